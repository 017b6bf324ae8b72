# SPDX-License-Identifier: MIT OR Apache-2.0
"""Meshes, functions, views and pictures, without VTK."""
import gc
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
import tracemalloc

import numpy as np
import pytest

import halite
from conftest import chord, grown, lattice, look_at, perspective, resident, tetrahedron


def test_pictures_are_the_integral(box, fog):
    eye, clip = look_at((3, -2.5, 2)), perspective(35, 4 / 3, 0.5, 20)
    view = halite.View.from_matrices(eye, clip, (64, 48))
    picture = halite.Renderer(box, "s", transfer=fog).render(view)
    assert picture.shape == (48, 64, 4) and picture.dtype == np.float32
    truth = chord(clip @ eye, 64, 48)
    assert truth[..., 3].max() > 0.9 and np.abs(picture - truth).max() < 2e-6
    # Depths end rays.
    depth = np.full((48, 64), 0.9, np.float32)
    depth[:, 20:] = 1.0
    cut = halite.Renderer(box, "s", transfer=fog).render(view, depth)
    assert np.abs(cut - chord(clip @ eye, 64, 48, np.where(depth < 1, depth, 1.0))).max() < 1e-4


def test_views_are_vtks(box, fog):
    renderer = halite.Renderer(box, "s", transfer=fog)
    by_camera = renderer.render(halite.View((3, -2.5, 2), view_up=(0, 0, 1), view_angle=35, size=(64, 48)))
    eye, clip = look_at((3, -2.5, 2)), perspective(35, 4 / 3, 0.5, 20)
    assert np.abs(by_camera - chord(clip @ eye, 64, 48)).max() < 2e-6
    half = renderer.render(halite.View((0, 0, 9), parallel_scale=2, size=(40, 40), planes=[((0, 0, 0), (1, 0, 0))]))
    assert half[20, 5:19, 3].max() == 0 and half[20, 22:28, 3].min() > 0.5


def test_arrays_and_components(box, fog):
    assert (box.n_points, box.n_cells, box.bounds) == (27, 8, (-1, 1, -1, 1, -1, 1))
    assert box.arrays == [("s", "point", 1), ("c", "cell", 1)] and box.range("c") == (0, 7)
    renderer = halite.Renderer(box, "c", transfer=fog)
    renderer.set_scalars(np.zeros((27, 3), np.float32))
    with pytest.raises(halite.Error, match='no array is called "t"; there are "s", "c"'):
        renderer.set_scalars("t")
    with pytest.raises(halite.Error, match="5"):
        renderer.set_scalars(np.zeros(5))


def test_what_is_wrong_is_named():
    points, cells, offsets, types = lattice()
    with pytest.raises(halite.Error, match="99"):
        halite.Mesh.from_arrays(points, np.where(cells == 0, 99, cells), offsets, types)
    with pytest.raises(halite.Error, match="-1"):
        halite.Mesh.from_arrays(points, np.where(cells == 0, -1, cells), offsets, types)
    with pytest.raises(halite.Error, match=r"\(27, 2\)"):
        halite.Mesh.from_arrays(points[:, :2], cells, offsets, types)
    with pytest.raises(halite.Error, match="26"):
        halite.Mesh.from_arrays(points, cells, offsets, types, point_data={"s": np.zeros(26)})
    with pytest.raises(halite.Error, match="300"):
        halite.Mesh.from_arrays(points, cells, offsets, np.full(8, 300))
    with pytest.raises(halite.Error, match="float64"):
        halite.Mesh.from_arrays(points, cells + 0.5, offsets, types)
    with pytest.raises(halite.Error, match="no components"):
        halite.Mesh.from_arrays(points, cells, offsets, types, point_data={"s": np.zeros((27, 0))})
    with pytest.raises(halite.Error, match="4096"):
        halite.Renderer(halite.Mesh.from_arrays(points, cells, offsets, types, point_data={"s": points[:, 0]}), threads=10**6)
    empty = halite.Mesh.from_arrays(np.zeros((0, 3)), [], [0], [], point_data={"s": np.zeros(0)})
    assert empty.bounds == (1, -1, 1, -1, 1, -1) and empty.length == 0
    assert halite.Renderer(empty).render(halite.View((3, 2, 4), size=(8, 8))).max() == 0
    with pytest.raises(halite.Error, match="no array"):
        halite.show(halite.Mesh.from_arrays(points, cells, offsets, types))
    with pytest.raises(OSError):
        halite.read("nowhere.vtu")
    with pytest.raises(halite.Error, match="no colour map|nothing"):
        halite.TransferFunction("nothing")
    with pytest.raises(halite.Error, match="opaque"):
        halite.TransferFunction(convention="opaque")
    with pytest.raises(halite.Error, match="ascends"):
        halite.TransferFunction("viridis", (1, 0))
    with pytest.raises(halite.Error, match="halite.pyvista"):
        halite.TransferFunction(opacity="sigmoid")
    with pytest.raises(TypeError, match="halite.read"):
        halite.Renderer("mesh.vtu")


def test_frames_can_be_ended(box, fog):
    renderer = halite.Renderer(box, "s", transfer=fog, engine="traverse", threads=1)
    view = halite.View((3, -2.5, 2), size=(2500, 2500))
    shares = []
    assert renderer.render(view, progress=lambda share: shares.append(share) or len(shares) < 2) is None
    assert len(shares) >= 2

    def wrong(share):
        raise ValueError("no more")

    with pytest.raises(ValueError, match="no more"):
        renderer.render(view, progress=wrong)
    assert renderer.render(halite.View((3, -2.5, 2), size=(20, 20))) is not None


def test_threads_take_turns(box, fog):
    renderer = halite.Renderer(box, "s", transfer=fog)
    view, pictures = halite.View((3, -2.5, 2), size=(50, 50)), []
    threads = [threading.Thread(target=lambda: pictures.append(renderer.render(view))) for _ in range(4)]
    [t.start() for t in threads]
    [t.join() for t in threads]
    assert len(pictures) == 4 and all((p == pictures[0]).all() for p in pictures)


@pytest.mark.skipif(sys.platform != "linux", reason="memory is read from /proc")
def test_memory_is_level(box, fog):
    points, cells, offsets, types = lattice(20)
    of_frame, of_mesh = 200 * 150 * 16, points.nbytes
    renderer = halite.Renderer(box, "s", transfer=fog)
    view = halite.View((3, -2.5, 2), view_up=(0, 0, 1), size=(200, 150))

    def frames():
        for i in range(300):
            renderer.render(view, progress=(lambda share: True) if i % 2 else None)

    def renderers():
        for _ in range(50):
            mesh = halite.Mesh.from_arrays(points, cells, offsets, types, point_data={"s": points[:, 0].copy()})
            halite.Renderer(mesh, "s", threads=2).render(view)

    # The first round fills what is kept; a leak of one frame in ten, or of one mesh in ten, shows in the next ones. Two, as what
    # allocators keep goes up and down by more than one mesh.
    for what, most in ((frames, 30 * of_frame), (renderers, 5 * 8 * of_mesh)):
        what()
        gc.collect()
        before = resident()
        for _ in range(2):
            what()
        gc.collect()
        grown = (resident() - before) / 2
        assert grown < most, (what.__name__, grown, most)


@pytest.mark.parametrize("floats, ints", [(np.float64, np.int64), (np.float32, np.int32), (np.float32, np.uint64)])
def test_arrays_are_copied_once(floats, ints):
    """What numpy allocates meanwhile is next to nothing: arrays are read where they are, whatever their type."""
    points, cells, offsets, types = lattice(30)
    arrays = [points.astype(floats), cells.astype(ints), offsets.astype(ints), types.astype(np.uint8)]
    scalars = points[:, 0].astype(floats)
    data = {"point_data": {"s": scalars, "v": points.astype(floats)}, "cell_data": {"c": np.arange(len(types), dtype=ints)}}
    mesh = halite.Mesh.from_arrays(*arrays, **data)
    renderer = halite.Renderer(mesh, "s")
    tracemalloc.start()
    try:
        mesh = halite.Mesh.from_arrays(*arrays, **data)
        of_mesh = tracemalloc.get_traced_memory()[1]
        tracemalloc.reset_peak()
        renderer.set_scalars(scalars)
        of_values = tracemalloc.get_traced_memory()[1]
        tracemalloc.reset_peak()
        halite.Mesh.from_arrays(np.asfortranarray(arrays[0]), *arrays[1:])
        of_columns = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert max(of_mesh, of_values) < 20_000 < arrays[0].nbytes <= of_columns
    # Points and cells are the mesh's own.
    before = mesh.bounds
    arrays[0][:] = 7
    assert mesh.bounds == before


@pytest.mark.skipif(sys.platform != "linux", reason="memory is read from /proc")
def test_what_is_not_drawn_is_not_copied():
    """A mesh takes memory for points and cells, whatever arrays it has, and a renderer for the component that it draws."""
    points, cells, offsets, types = lattice(60)
    vectors = {f"v{i}": np.random.default_rng(i).random((len(points), 3)) for i in range(8)}
    arrays = (points, cells.astype(np.int32), offsets, types.astype(np.uint8))
    of_mesh = points.nbytes + arrays[1].nbytes + offsets.nbytes + types.nbytes
    make = lambda: halite.Mesh.from_arrays(*arrays, point_data=vectors)
    renderer = halite.Renderer(make(), "v0", component=0)
    mesh, most = grown(make)
    # Threads and what allocators keep are in it.
    slack = 4 << 20
    assert most < of_mesh + slack < 8 * points.nbytes, (most, of_mesh)
    renderer.set_mesh(mesh, "v0", component=0)
    for part, copy in ((1, points.nbytes / 3), (None, points.nbytes / 3)):
        _, most = grown(lambda: renderer.set_scalars("v7", component=part))
        assert most < copy + slack, (part, most, copy)
    drawn, most = grown(lambda: renderer.set_scalars(vectors["v3"], component=2))
    assert most < points.nbytes / 3 + slack


def test_arrays_are_followed_when_they_are_set(fog):
    """Values that a program writes show from the next time on that they are set; until then the picture stays."""
    points, cells, offsets, types = lattice()
    values, wide = np.ones(27), np.ones((27, 4), np.float32)
    mesh = halite.Mesh.from_arrays(points, cells, offsets, types, point_data={"s": values, "t": wide[:, 2]})
    view = halite.View((3, -2.5, 2), view_up=(0, 0, 1), size=(40, 40))
    transfer = halite.TransferFunction([(0, 1, 1, 1)], opacity=[(0, 0), (1, 1)])
    for name, array in (("s", values), ("t", wide)):
        renderer = halite.Renderer(mesh, name, transfer=transfer)
        before = renderer.render(view)
        array[...] = 0.25
        assert mesh.range(name) == (0.25, 0.25)
        assert (renderer.render(view) == before).all()
        renderer.set_scalars(name)
        less = renderer.render(view)
        assert 0 < less.max() < before.max() and (less == halite.Renderer(mesh, name, transfer=transfer).render(view)).all()
    # Components by number, by length and all of them are those of values that are given.
    colors = np.random.default_rng(1).random((27, 4))
    mesh = halite.Mesh.from_arrays(points, cells, offsets, types, point_data={"c": colors, "one": colors[:, :1] - 0.5})
    for part, same in ((2, colors[:, 2]), (None, np.sqrt((colors ** 2).sum(1)))):
        pictures = [halite.Renderer(mesh, "c", component=part, transfer=transfer).render(view),
                    halite.Renderer(mesh, same, transfer=transfer).render(view)]
        assert np.abs(pictures[0] - pictures[1]).max() < 1e-6 and pictures[0].max() > 0.1
    assert halite.Renderer(mesh, "c", component="all", transfer=transfer).render(view)[..., :3].std(-1).max() > 0.01
    assert (halite.Renderer(mesh, "one", transfer=transfer).render(view)
            == halite.Renderer(mesh, colors[:, 0] - 0.5, transfer=transfer).render(view)).all()
    with pytest.raises(halite.Error, match="4 components, so there is no component 4"):
        halite.Renderer(mesh, "c", component=4)
    for bad in (-3, "some"):
        with pytest.raises(halite.Error, match="component is"):
            halite.Renderer(mesh, "c", component=bad)


def test_ghosts_are_left_out(fog):
    """What marks cells is the mesh's own, whatever is drawn."""
    points, cells, offsets, types = lattice()
    marks = np.zeros(8, np.uint8)
    marks[points[cells.reshape(8, 8)].mean(1)[:, 0] > 0] = 1
    mesh = halite.Mesh.from_arrays(points, cells, offsets, types, point_data={"s": np.ones(27)}, cell_data={"vtkGhostType": marks})
    view = halite.View((0, -9, 0), view_up=(0, 0, 1), parallel_scale=1.5, size=(30, 30))
    half = halite.Renderer(mesh, "s", transfer=fog).render(view)
    assert half[15, 6:14, 3].min() > 0.5 and half[15, 16:, 3].max() == 0
    assert halite.show(mesh, size=(40, 30)).pixels[..., 3].max() > 0


def test_any_layout_and_type_is_taken():
    points, cells, offsets, types = lattice(2)
    data = points[:, 0]
    view = halite.View((3, -2.5, 2), view_up=(0, 0, 1), size=(40, 40))
    wanted = halite.Renderer(halite.Mesh.from_arrays(points, cells, offsets, types, point_data={"s": data})).render(view)
    for change in (np.asfortranarray, lambda a: a.astype(a.dtype.newbyteorder(">")), lambda a: np.repeat(a, 2, 0)[::2], list,
                   lambda a: np.ma.array(a) if a.ndim > 1 else a):
        mesh = halite.Mesh.from_arrays(change(points), change(cells), change(offsets), change(types), point_data={"s": change(data)})
        assert (halite.Renderer(mesh).render(view) == wanted).all()
    mesh = halite.Mesh.from_arrays(points, cells, offsets, types, point_data={"flag": data > 0})
    assert mesh.range("flag") == (0, 1)
    with pytest.raises(halite.Error, match="complex|none of"):
        halite.Mesh.from_arrays(points, cells, offsets, types, point_data={"s": data + 1j})


def test_other_code_runs_while_it_draws(box, fog):
    renderer = halite.Renderer(box, "s", transfer=fog, engine="traverse", threads=1)
    counted, done = [0], threading.Event()

    def count():
        while not done.is_set():
            counted[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    before = counted[0]
    renderer.render(halite.View((3, -2.5, 2), size=(1500, 1500)))
    while_drawing = counted[0] - before
    done.set()
    thread.join()
    assert while_drawing > 10


def test_ctrl_c_ends_a_frame_soon(box, fog):
    # Where the tests run in the background of a shell, Python leaves interrupts ignored.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    renderer = halite.Renderer(box, "s", transfer=fog, engine="traverse", threads=1)
    took = []
    for _ in range(4):
        sent = []

        def interrupt():
            sent.append(time.perf_counter())
            os.kill(os.getpid(), signal.SIGINT)

        timer = threading.Timer(0.2, interrupt)
        timer.start()
        with pytest.raises(KeyboardInterrupt):
            renderer.render(halite.View((3, -2.5, 2), size=(9000, 9000)))
        took.append(time.perf_counter() - sent[0])
        timer.join()
    # Others may have the cores meanwhile.
    assert min(took) < 0.1, took
    assert renderer.render(halite.View((3, -2.5, 2), size=(20, 20))) is not None


def test_what_ends_rays(box, fog):
    """Depths of each kind, opaque objects, clipping and cropping end rays where geometry says."""
    eye = np.array([3, -2.5, 2])
    back = eye / np.linalg.norm(eye)
    renderer = halite.Renderer(box, "s", transfer=fog)
    view = lambda **more: halite.View(eye, view_up=(0, 0, 1), view_angle=35, size=(64, 48), clipping_range=(0.5, 20), **more)
    world, clip = look_at(eye), perspective(35, 4 / 3, 0.5, 20)
    middle = np.linalg.norm(eye)
    window = 0.5 + 0.5 * (clip @ [0, 0, -middle, 1])[2] / middle
    truth = chord(clip @ world, 64, 48, np.full((48, 64), window))
    x, y = np.meshgrid(2 * (np.arange(64) + 0.5) / 64 - 1, 1 - 2 * (np.arange(48) + 0.5) / 48)
    slope = np.tan(np.radians(17.5))
    along = middle * np.sqrt(1 + (x * slope * 4 / 3) ** 2 + (y * slope) ** 2)
    wall = {"type": "plane", "point": [0, 0, 0], "normal": back, "color": [1, 0.5, 0.25]}
    for picture in (renderer.render(view(), np.full((48, 64), window)),
                    renderer.render(view(), np.full((48, 64), middle), depth_kind="eye"),
                    renderer.render(view(), along, depth_kind="ray"),
                    renderer.render(view(opaque=[wall])),
                    renderer.render(view(planes=[((0, 0, 0), back)]))):
        assert np.abs(picture - truth).max() < 3e-5
    assert (view(opaque=[wall]).backdrop()[24, 32] == np.float32([1, 0.5, 0.25])).all()
    half = chord(clip @ world, 64, 48)
    cut = renderer.render(view(cropping=((-1, 1, -1, 1, -1, 0), "subvolume")))
    other = renderer.render(view(cropping=((-1, 1, -1, 1, -1, 0), 0x7FFFFFF & ~0x0002000)))
    # Transmittances of the parts multiply to that of the whole.
    both = 1 - (1 - cut[..., 3]) * (1 - other[..., 3])
    assert np.abs(both - half[..., 3]).max() < 1e-5 and np.abs(cut - half).max() > 0.1
    with pytest.raises(halite.Error, match="window"):
        renderer.render(halite.View(eye, size=(64, 48)), np.zeros((48, 64)))
    with pytest.raises(halite.Error, match='"far"'):
        renderer.render(view(), along, depth_kind="far")
    with pytest.raises(halite.Error, match="fence"):
        view(cropping=((0, 1, 0, 1, 0, 1), "wall"))
    with pytest.raises(halite.Error, match="opaque.*radius"):
        view(opaque=[{"type": "sphere", "center": [0, 0, 0]}])


def test_options_of_drawing(box, fog):
    view = halite.View((3, -2.5, 2), view_up=(0, 0, 1), size=(40, 30))
    wanted = halite.Renderer(box, "s", transfer=fog).render(view)
    table = halite.Renderer(box, "s", transfer=fog, integral={"form": "volume", "table": [8, 8, 64]}).render(view)
    assert 0 < np.abs(table - wanted).max() < 0.05
    for options, word in (({"integral": "cubic"}, "cubic"), ({"integral": {"form": "volume", "shape": 3}}, "shape"),
                          ({"reconstruction": "9"}, "9"), ({"sampling": 1.0}, "sampling"),
                          ({"projection": {"order": "sideways"}}, "sideways"), ({"placement": np.eye(3)}, "4, 4"),
                          ({"component": "some"}, "some"), ({"gradient_array": "none"}, "none")):
        with pytest.raises(halite.Error, match=word):
            halite.Renderer(box, "s", **options)
    with pytest.raises(halite.Error, match="table"):
        halite.TransferFunction(table2d=(np.zeros((2, 2, 3)), (0, 1), (0, 1)))
    with pytest.raises(halite.Error, match="lights"):
        halite.TransferFunction(lights=[{"type": "headlight"}])
    with pytest.raises(halite.Error, match="sigma"):
        halite.TransferFunction(widgets=[{"type": "gaussian", "center": [0, 0], "color": [1, 1, 1], "opacity": 1}])


def test_pickling_says_why_not(box):
    for thing in (box, halite.Renderer(box), halite.TransferFunction(), halite.View((1, 2, 3))):
        with pytest.raises(TypeError, match="pickled"):
            pickle.dumps(thing)


def test_grids():
    values = np.random.default_rng(1).uniform(size=(4, 3, 5))
    grid = halite.Mesh.image((5, 3, 4), spacing=(0.5, 1, 0.7), point_data={"v": values.ravel()})
    assert grid.is_grid and grid.bounds == (0, 2, 0, 2, 0, pytest.approx(2.1))
    view = halite.View((5, 4, 6), (1, 1, 1), size=(30, 30))
    axes = [np.arange(n) * d for n, d in ((5, 0.5), (3, 1), (4, 0.7))]
    pictures = [halite.Renderer(g).render(view) for g in (grid, halite.Mesh.rectilinear(*axes, point_data={"v": values.ravel()}))]
    assert pictures[0][..., 3].max() > 0.1 and np.abs(pictures[0] - pictures[1]).max() < 1e-6


def test_time_steps_are_read(tmp_path):
    for step in (0, 1, 2):
        tetrahedron(tmp_path / f"step{step}.vtu", [step, 1, 2, 5 + step])
    steps = "".join(f'<DataSet timestep="{0.5 * k}" file="step{k}.vtu"/>' for k in (0, 1, 2))
    (tmp_path / "series.pvd").write_text(f'<VTKFile type="Collection" version="0.1"><Collection>{steps}</Collection></VTKFile>')
    of = lambda **which: halite.read(tmp_path / "series.pvd", **which).range("s")
    assert of() == (0, 5) and of(step=2) == (1, 7) and of(time=0.6) == (1, 6)
    with pytest.raises(halite.Error, match="3"):
        of(step=3)
    with pytest.raises(halite.Error, match="no time 9"):
        of(time=9)
    # The mesh stays, and its values are the next step's.
    renderer, view = halite.Renderer(halite.read(tmp_path / "series.pvd"), "s"), halite.View((3, 2, 4), (0.3, 0.3, 0.3), size=(40, 30))
    fixed = halite.TransferFunction("viridis", (0, 7), opacity=[0, 1], unit_distance=0.3)
    renderer.set_transfer(fixed)
    renderer.set_scalars(np.array([2, 1, 2, 7], np.float32))
    wanted = halite.Renderer(halite.read(tmp_path / "step2.vtu"), "s", transfer=fixed).render(view)
    assert (renderer.render(view) == wanted).all() and wanted[..., 3].max() > 0.2


def test_pictures_are_files(box, tmp_path):
    picture = halite.show(box, size=(60, 40))
    assert picture._repr_png_()[:4] == b"\x89PNG" and picture.pixels[..., 3].max() > 0.05
    halite.write(tmp_path / "p.npy", picture.pixels)
    assert (np.load(tmp_path / "p.npy") == picture.pixels).all()
    picture.save(tmp_path / "p.png")
    assert (tmp_path / "p.png").stat().st_size > 100


def test_light_and_widgets(box):
    points, cells, offsets, types = lattice()
    mesh = halite.Mesh.from_arrays(points, cells, offsets, types, point_data={"x": points[:, 0]})
    view = halite.View((3, -2.5, 2), size=(30, 30))
    looks = [{}, {"shade": True}, {"silhouette": 2}, {"gradient_opacity": [(0, 0), (2, 1)]},
             {"widgets": [{"type": "gaussian", "center": [0, 1], "sigma": [0.3, 1], "color": [1, 0, 0], "opacity": 2}]}]
    pictures = [halite.Renderer(mesh, transfer=halite.TransferFunction("viridis", (-1, 1), **look)).render(view) for look in looks]
    for a in range(len(looks)):
        assert pictures[a][..., 3].max() > 0.1
        assert all(np.abs(pictures[a] - p).max() > 0.01 for p in pictures[:a])


@pytest.mark.skipif(sys.platform != "linux", reason="it is Mesa that complains")
def test_nothing_is_said_where_no_desktop_is():
    code = ("import halite; points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]\n"
            "mesh = halite.Mesh.from_arrays(points, [0, 1, 2, 3], [0, 4], [10], point_data={'s': [0, 1, 2, 3]})\n"
            "try: halite.Renderer(mesh, device='0')\n"
            "except halite.Error: print('there is no device')")
    for folder in (None, "", "relative"):
        env = {k: v for k, v in os.environ.items() if k not in ("XDG_RUNTIME_DIR", "NODEVICE_SELECT")}
        run = subprocess.run([sys.executable, "-c", code], capture_output=True,
                             env=env if folder is None else {**env, "XDG_RUNTIME_DIR": folder})
        assert run.returncode == 0 and not run.stderr, (folder, run.stderr.decode())
