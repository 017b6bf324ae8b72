# SPDX-License-Identifier: MIT OR Apache-2.0
"""Settings of pre-integrated tables: that each acts, that a bad one is said, and that none hands over the mesh again."""
import numpy as np
from scene import *  # noqa: F403
from test_pictures import RAMP, SLANT, WAVES
UNIT = 0.15
M = vtkHaliteMapper


def table(**settings):
    """One brick, so that segments are long; its window and renderer."""
    v = volume(lattice(1, field=SLANT), WAVES, RAMP, UNIT, **settings)
    return v, *scene(v)


def apart(w, expected):
    """How far a picture is from another, root mean square, in units of 1/255."""
    return np.sqrt(np.mean((pixels(w) - expected) ** 2))


def errors_of(form, name, values, **settings):
    """How far pictures with each of these values are from the truth; none may be another's, and none may take the mesh."""
    v, w, r = table(Integral=form, **settings)
    m = v.GetMapper()
    expected = truth(r, (64, 64), field=SLANT, opacity=WAVES, color=RAMP, unit=UNIT)
    seen, errors = [], []
    for value in values:
        getattr(m, "Set" + name)(*value if isinstance(value, tuple) else (value,))
        errors.append(apart(w, expected))
        assert all(np.abs(pixels(w) - other).max() > 0 for other in seen), (name, value)
        seen.append(pixels(w))
    assert m.GetNumberOfMeshUploads() == 1 and m.GetNumberOfFunctionUploads() == 1
    print(f"        {name} {dict(zip(values, np.round(errors, 3)))}")
    return errors


def test_higher_degrees_are_nearer_to_the_integral():
    first, second, fourth = errors_of(M.POLYNOMIAL, "PolynomialDegree", (1, 2, 4))
    assert fourth < second < first and fourth < first / 2


def test_more_texels_are_nearer_to_the_integral():
    few, more = errors_of(M.VOLUME, "TableSize", ((12, 12, 4), (256, 256, 32)))
    assert more < few / 2
    few, more = errors_of(M.POLYNOMIAL, "TableSize", ((12, 12, 0), (256, 256, 0)), PolynomialDegree=8)
    assert more < few / 2
    few, more = errors_of(M.CYLINDRICAL, "TableSize", ((16, 16, 16), (128, 128, 128)))
    assert more < few / 2


def test_finer_texels_are_nearer_to_the_integral():
    eight, full = errors_of(M.VOLUME, "TableTexels", (M.UNORM8, M.FLOAT32), TableSize=(256, 256, 64))
    assert full < eight


def test_bad_settings_are_one_error_and_can_be_mended():
    v, w, r = table()
    m = v.GetMapper()
    expected = truth(r, (64, 64), field=SLANT, opacity=WAVES, color=RAMP, unit=UNIT)
    said = messages(m)
    # What is said names what there is.
    cases = [
        (dict(Integral=M.POLYNOMIAL, PolynomialDegree=9), "from 1 to 8, and not 9"),
        (dict(Integral=M.AUTO_INTEGRAL, PolynomialDegree=-3), "from 1 to 8, and not -3"),
        (dict(Integral=M.POLYNOMIAL, TableSize=(8, -8, 8)), "8 x -8 x 8"),
        (dict(Integral=M.VOLUME, TableSize=(1, 8, 8)), "at least 2, 2 and 3"),
        (dict(Integral=M.CYLINDRICAL, TableSize=(8, 8, 6)), "multiple of 4"),
    ]
    for settings, word in cases:
        good = {name: getattr(m, "Get" + name)() for name in settings}
        for name, value in settings.items():
            getattr(m, "Set" + name)(value)
        assert pixels(w).max() == 0 and pixels(w).max() == 0, settings
        assert len(said) == 1 and word in said[0], (settings, said)
        said.clear()
        for name, value in good.items():
            getattr(m, "Set" + name)(value)
        check(pixels(w), expected, what=str(settings))


def test_pairs_are_read_from_weights_of_their_colours():
    v, w, r = table(Integral=M.POLYNOMIAL, PolynomialDegree=4)
    m = v.GetMapper()
    expected = truth(r, (64, 64), field=SLANT, opacity=WAVES, color=RAMP, unit=UNIT)
    said = messages(m)
    # Both components are the field.
    m.SetInputData(lattice(1, field=lambda p: np.stack([SLANT(p), SLANT(p)], -1)))
    v.GetProperty().IndependentComponentsOff()
    for form in (M.POLYNOMIAL, M.VOLUME):
        m.SetIntegral(form)
        off = apart(w, expected)
        print(f"        {form}: {off:.3f}")
        assert off < 1.5 and not said, (form, off, said)


def test_setters_tell_changes_only():
    m = vtkHaliteMapper()
    # Those by default, in the end.
    cases = dict(Integral=(M.AUTO_INTEGRAL, M.EXACT), TableSize=((8, 8, 8), (0, 0, 0)), TableTexels=(M.UNORM8, M.FLOAT32),
                 PolynomialDegree=(4, 2), Engine=(M.PROJECT, M.AUTO_ENGINE), Reconstruction=(M.PARABOLAS, M.TRILINEAR))
    for name, values in cases.items():
        ask, tell = getattr(m, "Get" + name), getattr(m, "Set" + name)
        assert ask() == values[-1], name
        for value in values:
            before = m.GetMTime()
            tell(value)
            changed = m.GetMTime()
            tell(value)
            assert changed > before and m.GetMTime() == changed and ask() == value, (name, value)
            as_string = getattr(m, f"Get{name}AsString", lambda: " ".join(map(str, value if isinstance(value, tuple) else (value,))))
            shown = as_string()
            assert f"{name}: {shown}\n" in str(m), name


def test_enumerations_have_setters_and_the_names_of_scene_files():
    names = dict(Engine=["auto", "traverse", "project"],
                 Integral=["exact", "auto", "volume", "polynomial", "cylindrical", "second-order", "second-order-polynomial"],
                 TableTexels=["float", "unorm16", "unorm8"], OpacityConvention=["Extinction", "Opacity", "ByInput"],
                 Reconstruction=["exact", "2", "1", "0", "0-left", "0-right"])
    m = M()
    for name, strings in names.items():
        ask, tell = getattr(m, f"Get{name}AsString"), getattr(m, "Set" + name)
        for value, string in enumerate(strings):
            tell(value)
            assert ask() == string and f"{name}: {string}\n" in str(m), (name, value, ask())
        # What is beyond is the nearest.
        for value, string in ((-1, strings[0]), (len(strings), strings[-1])):
            tell(value)
            assert ask() == string, (name, value)
        setters = {s for s in dir(m) if s.startswith(f"Set{name}To")}
        assert len(setters) == len(strings), setters
        said = set()
        for setter in setters:
            getattr(m, setter)()
            said.add(ask())
        assert said == set(strings), (name, said)


if __name__ == "__main__":
    main(globals())
