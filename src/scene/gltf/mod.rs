//! glTF 2.0 in, [`Model`] out: the only place that knows glTF.
//!
//! Units are those of glTF and of everything here: metres, candela, lux, cd/m2. Triangles are baked into world
//! coordinates in `f64`; the front of a triangle stays its front under mirroring. What is not supported is refused
//! where it was required of us and listed in [`Model::warnings`], with its effect, where it was not.
//!
//! A scene file comes from anywhere. Every index, range, number and reference is proved before it is used, no memory
//! is taken before the data for it is known to be there, and the walk over nodes does not recurse: any input gives a
//! model or an [`Error::Input`](crate::error::Error::Input) that names the field, never a panic.
//!
//! The order of the work, a file each: container and JSON (`document`), `extensions`, `buffers`, `nodes`, and at each
//! node its mesh (`meshes`, `instances`, `materials`, `glass`, `images`, `decode`), camera (`cameras`) and lights (`lights`,
//! `ies`).

mod buffers;
mod cameras;
mod decode;
mod document;
mod extensions;
mod glass;
mod ies;
mod images;
mod instances;
mod lights;
mod materials;
mod meshes;
mod nodes;
mod problem;
mod uri;

use std::borrow::Cow;

use buffers::Buffers;
use document::Document;
use images::Images;
use materials::Materials;
use meshes::Baker;
use nodes::Placed;
use problem::{File, Warnings};

use super::Model;
use crate::error::Result;

/// JSON text and, for a GLB, its binary chunk.
type Container<'a> = (Cow<'a, [u8]>, Option<Cow<'a, [u8]>>);

/// Loads a scene file.
///
/// `bytes` is the content of the file called `name` (for errors); `fetch(path)` returns the bytes of a file beside it,
/// after `path` was proved to stay in its folder.
///
/// # Errors
/// [`crate::error::Error::Input`] for anything wrong in the file, naming the field as a path into its JSON; and
/// whatever `fetch` returns.
pub fn load(name: &str, bytes: &[u8], fetch: &mut dyn FnMut(&str) -> Result<Vec<u8>>) -> Result<Model> {
    let file = File(name);
    let mut warnings = Warnings::default();
    let (json, binary) = container(file, bytes)?;
    let document = document::parse(file, &json)?;
    extensions::check(file, &document, &mut warnings)?;
    if !document.animations.is_empty() {
        warnings.add("animations are ignored: nodes stand where they are without them");
    }
    let buffers = Buffers::load(file, &document, binary.as_deref(), &mut *fetch)?;
    let webs = ies::webs(file, &document, &buffers, &mut *fetch, &mut warnings)?;
    let images = Images::new(file, &document, &buffers, fetch);
    let materials = Materials::new(file, &document, images);
    let nodes = nodes::walk(file, &document)?;
    let mut baker = Baker::new(file, &document, &buffers, materials, &nodes);
    let mut model = Model::default();
    for placed in &nodes {
        place(file, &document, placed, &mut baker, &mut model, &mut warnings)?;
        if let Some(profile) = &placed.node.extensions.lights_ies {
            model.lights.push(ies::light(file, &webs, placed, profile)?);
        }
    }
    baker.finish(&mut model, &mut warnings);
    model.nodes.list = nodes.iter().map(Placed::entry).collect();
    model.warnings = warnings.into_list();
    Ok(model)
}

/// Adds what hangs at one node.
fn place(
    file: File,
    document: &Document,
    placed: &Placed,
    baker: &mut Baker,
    model: &mut Model,
    warnings: &mut Warnings,
) -> Result<()> {
    let node = placed.node;
    if let Some(mesh) = node.mesh {
        baker.add(placed, mesh, warnings)?;
    }
    if node.skin.is_some() {
        warnings.add(format!("{}: its skin is ignored: the mesh stands as modelled, at the node", placed.label()));
    }
    if let Some(index) = node.camera
        && let Some(camera) = cameras::camera(file, document, placed, index, warnings)?
    {
        if model.cameras.iter().any(|other| other.name == camera.name) {
            warnings.add(format!("two cameras are called `{}`: the first in the file is meant", camera.name));
        }
        model.cameras.push(camera);
    }
    if let Some(light) = &node.extensions.lights_punctual {
        model.lights.push(lights::light(file, document, placed, light.light, warnings)?);
    }
    Ok(())
}

/// Splits a GLB; a .gltf is its JSON.
fn container<'a>(file: File, bytes: &'a [u8]) -> Result<Container<'a>> {
    if !bytes.starts_with(b"glTF") {
        let json = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
        let first = json.iter().find(|byte| !byte.is_ascii_whitespace());
        let begins = match first {
            Some(b'{') => return Ok((Cow::Borrowed(json), None)),
            Some(_) => format!("begins with \"{}\"", bytes[..bytes.len().min(8)].escape_ascii()),
            None => "empty".to_owned(),
        };
        return Err(file.bad("content", begins, "a .glb, which begins with glTF, or a .gltf, which is JSON: {...}"));
    }
    if bytes.len() < 20 {
        return Err(file.bad("content", format!("{} bytes", bytes.len()), "20 or more (is the file cut off?)"));
    }
    // The crate subtracts the size of the header from this length without looking.
    let length = bytes.get(8..12).and_then(|field| field.try_into().ok()).map_or(0, u32::from_le_bytes);
    if length < 20 || length as usize > bytes.len() {
        let allowed = format!("20 .. {}, the bytes there are (is the file cut off?)", bytes.len());
        return Err(file.bad("GLB length", length, allowed));
    }
    let glb = gltf::Glb::from_slice(&bytes[..length as usize])
        .map_err(|error| file.bad("GLB", error, "a header of version 2, a JSON chunk, then at most a BIN chunk"))?;
    Ok((glb.json, glb.bin))
}
