// SPDX-License-Identifier: MIT OR Apache-2.0
#include "vtkHaliteVolumeRepresentation.h"

#include "AnyGridVolume.h"
#include "OneGrid.h"
#include "SteadyGrid.h"
#include "vtkHaliteMapper.h"

#include "vtkAlgorithmOutput.h"
#include "vtkInformation.h"
#include "vtkInformationVector.h"
#include "vtkMath.h"
#include "vtkMatrix4x4.h"
#include "vtkObjectFactory.h"
#include "vtkPVGeometryFilter.h"
#include "vtkPVRenderView.h"
#include "vtkPiecewiseFunction.h"
#include "vtkPolyDataMapper.h"
#include "vtkUnstructuredGrid.h"
#include "vtkVolumeProperty.h"

struct vtkHaliteVolumeRepresentation::Internals
{
  OneGrid Input;
  SteadyGrid Drawn;
  vtkNew<vtkPiecewiseFunction> GradientOpacity;
  vtkSmartPointer<vtkUnstructuredGrid> Grid = vtkSmartPointer<vtkUnstructuredGrid>::New();
};

vtkStandardNewMacro(vtkHaliteVolumeRepresentation);

vtkHaliteVolumeRepresentation::vtkHaliteVolumeRepresentation()
  : Inner(new Internals)
{
  this->Actor = vtkSmartPointer<AnyGridVolume>::New();
  this->Actor->SetProperty(this->Property);
  this->Actor->SetLODMapper(this->LODMapper);
}

vtkHaliteVolumeRepresentation::~vtkHaliteVolumeRepresentation() = default;

vtkHaliteMapper* vtkHaliteVolumeRepresentation::GetHalite()
{
  return vtkHaliteMapper::SafeDownCast(this->GetActiveVolumeMapper());
}

void vtkHaliteVolumeRepresentation::SetActiveAssembly(const char* name)
{
  this->Inner->Input.SetAssembly(name);
  this->Superclass::SetActiveAssembly(name);
}

void vtkHaliteVolumeRepresentation::AddBlockSelector(const char* selector)
{
  this->Inner->Input.AddSelector(selector);
  this->Superclass::AddBlockSelector(selector);
}

void vtkHaliteVolumeRepresentation::RemoveAllBlockSelectors()
{
  this->Inner->Input.ClearSelectors();
  this->Superclass::RemoveAllBlockSelectors();
}

void vtkHaliteVolumeRepresentation::SetShade(bool shade)
{
  this->Property->SetShade(shade);
}

void vtkHaliteVolumeRepresentation::SetAmbient(double ambient)
{
  this->Property->SetAmbient(ambient);
}

void vtkHaliteVolumeRepresentation::SetDiffuse(double diffuse)
{
  this->Property->SetDiffuse(diffuse);
}

void vtkHaliteVolumeRepresentation::SetSpecular(double specular)
{
  this->Property->SetSpecular(specular);
}

void vtkHaliteVolumeRepresentation::SetSpecularPower(double power)
{
  this->Property->SetSpecularPower(power);
}

void vtkHaliteVolumeRepresentation::AddGradientOpacity(double length, double opacity)
{
  this->Inner->GradientOpacity->AddPoint(length, opacity);
  this->Property->SetGradientOpacity(this->Inner->GradientOpacity);
}

void vtkHaliteVolumeRepresentation::RemoveAllGradientOpacities()
{
  this->Inner->GradientOpacity->RemoveAllPoints();
  this->Property->SetGradientOpacity(static_cast<vtkPiecewiseFunction*>(nullptr));
}

int vtkHaliteVolumeRepresentation::FillInputPortInformation(int port, vtkInformation* information)
{
  if (!this->Superclass::FillInputPortInformation(port, information))
  {
    return 0;
  }
  information->Append(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), "vtkStructuredGrid");
  return 1;
}

int vtkHaliteVolumeRepresentation::RequestData(
  vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs)
{
  if (!this->GetHalite())
  {
    return this->Superclass::RequestData(request, inputs, outputs);
  }
  vtkMath::UninitializeBounds(this->DataBounds);
  // A client of a server that renders has no input.
  vtkDataObject* input =
    inputs[0]->GetNumberOfInformationObjects() == 1 ? vtkDataObject::GetData(inputs[0], 0) : nullptr;
  this->Inner->Grid = this->Inner->Input.Of(input);
  if (input)
  {
    this->Inner->Grid->GetBounds(this->DataBounds);
    if (this->UseSeparateOpacityArray)
    {
      this->AppendOpacityComponent(this->Inner->Grid);
    }
  }
  // The superclass's would cut into tetrahedra.
  return this->vtkVolumeRepresentation::RequestData(request, inputs, outputs);
}

int vtkHaliteVolumeRepresentation::ProcessViewRequest(
  vtkInformationRequestKey* request, vtkInformation* inInfo, vtkInformation* outInfo)
{
  vtkHaliteMapper* mapper = this->GetHalite();
  if (!mapper)
  {
    return this->Superclass::ProcessViewRequest(request, inInfo, outInfo);
  }
  if (!this->vtkVolumeRepresentation::ProcessViewRequest(request, inInfo, outInfo))
  {
    return 0;
  }
  if (request == vtkPVView::REQUEST_UPDATE())
  {
    outInfo->Set(vtkPVRenderView::NEED_ORDERED_COMPOSITING(), 1);
    vtkPVRenderView::SetPiece(inInfo, this, this->Inner->Grid);
    const int configuration = this->UseDataPartitions
      ? vtkPVRenderView::USE_BOUNDS_FOR_REDISTRIBUTION
      : vtkPVRenderView::DATA_IS_REDISTRIBUTABLE | vtkPVRenderView::USE_DATA_FOR_LOAD_BALANCING;
    vtkPVRenderView::SetOrderedCompositingConfiguration(inInfo, this, configuration);
    vtkPVRenderView::SetRedistributionModeToUniquelyAssignBoundaryCells(inInfo, this);
    vtkPVRenderView::SetRequiresDistributedRendering(inInfo, this, true);
    vtkNew<vtkMatrix4x4> placement;
    this->Actor->GetMatrix(placement);
    // Unlike in the superclass the volume keeps its mapper, and with that the picture, until data come that make another one.
    vtkPVRenderView::SetGeometryBounds(inInfo, this, this->DataBounds, placement);
  }
  else if (request == vtkPVView::REQUEST_UPDATE_LOD())
  {
    if (mapper->GetInteractiveImageSampleDistance() > 0)
    {
      // Halite itself draws, with fewer pixels, where the cells are.
      vtkPVRenderView::SetRequiresDistributedRenderingLOD(inInfo, this, true);
    }
    this->LODGeometryFilter->SetInputData(vtkPVView::GetPiece(inInfo, this));
    this->LODGeometryFilter->SetUseOutline(inInfo->Has(vtkPVRenderView::USE_OUTLINE_FOR_LOD()) ? 1 : 0);
    this->LODGeometryFilter->Update();
    vtkPVRenderView::SetPieceLOD(inInfo, this, this->LODGeometryFilter->GetOutputDataObject(0));
  }
  else if (request == vtkPVView::REQUEST_RENDER())
  {
    this->UpdateMapperParameters();
    const bool isInteracting = inInfo->Has(vtkPVRenderView::USE_LOD());
    mapper->SetInteracting(isInteracting);
    mapper->SetRoundingUp(AnyGridVolume::IsBlendedWithOthers());
    this->Actor->SetEnableLOD(isInteracting && mapper->GetInteractiveImageSampleDistance() <= 0 ? 1 : 0);
    vtkAlgorithmOutput* producer = vtkPVRenderView::GetPieceProducer(inInfo, this);
    vtkDataSet* delivered =
      producer ? vtkDataSet::SafeDownCast(producer->GetProducer()->GetOutputDataObject(0)) : nullptr;
    if (delivered)
    {
      mapper->SetInputData(this->Inner->Drawn.Of(delivered));
    }
    else
    {
      this->Actor->SetMapper(nullptr);
    }
    this->LODMapper->SetInputConnection(vtkPVRenderView::GetPieceProducerLOD(inInfo, this));
  }
  return 1;
}

void vtkHaliteVolumeRepresentation::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Grid:\n";
  this->Inner->Grid->PrintSelf(os, indent.GetNextIndent());
}
