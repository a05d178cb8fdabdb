//! Files in, triangles out: the mesh of one node in that node's own coordinates, or all of an OBJ file.
//!
//! The object will stand in place of the mesh of its node and be moved by the node's transform, so it is fitted before
//! that transform.

use super::obj;
use crate::error::{Error, Result};
use crate::farm::inputs::read_beside;
use crate::math::DVec3;
use crate::scene::{Model, gltf};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Most vertices and most triangles.
pub const MOST: usize = 1 << 26;

/// Triangles as a file has them.
#[derive(Debug, Default)]
pub struct Soup {
    /// Vertices \[m\].
    pub positions: Vec<DVec3>,
    /// Corners of each triangle, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// The mesh in the file at `path`, that of `node` where one is named.
///
/// # Errors
/// [`Error::Input`] for whatever is wrong in the file, and where it is not plain which mesh is meant.
pub fn read(path: &Path, node: Option<&str>) -> Result<Soup> {
    let name = path.display().to_string();
    let kind = path.extension().map(|e| e.to_string_lossy().to_ascii_lowercase()).unwrap_or_default();
    let is_obj = kind == "obj";
    if !is_obj && kind != "glb" && kind != "gltf" {
        return Err(Error::input("command line", "MESH", name, "a .glb, .gltf or .obj file"));
    }
    let bytes = fs::read(path)
        .map_err(|e| Error::input("command line", "MESH", &name, format!("a .glb, .gltf or .obj file ({e})")))?;
    if !is_obj {
        let model = gltf::load(&name, &bytes, &mut |uri| read_beside(path, uri))?;
        return of_node(&name, &model, node);
    }
    match node {
        Some(node) => Err(Error::input("command line", "--node", node, "only with .glb and .gltf: OBJ has no nodes")),
        None => obj::parse(&name, &bytes),
    }
}

/// The triangles that hang at one node of `model`, in its coordinates.
fn of_node(name: &str, model: &Model, node: Option<&str>) -> Result<Soup> {
    let place = chosen(name, model, node)?;
    let world = model.nodes.list[place as usize].world;
    let to_own = world.inverse();
    if !to_own.is_finite() {
        let allowed = "a node whose transform flattens nothing";
        return Err(Error::input(name, label(model, place), "a transform without inverse", allowed));
    }
    let positions = model.positions.iter().map(|&p| to_own.transform_point3(p)).collect();
    let own = model.triangles.iter().zip(&model.nodes.of_triangle).filter(|(_, of)| **of == place);
    // The loader turns the triangles of a mirrored node round.
    let mirrored = world.determinant() < 0.0;
    let triangles = own.map(|(&[a, b, c], _)| if mirrored { [a, c, b] } else { [a, b, c] }).collect();
    Ok(Soup { positions, triangles })
}

/// The place of the node with triangles that is called `node`, or of the only one.
fn chosen(name: &str, model: &Model, node: Option<&str>) -> Result<u32> {
    let all: BTreeSet<u32> = model.nodes.of_triangle.iter().copied().collect();
    let called = |place: &u32| node.is_none() || model.nodes.list[*place as usize].name.as_deref() == node;
    let found: Vec<u32> = all.iter().copied().filter(called).collect();
    if let [only] = found[..] {
        return Ok(only);
    }
    let names = all.iter().map(|&place| label(model, place)).collect::<Vec<_>>().join(", ");
    let names = if names.is_empty() { "none has".to_owned() } else { names };
    let allowed = format!("one node with a mesh of triangles: {names}");
    match node {
        Some(node) => Err(Error::input(name, "--node", format!("{node} ({} of that name)", found.len()), allowed)),
        None => Err(Error::input(name, "--node", "(missing)", allowed)),
    }
}

fn label(model: &Model, place: u32) -> String {
    let node = &model.nodes.list[place as usize];
    node.name.as_ref().map_or_else(|| format!("nodes[{}]", node.index), |name| format!("`{name}`"))
}
