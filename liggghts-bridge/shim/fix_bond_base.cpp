/* Host-independent part of fix concordem/bond, see fix_bond_base.h.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "fix_bond_base.h"

#include <stdio.h>
#include <string.h>

#include <algorithm>
#include <string>

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "force.h"
#include "group.h"
#include "memory.h"
#include "modify.h"
#include "neighbor.h"
#include "output.h"
#include "update.h"

#include "host.h"

using namespace LAMMPS_NS;

namespace {

#ifdef CONCORDEM_LAMMPS
const char *const ATOM_STYLES = "use `atom_style bpm/sphere` or `atom_style sphere`";
#else
const char *const ATOM_STYLES = "use `atom_style sphere` (or granular)";
#endif

}

FixBondBase::FixBondBase(LAMMPS *lmp, int narg, char **arg) : Fix(lmp, narg, arg)
{
  message_.text = text_;
  message_.capacity = sizeof(text_);
  text_[0] = 0;
  if (concordem_header_hash() != CONCORDEM_HEADER_HASH) fail("shim and library have different versions; rebuild both");
#ifndef CONCORDEM_LAMMPS
  if (!atom->sphere_flag) fail(std::string("needs atoms with radius, mass, angular velocity, and torque; ") + ATOM_STYLES);
#endif
  if (!atom->radius_flag || !atom->rmass_flag || !atom->omega_flag || !atom->torque_flag)
    fail(std::string("needs atoms with radius, mass, angular velocity, and torque; ") + ATOM_STYLES);
  if (!atom->tag_enable) fail("needs atom ids; remove `atom_modify id no`");
#ifndef CONCORDEM_LAMMPS
  if (force->newton_pair || force->newton)
    fail("needs `newton off`; put that command before the creation of the simulation box");
#endif
  if (domain->triclinic) fail("does not support triclinic boxes; use an orthogonal box");
  if (strcmp(update->unit_style, "si") != 0) fail("needs SI units; use `units si`");

  network_ = concordem_network_new(arg + 3, narg - 3, atom->ntypes, &facts_, &message_);
  if (!network_) fail(text_);
  law_ = arg[3];

  restart_global = 1;
  restart_peratom = 1;
  create_attribute = 1;
  scalar_flag = 1;
  vector_flag = 1;
  size_vector = CONCORDEM_SUMS;
  global_freq = 1;
  extscalar = 1;
  extvector = 1;
  time_depend = 1;
  periodic_ = domain->xperiodic || domain->yperiodic || domain->zperiodic;
  comm_forward = facts_.communicated + (periodic_ ? 3 : 0);

  FixBondBase::grow_arrays(atom->nmax);
  atom->add_callback(0);   // growing arrays
  atom->add_callback(1);   // restart
  for (int i = 0; i < atom->nlocal; i++) FixBondBase::set_arrays(i);
}

FixBondBase::~FixBondBase()
{
  if (network_) {
    atom->delete_callback(id, 0);
    atom->delete_callback(id, 1);
  }
  memory->destroy(memory_);
  memory->destroy(original_);
  concordem_network_delete(network_);
}

// Allows a bond to stretch by 5 % until the next rebuild, which detects longer ones.
void FixBondBase::find_reach(double given, double *smallest)
{
  double wanted = made_ ? 0.0 : given;
  if (!made_ && facts_.creation == 2) wanted = longest_listed();
  const double longest = concordem_longest(network_, facts_, made_, wanted, atom, groupbit, world, smallest);
  reach_ = std::max(1.05 * longest + neighbor->skin, facts_.reach);
}

// The buffer for a migrating atom must hold all its bonds.
int FixBondBase::exchange_size() const
{
  return facts_.atom_width + 2 + static_cast<int>(concordem_network_largest_pack(network_));
}

// Update the data of ghosts. At rebuilds, the host shifts positions of ghosts to their periodic image, which rounds them; bonds need
// the owner's positions bit for bit.
void FixBondBase::communicate()
{
  if (periodic_)
    for (int i = 0; i < atom->nlocal; i++)
      for (int axis = 0; axis < 3; axis++) original_[i][axis] = atom->x[i][axis];
  if (comm_forward) communicate_ghosts();
}

int FixBondBase::pack_ghosts(int count, const int *list, double *buffer) const
{
  return concordem_pack_ghosts(count, list, buffer, facts_.atom_width - facts_.communicated, facts_.atom_width, memory_,
                               periodic_ ? original_ : NULL);
}

void FixBondBase::unpack_ghosts(int count, int first_atom, const double *buffer)
{
  concordem_unpack_ghosts(count, first_atom, buffer, facts_.atom_width - facts_.communicated, facts_.atom_width, memory_,
                          periodic_ ? original_ : NULL);
}

void FixBondBase::make_bonds()
{
  if (facts_.creation == 1 && concordem_network_make_near(network_, &message_) < 0) fail_on_this_processor();
  if (facts_.creation == 2) concordem_network_make_listed(network_);
  if (lists_) queue_bonds_of_lists();
  const bool creates = facts_.creation || lists_;
  if (creates) rebuild();
  made_ = true;
  double total;
  if (!concordem_count(network_, world, &total))
    fail("a bond is longer than the ghost cutoff; add `reach LENGTH` with a larger length");
  if (!creates || comm->me != 0) return;
  print(total);
  if (total == 0.0) warn_no_bonds();
}

void FixBondBase::find_forces(bool setup, bool energies, bool virial_wanted)
{
  ConcordemAtoms atoms = arrays();
  const bool output_is_due = setup || update->ntimestep == output->next;
  const bool sample = output_is_due || energies || facts_.sample_every_step;
  const bool record = output_is_due || virial_wanted || concordem_compute_is_due(modify, update);
  if (concordem_network_forces(network_, &atoms, setup, sample, record, &message_) < 0) fail_on_this_processor();
  if (sample) sampled_at_ = update->ntimestep;
}

bool FixBondBase::creation_is_due() const
{
  return !made_ && update->ntimestep >= facts_.at;
}

// Longest bond of the list at the current positions. Fails if a listed atom does not exist.
double FixBondBase::longest_listed()
{
  int missing;
  const double longest = concordem_longest_listed(network_, atom, domain, groupbit, world, &missing);
  if (missing)
    fail("the list of bonds contains atom " + std::to_string(missing) + ", which is not in group " + group->names[igroup] +
         "; remove the bond, or add the atom to the group");
  return longest;
}

ConcordemAtoms FixBondBase::arrays()
{
  return concordem_arrays(atom, domain, update, groupbit, facts_.atom_width, memory_, periodic_ ? original_ : NULL);
}

void FixBondBase::rebuild()
{
  ConcordemAtoms atoms = arrays();
  // Only new bonds need the mean radius.
  const double mean = made_ ? 0.0 : concordem_mean_radius(atom, groupbit, world);
  if (concordem_network_rebuild(network_, &atoms, neighbor->skin, reach_, mean, &message_) < 0) fail_on_this_processor();
}

/* -------------------------------------------------------------------------------------------- data per atom, migration */

void FixBondBase::grow_arrays(int nmax)
{
  memory->grow(memory_, nmax, facts_.atom_width, "concordem/bond:memory");
  if (periodic_) memory->grow(original_, nmax, 3, "concordem/bond:original");
}

void FixBondBase::copy_arrays(int i, int j, int)
{
  memcpy(memory_[j], memory_[i], sizeof(double) * facts_.atom_width);
}

void FixBondBase::set_arrays(int i)
{
  concordem_network_initial_memory(network_, memory_[i]);
}

int FixBondBase::pack_exchange(int i, double *buf)
{
  int m = 0;
  for (int r = 0; r < facts_.atom_width; r++) buf[m++] = memory_[i][r];
  const int64_t count = concordem_network_pack(network_, atom->tag[i], 1, buf + m + 1, maxexchange);
  if (count > maxexchange) error->one(FLERR, "internal error of fix concordem/bond, please report it: the buffer for migrating atoms is too small");
  buf[m++] = static_cast<double>(count);
  return m + static_cast<int>(count);
}

int FixBondBase::unpack_exchange(int nlocal, double *buf)
{
  int m = 0;
  for (int r = 0; r < facts_.atom_width; r++) memory_[nlocal][r] = buf[m++];
  const int count = static_cast<int>(buf[m++]);
  if (concordem_network_unpack(network_, atom->tag[nlocal], buf + m, count, &message_) < 0) fail_on_this_processor();
  return m + count;
}

/* --------------------------------------------------------------------------------------------------------- restart */

void FixBondBase::write_restart(FILE *fp)
{
  const ConcordemRestartHead head = concordem_restart_head(network_, facts_, made_, law_.c_str(), world);
  if (comm->me == 0) {
    const int size = sizeof(head);
    fwrite(&size, sizeof(int), 1, fp);
    fwrite(&head, sizeof(head), 1, fp);
  }
}

void FixBondBase::restart(char *buf)
{
  ConcordemRestartHead head;
  if (!concordem_read_restart_head(buf, &head)) fail("the restart file was written by another version of ConcorDEM; use that one");
  if (law_ != head.law)
    fail(std::string("the restart file contains bonds of law ") + head.law + ", not " + law_ + "; give the same law");
  if (head.contacts != facts_.contacts)
    fail("the restart file contains contacts of another law; give the same `contact LAW`");
  made_ = head.made;
  const double none[CONCORDEM_TOTALS] = {0.0};
  concordem_network_resume(network_, comm->me == 0 ? head.totals : none, head.found_at);
}

int FixBondBase::pack_restart(int i, double *buf)
{
  int m = 1;
  for (int r = 0; r < facts_.atom_width; r++) buf[m++] = memory_[i][r];
  m += static_cast<int>(concordem_network_pack(network_, atom->tag[i], 0, buf + m, maxsize_restart()));
  buf[0] = m;
  return m;
}

void FixBondBase::unpack_restart(int nlocal, int nth)
{
  double *extra = atom->extra[nlocal];
  int m = 0;
  for (int k = 0; k < nth; k++) m += static_cast<int>(extra[m]);
  const int end = m + static_cast<int>(extra[m]);
  m++;
  for (int r = 0; r < facts_.atom_width; r++) memory_[nlocal][r] = extra[m++];
  if (concordem_network_unpack(network_, atom->tag[nlocal], extra + m, end - m, &message_) < 0) fail_on_this_processor();
}

int FixBondBase::size_restart(int i)
{
  return 1 + facts_.atom_width + static_cast<int>(concordem_network_pack(network_, atom->tag[i], 0, NULL, 0));
}

int FixBondBase::maxsize_restart()
{
  return 1 + facts_.atom_width + static_cast<int>(concordem_network_largest_pack(network_));
}

/* ---------------------------------------------------------------------------------------------------------- output */

void FixBondBase::update_sums()
{
  if (summed_at_ == update->ntimestep && update->setupflag == 0) return;
  double mine[CONCORDEM_SUMS];
  concordem_network_sums(network_, mine);
  MPI_Allreduce(mine, sums_, CONCORDEM_SUMS - 1, MPI_DOUBLE, MPI_SUM, world);
  MPI_Allreduce(mine + CONCORDEM_SUMS - 1, sums_ + CONCORDEM_SUMS - 1, 1, MPI_DOUBLE, MPI_MAX, world);
  summed_at_ = update->ntimestep;
}

double FixBondBase::compute_scalar()
{
  update_sums();
  return sums_[0];
}

double FixBondBase::compute_vector(int n)
{
  if (n >= 3 && n <= 6 && sampled_at_ != update->ntimestep && update->whichflag == 1)
    fail("stored energies are known only at steps with output; add `energies every` to sum them at every step");
  update_sums();
  return sums_[n];
}

double FixBondBase::memory_usage()
{
  return static_cast<double>(atom->nmax) * (facts_.atom_width + (periodic_ ? 3 : 0)) * sizeof(double);
}
