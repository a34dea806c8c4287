/* Heat conduction of fix concordem/bond: groups, temperatures for output, and `fix_modify ID temperature GROUP VALUE`.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include <stdlib.h>
#include <string.h>

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

// Every atom and bond of the file of `heat_network` must exist. Collective.
void FixBondBase::check_heat_network()
{
  double mine[4], all[4];
  concordem_network_heat_counts(network_, mine);
  MPI_Allreduce(mine, all, 4, MPI_DOUBLE, MPI_SUM, world);
  const char *const what[2] = {"atoms", "bonds"};
  for (int k = 0; k < 2; k++)
    if (all[2 + k] != mine[k])
      fail("the file of `heat_network` has " + std::to_string(static_cast<long long>(mine[k])) + " " + what[k] + ", but " +
           std::to_string(static_cast<long long>(all[2 + k])) + " exist; give the file of this body");
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
  ConcordemAtoms atoms = arrays();
  concordem_network_set_temperature(network_, &atoms, group->bitmask[found], value);
  // Ghosts need the temperatures before the next step, also of `run N pre no`.
  update->first_update = 0;
  return 3;
}
