// SPDX-License-Identifier: MIT OR Apache-2.0
#include "Threads.h"

#include <algorithm>
#include <cstdlib>
#include <thread>

#ifdef __unix__
#include <unistd.h>
#endif
#ifdef __linux__
#include <sched.h>
#endif

namespace halite_vtk
{

namespace
{

// The positive whole number that a variable starts with; 0 if there is none. Slurm appends how often: "4(x2)".
std::size_t Number(const char* variable)
{
  const char* text = std::getenv(variable);
  const long n = text ? std::strtol(text, nullptr, 10) : 0;
  return n > 0 ? static_cast<std::size_t>(n) : 0;
}

// A launcher may have bound the process to some of the node's.
std::size_t CoresOfProcess()
{
#ifdef __linux__
  cpu_set_t mine;
  CPU_ZERO(&mine);
  // It fails where there are more cores than the set has room for.
  if (sched_getaffinity(0, sizeof mine, &mine) == 0)
  {
    return static_cast<std::size_t>(CPU_COUNT(&mine));
  }
#endif
  return std::max(1u, std::thread::hardware_concurrency());
}

std::size_t CoresOfNode()
{
#ifdef _SC_NPROCESSORS_ONLN
  const long n = sysconf(_SC_NPROCESSORS_ONLN);
  return n > 0 ? static_cast<std::size_t>(n) : 0;
#else
  return std::thread::hardware_concurrency();
#endif
}

}

std::size_t Threads::ProcessesOfNode()
{
  // Open MPI; MPICH and Intel MPI; MVAPICH; Cray's PALS; Slurm. None of them needs MPI to be linked or started.
  for (const char* variable : { "OMPI_COMM_WORLD_LOCAL_SIZE", "MPI_LOCALNRANKS", "MV2_COMM_WORLD_LOCAL_SIZE",
         "PALS_LOCAL_SIZE", "SLURM_NTASKS_PER_NODE" })
  {
    if (const std::size_t n = Number(variable))
    {
      return n;
    }
  }
  return 1;
}

std::size_t Threads::Of(int asked)
{
  if (asked > 0)
  {
    return static_cast<std::size_t>(asked);
  }
  std::size_t threads = Number("HALITE_THREADS");
  if (threads == 0)
  {
    threads = std::min(CoresOfProcess(), std::max<std::size_t>(1, CoresOfNode() / Threads::ProcessesOfNode()));
  }
  const std::size_t most = Number("VTK_SMP_MAX_THREADS");
  return std::min<std::size_t>(most > 0 ? std::min(threads, most) : threads, 1024);
}
}
