# SPDX-License-Identifier: MIT OR Apache-2.0
"""The project's reference scenes, drawn in VTK, where a checkout has them beside it (HALITE_REFERENCE, or ../shared/reference)."""
import json
import os
import pathlib

import numpy as np
from scene import *  # noqa: F403

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDER = pathlib.Path(os.environ.get("HALITE_REFERENCE", ROOT.parent / "shared" / "reference"))
NAMES = ["wavelet_smooth", "wavelet_parallel", "wavelet_close90", "wavelet_inside90", "wavelet_peak", "sphere_shells",
         "many_knots", "opacity_convention", "offset_scalar", "discontinuous", "holes", "far_away", "huge_neighbour",
         "linear_hexes", "linear_wedges", "linear_pyramids"]


def draw(path):
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader
    s = json.loads(path.read_text())
    reader = vtkXMLUnstructuredGridReader()
    mesh = pathlib.Path(s["mesh"])
    reader.SetFileName(str(next(p for p in (FOLDER / mesh, FOLDER.parent / mesh, mesh, FOLDER / "meshes" / mesh.name) if p.exists())))
    reader.Update()
    steps = lambda knots: [(k[0] + 1e-9 * i * (1 + abs(k[0])) if i and k[0] == knots[i - 1][0] else k[0], *k[1:]) for i, k in enumerate(knots)]
    v = volume(reader.GetOutput(), steps(s["opacity"]), steps(s["color"]), s.get("unit_distance", 1))
    m = v.GetMapper()
    scalars = s["scalars"]
    m.SetScalarModeToUseCellFieldData() if scalars.get("association") == "cell" else m.SetScalarModeToUsePointFieldData()
    m.SelectScalarArray(scalars["name"])
    if s.get("convention", s.get("opacity_convention")) == "opacity":
        m.SetOpacityConventionToOpacity()
    if s.get("blend") == "maximum":
        m.SetBlendModeToMaximumIntensity()
    c = s["camera"]
    w, r = scene(v, size=s["size"], position=c["position"], focus=c["focal_point"], up=c["view_up"],
                 angle=c.get("view_angle", 30), parallel=c.get("parallel_scale"))
    # VTK's own range would cut off what is just before the camera.
    far = r.GetActiveCamera().GetClippingRange()[1]
    r.GetActiveCamera().SetClippingRange(*s.get("clipping_range", (1e-5 * far, far)))
    return pixels(w)


def test_reference_scenes():
    if not FOLDER.is_dir():
        print(f"skipped: there is no {FOLDER}")
        return
    for name in NAMES:
        expected = np.load(FOLDER / f"{name}.npy")[::-1]
        picture = draw(FOLDER / f"{name}.json")
        # A window shows no colour above full.
        worst = check(picture, 255 * np.clip(expected, 0, 1), what=name)
        print(f"        {worst:.2f}  {name}", flush=True)


if __name__ == "__main__":
    main(globals())
