// SPDX-License-Identifier: MIT OR Apache-2.0
// Ends a test that finds something else than it expects, and says where.
#pragma once

#include <cstdio>
#include <cstdlib>

inline void expect(bool holds, const char* what, int line)
{
  if (!holds)
  {
    std::fprintf(stderr, "line %d: %s\n", line, what);
    std::exit(1);
  }
}
#define EXPECT(condition) expect((condition), #condition, __LINE__)
