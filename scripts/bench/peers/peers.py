"""One class a program, all with `measure(scene, kind, setting, seconds, seed)`, which gives a `Result`."""

import csv
import json
import os
import re
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import process
import scenes
from settings import LEAST_BATCHES, SIDE, TARGET


@dataclass
class Result:
    """Values of all bins and what they cost; `variance` of the values as the program's own parts scatter, if it has."""

    values: np.ndarray
    seconds: float  # CPU seconds of the rendering alone
    variance: np.ndarray = None
    whole: float = None  # CPU seconds of all processes, planning and loading included
    worker: float = None  # wall seconds that the worker says itself


class Lampyris:
    """`plan`, `work` on one thread, `merge`. The rendering is `work` without what `work` takes for one lux-meter and a
    few histories in the same scene: loading, building, writing. Planning, which follows pilot trajectories, counts in
    `whole`."""

    def __init__(self, binary):
        self.binary, self.rates, self.loading = binary, {}, {}

    def version(self):
        digest = subprocess.run(["sha256sum", self.binary], capture_output=True, text=True, check=True).stdout[:12]
        text = subprocess.run([self.binary, "--version"], capture_output=True, text=True, check=True).stdout.strip()
        return f"{text} (binary {digest})"

    def measure(self, scene, kind, setting, seconds, seed):
        key = json.dumps([scene.name, kind, setting])
        if scene.name not in self.loading:
            self.loading[scene.name] = self.execute(scene, "nothing", setting, LEAST_BATCHES, 1)["work"]
        batches = LEAST_BATCHES
        while key not in self.rates:
            work = self.execute(scene, kind, setting, batches, 1)["work"] - self.loading[scene.name]
            if work > 0.2 * min(seconds, 2.0):
                self.rates[key] = batches / work
            batches *= 4
        batches = max(LEAST_BATCHES, round(self.rates[key] * seconds))
        spent = self.execute(scene, kind, setting, batches, 2 + seed)
        folder = spent["folder"]
        values, variance = read_grid(folder / "grid.csv") if kind == "grid" else read_image(folder / "image.exr")
        worker = json.loads((folder / "summary.json").read_text())["timings"]["worker_seconds"]
        rendering = spent["work"] - self.loading[scene.name]
        self.rates[key] = batches / rendering
        return Result(values, rendering, variance, spent["work"] + spent["plan"], worker)

    def execute(self, scene, kind, setting, batches, seed):
        folder = TARGET / "runs" / f"{scene.name}-{kind}"
        subprocess.run(["rm", "-rf", folder], check=True)
        job = TARGET / f"{scene.name}-{kind}.toml"
        job.write_text(job_text(scene, kind, setting, batches, seed))
        _, plan = process.run([self.binary, "plan", job, "-o", folder])
        _, work = process.run([self.binary, "work", folder, "--shard", "0", "--threads", "1"])
        if kind != "nothing":
            process.run([self.binary, "merge", folder])
        return {"folder": folder, "plan": plan, "work": work}


def job_text(scene, kind, setting, batches, seed):
    histories = 1 if kind == "nothing" else setting["histories"]
    text = f'scene = "{scene.path}"\n[run]\nseed = {seed}\nhistories_per_batch = {histories}\nbatches = {batches}\n'
    text += f'batches_per_shard = {batches}\nchannels = "luminance"\ncheckpoint_seconds = 60.0\n'
    if kind == "nothing":
        x, y, z = scene.grid_points()[0].tolist()
        return text + f'[[point]]\nname = "one"\nposition = [{x}, {y}, {z}]\nnormal = {list(scenes.NORMAL)}\n'
    if kind == "grid":
        lines = "".join(f"{key} = {list(value)}\n" for key, value in scenes.GRIDS[scene.name].items())
        side = SIDE["grid"]
        text += f'[[grid]]\nname = "grid"\n{lines}normal = {list(scenes.NORMAL)}\n'
        return text + f"columns = {side}\nrows = {side}\nkeep_batches = false\n"
    side, samples = SIDE["image"], setting["pixel_samples"]
    text += f'[[camera]]\nname = "image"\nnode = "camera"\nwidth = {side}\nheight = {side}\n'
    return text + f"pixel_samples = {samples}\n"


def read_grid(path):
    """Illuminance [lx] and its variance; NaN where a point is inside a solid."""
    with path.open() as file:
        rows = list(csv.DictReader(file))
    number = lambda row, column: float(row[column]) if row[column] else np.nan  # noqa: E731
    values = np.array([np.nan if "inside" in row["note"] else number(row, "illuminance_lx") for row in rows])
    return values, np.array([number(row, "standard_error_lx") for row in rows]) ** 2


def read_image(path):
    """Luminance [cd/m2] and its variance."""
    import mitsuba

    mitsuba.set_variant("scalar_rgb")
    bitmap = mitsuba.Bitmap(str(path))
    names = [field.name for field in bitmap.struct_()]
    pixels = np.array(bitmap).reshape(-1, len(names)).astype(float)
    return pixels[:, names.index("luminance.Y")], pixels[:, names.index("luminance.variance")]


class Mitsuba:
    """Requests to mitsuba_peer.py, one process for each variant."""

    def __init__(self):
        self.workers = {}
        self.library = llvm()

    def version(self):
        import drjit
        import mitsuba

        return f"Mitsuba {mitsuba.__version__}, Dr.Jit {drjit.__version__}, {Path(self.library).name}"

    def measure(self, scene, kind, setting, seconds, seed):
        worker = self.worker(setting["variant"])
        result = TARGET / "mitsuba.npz"
        request = {"scene": scene.name, "kind": kind, "setting": setting, "seconds": seconds, "seed": seed}
        worker.stdin.write(json.dumps({**request, "result": str(result)}) + "\n")
        worker.stdin.flush()
        answer = worker.stdout.readline()
        if not answer:
            del self.workers[setting["variant"]]
            raise process.Failed("Mitsuba ended")
        stored = np.load(result)
        return Result(stored["mean"], json.loads(answer)["seconds"], stored["variance"])

    def worker(self, variant):
        if variant not in self.workers:
            script = Path(__file__).with_name("mitsuba_peer.py")
            command = ["taskset", "-c", str(process.CORE), sys.executable, script, variant]
            environment = {**os.environ, "DRJIT_LIBLLVM_PATH": self.library}
            pipe = subprocess.PIPE
            self.workers[variant] = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, env=environment)
        return self.workers[variant]


def llvm():
    """The newest shared library of LLVM here that Mitsuba takes: 16 or later."""
    lines = subprocess.run(["/sbin/ldconfig", "-p"], capture_output=True, text=True, check=True).stdout
    found = re.findall(r"(\S*libLLVM(?:-(\d+))?\.so(?:\.(\d+))?\S*) .*=> (\S+)", lines)
    usable = [(int(old or new), path) for _, old, new, path in found if int(old or new or 0) >= 16]
    if not usable:
        raise process.Failed("no libLLVM of version 16 or later is installed")
    return max(usable)[1]


class Radiance:
    """rtrace on points of the grid (irradiance) or on rays through the pixels. Loading the octree is measured with one
    ray and taken off. A point source is an `illum` sphere of 1 mm radius: the right intensity, and not seen."""

    def __init__(self, cached):
        import pyradiance

        home = Path(pyradiance.__file__).parent
        self.programs, self.cached = home / "bin", cached
        self.environment = {**os.environ, "RAYPATH": f".:{home / 'lib'}"}
        self.octrees, self.rates, self.loading, self.second = {}, {}, {}, 0

    def version(self):
        output, _ = process.run([self.programs / "rtrace", "-version"], environment=self.environment)
        return output.decode().strip()

    def measure(self, scene, kind, setting, seconds, seed):
        key = json.dumps([scene.name, kind, setting])
        if scene.name not in self.octrees:
            self.octrees[scene.name] = self.octree(scene)
            nothing = {"ab": 0}
            self.loading[scene.name] = self.trace(scene, "grid", nothing, np.zeros((1, 6)))[1]
        if key not in self.rates:
            self.rates[key] = self.passes(scene, kind, setting, 1, 10_000 + seed)
            if self.rates[key].seconds > seconds:
                return self.rates[key]
        # The passes of a cached grid would all find the same stored values.
        repeats = 1 if self.cached and kind == "grid" else max(1, round(seconds / self.rates[key].seconds))
        return self.passes(scene, kind, setting, repeats, seed)

    def passes(self, scene, kind, setting, repeats, seed):
        generator = np.random.default_rng(seed)
        bins = SIDE[kind] ** 2
        # In another order each time: without -u+ the random numbers are the same in every run.
        order = np.concatenate([generator.permutation(bins) for _ in range(repeats)])
        if self.cached and kind == "grid":
            order = np.arange(bins)
        rays = np.empty((repeats * bins, 6))
        for k in range(repeats):
            part = order[k * bins : (k + 1) * bins]
            origins, directions = bin_rays(scene, kind, generator)
            rays[k * bins : (k + 1) * bins] = np.hstack([origins[part], directions[part]])
        values, seconds = self.trace(scene, kind, setting, rays)
        mean = np.bincount(order, values, bins) / repeats
        return Result(mean, max(seconds - self.loading[scene.name], 1e-3))

    def trace(self, scene, kind, setting, rays):
        options = []
        for name, value in setting.items():
            options += [f"-u{value}"] if name == "u" else [f"-{name}", value]
        self.wait_for_another_seed()
        command = [self.programs / "rtrace", "-h", "-fdd", "-ov", *(["-I+"] if kind == "grid" else []), *options]
        output, seconds = process.run([*command, self.octrees[scene.name]], rays.tobytes(), self.environment)
        return np.frombuffer(output).reshape(-1, 3)[:, 1], seconds

    def wait_for_another_seed(self):
        """With -u+ the seed of rtrace is the second of the clock."""
        while int(time.time()) == self.second:
            time.sleep(0.05)
        self.second = int(time.time())

    def octree(self, scene):
        source, octree = TARGET / f"{scene.name}.rad", TARGET / f"{scene.name}.oct"
        source.write_text(radiance_text(scene))
        with octree.open("wb") as file:
            subprocess.run([self.programs / "oconv", "-w", source], stdout=file, check=True, env=self.environment)
        return octree


def bin_rays(scene, kind, generator):
    if kind == "image":
        return scene.camera.rays(generator, SIDE["image"])
    points = scene.grid_points()
    return points, np.broadcast_to(scenes.NORMAL, points.shape)


def panel(triangles):
    """The quadrilateral of two triangles: Radiance samples parallelograms exactly, triangles not."""
    first, second = triangles
    return [np.array([*first, second[2]])]


def radiance_text(scene):
    lines = []
    for number, surface in enumerate(scene.surfaces):
        if surface.luminance > 0:
            lines.append(f"void light m{number} 0 0 3 {' '.join([repr(surface.luminance)] * 3)}")
        else:
            lines.append(f"void plastic m{number} 0 0 5 {' '.join([repr(surface.reflectance)] * 3)} 0 0")
        for i, corners in enumerate(panel(surface.corners) if surface.luminance > 0 else surface.corners):
            numbers = " ".join(f"{x:.9g}" for x in corners.ravel())
            lines.append(f"m{number} polygon p{number}.{i} 0 0 {corners.size} {numbers}")
    if scene.lamp:
        position, intensity = scene.lamp
        radius = 1e-3
        luminance = repr(float(intensity / (np.pi * radius**2)))
        lines.append(f"void illum lamp 1 void 0 3 {luminance} {luminance} {luminance}")
        lines.append(f"lamp sphere bulb 0 0 4 {' '.join(repr(float(x)) for x in position)} {radius}")
    return "\n".join(lines) + "\n"
