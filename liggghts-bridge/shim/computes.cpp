/* Computes, see computes.h.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "computes.h"

#include <stdlib.h>
#include <string.h>

#include <cmath>

#include "atom.h"
#include "error.h"
#include "memory.h"
#include "modify.h"
#include "update.h"

#include "tip.h"

#ifdef CONCORDEM_LAMMPS
#include "../lammps/fix_bond.h"
#else
#include "fix_bond.h"
#endif

using namespace LAMMPS_NS;

#ifdef CONCORDEM_LAMMPS
ComputeOfBonds::ComputeOfBonds(LAMMPS *lmp, int &iarg, int narg, char **arg) :
    Compute(lmp, narg, arg), fix_(NULL), capacity_(0)
#else
ComputeOfBonds::ComputeOfBonds(LAMMPS *lmp, int &iarg, int narg, char **arg) :
    Compute(lmp, iarg, narg, arg), fix_(NULL), capacity_(0)
#endif
{
  text_[0] = 0;
  if (narg <= iarg) fail("the id of a fix concordem/bond is missing; give it as the first argument");
  fix_id_ = arg[iarg++];
  timeflag = 1;
}

ComputeOfBonds::~ComputeOfBonds() {}

void ComputeOfBonds::fail(const std::string &text)
{
#ifdef CONCORDEM_LAMMPS
  error->all(FLERR, "Compute {} {}: {}", id, style, text);
#else
  concordem_leave_out_tip(universe);
  error->compute_error(FLERR, this, text.c_str());
#endif
}

// Stop all processors with a message that may exist on one processor only.
void ComputeOfBonds::fail_on_this_processor()
{
  const std::string text = std::string("compute ") + id + " " + style + ": " + text_;
  concordem_leave_out_tip(universe);
  error->one(FLERR, text.c_str());
}

double ComputeOfBonds::number(const char *key, const char *word)
{
  char *end;
  const double value = strtod(word, &end);
  if (end == word || *end || !std::isfinite(value)) fail(std::string("`") + key + " " + word + "` is not a finite number");
  return value;
}

void ComputeOfBonds::init()
{
  const int k = modify->find_fix(fix_id_.c_str());
  fix_ = k < 0 ? NULL : dynamic_cast<FixConcordemBond *>(modify->fix[k]);
  if (!fix_)
    fail("there is no fix concordem/bond with id " + fix_id_ + "; check the id (the fix of bond styles is concordem_bonds)");
}

/* ------------------------------------------------------------------------------------------- concordem/bond/local */

ComputeConcordemBondLocal::ComputeConcordemBondLocal(LAMMPS *lmp, int &iarg, int narg, char **arg) :
    ComputeOfBonds(lmp, iarg, narg, arg)
{
  if (narg > iarg) fail(std::string("unknown argument `") + arg[iarg] + "`; give only the id of a fix concordem/bond");
  array_local = NULL;
  local_flag = 1;
  size_local_cols = CONCORDEM_ROW - 1;
}

ComputeConcordemBondLocal::~ComputeConcordemBondLocal()
{
  memory->destroy(array_local);
}

void ComputeConcordemBondLocal::compute_local()
{
  invoked_local = update->ntimestep;
  int64_t count = 0;
  double *rows = concordem_network_rows(fix_->network(), &count);
  if (count > capacity_ || !array_local) {
    capacity_ = count > 0 ? static_cast<int>(count) : 1;
    memory->destroy(array_local);
    memory->create(array_local, capacity_, size_local_cols, "concordem/bond/local:array");
  }
  for (int64_t k = 0; k < count; k++)
    memcpy(array_local[k], rows + k * CONCORDEM_ROW, sizeof(double) * size_local_cols);
  concordem_rows_delete(rows, count);
  size_local_rows = static_cast<int>(count);
}

/* ----------------------------------------------------------------------------------------- concordem/broken/local */

ComputeConcordemBrokenLocal::ComputeConcordemBrokenLocal(LAMMPS *lmp, int &iarg, int narg, char **arg) :
    ComputeOfBonds(lmp, iarg, narg, arg)
{
  if (narg > iarg) fail(std::string("unknown argument `") + arg[iarg] + "`; give only the id of a fix concordem/bond");
  array_local = NULL;
  local_flag = 1;
  size_local_cols = CONCORDEM_BREAK;
}

ComputeConcordemBrokenLocal::~ComputeConcordemBrokenLocal()
{
  memory->destroy(array_local);
}

void ComputeConcordemBrokenLocal::init()
{
  ComputeOfBonds::init();
  concordem_network_keep_breaks(fix_->network());
}

void ComputeConcordemBrokenLocal::compute_local()
{
  if (invoked_local == update->ntimestep) return;
  invoked_local = update->ntimestep;
  int64_t count = 0;
  double *rows = concordem_network_take_breaks(fix_->network(), &count);
  if (count > capacity_ || !array_local) {
    capacity_ = count > 0 ? static_cast<int>(count) : 1;
    memory->destroy(array_local);
    memory->create(array_local, capacity_, size_local_cols, "concordem/broken/local:array");
  }
  if (count > 0) memcpy(array_local[0], rows, sizeof(double) * size_local_cols * count);
  concordem_records_delete(rows, count, CONCORDEM_BREAK);
  size_local_rows = static_cast<int>(count);
}

/* ------------------------------------------------------------------------------------------ concordem/stress/atom */

ComputeConcordemStressAtom::ComputeConcordemStressAtom(LAMMPS *lmp, int &iarg, int narg, char **arg) :
    ComputeOfBonds(lmp, iarg, narg, arg), half_branch_(0), fraction_(0.0)
{
  while (iarg < narg) {
    const std::string key = arg[iarg++];
    if (key != "partition" && key != "volume") fail("unknown option `" + key + "`; the options are partition and volume");
    if (iarg == narg) fail("`" + key + "` needs a value");
    const std::string word = arg[iarg++];
    if (key == "partition") {
      if (word != "contact-point" && word != "half-branch") fail("`partition " + word + "` is invalid; give contact-point or half-branch");
      half_branch_ = word == "half-branch";
    } else if (word == "packing") {
      if (iarg == narg) fail("`volume packing` needs a solid fraction");
      fraction_ = number("volume packing", arg[iarg++]);
      if (!(fraction_ > 0.0 && fraction_ <= 1.0)) fail("`volume packing`: the solid fraction must be more than 0 and at most 1");
    } else if (word == "sphere") {
      fraction_ = 0.0;
    } else {
      fail("`volume " + word + "` is invalid; give sphere, or packing FRACTION");
    }
  }
  peratom_flag = 1;
  size_peratom_cols = 9;
  array_atom = NULL;
}

ComputeConcordemStressAtom::~ComputeConcordemStressAtom()
{
  memory->destroy(array_atom);
}

void ComputeConcordemStressAtom::compute_peratom()
{
  invoked_peratom = update->ntimestep;
  if (atom->nmax > capacity_) {
    capacity_ = atom->nmax;
    memory->destroy(array_atom);
    memory->create(array_atom, capacity_, 9, "concordem/stress/atom:array");
  }
  const int count = atom->nlocal;
  if (count == 0) return;
  memset(array_atom[0], 0, sizeof(double) * 9 * count);
  const ConcordemMessage message = {text_, sizeof(text_)};
  if (concordem_network_stress(fix_->network(), update->ntimestep, half_branch_, fraction_, array_atom[0], count, &message) < 0)
    fail_on_this_processor();
  for (int i = 0; i < count; i++)
    if (!(atom->mask[i] & groupbit)) memset(array_atom[i], 0, sizeof(double) * 9);
}

/* ----------------------------------------------------------------------------------------------- concordem/couple */

ComputeConcordemCouple::ComputeConcordemCouple(LAMMPS *lmp, int &iarg, int narg, char **arg) :
    ComputeOfBonds(lmp, iarg, narg, arg), volume_(0.0)
{
  if (narg != iarg + 6 || strcmp(arg[iarg], "volume") != 0 || strcmp(arg[iarg + 2], "centroid") != 0)
    fail("invalid arguments; give `volume V centroid X Y Z` (m3, m) after the id of the fix");
  volume_ = number("volume", arg[iarg + 1]);
  if (!(volume_ > 0.0)) fail("`volume` must be positive");
  for (int axis = 0; axis < 3; axis++) centroid_[axis] = number("centroid", arg[iarg + 3 + axis]);
  iarg += 6;
  vector_flag = 1;
  size_vector = 18;
  extvector = 0;
  vector = new double[18];
}

ComputeConcordemCouple::~ComputeConcordemCouple()
{
  delete[] vector;
}

void ComputeConcordemCouple::compute_vector()
{
  invoked_vector = update->ntimestep;
  double mine[18], all[18];
  const ConcordemMessage message = {text_, sizeof(text_)};
  if (concordem_network_couple_sums(fix_->network(), update->ntimestep, mine, &message) < 0) fail_on_this_processor();
  MPI_Allreduce(mine, all, 18, MPI_DOUBLE, MPI_SUM, world);
  concordem_couple_of_sums(all, volume_, centroid_, vector);
}
