// SPDX-License-Identifier: MIT OR Apache-2.0
#include "vtkHaliteMapper.h"

#include "FrameGuard.h"
#include "Peeling.h"
#include "vtkHaliteMapperInternals.h"

#include "vtkBoundingBox.h"
#include "vtkCompositeDataSet.h"
#include "vtkDataSet.h"
#include "vtkInformation.h"
#include "vtkMath.h"
#include "vtkObjectFactory.h"
#include "vtkOpenGLActor.h"
#include "vtkOpenGLRenderPass.h"
#include "vtkOpenGLRenderWindow.h"
#include "vtkPlaneCollection.h"
#include "vtkRenderer.h"
#include "vtkVolume.h"
#include "vtkVolumeProperty.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

using namespace halite_vtk;

VTK_ABI_NAMESPACE_BEGIN

namespace
{

// Whether depth peeling draws the volume now, in peels.
bool IsPeeled(vtkVolume* volume)
{
  vtkInformation* keys = volume->GetPropertyKeys();
  return keys && keys->Has(vtkOpenGLActor::GLDepthMaskOverride()) &&
    keys->Get(vtkOpenGLActor::GLDepthMaskOverride()) < 0;
}

}

vtkStandardNewMacro(vtkHaliteMapper);

vtkHaliteMapper::vtkHaliteMapper()
  : Inner(new Internals(*this))
{
  this->SetDevice("auto");
}

vtkHaliteMapper::~vtkHaliteMapper()
{
  this->SetDevice(nullptr);
  this->SetTransfer2DYAxisArray(nullptr);
}

void vtkHaliteMapper::SetInputData(vtkDataSet* grid)
{
  this->SetInputDataInternal(0, grid);
}

void vtkHaliteMapper::SetInputData(vtkUnstructuredGridBase* grid)
{
  this->Superclass::SetInputData(grid);
}

int vtkHaliteMapper::FillInputPortInformation(int port, vtkInformation* information)
{
  if (!this->Superclass::FillInputPortInformation(port, information))
  {
    return 0;
  }
  for (const char* kind : { "vtkImageData", "vtkRectilinearGrid", "vtkStructuredGrid", "vtkCompositeDataSet" })
  {
    information->Append(vtkAlgorithm::INPUT_REQUIRED_DATA_TYPE(), kind);
  }
  return 1;
}

double* vtkHaliteMapper::GetBounds()
{
  auto blocks = vtkCompositeDataSet::SafeDownCast(this->GetInputDataObject(0, 0));
  if (!blocks)
  {
    return this->Superclass::GetBounds();
  }
  this->Update();
  vtkBoundingBox all;
  for (const Block& block : Block::Of(blocks))
  {
    all.AddBounds(block.Grid->GetBounds());
  }
  vtkMath::UninitializeBounds(this->Bounds);
  if (all.IsValid())
  {
    all.GetBounds(this->Bounds);
  }
  return this->Bounds;
}

bool vtkHaliteMapper::IsSupported(vtkRenderWindow* window)
{
  return vtkOpenGLRenderWindow::SafeDownCast(window) != nullptr;
}

void vtkHaliteMapper::Render(vtkRenderer* renderer, vtkVolume* volume)
{
  Internals& inner = *this->Inner;
  // From here on observers may take away all of these.
  const vtkSmartPointer<vtkHaliteMapper> self(this);
  const vtkSmartPointer<vtkRenderer> keptRenderer(renderer);
  const vtkSmartPointer<vtkVolume> keptVolume(volume);
  if (inner.IsAtWork)
  {
    inner.WarnOnce(
      "this mapper is drawing a frame, and leaves out the one that an observer of that asks for: draw when the "
      "first is over, or give the other window a mapper of its own");
    return;
  }
  const vtkSmartPointer<vtkOpenGLRenderWindow> window = vtkOpenGLRenderWindow::SafeDownCast(renderer->GetVTKWindow());
  const Internals::Turn turn(inner, window, renderer);
  this->PrepareTime = this->DepthTime = this->CoreTime = this->PresentTime = 0;
  this->TimeToDraw = 0;

  if (!window)
  {
    inner.ErrorOnce("Halite draws in OpenGL windows only, and this is none");
    return;
  }
  FrameGuard::Keep(window, renderer, volume, this);
  FrameGuard::KeepContext(window);
  const bool hadContext = Presenter::HasContext(window);
  inner.DrawIn(window, renderer, volume);
  if (hadContext)
  {
    inner.Mend();
  }
  FrameGuard::GiveBack(window, volume, this);
}

void vtkHaliteMapper::Internals::DrawIn(vtkOpenGLRenderWindow* window, vtkRenderer* renderer, vtkVolume* volume)
{
  // A volume has no cell or point to be picked.
  if (renderer->GetSelector())
  {
    return;
  }
  // Depth peeling asks for parts of rays, in peels. A maximum has no parts, so its picture goes over the finished
  // scene, once.
  const bool isMaximum = this->Self.GetBlendMode() == vtkUnstructuredGridVolumeMapper::MAXIMUM_INTENSITY_BLEND;
  vtkOpenGLRenderPass* pass = nullptr;
  if (!this->DrawsDeferred && IsPeeled(volume))
  {
    pass = isMaximum ? nullptr : Peeling::PassOf(&this->Self, volume);
    this->TargetPass = pass;
    if (!pass)
    {
      this->WarnOnce("Halite draws this volume over translucent geometry, not between its layers");
      this->Defer(renderer, volume);
      return;
    }
  }
  const vtkSmartPointer<vtkDataObject> input = this->Self.GetInputDataObject(0, 0);
  if (!input || !volume->GetProperty())
  {
    this->ErrorOnce("there is no grid to draw: SetInputData or SetInputConnection gives the mapper one");
    return;
  }
  const std::vector<Block> blocks = Block::Of(input);
  if (blocks.empty())
  {
    return;
  }
  const Viewport viewport = Presenter::ViewportOf(window, renderer, renderer->GetPass() && !this->DrawsDeferred);
  if (viewport.Width <= 0 || viewport.Height <= 0)
  {
    return;
  }
  this->WarnOfUnsupported();

  Clock clock(this->Self.TimeToDraw);
  Key wanted;
  try
  {
    if (!Presenter::HasContext(window))
    {
      throw std::runtime_error("the window has no OpenGL context: Render() of the window makes one");
    }
    const std::vector<Content> contents = this->Choose(blocks, volume, renderer, isMaximum);
    // Where surfaces end rays there is nothing between two pixels.
    const double distance = pass ? 1 : this->SampleDistance();
    SceneView view(renderer, static_cast<int>(std::ceil(viewport.Width / distance)),
      static_cast<int>(std::ceil(viewport.Height / distance)), isMaximum, this->Self.ClippingPlanes);
    if (this->Self.Cropping)
    {
      std::array<double, 6> planes;
      std::copy_n(this->Self.CroppingRegionPlanes, 6, planes.begin());
      view.Crop(planes, this->Self.CroppingRegionFlags, contents.front().Placement);
    }
    for (const Content& content : contents)
    {
      wanted << content.Whole() << static_cast<std::uint64_t>(content.Place);
    }
    wanted << view.Key << static_cast<std::uint64_t>(this->Self.RoundingUp);
    if (this->Failed == wanted)
    {
      return;
    }
    Frame& frame = this->FrameOf(renderer, volume);
    if (frame.Pictured != wanted)
    {
      frame.Texture = nullptr;
      frame.Layers.Clear();
      frame.Pictured = wanted;
    }
    Presenter& presenter = this->PresenterOf(window);
    if (pass ? this->Peel(contents, view, presenter, frame, pass)
             : this->Show(contents, view, viewport, presenter, frame))
    {
      this->Errors.clear();
      this->Failed = Key();
    }
  }
  catch (const halite::Error& error)
  {
    this->Failed = wanted;
    this->ReportWarnings();
    this->ErrorOnce(error.what());
  }
  catch (const std::exception& error)
  {
    // Of the window, which may be another one next time, or able to.
    this->ErrorOnce(error.what());
  }
}

void vtkHaliteMapper::DrawDeferred(vtkObject* caller, unsigned long, void*)
{
  const vtkSmartPointer<vtkHaliteMapper> self(this);
  Internals& inner = *this->Inner;
  std::list<Internals::DeferredDraw> due;
  for (auto deferred = inner.DeferredDraws.begin(); deferred != inner.DeferredDraws.end();)
  {
    auto next = std::next(deferred);
    if (!deferred->Renderer || deferred->Renderer == caller)
    {
      due.splice(due.end(), inner.DeferredDraws, deferred);
    }
    deferred = next;
  }
  const bool drewDeferred = inner.DrawsDeferred;
  inner.DrawsDeferred = true;
  for (const Internals::DeferredDraw& deferred : due)
  {
    if (deferred.Renderer)
    {
      deferred.Renderer->RemoveObserver(deferred.Observer);
      if (deferred.Volume)
      {
        this->Render(deferred.Renderer, deferred.Volume);
      }
    }
  }
  inner.DrawsDeferred = drewDeferred;
}

void vtkHaliteMapper::ReleaseGraphicsResources(vtkWindow* window)
{
  this->Inner->Release(window);
  this->Superclass::ReleaseGraphicsResources(window);
}

void vtkHaliteMapper::AddWidget(const char* widget)
{
  if (widget)
  {
    this->Widgets.push_back(widget);
    this->Modified();
  }
}

void vtkHaliteMapper::RemoveAllWidgets()
{
  if (!this->Widgets.empty())
  {
    this->Widgets.clear();
    this->Modified();
  }
}

int vtkHaliteMapper::GetNumberOfWidgets()
{
  return static_cast<int>(this->Widgets.size());
}

vtkIdType vtkHaliteMapper::GetNumberOfFrames()
{
  return this->Inner->Cores.GetCounts().Frames;
}

vtkIdType vtkHaliteMapper::GetNumberOfMeshUploads()
{
  return this->Inner->Cores.GetCounts().Meshes;
}

vtkIdType vtkHaliteMapper::GetNumberOfPointUploads()
{
  return this->Inner->Cores.GetCounts().Points;
}

vtkIdType vtkHaliteMapper::GetNumberOfFieldUploads()
{
  return this->Inner->Cores.GetCounts().Fields;
}

vtkIdType vtkHaliteMapper::GetNumberOfFunctionUploads()
{
  return this->Inner->Cores.GetCounts().Functions;
}

vtkIdType vtkHaliteMapper::GetNumberOfCopies()
{
  return this->Inner->Cores.GetCounts().Copies;
}

const char* vtkHaliteMapper::GetAdapter()
{
  this->Inner->Adapter = this->Inner->Cores.GetStatistics().adapter;
  return this->Inner->Adapter.c_str();
}

vtkIdType vtkHaliteMapper::GetNumberOfTetrahedra()
{
  return static_cast<vtkIdType>(this->Inner->Cores.GetStatistics().tetrahedra);
}

// The names of scene files and of halite.h.
const char* vtkHaliteMapper::GetEngineAsString()
{
  static const char* const names[] = { "auto", "traverse", "project" };
  return names[this->Engine];
}

const char* vtkHaliteMapper::GetIntegralAsString()
{
  static const char* const names[] = { "exact", "auto", "volume", "polynomial", "cylindrical", "second-order",
    "second-order-polynomial" };
  return names[this->Integral];
}

const char* vtkHaliteMapper::GetTableTexelsAsString()
{
  static const char* const names[] = { "float", "unorm16", "unorm8" };
  return names[this->TableTexels];
}

const char* vtkHaliteMapper::GetOpacityConventionAsString()
{
  static const char* const names[] = { "Extinction", "Opacity", "ByInput" };
  return names[this->OpacityConvention];
}

const char* vtkHaliteMapper::GetReconstructionAsString()
{
  static const char* const names[] = { "exact", "2", "1", "0", "0-left", "0-right" };
  return names[this->Reconstruction];
}

void vtkHaliteMapper::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Device: " << Internals::Text(this->Device) << "\n";
  os << indent << "Engine: " << this->GetEngineAsString() << "\n";
  os << indent << "Integral: " << this->GetIntegralAsString() << "\n";
  os << indent << "TableSize: " << this->TableSize[0] << " " << this->TableSize[1] << " " << this->TableSize[2] << "\n";
  os << indent << "TableTexels: " << this->GetTableTexelsAsString() << "\n";
  os << indent << "PolynomialDegree: " << this->PolynomialDegree << "\n";
  os << indent << "OpacityConvention: " << this->GetOpacityConventionAsString() << "\n";
  os << indent << "Transfer2DYAxisArray: " << Internals::Text(this->Transfer2DYAxisArray) << "\n";
  os << indent << "SilhouettePower: " << this->SilhouettePower << "\n";
  for (const std::string& widget : this->Widgets)
  {
    os << indent << "Widget: " << widget << "\n";
  }
  os << indent << "Reconstruction: " << this->GetReconstructionAsString() << "\n";
  os << indent << "SampleDistance: " << this->SampleDistance << "\n";
  os << indent << "Cropping: " << (this->Cropping ? "On" : "Off") << "\n";
  os << indent << "CroppingRegionPlanes:";
  for (double plane : this->CroppingRegionPlanes)
  {
    os << " " << plane;
  }
  os << "\n" << indent << "CroppingRegionFlags: " << this->CroppingRegionFlags << "\n";
  os << indent << "ImageSampleDistance: " << this->ImageSampleDistance << "\n";
  os << indent << "InteractiveImageSampleDistance: " << this->InteractiveImageSampleDistance << "\n";
  os << indent << "Interacting: " << (this->Interacting ? "On" : "Off") << "\n";
  os << indent << "RoundingUp: " << (this->RoundingUp ? "On" : "Off") << "\n";
  os << indent << "NumberOfThreads: " << this->NumberOfThreads << "\n";
  os << indent << "UseFloatingPointFrameBuffer: " << (this->UseFloatingPointFrameBuffer ? "On" : "Off") << "\n";
  os << indent << "PrepareTime: " << this->PrepareTime << "\n";
  os << indent << "DepthTime: " << this->DepthTime << "\n";
  os << indent << "CoreTime: " << this->CoreTime << "\n";
  os << indent << "PresentTime: " << this->PresentTime << "\n";
  os << indent << "Adapter: " << this->GetAdapter() << "\n";
  os << indent << "NumberOfFrames: " << this->GetNumberOfFrames() << "\n";
  os << indent << "NumberOfMeshUploads: " << this->GetNumberOfMeshUploads() << "\n";
  os << indent << "NumberOfPointUploads: " << this->GetNumberOfPointUploads() << "\n";
  os << indent << "NumberOfFieldUploads: " << this->GetNumberOfFieldUploads() << "\n";
  os << indent << "NumberOfFunctionUploads: " << this->GetNumberOfFunctionUploads() << "\n";
  os << indent << "NumberOfCopies: " << this->GetNumberOfCopies() << "\n";
}

VTK_ABI_NAMESPACE_END
