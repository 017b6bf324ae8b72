# SPDX-License-Identifier: MIT OR Apache-2.0
"""Image data, rectilinear and structured grids: pictures against the truth about their fields."""
import numpy as np
from vtkmodules import vtkCommonCore, vtkCommonDataModel, vtkRenderingVolumeOpenGL2
from vtkmodules.util import numpy_support

from scene import Errors, add, check, look, main, messages, pixels, renderer, scene, transform, truth, volume, window

SIZE = (4, 3, 5)
# Pixels, and parts of a ray that count as one value.
WINDOW, STEPS = (32, 32), 600
RAMP = [(0, 0.1, 0.3, 1), (0.5, 0.9, 0.9, 0.2), (1, 1, 0.2, 0.1)]
LOW = [(0, 0.0), (0.3, 0.5), (0.6, 0.1), (1, 0.8)]
LOOK = {"opacity": LOW, "color": RAMP, "slab": True, "unit": 0.5, "steps": STEPS}
VALUES = np.random.default_rng(5).uniform(0, 1, SIZE[::-1])
AXES = [np.array([-0.2, 0.1, 0.7, 1.0]), np.array([0.0, 0.35, 1.1]), np.array([0.0, 0.2, 0.5, 0.8, 1.3])]


def image(values=VALUES, spacing=(0.3, 0.5, 0.25), extent=(1, 0, -2), of="point"):
    g = vtkCommonDataModel.vtkImageData()
    g.SetExtent(*(x for a in range(3) for x in (extent[a], extent[a] + SIZE[a] - 1)))
    g.SetSpacing(*spacing)
    g.SetOrigin(*(-s * e for s, e in zip(spacing, extent)))
    add(g, values.ravel(), of=of)
    return g


def rectilinear(values=VALUES, of="point"):
    g = vtkCommonDataModel.vtkRectilinearGrid()
    g.SetDimensions(*SIZE)
    for name, axis in zip("XYZ", AXES):
        getattr(g, f"Set{name}Coordinates")(numpy_support.numpy_to_vtk(axis, deep=1))
    add(g, values.ravel(), of=of)
    return g


def axes_of(spacing):
    return [np.arange(n) * s for n, s in zip(SIZE, spacing)]


def trilinear(axes, values=VALUES):
    def field(p):
        index, share = [], []
        for a in range(3):
            i = np.clip(np.searchsorted(axes[a], p[..., a], side="right") - 1, 0, len(axes[a]) - 2)
            index.append(i)
            share.append((p[..., a] - axes[a][i]) / (axes[a][i + 1] - axes[a][i]))
        total = 0
        for c in range(8):
            b = [c >> a & 1 for a in range(3)]
            weight = np.prod([w if on else 1 - w for w, on in zip(share, b)], axis=0)
            total = total + weight * values[index[2] + b[2], index[1] + b[1], index[0] + b[0]]
        return total

    return field


def nearest(axes, values=VALUES):
    at = lambda axis, x: np.searchsorted((axis[1:] + axis[:-1]) / 2, x)
    return lambda p: values[at(axes[2], p[..., 2]), at(axes[1], p[..., 1]), at(axes[0], p[..., 0])]


def in_cells(axes, values):
    at = lambda axis, x: np.clip(np.searchsorted(axis, x, side="right") - 1, 0, len(axis) - 2)
    return lambda p: values[at(axes[2], p[..., 2]), at(axes[1], p[..., 1]), at(axes[0], p[..., 0])]


def cropped(field, planes, flags, own=lambda p: p):
    """The field in some regions, and elsewhere what is not seen."""
    low, high = np.array(planes[::2]), np.array(planes[1::2])

    def at(p):
        q = own(p)
        bit = ((q > low).astype(int) + (q > high)) @ [1, 3, 9]
        return np.where(np.right_shift(flags, bit) & 1, field(p), 0.0)

    return at


def expect(v, axes, field, linear=True, near=1.5, **settings):
    if linear:
        v.GetProperty().SetInterpolationTypeToLinear()
    w, r = scene(v, size=WINDOW, position=(2.4, -2.1, 3.0))
    box = {"low": [a[0] for a in axes], "high": [a[-1] for a in axes]}
    expected = truth(r, WINDOW, **box, field=field, **{**LOOK, **settings})
    check(pixels(w), expected, near=near)
    return w, r


def test_images():
    spacing = (0.3, 0.5, 0.25)
    axes = axes_of(spacing)
    expect(volume(image(), LOW, RAMP, 0.5), axes, trilinear(axes))
    # The convention follows the input unless it is set.
    v = volume(image(), LOW, RAMP, 0.5)
    v.GetMapper().SetOpacityConventionToExtinction()
    expect(v, axes, trilinear(axes), slab=False)
    v = volume(image(), LOW, RAMP, 0.5)
    v.GetMapper().SetBlendModeToMaximumIntensity()
    # The largest of some values is below the largest of all.
    expect(v, axes, trilinear(axes), maximum=True, steps=6000)


def test_nearest_is_the_default_of_images():
    axes = axes_of((0.3, 0.5, 0.25))
    expect(volume(image(), LOW, RAMP, 0.5), axes, nearest(axes), linear=False)
    expect(volume(rectilinear(), LOW, RAMP, 0.5), AXES, nearest(AXES), linear=False)


def test_cells_of_grids():
    values = np.random.default_rng(7).uniform(0, 1, [n - 1 for n in SIZE[::-1]])
    axes = axes_of((0.3, 0.5, 0.25))
    expect(volume(image(values, of="cell"), LOW, RAMP, 0.5), axes, in_cells(axes, values), linear=False)
    expect(volume(rectilinear(values, of="cell"), LOW, RAMP, 0.5), AXES, in_cells(AXES, values))


def test_rectilinear_grids():
    expect(volume(rectilinear(), LOW, RAMP, 0.5), AXES, trilinear(AXES))


def test_placement():
    m = np.array([[0.8, -0.5, 0, 0.3], [0.5, 0.8, 0.1, -0.2], [0, 0.2, -1.1, 1.0], [0, 0, 0, 1]])
    v = volume(rectilinear(), LOW, RAMP, 0.5)
    v.SetUserMatrix(transform(m))
    w, r = expect(v, AXES, trilinear(AXES), matrix=m)
    moved = np.array([[1, 0, 0, 0.2], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    v.SetUserMatrix(transform(moved))
    box = {"low": [a[0] for a in AXES], "high": [a[-1] for a in AXES]}
    check(pixels(w), truth(r, WINDOW, **box, field=trilinear(AXES), matrix=moved, **LOOK))


def test_directions():
    spacing, turn = (0.3, 0.5, 0.25), np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1.0]])
    g = image(extent=(0, 0, 0))
    g.SetDirectionMatrix(*turn.ravel())
    matrix = np.eye(4)
    matrix[:3, :3] = turn
    axes = axes_of(spacing)
    expect(volume(g, LOW, RAMP, 0.5), axes, trilinear(axes), matrix=matrix)


def test_cropping_regions():
    """The five kinds that VTK has names for, and any other, on images and rectilinear grids."""
    kinds = {
        "SubVolume": 0x2000,
        "Fence": 0x2EBFEBA,
        "InvertedFence": 0x5140145,
        "Cross": 0x417410,
        "InvertedCross": 0x7BE8BEF,
    }
    near = axes_of((0.3, 0.5, 0.25))
    for i, (kind, flags) in enumerate(kinds.items()):
        grid, axes = (image(), near) if i % 2 else (rectilinear(), AXES)
        planes = [a[0] + (a[-1] - a[0]) * share for a in axes for share in (0.27, 0.71)]
        v = volume(grid, LOW, RAMP, 0.5)
        mapper = v.GetMapper()
        mapper.CroppingOn()
        mapper.SetCroppingRegionPlanes(*planes)
        getattr(mapper, f"SetCroppingRegionFlagsTo{kind}")()
        assert mapper.GetCroppingRegionFlags() == flags
        expect(v, axes, cropped(trilinear(axes), planes, flags), steps=3000)
        mapper.SetCroppingRegionFlags(0x1B6CA53)
        expect(v, axes, cropped(trilinear(axes), planes, 0x1B6CA53), steps=3000)
        mapper.CroppingOff()
        expect(v, axes, trilinear(axes))


def test_cropping_of_maxima_placed_volumes_and_meshes():
    planes = [a[0] + (a[-1] - a[0]) * share for a in AXES for share in (0.3, 0.6)]

    def crop(mapper, planes):
        mapper.CroppingOn()
        mapper.SetCroppingRegionPlanes(*planes)
        mapper.SetCroppingRegionFlagsToFence()

    v = volume(rectilinear(), LOW, RAMP, 0.5)
    crop(v.GetMapper(), planes)
    v.GetMapper().SetBlendModeToMaximumIntensity()
    expect(v, AXES, cropped(trilinear(AXES), planes, 0x2EBFEBA), maximum=True, steps=6000)
    # Planes move with the volume.
    m = np.array([[0.8, -0.5, 0, 0.3], [0.5, 0.8, 0.1, -0.2], [0, 0.2, -1.1, 1.0], [0, 0, 0, 1]])
    v = volume(rectilinear(), LOW, RAMP, 0.5)
    crop(v.GetMapper(), planes)
    v.SetUserMatrix(transform(m))
    expect(v, AXES, cropped(trilinear(AXES), planes, 0x2EBFEBA), matrix=m, steps=3000)
    # A mesh of cells, whose planes are in its points' coordinates.
    g, shear, linear = sheared()
    planes = [0.4, 0.9, 0.3, 0.8, 0.2, 0.7]
    v = volume(g, LOW, RAMP, 0.5)
    crop(v.GetMapper(), planes)
    w, r = scene(v, size=WINDOW, position=(2.4, -2.1, 3.0))
    field = cropped(linear, planes, 0x2EBFEBA, own=lambda p: p @ shear[:3, :3].T)
    check(pixels(w), truth(r, WINDOW, field=field, opacity=LOW, color=RAMP, unit=0.5, matrix=shear, steps=3000))


def sheared():
    """A sheared box of hexahedra with a linear field, which is the same whatever the split."""
    g = vtkCommonDataModel.vtkStructuredGrid()
    g.SetDimensions(*SIZE)
    z, y, x = np.meshgrid(*(np.linspace(0, 1, n) for n in SIZE[::-1]), indexing="ij")
    points = np.stack([x, y, z], -1).reshape(-1, 3)
    shear = np.array([[1, 0.3, 0, 0], [0, 1, 0.2, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    p = vtkCommonCore.vtkPoints()
    p.SetData(numpy_support.numpy_to_vtk(points @ shear[:3, :3].T, deep=1))
    g.SetPoints(p)
    add(g, points @ [0.5, 0.2, 0.3])
    return g, shear, lambda p: p @ [0.5, 0.2, 0.3]


def test_light_and_second_variables_of_grids():
    """A linear field has the same gradient in a grid and in a mesh of its cells, whatever finds it."""
    linear = lambda p: 0.1 + p @ [0.4, 0.1, 0.25]
    axes = axes_of((0.3, 0.5, 0.25))
    z, y, x = np.meshgrid(*axes[::-1], indexing="ij")
    points = np.stack([x, y, z], -1)
    mesh = vtkCommonDataModel.vtkStructuredGrid()
    mesh.SetDimensions(*SIZE)
    p = vtkCommonCore.vtkPoints()
    p.SetData(numpy_support.numpy_to_vtk(points.reshape(-1, 3), deep=1))
    mesh.SetPoints(p)
    add(mesh, linear(points).ravel())
    pictures = []
    for g in (image(linear(points)), mesh):
        v = volume(g, LOW, RAMP, 0.5)
        v.GetMapper().SetOpacityConventionToOpacity()
        errors = Errors(v.GetMapper())
        look_of = v.GetProperty()
        look_of.SetInterpolationTypeToLinear()
        look_of.ShadeOn()
        look_of.SetAmbient(0.1)
        look_of.SetDiffuse(0.6)
        look_of.SetSpecular(0.4)
        look_of.SetSpecularPower(7)
        factor = vtkCommonDataModel.vtkPiecewiseFunction()
        for at, h in ((0.0, 0.0), (0.3, 0.2), (0.7, 1.0)):
            factor.AddPoint(at, h)
        look_of.SetGradientOpacity(factor)
        w, _ = scene(v, size=WINDOW, position=(2.4, -2.1, 3.0))
        pictures.append(pixels(w))
        assert len(errors) == 0
    assert pictures[0].max() > 40
    check(pictures[0], pictures[1])


def test_reconstructions_by_tables():
    """Parabolas with and without a table show about the same, and about the field."""
    axes = axes_of((0.3, 0.5, 0.25))
    v = volume(image(), LOW, RAMP, 0.5)
    v.GetProperty().SetInterpolationTypeToLinear()
    errors = messages(v.GetMapper())
    w, _ = scene(v, size=WINDOW, position=(2.4, -2.1, 3.0))
    exact, pictures = pixels(w), []
    m = v.GetMapper()
    m.SetReconstructionToParabolas()
    for form, step in ((m.EXACT, 0), (m.SECOND_ORDER_POLYNOMIAL, 0), (m.EXACT, 0.05), (m.SECOND_ORDER, 0.05)):
        m.SetIntegral(form)
        v.GetMapper().SetSampleDistance(step)
        pictures.append(pixels(w))
    assert len(errors) == 0
    assert np.abs(pictures[0] - exact).max() > 0
    check(pictures[1], pictures[0], near=6)
    for plain in pictures[::2]:
        check(plain, exact, near=8)
    # The table of one length ends before the last slab, which shows where rays are short.
    assert np.abs(pictures[3].astype(int) - pictures[2]).mean() < 3
    m.SetIntegralToVolume()
    pixels(w)
    assert len(errors) == 1 and "second-order" in errors[0]


def test_structured_grids():
    g, shear, linear = sheared()
    w, r = scene(volume(g, LOW, RAMP, 0.5), size=WINDOW, position=(2.4, -2.1, 3.0))
    check(pixels(w), truth(r, WINDOW, field=linear, opacity=LOW, color=RAMP, unit=0.5, matrix=shear))


def test_hidden_cells():
    g = rectilinear()
    marks = np.zeros([n - 1 for n in SIZE[::-1]], np.uint8)
    marks[:, 0, :] = 32
    a = numpy_support.numpy_to_vtk(marks.ravel(), deep=1)
    a.SetName("vtkGhostType")
    g.GetCellData().AddArray(a)
    cut = [AXES[0], AXES[1][1:], AXES[2]]
    expect(volume(g, LOW, RAMP, 0.5), cut, trilinear(AXES))


def test_a_mapper_takes_one_kind_after_the_other():
    axes = axes_of((0.3, 0.5, 0.25))
    v = volume(rectilinear(), LOW, RAMP, 0.5)
    errors = Errors(v.GetMapper())
    expect(v, AXES, trilinear(AXES))
    v.GetMapper().SetInputData(image())
    expect(v, axes, trilinear(axes))
    values = v.GetMapper().GetInputDataObject(0, 0).GetPointData().GetScalars()
    for i in range(values.GetNumberOfTuples()):
        values.SetValue(i, 1 - values.GetValue(i))
    values.Modified()
    expect(v, axes, trilinear(axes, 1 - VALUES))
    assert len(errors) == 0


def blocks():
    """The rectilinear grid in four, of which one lacks its array in a block of its own, and an empty one."""
    whole = vtkCommonDataModel.vtkMultiBlockDataSet()
    for x in (slice(0, 2), slice(1, 4)):
        for z in (slice(0, 3), slice(2, 5)):
            g = vtkCommonDataModel.vtkRectilinearGrid()
            kept = [x, slice(0, 3), z]
            g.SetDimensions(*(len(AXES[a][kept[a]]) for a in range(3)))
            for name, axis, part in zip("XYZ", AXES, kept):
                getattr(g, f"Set{name}Coordinates")(numpy_support.numpy_to_vtk(axis[part].copy(), deep=1))
            add(g, VALUES[z, :, x].ravel())
            whole.SetBlock(whole.GetNumberOfBlocks(), g)
    bare = image()
    bare.GetPointData().Initialize()
    bare.SetOrigin(5, 5, 5)
    for other in (bare, vtkCommonDataModel.vtkImageData()):
        whole.SetBlock(whole.GetNumberOfBlocks(), other)
    return whole


def test_several_grids_of_one_input():
    m = np.array([[0.8, -0.5, 0, 0.3], [0.5, 0.8, 0.1, -0.2], [0, 0.2, -1.1, 1.0], [0, 0, 0, 1]])
    for matrix in (np.eye(4), m):
        v = volume(rectilinear(), LOW, RAMP, 0.5)
        v.GetMapper().SetInputDataObject(blocks())
        errors = messages(v.GetMapper())
        v.SetUserMatrix(transform(matrix))
        w, r = expect(v, AXES, trilinear(AXES), matrix=matrix)
        assert not errors and v.GetMapper().GetNumberOfFrames() == 4
        pixels(w)
        assert v.GetMapper().GetNumberOfFrames() == 4, "a still picture"
        for angle in (100, 80):
            r.GetActiveCamera().Azimuth(angle)
            r.GetActiveCamera().SetParallelProjection(angle == 80)
            r.ResetCameraClippingRange()
            box = {"low": [a[0] for a in AXES], "high": [a[-1] for a in AXES]}
            check(pixels(w), truth(r, WINDOW, **box, field=trilinear(AXES), matrix=matrix, **LOOK), what=f"from {angle}")
    bounds = np.reshape(v.GetMapper().GetBounds(), (3, 2))
    assert np.allclose(bounds[:, 0], [a[0] for a in AXES]) and bounds[0, 1] > 5, "all blocks"
    v.GetMapper().SetBlendModeToMaximumIntensity()
    pixels(w)
    assert len(errors) == 1 and "maximum" in errors[0]
    # One grid again.
    v.GetMapper().SetBlendModeToComposite()
    v.GetMapper().SetInputData(rectilinear())
    check(pixels(w), truth(r, WINDOW, **box, field=trilinear(AXES), matrix=m, **LOOK))


def test_volumes_of_images_keep_working():
    """A volume that was made for VTK's own mapper of images shows about the same with this one."""
    axes = axes_of((0.3, 0.5, 0.25))
    v = volume(image(), LOW, RAMP, 0.5)
    v.GetProperty().SetInterpolationTypeToLinear()
    ours = v.GetMapper()
    theirs = vtkRenderingVolumeOpenGL2.vtkOpenGLGPUVolumeRayCastMapper()
    theirs.SetInputData(ours.GetInputDataObject(0, 0))
    theirs.SetSampleDistance(0.01)
    theirs.AutoAdjustSampleDistancesOff()
    pictures = []
    for mapper in (theirs, ours):
        v.SetMapper(mapper)
        w = window(WINDOW)
        look(renderer(w, v), position=(2.4, -2.1, 3.0))
        pictures.append(pixels(w))
    assert pictures[1].max() > 60
    apart = np.abs(pictures[0] - pictures[1])
    assert np.percentile(apart, 99) < 12 and apart.mean() < 3, (np.percentile(apart, 99), apart.mean())


if __name__ == "__main__":
    main(globals())
