// SPDX-License-Identifier: MIT OR Apache-2.0
/**
 * @class   vtkHaliteImageVolumeRepresentation
 * @brief   volumes of image data and rectilinear grids, with Halite among the mappers
 *
 * ParaView's representation, which has one mapper of its own. Where Halite is chosen vtkHaliteMapper draws the grid as it is, with the same
 * array, functions, light and cropping; several partitions are drawn one after another. Isosurfaces and slices, which are blend modes
 * here, maxima of several partitions, and more than 64 of these stay with ParaView's mapper.
 *
 * @sa
 * vtkHaliteMapper vtkHaliteVolumeRepresentation
 */
#ifndef vtkHaliteImageVolumeRepresentation_h
#define vtkHaliteImageVolumeRepresentation_h

#include "vtkHaliteParaViewModule.h" // for export macro
#include "vtkImageVolumeRepresentation.h"

#include <memory> // for std::unique_ptr

class vtkAbstractVolumeMapper;
class vtkHaliteMapper;

class VTKHALITEPARAVIEW_EXPORT vtkHaliteImageVolumeRepresentation : public vtkImageVolumeRepresentation
{
public:
  static vtkHaliteImageVolumeRepresentation* New();
  vtkTypeMacro(vtkHaliteImageVolumeRepresentation, vtkImageVolumeRepresentation);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  int ProcessViewRequest(vtkInformationRequestKey* request, vtkInformation* inInfo, vtkInformation* outInfo) override;

  /**
   * Registers a mapper under a name; "Halite" is that of a vtkHaliteMapper, and other names are ignored.
   */
  void AddVolumeMapper(const char* name, vtkAbstractVolumeMapper* mapper);

  /**
   * "Halite", or anything else for ParaView's own mapper.
   */
  void SetActiveVolumeMapper(const char* name);

  /**
   * The mapper that draws, of those two.
   */
  vtkAbstractVolumeMapper* GetActiveVolumeMapper();

  ///@{
  /**
   * Adds a point to the opacity by the length of the gradient, which multiplies that by the value; without points there is none.
   */
  void AddGradientOpacity(double length, double opacity);
  void RemoveAllGradientOpacities();
  ///@}

protected:
  vtkHaliteImageVolumeRepresentation();
  ~vtkHaliteImageVolumeRepresentation() override;

  void UpdateMapperParameters() override;

private:
  vtkHaliteImageVolumeRepresentation(const vtkHaliteImageVolumeRepresentation&) = delete;
  void operator=(const vtkHaliteImageVolumeRepresentation&) = delete;

  // Gives the mapper what was delivered; false if it cannot draw that.
  bool Connect(vtkHaliteMapper* halite);

  struct Internals;
  std::unique_ptr<Internals> Inner;
};

#endif
