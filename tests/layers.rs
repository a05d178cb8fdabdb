//! The layering rules, checked on the text of `src`: a module imports only from lower layers, or from its own
//! folder; threads, files, printing, clocks and generators stay where they belong. No list of exceptions.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Top modules, lowest first. `error` may be imported by all, `cli` and `commands` belong to the binary.
const LAYERS: [&[&str]; 9] = [
    &["error"],
    &["math"],
    &["random", "photometry"],
    &["job", "geometry"],
    &["tally", "scene"],
    &["transport"],
    &["farm"],
    &["report"],
    &["validate", "fit"],
];

/// Inside `farm`, lowest first; modules of one row do not know each other.
const FARM: [&[&str]; 9] = [
    &["plan", "durable"],
    &["receivers", "thinning"],
    &["regions", "degree"],
    &["local"],
    &["folder", "realization", "pilot"],
    &["inputs", "checkpoint", "attempts"],
    &["status"],
    &["worker", "coordinator", "merge", "audit", "engines"],
    &["testing"],
];

/// The files of the binary, and those in `commands/`: they may import anything, and nothing in the library can import them.
const BINARY: [&str; 3] = ["main.rs", "cli.rs", "commands.rs"];

/// A source file without its tests and comments.
struct Source {
    /// Path below `src`.
    name: String,
    text: String,
}

fn sources() -> Vec<Source> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    collect(&root, &mut files);
    files.sort();
    let read = |path: &PathBuf| {
        let name = path.strip_prefix(&root).unwrap().to_string_lossy().into_owned();
        Source { name, text: code_of(&fs::read_to_string(path).unwrap()) }
    };
    files.iter().map(read).filter(|s| !is_test(&s.name)).collect()
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => collect(&path, files),
            false if path.extension().is_some_and(|e| e == "rs") => files.push(path),
            false => {}
        }
    }
}

fn is_test(name: &str) -> bool {
    name.ends_with("/tests.rs") || name.ends_with("/testing.rs")
}

/// The text up to the unit tests (which stand last), without comments.
fn code_of(text: &str) -> String {
    let code = text.split("#[cfg(test)]").next().unwrap();
    code.lines().map(|line| line.split("//").next().unwrap()).collect::<Vec<_>>().join("\n")
}

fn layer_of(module: &str, layers: &[&[&str]]) -> usize {
    let found = layers.iter().position(|layer| layer.contains(&module));
    found.unwrap_or_else(|| panic!("`{module}` has no layer: give it one in tests/layers.rs and docs"))
}

/// `farm/checkpoint/read.rs` -> [farm, checkpoint, read]; `farm/mod.rs` -> [farm].
fn module_path(name: &str) -> Vec<String> {
    let stem = name.strip_suffix(".rs").unwrap();
    let mut parts: Vec<String> = stem.split('/').map(str::to_owned).collect();
    if parts.last().is_some_and(|p| p == "mod" || p == "lib") {
        parts.pop();
    }
    parts
}

/// Absolute paths (without `crate`) that the code of module `at` mentions after `crate::` or `super::`.
fn imports(at: &[String], code: &str) -> BTreeSet<Vec<String>> {
    let mut found = BTreeSet::new();
    for (start, _) in code.match_indices("crate::") {
        expand(Vec::new(), &code[start + "crate::".len()..], &mut found);
    }
    for (start, _) in code.match_indices("super::") {
        // `super::super::x`: only the whole chain counts.
        if code[..start].ends_with("super::") {
            continue;
        }
        let mut rest = &code[start..];
        let mut base = at.to_vec();
        while let Some(after) = rest.strip_prefix("super::") {
            base.pop();
            rest = after;
        }
        expand(base, rest, &mut found);
    }
    found
}

/// Adds the paths that a use tree such as `a::{b, c::d}` means below `base`.
fn expand(base: Vec<String>, text: &str, found: &mut BTreeSet<Vec<String>>) {
    let end = text.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(text.len());
    let (word, rest) = text.split_at(end);
    let mut path = base;
    if !word.is_empty() {
        path.push(word.to_owned());
    }
    match (word.is_empty(), rest) {
        (false, rest) if rest.starts_with("::") => expand(path, &rest[2..], found),
        (true, rest) if rest.starts_with('{') => {
            for branch in branches(&rest[1..]) {
                expand(path.clone(), branch.trim(), found);
            }
        }
        _ => {
            found.insert(path);
        }
    }
}

/// The comma-separated parts up to the closing brace.
fn branches(text: &str) -> Vec<&str> {
    let (mut depth, mut start, mut parts) = (0, 0, Vec::new());
    for (i, c) in text.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => {
                parts.push(&text[start..i]);
                break;
            }
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(&text[start..i]);
                start = i + 1;
            }
            _ => {}
        }
    }
    parts.into_iter().filter(|p| !p.trim().is_empty()).collect()
}

fn library() -> Vec<Source> {
    let of_binary = |s: &Source| BINARY.contains(&s.name.as_str()) || s.name.starts_with("commands/");
    sources().into_iter().filter(|s| !of_binary(s) && s.name != "lib.rs").collect()
}

#[test]
fn modules_import_from_lower_layers_or_their_own_folder() {
    let mut wrong = Vec::new();
    for source in library() {
        let at = module_path(&source.name);
        let own = layer_of(&at[0], &LAYERS);
        for import in imports(&at, &source.text) {
            let Some(top) = import.first() else { continue };
            if *top != at[0] && layer_of(top, &LAYERS) >= own {
                wrong.push(format!("{} imports {}", source.name, import.join("::")));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn inside_the_farm_workers_coordinator_and_merge_do_not_know_each_other() {
    let mut wrong = Vec::new();
    for source in library().iter().filter(|s| s.name.starts_with("farm/") && s.name != "farm/mod.rs") {
        let at = module_path(&source.name);
        let own = layer_of(&at[1], &FARM);
        for import in imports(&at, &source.text) {
            let [farm, part, ..] = import.as_slice() else { continue };
            if farm == "farm" && *part != at[1] && layer_of(part, &FARM) >= own {
                wrong.push(format!("{} imports {}", source.name, import.join("::")));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn modules_do_not_know_what_is_none_of_their_business() {
    let forbidden: BTreeMap<&str, &[&str]> = BTreeMap::from([
        ("geometry", &["photometry", "job", "random"] as &[&str]),
        ("tally", &["geometry", "scene", "photometry", "random"]),
        ("transport", &["farm"]),
        ("farm/plan", &["scene", "geometry", "transport", "random"]),
        ("farm/merge", &["scene", "geometry", "transport", "random", "photometry"]),
        ("farm/coordinator", &["tally", "photometry", "scene", "geometry", "transport", "random"]),
        ("farm/engines", &["tally", "photometry", "scene", "geometry", "transport", "random"]),
        ("farm/status", &["scene", "geometry", "transport", "random"]),
        ("farm/checkpoint", &["scene", "geometry", "transport", "random"]),
        ("report", &["transport", "random"]),
        ("fit", &["transport", "tally", "random", "photometry", "job"]),
    ]);
    let mut wrong = Vec::new();
    for source in library() {
        let at = module_path(&source.name);
        let rules = forbidden.iter().filter(|(part, _)| at.join("/").starts_with(**part));
        for (part, tops) in rules {
            let imported = imports(&at, &source.text);
            let bad = imported.iter().filter(|i| i.first().is_some_and(|top| tops.contains(&top.as_str())));
            wrong.extend(bad.map(|i| format!("{part}: {} imports {}", source.name, i.join("::"))));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Names of the library's and binary's files that contain one of `words`, apart from those below `allowed`.
fn strays(words: &[&str], allowed: &[&str]) -> Vec<String> {
    let contains = |s: &Source| words.iter().find(|w| s.text.contains(**w)).map(|w| format!("{}: {w}", s.name));
    let outside = |s: &&Source| !allowed.iter().any(|a| s.name.starts_with(a));
    sources().iter().filter(outside).filter_map(contains).collect()
}

#[test]
fn threads_are_where_batches_are_computed_or_merged_and_in_the_loading_of_a_scene() {
    let allowed = [
        "farm/local",
        "farm/realization.rs",
        "farm/receivers/edges.rs",
        "farm/thinning.rs",
        "farm/worker.rs",
        "farm/merge/passes.rs",
        "scene/",
        "geometry/",
    ];
    assert_eq!(strays(&["rayon", "par_iter", "thread::spawn"], &allowed), [""; 0]);
}

#[test]
fn files_are_opened_in_job_farm_report_and_the_input_of_a_fit_only() {
    let words = ["File::", "fs::", "OpenOptions", "tempfile"];
    // The binary makes the folder of a merge's results.
    assert_eq!(strays(&words, &["job/", "farm/", "report/", "fit/input.rs", "commands.rs"]), [""; 0]);
}

#[test]
fn printing_is_in_main_and_the_coordinator_only() {
    let words = ["println!", "print!(", "io::stdout", "io::stderr", "dbg!"];
    assert_eq!(strays(&words, &["main.rs", "farm/coordinator/"]), [""; 0]);
}

#[test]
fn clocks_are_where_somebody_works_watches_or_waits_only() {
    let words = ["std::time", "Instant", "SystemTime"];
    let work = ["farm/worker.rs", "farm/coordinator/"];
    let watch = ["farm/status.rs", "commands/watch.rs"];
    let wait = ["farm/engines/ssh/", "farm/durable.rs", "farm/merge/settle.rs"];
    let allowed = [&work[..], &watch, &wait].concat();
    assert_eq!(strays(&words, &allowed), [""; 0]);
}

#[test]
fn generators_are_built_for_transport_and_farm_only() {
    assert_eq!(strays(&["Stream::new", "Pcg64::new"], &["random/", "transport/", "farm/"]), [""; 0]);
}

#[test]
fn no_unwrap_outside_tests_and_nothing_left_to_do() {
    assert_eq!(strays(&[".unwrap()", "todo!", "unimplemented!"], &[]), [""; 0]);
}

#[test]
fn files_are_small() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    collect(&root, &mut files);
    for path in files {
        let lines = fs::read_to_string(&path).unwrap().lines().count();
        assert!(lines <= 400, "{} has {lines} lines", path.display());
    }
}

#[test]
fn the_parser_of_imports_sees_through_use_trees() {
    let at = ["farm", "checkpoint", "read"].map(str::to_owned);
    let code = "use crate::{error::Error, job::{Kept, SetShape}};\nuse super::{Header, super::plan};\n\
                use super::super::folder::Folder; let x = crate::math::sin(1.0);";
    let found: Vec<String> = imports(&at, code).iter().map(|i| i.join("::")).collect();
    for expected in
        ["error::Error", "job::Kept", "job::SetShape", "farm::checkpoint::Header", "farm::folder::Folder", "math::sin"]
    {
        assert!(found.iter().any(|f| f == expected), "{expected}: {found:?}");
    }
}
