// SPDX-License-Identifier: MIT OR Apache-2.0
// What the bridge calls back: private to this library, not installed.
#pragma once

#include <exception>
#include <functional>
#include <stdexcept>
#include <utility>

namespace halite
{
namespace bridge
{

class Progress
{
public:
  explicit Progress(std::function<bool(double)> tell)
    : Tell(std::move(tell))
  {
  }

  // Whether to go on. What it throws becomes an error of the call that it interrupts; the bridge can carry a
  // std::exception only, and ends the program at anything else.
  bool tell(double share) const
  {
    try
    {
      return !this->Tell || this->Tell(share);
    }
    catch (const std::exception&)
    {
      throw;
    }
    catch (...)
    {
      throw std::runtime_error("the progress function threw something that is no std::exception");
    }
  }

private:
  std::function<bool(double)> Tell;
};

}
}
