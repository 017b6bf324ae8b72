# SPDX-License-Identifier: MIT OR Apache-2.0
"""Boxes whose pictures are known, drawn by Halite in ParaView."""
import os
import re
import tempfile

import session

import numpy as np
from paraview import simple
from vtkmodules import vtkCommonCore, vtkCommonDataModel, vtkIOXML

from boxes import NEAR, QUAD, add, check, grid, lattice
from runner import main

COLOR = [(0, 0.1, 0.4, 0.9), (0.5, 0.9, 0.9, 0.2), (1, 1, 0.2, 0.1)]
OPACITY = [(0, 0.5), (0.3, 4), (0.5, 0), (1, 3)]
POLYHEDRON = 42
# As boxes has them: rows of a value and what it stands for.
ABOUT = {"color": COLOR, "opacity": OPACITY}


def drawn(data, near=NEAR, **how):
    v = session.view()
    d = session.show(session.source(data), v, color=COLOR, opacity=OPACITY, **how)
    p = session.picture(v)
    return v, d, p


def done(v):
    for s in list(simple.GetSources().values()):
        simple.Delete(s)
    simple.Delete(v)


def test_halite_is_in_the_list():
    v, d, _ = drawn(lattice(2))
    assert "Halite" in d.GetProperty("SelectMapper").GetAvailable()
    assert "Projected tetra" in d.GetProperty("SelectMapper").GetAvailable()
    assert session.count(d, "Frames") > 0
    done(v)


def test_a_new_volume_is_drawn_once():
    """With nothing said, ParaView updates it again after the first picture; that stays."""
    v, producer = session.view(), session.source(lattice(3, cells="mixed"))
    d = simple.Show(producer, v)
    d.SetRepresentationType("Volume")
    d.SelectMapper = "Halite"
    simple.ColorBy(d, ("POINTS", "s"))
    assert session.picture(v).max() > 20
    session.picture(v)
    assert [session.count(d, what) for what in ("Frames", "MeshUploads", "FieldUploads", "Copies")] == [1, 1, 1, 0]
    done(v)


def test_cells_of_all_kinds():
    for cells in ("tet", "hex", "voxel", "wedge", "mixed"):
        v, d, p = drawn(lattice(3, cells=cells))
        check(p, session.truth(v, **ABOUT), what=cells)
        # They were not cut before they came to the mapper.
        data = session.mapper_of(d).GetInputDataObject(0, 0)
        assert data.GetNumberOfCells() == lattice(3, cells=cells).GetNumberOfCells(), cells
        done(v)


def test_cells_of_two_dimensions_are_left_out():
    g = lattice(2)
    g.InsertNextCell(QUAD, 4, [0, 1, 4, 3])
    v, _, p = drawn(g)
    check(p, session.truth(v, **ABOUT))
    done(v)


def test_values_of_cells():
    g = lattice(4, field=lambda p: p[:, 0] * 0)
    layer = (np.arange(64) // 16 + 0.5) / 4
    add(g, layer, "c", of="cell")
    v, _, p = drawn(g, array=("CELLS", "c"))
    check(p, session.truth(v, field=lambda q: (np.floor(q[..., 2] * 4).clip(0, 3) + 0.5) / 4, steps=800, **ABOUT), near=2)
    done(v)


def test_a_polyhedron():
    g = vtkCommonDataModel.vtkUnstructuredGrid()
    box = lattice(1)
    g.SetPoints(box.GetPoints())
    faces = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
    stream = vtkCommonCore.vtkIdList()
    for x in [6] + [x for f in faces for x in [4, *f]]:
        stream.InsertNextId(x)
    g.InsertNextCell(POLYHEDRON, stream)
    add(g, np.array([box.GetPoint(i)[2] for i in range(8)]))
    v, d, p = drawn(g)
    check(p, session.truth(v, **ABOUT))
    assert session.mapper_of(d).GetInputDataObject(0, 0).GetCellType(0) == POLYHEDRON
    done(v)


def test_faces_of_no_polyhedra_are_dropped():
    """ParaView's reader of several pieces leaves such, and what deals cells to ranks would read them."""
    g = lattice(2)
    faces, places = vtkCommonCore.vtkIdTypeArray(), vtkCommonCore.vtkIdTypeArray()
    for array in (faces, places):
        array.SetNumberOfValues(8)
        array.Fill(1 << 40)
    g.SetCells(g.GetCellTypesArray(), g.GetCells(), places, faces)
    assert g.GetFaces()
    v, d, p = drawn(g)
    check(p, session.truth(v, **ABOUT))
    assert session.mapper_of(d).GetInputDataObject(0, 0).GetFaces() is None
    done(v)


def test_blocks_become_one_grid():
    blocks = vtkCommonDataModel.vtkMultiBlockDataSet()
    blocks.SetBlock(0, lattice(2, high=(1, 1, 0.5)))
    blocks.SetBlock(1, lattice(2, low=(0, 0, 0.5), cells="tet"))
    v, d, p = drawn(blocks)
    check(p, session.truth(v, **ABOUT))
    # The blocks that are chosen, alone.
    d.BlockSelectors = ["/Root/Block0"]
    check(session.picture(v), session.truth(v, high=(1, 1, 0.5), **ABOUT))
    done(v)


def test_partitions_become_one_grid():
    parts = [lattice(2, high=(1, 1, 0.5)), None, lattice(2, low=(0, 0, 0.5), cells="tet")]
    one, several = vtkCommonDataModel.vtkPartitionedDataSet(), vtkCommonDataModel.vtkPartitionedDataSetCollection()
    for i, part in enumerate(parts):
        one.SetPartition(i, part)
        if part:
            several.SetPartition(several.GetNumberOfPartitionedDataSets(), 0, part)
    for data in (one, several):
        v, d, p = drawn(data)
        check(p, session.truth(v, **ABOUT), what=data.GetClassName())
        assert session.mapper_of(d).GetInputDataObject(0, 0).GetNumberOfCells() == sum(g.GetNumberOfCells() for g in parts if g)
        done(v)


def test_ghost_cells_are_left_out():
    g = lattice(4)
    add(g, np.where(np.arange(64) // 16 == 3, 1, 0).astype(np.uint8), "vtkGhostType", of="cell")
    v, _, p = drawn(g)
    check(p, session.truth(v, high=(1, 1, 0.75), **ABOUT))
    done(v)


def test_the_unit_distance_when_nobody_says():
    """It is that which ParaView gives its own mappers."""
    producer, found = session.source(lattice(4, cells="tet")), []
    for mapper in ("Projected tetra", "Halite"):
        v = session.view()
        d = simple.Show(producer, v)
        d.SelectMapper = mapper
        d.SetRepresentationType("Volume")
        session.picture(v)
        found.append(d.ScalarOpacityUnitDistance)
        simple.Delete(v)
    assert found[0] == found[1] != 1, found
    simple.Delete(producer)


def test_structured_grids():
    g = vtkCommonDataModel.vtkStructuredGrid()
    box = lattice(4)
    g.SetDimensions(5, 5, 5)
    g.SetPoints(box.GetPoints())
    g.GetPointData().ShallowCopy(box.GetPointData())
    v, d, p = drawn(g)
    check(p, session.truth(v, **ABOUT))
    assert session.count(d, "Frames") > 0
    # A layer of hidden cells at the bottom.
    for i in range(16):
        g.BlankCell(i)
    v2, d, p = drawn(g)
    check(p, session.truth(v2, low=(0, 0, 0.25), **ABOUT))
    done(v)
    done(v2)


def test_settings_in_a_saved_state():
    g = lattice(3, cells="mixed")
    with tempfile.TemporaryDirectory() as folder:
        mesh, state = os.path.join(folder, "mesh.vtu"), os.path.join(folder, "state.pvsm")
        w = vtkIOXML.vtkXMLUnstructuredGridWriter()
        w.SetFileName(mesh)
        w.SetInputData(g)
        w.Write()
        v = session.view()
        d = session.show(simple.XMLUnstructuredGridReader(FileName=[mesh]), v, color=COLOR, opacity=OPACITY)
        d.HaliteEngine = "traverse"
        d.HaliteOpacityConvention = "Opacity"
        d.HaliteNumberOfThreads = 2
        before = session.picture(v)
        slab = [(s, min(a, 0.99)) for s, a in OPACITY]
        assert session.apart(before, session.truth(v, **ABOUT)) > 20
        simple.SaveState(state)
        done(v)
        simple.LoadState(state)
        v = simple.GetActiveView()
        d = simple.GetDisplayProperties(list(simple.GetSources().values())[0], v)
        assert d.SelectMapper == "Halite" and d.HaliteEngine == "traverse" and d.HaliteNumberOfThreads == 2
        assert d.HaliteOpacityConvention == "Opacity"
        assert session.apart(session.picture(v), before) == 0
        # The settings are the mapper's, not only the display's.
        text = str(session.mapper_of(d))
        assert "Engine: traverse" in text and "OpacityConvention: Opacity" in text and "NumberOfThreads: 2" in text, text
        d.ScalarOpacityFunction.Points = [x for s, a in slab for x in (s, a, 0.5, 0)]
        check(session.picture(v), session.truth(v, color=COLOR, opacity=slab, slab=True))
        done(v)


def test_time_changes_only_values():
    """Points and cells of each step are read anew, and are equal: the mesh is handed to the core once, as long as they are."""
    steps = [lattice(3, cells="mixed", field=lambda p, k=k: p[:, 2] * (1 - 0.2 * k)) for k in range(3)]
    steps.append(lattice(3, cells="mixed", low=(0, 0, 0.1)))
    steps.append(lattice(3, cells="tet", low=(0, 0, 0.1)))
    with tempfile.TemporaryDirectory() as folder:
        v = session.view()
        d = session.show(session.series(folder, vtkIOXML.vtkXMLUnstructuredGridWriter, "vtu", steps), v, color=COLOR,
                         opacity=OPACITY)
        for k in range(3):
            v.ViewTime = k
            check(session.picture(v), session.truth(v, field=lambda q: q[..., 2] * (1 - 0.2 * k), **ABOUT), what=f"step {k}")
        assert [session.count(d, what) for what in ("MeshUploads", "FieldUploads", "FunctionUploads")] == [1, 3, 1]
        # Other points, and then other cells.
        for k in (3, 4):
            v.ViewTime = k
            check(session.picture(v), session.truth(v, low=(0, 0, 0.1), **ABOUT), what=f"step {k}")
            assert session.count(d, "MeshUploads") == k - 1
        done(v)


def test_light():
    """The field's gradient looks up, and the view's light is the camera's."""
    v, d, _ = drawn(lattice(3, cells="mixed"))
    v.UseLight = 0
    light = simple.AddLight(view=v)
    light.Coords, light.Intensity, light.DiffuseColor = "Camera", 1, [1, 1, 1]
    d.Shade = 1
    d.Ambient, d.Diffuse, d.Specular = 0.3, 0.7, 0
    camera = np.array(v.CameraFocalPoint) - v.CameraPosition
    towards = abs(camera[2]) / np.linalg.norm(camera)
    check(session.picture(v), session.truth(v, lit=lambda rgb, *_: rgb * (0.3 + 0.7 * towards), **ABOUT), near=2)
    done(v)


def test_regions():
    v, d, _ = drawn(lattice(3, cells="mixed"))
    d.HaliteCropping, d.HaliteCroppingRegionPlanes = 1, [0.1, 0.5, 0, 1, 0.2, 0.7]
    check(session.picture(v), session.truth(v, low=(0.1, 0, 0.2), high=(0.5, 1, 0.7), **ABOUT))
    d.HaliteCroppingRegionFlags = "Cross"
    inside = lambda p: sum((p[..., a] > low) & (p[..., a] < high) for a, low, high in ((0, 0.1, 0.5), (2, 0.2, 0.7)))
    # The planes of the second axis are those of the box, so all is between them.
    check(session.picture(v), session.truth(v, keep=lambda p: inside(p) >= 1, steps=1500, **ABOUT), near=2)
    done(v)


def test_threads():
    """As many as the environment says, unless the display does."""
    for settings, asked, threads in (({"HALITE_THREADS": "3"}, 0, 3), ({"HALITE_THREADS": "3"}, 2, 2),
                                     ({"HALITE_THREADS": "3", "VTK_SMP_MAX_THREADS": "1"}, 0, 1),
                                     ({"OMPI_COMM_WORLD_LOCAL_SIZE": str(2 * os.cpu_count())}, 0, 1)):
        os.environ.update(settings)
        v, d, p = drawn(lattice(2))
        d.HaliteNumberOfThreads = asked
        check(session.picture(v), session.truth(v, **ABOUT))
        text = str(session.mapper_of(d))
        assert re.search(rf"Adapter: .*\b{threads} thread", text), (settings, asked, re.search("Adapter: .*", text))
        for name in settings:
            del os.environ[name]
        done(v)


def test_components_and_magnitude():
    g = lattice(3, cells="mixed")
    z = np.array([g.GetPoint(i)[2] for i in range(g.GetNumberOfPoints())])
    add(g, np.stack([z * 0.6, z, z * 0.8], -1), "v")
    v, d, p = drawn(g, array=("POINTS", "v"))
    check(p, session.truth(v, field=lambda q: np.sqrt(2) * q[..., 2], **ABOUT))
    d.LookupTable.VectorMode = "Component"
    d.LookupTable.VectorComponent = 0
    check(session.picture(v), session.truth(v, field=lambda q: 0.6 * q[..., 2], **ABOUT))
    done(v)


def test_a_separate_array_for_opacities():
    g = lattice(3, cells="mixed")
    add(g, np.array([g.GetPoint(i)[0] for i in range(g.GetNumberOfPoints())]), "x")
    v, d, _ = drawn(g)
    d.OpacityArrayName, d.OpacityComponent = ("POINTS", "x"), ""
    d.UseSeparateOpacityArray = 1
    check(session.picture(v), session.truth(v, field=lambda q: q[..., 0], hue=lambda q: q[..., 2], steps=600, **ABOUT), near=2)
    done(v)


def test_what_the_colour_editor_does():
    """Steps, logarithms, and a colour space of its own."""
    v, d, p = drawn(lattice(3, cells="mixed", field=lambda q: 1 + 99 * q[:, 2]), mapper="Halite")
    field = lambda q: 1 + 99 * q[..., 2]
    ends = [(1, 0.1, 0.4, 0.9), (100, 1, 0.2, 0.1)]
    opacity = [(1, 0.5), (30, 4), (50, 0), (100, 3)]
    d.ScalarOpacityFunction.Points = [x for s, a in opacity for x in (s, a, 0.5, 0)]
    table = d.LookupTable
    table.RGBPoints = [x for k in ends for x in k]
    mixed = lambda t: [a + (b - a) * t for a, b in zip(ends[0][1:], ends[1][1:])]
    about = {"field": field, "opacity": opacity, "steps": 700}
    check(session.picture(v), session.truth(v, color=ends, **about), what="plain")
    # Four steps of equal width, each in the colour of its place from 0 to 1.
    table.Discretize, table.NumberOfTableValues = 1, 4
    steps = [(1 + 99 * (i + e) / 4, *mixed(i / 3)) for i in range(4) for e in (0, 1 - 1e-9)]
    check(session.picture(v), session.truth(v, color=steps, **about), near=2, what="steps")
    table.Discretize = 0
    table.UseLogScale = 1
    logarithmic = [(10 ** (2 * t), *mixed(t)) for t in np.linspace(0, 1, 400)]
    check(session.picture(v), session.truth(v, color=logarithmic, **about), near=2, what="logarithms")
    table.UseLogScale = 0
    # Hues from red to blue are piecewise linear in RGB, by way of yellow, green and cyan.
    table.RGBPoints, table.ColorSpace = [1, 1, 0, 0, 100, 0, 0, 1], "HSV"
    hues = [(1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1)]
    hues = [(1 + 99 * i / 4, *rgb) for i, rgb in enumerate(hues)]
    check(session.picture(v), session.truth(v, color=hues, **about), what="hues")
    done(v)


def test_categories():
    """Numbers that stand for something: each has the colour of its category, and what is between two that of the nearer."""
    g = lattice(4, field=lambda p: 3 * p[:, 2])
    add(g, np.arange(64) // 16, "kind", of="cell")
    colors = [(0.9, 0.1, 0.1), (0.1, 0.9, 0.1), (0.1, 0.2, 0.9), (0.9, 0.8, 0.1)]
    for array, field, near in ((("CELLS", "kind"), lambda q: np.floor(q[..., 2] * 4).clip(0, 3), 2),
                               (("POINTS", "s"), lambda q: 3 * q[..., 2], 2)):
        v, d, plain = drawn(g, array=array)
        d.ScalarOpacityFunction.Points = [0, 1, 0.5, 0, 3, 1, 0.5, 0]
        d.LookupTable.InterpretValuesAsCategories = 1
        # In no order, and one that no number is.
        order = [2, 0, 3, 1]
        d.LookupTable.Annotations = [x for i in order for x in (str(i), f"kind {i}")] + ["none", "of these"]
        d.LookupTable.IndexedColors = [x for i in order for x in colors[i]] + [1, 1, 1]
        steps = [(s, *colors[i]) for i in range(4) for s in (i - 0.5, i + 0.5)]
        check(session.picture(v), session.truth(v, field=field, opacity=[(0, 1), (3, 1)], color=steps, steps=800), near=near,
              what=array[1])
        d.LookupTable.InterpretValuesAsCategories = 0
        d.ScalarOpacityFunction.Points = [x for s, a in OPACITY for x in (s, a, 0.5, 0)]
        assert session.apart(session.picture(v), plain) == 0
        done(v)


def test_opacity_by_the_gradient():
    """The field's gradient is 1 long: the function halves the opacity there. None is none, and other mappers have none."""
    v, d, plain = drawn(lattice(3, cells="tet"))
    check(plain, session.truth(v, **ABOUT))
    d.GradientOpacity = [0.5, 0, 1.5, 1]
    check(session.picture(v), session.truth(v, factor=lambda p: 0.5, **ABOUT), what="half")
    d.GradientOpacity = [1.5, 0, 2, 1]
    assert session.picture(v).max() == 0
    d.GradientOpacity = []
    assert session.apart(session.picture(v), plain) == 0
    d.SelectMapper = "Projected tetra"
    theirs = session.picture(v)
    d.GradientOpacity = [1.5, 0, 2, 1]
    assert session.apart(session.picture(v), theirs) == 0
    done(v)


def test_switching_representations_and_loading_again():
    v, d, p = drawn(lattice(3, cells="mixed"))
    for other in ("Surface", "Outline", "Wireframe"):
        d.SetRepresentationType(other)
        assert session.apart(session.picture(v), p) > 20, other
        d.SetRepresentationType("Volume")
        assert session.apart(session.picture(v), p) == 0, other
    # A plugin that is loaded already changes nothing. ParaView reports a failure, as with plugins of its own.
    simple.LoadPlugin(os.environ["HALITE_PLUGIN"], remote=False, ns=globals())
    d.Visibility = 0
    assert session.picture(v).max() == 0
    d.Visibility = 1
    assert session.apart(session.picture(v), p) == 0
    w, e, q = drawn(lattice(3, cells="mixed"))
    assert session.apart(q, p) == 0 and list(e.GetProperty("SelectMapper").GetAvailable()).count("Halite") == 1
    done(v)
    simple.Delete(w)


def test_placement():
    v, d, _ = drawn(lattice(2, cells="mixed"))
    d.Position, d.Scale, d.Orientation = [0.2, 0.1, -0.2], [1, 0.5, 1.5], [0, 0, 30]
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    matrix = np.array([[c, -0.5 * s, 0, 0.2], [s, 0.5 * c, 0, 0.1], [0, 0, 1.5, -0.2], [0, 0, 0, 1]])
    check(session.picture(v), session.truth(v, matrix=matrix, **ABOUT))
    done(v)


def test_other_mappers_draw_as_before():
    v, d, _ = drawn(lattice(4, cells="tet"), mapper="Projected tetra")
    assert session.mapper_of(d).GetClassName() == "vtkOpenGLProjectedTetrahedraMapper"
    theirs = session.picture(v)
    d.SelectMapper = "Halite"
    ours = session.picture(v)
    check(ours, session.truth(v, **ABOUT))
    assert session.count(d, "Frames") == 1
    d.SelectMapper = "Projected tetra"
    assert session.apart(session.picture(v), theirs) == 0
    # They classify vertices, and miss what the function does between them.
    assert 5 < session.apart(theirs, ours)
    done(v)


def test_a_new_session_has_it():
    """ParaView forgets its own session with all that is in it. No plugin is unloaded meanwhile; the new session reads its definitions."""
    v, _, p = drawn(lattice(2))
    done(v)
    simple.ResetSession()
    session.load()
    v, d, q = drawn(lattice(2))
    assert session.apart(p, q) == 0 and list(d.GetProperty("SelectMapper").GetAvailable()).count("Halite") == 1
    done(v)


if __name__ == "__main__":
    session.load()
    main(dict(globals()))
