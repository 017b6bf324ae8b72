# SPDX-License-Identifier: MIT OR Apache-2.0
"""The code in docs runs, and makes the pictures that stand beside it."""
import io
import re

import numpy as np
import pytest

pytest.importorskip("pyvista")

from PIL import Image  # noqa: E402

import pages  # noqa: E402


def difference(a, b):
    a, b = (np.asarray(Image.open(p).convert("RGB"), float) for p in (a, b))
    assert a.shape == b.shape
    return np.abs(a - b)


@pytest.mark.parametrize("number", range(len(pages.blocks())))
def test_the_page(number, tmp_path):
    code = pages.blocks()[number]
    if "disk_out_ref.vtu" in code and not pages.DATA.exists():
        pytest.skip("there is no ../shared/data")
    for name in pages.run_block(code, tmp_path):
        if name.endswith(".png"):
            assert f"({name})" in (pages.DOCS / "python.md").read_text(), "the page shows what it makes"
            assert (pages.DOCS / name).stat().st_size < 150_000
            # Letters of scalar bars differ a little from driver to driver.
            apart = difference(tmp_path / name, pages.DOCS / name)
            assert np.percentile(apart, 99) <= 1 and apart.mean() < 0.5


def test_the_page_shows_no_other_picture():
    shown = re.findall(r"\]\((\w+\.png)\)", (pages.DOCS / "python.md").read_text())
    made = re.findall(r'"(python_\w+\.png)"', "".join(pages.blocks()))
    assert sorted(shown) == sorted(made) and len(shown) == 3


def test_the_notebook():
    notebook, shown = pages.run_notebook()
    cells = [c for c in notebook["cells"] if c["cell_type"] == "code"]
    assert sum(png is not None for png in shown) >= 3
    for cell, png in zip(cells, shown):
        stored = pages.outputs(cell)
        assert len(stored) == (png is not None)
        if png:
            assert len(stored[0]) < 150_000
            assert difference(io.BytesIO(stored[0]), io.BytesIO(png)).max() <= 1
