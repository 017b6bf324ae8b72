# SPDX-License-Identifier: MIT OR Apache-2.0
"""Halite's pictures in plotters of PyVista.

>>> import pyvista
>>> import halite.pyvista
>>> plotter = pyvista.Plotter(off_screen=True)
>>> volume = halite.pyvista.add_volume(plotter, grid, scalars="pressure", cmap="inferno", opacity="sigmoid")

What :mod:`halite.vtk` says of its limits holds: translucent geometry goes under the volume, ``enable_ssao`` is refused, exports (to
HTML, glTF and others) leave the volume out and warn of it once. Views that a server draws, those of trame and notebooks, show it;
those that a browser draws do not.
"""
from __future__ import annotations

import functools
import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Optional, Union

import numpy as np
import numpy.typing as npt
import pyvista
from matplotlib.colors import ListedColormap
from pyvista.plotting.colors import get_cmap_safe

from . import Error, Mesh, TransferFunction
from ._window import Frames
from .vtk import Volume

__all__ = ["add_volume"]


# What pictures tell, and PyVista's opacities are made of.
_BYTE = 1 / 255
# Keywords of Plotter.add_volume that mean nothing here, and why.
_REFUSED = {
    "resolution": "a grid has a spacing of its own",
    "mapper": "Halite draws every kind of grid",
    "categories": "colours are continuous; cmap takes a list of colours, and n_colors their number",
    "culling": "a volume has no faces",
    "multi_colors": "one grid is drawn at a time",
}
_EXPORTS = ("export_gltf", "export_html", "export_obj", "export_vrml", "export_vtksz", "export_wasm_html", "export_wazex")
# Methods in which VTK asks for frames.
_PICTURES = ("screenshot", "get_image_depth", "write_frame")


def _bends(places: Any, values: Any, tolerance: float) -> list[int]:
    """Which of the points of a function are needed, if lines between them may be so far off at the others."""
    kept, first = [0], 0
    while first < len(places) - 1:
        # As far as one line goes: twice as far until it does not, then by halves.
        good, bad = first + 1, len(places)
        step = 1
        while good < len(places) - 1:
            last = min(good + step, bad - 1)
            if last <= good:
                break
            share = ((places[first:last + 1] - places[first]) / (places[last] - places[first]))[:, None]
            line = values[first] + (values[last] - values[first]) * share
            if np.abs(line - values[first:last + 1]).max() <= tolerance:
                good, step = last, 2 * step
            else:
                bad, step = last, max(1, (last - good) // 2)
        kept.append(good)
        first = good
    return kept


def _warning(export: Callable[..., Any], warned: list[str]) -> Callable[..., Any]:
    """An export that says once that it leaves volumes of Halite out."""
    @functools.wraps(export)
    def warn(*arguments: Any, **keywords: Any) -> Any:
        if not warned:
            warned.append(export.__name__)
            warnings.warn(f"{export.__name__}: what is exported has no volume of Halite, which is drawn as a picture; "
                          "screenshots and views drawn by a server have", UserWarning, stacklevel=2)
        return export(*arguments, **keywords)
    return warn


def _raising(plotter: Any, call: Callable[..., Any]) -> Callable[..., Any]:
    """A method of a plotter in which VTK asks for frames, and which raises what went wrong in them."""
    @functools.wraps(call)
    def ask(*arguments: Any, **keywords: Any) -> Any:
        if plotter.render_window is None:
            return call(*arguments, **keywords)
        with Frames.of(plotter.render_window).asked():
            return call(*arguments, **keywords)
    return ask


def _refuse_ssao(*_: Any, **__: Any) -> None:
    raise Error("enable_ssao: PyVista's ambient occlusion does not know volumes of Halite")


def _limit(plotter: Any) -> None:
    """Has a plotter say what it cannot do with the volume, and what went wrong."""
    if getattr(plotter.export_html, "__name__", "") == "export_html" and not hasattr(plotter.export_html, "__wrapped__"):
        warned: list[str] = []
        # What trame-pyvista adds to plotters, where it is installed, has exports of its own.
        for exporter in (plotter, getattr(plotter, "trame", None)):
            for name in _EXPORTS:
                if hasattr(exporter, name):
                    setattr(exporter, name, _warning(getattr(exporter, name), warned))
        for name in _PICTURES:
            setattr(plotter, name, _raising(plotter, getattr(plotter, name)))
        plotter.enable_ssao = _refuse_ssao


def add_volume(plotter: pyvista.Plotter, volume: Any, scalars: Union[str, npt.ArrayLike, None] = None, *,
               clim: Union[float, Sequence[float], None] = None, cmap: Any = None, opacity: Any = "linear", n_colors: int = 256,
               flip_scalars: bool = False, log_scale: bool = False, opacity_unit_distance: Optional[float] = None,
               shade: bool = False, ambient: float = 0.1, diffuse: float = 0.7, specular: float = 0.2, specular_power: float = 10.0,
               blending: str = "composite", show_scalar_bar: Optional[bool] = None,
               scalar_bar_args: Optional[Mapping[str, Any]] = None, annotations: Optional[Mapping[float, str]] = None,
               name: Optional[str] = None, reset_camera: Optional[bool] = None, render: bool = True, preference: str = "point",
               user_matrix: Optional[npt.ArrayLike] = None, component: Union[int, str, None] = None,
               silhouette: Optional[float] = None, gradient_opacity: npt.ArrayLike = (), pickable: bool = False, coarse: int = 2,
               threads: int = 0, device: str = "auto", engine: str = "auto", **refused: Any) -> Volume:
    """Add a volume to a plotter; keywords are those of ``Plotter.add_volume`` where they mean the same.

    Parameters
    ----------
    plotter : pyvista.Plotter
        Of any kind; with subplots, the active one.
    volume : pyvista.UnstructuredGrid, StructuredGrid, ImageData or RectilinearGrid
        Cells of any kind, without a triangulation. Followed when it is modified.
    scalars : str or array, optional
        An array of the mesh by name, or values of its points or cells. By default the active one; without one, the first that varies,
        real numbers before whole ones.
    clim : float or two floats, optional
        The range of scalars that colours and opacities lie over; one number is -clim to clim. The array's range by default.
    cmap : str, list, colour map of matplotlib, or pyvista.LookupTable, optional
        The theme's by default. Of a table, its colours.
    opacity : float, str or array
        As PyVista has it: "linear", "sigmoid", "geom", with "_r", "sigmoid_5", one opacity, or opacities over the range, in [0, 1].
    n_colors : int
        How many colours are taken from the map, and opacities from a function by name; colours are linear between them.
    flip_scalars : bool
        Turns the colour map round.
    log_scale : bool
        Colours and opacities lie over the logarithm of the scalars, which are above 0.
    opacity_unit_distance : float, optional
        The length that opacities are meant for, in world units; about the size of a cell by default. (PyVista has 1 for
        unstructured grids.)
    shade : bool
        Whether it is lit from the eye, with the gradient as normal.
    ambient, diffuse, specular, specular_power : float
        With `shade`: 0 or more.
    blending : {"composite", "maximum"}
        The integral, or the largest value along each ray.
    show_scalar_bar : bool, optional
        As the theme has it by default.
    scalar_bar_args : dict, optional
        As of ``Plotter.add_scalar_bar``.
    annotations : dict of float to str, optional
        Texts at values, on the scalar bar.
    name : str, optional
        Takes the place of what was added by this name.
    reset_camera, render
        As of ``Plotter.add_volume``.
    preference : {"point", "cell"}
        Where `scalars` is searched first.
    user_matrix : array of shape (4, 4), optional
        Where the volume stands in the world; affine.
    component : int or "all", optional
        As of :class:`halite.Renderer`. Of four bytes it is "all": they are colours themselves.
    silhouette, gradient_opacity
        As of :class:`halite.TransferFunction`.
    pickable : bool
        Whether pickers that know the bounds of props alone find it.
    coarse : int
        As of :class:`halite.vtk.Volume`.
    threads, device, engine
        As of :class:`halite.Renderer`.
    **refused
        Other keywords of ``Plotter.add_volume``, which have no meaning here.

    Returns
    -------
    halite.vtk.Volume
        A vtkVolume.

    Raises
    ------
    Error
        If there is no such array, or the plotter has ambient occlusion (``enable_ssao``).
    TypeError
        For a keyword that has no meaning here.
    ValueError
        If `blending` is another, or a logarithm has no place.

    Examples
    --------
    >>> plotter = pyvista.Plotter(off_screen=True)
    >>> volume = halite.pyvista.add_volume(plotter, grid, "pressure", clim=(0, 1), cmap="magma", opacity=[0, 0.2, 1])
    >>> plotter.remove_actor(volume)
    True
    """
    for keyword in refused:
        raise TypeError(f'add_volume: the keyword "{keyword}" has no meaning here: {_REFUSED[keyword]}' if keyword in _REFUSED else
                        f'add_volume: there is no keyword "{keyword}"')
    if blending not in ("composite", "maximum"):
        raise ValueError(f'blending is "composite" or "maximum", and not "{blending}"')
    if isinstance(volume, pyvista.MultiBlock):
        raise Error("a MultiBlock is several grids: add each of its blocks, or what its combine() makes of them")
    if isinstance(volume, (str, os.PathLike, Mesh)):
        what = "halite.Mesh" if isinstance(volume, Mesh) else "path"
        raise Error(f"a grid of PyVista or VTK is meant, and not a {what}: pyvista.read(path) reads one")
    grid = pyvista.wrap(volume)
    if scalars is not None and not isinstance(scalars, str):
        given = np.asarray(scalars)
        grid, scalars = grid.copy(deep=False), "Data"
        (grid.point_data if len(given) == grid.n_points else grid.cell_data)[scalars] = given
    if scalars is None:
        scalars = _default(grid)
    order = ("point", "cell") if preference == "point" else ("cell", "point")
    association = next((a for a in order if scalars in (grid.point_data if a == "point" else grid.cell_data)), None)
    if association is None:
        names = [*grid.point_data.keys(), *grid.cell_data.keys()]
        raise Error(f'no array is called "{scalars}"; there are ' + ", ".join(f'"{n}"' for n in names))
    values = np.asarray((grid.point_data if association == "point" else grid.cell_data)[scalars])
    if component is None and values.ndim > 1 and values.shape[1] == 4 and values.dtype == np.uint8:
        component = "all"
    low, high = _limits(clim, values, component, log_scale)
    if opacity_unit_distance is None:
        opacity_unit_distance = grid.length / max(2.0, round(max(grid.n_cells, 1) ** (1 / 3)))
    table = pyvista.LookupTable()
    if isinstance(cmap, pyvista.LookupTable):
        cmap = ListedColormap(np.asarray(cmap.values)[:, :3] / 255)
    map_of_colors = get_cmap_safe(cmap if cmap is not None else plotter._theme.cmap)
    map_of_colors = map_of_colors.reversed() if flip_scalars else map_of_colors
    table.apply_cmap(map_of_colors, n_colors)
    table.scalar_range, table.log_scale = (low, high), log_scale
    if annotations is not None:
        table.annotations = dict(annotations)
    shares = np.linspace(0, 1, n_colors)
    places = np.exp(np.log(low) + (np.log(high) - np.log(low)) * shares) if log_scale else low + (high - low) * shares
    colors = map_of_colors(shares)[:, :3]
    colors = np.column_stack([places, colors])[_bends(places, colors, 0.5 * _BYTE)]
    if isinstance(opacity, (int, float)):
        alphas = np.full((n_colors, 1), float(opacity))
    else:
        alphas = np.asarray(pyvista.opacity_transfer_function(opacity, n_colors), float)[:, None] / 255
    opacities = np.column_stack([places, alphas])[_bends(places, alphas, _BYTE)]
    transfer = TransferFunction(
        colors, opacity=opacities, unit_distance=opacity_unit_distance,
        convention="opacity" if isinstance(grid, (pyvista.ImageData, pyvista.RectilinearGrid)) else "extinction",
        shade=(ambient, diffuse, specular, specular_power) if shade else None, silhouette=silhouette,
        gradient_opacity=gradient_opacity)
    actor = Volume(grid, scalars, transfer=transfer, association=association, component=component,
                   maximum=blending == "maximum", coarse=coarse, threads=threads, device=device, engine=engine)
    if user_matrix is not None:
        actor.SetUserMatrix(pyvista.vtkmatrix_from_array(np.asarray(user_matrix, float)))
    actor.SetPickable(pickable)
    actor._watch(plotter.renderer)
    _limit(plotter)
    target: Any = plotter
    target.add_actor(actor, name=name, reset_camera=reset_camera, pickable=pickable, render=False)
    has_map = not (component == "all" and values.ndim > 1 and values.shape[1] == 4)
    if has_map and (plotter._theme.show_scalar_bar if show_scalar_bar is None else show_scalar_bar):
        mapper = pyvista.DataSetMapper()
        mapper.lookup_table = table
        mapper.scalar_range = (low, high)
        plotter.add_scalar_bar(mapper=mapper, **{"title": scalars, **(scalar_bar_args or {})})
    if render and plotter.render_window is not None and getattr(plotter, "_rendered_first_time", False):
        plotter.render()
    return actor


def _default(grid: Any) -> str:
    """The array that is drawn when nobody says: the active one, else the first that varies, real numbers before whole ones."""
    active = grid.active_scalars_name
    if active in grid.point_data or active in grid.cell_data:
        return str(active)
    # Arrays of the grid itself, such as times and titles, have no places.
    arrays = [(n, np.asarray(data[n])) for data in (grid.point_data, grid.cell_data) for n in data.keys()]
    arrays = [(n, a) for n, a in arrays if a.dtype.kind in "fiu" and a.size]
    if not arrays:
        raise Error("the mesh has no array to draw")
    best = min(arrays, key=lambda array: (array[1].dtype.kind != "f", not np.ptp(array[1]) > 0))
    return str(best[0])


def _limits(clim: Any, values: Any, component: Any, log_scale: bool) -> tuple[float, float]:
    """The range that colours lie over: as asked for, or that of the finite values."""
    if clim is None:
        if values.ndim > 1:
            if component == "all":
                values = values[:, -1]
            else:
                values = values[:, component] if isinstance(component, int) else np.linalg.norm(values, axis=1)
        finite = values[np.isfinite(values) & (values > 0 if log_scale else True)]
        clim = (finite.min(), finite.max()) if len(finite) else (0, 1)
    elif isinstance(clim, (int, float)):
        clim = (-clim, clim)
    low, high = (float(x) for x in clim)
    if log_scale and low <= 0:
        raise ValueError(f"log_scale: the range begins at {low}, and only what is above 0 has a logarithm")
    return low, high if high > low else low + max(1.0, abs(low)) * 1e-6
