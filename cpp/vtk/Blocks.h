// SPDX-License-Identifier: MIT OR Apache-2.0
// The grids of an input, and which of them is in front of which.
#pragma once

#include "vtkHaliteCompatibility.h"

#include "halite.h"

#include "vtkSmartPointer.h"

#include <cstddef>
#include <vector>

VTK_ABI_NAMESPACE_BEGIN
class vtkDataObject;
class vtkDataSet;
class vtkRenderer;
VTK_ABI_NAMESPACE_END

namespace halite_vtk
{

struct Block
{
  vtkSmartPointer<vtkDataSet> Grid;
  // Its number among those of the input, whatever the view.
  std::size_t Place = 0;

  // The grids that have cells: the input itself, or the leaves of a composite one.
  static std::vector<Block> Of(vtkDataObject* input);

  // Puts those first that are nearer to the eye, by the boxes around them before `placement` moves these: of two boxes, the one on the
  // eye's side of a plane between them; where they overlap, of the plane that they overlap least across.
  static void Sort(std::vector<Block>& blocks, vtkRenderer* renderer, const halite::Renderer::Matrix& placement);
};

}
