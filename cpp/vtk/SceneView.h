// SPDX-License-Identifier: MIT OR Apache-2.0
// From where a renderer shows its scene: its camera, and what the mapper clips, as the core's view.
#pragma once

#include "Key.h"
#include "vtkHaliteCompatibility.h"

#include "halite.h"

VTK_ABI_NAMESPACE_BEGIN
class vtkPlaneCollection;
class vtkRenderer;
VTK_ABI_NAMESPACE_END

// Stays where it is: the core's view points into it.
struct SceneView
{
  halite::View View;
  halite::Renderer::Matrix ToEye, ToClip;
  ::Key Key;

  // `width` x `height` rays.
  SceneView(vtkRenderer* renderer, int width, int height, bool isMaximum, vtkPlaneCollection* planes);
  SceneView(const SceneView&) = delete;
  void operator=(const SceneView&) = delete;
};
