//! The three estimators against each other and against exact values: they share geometry and reflectances, and nothing
//! of how the light is found.

mod common;

use common::scenes::{
    add_quad, box_walls, closed_box, cube_with_floor, cube_with_mirrors, integrating_sphere, lambert, mirror, omni,
    point, sobolev, spot_camera,
};
use common::{Case, Comparison, Estimate, assert_all, compare, difference, estimates, flux, number, table};
use lampyris::farm::realization::Realization;
use lampyris::job::{Job, Sampling};
use lampyris::math::{DVec3, PI};
use lampyris::photometry::Colour;
use lampyris::scene::{Model, Reflectance, Surface};
use lampyris::tally::{BatchScores, Scores, SetTally, Tally};
use lampyris::validate::scenes::in_parallel_light;

/// The run of one estimator: `local`, whose kernel is bounded, `reverse` or `direct_simulation`.
fn run(estimator: &str, histories: u32, batches: u32) -> String {
    format!(
        "[run]\nhistories_per_batch = {histories}\nbatches = {batches}\nseed = 61\n\
         [transport]\nestimator = \"{estimator}\"\n"
    )
}

/// Local against reverse estimation of every bin that `job` asks for in `model`, with (histories, batches) each.
fn local_against_reverse(model: &Model, job: &str, runs: [(u32, u32); 2]) -> Vec<Comparison> {
    let all = |estimator, (histories, batches)| Case::new(&(run(estimator, histories, batches) + job), model.clone());
    against(&all("local", runs[0]), &all("reverse", runs[1]))
}

/// Every bin of `local` against the same bin of `reverse`.
fn against(local: &Case, reverse: &Case) -> Vec<Comparison> {
    let names = local.job.sets().into_iter().map(|s| s.name);
    let pairs = names.zip(local.estimates().into_iter().zip(reverse.estimates()));
    let of_set = |(name, (a, b)): (String, (Vec<Estimate>, Vec<Estimate>))| {
        a.into_iter().zip(b).enumerate().map(|(i, (a, b))| difference(format!("{name}[{i}]"), a, b)).collect::<Vec<_>>()
    };
    pairs.flat_map(of_set).collect()
}

/// A room of 6 x 3 x 4 m with a square column, its walls of different reflectance.
fn room() -> Model {
    let mut model = closed_box(DVec3::new(6.0, 3.0, 4.0), &lambert(0.5, 0.0));
    // closed_box adds floor and ceiling as its third and fourth quads.
    model.surfaces[2] = lambert(0.3, 0.0);
    model.surfaces[3] = lambert(0.7, 0.0);
    let (x, y, z) = (DVec3::X * 0.4, DVec3::Y * 3.0, DVec3::Z * 0.4);
    let corner = DVec3::new(3.8, 0.0, 2.4);
    for (origin, u, v) in [(corner, z, y), (corner + x, y, z), (corner, y, x), (corner + z, x, y)] {
        add_quad(&mut model, origin, u, v, lambert(0.5, 0.0));
    }
    model
}

/// Points and cameras in the air and on surfaces of the room, in the light of the lamp and in the column's shadow.
fn room_receivers() -> String {
    point("desk", [1.5, 0.8, 1.0], [0.0, 1.0, 0.0])
        + &point("shadow", [5.3, 0.8, 3.2], [0.0, 1.0, 0.0])
        + &point("tilted", [4.5, 1.6, 1.0], [-1.0, 2.0, 0.5])
        + &spot_camera("wall", [2.0, 1.5, 2.0], [6.0, 1.2, 1.1], [0.0, 1.0, 0.0])
        + &spot_camera("floor", [1.0, 1.5, 1.0], [2.2, 0.0, 3.0], [0.0, 1.0, 0.0])
}

#[test]
fn local_and_reverse_agree_in_a_room_with_a_column() {
    let job = omni([2.5, 2.4, 1.6], 80.0) + &room_receivers();
    assert_all(&local_against_reverse(&room(), &job, [(4096, 64), (2048, 64)]));
}

/// A camera of 3 x 1 pixels of which `target` is in the middle.
fn strip(name: &str, eye: [f64; 3], target: [f64; 3]) -> String {
    format!(
        "[[camera]]\nname = \"{name}\"\neye = {eye:?}\ntarget = {target:?}\nvertical_fov_degrees = 2\n\
         width = 3\nheight = 1\npixel_samples = 4\n"
    )
}

#[test]
fn pixels_across_an_edge_show_the_mean_of_what_is_on_both_sides() {
    // The edge of the column before the wall, and the one between two of its sides.
    let cameras =
        strip("silhouette", [1.5, 1.5, 1.0], [4.2, 1.4, 2.4]) + &strip("column", [1.5, 1.5, 1.2], [3.8, 1.4, 2.4]);
    let job = omni([2.5, 2.4, 1.6], 80.0) + &cameras;
    assert_all(&local_against_reverse(&room(), &job, [(512, 256), (2048, 64)]));
}

#[test]
fn the_plain_local_estimate_agrees_with_reverse_too() {
    let job = omni([2.5, 2.4, 1.6], 80.0) + &room_receivers();
    let plain = Case::new(&(run("local", 4096, 64) + "bounded = false\n" + &job), room());
    assert_all(&against(&plain, &Case::new(&(run("reverse", 2048, 64) + &job), room())));
}

#[test]
fn local_and_reverse_agree_under_an_area_light() {
    // A Cornell-like box: coloured walls, and a panel hanging under the ceiling that is seen itself, and reflects.
    let mut model = closed_box(DVec3::new(0.556, 0.549, 0.559), &lambert(0.73, 0.0));
    let coloured = |rgb| Surface { reflectance: Reflectance::Lambert(Colour(rgb)), ..lambert(0.0, 0.0) };
    model.surfaces[0] = coloured([0.57, 0.04, 0.04]);
    model.surfaces[1] = coloured([0.11, 0.44, 0.09]);
    add_quad(&mut model, DVec3::new(0.13, 0.5, 0.13), DVec3::X * 0.3, DVec3::Z * 0.3, lambert(0.4, 500.0));
    let job = point("floor", [0.15, 0.0, 0.2], [0.0, 1.0, 0.0])
        + &point("air", [0.3, 0.2, 0.4], [1.0, 0.2, 0.3])
        + &spot_camera("panel", [0.3, 0.1, 0.1], [0.25, 0.5, 0.25], [0.0, 0.0, 1.0])
        + &spot_camera("red", [0.4, 0.2, 0.3], [0.0, 0.3, 0.25], [0.0, 1.0, 0.0])
        + "[[camera]]\nname = \"map\"\neye = [0.3, 0.4, 0.1]\ntarget = [0.25, 0.0, 0.3]\n\
            vertical_fov_degrees = 3\nwidth = 2\nheight = 1\npixel_samples = 4\n";
    let coloured = |estimator: &str, histories| {
        let run = run(estimator, histories, 64).replace("[transport]", "channels = \"rgb\"\n[transport]");
        Case::new(&(run + &job), model.clone())
    };
    let (local, reverse) = (coloured("local", 8192), coloured("reverse", 8192));
    let (a, b) = (local.batches(0..u32::MAX), reverse.batches(0..u32::MAX));
    let mut all = Vec::new();
    for (set, shape) in local.job.sets().iter().enumerate() {
        for bin in 0..shape.bins() {
            let channels = a.1[0].sets[set].colour.len().min(1) * 3;
            let name = |what: &str| format!("{}[{bin}] {what}", shape.name);
            let (x, y) = (estimates(&a.1)[set][bin], estimates(&b.1)[set][bin]);
            let fixed = |f: &[Vec<f64>]| f[set].get(bin).copied().unwrap_or(0.0);
            all.push(difference(name("luminance"), x.shifted(fixed(&a.0)), y.shifted(fixed(&b.0))));
            let channel = |batches: &[BatchScores], c: usize| {
                Estimate::from_scores(batches.iter().map(|b| b.sets[set].colour[bin][c]))
            };
            all.extend((0..channels).map(|c| difference(name(["r", "g", "b"][c]), channel(&a.1, c), channel(&b.1, c))));
        }
    }
    assert_all(&all);
}

#[test]
fn local_and_reverse_agree_between_open_planes() {
    let cameras = spot_camera("plane1", [0.2, 0.6, 0.0], [0.9, 0.0, 0.3], [0.0, 1.0, 0.0])
        + &spot_camera("plane2", [0.2, 0.4, 0.0], [0.5, 1.0, 0.0], [0.0, 0.0, 1.0]);
    let meters = point("e1", [0.5, 0.0, 0.0], [0.0, 1.0, 0.0]) + &point("air", [0.4, 0.6, 0.3], [1.0, -0.5, 0.0]);
    let job = sobolev("", 0.3, 0.9, 0.8) + &cameras + &meters;
    assert_all(&local_against_reverse(&Model::default(), &job, [(8192, 40), (4096, 40)]));
}

/// Ulbricht's sphere, R = 1 m: E = E_0 + rho Phi / (4 pi R^2 (1 - rho)), whatever the place of the lamp.
fn ulbricht(estimator: &str) -> (Vec<Estimate>, [f64; 3]) {
    let job = run(estimator, 1024, 64)
        + &integrating_sphere(0.5)
        + &omni([0.4, 0.0, 0.0], 100.0)
        + &point("g0", [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0])
        + &point("g180", [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0])
        + &spot_camera("wall", [0.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let estimates = Case::new(&job, Model::default()).estimates();
    let (near, far) = (377.777777777778, 151.020408163265);
    // Cameras come first in the order of the sets.
    (estimates.into_iter().map(|set| set[0]).collect(), [0.5 * far / PI, near, far])
}

#[test]
fn both_give_the_exact_values_of_an_integrating_sphere() {
    let mut all = Vec::new();
    for estimator in ["local", "reverse"] {
        let (estimates, exact) = ulbricht(estimator);
        let pairs = estimates.into_iter().zip(exact).enumerate();
        all.extend(pairs.map(|(i, (e, exact))| compare(format!("{estimator} {i}"), e, exact)));
    }
    assert_all(&all);
}

#[test]
fn reverse_gives_the_exact_values_of_a_white_furnace() {
    // M0 = 1 lm/m2 and rho = 0.5 everywhere: E = 2 lx and L = 2/pi cd/m2 at every place and in every direction.
    let job = run("reverse", 512, 64)
        + &point("wall", [0.003, 0.5, 0.0], [0.0, 0.0, 1.0])
        + &point("air", [0.5, 0.5, 0.5], [1.0, 2.0, 3.0])
        + &spot_camera("seen", [0.2, 0.8, 0.2], [0.8, 0.0, 0.8], [0.0, 1.0, 0.0])
        + "[[gonio]]\nname = \"around\"\nposition = [0.3, 0.6, 0.4]\nwidth = 4\nheight = 2\n"
        + "[[gonio]]\nname = \"leaving\"\nposition = [0.5, 0.0, 0.5]\nsurface = true\nnormal = [0, 1, 0]\n\
           width = 3\nheight = 3\n";
    let case = Case::new(&job, closed_box(DVec3::ONE, &lambert(0.5, 1.0 / PI)));
    let mut all = Vec::new();
    for (shape, set) in case.job.sets().iter().zip(case.estimates()) {
        let exact = if shape.name == "wall" || shape.name == "air" { 2.0 } else { 2.0 / PI };
        // NaN: below the horizon.
        let seen = set.into_iter().enumerate().filter(|(_, e)| !e.mean.is_nan());
        all.extend(seen.map(|(i, e)| compare(format!("{}[{i}]", shape.name), e, exact)));
    }
    assert!(all.len() >= 2 + 1 + 8 + 6, "{}", all.len());
    assert_all(&all);
}

#[test]
fn reverse_gives_the_exact_values_of_sobolevs_problem() {
    let rows = table("sobolev_tables.csv");
    let rows: Vec<_> = rows.iter().filter(|r| r["case"] == "A" && number(r, "r") <= 2.0).collect();
    let mut job = sobolev(&run("reverse", 4096, 64), 0.5, 0.5, 0.5);
    for (i, row) in rows.iter().enumerate() {
        job += &point(&format!("e{i}"), [number(row, "r"), 0.0, 0.0], [0.0, 1.0, 0.0]);
    }
    let estimates = Case::new(&job, Model::default()).estimates();
    let at = |(i, row): (usize, &&_)| compare(format!("E1[{i}]"), estimates[i][0], number(row, "E1"));
    assert_all(&rows.iter().enumerate().map(at).collect::<Vec<_>>());
}

#[test]
fn local_and_reverse_agree_on_a_glossy_floor_seen_by_an_eye() {
    // Far from the edges, seen steeply and flat; the floor of roughness 0.3 and 0.1, a dielectric.
    let job = spot_camera("steep", [0.4, 0.9, 0.4], [0.5, 0.0, 0.6], [1.0, 0.0, 0.0])
        + &spot_camera("flat", [0.2, 0.3, 0.4], [0.6, 0.0, 0.5], [0.0, 1.0, 0.0]);
    let mut all = Vec::new();
    for (roughness, histories) in [(0.3, [(16384, 44), (1024, 44)]), (0.1, [(65536, 40), (1024, 44)])] {
        let compared = local_against_reverse(&cube_with_floor(roughness, 0.0, 20.0), &job, histories);
        all.extend(compared.into_iter().map(|c| Comparison { name: format!("{roughness} {}", c.name), ..c }));
    }
    assert_all(&all);
}

#[test]
fn local_and_reverse_agree_on_light_that_comes_over_mirrors() {
    // What a mirror sends straight to the receiver is in neither estimate, what it sends to the surface before is in both.
    // Only an area light can be found behind mirrors.
    let model = cube_with_mirrors(20.0);
    let job = point("air", [0.5, 0.5, 0.5], [-1.0, 0.2, 0.1])
        + &point("floor", [0.6, 0.0, 0.5], [0.0, 1.0, 0.0])
        + &spot_camera("wall", [0.5, 0.5, 0.5], [1.0, 0.4, 0.6], [0.0, 1.0, 0.0])
        + &spot_camera("polished", [0.3, 0.7, 0.5], [0.6, 0.0, 0.6], [0.0, 1.0, 0.0])
            .replace("samples = 1", "samples = 16")
        + &spot_camera("mirrored", [0.7, 0.6, 0.5], [0.0, 0.5, 0.4], [0.0, 1.0, 0.0]);
    assert_all(&local_against_reverse(&model, &job, [(64, 4096), (1024, 256)]));
}

#[test]
fn reverse_misses_what_a_lamp_without_extent_sends_over_a_mirror() {
    // Lamp -> mirror floor -> wall -> meter: the local estimate follows it, no shadow ray of a reverse path can.
    let mut model = Model::default();
    add_quad(&mut model, DVec3::new(-9.0, 0.0, -9.0), DVec3::Z * 18.0, DVec3::X * 18.0, mirror(1.0));
    add_quad(&mut model, DVec3::new(2.0, 0.0, -2.0), DVec3::Z * 4.0, DVec3::Y * 3.0, lambert(0.6, 0.0));
    let job = omni([0.0, 1.0, 0.0], 100.0) + &point("meter", [0.5, 1.5, 0.0], [1.0, 0.0, 0.0]);
    let indirect = |estimator| {
        let (_, batches) = Case::new(&(run(estimator, 4096, 32) + &job), model.clone()).batches(0..u32::MAX);
        estimates(&batches)[0][0]
    };
    let (local, reverse) = (indirect("local"), indirect("reverse"));
    let error = local.standard_error + reverse.standard_error;
    assert!(local.mean - reverse.mean > 10.0 * error && reverse.mean > 0.0, "{local:?} {reverse:?}");
}

/// A grid as TOML; its cells are squares where `u` and `v` and their numbers say so.
fn grid(name: &str, [origin, u, v, normal]: [DVec3; 4], columns: u32, rows: u32) -> String {
    let [origin, u, v, normal] = [origin, u, v, normal].map(|p| p.to_array());
    format!(
        "[[grid]]\nname = \"{name}\"\norigin = {origin:?}\nu = {u:?}\nv = {v:?}\nnormal = {normal:?}\n\
         columns = {columns}\nrows = {rows}\n"
    )
}

/// The mean of each batch over blocks of `fine` x `fine` bins of the first set, as estimates of a row of `cells`.
fn block_means(batches: &[BatchScores], fixed: &[f64], cells: usize, fine: usize) -> Vec<Estimate> {
    let bins = |cell: usize| (0..fine * fine).map(move |k| (k / fine) * cells * fine + cell * fine + k % fine);
    let mean = |values: &dyn Fn(usize) -> f64, cell| bins(cell).map(values).sum::<f64>() / (fine * fine) as f64;
    let cell = |cell| {
        let scores = batches.iter().map(|b| mean(&|bin| b.sets[0].value[bin], cell));
        Estimate::from_scores(scores).shifted(mean(&|bin| fixed[bin], cell))
    };
    (0..cells).map(cell).collect()
}

#[test]
fn direct_simulation_gives_the_means_of_local_estimation_over_its_cells() {
    // Two square metres side by side, of a working plane in the air and of the floor.
    let mut all = Vec::new();
    for (name, height) in [("plane", 0.8), ("floor", 0.0)] {
        let corners = [DVec3::new(1.4, height, 2.6), DVec3::X * 2.0, DVec3::NEG_Z, DVec3::Y];
        let lamp = omni([2.2, 2.3, 1.8], 80.0);
        let counted = Case::new(&(run("direct_simulation", 32768, 64) + &lamp + &grid("g", corners, 2, 1)), room());
        let fine = Case::new(&(run("local", 512, 64) + &lamp + &grid("g", corners, 32, 16)), room());
        let (fixed, batches) = fine.batches(0..u32::MAX);
        let means = block_means(&batches, &fixed[0], 2, 16);
        let cells = counted.estimates().remove(0).into_iter().zip(means).enumerate();
        all.extend(cells.map(|(i, (counted, mean))| difference(format!("{name}[{i}]"), counted, mean)));
    }
    assert_all(&all);
}

#[test]
fn direct_simulation_counts_every_arrival_on_the_walls_of_a_closed_box_once() {
    // Six grids on the six walls: what they count is what is absorbed over 1 - rho. Of 160 000 arrivals a handful lies so
    // near an edge that it counts twice or not at all.
    let rho = 0.6;
    let size = DVec3::new(3.0, 2.0, 2.5);
    let walls = box_walls(size).map(|[origin, u, v]| ([origin, u, v, u.cross(v).normalize()], u.cross(v).length()));
    let mut job = run("direct_simulation", 2048, 32) + &omni([1.1, 0.9, 0.7], 50.0);
    for (i, (wall, _)) in walls.iter().enumerate() {
        job += &(grid(&format!("wall{i}"), *wall, 7, 5) + "monitor = [[3, 2]]\n");
    }
    let (fixed, batches) = Case::new(&job, closed_box(size, &lambert(rho, 0.0))).batches(0..u32::MAX);
    assert!(fixed.iter().flatten().all(|&f| f == 0.0), "direct light comes with the histories");
    let on_walls = |batch: &BatchScores, of: &dyn Fn(&Scores) -> f64| {
        batch.sets.iter().zip(walls).map(|(s, (_, area))| of(s) * area / 35.0).sum::<f64>()
    };
    let all = |of: &dyn Fn(&Scores) -> f64| Estimate::from_scores(batches.iter().map(|b| on_walls(b, of)));
    let counted = all(&|s| s.value.iter().sum());
    let absorbed = flux(&batches, "absorbed").mean;
    assert!((counted.mean * (1.0 - rho) / absorbed - 1.0).abs() < 2e-5, "{counted:?} against {absorbed} lm absorbed");
    // All that is emitted arrives, and arrives directly.
    let (direct, emitted) = (all(&|s| s.direct.iter().sum()).mean, 4.0 * PI * 50.0);
    assert!((direct / emitted - 1.0).abs() < 2e-5, "{direct} against {emitted} lm emitted");
    for scores in batches.iter().flat_map(|b| &b.sets) {
        // The histories of a monitored bin are what its score is made of.
        let totals = &scores.watched[0].totals;
        let mean = totals.iter().sum::<f64>() / 2048.0;
        assert!(totals.len() == 2048 && (mean / scores.value[17] - 1.0).abs() < 1e-12, "{mean}");
    }
    assert_all(&[compare("flux on the walls", counted, emitted / (1.0 - rho))]);
}

#[test]
fn direct_simulation_counts_light_from_outside_in_cells_beyond_all_surfaces() {
    // Beside and above a small box, in parallel light aslant and under an even sky: nothing stands in the way.
    let corners = [DVec3::new(1.5, 1.5, 2.5), DVec3::X * 4.0, DVec3::NEG_Z * 4.0, DVec3::Y];
    let box_at_origin = || closed_box(DVec3::ONE, &lambert(0.5, 0.0));
    let sun = DVec3::new(0.6, -0.8, 0.0);
    let job = run("direct_simulation", 16384, 32) + &grid("g", corners, 1, 1);
    let sky = job.clone() + "[sky]\nmodel = \"uniform\"\nhorizontal_illuminance = 1000.0\n";
    let mut all = Vec::new();
    for (name, case, exact) in [
        ("sun", Case::new(&job, in_parallel_light(box_at_origin(), sun, 1000.0)), 800.0),
        ("sky", Case::new(&sky, box_at_origin()), 1000.0),
    ] {
        all.push(compare(name, case.values()[0], exact));
    }
    assert_all(&all);
}

#[test]
fn direct_simulation_counts_only_what_comes_from_the_side_of_the_normal() {
    // A grid in the air of Ulbricht's sphere: reflected light comes from both sides, the lamp's own from one.
    let lit = |normal: DVec3| {
        let corners = [DVec3::new(-0.2, 0.1, -0.2), DVec3::X * 0.4, DVec3::Z * 0.4, normal];
        let job = run("direct_simulation", 4096, 32)
            + &integrating_sphere(0.5)
            + &omni([0.0, -0.5, 0.0], 100.0)
            + &grid("g", corners, 1, 1);
        let (_, batches) = Case::new(&job, Model::default()).batches(0..u32::MAX);
        let direct = batches.iter().map(|b| b.sets[0].direct[0]).sum::<f64>();
        (estimates(&batches)[0][0], direct)
    };
    let (above, direct_above) = lit(DVec3::Y);
    let (below, direct_below) = lit(DVec3::NEG_Y);
    assert_eq!(direct_above, 0.0);
    assert!(direct_below > 0.0 && below.mean > above.mean, "{above:?} {below:?}");
}

#[test]
fn sampled_direct_light_has_an_error_where_nothing_reflects() {
    let mut model = Model::default();
    add_quad(&mut model, DVec3::new(-0.5, 1.0, -0.5), DVec3::X, DVec3::Z, lambert(0.0, 100.0));
    let cell = [DVec3::new(-0.5, 0.0, 0.5), DVec3::X, DVec3::NEG_Z, DVec3::Y];
    for estimator in ["local", "reverse", "direct_simulation"] {
        let case = Case::new(&(run(estimator, 256, 16) + &grid("g", cell, 1, 1)), model.clone());
        let mut tally = Tally::new(&case.job.sets());
        case.batches(0..u32::MAX).1.iter().for_each(|batch| tally.accumulate(batch));
        let SetTally::Replicates(scores) = &tally.sets[0] else { panic!("a grid keeps its batches") };
        let Estimate { mean, standard_error, .. } = scores.estimate(0);
        assert!(mean > 0.0 && standard_error > 0.0, "{estimator}: {mean} +- {standard_error}");
    }
}

#[test]
fn reverse_paths_are_independent_unless_somebody_types_otherwise() {
    let job = |text: &str| Job::parse(&(text.to_owned() + &room_receivers() + &omni([1.0; 3], 1.0)), "test.toml");
    let sampling = |text: &str| job(text).unwrap().run.sampling;
    // Neither a power of two nor sixteen batches.
    assert_eq!(sampling(&run("reverse", 1000, 3)), Sampling::Random);
    assert_eq!(sampling("[transport]\nestimator = \"reverse\"\n"), Sampling::Random);
    assert_eq!(sampling(&run("local", 1024, 16)), Sampling::Rqmc);
    assert_eq!(sampling("[run]\nsampling = \"random\"\n"), Sampling::Random);
    let typed = run("reverse", 1024, 16).replace("[run]", "[run]\nsampling = \"rqmc\"");
    let refused = job(&typed).unwrap_err().to_string();
    assert!(refused.contains("run.sampling = rqmc: \"random\" with estimator"), "{refused}");
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let receivers = room_receivers() + &grid("g", [DVec3::new(1.0, 0.8, 3.0), DVec3::X, DVec3::NEG_Z, DVec3::Y], 5, 4);
    let only_grid = grid("g", [DVec3::new(1.0, 0.8, 3.0), DVec3::X, DVec3::NEG_Z, DVec3::Y], 5, 4);
    for (estimator, receivers) in [("local", &receivers), ("reverse", &receivers), ("direct_simulation", &only_grid)] {
        let job = run(estimator, 256, 16) + &omni([2.5, 2.4, 1.6], 80.0) + receivers;
        let digests = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let case = Case::new(&job, room());
                let realization = Realization::new(&case.job, &case.scene, &case.bounds);
                (0..3).map(|i| realization.batch(i).digest()).collect::<Vec<_>>()
            })
        };
        assert_eq!(digests(1), digests(3), "{estimator}");
        assert_ne!(digests(1)[0], digests(1)[1], "{estimator}: batches differ");
    }
}

#[test]
fn direct_simulation_is_refused_where_a_cell_does_not_measure_what_a_meter_would() {
    let job = |normal| {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::NEG_Z, normal];
        run("direct_simulation", 64, 16) + &omni([0.0, 2.0, 0.0], 80.0) + &grid("g", corners, 2, 2)
    };
    assert!(lampyris::job::Job::parse(&job(DVec3::NEG_Y * 3.0), "test.toml").is_ok());
    let error = lampyris::job::Job::parse(&job(DVec3::new(0.0, 1.0, 0.1)), "test.toml").unwrap_err().to_string();
    assert!(error.contains("grid[0].normal"), "{error}");
}
