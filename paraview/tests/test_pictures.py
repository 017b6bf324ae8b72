# SPDX-License-Identifier: MIT OR Apache-2.0
"""Boxes whose pictures are known, drawn by Halite in ParaView."""
import os
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


if __name__ == "__main__":
    session.load()
    main(dict(globals()))
