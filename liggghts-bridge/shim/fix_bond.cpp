/* fix concordem/bond for LIGGGHTS, see fix_bond.h.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "fix_bond.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <algorithm>
#include <map>
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
#include "tip.h"

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

namespace {

// Members of LIGGGHTS' class that are not public.
struct StyleOfComm : Comm {
  static constexpr auto multi = &StyleOfComm::style;   // 0: one cutoff for all types
};

}

void FixConcordemBond::init()
{
  if (comm->*StyleOfComm::multi != 0)
    fail("does not support `communicate multi`, where each type has ghosts up to a cutoff that this fix cannot raise; use `communicate single vel yes`");
  if (!comm->ghost_velocity)
    fail("needs the velocities of ghosts; add `communicate single vel yes`");
  check_run();
  for (int k = 0; k < modify->nfix && comm->me == 0; k++)
    if (strncmp(modify->fix[k]->style, "heat/gran", 9) == 0)
      warn(std::string("conducts no heat of fix ") + modify->fix[k]->id + " (" + modify->fix[k]->style +
           ") through its bonds and contacts; use `heat` for bonds, or a pair style for the contacts");
  // In its first setup, LIGGGHTS would reset the data of all atoms after we have stored forces there.
  just_created = 0;
  if (strstr(update->integrate_style, "respa")) fail("does not support run_style respa; use run_style verlet");
  if (periodic_ != concordem_has_images(domain)) fail("the boundaries changed after its definition; define it after `boundary` and change_box");
  find_reach(0.0);
  comm->cutghostuser = std::max(comm->cutghostuser, ghost_cutoff());
  // write_restart exchanges atoms without asking pre_exchange.
  reserve_exchange();
}

// Before atoms change their processors: the temperatures of the ghosts are those of the last step.
void FixConcordemBond::initial_integrate(int)
{
  conduct();
}

namespace {

// The lists of fixes that a run calls.
struct ListsOfModify : Modify {
  static constexpr auto pre_exchange = &ListsOfModify::list_pre_exchange;
  static constexpr auto pre_force = &ListsOfModify::list_pre_force;
};

// Let the fix `index` be called after all others of a list.
void call_last(int *list, int count, int index)
{
  int *const at = std::find(list, list + count, index);
  if (at != list + count) std::rotate(at, at + 1, list + count);
}

}

namespace {

// The numbers that LIGGGHTS gives to the spheres of each clump of a template with `bonded yes`; NULL: there is no such template.
double *numbers_of_clumps(const Modify *modify)
{
  for (int k = 0; k < modify->nfix; k++)
    if (strcmp(modify->fix[k]->id, "bond_random_id") == 0) return modify->fix[k]->vector_atom;
  return NULL;
}

}

// In steps, fixes that change radii come before us, as they do before pair styles. (The list of setup_pre_exchange is in use.)
void FixConcordemBond::setup_pre_exchange()
{
  call_last(modify->*ListsOfModify::pre_force, modify->n_pre_force, modify->my_index(this));
  pre_exchange();
}

void FixConcordemBond::pre_exchange()
{
  number_clumps();
  reserve_exchange();
}

void FixConcordemBond::reserve_exchange()
{
  prepare_exchange();
  if (exchange_size_ > maxexchange) {
    comm->maxexchange_fix += exchange_size_ - maxexchange;
    maxexchange = exchange_size_;
  }
}

void FixConcordemBond::setup_pre_force(int vflag)
{
  // Fixes that insert or delete atoms come before us.
  call_last(modify->*ListsOfModify::pre_exchange, modify->n_pre_exchange, modify->my_index(this));
  check_box(true);
  send_sizes();
  communicate(true);
  follow_changes();
  give_heat_network();
  measure_heated_groups();
  rebuild();
  check_clumps();
  bond_clumps();
  check_heat_step();
  if (creation_is_due()) make_bonds();
  check_resumed();
  check_pair_style();
  warn_without_contacts();
  check_step(SINCE_CHANGE);
  show_temperatures();
  find_forces_and_virial(true, vflag);
}

void FixConcordemBond::pre_force(int vflag)
{
  check_box(false);
  send_sizes();
  ConcordemAtoms atoms = arrays();
  concordem_network_turn(network_, &atoms);
  communicate(neighbor->ago == 0);
  show_temperatures();
  if (neighbor->ago == 0) {
    follow_changes();
    give_heat_network();
    measure_heated_groups();
    rebuild();
    bond_clumps();
    check_pair_style();
  }
  check_step(neighbor->ago == 0 && room_ > 0.0 ? SINCE_CHANGE : SINCE_LAST_CHECK);
  find_forces_and_virial(false, vflag);
  follow_growth();
  // New bonds start unstrained at the end of the step; the next step evaluates them.
  if (creation_is_due()) make_bonds();
}

void FixConcordemBond::check_clumps()
{
  const bool bonds = facts_.creation == 3;
  if (bonds && !numbers_of_clumps(modify))
    fail("`bond clumps` bonds clumps of `fix particletemplate/multiplespheres ... bonded yes`, but there is no such template; define one, or use "
         "`bond distance`");
  if (bonds || !numbers_of_clumps(modify)) return;
  for (int k = 0; k < modify->nfix; k++) {
    const FixConcordemBond *other = dynamic_cast<const FixConcordemBond *>(modify->fix[k]);
    if (other && other->facts_.creation == 3) return;
  }
  fail("a template has `bonded yes`, but no fix concordem/bond bonds its clumps; use `bond clumps FACTOR`, or remove `bonded yes`");
}

// LIGGGHTS draws the numbers of clumps per process, so that clumps of two processes may have the same. Before atoms change their processes, give
// each new clump a number of its own, below -1.
void FixConcordemBond::number_clumps()
{
  double *const number = facts_.creation == 3 ? numbers_of_clumps(modify) : NULL;
  if (!number) return;
  std::map<double, double> own;
  for (int i = 0; i < atom->nlocal; i++) {
    if (number[i] <= 0.0) continue;
    const double next = -2.0 - comm->me - static_cast<double>(comm->nprocs) * own.size();
    number[i] = own.insert(std::make_pair(number[i], next)).first->second;
  }
}

// An inserted clump keeps its number until it is bonded; -1 is that of spheres outside clumps.
void FixConcordemBond::bond_clumps()
{
  if (facts_.creation != 3) return;
  double *const number = numbers_of_clumps(modify);
  std::vector<double> clump(atom->nlocal + atom->nghost);
  int mine = 0, any;
  for (int i = 0; i < atom->nlocal; i++) {
    if (!(atom->mask[i] & groupbit) || (number[i] <= 0.0 && number[i] > -2.0)) continue;
    clump[i] = number[i];
    number[i] = -1.0;
    mine = 1;
  }
  MPI_Allreduce(&mine, &any, 1, MPI_INT, MPI_MAX, world);
  if (!any) return;
  send_to_ghosts(&clump);
  if (concordem_network_make_clumps(network_, clump.data(), clump.size(), &message_) < 0) fail_on_this_processor();
  make_queued();
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
  concordem_leave_out_tip(universe);
  error->fix_error(FLERR, this, text.c_str());
  abort();   // unreachable: fix_error ends the program
}

void FixBondBase::fail_on_this_processor()
{
  // error->one ends the program before the message is written to a pipe.
  if (comm->nprocs == 1) fail(text_);
  const std::string text = std::string("fix ") + id + " concordem/bond: " + text_;
  concordem_leave_out_tip(universe);
  error->one(FLERR, text.c_str());
  abort();   // unreachable: one ends the program
}

void FixBondBase::communicate_ghosts()
{
  comm->forward_comm_fix(this);
}

// LIGGGHTS makes an atom a ghost of a neighboring processor if its center is closer to the border than its radius plus half of the cutoff. That
// suffices for surfaces that touch, but not for bonds, which join centers.
double FixBondBase::ghost_cutoff() const
{
  return std::max(reach_, 2.0 * (reach_ - smallest_));
}

namespace {

struct RulesOfNeighbor : Neighbor {
  static constexpr auto types = &RulesOfNeighbor::nex_type;
  static constexpr auto type1 = &RulesOfNeighbor::ex1_type;
  static constexpr auto type2 = &RulesOfNeighbor::ex2_type;
  static constexpr auto groups = &RulesOfNeighbor::nex_group;
  static constexpr auto group1 = &RulesOfNeighbor::ex1_bit;
  static constexpr auto group2 = &RulesOfNeighbor::ex2_bit;
  static constexpr auto molecules = &RulesOfNeighbor::nex_mol;
  static constexpr auto molecule = &RulesOfNeighbor::ex_mol_bit;
};

}

FixBondBase::ExclusionsOfHost FixBondBase::exclusions_of_host() const
{
  const Neighbor &of = *neighbor;
  const ExclusionsOfHost host = {of.*RulesOfNeighbor::types, of.*RulesOfNeighbor::groups, of.*RulesOfNeighbor::molecules,
                                 {of.*RulesOfNeighbor::type1, of.*RulesOfNeighbor::type2},
                                 {of.*RulesOfNeighbor::group1, of.*RulesOfNeighbor::group2}, of.*RulesOfNeighbor::molecule, NULL};
  return host;
}

// LIGGGHTS has no special bonds between spheres.
void FixBondBase::find_special_pairs(std::vector<std::array<int64_t, 2> > &) {}

void FixBondBase::drop_from_lists(const std::vector<int64_t> &) {}

bool FixBondBase::has_pair_style_for_spheres() const
{
  std::vector<Pair *> styles(1, force->pair);
  const PairHybrid *hybrid = dynamic_cast<const PairHybrid *>(force->pair);
  if (hybrid) styles.assign(hybrid->styles, hybrid->styles + hybrid->nstyles);
  for (size_t k = 0; k < styles.size(); k++) {
    PairGran *pair = dynamic_cast<PairGran *>(styles[k]);
    if (pair && !concordem_is_our_model(pair)) return true;
  }
  return false;
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
