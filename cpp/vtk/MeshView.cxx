// SPDX-License-Identifier: MIT OR Apache-2.0
#include "MeshView.h"

#include "vtkHaliteCompatibility.h"

#include "vtkCellArray.h"
#include "vtkCellData.h"
#include "vtkCellType.h"
#include "vtkDataArray.h"
#include "vtkDataSetAttributes.h"
#include "vtkDoubleArray.h"
#include "vtkIdList.h"
#include "vtkImageData.h"
#include "vtkMatrix3x3.h"
#include "vtkNew.h"
#include "vtkPointData.h"
#include "vtkPointSet.h"
#include "vtkPoints.h"
#include "vtkRectilinearGrid.h"
#include "vtkSOADataArrayTemplate.h"
#include "vtkTypeInt64Array.h"
#include "vtkUnsignedCharArray.h"
#include "vtkUnstructuredGrid.h"

#include <algorithm>
#include <array>
#include <cstring>

namespace halite_vtk
{

namespace
{

// False for what is no number of 8, 16, 32 or 64 bits.
bool TypeOf(int vtkType, halite::Type& type)
{
  const bool isLong64 = sizeof(long) == 8;
  switch (vtkType)
  {
    case VTK_CHAR:
      type = std::is_signed<char>::value ? halite::Type::Int8 : halite::Type::UInt8;
      return true;
    case VTK_SIGNED_CHAR:
      type = halite::Type::Int8;
      return true;
    case VTK_UNSIGNED_CHAR:
      type = halite::Type::UInt8;
      return true;
    case VTK_SHORT:
      type = halite::Type::Int16;
      return true;
    case VTK_UNSIGNED_SHORT:
      type = halite::Type::UInt16;
      return true;
    case VTK_INT:
      type = halite::Type::Int32;
      return true;
    case VTK_UNSIGNED_INT:
      type = halite::Type::UInt32;
      return true;
    case VTK_LONG:
      type = isLong64 ? halite::Type::Int64 : halite::Type::Int32;
      return true;
    case VTK_UNSIGNED_LONG:
      type = isLong64 ? halite::Type::UInt64 : halite::Type::UInt32;
      return true;
    case VTK_LONG_LONG:
      type = halite::Type::Int64;
      return true;
    case VTK_UNSIGNED_LONG_LONG:
      type = halite::Type::UInt64;
      return true;
    case VTK_ID_TYPE:
      type = sizeof(vtkIdType) == 8 ? halite::Type::Int64 : halite::Type::Int32;
      return true;
    case VTK_FLOAT:
      type = halite::Type::Float32;
      return true;
    case VTK_DOUBLE:
      type = halite::Type::Float64;
      return true;
    default:
      return false;
  }
}

// Where one component of an array of structure-of-arrays layout lies; null if the array is none.
const void* ComponentOf(vtkDataArray* array, int component)
{
  switch (array->GetDataType())
  {
    vtkTemplateMacro(if (auto soa = vtkSOADataArrayTemplate<VTK_TT>::FastDownCast(array)) {
      return soa->GetComponentArrayPointer(component);
    });
    default:
      break;
  }
  return nullptr;
}

std::uint64_t Time(vtkObject* object)
{
  return object ? static_cast<std::uint64_t>(object->GetMTime()) : 0;
}

vtkDataArray* Ghosts(vtkDataSetAttributes* attributes)
{
  return attributes->GetArray(vtkDataSetAttributes::GhostArrayName());
}

}

halite::Numbers MeshView::Numbers(vtkDataArray* array, int component)
{
  halite::Type type = halite::Type::Float64;
  const bool known = TypeOf(array->GetDataType(), type);
  const std::size_t tuples = static_cast<std::size_t>(array->GetNumberOfTuples());
  const std::size_t components = static_cast<std::size_t>(array->GetNumberOfComponents());
  if (known && array->HasStandardMemoryLayout())
  {
    return { array->GetVoidPointer(0), tuples * components, type };
  }
  const int only = components == 1 ? 0 : component;
  if (known && only >= 0 && tuples > 0)
  {
    if (const void* data = ComponentOf(array, only))
    {
      return { data, tuples, type };
    }
  }
  auto copy =
    vtkSmartPointer<vtkDataArray>::Take(vtkDataArray::CreateDataArray(known ? array->GetDataType() : VTK_DOUBLE));
  if (component >= 0 && components > 1)
  {
    copy->SetNumberOfTuples(array->GetNumberOfTuples());
    copy->CopyComponent(0, array, component);
  }
  else
  {
    copy->DeepCopy(array);
  }
  this->Kept.push_back(copy);
  ++this->Copies;
  return { copy->GetVoidPointer(0), static_cast<std::size_t>(copy->GetNumberOfValues()), type };
}

halite::Numbers MeshView::Points(vtkDataSet* grid)
{
  if (auto sets = vtkPointSet::SafeDownCast(grid))
  {
    return sets->GetPoints() ? this->Numbers(sets->GetPoints()->GetData()) : halite::Numbers();
  }
  auto points = vtkSmartPointer<vtkDoubleArray>::New();
  points->SetNumberOfComponents(3);
  points->SetNumberOfTuples(grid->GetNumberOfPoints());
  for (vtkIdType i = 0; i < grid->GetNumberOfPoints(); ++i)
  {
    points->SetTuple(i, grid->GetPoint(i));
  }
  ++this->Copies;
  this->Kept.push_back(points);
  return this->Numbers(points);
}

namespace
{

// The faces of the grid's polyhedra, as halite::Mesh::addPolyhedra() takes them.
struct Faces
{
  std::vector<std::int64_t> Cells{ 0 }, Starts{ 0 }, Points;

  explicit Faces(vtkUnstructuredGrid* grid)
  {
    vtkNew<vtkIdList> stream;
    for (vtkIdType cell = 0; cell < grid->GetNumberOfCells(); ++cell)
    {
      if (grid->GetCellType(cell) == VTK_POLYHEDRON)
      {
        // The number of faces; then of each, the number of points, and those.
        grid->GetFaceStream(cell, stream);
        if (stream->GetNumberOfIds() == 0)
        {
          throw halite::Error("the grid has polyhedra, of which cell " + std::to_string(cell) +
            " has no faces: whoever made or read it left these out");
        }
        for (vtkIdType at = 1; at < stream->GetNumberOfIds();)
        {
          const vtkIdType end = at + 1 + stream->GetId(at);
          while (++at < end)
          {
            this->Points.push_back(stream->GetId(at));
          }
          this->Starts.push_back(static_cast<std::int64_t>(this->Points.size()));
        }
      }
      this->Cells.push_back(static_cast<std::int64_t>(this->Starts.size()) - 1);
    }
  }
};

}

halite::Mesh MeshView::Mesh(vtkDataSet* base)
{
  static const std::vector<std::int64_t> zero{ 0 };
  halite::Numbers types(nullptr, 0, halite::Type::UInt8), offsets = zero, connectivity(nullptr, 0, halite::Type::Int64);
  if (auto grid = vtkUnstructuredGrid::SafeDownCast(base))
  {
    vtkCellArray* cells = grid->GetCells();
    vtkDataArray* cellTypes = vtkHaliteCompatibility::GetCellTypes(grid);
    if (cells && cellTypes && cells->GetNumberOfCells() > 0)
    {
      types = this->Numbers(cellTypes);
      offsets = this->Numbers(cells->GetOffsetsArray());
      connectivity = this->Numbers(cells->GetConnectivityArray());
      // VTK leaves room behind what cells name, and anything in it, such as where it removed ghosts.
      const double end = cells->GetOffsetsArray()->GetComponent(cells->GetNumberOfCells(), 0);
      if (end >= 0 && end < static_cast<double>(connectivity.count))
      {
        connectivity.count = static_cast<std::size_t>(end);
      }
    }
  }
  else
  {
    auto t = vtkSmartPointer<vtkUnsignedCharArray>::New();
    auto o = vtkSmartPointer<vtkTypeInt64Array>::New(), c = vtkSmartPointer<vtkTypeInt64Array>::New();
    auto ids = vtkSmartPointer<vtkIdList>::New();
    o->InsertNextValue(0);
    for (vtkIdType i = 0; i < base->GetNumberOfCells(); ++i)
    {
      t->InsertNextValue(static_cast<unsigned char>(base->GetCellType(i)));
      base->GetCellPoints(i, ids);
      for (vtkIdType k = 0; k < ids->GetNumberOfIds(); ++k)
      {
        c->InsertNextValue(ids->GetId(k));
      }
      o->InsertNextValue(c->GetNumberOfValues());
    }
    this->Kept.insert(this->Kept.end(), { t, o, c });
    this->Copies += 3;
    types = this->Numbers(t);
    offsets = this->Numbers(o);
    connectivity = this->Numbers(c);
  }
  halite::Mesh mesh(this->Points(base), types, offsets, connectivity);
  auto grid = vtkUnstructuredGrid::SafeDownCast(base);
  if (grid && types.type == halite::Type::UInt8 && types.count > 0 &&
    std::memchr(types.data, VTK_POLYHEDRON, types.count))
  {
    const Faces faces(grid);
    this->Copies += 3;
    mesh.addPolyhedra(faces.Cells, faces.Starts, faces.Points);
  }
  const std::string name = vtkDataSetAttributes::GhostArrayName();
  if (vtkDataArray* ghosts = Ghosts(base->GetPointData()))
  {
    mesh.addArray(name, halite::Association::Points, 1, this->Numbers(ghosts));
  }
  if (vtkDataArray* ghosts = Ghosts(base->GetCellData()))
  {
    mesh.addArray(name, halite::Association::Cells, 1, this->Numbers(ghosts));
  }
  return mesh;
}

bool MeshView::IsGrid(vtkDataSet* grid)
{
  return vtkImageData::SafeDownCast(grid) || vtkRectilinearGrid::SafeDownCast(grid);
}

bool MeshView::HasGhosts(vtkDataSet* grid)
{
  return Ghosts(grid->GetPointData()) || Ghosts(grid->GetCellData());
}

namespace
{

// Where the values nearest to points end: half way to the next, and at the outer ones.
std::vector<double> Halves(const std::vector<double>& axis)
{
  std::vector<double> ends{ axis.front() };
  for (std::size_t i = 1; i < axis.size(); ++i)
  {
    ends.push_back(axis[i - 1] + (axis[i] - axis[i - 1]) / 2);
  }
  ends.push_back(axis.back());
  return ends;
}

}

halite::Grid MeshView::Grid(vtkDataSet* base, bool isNearest)
{
  std::array<std::vector<double>, 3> axes;
  std::array<double, 3> origin{ 0, 0, 0 };
  std::array<double, 9> direction{ 1, 0, 0, 0, 1, 0, 0, 0, 1 };
  if (auto image = vtkImageData::SafeDownCast(base))
  {
    const int* extent = image->GetExtent();
    const double* spacing = image->GetSpacing();
    for (int a = 0; a < 3; ++a)
    {
      for (int i = extent[2 * a]; i <= extent[2 * a + 1]; ++i)
      {
        axes[a].push_back(spacing[a] * i);
      }
    }
    std::copy_n(image->GetOrigin(), 3, origin.begin());
    std::copy_n(image->GetDirectionMatrix()->GetData(), 9, direction.begin());
  }
  else if (auto grid = vtkRectilinearGrid::SafeDownCast(base))
  {
    vtkDataArray* coordinates[] = { grid->GetXCoordinates(), grid->GetYCoordinates(), grid->GetZCoordinates() };
    for (int a = 0; a < 3; ++a)
    {
      for (vtkIdType i = 0; i < coordinates[a]->GetNumberOfTuples(); ++i)
      {
        axes[a].push_back(coordinates[a]->GetComponent(i, 0));
      }
    }
  }
  for (auto& axis : axes)
  {
    // An axis of one point has no volume, nearest or not.
    axis = isNearest && axis.size() > 1 ? Halves(axis) : axis;
  }
  halite::Grid made(axes[0], axes[1], axes[2], origin, direction);
  const std::string name = vtkDataSetAttributes::GhostArrayName();
  vtkDataArray* ofPoints = isNearest ? nullptr : Ghosts(base->GetPointData());
  if (ofPoints)
  {
    made.addArray(name, halite::Association::Points, 1, this->Numbers(ofPoints));
  }
  vtkDataArray* ofCells = isNearest ? nullptr : Ghosts(base->GetCellData());
  if (ofCells)
  {
    made.addArray(name, halite::Association::Cells, 1, this->Numbers(ofCells));
  }
  return made;
}

std::vector<std::uint64_t> MeshView::Identity(vtkDataSet* base)
{
  auto grid = vtkUnstructuredGrid::SafeDownCast(base);
  if (IsGrid(base))
  {
    // A grid's own time is that of its values, too. But that of its ghosts does not say when one of them was changed.
    std::vector<std::uint64_t> identity{ HasGhosts(base) ? Time(base) : 0 };
    const auto add = [&identity](double value) {
      identity.push_back(0);
      std::memcpy(&identity.back(), &value, sizeof value);
    };
    if (auto image = vtkImageData::SafeDownCast(base))
    {
      std::for_each(image->GetExtent(), image->GetExtent() + 6, add);
      std::for_each(image->GetOrigin(), image->GetOrigin() + 3, add);
      std::for_each(image->GetSpacing(), image->GetSpacing() + 3, add);
      std::for_each(image->GetDirectionMatrix()->GetData(), image->GetDirectionMatrix()->GetData() + 9, add);
    }
    else if (auto axes = vtkRectilinearGrid::SafeDownCast(base))
    {
      for (vtkDataArray* axis : { axes->GetXCoordinates(), axes->GetYCoordinates(), axes->GetZCoordinates() })
      {
        identity.push_back(static_cast<std::uint64_t>(axis->GetNumberOfTuples()));
        for (vtkIdType i = 0; i < axis->GetNumberOfTuples(); ++i)
        {
          add(axis->GetComponent(i, 0));
        }
      }
    }
    return identity;
  }
  if (!grid)
  {
    return { Time(base) };
  }
  vtkCellArray* cells = grid->GetCells();
  vtkPoints* points = grid->GetPoints();
  return { Time(points), Time(points ? points->GetData() : nullptr), Time(cells),
    Time(vtkHaliteCompatibility::GetCellTypes(grid)), Time(Ghosts(grid->GetPointData())),
    Time(Ghosts(grid->GetCellData())), static_cast<std::uint64_t>(grid->GetNumberOfPoints()),
    static_cast<std::uint64_t>(grid->GetNumberOfCells()) };
}

}
