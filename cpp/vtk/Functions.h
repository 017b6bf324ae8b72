// SPDX-License-Identifier: MIT OR Apache-2.0
// VTK's transfer functions as knots.
#pragma once

#include "halite.h"

class vtkColorTransferFunction;
class vtkPiecewiseFunction;

namespace Functions
{

using Color = std::vector<halite::TransferFunction::ColorKnot>;
using Opacity = std::vector<halite::TransferFunction::OpacityKnot>;

// Between nodes that VTK does not join by a straight line in RGB, knots are added until the error is below 1e-4. Negative
// values count as 0; where a function ends without clamping, it steps to what VTK says is beyond.
Color KnotsOf(vtkColorTransferFunction* function);
Color GreyKnotsOf(vtkPiecewiseFunction* function);
Opacity KnotsOf(vtkPiecewiseFunction* function);

}
