# SPDX-License-Identifier: MIT OR Apache-2.0
"""Depths from windows of VTK, pictures into them, and exceptions out of them."""
from __future__ import annotations

import contextlib
import sys
import threading
from collections.abc import Iterator
from typing import Any, Optional

import numpy as np
import numpy.typing as npt

from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkFloatArray, vtkWeakReference
from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLFramebufferObject, vtkOpenGLQuadHelper, vtkTextureObject

from ._halite import LateError

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


class Frames:
    """What Python asked of a window that VTK draws in: VTK prints what observers raise, so it is raised when VTK is done."""

    def __init__(self, window: Any) -> None:
        self._window = vtkWeakReference()
        self._window.Set(window)
        self._depth = 0
        self._error: Optional[BaseException] = None
        self._late = LateError()
        self._is_new = False
        self._interactor = vtkWeakReference()
        # After all that others do at the end of a frame.
        window.AddObserver("EndEvent", self._late, -1.0)

    @classmethod
    def of(cls, window: Any) -> Frames:
        """Those of a window, whose `Render` raises from then on."""
        frames = getattr(window, "_halite_frames", None)
        if frames is None:
            frames = window._halite_frames = cls(window)
            window.Render = frames.render
        found: Frames = frames
        return found

    def render(self) -> None:
        """The window's Render, which raises what went wrong in its frame."""
        window: Any = self._window.Get()
        with self.asked():
            type(window).Render(window)

    @contextlib.contextmanager
    def asked(self) -> Iterator[None]:
        """While a user's call draws frames: it raises what went wrong in the first of them that failed, at its end."""
        self._depth += 1
        try:
            yield
        finally:
            self._depth -= 1
            error = self._error
            if not self._depth:
                self._error = None
        if not self._depth and error is not None:
            raise error

    def failed(self, error: BaseException, is_new: bool) -> None:
        """Raises what happened in this frame where Python asked for it; while a user drags it is shown, once if it is the same."""
        if self._depth:
            self._error = self._error or error
        elif threading.current_thread() is threading.main_thread():
            self._late.hold(error)
            self._is_new = is_new
            self._watch_interactor()
        elif is_new:
            _show(error)

    def _watch_interactor(self) -> None:
        window: Any = self._window.Get()
        interactor = window.GetInteractor()
        if interactor is not None and self._interactor.Get() is not interactor:
            self._interactor.Set(interactor)
            interactor.AddObserver("RenderEvent", self._interactor_drew)

    def _interactor_drew(self, *_: Any) -> None:
        """The frame was asked for by nobody who could catch what it raises."""
        error = self._late.take()
        if error is not None and self._is_new:
            _show(error)


def _show(error: BaseException) -> None:
    sys.excepthook(type(error), error, error.__traceback__)


def rows(matrix: Any) -> npt.NDArray[np.float64]:
    """A vtkMatrix4x4."""
    return np.array([[matrix.GetElement(i, j) for j in range(4)] for i in range(4)])


def area(renderer: Any) -> list[int]:
    """Width, height and lower left corner of a renderer, in pixels."""
    numbers = [[0] for _ in range(4)]
    renderer.GetTiledSizeAndOrigin(*numbers)
    return [n[0] for n in numbers]


def depths(window: Any, is_foreign: bool, x: int, y: int, width: int, height: int) -> npt.NDArray[np.float32]:
    """Window depths, row 0 lowest; of the framebuffer that is bound if it is not the window's own."""
    if is_foreign:
        framebuffer: Any = vtkOpenGLFramebufferObject()
        framebuffer.SetContext(window)
        buffer = framebuffer.DownloadDepth((x, x + width - 1, y, y + height - 1), _FLOAT)
        depth = np.empty((height, width), np.float32)
        buffer.Download2D(_FLOAT, depth, (width, height), 1, (0, 0))
        if buffer.GetReferenceCount() > 1:
            buffer.UnRegister(None)
        return depth
    values = vtkFloatArray()
    window.GetZbufferData(x, y, x + width - 1, y + height - 1, values)
    found: npt.NDArray[np.float32] = vtk_to_numpy(values).reshape(height, width).copy()  # type: ignore[no-untyped-call]
    return found


def composite(window: Any, state: Any, picture: npt.NDArray[np.float32], x: int, y: int, width: int, height: int) -> None:
    """Draws a picture over an area of whatever framebuffer is bound, enlarged if it is smaller."""
    texture: Any = vtkTextureObject()
    texture.SetContext(window)
    texture.Create2DFromRaw(picture.shape[1], picture.shape[0], 4, _FLOAT, picture)
    quad: Any = vtkOpenGLQuadHelper(window, _VERTEX, _FRAGMENT, "")
    state.vtkglViewport(x, y, width, height)
    texture.Activate()
    window.GetShaderCache().ReadyShaderProgram(_VERTEX, _FRAGMENT, "").SetUniformi("picture", texture.GetTextureUnit())
    quad.Render()
    texture.Deactivate()
    quad.ReleaseGraphicsResources(window)
    texture.ReleaseGraphicsResources(window)
