// SPDX-License-Identifier: MIT OR Apache-2.0
// Between a window's frame buffer and pictures in memory.
#pragma once

#include "vtkHaliteCompatibility.h"

#include "vtkSmartPointer.h"
#include "vtkWeakPointer.h"

#include <memory>
#include <vector>

VTK_ABI_NAMESPACE_BEGIN
class vtkOpenGLQuadHelper;
class vtkOpenGLRenderWindow;
class vtkRenderer;
class vtkTextureObject;
class vtkWindow;
VTK_ABI_NAMESPACE_END

namespace halite_vtk
{

class Peeling;

// The part of a frame buffer that a renderer draws to, in pixels from its lower left corner.
struct Viewport
{
  int X = 0, Y = 0, Width = 0, Height = 0;
  // Whether the frame buffer is that of a render pass, and not the window's.
  bool IsOfPass = false;
};

// What one window keeps to show pictures.
class Presenter
{
public:
  explicit Presenter(vtkOpenGLRenderWindow* window);
  ~Presenter();

  vtkOpenGLRenderWindow* GetWindow() const;

  // Makes the window's context the current one. False if it has none: before it was set up, and after it was finalized.
  static bool HasContext(vtkOpenGLRenderWindow* window);

  // Where the renderer draws just now: render passes have frame buffers of other sizes than the window's.
  static Viewport ViewportOf(vtkOpenGLRenderWindow* window, vtkRenderer* renderer, bool isInPass);

  // The depths of what is drawn in the viewport, row 0 lowest; `across` x `down` of them, at the middles of as many
  // fields.
  static void ReadDepths(
    vtkOpenGLRenderWindow* window, const Viewport& viewport, int across, int down, std::vector<float>& depths);

  // A texture of premultiplied RGBA, row 0 lowest.
  vtkSmartPointer<vtkTextureObject> Upload(int width, int height, const std::vector<float>& pixels);

  // Draws a texture over what is in the viewport: colour + (1 - opacity) x what is there, opacity likewise.
  void Present(vtkTextureObject* texture, const Viewport& viewport);

  Peeling& GetPeeling();

private:
  vtkWeakPointer<vtkOpenGLRenderWindow> Window;
  std::unique_ptr<Peeling> Peels;
  std::unique_ptr<vtkOpenGLQuadHelper> Quad;
};

}
