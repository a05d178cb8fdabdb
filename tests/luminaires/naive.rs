//! A second reading of the test files, as plain as can be: it knows what was written, folds angles where the program mirrors
//! planes, counts in degrees, and shares no line with it.

use lampyris::math::{atan2, cos, sin};
use std::fs;
use std::path::Path;

/// One file: angles in degrees and intensities in cd, factors applied.
pub struct Naive {
    pub kind: char,
    pub planes: Vec<f64>,
    pub angles: Vec<f64>,
    values: Vec<f64>,
    /// How the plane of an angle is found, see [`Naive::folded`].
    fold: Fold,
}

#[derive(Clone, Copy, PartialEq)]
enum Fold {
    None,
    Axial,
    Quadrant,
    /// The file has 0 .. 180.
    Upper,
    /// The file has 90 .. 270.
    Left,
    /// The file has -90 .. 90.
    Right,
    /// Types A and B with angles from 0 on.
    Absolute,
}

/// The file called `name` in the folder of the tests.
pub fn read(name: &str) -> Naive {
    let bytes = fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/luminaires").join(name)).unwrap();
    let text: String = bytes.iter().map(|&b| if b == 0x1a { ' ' } else { char::from(b) }).collect();
    if name.ends_with(".ies") { ies(name, &text) } else { ldt(&text) }
}

fn ies(name: &str, text: &str) -> Naive {
    let numbers = text.split("TILT=").nth(1).unwrap();
    let numbers = numbers.replace("NONE", "").replace("INCLUDE", "");
    let numbers = if name == "commas_as_points.ies" { numbers.replace(',', ".") } else { numbers.replace(',', " ") };
    let mut n: Vec<f64> = numbers.split_whitespace().map(|w| w.parse().unwrap()).collect();
    if name == "tilt_include.ies" {
        n.drain(..8);
    }
    let (along, across) = (n[3] as usize, n[4] as usize);
    // The second factor counted in the editions of 1986 and 1991.
    let factor = n[2] * n[10] * if name.contains("1991") || name.contains("1986") { n[11] } else { 1.0 };
    let angles = n[13..13 + along].to_vec();
    let planes = n[13 + along..13 + along + across].to_vec();
    let values: Vec<f64> = n[13 + along + across..].iter().map(|v| v * factor).collect();
    let kind = [' ', 'C', 'B', 'A'][n[5] as usize];
    let fold = match (kind, planes[0], planes[planes.len() - 1]) {
        ('C', ..) if across == 1 => Fold::Axial,
        ('C', 0.0, 90.0) => Fold::Quadrant,
        ('C', 0.0, 180.0) => Fold::Upper,
        ('C', 90.0, 270.0) => Fold::Left,
        ('C', -90.0, 90.0) => Fold::Right,
        ('A' | 'B', 0.0, _) => Fold::Absolute,
        _ => Fold::None,
    };
    Naive { kind, planes, angles, values, fold }
}

fn ldt(text: &str) -> Naive {
    let lines: Vec<String> = text.lines().map(|l| l.trim().replace(',', ".")).collect();
    let number = |k: usize| -> f64 { lines[k].parse().unwrap() };
    let (symmetry, planes, angles, sets) =
        (number(2) as usize, number(3) as usize, number(5) as usize, number(25) as usize);
    // The flux of the first set, in the order in which the file with sets one after the other has it.
    let flux = if sets == 1 || lines[27].parse::<f64>().is_err() { number(28) } else { number(26 + 2 * sets) };
    let start = 26 + 6 * sets + 10;
    let c: Vec<f64> = (start..start + planes).map(number).collect();
    let g: Vec<f64> = (start + planes..start + planes + angles).map(number).collect();
    let (fold, first, count) = match symmetry {
        0 => (Fold::None, 0, planes),
        1 => (Fold::Axial, 0, 1),
        2 => (Fold::Upper, 0, planes / 2 + 1),
        3 => (Fold::Right, 3 * planes / 4, planes / 2 + 1),
        _ => (Fold::Quadrant, 0, planes / 4 + 1),
    };
    let kept: Vec<f64> =
        (first..first + count).map(|k| if k < planes { c[k] } else { c[k - planes] + 360.0 }).collect();
    let kept = if fold == Fold::Right { kept.iter().map(|c| c - 360.0).collect() } else { kept };
    let values: Vec<f64> =
        (start + planes + angles..lines.len()).map(|k| number(k) * number(23) * flux / 1000.0).collect();
    assert_eq!(values.len(), count * angles);
    Naive { kind: 'C', planes: kept, angles: g, values, fold }
}

impl Naive {
    /// The same direction among the planes that the file has, `plane` and `angle` in degrees.
    fn folded(&self, plane: f64, angle: f64) -> (f64, f64) {
        let turned = plane.rem_euclid(360.0);
        match self.fold {
            Fold::None if self.kind == 'C' => (turned, angle),
            Fold::None => (plane, angle),
            Fold::Axial => (0.0, angle),
            Fold::Quadrant => {
                let half = if turned > 180.0 { 360.0 - turned } else { turned };
                (if half > 90.0 { 180.0 - half } else { half }, angle)
            }
            Fold::Upper => (if turned > 180.0 { 360.0 - turned } else { turned }, angle),
            Fold::Left if turned < 90.0 => (180.0 - turned, angle),
            Fold::Left if turned > 270.0 => (540.0 - turned, angle),
            Fold::Left => (turned, angle),
            Fold::Right => {
                let signed = if turned > 180.0 { turned - 360.0 } else { turned };
                let folded = if signed > 90.0 { 180.0 - signed } else { signed };
                (if folded < -90.0 { -180.0 - folded } else { folded }, angle)
            }
            Fold::Absolute => (plane.abs(), angle.abs()),
        }
    }

    /// Intensity at angles in degrees, as the file counts them \[cd\].
    pub fn intensity(&self, plane: f64, angle: f64) -> f64 {
        let (plane, angle) = self.folded(plane, angle);
        if angle < self.angles[0] || angle > *self.angles.last().unwrap() {
            return 0.0;
        }
        let i = (1..self.angles.len() - 1).take_while(|&i| self.angles[i] <= angle).count();
        let share = (angle - self.angles[i]) / (self.angles[i + 1] - self.angles[i]);
        let along = |p: usize| {
            let of_plane = &self.values[p * self.angles.len()..];
            of_plane[i] * (1.0 - share) + of_plane[i + 1] * share
        };
        let count = self.planes.len();
        if count == 1 {
            return along(0);
        }
        let open = self.kind == 'C' && self.fold == Fold::None && *self.planes.last().unwrap() < 360.0;
        if open && plane > self.planes[count - 1] {
            let share = (plane - self.planes[count - 1]) / (360.0 - self.planes[count - 1]);
            return along(count - 1) * (1.0 - share) + along(0) * share;
        }
        if plane < self.planes[0] || plane > self.planes[count - 1] {
            return 0.0;
        }
        let p = (1..count - 1).take_while(|&p| self.planes[p] <= plane).count();
        let share = (plane - self.planes[p]) / (self.planes[p + 1] - self.planes[p]);
        along(p) * (1.0 - share) + along(p + 1) * share
    }

    /// The angles, in degrees, of a direction of a luminaire that looks down, with C0 along +X: plane, and angle in it.
    pub fn angles_of(&self, [x, y, z]: [f64; 3]) -> (f64, f64) {
        match self.kind {
            // C90 lies along -Z: from above, a quarter turn counter-clockwise from +X.
            'C' => (atan2(-z, x).to_degrees(), atan2((x * x + z * z).sqrt(), -y).to_degrees()),
            // Vertical 90 is +X; horizontal 90 lies clockwise, along +Z.
            _ => (atan2(z, -y).to_degrees(), atan2(x, (y * y + z * z).sqrt()).to_degrees()),
        }
    }

    /// Flux by quadrature: the midpoints of small cells whose edges are angles of the file \[lm\].
    pub fn flux(&self) -> f64 {
        const ACROSS: f64 = 2.5;
        const ALONG: f64 = 0.125;
        let (first, last) = if self.kind == 'C' { (0.0, 180.0) } else { (-90.0, 90.0) };
        let mut sum = 0.0;
        for j in 0..((last - first) / ALONG) as usize {
            let angle = first + ALONG * (j as f64 + 0.5);
            let ring: f64 = (0..144).map(|k| self.intensity(-180.0 + ACROSS * (k as f64 + 0.5), angle)).sum();
            let across = if self.kind == 'C' { sin(angle.to_radians()) } else { cos(angle.to_radians()) };
            sum += ring * ACROSS.to_radians() * across * ALONG.to_radians();
        }
        sum
    }
}
