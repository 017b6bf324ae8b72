// SPDX-License-Identifier: MIT OR Apache-2.0
/**
 * @class   vtkSIHaliteImageVolumeRepresentationProxy
 * @brief   registers Halite with a representation of volumes of images
 *
 * The subproxy "VolumeHaliteMapper" becomes the mapper "Halite" of a vtkHaliteImageVolumeRepresentation.
 */
#ifndef vtkSIHaliteImageVolumeRepresentationProxy_h
#define vtkSIHaliteImageVolumeRepresentationProxy_h

#include "vtkHaliteParaViewModule.h" // for export macro
#include "vtkSIProxy.h"

class VTKHALITEPARAVIEW_EXPORT vtkSIHaliteImageVolumeRepresentationProxy : public vtkSIProxy
{
public:
  static vtkSIHaliteImageVolumeRepresentationProxy* New();
  vtkTypeMacro(vtkSIHaliteImageVolumeRepresentationProxy, vtkSIProxy);
  void PrintSelf(ostream& os, vtkIndent indent) override;

protected:
  vtkSIHaliteImageVolumeRepresentationProxy() = default;
  ~vtkSIHaliteImageVolumeRepresentationProxy() override = default;

  bool CreateVTKObjects() override;

private:
  vtkSIHaliteImageVolumeRepresentationProxy(const vtkSIHaliteImageVolumeRepresentationProxy&) = delete;
  void operator=(const vtkSIHaliteImageVolumeRepresentationProxy&) = delete;
};

#endif
