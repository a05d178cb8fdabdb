"""Mitsuba's `path` integrator in a process of its own: one request a line on standard input, as JSON.

A request has scene, kind, setting, seconds, seed and a file for the result; the answer has the CPU seconds of the
rendering. Images are rendered by Mitsuba's own sensor and film with a box filter. A grid is one wavefront of all
points: light that arrives straight from the lamp by sampling the lamp, all other light by `path` along rays whose
directions are distributed as the cosine. The first pass of each setting, which compiles kernels, is not counted.
"""

import json
import sys
import time

import drjit as dr
import mitsuba as mi
import numpy as np
import scenes
from settings import SIDE, TARGET


def main():
    mi.set_variant(sys.argv[1])
    dr.set_thread_count(1)
    mi.set_log_level(mi.LogLevel.Error)
    for line in sys.stdin:
        request = json.loads(line)
        mean, variance, seconds = render(request)
        np.savez(request["result"], mean=mean, variance=variance)
        print(json.dumps({"seconds": seconds}), flush=True)


TASKS = {}


def render(request):
    """Mean over the passes, its variance as the passes scatter, and CPU seconds."""
    key = json.dumps([request["scene"], request["kind"], request["setting"]])
    if key not in TASKS:
        TASKS[key] = {"grid": Grid, "image": Image}[request["kind"]](request["scene"], request["setting"])
        TASKS[key].sample(0)
    task = TASKS[key]
    first = 1 + request["seed"] * 1_000_003
    total, squares, count = 0.0, 0.0, 0
    start = time.process_time()
    while count < 1 or time.process_time() - start < request["seconds"]:
        values = task.sample(first + count)
        total, squares, count = total + values, squares + values * values, count + 1
    seconds = time.process_time() - start
    mean = total / count
    variance = (squares / count - mean * mean) / max(count - 1, 1)
    return mean, variance, seconds


class Grid:
    """Illuminance [lx] at the points of the scene's grid."""

    def __init__(self, name, setting):
        scene = scenes.load(name)
        self.points = scene.grid_points()
        self.scene = mi.load_dict(describe(scene))
        self.sampler = mi.load_dict({"type": setting["sampler"], "sample_count": setting["samples"]})
        # Some samplers take only counts of a certain form.
        self.samples = self.sampler.sample_count()
        # Hidden lamps: what they send straight to the points is counted by sampling them.
        path = {"type": "path", "max_depth": -1, "rr_depth": setting["rr_depth"], "hide_emitters": True}
        self.path = mi.load_dict(path)
        self.lanes = mi.Point3f(*(mi.Float(np.repeat(axis, self.samples)) for axis in self.points.T))

    def sample(self, seed):
        with dr.suspend_grad():
            count = len(self.points) * self.samples
            self.sampler.set_samples_per_wavefront(self.samples)
            self.sampler.seed(seed, count)
            values = self.straight(count) + dr.pi * self.reflected()
            sums = dr.block_sum(values, self.samples)
            return np.array(sums, dtype=float) / self.samples

    def reflected(self):
        local = mi.warp.square_to_cosine_hemisphere(self.sampler.next_2d())
        frame = mi.Frame3f(mi.Normal3f(*scenes.NORMAL))
        rays = mi.RayDifferential3f(mi.Ray3f(self.lanes, frame.to_world(local)))
        radiance, _, _ = self.path.sample(self.scene, self.sampler, rays)
        return mono(radiance)

    def straight(self, count):
        place = dr.zeros(mi.Interaction3f, count)
        place.p = self.lanes
        sample, weight = self.scene.sample_emitter_direction(place, self.sampler.next_2d(), test_visibility=True)
        return mono(weight) * dr.maximum(dr.dot(sample.d, mi.Vector3f(*scenes.NORMAL)), 0)


class Image:
    """Luminance [cd/m2] of the pixels of the scene's camera."""

    def __init__(self, name, setting):
        scene = scenes.load(name)
        camera = scene.camera
        description = describe(scene)
        description["integrator"] = {"type": "path", "max_depth": -1, "rr_depth": setting["rr_depth"]}
        description["sensor"] = {
            "type": "perspective",
            "fov": float(np.degrees(2 * np.arctan(camera.tangent))),
            "to_world": mi.ScalarTransform4f().look_at(
                origin=camera.eye.tolist(), target=(camera.eye + camera.forward).tolist(), up=camera.up.tolist()
            ),
            "near_clip": 0.01,
            "film": {
                "type": "hdrfilm",
                "width": SIDE["image"],
                "height": SIDE["image"],
                "pixel_format": "luminance",
                "component_format": "float32",
                "rfilter": {"type": "box"},
            },
            "sampler": {"type": setting["sampler"], "sample_count": setting["samples"]},
        }
        self.scene = mi.load_dict(description)

    def sample(self, seed):
        with dr.suspend_grad():
            return np.array(mi.render(self.scene, seed=seed), dtype=float).ravel()


def mono(colour):
    """Scenes are grey, so any channel is the luminance."""
    return colour[0]


def describe(scene):
    """The scene as Mitsuba's dictionary, photometric units as they are."""
    description = {"type": "scene"}
    for number, surface in enumerate(scene.surfaces):
        shape = {
            "type": "ply",
            "filename": write_ply(scene.name, number, surface.corners),
            "face_normals": True,
            "bsdf": {"type": "diffuse", "reflectance": constant(surface.reflectance)},
        }
        if surface.luminance > 0:
            shape["emitter"] = {"type": "area", "radiance": constant(surface.luminance)}
        description[f"surface{number}"] = shape
    if scene.lamp:
        position, intensity = scene.lamp
        description["lamp"] = {"type": "point", "position": position.tolist(), "intensity": constant(intensity)}
    return description


def constant(value):
    if "mono" in mi.variant():
        return {"type": "uniform", "value": value}
    return {"type": "rgb", "value": [value] * 3}


def write_ply(scene, number, corners):
    path = TARGET / f"{scene}-{number}.ply"
    vertices, faces = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n"
    head += "property float x\nproperty float y\nproperty float z\n"
    head += f"element face {len(corners)}\nproperty list uchar int vertex_indices\nend_header\n"
    rows = np.zeros(len(corners), dtype=[("n", "u1"), ("v", "<i4", 3)])
    rows["n"], rows["v"] = 3, faces.reshape(-1, 3)
    path.write_bytes(head.encode() + vertices.astype("<f4").tobytes() + rows.tobytes())
    return str(path)


if __name__ == "__main__":
    main()
