//! The law in lanes of f32 against its twin in f64, and its bits on every path.

use super::sheets::SHEETS;
use super::{ALPHAS, BASE, DIELECTRICS, METALLIC, MIRROR, generator, law};
use lampyris::geometry::simd::exact::splat;
use lampyris::geometry::simd::{Isa, Kernel, Path, Vector};
use lampyris::math::{DVec3, Vec3};
use lampyris::photometry::Colour;
use lampyris::random::sphere;
use lampyris::scene::{LawInLanes, Reflectance};

/// The law for one direction and sixteen others, in three channels.
struct Evaluation<'a> {
    law: &'a LawInLanes,
    through: [f32; 3],
    normal: Vec3,
    one: Vec3,
    others: [[f32; 16]; 3],
}

impl Kernel for &Evaluation<'_> {
    type Output = [[f32; 16]; 3];

    #[inline(always)]
    fn run<I: Isa>(self) -> [[f32; 16]; 3] {
        let through = self.through.map(I::Sixteen::splat);
        let other = self.others.map(|axis| I::Sixteen::load(&axis));
        let f = self.law.evaluate::<I::Sixteen, 3>(&splat(self.normal), (&splat(self.one), &through), &other);
        let mut lanes = [[0.0; 16]; 3];
        f.into_iter().zip(&mut lanes).for_each(|(f, lanes)| f.store(lanes));
        lanes
    }
}

/// Sixteen directions around the one mirrored, as far from it as lobes are wide and more.
fn around(mirrored: DVec3, rng: &mut lampyris::random::Generator) -> [Vec3; 16] {
    [0; 16].map(|_| {
        let far = 3.0 * rng.uniform() * rng.uniform() * rng.uniform() * rng.uniform();
        (mirrored + far * sphere(rng.uniform2())).normalize().as_vec3()
    })
}

/// Compares law by law; a black channel, which reflects at grazing incidence alone, by the measure of the others.
fn check(law: &Reflectance, tolerance: f64) {
    let lanes = law.lanes().expect("no Lambert surface");
    let mut rng = generator(17);
    for _ in 0..400 {
        let normal = sphere(rng.uniform2()).as_vec3();
        let one = sphere(rng.uniform2()).as_vec3();
        let (n, from) = (normal.as_dvec3(), one.as_dvec3());
        let others = around(2.0 * from.dot(n) * n - from, &mut rng);
        let through = law.through(from.dot(n)).0.map(|c| c as f32);
        let columns = [others.map(|o| o.x), others.map(|o| o.y), others.map(|o| o.z)];
        let evaluation = Evaluation { law: lanes, through, normal, one, others: columns };
        let plain = Path::Scalar.run(&evaluation);
        for path in Path::ALL.into_iter().filter(|p| p.is_available()) {
            assert_eq!(path.run(&evaluation), plain, "{path:?}");
        }
        for (i, other) in others.into_iter().enumerate() {
            let cosines = [from.dot(n), other.as_dvec3().dot(n)];
            let least = cosines[0].abs().min(cosines[1].abs());
            if least < 1e-4 {
                continue;
            }
            // The law goes by the inverse of small cosines, each a sum of three products in f32.
            let tolerance = tolerance + 2e-7 / least;
            let f = law.evaluate(n, -from, other.as_dvec3());
            for (channel, value) in plain.iter().zip(f.0) {
                let error = (f64::from(channel[i]) - value).abs();
                assert!(error <= tolerance * f.max(), "{} against {value} at {cosines:?}", channel[i]);
            }
        }
    }
}

#[test]
fn lanes_of_f32_agree_with_f64() {
    for alpha in ALPHAS {
        for metallic in METALLIC {
            // A unit vector in f32 is off by 6e-8; where the lobe is alpha wide that is 6e-8/alpha of it, to the fourth power.
            check(&law(BASE, metallic, alpha), 2e-6 + 1e-6 / alpha);
        }
    }
    check(&law(Colour::grey(0.5), 0.0, MIRROR), 2e-6);
    for dielectric in DIELECTRICS[..3].iter().chain(&SHEETS) {
        check(&Reflectance::layered(BASE, 0.3, 0.4, *dielectric), 2e-6 + 1e-6 / 0.16);
    }
}

#[test]
fn nothing_is_reflected_from_below_and_nothing_is_lost_to_directions_that_cancel() {
    let law = law(BASE, 0.3, 0.01);
    let lanes = law.lanes().expect("no Lambert surface");
    let grazing = DVec3::new(1.0, 0.0, 1e-9).as_vec3();
    let others = [grazing, -grazing, Vec3::X, -Vec3::X, Vec3::Z, -Vec3::Z, Vec3::new(-1.0, 0.0, 1e-9), Vec3::Y];
    let column = |of: fn(Vec3) -> f32| std::array::from_fn(|i| of(others[i % others.len()]));
    for one in [grazing, Vec3::X, -Vec3::Z, Vec3::Z] {
        let others = [column(|o| o.x), column(|o| o.y), column(|o| o.z)];
        let evaluation = Evaluation { law: lanes, through: [1.0; 3], normal: Vec3::Z, one, others };
        for path in Path::ALL.into_iter().filter(|p| p.is_available()) {
            let f = path.run(&evaluation);
            for (i, other) in column(|o| o.z).into_iter().enumerate() {
                assert!(f.iter().all(|f| f[i].is_finite() && f[i] >= 0.0), "{f:?}");
                assert!((one.z > 0.0 && other > 0.0) || f.iter().all(|f| f[i] == 0.0), "{f:?}");
            }
        }
    }
}
