// SPDX-License-Identifier: MIT OR Apache-2.0
// Pictures of a volume up to translucent surfaces, of which the parts between these are made.
#pragma once

#include "Peeling.h"

#include <functional>
#include <list>
#include <vector>

namespace halite_vtk
{

class Layers
{
public:
  // Draws rays that end at these depths, one for each pixel of the window; false if that was given up.
  using Draw = std::function<bool(const std::vector<float>& ends, std::vector<float>& pixels)>;

  // Has all that these parts are made of; asks for what is not there yet. False if that was given up.
  bool Complete(const std::vector<Intervals>& intervals, const Draw& draw);

  // One part of each pixel, premultiplied; of parts that are complete.
  std::vector<float> PictureOf(const std::vector<Intervals>& intervals, Interval Intervals::*interval);

  // Forgets what was not used since this was called last.
  void DropUnused();
  void Clear() { this->All.clear(); }

private:
  // Premultiplied pixels of rays that end at these depths. Of each pixel of the window, which of these is its own; -1
  // is none.
  struct Layer
  {
    std::vector<int> Places;
    std::vector<float> Depths, Pixels;
    bool IsUsed;
  };
  const float* Find(std::size_t pixel, float depth);

  std::list<Layer> All;
  std::vector<float> Drawn;
};

}
