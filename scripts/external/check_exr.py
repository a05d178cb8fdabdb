#!/usr/bin/env python3
"""Checks the maps of scripts/external/room.toml with programs that are not ours.

    check_exr.py RESULTS_FOLDER

OpenEXR's exrheader and exrinfo must open each map and see its channels and attributes; OpenImageIO's iinfo and
oiiotool must decode the values that summary.json states and that belong together. Everything that is wrong is
listed; exit 1 when anything is.
"""

import json
import math
import re
import subprocess
import sys
from pathlib import Path

CHANNELS = """R G B luminance.Y luminance.variance luminance.standardError luminance.ciLower luminance.ciUpper
luminance.peak luminance.health direct.Y""".split()
ATTRIBUTES = {
    "units": "cd/m2",
    "estimate": "bounded",
    "confidence": "0.95",
    "batches": "16",
    "histories": "256",
    "seed": "7",
    "whiteLuminance": "1",
}
STUDENT_95_15 = 2.131449545559323  # two-sided 95 %, 15 degrees of freedom
F32 = 2.0**-23  # a stored value is half of this from the printed one, relatively
PRINTED = 1e-9  # oiiotool prints nine decimals

wrong = []


def main():
    results = Path(sys.argv[1])
    summary = json.loads((results / "summary.json").read_text())
    sets = {s["name"]: s for s in summary["sets"]}
    view = read(results / "view.exr", 64, 64)
    floor = read(results / "floor.exr", 32, 16)
    for name, pixels in [("view", view), ("floor", floor)]:
        check_headers(results / f"{name}.exr", pixels)
        check_against_summary(name, pixels, sets[name])
        check_consistency(name, pixels)
    check_orientation(view)
    check_missing(floor)
    for line in wrong[:20]:
        print("wrong:", line, file=sys.stderr)
    print(f"EXR maps in OpenEXR and OpenImageIO: {'ok' if not wrong else f'{len(wrong)} findings'}")
    return 1 if wrong else 0


def expect(holds, message):
    if not holds:
        wrong.append(message)


def output_of(*command):
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(map(str, command))}: {done.stderr}")
    return done.stdout


def printed_by(*command):
    """What a command says that ends with a code of chance: exrinfo 3.1.5 never sets it. It complains on its standard error."""
    done = subprocess.run(command, capture_output=True, text=True)
    if done.stderr:
        sys.exit(f"{' '.join(map(str, command))}: {done.stderr}")
    return done.stdout


def word(pattern, text):
    found = re.search(pattern, text)
    if not found:
        sys.exit(f"nothing like {pattern} in: {text}")
    return found[1]


def read(path, width, height):
    """Pixels as OpenImageIO decodes them: {(column, row): {channel: value}}."""
    text = output_of("oiiotool", "--info", "-v", "--dumpdata", str(path))
    expect(re.search(rf": +{width} x +{height}, {len(CHANNELS)} channel, float openexr", text), f"{path.name}: size or type")
    names = word(r"channel list: (.*)", text).split(", ")
    if sorted(names) != sorted(CHANNELS):
        sys.exit(f"{path.name}: OpenImageIO finds the channels {names}")
    pixels = {}
    for column, row, values in re.findall(r"Pixel \((\d+), (\d+)\): (.*)", text):
        pixels[int(column), int(row)] = dict(zip(names, map(float, values.split())))
    expect(len(pixels) == width * height, f"{path.name}: {len(pixels)} pixels")
    return pixels


def check_headers(path, pixels):
    header = output_of("exrheader", str(path))
    for channel in CHANNELS:
        expect(re.search(rf"^ +{re.escape(channel)}, 32-bit floating-point", header, re.M), f"{path.name}: {channel}")
    for name, value in ATTRIBUTES.items():
        found = re.search(rf'^{name} \(type \w+\): "?([^"\n]*)"?$', header, re.M)
        expect(found and found[1] == value, f"{path.name}: {name} is {found and found[1]}, not {value}")
    for line in ["compression): zip, multi-scanline blocks", "lineOrder): increasing y"]:
        expect(line in header, f"{path.name}: no {line}")
    expect(" parts: 1\n" in printed_by("exrinfo", "-v", str(path)), f"{path.name}: not one part in exrinfo")

    info = output_of("iinfo", "-v", "--stats", str(path))
    for name, value in ATTRIBUTES.items():
        found = re.search(rf'^ +{name}: "?([^"\n]*)"?$', info, re.M)
        expect(found and found[1] == value, f"{path.name}: {name} is {found and found[1]} in OpenImageIO")
    names = word(r"channel list: (.*)", info).split(", ")
    finite = word(r"Stats FiniteCount: ([\d ]*)", info).split()
    for name, count in zip(names, map(int, finite)):
        ours = sum(math.isfinite(p[name]) for p in pixels.values())
        expect(count == ours, f"{path.name}: {count} finite values of {name} in iinfo, {ours} in oiiotool")


def check_against_summary(name, pixels, stated):
    """Mean, smallest and largest luminance as decoded against those of summary.json."""
    luminance = [p["luminance.Y"] for p in pixels.values() if math.isfinite(p["luminance.Y"])]
    decoded = {"mean": math.fsum(luminance) / len(luminance), "min": min(luminance), "max": max(luminance)}
    for key, value in decoded.items():
        expect(near(value, stated[key]), f"{name}: {key} {value} decoded, {stated[key]} in summary.json")
    expect(stated["bins"] == len(pixels), f"{name}: {stated['bins']} bins in summary.json")


def check_consistency(name, pixels):
    """The layers of a pixel belong together."""
    for at, p in pixels.items():
        y, error, health = p["luminance.Y"], p["luminance.standardError"], p["luminance.health"]
        expect(math.isfinite(health) == math.isfinite(y), f"{name} {at}: health {health} of luminance {y}")
        if math.isfinite(health):
            check_health(f"{name} {at}", p)
        if not (math.isfinite(y) and math.isfinite(error)):
            continue
        grey = p["R"] == p["G"] == p["B"] == y
        half = STUDENT_95_15 * error
        slack = 4 * F32 * (abs(y) + half) + 4 * PRINTED
        interval = abs(p["luminance.ciLower"] - (y - half)) < slack and abs(p["luminance.ciUpper"] - (y + half)) < slack
        variance = abs(p["luminance.variance"] - error * error) < 4 * F32 * error * error + 4 * PRINTED
        shares = 0.0 <= p["direct.Y"] and -PRINTED <= p["luminance.peak"] <= 1.0 + PRINTED
        expect(grey and interval and variance and shares and error >= 0.0, f"{name} {at}: layers disagree: {p}")


def check_health(at, p):
    """The marks of 16 batches are those that the other layers ask for: 1 no information, 4 relative error, 8 peak."""
    y, error, peak, health = p["luminance.Y"], p["luminance.standardError"], p["luminance.peak"], p["luminance.health"]
    large_error = error > 0.1 * y  # false for NaN
    large_peak = error != 0.0 and peak > 0.05
    due = 1 if math.isnan(error) else 4 * large_error + 8 * large_peak
    near_limit = abs(error - 0.1 * y) < 1e-5 * y or abs(peak - 0.05) < 1e-5
    expect(health == due or near_limit, f"{at}: health {health}, the layers ask for {due}")


def check_orientation(view):
    """The lamp hangs near the ceiling to the left: the brightest direct light must be in the upper left."""
    column, row = max(view, key=lambda at: view[at]["direct.Y"])
    expect(row < 16 and column < 32, f"view: brightest at column {column}, row {row}, not in the upper left")
    expect(all(math.isfinite(p["luminance.Y"]) for p in view.values()), "view: values that are not finite")


def check_missing(floor):
    """Directions into the floor are not numbers, directions out of it are."""
    for (column, row), p in floor.items():
        expect(math.isfinite(p["luminance.Y"]) == (row < 8), f"floor: {p['luminance.Y']} at column {column}, row {row}")


def near(decoded, stated):
    return abs(decoded - stated) <= F32 * abs(stated) + PRINTED


if __name__ == "__main__":
    sys.exit(main())
