# SPDX-License-Identifier: MIT OR Apache-2.0
"""Draws a grid made with NumPy, by Halite in VTK.

    python3 numpy_grid.py [PICTURE.png]        without a picture, a window to turn it in
"""
import sys

import numpy as np
import vtkmodules.vtkInteractionStyle  # noqa: F401
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401
from halite.vtkHalite import vtkHaliteMapper
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import VTK_WEDGE, vtkCellArray, vtkPiecewiseFunction, vtkUnstructuredGrid
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingCore import (vtkColorTransferFunction, vtkRenderer, vtkRenderWindow, vtkRenderWindowInteractor,
                                         vtkVolume, vtkVolumeProperty, vtkWindowToImageFilter)

# Layers of triangles around an axis, as wedges: finer near the axis.
rings, around, layers = 12, 48, 24
radius = 0.05 + np.linspace(0, 1, rings + 1) ** 2
angle = 2 * np.pi * np.arange(around) / around
height = np.linspace(-1, 1, layers + 1)
z, r, a = np.meshgrid(height, radius, angle, indexing="ij")
points = np.stack([r * np.cos(a), r * np.sin(a), z], -1).reshape(-1, 3)
swirl = (np.sin(6 * r + 2 * a + 3 * z) * np.exp(-r)).ravel()

k, i, j = np.meshgrid(np.arange(layers), np.arange(rings), np.arange(around), indexing="ij")
point = lambda k, i, j: ((k * (rings + 1) + i) * around + j % around).ravel()
inner, outer, inner2, outer2 = point(k, i, j), point(k, i + 1, j), point(k, i, j + 1), point(k, i + 1, j + 1)
up = (rings + 1) * around
wedges = np.concatenate([np.stack([inner, inner2, outer, inner + up, inner2 + up, outer + up], -1),
                         np.stack([inner2, outer2, outer, inner2 + up, outer2 + up, outer + up], -1)])

grid, vertices, cells = vtkUnstructuredGrid(), vtkPoints(), vtkCellArray()
# VTK refers to NumPy's memory: it must live as long as the grid.
connectivity, offsets = wedges.astype(np.int64).ravel(), np.arange(0, wedges.size + 1, 6)
vertices.SetData(numpy_to_vtk(points))
cells.SetData(numpy_to_vtkIdTypeArray(offsets), numpy_to_vtkIdTypeArray(connectivity))
grid.SetPoints(vertices)
grid.SetCells(VTK_WEDGE, cells)
scalars = numpy_to_vtk(swirl)
scalars.SetName("swirl")
grid.GetPointData().SetScalars(scalars)

color, opacity, prop = vtkColorTransferFunction(), vtkPiecewiseFunction(), vtkVolumeProperty()
color.SetColorSpaceToDiverging()
color.AddRGBPoint(-0.8, 0.23, 0.30, 0.75)
color.AddRGBPoint(0.8, 0.71, 0.02, 0.15)
for s, alpha in ((-0.8, 0.9), (-0.3, 0), (0.25, 0), (0.3, 0.9), (0.35, 0), (0.8, 0.9)):
    opacity.AddPoint(s, alpha)
prop.SetColor(color)
prop.SetScalarOpacity(opacity)
prop.SetScalarOpacityUnitDistance(0.15)

mapper, volume = vtkHaliteMapper(), vtkVolume()
mapper.SetInputData(grid)
volume.SetMapper(mapper)
volume.SetProperty(prop)

renderer, window = vtkRenderer(), vtkRenderWindow()
renderer.SetBackground(1, 1, 1)
renderer.AddVolume(volume)
window.AddRenderer(renderer)
window.SetSize(480, 480)
camera = renderer.GetActiveCamera()
camera.SetPosition(3, -4, 3)
camera.SetViewUp(0, 0, 1)
renderer.ResetCamera()

if len(sys.argv) > 1:
    window.SetOffScreenRendering(1)
    window.Render()
    image, writer = vtkWindowToImageFilter(), vtkPNGWriter()
    image.SetInput(window)
    image.ReadFrontBufferOff()
    writer.SetInputConnection(image.GetOutputPort())
    writer.SetFileName(sys.argv[1])
    writer.Write()
    print(f"{grid.GetNumberOfCells()} wedges in {1000 * mapper.GetCoreTime():.0f} ms on {mapper.GetAdapter()}")
else:
    interactor = vtkRenderWindowInteractor()
    interactor.SetRenderWindow(window)
    window.Render()
    interactor.Start()
