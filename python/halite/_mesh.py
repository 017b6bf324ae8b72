# SPDX-License-Identifier: MIT OR Apache-2.0
"""Meshes and grids, from files, from numpy's arrays and from VTK."""
from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NoReturn, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _halite
from ._halite import Error

Arrays = Mapping[str, npt.ArrayLike]


def read(path: Union[str, os.PathLike[str]], *, step: Optional[int] = None, time: Optional[float] = None) -> Mesh:
    """Read a mesh or a grid from a file.

    Formats are VTK's .vtu, .vti, .vtr and .vts, the lists of their pieces (.pvtu, ...), series (.pvd, .series) and legacy .vtk.

    Parameters
    ----------
    path : path-like
        The file.
    step : int, optional
        Which of several time steps, from 0. The first by default.
    time : float, optional
        A time from the first to the last that there is; the nearest step is read.

    Returns
    -------
    Mesh
        The mesh, or the regular or rectilinear grid, with its arrays.

    Raises
    ------
    OSError
        If the file cannot be read.
    Error
        If it is malformed or not supported, with the place in it, or has no such step or time.
    MemoryError
        If there is no memory for what it announces.

    Examples
    --------
    >>> mesh = halite.read("tetrahedron.vtu")
    >>> mesh
    <halite.Mesh: a mesh of 4 points and 1 cells>
    """
    return Mesh(_halite.Mesh.read(os.fspath(path), step, time))


def native(values: npt.ArrayLike) -> npt.NDArray[Any]:
    """`values` in one piece and in the byte order of this machine; the array itself where it is so."""
    array = np.asarray(values)
    if array.dtype == bool:
        return np.ascontiguousarray(array).view(np.uint8)
    if not array.dtype.isnative:
        array = array.astype(array.dtype.newbyteorder("="))
    return np.ascontiguousarray(array)


def _arrays(data: Optional[Arrays]) -> list[tuple[str, Any]]:
    """Arrays of numpy and VTK by name, as they are; of what is neither, numpy's."""
    return [(str(name), values if _is_vtks(values) else np.asarray(values)) for name, values in (data or {}).items()]


def _is_vtks(array: Any) -> bool:
    """Whether it is an array of VTK, whose memory moves when VTK resizes it."""
    return not isinstance(array, np.ndarray) and hasattr(array, "GetVoidPointer")


def numbers(array: Any) -> npt.NDArray[Any]:
    """The values of an array of numpy or VTK, where they are at this moment if they are in one piece."""
    if _is_vtks(array):
        from . import _from_vtk
        array = _from_vtk.viewed(array)
    return native(array)


def components(array: Any) -> int:
    """Values of an array of numpy or VTK for each point or cell."""
    return int(array.GetNumberOfComponents()) if _is_vtks(array) else int(np.prod(array.shape[1:]))


_Given = list[tuple[str, npt.NDArray[Any]]]


def _whole(what: str, numbers: npt.ArrayLike) -> npt.NDArray[Any]:
    array = native(numbers).reshape(-1)
    if not array.size:
        return np.zeros(0, np.int64)
    if not np.issubdtype(array.dtype, np.integer):
        raise Error(f"{what} are whole numbers, and not {array.dtype}")
    return array


def _given(data: tuple[Sequence[tuple[str, Any]], Sequence[tuple[str, Any]]]) -> tuple[_Given, _Given]:
    """The arrays of a mesh, as the compiled module reads them."""
    points, cells = ([(name, numbers(array)) for name, array in arrays] for arrays in data)
    return points, cells


def range_of(values: npt.NDArray[Any], component: Union[int, str, None]) -> tuple[float, float]:
    """The least and the greatest finite value that is drawn."""
    if values.ndim > 1:
        values = values[:, component] if isinstance(component, int) else np.linalg.norm(values, axis=-1)
    if values.size and not (np.isfinite(values.min()) and np.isfinite(values.max())):
        values = values[np.isfinite(values)]
    return (float(values.min()), float(values.max())) if values.size else (0.0, 0.0)


def as_mesh(mesh: Any) -> Mesh:
    """`mesh` itself, or the mesh of a grid of VTK or PyVista."""
    if isinstance(mesh, Mesh):
        return mesh
    if hasattr(mesh, "IsA"):
        return Mesh.from_vtk(mesh)
    raise TypeError(f"a halite.Mesh or a grid of VTK is meant, and not {type(mesh).__name__}; halite.read(path) reads a file")


class Mesh:
    """A mesh, or a regular or rectilinear grid, with its arrays.

    It is made by :func:`read`, :meth:`from_arrays`, :meth:`from_vtk`, :meth:`image` or :meth:`rectilinear`. Its points and cells never
    change. Threads may share it.

    Parameters
    ----------
    core : halite._halite.Mesh
        The compiled mesh. Programs call the functions above.
    data : two lists of (name, array)
        The arrays of points and of cells that it is drawn by, if they are not its own.

    See Also
    --------
    Renderer : draws it.

    Notes
    -----
    Points and cells are read where they are, and copied once: coordinates become doubles, indices 32 bits. Arrays of values are not
    copied. The mesh refers to them, and a renderer reads the one that it draws when it begins to, in :class:`Renderer`,
    :meth:`Renderer.set_mesh` or :meth:`Renderer.set_scalars`: it keeps that component alone. So what a program writes to an array
    shows from the next :meth:`Renderer.set_scalars` on, and frames are drawn while the program writes. Meshes of files have arrays of
    their own.

    Examples
    --------
    >>> mesh = halite.Mesh.from_arrays([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [0, 1, 2, 3], [0, 4], [10],
    ...                                point_data={"s": [0.0, 1.0, 2.0, 3.0]})
    >>> mesh.n_points, mesh.n_cells, mesh.bounds
    (4, 1, (0.0, 1.0, 0.0, 1.0, 0.0, 1.0))
    """

    def __init__(self, core: _halite.Mesh, data: tuple[Sequence[tuple[str, Any]], Sequence[tuple[str, Any]]] = ((), ())) -> None:
        self._core = core
        self._data = data

    @classmethod
    def _of(cls, make: Callable[[_Given, _Given], _halite.Mesh], point_data: Optional[Arrays], cell_data: Optional[Arrays]) -> Mesh:
        data = (_arrays(point_data), _arrays(cell_data))
        return cls(make(*_given(data)), data)

    @classmethod
    def from_arrays(cls, points: npt.ArrayLike, cells: npt.ArrayLike, offsets: npt.ArrayLike, types: npt.ArrayLike, *,
                    faces: Optional[Sequence[npt.ArrayLike]] = None, point_data: Optional[Arrays] = None,
                    cell_data: Optional[Arrays] = None) -> Mesh:
        """Make a mesh of numpy's arrays.

        Parameters
        ----------
        points : array of float, of shape (n, 3)
            Coordinates, in world units.
        cells : array of int
            The points of all cells, from 0 to n - 1, one cell after another, in VTK's order.
        offsets : array of int, of shape (m + 1,)
            Where the points of each cell start in `cells`, and the end.
        types : array of int, of shape (m,)
            VTK's type of each cell, from 0 to 255: 10 is a tetrahedron, 12 a hexahedron, 13 a wedge, 14 a pyramid, 42 a
            polyhedron, 24 a quadratic tetrahedron. Cells of fewer than three dimensions are not drawn.
        faces : three arrays of int, optional
            Of polyhedra: where the faces of each cell start, and the end, of shape (m + 1,); where the points of each face
            start, and the end; and those points.
        point_data : dict of str to array, optional
            Arrays of shape (n,) or (n, k), of integers or floats of any size, by name; they are referred to. NaN is no value.
        cell_data : dict of str to array, optional
            Likewise of shape (m,) or (m, k).

        Returns
        -------
        Mesh
            The mesh.

        Raises
        ------
        Error
            If a count, an index, a type or a shape does not fit.
        MemoryError
            If there is no memory for the copy of points and cells.

        Examples
        --------
        >>> cube = [[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)]
        >>> mesh = halite.Mesh.from_arrays(cube, [0, 1, 3, 2, 4, 5, 7, 6], [0, 8], [12], cell_data={"c": [1.0]})
        >>> mesh.arrays
        [('c', 'cell', 1)]
        """
        coordinates = native(points)
        if coordinates.dtype not in (np.float64, np.float32):
            coordinates = coordinates.astype(np.float64)
        if coordinates.ndim != 2:
            raise Error(f"points have {coordinates.ndim} dimensions, and not the shape (n, 3)")
        polyhedra = None if faces is None else [_whole("faces", a) for a in faces]
        corners, starts, kinds = _whole("cells", cells), _whole("offsets", offsets), _whole("types", types)
        return cls._of(lambda p, c: _halite.Mesh.from_arrays(coordinates, corners, starts, kinds, polyhedra, p, c), point_data, cell_data)

    @classmethod
    def image(cls, dimensions: Sequence[int], *, origin: Sequence[float] = (0, 0, 0), spacing: Sequence[float] = (1, 1, 1),
              direction: npt.ArrayLike = ((1, 0, 0), (0, 1, 0), (0, 0, 1)), extent_start: Sequence[int] = (0, 0, 0),
              point_data: Optional[Arrays] = None, cell_data: Optional[Arrays] = None) -> Mesh:
        """Make a regular grid, whose field is trilinear between points.

        Parameters
        ----------
        dimensions : three ints
            How many points there are along x, y and z.
        origin : three floats
            Where the point of index (0, 0, 0) is, in world units.
        spacing : three floats
            From point to point along each axis, in world units, above 0.
        direction : array of shape (3, 3)
            The axes, in columns.
        extent_start : three ints
            The index of the first point along each axis.
        point_data : dict of str to array, optional
            Arrays with x fastest, by name: ``values.ravel()`` of an array of shape (nz, ny, nx), or shape (nx ny nz, k).
        cell_data : dict of str to array, optional
            Likewise, with one value fewer along each axis.

        Returns
        -------
        Mesh
            The grid.

        Raises
        ------
        Error
            If a count or a shape does not fit, or the axes are no axes.

        Examples
        --------
        >>> values = np.arange(24.0).reshape(4, 3, 2)
        >>> halite.Mesh.image((2, 3, 4), point_data={"v": values.ravel()})
        <halite.Mesh: a grid of 24 points and 6 cells>
        """
        rows = [[float(x) for x in row] for row in np.asarray(direction)]
        return cls._of(lambda p, c: _halite.Mesh.image(
            [float(x) for x in origin], [float(x) for x in spacing], rows, [int(i) for i in extent_start],
            [int(n) for n in dimensions], p, c), point_data, cell_data)

    @classmethod
    def rectilinear(cls, x: npt.ArrayLike, y: npt.ArrayLike, z: npt.ArrayLike, *, point_data: Optional[Arrays] = None,
                    cell_data: Optional[Arrays] = None) -> Mesh:
        """Make a grid with points at all triples of coordinates.

        Parameters
        ----------
        x : array of float, of shape (nx,)
            Coordinates along the axis, in world units, strictly monotone.
        y : array of float, of shape (ny,)
            Likewise.
        z : array of float, of shape (nz,)
            Likewise.
        point_data : dict of str to array, optional
            As of :meth:`image`.
        cell_data : dict of str to array, optional
            As of :meth:`image`.

        Returns
        -------
        Mesh
            The grid.

        Raises
        ------
        Error
            If coordinates are not monotone, or a shape does not fit.

        Examples
        --------
        >>> halite.Mesh.rectilinear([0, 1, 3], [0, 1], [0, 2], point_data={"v": np.arange(12)}).bounds
        (0.0, 3.0, 0.0, 1.0, 0.0, 2.0)
        """
        axes = [[float(c) for c in np.asarray(a).ravel()] for a in (x, y, z)]
        return cls._of(lambda p, c: _halite.Mesh.rectilinear(axes, p, c), point_data, cell_data)

    @classmethod
    def from_vtk(cls, grid: Any) -> Mesh:
        """Make a mesh of a grid of VTK or PyVista.

        VTK's points and cells are read where they are, and copied once; its arrays of values are referred to. Halite imports neither
        package by itself.

        Parameters
        ----------
        grid : vtkUnstructuredGrid, vtkStructuredGrid, vtkImageData or vtkRectilinearGrid
            Or one of PyVista's classes of them; of VTK 9.1 or later. Polyhedra may be in either layout.

        Returns
        -------
        Mesh
            The mesh, or grid. The active array is its first.

        Raises
        ------
        Error
            If it is of another class, which has no volume, or is not valid.

        Examples
        --------
        >>> from vtkmodules.vtkCommonDataModel import vtkImageData
        >>> image = vtkImageData()
        >>> image.SetDimensions(2, 3, 4)
        >>> halite.Mesh.from_vtk(image)
        <halite.Mesh: a grid of 24 points and 6 cells>
        """
        from . import _from_vtk
        return _from_vtk.mesh(cls, grid)

    @property
    def n_points(self) -> int:
        """Number of points."""
        return self._core.n_points

    @property
    def n_cells(self) -> int:
        """Number of cells."""
        return self._core.n_cells

    @property
    def is_grid(self) -> bool:
        """Whether it is regular or rectilinear."""
        return self._core.is_grid

    @property
    def bounds(self) -> tuple[float, float, float, float, float, float]:
        """Least and greatest x, y and z, in the order of VTK: (xmin, xmax, ymin, ymax, zmin, zmax), in world units.

        As in VTK, they are (1, -1, 1, -1, 1, -1) where there is no finite point.
        """
        b = self._core.bounds
        return (b[0], b[1], b[2], b[3], b[4], b[5]) if np.isfinite(b).all() else (1.0, -1.0, 1.0, -1.0, 1.0, -1.0)

    @property
    def length(self) -> float:
        """The length of the diagonal of the bounds, in world units; 0 where there is no finite point."""
        b = np.reshape(self.bounds, (3, 2))
        return float(np.linalg.norm(np.maximum(b[:, 1] - b[:, 0], 0)))

    @property
    def arrays(self) -> list[tuple[str, str, int]]:
        """Name, "point" or "cell", and number of components of each array."""
        given = [(n, kind, components(a)) for kind, all_of in zip(("point", "cell"), self._data) for n, a in all_of]
        return given or self._core.array_list

    def range(self, name: Optional[str] = None, association: Optional[str] = None,
              component: Optional[int] = None) -> tuple[float, float]:
        """Find the least and the greatest finite value of an array.

        Parameters
        ----------
        name : str, optional
            The array; the first by default.
        association : {"point", "cell"}, optional
            Whether it belongs to points or cells; points are searched first.
        component : int, optional
            Of an array of several; without it, the length of the tuples.

        Returns
        -------
        tuple of two floats
            The least and the greatest; (0, 0) if nothing is finite.

        Raises
        ------
        Error
            If there is no such array.

        Examples
        --------
        >>> halite.Mesh.image((2, 2, 2), point_data={"v": np.arange(8)}).range("v")
        (0.0, 7.0)
        """
        name, of_cells = self._find(name, association)
        given = self._numbers(name, of_cells)
        if given is not None:
            return range_of(given, component)
        low, high = self._core.range(name, of_cells, component)
        return (low, high) if low <= high else (0.0, 0.0)

    def _numbers(self, name: str, of_cells: bool) -> Optional[npt.NDArray[Any]]:
        """The values of an array that is not the compiled mesh's own."""
        return next((numbers(a) for n, a in self._data[of_cells] if n == name), None)

    def _find(self, name: Optional[str], association: Optional[str]) -> tuple[str, bool]:
        arrays = [(n, of == "cell") for n, of, _ in self.arrays if association is None or of == association]
        if not arrays:
            what = f" of {association}s" if association else ""
            raise Error(f"there is no array{what} to draw")
        if name is None:
            return arrays[0]
        for found in arrays:
            if found[0] == name:
                return found
        raise Error(f'no array is called "{name}"; there are ' + ", ".join(f'"{n}"' for n, _ in arrays))

    def __repr__(self) -> str:
        kind = "grid" if self.is_grid else "mesh"
        return f"<halite.Mesh: a {kind} of {self.n_points} points and {self.n_cells} cells>"

    def __reduce__(self) -> NoReturn:
        raise TypeError("a halite.Mesh cannot be pickled: pickle the arrays that it is made of")
