#!/usr/bin/env python3
"""Writes the photometric files of the tests, tests/luminaires/*.ies and *.ldt: each is a trap for whoever reads such files.

All are made from the few formulas below; no vendor's data is in them. Run it after a change here and commit what it wrote.
"""

import math
from pathlib import Path

FOLDER = Path(__file__).resolve().parent.parent / "tests" / "luminaires"


def shape(c, g):
    """An intensity in cd without any symmetry, C and G in degrees; it is the same for all C at G = 0 and 180."""
    across = math.sin(math.radians(g)) ** 2
    turn = math.radians(c)
    return round(200 + 120 * math.cos(math.radians(g)) + across * (90 * math.cos(turn) + 60 * math.sin(turn) + 40 * math.cos(3 * turn)), 3)


def half(c, g):
    """The same in C and 180 - C."""
    return round(0.5 * (shape(c, g) + shape(180 - c, g)), 3)


def other_half(c, g):
    """The same in C and -C."""
    return round(0.5 * (shape(c, g) + shape(-c, g)), 3)


def quarter(c, g):
    return round(0.5 * (half(c, g) + half(-c, g)), 3)


def beam(h, v):
    """Types A and B: brighter to the right and above."""
    falls = math.cos(math.radians(h)) * math.cos(math.radians(v))
    return round(1000 * max(falls, 0) ** 2 * (1 + 0.004 * h + 0.002 * v), 3)


def even_beam(h, v):
    return round(1000 * max(math.cos(math.radians(h)) * math.cos(math.radians(v)), 0) ** 3, 3)


def steps(first, last, step):
    return [first + step * k for k in range(int((last - first) / step) + 1)]


def text(x):
    return f"{x:g}" if x == int(x) else repr(x)


def lm63(name, planes, angles, value, first="IESNA:LM-63-2002", lamps=1, lumens=-1, factor=1, kind=1, unit=2, size=(0, 0, 0),
         last=(1, 1, 20), tilt="TILT=NONE", keywords=("[TEST] made by scripts/make_luminaires.py", "[LUMINAIRE] none"), change=None):
    """One file: `value(plane, angle)` in cd before the factors; `change` edits the finished text."""
    lines = ([first] if first else []) + list(keywords) + tilt.split("\n")
    lines.append(" ".join(map(text, [lamps, lumens, factor, len(angles), len(planes), kind, unit, *size])))
    lines.append(" ".join(map(text, last)))
    lines.append(" ".join(map(text, angles)))
    lines.append(" ".join(map(text, planes)))
    lines += [" ".join(text(value(p, a)) for a in angles) for p in planes]
    content = "\n".join(lines) + "\n"
    content = (change or (lambda x: x))(content)
    (FOLDER / f"{name}.ies").write_bytes(content if isinstance(content, bytes) else content.encode())


def ldt(name, symmetry, planes, angles, value, sets=((1, "LED", 4000, "3000K", "80", 40),), ratio=None, conversion=1.0,
        area=(0, 0, 0, 0, 0, 0), by_set=False, tilt="0", change=None):
    """One file: `value(C, G)` in cd; C of the planes kept is what `symmetry` says."""
    count = len(planes)
    kept = {0: planes, 1: [0], 2: planes[:count // 2 + 1], 3: planes[3 * count // 4:] + planes[:count // 4 + 1],
            4: planes[:count // 4 + 1]}[symmetry]
    flux = sets[0][2]
    if ratio is None:
        ratio = round(100 * integral(symmetry, value, angles, kept) / flux, 3)
    step = planes[1] - planes[0] if count > 1 else 0
    lines = ["made by scripts/make_luminaires.py", 1 if symmetry == 1 else 3, symmetry, count, step, len(angles), 0, "no test",
             "none", "none", name, "none", 0, 0, 0, *area, 100, ratio, conversion, tilt, len(sets)]
    lines += [x for one in sets for x in one] if by_set else [one[k] for k in range(6) for one in sets]
    lines += [0.5] * 10 + planes + angles
    lines += [round(value(c, g) * 1000 / flux / conversion, 6) for c in kept for g in angles]
    content = "\r\n".join(x if isinstance(x, str) else text(x) for x in lines) + "\r\n"
    (FOLDER / f"{name}.ldt").write_bytes((change or (lambda x: x))(content).encode())


def integral(symmetry, value, angles, kept):
    """Flux in lm, by the trapezoid rule over the planes and the exact integral between angles."""
    def ring(g):
        values = [value(c, g) for c in kept]
        if symmetry == 1:
            return 2 * math.pi * values[0]
        turns = [c - 360 if symmetry == 3 and c > 180 else c for c in kept]
        if symmetry == 0:
            turns, values = turns + [360], values + values[:1]
        sums = sum(0.5 * (values[k] + values[k + 1]) * (turns[k + 1] - turns[k]) for k in range(len(turns) - 1))
        return math.radians(sums) * {0: 1, 2: 2, 3: 2, 4: 4}[symmetry]
    total = 0
    for low, high in zip(angles, angles[1:]):
        a, b, t, u = ring(low), ring(high), math.radians(low), math.radians(high)
        total += a * math.cos(t) - b * math.cos(u) + (b - a) / (u - t) * (math.sin(u) - math.sin(t))
    return total


def main():
    FOLDER.mkdir(exist_ok=True)
    down, whole, full = steps(0, 90, 15), steps(0, 180, 15), steps(0, 360, 30)
    # Symmetries.
    lm63("omni_1000lm", [0], [0, 90, 180], lambda c, g: 79.57747154594767, lumens=1000)
    lm63("lambert_100lm", [0], steps(0, 90, 0.5), lambda c, g: round(31.830988618379067 * math.cos(math.radians(g)), 9) + 0.0,
         lumens=100, size=(-0.2, -0.2, 0))
    lm63("quadrant", steps(0, 90, 15), whole, quarter)
    lm63("half_0_180", steps(0, 180, 30), whole, other_half)
    lm63("half_90_270", steps(90, 270, 30), whole, half, first="IESNA:LM-63-1995")
    lm63("half_minus90_90", steps(-90, 90, 30), whole, half)
    lm63("full", full, whole, shape)
    lm63("full_without_360", full[:-1], whole, shape)
    lm63("upward", full, steps(90, 180, 15), shape)
    lm63("uneven", [0, 12.5, 40, 90, 107.5, 180, 260, 360], [0, 2.5, 10, 27.5, 45, 62.5, 80, 90], shape)
    lm63("type_b", steps(-90, 90, 15), steps(-90, 90, 15), beam, kind=2)
    lm63("type_b_mirrored", steps(0, 90, 15), steps(0, 90, 15), even_beam, kind=2)
    lm63("type_a", steps(-45, 45, 7.5), steps(-30, 30, 7.5), beam, kind=3)
    lm63("wedge", full, whole, lambda c, g: 1000 if (c, g) == (90, 45) else 0)
    # Factors, lamps, editions.
    lm63("factors_1991", [0], down, lambda c, g: 100 + g, first="IESNA91", factor=2.5, last=(0.9, 0.8, 36))
    lm63("factors_1995", [0], down, lambda c, g: 100 + g, first="IESNA:LM-63-1995", factor=2.5, last=(0.9, 0.8, 36))
    lm63("factors_2019", [0], down, lambda c, g: 100 + g, first="IES:LM-63-2019", factor=2.5, last=(0.9, 1.1, 36))
    lm63("edition_1986", [0], down, lambda c, g: 100 + g, first="", keywords=("A luminaire of long ago", "and a remark"), lumens=3000, lamps=2)
    lm63("relative", full, whole, shape, lamps=2, lumens=2400)
    lm63("more_than_its_lamps", full, whole, shape, lumens=2000)
    table = "TILT=INCLUDE\n1\n3\n0 45 90\n1 0.9 0.7"
    lm63("tilt_include", full, whole, shape, tilt=table)
    # Shapes of the opening.
    lm63("feet", [0], down, lambda c, g: 100, unit=1, size=(2, 4, 0.5))
    lm63("round_1995", [0], down, lambda c, g: 100, first="IESNA:LM-63-1995", size=(-0.3, 0, 0))
    lm63("sphere_2002", [0], whole, lambda c, g: 100, size=(-0.4, -0.4, -0.4))
    for name, size in [("rectangle", (0.3, 0.6, 0)), ("box", (0.2, 0.4, 0.1)), ("cylinder_upright", (-0.2, -0.2, 0.3)),
                       ("cylinder_along_c0", (-0.1, 0.6, -0.1)), ("cylinder_across_c0", (0.6, -0.1, -0.1)), ("sphere", (-0.3, -0.3, -0.3)),
                       ("disc", (-0.3, -0.2, 0)), ("disc_upright", (-0.3, 0, -0.2))]:
        lm63(f"opening_{name}", full, whole, shape, size=size)
    # Text.
    lm63("commas_between", full, whole, shape, change=lambda x: x.replace(" ", ", ").replace("[LUMINAIRE],", "[LUMINAIRE]"))
    lm63("commas_as_points", full, whole, shape, change=lambda x: "\n".join(
        line.replace(".", ",") if k > 2 else line for k, line in enumerate(x.split("\n"))))
    lm63("wrapped", full, whole, shape, change=wrapped)
    lm63("old_mac", full, whole, shape, change=lambda x: x.replace("\n", "\r"))
    lm63("latin_1", full, whole, shape, keywords=("[MANUFAC] Gl\u00fchlampenwerk", "[MORE] \u00a7 2"), change=lambda x: x.encode("latin-1"))
    # EULUMDAT.
    planes, angles = steps(0, 330, 30), steps(0, 180, 15)
    ldt("symmetry_0", 0, planes, angles, shape)
    ldt("symmetry_1", 1, planes, angles, lambda c, g: shape(0, g))
    ldt("symmetry_2", 2, planes, angles, other_half)
    ldt("symmetry_3", 3, planes, angles, half)
    ldt("symmetry_4", 4, planes, angles, quarter, area=(1200, 300, 0, 0, 0, 0))
    ldt("wedge", 0, planes, angles, lambda c, g: 1000 if (c, g) == (90, 45) else 0)
    ldt("comma", 0, planes, angles, shape, change=lambda x: x.replace("make_luminaires.py", "make").replace(".", ","))
    ldt("absolute", 0, planes, angles, shape, sets=((-1, "LED module", 2857.5, "4000K", "90", 25),), area=(150, 0, 0, 0, 0, 0))
    two = ((1, "T5", 2600, "3000K", "80", 32), (2, "T8", 5200, "4000K", "80", 60))
    ldt("two_sets_by_field", 4, planes, angles, quarter, sets=two)
    ldt("two_sets_by_set", 4, planes, angles, quarter, sets=two, by_set=True)
    ldt("conversion", 0, planes, angles, shape, conversion=1.25, tilt="15")
    ldt("wrong_ratio", 0, planes, angles, shape, ratio=200)


def wrapped(content):
    """Numbers broken over lines wherever they come, tabs, blanks, DOS ends of line and end of file."""
    head, numbers = content.split("TILT=NONE\n")
    words, lines = numbers.split(), []
    for k in range(0, len(words), 7):
        lines.append("  " + "\t ".join(words[k:k + 7]) + " ")
    return (head + "TILT=NONE\n" + "\n\n".join(lines) + "\n").replace("\n", "\r\n") + "\x1a\x1a"


main()
