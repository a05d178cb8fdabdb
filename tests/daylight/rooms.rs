//! Rooms with a window or a skylight: the sky's component in closed form and by quadrature, and estimators against each other.

use crate::common::{Case, Comparison, Estimate, assert_all, compare, difference};
use crate::{Hole, room, sky, through};
use lampyris::math::{DVec3, PI};
use lampyris::scene::Model;
use lampyris::validate::closed_forms::{parallel_corner, perpendicular_corner};
use lampyris::validate::scenes::{add_quad, lambert, point, run, spot_camera};

const UP: [f64; 3] = [0.0, 1.0, 0.0];

/// Direct and reflected light at meters in `model`.
fn values(model: &Model, job: &str) -> Vec<Estimate> {
    Case::new(&(run(2048, 32) + job), model.clone()).values()
}

#[test]
fn an_even_sky_through_openings_has_its_view_factor() {
    let mut all = Vec::new();
    let uniform = sky("\"uniform\"", 1000.0, "");
    // Below a corner of the skylight, and 2 m before the middle of the sill.
    let roof = PI * 1000.0 * parallel_corner(1.0, 1.0, 3.0);
    let facade = 2.0 * PI * 1000.0 * perpendicular_corner(1.0, 1.4, 2.0);
    for (hole, place, expected) in [(Hole::Roof, [1.0, 0.0, 2.0], roof), (Hole::Facade, [2.0, 1.0, 2.0], facade)] {
        for opening in [String::new(), hole.opening()] {
            // Without [[opening]] few directions find the hole.
            let histories = if opening.is_empty() { 65536 } else { 1024 };
            let job = run(histories, 32) + &uniform + &opening + &point("p", place, UP);
            let found = Case::new(&job, room(hole, &lambert(0.0, 0.0))).values()[0];
            all.push(compare(format!("{hole:?}, opening {}", !opening.is_empty()), found, expected));
        }
    }
    assert_all(&all);
}

#[test]
fn an_overcast_sky_over_obstructions_is_its_integral_over_the_opening() {
    let mut all = Vec::new();
    let overcast = sky("\"overcast\"", 1000.0, "ground_reflectance = 0.2\n");
    let luminance = |w: DVec3| if w.y < 0.0 { 0.2 * 7000.0 / 9.0 } else { 1000.0 * (1.0 + 2.0 * w.y) / 3.0 };
    // A black wall across the street hides what is below its edge: 6 m away, 4 m high, endless for all that is seen.
    let mut street = room(Hole::Facade, &lambert(0.0, 0.0));
    add_quad(&mut street, DVec3::new(-60.0, -40.0, -6.0), DVec3::X * 120.0, DVec3::Y * 44.0, lambert(0.0, 0.0));
    // A mask over the skylight hides half of it: 0.5 m above, x > 1.5.
    let mut masked = room(Hole::Roof, &lambert(0.0, 0.0));
    add_quad(&mut masked, DVec3::new(1.5, 3.5, -9.0), DVec3::X * 9.0, DVec3::Z * 20.0, lambert(0.0, 0.0));
    for p in [[2.0, 0.8, 1.0], [0.7, 0.8, 3.0]] {
        let place = DVec3::from(p);
        let over_the_street = |w: DVec3| {
            let at_wall = place + w * ((-6.0 - place.z) / w.z);
            if at_wall.y < 4.0 { 0.0 } else { luminance(w) }
        };
        let beside_the_mask = |w: DVec3| {
            let at_mask = place + w * ((3.5 - place.y) / w.y);
            if at_mask.x > 1.5 { 0.0 } else { luminance(w) }
        };
        let facade = through(Hole::Facade.rectangle(), place, DVec3::Y, over_the_street);
        let open = through(Hole::Facade.rectangle(), place, DVec3::NEG_Z, luminance);
        let roof = through(Hole::Roof.rectangle(), place, DVec3::Y, beside_the_mask);
        let job = overcast.clone() + &point("p", p, UP) + &point("q", p, [0.0, 0.0, -1.0]);
        let opened = |hole: Hole| job.clone() + &hole.opening();
        let name = |what: &str| format!("{what} at {p:?}");
        all.push(compare(name("street"), values(&street, &opened(Hole::Facade))[0], facade).within(1e-3));
        let room = room(Hole::Facade, &lambert(0.0, 0.0));
        all.push(compare(name("vertical"), values(&room, &opened(Hole::Facade))[1], open).within(1e-4));
        all.push(compare(name("masked skylight"), values(&masked, &opened(Hole::Roof))[0], roof).within(1e-3));
    }
    assert_all(&all);
}

/// Meters and small cameras in a bright room.
fn receivers() -> String {
    point("desk", [2.0, 0.8, 1.5], UP)
        + &point("back", [1.0, 0.8, 4.0], [0.0, 1.0, -0.3])
        + &spot_camera("wall", [2.0, 1.5, 2.5], [4.0, 1.2, 3.0], UP)
        + &spot_camera("floor", [2.0, 1.5, 4.5], [1.8, 0.0, 2.0], UP)
}

fn pairs(what: &str, a: &[Estimate], b: &[Estimate]) -> Vec<Comparison> {
    let pair = |(i, (a, b)): (usize, (&Estimate, &Estimate))| difference(format!("{what} {i}"), *a, *b);
    a.iter().zip(b).enumerate().map(pair).collect()
}

/// Sun and sky into a bright room: paths that find the sky by leaving, trajectories with and without openings, whole or in parts.
#[test]
fn local_and_reverse_agree_in_a_room_with_a_window_whatever_openings_are_drawn() {
    // The window looks south: north is +Z.
    let daylight = sky(
        "12",
        2000.0,
        "north = [0, 0, 1]\nground_reflectance = 0.2\n\
         [sky.sun]\nazimuth_degrees = 150\nelevation_degrees = 40\nilluminance = 20000\n",
    );
    let model = room(Hole::Facade, &lambert(0.6, 0.0));
    let of = |estimator: &str, histories: u32, openings: &str| {
        let run = format!("{}[transport]\nestimator = \"{estimator}\"\n", run(histories, 32));
        Case::new(&(run + &daylight + openings + &receivers()), model.clone()).values()
    };
    let reverse = of("reverse", 16384, "");
    let opened = of("local", 4096, &Hole::Facade.opening());
    // Half of the window, and one that is nowhere.
    let wrong = "[[opening]]\ncorners = [[1, 1, 0], [2, 1, 0], [2, 2.4, 0], [1, 2.4, 0]]\n\
                 [[opening]]\ncorners = [[0, 5, 0], [1, 5, 0], [1, 5, 3]]\n";
    let mut all = pairs("local, reverse", &opened, &reverse);
    all.extend(pairs("whole, half", &opened[2..], &of("local", 32768, wrong)[2..]));
    all.extend(pairs("with, without", &opened, &of("local", 32768, "")));
    assert_all(&all);
}

/// Counted on the cells of a grid.
#[test]
fn direct_simulation_agrees_in_the_mean_of_a_grid() {
    let grid = "[[grid]]\nname = \"floor\"\norigin = [0, 0.5, 5]\nu = [4, 0, 0]\nv = [0, 0, -5]\nnormal = [0, 1, 0]\n\
                columns = 4\nrows = 5\n";
    let model = room(Hole::Roof, &lambert(0.5, 0.0));
    let mean = |estimator: &str, histories| {
        let run = format!("{}[transport]\nestimator = \"{estimator}\"\n", run(histories, 32));
        let job = run + &sky("\"overcast\"", 3000.0, "") + &Hole::Roof.opening() + grid;
        let case = Case::new(&job, model.clone());
        let (_, batches) = case.batches(0..u32::MAX);
        Estimate::from_scores(batches.iter().map(|b| b.sets[0].value.iter().sum::<f64>() / 20.0))
    };
    // The values at the centres of few cells are not their means: many points say what the grid's mean is.
    let fine = grid.replace("columns = 4", "columns = 32").replace("rows = 5", "rows = 40");
    let job = run(256, 32) + &sky("\"overcast\"", 3000.0, "") + &Hole::Roof.opening() + &fine;
    let (_, batches) = Case::new(&job, model.clone()).batches(0..u32::MAX);
    let local = Estimate::from_scores(batches.iter().map(|b| b.sets[0].value.iter().sum::<f64>() / 1280.0));
    assert_all(&[difference("mean over the floor", local, mean("direct_simulation", 16384)).within(2e-3)]);
}
