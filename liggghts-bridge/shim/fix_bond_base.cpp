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

const char *const EMPTY_LISTS = "has no bonds: the atoms' bond lists are empty";

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
  bool consistent = false;
  for (const char *units : {"si", "lj", "cgs", "micro", "nano"}) consistent = consistent || strcmp(update->unit_style, units) == 0;
  if (!consistent)
    fail(std::string("in `units ") + update->unit_style + "`, a force is not mass times acceleration; use `units si` (or lj, cgs, micro, nano)");

  lost_ = lost_in_restart();
  network_ = concordem_network_new(arg + 3, narg - 3, atom->ntypes, strcmp(update->unit_style, "si") == 0, &facts_, &message_);
  // A file may be unreadable on one processor only.
  int valid = network_ != NULL, count_valid;
  MPI_Allreduce(&valid, &count_valid, 1, MPI_INT, MPI_SUM, world);
  if (count_valid == 0) fail(text_);
  if (!valid) fail_on_this_processor();
  if (count_valid < comm->nprocs) MPI_Barrier(world);   // until that processor ends the program
  law_ = arg[3];
  contacts_ = strcmp(facts_.contacts, "none") != 0;
  if (facts_.creation == 2) read_bond_list();
#ifdef CONCORDEM_LAMMPS
  if (facts_.creation == 3) fail("`bond clumps` is for templates of LIGGGHTS; use a bond style, and molecules with bonds in `fix deposit` or `fix pour`");
#endif
  vector_atom = NULL;
  begin_heat();

  restart_global = 1;
  restart_peratom = 1;
  wd_section = 3;
  create_attribute = 1;
  scalar_flag = 1;
  vector_flag = 1;
  size_vector = CONCORDEM_SUMS + 1;
  global_freq = 1;
  extscalar = 1;
  extvector = 1;
  time_depend = 1;
  periodic_ = concordem_has_images(domain);
  comm_forward = std::max(2, facts_.communicated + 1 + (periodic_ ? 3 : 0));   // the most

  FixBondBase::grow_arrays(atom->nmax);
  atom->add_callback(0);   // growing arrays
  atom->add_callback(1);   // restart
  for (int i = 0; i < atom->nlocal; i++) FixBondBase::set_arrays(i);
  if (facts_.state_length > 0) {
    state_.resize(facts_.state_length);
    concordem_network_state_file(network_, &state_[0]);
    read_state(state_);
  }
}

FixBondBase::~FixBondBase()
{
  if (network_) {
    atom->delete_callback(id, 0);
    atom->delete_callback(id, 1);
  }
  memory->destroy(memory_);
  memory->destroy(original_);
  if (conducts()) memory->destroy(vector_atom);
  concordem_network_delete(network_);
}

void FixBondBase::fail_with_text_of(int processor)
{
  MPI_Bcast(text_, sizeof(text_), MPI_CHAR, processor, world);
  fail(text_);
}

// Allows a bond to stretch by 5 % until the next rebuild, which detects longer ones.
void FixBondBase::find_reach(double given)
{
  double wanted = made_ ? 0.0 : given;
  if (!made_ && facts_.creation == 2) wanted = longest_listed();
  const double longest = concordem_longest(network_, facts_, made_, wanted, atom, groupbit, world, &smallest_);
  room_ = 0.0;
  for (int k = 0; k < modify->nfix; k++)
    if (changes_radii(modify->fix[k])) room_ = 0.25 * neighbor->skin;
  reach_ = std::max(1.05 * longest + neighbor->skin + 2.0 * room_, facts_.reach);
  force_reneighbor = room_ > 0.0;   // follow_growth may ask for it
  next_reneighbor = -1;
}

void FixBondBase::check_run()
{
  if (update->whichflag == 2)
    fail("does not support `minimize`, because the forces of its bonds depend on their history; relax with damped dynamics, for "
         "example fix viscous");
  if (domain->triclinic) fail("does not support triclinic boxes; use an orthogonal box");
  const std::string changer = changer_of_box();
  if (!changer.empty())
    fail("does not support boxes that change in a run, but fix " + changer + " changes it; remove that fix");
  check_other_fixes();
  warned_step_ = 0.0;
}

// The contacts of a fix are between all atoms of its group, also those that another fix bonds.
void FixBondBase::check_other_fixes()
{
  if (!contacts_) return;
  for (int k = 0; k < modify->nfix; k++) {
    const FixBondBase *other = dynamic_cast<const FixBondBase *>(modify->fix[k]);
    if (!other || other == this) continue;
    bigint mine = 0, shared = 0;
    for (int i = 0; i < atom->nlocal; i++)
      if (atom->mask[i] & groupbit && atom->mask[i] & other->groupbit) mine++;
    MPI_Allreduce(&mine, &shared, 1, MPI_LMP_BIGINT, MPI_SUM, world);
    if (shared > 1)
      fail("its `contact` acts on atoms that also belong to fix " + std::string(other->id) +
           ", so that forces would add up; use one fix, or groups without common atoms");
  }
}

void FixBondBase::check_box(bool setup)
{
  for (int axis = 0; axis < 3; axis++) {
    const double edge = concordem_edge(domain, axis);
    if (edge_[axis] >= 0.0 && edge != edge_[axis] && (made_ || !setup)) {
      snprintf(text_, sizeof(text_),
               "the periodic box changed from %.12g m to %.12g m along %c, which would stretch the bonds across its border; change the "
               "box before the bonds are created",
               edge_[axis], edge, "xyz"[axis]);
      fail(text_);
    }
    edge_[axis] = edge;
  }
}

// At the seam of two runs, the host adds the stored forces of the last step. Their dashpots are known only in the sum.
void FixBondBase::find_virial(bool setup, double *total, double **of_atoms)
{
  double found[6] = {0.0};
  concordem_network_virial(network_, found, of_atoms ? of_atoms[0] : NULL, of_atoms ? atom->nlocal : 0);
  const bool seam = setup && virial_at_ == update->ntimestep;
  if (!seam) {
    for (int k = 0; k < 6; k++) virial_[k] = found[k];
    virial_at_ = update->ntimestep;
  }
  for (int k = 0; k < 6; k++) total[k] += virial_[k];
}

// Update the data of ghosts. At rebuilds, the host shifts positions of ghosts to their periodic image, which rounds them; bonds need
// the owner's positions bit for bit. `rebuilds`: rebuild() follows, which orders the particles.
void FixBondBase::communicate(bool rebuilds)
{
  if (periodic_)
    for (int i = 0; i < atom->nlocal; i++)
      for (int axis = 0; axis < 3; axis++) original_[i][axis] = atom->x[i][axis];
  rebuilds_ = rebuilds;
  if (rebuilds) {
    const ConcordemAtoms atoms = arrays();
    concordem_network_place_new(network_, &atoms);
  }
  if (reals_of_ghost()) communicate_ghosts();
}

int FixBondBase::pack_ghosts(int count, const int *list, double *buffer) const
{
  if (sent_) {
    for (int k = 0; k < count; k++) buffer[k] = (*sent_)[list[k]];
    return count;
  }
  if (sends_sizes_) {
    for (int k = 0; k < count; k++) {
      buffer[2 * k] = atom->radius[list[k]];
      buffer[2 * k + 1] = atom->rmass[list[k]];
    }
    return 2 * count;
  }
  return concordem_pack_ghosts(count, list, buffer, facts_.atom_width - facts_.communicated - rebuilds_, facts_.atom_width, memory_,
                               periodic_ ? original_ : NULL);
}

void FixBondBase::unpack_ghosts(int count, int first_atom, const double *buffer)
{
  if (sent_) {
    std::copy(buffer, buffer + count, sent_->begin() + first_atom);
    return;
  }
  if (sends_sizes_) {
    for (int k = 0; k < count; k++) {
      atom->radius[first_atom + k] = buffer[2 * k];
      atom->rmass[first_atom + k] = buffer[2 * k + 1];
    }
    return;
  }
  concordem_unpack_ghosts(count, first_atom, buffer, facts_.atom_width - facts_.communicated - rebuilds_, facts_.atom_width, memory_,
                          periodic_ ? original_ : NULL);
}

// Among the pairs of `limit N`: atoms name partners, until no process has an undecided pair. Without a limit there is none.
void FixBondBase::choose_bonds()
{
  std::vector<double> named(atom->nlocal + atom->nghost);
  const int64_t count = named.size();
  for (;;) {
    const int64_t mine = concordem_network_name_partners(network_, named.data(), count);
    int64_t all;
    MPI_Allreduce(&mine, &all, 1, MPI_INT64_T, MPI_SUM, world);
    if (all == 0) return;
    send_to_ghosts(&named);
    concordem_network_bond_named(network_, named.data(), count);
  }
}

void FixBondBase::send_to_ghosts(std::vector<double> *numbers)
{
  sent_ = numbers;
  communicate_ghosts();
  sent_ = nullptr;
}

void FixBondBase::make_queued()
{
  if (mean_radius_ == 0.0) find_mean_radius();
  ask_heat_network(OF_NEW_BONDS);
  rebuild();
  check_heat_network();
  check_heat_step();
}

void FixBondBase::make_bonds()
{
  const bool lost = !lost_.empty() && modify->find_fix(lost_.c_str()) < 0, creates = facts_.creation || lists_;
  if (lost && !creates)
    fail("the restart file contains the bonds of fix " + lost_ + ", which the script does not define; give this fix the same id: `fix " +
         lost_ + " ...`");
  if (facts_.creation == 1) {
    if (concordem_network_make_near(network_, &message_) < 0) fail_on_this_processor();
    choose_bonds();
  }
  if (facts_.creation == 2) concordem_make_listed(network_, atom, groupbit, world);
  if (lists_) {
    const ConcordemAtoms atoms = arrays();
    const ConcordemBondLists lists = lists_of_atoms();
    concordem_network_make_of_lists(network_, &atoms, &lists);
  }
  if (creates) make_queued();
  made_ = true;
  drop_heat_bonds();
  check_step(SINCE_CHANGE);
  double total;
  if (!concordem_count(network_, world, &total))
    fail("a bond is longer than the ghost cutoff; add `reach LENGTH` with a larger length");
  if (comm->me != 0) return;
  if (creates && facts_.creation != 3) {
    char bonds[32];
    snprintf(bonds, sizeof(bonds), "%.0f", total);
    print(std::string(bonds) + " bonds of law " + law_);
  }
  if (lost) warn("creates new bonds; those of fix " + lost_ + " in the restart file are lost. To keep them, give this fix the same id");
  if (total == 0.0 && law_ != "none" && facts_.creation != 3)
    warn(lists_ ? EMPTY_LISTS :
         creates ? "created no bonds; check the distance factor and the group" :
                   "has no bonds: `bond none` creates none, and there are none from a restart file");
}

// Bonds are created only once, by the run that wrote the file; that they are missing must not go unnoticed.
void FixBondBase::check_resumed()
{
  if (resumed_.empty()) return;
  double mine[CONCORDEM_SUMS], all[2];
  concordem_network_sums(network_, mine);
  MPI_Allreduce(mine, all, 2, MPI_DOUBLE, MPI_SUM, world);   // bonds, and those that broke
  if (comm->me == 0 && all[0] + all[1] == 0.0 && law_ != "none" && facts_.creation != 3)
    warn(lists_ ? EMPTY_LISTS : "has no bonds: " + resumed_ + " has none, and bonds are created only once");
  resumed_.clear();
}

// Sections with `radius_ratio` refer to the atoms of the first bonds. It stays 0 as long as there are none.
void FixBondBase::find_mean_radius()
{
  mean_radius_ = concordem_mean_radius(network_, atom, groupbit, world);
}

void FixBondBase::find_forces(bool setup, bool energies, bool virial_wanted)
{
  ConcordemAtoms atoms = arrays();
  const bool output_is_due = setup || update->ntimestep == output->next;
  const bool sample = output_is_due || energies || facts_.sample_every_step;
  // Recorded forces take almost as much memory as the bonds. At output, computes may ask for them only afterwards.
  const bool record = virial_wanted || (output_is_due && concordem_forces_are_read(modify)) || concordem_output_is_due(modify, update);
  if (concordem_network_forces(network_, &atoms, setup, sample, record, &message_) < 0) fail_on_this_processor();
  if (sample) sampled_at_ = update->ntimestep;
}

bool FixBondBase::creation_is_due() const
{
  return !made_ && update->ntimestep >= facts_.at;
}

void FixBondBase::read_bond_list()
{
  share_file(concordem_network_read_bond_list, concordem_network_keep_listed, concordem_network_sort_listed);
  const int64_t kept = concordem_network_listed(network_, NULL);
  int64_t all, most;
  MPI_Allreduce(&kept, &all, 1, MPI_INT64_T, MPI_SUM, world);
  MPI_Allreduce(&kept, &most, 1, MPI_INT64_T, MPI_MAX, world);
  if (comm->me == 0)
    print("the file of `bond list` has " + std::to_string(all) + " bonds; a process keeps at most " + std::to_string(most) + " of them");
}

// Fail on all processors with the message in text_ of the one with the lowest line, unless no processor has a wrong line (INT64_MAX).
// Collective.
void FixBondBase::fail_at_lowest(int64_t line)
{
  int64_t lowest;
  MPI_Allreduce(&line, &lowest, 1, MPI_INT64_T, MPI_MIN, world);
  if (lowest == INT64_MAX) return;
  int keeps = line == lowest ? comm->me : -1, from;
  MPI_Allreduce(&keeps, &from, 1, MPI_INT, MPI_MAX, world);
  fail_with_text_of(from);
}

// Longest bond of the list at the current positions. Fails if a listed atom does not exist.
double FixBondBase::longest_listed()
{
  int64_t missing;
  const double longest = concordem_longest_listed(network_, atom, domain, groupbit, world, &missing);
  if (missing)
    fail("the list of bonds contains atom " + std::to_string(missing) + ", which is not in group " + group->names[igroup] +
         "; remove the bond, or add the atom to the group");
  return longest;
}

ConcordemAtoms FixBondBase::arrays()
{
  find_effective_masses();
  return concordem_arrays(atom, domain, update, groupbit, facts_.atom_width, memory_, periodic_ ? original_ : NULL,
                          effective_mass_.empty() ? NULL : effective_mass_.data());
}

void FixBondBase::rebuild()
{
  ConcordemAtoms atoms = arrays();
  if (restored_) deliver_restored();
  const ConcordemBondLists lists = lists_of_atoms();
  concordem_network_exclude(network_, exclusion_rules_.data(), exclusion_rules_.size(),
                            reinterpret_cast<const int64_t(*)[2]>(excluded_pairs_.data()), excluded_pairs_.size());
  if (concordem_network_rebuild(network_, &atoms, made_ && lists_ ? &lists : NULL, neighbor->skin, reach_, mean_radius_, &message_) < 0)
    fail_on_this_processor();
  if (compares_) compare_heat_network();
}

/* -------------------------------------------------------------------------------------------- data per atom, migration */

void FixBondBase::grow_arrays(int nmax)
{
  memory->grow(memory_, nmax, facts_.atom_width, "concordem/bond:memory");
  if (periodic_) memory->grow(original_, nmax, 3, "concordem/bond:original");
  if (conducts()) memory->grow(vector_atom, nmax, "concordem/bond:temperature");
}

void FixBondBase::copy_arrays(int i, int j, int)
{
  memcpy(memory_[j], memory_[i], sizeof(double) * facts_.atom_width);
}

void FixBondBase::set_arrays(int i)
{
  concordem_network_initial_memory(network_, atom->mask[i], memory_[i]);
}

int FixBondBase::pack_exchange(int i, double *buf)
{
  int m = 0;
  for (int r = 0; r < facts_.atom_width; r++) buf[m++] = memory_[i][r];
  const int64_t count = concordem_network_pack(network_, atom->tag[i], 1, buf + m + 1, exchange_size_);
  if (count > exchange_size_) {
    snprintf(text_, sizeof(text_), "the buffer for migrating atoms is too small: an internal error; please report it");
    fail_on_this_processor();
  }
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

// For a restart or data file. The bonds of an atom that is gone would be lost without a word.
ConcordemRestartHead FixBondBase::head()
{
  const ConcordemAtoms atoms = arrays();
  int64_t mine[2], all[2];
  concordem_network_owned_ends(network_, &atoms, mine);
  MPI_Allreduce(mine, all, 2, MPI_INT64_T, MPI_SUM, world);
  // Bonds of the atoms' lists may be deleted together with atoms.
  if (!lists_ && all[0] != all[1])
    fail("a bonded atom is gone since the last step, so that its bonds cannot be written; bonded atoms must stay");
  ConcordemRestartHead head = concordem_restart_head(network_, facts_, made_, law_.c_str(), world);
  for (int axis = 0; axis < 3; axis++) head.edge[axis] = edge_[axis];
  head.mean_radius = mean_radius_;
  head.virial_at = virial_at_;
  MPI_Allreduce(virial_, head.virial, 6, MPI_DOUBLE, MPI_SUM, world);
  return head;
}

// Share the records among the atoms. Returns their number.
int64_t FixBondBase::begin_restart()
{
  ConcordemAtoms atoms = arrays();
  int64_t most;
  const int64_t records = concordem_network_begin_restart(network_, &atoms, &most, &message_);
  if (records < 0) fail_on_this_processor();
  largest_piece_ = static_cast<int>(most);
  return records;
}

void FixBondBase::write_restart(FILE *fp)
{
  ConcordemRestartHead head = this->head();
  int64_t mine = begin_restart();
  MPI_Allreduce(&mine, &head.records, 1, MPI_INT64_T, MPI_SUM, world);
  int largest = largest_piece_;
  MPI_Allreduce(&largest, &largest_piece_, 1, MPI_INT, MPI_MAX, world);
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
  if (!state_.empty()) fail("the restart file has the bonds, and so has " + state_ + "; remove `state`");
  resume(head, "the restart file");
  records_of_restart_ = head.records;
}

void FixBondBase::resume(const ConcordemRestartHead &head, const std::string &file)
{
  if (law_ != head.law) fail(file + " contains bonds of law " + head.law + ", not " + law_ + "; give the same law");
  if (strcmp(head.contacts, facts_.contacts) != 0)
    fail(file + " contains contacts of law " + head.contacts + ", not " + facts_.contacts + "; give the same `contact LAW`");
  if (head.atom_width != facts_.atom_width || head.record_reals != facts_.record_reals)
    fail(file + " has other data per atom or bond; give the laws, the `deformable`, and the `heat` of the script that wrote it");
  if (head.reference_temperature != facts_.reference_temperature) {
    char kelvin[32];
    snprintf(kelvin, sizeof(kelvin), "%.17g", head.reference_temperature);
    fail(file + " refers to " + kelvin + " K, this script to another temperature; add `reference_temperature = " + kelvin + "` to [heat]");
  }
  restored_ = true;
  source_ = file;
  made_ = head.made;
  if (made_) {
    resumed_ = file;
    // The bonds of the list have been created.
    concordem_network_make_listed(network_, NULL, 0);
  }
  mean_radius_ = head.mean_radius;
  for (int axis = 0; axis < 3; axis++) edge_[axis] = head.edge[axis];
  virial_at_ = head.virial_at;
  for (int k = 0; k < 6; k++) virial_[k] = comm->me == 0 ? head.virial[k] : 0.0;
  const double none[CONCORDEM_TOTALS] = {0.0};
  concordem_network_resume(network_, comm->me == 0 ? head.totals : none, head.found_at);
}

int FixBondBase::pack_restart(int i, double *buf)
{
  int m = 1;
  for (int r = 0; r < facts_.atom_width; r++) buf[m++] = memory_[i][r];
  const double *reals;
  const int64_t count = concordem_network_restart_piece(network_, i, &reals, &message_);
  if (count < 0) fail_on_this_processor();
  if (count > 0) memcpy(buf + m, reals, sizeof(double) * count);
  m += static_cast<int>(count);
  buf[0] = m;
  if (i == atom->nlocal - 1) concordem_network_end_restart(network_);
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
  // Pieces are about equal.
  if (nlocal == 0) concordem_network_reserve_restored(network_, static_cast<int64_t>(end - m) * atom->nlocal);
  if (concordem_network_restore(network_, atom->tag[nlocal], extra + m, end - m, &message_) < 0) fail_on_this_processor();
}

// LIGGGHTS asks for the sizes of all atoms before it calls write_restart, LAMMPS afterwards. Both begin, so the records are counted twice.
int FixBondBase::size_restart(int i)
{
  if (i == 0) begin_restart();
  return 1 + facts_.atom_width + static_cast<int>(concordem_network_restart_length(network_, i));
}

// The first processor writes this number for all atoms, and write_restart comes before.
int FixBondBase::maxsize_restart()
{
  return 1 + facts_.atom_width + largest_piece_;
}

// The atoms of a restart file bring records of any atoms. Send each to the owners of its atoms; usually most are here.
void FixBondBase::deliver_restored()
{
  restored_ = false;
  int64_t mine = concordem_network_restored(network_), all;
  MPI_Allreduce(&mine, &all, 1, MPI_INT64_T, MPI_SUM, world);
  if (records_of_restart_ >= 0 && all != records_of_restart_)
    fail("of the " + std::to_string(static_cast<long long>(records_of_restart_)) + " bonds and contacts in " + source_ + ", " +
         std::to_string(static_cast<long long>(all)) + " came with its atoms; define this fix right after the file is read, before atoms are deleted");
  if (comm->nprocs == 1) {
    concordem_network_deliver_here(network_);
    return;
  }
  std::vector<tagint> owned;
  for (int i = 0; i < atom->nlocal; i++)
    if (atom->mask[i] & groupbit) owned.push_back(atom->tag[i]);
  std::sort(owned.begin(), owned.end());
  const auto is_here = [&](int64_t tag) { return std::binary_search(owned.begin(), owned.end(), static_cast<tagint>(tag)); };
  const auto take = [&](const double *reals, int64_t count) {
    if (concordem_network_deliver(network_, reals, count, &message_) < 0) fail_on_this_processor();
  };
  const std::vector<ConcordemPlace> directory = concordem_directory(atom, groupbit, world);
  // Records that travel at once; their copies must take little memory.
  const size_t most = 1 << 14;
  int64_t at = 0;
  for (int more = 1; more;) {
    std::vector<int64_t> asked;                              // two ids per record
    std::vector<std::pair<const double *, int64_t> > records;
    int64_t ids[2], count = 0;
    const double *reals;
    while (records.size() < most && (count = concordem_network_next_restored(network_, at, ids, &reals)) > 0) {
      at += count;
      if (is_here(ids[0]) && is_here(ids[1])) {
        take(reals, count);
        continue;
      }
      asked.insert(asked.end(), ids, ids + 2);
      records.push_back(std::make_pair(reals, count));
    }
    const std::vector<ConcordemPlace> places = concordem_places(asked, directory, world);
    std::vector<std::vector<double> > to(comm->nprocs);
    for (size_t k = 0; k < records.size(); k++) {
      const int64_t first = places[2 * k].owner, second = places[2 * k + 1].owner;
      const double *begin = records[k].first, *end = begin + records[k].second;
      if (first >= 0) to[first].insert(to[first].end(), begin, end);
      if (second >= 0 && second != first) to[second].insert(to[second].end(), begin, end);
    }
    const std::vector<double> arrived = concordem_send(to, world);
    take(arrived.data(), arrived.size());
    const int left = count > 0;
    MPI_Allreduce(&left, &more, 1, MPI_INT, MPI_MAX, world);
  }
  concordem_network_drop_restored(network_);
}

/* ---------------------------------------------------------------------------------------------------------- output */

void FixBondBase::update_sums()
{
  if (summed_at_ == update->ntimestep && update->setupflag == 0) return;
  double mine[CONCORDEM_SUMS];
  concordem_network_sums(network_, mine);
  MPI_Allreduce(mine, sums_, CONCORDEM_SUMS, MPI_DOUBLE, MPI_SUM, world);
  MPI_Allreduce(mine + CONCORDEM_LONGEST, sums_ + CONCORDEM_LONGEST, 1, MPI_DOUBLE, MPI_MAX, world);
  summed_at_ = update->ntimestep;
}

double FixBondBase::compute_scalar()
{
  update_sums();
  return sums_[0];
}

double FixBondBase::compute_vector(int n)
{
  if (n == CONCORDEM_SUMS) return stable_step_;
  if (n >= 3 && n <= 6 && sampled_at_ != update->ntimestep && update->whichflag == 1)
    fail("stored energies are known only at steps with output; add `energies every` to sum them at every step");
  update_sums();
  return sums_[n];
}

double FixBondBase::memory_usage()
{
  return static_cast<double>(atom->nmax) * (facts_.atom_width + (periodic_ ? 3 : 0)) * sizeof(double);
}
