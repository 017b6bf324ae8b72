// SPDX-License-Identifier: MIT OR Apache-2.0
/**
 * @class   vtkSIHaliteVolumeRepresentationProxy
 * @brief   registers Halite with a representation of volumes
 *
 * As ParaView's own class does its mappers: the subproxy "VolumeHaliteMapper" becomes the mapper "Halite".
 */
#ifndef vtkSIHaliteVolumeRepresentationProxy_h
#define vtkSIHaliteVolumeRepresentationProxy_h

#include "vtkHaliteParaViewModule.h" // for export macro
#include "vtkSIUnstructuredGridVolumeRepresentationProxy.h"

class VTKHALITEPARAVIEW_EXPORT vtkSIHaliteVolumeRepresentationProxy
  : public vtkSIUnstructuredGridVolumeRepresentationProxy
{
public:
  static vtkSIHaliteVolumeRepresentationProxy* New();
  vtkTypeMacro(vtkSIHaliteVolumeRepresentationProxy, vtkSIUnstructuredGridVolumeRepresentationProxy);
  void PrintSelf(ostream& os, vtkIndent indent) override;

protected:
  vtkSIHaliteVolumeRepresentationProxy() = default;
  ~vtkSIHaliteVolumeRepresentationProxy() override = default;

  bool CreateVTKObjects() override;

private:
  vtkSIHaliteVolumeRepresentationProxy(const vtkSIHaliteVolumeRepresentationProxy&) = delete;
  void operator=(const vtkSIHaliteVolumeRepresentationProxy&) = delete;
};

#endif
