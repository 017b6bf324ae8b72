# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the tests share: a box whose picture is known in closed form."""
import os

import numpy as np
import pytest

# Opacity 1 over a length of 1 / K.
K, COLOR = 1.1, (1.0, 0.4, 0.1)


def lattice(n=2):
    """Points, connectivity, offsets and types of the cube [-1, 1]^3 as n^3 hexahedra."""
    axis = np.linspace(-1, 1, n + 1)
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    points = np.stack([x, y, z], -1).reshape(-1, 3)
    k, j, i = (a.ravel() for a in np.meshgrid(*[np.arange(n)] * 3, indexing="ij"))
    first, m = i + (n + 1) * (j + (n + 1) * k), n + 1
    cells = first[:, None] + np.array([0, 1, m + 1, m, m * m, m * m + 1, m * m + m + 1, m * m + m])
    return points, cells.ravel(), np.arange(n ** 3 + 1) * 8, np.full(n ** 3, 12)


def chord(to_clip, width, height, depth=None):
    """Premultiplied RGBA of the box, row 0 uppermost, whose rays end at window depths."""
    x, y = np.meshgrid(2 * (np.arange(width) + 0.5) / width - 1, 1 - 2 * (np.arange(height) + 0.5) / height)
    inverse = np.linalg.inv(to_clip)

    def at(z):
        p = np.stack([x, y, z, np.ones_like(x)], -1) @ inverse.T
        return p[..., :3] / p[..., 3:]

    near, far = at(-np.ones_like(x)), at(np.ones_like(x) if depth is None else 2.0 * depth - 1)
    way = far - near
    length = np.linalg.norm(way, axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (-1 - near) * (length[..., None] / way), (1 - near) * (length[..., None] / way)
    begin = np.minimum(a, b).max(-1).clip(0)
    end = np.minimum(np.maximum(a, b).min(-1), length)
    alpha = 1 - np.exp(-K * np.maximum(end - begin, 0))
    return np.dstack([alpha[..., None] * COLOR, alpha])


def perspective(angle, aspect, near, far):
    f = 1 / np.tan(np.radians(angle) / 2)
    return np.array([[f / aspect, 0, 0, 0], [0, f, 0, 0],
                     [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)], [0, 0, -1, 0]])


def look_at(eye, focus=(0, 0, 0), up=(0, 0, 1)):
    back = np.subtract(eye, focus) / np.linalg.norm(np.subtract(eye, focus))
    right = np.cross(up, back) / np.linalg.norm(np.cross(up, back))
    m = np.eye(4)
    m[:3, :3] = [right, np.cross(back, right), back]
    m[:3, 3] = -m[:3, :3] @ eye
    return m


def tetrahedron(path, scalars=(0, 1, 2, 3)):
    """A file with one tetrahedron and its scalars."""
    def array(kind, name, numbers, more=""):
        return f'<DataArray type="{kind}" Name="{name}" format="ascii"{more}>{" ".join(map(str, numbers))}</DataArray>'

    path.write_text('<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian"><UnstructuredGrid>'
                    '<Piece NumberOfPoints="4" NumberOfCells="1"><PointData>' + array("Float32", "s", scalars) + "</PointData><Points>"
                    + array("Float64", "Points", [0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1], ' NumberOfComponents="3"') + "</Points><Cells>"
                    + array("Int64", "connectivity", [0, 1, 2, 3]) + array("Int64", "offsets", [4]) + array("UInt8", "types", [10])
                    + "</Cells></Piece></UnstructuredGrid></VTKFile>\n")


def resident():
    """Bytes of memory that this process has."""
    with open("/proc/self/statm") as f:
        return int(f.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def grown(work):
    """What `work` gives, and the most bytes of memory that this process had meanwhile beside those that it had before."""
    with open("/proc/self/clear_refs", "w") as f:
        f.write("5")
    before = resident()
    result = work()
    with open("/proc/self/status") as f:
        most = next(int(line.split()[1]) * 1024 for line in f if line.startswith("VmHWM"))
    return result, most - before


@pytest.fixture
def box():
    import halite
    points, cells, offsets, types = lattice()
    return halite.Mesh.from_arrays(points, cells, offsets, types, point_data={"s": np.ones(len(points))},
                                   cell_data={"c": np.arange(8.0)})


@pytest.fixture
def fog():
    import halite
    return halite.TransferFunction([(0, *COLOR)], opacity=1.0, unit_distance=1 / K)
