// SPDX-License-Identifier: MIT OR Apache-2.0
/**
 * What differs between versions of VTK, all of it. Tried with 9.1; written for 9.1 to 9.7.
 */
#ifndef vtkHaliteCompatibility_h
#define vtkHaliteCompatibility_h

#include "vtkMatrix4x4.h"
#include "vtkUnsignedCharArray.h"
#include "vtkUnstructuredGrid.h"
#include "vtkVersionMacros.h"
#include "vtkVolume.h"

// Since 9.3.
#ifndef VTK_ABI_NAMESPACE_BEGIN
#define VTK_ABI_NAMESPACE_BEGIN
#define VTK_ABI_NAMESPACE_END
#endif

// Since 9.5: methods of object factories are const in a VTK built so.
#ifndef VTK_FUTURE_CONST
#define VTK_FUTURE_CONST
#endif

namespace vtkHaliteCompatibility
{

// Since 9.2 a prop may stand in another coordinate system than the world.
inline void GetMatrix(vtkVolume* volume, vtkMatrix4x4* matrix)
{
#if VTK_VERSION_NUMBER >= VTK_VERSION_CHECK(9, 2, 0)
  volume->GetModelToWorldMatrix(matrix);
#else
  matrix->DeepCopy(volume->GetMatrix());
#endif
}

// Since 9.5 the types may be of any array.
inline vtkDataArray* GetCellTypes(vtkUnstructuredGrid* grid)
{
#if VTK_VERSION_NUMBER >= VTK_VERSION_CHECK(9, 5, 0)
  return grid->GetCellTypes<vtkDataArray>();
#else
  return grid->GetCellTypesArray();
#endif
}

}

#endif
// VTK-HeaderTest-Exclude: vtkHaliteCompatibility.h
