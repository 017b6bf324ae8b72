// SPDX-License-Identifier: MIT OR Apache-2.0
// A program that asks for VTK's mapper and, linked with the module, gets Halite's. One cube with a tent of opacity, of
// which VTK's own draws nothing.
#include "expect.h"

#include "vtkCamera.h"
#include "vtkColorTransferFunction.h"
#include "vtkDoubleArray.h"
#include "vtkHaliteMapper.h"
#include "vtkNew.h"
#include "vtkPiecewiseFunction.h"
#include "vtkPointData.h"
#include "vtkProjectedTetrahedraMapper.h"
#include "vtkRenderWindow.h"
#include "vtkRenderer.h"
#include "vtkUnsignedCharArray.h"
#include "vtkUnstructuredGrid.h"
#include "vtkVolume.h"
#include "vtkVolumeProperty.h"

#include <cstring>

namespace
{

int middle(vtkRenderWindow* window)
{
  window->Render();
  vtkNew<vtkUnsignedCharArray> pixels;
  window->GetRGBACharPixelData(0, 0, 39, 39, 0, pixels);
  return pixels->GetValue(4 * (20 * 40 + 20));
}

}

int main()
{
  vtkNew<vtkUnstructuredGrid> grid;
  vtkNew<vtkPoints> points;
  vtkNew<vtkDoubleArray> values;
  const vtkIdType ids[] = { 0, 1, 2, 3, 4, 5, 6, 7 };
  for (int i = 0; i < 8; ++i)
  {
    points->InsertNextPoint(i & 1, i >> 1 & 1, i >> 2);
    values->InsertNextValue(i >> 2);
  }
  grid->SetPoints(points);
  grid->InsertNextCell(VTK_VOXEL, 8, ids);
  grid->GetPointData()->SetScalars(values);

  vtkNew<vtkColorTransferFunction> white;
  white->AddRGBPoint(0, 1, 1, 1);
  vtkNew<vtkPiecewiseFunction> tent;
  tent->AddPoint(0, 0);
  tent->AddPoint(0.5, 2);
  tent->AddPoint(1, 0);
  vtkNew<vtkVolumeProperty> property;
  property->SetColor(white);
  property->SetScalarOpacity(tent);

  vtkNew<vtkRenderWindow> window;
  vtkNew<vtkRenderer> renderer;
  window->SetSize(40, 40);
  window->AddRenderer(renderer);
  auto draw = [&](vtkUnstructuredGridVolumeMapper* mapper) {
    vtkNew<vtkVolume> volume;
    mapper->SetInputData(grid);
    volume->SetMapper(mapper);
    volume->SetProperty(property);
    renderer->RemoveAllViewProps();
    renderer->AddVolume(volume);
    renderer->GetActiveCamera()->SetPosition(0.5, 0.5, 4);
    renderer->GetActiveCamera()->SetFocalPoint(0.5, 0.5, 0.5);
    renderer->ResetCameraClippingRange();
    return middle(window);
  };

  // By linking.
  EXPECT(vtkHaliteMapper::GetOverride());
  vtkNew<vtkProjectedTetrahedraMapper> mapper;
  EXPECT(std::strcmp(mapper->GetClassName(), "vtkHaliteMapper") == 0);
  EXPECT(draw(mapper) == 161);
  // By name.
  vtkNew<vtkHaliteMapper> byName;
  EXPECT(draw(byName) == 161);
  EXPECT(byName->GetNumberOfTetrahedra() == 6 && byName->GetNumberOfFrames() == 1);
  // Not at all.
  vtkHaliteMapper::SetOverride(false);
  vtkNew<vtkProjectedTetrahedraMapper> theirs;
  EXPECT(std::strcmp(theirs->GetClassName(), "vtkOpenGLProjectedTetrahedraMapper") == 0);
  vtkHaliteMapper::SetOverride(true);
  return 0;
}
