// SPDX-License-Identifier: MIT OR Apache-2.0
#include "Shading.h"

#include "Functions.h"

#include "vtkImageData.h"
#include "vtkLight.h"
#include "vtkLightCollection.h"
#include "vtkPointData.h"
#include "vtkRenderer.h"
#include "vtkVolumeProperty.h"

#include <algorithm>

namespace halite_vtk
{

namespace
{

// The lights of a renderer that are switched on.
std::vector<halite::Light> LightsOf(vtkRenderer* renderer)
{
  std::vector<halite::Light> lights;
  vtkLightCollection* collection = renderer->GetLights();
  vtkCollectionSimpleIterator cookie;
  collection->InitTraversal(cookie);
  while (vtkLight* light = collection->GetNextLight(cookie))
  {
    if (!light->GetSwitch())
    {
      continue;
    }
    halite::Light l;
    light->GetDiffuseColor(l.color.data());
    l.intensity = light->GetIntensity();
    double position[3], focus[3];
    light->GetTransformedPosition(position);
    light->GetTransformedFocalPoint(focus);
    const std::array<double, 3> axis = { focus[0] - position[0], focus[1] - position[1], focus[2] - position[2] };
    if (light->GetPositional())
    {
      l.kind = halite::Light::Kind::Position;
      std::copy_n(position, 3, l.vector.begin());
      light->GetAttenuationValues(l.attenuation.data());
      if (light->GetConeAngle() <= 90)
      {
        l.cone = halite::Light::Cone{ axis, light->GetConeAngle(), light->GetExponent() };
      }
    }
    else if (!light->LightTypeIsHeadlight())
    {
      l.kind = halite::Light::Kind::Direction;
      l.vector = axis;
    }
    lights.push_back(l);
  }
  return lights;
}

// The table that a function of two variables is. Its image says over what it lies; if it has neither origin nor spacing of
// its own, it lies over the range of the scalars, and over a gradient from 0 to a quarter of that, or the range of `second`.
halite::Table2D TableOf(vtkImageData* image, vtkDataArray* array, vtkDataArray* second)
{
  vtkDataArray* values = image->GetPointData()->GetScalars();
  if (!values || values->GetNumberOfComponents() != 4)
  {
    throw halite::Error("the 2D transfer function is no image of 4 components: red, green, blue and opacity");
  }
  halite::Table2D table;
  int size[3];
  image->GetDimensions(size);
  table.columns = static_cast<std::size_t>(size[0]);
  table.rows = static_cast<std::size_t>(size[1]);
  if (size[2] != 1)
  {
    throw halite::Error("the 2D transfer function has " + std::to_string(size[2]) + " layers, and not one");
  }
  const double one = values->GetDataType() == VTK_UNSIGNED_CHAR ? 255 : 1;
  for (vtkIdType i = 0; i < values->GetNumberOfTuples(); ++i)
  {
    std::array<double, 4> texel;
    values->GetTuple(i, texel.data());
    for (double& x : texel)
    {
      x /= one;
    }
    table.texels.push_back(texel);
  }
  const double *origin = image->GetOrigin(), *spacing = image->GetSpacing();
  const bool isPlain = std::all_of(origin, origin + 2, [](double x) { return x == 0; }) &&
    std::all_of(spacing, spacing + 2, [](double x) { return x == 1; });
  const auto spread = [](double low, double high) -> std::array<double, 2> {
    return { low, high > low ? high : low + std::max(1e-6, std::abs(low) * 1e-6) };
  };
  if (isPlain)
  {
    const double* range = array->GetFiniteRange(0);
    table.scalarRange = spread(range[0], range[1]);
    table.secondRange = spread(0, 0.25 * (range[1] - range[0]));
    if (second)
    {
      const double* others = second->GetFiniteRange(0);
      table.secondRange = spread(others[0], others[1]);
    }
    return table;
  }
  double bounds[6];
  image->GetBounds(bounds);
  table.scalarRange = spread(bounds[0] - spacing[0] / 2, bounds[1] + spacing[0] / 2);
  table.secondRange = spread(bounds[2] - spacing[1] / 2, bounds[3] + spacing[1] / 2);
  return table;
}

}

Shading::Shading(vtkVolumeProperty* property, vtkRenderer* renderer, vtkDataArray* array, vtkDataArray* second)
{
  const bool isTable = property->GetTransferFunctionMode() == vtkVolumeProperty::TF_2D;
  if (isTable && IsOfTwo(property))
  {
    vtkImageData* function = property->GetTransferFunction2D(0);
    this->Table = TableOf(function, array, second);
    this->TableTime = static_cast<std::uint64_t>(function->GetMTime());
  }
  else if (IsOfTwo(property))
  {
    for (const auto& k : Functions::KnotsOf(property->GetGradientOpacity(0)))
    {
      this->GradientOpacity.push_back({ k.scalar, k.opacity });
    }
  }
  if (property->GetShade(0))
  {
    halite::Shade shade;
    shade.ambient = property->GetAmbient(0);
    shade.diffuse = property->GetDiffuse(0);
    shade.specular = property->GetSpecular(0);
    shade.power = property->GetSpecularPower(0);
    shade.twoSided = renderer->GetTwoSidedLighting() != 0;
    shade.reflected = true;
    shade.lights = LightsOf(renderer);
    this->Shade = shade;
  }
  if (this->Table || !this->GradientOpacity.empty())
  {
    this->Second = second;
  }
}

bool Shading::IsOfTwo(vtkVolumeProperty* property)
{
  // With 2D functions, VTK says that there is gradient opacity.
  return property->GetTransferFunctionMode() == vtkVolumeProperty::TF_2D
    ? property->GetTransferFunction2D(0) != nullptr
    : property->HasGradientOpacity(0) && !property->GetDisableGradientOpacity(0);
}

bool Shading::IsThere() const
{
  return this->NeedsGradient() || this->Table || !this->GradientOpacity.empty() || !this->Widgets.empty();
}

bool Shading::NeedsGradient() const
{
  const bool isOfTwo = this->Table || !this->GradientOpacity.empty();
  return this->Shade || this->Silhouette || (isOfTwo && !this->Second);
}

Key Shading::Key() const
{
  halite_vtk::Key key;
  key << static_cast<std::uint64_t>(this->GradientOpacity.size());
  for (const auto& k : this->GradientOpacity)
  {
    key << k.secondVariable << k.factor;
  }
  if (this->Table)
  {
    key << this->TableTime << this->Table->scalarRange << this->Table->secondRange;
  }
  for (const std::string& widget : this->Widgets)
  {
    key << widget;
  }
  key << this->Silhouette.value_or(-1);
  if (this->Shade)
  {
    const halite::Shade& s = *this->Shade;
    key << s.ambient << s.diffuse << s.specular << s.power << static_cast<std::uint64_t>(s.twoSided);
    for (const halite::Light& l : s.lights)
    {
      key << static_cast<std::uint64_t>(l.kind) << l.vector << l.color << l.intensity << l.attenuation
          << static_cast<std::uint64_t>(l.cone.has_value());
      if (l.cone)
      {
        key << l.cone->axis << l.cone->angle << l.cone->exponent;
      }
    }
  }
  return key;
}

}
