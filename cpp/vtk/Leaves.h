// SPDX-License-Identifier: MIT OR Apache-2.0
// The grids of a data object. ParaView's representations include this, too.
#pragma once

#include "vtkCompositeDataIterator.h"
#include "vtkCompositeDataSet.h"
#include "vtkDataObject.h"
#include "vtkDataSet.h"
#include "vtkSmartPointer.h"

#include <vector>

namespace halite_vtk
{

// The grids that have cells: the data object itself, or the leaves of a composite one.
inline std::vector<vtkSmartPointer<vtkDataSet>> LeavesOf(vtkDataObject* data)
{
  std::vector<vtkSmartPointer<vtkDataSet>> grids;
  const auto add = [&grids](vtkDataObject* leaf) {
    vtkDataSet* grid = vtkDataSet::SafeDownCast(leaf);
    if (grid && grid->GetNumberOfCells() > 0)
    {
      grids.emplace_back(grid);
    }
  };
  if (auto composite = vtkCompositeDataSet::SafeDownCast(data))
  {
    const auto leaves = vtkSmartPointer<vtkCompositeDataIterator>::Take(composite->NewIterator());
    for (leaves->InitTraversal(); !leaves->IsDoneWithTraversal(); leaves->GoToNextItem())
    {
      add(leaves->GetCurrentDataObject());
    }
  }
  else
  {
    add(data);
  }
  return grids;
}

}
