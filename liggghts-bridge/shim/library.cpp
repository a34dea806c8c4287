/* What programs that drive LIGGGHTS as a library need besides its own interface.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include <mpi.h>
#include <string.h>

#include "fix.h"
#include "lammps.h"
#include "modify.h"

#include "fix_bond.h"

using namespace LAMMPS_NS;

namespace {

// Null if there is no fix concordem/bond of that id.
FixConcordemBond *find(void *liggghts, const char *fix_id)
{
  LAMMPS *lmp = static_cast<LAMMPS *>(liggghts);
  const int k = lmp->modify->find_fix(fix_id);
  return k < 0 ? NULL : dynamic_cast<FixConcordemBond *>(lmp->modify->fix[k]);
}

}  // namespace

extern "C" {

// Rows of the bonds and contacts of a fix (concordem_network_rows), to be given back to concordem_liggghts_rows_delete. Null if
// there is no fix concordem/bond of that id.
double *concordem_liggghts_rows(void *liggghts, const char *fix_id, int64_t *count)
{
  *count = 0;
  FixConcordemBond *fix = find(liggghts, fix_id);
  return fix ? concordem_network_rows(fix->network(), count) : NULL;
}

// The same for what is remembered of them (concordem_network_records), to be given back to concordem_liggghts_records_delete.
double *concordem_liggghts_records(void *liggghts, const char *fix_id, int64_t *count, int64_t *length)
{
  *count = *length = 0;
  FixConcordemBond *fix = find(liggghts, fix_id);
  return fix ? concordem_network_records(fix->network(), count, length) : NULL;
}

// Length of the vector that a fix tells of itself (0: none); -1 if there is no fix of that id. LIGGGHTS' own lammps_extract_fix
// passes any index on to the fix.
int concordem_liggghts_fix_size(void *liggghts, const char *fix_id)
{
  LAMMPS *lmp = static_cast<LAMMPS *>(liggghts);
  const int k = lmp->modify->find_fix(fix_id);
  if (k < 0) return -1;
  return lmp->modify->fix[k]->vector_flag ? lmp->modify->fix[k]->size_vector : 0;
}

// Processes that LIGGGHTS runs on.
int concordem_liggghts_processes(void *liggghts)
{
  int count = 1;
  MPI_Comm_size(static_cast<LAMMPS *>(liggghts)->world, &count);
  return count;
}

// The end of all processes, for one that cannot go on while the others wait for it.
void concordem_liggghts_abort(void *liggghts)
{
  MPI_Abort(static_cast<LAMMPS *>(liggghts)->world, 1);
}

// Whether MPI is running; with `finish` it is ended if so. Who starts it (lammps_open_no_mpi does, if nobody has) must end it.
int concordem_liggghts_mpi(int finish)
{
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
