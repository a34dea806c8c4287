/* What programs that drive LIGGGHTS as a library need besides its own interface.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include <mpi.h>
#include <string.h>

#include "lammps.h"
#include "modify.h"

#include "fix_bond.h"

using namespace LAMMPS_NS;

extern "C" {

// Rows of the bonds and contacts of a fix (concordem_network_rows), to be given back to concordem_liggghts_rows_delete. Null if
// there is no fix concordem/bond of that id.
double *concordem_liggghts_rows(void *liggghts, const char *fix_id, int64_t *count)
{
  LAMMPS *lmp = static_cast<LAMMPS *>(liggghts);
  *count = 0;
  const int k = lmp->modify->find_fix(fix_id);
  FixConcordemBond *fix = k < 0 ? NULL : dynamic_cast<FixConcordemBond *>(lmp->modify->fix[k]);
  return fix ? concordem_network_rows(fix->network(), count) : NULL;
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

}
