// SPDX-License-Identifier: MIT OR Apache-2.0
// Messages that are given once while they hold.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

namespace halite_vtk
{

class Messages
{
public:
  // What makes two messages the same: all but numbers that are in no name.
  static std::string WithoutNumbers(const std::string& message);

  // A step of the work was done, and said this: those that it did not say when it was done last.
  std::vector<std::string> New(int step, const std::vector<std::string>& said);

private:
  std::map<int, std::set<std::string>> Held;
};

}
