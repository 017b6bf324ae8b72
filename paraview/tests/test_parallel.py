# SPDX-License-Identifier: MIT OR Apache-2.0
"""Boxes in pieces on several ranks, under mpiexec: the pictures are those of one process."""
import math
import os
import re
import tempfile

import session

import numpy as np
from paraview import servermanager, simple
from vtkmodules import vtkIOXML

from boxes import NEAR, check, lattice
from runner import main

COLOR = [(0, 0.1, 0.4, 0.9), (0.5, 0.9, 0.9, 0.2), (1, 1, 0.2, 0.1)]
OPACITY = [(0, 0.5), (0.3, 4), (0.5, 0), (1, 3)]
ABOUT = {"color": COLOR, "opacity": OPACITY}


def ranks():
    return servermanager.ActiveConnection.GetNumberOfDataPartitions()


def parts(folder, ends, axis=0, cells="hex", order=None):
    """A file that lists slabs of the unit box, between these places along an axis."""
    names = []
    for i, (a, b) in enumerate(zip(ends, ends[1:])):
        low, high = [0, 0, 0], [1, 1, 1]
        low[axis], high[axis] = a, b
        w = vtkIOXML.vtkXMLUnstructuredGridWriter()
        names.append(f"part{i}.vtu")
        w.SetFileName(os.path.join(folder, names[-1]))
        w.SetInputData(lattice(4, low, high, cells=cells))
        w.Write()
    path = os.path.join(folder, "parts.pvtu")
    with open(path, "w") as f:
        f.write('<VTKFile type="PUnstructuredGrid" version="1.0"><PUnstructuredGrid GhostLevel="0">'
                '<PPoints><PDataArray type="Float64" NumberOfComponents="3"/></PPoints>'
                '<PPointData Scalars="s"><PDataArray type="Float64" Name="s"/></PPointData>')
        f.writelines(f'<Piece Source="{names[i]}"/>' for i in order or range(len(names)))
        f.write("</PUnstructuredGrid></VTKFile>")
    return simple.XMLPartitionedUnstructuredGridReader(FileName=[path])


def check_serial(picture, name):
    """Whether a picture is that of one rank, which comes first and leaves its own."""
    path = os.path.join(os.environ["HALITE_TEST_OUTPUT"], f"one_rank_{name}.npy")
    if ranks() == 1:
        np.save(path, picture)
    else:
        apart = session.apart(picture, np.load(path))
        assert apart <= 2, f"{name} on {ranks()} ranks: {apart} of 255 from one rank's"


def drawn(ends, views=((2.1, -1.7, 2.9), (-1.5, 2.4, -1.9)), also=lambda v: None, **how):
    # ParaView blends the ranks' pictures as bytes, in pairs, and cuts off what is less.
    near = NEAR if ranks() == 1 else 2.7
    with tempfile.TemporaryDirectory() as folder:
        v = session.view()
        axis = how.pop("axis", 0)
        reader = parts(folder, ends, axis, how.pop("cells", "hex"), how.pop("order", None))
        partitions = how.pop("partitions", 0)
        d = session.show(reader, v, color=COLOR, opacity=OPACITY, **how)
        d.UseDataPartitions = partitions
        for position in views:
            v.CameraPosition = position
            picture = session.picture(v)
            worst = check(picture, session.truth(v, **ABOUT), near=near, what=f"{ranks()} ranks, {ends}")
            if not servermanager.ActiveConnection.IsRemote():
                check_serial(picture, "_".join(str(x) for x in (*ends, axis, *position)))
            also(v)
            print(f"        {worst:.2f} of 255 apart")
        if ranks() > 1 and not servermanager.ActiveConnection.IsRemote():
            # This rank has a part of the cells, and draws that.
            drawn_here = session.mapper_of(d).GetInputDataObject(0, 0).GetNumberOfCells()
            assert 0 < drawn_here < 64 * (len(ends) - 1), drawn_here
        simple.Delete(reader)
        simple.Delete(v)


def images(folder, ends):
    """A file that lists parts of an image of 8 x 4 x 4 voxels that fills the unit box, between these places along x."""
    import test_images
    whole = test_images.vtkCommonDataModel.vtkImageData()
    whole.SetDimensions(9, 5, 5)
    whole.SetSpacing(1 / 8, 1 / 4, 1 / 4)
    path = os.path.join(folder, "parts.pvti")
    with open(path, "w") as f:
        f.write('<VTKFile type="PImageData" version="1.0"><PImageData WholeExtent="0 8 0 4 0 4" GhostLevel="0" Origin="0 0 0" '
                'Spacing="0.125 0.25 0.25"><PPointData Scalars="s"><PDataArray type="Float64" Name="s"/></PPointData>')
        for i, (a, b) in enumerate(zip(ends, ends[1:])):
            part = test_images.vtkCommonDataModel.vtkImageData()
            part.SetExtent(a, b, 0, 4, 0, 4)
            part.SetSpacing(whole.GetSpacing())
            test_images.valued(part, lambda p: p[:, 2], "s")
            w = vtkIOXML.vtkXMLImageDataWriter()
            w.SetFileName(os.path.join(folder, f"part{i}.vti"))
            w.SetInputData(part)
            w.Write()
            f.write(f'<Piece Extent="{a} {b} 0 4 0 4" Source="part{i}.vti"/>')
        f.write("</PImageData></VTKFile>")
    return simple.XMLPartitionedImageDataReader(FileName=[path])


def test_images():
    import test_images
    with tempfile.TemporaryDirectory() as folder:
        v = session.view()
        reader = images(folder, [0, 1, 4, 6, 8])
        d = session.show(reader, v, color=COLOR, opacity=test_images.OPACITY)
        for position in ((2.1, -1.7, 2.9), (-1.5, 2.4, -1.9)):
            v.CameraPosition = position
            picture = session.picture(v)
            worst = check(picture, session.truth(v, color=COLOR, opacity=test_images.OPACITY, slab=True),
                          near=NEAR if ranks() == 1 else 2.7, what=f"images on {ranks()} ranks")
            check_serial(picture, "_".join(str(x) for x in ("image", *position)))
            print(f"        {worst:.2f} of 255 apart")
        mapper = session.mapper_of(d)
        assert mapper.GetClassName() == "vtkHaliteMapper"
        assert mapper.GetInputDataObject(0, 0).GetNumberOfCells() <= math.ceil(128 / ranks()) + 64
        # Each rank has its share of the cores.
        share = min(max(1, os.cpu_count() // ranks()), len(os.sched_getaffinity(0)))
        assert re.search(rf"Adapter: .*\b{share} thread", str(mapper)), re.search("Adapter: .*", str(mapper))
        simple.Delete(reader)
        simple.Delete(v)


def test_even_slabs():
    drawn([0, 0.25, 0.5, 0.75, 1])


def test_uneven_slabs():
    drawn([0, 0.125, 0.25, 0.5, 1])


def test_fewer_pieces_than_ranks():
    drawn([0, 0.5, 1], axis=1)


def test_interlocking_pieces_are_dealt_anew():
    drawn([0, 0.25, 0.5, 0.75, 1], order=[0, 2, 1, 3])


def test_partitions_as_they_are():
    drawn([0, 0.125, 0.25, 0.5, 1], partitions=1)


def test_a_rank_without_cells():
    drawn([0, 0.5, 1], axis=1, partitions=1)


if __name__ == "__main__":
    session.load()
    main(dict(globals()))
