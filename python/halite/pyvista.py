# SPDX-License-Identifier: MIT OR Apache-2.0
"""Halite's pictures in plotters of PyVista.

>>> import pyvista
>>> import halite.pyvista
>>> plotter = pyvista.Plotter()
>>> actor = halite.pyvista.add_volume(plotter, grid, scalars="pressure", cmap="inferno", opacity="sigmoid")  # doctest: +SKIP

Translucent geometry goes under the volume, and `enable_ssao` does not know it.
"""
import numpy as np
import pyvista
from pyvista.plotting.colors import get_cmap_safe

from . import Error, TransferFunction
from .vtk import Volume

__all__ = ["add_volume"]


# What pictures tell, and PyVista's opacities are made of.
_BYTE = 1 / 255


def _bends(places, values, tolerance):
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


def add_volume(plotter, volume, scalars=None, *, clim=None, cmap=None, opacity="linear", n_colors=256, log_scale=False,
               opacity_unit_distance=None, shade=False, ambient=0.1, diffuse=0.7, specular=0.2, specular_power=10.0,
               blending="composite", show_scalar_bar=None, scalar_bar_args=None, name=None, reset_camera=None, render=True,
               preference="point", component=None, silhouette=None, gradient_opacity=(), pickable=False, threads=0,
               device="auto", engine="auto"):
    """Add a volume to a plotter; keywords are those of ``Plotter.add_volume`` where they mean the same.

    Parameters
    ----------
    plotter : pyvista.Plotter
    volume : pyvista.UnstructuredGrid, StructuredGrid, ImageData or RectilinearGrid
        Cells of any kind, without a triangulation.
    scalars : str or array, optional
        An array of the mesh by name, or values of its points or cells.
    clim : pair of float, optional
        The range of scalars; that of the array by default.
    cmap : str, list or colour map of matplotlib, optional
        The theme's by default.
    opacity : float, str or array
        As PyVista has it: "linear", "sigmoid", "geom", with "_r", "sigmoid_5", one opacity, or opacities over the range.
    opacity_unit_distance : float, optional
        The length that they are meant for; about the size of a cell by default.
    blending : {"composite", "maximum"}
    silhouette, gradient_opacity
        As of :class:`halite.TransferFunction`.
    threads, device, engine
        As of :class:`halite.Renderer`.

    Returns
    -------
    halite.vtk.Volume
        A vtkVolume.
    """
    grid = pyvista.wrap(volume)
    if blending not in ("composite", "maximum"):
        raise ValueError(f'blending is "composite" or "maximum", and not "{blending}"')
    if scalars is not None and not isinstance(scalars, str):
        values = np.asarray(scalars)
        grid, scalars = grid.copy(deep=False), "Data"
        (grid.point_data if len(values) == grid.n_points else grid.cell_data)[scalars] = values
    if scalars is None:
        scalars = grid.active_scalars_name or next(iter(grid.array_names), None)
    if scalars is None:
        raise Error("the mesh has no array to draw")
    order = ("point", "cell") if preference == "point" else ("cell", "point")
    association = next((a for a in order if scalars in (grid.point_data if a == "point" else grid.cell_data)), None)
    if association is None:
        raise Error(f'no array is called "{scalars}"; there are ' + ", ".join(f'"{n}"' for n in grid.array_names))
    values = np.asarray((grid.point_data if association == "point" else grid.cell_data)[scalars])
    if values.ndim > 1:
        values = values[:, component] if isinstance(component, int) else np.linalg.norm(values, axis=1)
    finite = values[np.isfinite(values) & (values > 0 if log_scale else True)]
    low, high = (float(x) for x in (clim if clim is not None else (finite.min(), finite.max()) if len(finite) else (0, 1)))
    if log_scale and low <= 0:
        raise ValueError(f"log_scale: the range begins at {low}, and only what is above 0 has a logarithm")
    if not high > low:
        high = low + max(1.0, abs(low)) * 1e-6
    if opacity_unit_distance is None:
        opacity_unit_distance = grid.length / max(2.0, round(max(grid.n_cells, 1) ** (1 / 3)))
    table = pyvista.LookupTable(cmap if cmap is not None else plotter._theme.cmap, n_values=n_colors, scalar_range=(low, high),
                                log_scale=log_scale)
    shares = np.linspace(0, 1, n_colors)
    places = np.exp(np.log(low) + (np.log(high) - np.log(low)) * shares) if log_scale else low + (high - low) * shares
    colors = get_cmap_safe(cmap if cmap is not None else plotter._theme.cmap)(shares)[:, :3]
    colors = np.column_stack([places, colors])[_bends(shares, colors, 0.5 * _BYTE)]
    if isinstance(opacity, (int, float)):
        alphas = np.full((n_colors, 1), float(opacity))
    else:
        alphas = np.asarray(pyvista.opacity_transfer_function(opacity, n_colors), float)[:, None] / 255
    opacities = np.column_stack([places, alphas])[_bends(shares, alphas, _BYTE)]
    transfer = TransferFunction(
        colors, opacity=opacities, unit_distance=opacity_unit_distance,
        convention="opacity" if isinstance(grid, (pyvista.ImageData, pyvista.RectilinearGrid)) else "extinction",
        shade=(ambient, diffuse, specular, specular_power) if shade else None, silhouette=silhouette,
        gradient_opacity=gradient_opacity)
    actor = Volume(grid, scalars, transfer=transfer, association=association, component=component,
                   maximum=blending == "maximum", threads=threads, device=device, engine=engine)
    actor.SetPickable(pickable)
    actor._watch(plotter.renderer)
    plotter.add_actor(actor, name=name, reset_camera=reset_camera, pickable=pickable, render=False)
    if plotter._theme.show_scalar_bar if show_scalar_bar is None else show_scalar_bar:
        mapper = pyvista.DataSetMapper()
        mapper.lookup_table = table
        mapper.scalar_range = (low, high)
        arguments = {"title": scalars, **(scalar_bar_args or {})}
        plotter.add_scalar_bar(mapper=mapper, **arguments)
    if render and plotter.render_window is not None and getattr(plotter, "_rendered_first_time", False):
        plotter.render()
    return actor
