# SPDX-License-Identifier: MIT OR Apache-2.0
"""Surfaces and legends beside volumes, in views as ParaView makes them."""
import session

from paraview import simple

from boxes import check, lattice
from runner import main

COLOR = [(0, 0.1, 0.4, 0.9), (0.5, 0.9, 0.9, 0.2), (1, 1, 0.2, 0.1)]
OPACITY = [(0, 0.5), (0.3, 2), (0.5, 0), (1, 3)]
ABOUT = {"color": COLOR, "opacity": OPACITY}


def with_plane(opacity, tilt=0.0):
    """The box and a black plane through it, whose height is 0.5 in the middle, seen from above."""
    v = session.view()
    session.show(session.source(lattice(3, cells="mixed")), v, color=COLOR, opacity=OPACITY)
    low, high = 0.5 - 5.5 * tilt, 0.5 + 4.5 * tilt
    plane = simple.Plane(Origin=[-5, -5, low], Point1=[5, -5, high], Point2=[-5, 5, low])
    d = simple.Show(plane, v)
    simple.ColorBy(d, None) if d.ColorArrayName[1] else None
    d.AmbientColor = d.DiffuseColor = [0, 0, 0]
    d.Specular = 0
    d.Opacity = opacity
    return v


def test_an_opaque_plane_ends_rays_inside_cells():
    for tilt in (0, 0.3):
        v = with_plane(1, tilt)
        above = session.truth(v, keep=lambda p: p[..., 2] - 0.5 > tilt * (p[..., 0] - 0.5), steps=1000, **ABOUT)
        check(session.picture(v), above, near=2, what=f"tilt {tilt}")
        simple.Delete(v)


def test_a_translucent_plane_lets_half_through():
    v = with_plane(0.5)
    above = session.truth(v, keep=lambda p: p[..., 2] > 0.5, steps=1000, **ABOUT)
    check(session.picture(v), (above + session.truth(v, **ABOUT)) / 2, near=2)
    simple.Delete(v)


def test_a_legend():
    v = session.view(size=(300, 200))
    d = session.show(session.source(lattice(3)), v, color=COLOR, opacity=OPACITY)
    without = session.picture(v)
    check(without, session.truth(v, size=(300, 200), **ABOUT))
    bar = simple.GetScalarBar(d.LookupTable, v)
    bar.WindowLocation = "Lower Right Corner"
    d.SetScalarBarVisibility(v, True)
    with_bar = session.picture(v)
    changed = abs(with_bar - without).max(-1) > 1
    assert changed.sum() > 200, "there is no legend"
    assert not changed[:, :180].any(), "the legend changes the volume"
    simple.Delete(v)


def test_selection_passes_to_what_lies_behind():
    v = session.view()
    d = session.show(session.source(lattice(3, cells="mixed")), v, color=COLOR, opacity=OPACITY)
    plane = simple.Plane(Origin=[-5, -5, -0.5], Point1=[5, -5, -0.5], Point2=[-5, 5, -0.5])
    plane.XResolution = plane.YResolution = 4
    simple.Show(plane, v)
    shown = session.picture(v)
    w, h = v.ViewSize
    simple.SelectSurfaceCells(Rectangle=[w // 2 - 2, h // 2 - 2, w // 2 + 2, h // 2 + 2], View=v)
    simple.SetActiveSource(plane)
    picked = simple.ExtractSelection(Input=plane)
    picked.UpdatePipeline()
    assert 1 <= picked.GetDataInformation().GetNumberOfCells() <= 4
    simple.ClearSelection(plane)
    assert session.apart(session.picture(v), shown) == 0
    simple.Delete(picked)
    simple.Delete(v)


def test_fewer_pixels_while_the_camera_is_dragged():
    v = session.view(size=(192, 160))
    v.LODThreshold = 0
    d = session.show(session.source(lattice(3, cells="mixed")), v, color=COLOR, opacity=OPACITY)
    still = session.picture(v)
    frames = session.count(d, "Frames")
    v.SMProxy.InteractiveRender()
    dragged = session.window(v)
    assert "Interacting: On" in str(session.mapper_of(d)) and session.count(d, "Frames") == frames + 1
    # A sixteenth of the pixels, enlarged: the volume, whose edges are blurred.
    assert 10 < session.apart(dragged, still) and abs(dragged - still).mean() < 3
    d.HaliteInteractiveImageSampleDistance = 1
    v.SMProxy.InteractiveRender()
    assert session.apart(session.window(v), still) == 0
    # ParaView's surface, which is of one opacity.
    d.HaliteInteractiveImageSampleDistance = 0
    frames = session.count(d, "Frames")
    v.SMProxy.InteractiveRender()
    assert session.apart(session.window(v), still) > 30 and session.count(d, "Frames") == frames
    d.HaliteInteractiveImageSampleDistance = 4
    assert session.apart(session.picture(v), still) == 0
    simple.Delete(v)


if __name__ == "__main__":
    session.load()
    main(dict(globals()))
