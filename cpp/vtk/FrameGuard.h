// SPDX-License-Identifier: MIT OR Apache-2.0
// What a frame is made of, kept while VTK draws it.
#pragma once

#include "vtkHaliteCompatibility.h"

#include "vtkCommand.h"
#include "vtkSmartPointer.h"
#include "vtkWeakPointer.h"

#include <map>
#include <set>

VTK_ABI_NAMESPACE_BEGIN
class vtkAbstractVolumeMapper;
class vtkOpenGLRenderWindow;
class vtkOpenGLState;
class vtkRenderWindow;
class vtkRenderer;
class vtkVolume;
class vtkWindow;
VTK_ABI_NAMESPACE_END

namespace halite_vtk
{

// Observers may take away, in the middle of a frame, what VTK is drawing: volumes, mappers, renderers. VTK goes on with what
// it began, and keeps nothing of it alive. This does, until the window has finished the frame.
class FrameGuard : public vtkCommand
{
public:
  // Keeps a volume and its mapper, the renderer and all that is in it, and what VTK knows of the window's OpenGL state: a
  // window that is finalized makes another one, while VTK goes on with the one that it had.
  static void Keep(
    vtkOpenGLRenderWindow* window, vtkRenderer* renderer, vtkVolume* volume, vtkAbstractVolumeMapper* mapper);

  // VTK asks a volume's mapper for its time when that has drawn, be there one or not: a volume that has lost its mapper has
  // it back until the frame is over.
  static void GiveBack(vtkWindow* window, vtkVolume* volume, vtkAbstractVolumeMapper* mapper);

  // VTK asks a renderer for its window until that has finished: a renderer that was taken out of the window, or put into
  // another, has it back until the frame is over.
  static void GiveBack(vtkRenderWindow* window, vtkRenderer* renderer);

  void Execute(vtkObject* window, unsigned long event, void* data) override;

  // VTK's mappers of surfaces ask for aborts, too, and go on in whatever context observers leave behind: from now on that
  // of the window, whenever it has asked.
  static void KeepContext(vtkOpenGLRenderWindow* window);

private:
  explicit FrameGuard(vtkWindow* window);
  ~FrameGuard() override;
  static FrameGuard& Of(vtkWindow* window);

  vtkWindow* const Window;
  unsigned long Observer = 0;
  std::set<vtkSmartPointer<vtkObject>> Objects;
  vtkSmartPointer<vtkOpenGLState> State;
  std::set<vtkVolume*> Bare;
  // Whether something was drawn in the context of another window.
  bool IsAstray = false;
  // Renderers that are in this window for the frame alone, and where observers put them.
  std::map<vtkRenderer*, vtkWeakPointer<vtkRenderWindow>> Moved;
};

}
