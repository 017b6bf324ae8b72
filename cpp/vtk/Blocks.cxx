// SPDX-License-Identifier: MIT OR Apache-2.0
#include "Blocks.h"

#include "Leaves.h"

#include "vtkCamera.h"
#include "vtkMatrix4x4.h"
#include "vtkNew.h"
#include "vtkRenderer.h"

#include <algorithm>
#include <array>

namespace halite_vtk
{

namespace
{

using Box = std::array<double, 6>;

// A place, with 1 behind it, or a direction, with 0.
using Eye = std::array<double, 4>;

Eye EyeOf(vtkRenderer* renderer, const halite::Renderer::Matrix& placement)
{
  vtkCamera* camera = renderer->GetActiveCamera();
  Eye eye{ 0, 0, 0, 1 };
  camera->GetPosition(eye.data());
  if (camera->GetParallelProjection())
  {
    camera->GetDirectionOfProjection(eye.data());
    eye = { -eye[0], -eye[1], -eye[2], 0 };
  }
  vtkNew<vtkMatrix4x4> back;
  back->DeepCopy(placement.data());
  back->Invert();
  back->MultiplyPoint(eye.data(), eye.data());
  return eye;
}

// Whether `a` hides `b` rather than the other way round.
bool IsBefore(const Box& a, const Box& b, const Eye& eye)
{
  double widest = -VTK_DOUBLE_MAX;
  bool isBefore = false;
  for (std::size_t axis = 0; axis < 3; ++axis)
  {
    for (const bool isBelow : { true, false })
    {
      const Box &low = isBelow ? a : b, &high = isBelow ? b : a;
      const double gap = high[2 * axis] - low[2 * axis + 1];
      if (gap > widest)
      {
        widest = gap;
        const double between = (high[2 * axis] + low[2 * axis + 1]) / 2;
        isBefore = (eye[axis] < between * eye[3]) == isBelow;
      }
    }
  }
  return isBefore;
}

}

std::vector<Block> Block::Of(vtkDataObject* input)
{
  std::vector<Block> blocks;
  for (const vtkSmartPointer<vtkDataSet>& grid : LeavesOf(input))
  {
    blocks.push_back({ grid, blocks.size() });
  }
  return blocks;
}

void Block::Sort(std::vector<Block>& blocks, vtkRenderer* renderer, const halite::Renderer::Matrix& placement)
{
  const std::size_t n = blocks.size();
  if (n < 2)
  {
    return;
  }
  const Eye eye = EyeOf(renderer, placement);
  std::vector<Box> boxes(n);
  for (std::size_t i = 0; i < n; ++i)
  {
    blocks[i].Grid->GetBounds(boxes[i].data());
  }
  // How many boxes that are not taken yet are before each.
  std::vector<std::size_t> before(n, 0);
  for (std::size_t i = 0; i < n; ++i)
  {
    for (std::size_t j = 0; j < n; ++j)
    {
      before[i] += i != j && IsBefore(boxes[j], boxes[i], eye);
    }
  }
  std::vector<Block> sorted;
  std::vector<bool> isTaken(n, false);
  while (sorted.size() < n)
  {
    // Where boxes hide each other in a circle no order is right, and the one with the fewest before it is taken.
    std::size_t next = n;
    for (std::size_t i = 0; i < n; ++i)
    {
      next = !isTaken[i] && (next == n || before[i] < before[next]) ? i : next;
    }
    isTaken[next] = true;
    sorted.push_back(blocks[next]);
    for (std::size_t i = 0; i < n; ++i)
    {
      before[i] -= !isTaken[i] && IsBefore(boxes[next], boxes[i], eye);
    }
  }
  blocks.swap(sorted);
}

}
