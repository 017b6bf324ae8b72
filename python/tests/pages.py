# SPDX-License-Identifier: MIT OR Apache-2.0
"""Runs the code of docs/python.md and docs/python.ipynb. `python pages.py` writes the pictures and outputs anew."""
import ast
import base64
import json
import os
import pathlib
import re
import shutil
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
DOCS = ROOT / "docs"
DATA = ROOT.parent / "shared" / "data" / "tools" / "disk_out_ref.vtu"


def blocks():
    """The Python code on the page, piece by piece."""
    return re.findall(r"^```python\n(.*?)^```$", (DOCS / "python.md").read_text(), re.M | re.S)


def run_block(code, folder):
    """Runs a piece of code in a folder; the files that it wrote."""
    if "disk_out_ref.vtu" in code:
        shutil.copy(DATA, folder)
    before, here = set(os.listdir(folder)), os.getcwd()
    os.chdir(folder)
    try:
        exec(compile(code, "docs/python.md", "exec"), {"__name__": "page"})
    finally:
        os.chdir(here)
    return sorted(set(os.listdir(folder)) - before)


def run_notebook():
    """The notebook, and for each of its code cells what it shows: the picture of its last line, or None."""
    notebook, names, shown = json.loads((DOCS / "python.ipynb").read_text()), {"__name__": "notebook"}, []
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            tree = ast.parse("".join(cell["source"]))
            last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
            exec(compile(tree, "docs/python.ipynb", "exec"), names)
            value = eval(compile(ast.Expression(last.value), "docs/python.ipynb", "eval"), names) if last else None
            shown.append(value._repr_png_() if value is not None else None)
    return notebook, shown


def outputs(cell):
    """The pictures in the outputs of a cell."""
    return [base64.b64decode("".join(o["data"]["image/png"])) for o in cell["outputs"] if "image/png" in o.get("data", {})]


def main():
    with tempfile.TemporaryDirectory() as folder:
        for code in blocks():
            for name in run_block(code, folder):
                if name.endswith(".png"):
                    shutil.copy(pathlib.Path(folder) / name, DOCS / name)
    notebook, shown = run_notebook()
    for cell, png in zip((c for c in notebook["cells"] if c["cell_type"] == "code"), shown):
        data = {"image/png": base64.b64encode(png).decode(), "text/plain": ["<halite.Picture: 320 x 240 pixels>"]} if png else None
        cell["outputs"] = [{"output_type": "execute_result", "execution_count": None, "metadata": {}, "data": data}] if png else []
    (DOCS / "python.ipynb").write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n")


if __name__ == "__main__":
    sys.exit(main())
