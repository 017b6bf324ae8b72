# SPDX-License-Identifier: MIT OR Apache-2.0
"""Meshes of the comparison, as NumPy arrays: (points float64 (n, 3), cells int64 (m, corners), VTK's cell type, values float32).

Every field is smooth and in about [35, 285], so that one pair of transfer functions suits all.
"""
import numpy as np

TETRAHEDRON, HEXAHEDRON = 10, 12
# Two mirrored splits of a cube into five tetrahedra; neighbours take turns, so that their faces agree.
FIVE = np.array([[[0, 1, 3, 4], [1, 2, 3, 6], [1, 4, 5, 6], [3, 4, 6, 7], [1, 3, 4, 6]],
                 [[0, 1, 2, 5], [0, 2, 3, 7], [0, 4, 5, 7], [2, 5, 6, 7], [0, 2, 5, 7]]])


def wavelet(points):
    """A bump with three waves over a cube around the origin: the formula of vtkRTAnalyticSource."""
    x, y, z = (points / np.ptp(points, axis=0).max()).T
    bump = 255 * np.exp(-2 * (x * x + y * y + z * z))
    return (bump + 10 * np.sin(60 * x) + 18 * np.sin(30 * y) + 5 * np.cos(40 * z)).astype(np.float32)


def lattice(axes):
    """Points of a lattice, x fastest, and the eight corners of each of its cells with the cell's parity."""
    nx, ny, nz = map(len, axes)
    z, y, x = np.meshgrid(axes[2], axes[1], axes[0], indexing="ij")
    k, j, i = np.meshgrid(np.arange(nz - 1), np.arange(ny - 1), np.arange(nx - 1), indexing="ij")
    first = (i + nx * (j + ny * k)).ravel()
    square = np.stack([first, first + 1, first + 1 + nx, first + nx], 1)
    corners = np.concatenate([square, square + nx * ny], 1)
    return np.stack([x, y, z], -1).reshape(-1, 3), corners, ((i + j + k) % 2).ravel()


def split(corners, parity):
    """Five tetrahedra of each cube, all of positive volume."""
    tetrahedra = np.where((parity == 0)[:, None, None], corners[:, FIVE[0]], corners[:, FIVE[1]])
    return tetrahedra.reshape(-1, 4)


def positive(points, tetrahedra):
    """`tetrahedra` with the corners of those of negative volume swapped, without those of none."""
    a, b, c, d = (points[tetrahedra[:, k]] for k in range(4))
    volume = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a)
    tetrahedra = np.where((volume < 0)[:, None], tetrahedra[:, [0, 2, 1, 3]], tetrahedra)
    return tetrahedra[np.abs(volume) > 1e-9 * np.abs(volume).max()]


def box(n):
    """n³ cubes of five tetrahedra each."""
    axis = np.arange(n + 1) - n / 2
    points, corners, parity = lattice([axis] * 3)
    return points, positive(points, split(corners, parity)), TETRAHEDRON, wavelet(points)


def hexahedra(n):
    """n³ hexahedra."""
    axis = np.arange(n + 1) - n / 2
    points, corners, _ = lattice([axis] * 3)
    return points, corners, HEXAHEDRON, wavelet(points)


def boundary_layer(n):
    """A box whose layers along z grow by 15 % each from a wall: cells up to some 1000 times as wide as high."""
    axis, heights = np.arange(n + 1) - n / 2, 1.15 ** np.arange(n + 1) - 1
    points, corners, parity = lattice([axis, axis, n * (heights / heights[-1] - 0.5)])
    return points, positive(points, split(corners, parity)), TETRAHEDRON, wavelet(points)


def ball(count):
    """The Delaunay tetrahedra of `count` random points in a ball."""
    from scipy.spatial import Delaunay
    random = np.random.default_rng(1)
    directions = random.normal(size=(count, 3))
    points = 16 * directions / np.linalg.norm(directions, axis=1)[:, None] * random.random((count, 1)) ** (1 / 3)
    return points, positive(points, Delaunay(points).simplices.astype(np.int64)), TETRAHEDRON, wavelet(points)


def sieve(n):
    """`box`, with holes along all three axes: rays leave and enter it many times."""
    points, tetrahedra, kind, _ = box(n)
    middle = points[tetrahedra].mean(1)
    hole = [(np.abs((middle[:, k] + n / 2) / n * 5 % 1 - 0.5) < 0.22) for k in range(3)]
    kept = tetrahedra[~(hole[0] & hole[1] | hole[1] & hole[2] | hole[0] & hole[2])]
    used, ids = np.unique(kept, return_inverse=True)
    return points[used], ids.reshape(-1, 4), kind, wavelet(points)[used]


def write(path, mesh, cell_data=False):
    """Writes a `.vtu` with raw appended data: "s" at points, or at cells, where it is the mean of the corners."""
    points, cells, kind, values = mesh
    if cell_data:
        values = values[cells].mean(1).astype(np.float32)
    m, corners = cells.shape
    arrays = [("Float64", "points", 3, points.astype("<f8")), ("Int64", "connectivity", 1, cells.astype("<i8")),
              ("Int64", "offsets", 1, np.arange(corners, corners * m + 1, corners, dtype="<i8")),
              ("UInt8", "types", 1, np.full(m, kind, np.uint8)), ("Float32", "s", 1, values.astype("<f4"))]
    heads, at = {}, 0
    for number, name, components, data in arrays:
        heads[name] = (f'<DataArray type="{number}" Name="{name}" NumberOfComponents="{components}" format="appended" '
                       f'offset="{at}"/>')
        at += 8 + data.nbytes
    field = "CellData" if cell_data else "PointData"
    with open(path, "wb") as file:
        file.write((f'<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">'
                    f'<UnstructuredGrid><Piece NumberOfPoints="{len(points)}" NumberOfCells="{m}">'
                    f'<{field} Scalars="s">{heads["s"]}</{field}><Points>{heads["points"]}</Points>'
                    f'<Cells>{heads["connectivity"]}{heads["offsets"]}{heads["types"]}</Cells>'
                    f'</Piece></UnstructuredGrid><AppendedData encoding="raw">_').encode())
        for *_, data in arrays:
            file.write(np.uint64(data.nbytes).tobytes())
            file.write(data.tobytes())
        file.write(b"</AppendedData></VTKFile>\n")
