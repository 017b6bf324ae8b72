# SPDX-License-Identifier: MIT OR Apache-2.0
"""Pictures of meshes with nothing said, and files of pictures."""
from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _halite
from ._mesh import _given, as_mesh, read
from ._renderer import Renderer
from ._transfer import TransferFunction
from ._view import View

Background = Union[Sequence[float], npt.NDArray[Any], None]


class Picture:
    """A picture, which notebooks show.

    Parameters
    ----------
    pixels : float32 array of shape (height, width, 4)
        Linear premultiplied red, green, blue and opacity; row 0 is uppermost.
    background : three floats, or array of shape (height, width, 3), or None
        What is behind it in files of 8 bits, in [0, 1]; None leaves an alpha channel.

    Attributes
    ----------
    pixels, background
        As given.

    Examples
    --------
    >>> picture = halite.Picture(np.zeros((2, 3, 4), np.float32), (1, 1, 1))
    >>> picture
    <halite.Picture: 3 x 2 pixels>
    """

    def __init__(self, pixels: npt.ArrayLike, background: Background = (0.11, 0.12, 0.14)) -> None:
        self.pixels = np.ascontiguousarray(pixels, np.float32)
        self.background = background

    def _repr_png_(self) -> bytes:
        return _encoded(self.pixels, self.background, None)

    def __repr__(self) -> str:
        return f"<halite.Picture: {self.pixels.shape[1]} x {self.pixels.shape[0]} pixels>"

    def save(self, path: Union[str, os.PathLike[str]]) -> None:
        """Write it to a .png over the background, or to .exr or .npy.

        Parameters
        ----------
        path : path-like
            The file.

        Raises
        ------
        OSError
            If it cannot be written.
        Error
            If the name ends otherwise.

        Examples
        --------
        >>> halite.Picture(np.zeros((2, 3, 4))).save("nothing.png")
        """
        write(path, self.pixels, background=self.background)


def _encoded(pixels: npt.ArrayLike, background: Background, path: Optional[str]) -> bytes:
    picture = np.ascontiguousarray(pixels, np.float32)
    if picture.ndim != 3:
        raise _halite.Error(f"a picture has the shape (height, width, 4), and not {picture.shape}")
    behind = None if background is None else np.ascontiguousarray(background, np.float32)
    if behind is None or behind.ndim == 3:
        return _halite.encode(picture, None, behind, path)
    return _halite.encode(picture, behind.tolist(), None, path)


def write(path: Union[str, os.PathLike[str]], picture: npt.ArrayLike, *, background: Background = None) -> None:
    """Write a picture to a file.

    Parameters
    ----------
    path : path-like
        Its ending says what it is: .png has 8 bits, .exr and .npy hold the floats themselves.
    picture : array of shape (height, width, 4)
        As of :meth:`Renderer.render`.
    background : three floats, or array of shape (height, width, 3), optional
        What a .png shows behind it, in [0, 1]; an alpha channel by default.

    Raises
    ------
    OSError
        If the file cannot be written.
    Error
        If a shape does not fit, or the name ends otherwise.

    Examples
    --------
    >>> halite.write("red.png", np.full((4, 4, 4), [0.5, 0, 0, 0.5]), background=(1, 1, 1))
    """
    _encoded(picture, background, os.fspath(path))


def show(mesh: Any, scalars: Optional[str] = None, *, size: Sequence[int] = (1024, 768), view: Optional[View] = None,
         background: Background = (0.11, 0.12, 0.14), **options: Any) -> Picture:
    """Draw a mesh, with array, colours, opacities and view chosen so that something is seen.

    The program ``halite render MESH`` chooses likewise.

    Parameters
    ----------
    mesh : Mesh, path-like, or a grid of VTK or PyVista
        What to draw.
    scalars : str, optional
        The array.
    size : (width, height)
        Of the picture, in pixels.
    view : View, optional
        From where, in the place of what is chosen; its size holds.
    background : three floats, or None
        Of the picture, in [0, 1].
    **options
        As of :class:`Renderer`, `transfer` among them.

    Returns
    -------
    Picture
        Which a notebook shows.

    Raises
    ------
    OSError
        If the file cannot be read.
    Error
        If there is nothing to draw, or no such array.

    Examples
    --------
    >>> halite.show("tetrahedron.vtu", size=(160, 120))
    <halite.Picture: 160 x 120 pixels>
    """
    if isinstance(mesh, (str, os.PathLike)):
        mesh = read(mesh)
    mesh = as_mesh(mesh)
    wanted = None if scalars is None else mesh._find(scalars, options.get("association"))
    name, of_cells, core, transfer = _halite.automatic(mesh._core, *_given(mesh._data), wanted, [int(n) for n in size])
    if options.get("transfer") is None:
        options["transfer"] = TransferFunction._of(transfer)
    options["association"] = "cell" if of_cells else "point"
    return Picture(Renderer(mesh, name, **options).render(view or View._of(core)), background)
