//! Any x86-64 CPU: the C library chooses its functions by CPU, and masks choose others.

use crate::bits::{Bits, summary};
use crate::place::{Place, straight};
use crate::process::{expect, lampyris, run_quietly};
use lampyris::geometry::simd::{self, Path};
use std::process::Command;

/// Names of glibc 2.36 (sysdeps/x86/cpu-tunables.c). An unknown one would be ignored silently, so it is checked that
/// each mask changes what the loader thinks of this CPU.
const MASKS: [&str; 3] =
    ["-FMA", "-AVX2,-AVX512F", "-AVX,-AVX2,-AVX512F,-FMA,-FMA4,-BMI1,-BMI2,-SSE4_1,-SSE4_2,-SSSE3,-ERMS,-FSRM"];

fn masked(command: &mut Command, mask: &str) -> String {
    expect(0, command.env("GLIBC_TUNABLES", format!("glibc.cpu.hwcaps={mask}")))
}

/// What the loader thinks of this CPU under a mask: its lines on active features.
fn active(mask: &str) -> Vec<String> {
    let said = masked(Command::new("/lib64/ld-linux-x86-64.so.2").arg("--list-diagnostics"), mask);
    let lines: Vec<String> = said.lines().filter(|l| l.contains(".active[")).map(str::to_owned).collect();
    assert!(!lines.is_empty(), "the loader says nothing of active features");
    lines
}

#[test]
fn masked_cpus_give_the_same_bits() {
    let place = Place::new();
    let plain = active("");
    for (i, mask) in MASKS.into_iter().enumerate() {
        assert_ne!(active(mask), plain, "{mask} masks nothing");
        let dir = place.path(&i.to_string());
        masked(&mut run_quietly(&place.path("job.toml"), &dir, 2), mask);
        Bits::of(&dir).assert_same(&straight().bits);
        masked(lampyris(&["merge"]).arg(&dir), mask);
        Bits::of(&dir).assert_same(&straight().bits);
    }
}

#[test]
fn every_path_of_the_kernels_gives_the_same_bits_and_is_named() {
    let place = Place::new();
    for path in Path::ALL.into_iter().filter(|path| path.is_available()) {
        let dir = place.path(path.name());
        expect(0, run_quietly(&place.path("job.toml"), &dir, 2).env(simd::VARIABLE, path.name()));
        Bits::of(&dir).assert_same(&straight().bits);
        assert_eq!(summary(&dir)["instructions"], serde_json::json!([path.name()]));
    }
}

/// Hash of many values of functions of the C library.
#[expect(clippy::disallowed_methods, reason = "shows that the masks change the bits of what lampyris must not use")]
fn c_library_bits() -> blake3::Hash {
    let mut hasher = blake3::Hasher::new();
    for i in 1..200_000 {
        let x = f64::from(i) * 1.0e-4;
        for value in [x.sin(), x.exp(), x.ln(), x.powf(2.2), x.atan()] {
            hasher.update(&value.to_bits().to_le_bytes());
        }
    }
    hasher.finalize()
}

/// Run by the next test in processes of its own; alone it only shows that a process agrees with itself.
#[test]
fn probe_of_the_c_library() {
    assert_eq!(c_library_bits(), c_library_bits());
    println!("probe {}", c_library_bits());
}

#[test]
fn the_masks_do_change_the_bits_of_the_c_library() {
    if !std::arch::is_x86_feature_detected!("fma") {
        return; // There is one variant only on such a CPU: nothing to mask.
    }
    let probe = |mask| {
        let mut command = Command::new(std::env::current_exe().unwrap());
        let said = masked(command.args(["--exact", "cpu::probe_of_the_c_library", "--nocapture"]), mask);
        said.lines().find_map(|l| Some(l.split_once("probe ")?.1.to_owned())).expect("the probe spoke")
    };
    let plain = probe("");
    assert_eq!(plain, probe(""));
    assert_ne!(plain, probe(MASKS[0]), "sin, exp, ln, powf and atan have the same bits without FMA");
}
