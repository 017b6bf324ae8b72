// SPDX-License-Identifier: MIT OR Apache-2.0
#include "vtkSIHaliteVolumeRepresentationProxy.h"

#include "vtkAbstractVolumeMapper.h"
#include "vtkObjectFactory.h"
#include "vtkUnstructuredGridVolumeRepresentation.h"

vtkStandardNewMacro(vtkSIHaliteVolumeRepresentationProxy);

bool vtkSIHaliteVolumeRepresentationProxy::CreateVTKObjects()
{
  if (!this->Superclass::CreateVTKObjects())
  {
    return false;
  }
  auto representation = vtkUnstructuredGridVolumeRepresentation::SafeDownCast(this->GetVTKObject());
  vtkSIProxy* proxy = this->GetSubSIProxy("VolumeHaliteMapper");
  auto mapper = proxy ? vtkAbstractVolumeMapper::SafeDownCast(proxy->GetVTKObject()) : nullptr;
  if (representation && mapper)
  {
    representation->AddVolumeMapper("Halite", mapper);
  }
  return true;
}

void vtkSIHaliteVolumeRepresentationProxy::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
}
