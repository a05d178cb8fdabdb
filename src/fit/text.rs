//! What `lampyris fit` says: the fit, its errors, and how many bytes it takes beside the mesh.

use super::errors::{Deviation, Errors};
use super::solid::place;
use super::{Fitted, Request};
use crate::report::short;

/// The report on `fitted`; its picture shows radial errors up to `seen` \[m\].
pub fn report(request: &Request, fitted: &Fitted, errors: &Errors, seen: f64) -> String {
    let mut lines = vec![head(request)];
    lines.extend(about_the_mesh(fitted));
    lines.extend(about_errors(errors));
    lines.extend(about_bytes(fitted));
    let (file, picture) = (&request.output, request.output.with_extension("png"));
    lines.push(format!("written: {} and {}", file.display(), picture.display()));
    lines.push(format!("  largest radial error seen in the picture: {} m", short(seen, 3)));
    lines.join("\n") + "\n"
}

fn head(request: &Request) -> String {
    let node = request.node.as_ref().map_or(String::new(), |node| format!(", node `{node}`"));
    let n = request.degree;
    let lanczos = if request.lanczos > 0.0 { format!(", Lanczos power {}", request.lanczos) } else { String::new() };
    let kind = request.numbers.name();
    format!("{}{node}: degree {n}, {} coefficients in {kind}{lanczos}", request.mesh.display(), (n + 1) * (n + 1))
}

fn about_the_mesh(fitted: &Fitted) -> Vec<String> {
    let Fitted { solid, centre, star, .. } = fitted;
    let turned = if solid.turned { "; its inside was in front and has been turned" } else { "" };
    let radii = star.radii();
    vec![
        format!("  mesh: {} vertices, {} triangles, closed{turned}", solid.positions.len(), solid.triangles),
        format!(
            "  centre {} m: at least {} m behind the planes of all faces (the most for any point: {} m)",
            place(centre.position),
            short(centre.margin, 4),
            short(centre.best, 4)
        ),
        format!("  radii of the series within {} .. {} m", short(radii.0, 4), short(radii.1, 4)),
    ]
}

fn about_errors(errors: &Errors) -> Vec<String> {
    let mean = errors.mean_radius;
    let relative = |d: &Deviation| {
        let shares = format!(
            "{} and {} of the mean radius {} m",
            short(d.rms / mean, 3),
            short(d.max / mean, 3),
            short(mean, 4)
        );
        format!("rms {} m, largest {} m ({shares})", short(d.rms, 3), short(d.max, 3))
    };
    let plain = |d: &Deviation| format!("rms {} m, largest {} m", short(d.rms, 3), short(d.max, 3));
    let [mesh, series] = errors.volumes;
    vec![
        format!(
            "  radial error, {} directions and, for the largest, {} vertices: {}",
            errors.directions,
            errors.vertices,
            relative(&errors.radial)
        ),
        format!(
            "  from the mesh to the series, the same points: {} (nearest point by projections on tangent planes)",
            plain(&errors.from_mesh)
        ),
        format!("  from the series to the mesh: {} (nearest triangle)", plain(&errors.from_series)),
        format!(
            "  angle between the normals, against flat faces: rms {} deg, largest {} deg",
            short(errors.angle.rms, 3),
            short(errors.angle.max, 3)
        ),
        format!(
            "  volume {} m3 of {} m3: error {} %",
            short(series, 6),
            short(mesh, 6),
            short(100.0 * (series / mesh - 1.0), 3)
        ),
    ]
}

fn about_bytes(fitted: &Fitted) -> Vec<String> {
    let (vertices, triangles) = (fitted.solid.positions.len(), fitted.solid.triangles);
    let own = fitted.bytes.len();
    let formats = [
        ("f32 positions and u32 indices", 12 * (vertices + triangles)),
        ("f32 positions and normals, u32 indices", 12 * (2 * vertices + triangles)),
        ("binary STL", 84 + 50 * triangles),
    ];
    let row = |(what, bytes): (&str, usize)| {
        format!("    the mesh as {what}: {bytes} bytes, {} times as many", short(bytes as f64 / own as f64, 3))
    };
    let mut lines = vec![format!("  the file: {own} bytes")];
    lines.extend(formats.map(row));
    let finest = short(180.0 / fitted.star.series().degree().max(1) as f64, 3);
    lines
        .push(format!("    bytes beside bytes: a mesh may hold details finer than {finest} deg, this series does not"));
    lines
}
