"""Models a furnished living room in Blender and exports it with Blender's own glTF exporter.

    scripts/blender/run scenes/blender_room.glb      (installs Blender as a Python module, then runs this)

Real input for the renderer, not made by its own scripts: nested parents with rotation and non-uniform scale, mirrored
and shared meshes, smooth normals, several materials on one mesh, an image texture, glossy and metallic materials,
point and spot lamps, an emissive panel, two cameras. Blender has +Z up; the exporter turns it to +Y up:
(x, y, z) -> (x, z, -y). The room is 5 x 4 x 2.6 m.
"""

import math
import random
import sys
import tempfile
from pathlib import Path

import bpy
from mathutils import Vector

sys.path.insert(0, str(Path(__file__).parent))
from shapes import block, cushion, cylinder, lathe, moved, png, rug_picture, sphere

LUMENS_PER_WATT = 683.0  # what the exporter takes a watt of a lamp for
MATERIALS = {}


def main():
    output = Path(sys.argv[1]).resolve()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y = 192, 128
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "rug.png"
        picture.write_bytes(png(rug_picture()))
        make_materials(str(picture))
        for build in (shell, dining_group, sofa, shelf, floor_lamp, small_things, lights, cameras):
            build()
        bpy.ops.export_scene.gltf(
            filepath=str(output),
            export_format="GLB",
            export_cameras=True,
            export_lights=True,
            export_import_convert_lighting_mode="SPEC",
            export_apply=False,
            export_animations=False,
            export_yup=True,
        )


# --- materials --------------------------------------------------------------------------------------------------


def make_materials(picture):
    """Linear Rec.709 reflectances; roughness 1 and metallic 0 is Lambert to the renderer."""
    matt = {
        "wall": (0.70, 0.68, 0.63),
        "accent wall": (0.30, 0.42, 0.45),
        "ceiling": (0.80, 0.80, 0.78),
        "fabric blue": (0.10, 0.17, 0.27),
        "fabric ochre": (0.55, 0.33, 0.08),
        "paper red": (0.45, 0.08, 0.06),
        "paper green": (0.12, 0.28, 0.14),
        "paper cream": (0.66, 0.60, 0.45),
        "canvas": (0.62, 0.55, 0.40),
    }
    for name, colour in matt.items():
        material(name, colour)
    material("floorboards", (0.34, 0.21, 0.12), roughness=0.6)
    material("oak", (0.46, 0.31, 0.18), roughness=0.45)
    material("white lacquer", (0.74, 0.74, 0.72), roughness=0.4)
    material("glazed clay", (0.12, 0.32, 0.36), roughness=0.35)
    material("apple", (0.42, 0.09, 0.05), roughness=0.5)
    material("brushed steel", (0.62, 0.60, 0.57), roughness=0.4, metallic=1.0)
    material("lampshade", (0.74, 0.68, 0.55), both_sides=True)
    material("panel", (0.6, 0.6, 0.6), luminance=2500.0)
    rug = material("rug", (0.8, 0.8, 0.8))
    texture = rug.node_tree.nodes.new("ShaderNodeTexImage")
    texture.image = bpy.data.images.load(picture)
    texture.image.pack()
    rug.node_tree.links.new(texture.outputs["Color"], rug.node_tree.nodes["Principled BSDF"].inputs["Base Color"])


def material(name, colour, roughness=1.0, metallic=0.0, luminance=0.0, both_sides=False):
    """A Principled material; `luminance` [cd/m2] is what the exporter writes as emissive strength."""
    made = MATERIALS[name] = bpy.data.materials.new(name)
    made.use_nodes = True
    made.use_backface_culling = not both_sides
    inputs = made.node_tree.nodes["Principled BSDF"].inputs
    inputs["Base Color"].default_value = (*colour, 1.0)
    inputs["Roughness"].default_value = roughness
    inputs["Metallic"].default_value = metallic
    if luminance:
        inputs["Emission Color"].default_value = (1.0, 1.0, 1.0, 1.0)
        inputs["Emission Strength"].default_value = luminance
    return made


# --- objects ----------------------------------------------------------------------------------------------------


def mesh(name, *parts):
    """A mesh from (shape, material name, smooth) parts, one material slot for each material."""
    made, vertices, faces, slots, smooth = bpy.data.meshes.new(name), [], [], [], []
    names = list(dict.fromkeys(part[1] for part in parts))
    for (points, polygons), material_name, is_smooth in parts:
        faces += [tuple(len(vertices) + i for i in polygon) for polygon in polygons]
        slots += [names.index(material_name)] * len(polygons)
        smooth += [is_smooth] * len(polygons)
        vertices += points
    made.from_pydata(vertices, [], faces)
    for material_name in names:
        made.materials.append(MATERIALS[material_name])
    made.polygons.foreach_set("material_index", slots)
    made.polygons.foreach_set("use_smooth", smooth)
    assert not made.validate(), f"{name}: Blender had to repair it"
    return made


def place(name, data, location=(0, 0, 0), degrees=0.0, scale=(1, 1, 1), parent=None):
    """An object with `data` (None: an empty parent), turned about the vertical."""
    made = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(made)
    made.location, made.scale, made.parent = location, scale, parent
    made.rotation_euler = (0.0, 0.0, math.radians(degrees))
    return made


def shell():
    """Floor, walls and ceiling: one box seen from inside; a skirting board, a door and a picture a little off them."""
    corners, faces = block((0, 0, 0), (5, 4, 2.6))
    inward = [tuple(reversed(face)) for face in faces]
    kinds = ["ceiling", "wall", "accent wall", "wall", "wall", "floorboards"]
    shell_parts = [((corners, [face]), kind, False) for face, kind in zip(inward, kinds)]
    place("shell", welded(mesh("shell", *shell_parts)))
    door = block((-0.45, -0.02, 0.005), (0.45, 0.02, 2.05)), "white lacquer", False
    handle = moved(sphere(0.03), (-0.37, -0.06, 1.05)), "brushed steel", True
    place("door", mesh("door", door, handle), (4.3, 3.97, 0))
    frame = block((-0.02, -0.45, -0.32), (0.02, 0.45, 0.32)), "oak", False
    canvas = block((-0.03, -0.4, -0.27), (-0.021, 0.4, 0.27)), "canvas", False
    place("picture", mesh("picture", frame, canvas), (4.97, 2.0, 1.55))


def welded(data):
    """Joins corners that lie in one place, so that the box is closed."""
    import bmesh

    editor = bmesh.new()
    editor.from_mesh(data)
    bmesh.ops.remove_doubles(editor, verts=editor.verts, dist=1e-6)
    editor.to_mesh(data)
    editor.free()
    return data


def dining_group():
    """A table and four chairs of one mesh under two parents: a turn, and a non-uniform scale inside it."""
    group = place("dining group", None, (3.45, 2.35, 0), degrees=14)
    stretched = place("dining stretched", None, scale=(1.12, 0.95, 1.0), parent=group)
    feet = [(x, y) for x in (-0.66, 0.66) for y in (-0.34, 0.34)]
    legs = [block((x - 0.03, y - 0.03, 0.002), (x + 0.03, y + 0.03, 0.705)) for x, y in feet]
    top = moved(cushion((0.75, 0.43, 0.02), power=0.12, sectors=64), (0, 0, 0.72))
    table_mesh = mesh("table", (top, "oak", True), *((leg, "oak", False) for leg in legs))
    place("table", table_mesh, parent=stretched)
    chair_mesh = chair()
    for i, (x, y, degrees) in enumerate([(-0.35, -0.62, 4), (0.38, -0.6, -7), (-0.36, 0.6, 176), (0.4, 0.72, 201)]):
        place(f"chair {i + 1}", chair_mesh, (x, y, 0), degrees, parent=stretched)
    # A child's chair: the same mesh, smaller and narrower, under a parent of its own.
    corner = place("play corner", None, (2.45, 0.75, 0), degrees=-35, scale=(0.62, 0.55, 0.58))
    place("chair for a child", chair_mesh, degrees=105, parent=corner)


def chair():
    legs = [cylinder(0.018, 0.003, 0.44, 12) for _ in range(4)]
    feet = [(x, y, 0.0) for x in (-0.18, 0.18) for y in (-0.17, 0.17)]
    seat = moved(cushion((0.22, 0.21, 0.025), power=0.25), (0, 0, 0.455)), "fabric ochre", True
    posts = [(moved(cylinder(0.015, 0.44, 0.86, 12), (x, -0.19, 0)), "oak", True) for x in (-0.16, 0.16)]
    back = moved(cushion((0.2, 0.018, 0.13), power=0.3), (0, -0.19, 0.76)), "oak", True
    return mesh("chair", seat, back, *posts, *((moved(leg, at), "oak", True) for leg, at in zip(legs, feet)))


def sofa():
    """Against the wall x = 0; the left arm is the right one mirrored by a negative scale."""
    parent = place("sofa", None, (0.5, 1.75, 0), degrees=90)
    base = block((-0.8, -0.38, 0.1), (0.8, 0.36, 0.27)), "fabric blue", False
    feet = [(moved(cylinder(0.03, 0.002, 0.12, 12), (x, y, 0)), "oak", True) for x in (-0.7, 0.7) for y in (-0.3, 0.3)]
    place("sofa base", mesh("sofa base", base, *feet), parent=parent)
    pillow = mesh("cushion", (cushion((1.0, 1.0, 1.0)), "fabric blue", True))
    for side in (-1, 1):
        place("seat", pillow, (0.4 * side, -0.08, 0.365), scale=(0.385, 0.29, 0.09), parent=parent)
        place("back", pillow, (0.4 * side, 0.29, 0.6), scale=(0.385, 0.1, 0.24), parent=parent)
    loose = mesh("loose cushion", (cushion((0.2, 0.06, 0.2), power=0.5), "fabric ochre", True))
    leaning = place("loose cushion", loose, (-0.5, 0.09, 0.66), parent=parent)
    leaning.rotation_euler = (math.radians(-18), math.radians(8), math.radians(-10))
    # An arm that leans outward, so that its mirror image is not itself.
    corners, faces = block((0.815, -0.4, 0.06), (0.93, 0.4, 0.58))
    leaning_corners = [(x + 0.06 * (z > 0.5), y, z) for x, y, z in corners]
    arm = mesh("arm", ((leaning_corners, faces), "fabric blue", False))
    place("right arm", arm, parent=parent)
    place("left arm", arm, scale=(-1, 1, 1), parent=parent)


def shelf():
    """Boards and sides of one cube mesh, books of another with a material for each book."""
    parent = place("shelf", None, (1.55, 3.8, 0))
    cube = block((-0.5, -0.5, 0.0), (0.5, 0.5, 1.0))
    board = mesh("board", (cube, "white lacquer", False))
    for height in (0.06, 0.46, 0.86, 1.26, 1.66):
        place("shelf board", board, (0, 0, height), scale=(1.2, 0.32, 0.025), parent=parent)
    for x in (-0.62, 0.62):
        place("shelf side", board, (x, 0, 0.004), scale=(0.03, 0.33, 1.75), parent=parent)
    papers = [mesh(f"book {name}", (cube, f"paper {name}", False)) for name in ("red", "green", "cream")]
    dice = random.Random(7)
    for height in (0.0851, 0.4851, 0.8851, 1.2851):
        x = -0.57
        end = dice.uniform(-0.1, 0.5)
        while x < end:
            width, depth, tall = dice.uniform(0.02, 0.055), dice.uniform(0.16, 0.24), dice.uniform(0.2, 0.33)
            place("book", dice.choice(papers), (x + width / 2, 0.02, height), scale=(width, depth, tall), parent=parent)
            x += width + 0.002
    ball = mesh("ball", (sphere(1.0), "glazed clay", True))
    place("ball", ball, (0.42, 0.0, 0.4851 + 0.101), scale=(0.1, 0.1, 0.1), parent=parent)
    place("egg", ball, (0.4, 0.0, 1.2851 + 0.141), scale=(0.09, 0.09, 0.14), parent=parent)


def floor_lamp():
    """A steel stand and a conical shade, open above and below and seen from both sides."""
    stand = lathe([(0.0, 0.002), (0.15, 0.002), (0.15, 0.02), (0.012, 0.035), (0.012, 1.38), (0.0, 1.38)])
    shade = lathe([(0.24, 1.36), (0.22, 1.42), (0.19, 1.52), (0.16, 1.62)], 32)
    place("floor lamp", mesh("floor lamp", (stand, "brushed steel", True), (shade, "lampshade", True)), (0.5, 3.3, 0))


def small_things():
    """A vase, apples of one mesh, the panel's housing over the table, a rug and an ottoman."""
    profile = [(0.0, 0.0), (0.05, 0.0), (0.075, 0.03), (0.085, 0.08), (0.075, 0.14), (0.045, 0.2), (0.03, 0.24)]
    profile += [(0.032, 0.27), (0.042, 0.29), (0.037, 0.288), (0.027, 0.265), (0.025, 0.24), (0.0, 0.22)]
    place("vase", mesh("vase", (lathe(profile, 32), "glazed clay", True)), (3.5, 2.3, 0.7415))
    apple = mesh("apple", (sphere(0.04), "apple", True))
    for x, y, scale in [(3.2, 2.2, (1, 1, 0.88)), (3.29, 2.24, (0.95, 1.02, 0.9)), (3.22, 2.3, (1.05, 1, 0.93))]:
        place("apple", apple, (x, y, 0.7415 + 0.04 * scale[2]), scale=scale)
    rug = mesh("rug", (block((-0.75, -1.0, 0.0), (0.75, 1.0, 0.01), bottom=False), "rug", False))
    along = rug.uv_layers.new(name="UVMap").data
    for corner, vertex in zip(along, (rug.vertices[loop.vertex_index].co for loop in rug.loops)):
        corner.uv = (vertex.x / 1.5 + 0.5, vertex.y / 2.0 + 0.5)
    place("rug", rug, (1.9, 1.75, 0.002), degrees=-6)
    ottoman = mesh("ottoman", (cushion((1.0, 1.0, 1.0), power=0.6), "fabric ochre", True))
    place("ottoman", ottoman, (1.75, 1.35, 0.215), scale=(0.3, 0.3, 0.2))


def lights():
    """About 800 lm from the floor lamp, 500 lm from a spot at the shelf, 2500 cd/m2 on 0.6 x 0.4 m over the table."""
    lamp = bpy.data.lights.new("floor lamp bulb", "POINT")
    lamp.energy, lamp.shadow_soft_size = 800.0 / LUMENS_PER_WATT, 0.0
    place("floor lamp bulb", lamp, (0.5, 3.3, 1.5))
    spot = bpy.data.lights.new("shelf spot", "SPOT")
    spot.spot_size, spot.spot_blend, spot.shadow_soft_size = math.radians(60), 0.4, 0.0
    spot.energy = 4 * math.pi * 500.0 / spot_angle(spot) / LUMENS_PER_WATT
    aim(place("shelf spot", spot, (1.55, 2.3, 2.5)), (1.55, 3.7, 1.0))
    housing = block((-0.32, -0.22, 0.0), (0.32, 0.22, 0.045)), "white lacquer", False
    glowing = ([(-0.3, -0.2, -0.002), (-0.3, 0.2, -0.002), (0.3, 0.2, -0.002), (0.3, -0.2, -0.002)], [(0, 1, 2, 3)])
    place("panel", mesh("panel", housing, (glowing, "panel", False)), (3.45, 2.35, 2.54), degrees=14)


def spot_angle(spot):
    """Solid angle [sr] by which a spot's intensity on its axis must be multiplied for its flux, with the falloff that
    KHR_lights_punctual recommends: ((cos - cos outer)/(cos inner - cos outer))^2 between the cones."""
    outer = spot.spot_size / 2
    inner = outer - outer * spot.spot_blend
    return 2 * math.pi * ((1 - math.cos(inner)) + (math.cos(inner) - math.cos(outer)) / 3)


def cameras():
    for name, eye, target, degrees in [
        ("camera_wide", (4.75, 0.25, 1.6), (1.75, 2.5, 0.85), 58.0),
        ("camera_detail", (2.35, 1.1, 1.3), (3.42, 2.3, 0.82), 36.0),
    ]:
        camera = bpy.data.cameras.new(name)
        camera.sensor_fit, camera.lens_unit, camera.clip_start = "VERTICAL", "FOV", 0.01
        camera.angle = math.radians(degrees)
        aim(place(name, camera, eye), target)


def aim(thing, target):
    """Turns a camera or a spot, which look along -Z, to `target`."""
    along = Vector(target) - thing.location
    thing.rotation_euler = along.to_track_quat("-Z", "Y").to_euler()


if __name__ == "__main__":
    main()
