"""The scenes: read from GLB once, so that all programs get the same corners, reflectances and lights.

`room` is scenes/room.glb as it is. `cornell` is scenes/cornell.glb with a panel that reflects nothing, because a
Radiance `light` cannot reflect. `object` is the room with a bumpy sphere of 128 000 triangles. The last two are
written into target/. Colours count by their luminance. The grid of the rooms lies 0.8 m over the floor and is laid so
that its lines pass 6 mm from all four faces of the column; that of the Cornell box lies 1 mm over its floor, so that
no program starts on a surface.
"""

import json
import math
import struct
import sys
from dataclasses import dataclass

import numpy as np
from settings import ROOT, SIDE, TARGET

sys.path.insert(0, str(ROOT / "scripts"))
import make_scenes  # noqa: E402

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
# Corner, edges [m] of the grids. Spacings of 0.412/3 and 0.412/4 m put lines at 3.894 and 4.306, -2.394 and -2.806 m:
# 6 mm from the column, whose faces are at 3.9 and 4.3, -2.4 and -2.8 m.
COLUMN_GRID = {
    "origin": (3.894 - 20.5 * 0.412 / 3, 0.8, -2.394 + 19.5 * 0.103),
    "u": (32 * 0.412 / 3, 0.0, 0.0),
    "v": (0.0, 0.0, -32 * 0.103),
}
GRIDS = {
    "room": COLUMN_GRID,
    "object": COLUMN_GRID,
    "cornell": {"origin": (0.0, 0.001, 0.0), "u": (0.556, 0.0, 0.0), "v": (0.0, 0.0, -0.5592)},
}
NORMAL = (0.0, 1.0, 0.0)
# Centre [m], mean radius [m], corners around and rows of the object: 2 * 400 * 160 triangles.
OBJECT = ((2.3, 1.55, -1.5), 0.45, 400, 161)


@dataclass
class Surface:
    """Triangles (n, 3, 3) [m] of one material."""

    name: str
    corners: np.ndarray
    reflectance: float
    luminance: float  # cd/m2


@dataclass
class Camera:
    """Place [m] and axes; `tangent` is that of half the field of view, pictures are square."""

    eye: np.ndarray
    right: np.ndarray
    up: np.ndarray
    forward: np.ndarray
    tangent: float

    def rays(self, generator, side):
        """Origins and directions of one ray a pixel, uniform over each, row 0 on top."""
        row, column = np.divmod(np.arange(side * side), side)
        jitter = generator.random((2, side * side))
        u = ((column + jitter[0]) / side * 2 - 1) * self.tangent
        v = (1 - (row + jitter[1]) / side * 2) * self.tangent
        directions = self.forward + u[:, None] * self.right + v[:, None] * self.up
        return np.broadcast_to(self.eye, directions.shape), directions


@dataclass
class Scene:
    """What the programs are given."""

    name: str
    path: str
    surfaces: list
    lamp: tuple  # position [m], intensity [cd]; or None
    camera: Camera

    def grid_points(self):
        """Cell centres [m], row by row, u fastest."""
        grid, side = GRIDS[self.name], SIDE["grid"]
        row, column = np.divmod(np.arange(side * side), side)
        along, across = ((x + 0.5)[:, None] / side for x in (column, row))
        return np.array(grid["origin"]) + along * np.array(grid["u"]) + across * np.array(grid["v"])


def make(name):
    """Path of the scene's GLB, written if it is not one that ships."""
    shipped = ROOT / "scenes" / f"{'cornell' if name == 'cornell' else 'room'}.glb"
    if name == "room":
        return shipped
    gltf = make_scenes.Gltf("")
    gltf.json, gltf.binary = parse(shipped.read_bytes())
    if name == "cornell":
        panel = next(m for m in gltf.json["materials"] if m.get("emissiveFactor"))
        panel["pbrMetallicRoughness"]["baseColorFactor"] = [0.0, 0.0, 0.0, 1.0]
    else:
        gltf.surface("object", bumpy_sphere(*OBJECT), make_scenes.grey("object 0.5", 0.5))
    path = TARGET / f"{name}.glb"
    path.write_bytes(gltf.bytes())
    return path


def load(name):
    """The scene as all programs get it."""
    path = make(name)
    gltf, binary = parse(path.read_bytes())
    surfaces, lamp, camera = [], None, None
    for node in gltf["nodes"]:
        if "mesh" in node:
            surfaces += [surface(gltf, binary, node["name"], p) for p in gltf["meshes"][node["mesh"]]["primitives"]]
        elif "camera" in node:
            camera = camera_at(node, gltf["cameras"][node["camera"]]["perspective"]["yfov"])
        else:
            light = gltf["extensions"]["KHR_lights_punctual"]["lights"][0]
            lamp = (np.array(node["translation"]), light["intensity"])
    return Scene(name, str(path), surfaces, lamp, camera)


def parse(content):
    """JSON and binary chunk of a GLB."""
    (length,) = struct.unpack_from("<I", content, 12)
    gltf = json.loads(content[20 : 20 + length])
    (size,) = struct.unpack_from("<I", content, 20 + length)
    gltf.pop("buffers")
    return gltf, content[28 + length : 28 + length + size]


def surface(gltf, binary, name, primitive):
    """The triangles of a primitive of make_scenes.py: f32 positions, u16 indices, no transform."""

    def read(accessor, kind):
        description = gltf["accessors"][accessor]
        view = gltf["bufferViews"][description["bufferView"]]
        return np.frombuffer(binary, kind, view["byteLength"] // np.dtype(kind).itemsize, view["byteOffset"])

    positions = read(primitive["attributes"]["POSITION"], "<f4").reshape(-1, 3)
    corners = positions[read(primitive["indices"], "<u2")].reshape(-1, 3, 3)
    material = gltf["materials"][primitive["material"]]
    reflectance = np.dot(LUMINANCE, material["pbrMetallicRoughness"]["baseColorFactor"][:3])
    strength = material.get("extensions", {}).get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0)
    luminance = strength * np.dot(LUMINANCE, material.get("emissiveFactor", (0, 0, 0)))
    return Surface(name, corners, float(reflectance), float(luminance))


def camera_at(node, yfov):
    x, y, z, w = node["rotation"]
    right = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])
    up = np.array([2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)])
    return Camera(np.array(node["translation"]), right, up, np.cross(up, right), math.tan(yfov / 2))


def bumpy_sphere(centre, radius, around, rows):
    """Triangles of a sphere with bumps of three sizes, fronts outward, poles on the vertical axis."""

    def corner(i, j):
        u, v = (i % around) / around * 2 * math.pi, j / rows * math.pi
        ring = math.sin(v) if 0 < j < rows else 0.0
        bumps = 0.12 * math.sin(5 * u + 0.3) * ring**2 * math.cos(4 * v)
        bumps += 0.05 * math.sin(17 * u) * math.sin(13 * v + 0.3) * ring
        bumps += 0.015 * math.sin(61 * u + 0.3) * math.sin(47 * v) * ring
        r = radius * (1 + bumps)
        shape = (0.8 * ring * math.cos(u), 1.15 * math.cos(v), -0.9 * ring * math.sin(u))
        return tuple(c + r * s for c, s in zip(centre, shape, strict=True))

    points = [[corner(i, j) for i in range(around)] for j in range(rows + 1)]
    faces = []
    for j in range(rows):
        for i in range(around):
            a, b = points[j][i], points[j + 1][i]
            c, d = points[j + 1][(i + 1) % around], points[j][(i + 1) % around]
            faces += [(a, b, d)] if j > 0 else []
            faces += [(d, b, c)] if j < rows - 1 else []
    return faces
