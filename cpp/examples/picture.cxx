// SPDX-License-Identifier: MIT OR Apache-2.0
// Reads a mesh and writes a picture of it: all that Halite needs, without VTK.
//
//   picture MESH.vtu PICTURE.png [ARRAY]
#include <halite.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

int main(int argc, char** argv)
{
  if (argc < 3)
  {
    std::fprintf(stderr, "usage: %s MESH.vtu PICTURE.png [ARRAY]\n", argv[0]);
    return 2;
  }
  try
  {
    const halite::Log log = [](halite::Level, const std::string& line) { std::fprintf(stderr, "%s\n", line.c_str()); };
    const halite::Mesh mesh = halite::Mesh::open(argv[1], log);
    for (const auto& cells : mesh.cellCounts())
    {
      std::printf("%zu cells: %s\n", cells.count, cells.name.c_str());
    }

    // The array, and its range.
    const auto arrays = mesh.arrays();
    const auto found = std::find_if(arrays.begin(), arrays.end(),
      [&](const halite::ArrayInfo& a) { return argc > 3 ? a.name == argv[3] : a.components == 1; });
    if (found == arrays.end())
    {
      throw halite::Error("the mesh has no such array");
    }
    auto values = mesh.arrayValues(found - arrays.begin());
    values.erase(
      std::remove_if(values.begin(), values.end(), [](double v) { return !std::isfinite(v); }), values.end());
    if (values.empty())
    {
      throw halite::Error("the array holds no finite value");
    }
    const auto range = std::minmax_element(values.begin(), values.end());
    const double lo = *range.first, hi = *range.second;
    std::printf("%s: %g to %g\n", found->name.c_str(), lo, hi);

    // The box around the points.
    const auto points = mesh.points();
    std::array<double, 3> low{ 1e300, 1e300, 1e300 }, high{ -1e300, -1e300, -1e300 };
    for (std::size_t i = 0; i < points.size(); ++i)
    {
      low[i % 3] = std::min(low[i % 3], points[i]);
      high[i % 3] = std::max(high[i % 3], points[i]);
    }
    const double size = std::hypot(high[0] - low[0], high[1] - low[1], high[2] - low[2]);

    halite::TransferFunction function;
    function.color = { { lo, { 0.1, 0.2, 0.8 } }, { (lo + hi) / 2, { 0.9, 0.9, 0.8 } }, { hi, { 0.8, 0.1, 0.1 } } };
    function.opacity = { { lo, 0 }, { hi, 1 } };
    function.unitDistance = size / 8;

    halite::View view;
    for (int k = 0; k < 3; ++k)
    {
      view.camera.focalPoint[k] = (low[k] + high[k]) / 2;
    }
    view.camera.position = view.camera.focalPoint;
    view.camera.position[0] += 0.9 * size;
    view.camera.position[1] -= 1.6 * size;
    view.camera.position[2] += 0.8 * size;
    view.camera.viewUp = { 0, 0, 1 };

    halite::Settings settings;
    settings.log = log;
    halite::Renderer renderer(settings);
    renderer.setMesh(mesh);
    renderer.setField(mesh, found->name);
    renderer.setTransferFunction(function);
    std::vector<float> pixels(4 * view.width * view.height);
    renderer.render(view, pixels.data(), [](double share) {
      std::printf("%.0f %%\n", 100 * share);
      return true;
    });
    const auto statistics = renderer.statistics();
    std::printf("%llu tetrahedra in %.1f ms on %s\n", static_cast<unsigned long long>(statistics.tetrahedra),
      statistics.frameMs, statistics.adapter.c_str());
    const std::array<float, 3> white{ 1, 1, 1 };
    halite::saveImage(argv[2], view.width, view.height, pixels.data(), &white);
  }
  catch (const halite::Error& error)
  {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
