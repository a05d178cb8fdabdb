//! Glass and opal: what goes straight through a pane, by the angle, and what an opal cover lets out.

use super::experiment::{Experiment, flux};
use super::scenes::{UP, add_quad, closed_box, in_parallel_light, lambert, omni, point, points, run};
use super::{Case, Comparison, Theme};
use crate::error::Result;
use crate::math::{DVec3, PI, atan2, cos, sin, sin_cos, tan};
use crate::photometry::Colour;
use crate::scene::{Delta, Model, Pane, Reflectance, Surface};

const THEME: Theme = Theme("Glass");
/// Refractive index and what is left of light that crosses the glass once: 6 mm of float glass.
pub(super) const WINDOW: (f64, f64) = (1.52, 0.95);

/// The cases, in order.
pub(super) fn cases() -> Vec<Case> {
    vec![
        THEME.case(
            "glass/transmission",
            "parallel light through a pane, by the angle of incidence, and a point source above one",
            "Fresnel's sines and tangents, all reflections inside summed",
            transmission,
        ),
        THEME.case("glass/opal-cover", "flux that leaves an opal box", "Phi tau / (1 - rho)", opal_cover),
    ]
}

pub(super) fn of(reflectance: Reflectance) -> Surface {
    Surface { reflectance, double_sided: true, ..lambert(0.0, 0.0) }
}

/// A pane of 4 m in the plane y = 1.
fn window() -> Model {
    let mut model = Model::default();
    let pane = Pane::new(WINDOW.0, Colour::grey(WINDOW.1));
    let corner = DVec3::new(-2.0, 1.0, -2.0);
    add_quad(&mut model, corner, DVec3::Z * 4.0, DVec3::X * 4.0, of(Reflectance::Delta(Delta::Pane(pane))));
    model
}

/// Transmittance of the pane at `angle` \[rad\], from the angles on both sides of a face.
pub(super) fn transmittance(angle: f64) -> f64 {
    let (index, internal) = WINDOW;
    let inside = asin(sin(angle) / index);
    let t = crate::math::pow(internal, 1.0 / cos(inside));
    let through = |r: f64| (1.0 - r) * (1.0 - r) * t / (1.0 - r * r * t * t);
    if angle == 0.0 {
        let r = (index - 1.0) / (index + 1.0);
        return through(r * r);
    }
    let s = sin(angle - inside) / sin(angle + inside);
    let p = tan(angle - inside) / tan(angle + inside);
    0.5 * (through(s * s) + through(p * p))
}

/// The acute angle with this sine \[rad\].
fn asin(sine: f64) -> f64 {
    atan2(sine, (1.0 - sine * sine).sqrt())
}

fn transmission() -> Result<Vec<Comparison>> {
    let mut all = Vec::new();
    for degrees in [0.0, 15.0, 30.0, 45.0, 60.0] {
        let angle = degrees * PI / 180.0;
        let (sine, cosine) = sin_cos(angle);
        let model = in_parallel_light(window(), DVec3::new(sine, -cosine, 0.0), 1000.0);
        let found = Experiment::new(&(run(1, 16) + &point("p", [0.0; 3], UP)), model)?.values();
        let exact = 1000.0 * cosine * transmittance(angle);
        all.push(Comparison::new(format!("parallel light at {degrees} degrees"), "lx", found[0], exact));
    }
    let places = [0.0, 1.0, 2.0];
    let job = run(1, 16) + &omni([0.0, 2.0, 0.0], 100.0) + &points("p", places.map(|x| ([x, 0.0, 0.0], UP)));
    for (x, found) in places.iter().zip(Experiment::new(&job, window())?.values()) {
        let d2: f64 = 4.0 + x * x;
        let exact = 100.0 * 2.0 / (d2 * d2.sqrt()) * transmittance(asin(x / d2.sqrt()));
        all.push(Comparison::new(format!("point source, x = {x} m"), "lx", found, exact));
    }
    Ok(all)
}

fn opal_cover() -> Result<Vec<Comparison>> {
    let (rho, tau) = (0.5, 0.4);
    let cover = of(Reflectance::opal(Colour::grey(rho), Colour::grey(tau)));
    let job = run(4096, 64) + &omni([0.4, 0.5, 0.6], 10.0) + &point("far", [3.0, 0.0, 0.0], UP);
    let (_, batches) = Experiment::new(&job, closed_box(DVec3::ONE, &cover))?.batches(1..u32::MAX);
    let exact = 40.0 * PI * tau / (1.0 - rho);
    Ok(vec![Comparison::new("flux outside", "lm", flux(&batches, "escaped"), exact)])
}
