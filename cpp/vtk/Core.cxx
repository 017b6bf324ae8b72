// SPDX-License-Identifier: MIT OR Apache-2.0
#include "Core.h"

#include "MeshView.h"

#include "vtkDataArray.h"
#include "vtkLogger.h"

namespace halite_vtk
{

namespace
{

// Whether another key is wanted than that which is held; then that is held no more.
bool IsNew(Key& held, const Key& wanted)
{
  const bool differs = held != wanted;
  if (differs)
  {
    held = Key();
  }
  return differs;
}

}

template <class Work>
auto Core::Do(Step step, Work work) -> decltype(work())
{
  struct Close
  {
    Core& Self;
    Step Now;
    ~Close()
    {
      const std::vector<std::string> fresh = this->Self.Messages.New(this->Now, this->Self.Said);
      this->Self.Warnings.insert(this->Self.Warnings.end(), fresh.begin(), fresh.end());
    }
  } close{ *this, step };
  this->Said.clear();
  return work();
}

std::vector<std::string> Core::TakeWarnings()
{
  std::vector<std::string> warnings;
  warnings.swap(this->Warnings);
  return warnings;
}

void Core::Hold(const Content& content)
{
  MeshView view;
  if (!this->Renderer || IsNew(this->SettingsKey, content.SettingsKey))
  {
    // The old one's memory is free before the new one takes its own.
    this->Renderer.reset();
    halite::Settings settings = content.Settings;
    settings.log = [this](halite::Level level, const std::string& line) {
      if (level == halite::Level::Info)
      {
        vtkLog(TRACE, << "Halite: " << line);
      }
      else
      {
        this->Said.push_back(line);
      }
    };
    this->Do(Start, [&] { this->Renderer.reset(new halite::Renderer(settings)); });
    this->SettingsKey = content.SettingsKey;
    this->IntegralKey = content.IntegralKey;
    this->MeshKey = this->PlacementKey = this->FieldKey = this->FunctionKey = Key();
  }
  if (IsNew(this->IntegralKey, content.IntegralKey))
  {
    this->Renderer->setIntegral(content.Settings.integral);
    this->IntegralKey = content.IntegralKey;
  }
  bool hasMesh = !IsNew(this->MeshKey, content.MeshKey);
  if (hasMesh && IsNew(this->PlacementKey, content.PlacementKey))
  {
    hasMesh = !content.IsGrid && this->Renderer->movePoints(view.Points(content.Grid), &content.Placement);
    this->Done.Points += hasMesh;
  }
  if (!hasMesh)
  {
    this->MeshKey = this->FieldKey = Key();
    this->Do(Mesh, [&] {
      if (content.IsGrid)
      {
        this->Renderer->setGrid(view.Grid(content.Grid, content.IsNearest), &content.Placement);
      }
      else
      {
        this->Renderer->setMesh(view.Mesh(content.Grid), &content.Placement);
      }
    });
    ++this->Done.Meshes;
    this->MeshKey = content.MeshKey;
  }
  this->PlacementKey = content.PlacementKey;
  if (IsNew(this->FieldKey, content.FieldKey))
  {
    const int n = content.Array->GetNumberOfComponents();
    const halite::Numbers numbers = view.Numbers(content.Array, content.Component);
    const bool isOne = numbers.count == static_cast<std::size_t>(content.Array->GetNumberOfTuples());
    const char* name = content.Array->GetName();
    const halite::Numbers second = content.Second ? view.Numbers(content.Second, 0) : halite::Numbers(nullptr, 0, {});
    this->Do(Field, [&] {
      this->Renderer->setField(name ? name : "", content.Association, isOne ? 1 : n,
        isOne && n > 1 ? 0 : content.Component, numbers, content.Second ? &second : nullptr);
    });
    ++this->Done.Fields;
    this->FieldKey = content.FieldKey;
  }
  if (IsNew(this->FunctionKey, content.FunctionKey))
  {
    this->Do(Function, [&] { this->Renderer->setTransferFunction(content.Function); });
    ++this->Done.Functions;
    this->FunctionKey = content.FunctionKey;
  }
  this->Done.Copies += view.GetCopies();
}

bool Core::Draw(const halite::View& view, std::vector<float>& pixels, const halite::Renderer::Progress& progress)
{
  pixels.resize(std::size_t(4) * view.width * view.height);
  const bool finished = this->Do(Frame, [&] { return this->Renderer->render(view, pixels.data(), progress); });
  ++this->Done.Frames;
  return finished;
}

halite::Statistics Core::GetStatistics() const
{
  return this->Renderer ? this->Renderer->statistics() : halite::Statistics();
}

}
