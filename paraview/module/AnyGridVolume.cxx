// SPDX-License-Identifier: MIT OR Apache-2.0
#include "AnyGridVolume.h"

#include "vtkHaliteMapper.h"

#include "vtkLODProp3D.h"
#include "vtkMultiProcessController.h"
#include "vtkObjectFactory.h"

vtkStandardNewMacro(AnyGridVolume);

bool AnyGridVolume::IsHalites()
{
  const int selected = this->LODProp->GetSelectedLODID();
  return selected >= 0 && selected == this->HighLODId && vtkHaliteMapper::SafeDownCast(this->GetMapper());
}

int AnyGridVolume::Done(int drawn)
{
  this->EstimatedRenderTime = this->LODProp->GetEstimatedRenderTime();
  return drawn;
}

bool AnyGridVolume::IsBlendedWithOthers()
{
  vtkMultiProcessController* controller = vtkMultiProcessController::GetGlobalController();
  return controller && controller->GetNumberOfProcesses() > 1;
}

void AnyGridVolume::SetMapper(vtkAbstractVolumeMapper* mapper)
{
  this->Superclass::SetMapper(this->Preferred ? this->Preferred.Get() : mapper);
}

int AnyGridVolume::RenderOpaqueGeometry(vtkViewport* viewport)
{
  return this->IsHalites() ? this->Done(this->LODProp->RenderOpaqueGeometry(viewport))
                           : this->Superclass::RenderOpaqueGeometry(viewport);
}

int AnyGridVolume::RenderVolumetricGeometry(vtkViewport* viewport)
{
  return this->IsHalites() ? this->Done(this->LODProp->RenderVolumetricGeometry(viewport))
                           : this->Superclass::RenderVolumetricGeometry(viewport);
}

int AnyGridVolume::RenderTranslucentPolygonalGeometry(vtkViewport* viewport)
{
  return this->IsHalites() ? this->Done(this->LODProp->RenderTranslucentPolygonalGeometry(viewport))
                           : this->Superclass::RenderTranslucentPolygonalGeometry(viewport);
}
