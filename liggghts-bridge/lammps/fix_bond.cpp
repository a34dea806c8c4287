/* fix concordem/bond for LAMMPS, see fix_bond.h. Differences from LIGGGHTS: it adds forces after those of pair styles (which may
   compute the virial from the sum of forces), tallies virials, and can take bonds from the atoms' lists.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "fix_bond.h"

#include <array>
#include <cstring>
#include <vector>

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "force.h"
#include "neighbor.h"
#include "update.h"

#include "host.h"

using namespace LAMMPS_NS;

FixConcordemBond::FixConcordemBond(LAMMPS *lmp, int narg, char **arg) : FixBondBase(lmp, narg, arg)
{
  virial_global_flag = 1;
  virial_peratom_flag = 1;
  thermo_virial = 1;
  maxexchange_dynamic = 1;
}

// LAMMPS keeps calling the fixes of its last setup, so `run N pre no` would call a deleted fix. Resetting first_update forces a setup at
// the next run. (On exit, LAMMPS deletes `update` before the fixes.)
FixConcordemBond::~FixConcordemBond()
{
  if (update) update->first_update = 0;
}

int FixConcordemBond::setmask()
{
  return FixConst::PRE_EXCHANGE | FixConst::PRE_FORCE | FixConst::POST_FORCE;
}

void FixConcordemBond::serve(const ConcordemStyle *style, bool lists)
{
  style_ = style;
  lists_ = lists;
  // The style tallies the virial.
  virial_global_flag = virial_peratom_flag = thermo_virial = 0;
}

void FixConcordemBond::init()
{
  if (!comm->ghost_velocity) fail("needs the velocities of ghosts; add `comm_modify vel yes`");
  if (domain->deform_flag) fail("does not support deforming boxes; remove `fix deform`");
  if (utils::strmatch(update->integrate_style, "^respa"))
    fail("does not support run_style respa; use run_style verlet");
  if (periodic_ != (domain->xperiodic || domain->yperiodic || domain->zperiodic))
    fail("the boundaries changed after its definition; define it after `boundary` and change_box");

  double smallest = 0.0;
  find_reach(!made_ && lists_ ? longest_given() : 0.0, &smallest);
  comm->cutghostuser = MAX(comm->cutghostuser, reach_);
  if (made_ && lists_) compare_with_lists();
}

// Longest bond in the atoms' lists.
double FixConcordemBond::longest_given()
{
  // Ghosts may not exist yet, so gather the positions of partners on other processors.
  std::vector<int> asked;
  for (int i = 0; i < atom->nlocal; i++)
    for (int m = 0; m < atom->num_bond[i]; m++) {
      if (atom->bond_type[i][m] <= 0) continue;
      const int j = atom->map(atom->bond_atom[i][m]);
      if (j < 0 || j >= atom->nlocal) asked.push_back(atom->bond_atom[i][m]);
    }
  std::sort(asked.begin(), asked.end());
  asked.erase(std::unique(asked.begin(), asked.end()), asked.end());
  int count = asked.size(), total = 0;
  std::vector<int> counts(comm->nprocs), starts(comm->nprocs);
  MPI_Allgather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, world);
  for (int p = 0; p < comm->nprocs; p++) starts[p] = total, total += counts[p];
  std::vector<int> all(total);
  MPI_Allgatherv(asked.data(), count, MPI_INT, all.data(), counts.data(), starts.data(), MPI_INT, world);
  std::vector<double> mine(4 * total, 0.0), found(4 * total, 0.0);
  for (int k = 0; k < total; k++) {
    const int i = atom->map(all[k]);
    if (i < 0 || i >= atom->nlocal) continue;
    for (int axis = 0; axis < 3; axis++) mine[4 * k + axis] = atom->x[i][axis];
    mine[4 * k + 3] = 1.0;
  }
  MPI_Allreduce(mine.data(), found.data(), 4 * total, MPI_DOUBLE, MPI_SUM, world);
  double longest = 0.0;
  for (int i = 0; i < atom->nlocal; i++)
    for (int m = 0; m < atom->num_bond[i]; m++) {
      if (atom->bond_type[i][m] <= 0) continue;
      const int partner = atom->bond_atom[i][m];
      const int j = atom->map(partner);
      const double *x;
      if (j >= 0 && j < atom->nlocal) {
        x = atom->x[j];
      } else {
        const int k = starts[comm->me] + static_cast<int>(std::lower_bound(asked.begin(), asked.end(), partner) - asked.begin());
        x = &found[4 * k];
        if (found[4 * k + 3] == 0.0)
          error->one(FLERR, "Fix {} concordem/bond: atom {} is bonded to atom {}, which does not exist; remove the bond", id,
                     atom->tag[i], partner);
      }
      double d[3];
      for (int axis = 0; axis < 3; axis++) d[axis] = x[axis] - atom->x[i][axis];
      domain->minimum_image(FLERR, d[0], d[1], d[2]);
      longest = MAX(longest, sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]));
    }
  return longest;
}

void FixConcordemBond::setup_pre_exchange()
{
  FixConcordemBond::pre_exchange();
}

void FixConcordemBond::pre_exchange()
{
  maxexchange = exchange_size();
}

void FixConcordemBond::setup_pre_force(int)
{
  setup_ = true;
  communicate();
  rebuild();
  if (creation_is_due()) make_bonds();
}

void FixConcordemBond::pre_force(int)
{
  setup_ = false;
  ConcordemAtoms atoms = arrays();
  concordem_network_turn(network_, &atoms);
  communicate();
  if (neighbor->ago == 0) rebuild();
}

void FixConcordemBond::setup(int vflag)
{
  FixConcordemBond::post_force(vflag);
}

void FixConcordemBond::post_force(int vflag)
{
  if (!style_) {
    v_init(vflag);
    find_forces(false, vflag_either);
    add_virial(vflag_global, virial, vflag_atom, vatom);
  }
  // New bonds start unstrained at the end of the step; the next step evaluates them.
  if (!setup_ && creation_is_due()) make_bonds();
}

void FixConcordemBond::find_forces(bool energies, bool virial_wanted)
{
  FixBondBase::find_forces(setup_, energies, virial_wanted);
  if (lists_) remove_broken_from_lists();
}

void FixConcordemBond::add_virial(int global, double *sum, int per_atom, double **of_atoms) const
{
  if (!global && !per_atom) return;
  double total[6] = {0.0};
  concordem_network_virial(network_, total, per_atom ? of_atoms[0] : nullptr, per_atom ? atom->nlocal : 0);
  if (global)
    for (int k = 0; k < 6; k++) sum[k] += total[k];
}

double FixConcordemBond::touching()
{
  update_sums();
  return sums_[2];
}

double FixConcordemBond::stored_energy() const
{
  double sums[CONCORDEM_SUMS];
  concordem_network_sums(network_, sums);
  return sums[3] + sums[4] + sums[5] + sums[6];
}

int FixConcordemBond::pack_forward_comm(int n, int *list, double *buf, int, int *)
{
  return pack_ghosts(n, list, buf);
}

void FixConcordemBond::unpack_forward_comm(int n, int first_atom, double *buf)
{
  unpack_ghosts(n, first_atom, buf);
}

// Remove broken bonds from the atoms' lists.
void FixConcordemBond::remove_broken_from_lists()
{
  const int32_t(*pairs)[2];
  const int64_t count = concordem_network_broken_now(network_, &pairs);
  for (int64_t k = 0; k < count; k++)
    for (int end = 0; end < 2; end++) {
      const int i = atom->map(pairs[k][end]);
      if (i < 0 || i >= atom->nlocal) continue;
      const int partner = pairs[k][1 - end], last = atom->num_bond[i] - 1;
      for (int m = 0; m <= last; m++) {
        if (atom->bond_atom[i][m] != partner) continue;
        atom->bond_atom[i][m] = atom->bond_atom[i][last];
        atom->bond_type[i][m] = atom->bond_type[i][last];
        atom->num_bond[i] = last;
        break;
      }
    }
  // Type 0 disables a bond in LAMMPS' bond list until the list is rebuilt.
  if (count)
    for (int n = 0; n < neighbor->nbondlist; n++) {
      int *bond = neighbor->bondlist[n];
      const int a = MIN(atom->tag[bond[0]], atom->tag[bond[1]]), b = MAX(atom->tag[bond[0]], atom->tag[bond[1]]);
      for (int64_t k = 0; k < count; k++)
        if (pairs[k][0] == a && pairs[k][1] == b) bond[2] = 0;
    }
}

// Fails if another command changed the atoms' lists of bonds.
void FixConcordemBond::compare_with_lists()
{
  double mine[3] = {0.0, 0.0, 0.0}, all[3];
  concordem_network_ends(network_, mine);
  for (int i = 0; i < atom->nlocal; i++)
    for (int m = 0; m < atom->num_bond[i]; m++)
      if (atom->bond_type[i][m] > 0) mine[2] += 1.0;
  MPI_Allreduce(mine, all, 3, MPI_DOUBLE, MPI_SUM, world);
  // Right after a restart, the network has no bonds yet.
  if (all[0] == 0.0 && all[1] == 0.0) return;
  if (all[0] + all[1] != all[2])
    fail(fmt::format("the atoms' lists contain {:.0f} bond ends, but the last run ended with {:.0f}; do not add or remove bonds after "
                     "the first run",
                     all[2], all[0] + all[1]));
}

/* --------------------------------------------------------------------------- functions of the base class specific to LAMMPS */

void FixBondBase::fail(const std::string &text)
{
  error->all(FLERR, "Fix {} concordem/bond: {}", id, text);
}

void FixBondBase::fail_on_this_processor()
{
  error->one(FLERR, "Fix {} concordem/bond: {}", id, text_);
}

void FixBondBase::communicate_ghosts()
{
  comm->forward_comm(this);
}

void FixBondBase::queue_bonds_of_lists()
{
  std::vector<std::array<int32_t, 2>> pairs;
  for (int i = 0; i < atom->nlocal; i++)
    for (int m = 0; m < atom->num_bond[i]; m++)
      if (atom->bond_type[i][m] > 0) pairs.push_back({atom->tag[i], atom->bond_atom[i][m]});
  concordem_network_make_given(network_, reinterpret_cast<const int32_t(*)[2]>(pairs.data()), pairs.size());
}

void FixBondBase::print(double bonds)
{
  utils::logmesg(lmp, "fix {} concordem/bond: {:.0f} bonds of law {}\n", id, bonds, law_);
}

void FixBondBase::warn_no_bonds()
{
  error->warning(FLERR, "Fix {} concordem/bond created no bonds; {}", id,
                 lists_ ? "the atoms' bond lists are empty" : "check the distance factor and the group");
}
