# SPDX-License-Identifier: MIT OR Apache-2.0
"""Halite's pictures in windows of VTK, of any release from 9.1 on, without compiled VTK code.

>>> from vtkmodules.vtkRenderingCore import vtkRenderer
>>> import halite.vtk
>>> volume = halite.vtk.add_volume(vtkRenderer(), grid, "pressure")  # doctest: +SKIP

A volume whose own mapper draws nothing carries the bounds; when it is its turn, after opaque geometry, the picture is made for the
camera and the depths of that moment and composited. So opaque geometry may stand before, behind and inside. Translucent geometry
goes under the volume.
"""
import time
import weakref

import numpy as np

import vtkmodules.vtkRenderingVolumeOpenGL2  # noqa: F401
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkFloatArray
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkPiecewiseFunction
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkVolume
from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLFramebufferObject, vtkOpenGLQuadHelper, vtkTextureObject
from vtkmodules.vtkRenderingVolume import vtkFixedPointVolumeRayCastMapper

from . import Mesh, Renderer, View
from ._from_vtk import cell_types

__all__ = ["Volume", "add_volume"]

_BLEND, _DEPTH_TEST, _SCISSOR_TEST, _CULL_FACE = 0x0BE2, 0x0B71, 0x0C11, 0x0B44
_ONE, _ONE_MINUS_SRC_ALPHA, _FUNC_ADD = 1, 0x0303, 0x8006
_VIEWPORT, _DRAW_FRAMEBUFFER = 0x0BA2, 0x8CA6
_FLOAT = 10
_VERTEX = """//VTK::System::Dec
in vec4 ndCoordIn;
in vec2 texCoordIn;
out vec2 texCoord;
void main() { gl_Position = ndCoordIn; texCoord = texCoordIn; }
"""
_FRAGMENT = """//VTK::System::Dec
//VTK::Output::Dec
in vec2 texCoord;
uniform sampler2D picture;
void main() { gl_FragData[0] = texelFetch(picture, ivec2(texCoord * vec2(textureSize(picture, 0))), 0); }
"""
# Frames a second that a window wants while it is dragged, and no still one does.
_DRAGGED = 1.0


def add_volume(renderer, grid, scalars=None, **options):
    """Add a volume to a vtkRenderer.

    Parameters
    ----------
    renderer : vtkRenderer
    grid : grid of VTK or PyVista
        Followed when it is modified.
    scalars : str, optional
        The array to draw; the active one by default.
    **options
        As of :class:`Volume`.

    Returns
    -------
    Volume
        A vtkVolume: it can be moved, hidden and removed.
    """
    volume = Volume(grid, scalars, **options)
    volume.add_to(renderer)
    return volume


class Volume(vtkVolume):
    """A vtkVolume that shows a grid by Halite.

    Parameters
    ----------
    grid : vtkUnstructuredGrid, vtkStructuredGrid, vtkImageData, vtkRectilinearGrid, or PyVista's classes of them
    scalars : str, optional
    transfer : halite.TransferFunction, optional
    association : {"point", "cell"}, optional
    component : int or "all", optional
    maximum : bool
        Show the largest value along each ray.
    coarse : int
        Pixels that are one while the window is dragged.
    threads, device, engine
        As of :class:`halite.Renderer`.

    Attributes
    ----------
    transfer : halite.TransferFunction
        May be set.
    error : Exception or None
        What the last frame failed with. VTK prints exceptions of observers, and goes on.
    seconds : dict
        What the last frame took: "read" depths, "draw", "composite".
    """

    def __init__(self, grid, scalars=None, *, transfer=None, association=None, component=None, maximum=False, coarse=2,
                 threads=0, device="auto", engine="auto"):
        self.grid, self.scalars, self.association, self.component = grid, scalars, association, component
        self.maximum, self.coarse, self.error, self.seconds, self.frames = maximum, int(coarse), None, {}, 0
        self._transfer, self._options = transfer, {"threads": threads, "device": device, "engine": engine}
        self._renderer = self._shape = self._values = self._drawn = None
        self._now, self._watched, self._late = None, {}, set()
        self._image = vtkImageData()
        self._image.SetDimensions(2, 2, 2)
        self._image.AllocateScalars(3, 1)
        vtk_to_numpy(self._image.GetPointData().GetScalars())[:] = 0
        mapper = vtkFixedPointVolumeRayCastMapper()
        mapper.SetInputData(self._image)
        mapper.IntermixIntersectingGeometryOff()
        mapper.AutoAdjustSampleDistancesOff()
        mapper.SetImageSampleDistance(100)
        mapper.SetSampleDistance(1e6)
        mapper.SetInteractiveSampleDistance(1e6)
        mapper.CroppingOn()
        mapper.SetCroppingRegionFlags(0)
        nothing = vtkPiecewiseFunction()
        nothing.AddPoint(0, 0)
        nothing.AddPoint(255, 0)
        self.GetProperty().SetScalarOpacity(nothing)
        self.GetProperty().ShadeOff()
        self.SetMapper(mapper)
        self._turning = None
        self._hold(True)
        self._follow()

    @property
    def transfer(self):
        return self._transfer

    @transfer.setter
    def transfer(self, transfer):
        self._transfer, self._drawn = transfer, None
        self._renderer.set_transfer(transfer)

    @property
    def mesh(self):
        """The halite.Mesh that is drawn."""
        return self._renderer.mesh

    @property
    def stats(self):
        """What the last picture was drawn with and took; see halite.Renderer."""
        return self._renderer.stats

    def add_to(self, renderer):
        """Adds the volume to a renderer of VTK, also once more: the renderer then keeps it until it is removed."""
        self._hold(True)
        self._watch(renderer)
        renderer.AddViewProp(self)

    def _follow(self):
        """Brings what changed of the grid, its array and the matrix to the renderer."""
        grid = self.grid
        parts = [grid.GetPoints() if hasattr(grid, "GetPoints") else None]
        if grid.IsA("vtkUnstructuredGrid"):
            parts += [grid.GetCells(), cell_types(grid)]
        matrix = _rows(self.GetMatrix())
        placed = tuple(matrix.ravel())
        shape = (id(grid), tuple(p.GetMTime() for p in parts if p is not None and hasattr(p, "GetMTime")), placed,
                 grid.GetNumberOfPoints(), grid.GetNumberOfCells(), _frame_of(grid))
        values = self._array()
        stamp = (None if values is None else (values.__this__, values.GetMTime()), self.scalars, self.association, self.component)
        if shape == self._shape and stamp == self._values:
            return
        what = {"association": self.association, "component": self.component}
        if shape == self._shape and values is not None:
            what["association"] = "cell" if self._of_cells else "point"
            self._renderer.set_scalars(vtk_to_numpy(values), **what)
        else:
            mesh = Mesh.from_vtk(grid)
            if self._renderer is None:
                self._renderer = Renderer(mesh, self.scalars, transfer=self._transfer, placement=matrix, **what, **self._options)
            else:
                self._renderer.set_mesh(mesh, self.scalars, placement=matrix, **what)
            low_high = np.reshape(mesh.bounds, (3, 2))
            self._image.SetOrigin(*low_high[:, 0])
            self._image.SetSpacing(*np.maximum(low_high[:, 1] - low_high[:, 0], 1e-30))
            self._image.Modified()
        self._shape, self._values, self._drawn = shape, stamp, None

    def _array(self):
        """The array of the grid that is drawn."""
        kinds = [("point", self.grid.GetPointData()), ("cell", self.grid.GetCellData())]
        for kind, data in kinds:
            if self.association in (None, kind):
                found = data.GetArray(self.scalars) if self.scalars else data.GetScalars()
                if found is not None:
                    self._of_cells = kind == "cell"
                    return found
        return None

    def _hold(self, strongly):
        """Has the mapper say when it is its turn. Strongly, the mapper keeps this object alive, which it belongs to."""
        mapper, turn = self.GetMapper(), self._turn
        if self._turning is not None:
            was, observer = self._turning
            if was == strongly:
                return
            mapper.RemoveObserver(observer)
        if not strongly:
            method = weakref.WeakMethod(self._turn)

            def turn(*event):
                alive = method()
                if alive is not None:
                    alive(*event)

        self._turning = (strongly, mapper.AddObserver("VolumeMapperRenderStartEvent", turn))

    def _leave(self, renderer):
        """Lets go of a renderer that the volume was removed from; of no more use to any, it lives while somebody has it."""
        for observer in self._watched.pop(renderer, ()):
            renderer.RemoveObserver(observer)
        self._late.discard(renderer)
        if not self._watched:
            self._hold(False)

    def _watch(self, renderer):
        if renderer not in self._watched:
            start = renderer.AddObserver("StartEvent", self._start)
            self._watched[renderer] = (start, renderer.AddObserver("EndEvent", self._end))

    def _start(self, renderer, _):
        if not renderer.HasViewProp(self):
            self._leave(renderer)
            return
        self._now = renderer
        peels = renderer.GetUseDepthPeeling() and renderer.GetUseDepthPeelingForVolumes()
        if peels and self.GetVisibility() and renderer.HasViewProp(self):
            # The carrier has nothing that could be peeled: it is drawn over what was.
            self.VisibilityOff()
            self._late.add(renderer)

    def _end(self, renderer, _):
        self._now = None
        if renderer in self._late:
            self._late.discard(renderer)
            self.VisibilityOn()
            self._paint(renderer)

    def _renderer_of_now(self):
        if self._now is not None:
            return self._now
        all_of = [c for c in (self.GetConsumer(i) for i in range(self.GetNumberOfConsumers())) if isinstance(c, vtkRenderer)]
        for renderer in all_of:
            self._watch(renderer)
        if len(all_of) == 1:
            return all_of[0]
        # The first frame of several viewports.
        for renderer in all_of:
            if renderer.GetRenderWindow() is not None:
                viewport = [0] * 4
                renderer.GetRenderWindow().GetState().vtkglGetIntegerv(_VIEWPORT, viewport)
                width, height, x, y = _area(renderer)
                if viewport == [x, y, width, height]:
                    return renderer
        return None

    def _turn(self, *_):
        self._hold(True)
        renderer = self._renderer_of_now()
        # Whoever picks gets what lies behind.
        if renderer is not None and renderer.GetSelector() is None:
            self._paint(renderer)

    def _paint(self, renderer):
        self.error = None
        try:
            self._draw(renderer)
        except Exception as error:
            self.error = error
            raise

    def _draw(self, renderer):
        began = time.perf_counter()
        self._follow()
        window, camera = renderer.GetRenderWindow(), renderer.GetActiveCamera()
        state = window.GetState()
        width, height, x, y = _area(renderer)
        bound = [0]
        state.vtkglGetIntegerv(_DRAW_FRAMEBUFFER, bound)
        is_foreign = bound[0] != window.GetRenderFramebuffer().GetFBOIndex()
        if is_foreign:
            viewport = [0] * 4
            state.vtkglGetIntegerv(_VIEWPORT, viewport)
            x, y, width, height = viewport
        if width <= 0 or height <= 0:
            return
        state.Push()
        try:
            depth = _depths(window, is_foreign, x, y, width, height)
            read = time.perf_counter()
            to_eye = _rows(camera.GetModelViewTransformMatrix())
            to_clip = _rows(camera.GetProjectionTransformMatrix(renderer.GetTiledAspectRatio(), -1, 1))
            step = self.coarse if window.GetDesiredUpdateRate() > _DRAGGED and self.coarse > 1 else 1
            picture = self._picture(to_eye, to_clip, depth, step)
            drawn = time.perf_counter()
            for cap in (_DEPTH_TEST, _SCISSOR_TEST, _CULL_FACE):
                state.vtkglDisable(cap)
            state.vtkglDepthMask(0)
            state.vtkglEnable(_BLEND)
            state.vtkglBlendEquation(_FUNC_ADD)
            state.vtkglBlendFuncSeparate(_ONE, _ONE_MINUS_SRC_ALPHA, _ONE, _ONE_MINUS_SRC_ALPHA)
            if is_foreign or step > 1:
                _composite(window, state, picture, x, y, width, height)
            else:
                window.SetRGBAPixelData(x, y, x + width - 1, y + height - 1, numpy_to_vtk(picture.reshape(-1)), 0, 1)
        finally:
            state.Pop()
        ended = time.perf_counter()
        self.seconds = {"read": read - began, "draw": drawn - read, "composite": ended - drawn}

    def _picture(self, to_eye, to_clip, depth, step):
        """The picture, row 0 lowest; the last one, if nothing that it depends on changed."""
        height, width = depth.shape
        planes = self.GetMapper().GetClippingPlanes()
        planes = [planes.GetItem(i) for i in range(planes.GetNumberOfItems())] if planes is not None else []
        planes = [(p.GetOrigin(), p.GetNormal()) for p in planes]
        key = (to_eye.tobytes(), to_clip.tobytes(), step, self.maximum, planes)
        if self._drawn is not None and self._drawn[0] == key and np.array_equal(self._drawn[1], depth):
            return self._drawn[2]
        size = (-(-width // step), -(-height // step))
        view = View.from_matrices(to_eye, to_clip, size, planes=planes)
        depths = depth[step // 2::step, step // 2::step] if step > 1 else depth
        if step > 1:
            pad = ((0, size[1] - depths.shape[0]), (0, size[0] - depths.shape[1]))
            depths = np.pad(depths, pad, mode="edge")
        ends = np.ascontiguousarray(depths[::-1]) if depths.min() < 1 else None
        picture = np.ascontiguousarray(self._renderer.render(view, ends, maximum=self.maximum)[::-1])
        self._drawn = (key, depth, picture)
        self.frames += 1
        return picture


def _rows(matrix):
    return np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])


def _frame_of(grid):
    """Where an image is."""
    if not grid.IsA("vtkImageData"):
        return None
    matrix = grid.GetDirectionMatrix()
    return (grid.GetOrigin(), grid.GetSpacing(), grid.GetExtent(), tuple(matrix.GetElement(i, j) for i in range(3) for j in range(3)))


def _area(renderer):
    """Width, height and lower left corner of a renderer, in pixels."""
    numbers = [[0] for _ in range(4)]
    renderer.GetTiledSizeAndOrigin(*numbers)
    return [n[0] for n in numbers]


def _depths(window, is_foreign, x, y, width, height):
    """Window depths, row 0 lowest."""
    if is_foreign:
        framebuffer = vtkOpenGLFramebufferObject()
        framebuffer.SetContext(window)
        buffer = framebuffer.DownloadDepth((x, x + width - 1, y, y + height - 1), _FLOAT)
        depth = np.empty((height, width), np.float32)
        buffer.Download2D(_FLOAT, depth, (width, height), 1, (0, 0))
        if buffer.GetReferenceCount() > 1:
            buffer.UnRegister(None)
        return depth
    values = vtkFloatArray()
    window.GetZbufferData(x, y, x + width - 1, y + height - 1, values)
    return vtk_to_numpy(values).reshape(height, width).copy()


def _composite(window, state, picture, x, y, width, height):
    """Draws a picture over an area of whatever framebuffer is bound, enlarged if it is smaller."""
    texture = vtkTextureObject()
    texture.SetContext(window)
    texture.Create2DFromRaw(picture.shape[1], picture.shape[0], 4, _FLOAT, picture)
    quad = vtkOpenGLQuadHelper(window, _VERTEX, _FRAGMENT, "")
    state.vtkglViewport(x, y, width, height)
    texture.Activate()
    window.GetShaderCache().ReadyShaderProgram(_VERTEX, _FRAGMENT, "").SetUniformi("picture", texture.GetTextureUnit())
    quad.Render()
    texture.Deactivate()
    quad.ReleaseGraphicsResources(window)
    texture.ReleaseGraphicsResources(window)
