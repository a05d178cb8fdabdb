//! The only door to transcendental functions, and the vectors everyone uses.
//!
//! The standard library calls the C library of the machine, whose last bits differ between versions and CPUs;
//! the pure-Rust `libm` gives the same bits everywhere. Square root, addition, multiplication and division are
//! correctly rounded by IEEE 754 and may be used directly. `clippy.toml` refuses the others outside this file.

pub use glam::{DMat3, DMat4, DQuat, DVec2, DVec3, DVec4, Vec3};
pub use libm::{acos, asin, atan2, cbrt, ceil, cos, exp, floor, log, log1p, log2, pow, sin, tan};
pub use std::f64::consts::PI;

/// Sine and cosine of `angle` \[rad\].
pub fn sin_cos(angle: f64) -> (f64, f64) {
    libm::sincos(angle)
}

/// Two unit vectors that with the unit vector `n` make a right-handed orthonormal frame
/// (Duff et al. 2017: no branch on which axis is longest, no singular direction).
pub fn frame(n: DVec3) -> (DVec3, DVec3) {
    let sign = 1f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    (DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x), DVec3::new(b, sign + n.y * n.y * a, -n.y))
}

/// The vector with coordinates `local` in the frame whose third axis is the unit vector `n`.
pub fn to_world(n: DVec3, local: DVec3) -> DVec3 {
    let (t, b) = frame(n);
    t * local.x + b * local.y + n * local.z
}

/// Nodes and weights of the Gauss-Legendre rule with `count` nodes on [-1, 1], by Newton's method on the Legendre polynomial.
pub fn gauss_legendre(count: usize) -> Vec<(f64, f64)> {
    let n = count as f64;
    let node = |i: usize| {
        let mut x = cos(PI * (i as f64 + 0.75) / (n + 0.5));
        let mut slope = 1.0;
        // Quadratic convergence from a guess good to 1e-3: the fourth step changes nothing.
        for _ in 0..4 {
            let (mut previous, mut value) = (1.0, x);
            for k in 2..=count {
                let k = k as f64;
                (previous, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * previous) / k);
            }
            slope = n * (x * value - previous) / (x * x - 1.0);
            x -= value / slope;
        }
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..count).map(node).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frame_is_orthonormal_and_right_handed() {
        for n in [DVec3::Z, -DVec3::Z, DVec3::X, DVec3::new(0.3, -0.5, -0.81).normalize()] {
            let (t, b) = frame(n);
            assert!(t.dot(b).abs() < 1e-15 && t.dot(n).abs() < 1e-15 && b.dot(n).abs() < 1e-15);
            assert!((t.cross(b) - n).length() < 1e-15);
        }
    }

    #[test]
    fn gauss_rules_are_exact_for_high_powers() {
        for count in [1usize, 2, 3, 32, 65, 258] {
            for power in [0usize, 2, 4, 2 * count - 2] {
                let sum: f64 = gauss_legendre(count).iter().map(|&(x, w)| (0..power).fold(w, |p, _| p * x)).sum();
                let exact = if power < 2 * count { 2.0 / (power + 1) as f64 } else { continue };
                assert!((sum / exact - 1.0).abs() < 1e-12, "{count} {power}: {sum} {exact}");
            }
        }
    }
}
