//! Closed forms of direct light, of form factors and of cavities; their unit tests compare them with the tables.

use crate::math::{DVec3, PI, atan2, cos, log};

/// Illuminance of a horizontal plane and of a vertical one that faces the source, at the distance `x` from the foot
/// of a point source of `intensity` \[cd\] at `height` \[lx\].
pub fn inverse_square(intensity: f64, height: f64, x: f64) -> [f64; 2] {
    let d2 = height * height + x * x;
    let d3 = d2 * d2.sqrt();
    [intensity * height / d3, intensity * x / d3]
}

/// Flux of a point source through a rectangle `a` x `b` with its middle `height` below \[lm\].
pub fn flux_through_rectangle(intensity: f64, height: f64, a: f64, b: f64) -> f64 {
    let (a, b) = (0.5 * a, 0.5 * b);
    4.0 * intensity * atan2(a * b, height * (a * a + b * b + height * height).sqrt())
}

/// Solid angle over which a KHR_lights_punctual spot would give its axial intensity: full inside `inner`, and a ramp
/// to `outer` that is the square of a linear function of the cosine \[sr\].
pub fn spot_solid_angle(inner: f64, outer: f64) -> f64 {
    2.0 * PI * ((1.0 - cos(inner)) + (cos(inner) - cos(outer)) / 3.0)
}

/// Configuration factor of a parallel rectangle `a` x `b` at distance `c`, from under its corner.
pub fn parallel_corner(a: f64, b: f64, c: f64) -> f64 {
    let part = |x: f64, y: f64| {
        let reach = (1.0 + x * x).sqrt();
        x / reach * atan2(y, reach)
    };
    let (x, y) = (a / c, b / c);
    (part(x, y) + part(y, x)) / (2.0 * PI)
}

/// Configuration factor of a perpendicular rectangle of width `a` that rises to `b` at distance `c`, from before its
/// lower corner.
pub fn perpendicular_corner(a: f64, b: f64, c: f64) -> f64 {
    let reach = (b * b + c * c).sqrt();
    (atan2(a, c) - c / reach * atan2(a, reach)) / (2.0 * PI)
}

/// Illuminance at `point` with unit `normal` from a polygon of luminance `luminance`, wholly above the horizon, its
/// `corners` in order, either way round (Lambert) \[lx\].
pub fn polygon(luminance: f64, point: DVec3, normal: DVec3, corners: &[DVec3]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    let edge = |(&a, &b): (&DVec3, &DVec3)| {
        let (a, b) = (a - point, b - point);
        let across = a.cross(b);
        atan2(across.length(), a.dot(b)) * across.normalize().dot(normal)
    };
    0.5 * luminance * corners.iter().zip(next).map(edge).sum::<f64>().abs()
}

/// Form factor between two equal parallel rectangles `a` x `b` at distance `c`.
pub fn parallel_rectangles(a: f64, b: f64, c: f64) -> f64 {
    let (x, y) = (a / c, b / c);
    let (x1, y1) = (1.0 + x * x, 1.0 + y * y);
    let half_log = 0.5 * log(x1 * y1 / (1.0 + x * x + y * y));
    let edges = x * y1.sqrt() * atan2(x, y1.sqrt()) + y * x1.sqrt() * atan2(y, x1.sqrt());
    2.0 / (PI * x * y) * (half_log + edges - x * atan2(x, 1.0) - y * atan2(y, 1.0))
}

/// Form factor between two unit squares with a common edge, at a right angle.
pub fn perpendicular_squares() -> f64 {
    let diagonal = 2f64.sqrt();
    0.5 - (diagonal * atan2(1.0, diagonal) - 0.25 * log(0.75)) / PI
}

/// Illuminance of the wall of a sphere of radius 1 m and reflectance `rho`, a point source of `intensity` at the
/// distance `offset` from its middle, at `angle` \[rad\] from the source as seen from the middle \[lx\].
pub fn ulbricht(intensity: f64, offset: f64, rho: f64, angle: f64) -> f64 {
    let d2 = 1.0 + offset * offset - 2.0 * offset * cos(angle);
    intensity * (1.0 - offset * cos(angle)) / (d2 * d2.sqrt()) + cavity(4.0 * PI * intensity, 4.0 * PI, rho) * rho
}

/// Mean illuminance of a closed cavity of `area` and uniform reflectance `rho`, whatever its shape, with `flux`
/// inside, direct light included \[lx\].
pub fn cavity(flux: f64, area: f64, rho: f64) -> f64 {
    flux / (area * (1.0 - rho))
}

#[cfg(test)]
mod tests {
    use super::super::reference::analytic;
    use super::*;

    #[track_caller]
    fn same(value: f64, case: &str, parameters: &str, quantity: &str) {
        let table = analytic(case, parameters, quantity);
        assert!((value - table).abs() <= 1e-10 * table.abs(), "{case} {parameters}: {value} against {table}");
    }

    #[test]
    fn direct_light_is_that_of_the_tables() {
        for x in [0.0, 1.0, 3.0] {
            let [horizontal, vertical] = inverse_square(100.0, 2.0, x);
            let parameters = format!("I0=100;h=2;x={x};m=0");
            same(horizontal, "point_cos_power", &parameters, "E_horizontal_lx");
            same(vertical, "point_cos_power", &parameters, "E_vertical_facing_lx");
        }
        let flux = flux_through_rectangle(100.0, 1.5, 6.0, 4.0);
        same(flux, "isotropic_point_rect_flux", "I=100;h=1.5;rect 6x4 centred", "flux_lm");
        let degrees = PI / 180.0;
        let cone = 100.0 * spot_solid_angle(30.0 * degrees, 30.0 * degrees);
        same(cone, "spot_uniform_cone_flux", "I0=100;half angle 30 deg", "flux_lm");
    }

    #[test]
    fn configuration_factors_are_those_of_the_tables() {
        for (a, b, c) in [(1.0, 1.0, 1.0), (2.0, 1.0, 1.0), (3.0, 2.0, 0.5), (0.3, 0.3, 2.0)] {
            let across = format!("width a={a};height b={b};distance c={c}");
            same(perpendicular_corner(a, b, c), "rect_perpendicular_corner", &across, "config_factor");
            same(parallel_corner(a, b, c), "rect_parallel_corner", &format!("a={a};b={b};c={c}"), "config_factor");
        }
        let above = 4.0 * parallel_corner(1.0, 0.5, 2.0) * 1000.0 * PI;
        same(above, "rect_luminaire_centre", "L=1000 cd/m2;2x1 m;h=2 centred above", "E_lx");
        let window = 2.0 * perpendicular_corner(1.0, 1.5, 2.0) * 2000.0 * PI;
        let parameters = "uniform window L=2000;width 2 centred;height 1.5 from sill level;distance 2";
        same(window, "window_sill", parameters, "E_horizontal_lx");
    }

    #[test]
    fn form_factors_are_those_of_the_tables() {
        same(parallel_rectangles(1.0, 1.0, 1.0), "form_factor_parallel_squares", "unit squares, distance 1", "F12");
        same(parallel_rectangles(2.0, 3.0, 1.0), "form_factor_parallel_rect", "2x3 at distance 1", "F12");
        same(perpendicular_squares(), "form_factor_perpendicular_squares", "unit squares, common edge", "F12");
    }

    #[test]
    fn a_polygon_of_many_sides_is_the_disc_of_the_table() {
        let corner = |i: u32| {
            let (sin, cos) = crate::math::sin_cos(f64::from(i) * 2.0 * PI / 1e5);
            DVec3::new(cos, 2.0, sin)
        };
        let corners: Vec<DVec3> = (0..100_000).map(corner).collect();
        for x in [0, 1, 3] {
            let case = if x == 0 { "disc_parallel_axis" } else { "disc_parallel_off_axis" };
            let parameters = if x == 0 { "L=1000;R=1;h=2".to_owned() } else { format!("L=1000;R=1;h=2;x={x}") };
            let table = analytic(case, &parameters, "E_lx");
            let value = polygon(1000.0, DVec3::X * f64::from(x), DVec3::Y, &corners);
            assert!((value / table - 1.0).abs() < 1e-8, "x = {x}: {value} against {table}");
        }
    }

    #[test]
    fn cavities_are_those_of_the_tables() {
        for (rho, angle) in [(0.5, 0.0), (0.5, 120.0), (0.9, 60.0), (0.9, 180.0)] {
            let parameters = format!("R=1;I=100;offset 0.4;rho={rho};angle from offset axis {angle} deg");
            let value = ulbricht(100.0, 0.4, rho, angle * PI / 180.0);
            same(value, "integrating_sphere_off_centre", &parameters, "E_total_lx");
        }
        for rho in [0.3, 0.5, 0.8] {
            let parameters = format!("unit cube;I=100 anywhere inside;uniform rho={rho}");
            same(cavity(400.0 * PI, 6.0, rho), "cube_mean", &parameters, "mean_E_lx");
            let furnace = format!("any closed cavity; M0=1 lm/m2; rho={rho}");
            same(cavity(6.0, 6.0, rho), "white_furnace", &furnace, "M_lm_m2");
        }
    }
}
