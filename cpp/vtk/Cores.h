// SPDX-License-Identifier: MIT OR Apache-2.0
// The core's renderers: one, or one for each of several grids, whose pictures go over each other.
#pragma once

#include "Content.h"
#include "Core.h"

#include <memory>
#include <string>
#include <vector>

namespace halite_vtk
{

class Cores
{
public:
  // Of all together.
  Core::Counts GetCounts() const;

  // Holds these from now on, of which the first is nearest.
  void Hold(const std::vector<Content>& contents);

  // As Core::Draw, of all that is held.
  bool Draw(const halite::View& view, std::vector<float>& pixels, const halite::Renderer::Progress& progress);

  // Of what drew last; nothing before that.
  halite::Statistics GetStatistics() const;

  std::vector<std::string> TakeWarnings();

private:
  // By the places of what they hold.
  std::vector<std::unique_ptr<Core>> All;
  // Of those that draw, nearest first.
  std::vector<std::size_t> Order;
  // Of those that are gone.
  Core::Counts Gone;
  std::vector<float> Behind;
};

}
