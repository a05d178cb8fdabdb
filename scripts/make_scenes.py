#!/usr/bin/env python3
"""Writes the scenes that ship, scenes/{room,cornell,furnace,figure2,office,glass}.glb, bit for bit the same on every machine.

    scripts/make_scenes.py            write them
    scripts/make_scenes.py --check    compare them with the files that are there; exit 1 where one differs

Units are those of glTF: metres, +Y up, candela for point lights, cd/m2 for emissive surfaces. Every surface is
Lambert (metallic 0, roughness 1) and one-sided, but for a screen of glass; its front is the side on which light travels. Faces that meet
share their corners to the last bit, floors and ceilings have holes where something stands on them, so no two
surfaces lie in one place; `check_closed` proves it each time. Only + - * / and sqrt are used on numbers: these
are exactly rounded everywhere.
"""

import json
import math
import struct
import sys
from collections import Counter
from pathlib import Path

import head

SCENES = Path(__file__).resolve().parent.parent / "scenes"


def main():
    check = parse_arguments(sys.argv[1:])
    wrong = 0
    scenes = [("room", room), ("cornell", cornell), ("furnace", furnace), ("figure2", figure2), ("office", office), ("glass", glass)]
    for name, build in scenes:
        path, content = SCENES / f"{name}.glb", build()
        if not check:
            path.write_bytes(content)
            print(f"{path.name}: {len(content)} bytes written")
        elif path.exists() and path.read_bytes() == content:
            print(f"{path.name}: {len(content)} bytes, as made")
        else:
            print(f"{path.name}: missing or not what this script makes", file=sys.stderr)
            wrong += 1
    return 1 if wrong else 0


def parse_arguments(arguments):
    if arguments not in ([], ["--check"]):
        sys.exit(__doc__)
    return arguments == ["--check"]


# --- the scenes -------------------------------------------------------------------------------------------------


def room():
    """The room of the paper's Figure 2 without the head: 6 x 4 x 3 m, a square column, a lamp of 1000 lm."""
    return hall_with_column("Room of the paper's Figure 2, without the head").bytes()


def figure2():
    """The same with the head, larger than life: 21,168 triangles with 31,752 edges, hanging before the column."""
    gltf = hall_with_column("Room of the paper's Figure 2")
    faces = head.mesh(42)
    check_closed(faces, sum(determinant(*t) for t in triangles(faces)) / 6.0)
    # Turned about +Y so that it looks a little past the camera, three and a half times as large as a head.
    sine, cosine = half_angle(-0.8, 0.6)
    placement = {"translation": [2.5, 1.35, -1.5], "rotation": [0.0, sine, 0.0, cosine], "scale": [3.5, 3.5, 3.5]}
    gltf.surface("Head", faces, grey("head 0.6", 0.6), placement)
    return gltf.bytes()


def hall_with_column(title):
    """Hall, column, lamp and camera that both rooms have."""
    hall = box((0.0, 0.0, -4.0), (6.0, 3.0, 0.0))
    column = box((3.9, 0.0, -2.8), (4.3, 3.0, -2.4))
    floor = ring(reverse(hall["-y"]), reverse(column["-y"]))
    ceiling = ring(reverse(hall["+y"]), reverse(column["+y"]))
    walls = [reverse(hall[side]) for side in SIDES]
    column_sides = [column[side] for side in SIDES]
    check_closed([*floor, *ceiling, *walls, *column_sides], -(6.0 * 4.0 * 3.0 - 0.4 * 0.4 * 3.0))

    gltf = Gltf(title)
    gltf.surface("floor", floor, grey("floor 0.3", 0.3))
    gltf.surface("ceiling", ceiling, grey("ceiling 0.7", 0.7))
    wall_material = grey("wall 0.5", 0.5)
    gltf.surface("walls", walls, wall_material)
    # The ends of the column fill the holes of floor and ceiling with their fronts outward: nobody sees them, but
    # a point inside the column is surrounded by backs and so is known to be inside.
    gltf.surface("column", [*column_sides, column["-y"], column["+y"]], wall_material)
    gltf.lamp("lamp", (2.0, 2.7, -2.4), 1000.0 / (4.0 * math.pi))
    gltf.camera("camera", (0.35, 1.75, -0.35), (3.75, 1.2, -2.35), math.pi / 3.0)
    return gltf


def cornell():
    """The Cornell box in its real size, open in front, with its measured lamp as a panel in an opening of the ceiling.

    Reflectances are the measured spectra as linear Rec.709, rounded to two or three digits as is usual; the panel
    has 5000 cd/m2 of the warm colour of the original lamp. The original's measured corners are rounded to a
    rectangular box.
    """
    hall = box(millimetres(556.0, 0.0, 559.2), millimetres(0.0, 548.8, 0.0))
    corners = [millimetres(x, 0.0, z) for x, z in CORNELL_FLOOR]
    floor = [tuple(corners[i] for i in triangle) for triangle in CORNELL_FLOOR_TRIANGLES]
    panel = list(reversed([millimetres(x, 548.8, z) for x, z in [(213, 227), (213, 332), (343, 332), (343, 227)]]))
    ceiling = ring(rotate(reverse(hall["+y"]), 3), panel)
    blocks = {"short block": prism(CORNELL_FLOOR[4:8], 165.0), "tall block": prism(CORNELL_FLOOR[8:12], 330.0)}
    back, left, right = (reverse(hall[side]) for side in ("-z", "-x", "+x"))
    front_opening = reverse(hall["+z"])
    standing = [face for faces in blocks.values() for face in faces[:-1]]
    blocks_volume = polygon_area(CORNELL_FLOOR[4:8]) * 0.165 + polygon_area(CORNELL_FLOOR[8:12]) * 0.330
    volume = 0.556 * 0.5488 * 0.5592 - blocks_volume * 1e-6
    check_closed([*floor, *ceiling, panel, back, left, right, front_opening, *standing], -volume)

    gltf = Gltf("Cornell box")
    white = lambert("white", (0.725, 0.71, 0.68))
    gltf.surface("floor", floor, white)
    gltf.surface("ceiling", ceiling, white)
    gltf.surface("back wall", [back], white)
    gltf.surface("left wall", [left], lambert("red", (0.63, 0.065, 0.05)))
    gltf.surface("right wall", [right], lambert("green", (0.14, 0.45, 0.091)))
    for name, faces in blocks.items():
        gltf.surface(name, faces, white)
    gltf.surface("panel", [panel], emitting(grey("panel 5000 cd/m2", 0.78), (1.0, 0.76, 0.37), 5000.0))
    # 35 mm lens before a picture of 25 x 25 mm: 2 atan(12.5/35).
    gltf.camera("camera", (0.278, 0.273, 0.8), (0.278, 0.273, 0.0), 0.68605)
    return gltf.bytes()


def furnace():
    """White furnace: a closed unit cube whose walls have reflectance 0.5 and emit M0 = 1 lm/m2, L0 = 1/pi cd/m2."""
    cube = box((0.0, 0.0, -1.0), (1.0, 1.0, 0.0))
    walls = [reverse(face) for face in cube.values()]
    check_closed(walls, -1.0)
    gltf = Gltf("White furnace")
    material = emitting(grey("wall 0.5, emitting 1 lm/m2", 0.5), (1.0, 1.0, 1.0), 1.0 / math.pi)
    gltf.surface("walls", walls, material)
    return gltf.bytes()


def office():
    """A room of 4 x 2.8 x 5 m in walls of 0.3 m, a window of 2.8 x 1.5 m in the wall at z = -5, a desk; across the street a building."""
    hall, shell = box((0.0, 0.0, -5.0), (4.0, 2.8, 0.0)), box((-0.3, -0.3, -5.3), (4.3, 3.1, 0.3))
    desk = box((1.0, 0.0, -3.6), (2.6, 0.72, -2.8))
    # The hole through the wall: its ends are those of the holes in both faces of the wall.
    hole = box((0.6, 0.9, -5.3), (3.4, 2.4, -5.0))
    inside = ring(reverse(hall["-z"]), hole["+z"])
    outside = ring(shell["-z"], hole["-z"])
    reveals = [reverse(hole[side]) for side in ("-x", "+x", "-y", "+y")]
    floor = ring(reverse(hall["-y"]), reverse(desk["-y"]))
    walls = [reverse(hall[side]) for side in ("-x", "+x", "+z")]
    others = [shell[side] for side in ("-x", "+x", "-y", "+y", "+z")]
    top = [desk[side] for side in ("-x", "+x", "+y", "-z", "+z")]
    solid = [*inside, *outside, *reveals, *floor, *walls, reverse(hall["+y"]), *others, *top]
    check_closed(solid, 4.6 * 3.4 * 5.6 - 4.0 * 2.8 * 5.0 - 2.8 * 1.5 * 0.3 + 1.6 * 0.72 * 0.8)

    gltf = Gltf("Office with a window")
    wall = grey("wall 0.6", 0.6)
    gltf.surface("floor", floor, grey("floor 0.3", 0.3))
    gltf.surface("ceiling", [reverse(hall["+y"])], grey("ceiling 0.8", 0.8))
    gltf.surface("walls", walls, wall)
    gltf.surface("window wall", inside, wall)
    gltf.surface("reveals", reveals, wall)
    gltf.surface("outside", [*outside, *others], grey("outside 0.3", 0.3))
    gltf.surface("desk", [*top, desk["-y"]], lambert("oak", (0.5, 0.38, 0.24)))
    building = box((-9.0, -4.0, -25.0), (5.0, 3.2, -17.0))
    gltf.surface("building", list(building.values()), lambert("brick", (0.4, 0.25, 0.2)))
    gltf.camera("camera", (3.5, 1.6, -0.4), (1.4, 1.15, -5.0), math.pi / 3.0)
    return gltf.bytes()


def glass():
    """A room of 4 x 2.6 x 3 m with a lamp in a globe, a screen of glass and a ball; the job says of what they are."""
    hall = box((0.0, 0.0, -3.0), (4.0, 2.6, 0.0))
    gltf = Gltf("Glass")
    gltf.surface("floor", [reverse(hall["-y"])], grey("floor", 0.3))
    gltf.surface("walls", [reverse(hall[side]) for side in (*SIDES, "+y")], grey("wall", 0.6))
    globe, ball = (1.2, 1.7, -1.6), (2.9, 0.35, -1.3)
    gltf.surface("globe", sphere(globe, 0.25, 4), grey("globe", 0.8))
    gltf.surface("ball", sphere(ball, 0.35, 4), grey("ball", 0.8))
    pane = [(2.1, 0.0, -0.4), (2.1, 0.0, -2.6), (2.1, 1.9, -2.6), (2.1, 1.9, -0.4)]
    gltf.surface("screen", [pane], transmitting(grey("screen", 0.97)))
    gltf.lamp("lamp", globe, 100.0)
    gltf.camera("camera", (0.3, 1.5, -0.3), (2.6, 0.8, -1.7), 1.0)
    return gltf.bytes()


def sphere(centre, radius, depth):
    """The faces of an octahedron, halved along each edge `depth` times and pushed out to a sphere; fronts outward."""
    x, y, z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    u, v, w = (-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0)
    faces = [(x, y, z), (y, u, z), (u, v, z), (v, x, z), (y, x, w), (u, y, w), (v, u, w), (x, v, w)]

    def between(a, b):
        middle = [p + q for p, q in zip(a, b, strict=True)]
        length = math.sqrt(sum(p * p for p in middle))
        return tuple(p / length for p in middle)

    for _ in range(depth):
        halves = []
        for a, b, c in faces:
            d, e, f = between(a, b), between(b, c), between(c, a)
            halves += [(a, d, f), (d, b, e), (f, e, c), (d, e, f)]
        faces = halves
    return [tuple(tuple(m + radius * p for m, p in zip(centre, corner, strict=True)) for corner in f) for f in faces]


# Corners of the floor of the Cornell box and of the blocks that stand on it: x, z in the millimetres and axes of the
# original (x to the left, z away from the camera).
CORNELL_FLOOR = [
    (0.0, 0.0), (556.0, 0.0), (556.0, 559.2), (0.0, 559.2),
    (130.0, 65.0), (82.0, 225.0), (240.0, 272.0), (290.0, 114.0),
    (423.0, 247.0), (265.0, 296.0), (314.0, 456.0), (472.0, 406.0),
]  # fmt: skip
# The floor around the two blocks, front upwards.
CORNELL_FLOOR_TRIANGLES = [
    (0, 7, 1), (0, 4, 7), (0, 5, 4), (0, 3, 5), (3, 6, 5), (3, 9, 6), (3, 10, 9),
    (3, 2, 10), (10, 2, 11), (2, 1, 11), (1, 8, 11), (1, 7, 8), (7, 9, 8), (7, 6, 9),
]  # fmt: skip


def millimetres(x, y, z):
    """A point of the original Cornell box in metres and in the axes of glTF: x to the right, z to the camera."""
    return ((556.0 - x) / 1000.0, y / 1000.0, -z / 1000.0)


def prism(base, height):
    """Upright block over `base` (mm, in the order of a front upwards), fronts outward: sides, top, and last the bottom."""
    low = [millimetres(x, 0.0, z) for x, z in base]
    high = [millimetres(x, height, z) for x, z in base]
    after = [1, 2, 3, 0]
    sides = [(low[i], low[j], high[j], high[i]) for i, j in enumerate(after)]
    return [*sides, tuple(high), reverse(low)]


# --- faces: tuples of corners, counter-clockwise seen from the front --------------------------------------------

SIDES = ("-x", "+x", "-z", "+z")


def box(low, high):
    """The six faces of an upright box with their fronts outward."""
    at = (low, high)
    corner = {(i, j, k): (at[i][0], at[j][1], at[k][2]) for i in (0, 1) for j in (0, 1) for k in (0, 1)}
    names = {
        "-x": ((0, 0, 0), (0, 0, 1), (0, 1, 1), (0, 1, 0)),
        "+x": ((1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1)),
        "-y": ((0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1)),
        "+y": ((0, 1, 0), (0, 1, 1), (1, 1, 1), (1, 1, 0)),
        "-z": ((0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0)),
        "+z": ((0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)),
    }
    return {name: tuple(corner[c] for c in corners) for name, corners in names.items()}


def reverse(face):
    """The same face with its front on the other side."""
    return (face[0], *reversed(face[1:]))


def rotate(face, n):
    """The same face with another first corner."""
    return (*face[n:], *face[:n])


def ring(outer, inner):
    """The part of the quadrilateral `outer` outside `inner`; both start at corners that lie near each other."""
    return [(outer[i], outer[j], inner[j], inner[i]) for i, j in enumerate([1, 2, 3, 0])]


def triangles(faces):
    """Splits faces into triangles from their first corners."""
    return [(face[0], face[i], face[i + 1]) for face in faces for i in range(1, len(face) - 1)]


def check_closed(faces, volume):
    """Asserts that the faces close a space: every edge has exactly one partner that runs the other way, and the
    signed volume is `volume` (negative when the fronts face the inside)."""
    edges = Counter()
    total = 0.0
    for a, b, c in triangles(faces):
        edges.update([(a, b), (b, c), (c, a)])
        total += determinant(a, b, c) / 6.0
    assert all(n == 1 and edges[(b, a)] == 1 for (a, b), n in edges.items()), "an edge without a partner"
    assert abs(total - volume) < 1e-12 * abs(volume), (total, volume)


def determinant(a, b, c):
    return sum(a[i] * (b[i - 2] * c[i - 1] - b[i - 1] * c[i - 2]) for i in range(3))


def polygon_area(corners):
    return abs(sum(x * corners[i - 1][1] - corners[i - 1][0] * y for i, (x, y) in enumerate(corners))) / 2.0


# --- materials --------------------------------------------------------------------------------------------------


def lambert(name, reflectance):
    """Lambert surface of the given linear Rec.709 reflectances."""
    factors = {"baseColorFactor": [*reflectance, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0}
    return {"name": name, "pbrMetallicRoughness": factors}


def grey(name, reflectance):
    return lambert(name, (reflectance, reflectance, reflectance))


def emitting(material, colour, luminance):
    """`material` that also emits `luminance` [cd/m2] of the linear Rec.709 colour `colour`."""
    y = 0.2126 * colour[0] + 0.7152 * colour[1] + 0.0722 * colour[2]
    strength = {"KHR_materials_emissive_strength": {"emissiveStrength": luminance / y}}
    return {**material, "emissiveFactor": list(colour), "extensions": strength}


def transmitting(material):
    """`material` as a pane of polished glass."""
    factors = {**material["pbrMetallicRoughness"], "roughnessFactor": 0.0}
    extensions = {"KHR_materials_transmission": {"transmissionFactor": 1.0}}
    return {**material, "pbrMetallicRoughness": factors, "extensions": extensions}


# --- the file format --------------------------------------------------------------------------------------------


class Gltf:
    """A glTF 2.0 file in the making: one node and mesh per surface."""

    def __init__(self, title):
        self.binary = b""
        self.json = {
            "asset": {"version": "2.0", "generator": "scripts/make_scenes.py"},
            "scene": 0,
            "scenes": [{"name": title, "nodes": []}],
            "nodes": [],
        }

    def surface(self, name, faces, material, placement=None):
        """Adds a mesh of indexed triangles without normals, so that every face is flat."""
        corners = triangles(faces)
        positions = list(dict.fromkeys(p for triangle in corners for p in triangle))
        number = {p: i for i, p in enumerate(positions)}
        indices = [number[p] for triangle in corners for p in triangle]
        primitive = {"attributes": {"POSITION": self.positions(positions)}, "indices": self.indices(indices)}
        primitive["material"] = self.material(material)
        mesh = self.add("meshes", {"name": name, "primitives": [primitive]})
        self.node({"name": name, "mesh": mesh, **(placement or {})})

    def lamp(self, name, position, intensity):
        """Adds a point light of `intensity` [cd] in all directions."""
        lights = self.json.setdefault("extensions", {}).setdefault("KHR_lights_punctual", {"lights": []})["lights"]
        lights.append({"name": name, "type": "point", "color": [1.0, 1.0, 1.0], "intensity": intensity})
        reference = {"KHR_lights_punctual": {"light": len(lights) - 1}}
        self.node({"name": name, "translation": list(position), "extensions": reference})

    def camera(self, name, eye, target, yfov):
        """Adds a camera at `eye` that looks at `target`; `yfov` in radians, square pictures."""
        lens = {"aspectRatio": 1.0, "yfov": yfov, "znear": 0.01}
        camera = self.add("cameras", {"name": name, "type": "perspective", "perspective": lens})
        rotation = looking_along([b - a for a, b in zip(eye, target, strict=True)])
        self.node({"name": name, "camera": camera, "translation": list(eye), "rotation": rotation})

    def bytes(self):
        """The finished .glb."""
        known = ("KHR_lights_punctual", "KHR_materials_emissive_strength", "KHR_materials_transmission")
        used = [e for e in known if e in json.dumps(self.json)]
        if used:
            self.json["extensionsUsed"] = used
        self.json["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps(self.json, separators=(",", ":")).encode()
        chunks = chunk(b"JSON", text, b" ") + chunk(b"BIN\0", self.binary, b"\0")
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks

    def positions(self, points):
        data = struct.pack(f"<{3 * len(points)}f", *(x for p in points for x in p))
        stored = [struct.unpack_from("<3f", data, 12 * i) for i in range(len(points))]
        assert len(set(stored)) == len(points), "corners that differ in f64 only"
        bounds = {"min": [min(axis) for axis in zip(*stored)], "max": [max(axis) for axis in zip(*stored)]}
        return self.accessor(data, 34962, {"componentType": 5126, "count": len(points), "type": "VEC3", **bounds})

    def indices(self, numbers):
        data = struct.pack(f"<{len(numbers)}H", *numbers)
        return self.accessor(data, 34963, {"componentType": 5123, "count": len(numbers), "type": "SCALAR"})

    def accessor(self, data, target, description):
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data), "target": target}
        self.binary += data + bytes(-len(data) % 4)
        return self.add("accessors", {"bufferView": self.add("bufferViews", view), **description})

    def material(self, material):
        known = self.json.setdefault("materials", [])
        return known.index(material) if material in known else self.add("materials", material)

    def node(self, node):
        self.json["scenes"][0]["nodes"].append(self.add("nodes", node))

    def add(self, kind, item):
        items = self.json.setdefault(kind, [])
        items.append(item)
        return len(items) - 1


def chunk(kind, data, padding):
    data += padding * (-len(data) % 4)
    return struct.pack("<I4s", len(data), kind) + data


def looking_along(forward):
    """Unit quaternion [x, y, z, w] that turns -Z to `forward` and keeps the horizon level: by `forward`'s heading about
    +Y, then by its height about the new +X. Half angles by square roots, so that no trigonometry is needed."""
    x, y, z = forward
    across = math.sqrt(x * x + z * z)
    length = math.sqrt(across * across + y * y)
    sin_h, cos_h = half_angle(-x / across, -z / across)
    sin_p, cos_p = half_angle(y / length, across / length)
    return [cos_h * sin_p, sin_h * cos_p, -sin_h * sin_p, cos_h * cos_p]


def half_angle(sine, cosine):
    """Sine and cosine of half the angle, for angles within a half turn."""
    return math.copysign(math.sqrt((1.0 - cosine) / 2.0), sine), math.sqrt((1.0 + cosine) / 2.0)


if __name__ == "__main__":
    sys.exit(main())
