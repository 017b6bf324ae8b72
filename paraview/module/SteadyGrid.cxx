// SPDX-License-Identifier: MIT OR Apache-2.0
#include "SteadyGrid.h"

#include "vtkCellArray.h"
#include "vtkDataArray.h"
#include "vtkIdTypeArray.h"
#include "vtkPoints.h"
#include "vtkUnsignedCharArray.h"
#include "vtkUnstructuredGrid.h"

#include <cstring>

namespace
{

bool AreEqual(vtkDataArray* a, vtkDataArray* b)
{
  if (a == b)
  {
    return true;
  }
  if (!a || !b || a->GetDataType() != b->GetDataType() || a->GetNumberOfValues() != b->GetNumberOfValues() ||
    a->GetNumberOfComponents() != b->GetNumberOfComponents() || !a->HasStandardMemoryLayout() ||
    !b->HasStandardMemoryLayout())
  {
    return false;
  }
  const auto bytes = static_cast<std::size_t>(a->GetNumberOfValues()) * static_cast<std::size_t>(a->GetDataTypeSize());
  return bytes == 0 || std::memcmp(a->GetVoidPointer(0), b->GetVoidPointer(0), bytes) == 0;
}

bool HaveEqualPoints(vtkUnstructuredGrid* a, vtkUnstructuredGrid* b)
{
  return a->GetPoints() && b->GetPoints() && AreEqual(a->GetPoints()->GetData(), b->GetPoints()->GetData());
}

bool HaveEqualCells(vtkUnstructuredGrid* a, vtkUnstructuredGrid* b)
{
  vtkCellArray *ofA = a->GetCells(), *ofB = b->GetCells();
  return ofA && ofB && AreEqual(a->GetCellTypesArray(), b->GetCellTypesArray()) &&
    AreEqual(ofA->GetOffsetsArray(), ofB->GetOffsetsArray()) &&
    AreEqual(ofA->GetConnectivityArray(), ofB->GetConnectivityArray()) && AreEqual(a->GetFaces(), b->GetFaces()) &&
    AreEqual(a->GetFaceLocations(), b->GetFaceLocations());
}

}

vtkDataSet* SteadyGrid::Of(vtkDataSet* grid)
{
  auto given = vtkUnstructuredGrid::SafeDownCast(grid);
  if (!given)
  {
    this->Kept = nullptr;
    this->Last = nullptr;
    return grid;
  }
  const unsigned long time = given->GetMTime();
  if (this->Last != given || this->LastTime != time)
  {
    auto steady = vtkSmartPointer<vtkUnstructuredGrid>::New();
    steady->ShallowCopy(given);
    // Points may move while cells stay, which saves less, but the time of each is its own.
    if (this->Kept && HaveEqualPoints(this->Kept, given))
    {
      steady->SetPoints(this->Kept->GetPoints());
    }
    if (this->Kept && HaveEqualCells(this->Kept, given))
    {
      vtkUnsignedCharArray* types = this->Kept->GetCellTypesArray();
      steady->SetCells(types, this->Kept->GetCells(), this->Kept->GetFaceLocations(), this->Kept->GetFaces());
    }
    this->Kept = steady;
    this->Last = given;
    this->LastTime = time;
  }
  return this->Kept;
}
