// SPDX-License-Identifier: MIT OR Apache-2.0
// What the parts of halite.h share: calls of the bridge, and what is handed to them. Not installed.
#pragma once

#include "halite.h"

// rust::Error is not in the header of the bridge.
#include "rust/cxx.h"

#include "halite-bridge/src/lib.rs.h"

#include <cstdint>
#include <utility>

namespace halite
{
namespace bridged
{

inline Level levelOf(const std::string& line)
{
  if (line.compare(0, 4, "INFO") == 0)
  {
    return Level::Info;
  }
  return line.compare(0, 5, "ERROR") == 0 ? Level::Error : Level::Warning;
}

// Gives a sink the lines that were collected for it.
inline void drain(const bridge::Log& lines, const Log& sink)
{
  if (!sink)
  {
    return;
  }
  try
  {
    for (const rust::String& raw : bridge::take_lines(lines))
    {
      const std::string line(raw.data(), raw.size());
      const std::size_t space = line.find(' ');
      sink(levelOf(line), space == std::string::npos ? line : line.substr(space + 1));
    }
  }
  catch (...)
  {
    // A log that cannot be written is no reason to fail.
  }
}

// Runs a call of the bridge: its errors become ours.
template <class Work>
auto call(Work work) -> decltype(work())
{
  try
  {
    return work();
  }
  catch (const rust::Error& error)
  {
    throw Error(error.what());
  }
}

// The same; what it logged is handed on, whether it failed or not, when `work` is gone.
template <class Work>
auto call(const bridge::Log& lines, const Log& sink, Work&& work) -> decltype(work())
{
  struct Drain
  {
    const bridge::Log& Lines;
    const Log& Sink;
    ~Drain() { drain(this->Lines, this->Sink); }
  } drain{ lines, sink };
  return call(std::forward<Work>(work));
}

inline std::size_t sizeOf(Type type)
{
  static const std::size_t sizes[] = { 1, 1, 2, 2, 4, 4, 8, 8, 4, 8 };
  const auto index = static_cast<std::size_t>(type);
  if (index >= sizeof sizes / sizeof *sizes)
  {
    throw Error("there is no type of numbers " + std::to_string(index));
  }
  return sizes[index];
}

// Whether so many numbers can lie there.
inline void check(const char* what, const void* data, std::size_t count, std::size_t size)
{
  if (count == 0)
  {
    return;
  }
  if (!data)
  {
    throw Error(std::string(what) + ": " + std::to_string(count) + " numbers at a null pointer");
  }
  if (count > static_cast<std::size_t>(PTRDIFF_MAX) / size)
  {
    throw Error(std::string(what) + ": " + std::to_string(count) + " numbers are more than memory has room for");
  }
  if (reinterpret_cast<std::uintptr_t>(data) % size != 0)
  {
    throw Error(
      std::string(what) + ": numbers of " + std::to_string(size) + " bytes at an address that is no multiple of that");
  }
}

template <class T>
rust::Slice<const T> slice(const char* what, const T* data, std::size_t count)
{
  // An empty slice must not be null either.
  static const T none{};
  check(what, data, count, sizeof(T));
  return { count ? data : &none, count };
}

inline bridge::Numbers numbers(const char* what, const Numbers& n)
{
  const std::size_t size = sizeOf(n.type);
  check(what, n.data, n.count, size);
  return { static_cast<bridge::Type>(n.type), slice(what, static_cast<const std::uint8_t*>(n.data), n.count * size) };
}

inline rust::Str str(const std::string& s)
{
  return { s.data(), s.size() };
}

template <class T>
std::vector<T> copy(const rust::Vec<T>& v)
{
  return std::vector<T>(v.begin(), v.end());
}

}

struct Mesh::Inner
{
  rust::Box<bridge::Mesh> Box;

  // The mesh of a face that still has one.
  static bridge::Mesh& Of(const Mesh& mesh)
  {
    if (!mesh.Data)
    {
      throw Error("this mesh was moved elsewhere");
    }
    return *mesh.Data->Box;
  }
};

struct Grid::Inner
{
  rust::Box<bridge::Grid> Box;

  static bridge::Grid& Of(const Grid& grid)
  {
    if (!grid.Data)
    {
      throw Error("this grid was moved elsewhere");
    }
    return *grid.Data->Box;
  }
};

}
