"""What is compared, for how long, and with which settings; the only file to touch for another set of numbers.

The peers' settings are the best of a recorded sweep (`docs/peers-sweep.csv`, written by `run --sweep`); without a
record the first candidate of each list is taken. The candidates of Lampyris are swept in the same way.
"""

import csv
import itertools
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
TARGET = ROOT / "target" / "peers"
SWEEP = ROOT / "docs" / "peers-sweep.csv"
REPORT = ROOT / "docs" / "peers.md"

SCENES = ("room", "cornell", "object")
KINDS = ("grid", "image")
SIDE = {"grid": 32, "image": 256}
PROGRAMS = ("lampyris", "mitsuba", "radiance", "radiance-cache")
# Batches of a run of Lampyris, so that its own error estimate is one; the statistics here do not need it.
LEAST_BATCHES = 16


@dataclass(frozen=True)
class Length:
    """How long things take: CPU seconds of one measured run, of a reference of each program; repetitions; programs."""

    run: float
    reference: float
    repeats: int
    programs: tuple = PROGRAMS


LENGTHS = {
    "quick": Length(run=1.0, reference=5.0, repeats=1, programs=("lampyris", "mitsuba", "radiance")),
    "short": Length(run=4.0, reference=25.0, repeats=3),
    "long": Length(run=20.0, reference=300.0, repeats=5),
}
SWEEP_SECONDS = 1.0


def product(**choices):
    return [dict(zip(choices, values, strict=True)) for values in itertools.product(*choices.values())]


def rtrace(**choices):
    """Radiance options without which a run would be biased: no thresholds, whole lights sampled, roulette, depth."""
    fixed = {"dt": 0, "dc": 1, "dj": 1, "ds": 0, "st": 0, "lr": -100, "ab": 100, "as": 0, "aa": 0}
    return [{**fixed, **choice} for choice in product(**choices)]


def cached(**choices):
    """Options of the irradiance cache: six bounces, weak light left out, lights sampled in parts."""
    fixed = {"dt": 0, "dc": 1, "dj": 1, "ds": 0.03, "st": 0, "u": "-", "ar": 300, "ab": 6, "lw": 1e-2, "as": 0}
    return [{**fixed, **choice} for choice in product(**choices)]


CANDIDATES = {
    ("lampyris", "grid"): product(histories=[4096, 1024, 16384]),
    ("lampyris", "image"): product(histories=[64, 16, 256], pixel_samples=[4, 1]),
    ("mitsuba", "grid"): [
        {"variant": "llvm_ad_mono", "sampler": "multijitter", "samples": 1024, "rr_depth": 5},
        {"variant": "llvm_ad_mono", "sampler": "multijitter", "samples": 256, "rr_depth": 5},
        {"variant": "llvm_ad_mono", "sampler": "multijitter", "samples": 4096, "rr_depth": 5},
        {"variant": "llvm_ad_mono", "sampler": "independent", "samples": 1024, "rr_depth": 5},
        {"variant": "llvm_ad_mono", "sampler": "stratified", "samples": 1024, "rr_depth": 5},
        {"variant": "llvm_ad_mono", "sampler": "orthogonal", "samples": 1024, "rr_depth": 5},
        {"variant": "llvm_ad_mono", "sampler": "ldsampler", "samples": 1024, "rr_depth": 5},
        {"variant": "llvm_ad_mono", "sampler": "multijitter", "samples": 1024, "rr_depth": 2},
        {"variant": "llvm_ad_mono", "sampler": "multijitter", "samples": 1024, "rr_depth": 3},
        {"variant": "llvm_ad_mono", "sampler": "multijitter", "samples": 1024, "rr_depth": 8},
        {"variant": "llvm_ad_rgb", "sampler": "multijitter", "samples": 1024, "rr_depth": 5},
    ],
    ("mitsuba", "image"): [
        {"variant": "llvm_ad_mono", "sampler": "multijitter", "samples": 16, "rr_depth": 5},
        {"variant": "llvm_ad_mono", "sampler": "multijitter", "samples": 4, "rr_depth": 5},
        {"variant": "llvm_ad_mono", "sampler": "multijitter", "samples": 64, "rr_depth": 5},
        {"variant": "llvm_ad_mono", "sampler": "independent", "samples": 16, "rr_depth": 5},
        {"variant": "llvm_ad_mono", "sampler": "stratified", "samples": 16, "rr_depth": 5},
        {"variant": "llvm_ad_mono", "sampler": "orthogonal", "samples": 16, "rr_depth": 5},
        {"variant": "llvm_ad_mono", "sampler": "ldsampler", "samples": 16, "rr_depth": 5},
        {"variant": "llvm_ad_mono", "sampler": "multijitter", "samples": 16, "rr_depth": 2},
        {"variant": "llvm_ad_mono", "sampler": "multijitter", "samples": 16, "rr_depth": 3},
        {"variant": "llvm_ad_mono", "sampler": "multijitter", "samples": 16, "rr_depth": 8},
        {"variant": "llvm_ad_rgb", "sampler": "multijitter", "samples": 16, "rr_depth": 5},
    ],
    ("radiance", "grid"): [
        *rtrace(u=["+", "-"], ad=[64], lw=[1e-2]),
        *rtrace(u=["+", "-"], ad=[1024], lw=[1e-2, 1e-3]),
        *rtrace(u=["+", "-"], ad=[4096], lw=[1e-2, 1e-3]),
        *rtrace(u=["-"], ad=[256], lw=[1e-2], ds=[0.1, 0.03, 0.01]),
        *rtrace(u=["-"], ad=[1024], lw=[1e-2, 1e-3], ds=[0.1, 0.03]),
    ],
    ("radiance", "image"): [
        *rtrace(u=["+", "-"], ad=[1, 4, 16], lw=[1e-1, 1e-2]),
        *rtrace(u=["-"], ad=[4, 16], lw=[1e-1], ds=[0.1]),
    ],
    ("radiance-cache", "grid"): cached(aa=[0.2, 0.3], ad=[512]),
    ("radiance-cache", "image"): cached(aa=[0.3], ad=[256, 1024]),
}


def chosen(program, scene, kind):
    """The setting with the highest figure of merit in the record of the sweep."""
    candidates = CANDIDATES[program, kind]
    found = {}
    if SWEEP.exists():
        with SWEEP.open() as file:
            for row in csv.DictReader(file):
                if (row["program"], row["scene"], row["kind"]) == (program, scene, kind):
                    found[row["setting"]] = float(row["fom"])
    return max(candidates, key=lambda candidate: found.get(describe(candidate), 0.0))


def describe(setting):
    """A setting in one line, which is its name in the record."""
    return " ".join(f"{key}={value}" for key, value in setting.items())
