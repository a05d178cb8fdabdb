//! What the files mean: intensities and fluxes against the second reading, and what is said about each trap.

use crate::{hanging, naive, names, photometry};
use lampyris::math::{DVec2, PI};
use lampyris::random::{Domain, Stream, sphere};
use lampyris::scene::photometric_web::{Shape, Symmetry};

#[test]
fn intensities_in_a_thousand_directions_are_those_of_a_second_reading() {
    for name in names() {
        let (file, naive) = (photometry(&name), naive::read(&name));
        let luminaire = hanging(&file);
        let mut rng = Stream::new(7, Domain::Trajectory, &name).generator(0);
        let mut lit = 0;
        for _ in 0..1000 {
            let direction = sphere(rng.uniform2());
            let (plane, angle) = naive.angles_of(direction.to_array());
            let (found, expected) = (luminaire.intensity(direction).luminance(), naive.intensity(plane, angle));
            let tolerance = 1e-9 * file.web.peak();
            assert!((found - expected).abs() <= tolerance, "{name} at {plane}, {angle}: {found} cd, not {expected}");
            lit += u32::from(expected > 0.0);
        }
        assert!(lit > 10, "{name}: dark in all but {lit} directions");
    }
}

#[test]
fn fluxes_are_those_of_quadrature() {
    for name in names() {
        let (found, expected) = (photometry(&name).flux(), naive::read(&name).flux());
        // The midpoint rule over an eighth of a degree errs by 2e-7.
        assert!((found / expected - 1.0).abs() < 1e-6, "{name}: {found} lm, not {expected}");
    }
}

#[test]
fn fluxes_with_a_closed_form_are_exact() {
    assert!((photometry("omni_1000lm.ies").flux() - 1000.0).abs() < 1e-9);
    // I = 100 + G with G in degrees, from 0 to 90: 2 pi (100 + 180/pi) times the factors.
    let ramp = 2.0 * PI * (100.0 + 180.0 / PI);
    for (name, factor) in [
        ("edition_1986.ies", 1.0),
        ("factors_1991.ies", 2.5 * 0.9 * 0.8),
        ("factors_1995.ies", 2.5 * 0.9),
        ("factors_2019.ies", 2.5 * 0.9),
    ] {
        let flux = photometry(name).flux();
        assert!((flux / (factor * ramp) - 1.0).abs() < 1e-12, "{name}: {flux}");
    }
}

#[test]
fn symmetries_are_named() {
    let symmetry = |name: &str| photometry(name).symmetry;
    for (name, expected) in [
        ("omni_1000lm.ies", Symmetry::Axial),
        ("symmetry_1.ldt", Symmetry::Axial),
        ("quadrant.ies", Symmetry::Quadrants),
        ("symmetry_4.ldt", Symmetry::Quadrants),
        ("half_0_180.ies", Symmetry::Plane(0.0)),
        ("symmetry_2.ldt", Symmetry::Plane(0.0)),
        ("half_90_270.ies", Symmetry::Plane(90.0)),
        ("half_minus90_90.ies", Symmetry::Plane(90.0)),
        ("symmetry_3.ldt", Symmetry::Plane(90.0)),
        ("full_without_360.ies", Symmetry::None),
        ("type_b.ies", Symmetry::None),
        ("type_b_mirrored.ies", Symmetry::Mirrored { horizontal: true, vertical: true }),
    ] {
        assert_eq!(symmetry(name), expected, "{name}");
    }
}

#[test]
fn openings_have_their_shape_in_metres() {
    let opening = |name: &str| {
        let o = photometry(name).opening;
        (o.shape, [o.width, o.length, o.height].map(|x| (x * 1e6).round() / 1e6))
    };
    assert_eq!(opening("feet.ies"), (Shape::Box, [0.6096, 1.2192, 0.1524]));
    assert_eq!(opening("round_1995.ies"), (Shape::Disc, [0.3, 0.3, 0.0]));
    assert_eq!(opening("lambert_100lm.ies"), (Shape::Disc, [0.2, 0.2, 0.0]));
    assert_eq!(opening("sphere_2002.ies"), (Shape::Sphere, [0.4, 0.4, 0.4]));
    assert_eq!(opening("full.ies"), (Shape::Point, [0.0; 3]));
    // The length of EULUMDAT lies along C90, where LM-63 has its width.
    assert_eq!(opening("symmetry_4.ldt"), (Shape::Rectangle, [1.2, 0.3, 0.0]));
    assert_eq!(opening("absolute.ldt"), (Shape::Disc, [0.15, 0.15, 0.0]));
}

#[test]
fn lamps_and_stated_fluxes_are_compared_with_the_web() {
    let warned = |name: &str, text: &str| photometry(name).warnings.iter().any(|w| w.contains(text));
    assert_eq!(photometry("relative.ies").lamps, Some((2.0, 4800.0)));
    assert_eq!(photometry("edition_1986.ies").lamps, Some((2.0, 6000.0)));
    assert_eq!(photometry("full.ies").lamps, None);
    assert_eq!(photometry("absolute.ldt").lamps, None);
    assert!(photometry("relative.ies").warnings.is_empty());
    assert!(warned("more_than_its_lamps.ies", "more than the 2000.0 lm"));
    assert!(warned("wrong_ratio.ldt", "the file states 8000.0 lm (-68.6 %)"));
    assert!(photometry("symmetry_0.ldt").warnings.is_empty());
    assert!(warned("two_sets_by_set.ldt", "of 2 sets of lamps the first is used"));
    assert!(warned("conversion.ldt", "measured at a tilt of 15 degrees"));
    assert!(warned("commas_as_points.ies", "decimal marks"));
    assert!(!warned("commas_between.ies", "decimal marks"));
    assert_eq!(photometry("latin_1.ies").labels, [("MANUFAC".to_owned(), "Gl\u{fc}hlampenwerk \u{a7} 2".to_owned())]);
}

#[test]
fn the_web_has_no_seam_where_its_planes_close() {
    for name in ["full.ies", "full_without_360.ies", "quadrant.ies", "half_90_270.ies", "omni_1000lm.ies"] {
        let web = photometry(name).web;
        for turn in [-4.0, -2.0, 0.0, 2.0, 4.0] {
            let (below, above) = (web.intensity(1.0, turn * PI - 1e-12), web.intensity(1.0, turn * PI + 1e-12));
            assert!(below > 0.0 && (below / above - 1.0).abs() < 1e-9, "{name} at {turn} pi: {below} {above}");
            let exact = web.intensity(1.0, turn * PI);
            assert!((exact / above - 1.0).abs() < 1e-9, "{name} at {turn} pi: {exact}");
        }
        assert!(web.intensity(0.0, 0.3) > 0.0);
        let (t, _) = web.sample(DVec2::new(0.0, 0.5));
        assert!(t < 1e-6);
    }
}
