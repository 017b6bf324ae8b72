# SPDX-License-Identifier: MIT OR Apache-2.0
"""Grids of VTK, of any release from 9.1 on, as meshes."""
from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Optional

import numpy as np

from ._halite import Error

if TYPE_CHECKING:
    from ._mesh import Mesh


def viewed(array: Any) -> Any:
    """VTK's array as numpy's, without a copy but of arrays that are not in one piece."""
    from vtkmodules.util.numpy_support import vtk_to_numpy
    return vtk_to_numpy(array)  # type: ignore[no-untyped-call]


def cell_types(grid: Any) -> Any:
    """VTK's type of each cell of an unstructured grid, as VTK's array; none of a grid without cells."""
    if not grid.GetNumberOfCells():
        return None
    if not hasattr(grid, "GetCellTypesArray"):
        return grid.GetCellTypes()
    with warnings.catch_warnings():
        # Deprecated from 9.6 on, where the new name is that of another method before.
        warnings.simplefilter("ignore", DeprecationWarning)
        types = grid.GetCellTypesArray()
    # Releases that keep one type for all cells say so by an array of another class.
    return types if types is not None else grid.GetCellTypes()


def _data(attributes: Any) -> dict[str, Any]:
    arrays: dict[str, Any] = {}
    active = attributes.GetScalars()
    listed = [attributes.GetArray(i) for i in range(attributes.GetNumberOfArrays())]
    # The active array is the first, which is drawn by default.
    for array in ([active] if active is not None else []) + listed:
        if array is None or not array.GetNumberOfTuples():
            continue
        name = array.GetName() or ("scalars" if array is active else "")
        if name and name not in arrays:
            arrays[name] = array
    # What curved cells are made by is found by its name, whatever the array is called.
    for role in ("HigherOrderDegrees", "RationalWeights"):
        array = getattr(attributes, f"Get{role}")()
        if array is not None and role not in arrays and array.GetNumberOfTuples():
            arrays[role] = array
    return arrays


def mesh(cls: type[Mesh], grid: Any) -> Mesh:
    """The mesh of a grid; `cls` is halite.Mesh."""
    kinds = ("vtkUnstructuredGrid", "vtkStructuredGrid", "vtkImageData", "vtkRectilinearGrid")
    kind = next((k for k in kinds if hasattr(grid, "IsA") and grid.IsA(k)), None)
    if kind is None:
        name = grid.GetClassName() if hasattr(grid, "GetClassName") else type(grid).__name__
        raise Error(f"a {name} has no volume to draw: vtkUnstructuredGrid, vtkStructuredGrid, vtkImageData and vtkRectilinearGrid have")
    data: dict[str, Any] = {"point_data": _data(grid.GetPointData()), "cell_data": _data(grid.GetCellData())}
    if kind == "vtkImageData":
        direction: Any = np.reshape([grid.GetDirectionMatrix().GetElement(i, j) for i in range(3) for j in range(3)], (3, 3))
        return cls.image(grid.GetDimensions(), origin=grid.GetOrigin(), spacing=grid.GetSpacing(), direction=direction,
                         extent_start=grid.GetExtent()[::2], **data)
    if kind == "vtkRectilinearGrid":
        return cls.rectilinear(*(viewed(getattr(grid, f"Get{a}Coordinates")()) for a in "XYZ"), **data)
    points = viewed(grid.GetPoints().GetData()) if grid.GetPoints() else np.zeros((0, 3))
    if kind == "vtkStructuredGrid":
        dimensions = [0, 0, 0]
        grid.GetDimensions(dimensions)
        return cls.from_arrays(points, *_hexahedra(dimensions), **data)
    cells = grid.GetCells()
    types = cell_types(grid)
    if types is None:
        return cls.from_arrays(points, [], [0], [], **data)
    types, starts = viewed(types), viewed(cells.GetOffsetsArray())
    # VTK leaves room behind what cells name, and anything in it, such as where it removed ghosts.
    corners = viewed(cells.GetConnectivityArray())[:max(int(starts[-1]), 0)]
    return cls.from_arrays(points, corners, starts, types,
                           faces=_faces(grid, types) if np.any(types == 42) else None, **data)


def _hexahedra(dimensions: Sequence[int]) -> tuple[Any, Any, Any]:
    """The cells of a structured grid: connectivity, offsets, types."""
    nx, ny, nz = dimensions
    if min(dimensions) < 2:
        return [], [0], []
    k, j, i = np.meshgrid(np.arange(nz - 1), np.arange(ny - 1), np.arange(nx - 1), indexing="ij")
    first = (i + nx * (j + ny * k)).ravel()
    corners = np.array([0, 1, nx + 1, nx])
    around = np.concatenate([corners, corners + nx * ny])
    connectivity = first[:, None] + around
    return connectivity.ravel(), np.arange(len(first) + 1) * 8, np.full(len(first), 12)


def _faces(grid: Any, types: Any) -> Optional[Sequence[Any]]:
    """The faces of polyhedra: where those of each cell start, where the points of each start, and these."""
    if hasattr(grid, "GetPolyhedronFaces"):
        # From 9.4 on: cells of faces, and faces of points. A cell's faces are numbers, not always a range.
        of_cells, faces = grid.GetPolyhedronFaceLocations(), grid.GetPolyhedronFaces()
        if of_cells is None or faces is None:
            return None
        starts, ids = viewed(of_cells.GetOffsetsArray()), viewed(of_cells.GetConnectivityArray())
        offsets, all_points = viewed(faces.GetOffsetsArray()), viewed(faces.GetConnectivityArray())
        sizes = np.diff(offsets)[ids]
        chosen = np.concatenate([[0], np.cumsum(sizes)])
        at = np.repeat(offsets[ids], sizes) + np.arange(chosen[-1]) - np.repeat(chosen[:-1], sizes)
        return starts, chosen, all_points[at.astype(np.int64)]
    stream, locations = grid.GetFaces(), grid.GetFaceLocations()
    if stream is None or locations is None:
        return None
    stream, locations = viewed(stream), viewed(locations)
    first, ends = [0], [0]
    points: list[Any] = []
    for cell in range(len(types)):
        count = 0
        if types[cell] == 42 and locations[cell] >= 0:
            at = locations[cell]
            count, at = stream[at], at + 1
            for _ in range(count):
                n = stream[at]
                points.append(stream[at + 1:at + 1 + n])
                ends.append(ends[-1] + n)
                at += 1 + n
        first.append(first[-1] + count)
    return first, ends, np.concatenate(points) if points else []
