// SPDX-License-Identifier: MIT OR Apache-2.0
// The core's renderer, which is handed only what it does not hold yet.
#pragma once

#include "Content.h"
#include "Key.h"
#include "Messages.h"

#include "vtkType.h"

#include <memory>
#include <string>
#include <vector>

namespace halite_vtk
{

class Core
{
public:
  // How often: it drew; something was handed over; an array's layout forced a copy.
  struct Counts
  {
    vtkIdType Frames = 0, Meshes = 0, Points = 0, Fields = 0, Functions = 0, Copies = 0;
  };
  const Counts& GetCounts() const { return this->Done; }

  // Holds this from now on. What throws half way is not held, and what follows from it neither.
  void Hold(const Content& content);

  // Draws what is held, as halite::Renderer does: false if `progress` ended it.
  bool Draw(const halite::View& view, std::vector<float>& pixels, const halite::Renderer::Progress& progress);

  // Of what drew last; nothing before that.
  halite::Statistics GetStatistics() const;

  // Warnings since this was called last, each once while it holds.
  std::vector<std::string> TakeWarnings();

private:
  enum Step
  {
    Start,
    Mesh,
    Field,
    Function,
    Frame
  };
  template <class Work>
  auto Do(Step step, Work work) -> decltype(work());

  std::unique_ptr<halite::Renderer> Renderer;
  Key SettingsKey, IntegralKey, MeshKey, PlacementKey, FieldKey, FunctionKey;
  Counts Done;
  halite_vtk::Messages Messages;
  // What a step that is at work has warned of, and what is to be said.
  std::vector<std::string> Said, Warnings;
};

}
