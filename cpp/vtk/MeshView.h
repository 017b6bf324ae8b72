// SPDX-License-Identifier: MIT OR Apache-2.0
// VTK's arrays as the core reads them: in place where their layout allows it.
#pragma once

#include "vtkHaliteCompatibility.h"

#include "halite.h"

#include "vtkSmartPointer.h"

#include <cstdint>
#include <vector>

VTK_ABI_NAMESPACE_BEGIN
class vtkDataArray;
class vtkDataSet;
class vtkPoints;
VTK_ABI_NAMESPACE_END

namespace halite_vtk
{

class MeshView
{
public:
  // Numbers of all components of an array, or of one. A copy, if one must be made, lives as long as this view.
  halite::Numbers Numbers(vtkDataArray* array, int component = -1);

  // The grid's points and cells, and what is left out of it.
  halite::Mesh Mesh(vtkDataSet* grid);

  halite::Numbers Points(vtkDataSet* grid);

  // Whether the core has a type of its own for it: image data and rectilinear grids.
  static bool IsGrid(vtkDataSet* grid);

  // Whether cells or points of it are marked as ghosts or hidden.
  static bool HasGhosts(vtkDataSet* grid);

  // Such a grid, and what is left out of it; or, if the value of the nearest point is drawn, that whose cells are what is
  // nearest to each point.
  halite::Grid Grid(vtkDataSet* grid, bool isNearest);

  // What the mesh of a grid depends on: equal if nothing changed.
  static std::vector<std::uint64_t> Identity(vtkDataSet* grid);

  int GetCopies() const { return this->Copies; }

private:
  std::vector<vtkSmartPointer<vtkDataArray>> Kept;
  int Copies = 0;
};

}
