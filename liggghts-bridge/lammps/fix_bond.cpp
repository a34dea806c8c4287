/* fix concordem/bond for LAMMPS, see fix_bond.h. Differences from LIGGGHTS: it adds forces after those of pair styles (which may
   compute the virial from the sum of forces) and before all other fixes, tallies virials, and can take bonds from the atoms' lists.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "fix_bond.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstring>
#include <set>
#include <thread>
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
#include "update.h"

#include "host.h"
#include "pair_style.h"

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
  return FixConst::PRE_EXCHANGE | FixConst::PRE_FORCE | FixConst::PRE_REVERSE | (conducts() ? FixConst::INITIAL_INTEGRATE : 0);
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
  check_run();
  if (utils::strmatch(update->integrate_style, "^respa"))
    fail("does not support run_style respa; use run_style verlet");
  check_fixes();
  if (periodic_ != concordem_has_images(domain)) fail("the boundaries changed after its definition; define it after `boundary` and change_box");
  find_reach(!made_ && lists_ ? longest_given() : 0.0);
  comm->cutghostuser = MAX(comm->cutghostuser, ghost_cutoff());
  check_special_bonds();
  // write_restart and write_data exchange atoms without asking pre_exchange.
  prepare_exchange();
  maxexchange = exchange_size_;
}

// Longest bond in the atoms' lists.
double FixConcordemBond::longest_given()
{
  // Ghosts may not exist yet, so ask for the positions of partners on other processors.
  std::vector<int64_t> asked;
  for (int i = 0; i < atom->nlocal; i++)
    for (int m = 0; m < atom->num_bond[i]; m++) {
      if (atom->bond_type[i][m] <= 0) continue;
      const int j = atom->map(atom->bond_atom[i][m]);
      if (j < 0 || j >= atom->nlocal) asked.push_back(atom->bond_atom[i][m]);
    }
  const std::vector<ConcordemPlace> places = concordem_places(asked, atom, groupbit, world);
  double longest = 0.0;
  size_t next = 0;
  for (int i = 0; i < atom->nlocal; i++)
    for (int m = 0; m < atom->num_bond[i]; m++) {
      if (atom->bond_type[i][m] <= 0) continue;
      const tagint partner = atom->bond_atom[i][m];
      const int j = atom->map(partner);
      const double *x = j >= 0 && j < atom->nlocal ? atom->x[j] : places[next].x;
      if ((j < 0 || j >= atom->nlocal) && places[next++].owner < 0)
        error->one(FLERR, "Fix {} concordem/bond: atom {} is bonded to atom {}, which does not exist; remove the bond", id,
                   atom->tag[i], partner);
      longest = MAX(longest, concordem_distance(atom->x[i], x, domain));
    }
  return longest;
}

// Before atoms change their processors: the temperatures of the ghosts are those of the last step.
void FixConcordemBond::initial_integrate(int)
{
  conduct();
}

void FixConcordemBond::setup_pre_exchange()
{
  FixConcordemBond::pre_exchange();
}

void FixConcordemBond::pre_exchange()
{
  prepare_exchange();
  maxexchange = exchange_size_;
}

namespace {

struct ListsOfModify : Modify {
  static constexpr auto pre_exchange = &ListsOfModify::list_pre_exchange;
};

}

// Forces depend on the history of the steps: each step finds them once, at the positions of the step.
namespace {

const char *const ONCE = "but forces of bonds and contacts depend on their history; remove that command, or compute it without ConcorDEM";

}

// Fixes that try positions, or numbers and kinds of atoms, and those that hold bonds.
void FixConcordemBond::check_fixes()
{
  for (const Fix *fix : modify->get_fix_list())
    for (const char *style : {"^numdiff", "^atom/swap", "^mol/swap", "^neighbor/swap", "^gcmc", "^sgcmc", "^widom", "^charge/regulation", "^hmc"})
      if (utils::strmatch(fix->style, style))
        fail(fmt::format("fix {} ({}) asks for energies of positions that it tries, {}", fix->id, fix->style, ONCE));
  // They ask the bond style for the length of a bond type.
  if (!lists_) return;
  for (const Fix *fix : modify->get_fix_list())
    for (const char *style : {"^shake", "^rattle", "^filter/corotate"})
      if (utils::strmatch(fix->style, style))
        fail(fmt::format("fix {} ({}) holds bonds at the length of their type, but these bonds have lengths of their own; use `fix rigid`", fix->id, fix->style));
}

void FixConcordemBond::begin_forces()
{
  // `rerun` sets up again and again, at steps that no run has reached.
  if (setup_ && stepped_at_ >= 0 && update->ntimestep != stepped_at_)
    fail(fmt::format("a command (rerun?) asks for forces at positions that no run has reached, {}", ONCE));
  if (!setup_ && update->ntimestep == stepped_at_) fail(fmt::format("a command asks a second time for the forces of step {}, {}", stepped_at_, ONCE));
  stepped_at_ = update->ntimestep;
  due_ = true;
}

void FixConcordemBond::setup_pre_force(int)
{
  setup_ = true;
  begin_forces();
  // Fixes that insert or delete atoms come before us.
  int *const list = modify->*ListsOfModify::pre_exchange, *const end = list + modify->n_pre_exchange;
  int *const at = std::find(list, end, modify->find_fix(id));
  if (at != end) std::rotate(at, at + 1, end);
  check_box(true);
  communicate(true);
  follow_changes();
  give_heat_network();
  measure_heated_groups();
  rebuild();
  make_added();
  check_heat_step();
  if (creation_is_due()) make_bonds();
  check_resumed();
  check_pair_style();
  warn_without_contacts();
  check_step(SINCE_CHANGE);
  show_temperatures();
}

void FixConcordemBond::pre_force(int)
{
  setup_ = false;
  begin_forces();
  check_box(false);
  ConcordemAtoms atoms = arrays();
  concordem_network_turn(network_, &atoms);
  communicate(neighbor->ago == 0);
  show_temperatures();
  if (neighbor->ago == 0) {
    follow_changes();
    give_heat_network();
    measure_heated_groups();
    rebuild();
    check_pair_style();
  }
  check_step(neighbor->ago == 0 && room_ > 0.0 ? SINCE_CHANGE : SINCE_LAST_CHECK);
}

// New bonds start unstrained with the present reference.
void FixConcordemBond::make_added()
{
  if (!lists_ || !made_) return;
  const bool adds = concordem_network_make_added(network_) > 0;
  // The first bonds of the run, on any processor. Only a rebuild finds them in the lists.
  const bool may_add = setup_ || neighbor->ago == 0;
  if (mean_radius_ == 0.0 && may_add) find_mean_radius();
  if (may_add) ask_heat_network(OF_NEW_BONDS);
  if (adds) rebuild();
}

void FixConcordemBond::setup_pre_reverse(int eflag, int vflag)
{
  FixConcordemBond::pre_reverse(eflag, vflag);
}

// All pair and bond styles have computed their forces. Fixes that change forces (setforce, freeze) follow, whatever their order in the
// script.
void FixConcordemBond::pre_reverse(int, int vflag)
{
  if (!style_) {
    v_init(vflag);
    find_forces(false, vflag_either);
    add_virial(vflag_global, virial, vflag_atom, vatom);
  }
  // New bonds start unstrained at the end of the step; the next step evaluates them.
  if (!setup_) {
    follow_growth();
    make_added();
    if (creation_is_due()) make_bonds();
  }
}

void FixConcordemBond::find_forces(bool energies, bool virial_wanted)
{
  if (!due_) fail(fmt::format("a command asks a second time for the forces of step {}, {}", update->ntimestep, ONCE));
  due_ = false;
  send_sizes();
  FixBondBase::find_forces(setup_, energies, virial_wanted);
  if (lists_) remove_broken_from_lists();
}

void FixConcordemBond::add_virial(int global, double *sum, int per_atom, double **of_atoms)
{
  if (!global && !per_atom) return;
  double total[6] = {0.0};
  find_virial(setup_, total, per_atom ? of_atoms : nullptr);
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
  const int64_t(*pairs)[2];
  const int64_t count = concordem_network_broken_now(network_, &pairs);
  for (int64_t k = 0; k < count; k++)
    for (int end = 0; end < 2; end++) {
      const int i = atom->map(pairs[k][end]);
      if (i < 0 || i >= atom->nlocal) continue;
      const tagint partner = pairs[k][1 - end];
      const int last = atom->num_bond[i] - 1;
      for (int m = 0; m <= last; m++) {
        if (atom->bond_atom[i][m] != partner) continue;
        atom->bond_atom[i][m] = atom->bond_atom[i][last];
        atom->bond_type[i][m] = atom->bond_type[i][last];
        atom->num_bond[i] = last;
        break;
      }
    }
  if (!count) return;
  if (last_break_) {
    snprintf(text_, sizeof(text_), "the bond of atoms %lld and %lld broke; %s", static_cast<long long>(pairs[0][0]),
             static_cast<long long>(pairs[0][1]), special_bonds_text().c_str());
    fail_on_this_processor();
  }
  free_broken_pairs(pairs, count);
  // Type 0 disables a bond in LAMMPS' bond list until the list is rebuilt.
  std::set<std::array<tagint, 2>> broken;
  std::vector<char> has_broken(atom->nlocal + atom->nghost, 0);
  for (int64_t k = 0; k < count; k++) {
    broken.insert({static_cast<tagint>(pairs[k][0]), static_cast<tagint>(pairs[k][1])});
    for (int end = 0; end < 2; end++)
      for (int i = atom->map(pairs[k][end]); i >= 0; i = atom->sametag[i]) has_broken[i] = 1;
  }
  for (int n = 0; n < neighbor->nbondlist; n++) {
    int *bond = neighbor->bondlist[n];
    if (!has_broken[bond[0]] || !has_broken[bond[1]]) continue;
    const tagint a = atom->tag[bond[0]], b = atom->tag[bond[1]];
    if (broken.count({MIN(a, b), MAX(a, b)})) bond[2] = 0;
  }
}

// A pair whose bond broke interacts through the pair style again: remove it from the special lists of its atoms, and clear its bits in the
// neighbor lists.
void FixConcordemBond::free_broken_pairs(const int64_t (*pairs)[2], int64_t count)
{
  for (int64_t k = 0; k < count; k++)
    for (int end = 0; end < 2; end++) {
      const int i = atom->map(pairs[k][end]);
      if (i < 0 || i >= atom->nlocal) continue;
      const tagint partner = pairs[k][1 - end];
      tagint *special = atom->special[i];
      int *number = atom->nspecial[i];   // cumulative: bonded, two bonds away, three
      tagint *found = std::find(special, special + number[0], partner);
      if (found != special + number[0]) {
        std::copy(found + 1, special + number[2], found);
        for (int kind = 0; kind < 3; kind++) number[kind]--;
      }
      for (int n = 0; n < neighbor->nlist; n++) {
        const NeighList *list = neighbor->lists[n];
        if (list->copy || list->occasional || list->kokkos || !list->firstneigh) continue;
        for (int m = 0; m < list->numneigh[i]; m++) {
          int &neighbor_entry = list->firstneigh[i][m];
          if (atom->tag[neighbor_entry & NEIGHMASK] == partner) neighbor_entry &= SPECIALMASK;
        }
      }
    }
}

// A pair must be seen again when its bond breaks. It is if it stays in the neighbor lists of other pair styles, and if the lists of bonded atoms
// are the only special ones, because those of atoms two or three bonds away are not updated. Without broken bonds, all is well.
void FixConcordemBond::check_special_bonds()
{
  last_break_ = false;
  const double *lj = force->special_lj, *coul = force->special_coul;
  const Pair *pair = force->pair;
  const bool ours = dynamic_cast<const PairConcordem *>(pair);
  if (ours && atom->molecular == Atom::MOLECULAR)
    for (int k = 1; k <= 3; k++)
      if (lj[k] != 0.0 && lj[k] != 1.0) fail("its contacts have no weights between 0 and 1; use 0 or 1 in `special_bonds lj`");
  if (!lists_ || !pair || utils::strmatch(force->pair_style, "^zero")) return;
  if (ours && lj[1] != 0.0) fail("bonded atoms have no contact beside their bond; use `special_bonds lj 0 1 1 coul 1 1 1`");
  const bool others = lj[2] == 1.0 && lj[3] == 1.0 && (ours || (coul[2] == 1.0 && coul[3] == 1.0));
  last_break_ = !others || (!ours && lj[1] == 0.0 && coul[1] == 0.0);
  if (last_break_ && comm->me == 0)
    warn("ends the run when a bond breaks: " + special_bonds_text());
}

std::string FixConcordemBond::special_bonds_text() const
{
  return fmt::format("with pair_style {}, pieces would pass through each other, because special_bonds takes the pair, or atoms two or three bonds "
                     "away, out of the neighbor lists; use `special_bonds lj 0 1 1 coul 1 1 1`", force->pair_style);
}

// LAMMPS' styles for touching spheres know nothing of our contacts and would add their forces to ours: granular, gran/..., bpm/spring;
// alone, or anywhere in pair_style hybrid. Other styles (lj/cut, ...) act at a distance, as the user wants, also between our atoms.
void FixConcordemBond::check_pair_style()
{
  if (!force->pair || dynamic_cast<PairConcordem *>(force->pair)) return;
  for (const char *family : {"^gran", "^bpm"})
    for (int sub = 0; sub < 8; sub++) {
      // 0: the only style of the family; 1, 2, ...: those of pair_style hybrid
      Pair *pair = force->pair_match(family, 0, sub);
      if (!pair && sub > 0) break;
      if (!pair || !pair->list || (pair == force->pair && sub > 0)) continue;
      check_pairs_of(pair, family);
    }
}

// End if a style for touching spheres also computes pairs of this fix.
void FixConcordemBond::check_pairs_of(const Pair *pair, const char *family)
{
  ConcordemPairLists lists;
  lists.atoms = pair->list->inum;
  lists.index_bits = NEIGHMASK;
  lists.list = pair->list->ilist;
  lists.numbers = pair->list->numneigh;
  lists.neighbors = pair->list->firstneigh;
  for (int k = 0; k < 4; k++) lists.weights[k] = k ? force->special_lj[k] : 1.0;
  ConcordemAtoms atoms = arrays();
  int64_t first[2];
  if (concordem_network_own_pairs(network_, &atoms, &lists, nullptr, 0, first) == 0) return;
  const std::string style = pair == force->pair ? std::string("pair_style ") + force->pair_style
                                                : fmt::format("the sub-style {} of pair_style {}",
                                                              strcmp(family, "^gran") == 0 ? "granular or gran/..." : "bpm/...", force->pair_style);
  const std::string group_name = group->names[igroup];
  const std::string remedy =
      contacts_ ? "Use `pair_style concordem/...`; or remove `contact`; or take the pairs out of the neighbor lists: "
      : lists_ ? "Use `special_bonds lj 0 1 1 coul 1 1 1`, or take the pairs out of the neighbor lists: "
               : "Use a bond style concordem/... with `special_bonds lj 0 1 1 coul 1 1 1`, or take the pairs out of the neighbor lists: ";
  error->one(FLERR, "Fix {} concordem/bond: atoms {} and {}: both {} and this fix compute the forces between them. {}`neigh_modify exclude group {} {}`",
             id, first[0], first[1], style, remedy, group_name, group_name);
}

/* --------------------------------------------------------------------------- functions of the base class specific to LAMMPS */

void FixBondBase::fail(const std::string &text)
{
  error->all(FLERR, "Fix {} concordem/bond: {}", id, text);
}

void FixBondBase::fail_on_this_processor()
{
  try {
    error->one(FLERR, "Fix {} concordem/bond: {}", id, text_);
  } catch (...) {
    // LAMMPS aborts all processes next, which may end mpirun before it has passed on the message.
    if (comm->nprocs > 1) std::this_thread::sleep_for(std::chrono::milliseconds(300));
    throw;
  }
}

void FixBondBase::communicate_ghosts()
{
  comm->forward_comm(this);
}

void FixBondBase::print(const std::string &text)
{
  utils::logmesg(lmp, "fix {} concordem/bond: {}\n", id, text);
}

double FixBondBase::ghost_cutoff() const
{
  return reach_;
}

FixBondBase::ExclusionsOfHost FixBondBase::exclusions_of_host() const
{
  return {neighbor->nex_type, neighbor->nex_group, neighbor->nex_mol, {neighbor->ex1_type, neighbor->ex2_type},
          {neighbor->ex1_bit, neighbor->ex2_bit}, neighbor->ex_mol_bit, neighbor->ex_mol_intra};
}

// Weights of special_bonds are those of pair styles, not those of `contact`. With a bond style of ours, the bonds themselves take their pairs out of the contacts, as long as they exist.
void FixBondBase::find_special_pairs(std::vector<std::array<int64_t, 2>> &pairs)
{
  if (atom->molecular != Atom::MOLECULAR || !dynamic_cast<PairConcordem *>(force->pair)) return;
  for (int i = 0; i < atom->nlocal; i++) {
    if (!(atom->mask[i] & groupbit)) continue;
    const int *const number = atom->nspecial[i];
    for (int k = 0; k < 3; k++) {
      if (force->special_lj[k + 1] != 0.0 || (lists_ && k == 0)) continue;
      for (int m = k ? number[k - 1] : 0; m < number[k]; m++) pairs.push_back({atom->tag[i], atom->special[i][m]});
    }
  }
}

bool FixBondBase::has_pair_style_for_spheres() const
{
  if (!force->pair || dynamic_cast<PairConcordem *>(force->pair)) return false;
  for (const char *family : {"^gran", "^bpm"})
    if (force->pair_match(family, 0, 0) || force->pair_match(family, 0, 1)) return true;
  return false;
}

// Remove the bonds to atoms that no longer exist from the lists of their partners.
void FixBondBase::drop_from_lists(const std::vector<int64_t> &atoms)
{
  if (!lists_) return;
  for (int i = 0; i < atom->nlocal; i++)
    for (int m = atom->num_bond[i] - 1; m >= 0; m--) {
      if (!std::binary_search(atoms.begin(), atoms.end(), static_cast<int64_t>(atom->bond_atom[i][m]))) continue;
      const int last = --atom->num_bond[i];
      atom->bond_atom[i][m] = atom->bond_atom[i][last];
      atom->bond_type[i][m] = atom->bond_type[i][last];
    }
}

ConcordemBondLists FixBondBase::lists_of_atoms() const
{
  return {atom->num_bond, reinterpret_cast<const void *const *>(atom->bond_atom), atom->bond_type};
}

std::string FixBondBase::changer_of_box() const
{
  for (const Fix *fix : modify->get_fix_list())
    if (fix->box_change & (BOX_CHANGE_SIZE | BOX_CHANGE_SHAPE)) return fmt::format("{} ({})", fix->id, fix->style);
  return "";
}

namespace {

// The fixes in a restart file, which LAMMPS keeps until the first run.
struct RestartOfFixes : Modify {
  static constexpr auto ids = &RestartOfFixes::id_restart_global;
  static constexpr auto styles = &RestartOfFixes::style_restart_global;
};

}

std::string FixBondBase::lost_in_restart() const
{
  std::string other;
  for (int k = 0; k < modify->nfix_restart_global; k++) {
    if (strcmp((modify->*RestartOfFixes::styles)[k], style) != 0) continue;
    const std::string found = (modify->*RestartOfFixes::ids)[k];
    if (found == id) return "";
    other = found;
  }
  return other;
}

void FixBondBase::warn(const std::string &text)
{
  error->warning(FLERR, "Fix {} concordem/bond {}", id, text);
}
