// SPDX-License-Identifier: MIT OR Apache-2.0
// How many threads the CPU draws with.
#pragma once

#include <cstddef>

namespace halite_vtk
{

class Threads
{
public:
  // As many as are asked for. If that is 0: HALITE_THREADS; without it the cores that this process may use, and no more than its
  // share of the node's, where a launcher of MPI started several processes there. VTK_SMP_MAX_THREADS limits both. At least 1.
  static std::size_t Of(int asked);

  // How many processes a launcher of MPI started on this node, this one among them; 1 where none says so.
  static std::size_t ProcessesOfNode();
};

}
