// SPDX-License-Identifier: MIT OR Apache-2.0
// The core's C++ face, without VTK: test_core CUBE.vtu FOLDER
#include "core.h"
#include "expect.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <thread>
#include <utility>

namespace
{

halite::TransferFunction tent()
{
  halite::TransferFunction f;
  f.color = { { 0, { 1, 0.5, 0 } } };
  f.opacity = { { 0, 0 }, { 0.5, 2 }, { 1, 0 } };
  return f;
}

halite::View clippedFromAbove()
{
  halite::View view = fromAbove(32);
  view.camera.clippingRange = { 1, 9 };
  return view;
}

halite::View slanted()
{
  halite::View view = clippedFromAbove();
  view.camera.position = { 3, -2, 4 };
  return view;
}

double farthest(const std::vector<float>& a, const std::vector<float>& b)
{
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
  {
    most = std::max(most, std::abs(double(a[i]) - b[i]));
  }
  return most;
}

std::vector<float> draw(halite::Renderer& renderer, const halite::View& view)
{
  std::vector<float> pixels(4 * view.width * view.height, -1);
  EXPECT(renderer.render(view, pixels.data()));
  return pixels;
}

bool isAll(const std::vector<float>& pixels, double alpha)
{
  for (std::size_t i = 0; i < pixels.size(); i += 4)
  {
    if (std::abs(pixels[i] - alpha) > 1e-5 || std::abs(pixels[i + 1] - alpha / 2) > 1e-5 ||
      std::abs(pixels[i + 3] - alpha) > 1e-5)
    {
      return false;
    }
  }
  return true;
}

const double Whole = 1 - std::exp(-1.0), Half = 1 - std::exp(-0.5);

}

int main(int argc, char** argv)
{
  EXPECT(argc == 3);
  const std::string path = argv[1], folder = argv[2];
  // A mesh of a file.
  const halite::Mesh mesh = halite::Mesh::open(path);
  EXPECT(mesh.points().size() == 24 && mesh.types() == std::vector<std::uint8_t>{ 12 });
  EXPECT(mesh.offsets() == (std::vector<std::uint64_t>{ 0, 8 }) && mesh.connectivity()[7] == 7);
  EXPECT(mesh.cellCounts().size() == 1 && mesh.cellCounts()[0].name == "hexahedron");
  const auto arrays = mesh.arrays();
  EXPECT(arrays.size() == 3 && arrays[1].name == "v" && arrays[1].components == 3 && arrays[1].tuples == 8);
  EXPECT(arrays[1].type == halite::Type::Float32 && arrays[2].association == halite::Association::Cells);
  EXPECT(mesh.arrayValues(2) == std::vector<double>{ 7 });

  halite::Renderer renderer;
  renderer.setMesh(mesh);
  renderer.setField(mesh, "s");
  renderer.setTransferFunction(tent());
  const halite::View view = clippedFromAbove();
  EXPECT(isAll(draw(renderer, view), Whole));
  const auto statistics = renderer.statistics();
  EXPECT(statistics.tetrahedra == 6 && statistics.cells == 1 && statistics.steps > 0 && !statistics.adapter.empty());

  // A mesh of slices, of other types; the same picture.
  const std::vector<float> points{ 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1 };
  const std::vector<std::int32_t> offsets{ 0, 8 }, ids{ 0, 1, 2, 3, 4, 5, 6, 7 };
  const std::vector<std::uint8_t> types{ 12 };
  halite::Mesh own(points, types, offsets, ids);
  const std::vector<double> values{ 0, 0, 0, 0, 1, 1, 1, 1 };
  own.addArray("s", halite::Association::Points, 1, values);
  EXPECT(own.arrays().size() == 1);
  halite::Renderer second({ 1, "cpu", "traverse", "exact" });
  second.setMesh(own);
  second.setField("values", halite::Association::Points, 1, 0, values);
  second.setTransferFunction(tent());
  const auto walked = draw(second, view), drawn = draw(renderer, view);
  const auto near = [](float a, float b) { return std::abs(a - b) < 1e-6; };
  EXPECT(std::equal(walked.begin(), walked.end(), drawn.begin(), drawn.end(), near));
  EXPECT(second.statistics().engine == "traverse");

  // A matrix: twice as thick, twice as much.
  const halite::Renderer::Matrix thick{ 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1 };
  EXPECT(second.movePoints(points, &thick));
  EXPECT(isAll(draw(second, view), 1 - std::exp(-2.0)));
  const halite::Renderer::Matrix mirror{ 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 1, 0, 0, 0, 1 };
  EXPECT(!second.movePoints(points, &mirror));
  second.setMesh(own, &mirror);
  second.setField("values", halite::Association::Points, 1, 0, values);
  EXPECT(isAll(draw(second, view), Whole));
  EXPECT(second.movePoints(own, &mirror));

  // Depths, planes, bottom-up rows, matrices in place of the camera, the maximum.
  halite::View other = view;
  std::vector<float> depths(32 * 32, 1.0f);
  std::fill(depths.begin(), depths.begin() + 32 * 16, static_cast<float>((4.5 - 1) / 8));
  other.depths = depths;
  auto pixels = draw(renderer, other);
  EXPECT(std::abs(pixels[3] - Half) < 1e-5 && std::abs(pixels[pixels.size() - 1] - Whole) < 1e-5);
  other.bottomUp = true;
  const auto upsideDown = draw(renderer, other);
  EXPECT(std::abs(upsideDown[3] - Half) < 1e-5 && std::abs(upsideDown[upsideDown.size() - 1] - Whole) < 1e-5);
  other.depths.pop_back();
  EXPECT(has(failure([&] { draw(renderer, other); }), "1023 depths for an image of 32x32"));
  other.depths.clear();
  other.planes = { { { 0, 0, 0.5 }, { 0, 0, 3 } } };
  EXPECT(isAll(draw(renderer, other), Half));
  other.planes.clear();
  const std::array<double, 16> toEye{ 1, 0, 0, -0.5, 0, 1, 0, -0.5, 0, 0, 1, -5, 0, 0, 0, 1 };
  const std::array<double, 16> toClip{ 2.5, 0, 0, 0, 0, 2.5, 0, 0, 0, 0, -0.25, -1.25, 0, 0, 0, 1 };
  other.worldToEye = toEye;
  EXPECT(has(failure([&] { draw(renderer, other); }), "one of its two matrices"));
  other.eyeToClip = toClip;
  const halite::View copied = std::exchange(other, view);
  EXPECT(isAll(draw(renderer, copied), Whole));
  other = view;
  other.maximum = true;
  pixels = draw(renderer, other);
  EXPECT(std::abs(pixels[3] - 0.0) < 1e-5);

  // Components.
  renderer.setField(mesh, "v", halite::Magnitude);
  halite::TransferFunction flat = tent();
  flat.opacity = { { 1, 0 }, { 5, 1 } };
  renderer.setTransferFunction(flat);
  EXPECT(isAll(draw(renderer, view), Half));

  // Forms of the integral: more of a polynomial's terms are nearer to the exact one.
  halite::TransferFunction hue = tent();
  hue.color = { { 0, { 1, 0, 0 } }, { 0.3, { 0, 1, 0 } }, { 1, { 0, 0, 1 } } };
  second.setTransferFunction(hue);
  const auto exact = draw(second, slanted());
  const auto errorOf = [&](const halite::Integral& integral) {
    second.setIntegral(integral);
    return farthest(draw(second, slanted()), exact);
  };
  halite::Integral integral;
  integral.form = "polynomial";
  integral.degree = 1;
  const double first = errorOf(integral);
  integral.degree = 4;
  const double fourth = errorOf(integral);
  EXPECT(fourth > 0 && fourth < first / 2);
  integral.degree = 0;
  EXPECT(has(failure([&] { second.setIntegral(integral); }), "from 1 to 8"));
  integral = { "polynomial", { 8, -8, 8 } };
  EXPECT(has(failure([&] { second.setIntegral(integral); }), "8 x -8 x 8"));
  integral = { "volume", { 64, 64, -1 } };
  EXPECT(has(failure([&] { second.setIntegral(integral); }), "64 x 64 x -1"));
  EXPECT(has(failure([] { halite::Renderer({ 1, "cpu", "", { "volume", {}, "long" } }); }), "unorm16"));
  EXPECT(farthest(draw(second, slanted()), exact) == fourth);
  // What a form does not use is not read.
  EXPECT(errorOf({ "exact", { 1, -1, 0 }, "none", -3 }) == 0);
  EXPECT(errorOf({ "cylindrical", { 64, 64, 16 }, "float", -3 }) > 0);
  EXPECT(errorOf({}) == 0);

  // Errors are exceptions that say what is wrong, and harm nothing.
  EXPECT(has(failure([] { halite::Mesh::open("/no/such/file.vtu"); }), "/no/such/file.vtu"));
  EXPECT(has(failure([&] { renderer.setField(mesh, "nothing"); }), "nothing"));
  EXPECT(has(failure([&] { renderer.setField(mesh, "v", 3); }), "component"));
  EXPECT(has(failure([&] { renderer.setField("few", halite::Association::Points, 1, 0, std::vector<double>{ 1 }); }),
    "1 value"));
  EXPECT(has(failure([] { halite::Renderer({ 0, "no such device", "", "" }); }), "no such device"));
  EXPECT(has(failure([] { halite::Renderer({ 0, "cpu", "magic", "" }); }), "traverse"));
  EXPECT(has(failure([&] {
    halite::Mesh(points, types, offsets, std::vector<std::int32_t>{ 0, 1, 2, 3, 4, 5, 6, 8 });
  }),
    "point 8"));
  EXPECT(has(failure([&] {
    halite::Mesh(points, types, offsets, std::vector<std::int32_t>{ 0, 1, 2, 3, 4, 5, 6, -1 });
  }),
    "negative"));
  halite::View none = view;
  none.width = 0;
  float buffer[4];
  EXPECT(has(failure([&] { renderer.render(none, buffer); }), "0x32"));
  flat.unitDistance = 0;
  EXPECT(has(failure([&] { renderer.setTransferFunction(flat); }), "unit distance"));
  EXPECT(isAll(draw(renderer, view), Half));

  // Progress, on this thread; an end; an exception.
  halite::View large = view;
  large.width = large.height = 1500;
  std::vector<float> big(4 * 1500 * 1500, -1);
  int told = 0;
  const auto here = std::this_thread::get_id();
  halite::Renderer slow({ 1, "cpu", "", "" });
  slow.setMesh(own);
  slow.setField(own, "s");
  slow.setTransferFunction(tent());
  EXPECT(slow.render(large, big.data(), [&](double share) {
    told += std::this_thread::get_id() == here && share >= 0 && share <= 1;
    return true;
  }));
  EXPECT(told > 0);
  big.assign(big.size(), -1);
  EXPECT(!slow.render(large, big.data(), [](double) { return false; }) && big[0] == -1);
  EXPECT(isAll(draw(slow, view), Whole));

  // Pictures.
  const std::array<float, 3> white{ 1, 1, 1 };
  const auto final = draw(renderer, view);
  for (const char* name : { "a.png", "a.exr", "a.npy" })
  {
    halite::saveImage(folder + "/" + name, 32, 32, final.data(), &white);
    EXPECT(std::ifstream(folder + "/" + name, std::ios::ate | std::ios::binary).tellg() > 100);
  }
  EXPECT(has(failure([&] { halite::saveImage(folder + "/a.bmp", 32, 32, final.data()); }), ".png"));
  EXPECT(std::string(halite::version()).size() >= 5);

  // Two renderers at once.
  std::thread one([&] { EXPECT(isAll(draw(renderer, view), Half)); });
  EXPECT(draw(second, view).size() == final.size());
  one.join();
  return 0;
}
