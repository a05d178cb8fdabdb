"""Shapes of the furnished room as plain lists: each is (vertices, faces), faces counter-clockwise from outside.

Lengths in metres, +Z up as in Blender. Nothing here knows Blender.
"""

import math
import struct
import zlib


def block(low, high, bottom=True):
    """Upright block; without `bottom` it is open below, for what stands on a floor."""
    vertices = [(x, y, z) for z in (low[2], high[2]) for y in (low[1], high[1]) for x in (low[0], high[0])]
    faces = [(4, 5, 7, 6), (0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6)]
    return vertices, faces + [(0, 2, 3, 1)] * bottom


def lathe(profile, sectors=24):
    """Surface of revolution about Z. `profile` lists (radius, height) from below to above, the outside to its right;
    a radius of 0 is a single point on the axis."""
    vertices, rows = [], []
    for radius, height in profile:
        count = sectors if radius > 0 else 1
        rows.append(range(len(vertices), len(vertices) + count))
        angles = [2 * math.pi * i / sectors for i in range(count)]
        vertices += [(radius * math.cos(a), radius * math.sin(a), height) for a in angles]
    faces = []
    for low, high in zip(rows, rows[1:]):
        for i in range(sectors):
            j = (i + 1) % sectors
            corners = [low[i % len(low)], low[j % len(low)], high[j % len(high)], high[i % len(high)]]
            face = tuple(dict.fromkeys(corners))
            if len(face) > 2:
                faces.append(face)
    return vertices, faces


def sphere(radius=1.0, rings=12, sectors=24):
    """Sphere about the origin."""
    return lathe([polar(radius, math.pi * (i / rings - 0.5)) for i in range(rings + 1)], sectors)


def cylinder(radius, low, high, sectors=16):
    """Upright closed cylinder."""
    return lathe([(0.0, low), (radius, low), (radius, high), (0.0, high)], sectors)


def cushion(half, power=0.35, rings=12, sectors=32):
    """Block with half sizes `half` rounded into a cushion (a superellipsoid), about the origin."""
    vertices, faces = sphere(1.0, rings, sectors)
    return [rounded(v, half, power) for v in vertices], faces


def moved(shape, offset):
    """The same shape elsewhere."""
    vertices, faces = shape
    return [tuple(a + b for a, b in zip(v, offset)) for v in vertices], faces


def polar(radius, latitude):
    across = radius * math.cos(latitude)
    return (across if across > 1e-9 else 0.0, radius * math.sin(latitude))


def rounded(point, half, power):
    x, y, z = point
    across = math.hypot(x, y)
    ring = across**power
    flat = [math.copysign(abs(c / across) ** power, c) * ring if across > 0 else 0.0 for c in (x, y)]
    return (half[0] * flat[0], half[1] * flat[1], half[2] * math.copysign(abs(z) ** power, z))


def rug_picture(size=64):
    """Pixels of the rug, rows of (r, g, b) bytes: a red field with blue diamonds inside a sand-coloured border."""
    sand, red, blue = (201, 178, 138), (128, 38, 32), (38, 58, 92)

    def pixel(i, j):
        edge = min(i, j, size - 1 - i, size - 1 - j)
        if edge < 4:
            return blue if edge in (1, 2) else sand
        diamond = abs(i % 16 - 7.5) + abs(j % 16 - 7.5)
        return sand if 5 <= diamond < 7 else blue if diamond < 5 else red

    return [[pixel(i, j) for i in range(size)] for j in range(size)]


def png(rows):
    """The PNG file of rows of (r, g, b) bytes."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", len(rows[0]), len(rows), 8, 2, 0, 0, 0)
    data = b"".join(b"\0" + bytes(c for pixel in row for c in pixel) for row in rows)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(data, 9)) + chunk(b"IEND", b"")
