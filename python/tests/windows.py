# SPDX-License-Identifier: MIT OR Apache-2.0
"""What tests in VTK share: a box in windows, and the truth for it."""
import numpy as np
from vtkmodules import vtkCommonCore, vtkCommonDataModel, vtkFiltersSources, vtkRenderingCore
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy

from conftest import lattice

SIZE = (120, 90)
NEAR = 1.1


def grid(values=None, size=2):
    points, cells, offsets, types = lattice(size)
    g = vtkCommonDataModel.vtkUnstructuredGrid()
    p = vtkCommonCore.vtkPoints()
    p.SetData(numpy_to_vtk(points, deep=1))
    g.SetPoints(p)
    g.Allocate(len(types))
    for c, kind in enumerate(types):
        g.InsertNextCell(int(kind), 8, [int(i) for i in cells[8 * c:8 * c + 8]])
    a = numpy_to_vtk(np.ones(len(points)) if values is None else values, deep=1)
    a.SetName("s")
    g.GetPointData().SetScalars(a)
    return g


def cube_of_pressure():
    """The unit cube as one hexahedron."""
    g = grid(size=1)
    vtk_to_numpy(g.GetPoints().GetData())[:] = (lattice(1)[0] + 1) / 2
    g.GetPoints().Modified()
    g.GetPointData().GetScalars().SetName("pressure")
    return g


def window(*renderers, samples=0, size=SIZE):
    w = vtkRenderingCore.vtkRenderWindow()
    w.SetOffScreenRendering(1)
    w.SetMultiSamples(samples)
    w.SetAlphaBitPlanes(1)
    w.SetSize(*size)
    for r in renderers:
        w.AddRenderer(r)
    return w


def renderer(background=(0, 0, 0), viewport=(0, 0, 1, 1)):
    r = vtkRenderingCore.vtkRenderer()
    r.SetBackground(*background)
    r.SetViewport(*viewport)
    c = r.GetActiveCamera()
    c.SetPosition(3, -2.5, 2)
    c.SetViewUp(0, 0, 1)
    return r


def plane(distance, color=(0.2, 0.4, 0.8)):
    """An opaque square that looks at the camera, so far from the origin towards it."""
    s = vtkFiltersSources.vtkPlaneSource()
    s.SetOrigin(-9, -9, 0)
    s.SetPoint1(9, -9, 0)
    s.SetPoint2(-9, 9, 0)
    n = np.array([3, -2.5, 2]) / np.linalg.norm([3, -2.5, 2])
    s.SetNormal(*n)
    s.SetCenter(*(n * distance))
    m = vtkRenderingCore.vtkPolyDataMapper()
    m.SetInputConnection(s.GetOutputPort())
    a = vtkRenderingCore.vtkActor()
    a.SetMapper(m)
    a.GetProperty().LightingOff()
    a.GetProperty().SetColor(*color)
    return a


def pixels(w, render=True):
    if render:
        w.Render()
    out = vtkCommonCore.vtkUnsignedCharArray()
    width, height = w.GetSize()
    w.GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, out)
    return vtk_to_numpy(out).reshape(height, width, 4)[::-1].astype(float)


def to_clip(r):
    rows = lambda m: np.array([[m.GetElement(i, j) for j in range(4)] for i in range(4)])
    c = r.GetActiveCamera()
    return rows(c.GetProjectionTransformMatrix(r.GetTiledAspectRatio(), -1, 1)) @ rows(c.GetModelViewTransformMatrix())


def over(front, back):
    return 255 * (front[..., :3] + (1 - front[..., 3:]) * np.asarray(back))


def depth_of(r, distance):
    """The window depth of :func:`plane`."""
    n = np.array([3, -2.5, 2]) / np.linalg.norm([3, -2.5, 2])
    p = to_clip(r) @ np.append(n * distance, 1)
    return 0.5 + 0.5 * p[2] / p[3]
