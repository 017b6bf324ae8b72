// SPDX-License-Identifier: MIT OR Apache-2.0
// What something depends on.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace halite_vtk
{

// Numbers and texts in order: what was made for one key serves all that are equal to it.
class Key
{
public:
  Key& operator<<(double v)
  {
    std::uint64_t bits;
    std::memcpy(&bits, &v, sizeof bits);
    return *this << bits;
  }
  Key& operator<<(std::uint64_t v)
  {
    this->Words.push_back(v);
    return *this;
  }
  Key& operator<<(const Key& other) { return *this << other.Words; }
  Key& operator<<(const std::vector<std::uint64_t>& words)
  {
    this->Words.insert(this->Words.end(), words.begin(), words.end());
    return *this;
  }
  template <std::size_t N>
  Key& operator<<(const std::array<double, N>& values)
  {
    for (double v : values)
    {
      *this << v;
    }
    return *this;
  }
  Key& operator<<(const std::string& s)
  {
    *this << static_cast<std::uint64_t>(s.size());
    for (unsigned char c : s)
    {
      *this << static_cast<std::uint64_t>(c);
    }
    return *this;
  }
  bool operator==(const Key& other) const { return this->Words == other.Words; }
  bool operator!=(const Key& other) const { return this->Words != other.Words; }

private:
  std::vector<std::uint64_t> Words;
};

}
