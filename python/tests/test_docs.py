# SPDX-License-Identifier: MIT OR Apache-2.0
"""Documentation of what is public, its examples, and its types."""
import doctest
import importlib
import inspect
import os
import re
import subprocess
import sys

import numpy as np
import pytest

import halite
from conftest import tetrahedron

SECTIONS = ["Parameters", "Returns", "Raises", "Warns", "Attributes", "See Also", "Notes", "Examples"]


def modules():
    yield halite
    for name, needs in (("halite.vtk", "vtkmodules"), ("halite.pyvista", "pyvista")):
        if importlib.util.find_spec(needs):
            yield importlib.import_module(name)


def public(*of):
    """Name and object of each public function, class and method of all or some modules; properties apart."""
    for module in of or modules():
        for name in module.__all__:
            thing = getattr(module, name)
            if not callable(thing) or thing is halite.Error:
                continue
            yield f"{module.__name__}.{name}", thing
            if inspect.isclass(thing):
                for own, member in vars(thing).items():
                    if not own.startswith("_") and not isinstance(member, property) and callable(getattr(thing, own)):
                        yield f"{module.__name__}.{name}.{own}", getattr(thing, own)


def properties():
    for name, thing in public():
        if inspect.isclass(thing):
            yield from ((f"{name}.{k}", v) for k, v in vars(thing).items() if isinstance(v, property))


def sections(text):
    """The lines of each section of a docstring in numpydoc, by name."""
    lines, found, name = inspect.cleandoc(text).splitlines(), {"": []}, ""
    for i, line in enumerate(lines):
        if i + 1 < len(lines) and re.fullmatch("-{3,}", lines[i + 1]):
            name = line
            assert len(line) == len(lines[i + 1]), f"{line}: the line under it has another length"
            found[name] = []
        elif not re.fullmatch("-{3,}", line):
            found[name].append(line)
    return found


def entries(lines):
    """Name and type of the entries of a section, and the text of each."""
    found = []
    for line in lines:
        if line and not line.startswith(" "):
            name, _, kind = line.partition(" : ")
            found.append((name, kind, []))
        elif line:
            found[-1][2].append(line)
    return found


@pytest.mark.parametrize("name, thing", list(public()), ids=lambda x: x if isinstance(x, str) else "")
def test_docstrings_are_numpydoc(name, thing):
    assert thing.__doc__, "there is none"
    parts = sections(thing.__doc__)
    summary = parts[""][0]
    assert summary.endswith(".") and len(parts[""]) == 1 or not parts[""][1], "the first line is a summary"
    known = [s for s in SECTIONS if s in parts]
    assert list(parts)[1:] == known, f"sections are {SECTIONS}, in this order"
    signature = inspect.signature(thing)
    marks = {inspect.Parameter.VAR_POSITIONAL: "*", inspect.Parameter.VAR_KEYWORD: "**"}
    asked = [marks.get(p.kind, "") + p.name for p in signature.parameters.values() if p.name not in ("self", "cls")]
    told = [n.strip() for names, _, _ in entries(parts.get("Parameters", [])) for n in names.split(",")]
    # Some stand together.
    assert sorted(told) == sorted(asked), "parameters are those of the signature"
    for names, kind, text in entries(parts.get("Parameters", [])):
        assert text, f"{names} has no text"
        assert kind or "," in names or names.startswith("*") or text[0].strip().startswith("As of"), f"{names} has no type"
    if not inspect.isclass(thing):
        returns = signature.return_annotation not in (None, "None")
        assert returns == ("Returns" in parts), "what is returned is told"
    for section in ("Returns", "Raises"):
        assert all(text for _, _, text in entries(parts.get(section, []))), f"{section} has an entry without a text"
    assert ">>>" in "\n".join(parts.get("Examples", [])), "there is no example"


@pytest.mark.parametrize("name, thing", list(properties()), ids=lambda x: x if isinstance(x, str) else "")
def test_properties_have_docstrings(name, thing):
    assert thing.__doc__ and thing.__doc__.splitlines()[0].endswith("."), name
    assert "return" in thing.fget.__annotations__, name


@pytest.mark.parametrize("module", list(modules()), ids=lambda m: m.__name__)
def test_examples_run(module, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    tetrahedron(tmp_path / "tetrahedron.vtu")
    names = {"np": np, "halite": halite}
    if module is not halite:
        from windows import cube_of_pressure
        names["grid"] = cube_of_pressure()
    if module.__name__ == "halite.pyvista":
        import pyvista
        names.update(pyvista=pyvista, grid=pyvista.wrap(names["grid"]))
    runner, tried = doctest.DocTestRunner(), {}
    for name, thing in [(module.__name__, module), *public(module)]:
        if "vtkmodules" in thing.__doc__ and not importlib.util.find_spec("vtkmodules"):
            continue
        result = runner.run(doctest.DocTestParser().get_doctest(thing.__doc__, dict(names), name, None, None))
        assert result.failed == 0, name
        tried[name] = result.attempted
    assert all(tried.values()) and len(tried) >= {"halite": 15, "halite.vtk": 4, "halite.pyvista": 2}[module.__name__]


def test_the_stub_is_that_of_the_compiled_module():
    """Every name, parameter and method of the compiled module is in the stub, and no other."""
    pytest.importorskip("mypy")
    run = subprocess.run([sys.executable, "-m", "mypy.stubtest", "halite._halite", "--mypy-config-file", os.devnull],
                         capture_output=True, text=True)
    assert run.returncode == 0, run.stdout + run.stderr


def test_types_are_strict(tmp_path):
    """The package itself, and a program that uses it; one that misuses it is found out."""
    pytest.importorskip("mypy")
    folder = os.path.dirname(halite.__file__)
    assert os.path.exists(os.path.join(folder, "py.typed"))
    right, wrong = tmp_path / "right.py", tmp_path / "wrong.py"
    right.write_text("import numpy as np\nimport numpy.typing as npt\nimport halite\n\n"
                     "mesh: halite.Mesh = halite.read('a.vtu', time=0.5)\n"
                     "renderer = halite.Renderer(mesh, 's', transfer=halite.TransferFunction('magma', (0, 1), opacity=[0, 1]))\n"
                     "pixels: npt.NDArray[np.float32] = renderer.render(halite.View((1, 2, 3), size=(4, 4)))\n"
                     "halite.Picture(pixels).save('a.png')\n"
                     "picture: halite.Picture = halite.show(mesh)\n")
    wrong.write_text("import halite\nhalite.read(3)\nhalite.Renderer(mesh='a', threads='all')\nhalite.View((1, 2, 3)).size + 1\n")

    def mypy(*arguments):
        return subprocess.run([sys.executable, "-m", "mypy", "--strict", "--config-file", os.devnull, "--cache-dir",
                               str(tmp_path / "cache"), *arguments], capture_output=True, text=True, cwd=tmp_path)

    run = mypy("right.py")
    assert run.returncode == 0, run.stdout
    run = mypy("wrong.py")
    assert [int(line.split(":")[1]) for line in run.stdout.splitlines() if ": error: " in line] == [2, 3, 4], run.stdout
    if importlib.util.find_spec("pyvista"):
        run = mypy("-p", "halite")
        assert run.returncode == 0, run.stdout
