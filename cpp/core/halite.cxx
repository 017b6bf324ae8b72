// SPDX-License-Identifier: MIT OR Apache-2.0
// The face that halite.h shows, made of the bridge. Nothing of the bridge is visible from outside.
#include "halite.h"

// rust::Error is not in the header of the bridge.
#include "rust/cxx.h"

#include "halite/src/ffi.rs.h"

#include <mutex>

namespace halite
{
namespace
{

std::mutex LogMutex;
std::function<void(Level, const std::string&)> Sink;

Level levelOf(const std::string& line)
{
  if (line.compare(0, 4, "INFO") == 0)
  {
    return Level::Info;
  }
  return line.compare(0, 5, "ERROR") == 0 ? Level::Error : Level::Warning;
}

void drainLog()
{
  std::function<void(Level, const std::string&)> sink;
  {
    std::lock_guard<std::mutex> lock(LogMutex);
    sink = Sink;
  }
  if (!sink)
  {
    return;
  }
  for (const rust::String& raw : bridge::take_log_lines())
  {
    const std::string line(raw.data(), raw.size());
    const std::size_t space = line.find(' ');
    sink(levelOf(line), space == std::string::npos ? line : line.substr(space + 1));
  }
}

// Runs a call of the bridge: its errors become ours, and what it logged is handed on, whether it failed or not.
template <class Work>
auto call(Work work) -> decltype(work())
{
  struct Drain
  {
    ~Drain()
    {
      try
      {
        drainLog();
      }
      catch (...)
      {
        // A log that cannot be written is no reason to fail.
      }
    }
  } drain;
  try
  {
    return work();
  }
  catch (const rust::Error& error)
  {
    throw Error(error.what());
  }
}

std::size_t sizeOf(Type type)
{
  static const std::size_t sizes[] = { 1, 1, 2, 2, 4, 4, 8, 8, 4, 8 };
  return sizes[static_cast<int>(type)];
}

template <class T>
rust::Slice<const T> slice(const T* data, std::size_t count)
{
  // An empty slice must not be null either.
  static const T none{};
  return { count ? data : &none, count };
}

bridge::Numbers numbers(const Numbers& n)
{
  return { static_cast<bridge::Type>(n.type),
    slice(static_cast<const std::uint8_t*>(n.data), n.count * sizeOf(n.type)) };
}

rust::Str str(const std::string& s)
{
  return { s.data(), s.size() };
}

std::array<double, 16> orIdentity(const Renderer::Matrix* matrix)
{
  return matrix ? *matrix : std::array<double, 16>{ 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1 };
}

template <class T>
std::vector<T> copy(const rust::Vec<T>& v)
{
  return std::vector<T>(v.begin(), v.end());
}

}

Error::~Error() = default;

void setLog(std::function<void(Level, const std::string&)> sink)
{
  if (sink)
  {
    call([] { bridge::keep_log_lines(); });
  }
  std::lock_guard<std::mutex> lock(LogMutex);
  Sink = std::move(sink);
}

const char* version()
{
  return HALITE_VERSION;
}

struct Mesh::Inner
{
  rust::Box<bridge::Mesh> Box;
};

Mesh Mesh::open(const std::string& path)
{
  Mesh mesh(Numbers(), Numbers(nullptr, 0, Type::UInt8), std::vector<std::int64_t>{ 0 }, std::vector<std::int64_t>{});
  mesh.Data->Box = call([&] { return bridge::open_mesh(str(path), 0); });
  return mesh;
}

Mesh::Mesh(Numbers points, Numbers types, Numbers offsets, Numbers connectivity)
{
  if (types.type != Type::UInt8)
  {
    throw Error("cell types are bytes");
  }
  this->Data.reset(new Inner{ call([&] {
    return bridge::new_mesh(numbers(points), numbers(types).bytes, numbers(offsets), numbers(connectivity));
  }) });
}

Mesh::Mesh(Mesh&&) noexcept = default;
Mesh& Mesh::operator=(Mesh&&) noexcept = default;
Mesh::~Mesh() = default;

void Mesh::addPolyhedra(Numbers cells, Numbers faces, Numbers points)
{
  call([&] { bridge::add_polyhedra(*this->Data->Box, numbers(cells), numbers(faces), numbers(points)); });
}

void Mesh::addArray(const std::string& name, Association association, std::size_t components, Numbers n)
{
  call([&] {
    bridge::add_array(*this->Data->Box, str(name), association == Association::Cells, components, numbers(n));
  });
}

std::vector<ArrayInfo> Mesh::arrays() const
{
  std::vector<ArrayInfo> result;
  for (const bridge::ArrayInfo& a : call([&] { return bridge::arrays(*this->Data->Box); }))
  {
    result.push_back({ std::string(a.name), a.of_cells ? Association::Cells : Association::Points,
      static_cast<Type>(a.kind), a.components, a.tuples });
  }
  return result;
}

std::vector<double> Mesh::arrayValues(std::size_t index) const
{
  return call([&] { return copy(bridge::array_values(*this->Data->Box, index)); });
}

std::vector<CellCount> Mesh::cellCounts() const
{
  std::vector<CellCount> result;
  for (const bridge::CellCount& c : call([&] { return bridge::cell_counts(*this->Data->Box); }))
  {
    result.push_back({ c.vtk_type, std::string(c.name), c.count });
  }
  return result;
}

std::vector<double> Mesh::points() const
{
  return call([&] { return copy(bridge::points(*this->Data->Box)); });
}

std::vector<std::uint8_t> Mesh::types() const
{
  return call([&] { return copy(bridge::types(*this->Data->Box)); });
}

std::vector<std::uint64_t> Mesh::offsets() const
{
  return call([&] { return copy(bridge::offsets(*this->Data->Box)); });
}

std::vector<std::uint32_t> Mesh::connectivity() const
{
  return call([&] { return copy(bridge::connectivity(*this->Data->Box)); });
}

struct Renderer::Inner
{
  rust::Box<bridge::Session> Box;
};

Renderer::Renderer(const Settings& s)
  : Data(new Inner{ call([&] { return bridge::new_session(s.threads, str(s.device), str(s.engine)); }) })
{
  this->setIntegral(s.integral);
}

Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;
Renderer::~Renderer() = default;

void Renderer::setMesh(const Mesh& mesh, const Matrix* matrix)
{
  call([&] { bridge::set_mesh(*this->Data->Box, *mesh.Data->Box, orIdentity(matrix)); });
}

bool Renderer::movePoints(Numbers points, const Matrix* matrix)
{
  return call([&] { return bridge::move_points(*this->Data->Box, numbers(points), orIdentity(matrix)); });
}

bool Renderer::movePoints(const Mesh& mesh, const Matrix* matrix)
{
  return call([&] { return bridge::move_mesh(*this->Data->Box, *mesh.Data->Box, orIdentity(matrix)); });
}

void Renderer::setField(const Mesh& mesh, const std::string& name, int component)
{
  const std::vector<ArrayInfo> arrays = mesh.arrays();
  for (std::size_t i = 0; i < arrays.size(); ++i)
  {
    if (arrays[i].name == name)
    {
      call([&] { bridge::set_mesh_field(*this->Data->Box, *mesh.Data->Box, i, component); });
      return;
    }
  }
  throw Error("the mesh has no array called \"" + name + "\"");
}

void Renderer::setField(
  const std::string& name, Association association, std::size_t components, int component, Numbers n)
{
  call([&] {
    bridge::set_field(
      *this->Data->Box, { str(name), association == Association::Cells, components, component }, numbers(n));
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
  call([&] {
    bridge::set_transfer(*this->Data->Box,
      { slice(color.data(), color.size()), slice(opacity.data(), opacity.size()), function.unitDistance,
        function.convention == OpacityConvention::Opacity });
  });
}

void Renderer::setIntegral(const Integral& i)
{
  call([&] {
    bridge::set_integral(*this->Data->Box,
      { str(i.form), i.table, str(i.lengths), str(i.texels), i.degree, str(i.alpha), str(i.planes) });
  });
}

bool Renderer::render(const View& view, float* pixels, const Progress& progress)
{
  if ((view.worldToEye != nullptr) != (view.eyeToClip != nullptr))
  {
    throw Error("the view has one of its two matrices");
  }
  std::vector<double> planes;
  for (const ClippingPlane& p : view.planes)
  {
    planes.insert(planes.end(), p.origin.begin(), p.origin.end());
    planes.insert(planes.end(), p.normal.begin(), p.normal.end());
  }
  const Camera& c = view.camera;
  const std::size_t count = std::size_t(view.width) * view.height;
  const bridge::ViewSpec spec{ view.width, view.height, view.bottomUp, view.maximum, view.worldToEye != nullptr,
    orIdentity(view.worldToEye), orIdentity(view.eyeToClip),
    { c.position, c.focalPoint, c.viewUp, c.parallel, c.parallel ? c.parallelScale : c.viewAngle, c.clippingRange[0],
      c.clippingRange[1] },
    slice(planes.data(), planes.size()), slice(view.depths, view.depths ? count : 0) };
  const bridge::Progress tell(progress);
  static float none;
  return call([&] {
    return bridge::render(
      *this->Data->Box, spec, rust::Slice<float>(count ? pixels : &none, 4 * count), tell);
  });
}

Statistics Renderer::statistics() const
{
  const bridge::Stats s = call([&] { return bridge::stats(*this->Data->Box); });
  return { std::string(s.engine), std::string(s.device), std::string(s.adapter), s.cells, s.tetrahedra, s.faces_ms,
    s.upload_ms, s.frame_ms, s.steps, s.repaired_rays, s.device_bytes, s.uploaded_bytes };
}

void saveImage(const std::string& path, std::uint32_t width, std::uint32_t height, const float* pixels,
  const std::array<float, 3>* background)
{
  call([&] {
    bridge::save_image(str(path), width, height, slice(pixels, 4 * std::size_t(width) * height),
      slice(background ? background->data() : nullptr, background ? 3 : 0));
  });
}

}
