# SPDX-License-Identifier: MIT OR Apache-2.0
"""Halite beside ParaView's own mappers on meshes as programs write them, with times and errors in one table:

    pvbatch real.py HALITE.SO FOLDER OUT [--judge 'COMMAND {scene} {folder}'] [--cases NAME...]

FOLDER has the files that CASES names, or legacy files beside them (.vtk), which are taken first: ParaView 5.11 does not
read the faces of polyhedra as VTK's XML files have them since version 2.3. OUT gets a scene file and pictures of each.
With a judge, a program that draws OUT/NAME.json as Halite's scene files describe it and leaves OUT/NAME.npy (rows from
the top, premultiplied RGBA), errors are those against it, in 255ths, over black: the greatest, and the root of their
mean square. The first image includes what a mapper's representation does to the grid; frames are medians of three views.
"""
import argparse
import json
import os
import shlex
import statistics
import subprocess
import time

import numpy as np
from paraview import simple
from vtkmodules.util import numpy_support

SIZE = (320, 240)
# What is drawn: a file, where its array is, its name, and the range of the functions.
CASES = {
    "combustor_tet5": ("papers/combustor_tet5.vtu", "POINTS", "Density", (0.1978, 0.7104)),
    "heat_sink_cells": ("papers/synth_heat_sink_tet.vtu", "CELLS", "HeatFlux", (0.28, 67.5)),
    "su2_knowles_mixed": ("tools/su2_knowles_mixed.vtu", "POINTS", "calc_dist", (0, 0.025)),
    "su2_knowles_cells": ("tools/su2_knowles_mixed.vtu", "CELLS", "calc_edge_ratio", (1, 1.414)),
    "of_flange_mixed": ("tools/of_flange.vtu", "CELLS", "T", (273, 573)),
    "of_dambreak_polyhedra": ("tools/of_dambreak_amr.vtu", "CELLS", "alpha.water", (0, 1)),
    "ensight_polyhedra": ("tools/ensight_poly.vtu", "CELLS", "Pressure", (0.1212, 0.2546)),
    "blood_vessels_voxels": ("tools/blood_vessels_voxel.vtu", "CELLS", "density", (0.22, 0.53)),
    "disk_out_ref_hexahedra": ("tools/disk_out_ref.vtu", "POINTS", "Temp", (293, 913)),
    "headsq_image": ("papers/headsq_quarter.vti", "POINTS", "ct", (0, 3926)),
}
MAPPERS = {"UnstructuredGridRepresentation": ("Halite", "Projected tetra", "Resample To Image"),
           "UniformGridRepresentation": ("Halite", "By rendering mode")}
COLOR = [(0, 0.1, 0.2, 0.8), (0.4, 0.2, 0.8, 0.6), (0.7, 0.95, 0.85, 0.3), (1, 0.8, 0.1, 0.1)]
OPACITY = [(0, 0.02), (0.3, 0.3), (0.35, 0.05), (0.7, 0.1), (1, 0.9)]


def look(bounds):
    """The camera, and the unit distance, for a box."""
    low, high = np.array(bounds[::2]), np.array(bounds[1::2])
    middle, diagonal = (low + high) / 2, np.linalg.norm(high - low)
    direction = np.array([0.61, -0.67, 0.42]) / np.linalg.norm([0.61, -0.67, 0.42])
    camera = {"projection": "perspective", "position": list(middle + 2.1 * diagonal * direction), "focal_point": list(middle),
              "view_up": [0, 0, 1], "view_angle": 30}
    return camera, diagonal / 12


def picture(v):
    image = v.SMProxy.CaptureWindow(1)
    w, h, _ = image.GetDimensions()
    return numpy_support.vtk_to_numpy(image.GetPointData().GetScalars()).reshape(h, w, -1)[::-1, :, :3].astype(np.uint8)


def drawn(source, mapper, association, name, camera, unit, color, opacity):
    """A picture, the time to the first one, and that of a frame."""
    v = simple.CreateView("RenderView")
    v.ViewSize, v.OrientationAxesVisibility, v.CenterAxesVisibility, v.UseFXAA = SIZE, 0, 0, 0
    v.UseColorPaletteForBackground, v.Background = 0, [0, 0, 0]
    v.CameraPosition, v.CameraFocalPoint = camera["position"], camera["focal_point"]
    v.CameraViewUp, v.CameraViewAngle = camera["view_up"], camera["view_angle"]
    start = time.perf_counter()
    d = simple.Show(source, v)
    d.SelectMapper = mapper
    d.SetRepresentationType("Volume")
    d.ColorArrayName = (association, name)
    d.LookupTable = simple.CreateLookupTable(
        RGBPoints=[x for k in color for x in k], ColorSpace="RGB", ScalarRangeInitialized=1)
    d.ScalarOpacityFunction = simple.CreatePiecewiseFunction(
        Points=[x for s, a in opacity for x in (s, a, 0.5, 0)], ScalarRangeInitialized=1)
    d.ScalarOpacityUnitDistance = unit
    found = picture(v)
    first, frames = time.perf_counter() - start, []
    for _ in range(3):
        v.GetActiveCamera().Azimuth(25)
        start = time.perf_counter()
        picture(v)
        frames.append(time.perf_counter() - start)
    simple.Delete(v)
    return found, first, statistics.median(frames)


def measure(case, folder, out, judge):
    file, association, name, (low, high) = CASES[case]
    path = os.path.abspath(os.path.join(folder, file))
    legacy = os.path.splitext(path)[0] + ".vtk"
    path = legacy if os.path.exists(legacy) else path
    simple._DisableFirstRenderCameraReset()
    reader = simple.OpenDataFile(path)
    reader.UpdatePipeline()
    information = reader.GetDataInformation()
    camera, unit = look(information.GetBounds())
    of_points = association == "POINTS"
    arrays = information.GetPointDataInformation() if of_points else information.GetCellDataInformation()
    array = arrays.GetArrayInformation(name)
    scale = lambda knots: [[low + (high - low) * k[0], *k[1:]] for k in knots]
    color, opacity = scale(COLOR), scale(OPACITY)
    is_image = path.endswith(".vti")
    scene = {"mesh": path, "scalars": {"name": name, "association": "point" if of_points else "cell"}, "color": color,
             "opacity": opacity, "unit_distance": unit, "convention": "opacity" if is_image else "extinction",
             "camera": camera, "size": SIZE}
    if "polyhedra" in case:
        # What a judge cannot draw as it is, it may cut; in values of cells nothing depends on how.
        scene["cells"] = "tets"
    if array.GetNumberOfComponents() > 1:
        scene["scalars"]["component"] = "magnitude"
    with open(os.path.join(out, case + ".json"), "w") as f:
        json.dump(scene, f)
    truth = None
    if judge:
        command = shlex.split(judge.format(scene=os.path.join(out, case + ".json"), folder=out))
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        truth = 255 * np.load(os.path.join(out, case + ".npy"))[..., :3]
    for mapper in MAPPERS["UniformGridRepresentation" if is_image else "UnstructuredGridRepresentation"]:
        if mapper == "Resample To Image" and "polyhedra" in case:
            # ParaView 5.11's probe of polyhedra ends the process.
            continue
        found, first, frame = drawn(reader, mapper, association, name, camera, unit, color, opacity)
        np.save(os.path.join(out, f"{case}.{mapper.replace(' ', '_')}.npy"), found)
        apart = np.abs(found - truth) if judge else np.array([np.nan])
        print(f"| {case}, {information.GetNumberOfCells():,} | {mapper} | {first:.2f} s | {frame:.2f} s | {apart.max():.1f} | "
              f"{np.sqrt((apart ** 2).mean()):.2f} |", flush=True)
    simple.Delete(reader)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for argument in ("plugin", "folder", "out"):
        parser.add_argument(argument)
    parser.add_argument("--judge")
    parser.add_argument("--cases", nargs="+", default=list(CASES), choices=CASES)
    arguments = parser.parse_args()
    os.makedirs(arguments.out, exist_ok=True)
    simple.LoadPlugin(arguments.plugin, remote=False, ns=globals())
    print("| mesh, cells | mapper | first image | frame | greatest error | RMSE |\n|---|---|---|---|---|---|", flush=True)
    for each in arguments.cases:
        measure(each, arguments.folder, arguments.out, arguments.judge)
