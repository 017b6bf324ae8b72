// SPDX-License-Identifier: MIT OR Apache-2.0
/**
 * @file halite.h
 * @brief Halite for C++17: exact volume rendering of unstructured grids, with no VTK in sight.
 *
 * @code
 * halite::Mesh mesh = halite::Mesh::open("disk.vtu");
 * halite::Renderer renderer;
 * renderer.setMesh(mesh);
 * renderer.setField(mesh, "Temp");
 * halite::TransferFunction function;
 * function.color = { { 293, { 0, 0, 1 } }, { 913, { 1, 0, 0 } } };
 * function.opacity = { { 293, 0 }, { 913, 1 } };
 * renderer.setTransferFunction(function);
 * halite::View view;
 * view.camera.position = { 0, -30, 10 };
 * std::vector<float> pixels(4 * view.width * view.height);
 * renderer.render(view, pixels.data());
 * @endcode
 *
 * What fails throws halite::Error, whose what() is one line that says what, where, and what would help; no call ends the
 * program. Meshes and renderers may be moved, not copied; one may be used by one thread at a time, two by two at once. Until
 * version 1, a new minor version may change this face, and has another SOVERSION then.
 */
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#if defined(_WIN32)
#if defined(halite_EXPORTS)
#define HALITE_EXPORT __declspec(dllexport)
#else
#define HALITE_EXPORT __declspec(dllimport)
#endif
#else
#define HALITE_EXPORT __attribute__((visibility("default")))
#endif

namespace halite
{

/// What every failure of Halite is in C++.
class HALITE_EXPORT Error : public std::runtime_error
{
public:
  using std::runtime_error::runtime_error;
  ~Error() override;
};

/// Types of numbers that arrays may be made of.
enum class Type
{
  Int8,
  UInt8,
  Int16,
  UInt16,
  Int32,
  UInt32,
  Int64,
  UInt64,
  Float32,
  Float64
};

/// Numbers of some type that lie one after another in the caller's memory. They are read during the call only, and not
/// copied before.
struct HALITE_EXPORT Numbers
{
  const void* data = nullptr;
  std::size_t count = 0;
  Type type = Type::Float64;

  Numbers() = default;
  Numbers(const void* data, std::size_t count, Type type)
    : data(data)
    , count(count)
    , type(type)
  {
  }
  Numbers(const std::vector<float>& v)
    : Numbers(v.data(), v.size(), Type::Float32)
  {
  }
  Numbers(const std::vector<double>& v)
    : Numbers(v.data(), v.size(), Type::Float64)
  {
  }
  Numbers(const std::vector<std::uint8_t>& v)
    : Numbers(v.data(), v.size(), Type::UInt8)
  {
  }
  Numbers(const std::vector<std::int32_t>& v)
    : Numbers(v.data(), v.size(), Type::Int32)
  {
  }
  Numbers(const std::vector<std::int64_t>& v)
    : Numbers(v.data(), v.size(), Type::Int64)
  {
  }
};

/// Whether an array has a tuple for each point or for each cell.
enum class Association
{
  Points,
  Cells
};

/// What a mesh knows of one of its arrays.
struct ArrayInfo
{
  std::string name;
  Association association = Association::Points;
  Type type = Type::Float64;
  std::size_t components = 0;
  std::size_t tuples = 0;
};

/// How many cells of one of VTK's types a mesh has.
struct CellCount
{
  std::uint8_t vtkType = 0;
  std::string name;
  std::size_t count = 0;
};

/// Level of a line of the log.
enum class Level
{
  Info,
  Warning,
  Error
};

/// Receives the log of one renderer, or of a file that is read, line by line: at the end of those calls that logged
/// something, on their thread. What it throws is dropped.
using Log = std::function<void(Level, const std::string&)>;

/// The version of the library, such as "0.1.0".
HALITE_EXPORT const char* version();

/// An unstructured grid: points, cells of VTK's types, arrays.
class HALITE_EXPORT Mesh
{
public:
  /// Reads a .vtu or legacy .vtk file; what is wrong with it but does no harm goes to `log`.
  static Mesh open(const std::string& path, const Log& log = {});

  /// Makes a mesh of `points` (x, y, z for each; any type of number) and cells as vtkCellArray keeps them: `types` has
  /// VTK's type of each cell, cell i has the points `connectivity[offsets[i]]` up to `connectivity[offsets[i + 1]]`, so
  /// that there is one offset more than cells. Offsets and connectivity are integers of 32 or 64 bits.
  Mesh(Numbers points, Numbers types, Numbers offsets, Numbers connectivity);

  Mesh(Mesh&&) noexcept;
  Mesh& operator=(Mesh&&) noexcept;
  ~Mesh();

  /// Says what faces the polyhedra (VTK's type 42) among the cells have; without it they are not drawn. Cell i has the
  /// faces cells[i] to cells[i + 1] (none if it is no polyhedron), face j the points points[faces[j]] to
  /// points[faces[j + 1]].
  void addPolyhedra(Numbers cells, Numbers faces, Numbers points);

  /// Adds a copy of an array, in tuples of `components`. One called "vtkGhostType" says which cells and points are
  /// left out, as in VTK.
  void addArray(const std::string& name, Association, std::size_t components, Numbers);

  /// The arrays, those of points first.
  std::vector<ArrayInfo> arrays() const;
  /// The numbers of an array, which is counted as arrays() does.
  std::vector<double> arrayValues(std::size_t index) const;
  /// How many cells there are of each type.
  std::vector<CellCount> cellCounts() const;
  /// x, y and z of each point.
  std::vector<double> points() const;
  /// VTK's type of each cell.
  std::vector<std::uint8_t> types() const;
  /// Where the points of each cell start in connectivity(), and the end.
  std::vector<std::uint64_t> offsets() const;
  /// The points of the cells.
  std::vector<std::uint32_t> connectivity() const;

private:
  friend class Renderer;
  struct Inner;
  std::unique_ptr<Inner> Data;
};

/// A regular or rectilinear grid: points at all triples of the coordinates along three axes, turned and moved; no list of cells. The
/// field is trilinear between points, or constant in a cell.
class HALITE_EXPORT Grid
{
public:
  /// Point (i, j, k) is at origin + direction · (x[i], y[j], z[k]); i is counted fastest, then j. Coordinates are any type of number,
  /// and ascend or descend from one to the next. `direction` is a matrix, rows one after another.
  Grid(Numbers x, Numbers y, Numbers z, const std::array<double, 3>& origin = { 0, 0, 0 },
    const std::array<double, 9>& direction = { 1, 0, 0, 0, 1, 0, 0, 0, 1 });

  Grid(Grid&&) noexcept;
  Grid& operator=(Grid&&) noexcept;
  ~Grid();

  /// Adds a copy of an array, in tuples of `components`. One called "vtkGhostType" says which cells and points are
  /// left out, as in VTK.
  void addArray(const std::string& name, Association, std::size_t components, Numbers);

private:
  friend class Renderer;
  struct Inner;
  std::unique_ptr<Inner> Data;
};

/// What of an array's tuples is drawn: a component, counted from 0, or one of these.
enum Component : int
{
  /// The Euclidean length of the tuple.
  Magnitude = -1,
  /// All of them: two are a value of the colour function and one of the opacity function; four are red, green and blue
  /// (0 to 1, or bytes) and a value of the opacity function.
  AllComponents = -2
};

/// How opacity a and the unit distance d give the extinction per unit of length.
enum class OpacityConvention
{
  /// a / d, as in VTK's mappers of unstructured grids.
  Extinction,
  /// −ln(1 − a) / d, as in VTK's mappers of image data: a is the opacity of a slab d thick.
  Opacity
};

/// Colour and opacity over the scalar s and the second variable g: bilinear between the centres of texels, constant beyond them.
struct Table2D
{
  std::size_t columns = 0, rows = 0;
  /// Row by row from the least g: red, green and blue in [0, 1], not multiplied by opacity, and opacity.
  std::vector<std::array<double, 4>> texels;
  /// From edge to edge of the outer texels.
  std::array<double, 2> scalarRange = { 0, 1 }, secondRange = { 0, 1 };
};

/// A light; nothing throws a shadow.
struct Light
{
  enum class Kind
  {
    /// From the eye, along each ray.
    Headlight,
    Direction,
    Position
  };
  struct Cone
  {
    std::array<double, 3> axis = { 0, 0, -1 };
    /// Between axis and side, in degrees; above 0, and 90 at most.
    double angle = 30;
    /// Of the cosine of the angle to the axis, by whose power the light gets weaker.
    double exponent = 1;
  };
  Kind kind = Kind::Headlight;
  /// Where a direction goes, or where a position is, in world coordinates.
  std::array<double, 3> vector = { 0, 0, -1 };
  std::array<double, 3> color = { 1, 1, 1 };
  double intensity = 1;
  /// (a, b, c): a position that is r away is 1/(a + b r + c r^2) as strong.
  std::array<double, 3> attenuation = { 1, 0, 0 };
  /// Of a position: what it lights.
  std::optional<Cone> cone;
};

/// Phong's terms, with the unit vector of the gradient as normal.
struct Shade
{
  double ambient = 0.1, diffuse = 0.7, specular = 0.2, power = 10;
  /// Else only the side that the gradient points to is lit.
  bool twoSided = true;
  /// Whether highlights are of the reflected vector, as in VTK's shaders, and not of that half way between light and eye.
  bool reflected = false;
  std::vector<Light> lights = { Light() };
};

/// Colour and opacity, piecewise linear between knots that ascend in the scalar; constant beyond them. Two knots at one
/// scalar are a step.
struct TransferFunction
{
  struct ColorKnot
  {
    double scalar;
    std::array<double, 3> rgb;
  };
  struct OpacityKnot
  {
    double scalar;
    double opacity;
  };
  struct GradientKnot
  {
    double secondVariable;
    double factor;
  };
  std::vector<ColorKnot> color;
  std::vector<OpacityKnot> opacity;
  double unitDistance = 1;
  OpacityConvention convention = OpacityConvention::Extinction;
  /// What extinction is multiplied by, over the second variable: the length of the field's gradient, or another array. Constant
  /// beyond the knots; 1 if there are none.
  std::vector<GradientKnot> gradientOpacity;
  /// Widgets over both variables in the place of colour and opacity, as scene files have them:
  /// {"type": "gaussian", "center": [0.5, 2], "sigma": [0.1, 1], "color": [1, 0.5, 0], "opacity": 0.8}.
  std::vector<std::string> widgets;
  /// In the place of colour and opacity, too.
  std::optional<Table2D> table;
  /// p, where extinction is multiplied by (1 - |n . d|)^p: n is the unit vector of the gradient, d the direction of the ray.
  std::optional<double> silhouette;
  std::optional<Shade> shade;
};

/// VTK's camera, in world coordinates.
struct Camera
{
  std::array<double, 3> position = { 0, 0, 1 };
  std::array<double, 3> focalPoint = { 0, 0, 0 };
  std::array<double, 3> viewUp = { 0, 1, 0 };
  bool parallel = false;
  /// The vertical angle of view in degrees, for perspective views.
  double viewAngle = 30;
  /// Half the height of a parallel view.
  double parallelScale = 1;
  /// What is seen lies between these distances along the view; everything does unless near < far.
  std::array<double, 2> clippingRange = { 0, 0 };
};

/// A plane that keeps what its normal points into.
struct ClippingPlane
{
  std::array<double, 3> origin;
  std::array<double, 3> normal;
};

/// Two planes across each axis of a space make 27 regions, as vtkVolumeMapper has them, some of which are drawn.
struct Cropping
{
  /// Where the planes are: x, x, y, y, z, z.
  std::array<double, 6> planes = { 0, 1, 0, 1, 0, 1 };
  /// Bit x + 3 y + 9 z is that of region (x, y, z), each from 0 to 2; at first the one between all planes is drawn.
  std::uint32_t regions = 0x0002000;
  /// From the space of the planes to the world, affine, rows one after another.
  std::array<double, 16> placement = { 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1 };
};

/// What to draw, and where from. It holds all that it says, so it may be copied and kept.
struct View
{
  std::uint32_t width = 640;
  std::uint32_t height = 480;
  Camera camera;
  /// OpenGL's matrices, rows one after another, take the place of the camera if they are given: from the world to the
  /// eye, and from there to clip coordinates. Any frustum can be had so.
  std::optional<std::array<double, 16>> worldToEye;
  std::optional<std::array<double, 16>> eyeToClip;
  std::vector<ClippingPlane> planes;
  /// What is drawn is in these regions, if any are named.
  std::optional<Cropping> cropping;
  /// One depth in [0, 1] for each pixel, as OpenGL has it, at which its ray ends; needs matrices or a clipping range. Empty:
  /// nothing ends rays.
  std::vector<float> depths;
  /// Whether row 0 of depths and pixels is the lowest, as in OpenGL, or the uppermost.
  bool bottomUp = false;
  /// Draw the largest value along each ray instead of the integral.
  bool maximum = false;
};

/// What a renderer did, and how long it took.
struct Statistics
{
  std::string engine, device, adapter;
  std::uint64_t cells = 0, tetrahedra = 0;
  double facesMs = 0, uploadMs = 0, frameMs = 0;
  std::uint64_t steps = 0, retracedRays = 0, deviceBytes = 0, uploadedBytes = 0;
};

/// The form of the ray integral, by the names that scenes have for it. Empty names mean the first that is said here. What
/// the form does not use is not read.
struct Integral
{
  /// "exact"; "volume", "polynomial" or "cylindrical": a pre-integrated table; or "auto": exact, or a table where
  /// functions have so many knots that it is faster. Of fields of several components, a table holds how much the colours at both
  /// ends of a segment count; regular and rectilinear grids have tables of one component alone. For such grids that
  /// are rebuilt by parabolas there are "second-order", a table of slabs of one length, and "second-order-polynomial", of all.
  std::string form;
  /// Texels: values in front, values behind, and lengths of a volume or planes of a cylinder. At least 2 x 2 x 3 in a
  /// volume; as many in front as behind in the others; a multiple of 4 planes; polynomials have as many layers as their
  /// degree wants. All 0: as many as suit the function. At most 1 GiB at 16 bytes each.
  std::array<std::int32_t, 3> table = { 0, 0, 0 };
  /// "float", "unorm16" or "unorm8".
  std::string texels;
  /// Of polynomials: 1 to 8.
  std::int32_t degree = 2;
  /// Of regular and rectilinear grids, what stands for the field between samples along rays: "exact" (itself), "2" (parabolas),
  /// "1" (lines), or rectangles by the middle sample, "0", or the sample at either end, "0-left" and "0-right".
  std::string reconstruction;
  /// From sample to sample in world units; 0: at the faces of voxels and midway. Slabs span two steps.
  double sampleDistance = 0;
};

/// How a renderer works; fixed once it is made, but for the integral. Empty names mean the first that is said here.
struct Settings
{
  /// 0: one for each core.
  std::size_t threads = 0;
  /// "auto", "cpu", or a GPU by index, UUID or part of its name.
  std::string device;
  /// "auto": "project" on the CPU, "traverse" on a device for graphics. "traverse": rays walk from cell to cell. "project": cells are
  /// projected. On the CPU their order is verified in every pixel, and pictures are those of the walk. On a device they are put
  /// in an order that is right for every pixel, unless cells overlap.
  std::string engine;
  /// See Renderer::setIntegral.
  Integral integral;
  /// What the renderer logs; nobody else's lines.
  Log log;
};

/// Draws one mesh, or grid, as often as wanted; keeps what does not change between frames. While a call is at work, all others but
/// statistics() and the destructor throw an Error and change nothing, on this thread (from what is called back) and others.
class HALITE_EXPORT Renderer
{
public:
  /// Receives the share that is done, in [0, 1], every 20 ms while a frame is drawn, on the thread that called; false ends
  /// the frame. It may throw anything: render() then throws an Error, with what a std::exception said.
  using Progress = std::function<bool(double)>;
  /// A matrix from the mesh's coordinates to the world, rows one after another; affine.
  using Matrix = std::array<double, 16>;

  explicit Renderer(const Settings& = {});
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;
  ~Renderer();

  /// Draws `mesh`, which is not needed afterwards; the field must be set again. Lengths along rays are lengths in the
  /// world.
  void setMesh(const Mesh& mesh, const Matrix* matrix = nullptr);
  /// Draws `grid` in place of a mesh, as setMesh does: its rays are cast, whatever the engine, on the device or the CPU.
  void setGrid(const Grid& grid, const Matrix* matrix = nullptr);
  /// Moves the points of the mesh, or only its matrix, and keeps all else. False if that cannot be, because the new
  /// matrix makes a mirror image of the old one, other points are not finite than were, or a grid is drawn: then set it again.
  bool movePoints(Numbers points, const Matrix* matrix = nullptr);
  bool movePoints(const Mesh& mesh, const Matrix* matrix = nullptr);
  /// Draws an array of the mesh.
  void setField(const Mesh& mesh, const std::string& name, int component = 0);
  /// Draws numbers, in tuples of `components`, one for each point or cell of the mesh or grid. If `second` is given, it has one
  /// number for each, which is the second variable in the place of the length of the gradient.
  void setField(const std::string& name, Association, std::size_t components, int component, Numbers,
    const Numbers* second = nullptr);
  void setTransferFunction(const TransferFunction&);
  /// Integrates in another form from the next frame on, which waits for its table if one is named. Where the transfer
  /// function alone changes, frames are exact until the new table is built, which happens meanwhile.
  void setIntegral(const Integral&);
  /// Draws into `pixels`, which has room for 4 x width x height: linear premultiplied red, green, blue and opacity of each
  /// pixel, row by row. False if `progress` ended it; `pixels` are then as they were.
  bool render(const View& view, float* pixels, const Progress& progress = {});

  /// Of the calls that are over.
  Statistics statistics() const;

private:
  struct Inner;
  // Shared with a call that is at work: a renderer may go meanwhile.
  std::shared_ptr<Inner> Data;
};

/// Writes `pixels` as render() makes them (row 0 uppermost) to a .png, .exr or .npy file. A .png shows them over
/// `background`, or has an alpha channel without one.
HALITE_EXPORT void saveImage(const std::string& path, std::uint32_t width, std::uint32_t height, const float* pixels,
  const std::array<float, 3>* background = nullptr);

}
