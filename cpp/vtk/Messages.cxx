// SPDX-License-Identifier: MIT OR Apache-2.0
#include "Messages.h"

#include <cctype>

namespace halite_vtk
{

std::string Messages::WithoutNumbers(const std::string& message)
{
  std::string kind;
  bool isQuoted = false;
  for (const char c : message)
  {
    const auto is = [](int (*kind)(int), char c) { return kind(static_cast<unsigned char>(c)) != 0; };
    isQuoted ^= c == '"' || c == '`';
    const char last = kind.empty() ? ' ' : kind.back();
    if (isQuoted || !is(std::isdigit, c) || is(std::isalnum, last) || last == '_')
    {
      kind += c;
    }
    else if (last != '#')
    {
      kind += '#';
    }
  }
  return kind;
}

std::vector<std::string> Messages::New(int step, const std::vector<std::string>& said)
{
  std::set<std::string> now;
  std::vector<std::string> fresh;
  std::set<std::string>& before = this->Held[step];
  for (const std::string& message : said)
  {
    const std::string kind = WithoutNumbers(message);
    if (now.insert(kind).second && !before.count(kind))
    {
      fresh.push_back(message);
    }
  }
  before.swap(now);
  return fresh;
}

}
