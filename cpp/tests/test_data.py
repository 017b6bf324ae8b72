# SPDX-License-Identifier: MIT OR Apache-2.0
"""Arrays of every layout, scalar modes, functions."""
import os

import numpy as np
from scene import *  # noqa: F403
from test_pictures import RAMP, SLANT, TENT, WAVES

BOX = dict(field=SLANT, opacity=WAVES, color=RAMP)


def expect(v, what="", near=NEAR, camera=dict(), **expected):
    w, r = scene(v, **camera)
    picture = pixels(w)
    check(picture, truth(r, (64, 64), **{**BOX, **expected}), near, what)
    return w, r, v.GetMapper()


def test_number_types():
    for kind in (np.float32, np.float64, np.int8, np.uint8, np.int16, np.uint16, np.int32, np.uint32, np.int64, np.uint64):
        g = lattice(2, field=lambda p: np.round(100 * SLANT(p)).astype(kind))
        scaled = [(100 * k[0], *k[1:]) for k in WAVES], [(100 * k[0], *k[1:]) for k in RAMP]
        _, _, m = expect(volume(g, *scaled), kind.__name__)
        assert m.GetNumberOfCopies() == 0, kind


def test_points_of_floats():
    _, _, m = expect(volume(lattice(2, field=SLANT, dtype=np.float32), WAVES, RAMP))
    assert m.GetNumberOfCopies() == 0


def test_ids_of_32_and_64_bits():
    for bits in (32, 64):
        g = lattice(2, field=SLANT)
        cells = g.GetCells()
        cells.ConvertTo32BitStorage() if bits == 32 else cells.ConvertTo64BitStorage()
        _, _, m = expect(volume(g, WAVES, RAMP), f"{bits} bits")
        assert m.GetNumberOfCopies() == 0


def test_structure_of_arrays():
    from vtkmodules.vtkCommonCore import vtkSOADataArrayTemplate
    g = lattice(2)
    points = np.array([g.GetPoint(i) for i in range(g.GetNumberOfPoints())])
    soa = vtkSOADataArrayTemplate["float64"]()
    soa.SetNumberOfComponents(3)
    soa.SetNumberOfTuples(len(points))
    soa.SetName("soa")
    for i, p in enumerate(points):
        soa.SetTuple3(i, 7 * p[0], SLANT(p), -p[2])
    g.GetPointData().SetScalars(soa)
    f = colors(RAMP)
    f.SetVectorModeToComponent()
    f.SetVectorComponent(1)
    _, _, m = expect(volume(g, WAVES, f))
    assert m.GetNumberOfCopies() == 0, "one component of such an array needs no copy"


def test_scalar_modes():
    g = lattice(2)
    points = np.array([g.GetPoint(i) for i in range(g.GetNumberOfPoints())])
    add(g, SLANT(points), "slant")
    add(g, np.arange(8) / 7.0, "cells", "cell")
    v = volume(g, WAVES, RAMP)
    m = v.GetMapper()
    w, r = scene(v)
    upward = truth(r, (64, 64), opacity=WAVES, color=RAMP)
    slanted = truth(r, (64, 64), **BOX)
    check(pixels(w), upward, what="default")
    m.SetScalarModeToUsePointFieldData()
    m.SelectScalarArray("slant")
    check(pixels(w), slanted, what="by name")
    m.SelectScalarArray(0)
    check(pixels(w), upward, what="by id")
    m.SelectScalarArray(1)
    check(pixels(w), slanted, what="by another id")
    m.SetScalarModeToUsePointData()
    check(pixels(w), upward, what="point data")
    # Bricks count along x, then y, then z.
    number = lambda p: sum((p[..., k] > 0.5) * 2**k for k in range(3)) / 7.0
    celled = truth(r, (64, 64), field=number, opacity=WAVES, color=RAMP, steps=2000)
    m.SetScalarModeToUseCellData()
    g.GetCellData().SetActiveScalars("cells")
    check(pixels(w), celled, what="cell data")
    m.SetScalarModeToUseCellFieldData()
    m.SelectScalarArray("cells")
    check(pixels(w), celled, what="cells by name")


def vectors(g):
    points = np.array([g.GetPoint(i) for i in range(g.GetNumberOfPoints())])
    return points, SLANT(points)


def test_components_and_magnitude():
    g = lattice(2)
    points, s = vectors(g)
    direction = np.array([2, -1, 2]) / 3
    add(g, s[:, None] * direction, "v")
    g.GetPointData().SetActiveScalars("v")
    f = colors(RAMP)
    v = volume(g, WAVES, f)
    w, r = scene(v)
    f.SetVectorModeToMagnitude()
    check(pixels(w), truth(r, (64, 64), **BOX), what="magnitude")
    f.SetVectorModeToComponent()
    f.SetVectorComponent(2)
    check(pixels(w), truth(r, (64, 64), **{**BOX, "field": lambda p: SLANT(p) * 2 / 3}), what="component")


def test_dependent_components():
    g = lattice(2)
    points, s = vectors(g)
    add(g, np.stack([points[:, 0], s], -1), "pair")
    g.GetPointData().SetActiveScalars("pair")
    v = volume(g, WAVES, RAMP)
    v.GetProperty().IndependentComponentsOff()
    w, r = scene(v)
    picture = pixels(w)
    hue = lambda p: p[..., 0]
    check(picture, truth(r, (64, 64), hue=hue, **BOX), what="smooth")
    steps = [(0, 1, 0, 0), (0.4999, 1, 0, 0), (0.5001, 0, 0, 1), (1, 0, 0, 1)]
    v.GetProperty().SetColor(colors(steps))
    picture = pixels(w)
    check(picture, truth(r, (64, 64), hue=hue, **{**BOX, "color": steps}), what="steps")
    assert picture[..., 0].max() > 100 and picture[..., 2].max() > 100


def test_four_dependent_components():
    # Red, green, blue and opacity themselves, as bytes or as floats from 0 to 1.
    g = lattice(1)
    n = g.GetNumberOfPoints()
    for kind, one in ((np.uint8, 255), (np.float32, 1.0)):
        a = np.tile(np.array([1.0, 0.4, 0.2, 0.6]) * one, (n, 1)).astype(kind)
        g.GetPointData().Initialize()
        add(g, a, "rgba")
        v = volume(g)
        v.GetProperty().IndependentComponentsOff()
        w, r = scene(v, position=(0.5, 0.5, 6), up=(0, 1, 0), parallel=0.4)
        alpha = 1 - np.exp(-0.6)
        assert np.abs(pixels(w)[32, 32] - 255 * alpha * np.array([1, 0.4, 0.2, 1])).max() < NEAR, kind


def test_three_dependent_components_are_an_error():
    g = lattice(1)
    add(g, np.ones((8, 3)), "three")
    g.GetPointData().SetActiveScalars("three")
    v = volume(g)
    v.GetProperty().IndependentComponentsOff()
    errors = Errors(v.GetMapper())
    w, r = scene(v)
    for _ in range(3):
        assert pixels(w).max() == 0
    assert len(errors) == 1, "an error is said once"
    v.GetProperty().IndependentComponentsOn()
    assert pixels(w).max() > 0, "and the volume is drawn once it can be"


def test_grey_functions():
    v = volume(lattice(2, field=SLANT), WAVES)
    v.GetProperty().SetColor(opacities([(0, 0.1), (0.6, 1), (1, 0.3)]))
    expect(v, color=[(0, 0.1, 0.1, 0.1), (0.6, 1, 1, 1), (1, 0.3, 0.3, 0.3)])


NODES = [(0, 0.1, 0.2, 0.9), (0.4, 0.9, 0.8, 0.2), (1, 0.8, 0.0, 0.1)]


def as_told(f, n=4001, low=0.0):
    """What VTK itself says of a function, at so many places: the truth."""
    at = np.linspace(low, 1, n)
    if isinstance(f, vtkCommonDataModel.vtkPiecewiseFunction):
        return [(s, f.GetValue(s)) for s in at]
    values = [0.0] * (3 * n)
    f.GetTable(low, 1.0, n, values)
    return np.column_stack([at, np.reshape(values, (n, 3))])


def test_colour_spaces():
    seen = {}
    for space in ("RGB", "HSV", "HSV without wrapping", "Lab", "LabCIEDE2000", "Diverging", "Step"):
        f = colors(NODES, space.split()[0])
        f.SetHSVWrap(" " not in space)
        table = as_told(f)
        seen[space] = np.array(table)
        expect(volume(lattice(2, field=SLANT), TENT, f), space, opacity=TENT, color=table)
    apart = [(a, b) for a in seen for b in seen if a < b and np.abs(seen[a] - seen[b]).max() < 0.01]
    assert len(apart) <= 1, apart


def test_logarithmic_colours():
    for space in ("RGB", "LabCIEDE2000"):
        f = colors([(0.01, 0.1, 0.2, 0.9), (0.1, 0.9, 0.8, 0.2), (1, 0.8, 0.0, 0.1)], space)
        f.SetScaleToLog10()
        table = as_told(f, 2001, low=0.01)
        # VTK's tables of such functions are equally spaced in the logarithm.
        table[:, 0] = np.geomspace(0.01, 1, 2001)
        far = lambda p: 0.01 + 0.9 * SLANT(p)
        expect(volume(lattice(2, field=far), TENT, f), space, field=far, opacity=TENT, color=table)


def test_midpoints_and_sharpness():
    f = vtkCommonDataModel.vtkPiecewiseFunction()
    f.AddPoint(0, 0, 0.3, 0.6)
    f.AddPoint(0.5, 3, 0.7, 1.0)
    f.AddPoint(1, 0.2, 0.5, 0)
    expect(volume(lattice(2, field=SLANT), f, RAMP), opacity=as_told(f, 8001))
    c = vtkRenderingCore.vtkColorTransferFunction()
    c.AddRGBPoint(0, 0.9, 0.1, 0.2, 0.3, 0.6)
    c.AddRGBPoint(0.5, 0.1, 0.9, 0.3, 0.7, 1.0)
    c.AddRGBPoint(1, 0.2, 0.3, 1.0)
    expect(volume(lattice(2, field=SLANT), TENT, c), opacity=TENT, color=as_told(c, 8001))


def test_functions_with_two_nodes_in_one_place():
    f = vtkCommonDataModel.vtkPiecewiseFunction()
    f.AllowDuplicateScalarsOn()
    for node in ((0, 0.2), (0.4, 0.2), (0.4, 4), (0.7, 3), (0.7, 0), (1, 0)):
        f.AddPoint(*node)
    steps = [(0, 0.2), (0.4, 0.2), (0.4 + 1e-12, 4), (0.7, 3), (0.7 + 1e-12, 0), (1, 0)]
    expect(volume(lattice(2, field=SLANT), f, RAMP), opacity=steps)


def test_functions_end_where_they_do_not_clamp():
    f, c = opacities([(0.3, 1), (0.6, 2)]), colors([(0.3, 1, 0, 0), (0.6, 0, 1, 0)])
    f.ClampingOff()
    v = volume(lattice(2, field=SLANT), f, c)
    expect(v, opacity=[(0.2999, 0), (0.3, 1), (0.6, 2), (0.6001, 0)], color=[(0.3, 1, 0, 0), (0.6, 0, 1, 0)])


def test_unit_distance_and_convention():
    for unit in (0.25, 3.0):
        expect(volume(lattice(2, field=SLANT), WAVES, RAMP, unit), unit=unit)
    low = [(0, 0.1), (0.5, 0.8), (1, 0.3)]
    v = volume(lattice(2, field=SLANT), low, RAMP, 0.5)
    v.GetMapper().SetOpacityConventionToOpacity()
    expect(v, opacity=low, unit=0.5, slab=True)


def test_values_that_are_not_finite_are_invisible():
    g = half = lattice(1, cells="hex", low=(0, 0, 0), high=(1, 1, 1))
    points = np.array([g.GetPoint(i) for i in range(8)] + [(x, y, 2.0) for y in (0, 1) for x in (0, 1)])
    g = grid(points, [(VOXEL, range(8)), (VOXEL, range(4, 12))], np.array([*points[:8, 2], np.nan, 0, np.inf, 1]))
    assert half
    # Every tetrahedron of the upper brick that touches such a point is gone; the lower one is whole.
    w, r = scene(volume(g, TENT), position=(0.5, 0.5, -5), focus=(0.5, 0.5, 0), up=(0, 1, 0), parallel=0.4, clip=(1, 6))
    check(pixels(w), np.full((64, 64, 4), 161))


def test_new_data():
    g = lattice(2, field=SLANT)
    v = volume(g, WAVES, RAMP)
    w, r = scene(v)
    pixels(w)
    a = g.GetPointData().GetScalars()
    points = np.array([g.GetPoint(i) for i in range(27)])
    for i, p in enumerate(points):
        a.SetValue(i, 1 - SLANT(p))
    a.Modified()
    check(pixels(w), truth(r, (64, 64), **{**BOX, "field": lambda p: 1 - SLANT(p)}), what="values in place")
    for i, p in enumerate(points):
        g.GetPoints().SetPoint(i, p[0], p[1], 0.6 * p[2])
        a.SetValue(i, SLANT(points[i] * [1, 1, 0.6]))
    g.GetPoints().Modified()
    a.Modified()
    check(pixels(w), truth(r, (64, 64), **{**BOX, "high": (1, 1, 0.6)}), what="points in place")
    v.GetMapper().SetInputData(lattice(1, high=(0.5, 1, 1), field=SLANT))
    check(pixels(w), truth(r, (64, 64), **{**BOX, "high": (0.5, 1, 1)}), what="another grid")


def test_empty_grids_draw_nothing_and_are_no_error():
    for g in (vtkCommonDataModel.vtkUnstructuredGrid(), grid(np.zeros((3, 3)), [], np.ones(3))):
        v = volume(g)
        errors = Errors(v.GetMapper())
        w, r = scene(v, clip=(1, 5))
        assert pixels(w).max() == 0 and len(errors) == 0


def test_errors_leave_the_application_alive():
    cases = dict(array=lambda m: (m.SetScalarModeToUsePointFieldData(), m.SelectScalarArray("nowhere")),
                 device=lambda m: m.SetDevice("no such thing"),
                 integral=lambda m: (m.SetIntegralToVolume(), m.SetTableSize(1, 1, 1)))
    for name, spoil in cases.items():
        v = volume(lattice(2, field=SLANT), WAVES, RAMP)
        spoil(v.GetMapper())
        errors = Errors(v.GetMapper())
        w, r = scene(v)
        assert pixels(w).max() == 0 and pixels(w).max() == 0 and len(errors) == 1, name
        v.GetMapper().SetScalarModeToDefault()
        v.GetMapper().SetDevice("auto")
        v.GetMapper().SetIntegralToAuto()
        check(pixels(w), truth(r, (64, 64), **BOX), what=name)


def test_projection_engine():
    """Bricks of a lattice can be sorted by depth."""
    for camera, unit in (dict(), 1.0), (dict(parallel=0.9), 0.5):
        v = volume(lattice(2, cells="hex", field=SLANT), WAVES, RAMP, unit)
        m = v.GetMapper()
        m.SetEngineToProject()
        errors = Errors(m)
        w, r = scene(v, **camera)
        picture = pixels(w)
        if len(errors):
            # There is no Vulkan driver here, not even one in software.
            assert "HALITE_REQUIRE_GPU" not in os.environ
            m.SetEngineToAuto()
            assert pixels(w).max() > 0
            print("skipped: no device can project")
            return
        check(picture, truth(r, (64, 64), unit=unit, **BOX), what=m.GetAdapter())
    stretch = np.diag([1.5, 0.7, 1.2, 1])
    v.SetUserMatrix(transform(stretch))
    check(pixels(w), truth(r, (64, 64), unit=unit, matrix=stretch, **BOX), what="moved")
    assert m.GetNumberOfMeshUploads() == 1 and m.GetNumberOfPointUploads() == 1
    r.AddActor(plane(0.4))
    over = truth(r, (64, 64), unit=unit, matrix=stretch, keep=lambda p: p[..., 2] > 0.4, steps=2000, **BOX)
    check(pixels(w), over + (1 - over[..., 3:] / 255) * [0, 0, 0, 255], what="opaque plane")
    # The CPU projects, too; maxima are the same on both.
    m.SetBlendModeToMaximumIntensity()
    largest = pixels(w)
    m.SetDevice("cpu")
    check(pixels(w), largest, what="maximum")
    m.SetBlendModeToComposite()
    check(pixels(w), over + (1 - over[..., 3:] / 255) * [0, 0, 0, 255], what="CPU")
    assert len(errors) == 0
    m.SetDevice("auto")
    check(pixels(w), over + (1 - over[..., 3:] / 255) * [0, 0, 0, 255], what="again")


def test_what_is_not_honoured_is_said_once():
    steep = opacities([(0, 0), (1, 1)])
    # Cells have no gradient.
    cases = dict(shade=(True, lambda p: p.ShadeOn()), gradient=(True, lambda p: p.SetGradientOpacity(steep)),
                 functions=(False, lambda p: p.SetTransferFunctionMode(p.TF_2D)))
    for name, (of_cells, ask) in cases.items():
        g = lattice(2, field=SLANT)
        if of_cells:
            add(g, np.full(8, 0.5), "c", "cell")
        v = volume(g, WAVES, RAMP)
        if of_cells:
            v.GetMapper().SetScalarModeToUseCellData()
        ask(v.GetProperty())
        errors = Errors(v.GetMapper())
        w, r = scene(v)
        for k in range(3):
            r.GetActiveCamera().Azimuth(1)
            field = (lambda p: np.full(p.shape[:-1], 0.5)) if of_cells else BOX["field"]
            check(pixels(w), truth(r, (64, 64), **{**BOX, "field": field}), what=name)
        assert len(errors) == 1, name


def test_settings_without_a_meaning_here_change_nothing():
    v = volume(lattice(2, field=SLANT), WAVES, RAMP)
    p = v.GetProperty()
    errors = Errors(v.GetMapper())
    w, r = scene(v)
    before = pixels(w)
    p.SetInterpolationTypeToLinear()
    check(pixels(w), before, near=0, what="linear")
    p.SetInterpolationTypeToNearest()
    check(pixels(w), before, near=0, what="nearest")
    p.SetComponentWeight(0, 0.3)
    p.SetAmbient(0.7)
    p.SetScalarOpacity(1, opacities([(0, 9)]))
    check(pixels(w), before, near=0, what="weights, light and other components")
    # An array of one component has no others, and its magnitude is not asked for.
    p.GetRGBTransferFunction(0).SetVectorModeToComponent()
    p.GetRGBTransferFunction(0).SetVectorComponent(2)
    check(pixels(w), before, near=0, what="component")
    p.GetRGBTransferFunction(0).SetVectorModeToMagnitude()
    check(pixels(w), before, near=0, what="magnitude")
    p.IndependentComponentsOff()
    check(pixels(w), before, near=0, what="dependent")
    assert len(errors) == 0


def test_other_arrays():
    """Bits, ids, and several components one after another: copied where they must be."""
    from vtkmodules.vtkCommonCore import vtkBitArray, vtkIdTypeArray, vtkSOADataArrayTemplate
    points = np.array([lattice(2).GetPoint(i) for i in range(27)])
    # Half of the box holds zeros: what is between 0 and 1 is in the other half.
    last = lambda p: np.maximum(2 * p[..., 0] - 1, 0)
    for kind in (vtkBitArray, vtkIdTypeArray):
        a = kind()
        for x in points[:, 0]:
            a.InsertNextTuple1(int(x >= 1))
        a.SetName("other")
        g = lattice(2)
        g.GetPointData().SetScalars(a)
        expect(volume(g, WAVES, RAMP), kind.__name__, field=last, steps=2000)
    soa = vtkSOADataArrayTemplate["float32"]()
    soa.SetNumberOfComponents(2)
    soa.SetNumberOfTuples(27)
    soa.SetName("soa")
    for i, p in enumerate(points):
        soa.SetTuple2(i, 0.6 * SLANT(p), 0.8 * SLANT(p))
    g = lattice(2)
    g.GetPointData().SetScalars(soa)
    f = colors(RAMP)
    f.SetVectorModeToMagnitude()
    expect(volume(g, WAVES, f), "magnitude")
    v = volume(g, [(0.8 * s, a) for s, a in WAVES], [(0.6 * k[0], *k[1:]) for k in RAMP])
    v.GetProperty().IndependentComponentsOff()
    expect(v, "both components")


if __name__ == "__main__":
    main(globals())
