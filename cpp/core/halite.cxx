// SPDX-License-Identifier: MIT OR Apache-2.0
// Renderers and pictures of halite.h, made of the bridge. Nothing of the bridge is visible from outside.
#include "bridged.h"

#include <atomic>
#include <cstdlib>
#include <mutex>

namespace halite
{

using namespace bridged;

namespace
{

#if defined(__linux__)
// Mesa's selection of Vulkan devices asks Wayland, which complains on stderr where there is no session. The environment is
// changed while the library is loaded, as other threads may read it later.
__attribute__((constructor)) void hushMesa()
{
  const char* folder = std::getenv("XDG_RUNTIME_DIR");
  if (!folder || folder[0] != '/')
  {
    setenv("NODEVICE_SELECT", "1", 0);
  }
}
#endif

// Four numbers for each of so many pixels.
std::size_t sizeOfImage(std::uint32_t width, std::uint32_t height)
{
  const std::size_t pixels = std::size_t(width) * height;
  if (pixels > static_cast<std::size_t>(PTRDIFF_MAX) / 16)
  {
    throw Error(
      "an image of " + std::to_string(width) + "x" + std::to_string(height) + " pixels is larger than memory");
  }
  return 4 * pixels;
}

std::array<double, 16> orIdentity(const Renderer::Matrix* matrix)
{
  return matrix ? *matrix : std::array<double, 16>{ 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1 };
}

}

Error::~Error() = default;

const char* version()
{
  return HALITE_VERSION;
}

struct Renderer::Inner
{
  rust::Box<bridge::Log> Lines;
  rust::Box<bridge::Session> Box;
  Log Sink;
  std::atomic<bool> IsAtWork{ false };
  // Of the calls before the one that is at work.
  std::mutex LatestMutex;
  Statistics Latest;

  Inner(rust::Box<bridge::Log> lines, const Settings& s)
    : Lines(std::move(lines))
    , Box(call(*this->Lines, s.log,
        [&] { return bridge::new_session(s.threads, str(s.device), str(s.engine), *this->Lines); }))
    , Sink(s.log)
  {
  }

  static std::shared_ptr<Inner> Of(const std::shared_ptr<Inner>& data)
  {
    if (!data)
    {
      throw Error("this renderer was moved elsewhere");
    }
    return data;
  }

  // What makes a call the only one; ends with it.
  struct Turn
  {
    std::atomic<bool>& Flag;
    const bool IsMine;
    explicit Turn(Inner& self)
      : Flag(self.IsAtWork)
      , IsMine(!self.IsAtWork.exchange(true))
    {
    }
    ~Turn()
    {
      if (this->IsMine)
      {
        this->Flag = false;
      }
    }
  };

  // Runs a call on the session, of which there is one at a time. `data` lives as long as the call, whatever that calls back.
  template <class Work>
  static auto Run(std::shared_ptr<Inner> data, Work work) -> decltype(work(*data->Box))
  {
    Inner& self = *Of(data);
    auto turn = std::make_unique<Turn>(self);
    if (!turn->IsMine)
    {
      throw Error("this renderer is at work: what it calls back, and other threads, may use it when that call is over");
    }
    // The log is handed on when the turn is over, so that its receiver may use the renderer.
    return call(*self.Lines, self.Sink, [&, turn = std::move(turn)] {
      self.Keep();
      return work(*self.Box);
    });
  }

  void Keep()
  {
    const bridge::Stats s = bridge::stats(*this->Box);
    const std::lock_guard<std::mutex> lock(this->LatestMutex);
    this->Latest = { std::string(s.engine), std::string(s.device), std::string(s.adapter), s.cells, s.tetrahedra,
      s.faces_ms, s.upload_ms, s.frame_ms, s.steps, s.retraced_rays, s.device_bytes, s.uploaded_bytes };
  }
};

Renderer::Renderer(const Settings& s)
  : Data(std::make_shared<Inner>(call([] { return bridge::new_log(); }), s))
{
  this->setIntegral(s.integral);
}

Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;
Renderer::~Renderer() = default;

void Renderer::setMesh(const Mesh& mesh, const Matrix* matrix)
{
  Inner::Run(this->Data,
    [&](bridge::Session& session) { bridge::set_mesh(session, Mesh::Inner::Of(mesh), orIdentity(matrix)); });
}

void Renderer::setGrid(const Grid& grid, const Matrix* matrix)
{
  Inner::Run(this->Data,
    [&](bridge::Session& session) { bridge::set_grid(session, Grid::Inner::Of(grid), orIdentity(matrix)); });
}

bool Renderer::movePoints(Numbers points, const Matrix* matrix)
{
  return Inner::Run(this->Data, [&](bridge::Session& session) {
    return bridge::move_points(session, numbers("points", points), orIdentity(matrix));
  });
}

bool Renderer::movePoints(const Mesh& mesh, const Matrix* matrix)
{
  return Inner::Run(this->Data,
    [&](bridge::Session& session) { return bridge::move_mesh(session, Mesh::Inner::Of(mesh), orIdentity(matrix)); });
}

void Renderer::setField(const Mesh& mesh, const std::string& name, int component)
{
  const std::vector<ArrayInfo> arrays = mesh.arrays();
  for (std::size_t i = 0; i < arrays.size(); ++i)
  {
    if (arrays[i].name == name)
    {
      Inner::Run(this->Data,
        [&](bridge::Session& session) { bridge::set_mesh_field(session, Mesh::Inner::Of(mesh), i, component); });
      return;
    }
  }
  throw Error("the mesh has no array called \"" + name + "\"");
}

void Renderer::setField(const std::string& name, Association association, std::size_t components, int component,
  Numbers n, const Numbers* second)
{
  Inner::Run(this->Data, [&](bridge::Session& session) {
    bridge::set_field(session, { str(name), association == Association::Cells, components, component },
      numbers(name.c_str(), n), numbers("the second variable", second ? *second : Numbers(nullptr, 0, n.type)));
  });
}

void Renderer::setTransferFunction(const TransferFunction& function)
{
  std::vector<double> color, opacity;
  for (const auto& knot : function.color)
  {
    color.insert(color.end(), { knot.scalar, knot.rgb[0], knot.rgb[1], knot.rgb[2] });
  }
  for (const auto& knot : function.opacity)
  {
    opacity.insert(opacity.end(), { knot.scalar, knot.opacity });
  }
  std::vector<double> factors, texels;
  for (const auto& knot : function.gradientOpacity)
  {
    factors.insert(factors.end(), { knot.secondVariable, knot.factor });
  }
  const Table2D table = function.table.value_or(Table2D());
  for (const auto& texel : table.texels)
  {
    texels.insert(texels.end(), texel.begin(), texel.end());
  }
  if (function.table && texels.empty())
  {
    throw Error("the table over the scalar and the second variable has no texels");
  }
  Inner::Run(this->Data, [&](bridge::Session& session) {
    rust::Vec<rust::String> widgets;
    for (const std::string& widget : function.widgets)
    {
      widgets.push_back(rust::String::lossy(widget));
    }
    const Shade shade = function.shade.value_or(Shade());
    rust::Vec<bridge::LightSpec> lights;
    for (const Light& l : shade.lights)
    {
      const Light::Cone cone = l.cone.value_or(Light::Cone());
      lights.push_back({ static_cast<bridge::LightKind>(l.kind), l.vector, l.color, l.intensity, l.attenuation,
        l.cone.has_value(), cone.axis, cone.angle, cone.exponent });
    }
    const bridge::ShadeSpec spec = { function.shade.has_value(), shade.ambient, shade.diffuse, shade.specular,
      shade.power, shade.twoSided, shade.reflected };
    bridge::set_transfer(session,
      { slice("colour knots", color.data(), color.size()), slice("opacity knots", opacity.data(), opacity.size()),
        function.unitDistance, function.convention == OpacityConvention::Opacity,
        slice("gradient opacity", factors.data(), factors.size()), std::move(widgets),
        slice("texels", texels.data(), texels.size()), { table.columns, table.rows },
        { table.scalarRange[0], table.scalarRange[1], table.secondRange[0], table.secondRange[1] },
        function.silhouette.has_value(), function.silhouette.value_or(0), spec, std::move(lights) });
  });
}

void Renderer::setIntegral(const Integral& i)
{
  Inner::Run(this->Data, [&](bridge::Session& session) {
    bridge::set_integral(
      session, { str(i.form), i.table, str(i.texels), i.degree, str(i.reconstruction), i.sampleDistance });
  });
}

bool Renderer::render(const View& view, float* pixels, const Progress& progress)
{
  if (view.worldToEye.has_value() != view.eyeToClip.has_value())
  {
    throw Error("the view has one of its two matrices");
  }
  const std::size_t count = sizeOfImage(view.width, view.height);
  check("pixels", pixels, count, sizeof(float));
  std::vector<double> planes;
  for (const ClippingPlane& p : view.planes)
  {
    planes.insert(planes.end(), p.origin.begin(), p.origin.end());
    planes.insert(planes.end(), p.normal.begin(), p.normal.end());
  }
  std::vector<double> crop;
  if (view.cropping)
  {
    crop.assign(view.cropping->planes.begin(), view.cropping->planes.end());
    crop.insert(crop.end(), view.cropping->placement.begin(), view.cropping->placement.end());
  }
  // What is called back may change the view.
  const std::vector<float> depths = view.depths;
  const Camera& c = view.camera;
  const bridge::ViewSpec spec{ view.width, view.height, view.bottomUp, view.maximum, view.worldToEye.has_value(),
    view.worldToEye.value_or(Matrix{}), view.eyeToClip.value_or(Matrix{}),
    { c.position, c.focalPoint, c.viewUp, c.parallel, c.parallel ? c.parallelScale : c.viewAngle, c.clippingRange[0],
      c.clippingRange[1] },
    slice("clipping planes", planes.data(), planes.size()), slice("depths", depths.data(), depths.size()),
    slice("cropping", crop.data(), crop.size()), view.cropping ? view.cropping->regions : 0 };
  const bridge::Progress tell(progress);
  static float none;
  return Inner::Run(this->Data, [&](bridge::Session& session) {
    return bridge::render(session, spec, rust::Slice<float>(count ? pixels : &none, count), tell);
  });
}

Statistics Renderer::statistics() const
{
  const std::shared_ptr<Inner> data = Inner::Of(this->Data);
  if (const Inner::Turn turn(*data); turn.IsMine)
  {
    call([&] { data->Keep(); });
  }
  const std::lock_guard<std::mutex> lock(data->LatestMutex);
  return data->Latest;
}

void saveImage(const std::string& path, std::uint32_t width, std::uint32_t height, const float* pixels,
  const std::array<float, 3>* background)
{
  call([&] {
    bridge::save_image(str(path), width, height, slice("pixels", pixels, sizeOfImage(width, height)),
      slice("background", background ? background->data() : nullptr, background ? 3 : 0));
  });
}

}
