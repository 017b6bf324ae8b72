// SPDX-License-Identifier: MIT OR Apache-2.0
#include "SceneView.h"

#include "vtkCamera.h"
#include "vtkMatrix3x3.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"
#include "vtkOpenGLCamera.h"
#include "vtkPlane.h"
#include "vtkPlaneCollection.h"
#include "vtkRenderer.h"

#include <algorithm>

namespace halite_vtk
{

namespace
{

// World to eye and eye to clip coordinates, as the window draws opaque geometry.
void MatricesOf(vtkRenderer* renderer, halite::Renderer::Matrix& toEye, halite::Renderer::Matrix& toClip)
{
  vtkCamera* camera = renderer->GetActiveCamera();
  vtkNew<vtkMatrix4x4> eye, clip;
  if (auto opengl = vtkOpenGLCamera::SafeDownCast(camera))
  {
    vtkMatrix4x4 *wcvc, *vcdc, *wcdc;
    vtkMatrix3x3* normals;
    opengl->GetKeyMatrices(renderer, wcvc, normals, vcdc, wcdc);
    vtkMatrix4x4::Transpose(wcvc, eye);
    vtkMatrix4x4::Transpose(vcdc, clip);
  }
  else
  {
    eye->DeepCopy(camera->GetModelViewTransformMatrix());
    clip->DeepCopy(camera->GetProjectionTransformMatrix(renderer->GetTiledAspectRatio(), -1, 1));
  }
  std::copy_n(eye->GetData(), 16, toEye.begin());
  std::copy_n(clip->GetData(), 16, toClip.begin());
}

}

SceneView::SceneView(vtkRenderer* renderer, int width, int height, bool isMaximum, vtkPlaneCollection* planes)
{
  halite::Renderer::Matrix toEye, toClip;
  MatricesOf(renderer, toEye, toClip);
  this->View.worldToEye = toEye;
  this->View.eyeToClip = toClip;
  this->View.width = static_cast<std::uint32_t>(width);
  this->View.height = static_cast<std::uint32_t>(height);
  this->View.bottomUp = true;
  this->View.maximum = isMaximum;
  this->Key << toEye << toClip << static_cast<double>(width) << static_cast<double>(height)
            << static_cast<std::uint64_t>(isMaximum);
  for (int i = 0; planes && i < planes->GetNumberOfItems(); ++i)
  {
    halite::ClippingPlane p;
    planes->GetItem(i)->GetOrigin(p.origin.data());
    planes->GetItem(i)->GetNormal(p.normal.data());
    this->View.planes.push_back(p);
    this->Key << p.origin << p.normal;
  }
}

void SceneView::Crop(const std::array<double, 6>& planes, int regions, const halite::Renderer::Matrix& placement)
{
  this->View.cropping.emplace();
  this->View.cropping->planes = planes;
  this->View.cropping->regions = static_cast<std::uint32_t>(regions);
  this->View.cropping->placement = placement;
  this->Key << placement << static_cast<double>(regions);
  for (double plane : planes)
  {
    this->Key << plane;
  }
}

}
