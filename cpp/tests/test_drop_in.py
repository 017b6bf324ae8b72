# SPDX-License-Identifier: MIT OR Apache-2.0
"""Programs that ask for VTK's mapper and know nothing of Halite: their filters, their settings, their ways to end."""
import gc

import numpy as np
import halite
from scene import *  # noqa: F403
from test_pictures import RAMP, WAVES
from vtkmodules.vtkCommonCore import vtkDoubleArray
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkRectilinearGrid
from vtkmodules.vtkCommonTransforms import vtkTransform
from vtkmodules.vtkFiltersCore import vtkThreshold
from vtkmodules.vtkFiltersGeneral import vtkDataSetTriangleFilter, vtkRectilinearGridToTetrahedra
from vtkmodules.vtkRenderingVolume import vtkProjectedTetrahedraMapper

assert halite


def cube(color):
    """Tetrahedra of a rectilinear grid, drawn by the functions that a new property has."""
    g = vtkRectilinearGrid()
    g.SetDimensions(2, 2, 2)
    for give in (g.SetXCoordinates, g.SetYCoordinates, g.SetZCoordinates):
        a = vtkDoubleArray()
        a.InsertNextValue(0)
        a.InsertNextValue(1)
        give(a)
    f = vtkRectilinearGridToTetrahedra()
    f.SetInputData(g)
    f.Update()
    add(f.GetOutput(), np.zeros(8))
    m = vtkProjectedTetrahedraMapper()
    assert m.GetClassName() == "vtkHaliteMapper"
    m.SetInputData(f.GetOutput())
    m.Update()
    v = vtkRenderingCore.vtkVolume()
    v.SetMapper(m)
    v.GetProperty().SetColor(colors([(0, *color)]))
    return v


def cone(color):
    m = vtkRenderingCore.vtkPolyDataMapper()
    s = vtkFiltersSources.vtkConeSource()
    m.SetInputConnection(s.GetOutputPort())
    a = vtkRenderingCore.vtkActor()
    a.SetMapper(m)
    a.GetProperty().SetColor(*color)
    return a


def moved(prop):
    t = vtkTransform()
    t.Translate(2, 2, 0)
    prop.SetUserTransform(t)
    return prop


def test_cubes_and_cones_under_a_transform():
    red, blue = (1, 0, 0), (0, 0, 1)
    w = window((96, 96))
    r = renderer(w, cube(red), moved(cube(blue)), cone(red), moved(cone(blue)), background=(1, 1, 1))
    # Drawn before anybody has placed the camera, too.
    w.Render()
    r.ResetCamera()
    picture = pixels(w)
    aside = np.eye(4)
    aside[:2, 3] = 2
    expected = np.full((96, 96, 3), 255.0)
    for color, m in ((red, np.eye(4)), (blue, aside)):
        over = truth(r, (96, 96), color=[(0, *color)], matrix=m)
        expected = over[..., :3] + (1 - over[..., 3:] / 255) * expected
    # Where cones are is seen in a picture of them alone.
    for v in list(r.GetVolumes()):
        r.RemoveVolume(v)
    without = (pixels(w)[..., :3] == 255).all(-1)[..., None]
    assert 0.5 < without.mean() < 0.99
    check(picture[..., :3] * without, expected * without)
    assert (picture[..., 1] == 0).any(), "cones are seen"


def test_thresholded_and_triangulated_image():
    n = 9
    im = vtkImageData()
    im.SetDimensions(n, n, n)
    im.SetSpacing(1 / (n - 1), 1 / (n - 1), 1 / (n - 1))
    z, y, x = np.meshgrid(*[np.arange(n)] * 3, indexing="ij")
    s = numpy_support.numpy_to_vtk((30 * x).astype(np.uint8).ravel(), deep=1)
    s.SetName("scalars")
    im.GetPointData().SetScalars(s)
    some = vtkThreshold()
    some.SetInputData(im)
    some.SetThresholdFunction(vtkThreshold.THRESHOLD_UPPER)
    some.SetUpperThreshold(80.0)
    some.AllScalarsOff()
    tets = vtkDataSetTriangleFilter()
    tets.SetInputConnection(some.GetOutputPort())
    m = vtkProjectedTetrahedraMapper()
    m.SetInputConnection(tets.GetOutputPort())
    opacity, color = [(80, 0), (120, 5), (255, 1)], [(80, 0, 0, 0), (120, 0, 0, 1), (160, 1, 0, 0), (200, 0, 1, 0), (255, 0, 1, 1)]
    v = vtkRenderingCore.vtkVolume()
    v.SetMapper(m)
    p = vtkRenderingCore.vtkVolumeProperty()
    p.SetColor(colors(color))
    p.SetScalarOpacity(opacities(opacity))
    p.ShadeOff()
    p.SetInterpolationTypeToLinear()
    v.SetProperty(p)
    w, r = scene(v)
    # Bricks are kept where one of their values is as large.
    expected = truth(r, (64, 64), low=(2 / 8, 0, 0), field=lambda p: 240 * p[..., 0], opacity=opacity, color=color)
    check(pixels(w), expected)
    assert m.GetNumberOfTetrahedra() == 5 * 6 * 64 or m.GetNumberOfTetrahedra() == 6 * 6 * 64, m.GetNumberOfTetrahedra()


def test_on_screen_off_screen_and_on_screen():
    first, second = cube((1, 0, 0)), moved(cube((0, 0, 1)))
    w = window((64, 64))
    r = renderer(w, first, second, background=(1, 1, 1))
    w.SetOffScreenRendering(0)
    w.Render()
    r.RemoveVolume(first)
    w.SetOffScreenRendering(1)
    w.Render()
    look(r, position=(4, 0, 5), focus=(2.5, 2.5, 0.5))
    aside = np.eye(4)
    aside[:2, 3] = 2
    over = truth(r, (64, 64), color=[(0, 0, 0, 1)], matrix=aside)
    expected = over[..., :3] + (1 - over[..., 3:] / 255) * 255
    check(pixels(w)[..., :3], expected, what="off screen")
    w.SetOffScreenRendering(0)
    w.Finalize()
    w.Start()
    check(pixels(w)[..., :3], expected, what="in another window")


def test_what_programs_tell_a_mapper():
    from vtkmodules.vtkRenderingCore import vtkAreaPicker, vtkCellPicker, vtkPointPicker, vtkPropPicker, vtkWorldPointPicker
    from vtkmodules.vtkRenderingVolume import vtkUnstructuredGridVolumeMapper
    m = vtkProjectedTetrahedraMapper()
    said = Errors(m)
    v = volume(lattice(2, cells="tet"), WAVES, RAMP, mapper=m)
    w, r = scene(v)
    w.Render()
    assert m.IsSupported(w) and vtkUnstructuredGridVolumeMapper.SafeDownCast(m) is m and vtkProjectedTetrahedraMapper.SafeDownCast(m) is m
    expected = truth(r, (64, 64), opacity=WAVES, color=RAMP)
    same = lambda what: check(pixels(w), expected, what=what)
    m.UseFloatingPointFrameBufferOff()
    same("without floating-point frame buffer")
    assert not m.GetUseFloatingPointFrameBuffer()
    m.SetVisibilitySort(m.GetVisibilitySort())
    same("with its own order")
    for picker in (vtkPropPicker(), vtkPointPicker(), vtkCellPicker(), vtkWorldPointPicker()):
        picker.Pick(32, 32, 0, r)
    vtkAreaPicker().AreaPick(0, 0, 63, 63, r)
    same("after picking")
    m.ReleaseGraphicsResources(w)
    same("after its resources were released")
    r.RemoveVolume(v)
    assert pixels(w).max() == 0
    r.AddVolume(v)
    same("after it was removed")
    v.VisibilityOff()
    assert pixels(w).max() == 0
    v.VisibilityOn()
    v.SetAllocatedRenderTime(0.001, r)
    same("in a hurry")
    assert m.GetTimeToDraw() >= 0 and v.GetEstimatedRenderTime(r) >= 0 and m.GetBounds() == (0, 1, 0, 1, 0, 1)
    m.SetScalarModeToUseCellData()
    add(m.GetInput(), np.full(48, 0.6), "c", "cell")
    check(pixels(w), truth(r, (64, 64), opacity=[(0, 5)], color=[(0, *interpolate(RAMP, 0.6))]), what="cell data")
    assert len(said) == 0 and "vtkHaliteMapper" in str(m)


def test_everything_goes_in_any_order():
    gone = []

    def make(k):
        v = volume(lattice(2, cells="tet"), WAVES, RAMP, mapper=vtkProjectedTetrahedraMapper())
        w, r = scene(v, plane(0.3))
        for o in (v, v.GetMapper(), v.GetProperty(), v.GetMapper().GetInput(), w, r):
            o.AddObserver("DeleteEvent", lambda *_: gone.append(k))
        assert pixels(w).max() > 0
        return [w, r, v, v.GetMapper()]

    orders = ((0, 1, 2, 3), (3, 2, 1, 0), (2, 0, 3, 1), (1, 2, 0, 3))
    for k, order in enumerate(orders):
        objects = make(k)
        for i in order:
            objects[i] = None
        gc.collect()
        assert gone.count(k) == 6, (order, gone)
    # A mapper in a window that is closed, then in another.
    v = volume(lattice(2, cells="tet"), WAVES, RAMP, mapper=vtkProjectedTetrahedraMapper())
    for _ in range(3):
        w, r = scene(v)
        check(pixels(w), truth(r, (64, 64), opacity=WAVES, color=RAMP))
        w.Finalize()
        del w, r


if __name__ == "__main__":
    main(globals())
