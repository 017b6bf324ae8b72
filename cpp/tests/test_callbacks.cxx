// SPDX-License-Identifier: MIT OR Apache-2.0
// What C++ programs may do to the core: throw from what it calls back, use it from there, hand it nothing, copy and move.
// No call ends the program, and the next picture is right.
#include "core.h"
#include "expect.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <thread>
#include <vector>

namespace
{

const std::vector<float> Points{ 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1 };
const std::vector<std::int32_t> Offsets{ 0, 8 }, Ids{ 0, 1, 2, 3, 4, 5, 6, 7 };
const std::vector<std::uint8_t> Types{ 12 };
const std::vector<double> Values{ 0, 0, 0, 0, 1, 1, 1, 1 };

halite::Mesh cube()
{
  return halite::Mesh(Points, Types, Offsets, Ids);
}

void fill(halite::Renderer& renderer)
{
  renderer.setMesh(cube());
  renderer.setField("s", halite::Association::Points, 1, 0, Values);
  halite::TransferFunction f;
  f.color = { { 0, { 1, 1, 1 } } };
  f.opacity = { { 0, 1 } };
  renderer.setTransferFunction(f);
}

// Draws, and says whether that is the cube: its rays are 1 long.
bool isRight(halite::Renderer& renderer)
{
  std::vector<float> pixels(4 * 16 * 16);
  return renderer.render(fromAbove(16), pixels.data()) &&
    std::all_of(pixels.begin(), pixels.end(), [](float p) { return std::abs(p - (1 - std::exp(-1.0))) < 1e-5; });
}

// Large enough to be told of.
const std::uint32_t Large = 1200;
std::vector<float> Pixels(4 * Large * Large);

}

int main()
{
  halite::Renderer renderer({ 1, "cpu" });
  fill(renderer);
  EXPECT(isRight(renderer));

  // Whatever the progress function throws.
  const auto thrown = [&](auto what) {
    return failure([&] { renderer.render(fromAbove(Large), Pixels.data(), [&](double) -> bool { throw what; }); });
  };
  EXPECT(has(thrown(std::runtime_error("enough of this")), "enough of this"));
  for (const std::string& message : { thrown(42), thrown("text"), thrown(std::string("text")), thrown(nullptr) })
  {
    EXPECT(has(message, "no std::exception"));
  }
  EXPECT(has(thrown(halite::Error("inner")), "inner"));
  EXPECT(isRight(renderer));

  // Whatever it does with the renderer: it is refused, with a word of its own, and harms nothing.
  std::vector<std::string> refused;
  bool done = false;
  EXPECT(renderer.render(fromAbove(Large), Pixels.data(), [&](double) {
    if (!done)
    {
      done = true;
      const auto tetrahedra = renderer.statistics().tetrahedra;
      EXPECT(tetrahedra == 6);
      float pixel[4];
      refused = { failure([&] { renderer.render(fromAbove(1), pixel); }), failure([&] { fill(renderer); }),
        failure([&] { renderer.movePoints(Points); }), failure([&] { renderer.setIntegral({ "volume" }); }),
        failure([&] { renderer.setTransferFunction({}); }) };
      std::thread([&] { refused.push_back(failure([&] { renderer.render(fromAbove(1), pixel); })); }).join();
    }
    return true;
  }));
  EXPECT(refused.size() == 6);
  for (const std::string& message : refused)
  {
    EXPECT(has(message, "at work") && !has(message, "failed"));
  }
  EXPECT(isRight(renderer));

  // Even ends it, or puts another in its place.
  auto owned = std::make_unique<halite::Renderer>(halite::Settings{ 1, "cpu" });
  fill(*owned);
  EXPECT(owned->render(fromAbove(Large), Pixels.data(), [&](double) {
    owned.reset();
    return true;
  }));
  EXPECT(std::abs(Pixels[4 * 600 * 1200 + 4 * 600] - (1 - std::exp(-1.0))) < 1e-5);
  halite::Renderer replaced({ 1, "cpu" });
  fill(replaced);
  EXPECT(replaced.render(fromAbove(Large), Pixels.data(), [&](double) {
    replaced = halite::Renderer({ 1, "cpu" });
    return true;
  }));
  fill(replaced);
  EXPECT(isRight(replaced));

  // Nothing where something should be, too much, crooked, of no type.
  using halite::Type;
  const auto mesh = [](halite::Numbers points, halite::Numbers types, halite::Numbers offsets, halite::Numbers ids) {
    return failure([&] { halite::Mesh(points, types, offsets, ids); });
  };
  EXPECT(has(mesh({ nullptr, 24, Type::Float32 }, Types, Offsets, Ids), "points: 24 numbers at a null pointer"));
  EXPECT(has(mesh(Points, { nullptr, 1, Type::UInt8 }, Offsets, Ids), "cell types"));
  EXPECT(has(mesh(Points, Types, { nullptr, 2, Type::Int32 }, Ids), "offsets"));
  EXPECT(has(mesh(Points, Types, Offsets, { nullptr, 8, Type::Int64 }), "connectivity"));
  EXPECT(has(
    mesh({ Points.data(), std::numeric_limits<std::size_t>::max(), Type::Float32 }, Types, Offsets, Ids), "memory"));
  const auto* bytes = reinterpret_cast<const char*>(Points.data());
  EXPECT(has(mesh({ bytes + 1, 23, Type::Float32 }, Types, Offsets, Ids), "multiple"));
  EXPECT(has(mesh({ Points.data(), 24, static_cast<Type>(77) }, Types, Offsets, Ids), "77"));
  EXPECT(has(mesh({ Points.data(), 23, Type::Float32 }, Types, Offsets, Ids), "23 numbers"));
  halite::Mesh own = cube();
  EXPECT(has(failure([&] {
    own.addArray("s", halite::Association::Points, 1, { nullptr, 8, Type::Float64 });
  }),
    "null"));
  EXPECT(has(failure([&] { own.addPolyhedra({ nullptr, 2, Type::Int32 }, Offsets, Ids); }), "null"));
  EXPECT(has(failure([&] {
    renderer.setField("s", halite::Association::Points, 1, 0, { nullptr, 8, Type::Int8 });
  }),
    "null"));
  EXPECT(has(failure([&] { renderer.movePoints({ nullptr, 24, Type::Float64 }); }), "null"));
  EXPECT(has(failure([&] { renderer.render(fromAbove(16), nullptr); }), "pixels"));
  EXPECT(has(failure([] { halite::saveImage("nothing.png", 4, 4, nullptr); }), "pixels"));
  const std::uint32_t most = std::numeric_limits<std::uint32_t>::max();
  halite::View vast = fromAbove(16);
  vast.width = vast.height = most;
  EXPECT(has(failure([&] { renderer.render(vast, Pixels.data()); }), "larger than memory"));
  EXPECT(has(failure([&] { halite::saveImage("nothing.png", most, most, Pixels.data()); }), "larger than memory"));
  EXPECT(mesh({ nullptr, 0, Type::Float64 }, { nullptr, 0, Type::UInt8 }, std::vector<std::int64_t>{ 0 },
           { nullptr, 0, Type::Int64 }) == "");
  EXPECT(isRight(renderer));

  // What was moved away says so.
  halite::Renderer taken = std::move(renderer);
  EXPECT(isRight(taken));
  EXPECT(has(failure([&] { renderer.render(fromAbove(1), Pixels.data()); }), "moved"));
  EXPECT(has(failure([&] { renderer.statistics(); }), "moved"));
  halite::Mesh there = std::move(own);
  EXPECT(has(failure([&] { own.points(); }), "moved"));
  EXPECT(has(failure([&] { taken.setMesh(own); }), "moved"));
  EXPECT(there.points().size() == 24);

  // Each renderer has its own log, which may use the renderer, and throw.
  std::vector<std::string> lines[2];
  halite::Renderer* user = nullptr;
  halite::Settings settings[2];
  for (int i = 0; i < 2; ++i)
  {
    settings[i].threads = 1;
    settings[i].device = "cpu";
    settings[i].log = [&lines, &user, i](halite::Level, const std::string& line) {
      lines[i].push_back(line);
      if (user)
      {
        EXPECT(user->statistics().engine == "traverse");
        throw 42;
      }
    };
  }
  halite::Renderer first(settings[0]), second(settings[1]);
  user = &first;
  const halite::Mesh surface(
    Points, std::vector<std::uint8_t>{ 9 }, std::vector<std::int32_t>{ 0, 4 }, std::vector<std::int32_t>{ 0, 1, 2, 3 });
  first.setMesh(surface);
  EXPECT(!lines[0].empty() && has(lines[0][0], "nothing is drawn") && lines[1].empty());
  user = nullptr;
  fill(second);
  EXPECT(isRight(second) && lines[1].empty());
  std::vector<float> pixels(4);
  EXPECT(first.render(fromAbove(1), pixels.data()) && pixels[3] == 0);

  // Points that are not finite leave out their cells, under a matrix too; and come back when they are.
  std::vector<float> broken = Points;
  broken[0] = std::numeric_limits<float>::quiet_NaN();
  const halite::Renderer::Matrix thick{ 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1 };
  first.setMesh(halite::Mesh(broken, Types, Offsets, Ids), &thick);
  first.setField("s", halite::Association::Points, 1, 0, Values);
  EXPECT(first.movePoints(broken) && !first.movePoints(Points));
  fill(first);
  EXPECT(isRight(first) && !first.movePoints(broken));
  return 0;
}
