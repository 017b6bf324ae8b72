# SPDX-License-Identifier: MIT OR Apache-2.0
"""Halite beside ParaView's own mappers, with times and errors in one table: on large grids that this makes, and on meshes as programs
write them:

    pvbatch mappers.py HALITE.SO FOLDER OUT [--reference 'COMMAND {scene} {folder}'] [--cases NAME...] [--cells SHARE]

FOLDER has the files that CASES names, or legacy files beside them (.vtk), which are taken first: ParaView 5.11 does not
read the faces of polyhedra as VTK's XML files have them since version 2.3. OUT gets scene files, pictures, and the grids that are made,
of some SHARE (1 by default) of a million hexahedra and 1.3 million tetrahedra. With a reference, a program that draws OUT/NAME.json as Halite's
scene files describe it and leaves OUT/NAME.npy (rows from the top, premultiplied RGBA), errors are those against it, in 255ths, over
black: the greatest, and the root of their mean square. Of cells other than tetrahedra there are two judgements: of cells with curved faces
and a field that is trilinear (or likewise) inside, and of the tetrahedra that Halite cuts cells into, by a rule that `split` has once more. The first image includes what a mapper's representation does to the grid; frames are medians of three views.
"""
import argparse
import json
import os
import shlex
import statistics
import subprocess
import time

import numpy as np
from paraview import servermanager, simple
from vtkmodules import vtkCommonCore, vtkCommonDataModel, vtkIOXML
from vtkmodules.util import numpy_support

SIZE, LARGE = (320, 240), (512, 512)
# What is drawn: a file, where its array is, its name, and the range of the functions.
CASES = {
    "made_tetrahedra": (None, "POINTS", "RTData", (37, 277)),
    "made_hexahedra": (None, "POINTS", "RTData", (37, 277)),
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


def made(case, share, path):
    """ParaView's wavelet as a file of tetrahedra or hexahedra."""
    side = round(((1e6 if "hexahedra" in case else 64 ** 3) * share) ** (1 / 3) / 2) * 2
    wavelet = simple.Wavelet(WholeExtent=[-side // 2, side // 2] * 3)
    if "hexahedra" in case:
        wavelet.UpdatePipeline()
        image, n = servermanager.Fetch(wavelet), side + 1
        grid, points, cells = (vtkCommonDataModel.vtkUnstructuredGrid(), vtkCommonCore.vtkPoints(), vtkCommonDataModel.vtkCellArray())
        z, y, x = np.meshgrid(*[np.arange(n, dtype=np.float32) - side // 2] * 3, indexing="ij")
        points.SetData(numpy_support.numpy_to_vtk(np.stack([x, y, z], -1).reshape(-1, 3), deep=1))
        number = np.arange(n ** 3).reshape(n, n, n)
        corners = [number[k:k + side, j:j + side, i:i + side] for k, j, i in
                   ((0, 0, 0), (0, 0, 1), (0, 1, 1), (0, 1, 0), (1, 0, 0), (1, 0, 1), (1, 1, 1), (1, 1, 0))]
        corners = np.stack(corners, -1).ravel()
        cells.SetData(numpy_support.numpy_to_vtkIdTypeArray(8 * np.arange(side ** 3 + 1), deep=1),
                      numpy_support.numpy_to_vtkIdTypeArray(corners, deep=1))
        grid.SetPoints(points)
        grid.SetCells(12, cells)
        grid.GetPointData().ShallowCopy(image.GetPointData())
        write(grid, path)
    else:
        tetrahedra = simple.Tetrahedralize(Input=wavelet)
        simple.SaveData(path, proxy=tetrahedra)
        simple.Delete(tetrahedra)
    simple.Delete(wavelet)


def write(grid, path):
    writer = vtkIOXML.vtkXMLUnstructuredGridWriter()
    writer.SetFileName(path)
    writer.SetInputData(grid)
    writer.Write()


# The faces of linear cells, by VTK's types and numbers of points.
FACES = {
    10: [(0, 1, 3), (1, 2, 3), (2, 0, 3), (0, 2, 1)],
    11: [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)],
    12: [(0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7)],
    13: [(0, 1, 2), (3, 5, 4), (0, 3, 4, 1), (1, 4, 5, 2), (2, 5, 3, 0)],
    14: [(0, 3, 2, 1), (0, 1, 4), (1, 2, 4), (2, 3, 4), (3, 0, 4)],
}


def split(grid):
    """The tetrahedra of linear cells: each cell is a cone from its smallest point (by x, y, z) over those of its faces that are without
    it, and these are fans from their own smallest points. None if there are other cells with a volume."""
    points = numpy_support.vtk_to_numpy(grid.GetPoints().GetData())
    types = numpy_support.vtk_to_numpy(grid.GetCellTypesArray())
    connectivity = numpy_support.vtk_to_numpy(grid.GetCells().GetConnectivityArray())
    starts = numpy_support.vtk_to_numpy(grid.GetCells().GetOffsetsArray())
    if any(vtkCommonDataModel.vtkCellTypes.GetClassNameFromTypeId(int(t)) and t not in FACES and t > 9 for t in np.unique(types)):
        return None
    rank = np.empty(len(points), np.int64)
    rank[np.lexsort(points.T[::-1])] = np.arange(len(points))
    found, of = [], []
    for kind, faces in FACES.items():
        cells = np.flatnonzero(types == kind)
        corners = connectivity[starts[cells][:, None] + np.arange(max(map(max, faces)) + 1)]
        least = np.argmin(rank[corners], 1)
        for face in faces:
            ring = corners[:, face]
            first = np.argmin(rank[ring], 1)
            turned = np.take_along_axis(ring, (first[:, None] + np.arange(len(face))) % len(face), 1)
            without = ~np.isin(least, face)
            for k in range(1, len(face) - 1):
                apex = np.take_along_axis(corners, least[:, None], 1)
                found.append(np.concatenate([apex, turned[:, [0, k, k + 1]]], 1)[without])
                of.append(cells[without])
    found, of = np.concatenate(found), np.concatenate(of)
    p = points.astype(float)[found]
    volume = np.einsum("ij,ij->i", np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), p[:, 3] - p[:, 0])
    found[volume < 0] = found[volume < 0][:, [0, 2, 1, 3]]
    found, of = found[volume != 0], of[volume != 0]
    cut, cells = vtkCommonDataModel.vtkUnstructuredGrid(), vtkCommonDataModel.vtkCellArray()
    cells.SetData(numpy_support.numpy_to_vtkIdTypeArray(4 * np.arange(len(found) + 1), deep=1),
                  numpy_support.numpy_to_vtkIdTypeArray(found.ravel().astype(np.int64), deep=1))
    cut.SetPoints(grid.GetPoints())
    cut.SetCells(10, cells)
    cut.GetPointData().ShallowCopy(grid.GetPointData())
    for i in range(grid.GetCellData().GetNumberOfArrays()):
        array = grid.GetCellData().GetArray(i)
        if array:
            values = numpy_support.numpy_to_vtk(numpy_support.vtk_to_numpy(array)[of], deep=1)
            values.SetName(array.GetName())
            cut.GetCellData().AddArray(values)
    return cut


def picture(v):
    image = v.SMProxy.CaptureWindow(1)
    w, h, _ = image.GetDimensions()
    return numpy_support.vtk_to_numpy(image.GetPointData().GetScalars()).reshape(h, w, -1)[::-1, :, :3].astype(np.uint8)


def drawn(source, mapper, association, name, camera, unit, color, opacity, size):
    """A picture, the time to the first one, and that of a frame."""
    v = simple.CreateView("RenderView")
    v.ViewSize, v.OrientationAxesVisibility, v.CenterAxesVisibility, v.UseFXAA = size, 0, 0, 0
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


def reference_picture(reference, scene, name, out):
    """The reference's picture of a scene, in 255ths over black."""
    with open(os.path.join(out, name + ".json"), "w") as f:
        json.dump(scene, f)
    if not reference:
        return None
    command = shlex.split(reference.format(scene=os.path.join(out, name + ".json"), folder=out))
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return 255 * np.load(os.path.join(out, name + ".npy"))[..., :3]


def apart(found, truth):
    if truth is None:
        return "|"
    off = np.abs(found - truth)
    return f"{off.max():.1f} | {np.sqrt((off ** 2).mean()):.2f}"


def measure(case, folder, out, reference, share):
    file, association, name, (low, high) = CASES[case]
    size = SIZE if file else LARGE
    path = os.path.abspath(os.path.join(folder, file) if file else os.path.join(out, case + ".vtu"))
    if not file:
        made(case, share, path)
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
             "camera": camera, "size": size}
    if "polyhedra" in case:
        # What a reference cannot draw as it is, it may cut; in values of cells nothing depends on how.
        scene["cells"] = "tets"
    if array.GetNumberOfComponents() > 1:
        scene["scalars"]["component"] = "magnitude"
    truth, of_split = reference_picture(reference, scene, case, out), None
    if reference and not is_image and "polyhedra" not in case:
        grid = servermanager.Fetch(reader)
        cut = split(grid) if np.any(numpy_support.vtk_to_numpy(grid.GetCellTypesArray()) != 10) else None
        if cut:
            write(cut, os.path.join(out, case + "_split.vtu"))
            of_split = reference_picture(reference, {**scene, "mesh": os.path.abspath(os.path.join(out, case + "_split.vtu"))}, case + "_split", out)
        else:
            of_split = truth
    for mapper in MAPPERS["UniformGridRepresentation" if is_image else "UnstructuredGridRepresentation"]:
        if mapper == "Resample To Image" and "polyhedra" in case:
            # ParaView 5.11's probe of polyhedra ends the process.
            continue
        found, first, frame = drawn(reader, mapper, association, name, camera, unit, color, opacity, size)
        np.save(os.path.join(out, f"{case}.{mapper.replace(' ', '_')}.npy"), found)
        print(f"| {case}, {information.GetNumberOfCells():,} | {mapper} | {first:.2f} s | {frame:.2f} s | {apart(found, truth)} | "
              f"{apart(found, truth if of_split is None else of_split)} |", flush=True)
    simple.Delete(reader)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for argument in ("plugin", "folder", "out"):
        parser.add_argument(argument)
    parser.add_argument("--reference")
    parser.add_argument("--cases", nargs="+", default=list(CASES), choices=CASES)
    parser.add_argument("--cells", type=float, default=1.0)
    arguments = parser.parse_args()
    os.makedirs(arguments.out, exist_ok=True)
    simple.LoadPlugin(arguments.plugin, remote=False, ns=globals())
    print("| mesh, cells | mapper | first image | frame | greatest error | RMSE | of tetrahedra | RMSE |\n|---|---|---|---|---|---|---|---|",
          flush=True)
    for each in arguments.cases:
        measure(each, arguments.folder, arguments.out, arguments.reference, arguments.cells)
