"""Measures Lampyris, Mitsuba and Radiance on the same scenes and writes docs/peers.md; started by `run`.

    run [--quick | --long] [--lampyris BINARY] [--no-report]     the comparison
    run --sweep [PROGRAM ...]                                    adds to docs/peers-sweep.csv what it has not; of the
                                                                 programs named, everything anew

Every program runs on one core, in turn, with another seed each time; medians count. References are kept in
target/peers/references, for the binary of Lampyris that made them.
"""

import argparse
import csv
import hashlib
import time
from pathlib import Path

import numpy as np
import peers
import process
import report
import scenes
from settings import CANDIDATES, KINDS, LENGTHS, PROGRAMS, ROOT, SCENES, SWEEP, SWEEP_SECONDS, TARGET, chosen, describe
from statistic import Reference, figure_of_merit

# Seed of the reference runs; measured runs have small ones.
REFERENCE_SEED = 1000


def main():
    arguments = parse_arguments()
    TARGET.mkdir(parents=True, exist_ok=True)
    programs = {
        "lampyris": peers.Lampyris(str(arguments.lampyris.resolve())),
        "mitsuba": peers.Mitsuba(),
        "radiance": peers.Radiance(cached=False),
        "radiance-cache": peers.Radiance(cached=True),
    }
    tasks = [(scenes.load(scene), kind) for kind in KINDS for scene in SCENES]
    length = LENGTHS["quick" if arguments.quick else "long" if arguments.long else "short"]
    references = {(s.name, k): reference(programs, s, k, length.reference) for s, k in tasks}
    if arguments.sweep is not None:
        sweep(programs, tasks, references, arguments.sweep)
        return
    runs = measure_all(programs, tasks, length)
    text = report.text(programs, tasks, references, runs, length, arguments)
    print(text)
    if not arguments.no_report:
        report.write(text)


def parse_arguments():
    form = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(prog="run", description=__doc__, formatter_class=form)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--long", action="store_true")
    parser.add_argument("--lampyris", type=Path, default=ROOT / "target" / "release" / "lampyris")
    parser.add_argument("--no-report", action="store_true")
    parser.add_argument("--sweep", nargs="*", choices=PROGRAMS, metavar="PROGRAM")
    return parser.parse_args()


def reference(programs, scene, kind, seconds):
    """Long runs of Lampyris and of Mitsuba, from the files of an earlier call or made."""
    results = []
    for name in ("lampyris", "mitsuba"):
        key = describe({"program": programs[name].version(), "scene": scene.name, "kind": kind, "seconds": seconds})
        path = TARGET / "references" / f"{scene.name}-{kind}-{name}-{hashlib.sha256(key.encode()).hexdigest()[:12]}.npz"
        if not path.exists():
            path.parent.mkdir(exist_ok=True)
            result = programs[name].measure(scene, kind, chosen(name, scene.name, kind), seconds, REFERENCE_SEED)
            np.savez(path, values=result.values, variance=result.variance, seconds=result.seconds)
            say(f"reference {scene.name} {kind}: {name}, {result.seconds:.1f} s")
        stored = np.load(path)
        results.append(peers.Result(stored["values"], float(stored["seconds"]), stored["variance"]))
    return Reference(*results)


def measure_all(programs, tasks, length):
    """Results of all repetitions by program, scene and kind; programs take turns."""
    runs = {(name, s.name, kind): [] for s, kind in tasks for name in length.programs}
    for repeat in range(length.repeats):
        for scene, kind in tasks:
            for name in length.programs:
                setting = chosen(name, scene.name, kind)
                result = programs[name].measure(scene, kind, setting, length.run, repeat)
                runs[name, scene.name, kind].append(result)
                say(f"repetition {repeat + 1} of {length.repeats}: {scene.name} {kind} {name}, {result.seconds:.1f} s")
    return runs


def sweep(programs, tasks, references, again):
    """Figures of merit of the candidates that the record has not; with names, of all of these programs alone."""
    rows = []
    if SWEEP.exists():
        with SWEEP.open() as file:
            rows = [row for row in csv.DictReader(file) if row["program"] not in again]
    known = {(row["program"], row["scene"], row["kind"], row["setting"]) for row in rows}
    for name in again or PROGRAMS:
        for scene, kind in tasks:
            for setting in CANDIDATES[name, kind]:
                if (name, scene.name, kind, describe(setting)) in known:
                    continue
                rows.append(try_candidate(programs[name], name, scene, kind, setting, references[scene.name, kind]))
                say(" ".join(str(value) for value in rows[-1].values()))
                store(rows)


def try_candidate(program, name, scene, kind, setting, known):
    row = {"program": name, "scene": scene.name, "kind": kind, "setting": describe(setting)}
    try:
        result = program.measure(scene, kind, setting, SWEEP_SECONDS, 0)
    except process.Failed:
        return {**row, "seconds": "", "rms_relative_error": "", "fom": 0}
    squared = known.squared_error(result.values)
    error = np.sqrt(max(squared, 0.0))
    fom = figure_of_merit(squared, result.seconds)
    return {**row, "seconds": f"{result.seconds:.3f}", "rms_relative_error": f"{error:.5f}", "fom": f"{fom:.4g}"}


def store(rows):
    with SWEEP.open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)


def say(text):
    print(f"{time.strftime('%H:%M:%S')} {text}", flush=True)


if __name__ == "__main__":
    main()
