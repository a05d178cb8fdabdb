//! EXT_lights_ies: photometric webs at nodes.
//!
//! The direction of the two angles 0 is the node's -Z, C0 its +X and C90 its +Y. The extension defines punctual lights: they are
//! points, whatever luminous opening the file has.

use super::buffers::Buffers;
use super::document::{Document, NodeProfile, Profile};
use super::nodes::Placed;
use super::problem::{File, Warnings};
use super::uri;
use crate::error::Result;
use crate::math::{DMat3, DVec3};
use crate::photometry::Colour;
use crate::scene::Light;
use crate::scene::photometric_web::{Luminaire, Photometry, Placement};

/// Largest memory of all webs of a scene \[bytes\].
const MOST_BYTES: u64 = 1 << 30;
const NAME: &str = "extensions.EXT_lights_ies.lights";

/// The webs of the file, in its order.
pub fn webs(
    file: File,
    document: &Document,
    buffers: &Buffers,
    fetch: &mut dyn FnMut(&str) -> Result<Vec<u8>>,
    warnings: &mut Warnings,
) -> Result<Vec<Photometry>> {
    let profiles = document.extensions.lights_ies.as_ref().map_or(&[][..], |extension| &extension.lights);
    let (mut webs, mut bytes_of_webs) = (Vec::new(), 0);
    for (i, profile) in profiles.iter().enumerate() {
        let label = label(profile, i);
        let web = Photometry::parse(&format!("{}: {label}", file.0), &bytes(file, buffers, profile, i, fetch)?)?;
        web.warnings.iter().for_each(|warning| warnings.add(format!("luminaire {label}: {warning}")));
        // Many profiles may lie on the same bytes: what a file makes of them is bounded, too.
        bytes_of_webs += web.bytes();
        if bytes_of_webs > MOST_BYTES {
            return Err(file.bad(NAME, format_args!("{bytes_of_webs} bytes of webs"), format!("at most {MOST_BYTES}")));
        }
        webs.push(web);
    }
    Ok(webs)
}

/// What to call a web of the file.
fn label(profile: &Profile, i: usize) -> String {
    let is_data = |uri: &str| uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:"));
    match &profile.uri {
        Some(uri) if !is_data(uri) => uri.clone(),
        _ => format!("{NAME}[{i}]"),
    }
}

fn bytes(
    file: File,
    buffers: &Buffers,
    profile: &Profile,
    i: usize,
    fetch: &mut dyn FnMut(&str) -> Result<Vec<u8>>,
) -> Result<Vec<u8>> {
    let path = format!("{NAME}[{i}]");
    match (&profile.uri, profile.buffer_view) {
        (Some(uri), None) => uri::resolve(file, &format!("{path}.uri"), uri, fetch),
        (None, Some(view)) => Ok(buffers.view(view, &format!("{path}.bufferView"))?.to_vec()),
        _ => Err(file.bad(path, "no source or two", "either `uri` or `bufferView`")),
    }
}

/// The luminaire that `profile` hangs at node `placed`.
pub fn light(file: File, webs: &[Photometry], placed: &Placed, profile: &NodeProfile) -> Result<Light> {
    let path = format!("nodes[{}].extensions.EXT_lights_ies", placed.index);
    let web = file.item(webs, NAME, profile.light, format_args!("{path}.light"))?;
    let multiplier = file.between(format_args!("{path}.multiplier"), profile.multiplier, 0.0, 1e12)?;
    let colour = file.all_between(format_args!("{path}.color"), profile.color, 0.0, 1.0)?;
    let frame = DMat3::from_mat4(placed.world);
    let placement = Placement::new(placed.position(), frame, DVec3::NEG_Z, DVec3::X);
    let placement = placement.ok_or_else(|| placed.flattened(file))?;
    Ok(Light::Luminaire(Luminaire::new(web, &placement, Colour(colour) * multiplier)))
}
