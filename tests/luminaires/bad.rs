//! Files that are wrong: refused with line, field, value and what is allowed; never a panic.

use crate::{bytes, names};
use lampyris::error::Error;
use lampyris::random::{Domain, Stream};
use lampyris::scene::photometric_web::Photometry;

/// The error of the file `name` with `from` replaced by `to`, once.
fn refusal(name: &str, from: &str, to: &str) -> String {
    let text = String::from_utf8(bytes(name)).unwrap();
    assert!(text.contains(from), "{name} has no {from:?}");
    match Photometry::parse(name, text.replacen(from, to, 1).as_bytes()) {
        Err(error @ Error::Input { .. }) => error.to_string(),
        Err(other) => panic!("another kind of error: {other}"),
        Ok(_) => panic!("{name} with {to:?} was accepted"),
    }
}

#[test]
fn what_is_wrong_in_lm_63_is_named() {
    let head = "1 -1 1 13 13 1 2 0 0 0";
    for (from, to, expected) in [
        (head, "0 -1 1 13 13 1 2 0 0 0", "number of lamps (line 5) = 0: 1 .. 1000000"),
        (head, "1 -2 1 13 13 1 2 0 0 0", "lumens per lamp (line 5) = -2"),
        (head, "1 -1 0 13 13 1 2 0 0 0", "candela multiplier (line 5) = 0: above 0"),
        (head, "1 -1 1 1 13 1 2 0 0 0", "number of vertical angles (line 5) = 1: 2 .. 100000"),
        (head, "1 -1 1 13.5 13 1 2 0 0 0", "number of vertical angles (line 5) = 13.5: a whole number"),
        (head, "1 -1 1 99999 99999 1 2 0 0 0", "vertical angles (line 7) = 195 to the end of the file: 99999 numbers"),
        (head, "1 -1 1 13 13 4 2 0 0 0", "photometric type (line 5) = 4: 1 .. 3"),
        (head, "1 -1 1 13 13 1 0 0 0 0", "units (line 5) = 0: 1 .. 2"),
        (head, "1 -1 1 13 13 1 2 nan 0 0", "width (line 5) = nan"),
        (head, "1 -1 1 13 13 1 2 0 0", "vertical angles"),
        (head, "1 -1 1 13 12 1 2 0 0 0", "candela values (line 20) = 14 more numbers"),
        ("1 1 20", "0 1 20", "ballast factor (line 6) = 0: above 0"),
        ("1 1 20", "1 1 -20", "input watts (line 6) = -20: 0 .. 1e9 W"),
        ("0 15 30", "0 15 15", "vertical angles (line 7) = 15 after 15"),
        ("0 15 30", "-5 15 30", "vertical angles (line 7) = -5: 0 .. 180 degrees"),
        ("0 30 60", "5 30 60", "planes (line 8) = 5 .. 360 degrees"),
        ("320 324.619", "-320 324.619", "candela values (line 9) = -320: 0 .. 1e12 cd"),
        ("320 324.619", "inf 324.619", "candela values (line 9) = inf"),
        ("320 324.619", "1e13 324.619", "candela values (line 9) = 1e13"),
        ("320 324.619", "320 324.619 7", "1 more numbers"),
        ("TILT=NONE", "TILT=lamp.tlt", "TILT (line 4) = lamp.tlt: NONE, or INCLUDE with the table"),
        ("TILT=NONE", "TILT=INCLUDE", "pairs of angles and factors (line 5) = -1: 1 .. 1000"),
    ] {
        let message = refusal("full.ies", from, to);
        assert!(message.contains(expected), "{to}: {message}");
    }
    let as_c = refusal("type_b.ies", "1 -1 1 13 13 2", "1 -1 1 13 13 1");
    assert!(as_c.contains("vertical angles (line 7) = -90: 0 .. 180 degrees"), "{as_c}");
    assert!(refusal("tilt_include.ies", "0 45 90\n", "5 45 90\n").contains("tilt angles (line 7) = 5: 0 as the first"));
    assert!(refusal("wedge.ies", "0 1000 0", "0 0 0").contains("no flux"));
}

#[test]
fn what_is_wrong_in_eulumdat_is_named() {
    let line = |n: usize, to: &str| {
        let text = String::from_utf8(bytes("symmetry_3.ldt")).unwrap();
        let mut lines: Vec<&str> = text.lines().collect();
        lines[n - 1] = to;
        match Photometry::parse("x.ldt", lines.join("\r\n").as_bytes()) {
            Err(error @ Error::Input { .. }) => error.to_string(),
            other => panic!("line {n} = {to:?}: {other:?}"),
        }
    };
    for (n, to, expected) in [
        (3, "5", "symmetry (line 3) = 5: 0 .. 4"),
        (4, "10", "number of C-planes (line 4) = 10: a multiple of 4"),
        (4, "", "number of C-planes (line 4)"),
        (6, "1", "number of angles (line 6) = 1"),
        (6, "100000", "angles G"),
        (17, "wide", "width of the luminous area (line 17) = wide"),
        (23, "-1", "light output ratio (line 23) = -1"),
        (24, "0", "conversion factor (line 24) = 0"),
        (26, "0", "sets of lamps (line 26) = 0"),
        (27, "0", "number of lamps (line 27) = 0"),
        (29, "-100", "flux of the lamps (line 29) = -100"),
        (44, "0", "angles C (line 44) = 0"),
        (52, "275", "planes from -90 to 90"),
        (68, "-3", "intensities (line 68) = -3"),
    ] {
        let message = line(n, to);
        assert!(message.contains(expected), "line {n} = {to}: {message}");
    }
    let empty = Photometry::parse("empty.ldt", b"").unwrap_err().to_string();
    assert!(
        empty.contains("file (line 1) = empty: IES LM-63, in which a line begins with TILT=, or EULUMDAT"),
        "{empty}"
    );
    let binary = Photometry::parse("picture.ies", b"\x89PNG\0\0").unwrap_err().to_string();
    assert!(binary.contains("text"), "{binary}");
}

#[test]
fn what_is_no_photometric_file_at_all_is_said_so() {
    let full = String::from_utf8(bytes("full.ies")).unwrap();
    for (content, begins) in [
        (&b"\n\n"[..], "(line 1) = empty"),
        (b"hello\nworld", "(line 1) = hello"),
        (b"\n<!DOCTYPE html>\n<html>404</html>", "(line 2) = <!DOCTYPE html>"),
        (b"{ \"asset\": {} }", "(line 1) = { \"asset\""),
        (full.replace("TILT=NONE\n", "").as_bytes(), "(line 1) = IESNA:LM-63-2002"),
    ] {
        let said = Photometry::parse("x.ies", content).unwrap_err().to_string();
        let wanted = format!("x.ies: file {begins}");
        assert!(said.starts_with(&wanted) && said.contains("IES LM-63, in which a line begins with TILT="), "{said}");
    }
    let utf_16: Vec<u8> = full.encode_utf16().flat_map(u16::to_le_bytes).collect();
    let said = Photometry::parse("x.ies", &utf_16).unwrap_err().to_string();
    assert!(said.contains("bytes of value 0: text in UTF-8 or Latin-1"), "{said}");
}

#[test]
fn what_is_odd_is_a_warning() {
    let full = String::from_utf8(bytes("full.ies")).unwrap();
    let warnings = |text: &str| Photometry::parse("x.ies", text.as_bytes()).unwrap().warnings;
    for (from, to, expected) in [
        ("IESNA:LM-63-2002", "\nIESNA:LM-63-2002", ""),
        ("\n", "\r\r\n", ""),
        ("IESNA:LM-63-2002\n", "", "its first line names no edition"),
        ("LM-63-2002", "LM-63-2050", "the edition `IESNA:LM-63-2050` is not known"),
        ("13 13 1 2 0 0 0", "13 13 1 2 600 600 0", "its luminous opening is 600 m long"),
        ("13 13 1 2 0 0 0", "13 13 1 2 0.0006 0.0006 0", "its luminous opening is 0.0006 m long"),
    ] {
        assert!(full.contains(from), "{from}");
        let found = warnings(&full.replace(from, to));
        assert!(
            found.len() == usize::from(!expected.is_empty()) && found.concat().contains(expected),
            "{to}: {found:?}"
        );
    }
    // The first edition had neither such a line nor keywords.
    assert_eq!(warnings(&String::from_utf8(bytes("edition_1986.ies")).unwrap()), [""; 0]);
}

#[test]
fn no_bytes_whatever_end_in_a_panic() {
    for name in names() {
        let whole = bytes(&name);
        let mut rng = Stream::new(3, Domain::Trajectory, &name).generator(0);
        for cut in (0..whole.len()).step_by(1 + whole.len() / 60) {
            let _ = Photometry::parse(&name, &whole[..cut]);
        }
        for _ in 0..300 {
            let mut damaged = whole.clone();
            for _ in 0..1 + rng.below(4) {
                let at = rng.below(damaged.len() as u32) as usize;
                damaged[at] = b"0123456789 .,-e\n\r\x1a\xff[]=N"[rng.below(23) as usize];
            }
            if let Ok(photometry) = Photometry::parse(&name, &damaged) {
                assert!(photometry.flux() > 0.0 && photometry.flux().is_finite());
            }
        }
    }
}
