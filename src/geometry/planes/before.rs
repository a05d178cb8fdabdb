//! What rays have crossed before some share of their way: planes that count no more.

use super::super::simd::{Isa, Vector};
use super::{Directions, Planes, Rows, abs, along, dot, splat};

impl<I: Isa> Planes<I> {
    /// The triangles whose planes all directions of a box have surely crossed before the share `start` of them.
    #[inline(always)]
    pub(in crate::geometry) fn before_all(&self, directions: &Directions, start: f32) -> u32 {
        let (center, half) = (splat::<I>(directions.center), splat::<I>(directions.half));
        let least = dot::<I>(self.face, center).sub(dot::<I>(abs::<I>(self.face), half));
        let crossed = least.mul(I::Eight::splat(start)).sub(self.volume);
        I::Eight::splat(self.face_tolerance).less(crossed) & !self.doubtful
    }

    /// The triangles whose planes the segment along `d` has surely crossed before the share `start` of it.
    #[inline(always)]
    pub(in crate::geometry) fn before(&self, d: [f32; 3], start: f32) -> u32 {
        let crossed = dot::<I>(self.face, splat::<I>(d)).mul(I::Eight::splat(start)).sub(self.volume);
        I::Eight::splat(self.face_tolerance).less(crossed) & !self.doubtful
    }
}

impl Rows {
    /// Of 16 rays along `d`, those that have surely crossed the plane of the triangle in `lane` before the shares `starts` of them.
    #[inline(always)]
    pub(in crate::geometry) fn before<I: Isa>(&self, lane: usize, d: &[I::Sixteen; 3], starts: I::Sixteen) -> u32 {
        let crossed = along::<I>(&self.face, lane, d).mul(starts).sub(I::Sixteen::splat(self.volume[lane]));
        let before = I::Sixteen::splat(self.face_tolerance).less(crossed);
        if self.doubtful >> lane & 1 == 1 { 0 } else { before }
    }
}
