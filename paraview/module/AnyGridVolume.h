// SPDX-License-Identifier: MIT OR Apache-2.0
/**
 * ParaView's volume, for Halite with any kind of grid: ParaView's own draws nothing where a mapper of unstructured grids has an image.
 */
#ifndef AnyGridVolume_h
#define AnyGridVolume_h

#include "vtkAbstractVolumeMapper.h"
#include "vtkPVLODVolume.h"
#include "vtkSmartPointer.h"

class AnyGridVolume : public vtkPVLODVolume
{
public:
  static AnyGridVolume* New();
  vtkTypeMacro(AnyGridVolume, vtkPVLODVolume);

  /**
   * Whether the pictures of several processes are blended, as bytes.
   */
  static bool IsBlendedWithOthers();

  /**
   * This mapper takes the place of whichever is set, from the next SetMapper() on, until null takes its place. A change of mappers makes
   * a new volume, for which all would be drawn anew.
   */
  void Prefer(vtkAbstractVolumeMapper* mapper) { this->Preferred = mapper; }

  void SetMapper(vtkAbstractVolumeMapper* mapper) override;
  int RenderOpaqueGeometry(vtkViewport* viewport) override;
  int RenderVolumetricGeometry(vtkViewport* viewport) override;
  int RenderTranslucentPolygonalGeometry(vtkViewport* viewport) override;

private:
  // Whether Halite draws, which says itself what it cannot draw.
  bool IsHalites();
  // What a part of rendering returned; the time that it will take is that of what draws.
  int Done(int drawn);

  vtkSmartPointer<vtkAbstractVolumeMapper> Preferred;
};

#endif
// VTK-HeaderTest-Exclude: AnyGridVolume.h
