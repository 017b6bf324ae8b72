# SPDX-License-Identifier: MIT OR Apache-2.0
"""Volumes in windows of VTK, pixel by pixel against the truth."""
import gc
import os
import subprocess
import sys
import tracemalloc
import weakref

import numpy as np
import pytest

pytest.importorskip("vtkmodules")

from vtkmodules import vtkCommonCore, vtkCommonDataModel, vtkRenderingCore  # noqa: E402
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy  # noqa: E402
from vtkmodules.vtkRenderingUI import vtkGenericRenderWindowInteractor  # noqa: E402

import halite  # noqa: E402
import halite.vtk  # noqa: E402
from conftest import chord, lattice, resident  # noqa: E402
from windows import NEAR, SIZE, depth_of, grid, over, pixels, plane, renderer, to_clip, window  # noqa: E402

@pytest.mark.parametrize("parallel", [False, True])
@pytest.mark.parametrize("distance", [None, -4.0, 0.0, 2.5])
def test_opaque_geometry(fog, distance, parallel):
    r = renderer((0.2, 0, 0.4))
    r.GetActiveCamera().SetParallelProjection(parallel)
    r.GetActiveCamera().SetParallelScale(1.9)
    halite.vtk.add_volume(r, grid(), transfer=fog)
    behind, depth = (0.2, 0, 0.4), None
    if distance is not None:
        r.AddActor(plane(distance))
        behind = (0.2, 0.4, 0.8)
    w = window(r)
    r.ResetCameraClippingRange()
    w.Render()
    if distance is not None:
        depth = np.full(SIZE[::-1], depth_of(r, distance))
    truth = chord(to_clip(r), *SIZE, depth)
    assert truth[..., 3].max() > 0.8 or distance == 2.5
    assert np.abs(pixels(w)[..., :3] - over(truth, behind)).max() < NEAR


def test_viewports_and_layers(fog):
    views = [(0, 0, 0.5, 1), (0.5, 0, 1, 0.5), (0.5, 0.5, 1, 1)]
    all_of = [renderer((0.2 * k, 0, 0), v) for k, v in enumerate(views)]
    volume = halite.vtk.Volume(grid(), transfer=fog)
    for r in all_of:
        volume.add_to(r)
    w = window(*all_of)
    picture = pixels(w)
    width, height = SIZE
    for k, (r, v) in enumerate(zip(all_of, views)):
        part = picture[round((1 - v[3]) * height):round((1 - v[1]) * height), round(v[0] * width):round(v[2] * width), :3]
        assert np.abs(part - over(chord(to_clip(r), part.shape[1], part.shape[0]), (0.2 * k, 0, 0))).max() < NEAR
    top = renderer()
    top.SetLayer(1)
    w = window(renderer((0.4, 0.4, 0.4)), top)
    w.SetNumberOfLayers(2)
    halite.vtk.add_volume(top, grid(), transfer=fog)
    top.ResetCameraClippingRange()
    assert np.abs(pixels(w)[..., :3] - over(chord(to_clip(top), *SIZE), (0.4, 0.4, 0.4))).max() < NEAR


@pytest.mark.parametrize("what", ["fxaa", "peeling", "peeling of volumes", "tiles"])
def test_the_ways_of_vtk(fog, what):
    r = renderer()
    halite.vtk.add_volume(r, grid(), transfer=fog)
    w = window(r)
    if what == "fxaa":
        r.UseFXAAOn()
    elif what.startswith("peeling"):
        r.UseDepthPeelingOn()
        r.SetUseDepthPeelingForVolumes(what == "peeling of volumes")
    r.ResetCameraClippingRange()
    truth = over(chord(to_clip(r), *SIZE), (0, 0, 0))
    if what == "tiles":
        shot = vtkRenderingCore.vtkWindowToImageFilter()
        shot.SetInput(w)
        shot.SetScale(2)
        shot.SetInputBufferTypeToRGBA()
        shot.Update()
        image = shot.GetOutput()
        tiled = vtk_to_numpy(image.GetPointData().GetScalars()).reshape(2 * SIZE[1], 2 * SIZE[0], 4)[::-1].astype(float)
        big = over(chord(to_clip(r), 2 * SIZE[0], 2 * SIZE[1]), (0, 0, 0))
        assert np.abs(tiled[..., :3] - big).max() < NEAR
    # FXAA blends over edges.
    near = NEAR if what != "fxaa" else 40
    assert np.abs(pixels(w)[..., :3] - truth).max() < near


def test_alpha(fog):
    r = renderer()
    r.SetBackgroundAlpha(0.5)
    halite.vtk.add_volume(r, grid(), transfer=fog)
    w = window(r)
    picture, truth = pixels(w), chord(to_clip(r), *SIZE)
    assert np.abs(picture[..., 3] - 255 * (truth[..., 3] + (1 - truth[..., 3]) * 0.5)).max() < NEAR


def test_changes_are_followed(fog):
    r, g = renderer(), grid()
    v = halite.vtk.add_volume(r, g, transfer=fog)
    w = window(r)
    r.ResetCameraClippingRange()
    first = pixels(w)
    frames = v.frames
    pixels(w)
    assert v.frames == frames > 0, "a still frame costs nothing"
    v.transfer = halite.TransferFunction([(0, 0, 1, 0)], opacity=1.0, unit_distance=0.5)
    green = pixels(w)
    assert np.abs(green - first).max() > 50
    # Values: thin where they are 0.
    v.transfer = halite.TransferFunction([(0, 1, 1, 1)], opacity=[(0, 0), (1, 2)])
    full = pixels(w)
    vtk_to_numpy(g.GetPointData().GetScalars())[:] = 0
    g.GetPointData().GetScalars().Modified()
    assert pixels(w)[..., :3].max() == 0 and full[..., :3].max() > 100
    v.SetVisibility(False)
    frames = v.frames
    pixels(w)
    assert v.frames == frames
    v.SetVisibility(True)
    vtk_to_numpy(g.GetPointData().GetScalars())[:] = 1
    g.GetPointData().GetScalars().Modified()
    v.SetPosition(50, 0, 0)
    r.ResetCameraClippingRange()
    assert pixels(w)[..., :3].max() == 0
    r.RemoveViewProp(v)
    pixels(w)


def test_dragging_is_coarser(fog):
    r = renderer()
    v = halite.vtk.add_volume(r, grid(), transfer=fog)
    w = window(r)
    still = pixels(w)
    w.SetDesiredUpdateRate(15)
    coarse = pixels(w)
    assert 0 < np.abs(still - coarse).mean() < 6
    w.SetDesiredUpdateRate(0.0001)
    assert (pixels(w) == still).all() and v.error is None


def test_bounds_and_picking(fog):
    r = renderer()
    v = halite.vtk.add_volume(r, grid(), transfer=fog)
    assert v.GetBounds() == pytest.approx((-1, 1, -1, 1, -1, 1))
    back = plane(-4.0)
    r.AddActor(back)
    w = window(r)
    r.ResetCameraClippingRange()
    w.Render()
    selector = vtkRenderingCore.vtkHardwareSelector()
    selector.SetRenderer(r)
    selector.SetArea(SIZE[0] // 2, SIZE[1] // 2, SIZE[0] // 2, SIZE[1] // 2)
    found = selector.Select()
    assert found.GetNumberOfNodes() == 1
    assert v.error is None


def test_errors_are_raised_and_survived(fog, monkeypatch):
    r, g = renderer(), grid()
    v = halite.vtk.add_volume(r, g, transfer=fog)
    w = window(r)
    good = pixels(w)
    v.scalars = "nothing"
    for _ in range(2):
        with pytest.raises(halite.Error, match='"nothing"') as raised:
            w.Render()
        assert v.error is raised.value
    # Where VTK asks for the frame, whoever called VTK gets it; tiles are several frames.
    shown = []
    monkeypatch.setattr(sys, "excepthook", lambda kind, error, trace: shown.append(error))
    shot = vtkRenderingCore.vtkWindowToImageFilter()
    shot.SetInput(w)
    shot.ShouldRerenderOn()
    for scale in (1, 1, 2):
        shot.SetScale(scale)
        shot.Modified()
        with pytest.raises(halite.Error, match='"nothing"') as raised:
            shot.Update()
    assert not shown and str(v.error) == str(raised.value)
    # Others' observers at the end of a frame see nothing of it.
    ends = []
    observer = w.AddObserver("EndEvent", lambda *_: [ends.append(i) for i in range(3)])
    shot.Modified()
    with pytest.raises(halite.Error, match='"nothing"'):
        shot.Update()
    w.RemoveObserver(observer)
    assert len(ends) == 12 and not shown
    # While a user drags, nobody could catch it: it is shown, once.
    interactor = vtkGenericRenderWindowInteractor()
    interactor.SetRenderWindow(w)
    interactor.Initialize()
    v.scalars = "other"
    for _ in range(3):
        interactor.Render()
    assert len(shown) == 1 and '"other"' in str(shown[0])
    v.scalars = "s"
    assert (pixels(w) == good).all() and v.error is None
    # Ctrl-C while a frame is drawn.
    monkeypatch.setattr(v, "_picture", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt):
        w.Render()
    monkeypatch.undo()
    assert (pixels(w) == good).all()
    with pytest.raises(halite.Error, match="vtkPolyData"):
        halite.vtk.add_volume(r, vtkCommonDataModel.vtkPolyData())


def test_ambient_occlusion_is_refused(fog):
    r = renderer()
    v = halite.vtk.add_volume(r, grid(), transfer=fog)
    w = window(r)
    good = pixels(w)
    r.UseSSAOOn()
    with pytest.raises(halite.Error, match="SSAO"):
        w.Render()
    r.UseSSAOOff()
    assert (pixels(w) == good).all() and v.error is None


def test_windows_come_and_go(fog):
    r = renderer()
    v = halite.vtk.add_volume(r, grid(), transfer=fog)
    first = pixels(window(r))
    for _ in range(3):
        w = window(r)
        assert (pixels(w) == first).all()
        w.Finalize()
        w.RemoveRenderer(r)
    for _ in range(20):
        r.RemoveViewProp(v)
        del v
        gc.collect()
        v = halite.vtk.add_volume(r, grid(), transfer=fog)
    assert (pixels(window(r)) == first).all()


@pytest.mark.parametrize("how", ["removed", "with its window", "never shown"])
def test_volumes_are_freed_with_what_shows_them(fog, how):
    r = renderer()
    v = halite.vtk.add_volume(r, grid(), transfer=fog)
    w = window(r)
    core = weakref.ref(v._renderer)
    if how != "never shown":
        w.Render()
    alive = weakref.ref(v)
    del v
    gc.collect()
    assert core() is not None, "the renderer has it"
    if how == "removed":
        r.RemoveViewProp(r.GetVolumes().GetItemAsObject(0))
        # VTK keeps its list of volumes until it makes another.
        assert r.GetVolumes().GetNumberOfItems() == 0
    else:
        del w, r
    gc.collect()
    # With the next volume, or the next frame of one.
    other = halite.vtk.Volume(grid(), transfer=fog)
    gc.collect()
    assert other.frames == 0 and alive() is None and core() is None, "VTK has it no more"


@pytest.mark.skipif(sys.platform != "linux", reason="memory is read from /proc")
def test_volumes_come_and_go_in_level_memory(fog):
    r = renderer()
    w = window(r)

    def volumes():
        for _ in range(50):
            big = grid(size=16)
            v = halite.vtk.add_volume(r, big, transfer=fog)
            w.Render()
            r.RemoveViewProp(v)
        del v
        gc.collect()
        return resident()

    volumes()
    before = volumes()
    # One mesh in five, as its renderer holds it.
    grown = volumes() - before
    assert grown < 10 * 200 * 16 ** 3, grown
    # One that nobody has but the renderer is drawn; one that was removed is drawn again where it is added.
    halite.vtk.add_volume(r, grid(), transfer=fog)
    gc.collect()
    good = pixels(w)
    assert good[..., :3].max() > 100
    v = r.GetVolumes().GetItemAsObject(0)
    r.RemoveViewProp(v)
    assert pixels(w)[..., :3].max() == 0
    v.add_to(r)
    del v
    gc.collect()
    assert (pixels(w) == good).all() and (pixels(w) == good).all()


@pytest.mark.skipif(sys.platform != "linux", reason="memory is read from /proc")
def test_frames_take_level_memory(fog):
    r = renderer()
    halite.vtk.add_volume(r, grid(), transfer=fog)
    w = window(r)

    def frames():
        for _ in range(150):
            r.GetActiveCamera().Azimuth(1)
            w.Render()
        gc.collect()
        return resident()

    frames()
    before = frames()
    # A picture in ten would show.
    assert frames() - before < 15 * 20 * SIZE[0] * SIZE[1]


@pytest.mark.parametrize("order", ["volume renderer window", "window renderer volume", "renderer window volume", ""])
def test_programs_end_in_any_order(order):
    """Whatever is deleted first, and what the interpreter deletes itself."""
    code = ("import sys; sys.path.insert(0, sys.argv[1])\n"
            "import halite.vtk\nfrom windows import grid, renderer as r, window as w\n"
            "renderer = r(); window = w(renderer); volume = halite.vtk.add_volume(renderer, grid())\n"
            "window.Render(); frames = volume.frames\n"
            "for name in sys.argv[2].split(): del globals()[name]\n"
            "print('drawn', frames)")
    here = os.path.dirname(os.path.abspath(__file__))
    run = subprocess.run([sys.executable, "-c", code, here, order], capture_output=True, text=True)
    assert run.returncode == 0 and run.stdout.strip() == "drawn 1" and "Error" not in run.stderr, run.stdout + run.stderr


@pytest.mark.parametrize("bits", [32, 64])
def test_vtks_arrays_are_read_where_they_are(bits):
    g = grid(size=20)
    cells = g.GetCells()
    if bits == 32:
        cells.ConvertTo32BitStorage()
    arrays = [g.GetPoints().GetData(), cells.GetConnectivityArray(), g.GetPointData().GetScalars()]
    for array in arrays:
        address = int(array.GetVoidPointer(0).split("_")[1], 16)
        assert halite._from_vtk.viewed(array).__array_interface__["data"][0] == address
    assert halite._from_vtk.viewed(arrays[1]).itemsize == bits // 8
    halite.Mesh.from_vtk(g)
    tracemalloc.start()
    try:
        halite.Mesh.from_vtk(g)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    # VTK says by a function where cells of one kind start, which numpy must list.
    listed = 8 * (g.GetNumberOfCells() + 1) if not cells.GetOffsetsArray().HasStandardMemoryLayout() else 0
    assert peak < 30_000 + listed < vtk_to_numpy(arrays[1]).nbytes


def test_vtks_arrays_may_move(fog):
    """VTK gives an array other memory when it grows; a mesh reads it where it is."""
    g = grid()
    mesh = halite.Mesh.from_vtk(g)
    values = g.GetPointData().GetScalars()
    name, view = values.GetName(), halite.View((3, -2.5, 2), view_up=(0, 0, 1), size=(40, 40))
    good = halite.Renderer(mesh, name, transfer=fog).render(view)
    values.SetNumberOfTuples(100_000)
    values.Fill(1)
    with pytest.raises(halite.Error, match="100000"):
        halite.Renderer(mesh, name, transfer=fog)
    values.SetNumberOfTuples(g.GetNumberOfPoints())
    values.Squeeze()
    assert (halite.Renderer(mesh, name, transfer=fog).render(view) == good).all()
    del g, values
    gc.collect()
    assert (halite.Renderer(mesh, name, transfer=fog).render(view) == good).all()


def test_kinds_of_grids():
    structured = vtkCommonDataModel.vtkStructuredGrid()
    structured.SetDimensions(3, 3, 3)
    structured.SetPoints(grid().GetPoints())
    image = vtkCommonDataModel.vtkImageData()
    image.SetDimensions(3, 3, 3)
    image.SetOrigin(-1, -1, -1)
    rectilinear = vtkCommonDataModel.vtkRectilinearGrid()
    rectilinear.SetDimensions(3, 3, 3)
    for axis in "XYZ":
        getattr(rectilinear, f"Set{axis}Coordinates")(numpy_to_vtk(np.array([-1.0, 0, 1]), deep=1))
    points = lattice()[0]
    view = halite.View((3, -2.5, 2), view_up=(0, 0, 1), size=(40, 40))
    transfer = halite.TransferFunction("viridis", (-1, 1), opacity=[0.2, 1])
    pictures = []
    for g in (grid(points[:, 0]), structured, image, rectilinear):
        if g.GetPointData().GetScalars() is None:
            a = numpy_to_vtk(points[:, 0].copy(), deep=1)
            a.SetName("s")
            g.GetPointData().SetScalars(a)
        pictures.append(halite.Renderer(halite.Mesh.from_vtk(g), "s", transfer=transfer).render(view))
    assert pictures[0][..., 3].max() > 0.3
    assert all(np.abs(p - pictures[0]).max() < 2e-6 for p in pictures[1:])


def test_cells_of_one_type(fog):
    """VTK keeps one type for all cells of a grid that is made so, from 9.6 on without an array of them."""
    made = grid()
    of_one = vtkCommonDataModel.vtkUnstructuredGrid()
    of_one.SetPoints(made.GetPoints())
    of_one.SetCells(12, made.GetCells())
    of_one.GetPointData().SetScalars(made.GetPointData().GetScalars())
    meshes = [halite.Mesh.from_vtk(g) for g in (made, of_one)]
    assert [m.n_cells for m in meshes] == [8, 8]
    view = halite.View((3, -2.5, 2), view_up=(0, 0, 1), size=(40, 40))
    pictures = [halite.Renderer(m, transfer=fog).render(view) for m in meshes]
    assert (pictures[0] == pictures[1]).all() and pictures[0][..., 3].max() > 0.1


def test_room_behind_cells_is_none_of_theirs(fog):
    """As VTK leaves it where it removes ghosts."""
    g = grid()
    good = halite.Renderer(halite.Mesh.from_vtk(g), transfer=fog)
    cells = g.GetCells()
    corners = cells.GetConnectivityArray()
    longer = numpy_to_vtk(np.append(vtk_to_numpy(corners).astype(np.int64), [-5, 1 << 40]), deep=1, array_type=vtkCommonCore.VTK_ID_TYPE)
    starts = numpy_to_vtk(vtk_to_numpy(cells.GetOffsetsArray()).astype(np.int64), deep=1, array_type=vtkCommonCore.VTK_ID_TYPE)
    more = vtkCommonDataModel.vtkCellArray()
    more.SetData(starts, longer)
    g.SetCells(12, more)
    view = halite.View((3, -2.5, 2), view_up=(0, 0, 1), size=(40, 40))
    assert (halite.Renderer(halite.Mesh.from_vtk(g), transfer=fog).render(view) == good.render(view)).all()


def test_polyhedra():
    g = vtkCommonDataModel.vtkUnstructuredGrid()
    points, cells, offsets, types = lattice(1)
    p = vtkCommonCore.vtkPoints()
    p.SetData(numpy_to_vtk(points, deep=1))
    g.SetPoints(p)
    faces = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
    ids = vtkCommonCore.vtkIdList()
    for i in [len(faces)] + [x for f in faces for x in [len(f), *f]]:
        ids.InsertNextId(i)
    g.InsertNextCell(42, ids)
    mesh = halite.Mesh.from_vtk(g)
    assert mesh.n_cells == 1
    box = halite.Mesh.from_arrays(points, cells, offsets, types, point_data={"s": points[:, 0]})
    a = numpy_to_vtk(points[:, 0].copy(), deep=1)
    a.SetName("s")
    g.GetPointData().SetScalars(a)
    view = halite.View((3, -2.5, 2), view_up=(0, 0, 1), size=(40, 40))
    pictures = [halite.Renderer(m).render(view) for m in (box, halite.Mesh.from_vtk(g))]
    assert np.abs(pictures[0] - pictures[1]).max() < 1e-5 and pictures[0][..., 3].max() > 0.1
