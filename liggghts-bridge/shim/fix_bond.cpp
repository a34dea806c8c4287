/* fix concordem/bond for LIGGGHTS, see fix_bond.h.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "fix_bond.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <algorithm>
#include <string>
#include <vector>

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "force.h"
#include "group.h"
#include "modify.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "pair_gran.h"
#include "pair_hybrid.h"
#include "update.h"

#include "pair_contact.h"

using namespace LAMMPS_NS;

FixConcordemBond::FixConcordemBond(LAMMPS *lmp, int narg, char **arg) : FixBondBase(lmp, narg, arg)
{
  virial_flag = 1;
}

// LIGGGHTS keeps calling the fixes of its last setup, so `run N pre no` would call a deleted fix. Resetting first_update forces a setup
// at the next run.
void FixConcordemBond::pre_delete(bool unfix)
{
  if (unfix) update->first_update = 0;
}

int FixConcordemBond::setmask()
{
  return FixConst::PRE_EXCHANGE | FixConst::PRE_FORCE | (conducts() ? FixConst::INITIAL_INTEGRATE : 0);
}

void FixConcordemBond::init()
{
  if (!comm->ghost_velocity)
    fail("needs the velocities of ghosts; add `communicate single vel yes`");
  check_run();
  // In its first setup, LIGGGHTS would reset the data of all atoms after we have stored forces there.
  just_created = 0;
  if (strstr(update->integrate_style, "respa")) fail("does not support run_style respa; use run_style verlet");
  if (periodic_ != (domain->xperiodic || domain->yperiodic || domain->zperiodic))
    fail("the boundaries changed after its definition; define it after `boundary` and change_box");

  double smallest = 0.0;
  find_reach(0.0, &smallest);
  // LIGGGHTS makes an atom a ghost of a neighboring processor if its center is closer to the border than its radius plus half of the
  // cutoff. That suffices for surfaces that touch, but not for bonds, which join centers.
  comm->cutghostuser = std::max(comm->cutghostuser, std::max(reach_, 2.0 * (reach_ - smallest)));
}

// Before atoms change their processors: the temperatures of the ghosts are those of the last step.
void FixConcordemBond::initial_integrate(int)
{
  conduct();
}

void FixConcordemBond::setup_pre_exchange()
{
  pre_exchange();
}

void FixConcordemBond::pre_exchange()
{
  const int needed = exchange_size();
  if (needed > maxexchange) {
    comm->maxexchange_fix += needed - maxexchange;
    maxexchange = needed;
  }
}

void FixConcordemBond::setup_pre_force(int vflag)
{
  check_box(true);
  communicate(true);
  give_heat_network();
  measure_heated_groups();
  rebuild();
  check_heat_step();
  if (creation_is_due()) make_bonds();
  check_resumed();
  check_pair_style();
  show_temperatures();
  find_forces_and_virial(true, vflag);
}

void FixConcordemBond::pre_force(int vflag)
{
  check_box(false);
  ConcordemAtoms atoms = arrays();
  concordem_network_turn(network_, &atoms);
  communicate(neighbor->ago == 0);
  show_temperatures();
  if (neighbor->ago == 0) {
    give_heat_network();
    measure_heated_groups();
    rebuild();
    check_pair_style();
  }
  find_forces_and_virial(false, vflag);
  // New bonds start unstrained at the end of the step; the next step evaluates them.
  if (creation_is_due()) make_bonds();
}

int FixConcordemBond::pack_comm(int n, int *list, double *buf, int, int *)
{
  pack_ghosts(n, list, buf);
  return reals_of_ghost();
}

void FixConcordemBond::unpack_comm(int n, int first_atom, double *buf)
{
  unpack_ghosts(n, first_atom, buf);
}

void FixConcordemBond::find_forces_and_virial(bool setup, int vflag)
{
  if (vflag) v_setup(vflag);
  else evflag = 0;
  find_forces(setup, false, vflag);
  if (vflag) find_virial(setup, virial, vflag_atom ? vatom : NULL);
}

int64_t FixConcordemBond::own_pairs(NeighList *list, unsigned char *marks, int64_t capacity, int64_t *first)
{
  ConcordemPairLists lists;
  lists.atoms = list->inum;
  lists.index_bits = NEIGHMASK;
  lists.list = list->ilist;
  lists.numbers = list->numneigh;
  lists.neighbors = list->firstneigh;
  for (int k = 0; k < 4; k++) lists.weights[k] = 1.0;
  ConcordemAtoms atoms = arrays();
  return concordem_network_own_pairs(network_, &atoms, &lists, marks, capacity, first);
}

void FixConcordemBond::mark_pairs(NeighList *list, std::vector<unsigned char> &marks)
{
  int64_t first[2];
  own_pairs(list, marks.data(), marks.size(), first);
}

// LIGGGHTS' own models know nothing of our bonds and contacts, and would add their forces to ours, alone or in pair_style hybrid. Our
// models leave them out.
void FixConcordemBond::check_pair_style()
{
  std::vector<Pair *> styles(1, force->pair);
  const PairHybrid *hybrid = dynamic_cast<const PairHybrid *>(force->pair);
  if (hybrid) styles.assign(hybrid->styles, hybrid->styles + hybrid->nstyles);
  for (size_t k = 0; k < styles.size(); k++) {
    PairGran *pair = dynamic_cast<PairGran *>(styles[k]);
    int64_t first[2];
    if (!pair || !pair->list || concordem_is_our_model(pair) || own_pairs(pair->list, NULL, 0, first) == 0) continue;
    const std::string style = hybrid ? std::string("the sub-style gran of pair_style ") + force->pair_style : "pair_style gran";
    const std::string group_name = group->names[igroup];
    snprintf(text_, sizeof(text_),
             "atoms %lld and %lld: both %s and this fix compute the forces between them. Use a model of ConcorDEM, which leaves out these "
             "pairs: `gran model concordem/hertz ...` instead of `gran model hertz ...`. Or take them out of the neighbor lists: "
             "`neigh_modify exclude group %s %s`",
             static_cast<long long>(first[0]), static_cast<long long>(first[1]), style.c_str(), group_name.c_str(), group_name.c_str());
    fail_on_this_processor();
  }
}

/* ------------------------------------------------------------------------- functions of the base class specific to LIGGGHTS */

void FixBondBase::fail(const std::string &text)
{
  error->fix_error(FLERR, this, text.c_str());
  abort();   // unreachable: fix_error ends the program
}

void FixBondBase::fail_on_this_processor()
{
  // error->one ends the program before the message is written to a pipe.
  if (comm->nprocs == 1) fail(text_);
  const std::string text = std::string("fix ") + id + " concordem/bond: " + text_;
  error->one(FLERR, text.c_str());
  abort();   // unreachable: one ends the program
}

void FixBondBase::communicate_ghosts()
{
  comm->forward_comm_fix(this);
}

ConcordemBondLists FixBondBase::lists_of_atoms() const
{
  return ConcordemBondLists();
}

std::string FixBondBase::changer_of_box() const
{
  for (int k = 0; k < modify->nfix; k++) {
    const Fix *fix = modify->fix[k];
    if (fix->box_change_size || fix->box_change_shape) return std::string(fix->id) + " (" + fix->style + ")";
  }
  return "";
}

std::string FixBondBase::lost_in_restart() const
{
  std::string other;
  for (int k = 0; k < modify->n_restart_data_global_style(style); k++) {
    const std::string found = modify->id_restart_data_global_style(style, k);
    if (found == id) return "";
    other = found;
  }
  return other;
}

void FixBondBase::print(const std::string &text)
{
  for (int k = 0; k < 2; k++) {
    FILE *out = k ? logfile : screen;
    if (out) fprintf(out, "fix %s concordem/bond: %s\n", id, text.c_str());
  }
}

void FixBondBase::warn(const std::string &text)
{
  const std::string whole = std::string("fix ") + id + " concordem/bond " + text;
  error->warning(FLERR, whole.c_str());
}
