// SPDX-License-Identifier: MIT OR Apache-2.0
#include "Cores.h"

#include <algorithm>

namespace halite_vtk
{

namespace
{

void Add(Core::Counts& all, const Core::Counts& more)
{
  all.Frames += more.Frames;
  all.Meshes += more.Meshes;
  all.Points += more.Points;
  all.Fields += more.Fields;
  all.Functions += more.Functions;
  all.Copies += more.Copies;
}

// Puts premultiplied colours behind others.
void Underlay(std::vector<float>& front, const std::vector<float>& behind)
{
  for (std::size_t p = 0; p + 3 < front.size(); p += 4)
  {
    const float clear = 1 - front[p + 3];
    for (std::size_t k = p; k < p + 4; ++k)
    {
      front[k] += clear * behind[k];
    }
  }
}

}

Core::Counts Cores::GetCounts() const
{
  Core::Counts all = this->Gone;
  for (const auto& core : this->All)
  {
    Add(all, core->GetCounts());
  }
  return all;
}

void Cores::Hold(const std::vector<Content>& contents)
{
  std::size_t places = 1;
  for (const Content& content : contents)
  {
    places = std::max(places, content.Place + 1);
  }
  while (this->All.size() > places)
  {
    Add(this->Gone, this->All.back()->GetCounts());
    this->All.pop_back();
  }
  while (this->All.size() < places)
  {
    this->All.emplace_back(new Core);
  }
  this->Order.clear();
  for (const Content& content : contents)
  {
    this->All[content.Place]->Hold(content);
    this->Order.push_back(content.Place);
  }
}

bool Cores::Draw(const halite::View& view, std::vector<float>& pixels, const halite::Renderer::Progress& progress)
{
  const double all = static_cast<double>(this->Order.size());
  for (std::size_t i = 0; i < this->Order.size(); ++i)
  {
    const auto shared = [&](double share) { return progress((static_cast<double>(i) + share) / all); };
    if (!this->All[this->Order[i]]->Draw(view, i == 0 ? pixels : this->Behind, shared))
    {
      return false;
    }
    if (i > 0)
    {
      Underlay(pixels, this->Behind);
    }
  }
  return true;
}

halite::Statistics Cores::GetStatistics() const
{
  halite::Statistics all;
  for (std::size_t place : this->Order)
  {
    const halite::Statistics one = this->All[place]->GetStatistics();
    const auto tetrahedra = all.tetrahedra + one.tetrahedra;
    all = one;
    all.tetrahedra = tetrahedra;
  }
  return all;
}

std::vector<std::string> Cores::TakeWarnings()
{
  std::vector<std::string> all;
  for (const auto& core : this->All)
  {
    for (std::string& warning : core->TakeWarnings())
    {
      // What is true of one block mostly is of others.
      if (std::find(all.begin(), all.end(), warning) == all.end())
      {
        all.push_back(std::move(warning));
      }
    }
  }
  return all;
}

}
