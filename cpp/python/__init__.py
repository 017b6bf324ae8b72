# SPDX-License-Identifier: MIT OR Apache-2.0
"""Halite in VTK: exact volume rendering of unstructured grids.

    from halite.vtkHalite import vtkHaliteMapper

Importing this package also makes vtkProjectedTetrahedraMapper() a vtkHaliteMapper from then on, whether VTK's rendering modules were
imported before or come after. vtkHaliteMapper.SetOverride(False) undoes that; the environment variable HALITE_OVERRIDE=0
prevents it.
"""
# VTK's own modules must be loaded first, for the classes that ours derives from.
import vtkmodules.vtkRenderingVolume
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401

from . import vtkHalite

vtkHalite.vtkHaliteMapper.RegisterOverride()
__all__ = ["vtkHalite"]
