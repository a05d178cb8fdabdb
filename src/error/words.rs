//! Values, names and types as messages show them.

/// Longest value repeated in a message \[characters\]: a data URI may hold a whole scene.
const LONGEST: usize = 400;
/// Digits beyond which a number is shown with a power of ten; every f64 of ordinary size and every u64 has fewer.
const DIGITS: usize = 24;
/// Most names that a message lists.
const MOST_NAMES: usize = 20;

/// `value` as it would be typed: numbers of many digits with a power of ten, a line of anything else, and no character that a terminal
/// would obey.
pub(super) fn shown(value: &str) -> String {
    if value.is_empty() {
        return "(empty)".to_owned();
    }
    if value.len() > DIGITS
        && let Ok(number) = value.parse::<f64>()
    {
        return format!("{number:e}");
    }
    let visible = |c: char| if c.is_control() { c.escape_default().collect() } else { vec![c] };
    let cut: String = value.chars().take(LONGEST).flat_map(visible).collect();
    if value.chars().nth(LONGEST).is_some() { cut + "..." } else { cut }
}

/// What a message says of `names` to someone who typed `typed`, which is none of them: those most like it first, no more than a
/// reader will read.
pub fn listed<'a>(typed: &str, names: impl IntoIterator<Item = &'a str>) -> String {
    let mut names: Vec<&str> = names.into_iter().collect();
    names.sort_unstable();
    names.dedup();
    let folded = typed.to_lowercase();
    names.sort_by_key(|name| (!name.to_lowercase().contains(&folded), edits(typed, name)));
    let more = names.len().saturating_sub(MOST_NAMES);
    names.truncate(MOST_NAMES);
    match (names.is_empty(), more) {
        (true, _) => "there are none".to_owned(),
        (_, 0) => names.join(", "),
        _ => format!("{}, and {more} more", names.join(", ")),
    }
}

/// How many characters must be put in, left out or changed to make `b` of `a`; capitals do not count.
fn edits(a: &str, b: &str) -> usize {
    let [a, b] = [a, b].map(|name| name.chars().take(LONGEST).flat_map(char::to_lowercase).collect::<Vec<char>>());
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, from) in a.iter().enumerate() {
        let mut before = std::mem::replace(&mut row[0], i + 1);
        for (j, to) in b.iter().enumerate() {
            let changed = before + usize::from(from != to);
            before = row[j + 1];
            row[j + 1] = changed.min(before + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

/// What serde means by `expected`, which speaks of the types of Rust.
pub fn in_words(expected: &str) -> String {
    match expected {
        "f64" => "a number".to_owned(),
        "u8" | "u32" | "u64" | "usize" => "a whole number, 0 or more".to_owned(),
        "a string" | "variant identifier" => "text in quotation marks".to_owned(),
        "a boolean" => "true or false".to_owned(),
        "a sequence" => "a list in brackets".to_owned(),
        _ => {
            let list = expected.strip_prefix("an array of length ").or(expected.strip_suffix(" elements in sequence"));
            list.map_or(expected.to_owned(), |length| format!("{length} numbers in brackets"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_shown_as_they_would_be_typed() {
        let cases = [
            (1e300.to_string(), "1e300".to_owned()),
            ((-1e-300).to_string(), "-1e-300".to_owned()),
            (String::new(), "(empty)".to_owned()),
            (u64::MAX.to_string(), u64::MAX.to_string()),
            (0.1f64.to_string(), "0.1".to_owned()),
            ("a\u{1b}[2J\nb".to_owned(), "a\\u{1b}[2J\\nb".to_owned()),
            ("Stra\u{df}e".to_owned(), "Stra\u{df}e".to_owned()),
            ("x".repeat(900), "x".repeat(LONGEST) + "..."),
        ];
        for (value, expected) in cases {
            assert_eq!(shown(&value), expected);
        }
    }

    #[test]
    fn names_are_listed_by_likeness() {
        let names = ["floor", "ceiling", "wall 0.6", "desk", "desk"];
        assert_eq!(listed("Dsk", names), "desk, floor, ceiling, wall 0.6");
        assert_eq!(listed("wall", names), "wall 0.6, desk, floor, ceiling");
        assert_eq!(listed("x", []), "there are none");
        let many: Vec<String> = (0..500).map(|i| format!("chair {i}")).collect();
        let text = listed("chair 77", many.iter().map(String::as_str));
        assert!(text.starts_with("chair 77, ") && text.ends_with(", and 480 more"), "{text}");
        assert_eq!(
            [("", ""), ("lamp", ""), ("lamp", "Lamp"), ("lmap", "lamp"), ("lamp1", "lamp")].map(|(a, b)| edits(a, b)),
            [0, 4, 0, 2, 1]
        );
    }
}
