// SPDX-License-Identifier: MIT OR Apache-2.0
#include "Content.h"

#include "MeshView.h"
#include "vtkHaliteCompatibility.h"

#include "vtkColorTransferFunction.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"
#include "vtkVolume.h"
#include "vtkVolumeProperty.h"

#include <algorithm>

namespace halite_vtk
{

namespace
{

// For an error.
std::string NameOf(vtkDataArray* array)
{
  return array->GetName() ? "the array \"" + std::string(array->GetName()) + "\"" : "an array without a name";
}

}

Content::Content(const halite::Settings& settings, vtkDataSet* grid, vtkDataArray* array, int cellFlag,
  vtkVolume* volume, halite::OpacityConvention convention, Functions::Cache& functions)
  : Settings(settings)
  , Grid(grid)
  , Array(array)
{
  this->SettingsKey << settings.device << settings.engine << static_cast<std::uint64_t>(settings.threads);
  const halite::Integral& integral = settings.integral;
  this->IntegralKey << integral.form << integral.texels << static_cast<double>(integral.degree)
                    << integral.reconstruction << integral.sampleDistance;
  for (int n : integral.table)
  {
    this->IntegralKey << static_cast<double>(n);
  }
  vtkNew<vtkMatrix4x4> placement;
  vtkHaliteCompatibility::GetMatrix(volume, placement);
  std::copy_n(placement->GetData(), 16, this->Placement.begin());
  this->PlacementKey << this->Placement;
  this->ChooseField(volume, cellFlag);
  this->ChooseInterpolation(volume);
  this->MeshKey << MeshView::Identity(grid) << static_cast<std::uint64_t>(this->IsNearest);
  this->ChooseFunction(volume, convention, functions);
}

void Content::Shade(const Shading& shading)
{
  halite::TransferFunction& f = this->Function;
  f.gradientOpacity = shading.GradientOpacity;
  f.table = shading.Table;
  f.widgets = shading.Widgets;
  f.silhouette = shading.Silhouette;
  f.shade = shading.Shade;
  this->FunctionKey << shading.Key();
  this->Second = shading.Second;
  this->FieldKey << static_cast<std::uint64_t>(this->Second ? this->Second->GetMTime() : 0);
}

Key Content::Whole() const
{
  Key whole;
  whole << this->SettingsKey << this->IntegralKey << this->MeshKey << this->PlacementKey << this->FieldKey
        << this->FunctionKey;
  return whole;
}

void Content::ChooseField(vtkVolume* volume, int cellFlag)
{
  if (!this->Array)
  {
    throw halite::Error("the input has no array to draw: check the scalar mode and SelectScalarArray");
  }
  const vtkIdType tuples = this->Array->GetNumberOfTuples();
  // Field data belongs to what it has as many tuples as.
  const bool ofCells = cellFlag == 1 || (cellFlag == 2 && tuples != this->Grid->GetNumberOfPoints());
  const vtkIdType expected = ofCells ? this->Grid->GetNumberOfCells() : this->Grid->GetNumberOfPoints();
  if (tuples != expected)
  {
    throw halite::Error(NameOf(this->Array) + " has " + std::to_string(tuples) + " tuples for " +
      std::to_string(expected) + (ofCells ? " cells" : " points") + ": it is of another grid, or half filled");
  }
  this->Association = ofCells ? halite::Association::Cells : halite::Association::Points;
  vtkVolumeProperty* property = volume->GetProperty();
  const int n = this->Array->GetNumberOfComponents();
  if (n > 1 && !property->GetIndependentComponents())
  {
    if (n != 2 && n != 4)
    {
      throw halite::Error(NameOf(this->Array) + " has " + std::to_string(n) +
        " dependent components: 2 (colour, opacity) or 4 (RGBA) can be drawn, or one of independent ones");
    }
    this->Component = halite::AllComponents;
  }
  else if (n > 1 && property->GetColorChannels() == 3)
  {
    vtkColorTransferFunction* colors = property->GetRGBTransferFunction(0);
    const bool isMagnitude = colors->GetVectorMode() == vtkScalarsToColors::MAGNITUDE;
    this->Component =
      isMagnitude ? static_cast<int>(halite::Magnitude) : std::min(std::max(colors->GetVectorComponent(), 0), n - 1);
  }
  this->FieldKey << static_cast<std::uint64_t>(this->Array->GetMTime()) << static_cast<std::uint64_t>(ofCells)
                 << static_cast<double>(this->Component);
}

void Content::ChooseInterpolation(vtkVolume* volume)
{
  this->IsGrid = MeshView::IsGrid(this->Grid);
  // VTK's mappers of images know it, those of unstructured grids do not. What is hidden is told by cells, which cells around
  // points are not.
  this->IsNearest = this->IsGrid && this->Association == halite::Association::Points &&
    volume->GetProperty()->GetInterpolationType() == VTK_NEAREST_INTERPOLATION && !MeshView::HasGhosts(this->Grid);
  if (this->IsNearest)
  {
    this->Association = halite::Association::Cells;
  }
  this->FieldKey << static_cast<std::uint64_t>(this->IsNearest);
}

void Content::ChooseFunction(vtkVolume* volume, halite::OpacityConvention convention, Functions::Cache& functions)
{
  vtkVolumeProperty* property = volume->GetProperty();
  const bool isRGBA = this->Component == halite::AllComponents && this->Array->GetNumberOfComponents() == 4;
  const Functions::Knots& knots = functions.KnotsOf(property, isRGBA);
  halite::TransferFunction& f = this->Function;
  f.color = knots.Color;
  f.opacity = knots.Opacity;
  if (isRGBA)
  {
    const double one = this->Array->GetDataType() == VTK_UNSIGNED_CHAR ? 255 : 1;
    const double most = std::max(one, this->Array->GetRange(3)[1]);
    f.opacity = { { 0, 0 }, { most, most / one } };
  }
  f.unitDistance = property->GetScalarOpacityUnitDistance(0);
  f.convention = convention;
  this->FunctionKey << f.unitDistance << static_cast<std::uint64_t>(convention);
  for (const auto& k : f.color)
  {
    this->FunctionKey << k.scalar << k.rgb;
  }
  this->FunctionKey << static_cast<std::uint64_t>(f.color.size());
  for (const auto& k : f.opacity)
  {
    this->FunctionKey << k.scalar << k.opacity;
  }
}

}
