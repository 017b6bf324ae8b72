# SPDX-License-Identifier: MIT OR Apache-2.0
"""The scenes of ../shared/reference, said in Python's words, are drawn as by the program, bit for bit."""
import importlib.util
import json
import os
import pathlib
import subprocess

import numpy as np
import pytest

import halite

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDER = ROOT.parent / "shared" / "reference"
PROGRAM = pathlib.Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "ci" / "halite"
SCENES = sorted(p.stem for p in FOLDER.glob("*.json"))
# What speaks to the oracle alone, and what needs no word: the default.
UNSAID = {"tol", "truth_of", "cells"}


def function(scene):
    """The transfer function of a scene."""
    take = lambda key, default=None: scene.pop(key, default)
    direct = take("emission", "chromatic") == "direct"
    scale = take("emission_scale", 1.0)
    more = {k: take(k) for k in ("gradient_opacity", "widgets", "silhouette", "shade", "lights") if k in scene}
    table = take("table2d")
    if table:
        more["table2d"] = (np.load(FOLDER / table["file"]), table["s"], table["g"])
    return halite.TransferFunction(
        take("color", [(0, 0, 0, 0)]), opacity=take("opacity", [(0, 0)]), unit_distance=take("unit_distance"),
        convention=take("convention", "extinction"), emission_scale=scale if direct else None, clamp=take("clamp", True), **more)


def seen(scene):
    """The view of a scene, and the depths at which its rays end."""
    camera = scene.pop("camera")
    parallel = camera.pop("projection", "perspective") == "parallel"
    scale, angle = camera.pop("parallel_scale", None), camera.pop("view_angle", 30.0)
    cropping = scene.pop("cropping", None)
    view = halite.View(
        **camera, view_angle=angle, parallel_scale=scale if parallel else None, size=scene.pop("size"),
        pixel_offset=scene.pop("pixel_offset", (0, 0)), clipping_range=scene.pop("clipping_range", None),
        planes=[(p["origin"], p["normal"]) for p in scene.pop("clipping_planes", [])], opaque=scene.pop("opaque", []),
        cropping=cropping and (np.ravel(cropping["planes"]), cropping.get("regions", "subvolume")))
    depth = scene.pop("depth", None)
    kinds = {"gl": "window", "eye": "eye", "ray": "ray"}
    return view, {} if depth is None else {"depth": np.load(FOLDER / depth["file"]), "depth_kind": kinds[depth.get("kind", "gl")]}


def by_vtk(path):
    """The mesh as VTK reads it; None without VTK."""
    readers = {".vtu": "UnstructuredGrid", ".vti": "ImageData", ".vtr": "RectilinearGrid", ".vts": "StructuredGrid"}
    if path.suffix not in readers or not importlib.util.find_spec("vtkmodules"):
        return None
    from vtkmodules import vtkIOXML
    reader = getattr(vtkIOXML, f"vtkXML{readers[path.suffix]}Reader")()
    reader.SetFileName(str(path))
    reader.Update()
    grid = reader.GetOutput()
    if hasattr(grid, "GetFaces") and not hasattr(grid, "GetPolyhedronFaces") and b'"polyhedron_to_faces"' in path.read_bytes():
        # Releases before 9.4 do not read faces of polyhedra that later ones write.
        return None
    return halite.Mesh.from_vtk(grid)


@pytest.mark.skipif(not SCENES, reason="there is no ../shared/reference")
@pytest.mark.skipif(not PROGRAM.exists(), reason="the program is not built: cargo build --profile ci")
@pytest.mark.parametrize("name", SCENES)
def test_pictures_are_those_of_the_program(name, tmp_path):
    scene = json.loads((FOLDER / f"{name}.json").read_text())
    for key in UNSAID:
        scene.pop(key, None)
    transfer, (view, ends) = function(scene), seen(scene)
    scalars = scene.pop("scalars")
    component = scalars.get("component")
    path = FOLDER / scene.pop("mesh")
    options = {
        "association": scalars.get("association"), "component": None if component == "magnitude" else component,
        "transfer": transfer, "gradient_array": scene.pop("gradient_array", None),
        "reconstruction": scene.pop("reconstruction", None), "sampling": scene.pop("sampling", None),
        "integral": scene.pop("integral", None), "engine": scene.pop("engine", "auto"), "device": "cpu"}
    maximum = scene.pop("blend", "composite") == "maximum"
    scene.pop("background", None)
    assert not scene, "Python has no word for this"
    out = tmp_path / "program.npy"
    run = subprocess.run([PROGRAM, "render", FOLDER / f"{name}.json", "--device", "cpu", "--out", out], capture_output=True, text=True)
    if run.returncode:
        with pytest.raises(halite.Error) as error:
            halite.Renderer(halite.read(path), scalars["name"], **options)
        assert str(error.value) in run.stderr
        return
    theirs = np.load(out)
    for mesh in (halite.read(path), by_vtk(path)):
        if mesh is not None:
            picture = halite.Renderer(mesh, scalars["name"], **options).render(view, maximum=maximum, **ends)
            assert picture.shape == theirs.shape and picture[..., 3].max() > 0.05
            different = np.count_nonzero(picture.view(np.uint32) != theirs.view(np.uint32))
            assert different == 0, f"{different} numbers of {theirs.size} differ, by {np.abs(picture - theirs).max()} at most"
