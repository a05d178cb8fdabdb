//! Wavefront OBJ: vertices and faces. Everything else in such a file says how a surface looks, not where it is.
//!
//! Polygons become fans of triangles around their first corner, which is right for convex ones.

use super::input::{MOST, Soup};
use crate::error::{Error, Result};
use crate::math::DVec3;

/// Largest coordinate \[m\].
const FARTHEST: f64 = 1e12;

/// The triangles of the OBJ file `name` with the content `bytes`.
///
/// # Errors
/// [`Error::Input`] with the line, for a coordinate or a corner that cannot be one.
pub fn parse(name: &str, bytes: &[u8]) -> Result<Soup> {
    let text = String::from_utf8_lossy(bytes);
    let mut soup = Soup::default();
    for (i, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        let bad = |value: &str, allowed: &str| Error::input(name, format!("line {}", i + 1), value, allowed);
        match words.next() {
            Some("v") => soup.positions.push(position(words).ok_or_else(|| bad(line, "`v` and three numbers [m]"))?),
            Some("f") => {
                let count = soup.positions.len();
                let corners: Option<Vec<u32>> = words.map(|word| corner(word, count)).collect();
                let corners = corners.filter(|c| c.len() >= 3).ok_or_else(|| {
                    bad(line, &format!("`f` and three corners or more, numbers of the {count} vertices above it"))
                })?;
                soup.triangles.extend(corners[1..].windows(2).map(|pair| [corners[0], pair[0], pair[1]]));
            }
            _ => {}
        }
        if soup.positions.len().max(soup.triangles.len()) > MOST {
            return Err(bad(line, &format!("at most {MOST} vertices and as many triangles")));
        }
    }
    Ok(soup)
}

fn position<'a>(mut words: impl Iterator<Item = &'a str>) -> Option<DVec3> {
    // Written so that NaN fails.
    let mut next = || words.next()?.parse().ok().filter(|x: &f64| x.abs() <= FARTHEST);
    Some(DVec3::new(next()?, next()?, next()?))
}

/// The vertex that `17`, `17/3/5` or, counted from the last of `count`, `-1` means.
fn corner(word: &str, count: usize) -> Option<u32> {
    let number: i64 = word.split('/').next()?.parse().ok()?;
    let index = if number < 0 { number.checked_add(count as i64)? } else { number - 1 };
    u32::try_from(index).ok().filter(|&index| (index as usize) < count)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_counted_from_either_end_and_polygons_become_fans() {
        let text = "# a square\nv 0 0 0\nv 1 0 0 1.0\nv 1 1 0\nvn 0 0 1\nv 0 1 0\nf 1/1/1 2//1 -2 4\n";
        let soup = parse("x.obj", text.as_bytes()).unwrap();
        assert_eq!(soup.positions.len(), 4);
        assert_eq!(soup.triangles, [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn what_is_no_face_or_vertex_is_named_with_its_line() {
        let cases = [
            ("v 0 0", "line 1 = v 0 0: `v` and three numbers"),
            ("v 0 nan 0", "line 1"),
            ("v 0 1e13 0", "line 1"),
            ("v 0 0 0\nf 1 1", "line 2 = f 1 1: `f` and three corners or more, numbers of the 1 vertices"),
            ("v 0 0 0\nf 1 1 2", "line 2"),
            ("v 0 0 0\nf 0 1 1", "line 2"),
            ("v 0 0 0\nf 1 1 -2", "line 2"),
            ("v 0 0 0\nf 1 1 -9223372036854775808", "line 2"),
            ("v 0 0 0\nf 1 1 x", "line 2"),
        ];
        for (text, fragment) in cases {
            let said = parse("x.obj", text.as_bytes()).unwrap_err().to_string();
            assert!(said.contains(fragment), "{text}: {said}");
        }
    }
}
