# SPDX-License-Identifier: MIT OR Apache-2.0
"""What users met: failures that are remembered too long, warnings without end, settings that nobody reads; render passes."""
import os
import subprocess
import sys

import numpy as np
from scene import *  # noqa: F403
from test_pictures import RAMP, SLANT, WAVES
from vtkmodules import vtkRenderingOpenGL2, vtkRenderingVolumeOpenGL2
from vtkmodules.vtkImagingCore import vtkRTAnalyticSource

BOX = dict(field=SLANT, opacity=WAVES, color=RAMP)


def box(**settings):
    return volume(lattice(2, field=SLANT), WAVES, RAMP, **settings)


def test_a_window_that_cannot_is_forgotten():
    v = box()
    said = messages(v.GetMapper())
    w, r = scene(v)
    expected = pixels(w)
    for _ in range(2):
        w.Finalize()
        v.GetMapper().Render(r, v)
        check(pixels(w), expected, near=0, what="after a window without a context")
    v.GetMapper().ReleaseGraphicsResources(w)
    check(pixels(w), expected, near=0, what="after a release")
    assert len(said) <= 2, said


def test_a_failure_of_the_content_is_over_when_that_is_mended():
    v = box()
    m = v.GetMapper()
    said = messages(m)
    w, r = scene(v)
    expected = pixels(w)
    for round in range(2):
        # Each time anew, as something was drawn between.
        m.SetIntegralToVolume()
        m.SetTableSize(1, 1, 1)
        assert pixels(w).max() == 0 and len(said) == round + 1, said
        assert pixels(w).max() == 0 and len(said) == round + 1, said
        m.SetIntegralToExact()
        check(pixels(w), expected, near=0)


def test_points_that_are_not_finite_leave_out_their_cells_wherever_the_volume_is():
    for bad in (np.nan, np.inf, -np.inf):
        g = lattice(3, field=SLANT)
        g.GetPoints().SetPoint(0, 0, bad, 0)
        g.GetPoints().Modified()
        still, moved, mirrored = (volume(g, WAVES, RAMP) for _ in range(3))
        w, r = scene(still, clip=(0.5, 12))
        expected = pixels(w)
        assert expected.max() > 50
        moved.SetPosition(1e-9, 0, 0)
        check(pixels(scene(moved, clip=(0.5, 12))[0]), expected, near=1, what="moved")
        still.SetPosition(1e-9, 0, 0)
        check(pixels(w), expected, near=1, what="moved after it was drawn")
        # The same grid, mirrored twice.
        h = lattice(3, field=SLANT)
        h.GetPoints().SetData(numpy_support.numpy_to_vtk(numpy_support.vtk_to_numpy(h.GetPoints().GetData()) * [-1, 1, 1], deep=1))
        h.GetPoints().SetPoint(0, 0, bad, 0)
        mirrored.GetMapper().SetInputData(h)
        mirrored.SetScale(-1, 1, 1)
        check(pixels(scene(mirrored, clip=(0.5, 12))[0]), expected, near=1, what="mirrored")


def test_points_that_become_finite_bring_back_their_cells():
    g = lattice(3, field=SLANT)
    g.GetPoints().SetPoint(0, 0, np.nan, 0)
    v = volume(g, WAVES, RAMP)
    v.SetPosition(0.1, 0, 0)
    w, r = scene(v, clip=(0.5, 12))
    pixels(w)
    g.GetPoints().SetPoint(0, 0, 0, 0)
    g.GetPoints().Modified()
    g.Modified()
    check(pixels(w), truth(r, (64, 64), matrix=rows(v.GetMatrix()), **BOX))


def image():
    source = vtkRTAnalyticSource()
    source.SetWholeExtent(-5, 5, -5, 5, -5, 5)
    m = vtkRenderingVolumeOpenGL2.vtkOpenGLGPUVolumeRayCastMapper()
    m.SetInputConnection(source.GetOutputPort())
    v = vtkRenderingCore.vtkVolume()
    v.SetMapper(m)
    v.SetScale(0.05)
    v.SetPosition(0.9, 0.5, 1.2)
    v.GetProperty().SetScalarOpacity(opacities([(40, 0), (280, 0.5)]))
    return v


def test_image_volumes_are_peeled_beside_ours():
    def peeled(*props):
        w, r = scene(*props, size=(120, 120), clip=(0.5, 12))
        r.SetBackground(0.2, 0.3, 0.5)
        r.UseDepthPeelingOn()
        r.UseDepthPeelingForVolumesOn()
        r.SetMaximumNumberOfPeels(8)
        r.SetOcclusionRatio(0)
        pixels(w)
        return pixels(w)

    for heights in ((), (0.5,), (0.3, 0.9)):
        sheets = []
        for z in heights:
            sheet = plane(z, (0.9, 0.3, 0.1), half=1.0)
            sheet.GetProperty().SetOpacity(0.5)
            sheets.append(sheet)
        alone = peeled(*sheets, image())
        # A volume of no opacity changes nothing, be it drawn before VTK's or after it.
        clear = lambda: volume(lattice(2, field=SLANT), [(0, 0), (1, 0)])
        check(peeled(*sheets, clear(), image()), alone, near=1, what=f"before, {heights}")
        check(peeled(*sheets, image(), clear()), alone, near=1, what=f"after, {heights}")
        # Where only one of two is, it is as if it were alone.
        ours = peeled(*sheets, box())
        bare = peeled(*sheets)
        only = (np.abs(ours - bare).max(-1) == 0)[..., None] & (np.abs(alone - bare).max(-1) > 5)[..., None]
        assert only.mean() > 0.01
        for props in ((image(), box()), (box(), image())):
            both = peeled(*sheets, *props)
            check(both * only, alone * only, near=1, what=f"the image's part, {heights}")
            mine = (np.abs(alone - bare).max(-1) == 0)[..., None] & (np.abs(ours - bare).max(-1) > 5)[..., None]
            # VTK's layers have 8 bits, and two volumes are rounded more often than one.
            check(both * mine, ours * mine, near=4, what=f"our part, {heights}")


def test_settings_that_are_not_used_refuse_nothing():
    expected = pixels(scene(box())[0])
    for name, value in (("PolynomialDegree", (9,)), ("PolynomialDegree", (0,)), ("PolynomialDegree", (-3,)), ("TableSize", (1, 1, 1)),
                        ("TableSize", (-4, 2, 2)), ("TableTexels", (2,))):
        v = box()
        getattr(v.GetMapper(), "Set" + name)(*value)
        said = Errors(v.GetMapper())
        check(pixels(scene(v)[0]), expected, near=0, what=f"{name} {value}")
        assert len(said) == 0, name
    # Of tables, what the form does not use.
    table = dict(Integral=vtkHaliteMapper.CYLINDRICAL, TableSize=(64, 64, 16))
    expected = pixels(scene(box(**table))[0])
    check(pixels(scene(box(**table, PolynomialDegree=99))[0]), expected, near=0)


def test_other_blend_modes_are_said_and_drawn_as_composite():
    expected = pixels(scene(box())[0])
    for mode in (2, 3, 4, 5):
        v = box()
        v.GetMapper().SetBlendMode(mode)
        said = messages(v.GetMapper(), "WarningEvent")
        w, r = scene(v)
        check(pixels(w), expected, near=0)
        pixels(w)
        assert len(said) == 1 and f"blend mode {mode}" in said[0], said


def step(kind, i):
    """One of a series of grids with something that is to be said."""
    g = lattice(2 + i % 3, field=SLANT)
    if kind == "point":
        g.GetPoints().SetPoint(0, 0, np.nan, 0)
    elif kind == "ghost":
        name = vtkCommonDataModel.vtkDataSetAttributes.GhostArrayName()
        add(g, np.ones(g.GetNumberOfCells(), np.uint8), name, "cell")
    elif kind == "surface":
        g = grid([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [(QUAD, [0, 1, 2, 3])] * (1 + i % 3), np.zeros(4))
    elif kind == "short":
        g.GetPointData().Initialize()
        add(g, np.zeros(3 + i))
        g.GetPointData().SetActiveScalars("s")
    return g


def test_what_holds_is_said_once():
    for kind, most in (("none", 0), ("point", 1), ("ghost", 1), ("surface", 1), ("short", 1)):
        v = volume(step(kind, 0), WAVES, RAMP)
        m = v.GetMapper()
        said, errors = messages(m, "WarningEvent"), messages(m)
        w, r = scene(v, clip=(0.5, 12))
        for i in range(12):
            m.SetInputData(step(kind, i))
            w.Render()
        assert len(said) + len(errors) == most, (kind, said, errors)
        # When it has not held for a while, it is news again.
        m.SetInputData(step("none", 0))
        w.Render()
        m.SetInputData(step(kind, 0))
        w.Render()
        assert len(said) + len(errors) == 2 * most, (kind, said, errors)


def test_warnings_are_those_of_the_mapper_that_they_are_about():
    a, b = volume(step("point", 0), WAVES, RAMP), box()
    said = [messages(v.GetMapper(), "WarningEvent") for v in (a, b)]
    w, r = scene(a, b, clip=(0.5, 12))
    w.Render()
    assert len(said[0]) == 1 and "not finite" in said[0][0] and not said[1], said


def passes():
    steps = vtkRenderingOpenGL2.vtkRenderStepsPass

    def over(name):
        p = getattr(vtkRenderingOpenGL2, name)()
        p.SetDelegatePass(steps())
        return p

    def sequence():
        every = vtkRenderingOpenGL2.vtkRenderPassCollection()
        for name in ("vtkLightsPass", "vtkOpaquePass", "vtkVolumetricPass"):
            every.AddItem(getattr(vtkRenderingOpenGL2, name)())
        s = vtkRenderingOpenGL2.vtkSequencePass()
        s.SetPasses(every)
        c = vtkRenderingOpenGL2.vtkCameraPass()
        c.SetDelegatePass(s)
        return c

    return {"steps": steps, "sequence": sequence, **{
        name: (lambda name=name: over(name))
        for name in ("vtkSSAAPass", "vtkSSAOPass", "vtkGaussianBlurPass", "vtkSobelGradientMagnitudePass", "vtkToneMappingPass")}}


def passed(name, *props, size=(90, 64)):
    w, r = scene(*props, size=size, clip=(0.5, 12))
    r.SetBackground(0.1, 0.2, 0.3)
    if name:
        r.SetPass(passes()[name]())
    return pixels(w)[..., :3]


def ball():
    s = vtkFiltersSources.vtkSphereSource()
    s.SetRadius(0.35)
    s.SetCenter(0.6, 0.3, 0.7)
    m = vtkRenderingCore.vtkPolyDataMapper()
    m.SetInputConnection(s.GetOutputPort())
    a = vtkRenderingCore.vtkActor()
    a.SetMapper(m)
    return a


def test_clear_volumes_leave_what_passes_make_unharmed():
    clear = lambda: volume(lattice(2, field=SLANT), [(0, 0), (1, 0)])
    for name in passes():
        props = lambda: (ball(), plane(-0.2, (0.7, 0.6, 0.2), half=2.0))
        check(passed(name, *props(), clear()), passed(name, *props()), near=1, what=name)


def test_volumes_stand_where_they_are_in_passes():
    props = lambda: (ball(), plane(-0.2, (0.7, 0.6, 0.2), half=2.0), box())
    plain = passed(None, *props())
    # Passes that only draw; that only smooth; that shade where surfaces meet, or by brightness.
    for name, most, mean in (("steps", 1, 0.1), ("sequence", 1, 0.1), ("vtkSSAAPass", 150, 2), ("vtkGaussianBlurPass", 150, 6)):
        apart = np.abs(passed(name, *props()) - plain)
        assert apart.max() <= most and apart.mean() <= mean, (name, apart.max(), apart.mean())
    # Where nothing but the volume is, there is nothing to shade.
    apart = np.abs(passed("vtkSSAOPass", box()) - passed(None, box()))
    assert apart.max() <= 1, apart.max()


def screen(picture):
    """A surface that shows a picture, and fills the view of `straight`."""
    height, width = picture.shape[:2]
    image = vtkCommonDataModel.vtkImageData()
    image.SetDimensions(width, height, 1)
    add(image, picture.clip(0, 255).round().astype(np.uint8).reshape(-1, 3))
    texture = vtkRenderingCore.vtkTexture()
    texture.SetInputData(image)
    texture.InterpolateOff()
    texture.SetColorModeToDirectScalars()
    s = vtkFiltersSources.vtkPlaneSource()
    s.SetOrigin(-width / height / 2, -0.5, 0)
    s.SetPoint1(width / height / 2, -0.5, 0)
    s.SetPoint2(-width / height / 2, 0.5, 0)
    m = vtkRenderingCore.vtkPolyDataMapper()
    m.SetInputConnection(s.GetOutputPort())
    a = vtkRenderingCore.vtkActor()
    a.SetMapper(m)
    a.SetTexture(texture)
    a.GetProperty().LightingOff()
    return a


def test_volumes_are_exact_under_supersampling():
    # VTK draws larger, and filters: the truth, on a surface and finer than what VTK draws, passes the same filter.
    size, straight = (30, 24), dict(position=(0, 0, 3), focus=(0, 0, 0), up=(0, 1, 0), parallel=0.5, clip=(1, 5))
    for angle in (30, 9):
        w, r = scene(box(), size=size, angle=angle, clip=(0.5, 12))
        r.SetPass(passes()["vtkSSAAPass"]())
        picture = pixels(w)[..., :3]
        fine = truth(r, (8 * size[0], 8 * size[1]), steps=20, **BOX)[..., :3]
        w, r = scene(screen(fine), size=size, **straight)
        r.SetPass(passes()["vtkSSAAPass"]())
        check(picture, pixels(w)[..., :3], near=4, what=f"supersampled, {angle} degrees")


def test_occlusion_of_surfaces_is_theirs_alone():
    # Occlusion is a factor of what is drawn, and is found from surfaces: a volume between them and the eye changes none of it.
    props = lambda: (ball(), plane(-0.2, (0.7, 0.6, 0.2), half=2.0))
    plain, shaded = (passed(name, *props()) for name in (None, "vtkSSAOPass"))
    both, expected = passed("vtkSSAOPass", *props(), box()), passed(None, *props(), box())
    # What is black tells no factor.
    tells = plain.max(-1) > 30
    factor = (shaded / plain.clip(1)).max(-1, keepdims=True)
    assert factor[tells].min() < 0.9 and tells.mean() > 0.9, "nothing is shaded"
    assert np.abs(expected - plain)[tells].mean() > 1, "no volume is seen"
    check(both * tells[..., None], expected * factor * tells[..., None], near=4, what="volume and occlusion")


def test_surfaces_end_rays_in_passes():
    # A wall amid the volume, over all of the view: what is behind it is not seen, pass or none.
    wall = lambda: plane(0.5, (0.3, 0.6, 0.9))
    plain = passed(None, wall(), box())
    assert np.abs(plain - passed(None, box())).mean() > 20
    for name in ("steps", "sequence", "vtkSSAAPass"):
        assert np.abs(passed(name, wall(), box()) - plain).mean() < 2, name


def python(code, **environment):
    env = {**os.environ, **environment}
    return subprocess.run([sys.executable, "-c", code], env=env, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def test_another_vtk_is_an_import_error(tmp=os.path.join(os.environ.get("HALITE_TEST_OUTPUT", "."), "other-vtk")):
    # A package that says it is of another version, in place of VTK's.
    os.makedirs(os.path.join(tmp, "vtkmodules"), exist_ok=True)
    open(os.path.join(tmp, "vtkmodules", "__init__.py"), "w").close()
    with open(os.path.join(tmp, "vtkmodules", "vtkCommonCore.py"), "w") as f:
        f.write("class vtkVersion:\n    GetVTKVersion = staticmethod(lambda: '9.7.2')\n")
    path = os.pathsep.join([tmp, os.environ["PYTHONPATH"]])
    run = python("import halite", PYTHONPATH=path)
    said = run.stderr.decode().splitlines()[-1]
    ours = vtkCommonCore.vtkVersion.GetVTKVersion()
    assert run.returncode == 1 and said.startswith("ImportError") and "9.7.2" in said and ours in said and tmp in said, (run.returncode, said)
    with open(os.path.join(tmp, "vtkmodules", "vtkCommonCore.py"), "w") as f:
        f.write("raise ImportError('no VTK here')\n")
    run = python("import halite", PYTHONPATH=path)
    said = run.stderr.decode().splitlines()[-1]
    assert run.returncode == 1 and said.startswith("ImportError") and ours in said and "no VTK here" in said, said


def test_nothing_is_said_where_no_desktop_is():
    code = ("import sys; sys.path[:0] = [%r]; from test_faults import box, scene, pixels; "
            "w, r = scene(box(Engine=0)); print(pixels(w).max())" % os.path.dirname(os.path.abspath(__file__)))
    env = {k: v for k, v in os.environ.items() if k not in ("XDG_RUNTIME_DIR", "NODEVICE_SELECT")}
    for folder in ({}, {"XDG_RUNTIME_DIR": "relative"}):
        run = subprocess.run([sys.executable, "-c", code], env={**env, **folder}, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        assert run.returncode == 0 and int(run.stdout) > 50, run
        assert not run.stderr, run.stderr.decode()


if __name__ == "__main__":
    main(globals())
