#!/usr/bin/env python3
# SPDX-License-Identifier: MIT OR Apache-2.0
"""Times Halite's ray caster of regular grids beside VTK's mappers of images, and prints a table.

    cargo build --release
    xvfb-run -a -s "-noreset" python3 benches/beside_vtk/grids.py target/release/halite [--points N] [--rounds N] [--json FILE]

All draw the same images from the same file, a process of its own each time, one after the other in turns. Figures are medians over all
rounds and views: wall seconds, CPU seconds of all threads. VTK's mappers take a sample for each pixel and voxel. Errors are the greatest and
the root mean square over 200 pixels, of a float64 sum of 64 samples a voxel along their rays; of VTK's 8-bit pictures the colours only.

It needs NumPy, VTK for Python and a display.
"""
import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkIOXML import vtkXMLImageDataWriter

HERE = pathlib.Path(__file__).resolve().parent
SIZE = 512
COLOR = [[35, 0, 0, 1], [160, 0, 1, 0], [285, 1, 0, 0]]
LINE = [[35, 0], [160, 0.05], [285, 0.1]]
PEAKS = [[s + d, k if d == 0 else 0] for s, k in ((70, 0.3), (130, 0.1), (190, 0.2), (250, 0.5)) for d in (-8, 0, 8)]
HALITE = {"exact": [], "order 2, two voxels": ["--reconstruction", "2", "--sampling", "2"],
          "order 1, two voxels": ["--reconstruction", "1", "--sampling", "2"]}
PEERS = {"VTK fixed point": "fixed", "VTK GPU": "gpu"}


def wavelet(n):
    """VTK's wavelet over n³ points."""
    x = (n // 2 - np.arange(n)) / (n - 1)
    bell = np.exp(-2 * x * x)
    z, y, x_ = np.meshgrid(x, x, x, indexing="ij", sparse=True)
    values = 255 * bell[:, None, None] * bell[None, :, None] * bell[None, None, :]
    return (values + 10 * np.sin(60 * x_) + 18 * np.sin(30 * y) + 5 * np.cos(40 * z)).astype(np.float32)


def noise(n):
    return np.random.default_rng(1).uniform(35, 285, (n, n, n)).astype(np.float32)


def write(path, values):
    image = vtkImageData()
    n = values.shape[0]
    image.SetDimensions(n, n, n)
    image.SetOrigin(*[-(n // 2)] * 3)
    array = numpy_to_vtk(values.ravel())
    array.SetName("s")
    image.GetPointData().SetScalars(array)
    writer = vtkXMLImageDataWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(image)
    writer.SetCompressorTypeToNone()
    writer.Write()


def truth(values, opacity, camera, pixels):
    """Premultiplied colours of pixels, by their rays."""
    n = values.shape[0]
    eye = np.array(camera["position"]) + n // 2
    ahead = -np.array(camera["position"])
    ahead = ahead / np.linalg.norm(ahead)
    right = np.cross(ahead, camera["view_up"])
    right /= np.linalg.norm(right)
    up, wide = np.cross(right, ahead), np.tan(np.radians(camera["view_angle"] / 2))
    colors = []
    for i, j in pixels:
        d = ahead + wide * ((2 * (i + 0.5) / SIZE - 1) * right + (1 - 2 * (j + 0.5) / SIZE) * up)
        d /= np.linalg.norm(d)
        near, far = (0 - eye) / d, (n - 1 - eye) / d
        start, end = np.minimum(near, far).max(), np.maximum(near, far).min()
        color = np.zeros(3)
        if start < end:
            count = int(64 * (end - start)) + 64
            h = (end - start) / count
            p = eye + d * (start + h * (np.arange(count) + 0.5))[:, None]
            low = np.clip(np.floor(p), 0, n - 2).astype(int)
            w = p - low
            s = 0.0
            for k in range(8):
                bits = np.array([k & 1, k >> 1 & 1, k >> 2])
                x, y, z = (low + bits).T
                s = s + values[z, y, x].astype(float) * np.where(bits, w, 1 - w).prod(axis=1)
            depth = h * np.interp(s, *zip(*opacity))
            before = np.exp(-np.concatenate([[0], np.cumsum(depth)[:-1]]))
            weight = before * -np.expm1(-depth)
            places = [c[0] for c in COLOR]
            color = np.array([(weight * np.interp(s, places, [c[k + 1] for c in COLOR])).sum() for k in range(3)])
        colors.append(color)
    return np.array(colors)


def run(command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}: {done.stderr.strip() or done.returncode}")
    return done.stdout


def measure(program, scene, views, rounds, folder, wanted, pixels):
    rows = {name: {"wall": [], "cpu": []} for name in [*HALITE, *PEERS]}

    def error(image):
        e = np.abs(np.array([image[j, i, :3] for i, j in pixels], float) - wanted)
        return e.max(), np.sqrt((e * e).mean())

    for turn in range(rounds):
        for name, more in HALITE.items():
            report, out = folder / "bench.json", folder / "picture.npy"
            run([program, "bench", scene, "--device", "cpu", "--frames", views, "--views", views, "--json", report, *more])
            report = json.loads(report.read_text())
            rows[name]["wall"].append(report["frame_ms"] / 1e3)
            rows[name]["cpu"].append((report["frame_cpu_ms"] or float("nan")) / 1e3)
            if turn == 0:
                run([program, "render", scene, "--device", "cpu", "--out", out, *more])
                rows[name]["error"] = error(np.load(out))
        for name, peer in PEERS.items():
            out = folder / "peer.npy"
            times = json.loads(run([sys.executable, HERE / "vtk_frames.py", scene, peer, views, out]).splitlines()[-1])
            rows[name]["wall"] += times["wall"]
            rows[name]["cpu"] += times["cpu"]
            rows[name]["error"] = error(np.load(out))
    for row in rows.values():
        row["wall"], row["cpu"] = statistics.median(row["wall"]), statistics.median(row["cpu"])
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("halite", help="the program, built with --release")
    parser.add_argument("--points", type=int, default=256, help="points along each axis")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--views", type=int, default=6)
    parser.add_argument("--json", help="write the figures here")
    options = parser.parse_args()
    n, figures = options.points, {}
    pixels = np.random.default_rng(2).integers(SIZE // 5, SIZE * 4 // 5, (200, 2))
    print("| scene | drawn by | wall | CPU | error, max / RMSE |")
    print("|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for name, values, opacity in (("wavelet, 3 knots", wavelet(n), LINE), ("wavelet, 12 knots", wavelet(n), PEAKS), ("noise", noise(n), LINE)):
            camera = {"position": [1.45 * n, 0.83 * n, 2.07 * n], "focal_point": [0, 0, 0], "view_up": [0, 1, 0], "view_angle": 30}
            write(folder / "scene.vti", values)
            scene = {"mesh": str(folder / "scene.vti"), "scalars": {"name": "s", "association": "point"}, "color": COLOR, "opacity": opacity,
                     "unit_distance": 1, "size": [SIZE, SIZE], "camera": camera}
            path = folder / "scene.json"
            path.write_text(json.dumps(scene))
            wanted = truth(values, opacity, camera, pixels)
            figures[name] = measure(options.halite, path, options.views, options.rounds, folder, wanted, pixels)
            for who, row in figures[name].items():
                worst, rms = row["error"]
                print(f"| {name} | {who} | {row['wall'] * 1e3:.0f} ms | {row['cpu'] * 1e3:.0f} ms | {worst:.1e} / {rms:.1e} |", flush=True)
                name = ""
    if options.json:
        pathlib.Path(options.json).write_text(json.dumps(figures, indent=1) + "\n")


main()
