// SPDX-License-Identifier: MIT OR Apache-2.0
// VTK's transfer functions as knots.
#pragma once

#include "Key.h"
#include "vtkHaliteCompatibility.h"

#include "halite.h"

#include <map>

VTK_ABI_NAMESPACE_BEGIN
class vtkColorTransferFunction;
class vtkPiecewiseFunction;
class vtkVolumeProperty;
VTK_ABI_NAMESPACE_END

namespace halite_vtk
{

namespace Functions
{

using Color = std::vector<halite::TransferFunction::ColorKnot>;
using Opacity = std::vector<halite::TransferFunction::OpacityKnot>;

// Between nodes that VTK does not join by a straight line in RGB, knots are added until the error is below 1e-4.
// Negative values count as 0; where a function ends without clamping, it steps to what VTK says is beyond.
Color KnotsOf(vtkColorTransferFunction* function);
Color GreyKnotsOf(vtkPiecewiseFunction* function);
Opacity KnotsOf(vtkPiecewiseFunction* function);

struct Knots
{
  halite_vtk::Key Sources;
  Functions::Color Color;
  Functions::Opacity Opacity;
};

// The knots of properties, found anew only where a function changed.
class Cache
{
public:
  // Those of component 0. Of RGBA, of which the array itself has the colours: white, and no opacity.
  const Knots& KnotsOf(vtkVolumeProperty* property, bool isRGBA);

private:
  std::map<vtkVolumeProperty*, Knots> Kept;
};

}

}
