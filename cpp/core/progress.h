// SPDX-License-Identifier: MIT OR Apache-2.0
// What the bridge calls back: private to this library, not installed.
#pragma once

#include <functional>

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

  // Whether to go on. What it throws becomes an error of the call that it interrupts.
  bool tell(double share) const { return !this->Tell || this->Tell(share); }

private:
  std::function<bool(double)> Tell;
};

}
}
