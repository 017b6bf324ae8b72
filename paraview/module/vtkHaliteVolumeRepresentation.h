// SPDX-License-Identifier: MIT OR Apache-2.0
/**
 * @class   vtkHaliteVolumeRepresentation
 * @brief   volumes of unstructured and structured grids, with Halite among the mappers
 *
 * ParaView's representation, which cuts its input into tetrahedra. Where vtkHaliteMapper is the active mapper the grid goes through
 * as it is: cells of any type stay whole, blocks become one grid, ghost cells are left out.
 *
 * @sa
 * vtkHaliteMapper
 */
#ifndef vtkHaliteVolumeRepresentation_h
#define vtkHaliteVolumeRepresentation_h

#include "vtkHaliteParaViewModule.h" // for export macro
#include "vtkUnstructuredGridVolumeRepresentation.h"

#include <memory> // for std::unique_ptr

class vtkHaliteMapper;

class VTKHALITEPARAVIEW_EXPORT vtkHaliteVolumeRepresentation : public vtkUnstructuredGridVolumeRepresentation
{
public:
  static vtkHaliteVolumeRepresentation* New();
  vtkTypeMacro(vtkHaliteVolumeRepresentation, vtkUnstructuredGridVolumeRepresentation);
  void PrintSelf(ostream& os, vtkIndent indent) override;

  int ProcessViewRequest(vtkInformationRequestKey* request, vtkInformation* inInfo, vtkInformation* outInfo) override;

  ///@{
  /**
   * Which blocks of composite data are drawn, as in the superclass.
   */
  void SetActiveAssembly(const char* name);
  void AddBlockSelector(const char* selector);
  void RemoveAllBlockSelectors();
  ///@}

  ///@{
  /**
   * Light, by the lights of the view, as vtkVolumeProperty has it; off at first. ParaView's other mappers of unstructured grids have none.
   */
  void SetShade(bool shade);
  void SetAmbient(double ambient);
  void SetDiffuse(double diffuse);
  void SetSpecular(double specular);
  void SetSpecularPower(double power);
  ///@}

  ///@{
  /**
   * Adds a point to the opacity by the length of the gradient, which multiplies that by the value; without points there is none. As
   * light, it is of Halite alone.
   */
  void AddGradientOpacity(double length, double opacity);
  void RemoveAllGradientOpacities();
  ///@}

protected:
  vtkHaliteVolumeRepresentation();
  ~vtkHaliteVolumeRepresentation() override;

  int FillInputPortInformation(int port, vtkInformation* information) override;
  int RequestData(vtkInformation* request, vtkInformationVector** inputs, vtkInformationVector* outputs) override;

private:
  vtkHaliteVolumeRepresentation(const vtkHaliteVolumeRepresentation&) = delete;
  void operator=(const vtkHaliteVolumeRepresentation&) = delete;

  // Null where another mapper is active.
  vtkHaliteMapper* GetHalite();

  struct Internals;
  std::unique_ptr<Internals> Inner;
};

#endif
