#!/usr/bin/env python3
# SPDX-License-Identifier: MIT OR Apache-2.0
"""Times Halite's engines beside VTK's own mappers, and prints the README's table.

    cargo build --release
    xvfb-run -a -s "-noreset" python3 benches/beside_vtk/beside_vtk.py target/release/halite [--only WORD] [--rounds N] [--json FILE] [--plot FILE.png]

Every program draws the same scenes from the same files, a process of its own each time, one after the other in turns, so that no part of a
sitting favours one of them. Figures are medians over all rounds and views (12 sides of the mesh; fewer for the largest): wall seconds, CPU
seconds of all threads, the ratio of the wall seconds of VTK's projected tetrahedra, and the greatest and root mean square difference
from the walk on the CPU (`--engine traverse`), which the tests hold to the float64 reference within 2e-5; of VTK's 8-bit pictures the colours only.

It needs NumPy, VTK for Python, a display, for the ball SciPy and for --plot Matplotlib.
"""
import argparse
import json
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile

import numpy as np

import meshes

HERE = pathlib.Path(__file__).resolve().parent
TRANSPARENT = [[35, 0], [285, 0.1]]
OPAQUE = [[35, 0], [120, 0], [150, 2], [285, 5]]
PEAKS = [[35, 0], [100, 0], [105, 0.8], [110, 0], [180, 0], [185, 1.5], [190, 0], [285, 0.02]]
COLOR = [[35, 0, 0, 1], [160, 0, 1, 0], [285, 1, 0, 0]]
# What is drawn: name, mesh, its argument, opacity, pixels along each side, views, whether values belong to cells.
SCENES = [
    ("wavelet 164 k", meshes.box, 32, TRANSPARENT, 512, 12, False),
    ("wavelet 164 k, opaque", meshes.box, 32, OPAQUE, 512, 12, False),
    ("wavelet 164 k, two peaks", meshes.box, 32, PEAKS, 512, 12, False),
    ("wavelet 164 k, 1024²", meshes.box, 32, TRANSPARENT, 1024, 12, False),
    ("wavelet 164 k, cell values", meshes.box, 32, TRANSPARENT, 512, 12, True),
    ("boundary layer 164 k", meshes.boundary_layer, 32, TRANSPARENT, 512, 12, False),
    ("Delaunay ball 133 k", meshes.ball, 20_000, TRANSPARENT, 512, 12, False),
    ("sieve 211 k", meshes.sieve, 40, TRANSPARENT, 512, 12, False),
    ("wavelet 1.3 M", meshes.box, 64, TRANSPARENT, 512, 12, False),
    ("wavelet 1.3 M, opaque", meshes.box, 64, OPAQUE, 512, 12, False),
    ("hexahedra 1 M", meshes.hexahedra, 100, TRANSPARENT, 512, 4, False),
    ("wavelet 10 M, 1024²", meshes.box, 126, TRANSPARENT, 1024, 2, False),
]
PEERS = {"VTK projected": "projected", "VTK Bunyk": "bunyk"}
ENGINES = {"Halite projection": "project", "Halite walk": "traverse"}


def scene_of(mesh, opacity, size, at_cells, path):
    """A scene that shows all of the mesh; its path is that of the mesh, too."""
    points = mesh[0]
    extent = np.ptp(points, axis=0).max()
    scene = {
        "mesh": str(path.with_suffix(".vtu")), "scalars": {"name": "s", "association": "cell" if at_cells else "point"}, "color": COLOR,
        "opacity": opacity, "unit_distance": extent / 32, "size": [size, size],
        "camera": {"position": (extent * np.array([1.45, 0.83, 2.07])).tolist(), "focal_point": [0, 0, 0], "view_up": [0, 1, 0],
                   "view_angle": 30},
    }
    meshes.write(path.with_suffix(".vtu"), mesh, at_cells)
    path.with_suffix(".json").write_text(json.dumps(scene))
    return str(path.with_suffix(".json"))


def run(command):
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}: {done.stderr.strip() or done.returncode}")
    return done.stdout


def time_halite(program, scene, engine, views, folder):
    report = folder / "bench.json"
    run([program, "bench", scene, "--engine", engine, "--device", "cpu", "--frames", str(views), "--views", str(views), "--json", report])
    return json.loads(report.read_text())


def picture(program, scene, engine, folder):
    out = folder / "picture.npy"
    run([program, "render", scene, "--engine", engine, "--device", "cpu", "--out", out])
    return np.load(out).astype(float)


def difference(image, truth):
    e = np.abs(image - truth[..., : image.shape[2]])
    return e.max(), np.sqrt(np.mean(e * e))


def measure(program, scene, views, rounds, folder, peers):
    """Times and errors of all, drawn in turns."""
    rows = {name: {"wall": [], "cpu": []} for name in [*ENGINES, *peers]}
    truth = picture(program, scene, "traverse", folder)
    for turn in range(rounds):
        for name, engine in ENGINES.items():
            report = time_halite(program, scene, engine, views, folder)
            row = rows[name]
            row["wall"].append(report["frame_ms"] / 1e3)
            row["cpu"].append((report["frame_cpu_ms"] or float("nan")) / 1e3)
            row.update(engine=report["engine"], edit=report["transfer_edit_ms"] / 1e3, steps=report["steps"], peak=report["peak_bytes"],
                       cells=report["tetrahedra"], first=(report["load_ms"] + report["faces_ms"] + report["first_frame_ms"]) / 1e3)
            if turn == 0:
                row["error"] = difference(picture(program, scene, engine, folder), truth)
        for name, peer in peers.items():
            out = folder / "peer.npy"
            times = json.loads(run([sys.executable, HERE / "vtk_frames.py", scene, peer, str(views), out]).splitlines()[-1])
            rows[name]["wall"] += times["wall"]
            rows[name]["cpu"] += times["cpu"]
            rows[name]["version"] = times["version"]
            rows[name]["error"] = difference(np.load(out).astype(float), truth)
    for row in rows.values():
        row["wall"], row["cpu"] = statistics.median(row["wall"]), statistics.median(row["cpu"])
    return rows


def line(name, rows):
    base = rows.get("VTK projected", {}).get("wall", float("nan"))
    text = []
    for who, row in rows.items():
        worst, rms = row["error"]
        per_step = f"{row['cpu'] / row['steps'] * 1e9:.1f} ns" if row.get("steps") else ""
        held = f"{row['peak'] / row['cells']:.0f} B" if row.get("peak") else ""
        text.append(f"| {name} | {who} | {row['wall'] * 1e3:.0f} ms | {row['cpu'] * 1e3:.0f} ms | {base / row['wall']:.2f} | "
                    f"{worst:.1e} / {rms:.1e} | {per_step} | {held} |")
        name = ""
    return "\n".join(text)


def plot(program, folder, path):
    """How a frame's time grows with cells, with pixels and with threads."""
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(1, 3, figsize=(12, 3.6), constrained_layout=True)

    def wall(scene, engine, *more):
        report = folder / "bench.json"
        run([program, *more, "bench", scene, "--engine", engine, "--device", "cpu", "--frames", "6", "--views", "6", "--json", report])
        return json.loads(report.read_text())["frame_ms"]

    scenes = {n: scene_of(meshes.box(n), TRANSPARENT, 512, False, folder / f"cells{n}") for n in (8, 16, 32, 48, 64)}
    sizes = {s: scene_of(meshes.box(32), TRANSPARENT, s, False, folder / f"pixels{s}") for s in (128, 256, 512, 1024)}
    threads = range(1, (os.cpu_count() or 1) + 1)
    for name, engine in ENGINES.items():
        axes[0].loglog([5 * n ** 3 for n in scenes], [wall(s, engine) for s in scenes.values()], "o-", label=name)
        axes[1].loglog([s * s for s in sizes], [wall(s, engine) for s in sizes.values()], "o-", label=name)
        axes[2].plot(list(threads), [wall(scenes[32], engine, "--threads", str(t)) for t in threads], "o-", label=name)
    for axis, label in zip(axes, ("tetrahedra (512² pixels)", "pixels (164 k tetrahedra)", "threads (164 k, 512²)")):
        axis.set_xlabel(label)
        axis.set_ylabel("ms a frame")
        axis.grid(True, which="both", alpha=0.3)
    axes[0].legend()
    figure.savefig(path, dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("halite", help="the program, built with --release")
    parser.add_argument("--only", default="", help="scenes whose names hold this")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--no-bunyk", action="store_true", help="leave out VTK's ray caster, which takes seconds a frame")
    parser.add_argument("--json", help="write the figures here")
    parser.add_argument("--plot", help="also draw how time grows with cells, pixels and threads")
    options = parser.parse_args()
    peers = {n: p for n, p in PEERS.items() if not (options.no_bunyk and p == "bunyk")}
    print("| scene | drawn by | wall | CPU | projected = 1 | error, max / RMSE | CPU per fragment | memory per cell |")
    print("|---|---|---|---|---|---|---|---|")
    figures = {}
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for name, make, argument, opacity, size, views, at_cells in SCENES:
            if options.only not in name:
                continue
            scene = scene_of(make(argument), opacity, size, at_cells, folder / "scene")
            large = "10 M" in name
            some = {n: p for n, p in peers.items() if not (large and p == "bunyk")}
            figures[name] = measure(options.halite, scene, views, 1 if large else options.rounds, folder, some)
            print(line(name, figures[name]), flush=True)
        if options.plot:
            plot(options.halite, folder, options.plot)
    if options.json:
        pathlib.Path(options.json).write_text(json.dumps(figures, indent=1) + "\n")


if __name__ == "__main__":
    main()
