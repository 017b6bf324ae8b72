# SPDX-License-Identifier: MIT OR Apache-2.0
"""Light, gradient opacity, functions of two variables and silhouettes: pictures against the truth about a linear field, whose
gradient is the same everywhere."""
import numpy as np
from vtkmodules import vtkCommonDataModel, vtkRenderingCore
from vtkmodules.util import numpy_support

from scene import add, check, lattice, main, messages, opacities, pixels, rays, scene, transform, truth, volume

SIZE = (40, 40)
SLOPE = np.array([0.5, 0.2, 0.3])
FIELD = lambda p: p @ SLOPE
RAMP = [(0, 0.1, 0.3, 1), (0.5, 0.9, 0.9, 0.2), (1, 1, 0.2, 0.1)]
LOW = [(0, 0.0), (0.3, 0.8), (0.6, 0.2), (1, 1.2)]
LOOK = {"field": FIELD, "opacity": LOW, "color": RAMP, "unit": 0.5}
NORMAL = SLOPE / np.linalg.norm(SLOPE)


def box(**settings):
    v = volume(lattice(2, cells="mixed", field=FIELD), LOW, RAMP, 0.5, **settings)
    p = v.GetProperty()
    p.SetAmbient(0.2)
    p.SetDiffuse(0.6)
    p.SetSpecular(0.7)
    p.SetSpecularPower(6)
    return v


def phong(lights, normal=NORMAL, two_sided=True, ambient=0.2, diffuse=0.6, specular=0.7, power=6):
    """What is lit by lights that are functions of places and directions of rays: strength in colour, and the way to the light."""
    def lit(rgb, world, along):
        scattered, shining = 0, 0
        for light in lights:
            strength, to = light(world, along)
            cosine = (to * normal).sum(-1, keepdims=True)
            falls = np.abs(cosine) if two_sided else cosine.clip(0)
            reflected = 2 * cosine * normal - to
            scattered = scattered + strength * falls
            shining = shining + strength * (falls > 0) * (reflected * -along).sum(-1, keepdims=True).clip(0) ** power
        return rgb * (ambient + diffuse * scattered) + specular * shining

    return lit


def headlight(world, along):
    return 1, -along


def unit(v):
    v = np.asarray(v, float)
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def expect(v, what, lights=(), near=1.5, **more):
    w, r = scene(v, size=SIZE)
    for light in lights:
        r.AddLight(light)
    said = messages(v.GetMapper()) + messages(v.GetMapper(), "WarningEvent")
    picture = pixels(w)
    assert not said, said
    check(picture, truth(r, SIZE, **{**LOOK, **more}).clip(0, 255), near=near, what=what)
    return w, r


def light(**settings):
    made = vtkRenderingCore.vtkLight()
    for name, value in settings.items():
        getattr(made, "Set" + name)(*value) if isinstance(value, tuple) else getattr(made, "Set" + name)(value)
    return made


def test_headlight():
    v = box()
    v.GetProperty().ShadeOn()
    w, r = expect(v, "headlight", lit=phong([headlight]))
    # One side only, and that is turned away from the eye.
    r.TwoSidedLightingOff()
    check(pixels(w), truth(r, SIZE, **LOOK, lit=phong([headlight], two_sided=False)).clip(0, 255), what="one side")
    v.GetProperty().ShadeOff()
    check(pixels(w), truth(r, SIZE, **LOOK), what="no light")


def test_lights_of_the_scene():
    v = box()
    v.GetProperty().ShadeOn()
    far = light(Position=(3, 1, 2), FocalPoint=(0, 0, 0), Color=(1, 0.5, 0.2), Intensity=0.8)
    off = light(Position=(1, 1, 1), Switch=0)
    to = unit([3, 1, 2])
    direction = lambda world, along: (0.8 * np.array([1, 0.5, 0.2]), np.broadcast_to(to, world.shape))
    w, r = expect(v, "a direction", [far, off], lit=phong([direction]))
    # A light that moves with the camera.
    r.RemoveAllLights()
    follows = light(Position=(1, 0.5, 1), FocalPoint=(0, 0, 0))
    follows.SetLightTypeToCameraLight()
    r.AddLight(follows)
    for _ in range(2):
        r.GetActiveCamera().Azimuth(25)
        picture = pixels(w)
        moved = unit(np.subtract(follows.GetTransformedPosition(), follows.GetTransformedFocalPoint()))
        direction = lambda world, along: (1, np.broadcast_to(moved, world.shape))
        check(picture, truth(r, SIZE, **LOOK, lit=phong([direction])).clip(0, 255), what="a camera's light")


def test_a_spot():
    v = box()
    v.GetProperty().ShadeOn()
    place, aim = np.array([0.8, -0.6, 1.4]), np.array([0.5, 0.5, 0.5])
    spot = light(Position=tuple(place), FocalPoint=tuple(aim), Positional=1, ConeAngle=32, Exponent=2, AttenuationValues=(0.5, 0, 0.4))

    def shines(world, along):
        way = world - place
        distance = np.linalg.norm(way, axis=-1, keepdims=True)
        cosine = (way / distance) @ unit(aim - place)[:, None]
        inside = cosine >= np.cos(np.radians(32))
        return inside * cosine ** 2 / (0.5 + 0.4 * distance ** 2), -way / distance

    expect(v, "a spot", [spot], lit=phong([shines]), steps=2500)


def test_placement_turns_normals():
    m = np.array([[0.8, -0.5, 0, 0.3], [0.5, 0.8, 0.1, -0.2], [0, 0.2, 1.1, 0], [0, 0, 0, 1]])
    v = box()
    v.GetProperty().ShadeOn()
    v.SetUserMatrix(transform(m))
    normal = unit(np.linalg.inv(m[:3, :3]).T @ SLOPE)
    expect(v, "placed", lit=phong([headlight], normal), matrix=m)


def test_gradient_opacity():
    v = box()
    steep = [(0, 0.0), (1, 1.0)]
    v.GetProperty().SetGradientOpacity(opacities(steep))
    share = float(np.linalg.norm(SLOPE))
    w, r = expect(v, "gradient opacity", factor=lambda p: share)
    v.GetProperty().DisableGradientOpacityOn()
    check(pixels(w), truth(r, SIZE, **LOOK), what="disabled")


def test_functions_of_two_variables():
    table = np.random.default_rng(3).uniform(0.2, 1, (5, 6, 4))
    image = vtkCommonDataModel.vtkImageData()
    image.SetDimensions(6, 5, 1)
    # Centres of texels.
    image.SetOrigin(0.0, -0.1, 0)
    image.SetSpacing(0.2, 0.3, 1)
    image.GetPointData().SetScalars(numpy_support.numpy_to_vtk(table.reshape(-1, 4).astype(np.float32), deep=1))
    v = box()
    v.GetProperty().SetTransferFunction2D(image)
    v.GetProperty().SetTransferFunctionMode(v.GetProperty().TF_2D)
    other = lambda p: p[..., 1] - 0.3 * p[..., 0]
    g = v.GetMapper().GetInputDataObject(0, 0)
    points = numpy_support.vtk_to_numpy(g.GetPoints().GetData())

    def at(s, g):
        x, y = (s / 0.2).clip(0, 5), ((g + 0.1) / 0.3).clip(0, 4)
        i, j = np.minimum(x.astype(int), 4), np.minimum(y.astype(int), 3)
        u, w = (x - i)[..., None], (y - j)[..., None]
        low = table[j, i] * (1 - u) + table[j, i + 1] * u
        return low * (1 - w) + (table[j + 1, i] * (1 - u) + table[j + 1, i + 1] * u) * w

    one = {"opacity": ((0, 1),), "color": ((0, 1, 1, 1),), "steps": 900}
    steepness = float(np.linalg.norm(SLOPE))
    texel = lambda p: at(FIELD(p), np.full(p.shape[:-1], steepness))
    expect(v, "by the gradient", **one, factor=lambda p: texel(p)[..., 3], lit=lambda rgb, p, along: texel(p)[..., :3])
    add(g, other(points), "other")
    v.GetMapper().SetTransfer2DYAxisArray("other")
    texel = lambda p: at(FIELD(p), other(p))
    expect(v, "by another array", **one, factor=lambda p: texel(p)[..., 3], lit=lambda rgb, p, along: texel(p)[..., :3])
    v.GetMapper().SetTransfer2DYAxisArray("nothing")
    said = messages(v.GetMapper())
    w, r = scene(v, size=SIZE)
    pixels(w)
    assert len(said) == 1 and "nothing" in said[0], said
    # What is not in use refuses nothing.
    v.GetProperty().SetTransferFunctionMode(v.GetProperty().TF_1D)
    check(pixels(w), truth(r, SIZE, **LOOK), what="one variable")
    assert len(said) == 1, said


def test_silhouettes_and_widgets():
    v = box()
    v.GetMapper().SetSilhouettePower(2)
    w, r = scene(v, size=SIZE)
    picture = pixels(w)
    start, end = rays(r, SIZE)
    turned = (1 - np.abs(unit(end - start) @ NORMAL)) ** 2
    check(picture, truth(r, SIZE, **LOOK, factor=lambda p: turned[..., None]), what="silhouettes")
    v.GetMapper().SetSilhouettePower(-1)
    v.GetMapper().AddWidget('{"type": "uniform", "color": [1, 0.5, 0], "opacity": 0.4, "s": [0.3, 0.6]}')
    knots = [(0.3 - 1e-9, 0), (0.3, 0.4), (0.6, 0.4), (0.6 + 1e-9, 0)]
    check(pixels(w), truth(r, SIZE, field=FIELD, unit=0.5, opacity=knots, color=[(0, 1, 0.5, 0)]), what="a widget")
    v.GetMapper().RemoveAllWidgets()
    check(pixels(w), truth(r, SIZE, **LOOK), what="none")
    errors = messages(v.GetMapper())
    v.GetMapper().AddWidget('{"type": "round"}')
    pixels(w)
    assert len(errors) == 1 and "widgets[0]" in errors[0], errors


if __name__ == "__main__":
    main(globals())
