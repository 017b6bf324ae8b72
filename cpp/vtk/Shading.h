// SPDX-License-Identifier: MIT OR Apache-2.0
// What a volume shows besides functions of one variable: gradient opacity, functions of two, light and silhouettes.
#pragma once

#include "Key.h"
#include "vtkHaliteCompatibility.h"

#include "halite.h"

#include "vtkDataArray.h"
#include "vtkSmartPointer.h"

VTK_ABI_NAMESPACE_BEGIN
class vtkRenderer;
class vtkVolumeProperty;
VTK_ABI_NAMESPACE_END

namespace halite_vtk
{

struct Shading
{
  std::vector<halite::TransferFunction::GradientKnot> GradientOpacity;
  std::optional<halite::Table2D> Table;
  // When the image that it is was changed last.
  std::uint64_t TableTime = 0;
  std::vector<std::string> Widgets;
  std::optional<double> Silhouette;
  std::optional<halite::Shade> Shade;
  // The second variable, if it is not the length of the gradient.
  vtkSmartPointer<vtkDataArray> Second;

  // What a property asks for where `array` is drawn, lit by the lights of `renderer`.
  Shading(vtkVolumeProperty* property, vtkRenderer* renderer, vtkDataArray* array, vtkDataArray* second);

  // Whether functions of a property have a second variable.
  static bool IsOfTwo(vtkVolumeProperty* property);
  // Whether there is anything of it.
  bool IsThere() const;
  // Whether it needs the gradient of the field.
  bool NeedsGradient() const;
  // What it depends on.
  halite_vtk::Key Key() const;
};

}
