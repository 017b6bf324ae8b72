// SPDX-License-Identifier: MIT OR Apache-2.0
/**
 * What a representation is given, as one unstructured grid whose cells are as they were.
 */
#ifndef OneGrid_h
#define OneGrid_h

#include "vtkNew.h"
#include "vtkSmartPointer.h"

class vtkDataObject;
class vtkExtractBlockUsingDataAssembly;
class vtkUnstructuredGrid;

class OneGrid
{
public:
  OneGrid();
  ~OneGrid();

  ///@{
  /**
   * Which blocks of composite data are taken: those that any selector finds in the assembly of this name.
   */
  void SetAssembly(const char* name);
  void AddSelector(const char* selector);
  void ClearSelectors();
  ///@}

  /**
   * An unstructured grid shares its arrays with the result; structured grids become hexahedra, and blocks are put one after the other.
   * Without duplicate and hidden cells. Empty for null, and for what is no grid.
   */
  vtkSmartPointer<vtkUnstructuredGrid> Of(vtkDataObject* input);

private:
  vtkNew<vtkExtractBlockUsingDataAssembly> Blocks;
};

#endif
// VTK-HeaderTest-Exclude: OneGrid.h
