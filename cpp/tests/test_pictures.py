# SPDX-License-Identifier: MIT OR Apache-2.0
"""Pictures in real windows against closed forms and integrals. Where other mappers of VTK fail is said as it was measured."""
import numpy as np
from scene import *  # noqa: F403

RAMP = [(0, 0.1, 0.2, 0.9), (0.4, 0.9, 0.9, 0.1), (1, 1.0, 0.1, 0.0)]
TENT = [(0, 0), (0.5, 2), (1, 0)]
WAVES = [(0, 0), (0.2, 3), (0.3, 0.1), (0.55, 0.2), (0.6, 5), (0.7, 0), (1, 2)]
SLANT = lambda p: 0.2 * p[..., 0] + 0.3 * p[..., 1] + 0.5 * p[..., 2]


def from_above(parallel=0.7):
    return dict(position=(0.5, 0.5, 6), up=(0, 1, 0), parallel=parallel)


def middle(picture):
    h, w = picture.shape[:2]
    return picture[h // 2, w // 2]


def test_tent_opacity_in_one_cube():
    # Projected tetrahedra and the ray casters draw nothing.
    w, r = scene(volume(lattice(), TENT), **from_above())
    picture = pixels(w)
    assert list(middle(picture)) == [161] * 4, middle(picture)
    check(picture, truth(r, (64, 64), opacity=TENT))


def test_perspective_views_of_every_cell_type():
    for cells in ("hex", "voxel", "tet", "wedge", "mixed"):
        g = lattice(3, cells=cells, field=SLANT) if cells != "mixed" else lattice(3, cells="tet", field=SLANT)
        w, r = scene(volume(g, WAVES, RAMP, 0.7))
        check(pixels(w), truth(r, (64, 64), field=SLANT, opacity=WAVES, color=RAMP, unit=0.7), what=cells)


def test_pyramids_fill_a_cube():
    corners = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)] + [(0.5, 0.5, 0.5)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    g = grid(np.array(corners, float), [(PYRAMID, [*f, 8]) for f in faces], SLANT(np.array(corners)))
    w, r = scene(volume(g, WAVES, RAMP))
    check(pixels(w), truth(r, (64, 64), field=SLANT, opacity=WAVES, color=RAMP))


def test_polyhedra_and_curved_cells():
    corners = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    stream = [len(faces)] + [n for f in faces for n in (4, *f)]
    g = grid(corners, [], SLANT(corners))
    ids = vtkCommonCore.vtkIdList()
    for n in stream:
        ids.InsertNextId(n)
    g.InsertNextCell(vtkCommonDataModel.VTK_POLYHEDRON, ids)
    w, r = scene(volume(g, WAVES, RAMP))
    check(pixels(w), truth(r, (64, 64), field=SLANT, opacity=WAVES, color=RAMP), what="polyhedron")

    sequence = (0, 1, 3, 2, 4, 5, 7, 6)
    edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
    nodes = corners[list(sequence)]
    nodes = np.concatenate([nodes, [(nodes[a] + nodes[b]) / 2 for a, b in edges]])
    g = grid(nodes, [(vtkCommonDataModel.VTK_QUADRATIC_HEXAHEDRON, range(20))], SLANT(nodes))
    w, r = scene(volume(g, WAVES, RAMP))
    check(pixels(w), truth(r, (64, 64), field=SLANT, opacity=WAVES, color=RAMP), what="quadratic hexahedron")


def test_small_cell_beside_one_thirty_times_larger():
    # Projected tetrahedra lose the small one in perspective views.
    def with_giant(giant):
        points = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
        cells = [(VOXEL, range(8))]
        if giant:
            points += [(200, 0, 0), (260, 0, 0), (200, 60, 0), (200, 0, 60)]
            cells.append((TETRA, range(8, 12)))
        return grid(np.array(points, float), cells, np.ones(len(points)))
    for giant in (False, True):
        v = volume(with_giant(giant), [(0, 0.8)])
        w, r = scene(v, clip=(0.5, 600))
        check(pixels(w), truth(r, (64, 64), opacity=[(0, 0.8)]), what=f"giant {giant}")


def test_matrices():
    # Scale 2 makes projected tetrahedra vanish, and scales that are not uniform sort them wrongly.
    shear = np.eye(4)
    shear[0, 1], shear[1, 2] = 0.7, -0.4
    stretch = np.diag([1.5, 0.4, 2.2, 1])
    mirror = np.diag([-1, 1, 1, 1.0])
    mirror[:3, 3] = (0.3, -0.1, 0.2)
    for name, m in dict(scale=np.diag([2.0, 2, 2, 1]), stretch=stretch, shear=shear @ stretch, mirror=mirror).items():
        v = volume(lattice(2, field=SLANT), WAVES, RAMP)
        v.SetUserMatrix(transform(m))
        w, r = scene(v, position=(5, -6, 7))
        check(pixels(w), truth(r, (64, 64), field=SLANT, opacity=WAVES, color=RAMP, matrix=m), what=name)
    # The same mapper from one to the next: points move; where hands change, the mesh is handed over again.
    v = volume(lattice(2, field=SLANT), WAVES, RAMP)
    w, r = scene(v, position=(5, -6, 7), clip=(1, 30))
    for m in (np.eye(4), stretch, mirror, shear @ stretch, np.diag([9.0, 9, 9, 1]), np.eye(4)):
        v.SetUserMatrix(transform(m))
        picture = pixels(w)
        check(picture, truth(r, (64, 64), field=SLANT, opacity=WAVES, color=RAMP, matrix=m), what=str(m))
    m = v.GetMapper()
    assert m.GetNumberOfMeshUploads() == 3 and m.GetNumberOfPointUploads() == 3, (m.GetNumberOfMeshUploads(), m.GetNumberOfPointUploads())


def test_actor_scale_of_two():
    v = volume(lattice(), [(0, 0.5)])
    v.SetScale(2)
    w, r = scene(v, position=(1, 1, 9), focus=(1, 1, 1), up=(0, 1, 0), parallel=1.5)
    expected = 255 * (1 - np.exp(-1.0))
    assert abs(middle(pixels(w))[0] - expected) < 1, middle(pixels(w))


def test_right_half_of_a_window():
    # Projected tetrahedra draw nothing there.
    g = lattice(2, field=SLANT)
    w = window((128, 64))
    left = renderer(w, volume(g, WAVES, RAMP), viewport=(0, 0, 0.5, 1))
    right = renderer(w, volume(g, TENT, RAMP), viewport=(0.5, 0, 1, 1))
    look(left)
    look(right, position=(-2, -3, 1))
    picture = pixels(w)
    check(picture[:, :64], truth(left, (64, 64), field=SLANT, opacity=WAVES, color=RAMP), what="left")
    check(picture[:, 64:], truth(right, (64, 64), field=SLANT, opacity=TENT, color=RAMP), what="right")


def test_camera_inside():
    # Projected tetrahedra and the ray casters draw nothing.
    for position, focus in (((0.5, 0.4, 0.3), (0.9, 0.8, 1)), ((0.1, 0.1, 0.9), (1, 0.5, 0))):
        w, r = scene(volume(lattice(3, field=SLANT), WAVES, RAMP), position=position, focus=focus, angle=80, clip=(1e-3, 10))
        check(pixels(w), truth(r, (64, 64), field=SLANT, opacity=WAVES, color=RAMP))


def test_near_plane_cuts_cells():
    w, r = scene(volume(lattice(2, field=SLANT), WAVES, RAMP), clip=(2.9, 3.6))
    check(pixels(w), truth(r, (64, 64), field=SLANT, opacity=WAVES, color=RAMP))


def test_opaque_plane_in_mid_cell():
    # Others draw anything from 0 to 161; half of the cube is 100.3 everywhere.
    for samples in (0, 8):
        w, r = scene(volume(lattice(), [(0, 1)]), plane(0.5), samples=samples, **from_above(0.4))
        picture = pixels(w)
        assert set(np.unique(picture[..., :3])) == {100}, np.unique(picture[..., :3])
        assert set(np.unique(picture[..., 3])) == {255}


def test_opaque_geometry_in_front_behind_and_inside():
    for z in (-0.5, 0.25, 0.8, 1.5):
        v = volume(lattice(2, field=SLANT), WAVES, RAMP)
        w, r = scene(v, plane(z, (0.2, 0.6, 0.4)), position=(2, -3, 4))
        over = truth(r, (64, 64), field=SLANT, opacity=WAVES, color=RAMP, keep=lambda p: p[..., 2] > z)
        paint = np.array([0.2, 0.6, 0.4, 1]) * 255
        expected = over + (1 - over[..., 3:] / 255) * np.round(paint)
        # The plane ends somewhere: beyond it is background.
        picture = pixels(w)
        ends = picture[..., 3] < 255
        check(np.where(ends[..., None], 0, picture), np.where(ends[..., None], 0, expected), what=f"z = {z}")


def test_offset_of_a_million():
    # Projected tetrahedra are 42 of 255 off on average.
    around = dict(position=(2.1, -1.7, 2.9), focus=(0.5, 0.5, 0.5), clip=(1, 8))
    _, r = scene(volume(lattice()), **around)
    expected = truth(r, (64, 64), field=SLANT, opacity=WAVES, color=RAMP)
    for offset in (np.array([1e6, 2e6, 500.0]), np.array([-3e4, 0, 1e4])):
        g = lattice(3, low=offset, high=offset + 1, field=lambda p: SLANT(p - offset))
        there = {k: tuple(offset + around[k]) for k in ("position", "focus")}
        w, _ = scene(volume(g, WAVES, RAMP), clip=(1, 8), **there)
        check(pixels(w), expected, what=str(offset))


def test_mixed_grid_with_cells_of_two_dimensions():
    # Projected tetrahedra report an error and draw nothing.
    g = lattice(1, cells="hex", field=SLANT)
    g.InsertNextCell(QUAD, 4, [0, 1, 2, 3])
    g.InsertNextCell(3, 2, [0, 5])
    g.InsertNextCell(1, 1, [2])
    v = volume(g, WAVES, RAMP)
    errors = Errors(v.GetMapper())
    w, r = scene(v)
    check(pixels(w), truth(r, (64, 64), field=SLANT, opacity=WAVES, color=RAMP))
    assert len(errors) == 0


def half_grid():
    """Two bricks; the upper one is to be left out."""
    points = np.array([(x, y, z) for z in (0, 1, 2) for y in (0, 1) for x in (0, 1)], float)
    return grid(points, [(VOXEL, range(8)), (VOXEL, range(4, 12))], points[:, 2])


def test_hidden_and_ghost_cells():
    # Projected tetrahedra draw them.
    for flag in (1, 8, 32):
        g = half_grid()
        add(g, np.array([0, flag], np.uint8), "vtkGhostType", "cell")
        w, r = scene(volume(g, TENT), clip=(0.1, 20))
        check(pixels(w), truth(r, (64, 64), opacity=TENT), what=f"flag {flag}")
    g = half_grid()
    add(g, np.array([0] * 8 + [2] * 4, np.uint8), "vtkGhostType")
    w, r = scene(volume(g, TENT), clip=(0.1, 20))
    check(pixels(w), truth(r, (64, 64), opacity=TENT), what="hidden points")


def test_removed_cells_leave_room():
    """VTK removes ghosts from a grid and leaves room, with anything in it, behind what cells name."""
    g = half_grid()
    add(g, np.array([0, 1], np.uint8), "vtkGhostType", "cell")
    g.RemoveGhostCells()
    w, r = scene(volume(g, TENT), clip=(0.1, 20))
    check(pixels(w), truth(r, (64, 64), opacity=TENT), what="removed")
    g = half_grid()
    cells = g.GetCells()
    corners = numpy_support.vtk_to_numpy(cells.GetConnectivityArray()).astype(np.int64)
    starts = numpy_support.vtk_to_numpy(cells.GetOffsetsArray()).astype(np.int64)
    roomy = vtkCommonDataModel.vtkCellArray()
    roomy.SetData(*(numpy_support.numpy_to_vtkIdTypeArray(a, deep=1) for a in (starts, np.append(corners, [-7, 1 << 40]))))
    g.SetCells(VOXEL, roomy)
    w, r = scene(volume(g, TENT), clip=(0.1, 20))
    check(pixels(w), truth(r, (64, 64), high=(1, 1, 2), opacity=TENT), what="with room")


def test_blanked_cells_change():
    g = half_grid()
    ghosts = add(g, np.array([0, 32], np.uint8), "vtkGhostType", "cell")
    w, r = scene(volume(g, TENT), clip=(0.1, 20))
    pixels(w)
    ghosts.SetValue(1, 0)
    ghosts.Modified()
    check(pixels(w), truth(r, (64, 64), high=(1, 1, 2), opacity=TENT))


def test_clipping_planes():
    v = volume(lattice(2, field=SLANT), WAVES, RAMP)
    w, r = scene(v)
    for origin, normal in (((0.4, 0, 0), (1, 0.5, 0)), ((0, 0, 0.7), (0, 0, -1))):
        p = vtkCommonDataModel.vtkPlane()
        p.SetOrigin(*origin)
        p.SetNormal(*normal)
        v.GetMapper().AddClippingPlane(p)
    kept = lambda p: (p[..., 0] - 0.4 + 0.5 * p[..., 1] > 0) & (p[..., 2] < 0.7)
    expected = truth(r, (64, 64), field=SLANT, opacity=WAVES, color=RAMP, keep=kept, steps=2000)
    check(pixels(w), expected)
    v.GetMapper().RemoveAllClippingPlanes()
    check(pixels(w), truth(r, (64, 64), field=SLANT, opacity=WAVES, color=RAMP))


def test_maximum_intensity():
    rising = [(0, 0), (1, 0.9)]
    v = volume(lattice(2, field=SLANT), rising, RAMP)
    v.GetMapper().SetBlendModeToMaximumIntensity()
    w, r = scene(v)
    expected = truth(r, (64, 64), field=SLANT, opacity=rising, color=RAMP, maximum=True, steps=1000)
    check(pixels(w), expected)
    v.GetMapper().SetBlendModeToComposite()
    check(pixels(w), truth(r, (64, 64), field=SLANT, opacity=rising, color=RAMP))


def test_background_shows_through():
    w, r = scene(volume(lattice(), TENT, RAMP))
    r.SetBackground(0.2, 0.4, 0.6)
    over = truth(r, (64, 64), opacity=TENT, color=RAMP)
    expected = over[..., :3] + (1 - over[..., 3:] / 255) * np.array([51, 102, 153])
    check(pixels(w)[..., :3], expected)


def test_two_volumes_in_one_scene():
    low = volume(lattice(2, field=SLANT), [(0, 0.7)], [(0, 1, 0, 0)])
    high = volume(lattice(2, low=(0, 0, 2), high=(1, 1, 3), field=SLANT), [(0, 0.7)], [(0, 0, 1, 0)])
    w, r = scene(low, high, position=(0.5, 0.5, 9), up=(0, 1, 0), parallel=0.4)
    a = 1 - np.exp(-0.7)
    got = middle(pixels(w))
    # Volumes are drawn from far to near.
    assert max(abs(got[:2] - 255 * np.array([a * (1 - a), a]))) < NEAR, got


if __name__ == "__main__":
    main(globals())
