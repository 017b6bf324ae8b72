// SPDX-License-Identifier: MIT OR Apache-2.0
// What the mapper keeps between frames, and the steps of one.
#pragma once

#include "Blocks.h"
#include "Content.h"
#include "Cores.h"
#include "Key.h"
#include "Layers.h"
#include "Presenter.h"
#include "SceneView.h"
#include "vtkHaliteCompatibility.h"
#include "vtkHaliteMapper.h"

#include "vtkSmartPointer.h"
#include "vtkTextureObject.h"
#include "vtkWeakPointer.h"

#include <chrono>
#include <list>
#include <set>
#include <string>
#include <vector>

VTK_ABI_NAMESPACE_BEGIN

class vtkOpenGLRenderPass;
class vtkOpenGLRenderWindow;
class vtkRenderer;
class vtkVolume;
class vtkVolumeProperty;
class vtkWindow;

struct vtkHaliteMapper::Internals
{
  // Adds its own life to a time, in seconds.
  class Clock
  {
  public:
    explicit Clock(double& seconds)
      : Seconds(seconds)
      , Start(std::chrono::steady_clock::now())
    {
    }
    ~Clock() { this->Seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - this->Start).count(); }

  private:
    double& Seconds;
    std::chrono::steady_clock::time_point Start;
  };

  // What was drawn for a renderer, a volume and an eye: a picture, or those of rays up to translucent surfaces.
  struct Frame
  {
    vtkWeakPointer<vtkRenderer> Renderer;
    vtkWeakPointer<vtkVolume> Volume;
    int Eye = 0;
    halite_vtk::Key Pictured;
    std::vector<float> Depths;
    vtkSmartPointer<vtkTextureObject> Texture;
    halite_vtk::Layers Layers;
    // Before the first of these surfaces, and not drawn yet.
    std::vector<float> Kept;
  };

  // What is to be drawn once a renderer has finished.
  struct DeferredDraw
  {
    vtkWeakPointer<vtkRenderer> Renderer;
    vtkWeakPointer<vtkVolume> Volume;
    unsigned long Observer = 0;
  };

  static std::string Text(const char* s) { return s ? s : ""; }

  vtkHaliteMapper& Self;
  halite_vtk::Cores Cores;
  halite_vtk::Functions::Cache Knots;
  std::list<Frame> Frames;
  std::list<halite_vtk::Presenter> Presenters;
  // What of the content failed since something was drawn, and what for: nothing of that is tried, and nothing is said, twice.
  halite_vtk::Key Failed;
  std::set<std::string> Errors;
  std::set<std::string> Warned;
  std::vector<float> Pixels;
  std::string Adapter;
  std::list<DeferredDraw> DeferredDraws;
  bool DrawsDeferred = false;
  // A frame that is at work, in which observers may do anything: whether what it draws to was released since it began, and
  // what was released, which goes when it is over.
  bool IsAtWork = false;
  vtkOpenGLRenderWindow* Target = nullptr;
  vtkRenderer* TargetRenderer = nullptr;
  vtkOpenGLRenderPass* TargetPass = nullptr;
  bool IsReleased = false;
  std::list<Frame> OldFrames;
  std::list<halite_vtk::Presenter> OldPresenters;

  // Makes a frame the one that is at work; ends with it.
  class Turn
  {
  public:
    Turn(Internals& self, vtkOpenGLRenderWindow* window, vtkRenderer* renderer)
      : Self(self)
    {
      self.IsAtWork = true;
      self.Target = window;
      self.TargetRenderer = renderer;
      self.TargetPass = nullptr;
      self.IsReleased = false;
    }
    ~Turn()
    {
      this->Self.OldFrames.clear();
      this->Self.OldPresenters.clear();
      this->Self.Target = nullptr;
      this->Self.IsAtWork = false;
    }

  private:
    Internals& Self;
  };

  explicit Internals(vtkHaliteMapper& self)
    : Self(self)
  {
  }

  // An error, once until something is drawn; a warning of the mapper's own, once.
  void ErrorOnce(const std::string& what);
  void WarnOnce(const std::string& what);
  // Warnings of the core.
  void ReportWarnings();
  // The blend mode, if it is none that is drawn.
  void WarnOfUnsupported();
  // Has a second variable and light drawn, as far as what is drawn has them.
  void Shade(halite_vtk::Content& content, vtkVolume* volume, vtkRenderer* renderer, bool isMaximum);

  halite_vtk::Presenter& PresenterOf(vtkOpenGLRenderWindow* window);
  Frame& FrameOf(vtkRenderer* renderer, vtkVolume* volume);
  // Lets go what was made for a window: at once, or when the frame that is at work is over.
  void Release(vtkWindow* window);
  // What is drawn of each grid, the nearest first.
  std::vector<halite_vtk::Content> Choose(
    std::vector<halite_vtk::Block> blocks, vtkVolume* volume, vtkRenderer* renderer, bool isMaximum);
  // Between rays, in pixels.
  double SampleDistance() const;
  // Draws once the renderer has finished.
  void Defer(vtkRenderer* renderer, vtkVolume* volume);

  // Puts right what observers of the frame that is at work did to what VTK draws it with: its window, renderer and pass.
  void Mend();

  // Draws a volume in a window, or says what is in the way.
  void DrawIn(vtkOpenGLRenderWindow* window, vtkRenderer* renderer, vtkVolume* volume);

  // These are false if what they draw was given up. By the core:
  bool Draw(const std::vector<halite_vtk::Content>& contents, const halite::View& view, vtkOpenGLRenderWindow* window,
    std::vector<float>& pixels);
  // Into the window, as one picture:
  bool Show(const std::vector<halite_vtk::Content>& contents, halite_vtk::SceneView& view,
    const halite_vtk::Viewport& viewport, halite_vtk::Presenter& presenter, Frame& frame);
  // Into the layers of a pass of depth peeling:
  bool Peel(const std::vector<halite_vtk::Content>& contents, halite_vtk::SceneView& view,
    halite_vtk::Presenter& presenter, Frame& frame, vtkOpenGLRenderPass* pass);
};

VTK_ABI_NAMESPACE_END
