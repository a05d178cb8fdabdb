//! Openings and obstructions: light through a hole in a roof or a facade, a lit wall seen whole and in part, the cube of 4 m. Cases like
//! 5.4 to 5.8 of CIE 171:2006, their values by clipping and closed forms.

use super::clipping::{factor, within};
use super::closed_forms::{cavity, flux_through_rectangle, inverse_square};
use super::experiment::Experiment;
use super::form_factors::{mean_of_meters, wall_meters};
use super::scenes::{UP, add_quad, box_walls, enclosure, in_parallel_light, lambert, omni, points, rectangle, run};
use super::{Case, Comparison, Theme};
use crate::error::Result;
use crate::math::{DVec3, PI};
use crate::scene::{Model, Surface};
use crate::tally::statistics::Estimate;

const THEME: Theme = Theme("Openings and obstructions");

/// The cases, in order.
pub(super) fn cases() -> Vec<Case> {
    vec![
        THEME.case(
            "opening/point-through-roof",
            "a point source above a hole in a roof: lux below it and beside it, flux of the beam",
            "I h / d^3 or none; flux of a point source through a rectangle",
            point_through_roof,
        ),
        THEME.case(
            "opening/area-through-roof",
            "a luminous area above the same hole",
            "Lambert's sum over the edges of what is seen through it",
            || {
                area_through(
                    &roof(),
                    [DVec3::new(-1.5, 5.0, -1.0), DVec3::X * 3.0, DVec3::Z * 2.0],
                    &hole_in_roof(),
                    4096,
                )
            },
        ),
        THEME.case("opening/area-through-facade", "a bright facade opposite a window", "the same", || {
            area_through(&facade(), [DVec3::new(8.0, -2.0, 6.0), DVec3::Y * 9.0, DVec3::Z * -12.0], &window(), 32768)
        }),
        THEME.case(
            "reflection/without-obstruction",
            "an evenly lit wall, on the floor and on a wall across",
            "rho E times the configuration factor",
            || lit_wall(false),
        ),
        THEME.case(
            "reflection/with-obstruction",
            "the same behind a screen",
            "rho E times the factor of what the screen leaves to see",
            || lit_wall(true),
        ),
        THEME.case(
            "cavity/cube-4m",
            "mean indirect light of a cube of 4 m, for thirteen reflectances",
            "rho Phi / (S (1 - rho))",
            cube,
        ),
    ]
}

/// Black on both sides.
fn black() -> Surface {
    Surface { double_sided: true, ..lambert(0.0, 0.0) }
}

/// A black wall in the plane of `u` and `v` with a rectangular hole, which lies from `hole.0` to `hole.1` along either.
fn wall_with_hole(origin: DVec3, [u, v]: [DVec3; 2], size: [f64; 2], hole: [[f64; 2]; 2]) -> Model {
    let mut model = Model::default();
    let [[a, b], [c, d]] = hole;
    for [from_u, to_u, from_v, to_v] in
        [[0.0, a, 0.0, size[1]], [b, size[0], 0.0, size[1]], [a, b, 0.0, c], [a, b, d, size[1]]]
    {
        add_quad(&mut model, origin + u * from_u + v * from_v, u * (to_u - from_u), v * (to_v - from_v), black());
    }
    model
}

/// A roof of 20 x 20 m, 3 m up, with a hole of 1 x 1.2 m above the origin.
fn roof() -> Model {
    wall_with_hole(DVec3::new(-10.0, 3.0, -10.0), [DVec3::Z, DVec3::X], [20.0, 20.0], [[9.4, 10.6], [9.5, 10.5]])
}

fn hole_in_roof() -> [DVec3; 4] {
    rectangle(DVec3::new(-0.5, 3.0, -0.6), DVec3::Z * 1.2, DVec3::X)
}

/// A facade at x = 2 m, 12 m wide and high, with a window of 2 x 1.5 m from 1 m up.
fn facade() -> Model {
    wall_with_hole(DVec3::new(2.0, -6.0, -6.0), [DVec3::Y, DVec3::Z], [12.0, 12.0], [[7.0, 8.5], [5.0, 7.0]])
}

fn window() -> [DVec3; 4] {
    rectangle(DVec3::new(2.0, 1.0, -1.0), DVec3::Y * 1.5, DVec3::Z * 2.0)
}

fn point_through_roof() -> Result<Vec<Comparison>> {
    // 1.5 m above the hole: the beam on the floor is three times as wide as the hole.
    let grid = "[[grid]]\nname = \"beam\"\norigin = [-1.5, 0, 1.8]\nu = [3, 0, 0]\nv = [0, 0, -3.6]\n\
                normal = [0, 1, 0]\ncolumns = 150\nrows = 180\n";
    let meters = points("p", [0.0, 1.4, 1.6].map(|x| ([x, 0.0, 0.0], UP)));
    let experiment = Experiment::new(&(run(1, 16) + &omni([0.0, 4.5, 0.0], 100.0) + grid + &meters), roof())?;
    let (fixed, _) = experiment.batches(0..0);
    let flux = fixed[0].iter().sum::<f64>() * 3.0 * 3.6 / fixed[0].len() as f64;
    let exact = |value: f64| Estimate { n: 16, mean: value, standard_error: 0.0 };
    let mut all = vec![
        Comparison::new("flux of the beam", "lm", exact(flux), flux_through_rectangle(100.0, 1.5, 1.0, 1.2))
            .within(1e-5),
    ];
    for (i, (x, seen)) in [(0.0, 1.0), (1.4, 1.0), (1.6, 0.0)].into_iter().enumerate() {
        let reference = seen * inverse_square(100.0, 4.5, x)[0];
        all.push(Comparison::new(format!("x = {x} m"), "lx", exact(fixed[1 + i][0]), reference));
    }
    Ok(all)
}

/// A luminous rectangle (origin, u, v) behind a wall with a hole: on the floor, and on a vertical meter.
fn area_through(
    wall: &Model,
    [origin, u, v]: [DVec3; 3],
    hole: &[DVec3; 4],
    histories: u32,
) -> Result<Vec<Comparison>> {
    let mut model = wall.clone();
    add_quad(&mut model, origin, u, v, lambert(0.0, 1000.0));
    let places = [
        ([0.0, 0.0, 0.0], UP),
        ([-0.6, 0.0, 0.2], UP),
        ([-1.0, 0.5, 0.4], UP),
        ([-0.7, 0.5, 0.0], [1.0, 0.0, 0.0]),
        ([-1.0, 0.8, -0.3], [0.6, 0.8, 0.0]),
    ];
    let job = run(histories, 32) + &points("p", places);
    let found = Experiment::new(&job, model)?.values();
    let corners = rectangle(origin, u, v);
    let exact = |(place, normal): ([f64; 3], [f64; 3])| {
        let place = DVec3::from(place);
        1000.0 * PI * factor(place, normal.into(), &within(&corners, place, hole))
    };
    let compare = |(&at, e): (&([f64; 3], [f64; 3]), &Estimate)| {
        Comparison::new(format!("{:?} facing {:?}", at.0, at.1), "lx", *e, exact(at))
    };
    Ok(places.iter().zip(&found).map(compare).collect())
}

/// A wall of 4 x 3 m and reflectance 0.7 in the plane x = 0, lit evenly from below so that no screen shades it.
fn lit_wall(screened: bool) -> Result<Vec<Comparison>> {
    let mut model = Model::default();
    let wall = rectangle(DVec3::new(0.0, 0.0, -2.0), DVec3::Y * 3.0, DVec3::Z * 4.0);
    add_quad(&mut model, wall[0], DVec3::Y * 3.0, DVec3::Z * 4.0, lambert(0.7, 0.0));
    let screen = rectangle(DVec3::new(1.0, 0.0, -0.8), DVec3::Y, DVec3::Z * 1.5);
    if screened {
        add_quad(&mut model, screen[0], DVec3::Y, DVec3::Z * 1.5, black());
    }
    let lit = 1000.0 / 17f64.sqrt();
    let model = in_parallel_light(model, DVec3::new(-1.0, 4.0, 0.0).normalize(), 1000.0);
    let places = [
        ([1.5, 0.0, 1.0], UP),
        ([2.0, 0.0, 0.5], UP),
        ([3.0, 0.0, -1.0], UP),
        ([2.0, 0.5, 1.5], UP),
        ([4.0, 1.0, 0.0], [-1.0, 0.0, 0.0]),
        ([2.0, 0.2, 1.0], [0.0, 0.0, -1.0]),
    ];
    let found = Experiment::new(&(run(65536, 32) + &points("p", places)), model)?.estimates_of_orders(1..u32::MAX);
    let exact = |(place, normal): ([f64; 3], [f64; 3])| {
        let (place, normal) = (DVec3::from(place), DVec3::from(normal));
        let hidden = if screened { factor(place, normal, &within(&wall, place, &screen)) } else { 0.0 };
        0.7 * lit * (factor(place, normal, &wall) - hidden)
    };
    let compare = |(i, &at): (usize, &([f64; 3], [f64; 3]))| {
        Comparison::new(format!("{:?} facing {:?}", at.0, at.1), "lx", found[i][0], exact(at))
    };
    Ok(places.iter().enumerate().map(compare).collect())
}

fn cube() -> Result<Vec<Comparison>> {
    let walls = box_walls(DVec3::splat(4.0));
    // With the source in the middle one wall is like all.
    let (meters, weights) = wall_meters(&walls[2..3]);
    let job = run(256, 16) + &omni([2.0; 3], 100.0) + &meters;
    let mut all = Vec::new();
    for rho in [0.0, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.95] {
        let (_, batches) = Experiment::new(&job, enclosure(&walls, &lambert(rho, 0.0)))?.batches(1..u32::MAX);
        let exact = rho * cavity(400.0 * PI, 96.0, rho);
        let name = format!("rho = {rho}");
        // 1e-4: what the Gauss rule loses near edges.
        all.push(Comparison::new(name, "lx", mean_of_meters(&batches, &weights), exact).within(1e-4));
    }
    Ok(all)
}
