// SPDX-License-Identifier: MIT OR Apache-2.0
#include "vtkSIHaliteImageVolumeRepresentationProxy.h"

#include "vtkAbstractVolumeMapper.h"
#include "vtkHaliteImageVolumeRepresentation.h"
#include "vtkObjectFactory.h"

vtkStandardNewMacro(vtkSIHaliteImageVolumeRepresentationProxy);

bool vtkSIHaliteImageVolumeRepresentationProxy::CreateVTKObjects()
{
  if (!this->Superclass::CreateVTKObjects())
  {
    return false;
  }
  auto representation = vtkHaliteImageVolumeRepresentation::SafeDownCast(this->GetVTKObject());
  vtkSIProxy* proxy = this->GetSubSIProxy("VolumeHaliteMapper");
  auto mapper = proxy ? vtkAbstractVolumeMapper::SafeDownCast(proxy->GetVTKObject()) : nullptr;
  if (representation && mapper)
  {
    representation->AddVolumeMapper("Halite", mapper);
  }
  return true;
}

void vtkSIHaliteImageVolumeRepresentationProxy::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
}
