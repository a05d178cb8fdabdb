//! Rooms with a window or a skylight: the sky's component in closed form and by quadrature, and estimators against each other.

use crate::common::{Case, Comparison, Estimate, assert_all, compare, difference};
use crate::{Hole, room, sky};
use lampyris::math::DVec3;
use lampyris::scene::Surface;
use lampyris::validate::daylight::through;
use lampyris::validate::scenes::{add_quad, lambert, point, run, spot_camera};

const UP: [f64; 3] = [0.0, 1.0, 0.0];

#[test]
fn openings_change_no_mean_of_the_direct_light() {
    let mut all = Vec::new();
    // The standard's clear sky, the sun before the window; a tilted plane sees sky and ground.
    let clear =
        sky("12", 1000.0, "ground_reflectance = 0.3\n[sky.sun]\nazimuth_degrees = 20\nelevation_degrees = 30\n");
    for (hole, place) in [(Hole::Roof, [1.2, 0.3, 2.7]), (Hole::Facade, [2.2, 0.9, 2.0])] {
        for opening in [String::new(), hole.opening()] {
            // Without [[opening]] few directions find the hole.
            let histories = if opening.is_empty() { 65536 } else { 2048 };
            let job = run(histories, 32) + &clear + &opening + &point("p", place, [0.0, 1.0, -1.0]);
            let case = Case::new(&job, room(hole, &lambert(0.0, 0.0)));
            let luminance = |w: DVec3| case.scene.beyond(w).luminance();
            let normal = DVec3::new(0.0, 1.0, -1.0).normalize();
            let expected = through(hole.rectangle(), place.into(), normal, luminance);
            let name = format!("{hole:?}, opening {}", !opening.is_empty());
            all.push(compare(name, case.values()[0], expected).within(1e-4));
        }
    }
    assert_all(&all);
}

/// A meter beside the patch of sun, and a pixel on a wall.
fn receivers() -> String {
    point("desk", [0.7, 0.8, 1.5], UP) + &spot_camera("wall", [2.0, 1.5, 2.5], [4.0, 1.2, 3.0], UP)
}

fn pairs(what: &str, a: &[Estimate], b: &[Estimate]) -> Vec<Comparison> {
    let pair = |(i, (a, b)): (usize, (&Estimate, &Estimate))| difference(format!("{what} {i}"), *a, *b);
    a.iter().zip(b).enumerate().map(pair).collect()
}

/// Sun and sky into a bright room: paths that find the sky by leaving, trajectories with and without openings, right or wrong.
#[test]
fn local_and_reverse_agree_in_a_room_with_a_window_whatever_openings_are_drawn() {
    // The window looks south: north is +Z.
    let daylight = sky(
        "12",
        2000.0,
        "north = [0, 0, 1]\nground_reflectance = 0.2\n\
         [sky.sun]\nazimuth_degrees = 150\nelevation_degrees = 40\nilluminance = 3000\n",
    );
    let mut model = room(Hole::Facade, &lambert(0.4, 0.0));
    // A bright wall across the street, in the sun behind it, and a pavement: light enters by way of them, too.
    let both = Surface { double_sided: true, ..lambert(0.5, 0.0) };
    add_quad(&mut model, DVec3::new(-2.0, -1.0, -6.0), DVec3::X * 8.0, DVec3::Y * 3.5, both.clone());
    add_quad(&mut model, DVec3::new(-2.0, -1.0, -0.1), DVec3::X * 8.0, DVec3::NEG_Z * 5.9, both);
    let of = |estimator: &str, histories: u32, openings: &str| {
        let run = format!("{}[transport]\nestimator = \"{estimator}\"\n", run(histories, 32));
        Case::new(&(run + &daylight + openings + &receivers()), model.clone()).values()
    };
    let reverse = of("reverse", 32768, "");
    let opened = of("local", 8192, &Hole::Facade.opening());
    // One before the whole wall, off its plane and larger, and one that is nowhere.
    let wrong = "[[opening]]\ncorners = [[0.5, 0.5, -0.3], [3.5, 0.5, -0.3], [3.5, 2.8, -0.1], [0.5, 2.8, -0.1]]\n\
                 [[opening]]\ncorners = [[0, 5, 0], [1, 5, 0], [1, 5, 3]]\n";
    let mut all = pairs("local, reverse", &opened, &reverse);
    all.extend(pairs("right, wrong", &opened, &of("local", 8192, wrong)));
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
