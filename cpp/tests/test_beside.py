# SPDX-License-Identifier: MIT OR Apache-2.0
"""A scene as tetrahedra beside the same scene as an image, drawn by VTK's own mapper of images on the graphics device at steps of half a
voxel: they show the same, light and gradient opacity included."""
import numpy as np
from vtkmodules import vtkCommonDataModel, vtkFiltersGeneral, vtkRenderingVolumeOpenGL2
from vtkmodules.util import numpy_support
from vtkmodules.vtkCommonCore import vtkVersion

from scene import look, main, messages, opacities, pixels, renderer, volume, window

SIZE = (160, 160)
# Voxels along each axis.
N = 64
# Pixels from the outline of what is seen.
ASIDE = 3
# Differences of bytes, of 255.
NEAR = 2


def field(p):
    """What is linear nowhere, and below 0.1 at the faces of the box, where VTK's differences are one-sided."""
    x, y, z = np.moveaxis(np.asarray(p) - 0.5, -1, 0)
    return 1 - 3.7 * (x ** 2 + 1.3 * y ** 2 + 1.1 * z ** 2) + 0.2 * x * y


COLORS = [(0, 0.1, 0.3, 1), (0.5, 0.9, 0.9, 0.2), (1, 1, 0.2, 0.1)]
OPACITIES = [(0, 0.0), (0.1, 0.0), (0.5, 0.3), (0.8, 0.1), (1, 0.4)]


def voxels():
    axis = np.linspace(0, 1, N + 1)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    image = vtkCommonDataModel.vtkImageData()
    image.SetDimensions(N + 1, N + 1, N + 1)
    image.SetSpacing(*[1 / N] * 3)
    values = field(np.stack([x, y, z], -1)).astype(np.float32).ravel()
    array = numpy_support.numpy_to_vtk(values, deep=1)
    array.SetName("s")
    image.GetPointData().SetScalars(array)
    return image


def pictures(change, position):
    """The scene by Halite, as tetrahedra, and by VTK, as an image; what changes is told how long it takes a gradient for 1."""
    image = voxels()
    cut = vtkFiltersGeneral.vtkDataSetTriangleFilter()
    cut.SetInputData(image)
    cut.Update()
    ours = volume(cut.GetOutput(), OPACITIES, COLORS, 0.2, OpacityConvention=1)
    theirs = vtkRenderingVolumeOpenGL2.vtkOpenGLGPUVolumeRayCastMapper()
    theirs.AutoAdjustSampleDistancesOff()
    theirs.SetSampleDistance(0.5 / N)
    theirs.UseJitteringOff()
    both = []
    # VTK counts gradients by voxels.
    for v, unit in ((ours, 1), (volume(image, OPACITIES, COLORS, 0.2, mapper=theirs), 1 / N)):
        p = v.GetProperty()
        p.SetInterpolationTypeToLinear()
        p.SetAmbient(0.2)
        p.SetDiffuse(0.6)
        p.SetSpecular(0.4)
        p.SetSpecularPower(8)
        change(p, unit)
        said = messages(v.GetMapper()) + messages(v.GetMapper(), "WarningEvent")
        w = window(SIZE)
        look(renderer(w, v), position=position)
        both.append(pixels(w)[..., :3])
        assert not said, said
    return both


def compare(change, what):
    for position in ((2.4, -2.1, 3.0), (-1.9, 2.6, 1.4)):
        ours, theirs = pictures(change, position)
        covered = theirs.max(axis=-1) > 0
        inside = covered.copy()
        for _ in range(ASIDE):
            inside[1:-1, 1:-1] &= inside[2:, 1:-1] & inside[:-2, 1:-1] & inside[1:-1, 2:] & inside[1:-1, :-2]
        assert inside.sum() > 2000 and ours[inside].max() > 60, (what, inside.sum(), ours[inside].max(), theirs[inside].max())
        apart = np.abs(ours - theirs)[inside]
        print(f"{what}: {apart.max()} of 255 at most, {apart.mean():.2f} on average")
        assert apart.max() <= NEAR, (what, apart.max(), apart.mean())


def test_functions_of_one_variable():
    compare(lambda p, _: p.ShadeOff(), "one variable")


def test_light():
    def change(p, _):
        p.ShadeOn()
        # Until 9.1 VTK's highlights of a headlight were those of the half vector, and have been of the reflected one since.
        if vtkVersion.GetVTKMajorVersion() * 100 + vtkVersion.GetVTKMinorVersion() < 902:
            p.SetSpecular(0)

    compare(change, "light")


def test_gradient_opacity():
    def change(p, unit):
        p.SetGradientOpacity(opacities([(0, 0.2), (1.5 * unit, 0.4), (3 * unit, 1.0)]))

    compare(change, "gradient opacity")


if __name__ == "__main__":
    main(globals())
