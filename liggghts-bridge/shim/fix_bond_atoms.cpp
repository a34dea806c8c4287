/* What both fixes concordem/bond, for LIGGGHTS and for LAMMPS, do alike: what they keep of their atoms, restart, sums.

   SPDX-License-Identifier: GPL-2.0-or-later */
#ifdef CONCORDEM_LAMMPS
#include "../lammps/fix_bond.h"
#else
#include "fix_bond.h"
#endif

#include <stdio.h>
#include <string.h>

#include <string>

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "group.h"
#include "memory.h"
#include "neighbor.h"
#include "update.h"

#include "host.h"

using namespace LAMMPS_NS;

bool FixConcordemBond::creation_is_due() const
{
  return !made_ && update->ntimestep >= facts_.at;
}

// Longest bond of the list at the present positions. Fails if a listed atom does not exist.
double FixConcordemBond::longest_listed()
{
  int missing;
  const double longest = concordem_longest_listed(network_, atom, domain, groupbit, world, &missing);
  if (missing)
    fail("the list of bonds names atom " + std::to_string(missing) + ", which is not in group " + group->names[igroup]);
  return longest;
}

ConcordemAtoms FixConcordemBond::arrays()
{
  return concordem_arrays(atom, domain, update, groupbit, facts_.atom_width, memory_, periodic_ ? original_ : NULL);
}

void FixConcordemBond::rebuild()
{
  ConcordemAtoms atoms = arrays();
  // The mean radius is of use to bonds that are measured for the first time.
  const double mean = made_ ? 0.0 : concordem_mean_radius(atom, groupbit, world);
  if (concordem_network_rebuild(network_, &atoms, neighbor->skin, reach_, mean, &message_) < 0) fail_on_this_processor();
}

/* ------------------------------------------------------------------------------------------------- atoms come and go */

void FixConcordemBond::grow_arrays(int nmax)
{
  memory->grow(memory_, nmax, facts_.atom_width, "concordem/bond:memory");
  if (periodic_) memory->grow(original_, nmax, 3, "concordem/bond:original");
}

void FixConcordemBond::copy_arrays(int i, int j, int)
{
  memcpy(memory_[j], memory_[i], sizeof(double) * facts_.atom_width);
}

void FixConcordemBond::set_arrays(int i)
{
  concordem_network_initial_memory(network_, memory_[i]);
}

int FixConcordemBond::pack_exchange(int i, double *buf)
{
  int m = 0;
  for (int r = 0; r < facts_.atom_width; r++) buf[m++] = memory_[i][r];
  const int64_t count = concordem_network_pack(network_, atom->tag[i], 1, buf + m + 1, maxexchange);
  if (count > maxexchange) error->one(FLERR, "fix concordem/bond: buffer for migrating atoms too small (internal error)");
  buf[m++] = static_cast<double>(count);
  return m + static_cast<int>(count);
}

int FixConcordemBond::unpack_exchange(int nlocal, double *buf)
{
  int m = 0;
  for (int r = 0; r < facts_.atom_width; r++) memory_[nlocal][r] = buf[m++];
  const int count = static_cast<int>(buf[m++]);
  if (concordem_network_unpack(network_, atom->tag[nlocal], buf + m, count, &message_) < 0) fail_on_this_processor();
  return m + count;
}

/* --------------------------------------------------------------------------------------------------------- restart */

void FixConcordemBond::write_restart(FILE *fp)
{
  const ConcordemRestartHead head = concordem_restart_head(network_, facts_, made_, law_.c_str(), world);
  if (comm->me == 0) {
    const int size = sizeof(head);
    fwrite(&size, sizeof(int), 1, fp);
    fwrite(&head, sizeof(head), 1, fp);
  }
}

void FixConcordemBond::restart(char *buf)
{
  ConcordemRestartHead head;
  if (!concordem_read_restart_head(buf, &head)) fail("the restart file was written by another version of this library");
  if (law_ != head.law) fail(std::string("the restart file holds bonds of law ") + head.law + ", not " + law_);
  if (head.contacts != facts_.contacts) fail("the restart file holds contacts of another law; give the same `contact LAW`");
  made_ = head.made;
  const double none[CONCORDEM_TOTALS] = {0.0};
  concordem_network_resume(network_, comm->me == 0 ? head.totals : none, head.found_at);
}

int FixConcordemBond::pack_restart(int i, double *buf)
{
  int m = 1;
  for (int r = 0; r < facts_.atom_width; r++) buf[m++] = memory_[i][r];
  m += static_cast<int>(concordem_network_pack(network_, atom->tag[i], 0, buf + m, maxsize_restart()));
  buf[0] = m;
  return m;
}

void FixConcordemBond::unpack_restart(int nlocal, int nth)
{
  double *extra = atom->extra[nlocal];
  int m = 0;
  for (int k = 0; k < nth; k++) m += static_cast<int>(extra[m]);
  const int end = m + static_cast<int>(extra[m]);
  m++;
  for (int r = 0; r < facts_.atom_width; r++) memory_[nlocal][r] = extra[m++];
  if (concordem_network_unpack(network_, atom->tag[nlocal], extra + m, end - m, &message_) < 0) fail_on_this_processor();
}

int FixConcordemBond::size_restart(int i)
{
  return 1 + facts_.atom_width + static_cast<int>(concordem_network_pack(network_, atom->tag[i], 0, NULL, 0));
}

int FixConcordemBond::maxsize_restart()
{
  return 1 + facts_.atom_width + static_cast<int>(concordem_network_largest_pack(network_));
}

/* ---------------------------------------------------------------------------------------------------------- output */

void FixConcordemBond::update_sums()
{
  if (summed_at_ == update->ntimestep && update->setupflag == 0) return;
  double mine[CONCORDEM_SUMS];
  concordem_network_sums(network_, mine);
  MPI_Allreduce(mine, sums_, CONCORDEM_SUMS - 1, MPI_DOUBLE, MPI_SUM, world);
  MPI_Allreduce(mine + CONCORDEM_SUMS - 1, sums_ + CONCORDEM_SUMS - 1, 1, MPI_DOUBLE, MPI_MAX, world);
  summed_at_ = update->ntimestep;
}

double FixConcordemBond::compute_scalar()
{
  update_sums();
  return sums_[0];
}

double FixConcordemBond::compute_vector(int n)
{
  if (n >= 3 && n <= 6 && sampled_at_ != update->ntimestep && update->whichflag == 1)
    fail("sums stored energies when output is due; add `energies every` to have them at every step");
  update_sums();
  return sums_[n];
}

double FixConcordemBond::memory_usage()
{
  return static_cast<double>(atom->nmax) * (facts_.atom_width + (periodic_ ? 3 : 0)) * sizeof(double);
}
