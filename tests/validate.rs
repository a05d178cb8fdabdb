//! `lampyris validate`: which cases there are, what it refuses, and the document it writes.

mod common;

use common::battery::{THEMES, validate};
use std::fs;

#[test]
fn every_case_belongs_to_a_theme_that_a_test_runs() {
    for case in lampyris::validate::cases() {
        assert!(THEMES.iter().any(|t| case.name.starts_with(t)), "{}", case.name);
    }
}

#[test]
fn an_unknown_case_is_refused_with_the_names_of_all() {
    let output = validate(&["--case", "radiosity"]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0), "{said}");
    for case in lampyris::validate::cases() {
        assert!(said.contains(case.name), "{} is not named: {said}", case.name);
    }
}

#[test]
fn a_file_that_cannot_be_written_is_an_error_before_anything_is_computed() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("missing").join("validation.md");
    let output = validate(&["--markdown", file.to_str().unwrap()]);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!((output.status.code(), output.stdout.len()), (Some(1), 0), "{said}");
    assert!(said.contains("validation.md") && said.contains("No such file"), "{said}");
}

/// Cells of the rows of all tables; every table has a head, a rule, and rows of the same width.
fn tables(text: &str) -> Vec<Vec<String>> {
    let cells = |line: &str| line.trim_matches('|').split('|').map(|c| c.trim().to_owned()).collect::<Vec<_>>();
    let lines: Vec<&str> = text.lines().collect();
    let mut rows = Vec::new();
    for table in lines.chunk_by(|a, b| a.starts_with('|') == b.starts_with('|')).filter(|t| t[0].starts_with('|')) {
        let width = cells(table[0]).len();
        assert!(cells(table[1]).iter().all(|c| c.trim_end_matches(':') == "---"), "{}", table[1]);
        for line in &table[2..] {
            assert!(line.ends_with('|') && cells(line).len() == width, "{line}");
            rows.push(cells(line));
        }
    }
    rows
}

#[test]
fn the_document_is_made_of_tables_with_every_comparison() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("validation.md");
    let part = "direct/p";
    let output = validate(&["--case", part, "--markdown", file.to_str().unwrap(), "--note", "Commit abc."]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let text = fs::read_to_string(&file).unwrap();
    assert!(text.contains("\nCommit abc.\n") && text.contains("Only "), "{text}");
    let rows = tables(&text);
    let printed = String::from_utf8(output.stdout).unwrap();
    for case in lampyris::validate::select(Some(part)).unwrap() {
        assert!(rows.iter().any(|r| r.len() == 3 && r[0] == format!("`{}`", case.name)), "{}", case.name);
        let compared: Vec<_> = rows.iter().filter(|r| r.len() == 8 && r[0] == case.name).collect();
        let shown = printed.lines().filter(|l| l.starts_with(case.name)).count();
        assert!(compared.len() == shown && shown > 0, "{}: {} of {shown}", case.name, compared.len());
        assert!(compared.iter().all(|r| r[7] == "yes"), "{compared:?}");
    }
}
