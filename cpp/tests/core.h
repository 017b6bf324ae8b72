// SPDX-License-Identifier: MIT OR Apache-2.0
// What tests of halite.h share.
#pragma once

#include <halite.h>

#include <string>

// What a call throws; empty if nothing.
template <class Work>
std::string failure(Work work)
{
  try
  {
    work();
  }
  catch (const halite::Error& error)
  {
    return error.what();
  }
  return "";
}

inline bool has(const std::string& text, const char* word)
{
  return text.find(word) != std::string::npos;
}

// From above, in parallel, where the rays of all pixels go through the cube from 0 to 1.
inline halite::View fromAbove(std::uint32_t size)
{
  halite::View view;
  view.width = view.height = size;
  view.camera.position = { 0.5, 0.5, 5 };
  view.camera.focalPoint = { 0.5, 0.5, 0.5 };
  view.camera.parallel = true;
  view.camera.parallelScale = 0.4;
  return view;
}
