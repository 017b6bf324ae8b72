# SPDX-License-Identifier: MIT OR Apache-2.0
"""Times Halite beside ParaView's own mappers, on the same grids in the same view: pvbatch mappers.py HALITE.SO [SIDE]

The first image includes what a mapper's representation does to the grid; frames are medians of three views. SIDE is the number of cells
along an edge of the grids.
"""
import statistics
import sys
import time

from paraview import simple

MAPPERS = "Halite", "Projected tetra", "Resample To Image"


def timed(v):
    start = time.perf_counter()
    v.SMProxy.CaptureWindow(1)
    return time.perf_counter() - start


def measure(name, grid):
    grid.UpdatePipeline()
    cells = grid.GetDataInformation().GetNumberOfCells()
    for mapper in MAPPERS:
        v = simple.CreateView("RenderView")
        v.ViewSize = [512, 512]
        start = time.perf_counter()
        d = simple.Show(grid, v, "UnstructuredGridRepresentation")
        d.SelectMapper = mapper
        d.SetRepresentationType("Volume")
        simple.ColorBy(d, ("POINTS", "RTData"))
        simple.ResetCamera(v)
        timed(v)
        first = time.perf_counter() - start
        frames = []
        for _ in range(3):
            simple.GetActiveCamera().Azimuth(25)
            frames.append(timed(v))
        print(f"| {name}, {cells:,} | {mapper} | {first:.2f} s | {statistics.median(frames):.2f} s |", flush=True)
        simple.Delete(v)


if __name__ == "__main__":
    simple.LoadPlugin(sys.argv[1], remote=False, ns=globals())
    half = int(sys.argv[2]) // 2 if len(sys.argv) > 2 else 50
    print("| grid, cells | mapper | first image | frame |\n|---|---|---|---|")
    wavelet = simple.Wavelet(WholeExtent=[-half, half] * 3)
    measure("voxels", simple.AppendDatasets(Input=wavelet))
    small = simple.Wavelet(WholeExtent=[-int(half * 0.64), int(half * 0.64)] * 3)
    measure("tetrahedra", simple.Tetrahedralize(Input=small))
