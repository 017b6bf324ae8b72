# SPDX-License-Identifier: MIT OR Apache-2.0
"""Ways in which windows of VTK show what is in them, pixel by pixel against closed forms."""
import numpy as np
import pytest

pytest.importorskip("vtkmodules")

from vtkmodules import vtkCommonDataModel, vtkCommonTransforms, vtkRenderingAnnotation, vtkRenderingCore, vtkRenderingOpenGL2  # noqa: E402
from vtkmodules import vtkInteractionWidgets, vtkRenderingFreeType  # noqa: E402, F401
from vtkmodules.util.numpy_support import vtk_to_numpy  # noqa: E402

import halite  # noqa: E402
import halite.vtk  # noqa: E402
from conftest import COLOR, K, chord  # noqa: E402
from windows import NEAR, SIZE, depth_of, grid, over, pixels, plane, renderer, to_clip, window  # noqa: E402

WIDTH, HEIGHT = SIZE


def test_text_goes_on_top(fog):
    """A box with a text, and a text by itself: their pixels are those of a window without a volume."""
    def texts(r):
        text = vtkRenderingCore.vtkTextActor()
        text.SetInput("Halite")
        text.GetTextProperty().SetFontSize(24)
        text.GetTextProperty().SetBackgroundColor(0, 0, 0.5)
        text.GetTextProperty().SetBackgroundOpacity(1)
        text.SetPosition(WIDTH // 2 - 40, HEIGHT // 2)
        r.AddViewProp(text)
        bar = vtkRenderingAnnotation.vtkScalarBarActor()
        bar.SetNumberOfLabels(2)
        bar.DrawBackgroundOn()
        r.AddViewProp(bar)

    alone, r = renderer(), renderer()
    for each in (alone, r):
        texts(each)
    without = pixels(window(alone))[..., :3]
    halite.vtk.add_volume(r, grid(), transfer=fog)
    w = window(r)
    picture = pixels(w)[..., :3]
    is_text = without.max(-1) > 0
    opaque = is_text & (np.abs(without - (0, 0, 127.5)).max(-1) < 1)
    assert opaque.sum() > 300 and (chord(to_clip(r), *SIZE)[..., 3][opaque] > 0.3).sum() > 200
    assert np.abs(picture - without)[opaque].max() < NEAR
    assert np.abs(picture - over(chord(to_clip(r), *SIZE), (0, 0, 0)))[~is_text].max() < NEAR


def eye_to_clip(r, left):
    """World to clip of an eye, by the camera of a window that has drawn in stereo."""
    c = r.GetActiveCamera()
    assert c.GetStereo()
    c.SetLeftEye(left)
    return to_clip(r)


@pytest.mark.parametrize("kind", ["Left", "Right", "RedBlue", "Interlaced", "SplitViewportHorizontal", "CrystalEyes"])
def test_stereo(fog, kind):
    r = renderer((0.2, 0.1, 0.3))
    inside = plane(0.0)
    r.AddActor(inside)
    halite.vtk.add_volume(r, grid(), transfer=fog)
    w = window(r)
    w.SetStereoCapableWindow(kind == "CrystalEyes")
    getattr(w, f"SetStereoTypeTo{kind}")()
    w.StereoRenderOn()
    r.GetActiveCamera().SetEyeAngle(6)
    r.ResetCameraClippingRange()
    picture = pixels(w)[..., :3]

    def truth(left):
        matrix = eye_to_clip(r, left)
        n = np.array([3, -2.5, 2]) / np.linalg.norm([3, -2.5, 2])
        # The plane is tilted to this eye: its depth differs from pixel to pixel.
        x, y = np.meshgrid(2 * (np.arange(WIDTH) + 0.5) / WIDTH - 1, 1 - 2 * (np.arange(HEIGHT) + 0.5) / HEIGHT)
        inverse = np.linalg.inv(matrix)
        ends = [np.stack([x, y, z * np.ones_like(x), np.ones_like(x)], -1) @ inverse.T for z in (-1, 1)]
        a, b = (e[..., :3] / e[..., 3:] for e in ends)
        at = a + (b - a) * (-(a @ n) / ((b - a) @ n))[..., None]
        p = np.concatenate([at, np.ones_like(x)[..., None]], -1) @ matrix.T
        return over(chord(matrix, WIDTH, HEIGHT, 0.5 + 0.5 * p[..., 2] / p[..., 3]), (0.2, 0.4, 0.8))

    left, right = truth(1), truth(0)
    assert np.abs(left - right).max() > 20
    near = lambda shown, wanted: np.abs(shown - wanted).max() < NEAR
    if kind in ("Left", "Right"):
        assert near(picture, left if kind == "Left" else right)
    elif kind == "CrystalEyes":
        assert near(picture, left) or near(picture, right)
    elif kind == "RedBlue":
        # Grey of each eye, rounded twice.
        assert np.abs(picture[..., 0] - left.mean(-1)).max() < 2 and np.abs(picture[..., 2] - right.mean(-1)).max() < 2
    elif kind == "SplitViewportHorizontal":
        # VTK takes every other column, and another one where the halves meet.
        halves = (picture[:, :WIDTH // 2], picture[:, WIDTH // 2:])
        assert near(halves[0], left[:, ::2]) and near(halves[1][:, 1:-1], right[:, 2:-2:2])
    else:
        rows = [[near(shown, wanted) for shown, wanted in zip(picture, eye)] for eye in (left, right)]
        assert all(map(any, zip(*rows))) and sum(rows[0]) > 40 and sum(rows[1]) > 40


def tiled(w, scale):
    shot = vtkRenderingCore.vtkWindowToImageFilter()
    shot.SetInput(w)
    shot.SetScale(scale)
    shot.SetInputBufferTypeToRGBA()
    shot.ReadFrontBufferOff()
    shot.Update()
    image = shot.GetOutput()
    return vtk_to_numpy(image.GetPointData().GetScalars()).reshape(scale * HEIGHT, scale * WIDTH, 4)[::-1].astype(float)


@pytest.mark.parametrize("scale", [2, 3])
def test_tiles_are_the_picture(fog, scale):
    """A picture of tiles is that of a window as large as all of them."""
    def scene():
        r = renderer((0.1, 0.3, 0.2))
        r.AddActor(plane(0.2))
        halite.vtk.add_volume(r, grid(), transfer=fog)
        return r

    small, large = scene(), scene()
    w, big = window(small), window(large, size=(scale * WIDTH, scale * HEIGHT))
    w.Render()
    direct = pixels(big)
    assert np.abs(tiled(w, scale)[..., :3] - direct[..., :3]).max() <= 1
    truth = chord(to_clip(large), scale * WIDTH, scale * HEIGHT, np.full((scale * HEIGHT, scale * WIDTH), depth_of(large, 0.2)))
    assert np.abs(direct[..., :3] - over(truth, (0.2, 0.4, 0.8))).max() < NEAR


@pytest.mark.parametrize("alpha", [0.0, 0.25, 1.0])
def test_background_alpha(fog, alpha):
    r = renderer((0.5, 0.25, 0.0))
    r.SetBackgroundAlpha(alpha)
    halite.vtk.add_volume(r, grid(), transfer=fog)
    w = window(r)
    picture, truth = pixels(w), chord(to_clip(r), *SIZE)
    assert np.abs(picture[..., 3] - 255 * (truth[..., 3] + (1 - truth[..., 3]) * alpha)).max() < NEAR
    # VTK clears with the colour itself or its product, by release.
    corner = picture[0, 0, :3]
    assert any(np.abs(corner - 255 * np.array(r.GetBackground()) * share).max() <= 1 for share in (1, alpha))
    assert np.abs(picture[..., :3] - over(truth, corner / 255)).max() < NEAR


def test_a_matrix_moves_it(fog):
    r = renderer()
    v = halite.vtk.add_volume(r, grid(), transfer=fog)
    v.SetScale(0.5, 1.25, 0.75)
    v.SetPosition(0.2, -0.1, 0.3)
    v.RotateZ(30)
    turn = vtkCommonTransforms.vtkTransform()
    turn.RotateX(20)
    v.SetUserTransform(turn)
    w = window(r)
    r.ResetCamera()
    r.ResetCameraClippingRange()
    picture = pixels(w)[..., :3]
    placed = np.array([[v.GetMatrix().GetElement(i, j) for j in range(4)] for i in range(4)])
    # A ray's length in the world, of its way in the box as it is before the matrix.
    x, y = np.meshgrid(2 * (np.arange(WIDTH) + 0.5) / WIDTH - 1, 1 - 2 * (np.arange(HEIGHT) + 0.5) / HEIGHT)
    inverse = np.linalg.inv(to_clip(r) @ placed)
    near, far = (np.stack([x, y, z * np.ones_like(x), np.ones_like(x)], -1) @ inverse.T for z in (-1, 1))
    near, far = near[..., :3] / near[..., 3:], far[..., :3] / far[..., 3:]
    way = far - near
    a, b = (-1 - near) / way, (1 - near) / way
    share = np.clip(np.maximum(a, b).min(-1) - np.minimum(a, b).max(-1).clip(0), 0, None)
    length = share * np.linalg.norm(way @ placed[:3, :3].T, axis=-1)
    alpha = 1 - np.exp(-K * length)
    assert alpha.max() > 0.6 and np.abs(picture - 255 * alpha[..., None] * COLOR).max() < NEAR
    low_high = np.reshape(v.GetBounds(), (3, 2))
    corners = np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T @ placed[:3, :3].T + placed[:3, 3]
    assert low_high[:, 0] == pytest.approx(corners.min(0)) and low_high[:, 1] == pytest.approx(corners.max(0))


def test_two_windows_at_once(fog):
    """One volume, two renderers, two windows in turns; one of them is finalized, and comes back."""
    first, second = renderer((0.2, 0, 0)), renderer((0, 0, 0.4))
    v = halite.vtk.Volume(grid(), transfer=fog)
    for r in (first, second):
        v.add_to(r)
    second.GetActiveCamera().SetPosition(-2, 3, 2.5)
    windows = [window(first), window(second, size=(90, 100))]
    for _ in range(2):
        for w, r, size, background in zip(windows, (first, second), (SIZE, (90, 100)), ((0.2, 0, 0), (0, 0, 0.4))):
            picture = pixels(w)[..., :3]
            assert np.abs(picture - over(chord(to_clip(r), *size), background)).max() < NEAR
    windows[0].Finalize()
    assert np.abs(pixels(windows[1])[..., :3] - over(chord(to_clip(second), 90, 100), (0, 0, 0.4))).max() < NEAR
    assert np.abs(pixels(windows[0])[..., :3] - over(chord(to_clip(first), *SIZE), (0.2, 0, 0))).max() < NEAR and v.error is None


def test_the_one_added_last_is_over_the_others(fog):
    """Volumes in one renderer: the order in which they were added, whatever is in front."""
    green = halite.TransferFunction([(0, 0, 1, 0)], opacity=1.0, unit_distance=0.7)
    for first_is_green in (True, False):
        r = renderer()
        for transfer in ((green, fog) if first_is_green else (fog, green)):
            halite.vtk.add_volume(r, grid(), transfer=transfer)
        w = window(r)
        picture = pixels(w)[..., :3]
        box = chord(to_clip(r), *SIZE)
        length = -np.log1p(-box[..., 3]) / K
        alpha = 1 - np.exp(-length / 0.7)
        other = np.dstack([0 * alpha, alpha, 0 * alpha, alpha])
        below, above = (other, box) if first_is_green else (box, other)
        assert np.abs(picture - over(above, below[..., :3])).max() < 2 * NEAR


def test_pickers_find_what_lies_behind(fog):
    r = renderer()
    v = halite.vtk.add_volume(r, grid(), transfer=fog)
    behind = plane(-4.0)
    r.AddActor(behind)
    w = window(r)
    r.ResetCameraClippingRange()
    before = pixels(w)
    at = (WIDTH // 2, HEIGHT // 2)
    n = np.array([3, -2.5, 2]) / np.linalg.norm([3, -2.5, 2])
    cells = vtkRenderingCore.vtkCellPicker()
    assert cells.Pick(*at, 0, r) and cells.GetActor() is behind
    assert np.dot(cells.GetPickPosition(), n) == pytest.approx(-4, abs=1e-3)
    world = vtkRenderingCore.vtkWorldPointPicker()
    world.Pick(*at, 0, r)
    assert np.dot(world.GetPickPosition(), n) == pytest.approx(-4, abs=0.05)
    hardware = vtkRenderingCore.vtkHardwareSelector()
    hardware.SetRenderer(r)
    hardware.SetArea(*at, *at)
    found = hardware.Select()
    assert found.GetNumberOfNodes() == 1 and found.GetNode(0).GetProperties().Get(found.GetNode(0).PROP()) is behind
    v.SetPickable(False)
    props = vtkRenderingCore.vtkPropPicker()
    assert props.Pick(*at, 0, r) and props.GetActor() is behind
    assert (pixels(w) == before).all() and v.error is None


def test_multisampling_blurs_silhouettes_alone(fog):
    r = renderer()
    r.AddActor(plane(0.0))
    halite.vtk.add_volume(r, grid(), transfer=fog)
    w = window(r, samples=4)
    r.ResetCameraClippingRange()
    truth = over(chord(to_clip(r), *SIZE, np.full((HEIGHT, WIDTH), depth_of(r, 0.0))), (0.2, 0.4, 0.8))
    assert np.abs(pixels(w)[..., :3] - truth).max() < 1.3


def test_a_dragged_window_is_coarse_and_a_still_one_exact(fog):
    r = renderer()
    v = halite.vtk.add_volume(r, grid(), transfer=fog)
    w = window(r)
    interactor = vtkRenderingCore.vtkRenderWindowInteractor()
    interactor.SetRenderWindow(w)
    truth = over(chord(to_clip(r), *SIZE), (0, 0, 0))
    w.Render()
    drawn = v.frames
    for rate, is_coarse in ((interactor.GetDesiredUpdateRate(), True), (interactor.GetStillUpdateRate(), False)):
        w.SetDesiredUpdateRate(rate)
        picture = pixels(w)[..., :3]
        if is_coarse:
            # Four pixels are one.
            assert (picture[0::2, 0::2] == picture[1::2, 1::2]).all() and 0.1 < np.abs(picture - truth).mean() < 6
        else:
            assert np.abs(picture - truth).max() < NEAR
    assert v.frames == drawn + 2


def test_points_and_cells_are_followed(fog):
    g = grid()
    r = renderer()
    v = halite.vtk.add_volume(r, g, transfer=fog)
    w = window(r)
    points = vtk_to_numpy(g.GetPoints().GetData())
    w.Render()
    # Half as large: as twice as far away, with half the extinction for each length.
    points *= 0.5
    g.GetPoints().GetData().Modified()
    g.GetPoints().Modified()
    picture = pixels(w)[..., :3]
    twice = to_clip(r) @ np.diag([0.5, 0.5, 0.5, 1])
    alpha = 1 - np.sqrt(1 - chord(twice, *SIZE)[..., 3])
    assert alpha.max() > 0.5 and np.abs(picture - 255 * alpha[..., None] * COLOR).max() < NEAR
    assert v.GetBounds() == pytest.approx((-0.5, 0.5, -0.5, 0.5, -0.5, 0.5))
    points *= 2
    g.GetPoints().Modified()
    lower = grid(size=1)
    g.SetCells(12, lower.GetCells())
    g.SetPoints(lower.GetPoints())
    g.GetPointData().SetScalars(lower.GetPointData().GetScalars())
    assert np.abs(pixels(w)[..., :3] - over(chord(to_clip(r), *SIZE), (0, 0, 0))).max() < NEAR and v.mesh.n_cells == 1


def test_clipping_planes_of_the_mapper(fog):
    """Cut by a plane that looks at the camera, the volume is that in front of an opaque one, over nothing."""
    r = renderer()
    v = halite.vtk.add_volume(r, grid(), transfer=fog)
    cut = vtkCommonDataModel.vtkPlane()
    cut.SetNormal(3, -2.5, 2)
    v.GetMapper().AddClippingPlane(cut)
    w = window(r)
    r.ResetCameraClippingRange()
    truth = chord(to_clip(r), *SIZE, np.full((HEIGHT, WIDTH), depth_of(r, 0.0)))
    assert truth[..., 3].max() > 0.5 and np.abs(pixels(w)[..., :3] - over(truth, (0, 0, 0))).max() < NEAR
    v.GetMapper().RemoveAllClippingPlanes()
    assert np.abs(pixels(w)[..., :3] - over(chord(to_clip(r), *SIZE), (0, 0, 0))).max() < NEAR and v.error is None


def test_a_time_series_takes_values_alone(fog, monkeypatch):
    g = grid()
    r = renderer()
    v = halite.vtk.add_volume(r, g, transfer=halite.TransferFunction([(0, *COLOR)], opacity=[(0, 0), (1, 1)], unit_distance=1 / K))
    w = window(r)
    truth = chord(to_clip(r), *SIZE)
    mesh = v.mesh
    monkeypatch.setattr(halite.Mesh, "from_vtk", lambda grid: pytest.fail("the mesh is taken again"))
    values = vtk_to_numpy(g.GetPointData().GetScalars())
    for step in (1.0, 0.5, 0.25, 1.0):
        values[:] = step
        g.GetPointData().GetScalars().Modified()
        alpha = 1 - (1 - truth[..., 3]) ** step
        assert np.abs(pixels(w)[..., :3] - 255 * alpha[..., None] * COLOR).max() < NEAR
        assert v.mesh is mesh
