"""Writes glTF files with exporters from PyPI into the folder named: trimesh, CadQuery, VTK, usd2gltf, IfcOpenShell.

Run by `run`, from an environment in which they are installed.
"""

import sys
import traceback
from pathlib import Path

import numpy as np
from PIL import Image

folder = Path(sys.argv[1])


def letter():
    """An F, dark on light: shows whether an image lies the right way round."""
    rows = ["........", ".#####..", ".#......", ".####...", ".#......", ".#......", ".#......", "........"]
    pixels = [[(60, 30, 20) if c == "#" else (230, 180 - 10 * y, 60 + 20 * x) for x, c in enumerate(row)] for y, row in enumerate(rows)]
    return Image.fromarray(np.array(pixels, dtype=np.uint8))


def write_trimesh():
    import trimesh
    from trimesh.visual.material import PBRMaterial

    scene = trimesh.Scene()
    floor = trimesh.Trimesh([[-1.5, 0, 1.5], [1.5, 0, 1.5], [1.5, 0, -1.5], [-1.5, 0, -1.5]], [[0, 1, 2], [0, 2, 3]], process=False)
    paint = PBRMaterial(name="letter", baseColorTexture=letter(), metallicFactor=0.0, roughnessFactor=1.0)
    floor.visual = trimesh.visual.TextureVisuals(uv=[[0, 0], [1, 0], [1, 1], [0, 1]], material=paint)
    scene.add_geometry(floor)
    ball = trimesh.creation.icosphere(subdivisions=3, radius=0.4)
    ball.apply_translation([0, 0.4, 0])
    ball.visual.vertex_colors = np.concatenate([np.uint8(255 * (0.5 + 1.2 * (ball.vertices - [0, 0.4, 0]))), np.full((len(ball.vertices), 1), 255, np.uint8)], axis=1)
    scene.add_geometry(ball)
    scene.export(folder / "trimesh.glb")


def write_cadquery():
    import cadquery as cq

    plate = cq.Workplane("XY").box(3, 3, 0.1).translate((0, 0, -0.05))
    part = cq.Workplane("XY").box(0.9, 0.6, 0.5).faces(">Z").workplane().hole(0.3).edges("|Z").fillet(0.1).translate((0, 0, 0.25))
    assembly = cq.Assembly()
    assembly.add(plate, name="plate", color=cq.Color(0.6, 0.6, 0.55))
    assembly.add(part, name="part", color=cq.Color(0.8, 0.2, 0.1))
    assembly.export(str(folder / "cadquery.glb"), tolerance=0.05, angularTolerance=0.3)


def write_vtk():
    import vtk

    renderer, window = vtk.vtkRenderer(), vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.AddRenderer(renderer)
    plane = vtk.vtkPlaneSource()
    plane.SetOrigin(-1.5, 0, 1.5)
    plane.SetPoint1(1.5, 0, 1.5)
    plane.SetPoint2(-1.5, 0, -1.5)
    cone = vtk.vtkConeSource()
    cone.SetCenter(0, 0.5, 0)
    cone.SetDirection(0, 1, 0)
    cone.SetRadius(0.5)
    cone.SetHeight(1)
    cone.SetResolution(24)
    for source, colour in [(plane, (0.6, 0.6, 0.5)), (cone, (0.2, 0.5, 0.7))]:
        mapper, actor = vtk.vtkPolyDataMapper(), vtk.vtkActor()
        mapper.SetInputConnection(source.GetOutputPort())
        actor.SetMapper(mapper)
        actor.GetProperty().SetColor(colour)
        renderer.AddActor(actor)
    exporter = vtk.vtkGLTFExporter()
    exporter.SetRenderWindow(window)
    exporter.SetFileName(str(folder / "vtk.gltf"))
    exporter.InlineDataOn()
    exporter.Write()


def write_usd():
    from pxr import Gf, Sdf, Usd, UsdGeom, UsdShade
    from usd2gltf import converter

    path = str(folder / "scene.usda")
    stage = Usd.Stage.CreateNew(path)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, 1)
    root = UsdGeom.Xform.Define(stage, "/root")
    stage.SetDefaultPrim(root.GetPrim())
    for name, colour, points in [
        ("floor", (0.6, 0.6, 0.5), [(-1.5, 0, 1.5), (1.5, 0, 1.5), (1.5, 0, -1.5), (-1.5, 0, -1.5)]),
        ("wall", (0.2, 0.6, 0.3), [(-0.6, 0, -0.5), (0.6, 0, -0.5), (0.6, 1, -0.5), (-0.6, 1, -0.5)]),
    ]:
        mesh = UsdGeom.Mesh.Define(stage, f"/root/{name}")
        mesh.CreatePointsAttr([Gf.Vec3f(*p) for p in points])
        mesh.CreateFaceVertexCountsAttr([3, 3])
        mesh.CreateFaceVertexIndicesAttr([0, 1, 2, 0, 2, 3])
        mesh.CreateSubdivisionSchemeAttr("none")
        material = UsdShade.Material.Define(stage, f"/root/materials/{name}")
        shader = UsdShade.Shader.Define(stage, f"/root/materials/{name}/shader")
        shader.CreateIdAttr("UsdPreviewSurface")
        shader.CreateInput("diffuseColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(*colour))
        shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(0.5)
        shader.CreateInput("metallic", Sdf.ValueTypeNames.Float).Set(0.0)
        material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
        UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
    stage.Save()
    converter.Converter().process(stage, str(folder / "usd2gltf.glb"))


def write_ifc():
    import ifcopenshell
    import ifcopenshell.api.aggregate
    import ifcopenshell.api.context
    import ifcopenshell.api.geometry
    import ifcopenshell.api.root
    import ifcopenshell.api.spatial
    import ifcopenshell.api.unit
    import ifcopenshell.geom

    model = ifcopenshell.file(schema="IFC4")
    project = ifcopenshell.api.root.create_entity(model, ifc_class="IfcProject", name="room")
    ifcopenshell.api.unit.assign_unit(model, length={"is_metric": True, "raw": "METERS"})
    whole = ifcopenshell.api.context.add_context(model, context_type="Model")
    body = ifcopenshell.api.context.add_context(model, context_type="Model", context_identifier="Body", target_view="MODEL_VIEW", parent=whole)
    storey = ifcopenshell.api.root.create_entity(model, ifc_class="IfcBuildingStorey", name="ground")
    ifcopenshell.api.aggregate.assign_object(model, products=[storey], relating_object=project)
    for name, at, size in [("slab", (-1.5, -1.5, -0.1), (3.0, 3.0, 0.1)), ("wall", (-0.8, 0.0, 0.0), (1.6, 0.2, 1.0))]:
        wall = ifcopenshell.api.root.create_entity(model, ifc_class="IfcWall", name=name)
        shape = ifcopenshell.api.geometry.add_wall_representation(model, context=body, length=size[0], height=size[2], thickness=size[1])
        ifcopenshell.api.geometry.assign_representation(model, product=wall, representation=shape)
        matrix = np.eye(4)
        matrix[:3, 3] = at
        ifcopenshell.api.geometry.edit_object_placement(model, product=wall, matrix=matrix)
        ifcopenshell.api.spatial.assign_container(model, products=[wall], relating_structure=storey)
    settings = ifcopenshell.geom.settings()
    serializer = ifcopenshell.geom.serializers.gltf(str(folder / "ifcopenshell.glb"), settings)
    serializer.setFile(model)
    serializer.setUnitNameAndMagnitude("METER", 1.0)
    serializer.writeHeader()
    for shape in ifcopenshell.geom.iterate(settings, model):
        serializer.write(shape)
    serializer.finalize()


failed = False
for write in [write_trimesh, write_cadquery, write_vtk, write_usd, write_ifc]:
    try:
        write()
    except Exception:
        traceback.print_exc()
        failed = True
sys.exit(failed)
