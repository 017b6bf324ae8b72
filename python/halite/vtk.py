# SPDX-License-Identifier: MIT OR Apache-2.0
"""Halite's pictures in windows of VTK, of any release from 9.1 on, without compiled VTK code.

>>> from vtkmodules.vtkRenderingCore import vtkRenderer
>>> import halite.vtk
>>> renderer = vtkRenderer()
>>> volume = halite.vtk.add_volume(renderer, grid, "pressure")
>>> renderer.GetVolumes().GetNumberOfItems()
1

A volume whose own mapper draws nothing carries the bounds; when it is its turn, after opaque geometry, the picture is made for the
camera and the depths of that moment and composited. So opaque geometry may stand before, behind and inside.

What it cannot do: translucent geometry goes under the volume; several volumes go over each other in the order in which they were
added to the renderer; VTK's ambient occlusion (SSAO) is refused with an error; exporters leave the volume out, and say nothing; and
windows have 8 bits for each colour. What goes wrong in a frame is raised by the call that asked for it, such as the ``Render`` of a
window or the ``Update`` of a vtkWindowToImageFilter; while a user drags, nobody could catch it, and it goes to ``sys.excepthook``. The
window lives on.
"""
from __future__ import annotations

import time
from typing import Any, Optional

import numpy as np

import vtkmodules.vtkRenderingVolumeOpenGL2  # noqa: F401
from vtkmodules.util import numpy_support
from vtkmodules.vtkCommonCore import vtkCollection, vtkObject, vtkWeakReference
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkPiecewiseFunction
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkVolume
from vtkmodules.vtkRenderingVolume import vtkFixedPointVolumeRayCastMapper

from . import Error, Mesh, Renderer, TransferFunction, View
from ._from_vtk import cell_types
from ._window import Frames, area, composite, depths, rows

__all__ = ["Volume", "add_volume"]

_support: Any = numpy_support

_BLEND, _DEPTH_TEST, _SCISSOR_TEST, _CULL_FACE = 0x0BE2, 0x0B71, 0x0C11, 0x0B44
_ONE, _ONE_MINUS_SRC_ALPHA, _FUNC_ADD = 1, 0x0303, 0x8006
_VIEWPORT, _DRAW_FRAMEBUFFER = 0x0BA2, 0x8CA6
# Frames a second that a window wants while it is dragged, and no still one does.
_DRAGGED = 1.0


def add_volume(renderer: vtkRenderer, grid: Any, scalars: Optional[str] = None, **options: Any) -> Volume:
    """Add a volume to a renderer.

    Parameters
    ----------
    renderer : vtkRenderer
        Of any window that draws by OpenGL.
    grid : grid of VTK or PyVista
        As of :class:`Volume`; followed when it is modified.
    scalars : str, optional
        The array to draw; the active one by default.
    **options
        As of :class:`Volume`.

    Returns
    -------
    Volume
        A vtkVolume: it can be moved, hidden and removed.

    Raises
    ------
    Error
        If the grid or the array cannot be drawn.

    Examples
    --------
    >>> from vtkmodules.vtkRenderingCore import vtkRenderer
    >>> renderer = vtkRenderer()
    >>> volume = halite.vtk.add_volume(renderer, grid, transfer=halite.TransferFunction("magma", (0, 1)))
    >>> renderer.RemoveVolume(volume)
    """
    volume = Volume(grid, scalars, **options)
    volume.add_to(renderer)
    return volume


class Volume(vtkVolume):
    """A vtkVolume that shows a grid by Halite.

    Its matrix, visibility, bounds and clipping planes (of its mapper) are VTK's. Whoever picks gets what lies behind it.

    Parameters
    ----------
    grid : vtkUnstructuredGrid, vtkStructuredGrid, vtkImageData or vtkRectilinearGrid
        Or one of PyVista's classes of them. Values that are written in place are seen after ``Modified()`` of their array: they alone
        are taken again, without the mesh.
    scalars : str, optional
        The array to draw; the active one by default.
    transfer : halite.TransferFunction, optional
        Colours and opacities.
    association : {"point", "cell"}, optional
        Whether the array belongs to points or cells; points are searched first.
    component : int or "all", optional
        As of :class:`halite.Renderer`.
    maximum : bool
        Show the largest value along each ray.
    coarse : int
        So many pixels are one, along each side, while the window is dragged: where it wants more than a frame a second.
    threads, device, engine, integral, reconstruction, sampling, gradient_array
        As of :class:`halite.Renderer`.

    Raises
    ------
    Error
        If the grid or the array cannot be drawn.

    Attributes
    ----------
    grid, scalars, association, component, maximum, coarse
        As given; they may be set.
    error : BaseException or None
        What the last frame failed with.
    seconds : dict
        What the last frame took, in seconds: "read" depths, "draw", "composite".
    frames : int
        How many pictures were drawn. A still frame costs none.

    Examples
    --------
    >>> volume = halite.vtk.Volume(grid, "pressure", transfer=halite.TransferFunction("viridis", (0, 1), opacity=[0, 1]))
    >>> volume.GetBounds()
    (0.0, 1.0, 0.0, 1.0, 0.0, 1.0)
    """

    def __init__(self, grid: Any, scalars: Optional[str] = None, *, transfer: Optional[TransferFunction] = None,
                 association: Optional[str] = None, component: Any = None, maximum: bool = False, coarse: int = 2, threads: int = 0,
                 device: str = "auto", engine: str = "auto", integral: Any = None, reconstruction: Optional[str] = None,
                 sampling: Optional[float] = None, gradient_array: Optional[str] = None) -> None:
        if not hasattr(grid, "IsA"):
            raise Error(f"a grid of VTK is meant, and not a {type(grid).__name__}: readers of VTK give one")
        _let_go()
        self.grid, self.scalars, self.association, self.component = grid, scalars, association, component
        self.maximum, self.coarse, self.frames = maximum, int(coarse), 0
        self.error: Optional[BaseException] = None
        self.seconds: dict[str, float] = {}
        self._transfer, self._second = transfer, gradient_array
        self._options = {"threads": threads, "device": device, "engine": engine, "integral": integral,
                         "reconstruction": reconstruction, "sampling": sampling}
        self._renderer: Any = None
        self._shape: Any = None
        self._values: Any = None
        self._drawn: Any = None
        self._now: Any = None
        self._watched: list[tuple[vtkWeakReference, list[int]]] = []
        self._late = False
        self._image = vtkImageData()
        self._image.SetDimensions(2, 2, 2)
        self._image.AllocateScalars(3, 1)
        self._image.GetPointData().GetScalars().Fill(0)
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
        _observe(mapper, "VolumeMapperRenderStartEvent", self, "_turn")
        self._follow()

    def __repr__(self) -> str:
        return f"<halite.vtk.Volume: {self.scalars or 'the active array'} of {self.mesh!r}>"

    __str__ = __repr__

    @property
    def transfer(self) -> Optional[TransferFunction]:
        """The transfer function; it may be set."""
        return self._transfer

    @transfer.setter
    def transfer(self, transfer: Optional[TransferFunction]) -> None:
        self._transfer, self._drawn = transfer, None
        self._renderer.set_transfer(transfer)

    @property
    def mesh(self) -> Mesh:
        """The mesh that is drawn."""
        mesh: Mesh = self._renderer.mesh
        return mesh

    @property
    def stats(self) -> dict[str, Any]:
        """What the last picture was drawn with and took; see :attr:`halite.Renderer.stats`."""
        stats: dict[str, Any] = self._renderer.stats
        return stats

    def add_to(self, renderer: vtkRenderer) -> None:
        """Add the volume to a renderer of VTK, also once more: the renderer then keeps it until it is removed.

        Parameters
        ----------
        renderer : vtkRenderer
            Another one, or the same after a removal.

        Examples
        --------
        >>> from vtkmodules.vtkRenderingCore import vtkRenderer
        >>> left, right = vtkRenderer(), vtkRenderer()
        >>> volume = halite.vtk.add_volume(left, grid)
        >>> volume.add_to(right)
        """
        self._watch(renderer)
        renderer.AddViewProp(self)

    def _follow(self) -> None:
        """Brings what changed of the grid, its array and the matrix to the renderer."""
        grid = self.grid
        parts = [grid.GetPoints() if hasattr(grid, "GetPoints") else None]
        if grid.IsA("vtkUnstructuredGrid"):
            parts += [grid.GetCells(), cell_types(grid)]
        matrix = rows(self.GetMatrix())
        placed = tuple(matrix.ravel())
        shape = (id(grid), tuple(p.GetMTime() for p in parts if p is not None and hasattr(p, "GetMTime")), placed,
                 grid.GetNumberOfPoints(), grid.GetNumberOfCells(), _frame_of(grid))
        values = self._array()
        stamp = (None if values is None else (values.__this__, values.GetMTime()), self.scalars, self.association, self.component)
        if shape == self._shape and stamp == self._values:
            return
        what = {"association": self.association, "component": self.component, "gradient_array": self._second}
        kept, self._shape = self._shape, None
        if shape == kept and values is not None:
            what["association"] = "cell" if self._of_cells else "point"
            self._renderer.set_scalars(_support.vtk_to_numpy(values), **what)
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

    def _array(self) -> Any:
        """The array of the grid that is drawn."""
        kinds = [("point", self.grid.GetPointData()), ("cell", self.grid.GetCellData())]
        for kind, data in kinds:
            if self.association in (None, kind):
                found = data.GetArray(self.scalars) if self.scalars else data.GetScalars()
                if found is not None:
                    self._of_cells = kind == "cell"
                    return found
        return None

    def _leave(self, renderer: Any) -> None:
        """Lets go of a renderer that the volume was removed from, and of those that are gone."""
        kept = []
        for watched, observers in self._watched:
            if watched.Get() is renderer:
                for observer in observers:
                    renderer.RemoveObserver(observer)
            elif watched.Get() is not None:
                kept.append((watched, observers))
        self._watched = kept

    def _watch(self, renderer: Any) -> None:
        if not any(watched.Get() is renderer for watched, _ in self._watched):
            observers = [_observe(renderer, event, self, name) for event, name in (("StartEvent", "_start"), ("EndEvent", "_end"))]
            self._watched.append((_weak(renderer), observers))
        if renderer.GetRenderWindow() is not None:
            Frames.of(renderer.GetRenderWindow())

    def _start(self, renderer: Any, _: str) -> None:
        if not renderer.HasViewProp(self):
            self._leave(renderer)
            return
        _let_go()
        self._now = renderer
        Frames.of(renderer.GetRenderWindow())
        peels = renderer.GetUseDepthPeeling() and renderer.GetUseDepthPeelingForVolumes()
        self._late = bool(peels and self.GetVisibility())
        if self._late:
            # The carrier has nothing that could be peeled: it is drawn over what was.
            self.VisibilityOff()

    def _end(self, renderer: Any, _: str) -> None:
        self._now = None
        if self._late:
            self._late = False
            self.VisibilityOn()
            self._paint(renderer)

    def _renderer_of_now(self) -> Any:
        if self._now is not None:
            return self._now
        all_of: list[Any] = [c for c in (self.GetConsumer(i) for i in range(self.GetNumberOfConsumers())) if isinstance(c, vtkRenderer)]
        for renderer in all_of:
            self._watch(renderer)
        if len(all_of) == 1:
            return all_of[0]
        # The first frame of several viewports.
        for renderer in all_of:
            if renderer.GetRenderWindow() is not None:
                viewport = [0] * 4
                renderer.GetRenderWindow().GetState().vtkglGetIntegerv(_VIEWPORT, viewport)
                width, height, x, y = area(renderer)
                if viewport == [x, y, width, height]:
                    return renderer
        return None

    def _turn(self, *_: Any) -> None:
        renderer = self._renderer_of_now()
        # Whoever picks gets what lies behind.
        if renderer is not None and renderer.GetSelector() is None:
            self._paint(renderer)

    def _paint(self, renderer: Any) -> None:
        before, self.error = self.error, None
        try:
            self._draw(renderer)
        except BaseException as error:
            self.error = error
            Frames.of(renderer.GetRenderWindow()).failed(error, repr(error) != repr(before))

    def _draw(self, renderer: Any) -> None:
        began = time.perf_counter()
        if _is_occluded(renderer):
            raise Error("VTK's ambient occlusion (SSAO) does not know volumes of Halite: disable it (PyVista: disable_ssao)")
        self._follow()
        window: Any = renderer.GetRenderWindow()
        camera = renderer.GetActiveCamera()
        state = window.GetState()
        width, height, x, y = area(renderer)
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
            depth = depths(window, is_foreign, x, y, width, height)
            read = time.perf_counter()
            to_eye = rows(camera.GetModelViewTransformMatrix())
            to_clip = rows(camera.GetProjectionTransformMatrix(renderer.GetTiledAspectRatio(), -1, 1))
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
                composite(window, state, picture, x, y, width, height)
            else:
                window.SetRGBAPixelData(x, y, x + width - 1, y + height - 1, _support.numpy_to_vtk(picture.reshape(-1)), 0, 1)
        finally:
            state.Pop()
        ended = time.perf_counter()
        self.seconds = {"read": read - began, "draw": drawn - read, "composite": ended - drawn}

    def _picture(self, to_eye: Any, to_clip: Any, depth: Any, step: int) -> Any:
        """The picture, row 0 lowest; the last one, if nothing that it depends on changed."""
        height, width = depth.shape
        planes = self.GetMapper().GetClippingPlanes()
        planes = [planes.GetItem(i) for i in range(planes.GetNumberOfItems())] if planes is not None else []
        planes = [(p.GetOrigin(), p.GetNormal()) for p in planes]
        key = (to_eye.tobytes(), to_clip.tobytes(), step, self.maximum, planes)
        if self._drawn is not None and self._drawn[0] == key and np.array_equal(self._drawn[1], depth):
            return self._drawn[2]
        size = (-(-width // step), -(-height // step))
        # Upside down: rows begin at the top there, and at the bottom in windows.
        view = View.from_matrices(to_eye, np.diag([1, -1, 1, 1]) @ to_clip, size, planes=planes)
        depths = depth[step // 2::step, step // 2::step] if step > 1 else depth
        if step > 1:
            pad = ((0, size[1] - depths.shape[0]), (0, size[0] - depths.shape[1]))
            depths = np.pad(depths, pad, mode="edge")
        ends = depths if depths.min() < 1 else None
        picture = self._renderer.render(view, ends, maximum=self.maximum)
        self._drawn = (key, depth, picture)
        self.frames += 1
        return picture


def _weak(thing: Any) -> vtkWeakReference:
    reference = vtkWeakReference()
    reference.Set(thing)
    return reference


def _observe(subject: Any, event: str, volume: Volume, name: str) -> int:
    """Has an event call a method of the volume while there is the volume: nobody is kept alive by being watched.

    VTK keeps what Python has of a volume as long as the volume itself, such as by a renderer.
    """
    reference = _weak(volume)

    def call(*arguments: Any) -> None:
        alive = reference.Get()
        if alive is not None:
            getattr(alive, name)(*arguments)

    observer: int = subject.AddObserver(event, call)
    return observer


def _let_go() -> None:
    """Has VTK let go of what Python had of objects that are deleted: it looks whenever it keeps such things of another one."""
    kept, holder = vtkObject(), vtkCollection()
    holder.AddItem(kept)
    vars(kept)["held"] = True


def _is_occluded(renderer: Any) -> bool:
    """Whether the renderer draws by a pass of ambient occlusion."""
    if renderer.GetUseSSAO():
        return True
    found = renderer.GetPass()
    while found is not None and not found.IsA("vtkSSAOPass"):
        found = found.GetDelegatePass() if hasattr(found, "GetDelegatePass") else None
    return found is not None


def _frame_of(grid: Any) -> Any:
    """Where an image is."""
    if not grid.IsA("vtkImageData"):
        return None
    matrix = grid.GetDirectionMatrix()
    return (grid.GetOrigin(), grid.GetSpacing(), grid.GetExtent(), tuple(matrix.GetElement(i, j) for i in range(3) for j in range(3)))
