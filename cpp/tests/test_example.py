# SPDX-License-Identifier: MIT OR Apache-2.0
"""The example in Python writes a picture in which something is to be seen."""
import os
import pathlib
import subprocess
import sys

from scene import *  # noqa: F403


def test_example():
    from vtkmodules.vtkIOImage import vtkPNGReader
    script = pathlib.Path(__file__).resolve().parents[1] / "examples" / "numpy_grid.py"
    picture = os.path.join(os.environ["HALITE_TEST_OUTPUT"], "numpy_grid.png")
    said = subprocess.run([sys.executable, str(script), picture], check=True, stdout=subprocess.PIPE).stdout.decode()
    assert "27648 wedges" in said, said
    reader = vtkPNGReader()
    reader.SetFileName(picture)
    reader.Update()
    seen = numpy_support.vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars())[:, :3].astype(int)
    red, blue = (seen[:, 0] - seen[:, 2] > 40).mean(), (seen[:, 2] - seen[:, 0] > 40).mean()
    assert red > 0.02 and blue > 0.02 and (seen == 255).all(-1).mean() > 0.2, (red, blue)


if __name__ == "__main__":
    main(globals())
