#!/usr/bin/env python3
"""Times isoforge beside vtkFlyingEdges3D, scikit-image (Lewiner) and fast-surface-nets on the same arrays.

    pip install vtk scikit-image numpy nibabel
    cargo build --release --example bench_volume
    cargo build --release --manifest-path benches/peers/surface-nets/Cargo.toml
    python benches/peers/peers.py [--size 256] [--passes 3] [--brain FILE.nii.gz] [--no-gpu] [--out FILE.md]
        [--surface-nets benches/peers/surface-nets/target/release/surface-nets-peer]

README.md beside this file says what is compared and how.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import skimage.measure
import vtk
from vtk.util.numpy_support import numpy_to_vtk

ROOT = Path(__file__).resolve().parents[2]
# Runs a pass of every contestant (but scikit-image: one); the best counts for the pass.
REPEATS = 3
NAMED = {"sphere": (1.5, 1.0), "torus": (1.5, 0.0), "gyroid": (1.0, 0.0)}


def field(name, n):
    """The array [z, y, x] of a field at n³ points, and its iso value."""
    if name == "noise":
        return np.random.default_rng(1).random((n, n, n), dtype=np.float32), 0.5
    half, iso = NAMED[name]
    axis = np.linspace(-half, half, n, dtype=np.float32)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij", sparse=True)
    if name == "sphere":
        values = np.sqrt(x * x + y * y + z * z)
    elif name == "torus":
        flat = x * x + y * y
        k = flat + z * z + np.float32(0.375)
        values = k * k - np.float32(2.0) * flat
    else:
        turn = np.float32(2 * np.pi)
        s = [np.sin(turn * v) for v in (x, y, z)]
        c = [np.cos(turn * v) for v in (x, y, z)]
        values = s[0] * c[1] + s[1] * c[2] + s[2] * c[0]
    return np.ascontiguousarray(values, dtype=np.float32), iso


def brain(path):
    """The voxels of a NIfTI file, in the file's own order, and an iso value that shows the brain.

    Between whole numbers, so that no voxel equals it: the contestants treat ties differently.
    """
    import nibabel

    image = nibabel.load(path)
    voxels = np.asarray(image.dataobj, dtype=np.float32)
    return np.ascontiguousarray(voxels.transpose(2, 1, 0)), 10.5


class Vtk:
    """vtkFlyingEdges3D on an array that is wrapped, not copied."""

    def __init__(self, values, iso, normals):
        self.scalars = numpy_to_vtk(values.reshape(-1), deep=False)
        self.image = vtk.vtkImageData()
        self.image.SetDimensions(*values.shape[::-1])
        self.image.GetPointData().SetScalars(self.scalars)
        self.filter = vtk.vtkFlyingEdges3D()
        self.filter.SetInputData(self.image)
        self.filter.SetComputeNormals(normals)
        self.filter.SetComputeGradients(False)
        self.filter.SetComputeScalars(False)
        self.filter.SetValue(0, iso)

    def run(self, threads):
        vtk.vtkSMPTools.Initialize(threads)
        best = float("inf")
        for _ in range(REPEATS):
            self.filter.Modified()
            start = time.perf_counter()
            self.filter.Update()
            best = min(best, time.perf_counter() - start)
        return best, self.filter.GetOutput().GetNumberOfPolys()


def lewiner(values, iso):
    start = time.perf_counter()
    vertices, faces, normals, _ = skimage.measure.marching_cubes(values, iso, method="lewiner")
    return time.perf_counter() - start, len(faces)


def isoforge(program, file, shape, iso, threads, gpu, repeats=REPEATS):
    command = [program, file, *map(str, shape[::-1]), repr(float(iso)), "--repeats", str(repeats)]
    if gpu:
        command.append("--gpu")
    environment = dict(os.environ, RAYON_NUM_THREADS=str(threads))
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(done.stderr.strip() or f"{program} failed")
    return json.loads(done.stdout)


def measure(name, values, iso, arguments, program, note):
    """Seconds of every contestant, by passes in turn, and the triangles that each made."""
    seconds, triangles, stages = {}, {}, {}

    def add(label, result):
        seconds.setdefault(label, []).append(result[0])
        triangles[label] = result[1]

    peers = {normals: Vtk(values, iso, normals) for normals in (True, False)}
    peers[True].run(2)  # once unseen: pages in the array and the library
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "values.raw"
        values.tofile(file)
        gpu = not arguments.no_gpu
        for turn in range(arguments.passes):
            note(f"{name}: pass {turn + 1} of {arguments.passes}")
            for threads in (1, 2):
                for normals in (True, False):
                    add(f"VTK, {'normals' if normals else 'no normals'}, {threads} thr.", peers[normals].run(threads))
                ours = isoforge(program, file, values.shape, iso, threads, False)
                stages[f"CPU, {threads} thr."] = ours["fresh"]["stages"]
                for kind in ("fresh", "cached", "fresh reused", "cached reused"):
                    add(f"isoforge CPU, {kind}, {threads} thr.", (ours[kind]["best"], ours["triangles"]))
                if arguments.surface_nets and threads == 1:
                    theirs = isoforge(arguments.surface_nets, file, values.shape, iso, 1, False)
                    add("fast-surface-nets, reused, 1 thr.", (theirs["best"], theirs["triangles"]))
                if arguments.before:
                    old = isoforge(arguments.before, file, values.shape, iso, threads, False)
                    for kind in ("fresh", "cached"):
                        add(f"before: CPU, {kind}, {threads} thr.", (old[kind]["best"], old["triangles"]))
            if not arguments.no_scikit and (turn == 0 or not arguments.quick):
                add("scikit-image", lewiner(values, iso))
            if gpu and (turn == 0 or name != "noise"):
                try:
                    ours = isoforge(program, file, values.shape, iso, 2, True, 1 if name == "noise" else REPEATS)
                except RuntimeError as error:
                    note(f"no GPU rows: {error}")
                    gpu = False
                    continue
                if arguments.before and name != "noise":
                    old = isoforge(arguments.before, file, values.shape, iso, 2, True)
                    add("before: GPU, fresh", (old["fresh"]["best"], old["triangles"]))
                stages["GPU"] = ours["fresh"]["stages"]
                for kind in ("fresh", "cached") if ours["cached"] else ("fresh",):
                    add(f"isoforge GPU ({ours['adapter']}), {kind}", (ours[kind]["best"], ours["triangles"]))
    # Another method makes another mesh.
    counts = {n for label, n in triangles.items() if "surface-nets" not in label}
    if max(counts) - min(counts) > 1e-3 * max(counts):
        note(f"{name}: the triangle counts differ: {triangles}")
    return seconds, triangles, stages


def table(name, iso, shape, seconds, triangles):
    base = min(seconds["VTK, normals, 2 thr."])
    lines = [
        f"## {name}, {shape[2]}×{shape[1]}×{shape[0]} points, iso {iso}",
        "",
        "| | best s | median s | ÷ VTK with normals, 2 thr. | triangles |",
        "|---|---|---|---|---|",
    ]
    for label, list_ in seconds.items():
        best, median = min(list_), statistics.median(list_)
        lines.append(f"| {label} | {best:.4f} | {median:.4f} | {best / base:.2f} | {triangles[label]} |")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=int, default=256, help="points along each axis")
    parser.add_argument("--passes", type=int, default=3)
    parser.add_argument("--cases", nargs="*", default=["sphere", "torus", "gyroid", "noise"])
    parser.add_argument("--brain", type=Path, help="a NIfTI file, extracted at iso 10.5")
    parser.add_argument("--no-gpu", action="store_true")
    parser.add_argument("--no-scikit", action="store_true")
    parser.add_argument("--surface-nets", help="the build of surface-nets/, to take turns with")
    parser.add_argument("--before", help="an older build of bench_volume, to take turns with")
    parser.add_argument("--quick", action="store_true", help="scikit-image in the first pass only")
    parser.add_argument("--out", type=Path, help="also write the tables here")
    arguments = parser.parse_args()
    program = ROOT / "target" / "release" / "examples" / "bench_volume"
    if not program.exists():
        sys.exit("build first: cargo build --release --example bench_volume")

    def note(line):
        print(line, file=sys.stderr, flush=True)

    # VTK's wheels come with several backends and start with the sequential one.
    if not vtk.vtkSMPTools.SetBackend("STDThread"):
        sys.exit("this VTK has no STDThread backend: it would run on one thread")
    head = f"VTK {vtk.vtkVersion().GetVTKVersion()} ({vtk.vtkSMPTools.GetBackend()}), scikit-image "
    head += f"{skimage.__version__}, {os.cpu_count()} cores; best and median of {arguments.passes} passes in turn, the best of {REPEATS} runs each\n"
    text = [head]
    print(head)
    for name in arguments.cases + (["brain"] if arguments.brain else []):
        values, iso = brain(arguments.brain) if name == "brain" else field(name, arguments.size)
        seconds, triangles, stages = measure(name, values, iso, arguments, program, note)
        text.append(table(name, iso, values.shape, seconds, triangles))
        print(text[-1])
        for label, parts in stages.items():
            note(f"  {label}: " + ", ".join(f"{stage} {1e3 * s:.1f} ms" for stage, s in parts.items()))
    if arguments.out:
        arguments.out.write_text("\n".join(text))


if __name__ == "__main__":
    main()
