// SPDX-License-Identifier: MIT OR Apache-2.0
#include "FrameGuard.h"

#include "vtkAbstractVolumeMapper.h"
#include "vtkCollection.h"
#include "vtkOpenGLRenderWindow.h"
#include "vtkOpenGLShaderCache.h"
#include "vtkOpenGLState.h"
#include "vtkPropCollection.h"
#include "vtkRenderer.h"
#include "vtkRendererCollection.h"
#include "vtkVolume.h"
#include "vtkWindow.h"

#include <limits>
#include <map>
#include <mutex>

namespace halite_vtk
{

namespace
{

// The guards of windows that are drawing now. Never destroyed: windows may outlive what is static here.
struct Registry
{
  std::mutex Mutex;
  std::map<vtkWindow*, FrameGuard*> Guards;
};
Registry& Windows()
{
  static Registry* const all = new Registry;
  return *all;
}

// The priority of an observer that comes after all others.
const float Last = std::numeric_limits<float>::lowest();

// Programs that make contexts by themselves know best.
bool IsCurrent(vtkOpenGLRenderWindow* window)
{
  return window->IsA("vtkGenericOpenGLRenderWindow") || window->IsCurrent();
}

struct ContextKeeper : vtkCommand
{
  static ContextKeeper* New() { return new ContextKeeper; }

  void Execute(vtkObject* caller, unsigned long, void*) override
  {
    vtkOpenGLRenderWindow* window = vtkOpenGLRenderWindow::SafeDownCast(caller);
    if (window && window->CheckInRenderStatus() && !IsCurrent(window))
    {
      window->MakeCurrent();
    }
  }
};

}

FrameGuard::FrameGuard(vtkWindow* window)
  : Window(window)
{
}

FrameGuard::~FrameGuard()
{
  Registry& all = Windows();
  const std::lock_guard<std::mutex> lock(all.Mutex);
  const auto found = all.Guards.find(this->Window);
  if (found != all.Guards.end() && found->second == this)
  {
    all.Guards.erase(found);
  }
}

FrameGuard& FrameGuard::Of(vtkWindow* window)
{
  Registry& all = Windows();
  const std::lock_guard<std::mutex> lock(all.Mutex);
  FrameGuard*& guard = all.Guards[window];
  if (!guard)
  {
    guard = new FrameGuard(window);
    guard->Observer = window->AddObserver(vtkCommand::EndEvent, guard);
    // The window has it from now on, and lets it go if it goes itself.
    guard->UnRegister();
  }
  return *guard;
}

void FrameGuard::Keep(
  vtkOpenGLRenderWindow* window, vtkRenderer* renderer, vtkVolume* volume, vtkAbstractVolumeMapper* mapper)
{
  FrameGuard& guard = Of(window);
  guard.State = guard.State ? guard.State.Get() : window->GetState();
  auto& objects = guard.Objects;
  objects.insert({ renderer, volume, mapper });
  vtkPropCollection* props = renderer->GetViewProps();
  vtkCollectionSimpleIterator at;
  for (props->InitTraversal(at); vtkObject* prop = props->GetNextProp(at);)
  {
    objects.insert(prop);
  }
}

void FrameGuard::GiveBack(vtkWindow* window, vtkVolume* volume, vtkAbstractVolumeMapper* mapper)
{
  if (!volume->GetMapper())
  {
    volume->SetMapper(mapper);
    Of(window).Bare.insert(volume);
  }
}

void FrameGuard::GiveBack(vtkRenderWindow* window, vtkRenderer* renderer)
{
  if (renderer->GetRenderWindow() != window)
  {
    FrameGuard& guard = Of(window);
    guard.Objects.insert(renderer);
    guard.Moved[renderer] = renderer->GetRenderWindow();
    renderer->SetRenderWindow(window);
  }
}

void FrameGuard::KeepContext(vtkOpenGLRenderWindow* window)
{
  // Never destroyed, as windows may outlive what is static here.
  static ContextKeeper* const keeper = ContextKeeper::New();
  if (!window->HasObserver(vtkCommand::AbortCheckEvent, keeper))
  {
    window->AddObserver(vtkCommand::AbortCheckEvent, keeper, Last);
  }
  // In this frame it may be too late: what VTK keeps of surfaces is in another context then, and goes when the frame is over.
  if (window->CheckInRenderStatus() && !IsCurrent(window))
  {
    Of(window).IsAstray = true;
  }
}

void FrameGuard::Execute(vtkObject* caller, unsigned long, void*)
{
  {
    Registry& all = Windows();
    const std::lock_guard<std::mutex> lock(all.Mutex);
    all.Guards.erase(this->Window);
  }
  std::set<vtkSmartPointer<vtkObject>> objects;
  objects.swap(this->Objects);
  for (vtkVolume* volume : this->Bare)
  {
    vtkAbstractVolumeMapper* mapper = volume->GetMapper();
    if (mapper && objects.count(mapper))
    {
      volume->SetMapper(nullptr);
    }
  }
  vtkOpenGLRenderWindow* window = vtkOpenGLRenderWindow::SafeDownCast(caller);
  // VTK has gone on with what it knew of another context.
  if (this->State && window->GetState() != this->State && IsCurrent(window))
  {
    window->GetState()->Reset();
  }
  if (this->IsAstray)
  {
    window->GetShaderCache()->ReleaseGraphicsResources(window);
    vtkRendererCollection* renderers = window->GetRenderers();
    vtkCollectionSimpleIterator at;
    for (renderers->InitTraversal(at); vtkRenderer* renderer = renderers->GetNextRenderer(at);)
    {
      renderer->ReleaseGraphicsResources(window);
    }
  }
  for (const auto& moved : this->Moved)
  {
    if (moved.first->GetRenderWindow() == window && !window->HasRenderer(moved.first))
    {
      moved.first->SetRenderWindow(moved.second);
    }
  }
  caller->RemoveObserver(this->Observer);
}

}
