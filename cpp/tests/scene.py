# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the tests in VTK share: windows, volumes, and the boxes of `boxes`."""
import numpy as np
import vtkmodules.vtkInteractionStyle  # noqa: F401
import vtkmodules.vtkRenderingFreeType  # noqa: F401
import vtkmodules.vtkRenderingVolumeOpenGL2  # noqa: F401
from vtkmodules.util import numpy_support
from vtkmodules import vtkCommonCore, vtkCommonDataModel, vtkCommonMath, vtkFiltersSources, vtkRenderingCore

from halite.vtkHalite import vtkHaliteMapper

from boxes import (HEXAHEDRON, NEAR, PYRAMID, QUAD, TETRA, VOXEL, WEDGE, WHITE, add, check, grid, interpolate, lattice,  # noqa: F401
                   rays, rows, save, truth)
from runner import main  # noqa: F401


def colors(knots, space=None):
    f = vtkRenderingCore.vtkColorTransferFunction()
    for s, r, g, b in knots:
        f.AddRGBPoint(s, r, g, b)
    if space:
        getattr(f, "SetColorSpaceTo" + space)()
    return f


def opacities(knots):
    f = vtkCommonDataModel.vtkPiecewiseFunction()
    for s, a in knots:
        f.AddPoint(s, a)
    return f


def volume(g, opacity=((0, 1),), color=WHITE, unit=1.0, mapper=None, **settings):
    m = mapper or vtkHaliteMapper()
    m.SetInputData(g)
    for name, value in settings.items():
        getattr(m, "Set" + name)(value)
    p = vtkRenderingCore.vtkVolumeProperty()
    p.SetColor(color if isinstance(color, vtkCommonCore.vtkObject) else colors(color))
    p.SetScalarOpacity(opacity if isinstance(opacity, vtkCommonCore.vtkObject) else opacities(opacity))
    p.SetScalarOpacityUnitDistance(unit)
    v = vtkRenderingCore.vtkVolume()
    v.SetMapper(m)
    v.SetProperty(p)
    return v


def window(size=(64, 64), samples=0):
    w = vtkRenderingCore.vtkRenderWindow()
    w.SetMultiSamples(samples)
    w.SetAlphaBitPlanes(1)
    w.SetSize(*size)
    return w


def renderer(w, *props, viewport=None, background=(0, 0, 0)):
    r = vtkRenderingCore.vtkRenderer()
    r.SetBackground(*background)
    if viewport:
        r.SetViewport(*viewport)
    w.AddRenderer(r)
    for p in props:
        r.AddViewProp(p)
    return r


def look(r, position=(2.1, -1.7, 2.9), focus=(0.5, 0.5, 0.5), up=(0, 0, 1), angle=30, parallel=None, clip=None):
    c = r.GetActiveCamera()
    c.SetPosition(*position)
    c.SetFocalPoint(*focus)
    c.SetViewUp(*up)
    c.SetViewAngle(angle)
    if parallel:
        c.ParallelProjectionOn()
        c.SetParallelScale(parallel)
    r.ResetCameraClippingRange() if clip is None else c.SetClippingRange(*clip)
    return c


def scene(*props, size=(64, 64), samples=0, **camera):
    w = window(size, samples)
    r = renderer(w, *props)
    look(r, **camera)
    return w, r


def pixels(w, render=True, buffer=0):
    """What a window shows, as (h, w, 4) bytes; row 0 is the lowest."""
    if render:
        w.Render()
    width, height = w.GetSize()
    out = vtkCommonCore.vtkUnsignedCharArray()
    w.GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, out, buffer)
    return numpy_support.vtk_to_numpy(out).reshape(height, width, 4).astype(int)


def transform(m):
    t = vtkCommonMath.vtkMatrix4x4()
    for i in range(4):
        for j in range(4):
            t.SetElement(i, j, m[i][j])
    return t


def plane(z, color=(0, 0, 0), half=50.0):
    """An opaque square at a height, facing up and down."""
    s = vtkFiltersSources.vtkPlaneSource()
    s.SetOrigin(-half, -half, z)
    s.SetPoint1(half, -half, z)
    s.SetPoint2(-half, half, z)
    m = vtkRenderingCore.vtkPolyDataMapper()
    m.SetInputConnection(s.GetOutputPort())
    a = vtkRenderingCore.vtkActor()
    a.SetMapper(m)
    a.GetProperty().SetColor(*color)
    a.GetProperty().LightingOff()
    return a


class Errors:
    """Collects what VTK objects say instead of printing it."""

    def __init__(self, *objects):
        self.said = []
        for o in objects:
            o.AddObserver("ErrorEvent", self.note)
            o.AddObserver("WarningEvent", self.note)

    def note(self, *_):
        self.said.append("")

    def __len__(self):
        return len(self.said)


def messages(mapper, event="ErrorEvent"):
    """What the mapper says is wrong, as it is said; with "WarningEvent", what it warns of."""
    said = []

    def note(_, __, text):
        said.append(text)

    note.CallDataType = vtkCommonCore.VTK_STRING
    mapper.AddObserver(event, note)
    return said
