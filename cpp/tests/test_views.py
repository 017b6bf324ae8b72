# SPDX-License-Identifier: MIT OR Apache-2.0
"""Cameras, viewports and windows of every kind."""
import numpy as np
from scene import *  # noqa: F403
from test_pictures import RAMP, SLANT, WAVES

BOX = dict(field=SLANT, opacity=WAVES, color=RAMP)


def box(**settings):
    return volume(lattice(2, field=SLANT), WAVES, RAMP, **settings)


def test_window_centre_and_shear():
    w, r = scene(box())
    c = r.GetActiveCamera()
    c.SetWindowCenter(0.3, -0.2)
    check(pixels(w), truth(r, (64, 64), **BOX), what="window centre")
    c.SetWindowCenter(0, 0)
    c.SetViewShear(0.15, 0.1, 1.0)
    check(pixels(w), truth(r, (64, 64), **BOX), what="shear")
    c.ParallelProjectionOn()
    c.SetParallelScale(1)
    check(pixels(w), truth(r, (64, 64), **BOX), what="parallel and sheared")


def test_off_axis():
    w, r = scene(box(), position=(0.5, 0.5, 4), up=(0, 1, 0), clip=(1, 8))
    c = r.GetActiveCamera()
    c.UseOffAxisProjectionOn()
    c.SetScreenBottomLeft(-0.5, -0.3, 1.5)
    c.SetScreenBottomRight(1.6, -0.3, 1.3)
    c.SetScreenTopRight(1.6, 1.4, 1.3)
    c.SetEyeSeparation(0.4)
    check(pixels(w), truth(r, (64, 64), **BOX))


def test_explicit_projection():
    w, r = scene(box(), clip=(1, 8))
    m = np.array([[2.5, 0, 0.2, 0], [0, 3, -0.1, 0], [0, 0, -9 / 7, -16 / 7], [0, 0, -1, 0]])
    c = r.GetActiveCamera()
    c.SetExplicitProjectionTransformMatrix(transform(m))
    c.UseExplicitProjectionTransformMatrixOn()
    check(pixels(w), truth(r, (64, 64), **BOX))


def test_model_transform_of_the_camera():
    w, r = scene(box(), clip=(0.5, 12))
    m = np.diag([1.3, 0.8, 1, 1])
    m[0, 3] = 0.2
    r.GetActiveCamera().SetModelTransformMatrix(transform(m))
    # It moves the world before the eye sees it: lengths are those of the world as it was.
    check(pixels(w), truth(r, (64, 64), **BOX))


def eyes(w, r):
    """Truth for the left and the right eye, of a window that draws for two."""
    w.Render()
    pictures = []
    for left in (1, 0):
        r.GetActiveCamera().SetLeftEye(left)
        pictures.append(truth(r, (64, 64), **BOX))
    return pictures


def test_stereo():
    w = window()
    w.StereoCapableWindowOn()
    r = renderer(w, box())
    c = look(r)
    w.StereoRenderOn()
    w.SetStereoTypeToLeft()
    left, right = eyes(w, r)
    assert np.abs(left - right).max() > 20, "the eyes see the same"
    check(pixels(w), left, what="left")
    w.SetStereoTypeToRight()
    check(pixels(w), right, what="right")
    c.SetEyeAngle(0)
    both = pixels(w)
    w.StereoRenderOff()
    check(both, pixels(w), near=0)


def test_two_eyes_in_one_picture():
    w, r = scene(box())
    w.StereoRenderOn()
    left, right = eyes(w, r)
    # Red for one eye, green and blue for the other. (With less saturation VTK rounds three products down.)
    w.SetStereoTypeToAnaglyph()
    w.SetAnaglyphColorSaturation(1)
    w.SetAnaglyphColorMask(4, 3)
    mixed = pixels(w)
    check(mixed[..., 0], left[..., 0], what="red")
    check(mixed[..., 1:3], right[..., 1:3], what="green and blue")
    w.SetStereoTypeToInterlaced()
    lines = pixels(w)[..., :3]
    for k in range(2):
        check(lines[k::2], (left, right)[k][k::2, :, :3], what=f"every other row from {k}")


def test_tiles():
    # A picture of two by two tiles is that of one large window.
    from vtkmodules.vtkRenderingCore import vtkWindowToImageFilter
    w, r = scene(box())
    grab = vtkWindowToImageFilter()
    grab.SetInput(w)
    grab.SetScale(2)
    grab.SetInputBufferTypeToRGB()
    grab.ReadFrontBufferOff()
    grab.Update()
    got = numpy_support.vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars()).reshape(128, 128, 3).astype(int)
    check(got, truth(r, (128, 128), **BOX)[..., :3])


def test_sizes():
    w, r = scene(box(), size=(90, 40))
    for size in ((90, 40), (33, 70), (1, 1), (64, 64)):
        w.SetSize(*size)
        picture = pixels(w)
        if size != (1, 1):
            check(picture, truth(r, size, **BOX), what=str(size))


def test_several_windows_on_one_mapper():
    v = box()
    made = [scene(v, position=p) for p in ((2.1, -1.7, 2.9), (-2, -3, 1), (0.5, 4, 0.2))]
    for _ in range(2):
        for i, (w, r) in enumerate(made):
            check(pixels(w), truth(r, (64, 64), **BOX), what=f"window {i}")
    m = v.GetMapper()
    assert m.GetNumberOfFrames() == 3 and m.GetNumberOfMeshUploads() == 1, "still windows are drawn once"
    # A window may go while the others stay.
    made.pop(0)[0].Finalize()
    for w, r in made:
        check(pixels(w), truth(r, (64, 64), **BOX))


def test_several_volumes_on_one_mapper():
    a, b = box(), volume(lattice(2, field=SLANT), [(0, 0.4)])
    b.SetMapper(a.GetMapper())
    b.SetPosition(0, 0, 2)
    w, r = scene(a, b, position=(4, -5, 6), clip=(1, 20))
    first = pixels(w)
    frames = a.GetMapper().GetNumberOfFrames()
    check(pixels(w), first, near=0)
    assert a.GetMapper().GetNumberOfFrames() == frames == 2


def test_viewports_side_by_side_and_on_top():
    v = box()
    w = window((120, 60))
    rs = [renderer(w, v, viewport=(k / 2, 0, (k + 1) / 2, 1)) for k in range(2)]
    look(rs[0])
    look(rs[1], position=(-2, 3, 1))
    w.SetNumberOfLayers(2)
    top = renderer(w, plane(0.5, (1, 0, 0)), viewport=(0, 0, 0.1, 0.1))
    top.SetLayer(1)
    look(top, position=(0, 0, 5), up=(0, 1, 0))
    picture = pixels(w)
    check(picture[8:, :60], truth(rs[0], (60, 60), **BOX)[8:], what="left")
    check(picture[:, 60:], truth(rs[1], (60, 60), **BOX), what="right")
    assert list(picture[2, 4, :3]) == [255, 0, 0]


def test_multisampled_windows():
    for samples in (0, 4, 8):
        w, r = scene(box(), plane(-0.3, (0.2, 0.4, 0.6)), samples=samples, position=(0.5, 0.5, 5), up=(0, 1, 0))
        over = truth(r, (64, 64), **BOX)
        check(pixels(w), over + (1 - over[..., 3:] / 255) * np.array([51, 102, 153, 255]), what=f"{samples} samples")


def test_off_screen_and_back():
    w, r = scene(box())
    for off in (1, 0, 1):
        w.SetOffScreenRendering(off)
        check(pixels(w), truth(r, (64, 64), **BOX))


def test_picking_draws_nothing():
    from vtkmodules.vtkRenderingCore import vtkHardwareSelector
    w, r = scene(box())
    before = pixels(w)
    s = vtkHardwareSelector()
    s.SetRenderer(r)
    s.SetArea(0, 0, 63, 63)
    assert s.Select().GetNumberOfNodes() == 0
    check(pixels(w), before, near=0)


GLASS = (0.2, 0.8, 0.4), (0.9, 0.3, 0.1), (0.1, 0.4, 0.9), (0.8, 0.8, 0.2)


def glass(z, k=0, opacity=0.5):
    p = plane(z, GLASS[k % 4])
    p.GetProperty().SetOpacity(opacity)
    return p


def layered(r, heights, opacity=0.5, floor=None, size=(64, 64), boxes=((0, 1),)):
    """The truth, seen from above, of boxes from one height to another with sheets of glass and an opaque floor."""
    ends = sorted([1e3, *heights, -1e3 if floor is None else floor], reverse=True)
    seen = np.zeros((*size[::-1], 4))
    under = lambda picture: seen + (1 - seen[..., 3:] / 255) * picture
    for above, below in zip(ends, ends[1:]):
        for bottom, top in sorted(boxes, reverse=True):
            low, high = max(bottom, below), min(top, above)
            if low < high:
                seen = under(truth(r, size, low=(0, 0, low), high=(1, 1, high), **{**BOX, "field": lambda p: SLANT(p - [0, 0, bottom])}))
        if below in heights:
            seen = under(255 * opacity * np.array([*GLASS[heights.index(below) % 4], 1]))
    return seen if floor is None else under(np.array([51, 153, 102, 255]))


def peeled(*props, **camera):
    w, r = scene(*props, **{**dict(position=(0.7, 0.1, 5), up=(0, 1, 0), clip=(1, 12)), **camera})
    peel(r)
    return w, r


def peel(r):
    r.UseDepthPeelingOn()
    r.UseDepthPeelingForVolumesOn()
    r.SetMaximumNumberOfPeels(20)
    r.SetOcclusionRatio(0)


def test_glass_in_front_behind_and_inside():
    # Projected tetrahedra make the window black.
    for heights in ([1.5], [-0.3], [0.47], [1.2, 0.47], [0.8, 0.3], [1.3, 0.6, -0.2]):
        v = box()
        w, r = peeled(v, *(glass(z, k) for k, z in enumerate(heights)))
        # VTK's layers have 8 bits, so each rounds once more.
        expected, near = layered(r, heights), max(NEAR, 0.6 * len(heights))
        check(pixels(w), expected, near, what=f"glass at {heights}")
        frames = v.GetMapper().GetNumberOfFrames()
        check(pixels(w), expected, near, what="again")
        assert v.GetMapper().GetNumberOfFrames() == frames, "a still scene is drawn once"


def test_glass_and_opaque_geometry():
    for height, floor in ((1.4, 0.3), (0.6, 0.2), (0.6, -0.5), (-0.2, 0.5)):
        w, r = peeled(box(), glass(height), plane(floor, (0.2, 0.6, 0.4)))
        check(pixels(w), layered(r, [height] if height > floor else [], floor=floor), what=f"glass at {height}, floor at {floor}")


def test_glass_that_moves():
    v, sheet = box(), glass(0)
    w, r = peeled(v, sheet)
    for height in (1.5, 0.6, 0.2, -0.4):
        sheet.SetPosition(0, 0, height)
        check(pixels(w), layered(r, [height]), what=f"glass at {height}")
    assert v.GetMapper().GetNumberOfMeshUploads() == 1
    r.RemoveViewProp(sheet)
    check(pixels(w), layered(r, []), what="no glass")


def test_glass_among_two_volumes():
    high = box()
    high.SetPosition(0, 0, 2)
    for heights in ([1.5], [2.5], [0.5]):
        w, r = peeled(box(), high, *(glass(z, k) for k, z in enumerate(heights)), position=(0.7, 0.1, 8), clip=(3, 12))
        # Both are rounded.
        check(pixels(w), layered(r, heights, boxes=((0, 1), (2, 3))), near=2, what=f"glass at {heights}")


def test_glass_in_the_right_half_of_a_window():
    w = window((128, 64))
    left = renderer(w, box(), glass(0.4), viewport=(0, 0, 0.5, 1))
    right = renderer(w, box(), glass(0.4), viewport=(0.5, 0, 1, 1))
    for r in (left, right):
        look(r, position=(0.7, 0.1, 5), up=(0, 1, 0), clip=(1, 12))
        peel(r)
    picture = pixels(w)
    check(picture[:, :64], layered(left, [0.4]), what="left")
    check(picture[:, 64:], layered(right, [0.4]), what="right")


def test_a_maximum_goes_over_glass():
    v = box()
    v.GetMapper().SetBlendModeToMaximumIntensity()
    said = Errors(v.GetMapper())
    w, r = peeled(v, glass(0.4))
    over = truth(r, (64, 64), maximum=True, steps=1000, **BOX)
    for _ in range(2):
        check(pixels(w), over + (1 - over[..., 3:] / 255) * 127.5 * np.array([*GLASS[0], 1]))
    assert len(said) == 1, "that is said once"


def enlarged(picture):
    """Twice as large, linear between the middles of pixels."""
    for axis in (0, 1):
        p = np.moveaxis(picture, axis, 0)
        p = np.concatenate([p[:1], p, p[-1:]])
        p = np.stack([0.25 * p[:-2] + 0.75 * p[1:-1], 0.75 * p[1:-1] + 0.25 * p[2:]], 1)
        picture = np.moveaxis(p.reshape(-1, *p.shape[2:]), 0, axis)
    return picture


def test_image_sample_distance():
    v = box(ImageSampleDistance=2.0)
    w, r = scene(v, size=(96, 96))
    check(pixels(w), enlarged(truth(r, (48, 48), **BOX)), what="every other pixel")
    v.GetMapper().SetImageSampleDistance(1)
    check(pixels(w), truth(r, (96, 96), **BOX), what="every pixel")


if __name__ == "__main__":
    main(globals())
