//! The battery by the command `lampyris validate`, as a user runs it.

use lampyris::validate;
use std::process::{Command, Output};

/// Beginnings of the names of all cases; each is run by one test.
pub const THEMES: [&str; 11] = [
    "direct/",
    "form-factor/",
    "cavity/",
    "bounce/",
    "cube/",
    "glass/",
    "sobolev/",
    "luminaire/",
    "opening/",
    "reflection/",
    "daylight/",
];

/// Runs `lampyris validate` with `args`.
pub fn validate(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_lampyris")).arg("validate").args(args).output().unwrap()
}

/// Runs the cases of a theme, which must all hold and all stand in the table.
#[track_caller]
pub fn assert_theme(theme: &str) {
    assert!(THEMES.contains(&theme));
    let output = validate(&["--case", theme]);
    let (text, said) = (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    println!("{text}");
    assert_eq!(output.status.code(), Some(0), "{said}{text}");
    for case in validate::select(Some(theme)).unwrap() {
        assert!(text.lines().any(|line| line.starts_with(case.name)), "{} is not in the table:\n{text}", case.name);
    }
}
