# SPDX-License-Identifier: MIT OR Apache-2.0
"""Boxes of cells, and the truth about their pictures.

A box that is filled with a field linear in x, y and z looks the same however it is cut into cells, so its picture can be had
without cells: `truth` integrates along the ray of each pixel, which it takes from VTK's camera.
"""
import os
import sys

import numpy as np
from vtkmodules.util import numpy_support
from vtkmodules import vtkCommonCore, vtkCommonDataModel

TETRA, VOXEL, HEXAHEDRON, WEDGE, PYRAMID, QUAD = 10, 11, 12, 13, 14, 9

# How far a picture of bytes may be from the truth.
NEAR = 1.5
WHITE = [(0, 1, 1, 1)]


def grid(points, cells, array=None, name="s", of="point", kind=None):
    """An unstructured grid; `cells` are pairs of a VTK type and point ids."""
    g = vtkCommonDataModel.vtkUnstructuredGrid()
    p = vtkCommonCore.vtkPoints()
    p.SetDataType(kind or vtkCommonCore.VTK_DOUBLE)
    p.SetData(numpy_support.numpy_to_vtk(np.ascontiguousarray(points), deep=1))
    g.SetPoints(p)
    g.Allocate(len(cells))
    for cell_type, ids in cells:
        g.InsertNextCell(cell_type, len(ids), [int(i) for i in ids])
    if array is not None:
        add(g, array, name, of)
    return g


def add(g, array, name="s", of="point"):
    a = numpy_support.numpy_to_vtk(np.ascontiguousarray(array), deep=1)
    a.SetName(name)
    data = g.GetPointData() if of == "point" else g.GetCellData()
    data.AddArray(a)
    if data.GetScalars() is None:
        data.SetActiveScalars(name)
    return a


def lattice(n=1, low=(0, 0, 0), high=(1, 1, 1), cells="hex", field=lambda p: p[:, 2], dtype=float):
    """A box of n^3 bricks, as one kind of cell or a mixture of all, with a field at its points."""
    low, high = np.array(low, float), np.array(high, float)
    axis = np.arange(n + 1) / n
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    points = low + (high - low) * np.stack([x, y, z], -1).reshape(-1, 3)
    at = lambda i, j, k: i + (n + 1) * (j + (n + 1) * k)
    out = []
    for k in range(n):
        for j in range(n):
            for i in range(n):
                h = [at(i, j, k), at(i + 1, j, k), at(i + 1, j + 1, k), at(i, j + 1, k)]
                h += [at(i, j, k + 1), at(i + 1, j, k + 1), at(i + 1, j + 1, k + 1), at(i, j + 1, k + 1)]
                kind = cells if cells != "mixed" else ("hex", "voxel", "tet", "wedge", "pyramid")[(i + 2 * j + 3 * k) % 5]
                if kind == "hex":
                    out.append((HEXAHEDRON, h))
                elif kind == "voxel":
                    out.append((VOXEL, [h[q] for q in (0, 1, 3, 2, 4, 5, 7, 6)]))
                elif kind == "tet":
                    for t in ((0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)):
                        out.append((TETRA, [h[q] for q in t]))
                elif kind == "wedge":
                    out += [(WEDGE, [h[q] for q in (0, 3, 1, 4, 7, 5)]), (WEDGE, [h[q] for q in (2, 1, 3, 6, 5, 7)])]
                else:
                    # Six pyramids would need a point in the middle; two tetrahedra and a pyramid on a corner do not.
                    out += [(PYRAMID, [h[q] for q in (0, 1, 2, 3, 4)]), (PYRAMID, [h[q] for q in (1, 2, 6, 5, 4)]),
                            (PYRAMID, [h[q] for q in (2, 3, 7, 6, 4)])]
    points = points.astype(dtype)
    return grid(points, out, field(points.astype(float)))


def rows(m):
    return np.array([[m.GetElement(i, j) for j in range(4)] for i in range(4)])


def rays(r, size):
    """Origin (on the near plane) and far end of each pixel's ray in the world, as VTK's camera has it."""
    w, h = size
    # VTK's matrix of both knows no eyes.
    c = r.GetActiveCamera()
    m = np.linalg.inv(rows(c.GetProjectionTransformMatrix(w / h, -1, 1)) @ rows(c.GetViewTransformMatrix()))
    x, y = np.meshgrid((np.arange(w) + 0.5) / w * 2 - 1, (np.arange(h) + 0.5) / h * 2 - 1)
    ends = []
    for z in (-1, 1):
        p = np.stack([x, y, np.full_like(x, z), np.ones_like(x)], -1) @ m.T
        ends.append(p[..., :3] / p[..., 3:])
    return ends


def interpolate(knots, s):
    knots = np.array(knots, float)
    return np.stack([np.interp(s, knots[:, 0], knots[:, k]) for k in range(1, knots.shape[1])], -1)


def truth(r, size, low=(0, 0, 0), high=(1, 1, 1), field=lambda p: p[..., 2], opacity=((0, 1),), color=WHITE, unit=1.0,
          matrix=np.eye(4), keep=lambda p: True, maximum=False, steps=300, slab=False, hue=None, factor=lambda p: 1,
          lit=lambda rgb, world, along: rgb):
    """The picture of a box under `matrix`, in bytes, of what `keep` says of points in the world. Colours are those of another
    field, `hue`, if it is given. Extinction is multiplied by `factor`, and colours are `lit`, at points of the world."""
    start, end = rays(r, size)
    inverse = np.linalg.inv(matrix)
    to_model = lambda p: p @ inverse[:3, :3].T + inverse[:3, 3]
    a, b = to_model(start), to_model(end)
    with np.errstate(divide="ignore", invalid="ignore"):
        t0, t1 = (np.array(low) - a) / (b - a), (np.array(high) - a) / (b - a)
    near = np.nanmax(np.minimum(t0, t1), -1).clip(0, 1)
    far = np.nanmin(np.maximum(t0, t1), -1).clip(0, 1)
    far = np.maximum(near, far)
    at = lambda u: start[..., None, :] + (end - start)[..., None, :] * (near[..., None] + (far - near)[..., None] * u)[..., None]
    # The parts of a ray that count as one value end where a function bends or jumps, if the field is linear.
    edges = np.broadcast_to(np.linspace(0, 1, steps + 1), (*near.shape, steps + 1))
    for f, knots in ((field, opacity), (hue or field, color)):
        ends = f(to_model(at(np.array([0, 0.37, 1]))))
        if len(knots) < 100 and np.abs(ends @ [0.63, -1, 0.37]).max() < 1e-9 * np.abs(ends).max():
            with np.errstate(divide="ignore", invalid="ignore"):
                bends = (np.array([k[0] for k in knots]) - ends[..., :1]) / (ends[..., 2:] - ends[..., :1])
            edges = np.concatenate([edges, np.nan_to_num(bends).clip(0, 1)], -1)
    edges = np.sort(edges, -1)
    world = at((edges[..., 1:] + edges[..., :-1]) / 2)
    length = (np.linalg.norm(end - start, axis=-1) * (far - near))[..., None] * np.diff(edges, axis=-1)
    s = field(to_model(world))
    alpha = interpolate(opacity, s)[..., 0] * keep(world)
    rgb = interpolate(color, hue(to_model(world)) if hue else s)
    if maximum:
        inside = (far > near)[..., None] & np.broadcast_to(keep(world), s.shape)
        best = np.max(np.where(inside, s, -np.inf), -1)
        seen = np.isfinite(best)
        top = np.where(seen, best, 0)
        a = interpolate(opacity, top)[..., 0].clip(0, 1) * seen
        return 255 * np.concatenate([interpolate(color, top) * a[..., None], a[..., None]], -1)
    rgb = lit(rgb, world, ((end - start) / np.linalg.norm(end - start, axis=-1, keepdims=True))[..., None, :])
    tau = (-np.log1p(-alpha) if slab else alpha) / unit * length * factor(world)
    through = np.exp(-np.cumsum(tau, -1))
    before = np.concatenate([np.ones_like(through[..., :1]), through[..., :-1]], -1)
    light = np.sum((before - through)[..., None] * rgb, -2)
    return 255 * np.concatenate([light, 1 - through[..., -1:]], -1)


def check(picture, expected, near=NEAR, what=""):
    """Fails unless the two are near each other everywhere, and something is to be seen."""
    apart = np.abs(picture - expected)
    worst = np.unravel_index(np.argmax(apart), apart.shape)
    assert np.max(expected) > 20, f"{what}: there is nothing to compare with"
    if "HALITE_TEST_WORST" in os.environ:
        print(f"        {apart[worst]:.2f}  {what}")
    if apart[worst] > near:
        save(picture, "picture")
        save(np.broadcast_to(expected, picture.shape), "expected")
        raise AssertionError(f"{what}: {apart[worst]:.2f} apart at {worst}, mean {apart.mean():.3f}: "
                             f"{picture[worst[:2]]} is not {np.broadcast_to(expected, picture.shape)[worst[:2]]}")
    return apart[worst]


def save(picture, name):
    folder = os.environ.get("HALITE_TEST_OUTPUT")
    if folder:
        np.save(os.path.join(folder, f"{os.path.basename(sys.argv[0])}-{name}.npy"), picture)
