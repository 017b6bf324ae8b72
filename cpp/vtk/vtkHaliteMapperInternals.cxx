// SPDX-License-Identifier: MIT OR Apache-2.0
#include "vtkHaliteMapperInternals.h"

#include "FrameGuard.h"
#include "MeshView.h"
#include "Peeling.h"
#include "Threads.h"

#include "vtkCamera.h"
#include "vtkCellData.h"
#include "vtkCommand.h"
#include "vtkDataArray.h"
#include "vtkDataSet.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"
#include "vtkOpenGLRenderPass.h"
#include "vtkOpenGLRenderWindow.h"
#include "vtkPointData.h"
#include "vtkRenderer.h"
#include "vtkVolume.h"
#include "vtkVolumeCollection.h"
#include "vtkVolumeProperty.h"

#include <algorithm>

using namespace halite_vtk;

VTK_ABI_NAMESPACE_BEGIN

void vtkHaliteMapper::Internals::ErrorOnce(const std::string& what)
{
  if (this->Errors.insert(Messages::WithoutNumbers(what)).second)
  {
    vtkErrorWithObjectMacro(&this->Self, << what);
  }
}

void vtkHaliteMapper::Internals::WarnOnce(const std::string& what)
{
  if (this->Warned.insert(what).second)
  {
    vtkWarningWithObjectMacro(&this->Self, << what);
  }
}

void vtkHaliteMapper::Internals::ReportWarnings()
{
  for (const std::string& warning : this->Cores.TakeWarnings())
  {
    vtkWarningWithObjectMacro(&this->Self, << warning);
  }
}

void vtkHaliteMapper::Internals::Release(vtkWindow* window)
{
  const auto take = [this](auto& from, auto& to, auto isOld) {
    for (auto at = from.begin(); at != from.end();)
    {
      const auto next = std::next(at);
      if (isOld(*at))
      {
        to.splice(to.end(), from, at);
      }
      at = next;
    }
    if (!this->IsAtWork)
    {
      to.clear();
    }
  };
  this->IsReleased |= window == this->Target;
  // Where a renderer comes to a window VTK releases what is of no window: that is nothing of ours.
  take(
    this->Frames, this->OldFrames, [&](const Frame& f) { return !f.Renderer || f.Renderer->GetVTKWindow() == window; });
  take(this->Presenters, this->OldPresenters,
    [&](const Presenter& p) { return !p.GetWindow() || p.GetWindow() == window; });
}

Presenter& vtkHaliteMapper::Internals::PresenterOf(vtkOpenGLRenderWindow* window)
{
  for (Presenter& p : this->Presenters)
  {
    if (p.GetWindow() == window)
    {
      return p;
    }
  }
  this->Presenters.emplace_back(window);
  return this->Presenters.back();
}

vtkHaliteMapper::Internals::Frame& vtkHaliteMapper::Internals::FrameOf(vtkRenderer* renderer, vtkVolume* volume)
{
  const int eye = renderer->GetActiveCamera()->GetLeftEye();
  this->Frames.remove_if([](const Frame& f) { return !f.Renderer || !f.Volume; });
  for (Frame& f : this->Frames)
  {
    if (f.Renderer == renderer && f.Volume == volume && f.Eye == eye)
    {
      return f;
    }
  }
  this->Frames.emplace_back();
  Frame& f = this->Frames.back();
  f.Renderer = renderer;
  f.Volume = volume;
  f.Eye = eye;
  return f;
}

void vtkHaliteMapper::Internals::WarnOfUnsupported()
{
  const int blend = this->Self.GetBlendMode();
  if (blend != COMPOSITE_BLEND && blend != MAXIMUM_INTENSITY_BLEND)
  {
    this->WarnOnce("Halite does not draw blend mode " + std::to_string(blend) +
      " (it has composite and maximum intensity); composite is used");
  }
}

void vtkHaliteMapper::Internals::Shade(Content& content, vtkVolume* volume, vtkRenderer* renderer, bool isMaximum)
{
  // A maximum has neither.
  if (isMaximum)
  {
    return;
  }
  vtkVolumeProperty* property = volume->GetProperty();
  const std::string name = Text(this->Self.Transfer2DYAxisArray);
  vtkDataArray* second = nullptr;
  if (!name.empty() && (!this->Self.Widgets.empty() || Shading::IsOfTwo(property)))
  {
    vtkDataSetAttributes* arrays = content.Association == halite::Association::Points
      ? static_cast<vtkDataSetAttributes*>(content.Grid->GetPointData())
      : content.Grid->GetCellData();
    second = arrays->GetArray(name.c_str());
    if (!second)
    {
      throw halite::Error("Transfer2DYAxisArray: there is no array \"" + name + "\" beside the one that is drawn");
    }
  }
  if (property->GetTransferFunctionMode() == vtkVolumeProperty::TF_2D && !property->GetTransferFunction2D(0))
  {
    this->WarnOnce("the property has no 2D transfer function: its functions of one variable are used");
  }
  Shading shading(property, renderer, content.Array, second);
  shading.Widgets = this->Self.Widgets;
  if (this->Self.SilhouettePower >= 0)
  {
    shading.Silhouette = this->Self.SilhouettePower;
  }
  if (!shading.Widgets.empty())
  {
    shading.Table.reset();
    shading.Second = second;
  }
  if (!shading.IsThere())
  {
    return;
  }
  if (content.Component == halite::AllComponents)
  {
    this->WarnOnce(
      "dependent components have no gradient: they are drawn without light, gradient opacity and 2D functions");
  }
  else if (content.Association == halite::Association::Cells && shading.NeedsGradient())
  {
    this->WarnOnce(
      "values of cells have no gradient: they are drawn without light, gradient opacity and 2D functions of it");
  }
  else
  {
    content.Shade(shading);
  }
}

std::vector<Content> vtkHaliteMapper::Internals::Choose(
  std::vector<Block> blocks, vtkVolume* volume, vtkRenderer* renderer, bool isMaximum)
{
  Clock clock(this->Self.PrepareTime);
  halite::Settings settings;
  settings.threads = Threads::Of(this->Self.NumberOfThreads);
  settings.device = Text(this->Self.Device);
  settings.engine = this->Self.GetEngineAsString();
  halite::Integral& integral = settings.integral;
  integral.form = this->Self.GetIntegralAsString();
  std::copy_n(this->Self.TableSize, 3, integral.table.begin());
  integral.texels = this->Self.GetTableTexelsAsString();
  integral.degree = this->Self.PolynomialDegree;
  integral.reconstruction = this->Self.GetReconstructionAsString();
  integral.sampleDistance = this->Self.SampleDistance;
  const bool areSeveral = blocks.size() > 1;
  if (areSeveral)
  {
    if (isMaximum ||
      !std::all_of(blocks.begin(), blocks.end(), [](const Block& b) { return MeshView::IsGrid(b.Grid); }))
    {
      throw halite::Error("of several grids, image data and rectilinear grids are drawn together, and no maximum is: "
                          "vtkAppendFilter makes one of others");
    }
    vtkNew<vtkMatrix4x4> matrix;
    vtkHaliteCompatibility::GetMatrix(volume, matrix);
    halite::Renderer::Matrix placement;
    std::copy_n(matrix->GetData(), 16, placement.begin());
    Block::Sort(blocks, renderer, placement);
  }
  std::vector<Content> contents;
  const auto add = [&](const Block& block, vtkDataArray* array, int cellFlag) {
    const bool isSlab = this->Self.OpacityConvention == vtkHaliteMapper::OPACITY ||
      (this->Self.OpacityConvention == vtkHaliteMapper::BY_INPUT && MeshView::IsGrid(block.Grid));
    const auto convention = isSlab ? halite::OpacityConvention::Opacity : halite::OpacityConvention::Extinction;
    contents.emplace_back(settings, block.Grid, array, cellFlag, volume, convention, this->Knots);
    contents.back().Place = block.Place;
    this->Shade(contents.back(), volume, renderer, isMaximum);
  };
  for (const Block& block : blocks)
  {
    int cellFlag = 0;
    vtkDataArray* array = vtkAbstractMapper::GetScalars(block.Grid, this->Self.ScalarMode, this->Self.ArrayAccessMode,
      this->Self.ArrayId, this->Self.ArrayName, cellFlag);
    // Blocks may lack what others have.
    if (array || !areSeveral)
    {
      add(block, array, cellFlag);
    }
  }
  if (contents.empty())
  {
    add(blocks.front(), nullptr, 0);
  }
  return contents;
}

void vtkHaliteMapper::Internals::Mend()
{
  FrameGuard::GiveBack(this->Target, this->TargetRenderer);
  // Observers may have drawn elsewhere, or finalized the window: VTK goes on with its frame, and needs what that began with.
  if (!Presenter::HasContext(this->Target))
  {
    this->Target->Start();
    this->IsReleased = true;
  }
  if (this->TargetPass)
  {
    Peeling::Restore(this->TargetPass);
  }
}

bool vtkHaliteMapper::Internals::Draw(const std::vector<Content>& contents, const halite::View& view,
  vtkOpenGLRenderWindow* window, std::vector<float>& pixels)
{
  {
    Clock clock(this->Self.PrepareTime);
    this->Cores.Hold(contents);
  }
  std::string thrown;
  bool finished;
  {
    Clock clock(this->Self.CoreTime);
    finished = this->Cores.Draw(view, pixels, [&](double share) {
      // What observers throw stays here: VTK's windows never draw again if an exception leaves a frame.
      try
      {
        this->Self.InvokeEvent(vtkCommand::VolumeMapperRenderProgressEvent, &share);
        return !window->CheckAbortStatus();
      }
      catch (const std::exception& error)
      {
        thrown = std::string("an observer of the frame threw: ") + error.what();
      }
      catch (...)
      {
        thrown = "an observer of the frame threw something that is no std::exception";
      }
      return false;
    });
  }
  if (!thrown.empty())
  {
    this->ErrorOnce(thrown);
  }
  this->ReportWarnings();
  this->Mend();
  return finished && !this->IsReleased;
}

namespace
{

// Half a byte's step more of what is not 0.
void RoundUp(std::vector<float>& pixels)
{
  for (float& value : pixels)
  {
    value = value > 0 ? std::min(value + 0.5f / 255, 1.0f) : value;
  }
}

}

bool vtkHaliteMapper::Internals::Show(
  const std::vector<Content>& contents, SceneView& view, const Viewport& viewport, Presenter& presenter, Frame& frame)
{
  vtkRenderer* renderer = frame.Renderer;
  const int width = static_cast<int>(view.View.width), height = static_cast<int>(view.View.height);
  std::vector<float> depths;
  // Where nothing was drawn and nothing kept, nothing ends rays.
  if (viewport.IsOfPass || renderer->GetNumberOfPropsRendered() > 0 || renderer->GetPreserveDepthBuffer() ||
    !renderer->GetErase())
  {
    Clock clock(this->Self.DepthTime);
    Presenter::ReadDepths(presenter.GetWindow(), viewport, width, height, depths);
    if (std::all_of(depths.begin(), depths.end(), [](float d) { return d >= 1; }))
    {
      depths.clear();
    }
  }
  const bool isDrawn = frame.Texture && frame.Depths == depths;
  if (!isDrawn)
  {
    frame.Texture = nullptr;
    frame.Layers.Clear();
    frame.Depths.swap(depths);
    view.View.depths = frame.Depths;
    if (!this->Draw(contents, view.View, presenter.GetWindow(), this->Pixels))
    {
      return false;
    }
  }
  Clock clock(this->Self.PresentTime);
  if (!isDrawn)
  {
    if (this->Self.RoundingUp)
    {
      RoundUp(this->Pixels);
    }
    frame.Texture = presenter.Upload(width, height, this->Pixels);
  }
  presenter.Present(frame.Texture, viewport);
  return true;
}

bool vtkHaliteMapper::Internals::Peel(
  const std::vector<Content>& contents, SceneView& view, Presenter& presenter, Frame& frame, vtkOpenGLRenderPass* pass)
{
  vtkRenderer* renderer = frame.Renderer;
  vtkVolume* volume = frame.Volume;
  Peeling& peeling = presenter.GetPeeling();
  const int width = static_cast<int>(view.View.width), height = static_cast<int>(view.View.height);
  std::vector<Intervals> intervals;
  {
    Clock clock(this->Self.DepthTime);
    peeling.ReadIntervals(pass, &this->Self, volume, width, height, intervals);
  }
  const bool isOutside = peeling.IsOutside();
  if (isOutside)
  {
    frame.Kept.clear();
    frame.Layers.DropUnused();
  }
  const bool isComplete =
    frame.Layers.Complete(intervals, [&](const std::vector<float>& ends, std::vector<float>& pixels) {
      view.View.depths = ends;
      return this->Draw(contents, view.View, presenter.GetWindow(), pixels);
    });
  if (!isComplete)
  {
    return false;
  }
  Clock clock(this->Self.PresentTime);
  const bool isAlone = volume->GetMapper() == &this->Self && renderer->GetVolumes()->GetNumberOfItems() == 1;
  std::vector<float> kept, front = frame.Layers.PictureOf(intervals, &Intervals::Front);
  const std::vector<float> back = frame.Layers.PictureOf(intervals, &Intervals::Back);
  kept.swap(frame.Kept);
  if (isOutside && isAlone && renderer->GetMaximumNumberOfPeels() > 0)
  {
    frame.Kept.swap(front);
  }
  const auto textureOf = [&](const std::vector<float>& pixels) {
    return pixels.empty() ? presenter.Upload(1, 1, { 0, 0, 0, 0 }) : presenter.Upload(width, height, pixels);
  };
  peeling.Composite(pass, &this->Self, volume, isAlone, textureOf(kept), textureOf(front), textureOf(back));
  return true;
}

double vtkHaliteMapper::Internals::SampleDistance() const
{
  const double distance = this->Self.ImageSampleDistance;
  return this->Self.Interacting ? std::max(distance, this->Self.InteractiveImageSampleDistance) : distance;
}

void vtkHaliteMapper::Internals::Defer(vtkRenderer* renderer, vtkVolume* volume)
{
  const bool waits = std::any_of(this->DeferredDraws.begin(), this->DeferredDraws.end(),
    [&](const DeferredDraw& l) { return l.Renderer == renderer && l.Volume == volume; });
  if (!waits)
  {
    const unsigned long observer =
      renderer->AddObserver(vtkCommand::EndEvent, &this->Self, &vtkHaliteMapper::DrawDeferred);
    this->DeferredDraws.push_back({ renderer, volume, observer });
  }
}

VTK_ABI_NAMESPACE_END
