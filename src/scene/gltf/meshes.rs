//! Meshes, baked into world coordinates once for each node that shows them.
//!
//! A vertex is transformed once per node and accessor: corners that coincide in the file coincide bit for bit.

use std::collections::HashMap;

use super::buffers::Buffers;
use super::document::{Document, Primitive};
use super::materials::Materials;
use super::nodes::{Placed, to_world};
use super::problem::{File, Warnings};
use crate::error::Result;
use crate::math::DVec3;
use crate::scene::Model;

/// Most vertices and most triangles of a scene: many nodes may show one mesh, so a small file may describe any number.
const MOST: usize = 1 << 26;

/// Collects the triangles of the scene.
pub struct Baker<'a> {
    file: File<'a>,
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    materials: Materials<'a>,
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    surface_of: Vec<u32>,
    /// Node of each triangle.
    node_of: Vec<u32>,
    /// Triangles without area, which were dropped.
    dropped: usize,
    /// How many nodes show each mesh; 0 once room is claimed for all of them.
    unclaimed: Vec<usize>,
    /// Vertices of the meshes met so far, counting every node that will show them.
    vertices_claimed: usize,
    /// Their triangles, with those to be dropped: they cost time too.
    triangles_claimed: usize,
}

/// How the vertices of a primitive make triangles.
#[derive(Clone, Copy)]
enum Mode {
    List,
    Strip,
    Fan,
}

impl<'a> Baker<'a> {
    /// Nothing yet of the meshes that `nodes` show.
    pub fn new(
        file: File<'a>,
        document: &'a Document,
        buffers: &'a Buffers<'a>,
        materials: Materials<'a>,
        nodes: &[Placed],
    ) -> Self {
        let mut unclaimed = vec![0; document.meshes.len()];
        for mesh in nodes.iter().filter_map(|placed| placed.node.mesh) {
            // A mesh that does not exist is refused when its node is reached.
            unclaimed.get_mut(mesh).into_iter().for_each(|count| *count += 1);
        }
        Baker {
            file,
            document,
            buffers,
            materials,
            positions: Vec::new(),
            triangles: Vec::new(),
            surface_of: Vec::new(),
            node_of: Vec::new(),
            dropped: 0,
            unclaimed,
            vertices_claimed: 0,
            triangles_claimed: 0,
        }
    }

    /// Adds mesh `index` as node `placed` shows it.
    pub fn add(&mut self, placed: &Placed, index: usize, warnings: &mut Warnings) -> Result<()> {
        let field = format_args!("nodes[{}].mesh", placed.index);
        let mesh = self.file.item(&self.document.meshes, "meshes", index, field)?;
        let label = mesh.name.as_ref().map_or_else(|| format!("meshes[{index}]"), |name| format!("mesh `{name}`"));
        // The first node to show a mesh claims room for all of them, so that too much is refused at once.
        let times = std::mem::take(&mut self.unclaimed[index]);
        let mut first_of = HashMap::new();
        for (p, primitive) in mesh.primitives.iter().enumerate() {
            let path = format!("meshes[{index}].primitives[{p}]");
            let Some(mode) = self.mode(primitive, &path, &label, warnings)? else { continue };
            note_ignored(primitive, &label, warnings);
            let surface = self.materials.surface(primitive.material, &format!("{path}.material"), &label, warnings)?;
            let vertices = self.vertices(primitive, &path, placed, times, &mut first_of)?;
            let corners = self.corners(primitive, &path, mode, vertices.1, times)?;
            self.push(corners, vertices.0, placed, surface);
        }
        Ok(())
    }

    /// Writes what was collected into `model`.
    pub fn finish(self, model: &mut Model, warnings: &mut Warnings) {
        if self.dropped > 0 {
            warnings.add(format!("{} triangles without area were dropped", self.dropped));
        }
        model.positions = self.positions;
        model.triangles = self.triangles;
        model.surface_of = self.surface_of;
        model.nodes.of_triangle = self.node_of;
        model.surfaces = self.materials.into_surfaces();
        model.drop_unused_vertices();
    }

    /// How `primitive` makes triangles; `None`, with a warning, for points and lines.
    fn mode(&self, primitive: &Primitive, path: &str, mesh: &str, warnings: &mut Warnings) -> Result<Option<Mode>> {
        match primitive.mode {
            0..=3 => {
                warnings.add(format!("{mesh}: points and lines are ignored: they have no surface"));
                Ok(None)
            }
            4 => Ok(Some(Mode::List)),
            5 => Ok(Some(Mode::Strip)),
            6 => Ok(Some(Mode::Fan)),
            other => Err(self.file.bad(format_args!("{path}.mode"), other, "0 .. 6")),
        }
    }

    /// Index of the first world vertex of `primitive`, and their number; `first_of` holds the accessors that this
    /// node has brought into the world already.
    fn vertices(
        &mut self,
        primitive: &Primitive,
        path: &str,
        placed: &Placed,
        times: usize,
        first_of: &mut HashMap<usize, (u32, usize)>,
    ) -> Result<(u32, usize)> {
        let field = format!("{path}.attributes.POSITION");
        let Some(&accessor) = primitive.attributes.get("POSITION") else {
            return Err(self.file.bad(field, "none", "an index into `accessors`"));
        };
        if let Some(&known) = first_of.get(&accessor) {
            return Ok(known);
        }
        let local = self.buffers.positions(accessor, &field)?;
        self.vertices_claimed = self.claim("vertices", self.vertices_claimed, local.len(), times, path)?;
        let first = self.positions.len() as u32;
        for (i, &position) in local.iter().enumerate() {
            let position = to_world(&placed.world, position).ok_or_else(|| {
                let field = format!("accessors[{accessor}], element {i}");
                self.file.bad(field, position, "a world position within 1e12 m of the origin")
            })?;
            self.positions.push(position);
        }
        first_of.insert(accessor, (first, local.len()));
        Ok((first, local.len()))
    }

    /// `now` and `more` vertices or triangles `times` over, refused beyond [`MOST`].
    fn claim(&self, what: &str, now: usize, more: usize, times: usize, path: &str) -> Result<usize> {
        match more.checked_mul(times).and_then(|all| all.checked_add(now)) {
            Some(total) if total <= MOST => Ok(total),
            _ => {
                let value = format!("{more} {what}, shown by {times} nodes, beside {now}");
                Err(self.file.bad(path, value, format!("at most {MOST} {what} in the scene")))
            }
        }
    }

    /// Corners of each triangle of `primitive`, numbered within its own `count` vertices.
    fn corners(
        &mut self,
        primitive: &Primitive,
        path: &str,
        mode: Mode,
        count: usize,
        times: usize,
    ) -> Result<Vec<[u32; 3]>> {
        let order = match primitive.indices {
            Some(accessor) => self.buffers.indices(accessor, &format!("{path}.indices"), count)?,
            None => (0..count as u32).collect(),
        };
        let triangles = order.len() / if matches!(mode, Mode::List) { 3 } else { 1 };
        self.triangles_claimed = self.claim("triangles", self.triangles_claimed, triangles, times, path)?;
        if order.len() < 3 || (matches!(mode, Mode::List) && order.len() % 3 != 0) {
            let allowed = if matches!(mode, Mode::List) { "a multiple of 3 vertices" } else { "3 vertices or more" };
            return Err(self.file.bad(path, order.len(), allowed));
        }
        Ok(match mode {
            Mode::List => order.chunks_exact(3).map(|v| [v[0], v[1], v[2]]).collect(),
            Mode::Fan => order[1..].windows(2).map(|v| [v[0], v[1], order[0]]).collect(),
            Mode::Strip => {
                let alternate =
                    |(i, v): (usize, &[u32])| if i % 2 == 0 { [v[0], v[1], v[2]] } else { [v[0], v[2], v[1]] };
                order.windows(3).enumerate().map(alternate).collect()
            }
        })
    }

    /// Adds triangles of `surface` at the node `placed`, their vertices counted from `first`. A mirrored node turns
    /// their order round, so that the front stays the front.
    fn push(&mut self, corners: Vec<[u32; 3]>, first: u32, placed: &Placed, surface: u32) {
        let mirrored = placed.world.determinant() < 0.0;
        for [a, b, c] in corners {
            let triangle = if mirrored { [a, c, b] } else { [a, b, c] }.map(|corner| first + corner);
            let [p, q, r] = triangle.map(|corner| self.positions[corner as usize]);
            if (q - p).cross(r - p).length() > 0.0 {
                self.triangles.push(triangle);
                self.surface_of.push(surface);
                self.node_of.push(placed.place);
            } else {
                self.dropped += 1;
            }
        }
    }
}

/// Lists what of `primitive` has no effect.
fn note_ignored(primitive: &Primitive, mesh: &str, warnings: &mut Warnings) {
    if !primitive.targets.is_empty() {
        warnings.add(format!("{mesh}: morph targets are ignored: the mesh keeps its basic shape"));
    }
    if primitive.attributes.keys().any(|name| name.starts_with("COLOR_")) {
        warnings.add(format!("{mesh}: vertex colours are ignored: the material alone gives the colour"));
    }
    if primitive.attributes.contains_key("NORMAL") {
        warnings.add("interpolated normals are not used: all cosines are those of the geometry");
    }
}
