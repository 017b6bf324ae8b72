// SPDX-License-Identifier: MIT OR Apache-2.0
// A program that knows nothing of Halite and gets it through VTK_AUTOLOAD_PATH; how it ends, and what lives on when VTK unloads
// what it has loaded: test_autoload WAY
#include "expect.h"

#include "vtkDoubleArray.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkPointData.h"
#include "vtkPoints.h"
#include "vtkProjectedTetrahedraMapper.h"
#include "vtkRenderWindow.h"
#include "vtkRenderer.h"
#include "vtkSmartPointer.h"
#include "vtkUnsignedCharArray.h"
#include "vtkUnstructuredGrid.h"
#include "vtkVolume.h"

#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>

namespace
{

struct Scene
{
  vtkNew<vtkUnstructuredGrid> Grid;
  vtkNew<vtkVolume> Volume;
  vtkNew<vtkRenderer> Renderer;
  vtkNew<vtkRenderWindow> Window;

  Scene()
  {
    vtkNew<vtkPoints> points;
    vtkNew<vtkDoubleArray> values;
    const double corners[4][3] = { { 0, 0, 0 }, { 1, 0, 0 }, { 0, 1, 0 }, { 0, 0, 1 } };
    for (const auto& p : corners)
    {
      points->InsertNextPoint(p);
      values->InsertNextValue(1000);
    }
    const vtkIdType ids[4] = { 0, 1, 2, 3 };
    this->Grid->SetPoints(points);
    this->Grid->InsertNextCell(VTK_TETRA, 4, ids);
    this->Grid->GetPointData()->SetScalars(values);
    vtkNew<vtkProjectedTetrahedraMapper> mapper;
    EXPECT(std::strcmp(mapper->GetClassName(), "vtkHaliteMapper") == 0);
    mapper->SetInputData(this->Grid);
    this->Volume->SetMapper(mapper);
    this->Renderer->AddVolume(this->Volume);
    this->Window->SetOffScreenRendering(1);
    this->Window->SetSize(40, 40);
    this->Window->AddRenderer(this->Renderer);
  }

  // Whether something is seen.
  bool Draw()
  {
    this->Window->Render();
    vtkNew<vtkUnsignedCharArray> pixels;
    this->Window->GetRGBACharPixelData(0, 0, 39, 39, 0, pixels);
    for (vtkIdType i = 0; i < pixels->GetNumberOfValues(); i += 4)
    {
      if (pixels->GetValue(i) > 20)
      {
        return true;
      }
    }
    return false;
  }
};

// Destroyed after main, before or after VTK has unloaded its factories.
vtkSmartPointer<vtkVolume> LastVolume;

}

int main(int argc, char** argv)
{
  EXPECT(argc == 2);
  const std::string way = argv[1];
  auto scene = std::make_unique<Scene>();
  EXPECT(scene->Draw());
  if (way == "kept")
  {
    LastVolume = scene->Volume;
  }
  else if (way == "leaked")
  {
    scene.release();
  }
  else if (way == "unregistered")
  {
    // The library is closed while its mapper draws on.
    vtkObjectFactory::UnRegisterAllFactories();
    scene->Renderer->ResetCamera();
    scene->Volume->RotateX(10);
    EXPECT(scene->Draw());
    scene.reset();
  }
  else if (way == "exit")
  {
    std::exit(scene->Draw() ? 0 : 1);
  }
  else
  {
    EXPECT(way == "plain");
  }
  return 0;
}
