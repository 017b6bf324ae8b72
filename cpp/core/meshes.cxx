// SPDX-License-Identifier: MIT OR Apache-2.0
// Meshes and grids of halite.h, made of the bridge.
#include "bridged.h"

namespace halite
{

using namespace bridged;

Mesh Mesh::open(const std::string& path, const Log& log)
{
  Mesh mesh(Numbers(), Numbers(nullptr, 0, Type::UInt8), std::vector<std::int64_t>{ 0 }, std::vector<std::int64_t>{});
  const rust::Box<bridge::Log> lines = call([] { return bridge::new_log(); });
  mesh.Data->Box = call(*lines, log, [&] { return bridge::open_mesh(str(path), 0, *lines); });
  return mesh;
}

Mesh::Mesh(Numbers points, Numbers types, Numbers offsets, Numbers connectivity)
{
  if (types.type != Type::UInt8)
  {
    throw Error("cell types are bytes");
  }
  this->Data.reset(new Inner{ call([&] {
    return bridge::new_mesh(numbers("points", points), numbers("cell types", types).bytes, numbers("offsets", offsets),
      numbers("connectivity", connectivity));
  }) });
}

Mesh::Mesh(Mesh&&) noexcept = default;
Mesh& Mesh::operator=(Mesh&&) noexcept = default;
Mesh::~Mesh() = default;

void Mesh::addPolyhedra(Numbers cells, Numbers faces, Numbers points)
{
  call([&] {
    bridge::add_polyhedra(Inner::Of(*this), numbers("starts of cells", cells), numbers("starts of faces", faces),
      numbers("points of faces", points));
  });
}

void Mesh::addArray(const std::string& name, Association association, std::size_t components, Numbers n)
{
  call([&] {
    bridge::add_array(
      Inner::Of(*this), str(name), association == Association::Cells, components, numbers(name.c_str(), n));
  });
}

std::vector<ArrayInfo> Mesh::arrays() const
{
  std::vector<ArrayInfo> result;
  for (const bridge::ArrayInfo& a : call([&] { return bridge::arrays(Inner::Of(*this)); }))
  {
    result.push_back({ std::string(a.name), a.of_cells ? Association::Cells : Association::Points,
      static_cast<Type>(a.kind), a.components, a.tuples });
  }
  return result;
}

std::vector<double> Mesh::arrayValues(std::size_t index) const
{
  return call([&] { return copy(bridge::array_values(Inner::Of(*this), index)); });
}

std::vector<CellCount> Mesh::cellCounts() const
{
  std::vector<CellCount> result;
  for (const bridge::CellCount& c : call([&] { return bridge::cell_counts(Inner::Of(*this)); }))
  {
    result.push_back({ c.vtk_type, std::string(c.name), c.count });
  }
  return result;
}

std::vector<double> Mesh::points() const
{
  return call([&] { return copy(bridge::points(Inner::Of(*this))); });
}

std::vector<std::uint8_t> Mesh::types() const
{
  return call([&] { return copy(bridge::types(Inner::Of(*this))); });
}

std::vector<std::uint64_t> Mesh::offsets() const
{
  return call([&] { return copy(bridge::offsets(Inner::Of(*this))); });
}

std::vector<std::uint32_t> Mesh::connectivity() const
{
  return call([&] { return copy(bridge::connectivity(Inner::Of(*this))); });
}

Grid::Grid(Numbers x, Numbers y, Numbers z, const std::array<double, 3>& origin, const std::array<double, 9>& direction)
{
  this->Data.reset(new Inner{
    call([&] { return bridge::new_grid(numbers("x", x), numbers("y", y), numbers("z", z), origin, direction); }) });
}

Grid::Grid(Grid&&) noexcept = default;
Grid& Grid::operator=(Grid&&) noexcept = default;
Grid::~Grid() = default;

void Grid::addArray(const std::string& name, Association association, std::size_t components, Numbers n)
{
  call([&] {
    bridge::add_grid_array(
      Inner::Of(*this), str(name), association == Association::Cells, components, numbers(name.c_str(), n));
  });
}

}
