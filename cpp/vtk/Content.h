// SPDX-License-Identifier: MIT OR Apache-2.0
// What is drawn: a grid, one of its arrays, where, and by which functions.
#pragma once

#include "Functions.h"
#include "Key.h"
#include "Shading.h"
#include "vtkHaliteCompatibility.h"

#include "halite.h"

#include "vtkDataArray.h"
#include "vtkDataSet.h"
#include "vtkSmartPointer.h"

VTK_ABI_NAMESPACE_BEGIN
class vtkVolume;
VTK_ABI_NAMESPACE_END

namespace halite_vtk
{

struct Content
{
  // How the core is to work.
  halite::Settings Settings;
  vtkSmartPointer<vtkDataSet> Grid;
  // Which grid of the input it is.
  std::size_t Place = 0;
  // Whether the core has it as a grid, and then whether the value of the nearest point is drawn.
  bool IsGrid = false;
  bool IsNearest = false;
  halite::Renderer::Matrix Placement{};
  vtkSmartPointer<vtkDataArray> Array;
  halite::Association Association = halite::Association::Points;
  int Component = 0;
  halite::TransferFunction Function;
  // The second variable, if it is not the length of the gradient.
  vtkSmartPointer<vtkDataArray> Second;
  // What each of these depends on.
  Key SettingsKey, IntegralKey, MeshKey, PlacementKey, FieldKey, FunctionKey;

  // What a volume shows of a grid by `array`, of which `cellFlag` says what vtkAbstractMapper::GetScalars does. Throws
  // if there is no array, or VTK has no meaning for it.
  Content(const halite::Settings& settings, vtkDataSet* grid, vtkDataArray* array, int cellFlag, vtkVolume* volume,
    halite::OpacityConvention convention, Functions::Cache& functions);

  // Has it drawn with a second variable and light.
  void Shade(const Shading& shading);

  // What a picture depends on, but for the view.
  Key Whole() const;

private:
  void ChooseField(vtkVolume* volume, int cellFlag);
  void ChooseInterpolation(vtkVolume* volume);
  void ChooseFunction(vtkVolume* volume, halite::OpacityConvention convention, Functions::Cache& functions);
};

}
