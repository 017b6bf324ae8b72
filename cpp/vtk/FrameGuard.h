// SPDX-License-Identifier: MIT OR Apache-2.0
// What a frame is made of, kept while VTK draws it.
#pragma once

#include "vtkHaliteCompatibility.h"

#include "vtkCommand.h"
#include "vtkSmartPointer.h"

#include <set>

VTK_ABI_NAMESPACE_BEGIN
class vtkAbstractVolumeMapper;
class vtkRenderer;
class vtkVolume;
class vtkWindow;
VTK_ABI_NAMESPACE_END

// Observers may take away, in the middle of a frame, what VTK is drawing: volumes, mappers, renderers. VTK goes on with what
// it began, and keeps nothing of it alive. This does, until the window has finished the frame.
class FrameGuard : public vtkCommand
{
public:
  // Keeps a volume and its mapper, the renderer and all that is in it.
  static void Keep(vtkWindow* window, vtkRenderer* renderer, vtkVolume* volume, vtkAbstractVolumeMapper* mapper);

  // VTK asks a volume's mapper for its time when that has drawn, be there one or not: a volume that has lost its mapper has
  // it back until the frame is over.
  static void GiveBack(vtkWindow* window, vtkVolume* volume, vtkAbstractVolumeMapper* mapper);

  void Execute(vtkObject* window, unsigned long event, void* data) override;

private:
  explicit FrameGuard(vtkWindow* window);
  ~FrameGuard() override;
  static FrameGuard& Of(vtkWindow* window);

  vtkWindow* const Window;
  unsigned long Observer = 0;
  std::set<vtkSmartPointer<vtkObject>> Objects;
  std::set<vtkVolume*> Bare;
};
