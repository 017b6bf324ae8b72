# SPDX-License-Identifier: MIT OR Apache-2.0
"""Exact volume rendering of unstructured grids: every pixel is the emission-absorption integral of the field that the mesh defines.

>>> import numpy as np
>>> import halite
>>> points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
>>> mesh = halite.Mesh.from_arrays(points, cells=[0, 1, 2, 3], offsets=[0, 4], types=[10], point_data={"s": points[:, 0]})
>>> transfer = halite.TransferFunction("viridis", (0, 1), opacity=1.0)
>>> view = halite.View((3, 2, 4), (0.3, 0.3, 0.3), size=(64, 48))
>>> picture = halite.Renderer(mesh, transfer=transfer).render(view)
>>> picture.shape, picture.dtype
((48, 64, 4), dtype('float32'))

``halite.vtk`` and ``halite.pyvista`` put such pictures into windows of VTK and PyVista.
"""
import os
import sys

if sys.platform == "linux" and not os.environ.get("XDG_RUNTIME_DIR", "").startswith("/"):
    # Mesa's selection of Vulkan devices asks Wayland, which complains on stderr where there is no session.
    os.environ.setdefault("NODEVICE_SELECT", "1")

from ._halite import Error, __version__
from ._mesh import Mesh, read
from ._picture import Picture, show, write
from ._renderer import Renderer
from ._transfer import TransferFunction
from ._view import View

__all__ = ["Error", "Mesh", "Picture", "Renderer", "TransferFunction", "View", "__version__", "read", "show", "write"]

# Tracebacks and documentation name what programs import.
for _public in (Mesh, Picture, Renderer, TransferFunction, View, read, show, write):
    _public.__module__ = __name__
del _public, os, sys
