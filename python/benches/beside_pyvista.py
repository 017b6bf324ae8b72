# SPDX-License-Identifier: MIT OR Apache-2.0
"""Times volumes of Halite beside PyVista's own add_volume: the same tetrahedra in the same plotter, in turns, each view once for each.

    xvfb-run -a python python/benches/beside_pyvista.py [--cubes 32] [--views 8] [--size 512]

The wheel is to be a release build (`maturin build --release`). Wall clock and CPU time, which says less of what else the machine does;
medians over the views. Then what a frame takes besides the core's own: depths read back, the picture handed to the window, and VTK.
"""
import argparse
import pathlib
import statistics
import sys
import time

import numpy as np
import pyvista
import vtkmodules

import halite
import halite.pyvista

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "benches" / "beside_vtk"))
import meshes  # noqa: E402


def timed(frame):
    """Wall and CPU seconds of a frame."""
    wall, cpu = time.perf_counter(), time.process_time()
    frame()
    return time.perf_counter() - wall, time.process_time() - cpu


def plotter_of(size):
    plotter = pyvista.Plotter(off_screen=True, window_size=size)
    plotter.disable_anti_aliasing()
    plotter.set_background("black")
    return plotter


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cubes", type=int, default=32, help="cubes along each side, of five tetrahedra each")
    parser.add_argument("--views", type=int, default=8)
    parser.add_argument("--size", type=int, default=512)
    arguments = parser.parse_args()
    points, cells, kind, values = meshes.box(arguments.cubes)
    rows = np.column_stack([np.full(len(cells), 4), cells])
    grid = pyvista.UnstructuredGrid(rows.ravel(), np.full(len(cells), kind, np.uint8), points)
    grid["s"] = values
    print(f"{len(cells)} tetrahedra, {arguments.size} x {arguments.size} pixels, VTK {vtkmodules.__version__}, "
          f"PyVista {pyvista.__version__}, Halite {halite.__version__}")
    options = {"scalars": "s", "cmap": "viridis", "opacity": [0.0, 0.3], "show_scalar_bar": False}
    unit = grid.length / 10
    plotter = plotter_of((arguments.size, arguments.size))
    theirs = plotter.add_volume(grid, opacity_unit_distance=unit, **options)
    ours = halite.pyvista.add_volume(plotter, grid, opacity_unit_distance=unit, **options)
    plotter.show(auto_close=False)
    times = {"PyVista": [], "Halite": []}
    for view in range(arguments.views + 1):
        plotter.camera.azimuth = 360 / arguments.views * view
        plotter.camera.elevation = 20
        for name, shown, hidden in (("PyVista", theirs, ours), ("Halite", ours, theirs)):
            shown.SetVisibility(True)
            hidden.SetVisibility(False)
            took = timed(plotter.render)
            # The first view is for what is made once.
            if view:
                times[name].append(took)
    medians = {name: [statistics.median(t) for t in zip(*all_of)] for name, all_of in times.items()}
    for name, (wall, cpu) in medians.items():
        print(f"{name:8} {1e3 * wall:8.1f} ms, {1e3 * cpu:8.1f} ms of CPU")
    print(f"Halite is {medians['PyVista'][0] / medians['Halite'][0]:.1f} times as fast by the clock, "
          f"{medians['PyVista'][1] / medians['Halite'][1]:.1f} times by CPU")
    plotter.close()
    print("besides the core's frame, in ms: depths read, picture composited, and all of it; of that, in CPU time of a still frame")
    for size in ((512, 512), (1920, 1080)):
        plotter = plotter_of(size)
        volume = halite.pyvista.add_volume(plotter, grid, opacity_unit_distance=unit, **options)
        plotter.show(auto_close=False)
        rest = []
        for view in range(arguments.views):
            plotter.camera.azimuth = 360 / arguments.views * (view + 0.5)
            drawn = volume.frames
            wall, _ = timed(plotter.render)
            assert volume.frames == drawn + 1
            read, composite, all_of = volume.seconds["read"], volume.seconds["composite"], wall - 1e-3 * volume.stats["frame_ms"]
            # A still view costs the rest alone.
            _, still = timed(plotter.render)
            assert volume.frames == drawn + 1
            rest.append([1e3 * t for t in (read, composite, all_of, still)])
        print(f"{size[0]:5} x {size[1]:4}: " + ", ".join(f"{statistics.median(t):.1f}" for t in zip(*rest)))
        plotter.close()


if __name__ == "__main__":
    main()
