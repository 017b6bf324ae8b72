# SPDX-License-Identifier: MIT OR Apache-2.0
"""Image data and rectilinear grids, drawn by Halite in ParaView as they are."""
import os
import tempfile

import session

import numpy as np
from paraview import simple
from vtkmodules import vtkCommonDataModel, vtkIOXML
from vtkmodules.util import numpy_support

from boxes import add, check
from runner import main

COLOR = [(0, 0.1, 0.4, 0.9), (0.5, 0.9, 0.9, 0.2), (1, 1, 0.2, 0.1)]
OPACITY = [(0, 0.5), (0.3, 0.95), (0.5, 0), (1, 0.8)]
ABOUT = {"color": COLOR, "opacity": OPACITY, "slab": True}
# Axes of a rectilinear grid whose spaces differ.
AXES = [0, 0.1, 0.4, 0.55, 1]


def image(field=lambda p: p[:, 2], name="s"):
    g = vtkCommonDataModel.vtkImageData()
    g.SetDimensions(5, 5, 5)
    g.SetSpacing(0.25, 0.25, 0.25)
    return valued(g, field, name)


def rectilinear(field=lambda p: p[:, 2], name="s"):
    g = vtkCommonDataModel.vtkRectilinearGrid()
    g.SetDimensions(5, 5, 5)
    for axis in "XYZ":
        getattr(g, f"Set{axis}Coordinates")(numpy_support.numpy_to_vtk(np.array(AXES), deep=1))
    return valued(g, field, name)


def valued(g, field, name):
    add(g, field(np.array([g.GetPoint(i) for i in range(g.GetNumberOfPoints())])), name)
    return g


def drawn(data, **how):
    v = session.view()
    d = session.show(session.source(data), v, color=COLOR, opacity=OPACITY, **how)
    return v, d, session.picture(v)


def done(v):
    for s in list(simple.GetSources().values()):
        simple.Delete(s)
    simple.Delete(v)


def test_images_and_rectilinear_grids_are_drawn_as_they_are():
    for make, kind in ((image, "vtkImageData"), (rectilinear, "vtkRectilinearGrid")):
        v, d, p = drawn(make())
        assert list(d.GetProperty("SelectMapper").GetAvailable())[-1] == "Halite"
        check(p, session.truth(v, **ABOUT), what=kind)
        mapper = session.mapper_of(d)
        assert mapper.GetClassName() == "vtkHaliteMapper" and mapper.GetInputDataObject(0, 0).GetClassName() == kind
        # A picture that stays costs nothing.
        session.picture(v)
        assert session.count(d, "Frames") == 1
        done(v)


def test_the_mapper_of_before_is_the_default():
    v, d, p = drawn(image(), mapper=None)
    assert d.SelectMapper == "By rendering mode"
    assert session.mapper_of(d).GetClassName() == "vtkMultiBlockVolumeMapper"
    d.SelectMapper = "Halite"
    check(session.picture(v), session.truth(v, **ABOUT))
    d.SelectMapper = "By rendering mode"
    assert session.apart(session.picture(v), p) == 0
    # Isosurfaces are ParaView's.
    d.BlendMode = "Isosurface"
    d.IsosurfaceValues = [0.4]
    theirs = session.picture(v)
    d.SelectMapper = "Halite"
    assert theirs.max() > 50 and session.apart(session.picture(v), theirs) == 0
    done(v)


def pieces(cuts, ghosts=0):
    """The image as images of its own between cuts along each axis, with layers of ghosts of their neighbours."""
    whole = image()
    blocks = vtkCommonDataModel.vtkMultiBlockDataSet()
    spans = [list(zip([0, *c], [*c, 4])) for c in cuts]
    for x in spans[0]:
        for y in spans[1]:
            for z in spans[2]:
                grown = [e for low, high in (x, y, z) for e in (max(low - ghosts, 0), min(high + ghosts, 4))]
                piece = vtkCommonDataModel.vtkImageData()
                piece.SetExtent(*grown)
                piece.SetSpacing(*whole.GetSpacing())
                valued(piece, lambda p: p[:, 2], "s")
                if ghosts:
                    marks = [[low <= i < high for i in range(grown[2 * a], grown[2 * a + 1])] for a, (low, high) in enumerate((x, y, z))]
                    own = np.einsum("k,j,i->kji", *[np.array(m, int) for m in reversed(marks)]).ravel()
                    add(piece, (1 - own).astype(np.uint8), "vtkGhostType", of="cell")
                blocks.SetBlock(blocks.GetNumberOfBlocks(), piece)
    return blocks


def test_several_images():
    """Blocks are drawn one behind another, from wherever they are seen: the picture is that of one image, but for the rounding."""
    about = {**ABOUT}
    eyes = [(2.1, -1.7, 2.9), (-1.6, 2.4, -1.9), (0.5, 0.45, 3.5)]
    for cuts, ghosts in ((([2], [], []), 0), (([1, 3], [2], [1]), 0), (([2], [2], [2]), 1)):
        for eye in eyes:
            v = session.view(position=eye, up=(0, 1, 0) if eye[0] == 0.5 else (0, 0, 1))
            v.CameraParallelProjection = int(eye == eyes[1])
            v.CameraParallelScale = 1.2
            d = session.show(session.source(pieces(cuts, ghosts)), v, color=COLOR, opacity=OPACITY)
            check(session.picture(v), session.truth(v, **about), what=f"{cuts} with {ghosts} ghosts from {eye}")
            assert session.mapper_of(d).GetClassName() == "vtkHaliteMapper"
            session.picture(v)
            grids = (len(cuts[0]) + 1) * (len(cuts[1]) + 1) * (len(cuts[2]) + 1)
            assert session.count(d, "Frames") == grids and session.count(d, "MeshUploads") == grids
            done(v)
    # A plane inside, opaque and peeled: beside one image, in the same window.
    v = session.view()
    d = session.show(session.source(pieces([[1, 3], [2], [1]])), v, color=COLOR, opacity=OPACITY)
    one = session.show(session.source(image()), v, color=COLOR, opacity=OPACITY)
    plane = simple.Show(simple.Plane(Origin=[-0.2, -0.2, 0.4], Point1=[1.2, -0.2, 0.6], Point2=[-0.2, 1.2, 0.4]), v)

    def both():
        pictures = []
        for d.Visibility in (0, 1):
            one.Visibility = 1 - d.Visibility
            pictures.append(session.picture(v))
        return pictures

    plane.Visibility = 0
    alone = both()
    assert session.apart(*alone) <= 1
    plane.Visibility = 1
    for plane.Opacity in (1, 0.5):
        pictures = both()
        assert session.apart(*pictures) <= 2 and session.apart(pictures[1], alone[1]) > 20, plane.Opacity
    # A maximum has no front and back.
    plane.Visibility = 0
    d.HaliteBlendMode = "Maximum"
    session.picture(v)
    assert session.mapper_of(d).GetClassName() == "vtkMultiBlockVolumeMapper"
    d.HaliteBlendMode = "Composite"
    assert session.apart(session.picture(v), alone[1]) == 0
    done(v)


def test_opacity_by_the_gradient():
    v, d, plain = drawn(image())
    d.GradientOpacity = [0.5, 0, 1.5, 1]
    check(session.picture(v), session.truth(v, factor=lambda p: 0.5, **ABOUT), what="half")
    d.SelectMapper = "By rendering mode"
    theirs = session.picture(v)
    d.GradientOpacity = []
    assert session.apart(session.picture(v), theirs) == 0
    d.SelectMapper = "Halite"
    assert session.apart(session.picture(v), plain) == 0
    done(v)


def test_values_of_cells():
    g = image()
    layer = (np.arange(64) // 16 + 0.5) / 4
    add(g, layer, "c", of="cell")
    v, _, p = drawn(g, array=("CELLS", "c"))
    check(p, session.truth(v, field=lambda q: (np.floor(q[..., 2] * 4).clip(0, 3) + 0.5) / 4, steps=800, **ABOUT), near=2)
    done(v)


def test_components_and_magnitude():
    g = rectilinear(lambda p: np.stack([p[:, 2] * 0.6, p[:, 0], p[:, 2] * 0.8], -1), "v")
    v, d, _ = drawn(g, array=("POINTS", "v"))
    d.LookupTable.VectorMode = "Component"
    d.LookupTable.VectorComponent = 1
    check(session.picture(v), session.truth(v, field=lambda q: q[..., 0], **ABOUT))
    done(v)


def test_hidden_cells():
    g = vtkCommonDataModel.vtkUniformGrid()
    g.ShallowCopy(image())
    for i in range(16):
        g.BlankCell(i)
    v, d, p = drawn(g)
    check(p, session.truth(v, low=(0, 0, 0.25), **ABOUT))
    done(v)


def test_placement_and_cropping():
    v, d, _ = drawn(image())
    d.Position, d.Scale, d.Orientation = [0.2, 0.1, -0.2], [1, 0.5, 1.5], [0, 0, 30]
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    matrix = np.array([[c, -0.5 * s, 0, 0.2], [s, 0.5 * c, 0, 0.1], [0, 0, 1.5, -0.2], [0, 0, 0, 1]])
    check(session.picture(v), session.truth(v, matrix=matrix, **ABOUT))
    # ParaView's box: an origin, and scales of the bounds.
    d.UseCropping = 1
    d.CroppingOrigin, d.CroppingScale = [0.1, 0.2, 0], [0.5, 0.7, 0.6]
    box = {"low": (0.1, 0.2, 0), "high": (0.6, 0.9, 0.6)}
    check(session.picture(v), session.truth(v, matrix=matrix, **box, **ABOUT))
    # Regions of the mapper's own, within that.
    d.HaliteCropping = 1
    d.HaliteCroppingRegionPlanes = [0, 0.5, 0, 1, 0.1, 1]
    box = {"low": (0.1, 0.2, 0.1), "high": (0.5, 0.9, 0.6)}
    check(session.picture(v), session.truth(v, matrix=matrix, **box, **ABOUT))
    d.UseCropping = 0
    box = {"low": (0, 0, 0.1), "high": (0.5, 1, 1)}
    check(session.picture(v), session.truth(v, matrix=matrix, **box, **ABOUT))
    done(v)


def test_light():
    """The field's gradient looks up, and the view's light comes from the eye."""
    v, d, p = drawn(image())
    v.UseLight = 0
    light = simple.AddLight(view=v)
    light.Coords, light.Intensity, light.DiffuseColor = "Camera", 1, [1, 1, 1]
    d.Shade = 1
    d.Ambient, d.Diffuse, d.Specular = 0.3, 0.7, 0
    lit = session.picture(v)
    camera = np.array(v.CameraFocalPoint) - v.CameraPosition
    camera /= np.linalg.norm(camera)
    # A light of the camera shines along where that looks.
    check(lit, session.truth(v, lit=lambda rgb, *_: rgb * (0.3 + 0.7 * abs(camera[2])), **ABOUT), near=2)
    assert session.apart(lit, session.truth(v, **ABOUT)) > 20
    done(v)


def test_every_setting_is_kept_in_a_saved_state():
    """Each property of the mapper, with a value that is not its default: in the display, and in the mapper behind it."""
    settings = {
        "Engine": ("traverse", "Engine: traverse"),
        "Device": ("cpu", "Device: cpu"),
        "BlendMode": ("Maximum", "Blend Mode: 1"),
        "OpacityConvention": ("Extinction", "OpacityConvention: Extinction"),
        "Integral": ("second-order-polynomial", "Integral: second-order-polynomial"),
        "TableSize": ([64, 64, 0], "TableSize: 64 64 0"),
        "TableTexels": ("unorm16", "TableTexels: unorm16"),
        "PolynomialDegree": (3, "PolynomialDegree: 3"),
        "Reconstruction": ("2", "Reconstruction: 2"),
        "SampleDistance": (0.125, "SampleDistance: 0.125"),
        "Transfer2DYAxisArray": ("second", "Transfer2DYAxisArray: second"),
        "Widgets": (['{"type": "gaussian"}'], 'Widget: {"type": "gaussian"}'),
        "SilhouettePower": (2, "SilhouettePower: 2"),
        "Cropping": (1, "Cropping: On"),
        "CroppingRegionPlanes": ([0, 0.5, 0, 0.25, 0, 0.75], "CroppingRegionPlanes: 0 0.5 0 0.25 0 0.75"),
        "CroppingRegionFlags": ("Cross", "CroppingRegionFlags: 4289552"),
        "ImageSampleDistance": (2, "ImageSampleDistance: 2"),
        "InteractiveImageSampleDistance": (8, "InteractiveImageSampleDistance: 8"),
        "NumberOfThreads": (2, "NumberOfThreads: 2"),
    }
    held = lambda d, name: (list if isinstance(settings[name][0], list) else lambda x: x)(getattr(d, "Halite" + name))
    with tempfile.TemporaryDirectory() as folder:
        path, state = os.path.join(folder, "image.vti"), os.path.join(folder, "state.pvsm")
        w = vtkIOXML.vtkXMLImageDataWriter()
        w.SetFileName(path)
        w.SetInputData(image())
        w.Write()
        v = session.view()
        d = session.show(simple.XMLImageDataReader(FileName=[path]), v, color=COLOR, opacity=OPACITY)
        listed = {name[len("Halite"):] for name in d.ListProperties() if name.startswith("Halite")}
        assert listed == set(settings), listed ^ set(settings)
        for name, (value, _) in settings.items():
            assert held(d, name) != value, f"{name} is tested with its default"
            setattr(d, "Halite" + name, value)
        d.GradientOpacity = [0.5, 0, 1.5, 1]
        # Values that make no picture are kept, too.
        d.Visibility = 0
        simple.SaveState(state)
        done(v)
        simple.LoadState(state)
        v = simple.GetActiveView()
        d = simple.GetDisplayProperties(list(simple.GetSources().values())[0], v)
        assert d.SelectMapper == "Halite"
        for name, (value, _) in settings.items():
            assert held(d, name) == value, (name, held(d, name))
        assert list(d.GradientOpacity) == [0.5, 0, 1.5, 1]
        d.HaliteWidgets, d.HaliteTransfer2DYAxisArray, d.HaliteIntegral = [], "", "exact"
        d.Visibility = 1
        session.picture(v)
        text = str(session.mapper_of(d))
        for name, (_, line) in settings.items():
            if name not in ("Widgets", "Transfer2DYAxisArray", "Integral"):
                assert "  " + line + "\n" in text, (name, text)
        done(v)


def test_reconstructions_and_their_tables():
    """A field that is linear is the same through any of these; what they are off is that of their tables."""
    for reconstruction, integral, table, near in (("2", "second-order-polynomial", [32, 32, 0], 2),
                                                  ("1", "volume", [64, 64, 16], 3), ("1", "exact", [0, 0, 0], 1.5)):
        v, d, _ = drawn(image())
        d.HaliteTableSize = table
        d.HaliteReconstruction, d.HaliteIntegral = reconstruction, integral
        check(session.picture(v), session.truth(v, **ABOUT), near=near, what=f"{reconstruction} {integral}")
        text = str(session.mapper_of(d))
        assert f"Integral: {integral}" in text and f"Reconstruction: {reconstruction}" in text
        done(v)


def test_widgets_and_a_second_array():
    """A widget without end along the second variable is a function of one; a narrow one sees that array."""
    g = image()
    add(g, np.array([g.GetPoint(i)[0] for i in range(125)]), "x")
    v, d, _ = drawn(g, unit=0.25)
    widget = '{"type": "gaussian", "center": [0.5, %s], "sigma": [0.15, %s], "color": [1, 0.5, 0.2], "opacity": 0.9}'
    d.HaliteOpacityConvention = "Extinction"
    d.HaliteTransfer2DYAxisArray = "x"
    s = np.linspace(0, 1, 4001)
    bell = lambda at, middle, wide: np.exp(-((at - middle) / wide) ** 2 / 2)
    for middle, wide, factor in ((0, 1e6, lambda p: 1), (0.7, 0.2, lambda p: bell(p[..., 0], 0.7, 0.2))):
        d.HaliteWidgets = [widget % (middle, wide)]
        expected = session.truth(v, opacity=list(zip(s, 0.9 * bell(s, 0.5, 0.15))), color=[(0, 1, 0.5, 0.2)], unit=0.25,
                                 factor=factor, steps=1000)
        check(session.picture(v), expected, near=2, what=f"around {middle}")
    done(v)


def test_time_changes_only_values():
    """Points and cells of each step are read anew, and are equal: the mesh is handed to the core once."""
    for make, writer, reader in ((image, vtkIOXML.vtkXMLImageDataWriter, "vti"),
                                 (rectilinear, vtkIOXML.vtkXMLRectilinearGridWriter, "vtr")):
        with tempfile.TemporaryDirectory() as folder:
            series = session.series(folder, writer, reader, [make(lambda p, k=k: p[:, 2] * (1 - 0.2 * k)) for k in range(3)])
            v = session.view()
            d = session.show(series, v, color=COLOR, opacity=OPACITY)
            for k in range(3):
                v.ViewTime = k
                check(session.picture(v), session.truth(v, field=lambda q: q[..., 2] * (1 - 0.2 * k), **ABOUT), what=f"step {k}")
            counted = [session.count(d, what) for what in ("MeshUploads", "FieldUploads", "FunctionUploads")]
            assert counted == [1, 3, 1], counted
            done(v)


if __name__ == "__main__":
    session.load()
    main(dict(globals()))
