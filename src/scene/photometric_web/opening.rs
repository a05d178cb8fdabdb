//! The luminous opening of a luminaire: a shape by the signs of three numbers.

/// Shape of the part that shines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// No extent is given.
    Point,
    /// A rectangle that looks along the aim.
    Rectangle,
    /// A box that shines on its sides, too.
    Box,
    /// A circle or an ellipse that looks along the aim.
    Disc,
    /// A cylinder around the aim.
    UprightCylinder,
    /// A sphere or an ellipsoid.
    Sphere,
    /// A cylinder along the length.
    CylinderAlongLength,
    /// A cylinder along the width.
    CylinderAlongWidth,
    /// A circle or an ellipse that looks along the C0 direction.
    UprightDisc,
    /// Signs that no edition of LM-63 has: nobody knows what is meant.
    Unknown,
}

/// The luminous opening.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Opening {
    /// Its shape.
    pub shape: Shape,
    /// Along the plane C90-C270 \[m\].
    pub width: f64,
    /// Along the plane C0-C180 \[m\].
    pub length: f64,
    /// Along the aim \[m\].
    pub height: f64,
}

impl Opening {
    /// The opening with the dimensions of an LM-63 file: a round one has negative numbers, from 2002 on in both directions
    /// in which it is round, before in one of them, the other being 0 \[m\].
    pub(super) fn of_lm63(width: f64, length: f64, height: f64) -> Opening {
        let sign = |x: f64| i32::from(x > 0.0) - i32::from(x < 0.0);
        let shape = match (sign(width), sign(length), sign(height)) {
            (0, 0, 0) => Shape::Point,
            (-1, -1, 0) | (-1, 0, 0) | (0, -1, 0) | (-1, 1, 0) | (1, -1, 0) => Shape::Disc,
            (-1, -1, 1) | (-1, 0, 1) | (0, -1, 1) | (-1, 1, 1) | (1, -1, 1) => Shape::UprightCylinder,
            (-1, -1, -1) => Shape::Sphere,
            (-1, 0, -1) if width == height => Shape::Sphere,
            (-1, 0, -1) => Shape::UprightDisc,
            (-1, 1, -1) | (0, 1, -1) => Shape::CylinderAlongLength,
            (1, -1, -1) | (1, 0, -1) => Shape::CylinderAlongWidth,
            (1, 1, 0) => Shape::Rectangle,
            (0 | 1, 0 | 1, 0 | 1) => Shape::Box,
            _ => Shape::Unknown,
        };
        let [mut width, mut length, height] = [width, length, height].map(f64::abs);
        if matches!(shape, Shape::Disc | Shape::UprightCylinder | Shape::Sphere) {
            // One diameter stands for both.
            (width, length) = (if width > 0.0 { width } else { length }, if length > 0.0 { length } else { width });
        }
        match shape {
            Shape::CylinderAlongLength if width == 0.0 => width = height,
            Shape::CylinderAlongWidth if length == 0.0 => length = height,
            _ => {}
        }
        Opening { shape, width, length, height }
    }

    /// True where light can leave it: not of a point, nor of a line, nor of what is unknown.
    pub fn has_area(&self) -> bool {
        let Opening { width, length, height, .. } = *self;
        match self.shape {
            Shape::Point | Shape::Unknown => false,
            Shape::Rectangle | Shape::Disc => width * length > 0.0,
            Shape::UprightDisc => width * height > 0.0,
            _ => width * length + length * height + height * width > 0.0,
        }
    }

    /// The opening with the dimensions of a EULUMDAT file, whose length lies along C90-C270, and is a diameter where the width
    /// is 0 \[m\].
    pub(super) fn of_eulumdat(length: f64, width: f64, height: f64) -> Opening {
        let (shape, other) = match (length > 0.0, width > 0.0, height > 0.0) {
            (false, ..) => (Shape::Point, width),
            (_, true, false) => (Shape::Rectangle, width),
            (_, true, true) => (Shape::Box, width),
            (_, false, false) => (Shape::Disc, length),
            (_, false, true) => (Shape::UprightCylinder, length),
        };
        Opening { shape, width: length, length: other, height }
    }
}
