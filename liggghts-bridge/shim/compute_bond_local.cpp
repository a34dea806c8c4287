/* compute concordem/bond/local: the bonds and contacts of a fix concordem/bond, one row each, for `dump local`.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "compute_bond_local.h"

#include <string.h>

#include "error.h"
#include "fix_bond.h"
#include "memory.h"
#include "modify.h"
#include "update.h"

using namespace LAMMPS_NS;

ComputeConcordemBondLocal::ComputeConcordemBondLocal(LAMMPS *lmp, int &iarg, int narg, char **arg) :
    Compute(lmp, iarg, narg, arg), fix_(NULL), capacity_(0)
{
  if (narg != iarg + 1) error->compute_error(FLERR, this, "wants the id of a fix concordem/bond and nothing else");
  fix_id_ = arg[iarg++];
  array_local = NULL;
  local_flag = 1;
  size_local_cols = CONCORDEM_ROW - 1;
}

ComputeConcordemBondLocal::~ComputeConcordemBondLocal()
{
  memory->destroy(array_local);
}

void ComputeConcordemBondLocal::init()
{
  const int k = modify->find_fix(fix_id_.c_str());
  fix_ = k < 0 ? NULL : dynamic_cast<FixConcordemBond *>(modify->fix[k]);
  if (!fix_) error->compute_error(FLERR, this, "wants the id of a fix concordem/bond; there is none of that id");
}

void ComputeConcordemBondLocal::compute_local()
{
  invoked_local = update->ntimestep;
  int64_t count = 0;
  double *rows = concordem_network_rows(fix_->network(), &count);
  if (count > capacity_ || !array_local) {
    capacity_ = count > 0 ? count : 1;
    memory->destroy(array_local);
    memory->create(array_local, static_cast<int>(capacity_), size_local_cols, "concordem/bond/local:array");
  }
  for (int64_t k = 0; k < count; k++)
    memcpy(array_local[k], rows + k * CONCORDEM_ROW, sizeof(double) * size_local_cols);
  concordem_rows_delete(rows, count);
  size_local_rows = static_cast<int>(count);
}
