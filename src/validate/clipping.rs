//! Closed forms where only a part of an even surface is seen: cut by the horizon, by an opening, by what stands before it.
//!
//! A polygon is cut by planes through the receiver; what is left gets Lambert's sum over its edges.

use crate::math::{DVec3, PI, atan2};

/// The corners of what of the convex polygon `corners` lies on the side of `normal` of the plane through `point`.
fn cut(corners: &[DVec3], point: DVec3, normal: DVec3) -> Vec<DVec3> {
    let height = |p: DVec3| (p - point).dot(normal);
    let mut left = Vec::new();
    for (&a, &b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        let (from, to) = (height(a), height(b));
        if from >= 0.0 {
            left.push(a);
        }
        if (from > 0.0 && to < 0.0) || (from < 0.0 && to > 0.0) {
            left.push(a + (b - a) * (from / (from - to)));
        }
    }
    left
}

/// What of `corners` is seen from `point` within the outline `opening`, both convex.
pub fn within(corners: &[DVec3], point: DVec3, opening: &[DVec3]) -> Vec<DVec3> {
    let middle = opening.iter().sum::<DVec3>() / opening.len() as f64 - point;
    let edges = opening.iter().zip(opening.iter().cycle().skip(1));
    edges.fold(corners.to_vec(), |left, (&a, &b)| {
        let across = (a - point).cross(b - point);
        cut(&left, point, across * across.dot(middle).signum())
    })
}

/// Configuration factor of the convex polygon `corners` at `point` with the unit `normal`, what lies below the horizon cut off.
pub fn factor(point: DVec3, normal: DVec3, corners: &[DVec3]) -> f64 {
    let seen = cut(corners, point, normal);
    let edge = |(&a, &b): (&DVec3, &DVec3)| {
        let (a, b) = (a - point, b - point);
        let across = a.cross(b);
        atan2(across.length(), a.dot(b)) * across.normalize_or_zero().dot(normal)
    };
    let next = seen.iter().cycle().skip(1);
    seen.iter().zip(next).map(edge).sum::<f64>().abs() / (2.0 * PI)
}

#[cfg(test)]
mod tests {
    use super::super::closed_forms::parallel_corner;
    use super::super::scenes::rectangle;
    use super::*;

    #[test]
    fn parts_add_up_to_the_whole() {
        let (point, normal) = (DVec3::new(0.3, 0.0, 0.2), DVec3::new(0.1, 1.0, 0.2).normalize());
        let whole = rectangle(DVec3::new(-1.0, 2.0, -1.0), DVec3::X * 3.0, DVec3::Z * 2.0);
        let left = rectangle(DVec3::new(-1.0, 2.0, -1.0), DVec3::X, DVec3::Z * 2.0);
        let right = rectangle(DVec3::new(0.0, 2.0, -1.0), DVec3::X * 2.0, DVec3::Z * 2.0);
        let parts = factor(point, normal, &left) + factor(point, normal, &right);
        assert!((factor(point, normal, &whole) - parts).abs() < 1e-14);
        // The outline of the left half, half way to it.
        let outline = left.map(|corner| point + 0.5 * (corner - point));
        let seen = factor(point, normal, &within(&whole, point, &outline));
        assert!((seen - factor(point, normal, &left)).abs() < 1e-14);
        let aside = outline.map(|corner| corner + DVec3::X * 10.0);
        assert_eq!(factor(point, normal, &within(&whole, point, &aside)), 0.0);
    }

    #[test]
    fn the_horizon_halves_what_it_halves() {
        let over = |normal| {
            factor(DVec3::ZERO, normal, &rectangle(DVec3::new(-1.0, 1.0, -1.0), DVec3::X * 2.0, DVec3::Z * 2.0))
        };
        assert!((over(DVec3::Y) - 4.0 * parallel_corner(1.0, 1.0, 1.0)).abs() < 1e-14);
        assert_eq!(over(DVec3::NEG_Y), 0.0);
        let half = factor(DVec3::ZERO, DVec3::X, &rectangle(DVec3::new(0.0, 1.0, -1.0), DVec3::X, DVec3::Z * 2.0));
        assert!(half > 0.1 && (over(DVec3::X) - half).abs() < 1e-14);
    }
}
