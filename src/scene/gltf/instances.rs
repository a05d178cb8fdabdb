//! EXT_mesh_gpu_instancing: the mesh of a node at many places.

use super::buffers::Buffers;
use super::document::{Document, Instancing};
use super::nodes::Placed;
use super::problem::{File, Warnings};
use crate::error::Result;
use crate::math::{DMat4, DQuat, DVec3};

/// How many times `instancing` shows its mesh, as far as is known before anything is read.
pub fn count(document: &Document, instancing: Option<&Instancing>) -> usize {
    let Some(instancing) = instancing else { return 1 };
    let counts = instancing.attributes.values().filter_map(|&index| document.accessors.get(index));
    counts.map(|accessor| usize::try_from(accessor.count).unwrap_or(usize::MAX)).max().unwrap_or(1)
}

/// The places at which node `placed` shows its mesh: itself, or each of its instances.
pub fn places<'a>(
    file: File,
    buffers: &Buffers,
    placed: &Placed<'a>,
    warnings: &mut Warnings,
) -> Result<Vec<Placed<'a>>> {
    let Some(instancing) = &placed.node.extensions.instancing else { return Ok(vec![placed.at(placed.world)]) };
    let path = format!("nodes[{}].extensions.EXT_mesh_gpu_instancing.attributes", placed.index);
    let attribute = |name: &str| instancing.attributes.get(name).map(|&index| (index, format!("{path}.{name}")));
    let vectors = |name: &str| -> Result<Option<Vec<[f64; 3]>>> {
        attribute(name).map(|(index, field)| buffers.rows::<3>(index, &field, &["VEC3"])).transpose()
    };
    let (translations, scales) = (vectors("TRANSLATION")?, vectors("SCALE")?);
    let rotations =
        attribute("ROTATION").map(|(index, field)| buffers.rows::<4>(index, &field, &["VEC4"])).transpose()?;
    let lengths =
        [translations.as_ref().map(Vec::len), scales.as_ref().map(Vec::len), rotations.as_ref().map(Vec::len)];
    let mut lengths = lengths.into_iter().flatten();
    let Some(count) = lengths.next() else {
        return Err(file.bad(path, "none", "TRANSLATION, ROTATION or SCALE"));
    };
    if let Some(other) = lengths.find(|&other| other != count) {
        return Err(file.bad(path, format_args!("{count} and {other} instances"), "as many of each attribute"));
    }
    if let Some(name) =
        instancing.attributes.keys().find(|name| !["TRANSLATION", "ROTATION", "SCALE"].contains(&&name[..]))
    {
        warnings.add(format!("{}: {name} of its instances is ignored", placed.label()));
    }
    let place = |i: usize| {
        let translation = translations.as_ref().map_or(DVec3::ZERO, |t| t[i].into());
        let scale = scales.as_ref().map_or(DVec3::ONE, |s| s[i].into());
        // Rotations in bytes are unit quaternions only nearly.
        let rotation = rotations.as_ref().map_or(DQuat::IDENTITY, |r| DQuat::from_array(r[i]));
        if rotation.length() < 0.5 {
            let allowed = "quaternions of length 1";
            return Err(file.bad(format_args!("{path}.ROTATION, element {i}"), rotation, allowed));
        }
        let own = DMat4::from_scale_rotation_translation(scale, rotation.normalize(), translation);
        Ok(placed.at(placed.world * own))
    };
    (0..count).map(place).collect()
}
