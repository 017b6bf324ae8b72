// SPDX-License-Identifier: MIT OR Apache-2.0
#include "Functions.h"

#include "vtkColorTransferFunction.h"
#include "vtkDiscretizableColorTransferFunction.h"
#include "vtkPiecewiseFunction.h"
#include "vtkVariant.h"
#include "vtkVolumeProperty.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace halite_vtk
{

namespace
{

const double Tolerance = 1e-4;

// Halvings of an interval between two nodes, after which what is left is as good as a step.
const int MostHalvings = 16;

using Value = std::array<double, 3>;

struct Knot
{
  double s;
  Value value;
};

double Distance(const Value& a, const Value& b)
{
  return std::max({ std::abs(a[0] - b[0]), std::abs(a[1] - b[1]), std::abs(a[2] - b[2]) });
}

Value Mix(const Value& a, const Value& b, double u)
{
  return { a[0] + (b[0] - a[0]) * u, a[1] + (b[1] - a[1]) * u, a[2] + (b[2] - a[2]) * u };
}

template <class F>
void Refine(const F& f, const Knot& a, const Knot& b, int halvings, std::vector<Knot>& knots)
{
  bool straight = true;
  // At no simple fractions of each other, so that what repeats is not missed.
  for (double u : { 0.5, 0.23, 0.81 })
  {
    straight = straight && Distance(f(a.s + (b.s - a.s) * u), Mix(a.value, b.value, u)) < Tolerance;
  }
  if (straight || halvings == 0)
  {
    knots.push_back(b);
    return;
  }
  const double s = a.s + (b.s - a.s) / 2;
  const Knot middle{ s, f(s) };
  Refine(f, a, middle, halvings - 1, knots);
  Refine(f, middle, b, halvings - 1, knots);
}

// The knots of a function with nodes at `nodes`, ascending.
template <class F>
std::vector<Knot> Sample(const F& raw, std::vector<double> nodes)
{
  auto f = [&](double s) {
    Value v = raw(s);
    for (double& x : v)
    {
      x = std::isfinite(x) ? std::max(x, 0.0) : 0.0;
    }
    return v;
  };
  nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
  if (nodes.empty())
  {
    return { { 0, { 0, 0, 0 } } };
  }
  const double infinity = std::numeric_limits<double>::infinity();
  const double first = nodes.front(), last = nodes.back();
  std::vector<Knot> knots;
  auto add = [&](double s, const Value& v) {
    if (knots.empty() || knots.back().s != s || Distance(knots.back().value, v) > 0)
    {
      knots.push_back({ s, v });
    }
  };
  add(first, f(std::nextafter(first, -infinity)));
  add(first, f(first));
  for (std::size_t i = 0; i + 1 < nodes.size(); ++i)
  {
    // A function may jump at its nodes.
    const double s = nodes[i], end = nodes[i + 1];
    const Knot a{ s, f(std::nextafter(s, infinity)) }, b{ end, f(std::nextafter(end, -infinity)) };
    if (Distance(a.value, knots.back().value) > Tolerance)
    {
      knots.push_back(a);
    }
    Refine(f, knots.back(), b, MostHalvings, knots);
    if (Distance(f(end), b.value) > Tolerance)
    {
      knots.push_back({ end, f(end) });
    }
  }
  // The last node itself belongs to the function, also where the scalar is known to 32 bits only.
  const double beyond = last + 1e-6 * std::max({ last - first, std::abs(last) * 1e-3, 1e-30 });
  const Value after = f(beyond);
  if (Distance(after, knots.back().value) > Tolerance)
  {
    add(beyond, knots.back().value);
    add(beyond, after);
  }
  // What lies between two equal values says nothing.
  std::vector<Knot> kept;
  for (std::size_t i = 0; i < knots.size(); ++i)
  {
    const bool idle = i > 0 && i + 1 < knots.size() && Distance(kept.back().value, knots[i].value) == 0 &&
      Distance(knots[i].value, knots[i + 1].value) == 0;
    if (!idle)
    {
      kept.push_back(knots[i]);
    }
  }
  return kept;
}

std::vector<Knot> Sample(vtkPiecewiseFunction* function)
{
  std::vector<double> nodes;
  for (int i = 0; i < function->GetSize(); ++i)
  {
    double node[4];
    function->GetNodeValue(i, node);
    nodes.push_back(node[0]);
  }
  return Sample(
    [&](double s) -> Value {
      const double v = function->GetValue(s);
      return { v, v, v };
    },
    nodes);
}

// Values of an interval, both ends among them.
const std::size_t Samples = 2049;

// A function's values between its nodes. Where VTK looks for the way from one colour to the next, which takes a fifth
// of a second, it does so anew for each value, but once for a table.
std::vector<std::vector<Value>> TablesOf(vtkColorTransferFunction* function, const std::vector<double>& nodes)
{
  std::vector<std::vector<Value>> tables;
  for (std::size_t i = 0; i + 1 < nodes.size(); ++i)
  {
    tables.emplace_back(Samples);
    function->GetTable(nodes[i], nodes[i + 1], static_cast<int>(Samples), tables.back().front().data());
  }
  return tables;
}

// Where values are categories: the colour of the one that is nearest, of those that are numbers.
Functions::Color CategoriesOf(vtkColorTransferFunction* function)
{
  std::vector<Knot> categories;
  for (vtkIdType i = 0; i < function->GetNumberOfAnnotatedValues(); ++i)
  {
    bool isNumber = false;
    const double value = function->GetAnnotatedValue(i).ToDouble(&isNumber);
    if (isNumber && std::isfinite(value))
    {
      double rgba[4];
      function->GetIndexedColor(i, rgba);
      categories.push_back({ value, { rgba[0], rgba[1], rgba[2] } });
    }
  }
  std::stable_sort(categories.begin(), categories.end(), [](const Knot& a, const Knot& b) { return a.s < b.s; });
  Functions::Color color;
  for (std::size_t i = 0; i < categories.size(); ++i)
  {
    if (i > 0)
    {
      const double between = categories[i - 1].s + (categories[i].s - categories[i - 1].s) / 2;
      color.push_back({ between, categories[i - 1].value });
      color.push_back({ between, categories[i].value });
    }
    else
    {
      color.push_back({ categories[i].s, categories[i].value });
    }
  }
  return color;
}

}

namespace Functions
{

// The most colours of a table whose steps are knots.
const vtkIdType MostColors = 4096;

// The steps of a function that has a table of colours, as ParaView's have; nothing of others. Looked for by halving, each would be a
// steep ramp between many knots.
Color StepsOf(vtkColorTransferFunction* function)
{
  auto* table = vtkDiscretizableColorTransferFunction::SafeDownCast(function);
  Color color;
  if (!table || !table->GetDiscretize() || table->GetIndexedLookup() || table->GetUseLogScale())
  {
    return color;
  }
  const double* range = table->GetRange();
  const double low = range[0], width = range[1] - range[0];
  const vtkIdType count = table->GetNumberOfValues();
  if (!(width > 0) || !std::isfinite(width) || count < 1 || count > MostColors)
  {
    return color;
  }
  for (vtkIdType i = 0; i < count; ++i)
  {
    Value v;
    function->GetColor(low + width * (i + 0.5) / count, v.data());
    color.push_back({ low + width * i / count, v });
    color.push_back({ low + width * (i + 1) / count, v });
  }
  return color;
}

Color KnotsOf(vtkColorTransferFunction* function)
{
  if (function->GetIndexedLookup())
  {
    const Color categories = CategoriesOf(function);
    if (!categories.empty())
    {
      return categories;
    }
  }
  const Color steps = StepsOf(function);
  if (!steps.empty())
  {
    return steps;
  }
  std::vector<double> nodes;
  for (int i = 0; i < function->GetSize(); ++i)
  {
    double node[6];
    function->GetNodeValue(i, node);
    nodes.push_back(node[0]);
  }
  Color color;
  std::vector<std::vector<Value>> tables;
  const bool isLogarithmic = function->GetScale() == VTK_CTF_LOG10 && !nodes.empty() && nodes.front() > 0;
  if (function->GetColorSpace() == VTK_CTF_LAB_CIEDE2000)
  {
    tables = TablesOf(function, nodes);
  }
  auto evaluate = [&](double s) -> Value {
    const std::size_t next = std::upper_bound(nodes.begin(), nodes.end(), s) - nodes.begin();
    if (!tables.empty() && next > 0 && (next < nodes.size() || s == nodes.back()))
    {
      const std::size_t i = std::min(next, nodes.size() - 1) - 1;
      const double share = isLogarithmic ? std::log(s / nodes[i]) / std::log(nodes[i + 1] / nodes[i])
                                         : (s - nodes[i]) / (nodes[i + 1] - nodes[i]);
      const double at = std::min(std::max(share, 0.0), 1.0) * (Samples - 1);
      const std::size_t k = std::min(static_cast<std::size_t>(at), Samples - 2);
      return Mix(tables[i][k], tables[i][k + 1], at - static_cast<double>(k));
    }
    Value v;
    function->GetColor(s, v.data());
    return v;
  };
  for (const Knot& k : Sample(evaluate, nodes))
  {
    color.push_back({ k.s, k.value });
  }
  return color;
}

Color GreyKnotsOf(vtkPiecewiseFunction* function)
{
  Color color;
  for (const Knot& k : Sample(function))
  {
    color.push_back({ k.s, k.value });
  }
  return color;
}

Opacity KnotsOf(vtkPiecewiseFunction* function)
{
  Opacity opacity;
  for (const Knot& k : Sample(function))
  {
    opacity.push_back({ k.s, k.value[0] });
  }
  return opacity;
}

const Knots& Cache::KnotsOf(vtkVolumeProperty* property, bool isRGBA)
{
  const bool isGrey = property->GetColorChannels() == 1;
  vtkPiecewiseFunction* opacity = property->GetScalarOpacity(0);
  vtkPiecewiseFunction* greys = isGrey ? property->GetGrayTransferFunction(0) : nullptr;
  vtkColorTransferFunction* colors = isGrey ? nullptr : property->GetRGBTransferFunction(0);
  halite_vtk::Key sources;
  sources << static_cast<std::uint64_t>(opacity->GetMTime())
          << static_cast<std::uint64_t>(isGrey ? greys->GetMTime() : colors->GetMTime())
          << static_cast<std::uint64_t>(isRGBA);
  // Properties that are gone leave theirs behind.
  if (this->Kept.size() > 100)
  {
    this->Kept.clear();
  }
  Knots& knots = this->Kept[property];
  if (knots.Sources != sources)
  {
    knots.Sources = sources;
    if (isRGBA)
    {
      knots.Color = { { 0, { 1, 1, 1 } } };
      knots.Opacity.clear();
    }
    else
    {
      knots.Color = isGrey ? GreyKnotsOf(greys) : Functions::KnotsOf(colors);
      knots.Opacity = Functions::KnotsOf(opacity);
    }
  }
  return knots;
}

}

}
