// SPDX-License-Identifier: MIT OR Apache-2.0
#include "OneGrid.h"

#include "vtkAppendFilter.h"
#include "vtkCellArray.h"
#include "vtkCellType.h"
#include "vtkCompositeDataSet.h"
#include "vtkDataSet.h"
#include "vtkExtractBlockUsingDataAssembly.h"
#include "vtkIdTypeArray.h"
#include "vtkMergeBlocks.h"
#include "vtkPartitionedDataSet.h"
#include "vtkUnsignedCharArray.h"
#include "vtkUnstructuredGrid.h"

#include <cstring>

namespace
{

vtkUnstructuredGrid* Merged(vtkDataObject* blocks, vtkMergeBlocks* merge)
{
  merge->SetInputData(blocks);
  // Neighbours are found by where their points are, whichever block these belong to.
  merge->MergePointsOff();
  merge->Update();
  return vtkUnstructuredGrid::SafeDownCast(merge->GetOutputDataObject(0));
}

bool HasPolyhedra(vtkUnstructuredGrid* grid)
{
  vtkUnsignedCharArray* types = grid->GetCellTypesArray();
  const auto count = types ? static_cast<std::size_t>(types->GetNumberOfValues()) : 0;
  return count > 0 && std::memchr(types->GetPointer(0), VTK_POLYHEDRON, count);
}

// ParaView 5.11's reader of several pieces leaves arrays for faces of polyhedra, with anything in them, where there are no polyhedra.
// What deals cells to ranks reads them.
void DropFacesOfNothing(vtkUnstructuredGrid* grid)
{
  if ((grid->GetFaces() || grid->GetFaceLocations()) && !HasPolyhedra(grid))
  {
    grid->SetCells(grid->GetCellTypesArray(), grid->GetCells(), nullptr, nullptr);
  }
}

}

OneGrid::OneGrid() = default;
OneGrid::~OneGrid() = default;

void OneGrid::SetAssembly(const char* name)
{
  this->Blocks->SetAssemblyName(name);
}

void OneGrid::AddSelector(const char* selector)
{
  this->Blocks->AddSelector(selector);
}

void OneGrid::ClearSelectors()
{
  this->Blocks->ClearSelectors();
}

vtkSmartPointer<vtkUnstructuredGrid> OneGrid::Of(vtkDataObject* input)
{
  auto grid = vtkSmartPointer<vtkUnstructuredGrid>::New();
  if (vtkCompositeDataSet::SafeDownCast(input))
  {
    vtkDataObject* chosen = input;
    // Partitions of one data set are no blocks that could be chosen.
    if (!vtkPartitionedDataSet::SafeDownCast(input))
    {
      this->Blocks->SetInputData(input);
      this->Blocks->Update();
      chosen = this->Blocks->GetOutputDataObject(0);
    }
    vtkNew<vtkMergeBlocks> merge;
    if (vtkUnstructuredGrid* merged = Merged(chosen, merge))
    {
      grid->ShallowCopy(merged);
    }
    this->Blocks->SetInputData(nullptr);
  }
  else if (auto unstructured = vtkUnstructuredGrid::SafeDownCast(input))
  {
    grid->ShallowCopy(unstructured);
  }
  else if (auto other = vtkDataSet::SafeDownCast(input))
  {
    vtkNew<vtkAppendFilter> append;
    append->AddInputData(other);
    append->Update();
    grid->ShallowCopy(append->GetOutput());
  }
  DropFacesOfNothing(grid);
  if (grid->HasAnyGhostCells())
  {
    grid->RemoveGhostCells();
  }
  return grid;
}
