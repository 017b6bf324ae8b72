// SPDX-License-Identifier: MIT OR Apache-2.0
#include "vtkHaliteImageVolumeRepresentation.h"

#include "AnyGridVolume.h"
#include "Leaves.h"
#include "vtkHaliteMapper.h"

#include "vtkDataObject.h"
#include "vtkDataSet.h"
#include "vtkInformation.h"
#include "vtkMatrix4x4.h"
#include "vtkObjectFactory.h"
#include "vtkPVRenderView.h"
#include "vtkPiecewiseFunction.h"
#include "vtkPlane.h"
#include "vtkPlaneCollection.h"
#include "vtkPolyDataMapper.h"
#include "vtkVolumeMapper.h"
#include "vtkVolumeProperty.h"

#include <array>
#include <string>
#include <vector>

struct vtkHaliteImageVolumeRepresentation::Internals
{
  vtkNew<AnyGridVolume> Volume;
  vtkSmartPointer<vtkHaliteMapper> Mapper;
  vtkNew<vtkPiecewiseFunction> GradientOpacity;
  bool IsChosen = false;
  bool HasWarned = false;
  // The mapper's own second array while that of the representation takes its place.
  bool IsReplaced = false;
  std::string OwnSecond;
  std::string Replacement;
};

vtkStandardNewMacro(vtkHaliteImageVolumeRepresentation);

vtkHaliteImageVolumeRepresentation::vtkHaliteImageVolumeRepresentation()
  : Inner(new Internals)
{
  this->Actor = this->Inner->Volume;
  this->Actor->SetProperty(this->Property);
  this->Actor->SetLODMapper(this->OutlineMapper);
}

vtkHaliteImageVolumeRepresentation::~vtkHaliteImageVolumeRepresentation() = default;

void vtkHaliteImageVolumeRepresentation::AddVolumeMapper(const char* name, vtkAbstractVolumeMapper* mapper)
{
  if (name && std::string(name) == "Halite")
  {
    this->Inner->Mapper = vtkHaliteMapper::SafeDownCast(mapper);
  }
}

void vtkHaliteImageVolumeRepresentation::SetActiveVolumeMapper(const char* name)
{
  this->Inner->IsChosen = name && std::string(name) == "Halite";
  this->Modified();
}

vtkAbstractVolumeMapper* vtkHaliteImageVolumeRepresentation::GetActiveVolumeMapper()
{
  const int blend = this->VolumeMapper->GetBlendMode();
  const bool isVolume = blend == vtkVolumeMapper::COMPOSITE_BLEND || blend == vtkVolumeMapper::MAXIMUM_INTENSITY_BLEND;
  if (this->Inner->IsChosen && this->Inner->Mapper && isVolume)
  {
    return this->Inner->Mapper;
  }
  return this->VolumeMapper;
}

int vtkHaliteImageVolumeRepresentation::ProcessViewRequest(
  vtkInformationRequestKey* request, vtkInformation* inInfo, vtkInformation* outInfo)
{
  if (request == vtkPVView::REQUEST_RENDER() && this->Inner->Mapper)
  {
    this->Inner->Mapper->SetInteracting(inInfo->Has(vtkPVRenderView::USE_LOD()) != 0);
    this->Inner->Mapper->SetRoundingUp(AnyGridVolume::IsBlendedWithOthers());
  }
  return this->Superclass::ProcessViewRequest(request, inInfo, outInfo);
}

namespace
{

// The core draws each with threads of its own.
constexpr std::size_t MostGrids = 64;

// Planes around a box that a matrix moves, whose inside is in front of each.
vtkSmartPointer<vtkPlaneCollection> Around(const std::array<double, 6>& box, vtkMatrix4x4* matrix)
{
  vtkNew<vtkMatrix4x4> back;
  vtkMatrix4x4::Invert(matrix, back);
  auto planes = vtkSmartPointer<vtkPlaneCollection>::New();
  for (int i = 0; i < 6; ++i)
  {
    const int axis = i / 2;
    const double sign = i % 2 == 0 ? 1 : -1;
    double point[4] = { 0, 0, 0, 1 };
    point[axis] = box[static_cast<std::size_t>(i)];
    matrix->MultiplyPoint(point, point);
    vtkNew<vtkPlane> plane;
    plane->SetOrigin(point[0], point[1], point[2]);
    // Normals are moved by the transpose of the inverse.
    plane->SetNormal(
      sign * back->GetElement(axis, 0), sign * back->GetElement(axis, 1), sign * back->GetElement(axis, 2));
    planes->AddItem(plane);
  }
  return planes;
}

}

bool vtkHaliteImageVolumeRepresentation::Connect(vtkHaliteMapper* halite)
{
  // A client of a server that renders has no input.
  if (!halite || this->VolumeMapper->GetNumberOfInputConnections(0) == 0)
  {
    return false;
  }
  vtkDataObject* delivered = this->VolumeMapper->GetInputDataObject(0, 0);
  const std::vector<vtkSmartPointer<vtkDataSet>> grids = halite_vtk::LeavesOf(delivered);
  if (grids.empty())
  {
    return false;
  }
  if (grids.size() == 1 && grids.front() != delivered)
  {
    halite->SetInputData(grids.front());
    return true;
  }
  const bool isMaximum = this->VolumeMapper->GetBlendMode() == vtkVolumeMapper::MAXIMUM_INTENSITY_BLEND ||
    halite->GetBlendMode() == vtkUnstructuredGridVolumeMapper::MAXIMUM_INTENSITY_BLEND;
  if (grids.size() > MostGrids || (grids.size() > 1 && isMaximum))
  {
    if (!this->Inner->HasWarned)
    {
      vtkWarningMacro("Halite draws up to "
        << MostGrids
        << " images or rectilinear grids together, and a maximum of one: ParaView's own mapper draws these "
        << grids.size());
      this->Inner->HasWarned = true;
    }
    return false;
  }
  halite->SetInputConnection(this->VolumeMapper->GetInputConnection(0, 0));
  return true;
}

void vtkHaliteImageVolumeRepresentation::AddGradientOpacity(double length, double opacity)
{
  this->Inner->GradientOpacity->AddPoint(length, opacity);
  this->Modified();
}

void vtkHaliteImageVolumeRepresentation::RemoveAllGradientOpacities()
{
  this->Inner->GradientOpacity->RemoveAllPoints();
  this->Modified();
}

void vtkHaliteImageVolumeRepresentation::UpdateMapperParameters()
{
  Internals& inner = *this->Inner;
  vtkHaliteMapper* halite = vtkHaliteMapper::SafeDownCast(this->GetActiveVolumeMapper());
  const bool draws = this->Connect(halite);
  inner.Volume->Prefer(draws ? halite : nullptr);
  const bool hasGradientOpacity = draws && inner.GradientOpacity->GetSize() > 0;
  this->Property->SetGradientOpacity(hasGradientOpacity ? inner.GradientOpacity.Get() : nullptr);
  this->Superclass::UpdateMapperParameters();
  if (!draws)
  {
    return;
  }

  std::string array;
  int association = vtkDataObject::FIELD_ASSOCIATION_POINTS;
  vtkInformation* info = this->GetInputArrayInformation(0);
  if (info && info->Has(vtkDataObject::FIELD_NAME()) && info->Has(vtkDataObject::FIELD_ASSOCIATION()))
  {
    array = info->Get(vtkDataObject::FIELD_NAME());
    association = info->Get(vtkDataObject::FIELD_ASSOCIATION());
  }
  halite->SelectScalarArray((this->UseSeparateOpacityArray ? array + "_and_opacity" : array).c_str());
  halite->SetScalarMode(association == vtkDataObject::FIELD_ASSOCIATION_CELLS ? VTK_SCALAR_MODE_USE_CELL_FIELD_DATA
      : association == vtkDataObject::FIELD_ASSOCIATION_NONE                  ? VTK_SCALAR_MODE_USE_FIELD_DATA
                                                                              : VTK_SCALAR_MODE_USE_POINT_FIELD_DATA);

  // The mapper has regions of its own, which are for the user.
  vtkSmartPointer<vtkPlaneCollection> planes;
  if (this->VolumeMapper->GetCropping())
  {
    std::array<double, 6> box;
    for (std::size_t i = 0; i < 6; ++i)
    {
      box[i] = this->CroppingOrigin[i / 2] + this->DataBounds[i] * this->CroppingScale[i / 2];
    }
    vtkNew<vtkMatrix4x4> placement;
    this->Actor->GetMatrix(placement);
    planes = Around(box, placement);
  }
  halite->SetClippingPlanes(planes);

  const std::string held = halite->GetTransfer2DYAxisArray() ? halite->GetTransfer2DYAxisArray() : "";
  if (!inner.IsReplaced || held != inner.Replacement)
  {
    inner.OwnSecond = held;
  }
  inner.IsReplaced = this->UseTransfer2D && !this->UseGradientForTransfer2D;
  inner.Replacement = this->ColorArray2Name;
  const std::string& second = inner.IsReplaced ? inner.Replacement : inner.OwnSecond;
  halite->SetTransfer2DYAxisArray(second.c_str());
}

void vtkHaliteImageVolumeRepresentation::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Mapper: " << (this->Inner->IsChosen ? "Halite" : "ParaView's") << "\n";
}
