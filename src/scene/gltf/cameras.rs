//! Camera nodes: where a picture may be taken from.

use super::document::{Camera, CameraKind, Document};
use super::nodes::Placed;
use super::problem::{File, Warnings};
use crate::error::Result;
use crate::math::{DVec3, PI};
use crate::scene::CameraNode;

/// The camera at node `placed`; an orthographic one is left out with a warning.
pub fn camera(
    file: File,
    document: &Document,
    placed: &Placed,
    index: usize,
    warnings: &mut Warnings,
) -> Result<Option<CameraNode>> {
    let field = format_args!("nodes[{}].camera", placed.index);
    let camera = file.item(&document.cameras, "cameras", index, field)?;
    let name = name(placed, camera);
    if camera.kind == CameraKind::Orthographic {
        warnings.add(format!("camera `{name}` is orthographic and cannot be used: only perspective cameras are"));
        return Ok(None);
    }
    let (yfov, aspect) = perspective(file, camera, index)?;
    let (right, up) = axes(file, placed)?;
    Ok(Some(CameraNode { name, eye: placed.position(), right, up, yfov, aspect }))
}

/// Name of the node, else of the camera, else its number.
fn name(placed: &Placed, camera: &Camera) -> String {
    let given = placed.node.name.as_ref().or(camera.name.as_ref());
    given.cloned().unwrap_or_else(|| format!("camera{}", placed.index))
}

/// Vertical field of view \[rad\] and, where given, width over height.
fn perspective(file: File, camera: &Camera, index: usize) -> Result<(f64, Option<f64>)> {
    let path = format!("cameras[{index}].perspective");
    let allowed = "above 0 and below pi radians";
    let Some(perspective) = &camera.perspective else { return Err(file.bad(path, "none", "a perspective")) };
    let Some(yfov) = perspective.yfov else { return Err(file.bad(format!("{path}.yfov"), "none", allowed)) };
    if !(yfov > 0.0 && yfov < PI) {
        return Err(file.bad(format!("{path}.yfov"), yfov, allowed));
    }
    match perspective.aspect_ratio {
        Some(aspect) if !(aspect > 0.0 && aspect.is_finite()) => {
            Err(file.bad(format!("{path}.aspectRatio"), aspect, "above 0"))
        }
        aspect => Ok((yfov, aspect)),
    }
}

/// Unit vectors to the right and up in the picture. Scale, shear and mirroring of the node are ignored: the viewing
/// direction -Z is kept, up is made perpendicular to it, and right follows from both.
fn axes(file: File, placed: &Placed) -> Result<(DVec3, DVec3)> {
    let forward = placed.direction(file, DVec3::NEG_Z)?;
    let up = placed.direction(file, DVec3::Y)?;
    let right = forward.cross(up).try_normalize().ok_or_else(|| placed.flattened(file))?;
    Ok((right, right.cross(forward).normalize()))
}
