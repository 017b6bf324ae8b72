// SPDX-License-Identifier: MIT OR Apache-2.0
#include "FrameGuard.h"

#include "vtkAbstractVolumeMapper.h"
#include "vtkCollection.h"
#include "vtkPropCollection.h"
#include "vtkRenderer.h"
#include "vtkVolume.h"
#include "vtkWindow.h"

#include <map>
#include <mutex>

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
  vtkWindow* window, vtkRenderer* renderer, vtkVolume* volume, vtkAbstractVolumeMapper* mapper)
{
  auto& objects = Of(window).Objects;
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

void FrameGuard::Execute(vtkObject* window, unsigned long, void*)
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
  window->RemoveObserver(this->Observer);
}
