# SPDX-License-Identifier: MIT OR Apache-2.0
"""What plotters of PyVista do with a volume, pixel by pixel against closed forms, and what they cannot do."""
import gc
import io
import time
import warnings
import weakref

import numpy as np
import pytest

pyvista = pytest.importorskip("pyvista")

import matplotlib  # noqa: E402
from PIL import Image  # noqa: E402
from vtkmodules import vtkWebCore  # noqa: E402

import halite  # noqa: E402
import halite.pyvista  # noqa: E402
from conftest import COLOR, K, chord  # noqa: E402
from windows import NEAR, SIZE, depth_of, grid, over, plane, to_clip  # noqa: E402

WIDTH, HEIGHT = SIZE
BEHIND = (0.2, 0.4, 0.8)
FOG = {"cmap": matplotlib.colors.ListedColormap([COLOR, COLOR]), "clim": (0, 2), "opacity": 1.0, "opacity_unit_distance": 1 / K,
       "show_scalar_bar": False}


def box(**options):
    """A plotter with the box."""
    p = pyvista.Plotter(off_screen=True, window_size=SIZE, **options)
    p.set_background("black")
    p.disable_anti_aliasing()
    return p, halite.pyvista.add_volume(p, pyvista.wrap(grid()), "s", **FOG)


def look(p):
    p.camera_position = [(3, -2.5, 2), (0, 0, 0), (0, 0, 1)]
    p.reset_camera_clipping_range()


def shot(p):
    return p.screenshot(return_img=True).astype(float)[..., :3]


def truth(p, distance, size=SIZE):
    """The picture of the box, with an opaque plane at a distance from its middle, or none."""
    w, h = size
    depth = None if distance is None else np.full((h, w), depth_of(p.renderer, distance))
    return over(chord(to_clip(p.renderer), w, h, depth), (0, 0, 0) if distance is None else BEHIND)


@pytest.mark.parametrize("distance", [None, -4.0, 0.0, 2.5])
@pytest.mark.parametrize("what", ["plain", "eye dome lighting", "fxaa", "msaa", "depth peeling", "parallel"])
def test_effects(what, distance):
    p, volume = box()
    if distance is not None:
        p.add_actor(plane(distance), reset_camera=False, render=False)
    if what == "eye dome lighting":
        p.enable_eye_dome_lighting()
    elif what in ("fxaa", "msaa"):
        p.enable_anti_aliasing(what)
    elif what == "depth peeling":
        p.enable_depth_peeling()
    look(p)
    if what == "parallel":
        p.enable_parallel_projection()
        p.camera.parallel_scale = 1.9
        p.reset_camera_clipping_range()
    p.show(auto_close=False)
    if what == "fxaa" and volume._drawn[2].shape[:2] != (HEIGHT, WIDTH):
        pytest.skip("without a display, PyVista supersamples where FXAA is asked for")
    assert volume.error is None and np.abs(shot(p) - truth(p, distance)).max() < (1.3 if what == "msaa" else NEAR)
    p.close()


@pytest.mark.parametrize("distance", [None, 0.0])
def test_supersampling(distance):
    """VTK draws more pixels and filters them: of the truth, as a textured background, it makes the same."""
    p, volume = box()
    if distance is not None:
        p.add_actor(plane(distance), reset_camera=False, render=False)
    p.enable_anti_aliasing("ssaa")
    look(p)
    p.show(auto_close=False)
    picture, (height, width) = shot(p), volume._drawn[2].shape[:2]
    assert width > 1.5 * WIDTH and volume.error is None
    image = pyvista.ImageData(dimensions=(width, height, 1))
    image["truth"] = np.round(truth(p, distance, (width, height))).astype(np.uint8)[::-1].reshape(-1, 3)
    texture = pyvista.Texture(image)
    texture.InterpolateOff()
    q = pyvista.Plotter(off_screen=True, window_size=SIZE)
    q.renderer.SetBackgroundTexture(texture)
    q.renderer.TexturedBackgroundOn()
    q.enable_anti_aliasing("ssaa")
    q.show(auto_close=False)
    wanted = shot(q)
    assert wanted.max() > 100 and np.abs(picture - wanted).max() < NEAR
    p.close()
    q.close()


def test_subplots_texts_and_tiles():
    p, _ = box(shape=(1, 2))
    p.subplot(0, 1)
    halite.pyvista.add_volume(p, pyvista.wrap(grid()), "s", **FOG)
    text = p.add_text("on top", position=(5, 5), font_size=12, color="white")
    for column in (0, 1):
        p.subplot(0, column)
        look(p)
    p.show(auto_close=False)
    picture = shot(p)
    half = WIDTH // 2
    for column in (0, 1):
        p.subplot(0, column)
        wanted = over(chord(to_clip(p.renderer), half, HEIGHT), (0, 0, 0))
        difference = np.abs(picture[:, half * column:half * (column + 1)] - wanted).max(-1)
        # PyVista draws a line round subplots.
        difference = difference[2:-2, 2:-2]
        is_text = difference > NEAR
        assert is_text.sum() == 0 if column == 0 else 20 < is_text.sum() < 500
    text.SetVisibility(False)
    large = p.screenshot(return_img=True, scale=2).astype(float)[..., :3]
    p.subplot(0, 0)
    wanted = over(chord(to_clip(p.renderer), 2 * half, 2 * HEIGHT), (0, 0, 0))
    assert np.abs(large[:, :2 * half] - wanted)[4:-4, 4:-4].max() < NEAR
    p.close()


def test_transparent_backgrounds():
    p, _ = box()
    look(p)
    p.show(auto_close=False)
    picture = p.screenshot(return_img=True, transparent_background=True).astype(float)
    wanted = chord(to_clip(p.renderer), *SIZE)
    assert picture.shape[-1] == 4 and np.abs(picture[..., 3] - 255 * wanted[..., 3]).max() < NEAR
    assert np.abs(picture[..., :3] - 255 * wanted[..., :3]).max() < NEAR
    p.close()


def test_errors_are_raised_and_the_plotter_lives_on(monkeypatch):
    p, volume = box()
    look(p)
    p.show(auto_close=False)
    good = shot(p)
    volume.scalars = "nothing"
    for _ in range(2):
        with pytest.raises(halite.Error, match='"nothing"'):
            p.render()
    shown = []
    monkeypatch.setattr("sys.excepthook", lambda kind, error, trace: shown.append(error))
    volume.scalars = "other"
    p.render_window.GetInteractor().Render()
    assert len(shown) == 1 and '"other"' in str(shown[0])
    # Where VTK asks for frames in what the user calls, for tiles too, that raises it.
    for ask in (lambda: p.screenshot(scale=2), p.get_image_depth):
        volume.scalars = f"no {ask}"
        with pytest.raises(halite.Error, match='"no ') as raised:
            ask()
        assert str(volume.error) == str(raised.value) and len(shown) == 1
    volume.scalars = "s"
    volume.grid.GetPointData().GetArray("s").Modified()
    p.render()
    assert (shot(p) == good).all() and volume.frames == 2
    p.close()
    q, volume = box()
    volume.scalars = "nothing"
    with pytest.raises(halite.Error, match='"nothing"'):
        q.show(auto_close=False)
    q.close()


def test_the_scalar_bar_has_the_colours():
    p = pyvista.Plotter(off_screen=True, window_size=SIZE)
    halite.pyvista.add_volume(p, pyvista.wrap(grid(np.linspace(2, 5, 27))), "s", cmap="inferno", flip_scalars=True, n_colors=16,
                              annotations={3.0: "three"}, scalar_bar_args={"title": "heat"})
    bar = p.scalar_bars["heat"]
    table = bar.GetLookupTable()
    assert table.GetTableRange() == pytest.approx((2, 5)) and table.GetNumberOfTableValues() == 16
    wanted = matplotlib.colormaps["inferno"].reversed()(np.linspace(0, 1, 16))
    colors = np.array([table.GetTableValue(i) for i in range(16)])
    assert np.abs(colors[:, :3] - wanted[:, :3]).max() < 2 / 255
    assert table.GetNumberOfAnnotatedValues() == 1 and table.GetAnnotation(0) == "three"
    # It belongs to the volume alone: other things have theirs.
    p.add_mesh(pyvista.Sphere(), scalars=np.arange(842.0), scalar_bar_args={"title": "sphere"})
    assert p.scalar_bars["heat"].GetLookupTable().GetTableRange() == pytest.approx((2, 5))
    p.close()


@pytest.mark.parametrize("log_scale", [False, True])
def test_scales(log_scale):
    """One value all over has the colour and the opacity of its share of the range."""
    p = pyvista.Plotter(off_screen=True, window_size=SIZE)
    p.set_background("black")
    p.disable_anti_aliasing()
    colors = matplotlib.colors.LinearSegmentedColormap.from_list("two", [(1, 0, 0), (0, 1, 0)])
    halite.pyvista.add_volume(p, pyvista.wrap(grid(np.full(27, 10.0))), "s", clim=(1, 100), cmap=colors, opacity=[0.0, 1.0],
                              log_scale=log_scale, opacity_unit_distance=1 / K, show_scalar_bar=False)
    look(p)
    p.show(auto_close=False)
    share = 0.5 if log_scale else 9 / 99
    alpha = 1 - (1 - chord(to_clip(p.renderer), *SIZE)[..., 3]) ** share
    wanted = 255 * alpha[..., None] * [1 - share, share, 0]
    # Colours and opacities are PyVista's, in 8 bits.
    assert wanted.max() > 15 and np.abs(shot(p) - wanted).max() < NEAR + 1
    p.close()


def test_a_user_matrix_and_clim():
    p, _ = box()
    q = pyvista.Plotter(off_screen=True, window_size=SIZE)
    q.set_background("black")
    q.disable_anti_aliasing()
    move = np.diag([2.0, 2, 2, 1])
    move[:3, 3] = [1, 2, 3]
    half = pyvista.wrap(grid())
    half.points = (half.points - move[:3, 3]) / 2
    halite.pyvista.add_volume(q, half, "s", user_matrix=move, **{**FOG, "clim": 2})
    for each in (p, q):
        look(each)
        each.show(auto_close=False)
    assert q.bounds == pytest.approx((-1, 1, -1, 1, -1, 1)) and np.abs(shot(p) - shot(q)).max() <= 1
    p.close()
    q.close()


def test_what_users_of_pyvista_give():
    p, _ = box()
    grid_of = lambda: pyvista.wrap(grid(np.linspace(0, 1, 27)))
    table = pyvista.LookupTable("magma")
    pictures = []
    for more in ({"cmap": "magma"}, {"cmap": table}, {"cmap": matplotlib.colormaps["magma"]}):
        q = pyvista.Plotter(off_screen=True, window_size=SIZE)
        volume = halite.pyvista.add_volume(q, grid_of(), "s", show_scalar_bar=False, opacity="sigmoid", **more)
        look(q)
        q.show(auto_close=False)
        pictures.append(shot(q))
        q.close()
    assert all(np.abs(x - pictures[0]).max() <= 1 for x in pictures) and pictures[0].min() < 200
    assert repr(volume) == str(volume) == "<halite.vtk.Volume: s of <halite.Mesh: a mesh of 27 points and 8 cells>>"
    # Four bytes are a colour and an opacity.
    colored = grid_of()
    bytes_of = np.zeros((27, 4), np.uint8)
    bytes_of[:] = (0, 255, 0, 255)
    q = pyvista.Plotter(off_screen=True, window_size=SIZE)
    q.set_background("black")
    halite.pyvista.add_volume(q, colored, bytes_of, clim=(0, 255), opacity_unit_distance=0.2)
    look(q)
    q.show(auto_close=False)
    green = shot(q)
    assert green[HEIGHT // 2, WIDTH // 2, 1] > 250 and green[..., [0, 2]].max() == 0 and not len(q.scalar_bars)
    q.close()
    for wrong, word in ((pyvista.MultiBlock([grid_of()]), "combine"), ("grid.vtu", "pyvista.read"), (pyvista.Sphere(), "vtkPolyData"),
                        (halite.Mesh.from_vtk(grid_of()), "halite.Mesh")):
        with pytest.raises(halite.Error, match=word):
            halite.pyvista.add_volume(p, wrong)
    with pytest.raises(halite.Error, match="grid of VTK is meant, and not a Mesh"):
        halite.vtk.Volume(halite.Mesh.from_vtk(grid_of()))
    # A picture by the plotter's camera is what the plotter shows.
    look(p)
    p.show(auto_close=False)
    fog = halite.TransferFunction([(0, *COLOR)], opacity=1.0, unit_distance=1 / K)
    picture = halite.Renderer(grid(), "s", transfer=fog).render(halite.View.from_vtk(p.camera, SIZE))
    assert np.abs(shot(p) - over(picture, (0, 0, 0))).max() < NEAR
    p.close()


def test_plotters_come_and_go():
    """A plotter that is closed keeps nothing, nor does anything keep it."""
    alive = []
    for shown in (True, True, False):
        p, volume = box()
        if shown:
            p.show(auto_close=False)
        alive += [weakref.ref(p), weakref.ref(volume), weakref.ref(volume._renderer)]
        p.close()
        del p, volume
    p, _ = box()
    p.close()
    gc.collect()
    assert [a() for a in alive] == [None] * 9


def test_names_take_each_others_place():
    p, first = box()
    second = halite.pyvista.add_volume(p, pyvista.wrap(grid()), "s", name="fog", **FOG)
    third = halite.pyvista.add_volume(p, pyvista.wrap(grid()), "s", name="fog", **FOG)
    volumes = p.renderer.GetVolumes()
    present = [volumes.GetItemAsObject(i) for i in range(volumes.GetNumberOfItems())]
    assert first in present and third in present and second not in present
    p.close()


@pytest.mark.parametrize("keyword", ["resolution", "mapper", "categories", "culling", "multi_colors", "colour"])
def test_what_has_no_meaning_is_refused_by_name(keyword):
    p = pyvista.Plotter(off_screen=True, window_size=SIZE)
    with pytest.raises(TypeError, match=f'"{keyword}"'):
        halite.pyvista.add_volume(p, pyvista.wrap(grid()), "s", **{keyword: True})
    p.close()


def test_every_keyword_of_pyvista_is_taken_or_refused():
    import inspect
    theirs = set(inspect.signature(pyvista.Plotter.add_volume).parameters) - {"self", "kwargs"}
    ours = set(inspect.signature(halite.pyvista.add_volume).parameters)
    assert theirs <= ours | set(halite.pyvista._REFUSED)


def test_ambient_occlusion_is_refused():
    p, _ = box()
    with pytest.raises(halite.Error, match="ambient occlusion"):
        p.enable_ssao()
    p.close()
    q = pyvista.Plotter(off_screen=True, window_size=SIZE)
    q.enable_ssao()
    halite.pyvista.add_volume(q, pyvista.wrap(grid()), "s", **FOG)
    with pytest.raises(halite.Error, match="SSAO"):
        q.show(auto_close=False)
    q.disable_ssao()
    q.render()
    q.close()


def test_exports_say_once_what_they_leave_out(tmp_path):
    p, _ = box()
    p.add_mesh(pyvista.Sphere())
    p.show(auto_close=False)
    with pytest.warns(UserWarning, match="no volume of Halite") as said:
        p.export_gltf(tmp_path / "scene.gltf")
    assert len(said) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        p.export_obj(tmp_path / "scene.obj")
    assert (tmp_path / "scene.gltf").stat().st_size > 100 and (tmp_path / "scene.obj").stat().st_size > 100
    p.close()


def test_a_mouse_drags_coarse_frames_and_leaves_an_exact_one():
    p, volume = box()
    look(p)
    p.show(auto_close=False)
    interactor, rates = p.iren.interactor, []
    p.renderer.AddObserver("EndEvent", lambda *_: rates.append(p.render_window.GetDesiredUpdateRate()))

    def mouse(event, x):
        interactor.SetEventInformation(x, HEIGHT // 2, 0, 0, chr(0), 0, None)
        interactor.InvokeEvent(event)

    mouse("MouseMoveEvent", 60)
    mouse("LeftButtonPressEvent", 60)
    sizes = []
    for x in (64, 70, 80):
        mouse("MouseMoveEvent", x)
        sizes.append(volume._drawn[2].shape[:2])
    dragged = len(rates)
    assert dragged >= 3 and min(rates) > 1 and sizes == [(HEIGHT // 2, WIDTH // 2)] * 3
    mouse("LeftButtonReleaseEvent", 80)
    assert len(rates) > dragged and rates[-1] < 1 and volume._drawn[2].shape[:2] == (HEIGHT, WIDTH)
    assert p.camera.position[0] < 2 and np.abs(shot(p) - truth(p, None)).max() < NEAR
    p.close()


def test_views_that_a_server_draws():
    """What trame's remote views send: compressed pictures of the window, coarse while it is dragged, and exact when still."""
    p, volume = box()
    look(p)
    p.show(auto_close=False)
    web = vtkWebCore.vtkWebApplication()
    web.SetImageEncoding(0)

    def sent(rate):
        p.render_window.SetDesiredUpdateRate(rate)
        # Pictures are compressed by other threads: the first to come may be of the frame before.
        for _ in range(20):
            web.InvalidateCache(p.render_window)
            data = web.StillRender(p.render_window, 100)
            time.sleep(0.02)
        return np.asarray(Image.open(io.BytesIO(memoryview(data).tobytes())).convert("RGB"), float)

    wanted, frames = truth(p, None), volume.frames
    for rate, near in ((15, 6), (0.0001, 2)):
        # JPEG halves the resolution of colours: green, which is mostly lightness, is nearest.
        difference = np.abs(sent(rate) - wanted)[..., 1]
        assert difference.mean() < near and (difference.mean() > 0.5) == (rate > 1)
    assert volume.error is None and volume.frames > frames
    p.close()
