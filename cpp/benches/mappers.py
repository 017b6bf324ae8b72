# SPDX-License-Identifier: MIT OR Apache-2.0
"""Times Halite beside VTK's own projected tetrahedra in one process: medians of frames drawn in turns, at 512 x 512.

    PYTHONPATH=BUILD/lib/python3/dist-packages python3 cpp/benches/mappers.py [POINTS_PER_AXIS ...]

31 points along each axis make 162,000 tetrahedra, 61 make 1,296,000. Build with cargo's profile "release" first.
"""
import os
import pathlib
import statistics
import sys
import time

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "tests"))
from scene import (add, look, numpy_support, plane, renderer, vtkCommonCore, vtkCommonDataModel, vtkHaliteMapper, volume,  # noqa: E402
                   window)
from vtkmodules.vtkRenderingVolumeOpenGL2 import vtkOpenGLProjectedTetrahedraMapper  # noqa: E402

KUHN = ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6))


def tetrahedra(n):
    """A cube of (n - 1)^3 bricks of six tetrahedra, with a smooth field."""
    axis = np.linspace(-1, 1, n)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    points = np.stack([x, y, z], -1).reshape(-1, 3)
    i = np.arange(n - 1)
    k, j, i = np.meshgrid(i, i, i, indexing="ij")
    b = (i + n * (j + n * k)).ravel()
    brick = [b, b + 1, b + 1 + n, b + n]
    brick += [c + n * n for c in brick]
    ids = np.stack([np.stack([brick[q] for q in t], -1) for t in KUHN], 1).reshape(-1).astype(np.int64)
    grid, p, cells = vtkCommonDataModel.vtkUnstructuredGrid(), vtkCommonCore.vtkPoints(), vtkCommonDataModel.vtkCellArray()
    p.SetData(numpy_support.numpy_to_vtk(points.astype(np.float32), deep=1))
    cells.SetData(numpy_support.numpy_to_vtkIdTypeArray(np.arange(0, len(ids) + 1, 4), deep=1),
                  numpy_support.numpy_to_vtkIdTypeArray(ids, deep=1))
    grid.SetPoints(p)
    grid.SetCells(10, cells)
    x, y, z = points.T
    add(grid, np.sin(3 * x) * np.cos(2 * y) + 0.5 * np.sin(4 * z + x))
    return grid


def frame(w):
    start = time.perf_counter()
    w.Render()
    w.WaitForCompletion()
    return 1e3 * (time.perf_counter() - start)


def compare(n):
    grid = tetrahedra(n)
    opacity = [(-1.5, 0.3), (-0.8, 0), (-0.2, 0), (0, 0.6), (0.2, 0), (1.5, 0.4)]
    color = [(-1.5, 0.1, 0.2, 0.9), (0, 0.9, 0.9, 0.3), (1.5, 0.9, 0.1, 0.1)]
    windows, times, parts = {}, {}, []
    print(f"{grid.GetNumberOfCells()} tetrahedra; {os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}")
    for name, mapper in (("Halite", vtkHaliteMapper()), ("projected tetrahedra", vtkOpenGLProjectedTetrahedraMapper())):
        w = window((512, 512))
        w.SetOffScreenRendering(1)
        # Something opaque far behind, so that depths must be read.
        r = renderer(w, volume(grid, opacity, color, 0.3, mapper=mapper), plane(-3))
        look(r, position=(3.2, 2.5, 4.1), focus=(0, 0, 0), up=(0, 1, 0), clip=(1, 12))
        windows[name], times[name] = (w, r, mapper), []
        print(f"  {name}: first frame {frame(w):.0f} ms")
    for _ in range(9):
        for name, (w, r, mapper) in windows.items():
            r.GetActiveCamera().Azimuth(3)
            times[name].append(frame(w))
            if name == "Halite":
                parts.append((mapper.GetPrepareTime(), mapper.GetDepthTime(), mapper.GetCoreTime(), mapper.GetPresentTime()))
    medians = {name: statistics.median(t) for name, t in times.items()}
    for name, t in medians.items():
        print(f"  {name}: {t:.1f} ms ({min(times[name]):.1f} to {max(times[name]):.1f})")
    prepare, depth, core, present = (1e3 * statistics.median(p) for p in zip(*parts))
    print(f"  core {core:.1f} ms; host side: prepare {prepare:.2f}, depth read {depth:.2f}, upload and blit {present:.2f} ms")
    print(f"  ratio {medians['projected tetrahedra'] / medians['Halite']:.1f}; still frame {frame(windows['Halite'][0]):.2f} ms")


for argument in sys.argv[1:] or ["31", "61"]:
    compare(int(argument))
