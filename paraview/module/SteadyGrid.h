// SPDX-License-Identifier: MIT OR Apache-2.0
/**
 * Grids one after the other, as a time series has them: what is equal to that of the grid before is that, so that what is made of points and
 * cells is not made anew.
 */
#ifndef SteadyGrid_h
#define SteadyGrid_h

#include "vtkSmartPointer.h"

class vtkDataSet;
class vtkUnstructuredGrid;

class SteadyGrid
{
public:
  /**
   * The same grid; or, if it is an unstructured grid whose points and cells are those of the one before, number for number, a grid
   * with its arrays and the points and cells of the one before.
   */
  vtkDataSet* Of(vtkDataSet* grid);

private:
  vtkSmartPointer<vtkDataSet> Last;
  unsigned long LastTime = 0;
  vtkSmartPointer<vtkUnstructuredGrid> Kept;
};

#endif
// VTK-HeaderTest-Exclude: SteadyGrid.h
