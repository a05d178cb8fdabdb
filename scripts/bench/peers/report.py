"""The record of a comparison as Markdown, docs/peers.md."""

import platform
import subprocess
import time

import numpy as np
from settings import PROGRAMS, REPORT, ROOT, SIDE, chosen, describe
from statistic import figure_of_merit

TITLES = {
    "lampyris": "Lampyris",
    "mitsuba": "Mitsuba `path`",
    "radiance": "Radiance, pure Monte Carlo",
    "radiance-cache": "Radiance, irradiance cache",
}
SCENE_TITLES = {
    "room": "room with column and omni",
    "cornell": "Cornell box, area light",
    "object": "room with 128k-triangle object",
}
KIND_TITLES = {
    kind: f"{side} x {side} {what}" for (kind, side), what in zip(SIDE.items(), ("lux grid", "image"), strict=True)
}
# Points whose nearest face of the column is that far off [m] count as near.
NEAR = 0.0065
HEAD = """# Lampyris and other programs

Written by `scripts/bench/peers/run`, which installs the others, measures and writes this page. The same scenes, one
core each, in turn, with other random numbers in each repetition, of which there are {repeats}; medians. The figure of
merit is FOM = 1/(mean squared relative error x CPU seconds) [1/s], over all bins whose reference is above zero, the
reference's own error taken off. CPU seconds are those of the rendering alone: of Lampyris, the worker process less what
it takes to load the scene; "whole" counts planning with its pilot trajectories and loading too. Of Mitsuba, the process
while it renders, after a first pass that compiles; of Radiance, `rtrace` less what it takes for one ray.

Date: {date}, commit {commit}. Machine: {machine}.
Versions: {versions}.
Command: `{command}`; {seconds:g} s of CPU time a run, {reference:g} s a reference of each program.

The Cornell box differs from `scenes/cornell.glb` in one thing: its panel does not reflect, because a `light` of
Radiance cannot. Colours count by their luminance. The grids of the rooms pass 6 mm from all faces of the column, the
grid of the Cornell box lies 1 mm over its floor. Images are of luminance.
"""
MERITS = """## Figures of merit [1/s]

In brackets least and greatest of the repetitions. \\*: the reference is not twice as exact as the run, so that the
figure depends on what is taken off for it, and may be wrong by a factor of two and more; see the last columns of the
next table, or take `--long`.
"""
AGREEMENT = """## Do the references agree?

z is Lampyris less Mitsuba over their combined standard error, bin by bin; of equal expectations mean z2 is 1 and
|z| > 3 in 0.3 % of the bins, given some 30 batches or more and errors that are near to normal. Those of Mitsuba's
pixels are not: a rare bright path is missing in most of them, which then are too dark and seem too precise. So for
images the sums over squares of 32 x 32 pixels are compared too: the root mean square of their relative difference,
"of which" the error of Mitsuba explains the second figure; the rest is that of Lampyris, whose pixels share histories
and err together. For the same reason the error of the ratio of sums is that of Mitsuba alone. The reference is the mean
of both, weighted by inverse variance. The last columns are 1/(mean relative variance x CPU seconds) as the two programs
themselves estimate their variances in these long runs: figures of merit that need no reference.

| task | bins | mean z2 | abs(z) > 3 | largest | ratio of sums - 1 | squares | weight of Lampyris | error of the reference \
| FOM by its own errors: Lampyris | Mitsuba |
|---|---|---|---|---|---|---|---|---|---|---|"""


SETTINGS = """## Settings, errors and times

Settings are the best of `docs/peers-sweep.csv` (`scripts/bench/peers/run --sweep`). The error is the root mean square
of the relative error; what all repetitions have in common of it is the bias, within a tenth of the error. The cache of
a grid has no random numbers, so that all its error is common. Empty: does not apply.

| task | program | setting | error | in common | CPU [s] | CPU, whole [s] | worker's own [s] |
|---|---|---|---|---|---|---|---|"""


def text(programs, tasks, references, runs, length, arguments):
    names = length.programs
    parts = [head(programs, length, arguments), merits(names, tasks, references, runs), agreement(tasks, references)]
    parts += [near_column(names, tasks, references, runs), details(names, tasks, references, runs)]
    return "\n".join(parts)


def head(programs, length, arguments):
    commit = output("git", "rev-parse", "--short", "HEAD")
    model = next(line.split(": ")[1] for line in open("/proc/cpuinfo") if line.startswith("model name")).strip()
    versions = "; ".join(programs[name].version() for name in PROGRAMS[:3])
    form = " --quick" if arguments.quick else " --long" if arguments.long else ""
    return HEAD.format(
        repeats=length.repeats,
        date=time.strftime("%Y-%m-%d"),
        commit=commit,
        machine=f"one core of {model}, {platform.system()}",
        versions=versions,
        command=f"scripts/bench/peers/run{form}",
        seconds=length.run,
        reference=length.reference,
    )


def output(*command):
    return subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT).stdout.strip()


def merits(names, tasks, references, runs):
    lines = [MERITS]
    titles = " | ".join(TITLES[name] for name in names)
    over = " | ".join(f"over {TITLES[name]}" for name in names[1:])
    lines.append(f"| task | {titles} | Lampyris, whole | {over} |")
    lines.append("|---" * (2 * len(names) + 1) + "|")
    for scene, kind in tasks:
        known = references[scene.name, kind]
        found = {name: foms(known, runs[name, scene.name, kind], lambda r: r.seconds) for name in names}
        whole = np.median(foms(known, runs["lampyris", scene.name, kind], lambda r: r.whole))
        middle = {name: np.median(values) for name, values in found.items()}
        marks = {n: "" if sure(known, runs[n, scene.name, kind]) else " \\*" for n in names}
        cells = [f"{number(middle[n])}{marks[n]} ({number(min(found[n]))} .. {number(max(found[n]))})" for n in names]
        over = [number(middle["lampyris"] / middle[n]) for n in names[1:]]
        lines.append(f"| {title(scene, kind)} | " + " | ".join([*cells, number(whole), *over]) + " |")
    return "\n".join(lines) + "\n"


def foms(known, results, seconds, bins=None):
    return [figure_of_merit(known.squared_error(r.values, bins), seconds(r)) for r in results]


def sure(known, results):
    return known.suffices(np.median([known.squared_error(r.values) for r in results]))


def agreement(tasks, references):
    lines = [AGREEMENT]
    for scene, kind in tasks:
        known = references[scene.name, kind]
        z = np.abs(known.z)
        cells = [f"{known.bins.sum()}", f"{np.mean(z * z):.2f}", f"{100 * np.mean(z > 3):.2f} %", f"{np.max(z):.1f}"]
        cells.append(f"{100 * known.of_totals:.3f} % +- {100 * known.of_totals_error:.3f} %")
        cells.append(" of which ".join(f"{100 * x:.2f} %" for x in known.blocks) if known.blocks else "")
        cells += [f"{known.share:.3f}", f"{100 * np.sqrt(known.own):.3f} %", *map(number, known.claimed)]
        lines.append(f"| {title(scene, kind)} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def near_column(names, tasks, references, runs):
    lines = ["## Grid points 6 mm from the column\n", "FOM of these points alone; they count in the table above too.\n"]
    lines.append("| task | points | " + " | ".join(TITLES[name] for name in names) + " |")
    lines.append("|---" * (2 + len(names)) + "|")
    for scene, kind in tasks:
        if kind == "image" or scene.lamp is None:
            continue
        known, near = references[scene.name, kind], distance_to_column(scene.grid_points()) < NEAR
        merit = [number(np.median(foms(known, runs[n, scene.name, kind], lambda r: r.seconds, near))) for n in names]
        lines.append(f"| {title(scene, kind)} | {np.sum(known.bins & near)} | " + " | ".join(merit) + " |")
    return "\n".join(lines) + "\n"


def distance_to_column(points):
    """Horizontal distance [m] from the column of the room."""
    low, high = np.array([3.9, -2.8]), np.array([4.3, -2.4])
    place = points[:, [0, 2]]
    return np.hypot(*np.maximum(np.maximum(low - place, place - high), 0).T)


def details(names, tasks, references, runs):
    lines = [SETTINGS]
    for scene, kind in tasks:
        known = references[scene.name, kind]
        for name in names:
            results = runs[name, scene.name, kind]
            error = np.sqrt(max(0.0, np.median([known.squared_error(r.values) for r in results])))
            common = known.repeated_error([r.values for r in results])
            times = [middle_time(results, part) for part in ("seconds", "whole", "worker")]
            setting = f"`{describe(chosen(name, scene.name, kind))}`"
            shared = f"{100 * common:.3f} %" if np.isfinite(common) else "-"
            cells = [TITLES[name], setting, f"{100 * error:.3f} %", shared, *times]
            lines.append(f"| {title(scene, kind)} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def middle_time(results, part):
    values = [getattr(result, part) for result in results]
    return "" if values[0] is None else f"{np.median(values):.2f}"


def title(scene, kind):
    return f"{KIND_TITLES[kind]}, {SCENE_TITLES[scene.name]}"


def number(value):
    """Two or three digits, no powers."""
    if not np.isfinite(value):
        return "-"
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"


def write(text):
    REPORT.write_text(text)
