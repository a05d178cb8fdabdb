//! Cases with an exact answer, each of which isolates one property: sources, direct light, one bounce, conservation.

mod common;

use common::scenes::{add_quad, closed_box, lambert, point, spot_camera};
use common::{Case, Comparison, assert_all, compare, flux, number, table};
use lampyris::math::{DVec3, PI, cos};
use lampyris::photometry::Colour;
use lampyris::scene::{Light, Model};

/// The value of a row of analytic_cases.csv.
fn reference(case: &str, parameters: &str, quantity: &str) -> f64 {
    let rows = table("analytic_cases.csv");
    let is_it = |r: &&std::collections::HashMap<String, String>| {
        r["case"] == case && r["parameters"] == parameters && r["quantity"] == quantity
    };
    number(rows.iter().find(is_it).unwrap_or_else(|| panic!("{case} {parameters} {quantity}")), "value")
}

fn run(histories: u32, batches: u32) -> String {
    format!("[run]\nhistories_per_batch = {histories}\nbatches = {batches}\nseed = 21\n")
}

fn omni(position: [f64; 3], intensity: f64) -> String {
    format!("[[source]]\nkind = \"omni\"\nposition = {position:?}\nintensity = {intensity}\n")
}

#[track_caller]
fn assert_exact(name: &str, value: f64, reference: f64) {
    assert!((value - reference).abs() <= 2e-6 * reference.abs(), "{name}: {value} against {reference}");
}

/// Direct light of job and model at the points of the job, without any history.
fn direct(job: &str, model: Model) -> Vec<f64> {
    let case = Case::new(job, model);
    let realization = lampyris::farm::realization::Realization::new(&case.job, &case.scene, &case.bounds);
    realization.fixed_direct().iter().map(|set| set[0]).collect()
}

/// A one-sided quad far below everything, so that scenes without surfaces have one.
fn floor_far_below() -> Model {
    let mut model = Model::default();
    add_quad(&mut model, DVec3::new(-1.0, -50.0, -1.0), DVec3::Z, DVec3::X, lambert(0.0, 0.0));
    model
}

#[test]
fn point_source() {
    for x in [0.0, 1.0, 3.0] {
        let parameters = format!("I0=100;h=2;x={x};m=0");
        let job = run(1, 16)
            + &omni([0.0, 2.0, 0.0], 100.0)
            + &point("horizontal", [x, 0.0, 0.0], [0.0, 1.0, 0.0])
            + &point("vertical", [x, 0.0, 0.0], [-1.0, 0.0, 0.0]);
        let values = direct(&job, floor_far_below());
        let horizontal = reference("point_cos_power", &parameters, "E_horizontal_lx");
        let vertical = reference("point_cos_power", &parameters, "E_vertical_facing_lx");
        assert!((values[0] - horizontal).abs() < 1e-8 && (values[1] - vertical).abs() < 1e-8, "{values:?}");
    }
}

#[test]
fn flux_of_a_point_source_through_a_rectangle() {
    let mut model = Model::default();
    add_quad(&mut model, DVec3::new(-3.0, 0.0, -2.0), DVec3::Z * 4.0, DVec3::X * 6.0, lambert(0.0, 0.0));
    let grid = "[[grid]]\nname = \"floor\"\norigin = [-3, 0, 2]\nu = [6, 0, 0]\nv = [0, 0, -4]\n\
                normal = [0, 1, 0]\ncolumns = 300\nrows = 200\n";
    let case = Case::new(&(run(16384, 32) + &omni([0.0, 1.5, 0.0], 100.0) + grid), model);
    let (fixed, batches) = case.batches(0..u32::MAX);
    let exact = reference("isotropic_point_rect_flux", "I=100;h=1.5;rect 6x4 centred", "flux_lm");
    let by_cells = fixed[0].iter().sum::<f64>() * 24.0 / fixed[0].len() as f64;
    assert!((by_cells / exact - 1.0).abs() < 1e-5, "midpoint sum {by_cells}");
    assert_all(&[compare("flux absorbed", flux(&batches, "absorbed"), exact)]);
}

/// An emissive rectangle `u` x `v`, its front on the side of u x v, sensed at points.
fn luminaire(luminance: f64, origin: DVec3, u: DVec3, v: DVec3, points: &str) -> Vec<common::Estimate> {
    let mut model = Model::default();
    add_quad(&mut model, origin, u, v, lambert(0.0, luminance));
    Case::new(&(run(8192, 32) + points), model).estimates().iter().map(|set| set[0]).collect()
}

#[test]
fn parallel_rectangle() {
    let up = [0.0, 1.0, 0.0];
    let points = point("centre", [1.0, 0.0, 0.5], up)
        + &point("corner", [0.0, 0.0, 0.0], up)
        + &point("outside", [-1.0, 0.0, 0.0], up);
    let e = luminaire(1000.0, DVec3::Y * 2.0, DVec3::X * 2.0, DVec3::Z, &points);
    let name = ["rect_luminaire_centre", "rect_luminaire_corner", "rect_luminaire_outside"];
    let parameters = [
        "L=1000 cd/m2;2x1 m;h=2 centred above",
        "L=1000 cd/m2;2x1 m;h=2 above one corner",
        "L=1000;rect x 1..3,y 0..1;h=2;point at x=0,y=0",
    ];
    let mut all: Vec<Comparison> =
        (0..3).map(|i| compare(name[i], e[i], reference(name[i], parameters[i], "E_lx"))).collect();
    for (a, b, c) in [(1.0, 1.0, 1.0), (2.0, 1.0, 1.0), (3.0, 2.0, 0.5), (0.3, 0.3, 2.0)] {
        let corner = point("corner", [0.0, 0.0, 0.0], up);
        let e = luminaire(1.0, DVec3::Y * c, DVec3::X * a, DVec3::Z * b, &corner);
        let parameters = format!("a={a};b={b};c={c}");
        let factor = reference("rect_parallel_corner", &parameters, "config_factor");
        all.push(compare(parameters, e[0], PI * factor));
    }
    assert_all(&all);
}

#[test]
fn perpendicular_rectangle() {
    let mut all = Vec::new();
    for (a, b, c) in [(1.0, 1.0, 1.0), (2.0, 1.0, 1.0), (3.0, 2.0, 0.5), (0.3, 0.3, 2.0)] {
        // Receiver plane y = 0, rectangle in the plane z = -c, its front towards the receiver.
        let corner = point("corner", [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        let e = luminaire(1.0, DVec3::Z * -c, DVec3::X * a, DVec3::Y * b, &corner);
        let parameters = format!("width a={a};height b={b};distance c={c}");
        all.push(compare(&parameters, e[0], PI * reference("rect_perpendicular_corner", &parameters, "config_factor")));
    }
    let sill = point("sill", [0.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let e = luminaire(2000.0, DVec3::new(-1.0, 0.0, -2.0), DVec3::X * 2.0, DVec3::Y * 1.5, &sill);
    let parameters = "uniform window L=2000;width 2 centred;height 1.5 from sill level;distance 2";
    all.push(compare("sill", e[0], reference("window_sill", parameters, "E_horizontal_lx")));
    assert_all(&all);
}

#[test]
fn one_bounce_off_an_infinite_floor() {
    let mut job = run(32768, 32) + &omni([0.0, 1.0, 0.0], 100.0);
    job += "[[plane]]\npoint = [0, 0, 0]\nnormal = [0, 1, 0]\nreflectance = 0.5\n";
    for r in 0..3 {
        job += &point(&format!("r{r}"), [f64::from(r), 1.5, 0.0], [0.0, -1.0, 0.0]);
    }
    let e = Case::new(&job, Model::default()).estimates_of_orders(1..2);
    let parameters = |r| format!("I=100;source height 1;receiver plane at 1.5 facing down;rho=0.5;r={r}");
    let value = |r| reference("one_bounce_infinite_plane", &parameters(r), "E_bounce_lx");
    assert_all(&(0..3).map(|r| compare(format!("r = {r}"), e[r][0], value(r))).collect::<Vec<_>>());
}

#[test]
fn one_bounce_off_a_wall() {
    // The table has z up; here its (x, y, z) is (x, z, -y).
    let axes = |p: [f64; 3]| [p[0], p[2], -p[1]];
    let mut model = Model::default();
    add_quad(&mut model, DVec3::ZERO, DVec3::NEG_Z * 4.0, DVec3::Y * 3.0, lambert(0.6, 0.0));
    let points = [
        ("P=(1.0, 2.0, 0.0) floor", axes([1.0, 2.0, 0.0]), [0.0, 1.0, 0.0]),
        ("P=(0.5, 1.0, 0.0) floor", axes([0.5, 1.0, 0.0]), [0.0, 1.0, 0.0]),
        ("P=(3.0, 2.0, 1.5) opposite wall", axes([3.0, 2.0, 1.5]), [-1.0, 0.0, 0.0]),
    ];
    let mut job = run(65536, 32) + &omni(axes([2.0, 1.0, 1.5]), 100.0);
    for (i, (_, position, normal)) in points.iter().enumerate() {
        job += &point(&format!("p{i}"), *position, *normal);
    }
    let e = Case::new(&job, model).estimates_of_orders(1..2);
    let value =
        |p: &str| reference("one_bounce_wall", &format!("wall x=0 4x3 rho=0.6;I=100 at (2,1,1.5);{p}"), "E_bounce_lx");
    let all = points.iter().enumerate().map(|(i, (name, ..))| compare(name, e[i][0], value(name)));
    assert_all(&all.collect::<Vec<_>>());
}

/// Configuration factor of a perpendicular rectangle, item 4 of the reference solutions.
fn perpendicular(a: f64, b: f64, c: f64) -> f64 {
    let reach = (b * b + c * c).sqrt();
    (lampyris::math::atan2(a, c) - c / reach * lampyris::math::atan2(a, reach)) / (2.0 * PI)
}

#[test]
fn one_bounce_beside_a_wall_strip() {
    // Parallel light across a wall strip of height 1; the strip ends at +-3, which the reference accounts for:
    // with the ends at infinity it is the tabulated value.
    let half = 3.0;
    let mut model = Model::default();
    add_quad(&mut model, DVec3::new(0.0, 0.0, -half), DVec3::Y, DVec3::Z * 2.0 * half, lambert(0.5, 0.0));
    model.lights.push(Light::Directional { direction: DVec3::NEG_X, illuminance: Colour::grey(1000.0) });
    let mut job = run(1 << 17, 64);
    let distances = [0.1, 1.0];
    for (i, s) in distances.iter().enumerate() {
        job += &point(&format!("s{i}"), [*s, 0.0, 0.0], [0.0, 1.0, 0.0]);
    }
    let e = Case::new(&job, model).estimates_of_orders(1..2);
    let mut all = Vec::new();
    for (i, &s) in distances.iter().enumerate() {
        let parameters = format!("infinite wall strip height 1, E_wall=1000, rho=0.5; floor distance s={s}");
        let endless = reference("corner_strip_one_bounce", &parameters, "E_bounce_lx");
        assert_exact("endless strip", 2.0 * 500.0 * perpendicular(1e9, 1.0, s), endless);
        all.push(compare(parameters, e[i][0], 2.0 * 500.0 * perpendicular(half, 1.0, s)));
    }
    assert_all(&all);
}

#[test]
fn integrating_sphere() {
    for rho in [0.5, 0.9] {
        let mut job = run(512, 64) + &omni([0.0, 0.4, 0.0], 100.0);
        job += &format!("[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nfacing = \"inward\"\nreflectance = {rho}\n");
        let degrees = [0.0, 60.0, 120.0, 180.0];
        for (i, angle) in degrees.iter().enumerate() {
            let (sin, cos) = lampyris::math::sin_cos(angle * PI / 180.0);
            job += &point(&format!("e{i}"), [sin, cos, 0.0], [-sin, -cos, 0.0]);
            job += &spot_camera(&format!("l{i}"), [0.1, 0.0, 0.2], [sin, cos, 0.0], [0.0, 0.0, 1.0]);
        }
        let estimates = Case::new(&job, Model::default()).estimates();
        let value = |angle: f64, quantity: &str| {
            let parameters = format!("R=1;I=100;offset 0.4;rho={rho};angle from offset axis {angle} deg");
            reference("integrating_sphere_off_centre", &parameters, quantity)
        };
        let mut all = Vec::new();
        for (i, &angle) in degrees.iter().enumerate() {
            all.push(compare(format!("L {angle}"), estimates[i][0], value(angle, "L_wall_cd_m2")));
            all.push(compare(format!("E {angle}"), estimates[4 + i][0], value(angle, "E_total_lx")));
        }
        assert_all(&all);
    }
}

#[test]
fn white_furnace_order_by_order_and_in_luminance() {
    let rho = 0.5;
    let mut job = run(8192, 64);
    job += &point("e", [0.4, 0.0, 0.9], [0.0, 1.0, 0.0]);
    job += &spot_camera("l", [0.5, 1.0, 1.5], [1.0, 1.1, 1.2], [0.0, 1.0, 0.0]);
    let case = Case::new(&job, closed_box(DVec3::new(1.0, 2.0, 3.0), &lambert(rho, 1.0 / PI)));
    let total = case.estimates();
    let parameters = format!("any closed cavity; M0=1 lm/m2; rho={rho}");
    let luminance = reference("white_furnace", &parameters, "L_cd_m2");
    let exitance = reference("white_furnace", &parameters, "M_lm_m2");
    let mut all = vec![compare("L", total[0][0], luminance), compare("E", total[1][0], exitance)];
    // No order at all leaves the sampled direct light: E_0 = M0, and L0 + K L0 = (1 + rho) M0 / pi.
    let direct = case.estimates_of_orders(0..0);
    all.push(compare("L0 + K L0", direct[0][0], (1.0 + rho) / PI));
    all.push(compare("E_0", direct[1][0], 1.0));
    for order in 1..4u32 {
        let e = case.estimates_of_orders(order..order + 1)[1][0];
        let share = (0..order).fold(1.0, |x, _| x * rho);
        all.push(compare(format!("E_0 and order {order}"), e, 1.0 + share));
    }
    assert_all(&all);
}

/// Nodes and weights of the Gauss-Legendre rule with six points on the unit interval.
fn gauss() -> Vec<(f64, f64)> {
    let half = [
        (0.932_469_514_203_152, 0.171_324_492_379_170_4),
        (0.661_209_386_466_264_5, 0.360_761_573_048_138_6),
        (0.238_619_186_083_196_9, 0.467_913_934_572_691),
    ];
    half.iter().flat_map(|&(x, w)| [(0.5 - 0.5 * x, 0.5 * w), (0.5 + 0.5 * x, 0.5 * w)]).collect()
}

/// Lux-meters at the nodes of every wall (origin, u, v; all of area one, facing u x v), and the weight of each.
fn wall_meters(walls: &[(DVec3, DVec3, DVec3)]) -> (String, Vec<f64>) {
    let mut toml = String::new();
    let mut weights = Vec::new();
    for &(origin, u, v) in walls {
        for (a, wa) in gauss() {
            for (b, wb) in gauss() {
                let name = format!("p{}", weights.len());
                toml += &point(&name, (origin + a * u + b * v).to_array(), u.cross(v).to_array());
                weights.push(wa * wb / walls.len() as f64);
            }
        }
    }
    (toml, weights)
}

/// Mean indirect illuminance of a closed cavity of uniform reflectance: rho Phi / (S (1 - rho)), whatever its shape
/// and wherever the light. The direct part of the mean, Phi / S, is exact and not a matter of local estimation.
fn mean_indirect(name: &str, walls: &[(DVec3, DVec3, DVec3)], rho: f64, mean: f64) -> Comparison {
    let mut model = Model::default();
    walls.iter().for_each(|&(origin, u, v)| add_quad(&mut model, origin, u, v, lambert(rho, 0.0)));
    let (meters, weights) = wall_meters(walls);
    let job = run(512, 32) + &omni([0.4, 0.6, 0.5], 100.0) + &meters;
    let (_, batches) = Case::new(&job, model).batches(1..u32::MAX);
    let of_batch =
        |b: &lampyris::tally::BatchScores| b.sets.iter().zip(&weights).map(|(s, w)| w * s.value[0]).sum::<f64>();
    compare(name, common::Estimate::from_scores(batches.iter().map(of_batch)), mean * rho)
}

#[test]
fn mean_illuminance_of_closed_cavities() {
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let cube = [(DVec3::ZERO, z, x), (y, x, z), (DVec3::ZERO, x, y), (z, y, x), (DVec3::ZERO, y, z), (x, z, y)];
    let mut all = Vec::new();
    for rho in [0.3, 0.5, 0.8] {
        let parameters = format!("unit cube;I=100 anywhere inside;uniform rho={rho}");
        let mean = reference("cube_mean", &parameters, "mean_E_lx");
        all.push(mean_indirect(&parameters, &cube, rho, mean));
    }
    // An L of three unit cubes: floor and ceiling of three squares each, eight walls, one edge that juts in.
    let flat = |at: DVec3| [(at, z, x), (at + y, x, z)];
    let mut l: Vec<_> = [DVec3::ZERO, x, z].into_iter().flat_map(flat).collect();
    l.extend([(DVec3::ZERO, x, y), (x, x, y), (DVec3::ZERO, y, z), (z, y, z)]);
    l.extend([(2.0 * x, z, y), (x + z, y, x), (x + z, z, y), (2.0 * z, y, x)]);
    let surface = 14.0;
    all.push(mean_indirect("L", &l, 0.5, 400.0 * PI / (surface * 0.5)));
    assert_all(&all);
}

fn spot_in(model: &mut Model, inner: f64, outer: f64) {
    let (position, direction) = (DVec3::new(0.0, 0.0, 0.0), DVec3::NEG_Y);
    model.lights.push(Light::Spot { position, direction, intensity: Colour::grey(100.0), inner, outer });
}

#[test]
fn spot_against_closed_forms() {
    let (inner, outer) = (0.3, 0.8);
    // Direct light at distance 2 and three angles from the axis: full, half way in the cosine, none.
    let middle = lampyris::math::acos(0.5 * (cos(inner) + cos(outer)));
    let mut job = run(2048, 32);
    for (i, angle) in [0.1, middle, 0.9].iter().enumerate() {
        let (s, c) = lampyris::math::sin_cos(*angle);
        job += &point(&format!("p{i}"), [2.0 * s, -2.0 * c, 0.0], [-s, c, 0.0]);
    }
    let mut model = floor_far_below();
    spot_in(&mut model, inner, outer);
    let values = direct(&job, model);
    for (value, expected) in values.iter().zip([25.0, 25.0 / 4.0, 0.0]) {
        assert!((value - expected).abs() < 1e-9, "{values:?}");
    }
    // Flux: a spot in an integrating sphere gives the indirect illuminance rho Phi / (4 pi (1 - rho)) everywhere.
    // int of the falloff over cosine: full cone (1 - c1), ramp (c1 - c0)/3.
    let mut model = Model::default();
    spot_in(&mut model, inner, outer);
    let solid_angle = 2.0 * PI * ((1.0 - cos(inner)) + (cos(inner) - cos(outer)) / 3.0);
    let job = run(2048, 32)
        + "[[sphere]]\ncenter = [0, 0, 0]\nradius = 1\nfacing = \"inward\"\nreflectance = 0.5\n\
           [[source]]\nkind = \"omni\"\nposition = [0, 0, 0]\nintensity = 1\n"
        + &point("wall", [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]);
    let case = Case::new(&job, model);
    let (_, batches) = case.batches(1..u32::MAX);
    let phi = 100.0 * solid_angle + 4.0 * PI;
    let indirect = common::estimates(&batches)[0][0];
    assert_all(&[
        compare("spot and omni in a sphere", indirect, 0.5 * phi / (4.0 * PI * 0.5)),
        compare("emitted", flux(&batches, "emitted"), phi),
    ]);
}

#[test]
fn directional_against_closed_forms() {
    // Parallel light at 60 degrees on a square of side 1: E = E_perp / 2; one bounce to a point over its corner.
    let tilt = (0.75f64).sqrt();
    let mut model = Model::default();
    add_quad(&mut model, DVec3::ZERO, DVec3::Z, DVec3::X, lambert(0.5, 0.0));
    let direction = DVec3::new(tilt, -0.5, 0.0);
    model.lights.push(Light::Directional { direction, illuminance: Colour::grey(1000.0) });
    let job = run(65536, 32)
        + &point("floor", [0.5, 0.0, 0.5], [0.0, 1.0, 0.0])
        + &point("above", [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]);
    let case = Case::new(&job, model);
    let (fixed, batches) = case.batches(1..2);
    assert_exact("direct", fixed[0][0], 500.0);
    assert_exact("behind", fixed[1][0], 0.0);
    let factor = reference("rect_parallel_corner", "a=1;b=1;c=1", "config_factor");
    assert_all(&[
        compare("one bounce", common::estimates(&batches)[1][0], 0.5 * 500.0 * factor),
        compare("absorbed", flux(&batches, "absorbed"), 0.5 * 500.0),
    ]);
}

#[test]
fn flux_balances() {
    let job = run(2048, 64) + &omni([0.5, 0.6, 0.5], 10.0) + &point("p", [0.5, 0.0, 0.5], [0.0, 1.0, 0.0]);
    let mut open = closed_box(DVec3::new(1.0, 2.0, 1.0), &lambert(0.7, 5.0));
    open.triangles.truncate(10);
    open.surface_of.truncate(10);
    for (model, closed) in [(closed_box(DVec3::ONE, &lambert(0.7, 5.0)), true), (open, false)] {
        let (_, batches) = Case::new(&job, model).batches(1..2);
        let balance = batches.iter().map(|b| b.flux[1] + b.flux[2] + b.flux[3]);
        let balance = common::Estimate::from_scores(balance);
        assert_all(&[compare("absorbed + escaped + lost", balance, flux(&batches, "emitted").mean)]);
        assert_eq!(flux(&batches, "lost").mean, 0.0);
        assert_eq!(flux(&batches, "escaped").mean == 0.0, closed, "a closed box leaks or an open one does not");
    }
}
