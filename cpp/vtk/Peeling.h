// SPDX-License-Identifier: MIT OR Apache-2.0
// A volume among the layers of translucent surfaces: what VTK's dual depth peeling asks of a volume, and how it is
// answered.
#pragma once

#include "vtkHaliteCompatibility.h"

#include "vtkWeakPointer.h"

#include <array>
#include <memory>
#include <vector>

VTK_ABI_NAMESPACE_BEGIN
class vtkAbstractMapper;
class vtkOpenGLQuadHelper;
class vtkOpenGLRenderPass;
class vtkOpenGLRenderWindow;
class vtkTextureObject;
class vtkVolume;
VTK_ABI_NAMESPACE_END

namespace halite_vtk
{

// Window depths between which a part of a pixel's ray lies: nothing of it if they do not grow.
struct Interval
{
  float Start, End;
};

// The two parts of a ray that one peel draws: that behind the layer which was peeled from the front, and that before
// the one which was peeled from behind.
struct Intervals
{
  Interval Front, Back;
};

// What one window keeps to draw parts of rays.
class Peeling
{
public:
  explicit Peeling(vtkOpenGLRenderWindow* window);
  ~Peeling();

  // The pass that draws a volume in peels just now; null if none does, or in a way that is not known.
  static vtkOpenGLRenderPass* PassOf(vtkAbstractMapper* mapper, vtkVolume* volume);

  // Gives the pass textures again if it has released its own, and the OpenGL state of the window's new context if that was
  // finalized: it releases them whenever its window or renderer is told to, but does not survive it in the middle of a
  // frame. What was peeled is lost, as the window's picture is.
  static void Restore(vtkOpenGLRenderPass* pass);

  // What the pass wants of each pixel, row 0 lowest.
  void ReadIntervals(vtkOpenGLRenderPass* pass, vtkAbstractMapper* mapper, vtkVolume* volume, int width, int height,
    std::vector<Intervals>& intervals);

  // Whether what was asked for last lies before and behind all layers; it starts a frame.
  bool IsOutside() const { return this->Now == Outside; }

  // Gives it the pictures of these parts, premultiplied. What was kept goes before all layers that were drawn until now; that
  // is only for a volume that is alone in the scene.
  void Composite(vtkOpenGLRenderPass* pass, vtkAbstractMapper* mapper, vtkVolume* volume, bool isAlone,
    vtkTextureObject* kept, vtkTextureObject* front, vtkTextureObject* back);

private:
  // What is drawn: all before and behind the layers, then what is between them, then what was not reached.
  enum Stage
  {
    Outside,
    Between,
    Rest,
    Unknown
  };
  static Stage StageOf(vtkOpenGLRenderPass* pass, vtkAbstractMapper* mapper, vtkVolume* volume);
  vtkOpenGLQuadHelper& Ready(std::unique_ptr<vtkOpenGLQuadHelper>& quad, const char* fragment);

  vtkWeakPointer<vtkOpenGLRenderWindow> Window;
  Stage Now = Unknown;
  std::array<std::unique_ptr<vtkOpenGLQuadHelper>, 3> IntervalShaders, CompositeShaders;
};

}
