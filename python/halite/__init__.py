# SPDX-License-Identifier: MIT OR Apache-2.0
"""Exact volume rendering of unstructured grids: every pixel is the emission-absorption integral of the field that the mesh defines.

>>> import numpy as np
>>> import halite
>>> points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
>>> mesh = halite.Mesh.from_arrays(points, cells=[0, 1, 2, 3], offsets=[0, 4], types=[10], point_data={"s": points[:, 0]})
>>> transfer = halite.TransferFunction("viridis", (0, 1), opacity=1.0)
>>> view = halite.View((3, 2, 4), (0.3, 0.3, 0.3), size=(64, 48))
>>> picture = halite.Renderer(mesh, transfer=transfer).render(view)
>>> picture.shape, picture.dtype
((48, 64, 4), dtype('float32'))

``halite.vtk`` and ``halite.pyvista`` put such pictures into windows of VTK and PyVista.
"""
from __future__ import annotations

import json
import os
import sys

import numpy as np

if sys.platform == "linux" and not os.environ.get("XDG_RUNTIME_DIR", "").startswith("/"):
    # Mesa's selection of Vulkan devices asks Wayland, which complains on stderr where there is no session.
    os.environ.setdefault("NODEVICE_SELECT", "1")

from . import _halite
from ._halite import Error, __version__

__all__ = ["Error", "Mesh", "Picture", "Renderer", "TransferFunction", "View", "read", "show", "write", "__version__"]


def read(path, *, step=None, time=None):
    """Read a mesh or a grid: .vtu, .vti, .vtr, .vts, their .p... lists, .pvd, or legacy .vtk.

    Parameters
    ----------
    path : path-like
    step : int, optional
        Which of several time steps, from 0.
    time : float, optional
        The time; the nearest step is read.

    Returns
    -------
    Mesh

    Raises
    ------
    OSError
        If the file cannot be read.
    Error
        If it is malformed or not supported, with the place in it.
    """
    return Mesh(_halite.Mesh.read(os.fspath(path), step, time))


def _arrays(data):
    return [(str(name), np.ascontiguousarray(values)) for name, values in (data or {}).items()]


def _whole(what, numbers):
    numbers = np.asarray(numbers).reshape(-1)
    if numbers.size and not np.issubdtype(numbers.dtype, np.integer):
        raise Error(f"{what} are whole numbers, and not {numbers.dtype}")
    return np.ascontiguousarray(numbers, np.int64)


class Mesh:
    """A mesh, or a regular or rectilinear grid, with its arrays. It never changes.

    Made by :func:`read`, :meth:`from_arrays`, :meth:`from_vtk`, :meth:`image` or :meth:`rectilinear`.
    """

    def __init__(self, core):
        self._core = core

    @classmethod
    def from_arrays(cls, points, cells, offsets, types, *, faces=None, point_data=None, cell_data=None):
        """A mesh of numpy's arrays, which are copied.

        Parameters
        ----------
        points : array of shape (n, 3)
            Coordinates.
        cells : array of int
            The points of all cells, one cell after another.
        offsets : array of int, of shape (m + 1,)
            Where the points of each cell start in `cells`, and the end.
        types : array of int, of shape (m,)
            VTK's type of each cell: 10 is a tetrahedron, 12 a hexahedron, 13 a wedge, 14 a pyramid, 42 a polyhedron.
        faces : triple of arrays of int, optional
            Of polyhedra: where the faces of each cell start, and the end, of shape (m + 1,); where the points of each face
            start, and the end; and those points.
        point_data, cell_data : dict of str to array, optional
            Arrays of shape (n,) or (n, k), and (m,) or (m, k), by name.

        Raises
        ------
        Error
            If a count, an index or a shape does not fit.
        """
        points = np.ascontiguousarray(points, np.float64)
        if points.ndim != 2:
            raise Error(f"points have {points.ndim} dimensions, and not the shape (n, 3)")
        kinds = _whole("types", types)
        if kinds.size and not 0 <= kinds.min() <= kinds.max() <= 255:
            raise Error(f"types are VTK's, from 0 to 255, and not {kinds.min()} to {kinds.max()}")
        faces = None if faces is None else [_whole("faces", a) for a in faces]
        return cls(_halite.Mesh.from_arrays(points, _whole("cells", cells), _whole("offsets", offsets), kinds.astype(np.uint8),
                                            faces, _arrays(point_data), _arrays(cell_data)))

    @classmethod
    def image(cls, dimensions, *, origin=(0, 0, 0), spacing=(1, 1, 1), direction=np.eye(3), extent_start=(0, 0, 0),
              point_data=None, cell_data=None):
        """A regular grid of so many points along x, y and z, whose field is trilinear between points.

        Arrays have x fastest: ``values.ravel()`` of an array of shape (nz, ny, nx).
        """
        rows = [[float(x) for x in row] for row in np.asarray(direction)]
        return cls(_halite.Mesh.image(
            [float(x) for x in origin], [float(x) for x in spacing], rows, [int(i) for i in extent_start],
            [int(n) for n in dimensions], _arrays(point_data), _arrays(cell_data)))

    @classmethod
    def rectilinear(cls, x, y, z, *, point_data=None, cell_data=None):
        """A grid with points at all triples of these coordinates."""
        return cls(_halite.Mesh.rectilinear([list(map(float, a)) for a in (x, y, z)], _arrays(point_data), _arrays(cell_data)))

    @classmethod
    def from_vtk(cls, grid):
        """A mesh of a vtkUnstructuredGrid, vtkStructuredGrid, vtkImageData or vtkRectilinearGrid, or PyVista's classes of them."""
        from . import _from_vtk
        return _from_vtk.mesh(cls, grid)

    @property
    def n_points(self):
        """Number of points."""
        return self._core.n_points

    @property
    def n_cells(self):
        """Number of cells."""
        return self._core.n_cells

    @property
    def is_grid(self):
        """Whether it is regular or rectilinear."""
        return self._core.is_grid

    @property
    def bounds(self):
        """Least and greatest x, y and z, in the order of VTK: (xmin, xmax, ymin, ymax, zmin, zmax).

        As in VTK, they are (1, -1, 1, -1, 1, -1) where there is no finite point.
        """
        bounds = tuple(self._core.bounds)
        return bounds if np.isfinite(bounds).all() else (1.0, -1.0) * 3

    @property
    def length(self):
        """The length of the diagonal of the bounds; 0 where there is no finite point."""
        b = np.reshape(self.bounds, (3, 2))
        return float(np.linalg.norm(np.maximum(b[:, 1] - b[:, 0], 0)))

    @property
    def arrays(self):
        """Name, "point" or "cell", and number of components of each array."""
        return self._core.array_list

    def range(self, name=None, association=None, component=None):
        """The least and the greatest finite value of an array; of several components without `component`, of their length."""
        name, of_cells = self._find(name, association)
        low, high = self._core.range(name, of_cells, component)
        return (low, high) if low <= high else (0.0, 0.0)

    def _find(self, name, association):
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

    def __repr__(self):
        kind = "grid" if self.is_grid else "mesh"
        return f"<halite.Mesh: a {kind} of {self.n_points} points and {self.n_cells} cells>"

    def __reduce__(self):
        raise TypeError("a halite.Mesh cannot be pickled: pickle the arrays that it is made of")


class TransferFunction:
    """Colour and opacity of a scalar.

    Parameters
    ----------
    color : str or array of shape (n, 4)
        A colour map by name ("viridis", "cool to warm", "turbo_r", ...), one of matplotlib's as an object, or knots
        (scalar, red, green, blue) that ascend, colours in [0, 1].
    clim : pair of float, optional
        The range of scalars that a colour map, and opacities without scalars, lie over.
    opacity : float, list of float, or array of shape (n, 2)
        One opacity for all; opacities that lie evenly over `clim`; or knots (scalar, opacity).
    unit_distance : float
        The length that opacities are meant for, in world units.
    convention : {"extinction", "opacity"}
        Whether extinction is a / d, as in VTK's mappers of unstructured grids, or -ln(1 - a) / d, as in those of images.
    emission_scale : float, optional
        Makes emission independent of opacity: colour times this per unit of length.
    gradient_opacity : array of shape (n, 2), optional
        Knots (length of the gradient, factor) of what extinction is multiplied by.
    widgets : list of dict, optional
        Shapes in the plane of scalar and gradient, as scene files have them, in the place of colour and opacity.
    silhouette : float, optional
        p: extinction is multiplied by (1 - abs(n.d))^p.
    shade : bool or (ambient, diffuse, specular, power), optional
        Light from the eye, with the unit vector of the gradient as normal.
    """

    def __init__(self, color="viridis", clim=(0.0, 1.0), *, opacity=1.0, unit_distance=1.0, convention="extinction",
                 emission_scale=None, gradient_opacity=(), widgets=(), silhouette=None, shade=None):
        low, high = (float(x) for x in clim)
        if shade is True:
            shade = (0.1, 0.7, 0.2, 10.0)
        self._core = _halite.TransferFunction(
            _colors(color, low, high), _opacities(opacity, low, high), float(unit_distance), convention, emission_scale,
            [[float(x) for x in knot] for knot in gradient_opacity], [json.dumps(w) for w in widgets], silhouette,
            [float(x) for x in shade] if shade else None)

    @property
    def color(self):
        """The knots (scalar, red, green, blue), of shape (n, 4)."""
        return np.array(self._core.color)

    @property
    def opacity(self):
        """The knots (scalar, opacity), of shape (n, 2)."""
        return np.array(self._core.opacity)


def _colors(color, low, high):
    if isinstance(color, str):
        return _halite.colormap(color, low, high)
    if callable(color):
        shares = np.linspace(0, 1, 256)
        return [[low + (high - low) * u, *map(float, color(float(u))[:3])] for u in shares]
    return [[float(x) for x in knot] for knot in np.asarray(color, float).reshape(-1, 4)]


def _opacities(opacity, low, high):
    a = np.asarray(opacity, float)
    if a.ndim == 0:
        return [[low, float(a)]]
    if a.ndim == 1:
        return [[float(s), float(x)] for s, x in zip(np.linspace(low, high, len(a)), a)]
    return [[float(x) for x in knot] for knot in a.reshape(-1, 2)]


class View:
    """From where a mesh is seen, as by VTK's camera.

    Parameters
    ----------
    position, focal_point, view_up : three floats
    view_angle : float
        The vertical angle of view, in degrees.
    parallel_scale : float, optional
        Makes the view parallel: half its height in world units.
    clipping_range : pair of float, optional
        Distances along the view between which anything is seen.
    size : (width, height)
        In pixels.
    planes : list of (origin, normal)
        What the normals point into is kept.
    """

    def __init__(self, position, focal_point=(0, 0, 0), view_up=(0, 1, 0), *, view_angle=30.0, parallel_scale=None,
                 clipping_range=None, size=(1024, 768), planes=()):
        three = lambda v: [float(x) for x in v]
        self._set(_halite.View.from_camera(
            three(position), three(focal_point), three(view_up), float(view_angle),
            None if parallel_scale is None else float(parallel_scale), clipping_range, [int(n) for n in size]), planes)

    @classmethod
    def from_matrices(cls, world_to_eye, eye_to_clip, size, *, planes=()):
        """A view by OpenGL's matrices: two arrays of shape (4, 4) for column vectors."""
        rows = lambda m: [[float(x) for x in row] for row in np.asarray(m)]
        view = cls.__new__(cls)
        view._set(_halite.View.from_matrices(rows(world_to_eye), rows(eye_to_clip), [int(n) for n in size]), planes)
        return view

    def _set(self, core, planes):
        planes = [[[float(x) for x in v] for v in plane] for plane in planes]
        self._core = core.clipped(planes) if planes else core

    @property
    def size(self):
        """Width and height, in pixels."""
        return tuple(self._core.size)


class Renderer:
    """Draws one mesh, as often as wanted, and keeps what does not change between frames.

    Threads may share a renderer: one draws after another. Python runs while it draws.

    Parameters
    ----------
    mesh : Mesh
    scalars : str, optional
        The array to draw; the first by default.
    association : {"point", "cell"}, optional
    component : int, optional
        Of an array of several; without it, the length of the tuples. ``"all"``: two are the values of colour and opacity, four are
        red, green, blue and a value of the opacity.
    transfer : TransferFunction, optional
        The colour map "viridis" over the range of the array, with opacities that rise over it, by default.
    threads : int
        0: one for each core.
    device : str
        "auto", "cpu", or a GPU by index, UUID or part of its name.
    engine : str
        "auto", "traverse" or "project".
    placement : array of shape (4, 4), optional
        From the mesh's coordinates to the world; affine.
    """

    def __init__(self, mesh, scalars=None, *, association=None, component=None, transfer=None, threads=0, device="auto",
                 engine="auto", placement=None):
        self._core = _halite.Renderer(threads, device, engine)
        self._transfer = transfer
        self.set_mesh(mesh, scalars, association=association, component=component, placement=placement)

    def set_mesh(self, mesh, scalars=None, *, association=None, component=None, placement=None):
        """Draw another mesh from now on."""
        placement = np.eye(4) if placement is None else np.asarray(placement, float)
        self._core.set_mesh(mesh._core, [[float(x) for x in row] for row in placement])
        self.mesh = mesh
        self.set_scalars(scalars, association=association, component=component)

    def set_scalars(self, scalars=None, *, association=None, component=None):
        """Draw another array of the mesh, or values of its points or cells, of shape (n,) or (n, k), from now on."""
        code = {None: -1, "all": -2}.get(component, component)
        if scalars is None or isinstance(scalars, str):
            name, of_cells = self.mesh._find(scalars, association)
            self._core.set_array(self.mesh._core, name, of_cells, _code(code, self.mesh, name, of_cells))
            self._range = self.mesh.range(name, "cell" if of_cells else "point", component if isinstance(component, int) else None)
        else:
            values = np.ascontiguousarray(scalars)
            of_cells = association == "cell" or (association is None and len(values) != self.mesh.n_points)
            self._core.set_values(values, of_cells, 0 if values.ndim == 1 and code == -1 else code)
            lengths = values if values.ndim == 1 else np.linalg.norm(values, axis=-1)
            finite = lengths[np.isfinite(lengths)]
            self._range = (float(finite.min()), float(finite.max())) if len(finite) else (0.0, 0.0)
        self.set_transfer(self._transfer)

    def set_transfer(self, transfer=None):
        """Draw with another transfer function from now on."""
        self._transfer = transfer
        if transfer is None:
            low, high = self._range
            transfer = TransferFunction("viridis", (low, high if high > low else low + 1), opacity=[0, 1],
                                        unit_distance=(self.mesh.length or 1.0) / 5)
        self._core.set_transfer(transfer._core)

    def render(self, view, depth=None, *, maximum=False, progress=None):
        """Draw a frame.

        Parameters
        ----------
        view : View
        depth : float32 array of shape (height, width), optional
            OpenGL's window depths in [0, 1], row 0 uppermost, at which rays end; needs a clipping range or matrices.
        maximum : bool
            Show the largest value along each ray in the place of the integral.
        progress : callable, optional
            Called with the share that is done every 20 ms; False ends the frame.

        Returns
        -------
        float32 array of shape (height, width, 4), or None
            Linear premultiplied red, green, blue and opacity; row 0 is uppermost. None if `progress` ended it.
        """
        if depth is not None:
            depth = np.ascontiguousarray(depth, np.float32)
        core = view._core.of_maxima() if maximum else view._core
        return self._core.render(core, depth, progress)

    @property
    def stats(self):
        """What the last frame was drawn with and took: engine, device, adapter, cells, tetrahedra, frame_ms."""
        of = dict(self._core.stats)
        return {k: v if k in ("engine", "device", "adapter") else float(v) if k == "frame_ms" else int(v) for k, v in of.items()}

    def __reduce__(self):
        raise TypeError("a halite.Renderer cannot be pickled: it holds threads and device memory")


def _code(code, mesh, name, of_cells):
    n = next(n for k, of, n in mesh.arrays if k == name and (of == "cell") == of_cells)
    return 0 if n == 1 and code == -1 else code


class Picture:
    """A picture that a notebook shows: `pixels` is the float32 array of shape (height, width, 4)."""

    def __init__(self, pixels, background=(0.11, 0.12, 0.14)):
        self.pixels, self.background = pixels, background

    def _repr_png_(self):
        return _halite.encode(self.pixels, self.background, None)

    def save(self, path):
        """Write it to a .png over the background, or to .exr or .npy."""
        write(path, self.pixels, background=self.background)


def write(path, picture, *, background=None):
    """Write a picture to a .png (8 bits; over `background`, or with an alpha channel), .exr or .npy file."""
    color = None if background is None else [float(x) for x in background]
    _halite.encode(np.ascontiguousarray(picture, np.float32), color, os.fspath(path))


def show(mesh, scalars=None, *, size=(1024, 768), **options):
    """A picture of a mesh, with array, colours, opacities and view chosen so that something is seen.

    Parameters
    ----------
    mesh : Mesh, path-like, or a grid of VTK or PyVista
    scalars : str, optional
    size : (width, height)
    **options
        As of :class:`Renderer`, `transfer` among them.

    Returns
    -------
    Picture
    """
    if isinstance(mesh, (str, os.PathLike)):
        mesh = read(mesh)
    elif not isinstance(mesh, Mesh):
        mesh = Mesh.from_vtk(mesh)
    wanted = None if scalars is None else mesh._find(scalars, options.get("association"))
    name, of_cells, core, transfer = _halite.automatic(mesh._core, wanted, [int(n) for n in size])
    if options.get("transfer") is None:
        chosen = TransferFunction.__new__(TransferFunction)
        chosen._core = transfer
        options["transfer"] = chosen
    options["association"] = "cell" if of_cells else "point"
    view = View.__new__(View)
    view._core = core
    return Picture(Renderer(mesh, name, **options).render(view))
