# SPDX-License-Identifier: MIT OR Apache-2.0
"""Volumes in plotters of PyVista."""
import numpy as np
import pytest

pyvista = pytest.importorskip("pyvista")

import halite  # noqa: E402
import halite.pyvista  # noqa: E402
from conftest import lattice  # noqa: E402


def mesh(n=4):
    points, cells, offsets, types = lattice(n)
    rows = np.column_stack([np.full(len(types), 8), cells.reshape(-1, 8)])
    grid = pyvista.UnstructuredGrid(rows.ravel(), types.astype(np.uint8), points)
    grid["x"] = points[:, 0]
    grid["v"] = points * 2
    grid.cell_data["c"] = np.arange(len(types), dtype=float)
    return grid


def plotter(**options):
    return pyvista.Plotter(off_screen=True, window_size=(160, 120), **options)


def test_a_picture_as_pyvista_draws_tetrahedra():
    """PyVista's own mapper, on tetrahedra, shows about the same."""
    grid = mesh(8)
    pictures = []
    for draw in ("theirs", "ours"):
        p = plotter()
        p.set_background("black")
        if draw == "theirs":
            p.add_volume(grid.triangulate(), scalars="x", cmap="viridis", opacity=[0.0, 1.0], opacity_unit_distance=1.0,
                         show_scalar_bar=False)
        else:
            halite.pyvista.add_volume(p, grid, "x", cmap="viridis", opacity=[0.0, 1.0], opacity_unit_distance=1.0,
                                      show_scalar_bar=False)
        p.camera_position = [(4, -3, 2.5), (0, 0, 0), (0, 0, 1)]
        pictures.append(p.screenshot(return_img=True).astype(float))
        p.close()
    assert pictures[1].max() > 60
    assert np.abs(pictures[0] - pictures[1]).mean() < 8


def test_keywords():
    grid = mesh()
    p = plotter()
    actor = halite.pyvista.add_volume(p, grid, "x", clim=(-0.5, 0.5), cmap="inferno", opacity="sigmoid", name="fog",
                                      scalar_bar_args={"title": "fog"})
    assert "fog" in p.actors and p.bounds[:2] == pytest.approx((-1, 1))
    first = p.screenshot(return_img=True)
    assert "fog" in p.scalar_bars
    for more in ({"shade": True}, {"blending": "maximum"}, {"opacity": 0.4}, {"scalars": "v"}, {"scalars": "c"},
                 {"scalars": np.arange(grid.n_points)}, {"silhouette": 2}):
        q = plotter()
        other = halite.pyvista.add_volume(q, grid, **{"scalars": "x", **more})
        shot = q.screenshot(return_img=True)
        assert other.error is None and np.abs(shot.astype(float) - first).max() > 20, more
        q.close()
    with pytest.raises(halite.Error, match='"nothing"'):
        halite.pyvista.add_volume(p, grid, "nothing")
    with pytest.raises(TypeError, match="resolution"):
        halite.pyvista.add_volume(p, grid, "x", resolution=3)
    with pytest.raises(ValueError, match="additive"):
        halite.pyvista.add_volume(p, grid, "x", blending="additive")
    p.remove_actor(actor)
    assert np.abs(p.screenshot(return_img=True).astype(float) - first).max() > 20
    p.close()


def test_the_array_when_nobody_says():
    grid = mesh()
    grid.field_data["TimeValue"] = [0.5]
    grid.cell_data["number"] = np.arange(grid.n_cells)
    grid.set_active_scalars(None)
    drawn = lambda: halite.pyvista.add_volume(plotter(), grid).scalars
    assert drawn() == "x"
    del grid.point_data["x"], grid.point_data["v"]
    assert drawn() == "c"
    del grid.cell_data["c"]
    assert drawn() == "number"
    grid.set_active_scalars("number")
    grid.cell_data["other"] = np.linspace(0, 1, grid.n_cells)
    grid.set_active_scalars("number")
    assert drawn() == "number"
    with pytest.raises(halite.Error, match='"TimeValue"; there are "number", "other"'):
        halite.pyvista.add_volume(plotter(), grid, "TimeValue")
    grid.clear_cell_data()
    with pytest.raises(halite.Error, match="no array"):
        halite.pyvista.add_volume(plotter(), grid)


def test_with_a_slice_inside_and_updates():
    grid = mesh()
    p = plotter()
    p.set_background("black")
    p.add_mesh(grid.slice("z"), color="white", lighting=False)
    actor = halite.pyvista.add_volume(p, grid, "x", opacity=1.0, opacity_unit_distance=1.0, show_scalar_bar=False)
    first = p.screenshot(return_img=True).astype(float)
    grid["x"][:] = -grid["x"]
    grid.GetPointData().GetArray("x").Modified()
    p.render()
    second = p.screenshot(return_img=True).astype(float)
    assert actor.error is None and np.abs(first - second).max() > 20
    for effect in ("enable_anti_aliasing", "enable_eye_dome_lighting", "enable_depth_peeling"):
        getattr(p, effect)()
        p.render()
        assert actor.error is None and p.screenshot(return_img=True).max() > 60, effect
    p.close()
