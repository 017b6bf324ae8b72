// SPDX-License-Identifier: MIT OR Apache-2.0
#include "Layers.h"

#include <algorithm>

namespace halite_vtk
{

namespace
{

// What lies between two ends of a ray, by the pixels up to both.
void Between(const float* near, const float* far, float* pixel)
{
  const double transmittance = 1.0 - near[3];
  for (int k = 0; k < 4; ++k)
  {
    pixel[k] = transmittance > 0 ? static_cast<float>(std::max((double(far[k]) - near[k]) / transmittance, 0.0)) : 0;
  }
  pixel[3] = std::min(pixel[3], 1.0f);
}

}

// The pixel of the ray up to a depth; null if that was not drawn yet.
const float* Layers::Find(std::size_t pixel, float depth)
{
  static const float nothing[4] = { 0, 0, 0, 0 };
  if (!(depth > 0))
  {
    return nothing;
  }
  for (Layer& layer : this->All)
  {
    const int place = layer.Places[pixel];
    if (place >= 0 && layer.Depths[place] == depth)
    {
      layer.IsUsed = true;
      return &layer.Pixels[4 * static_cast<std::size_t>(place)];
    }
  }
  return nullptr;
}

bool Layers::Complete(const std::vector<Intervals>& intervals, const Draw& draw)
{
  for (float Interval::*end : { &Interval::Start, &Interval::End })
  {
    for (Interval Intervals::*interval : { &Intervals::Front, &Intervals::Back })
    {
      std::vector<float> ends(intervals.size(), 0.0f);
      bool any = false;
      for (std::size_t i = 0; i < intervals.size(); ++i)
      {
        const Interval& p = intervals[i].*interval;
        if (p.Start < p.End && !this->Find(i, p.*end))
        {
          ends[i] = p.*end;
          any = true;
        }
      }
      if (!any)
      {
        continue;
      }
      if (!draw(ends, this->Drawn))
      {
        return false;
      }
      Layer layer{ std::vector<int>(ends.size(), -1), {}, {}, true };
      for (std::size_t i = 0; i < ends.size(); ++i)
      {
        if (ends[i] > 0)
        {
          layer.Places[i] = static_cast<int>(layer.Depths.size());
          layer.Depths.push_back(ends[i]);
          layer.Pixels.insert(layer.Pixels.end(), &this->Drawn[4 * i], &this->Drawn[4 * i] + 4);
        }
      }
      this->All.push_back(std::move(layer));
    }
  }
  return true;
}

std::vector<float> Layers::PictureOf(const std::vector<Intervals>& intervals, Interval Intervals::*interval)
{
  std::vector<float> pixels(4 * intervals.size(), 0.0f);
  for (std::size_t i = 0; i < intervals.size(); ++i)
  {
    const Interval& p = intervals[i].*interval;
    if (p.Start < p.End)
    {
      Between(this->Find(i, p.Start), this->Find(i, p.End), &pixels[4 * i]);
    }
  }
  return pixels;
}

void Layers::DropUnused()
{
  this->All.remove_if([](const Layer& layer) { return !layer.IsUsed; });
  for (Layer& layer : this->All)
  {
    layer.IsUsed = false;
  }
}

}
