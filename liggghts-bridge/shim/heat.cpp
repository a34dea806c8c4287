/* Heat conduction of fix concordem/bond: groups, the file of `heat_network`, temperatures for output, and `fix_modify ID temperature GROUP
   VALUE`.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include <stdlib.h>
#include <string.h>

#include <algorithm>
#include <string>
#include <vector>

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "fix_bond_base.h"
#include "group.h"
#include "memory.h"
#include "update.h"

#include "host.h"

using namespace LAMMPS_NS;

namespace {

// Ids of an atom (and 0) or of the atoms of a bond.
struct Ids {
  int64_t of[2];
};

}

// Called by the constructor, before atoms get their data.
void FixBondBase::begin_heat()
{
  if (!conducts()) return;
  // In two dimensions LIGGGHTS' masses are those of discs 1 m deep, but areas of bonds are those of spheres.
  if (domain->dimension == 2) fail("`heat` needs `dimension 3`; keep the atoms in a plane with forces along z set to zero");
  for (int k = 0; k < facts_.heat_groups; k++) {
    std::string name(concordem_network_heat_group(network_, k, NULL), ' ');
    concordem_network_heat_group(network_, k, &name[0]);
    heat_groups_.push_back(name);
    const int found = group->find(name.c_str());
    if (found < 0) fail("the file of `heat` names the set " + name + ", but there is no such group; define it before this fix");
    heat_bits_.push_back(group->bitmask[found]);
    if (group->count(found) == 0 && comm->me == 0)
      warn("the group " + name + " of the file of `heat` has no atoms yet; its initial temperature applies only to atoms that are created "
           "later: define the fix after the atoms, or use `fix_modify ID temperature`");
  }
  concordem_network_set_heat_groups(network_, heat_bits_.data());
  // `f_ID` of an atom is its temperature.
  peratom_flag = 1;
  size_peratom_cols = 0;
  peratom_freq = 1;
  if (!facts_.heat_network) return;
  read_heat_network();
  compares_ = true;
}

// The power of a source is shared in proportion to the volumes of its atoms, on all processors. Collective; before each rebuild, because atoms may
// have been inserted or deleted.
void FixBondBase::measure_heated_groups()
{
  ConcordemAtoms atoms = arrays();
  std::vector<double> volumes;
  for (int k = 0; k < facts_.heat_groups; k++) {
    // Another group may have the bit of a deleted one.
    const int found = group->find(heat_groups_[k].c_str());
    if (found < 0 || group->bitmask[found] != heat_bits_[k])
      fail("the group " + heat_groups_[k] + " of the file of `heat` was deleted; define the fix again, or keep the group");
    const int64_t count = concordem_network_heat_volumes(network_, &atoms, k, NULL);
    if (count < 0) continue;
    volumes.resize(count);
    concordem_network_heat_volumes(network_, &atoms, k, volumes.data());
    const double whole = concordem_exact_sum(volumes, world).value();
    if (!(whole > 0.0)) fail("a source of heat has no atoms: group " + heat_groups_[k] + " has none in the group of this fix; add atoms, or remove the source");
    concordem_network_set_heat_volume(network_, k, whole);
  }
}

// Collective.
void FixBondBase::read_heat_network()
{
  share_file(concordem_network_read_heat_network, concordem_network_keep_heat_entries, concordem_network_sort_heat_entries);
  int64_t counts[4], all[2], most;
  concordem_network_heat_counts(network_, counts);
  MPI_Allreduce(counts, all, 2, MPI_INT64_T, MPI_SUM, world);
  const int64_t kept = counts[0] + counts[1];
  MPI_Allreduce(&kept, &most, 1, MPI_INT64_T, MPI_MAX, world);
  if (comm->me == 0)
    print("the file of `heat_network` has " + std::to_string(all[0]) + " atoms and " + std::to_string(all[1]) +
          " bonds; a process keeps at most " + std::to_string(most) + " of them");
}

// Bring what the atoms or bonds of this processor need from the processors that keep it. Collective.
void FixBondBase::ask_heat_network(Asked asked)
{
  if (!facts_.heat_network) return;
  ConcordemAtoms atoms = arrays();
  const int64_t count = concordem_network_asked_heat_entries(network_, &atoms, asked, NULL);
  int64_t most;
  MPI_Allreduce(&count, &most, 1, MPI_INT64_T, MPI_MAX, world);
  if (most == 0) return;
  std::vector<Ids> wanted(count);
  if (count > 0) concordem_network_asked_heat_entries(network_, &atoms, asked, &wanted[0].of);
  for (int64_t start = 0; start < most; start += CONCORDEM_CHUNK) {
    std::vector<std::vector<Ids> > questions(comm->nprocs);
    for (int64_t k = start; k < std::min(start + CONCORDEM_CHUNK, count); k++)
      questions[concordem_keeper(wanted[k].of[0], comm->nprocs)].push_back(wanted[k]);
    std::vector<int> from;
    const std::vector<Ids> here = concordem_send(questions, world, &from);
    std::vector<std::vector<ConcordemHeatEntry> > answers(comm->nprocs);
    size_t at = 0;
    for (int p = 0; p < comm->nprocs; p++) {
      if (from[p] == 0) continue;
      answers[p].resize(from[p]);
      concordem_network_heat_entries(network_, &here[at].of, from[p], answers[p].data());
      at += from[p];
    }
    const std::vector<ConcordemHeatEntry> arrived = concordem_send(answers, world);
    concordem_network_take_heat_entries(network_, arrived.data(), arrived.size());
  }
  if (concordem_network_use_heat_entries(network_, &atoms, asked, &message_) < 0) fail_on_this_processor();
}

// New atoms get their numbers before the volumes of groups are summed, also those that were created in the run. At first, all ask: those of a
// restart or data file brought numbers along.
void FixBondBase::give_heat_network()
{
  ask_heat_network(compares_ ? OF_ATOMS : OF_NEW_ATOMS);
}

// The bonds of a restart or data file brought their numbers along as well. Once, after the first rebuild. Collective.
void FixBondBase::compare_heat_network()
{
  compares_ = false;
  ask_heat_network(OF_BONDS);
  drop_heat_bonds();
}

// The bonds of the file are needed until those of the script are created. Bonds of the atoms' lists may be created at any time, and atoms as
// well.
void FixBondBase::drop_heat_bonds()
{
  if (made_ && !lists_) concordem_network_drop_heat_bonds(network_);
}

// Every atom and bond of the file of `heat_network` must exist. Collective.
void FixBondBase::check_heat_network()
{
  int64_t mine[4], all[4];
  concordem_network_heat_counts(network_, mine);
  MPI_Allreduce(mine, all, 4, MPI_INT64_T, MPI_SUM, world);
  const char *const what[2] = {"atoms", "bonds"};
  for (int k = 0; facts_.heat_network && k < 2; k++)
    if (all[2 + k] != all[k])
      fail("the file of `heat_network` has " + std::to_string(all[k]) + " " + what[k] + ", but " + std::to_string(all[2 + k]) +
           " exist; give the file of this body");
}

void FixBondBase::check_heat_step()
{
  if (conducts() && concordem_network_check_heat_step(network_, update->dt, &message_) < 0) fail_on_this_processor();
}

void FixBondBase::conduct()
{
  ConcordemAtoms atoms = arrays();
  if (concordem_network_conduct(network_, &atoms, &message_) < 0) fail_on_this_processor();
}

void FixBondBase::show_temperatures()
{
  if (!conducts()) return;
  for (int i = 0; i < atom->nlocal; i++) vector_atom[i] = memory_[i][facts_.temperature];
}

int FixBondBase::modify_param(int narg, char **arg)
{
  if (strcmp(arg[0], "temperature") != 0) return 0;
  if (!conducts()) fail("has no temperatures; add `heat FILE`");
  if (narg < 3) fail("`fix_modify " + std::string(id) + " temperature` needs a group and a temperature in K");
  const int found = group->find(arg[1]);
  if (found < 0) fail("`fix_modify " + std::string(id) + " temperature " + arg[1] + "`: there is no such group; define it before");
  char *end;
  const double value = strtod(arg[2], &end);
  if (end == arg[2] || *end || !(value >= 0.0 && value < 1e300))
    fail("`fix_modify " + std::string(id) + " temperature " + arg[1] + " " + arg[2] + "`: give a number, the absolute temperature in K, without a unit");
  // The heat of the change is summed, so new atoms need their capacities.
  ask_heat_network(OF_NEW_ATOMS);
  ConcordemAtoms atoms = arrays();
  concordem_network_set_temperature(network_, &atoms, group->bitmask[found], value);
  // Ghosts need the temperatures before the next step, also of `run N pre no`.
  update->first_update = 0;
  return 3;
}
