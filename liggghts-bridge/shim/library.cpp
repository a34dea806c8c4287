/* Additions to LIGGGHTS' C library interface, for programs that use LIGGGHTS as a library.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include <mpi.h>
#include <string.h>

#include "fix.h"
#include "lammps.h"
#include "modify.h"

#include "fix_bond.h"
#include "host.h"

using namespace LAMMPS_NS;

namespace {

// Null if there is no fix concordem/bond with this id.
FixConcordemBond *find(void *liggghts, const char *fix_id)
{
  LAMMPS *lmp = static_cast<LAMMPS *>(liggghts);
  const int k = lmp->modify->find_fix(fix_id);
  return k < 0 ? NULL : dynamic_cast<FixConcordemBond *>(lmp->modify->fix[k]);
}

}  // namespace

extern "C" {

// Rows of the bonds and contacts of a fix (concordem_network_rows); free them with concordem_liggghts_rows_delete. Null if there is no
// fix concordem/bond with this id.
double *concordem_liggghts_rows(void *liggghts, const char *fix_id, int64_t *count)
{
  *count = 0;
  FixConcordemBond *fix = find(liggghts, fix_id);
  return fix ? concordem_network_rows(fix->network(), count) : NULL;
}

// Their records (concordem_network_records); free them with concordem_liggghts_records_delete.
double *concordem_liggghts_records(void *liggghts, const char *fix_id, int64_t *count, int64_t *length)
{
  *count = *length = 0;
  FixConcordemBond *fix = find(liggghts, fix_id);
  return fix ? concordem_network_records(fix->network(), count, length) : NULL;
}

// Length of the output vector of a fix (0: none), or -1 if there is no fix with this id. Needed because lammps_extract_fix does not
// check the index.
int concordem_liggghts_fix_size(void *liggghts, const char *fix_id)
{
  LAMMPS *lmp = static_cast<LAMMPS *>(liggghts);
  const int k = lmp->modify->find_fix(fix_id);
  if (k < 0) return -1;
  return lmp->modify->fix[k]->vector_flag ? lmp->modify->fix[k]->size_vector : 0;
}

// Number of processes that LIGGGHTS runs on.
int concordem_liggghts_processes(void *liggghts)
{
  int count = 1;
  MPI_Comm_size(static_cast<LAMMPS *>(liggghts)->world, &count);
  return count;
}

// Stop all processes when this one cannot continue and the others would wait for it.
void concordem_liggghts_abort(void *liggghts)
{
  MPI_Abort(static_cast<LAMMPS *>(liggghts)->world, 1);
}

// Called when a program opens LIGGGHTS. Whether MPI is running; if `finish`, finalize it. lammps_open_no_mpi initializes MPI if necessary but never finalizes it.
int concordem_liggghts_mpi(int finish)
{
  concordem_is_a_library() = true;
  int started = 0, ended = 0;
  MPI_Initialized(&started);
  MPI_Finalized(&ended);
  const bool running = started && !ended;
  if (finish && running) MPI_Finalize();
  return running;
}

void concordem_liggghts_rows_delete(double *rows, int64_t count)
{
  concordem_rows_delete(rows, count);
}

void concordem_liggghts_records_delete(double *reals, int64_t count, int64_t length)
{
  concordem_records_delete(reals, count, length);
}

}
