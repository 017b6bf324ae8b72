// SPDX-License-Identifier: MIT OR Apache-2.0
// From where a renderer shows its scene: its camera, and what the mapper clips, as the core's view.
#pragma once

#include "Key.h"
#include "vtkHaliteCompatibility.h"

#include "halite.h"

#include <array>

VTK_ABI_NAMESPACE_BEGIN
class vtkPlaneCollection;
class vtkRenderer;
VTK_ABI_NAMESPACE_END

namespace halite_vtk
{

struct SceneView
{
  halite::View View;
  halite_vtk::Key Key;

  // `width` x `height` rays.
  SceneView(vtkRenderer* renderer, int width, int height, bool isMaximum, vtkPlaneCollection* planes);

  // Has some of the regions between planes of the data drawn, which a volume places.
  void Crop(const std::array<double, 6>& planes, int regions, const halite::Renderer::Matrix& placement);
};

}
