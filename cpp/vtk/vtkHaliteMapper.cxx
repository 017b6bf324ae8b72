// SPDX-License-Identifier: MIT OR Apache-2.0
#include "vtkHaliteMapper.h"

#include "Functions.h"
#include "MeshView.h"
#include "Peeling.h"
#include "Presenter.h"
#include "vtkHaliteCompatibility.h"

#include "vtkCamera.h"
#include "vtkCellData.h"
#include "vtkColorTransferFunction.h"
#include "vtkCommand.h"
#include "vtkDataArray.h"
#include "vtkInformation.h"
#include "vtkLogger.h"
#include "vtkMatrix3x3.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"
#include "vtkObjectFactory.h"
#include "vtkOpenGLActor.h"
#include "vtkOpenGLCamera.h"
#include "vtkOpenGLRenderPass.h"
#include "vtkOpenGLRenderWindow.h"
#include "vtkPiecewiseFunction.h"
#include "vtkPlane.h"
#include "vtkPlaneCollection.h"
#include "vtkPointData.h"
#include "vtkRenderer.h"
#include "vtkTextureObject.h"
#include "vtkUnstructuredGridBase.h"
#include "vtkVolume.h"
#include "vtkVolumeCollection.h"
#include "vtkVolumeProperty.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <list>
#include <map>
#include <mutex>
#include <set>

VTK_ABI_NAMESPACE_BEGIN

namespace
{

using Matrix = std::array<double, 16>;

// The rows of a matrix of VTK's.
Matrix RowsOf(vtkMatrix4x4* m)
{
  Matrix rows;
  std::copy(&m->Element[0][0], &m->Element[0][0] + 16, rows.begin());
  return rows;
}

// What a frame depends on, in order; two that are equal have equal pictures.
class Key
{
public:
  Key& operator<<(double v)
  {
    std::uint64_t bits;
    std::memcpy(&bits, &v, sizeof bits);
    return *this << bits;
  }
  Key& operator<<(std::uint64_t v)
  {
    this->Words.push_back(v);
    return *this;
  }
  Key& operator<<(const Key& other)
  {
    this->Words.insert(this->Words.end(), other.Words.begin(), other.Words.end());
    return *this;
  }
  Key& operator<<(const std::vector<std::uint64_t>& words)
  {
    this->Words.insert(this->Words.end(), words.begin(), words.end());
    return *this;
  }
  template <std::size_t N>
  Key& operator<<(const std::array<double, N>& values)
  {
    for (double v : values)
    {
      *this << v;
    }
    return *this;
  }
  Key& operator<<(const std::string& s)
  {
    *this << static_cast<std::uint64_t>(s.size());
    for (unsigned char c : s)
    {
      *this << static_cast<std::uint64_t>(c);
    }
    return *this;
  }
  bool operator==(const Key& other) const { return this->Words == other.Words; }
  bool operator!=(const Key& other) const { return this->Words != other.Words; }

private:
  std::vector<std::uint64_t> Words;
};

std::string Text(const char* s)
{
  return s ? s : "";
}

// The core's log goes where VTK's does.
void ForwardLog()
{
  static std::once_flag once;
  std::call_once(once, [] {
    halite::setLog([](halite::Level level, const std::string& line) {
      if (level == halite::Level::Info)
      {
        vtkLog(TRACE, << "Halite: " << line);
      }
      else
      {
        vtkGenericWarningMacro("Halite: " << line);
      }
    });
  });
}

double Now()
{
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// Measures its own life, in seconds.
class Clock
{
public:
  explicit Clock(double& seconds)
    : Seconds(seconds)
    , Start(Now())
  {
  }
  ~Clock() { this->Seconds += Now() - this->Start; }

private:
  double& Seconds;
  double Start;
};

// What is drawn of a grid, by which functions.
struct Content
{
  vtkUnstructuredGridBase* Grid = nullptr;
  vtkDataArray* Array = nullptr;
  halite::Association Association = halite::Association::Points;
  int Component = 0;
  Matrix Placement{};
  halite::TransferFunction Function;
  Key SettingsKey, MeshKey, PlacementKey, FieldKey, FunctionKey;
};

// The knots of a property's functions, kept until one of them changes.
struct Knots
{
  Key Sources;
  Functions::Color Color;
  Functions::Opacity Opacity;
};

// Premultiplied pixels of rays that end at these depths. Of each pixel of the window, which of these is its own; -1 is none.
struct Layer
{
  std::vector<int> Places;
  std::vector<float> Depths, Pixels;
  bool Used;
};

// What was drawn for a renderer, a volume and an eye: a picture, or those of rays up to translucent surfaces.
struct Frame
{
  vtkWeakPointer<vtkRenderer> Renderer;
  vtkWeakPointer<vtkVolume> Volume;
  int Eye = 0;
  Key Pictured;
  std::vector<float> Depths;
  vtkSmartPointer<vtkTextureObject> Texture;
  std::list<Layer> Layers;
  // Before the first of these surfaces, and not drawn yet.
  std::vector<float> Kept;
};

}

struct vtkHaliteMapper::Internals
{
  std::unique_ptr<halite::Renderer> Renderer;
  // What the renderer holds.
  Key SettingsKey, MeshKey, PlacementKey, FieldKey, FunctionKey;
  std::map<vtkVolumeProperty*, Knots> Functions;
  std::list<Frame> Frames;
  std::list<Presenter> Presenters;
  // What failed since something was drawn, and for what: nothing is tried, or said, twice.
  Key Failed;
  std::set<std::string> Errors;
  std::set<std::string> Remarks;
  std::vector<float> Pixels;
  std::string Adapter;
  // What is to be drawn once a renderer has finished.
  struct Late
  {
    vtkWeakPointer<vtkRenderer> Renderer;
    vtkWeakPointer<vtkVolume> Volume;
    unsigned long Observer = 0;
  };
  std::list<Late> Lates;
  bool DrawsLate = false;

  Presenter& PresenterOf(vtkOpenGLRenderWindow* window)
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

  Frame& FrameOf(vtkRenderer* renderer, vtkVolume* volume, int eye)
  {
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

  // What is to be drawn now.
  void Choose(vtkHaliteMapper& self, Content& content, vtkVolume* volume);

  // Draws with the core; false if that was given up.
  bool Draw(vtkHaliteMapper& self, const Content& content, const halite::View& view, vtkWindow* window,
    std::vector<float>& pixels);

  // Draws what a pass of depth peeling wants now; false if that was given up.
  bool Peel(vtkHaliteMapper& self, const Content& content, halite::View& view, Presenter& presenter, Frame& frame,
    vtkOpenGLRenderPass* pass);

  // Hands to the core what it does not hold yet.
  void Prepare(vtkHaliteMapper& self, const Content& content);

  const Knots& KnotsOf(vtkVolumeProperty* property, bool rgba)
  {
    const bool grey = property->GetColorChannels() == 1;
    vtkPiecewiseFunction* opacity = property->GetScalarOpacity(0);
    vtkPiecewiseFunction* greys = grey ? property->GetGrayTransferFunction(0) : nullptr;
    vtkColorTransferFunction* colors = grey ? nullptr : property->GetRGBTransferFunction(0);
    Key sources;
    sources << static_cast<std::uint64_t>(opacity->GetMTime())
            << static_cast<std::uint64_t>(grey ? greys->GetMTime() : colors->GetMTime())
            << static_cast<std::uint64_t>(rgba);
    // Properties that are gone leave theirs behind.
    if (this->Functions.size() > 100)
    {
      this->Functions.clear();
    }
    Knots& knots = this->Functions[property];
    if (knots.Sources != sources)
    {
      knots.Sources = sources;
      if (rgba)
      {
        // The colours are in the array.
        knots.Color = { { 0, { 1, 1, 1 } } };
        knots.Opacity.clear();
      }
      else
      {
        knots.Color = grey ? ::Functions::GreyKnotsOf(greys) : ::Functions::KnotsOf(colors);
        knots.Opacity = ::Functions::KnotsOf(opacity);
      }
    }
    return knots;
  }
};

vtkStandardNewMacro(vtkHaliteMapper);

vtkHaliteMapper::vtkHaliteMapper()
  : Inner(new Internals)
{
  this->SetDevice("auto");
  this->SetEngine("auto");
  this->SetIntegral("exact");
}

vtkHaliteMapper::~vtkHaliteMapper()
{
  this->SetDevice(nullptr);
  this->SetEngine(nullptr);
  this->SetIntegral(nullptr);
}

bool vtkHaliteMapper::IsSupported(vtkRenderWindow* window)
{
  return vtkOpenGLRenderWindow::SafeDownCast(window) != nullptr;
}

void vtkHaliteMapper::DrawLate(vtkObject* caller, unsigned long, void*)
{
  Internals& inner = *this->Inner;
  std::list<Internals::Late> due;
  for (auto late = inner.Lates.begin(); late != inner.Lates.end();)
  {
    auto next = std::next(late);
    if (!late->Renderer || late->Renderer == caller)
    {
      due.splice(due.end(), inner.Lates, late);
    }
    late = next;
  }
  inner.DrawsLate = true;
  for (const Internals::Late& late : due)
  {
    if (late.Renderer)
    {
      late.Renderer->RemoveObserver(late.Observer);
      if (late.Volume)
      {
        this->Render(late.Renderer, late.Volume);
      }
    }
  }
  inner.DrawsLate = false;
}

void vtkHaliteMapper::PrintSelf(ostream& os, vtkIndent indent)
{
  this->Superclass::PrintSelf(os, indent);
  os << indent << "Device: " << Text(this->Device) << "\n";
  os << indent << "Engine: " << Text(this->Engine) << "\n";
  os << indent << "Integral: " << Text(this->Integral) << "\n";
  os << indent << "OpacityConvention: " << (this->OpacityConvention == OPACITY ? "Opacity" : "Extinction") << "\n";
  os << indent << "ImageSampleDistance: " << this->ImageSampleDistance << "\n";
  os << indent << "NumberOfThreads: " << this->NumberOfThreads << "\n";
  os << indent << "UseFloatingPointFrameBuffer: " << (this->UseFloatingPointFrameBuffer ? "On" : "Off") << "\n";
  os << indent << "PrepareTime: " << this->PrepareTime << "\n";
  os << indent << "DepthTime: " << this->DepthTime << "\n";
  os << indent << "CoreTime: " << this->CoreTime << "\n";
  os << indent << "PresentTime: " << this->PresentTime << "\n";
  os << indent << "NumberOfFrames: " << this->NumberOfFrames << "\n";
  os << indent << "NumberOfMeshUploads: " << this->NumberOfMeshUploads << "\n";
  os << indent << "NumberOfPointUploads: " << this->NumberOfPointUploads << "\n";
  os << indent << "NumberOfFieldUploads: " << this->NumberOfFieldUploads << "\n";
  os << indent << "NumberOfFunctionUploads: " << this->NumberOfFunctionUploads << "\n";
  os << indent << "NumberOfCopies: " << this->NumberOfCopies << "\n";
}

void vtkHaliteMapper::ReleaseGraphicsResources(vtkWindow* window)
{
  // Where a renderer comes to a window VTK releases what is of no window: that is nothing of ours.
  this->Inner->Frames.remove_if([&](const Frame& f) { return !f.Renderer || f.Renderer->GetVTKWindow() == window; });
  this->Inner->Presenters.remove_if([&](const Presenter& p) { return !p.GetWindow() || p.GetWindow() == window; });
  this->Superclass::ReleaseGraphicsResources(window);
}

const char* vtkHaliteMapper::GetAdapter()
{
  this->Inner->Adapter = this->Inner->Renderer ? this->Inner->Renderer->statistics().adapter : "";
  return this->Inner->Adapter.c_str();
}

vtkIdType vtkHaliteMapper::GetNumberOfTetrahedra()
{
  return this->Inner->Renderer ? static_cast<vtkIdType>(this->Inner->Renderer->statistics().tetrahedra) : 0;
}

namespace
{

// The array that is drawn, and how. Throws if there is none, or VTK has no meaning for it.
void ChooseField(Content& content, vtkVolumeProperty* property, vtkDataArray* array, int cellFlag)
{
  if (!array)
  {
    throw halite::Error("the input has no array to draw: check the scalar mode and SelectScalarArray");
  }
  vtkUnstructuredGridBase* grid = content.Grid;
  // Field data belongs to what it has as many tuples as.
  const bool ofCells = cellFlag == 1 || (cellFlag == 2 && array->GetNumberOfTuples() != grid->GetNumberOfPoints());
  const vtkIdType expected = ofCells ? grid->GetNumberOfCells() : grid->GetNumberOfPoints();
  if (array->GetNumberOfTuples() != expected)
  {
    throw halite::Error("the array \"" + Text(array->GetName()) + "\" has " +
      std::to_string(array->GetNumberOfTuples()) + " tuples for " + std::to_string(expected) +
      (ofCells ? " cells" : " points"));
  }
  content.Array = array;
  content.Association = ofCells ? halite::Association::Cells : halite::Association::Points;
  const int n = array->GetNumberOfComponents();
  content.Component = 0;
  if (n > 1 && !property->GetIndependentComponents())
  {
    if (n != 2 && n != 4)
    {
      throw halite::Error("the array \"" + Text(array->GetName()) + "\" has " + std::to_string(n) +
        " dependent components: 2 (colour, opacity) or 4 (RGBA) can be drawn, or one of independent ones");
    }
    content.Component = halite::AllComponents;
  }
  else if (n > 1 && property->GetColorChannels() == 3)
  {
    vtkColorTransferFunction* colors = property->GetRGBTransferFunction(0);
    const bool magnitude = colors->GetVectorMode() == vtkScalarsToColors::MAGNITUDE;
    content.Component =
      magnitude ? static_cast<int>(halite::Magnitude) : std::min(std::max(colors->GetVectorComponent(), 0), n - 1);
  }
  content.FieldKey = Key();
  content.FieldKey << static_cast<std::uint64_t>(array->GetMTime()) << static_cast<std::uint64_t>(ofCells)
                   << static_cast<double>(content.Component);
}

// The functions. Those of four dependent components are the array's own.
void ChooseFunction(Content& content, vtkVolumeProperty* property, const Knots& knots, int convention)
{
  halite::TransferFunction& f = content.Function;
  f.color = knots.Color;
  f.opacity = knots.Opacity;
  if (content.Component == halite::AllComponents && content.Array->GetNumberOfComponents() == 4)
  {
    const double one = content.Array->GetDataType() == VTK_UNSIGNED_CHAR ? 255 : 1;
    const double most = std::max(one, content.Array->GetRange(3)[1]);
    f.opacity = { { 0, 0 }, { most, most / one } };
  }
  f.unitDistance = property->GetScalarOpacityUnitDistance(0);
  f.convention = convention == vtkHaliteMapper::OPACITY ? halite::OpacityConvention::Opacity
                                                        : halite::OpacityConvention::Extinction;
  content.FunctionKey = Key();
  content.FunctionKey << f.unitDistance << static_cast<std::uint64_t>(convention);
  for (const auto& k : f.color)
  {
    content.FunctionKey << k.scalar << k.rgb;
  }
  content.FunctionKey << static_cast<std::uint64_t>(f.color.size());
  for (const auto& k : f.opacity)
  {
    content.FunctionKey << k.scalar << k.opacity;
  }
}

// World to eye and eye to clip coordinates, as the window draws opaque geometry.
void MatricesOf(vtkRenderer* renderer, Matrix& toEye, Matrix& toClip)
{
  vtkCamera* camera = renderer->GetActiveCamera();
  vtkNew<vtkMatrix4x4> eye, clip;
  if (auto opengl = vtkOpenGLCamera::SafeDownCast(camera))
  {
    vtkMatrix4x4 *wcvc, *vcdc, *wcdc;
    vtkMatrix3x3* normals;
    opengl->GetKeyMatrices(renderer, wcvc, normals, vcdc, wcdc);
    vtkMatrix4x4::Transpose(wcvc, eye);
    vtkMatrix4x4::Transpose(vcdc, clip);
  }
  else
  {
    eye->DeepCopy(camera->GetModelViewTransformMatrix());
    clip->DeepCopy(camera->GetProjectionTransformMatrix(renderer->GetTiledAspectRatio(), -1, 1));
  }
  toEye = RowsOf(eye);
  toClip = RowsOf(clip);
}

}

void vtkHaliteMapper::Internals::Choose(vtkHaliteMapper& self, Content& content, vtkVolume* volume)
{
  content.SettingsKey << Text(self.Device) << Text(self.Engine) << Text(self.Integral)
                      << static_cast<std::uint64_t>(self.NumberOfThreads);
  content.MeshKey << MeshView::Identity(content.Grid);
  vtkNew<vtkMatrix4x4> placement;
  vtkHaliteCompatibility::GetMatrix(volume, placement);
  content.Placement = RowsOf(placement);
  content.PlacementKey << content.Placement;
  int cellFlag = 0;
  vtkDataArray* array = vtkAbstractMapper::GetScalars(
    content.Grid, self.ScalarMode, self.ArrayAccessMode, self.ArrayId, self.ArrayName, cellFlag);
  vtkVolumeProperty* property = volume->GetProperty();
  ChooseField(content, property, array, cellFlag);
  const bool rgba = content.Component == halite::AllComponents && array->GetNumberOfComponents() == 4;
  ChooseFunction(content, property, this->KnotsOf(property, rgba), self.OpacityConvention);
}

void vtkHaliteMapper::Internals::Prepare(vtkHaliteMapper& self, const Content& content)
{
  MeshView view;
  // What fails half way is not held, and what follows from it neither.
  auto isNew = [](Key& held, const Key& wanted) {
    const bool differs = held != wanted;
    if (differs)
    {
      held = Key();
    }
    return differs;
  };
  if (!this->Renderer || isNew(this->SettingsKey, content.SettingsKey))
  {
    halite::Settings settings;
    settings.threads = static_cast<std::size_t>(self.NumberOfThreads);
    settings.device = Text(self.Device);
    settings.engine = Text(self.Engine);
    settings.integral = Text(self.Integral);
    this->Renderer.reset();
    this->Renderer.reset(new halite::Renderer(settings));
    this->SettingsKey = content.SettingsKey;
    this->MeshKey = this->PlacementKey = this->FieldKey = this->FunctionKey = Key();
  }
  bool hasMesh = !isNew(this->MeshKey, content.MeshKey);
  if (hasMesh && isNew(this->PlacementKey, content.PlacementKey))
  {
    hasMesh = this->Renderer->movePoints(view.Points(content.Grid), &content.Placement);
    self.NumberOfPointUploads += hasMesh;
  }
  if (!hasMesh)
  {
    this->MeshKey = this->FieldKey = Key();
    this->Renderer->setMesh(view.Mesh(content.Grid), &content.Placement);
    ++self.NumberOfMeshUploads;
    this->MeshKey = content.MeshKey;
  }
  this->PlacementKey = content.PlacementKey;
  if (isNew(this->FieldKey, content.FieldKey))
  {
    const int n = content.Array->GetNumberOfComponents();
    const halite::Numbers numbers = view.Numbers(content.Array, content.Component);
    const bool single = numbers.count == static_cast<std::size_t>(content.Array->GetNumberOfTuples());
    this->Renderer->setField(Text(content.Array->GetName()), content.Association, single ? 1 : n,
      single && n > 1 ? 0 : content.Component, numbers);
    ++self.NumberOfFieldUploads;
    this->FieldKey = content.FieldKey;
  }
  if (isNew(this->FunctionKey, content.FunctionKey))
  {
    this->Renderer->setTransferFunction(content.Function);
    ++self.NumberOfFunctionUploads;
    this->FunctionKey = content.FunctionKey;
  }
  self.NumberOfCopies += view.GetCopies();
}

bool vtkHaliteMapper::Internals::Draw(vtkHaliteMapper& self, const Content& content, const halite::View& view,
  vtkWindow* window, std::vector<float>& pixels)
{
  {
    Clock clock(self.PrepareTime);
    this->Prepare(self, content);
  }
  Clock clock(self.CoreTime);
  auto opengl = static_cast<vtkOpenGLRenderWindow*>(window);
  pixels.resize(std::size_t(4) * view.width * view.height);
  const bool finished = this->Renderer->render(view, pixels.data(), [&](double share) {
    self.InvokeEvent(vtkCommand::VolumeMapperRenderProgressEvent, &share);
    return !opengl->CheckAbortStatus();
  });
  ++self.NumberOfFrames;
  // Handlers of events may have drawn elsewhere.
  opengl->MakeCurrent();
  return finished;
}

namespace
{

// The pixel of the ray up to a depth; null if that was not drawn yet.
const float* Find(std::list<Layer>& layers, std::size_t pixel, float depth)
{
  static const float nothing[4] = { 0, 0, 0, 0 };
  if (!(depth > 0))
  {
    return nothing;
  }
  for (Layer& layer : layers)
  {
    const int place = layer.Places[pixel];
    if (place >= 0 && layer.Depths[place] == depth)
    {
      layer.Used = true;
      return &layer.Pixels[4 * static_cast<std::size_t>(place)];
    }
  }
  return nullptr;
}

// What lies between two ends of a ray, by the pixels up to both.
void Between(const float* near, const float* far, float* pixel)
{
  const double through = 1.0 - near[3];
  for (int k = 0; k < 4; ++k)
  {
    pixel[k] = through > 0 ? static_cast<float>(std::max((double(far[k]) - near[k]) / through, 0.0)) : 0;
  }
  pixel[3] = std::min(pixel[3], 1.0f);
}

}

bool vtkHaliteMapper::Internals::Peel(vtkHaliteMapper& self, const Content& content, halite::View& view,
  Presenter& presenter, Frame& frame, vtkOpenGLRenderPass* pass)
{
  vtkVolume* volume = frame.Volume;
  const int width = static_cast<int>(view.width), height = static_cast<int>(view.height);
  std::vector<Parts> parts;
  {
    Clock clock(self.DepthTime);
    presenter.GetPeeling().Ask(pass, &self, volume, width, height, parts);
  }
  const bool isOutside = presenter.GetPeeling().IsOutside();
  if (isOutside)
  {
    frame.Kept.clear();
    frame.Layers.remove_if([](const Layer& layer) { return !layer.Used; });
    for (Layer& layer : frame.Layers)
    {
      layer.Used = false;
    }
  }
  // Four ends of rays for each pixel: the core is asked for what is new of each.
  for (float Part::*end : { &Part::Start, &Part::End })
  {
    for (Part Parts::*part : { &Parts::Front, &Parts::Back })
    {
      std::vector<float> ends(parts.size(), 0.0f);
      bool any = false;
      for (std::size_t i = 0; i < parts.size(); ++i)
      {
        const Part& p = parts[i].*part;
        if (p.Start < p.End && !Find(frame.Layers, i, p.*end))
        {
          ends[i] = p.*end;
          any = true;
        }
      }
      if (any)
      {
        view.depths = ends.data();
        if (!this->Draw(self, content, view, presenter.GetWindow(), this->Pixels))
        {
          return false;
        }
        Layer layer{ std::vector<int>(ends.size(), -1), {}, {}, true };
        for (std::size_t i = 0; i < ends.size(); ++i)
        {
          if (ends[i] > 0)
          {
            layer.Places[i] = static_cast<int>(layer.Depths.size());
            layer.Depths.push_back(ends[i]);
            layer.Pixels.insert(layer.Pixels.end(), &this->Pixels[4 * i], &this->Pixels[4 * i] + 4);
          }
        }
        frame.Layers.push_back(std::move(layer));
      }
    }
  }
  Clock clock(self.PresentTime);
  const auto draw = [&](Part Parts::*part) {
    std::vector<float> pixels(4 * parts.size(), 0.0f);
    for (std::size_t i = 0; i < parts.size(); ++i)
    {
      const Part& p = parts[i].*part;
      if (p.Start < p.End)
      {
        Between(Find(frame.Layers, i, p.Start), Find(frame.Layers, i, p.End), &pixels[4 * i]);
      }
    }
    return pixels;
  };
  std::vector<float> kept, front = draw(&Parts::Front), back = draw(&Parts::Back);
  kept.swap(frame.Kept);
  // VTK's layers have 8 bits, and what is written less often is rounded less often. Other volumes would have to go between.
  vtkRenderer* renderer = frame.Renderer;
  if (isOutside && volume->GetMapper() == &self && renderer->GetVolumes()->GetNumberOfItems() == 1 &&
    renderer->GetMaximumNumberOfPeels() > 0)
  {
    frame.Kept.swap(front);
  }
  vtkSmartPointer<vtkTextureObject> textures[3];
  const std::vector<float>* const pictures[] = { &kept, &front, &back };
  for (int k = 0; k < 3; ++k)
  {
    textures[k] = pictures[k]->empty() ? presenter.Upload(1, 1, { 0, 0, 0, 0 }) : presenter.Upload(width, height, *pictures[k]);
  }
  presenter.GetPeeling().Answer(pass, &self, volume, textures[0], textures[1], textures[2]);
  return true;
}

void vtkHaliteMapper::Render(vtkRenderer* renderer, vtkVolume* volume)
{
  Internals& inner = *this->Inner;
  this->PrepareTime = this->DepthTime = this->CoreTime = this->PresentTime = 0;
  this->TimeToDraw = 0;
  auto say = [&](const std::string& what) {
    if (inner.Errors.insert(what).second)
    {
      vtkErrorMacro(<< what);
    }
  };
  auto remark = [&](const char* what) {
    if (inner.Remarks.insert(what).second)
    {
      vtkWarningMacro(<< what);
    }
  };

  auto window = vtkOpenGLRenderWindow::SafeDownCast(renderer->GetVTKWindow());
  if (!window)
  {
    say("Halite draws in OpenGL windows only, and this is none");
    return;
  }
  // A volume has no cell or point to be picked.
  if (renderer->GetSelector())
  {
    return;
  }
  // Depth peeling asks for parts of rays, in peels. A maximum has no parts, so its picture goes over the finished scene, once.
  vtkInformation* keys = volume->GetPropertyKeys();
  const bool maximum = this->GetBlendMode() == vtkUnstructuredGridVolumeMapper::MAXIMUM_INTENSITY_BLEND;
  const bool peels = !inner.DrawsLate && keys && keys->Has(vtkOpenGLActor::GLDepthMaskOverride()) &&
    keys->Get(vtkOpenGLActor::GLDepthMaskOverride()) < 0;
  vtkOpenGLRenderPass* pass = peels && !maximum ? Peeling::PassOf(this, volume) : nullptr;
  if (peels && !pass)
  {
    remark("Halite draws this volume over translucent geometry, not between its layers");
    const bool waits = std::any_of(inner.Lates.begin(), inner.Lates.end(),
      [&](const Internals::Late& l) { return l.Renderer == renderer && l.Volume == volume; });
    if (!waits)
    {
      inner.Lates.emplace_back();
      inner.Lates.back().Renderer = renderer;
      inner.Lates.back().Volume = volume;
      inner.Lates.back().Observer = renderer->AddObserver(vtkCommand::EndEvent, this, &vtkHaliteMapper::DrawLate);
    }
    return;
  }

  Content content;
  content.Grid = vtkUnstructuredGridBase::SafeDownCast(this->GetInputDataObject(0, 0));
  vtkVolumeProperty* property = volume->GetProperty();
  if (!content.Grid || !property)
  {
    say("there is no unstructured grid to draw");
    return;
  }
  if (content.Grid->GetNumberOfCells() == 0)
  {
    return;
  }
  Viewport viewport;
  renderer->GetTiledSizeAndOrigin(&viewport.Width, &viewport.Height, &viewport.X, &viewport.Y);
  if (viewport.Width <= 0 || viewport.Height <= 0)
  {
    return;
  }
  if (property->GetShade(0))
  {
    remark("Halite does not shade: the volume emits light and absorbs it");
  }
  // With 2D functions, VTK says that there is gradient opacity.
  if (property->GetTransferFunctionMode() == vtkVolumeProperty::TF_2D)
  {
    remark("Halite does not draw 2D transfer functions; the 1D functions are used");
  }
  else if (property->HasGradientOpacity(0) && !property->GetDisableGradientOpacity(0))
  {
    remark("Halite does not draw gradient opacity");
  }

  ForwardLog();
  const double start = Now();
  Key wanted;
  try
  {
    Frame& frame = inner.FrameOf(renderer, volume, renderer->GetActiveCamera()->GetLeftEye());
    halite::View view;
    Matrix toEye, toClip;
    {
      Clock clock(this->PrepareTime);
      inner.Choose(*this, content, volume);
      wanted << content.SettingsKey << content.MeshKey << content.PlacementKey << content.FieldKey << content.FunctionKey;
      MatricesOf(renderer, toEye, toClip);
      view.worldToEye = &toEye;
      view.eyeToClip = &toClip;
      // Where surfaces end rays there is nothing between two pixels.
      const double distance = pass ? 1 : this->ImageSampleDistance;
      view.width = static_cast<std::uint32_t>(std::ceil(viewport.Width / distance));
      view.height = static_cast<std::uint32_t>(std::ceil(viewport.Height / distance));
      view.bottomUp = true;
      view.maximum = maximum;
      wanted << toEye << toClip << static_cast<double>(view.width) << static_cast<double>(view.height)
             << static_cast<std::uint64_t>(view.maximum);
      for (int i = 0; i < this->GetNumberOfClippingPlanes(); ++i)
      {
        vtkPlane* plane = this->ClippingPlanes->GetItem(i);
        halite::ClippingPlane p;
        plane->GetOrigin(p.origin.data());
        plane->GetNormal(p.normal.data());
        view.planes.push_back(p);
        wanted << p.origin << p.normal;
      }
    }
    if (inner.Failed == wanted)
    {
      return;
    }
    Presenter& presenter = inner.PresenterOf(window);
    if (pass)
    {
      if (frame.Pictured != wanted)
      {
        frame.Layers.clear();
        frame.Texture = nullptr;
        frame.Pictured = wanted;
      }
      if (inner.Peel(*this, content, view, presenter, frame, pass))
      {
        inner.Errors.clear();
      }
      this->TimeToDraw = Now() - start;
      return;
    }
    std::vector<float> depths;
    // Where nothing was drawn and nothing kept, nothing ends rays.
    if (renderer->GetNumberOfPropsRendered() > 0 || renderer->GetPreserveDepthBuffer() || !renderer->GetErase())
    {
      Clock clock(this->DepthTime);
      Presenter::ReadDepths(window, viewport, view.width, view.height, depths);
      if (std::all_of(depths.begin(), depths.end(), [](float d) { return d >= 1; }))
      {
        depths.clear();
      }
    }
    if (!frame.Texture || frame.Pictured != wanted || frame.Depths != depths)
    {
      frame.Texture = nullptr;
      frame.Layers.clear();
      frame.Pictured = wanted;
      frame.Depths.swap(depths);
      view.depths = frame.Depths.empty() ? nullptr : frame.Depths.data();
      if (!inner.Draw(*this, content, view, window, inner.Pixels))
      {
        return;
      }
    }
    Clock clock(this->PresentTime);
    if (!frame.Texture)
    {
      frame.Texture = presenter.Upload(view.width, view.height, inner.Pixels);
    }
    presenter.Present(frame.Texture, viewport);
    inner.Errors.clear();
  }
  catch (const std::exception& error)
  {
    inner.Failed = wanted;
    say(error.what());
  }
  this->TimeToDraw = Now() - start;
}

VTK_ABI_NAMESPACE_END
