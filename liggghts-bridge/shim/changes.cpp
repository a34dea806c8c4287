/* What other commands of the script change while fix concordem/bond runs: processors, numbers, sizes, and masses of atoms, and the pairs
   that may touch.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include <stdio.h>
#include <string.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "fix_bond_base.h"
#include "force.h"
#include "group.h"
#include "modify.h"
#include "neighbor.h"
#include "update.h"

#include "host.h"

using namespace LAMMPS_NS;

bool FixBondBase::changes_radii(const Fix *fix)
{
  return strncmp(fix->style, "adapt", 5) == 0 || strcmp(fix->style, "set") == 0;
}

// An atom that crosses a corner of the processor grid passes over other processors, whose buffers must also hold its bonds. Atoms that were
// inserted may be larger than all before.
void FixBondBase::prepare_exchange()
{
  const double none = -1e300;
  double mine[3] = {static_cast<double>(facts_.atom_width + 2 + concordem_network_largest_pack(network_)), 0.0, none}, all[3];
  for (int i = 0; i < atom->nlocal; i++) {
    if (!(atom->mask[i] & groupbit)) continue;
    mine[1] = std::max(mine[1], atom->radius[i]);
    mine[2] = std::max(mine[2], -atom->radius[i]);
  }
  MPI_Allreduce(mine, all, 3, MPI_DOUBLE, MPI_MAX, world);
  exchange_size_ = static_cast<int>(all[0]);
  if (all[1] == 0.0) return;
  double longest = contacts_ ? 2.0 * all[1] : 0.0;
  if ((!made_ && facts_.creation == 1) || facts_.creation == 3) longest = std::max(longest, facts_.factor * 2.0 * all[1]);
  reach_ = std::max(reach_, 1.05 * longest + neighbor->skin + 2.0 * room_);
  smallest_ = smallest_ > 0.0 ? std::min(smallest_, -all[2]) : -all[2];
  const double cutoff = ghost_cutoff();
  if (cutoff <= comm->cutghostuser) return;
  comm->cutghostuser = cutoff;
  comm->setup();
  neighbor->setup_bins();
}

// The hosts send radii to ghosts before fixes change those of owned atoms, or not at all.
void FixBondBase::send_sizes()
{
  if (room_ == 0.0) return;
  sends_sizes_ = true;
  communicate_ghosts();
  sends_sizes_ = false;
}

// Ghosts cover growth by room_ until the next rebuild, which must come before that is used up.
void FixBondBase::follow_growth()
{
  if (room_ == 0.0) return;
  double mine = concordem_network_grown(network_), all;
  MPI_Allreduce(&mine, &all, 1, MPI_DOUBLE, MPI_MAX, world);
  if (all > room_) {
    snprintf(text_, sizeof(text_),
             "radii have grown by %.4g since the last rebuild of the neighbor lists, more than a quarter of the skin (%.4g), so that contacts "
             "may be missed; change them more often and less each time, or increase the skin (`neighbor`)",
             all, neighbor->skin);
    fail(text_);
  }
  if (all > 0.5 * room_) next_reneighbor = update->ntimestep + 1;
}

void FixBondBase::follow_changes()
{
  forget_lost_atoms();
  frozen_ = 0;
  body_mass_.clear();
  for (int k = 0; k < modify->nfix; k++) {
    Fix *fix = modify->fix[k];
    if (strncmp(fix->style, "freeze", 6) == 0) frozen_ |= fix->groupbit;
    if (!fix->rigid_flag) continue;
    body_mass_.resize(atom->nlocal + atom->nghost, 0.0);
    int size;
    const int *body = static_cast<const int *>(fix->extract("body", size));
    const double *total = static_cast<const double *>(fix->extract("masstotal", size));
    for (int i = 0; body && total && i < atom->nlocal; i++)
      if (body[i] >= 0) body_mass_[i] = total[body[i]];
  }
  if (!body_mass_.empty()) {
    send_to_ghosts(&body_mass_);
  }
  find_exclusions();
}

// Masses may change at any step.
void FixBondBase::find_effective_masses()
{
  effective_mass_.clear();
  if (!frozen_ && body_mass_.empty()) return;
  effective_mass_.assign(atom->rmass, atom->rmass + atom->nlocal + atom->nghost);
  for (size_t i = 0; i < effective_mass_.size(); i++) {
    if (i < body_mass_.size() && body_mass_[i] > 0.0) effective_mass_[i] = body_mass_[i];
    if (atom->mask[i] & frozen_) effective_mass_[i] = CONCORDEM_FROZEN_MASS;
  }
}

/* ------------------------------------------------------------------------------------------------- pairs without contacts */

void FixBondBase::find_exclusions()
{
  if (!contacts_) return;
  const int count = atom->nlocal + atom->nghost;
  const ExclusionsOfHost host = exclusions_of_host();
  std::vector<ConcordemRules> &rules = exclusion_rules_;
  rules.clear();
  // Pairs with an atom outside the group of `neigh_modify include` are in no list of the hosts.
  const int included = neighbor->includegroup ? group->bitmask[neighbor->includegroup] : 0;
  if (facts_.follows_exclusions != 0 && (included || host.types + host.groups + host.molecules > 0)) {
    if (host.types + host.groups + (included != 0) > 64 || host.molecules > 64) fail("supports up to 64 `neigh_modify exclude` for types and groups, and 64 for molecules; combine some");
    const ConcordemRules none = {0, 0, 0, 0, 0};
    rules.assign(count, none);
    uint64_t mine[4] = {0}, all[4];
    for (int i = 0; i < count; i++) {
      ConcordemRules &of = rules[i];
      for (int k = 0; k < host.types + host.groups; k++) {
        const int group = k - host.types;
        for (int side = 0; side < 2; side++) {
          const bool in = group < 0 ? atom->type[i] == host.type[side][k] : atom->mask[i] & host.group[side][group];
          if (in) (side ? of.second : of.first) |= UINT64_C(1) << k;
        }
      }
      if (included) {
        const uint64_t last = UINT64_C(1) << 63;
        if (!(atom->mask[i] & included)) of.first |= last;
        of.second |= last;
      }
      // LIGGGHTS' clumps are molecules; atoms outside have a negative one.
      for (int k = 0; k < host.molecules; k++)
        if (atom->mask[i] & host.molecule[k] && (host.same_molecule || atom->molecule[i] >= 0))
          (!host.same_molecule || host.same_molecule[k] ? of.same_molecule : of.other_molecule) |= UINT64_C(1) << k;
      if (host.molecules) of.molecule = atom->molecule[i];
      if (i >= atom->nlocal || !(atom->mask[i] & groupbit)) continue;
      mine[0] |= of.first;
      mine[1] |= of.second;
      mine[2] |= of.same_molecule | of.other_molecule;
    }
    if (facts_.follows_exclusions < 0 && has_pair_style_for_spheres()) {
      MPI_Allreduce(mine, all, 4, MPI_UINT64_T, MPI_BOR, world);
      if (all[0] & all[1] || all[2])
        fail(std::string("`neigh_modify exclude` (or `include`) names pairs of group ") + group->names[igroup] +
             ", whose contacts this fix computes. Add `exclude ignore` if it takes them out of the pair style only, or `exclude follow` if they "
             "have no contacts");
    }
  }
  excluded_pairs_.clear();
  find_special_pairs(excluded_pairs_);
}

// Not a fault: a script may have reasons. `contact none` says so.
void FixBondBase::warn_without_contacts()
{
  told_lost_ = false;
  if (contacts_ || facts_.contact_given || force->pair || comm->me != 0) return;
  warn("computes no contacts, and there is no pair style: unbonded atoms pass through each other, also those of broken bonds. Add `contact LAW`, "
       "a pair style, or, if that is meant, `contact none`");
}

/* ------------------------------------------------------------------------------------------------------------- lost atoms */

// Atoms may leave the box, or be deleted. Their bonds are gone, too. That an atom is out of sight does not mean that it is gone, so ask all
// processors.
void FixBondBase::forget_lost_atoms()
{
  const ConcordemAtoms atoms = arrays();
  const int64_t mine[2] = {concordem_network_known(network_, &atoms), atom->nlocal};
  int64_t all[2];
  MPI_Allreduce(mine, all, 2, MPI_INT64_T, MPI_SUM, world);
  const bool fewer = all[0] < atoms_before_;
  atoms_before_ = all[1];
  if (!fewer) return;
  std::vector<int64_t> absent(concordem_network_absent(network_, &atoms, NULL)), gone;
  concordem_network_absent(network_, &atoms, absent.data());
  const int everyone = 1;
  const std::vector<ConcordemPlace> places = concordem_places(absent, atom, everyone, world);
  for (size_t k = 0; k < places.size(); k++)
    if (places[k].owner < 0) gone.push_back(places[k].tag);
  const int64_t here = concordem_network_forget(network_, &atoms, gone.data(), gone.size());
  drop_from_lists(gone);
  int64_t bonds;
  MPI_Allreduce(&here, &bonds, 1, MPI_INT64_T, MPI_SUM, world);
  if (bonds == 0 || told_lost_ || comm->me != 0) return;
  told_lost_ = true;
  warn("has lost " + std::to_string(static_cast<long long>(bonds)) + " bonds of atoms that left the box or were deleted; in this run, further losses are not "
       "reported");
}

/* -------------------------------------------------------------------------------------------------------------- time step */

// Another step, radii, or masses change the bound, also within a run. Atoms may be held or moved by other fixes, so that a larger step need
// not be wrong.
void FixBondBase::check_step(Since since)
{
  if (!made_ || (since == SINCE_LAST_CHECK && checked_step_ == update->dt)) return;
  checked_step_ = update->dt;
  const double mine = concordem_network_stable_step(network_, update->dt);
  MPI_Allreduce(&mine, &stable_step_, 1, MPI_DOUBLE, MPI_MIN, world);
  if (stable_step_ >= update->dt || warned_step_ == update->dt) return;
  warned_step_ = update->dt;
  if (comm->me != 0) return;
  char text[300];
  snprintf(text, sizeof(text),
           "is unstable with `timestep %.4g`: the bonds and contacts of free atoms allow at most %.4g. Reduce it, also because damping and "
           "new contacts lower this bound",
           update->dt, stable_step_);
  warn(text);
}
