# SPDX-License-Identifier: MIT OR Apache-2.0
"""Drawing."""
from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any, NoReturn, Optional, Union, overload

import numpy as np
import numpy.typing as npt

from . import _halite
from ._mesh import Mesh, as_mesh, native
from ._transfer import TransferFunction, _plain
from ._view import View

Component = Union[int, str, None]
Pixels = npt.NDArray[np.float32]


class Renderer:
    """Draws one mesh, as often as wanted, and keeps what does not change between frames.

    Threads may share a renderer: one draws after another. Other Python code runs while it draws.

    Parameters
    ----------
    mesh : Mesh, or a grid of VTK or PyVista
        What to draw.
    scalars : str or array, optional
        The array to draw, or values as of :meth:`set_scalars`; the mesh's first array by default.
    association : {"point", "cell"}, optional
        Whether it belongs to points or cells; points are searched first.
    component : int or "all", optional
        Of an array of several; without it, the length of the tuples. ``"all"``: two are the values of colour and opacity, four are
        red, green, blue and a value of the opacity.
    transfer : TransferFunction, optional
        The colour map "viridis" over the range of the array, with opacities that rise over it, by default.
    gradient_array : str or array, optional
        The second variable, of points or cells as the first, in the place of the length of its gradient.
    threads : int
        0: one for each core; 4096 at most.
    device : str
        "auto", "cpu", or a GPU by index, UUID or part of its name. Auto is the first real GPU, and the CPU where there is none.
    engine : {"auto", "traverse", "project"}
        How frames are drawn: rays walk from cell to cell, or cells are projected. Pictures are alike.
    integral : str or dict, optional
        The form of the ray integral, as scene files have it: "exact" by default, or a table such as "volume".
    reconstruction : str, optional
        What stands for the field of a regular or rectilinear grid between samples: itself by default ("exact"), parabolas ("2"),
        lines ("1"), or rectangles.
    sampling : float, optional
        With `reconstruction`: how far samples are apart, in world units; at faces of voxels and midway by default.
    projection : dict, optional
        Options of the engine "project" on devices, as scene files have them.
    placement : array of shape (4, 4), optional
        From the mesh's coordinates to the world; affine.

    Raises
    ------
    Error
        If there is no such array, device or engine, or a choice does not fit another.
    MemoryError
        If there is no memory for what drawing takes.

    Examples
    --------
    >>> axis = np.linspace(-1, 1, 9)
    >>> mesh = halite.Mesh.rectilinear(axis, axis, axis, point_data={"s": np.arange(729.0)})
    >>> renderer = halite.Renderer(mesh, "s", transfer=halite.TransferFunction("inferno", (0, 728), unit_distance=2))
    >>> renderer.render(halite.View((3, 2, 4), size=(64, 48))).shape
    (48, 64, 4)
    """

    mesh: Mesh
    """The mesh that is drawn."""

    def __init__(self, mesh: Any, scalars: Union[str, npt.ArrayLike, None] = None, *, association: Optional[str] = None,
                 component: Component = None, transfer: Optional[TransferFunction] = None,
                 gradient_array: Union[str, npt.ArrayLike, None] = None, threads: int = 0, device: str = "auto", engine: str = "auto",
                 integral: Union[str, Mapping[str, Any], None] = None, reconstruction: Optional[str] = None,
                 sampling: Optional[float] = None, projection: Optional[Mapping[str, Any]] = None,
                 placement: Optional[npt.ArrayLike] = None) -> None:
        self._core = _halite.Renderer(threads, device, engine)
        if sampling is not None and reconstruction is None:
            raise _halite.Error('sampling: the exact reconstruction takes no samples; reconstruction="2" does')
        self._core.set_options(None if integral is None else json.dumps(integral, default=_plain), reconstruction or "",
                               float(sampling or 0), None if projection is None else json.dumps(dict(projection)))
        self._transfer = transfer
        self.set_mesh(mesh, scalars, association=association, component=component, gradient_array=gradient_array, placement=placement)

    def set_mesh(self, mesh: Any, scalars: Union[str, npt.ArrayLike, None] = None, *, association: Optional[str] = None,
                 component: Component = None, gradient_array: Union[str, npt.ArrayLike, None] = None,
                 placement: Optional[npt.ArrayLike] = None) -> None:
        """Draw another mesh from now on, with the same transfer function.

        Parameters
        ----------
        mesh : Mesh, or a grid of VTK or PyVista
            What to draw.
        scalars, association, component, gradient_array, placement
            As of the class.

        Raises
        ------
        Error
            If there is no such array, or the placement is not affine.

        Examples
        --------
        >>> renderer = halite.Renderer(halite.Mesh.image((2, 2, 2), point_data={"v": np.arange(8)}))
        >>> renderer.set_mesh(halite.Mesh.image((3, 3, 3), point_data={"w": np.arange(27)}), "w")
        """
        rows = np.eye(4) if placement is None else np.asarray(placement, float)
        if rows.shape != (4, 4):
            raise _halite.Error(f"placement has the shape {rows.shape}, and not (4, 4)")
        mesh = as_mesh(mesh)
        self._core.set_mesh(mesh._core, rows.tolist())
        self.mesh = mesh
        self.set_scalars(scalars, association=association, component=component, gradient_array=gradient_array)

    def set_scalars(self, scalars: Union[str, npt.ArrayLike, None] = None, *, association: Optional[str] = None,
                    component: Component = None, gradient_array: Union[str, npt.ArrayLike, None] = None) -> None:
        """Draw other values from now on, such as the next time step's; the mesh stays as it is.

        Parameters
        ----------
        scalars : str, or array of shape (n,) or (n, k), optional
            An array of the mesh by name, or values of its points or cells. They are read where they are, and what is drawn of them
            is copied.
        association : {"point", "cell"}, optional
            Whether it belongs to points or cells. Values belong to points if there are as many.
        component, gradient_array
            As of the class.

        Raises
        ------
        Error
            If there is no such array, or it has another length than the mesh.

        Examples
        --------
        >>> renderer = halite.Renderer(halite.Mesh.image((2, 2, 2), point_data={"v": np.arange(8)}))
        >>> renderer.set_scalars(np.ones(8))
        """
        if isinstance(component, str) and component != "all" or isinstance(component, int) and component < 0:
            raise _halite.Error(f'component is a number from 0 or "all", and not {component!r}')
        code = -1 if component is None else -2 if isinstance(component, str) else int(component)
        if scalars is None or isinstance(scalars, str):
            name, of_cells = self.mesh._find(scalars, association)
            values = self.mesh._numbers(name, of_cells)
        else:
            name, values = "values", native(scalars)
            of_cells = association == "cell" or (association is None and len(values) != self.mesh.n_points)
        if gradient_array is None:
            second = None
        elif isinstance(gradient_array, str):
            second = (gradient_array, self.mesh._numbers(gradient_array, of_cells))
        else:
            second = ("gradient_array", native(gradient_array))
        low, high = self._core.set_field(self.mesh._core, (name, values), of_cells, code, second)
        self._range = (low, high)
        self.set_transfer(self._transfer)

    def set_transfer(self, transfer: Optional[TransferFunction] = None) -> None:
        """Draw with another transfer function from now on.

        Parameters
        ----------
        transfer : TransferFunction, optional
            Without one, that which the class has by default.

        Examples
        --------
        >>> renderer = halite.Renderer(halite.Mesh.image((2, 2, 2), point_data={"v": np.arange(8)}))
        >>> renderer.set_transfer(halite.TransferFunction("magma", (0, 7), opacity=[0, 0.2, 1]))
        """
        self._transfer = transfer
        if transfer is None:
            low, high = self._range
            transfer = TransferFunction("viridis", (low, high if high > low else low + 1), opacity=[0, 1],
                                        unit_distance=(self.mesh.length or 1.0) / 5)
        self._core.set_transfer(transfer._core)

    @overload
    def render(self, view: View, depth: Optional[npt.ArrayLike] = None, *, depth_kind: str = "window", maximum: bool = False,
               progress: None = None) -> Pixels: ...

    @overload
    def render(self, view: View, depth: Optional[npt.ArrayLike] = None, *, depth_kind: str = "window", maximum: bool = False,
               progress: Optional[Callable[[float], object]] = None) -> Optional[Pixels]: ...

    def render(self, view: View, depth: Optional[npt.ArrayLike] = None, *, depth_kind: str = "window", maximum: bool = False,
               progress: Optional[Callable[[float], object]] = None) -> Optional[Pixels]:
        """Draw a frame.

        Ctrl-C ends it within 0.1 s.

        Parameters
        ----------
        view : View
            From where, and how large.
        depth : array of shape (height, width), optional
            Where rays end; row 0 is uppermost.
        depth_kind : {"window", "eye", "ray"}
            What depths are: OpenGL's window depths in [0, 1], which need a clipping range or matrices; distances along the direction
            of view; or distances along each ray from the eye, or from its plane in parallel views, in world units.
        maximum : bool
            Show the largest value along each ray in the place of the integral.
        progress : callable, optional
            Called with the share that is done, in [0, 1], every 20 ms, in this thread; False ends the frame.

        Returns
        -------
        float32 array of shape (height, width, 4), or None
            Linear premultiplied red, green, blue and opacity; row 0 is uppermost. None if `progress` ended it.

        Raises
        ------
        Error
            If depths do not fit the view, or a device failed.
        MemoryError
            If there is no memory for the picture.

        Warns
        -----
        UserWarning
            Of what is left out, such as cells whose points are not finite.

        Examples
        --------
        >>> renderer = halite.Renderer(halite.Mesh.image((2, 2, 2), point_data={"v": np.ones(8)}))
        >>> view = halite.View((0.5, 0.5, 9), (0.5, 0.5, 0), clipping_range=(1, 20), size=(5, 5))
        >>> float(renderer.render(view, np.zeros((5, 5)))[2, 2, 3])
        0.0
        """
        ends = None if depth is None else np.ascontiguousarray(depth, np.float32)
        core = view._core.of_maxima() if maximum else view._core
        return self._core.render(core, ends, depth_kind, progress)

    @property
    def stats(self) -> dict[str, Union[str, int, float]]:
        """What the last frame was drawn with and took: engine, device, adapter, cells, tetrahedra, and frame_ms in milliseconds."""
        of = dict(self._core.stats)
        return {k: v if k in ("engine", "device", "adapter") else float(v) if k == "frame_ms" else int(v) for k, v in of.items()}

    def __reduce__(self) -> NoReturn:
        raise TypeError("a halite.Renderer cannot be pickled: it holds threads and device memory")
