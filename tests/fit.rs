//! `lampyris fit`: spheres and ellipsoids come back as they were, what is not star-shaped or not closed is refused with
//! the place, files are read back bit for bit, and no content of a file makes the reader panic.

#[allow(dead_code, reason = "each test binary uses its own part")]
#[path = "common/gltf_builder.rs"]
mod gltf_builder;

use gltf_builder::Builder;
use lampyris::fit::{Request, run};
use lampyris::geometry::harmonic::file::{File, Numbers};
use lampyris::geometry::harmonic::{MAX_DEGREE, Series, Star};
use lampyris::math::{DVec3, PI, sin_cos, tan};
use serde_json::json;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Vertices as a file of single precision holds them, and triangles.
type Shape = (Vec<[f32; 3]>, Vec<[u32; 3]>);

/// Triangles over a cube with `n` cells along each edge, each vertex where `place` puts the unit vector towards it.
fn cube_sphere(n: u32, place: impl Fn(DVec3) -> DVec3) -> Shape {
    let (mut positions, mut triangles, mut known) = (Vec::new(), Vec::new(), BTreeMap::new());
    let axis = |i: u32| {
        if i == 0 {
            -1.0
        } else if i == n {
            1.0
        } else {
            tan((f64::from(2 * i) / f64::from(n) - 1.0) * PI / 4.0)
        }
    };
    let mut vertex = |p: [u32; 3]| {
        *known.entry(p).or_insert_with(|| {
            positions.push(place(DVec3::from_array(p.map(axis)).normalize()).as_vec3().to_array());
            positions.len() as u32 - 1
        })
    };
    for (side, a) in [0, n].into_iter().flat_map(|side| (0..3).map(move |a| (side, a))) {
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let [p, q, r, s] = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(u, v)| {
                let mut at = [side; 3];
                (at[(a + 1) % 3], at[(a + 2) % 3]) = (i + u, j + v);
                vertex(at)
            });
            triangles.extend(if side == 0 { [[p, r, q], [p, s, r]] } else { [[p, q, r], [p, r, s]] });
        }
    }
    (positions, triangles)
}

fn ellipsoid(n: u32, axes: DVec3) -> Shape {
    cube_sphere(n, |d| d / (d / axes).length())
}

/// A box between `low` and `high`.
fn cuboid(low: DVec3, high: DVec3) -> Shape {
    cube_sphere(1, |d| DVec3::select(d.cmpgt(DVec3::ZERO), high, low))
}

/// A torus around z with the radii 1 and 0.3.
fn torus() -> Shape {
    let (n, m) = (24, 12);
    let position = |i: u32, j: u32| {
        let ((s, c), (sin, cos)) = (sin_cos(2.0 * PI * f64::from(i) / 24.0), sin_cos(2.0 * PI * f64::from(j) / 12.0));
        let around = 1.0 + 0.3 * cos;
        DVec3::new(around * c, around * s, 0.3 * sin).as_vec3().to_array()
    };
    let positions = (0..n).flat_map(|i| (0..m).map(move |j| position(i, j))).collect();
    let at = |i: u32, j: u32| i % n * m + j % m;
    let quad = |(i, j)| [[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]];
    (positions, (0..n).flat_map(|i| (0..m).map(move |j| (i, j))).flat_map(quad).collect())
}

/// The prism over a polygon in x and y, from z = 0 to 1.
fn prism(polygon: &[[f32; 2]], cover: &[[u32; 3]]) -> Shape {
    let n = polygon.len() as u32;
    let level = |z: f32| polygon.iter().map(move |p| [p[0], p[1], z]);
    let mut triangles: Vec<[u32; 3]> = cover.iter().map(|&[a, b, c]| [a, c, b]).collect();
    triangles.extend(cover.iter().map(|t| t.map(|v| v + n)));
    for i in 0..n {
        let j = (i + 1) % n;
        triangles.extend([[i, j, j + n], [i, j + n, i + n]]);
    }
    (level(0.0).chain(level(1.0)).collect(), triangles)
}

fn obj(shape: &Shape) -> String {
    let mut text = String::from("# made by a test\n");
    // With the digits of double precision, as which they are read.
    let vertices = shape.0.iter().map(|p| p.map(f64::from));
    vertices.for_each(|[x, y, z]| writeln!(text, "v {x} {y} {z}").unwrap());
    shape.1.iter().for_each(|t| writeln!(text, "f {} {} {}", t[0] + 1, t[1] + 1, t[2] + 1).unwrap());
    text
}

/// Files in a folder of their own.
struct Workshop(TempDir);

impl Workshop {
    fn new() -> Workshop {
        Workshop(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn put(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        std::fs::write(self.path(name), content).unwrap();
        self.path(name)
    }

    fn request(&self, mesh: PathBuf, degree: usize) -> Request {
        let output = mesh.with_extension("harmonic");
        Request { mesh, node: None, degree, numbers: Numbers::F64, lanczos: 0.0, output }
    }

    /// Fits `shape`, an OBJ file; the report and the file.
    fn fit(&self, shape: &Shape, degree: usize) -> (String, File) {
        let request = self.request(self.put("shape.obj", obj(shape)), degree);
        let report = run(&request).unwrap();
        (report, read(&request.output))
    }

    /// What is said of a file that is refused, beside which nothing is left.
    fn refused(&self, request: &Request) -> String {
        let error = run(request).unwrap_err();
        assert_eq!(error.exit_code(), 2, "{error}");
        assert!(!request.output.exists(), "{error}");
        error.to_string()
    }

    fn refused_obj(&self, text: &str) -> String {
        self.refused(&self.request(self.put("bad.obj", text), 4))
    }
}

fn read(path: &Path) -> File {
    File::parse("test", &std::fs::read(path).unwrap()).unwrap()
}

/// Root mean square and largest difference of r from `exact`, seen from the centre of the file.
fn errors(file: &File, exact: impl Fn(DVec3) -> f64) -> (f64, f64) {
    let directions = (0..5000).map(|i| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / 5000.0;
        let (sin, cos) = sin_cos(2.399_963 * f64::from(i));
        (1.0 - z * z).sqrt() * DVec3::new(cos, sin, 0.0) + z * DVec3::Z
    });
    let all: Vec<f64> = directions.map(|d| file.series.value(d) - exact(d)).collect();
    let square = all.iter().map(|e| e * e).sum::<f64>() / all.len() as f64;
    (square.sqrt(), all.iter().fold(0.0, |m: f64, e| m.max(e.abs())))
}

/// The number that follows `before` in the line of `report` that has `line` in it.
fn number(report: &str, line: &str, before: &str) -> f64 {
    let line = report.lines().find(|l| l.contains(line)).unwrap_or_else(|| panic!("{line}: {report}"));
    let after = line.split_once(before).unwrap_or_else(|| panic!("{before}: {line}")).1;
    let digits: String = after.chars().take_while(|c| c.is_ascii_digit() || ".e-".contains(*c)).collect();
    digits.parse().unwrap_or_else(|_| panic!("{line}: {digits}"))
}

#[test]
fn a_sphere_is_a_constant_about_its_centre() {
    let middle = DVec3::new(0.5, -2.0, 7.0);
    let (report, file) = Workshop::new().fit(&cube_sphere(40, |d| middle + 0.25 * d), 6);
    assert!((file.center - middle).length() < 1e-6, "{report}");
    // The flat faces of the mesh lie up to 0.25 h^2/2, h = 0.028 rad, below the sphere.
    let (rms, max) = errors(&file, |_| 0.25);
    assert!(rms < 1e-4 && max < 1e-4, "{rms} {max}");
    let norms = file.series.norms();
    assert!(norms[1..].iter().all(|c| *c < 3e-5), "{norms:?}");
    assert!(number(&report, "volume", "error ").abs() < 0.01 && number(&report, "normals", "rms ") < 2.0, "{report}");
}

#[test]
fn an_ellipsoid_comes_back_with_the_errors_that_its_degree_allows() {
    let axes = DVec3::new(1.0, 0.8, 1.25);
    let shape = ellipsoid(120, axes);
    // Beyond degree 8 the flat faces are the larger error: up to h^2/8 of the radius of curvature, h = 0.019 rad.
    for (degree, bound) in [(8, 5e-4), (16, 1e-4)] {
        let (report, file) = Workshop::new().fit(&shape, degree);
        assert!(file.center.length() < 1e-5, "{}", file.center);
        let (rms, max) = errors(&file, |d| 1.0 / (d / axes).length());
        assert!(max < bound && rms < 0.5 * bound, "degree {degree}: {rms} {max}");
        let said = number(&report, "radial error", "largest ");
        assert!(said < bound && said > 0.3 * max, "{said} {max}: {report}");
        // Both ways between the surfaces are no longer than the way along the radius.
        for line in ["from the mesh to the series", "from the series to the mesh"] {
            assert!(number(&report, line, "largest ") <= said * 1.01, "{report}");
        }
    }
}

#[test]
fn obj_and_glb_give_the_same_bits_in_the_coordinates_of_the_node() {
    let workshop = Workshop::new();
    let shape = ellipsoid(12, DVec3::new(0.3, 0.2, 0.25));
    let from_obj = workshop.fit(&shape, 5).1;
    let mut builder = Builder::new();
    let indices: Vec<u16> = shape.1.iter().flatten().map(|&v| v as u16).collect();
    let mesh = builder.mesh(&shape.0, Some(&indices));
    builder.node(json!({ "mesh": mesh, "name": "head" }));
    let plain = workshop.request(workshop.put("plain.glb", builder.glb()), 5);
    run(&plain).unwrap();
    assert_eq!(read(&plain.output), from_obj);
    // Elsewhere, scaled and mirrored the node is still the same object in its own coordinates, to rounding.
    let moved = json!({ "mesh": mesh, "name": "moved", "translation": [3, -4, 5], "scale": [-2, 3, 1.5], "rotation": [0, 0.6, 0, 0.8] });
    builder.node(moved);
    let path = workshop.put("two.gltf", builder.embedded());
    let said = workshop.refused(&workshop.request(path.clone(), 5));
    assert!(said.contains("--node = (missing): one node with a mesh of triangles: `head`, `moved`"), "{said}");
    let named = |node: &str| Request { node: Some(node.into()), ..workshop.request(path.clone(), 5) };
    let said = workshop.refused(&named("hand"));
    assert!(said.contains("--node = hand (0 of that name): one node with a mesh of triangles: `head`"), "{said}");
    let report = run(&named("moved")).unwrap();
    assert!(!report.contains("turned"), "{report}");
    let file = read(&path.with_extension("harmonic"));
    assert!((file.center - from_obj.center).length() < 1e-6);
    for (a, b) in file.series.pairs().iter().flatten().zip(from_obj.series.pairs().iter().flatten()) {
        assert!((a - b).abs() < 1e-6, "{a} {b}");
    }
}

#[test]
fn a_rod_is_fitted_from_its_middle_and_an_l_from_its_corner() {
    let workshop = Workshop::new();
    let (_, file) = workshop.fit(&cuboid(DVec3::ZERO, DVec3::new(1.0, 1.0, 4.0)), 3);
    assert!((file.center - DVec3::new(0.5, 0.5, 2.0)).length() < 1e-9, "{}", file.center);
    let l = prism(
        &[[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]],
        &[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]],
    );
    // An L has one square from which all of it is seen; at its middle all planes are half a side away.
    let (report, file) = workshop.fit(&l, 12);
    assert!(file.center.x < 0.55 + 1e-9 && file.center.y < 0.55 + 1e-9, "{}", file.center);
    assert!((number(&report, "centre", "any point: ") - 0.5).abs() < 1e-9, "{report}");
}

#[test]
fn what_is_not_star_shaped_is_refused_with_the_place() {
    let workshop = Workshop::new();
    let said = workshop.refused_obj(&obj(&torus()));
    assert!(said.contains("star shape = ") && said.contains("faces turn away from even the best centre"), "{said}");
    // The tube is seen from the hole or from one side of the ring: some face is 0.3 m on the wrong side or more.
    assert!(number(&said, "star shape", "lies ") > 0.29 && number(&said, "star shape", "plane, ") > 90.0, "{said}");
    let u = prism(
        &[[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [2.0, 3.0], [2.0, 1.0], [1.0, 1.0], [1.0, 3.0], [0.0, 3.0]],
        &[[0, 5, 6], [0, 6, 7], [0, 1, 5], [1, 4, 5], [1, 2, 4], [2, 3, 4]],
    );
    // Its inner walls are 1 m apart, and each wants the centre beyond itself: half a metre is the least wrong.
    let said = workshop.refused_obj(&obj(&u));
    assert!((number(&said, "star shape", "lies ") - 0.5).abs() < 1e-6, "{said}");
}

#[test]
fn what_is_not_one_closed_surface_is_refused_with_an_edge() {
    let workshop = Workshop::new();
    let cube = cuboid(DVec3::ZERO, DVec3::ONE);
    let open = (cube.0.clone(), cube.1[1..].to_vec());
    let said = workshop.refused_obj(&obj(&open));
    assert!(said.contains("edge from (") && said.contains("of 1 triangle: a closed mesh"), "{said}");
    let mut torn = cube.clone();
    torn.1[3].swap(0, 1);
    assert!(workshop.refused_obj(&obj(&torn)).contains("one of them turned inside out"));
    let inner = cuboid(DVec3::splat(0.25), DVec3::splat(0.75));
    let mut layers = cube.clone();
    layers.0.extend(inner.0);
    layers.1.extend(inner.1.iter().map(|t| t.map(|v| v + 8)));
    assert!(workshop.refused_obj(&obj(&layers)).contains("layers of the mesh = 2.000"));
    for empty in ["", "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "v 0 0 0\nf 1 1 1\n"] {
        assert!(workshop.refused_obj(empty).contains("diagonal of the mesh"));
    }
}

#[test]
fn separate_vertices_are_joined_and_a_mesh_inside_out_is_turned() {
    let cube = cuboid(-DVec3::ONE, DVec3::ONE);
    let corners: Vec<[f32; 3]> = cube.1.iter().flatten().map(|&v| cube.0[v as usize]).collect();
    let separate = (0..cube.1.len() as u32).map(|i| [3 * i, 3 * i + 2, 3 * i + 1]).collect();
    let workshop = Workshop::new();
    let (report, file) = workshop.fit(&(corners, separate), 8);
    assert!(report.contains("8 vertices, 12 triangles, closed; its inside was in front"), "{report}");
    // In a different order of the vertices the same sums round differently.
    let (_, same) = workshop.fit(&cube, 8);
    let pairs = file.series.pairs().into_iter().zip(same.series.pairs());
    assert!(pairs.into_iter().all(|(a, b)| (a[0] - b[0]).abs() < 1e-12 && (a[1] - b[1]).abs() < 1e-12));
}

#[test]
fn degree_0_is_the_mean_radius_and_powers_of_lanczos_damp() {
    let workshop = Workshop::new();
    let cube = cuboid(-DVec3::ONE, DVec3::ONE);
    let (report, file) = workshop.fit(&cube, 0);
    // Of a cube of half edge 1: 6/(4 pi) int over -1 .. 1 of dx dy/(1 + x^2 + y^2).
    let mean = 1.221_374_8;
    assert!((file.series.value(DVec3::X) - mean).abs() < 5e-4, "{report}");
    let sharp = workshop.fit(&cube, 16).1.series.norms();
    let request = Request { lanczos: 1.0, ..workshop.request(workshop.path("shape.obj"), 16) };
    run(&request).unwrap();
    let soft = read(&request.output).series.norms();
    let x = PI * 8.0 / 17.0;
    assert!((soft[8] / sharp[8] - sin_cos(x).0 / x).abs() < 1e-12 && soft[0] == sharp[0]);
}

#[test]
fn files_are_read_back_bit_for_bit_and_counted() {
    let workshop = Workshop::new();
    let path = workshop.put("egg.obj", obj(&ellipsoid(12, DVec3::new(0.11, 0.13, 0.17))));
    for (numbers, size) in [(Numbers::F32, 4), (Numbers::F64, 8)] {
        let request = Request { numbers, ..workshop.request(path.clone(), 9) };
        let report = run(&request).unwrap();
        let bytes = std::fs::read(&request.output).unwrap();
        let file = File::parse("egg", &bytes).unwrap();
        assert_eq!(file.bytes(numbers), bytes);
        assert_eq!(number(&report, "the file", ": ") as usize, bytes.len());
        assert!(bytes.len() > 100 * size && bytes.len() < 100 * size + 200);
        assert!(Star::new(file.series).is_ok());
        // 866 vertices, 1728 triangles.
        assert_eq!(number(&report, "u32 indices", ": "), 12.0 * (866.0 + 1728.0), "{report}");
        let picture = std::fs::read(path.with_extension("png")).unwrap();
        assert!(picture.starts_with(b"\x89PNG") && report.contains("egg.png"));
    }
}

#[test]
fn what_was_typed_wrong_is_named() {
    let workshop = Workshop::new();
    let good = workshop.request(workshop.put("a.obj", obj(&cuboid(-DVec3::ONE, DVec3::ONE))), 2);
    let cases = [
        (Request { degree: MAX_DEGREE + 1, ..good.clone() }, "--degree = 129: 0 .. 128"),
        (Request { lanczos: f64::NAN, ..good.clone() }, "--lanczos = NaN: 0 .. 16"),
        (Request { output: workshop.path("a.png"), ..good.clone() }, "a file name that ends in .harmonic"),
        (Request { mesh: workshop.path("a.stl"), ..good.clone() }, "a .glb, .gltf or .obj file"),
        (Request { mesh: workshop.path("b.obj"), ..good.clone() }, "a .glb, .gltf or .obj file (No such file"),
        (Request { node: Some("x".into()), ..good.clone() }, "--node = x: only with .glb and .gltf"),
    ];
    for (request, fragment) in cases {
        let said = workshop.refused(&request);
        assert!(said.contains(fragment), "{fragment}: {said}");
    }
}

/// A small valid file.
fn small(numbers: Numbers) -> Vec<u8> {
    let pairs = [[1.0, 0.0], [0.1, 0.0], [-0.05, 0.02]];
    File { center: DVec3::new(0.5, -1e-3, 2.0), series: Series::new(&pairs).unwrap() }.bytes(numbers)
}

#[test]
fn damaged_files_are_refused_or_read_and_never_a_panic() {
    for numbers in Numbers::ALL {
        let good = small(numbers);
        assert!(File::parse("x", &good).is_ok());
        for end in 0..good.len() {
            assert!(File::parse("x", &good[..end]).is_err(), "cut at {end}");
        }
        for extra in [1, 4, 8, 1000] {
            let longer: Vec<u8> = good.iter().copied().chain(std::iter::repeat_n(0, extra)).collect();
            assert!(File::parse("x", &longer).is_err(), "{extra} bytes more");
        }
        for (at, mask) in (0..good.len()).flat_map(|at| [0x01, 0x10, 0x80, 0xff].map(|mask| (at, mask))) {
            let mut bytes = good.clone();
            bytes[at] ^= mask;
            // A flipped bit of a number is another number: what is read must at least be writable again as it was.
            if let Ok(file) = File::parse("x", &bytes) {
                let again = File::parse("x", &file.bytes(numbers)).unwrap();
                assert_eq!(again, file, "{at} {mask:x}");
                let _ = Star::new(file.series);
            }
        }
    }
}

#[test]
fn absurd_headers_are_refused_before_anything_is_allocated() {
    let text = |center: &str, degree: &str, numbers: &str| {
        format!("lampyris harmonic 1\nconvention schmidt-real\ncenter {center}\ndegree {degree}\nnumbers {numbers}\n\n")
    };
    let cases = [
        (text("0 0 0", "18446744073709551615", "f64"), "degree = 18446744073709551615: 0 ..= 128"),
        (text("0 0 0", "4294967295", "f32"), "degree"),
        (text("0 0 0", "129", "f32"), "degree = 129"),
        (text("0 0 0", "-1", "f32"), "degree = -1"),
        (text("0 0 0", "128", "f64"), "bytes of coefficients = 0: 133128 of degree 128"),
        (text("0 0", "0", "f32"), "center"),
        (text("0 0 0 0", "0", "f32"), "center"),
        (text("nan 0 0", "0", "f32"), "center"),
        (text("0 inf 0", "0", "f32"), "center"),
        (text("0 0 0", "0", "f16"), "numbers = f16"),
        ("\n\n".to_owned(), "version"),
        (String::new(), "header"),
        ("x".repeat(100_000), "header"),
    ];
    for (text, fragment) in cases {
        let said = File::parse("x.harmonic", text.as_bytes()).unwrap_err().to_string();
        assert!(said.contains(fragment), "{fragment}: {said}");
    }
    let mut bytes = text("0 0 0", "0", "f64").into_bytes();
    bytes.extend(f64::NAN.to_le_bytes());
    assert!(File::parse("x", &bytes).is_err());
}
