/* fix concordem/bond in LAMMPS, see fix_bond.h. Differs from the one for LIGGGHTS where the hosts do: forces are added after those
   of pair styles (which may take the virial from the sum of forces), virials are tallied, bonds may be the atoms' own.

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
#include "memory.h"
#include "modify.h"
#include "neighbor.h"
#include "output.h"
#include "update.h"

#include "host.h"

using namespace LAMMPS_NS;

FixConcordemBond::FixConcordemBond(LAMMPS *lmp, int narg, char **arg) : Fix(lmp, narg, arg)
{
  message_.text = text_;
  message_.capacity = sizeof(text_);
  text_[0] = 0;
  if (!atom->radius_flag || !atom->rmass_flag || !atom->omega_flag || !atom->torque_flag)
    fail("needs atoms with radius, mass, spin, and torque: use `atom_style bpm/sphere` or `atom_style sphere`");
  if (!atom->tag_enable) fail("needs atom ids: remove `atom_modify id no`");
  if (domain->triclinic) fail("needs an orthogonal box, not a triclinic one");
  if (strcmp(update->unit_style, "si") != 0) fail("takes its parameters in SI units: use `units si`");

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
  virial_global_flag = 1;
  virial_peratom_flag = 1;
  thermo_virial = 1;
  maxexchange_dynamic = 1;
  periodic_ = domain->xperiodic || domain->yperiodic || domain->zperiodic;
  comm_forward = facts_.communicated + (periodic_ ? 3 : 0);

  FixConcordemBond::grow_arrays(atom->nmax);
  atom->add_callback(Atom::GROW);
  atom->add_callback(Atom::RESTART);
  for (int i = 0; i < atom->nlocal; i++) FixConcordemBond::set_arrays(i);
}

FixConcordemBond::~FixConcordemBond()
{
  if (network_) {
    atom->delete_callback(id, Atom::GROW);
    atom->delete_callback(id, Atom::RESTART);
  }
  memory->destroy(memory_);
  memory->destroy(original_);
  concordem_network_delete(network_);
  // LAMMPS' lists of what to call are those of the last set-up: `run N pre no` would go on calling a fix that is gone, and so would a
  // style. As before the first run, the next one is set up whatever it says. (When LAMMPS ends, `update` goes before fixes.)
  if (update) update->first_update = 0;
}

int FixConcordemBond::setmask()
{
  return FixConst::PRE_EXCHANGE | FixConst::PRE_FORCE | FixConst::POST_FORCE;
}

void FixConcordemBond::fail(const std::string &text)
{
  error->all(FLERR, "Fix {} concordem/bond: {}", id, text);
}

// A message that may exist on one processor only: all are stopped.
void FixConcordemBond::fail_on_this_processor()
{
  error->one(FLERR, "Fix {} concordem/bond: {}", id, text_);
}

void FixConcordemBond::serve(const ConcordemStyle *style, bool lists)
{
  style_ = style;
  lists_ = lists;
  // The style tallies.
  virial_global_flag = virial_peratom_flag = thermo_virial = 0;
}

void FixConcordemBond::init()
{
  if (!comm->ghost_velocity) fail("needs velocities of neighbours on other processors: add `comm_modify vel yes`");
  if (domain->deform_flag) fail("does not follow boxes that deform: remove `fix deform`");
  if (utils::strmatch(update->integrate_style, "^respa")) fail("does not work with run_style respa");
  if (periodic_ != (domain->xperiodic || domain->yperiodic || domain->zperiodic))
    fail("must be defined after `boundary` or change_box have set the final boundaries");

  // Atoms must be known as far as the longest bond reaches. It may stretch by 5 % before lists are rebuilt with a check.
  double wanted = 0.0, smallest = 0.0;
  if (!made_ && lists_) wanted = longest_given();
  if (!made_ && facts_.creation == 2) wanted = longest_listed();
  const double longest = concordem_longest(network_, facts_, made_, wanted, atom, groupbit, world, &smallest);
  reach_ = MAX(1.05 * longest + neighbor->skin, facts_.reach);
  comm->cutghostuser = MAX(comm->cutghostuser, reach_);
  if (made_ && lists_) compare_with_lists();
}

// Longest of the bonds in the atoms' own lists, by the positions of all atoms in them.
double FixConcordemBond::longest_given()
{
  // Copies of neighbours need not be there yet: every processor gets the positions of partners it does not have.
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
          error->one(FLERR, "Fix {} concordem/bond: atom {} is bonded with atom {}, which does not exist", id, atom->tag[i], partner);
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

// The buffer for an atom that migrates must hold all its bonds.
void FixConcordemBond::pre_exchange()
{
  maxexchange = facts_.atom_width + 2 + static_cast<int>(concordem_network_largest_pack(network_));
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
  // Bonds begin at the end of the step, unstressed, and are first asked in the next one.
  if (!setup_ && creation_is_due()) make_bonds();
}

void FixConcordemBond::find_forces(bool energies, bool virial_wanted)
{
  ConcordemAtoms atoms = arrays();
  const bool output_is_due = setup_ || update->ntimestep == output->next;
  const bool sample = output_is_due || energies || facts_.sample_every_step;
  const bool record = output_is_due || virial_wanted || concordem_compute_is_due(modify, update);
  if (concordem_network_forces(network_, &atoms, setup_, sample, record, &message_) < 0) fail_on_this_processor();
  if (sample) sampled_at_ = update->ntimestep;
  if (lists_) take_broken_off_lists();
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

// Copies get what the network must know of them. On steps with new lists LAMMPS itself sends positions of copies, moved to
// their periodic image, which rounds; bonds need what their owner has.
void FixConcordemBond::communicate()
{
  if (periodic_)
    for (int i = 0; i < atom->nlocal; i++)
      for (int axis = 0; axis < 3; axis++) original_[i][axis] = atom->x[i][axis];
  if (comm_forward) comm->forward_comm(this);
}

int FixConcordemBond::pack_forward_comm(int n, int *list, double *buf, int, int *)
{
  return concordem_pack_copies(n, list, buf, facts_.atom_width - facts_.communicated, facts_.atom_width, memory_,
                        periodic_ ? original_ : nullptr);
}

void FixConcordemBond::unpack_forward_comm(int n, int first_atom, double *buf)
{
  concordem_unpack_copies(n, first_atom, buf, facts_.atom_width - facts_.communicated, facts_.atom_width, memory_,
                          periodic_ ? original_ : nullptr);
}

void FixConcordemBond::make_bonds()
{
  if (facts_.creation == 1 && concordem_network_make_near(network_, &message_) < 0) fail_on_this_processor();
  if (facts_.creation == 2) concordem_network_make_listed(network_);
  if (lists_) {
    std::vector<std::array<int32_t, 2>> pairs;
    for (int i = 0; i < atom->nlocal; i++)
      for (int m = 0; m < atom->num_bond[i]; m++)
        if (atom->bond_type[i][m] > 0) pairs.push_back({atom->tag[i], atom->bond_atom[i][m]});
    concordem_network_make_given(network_, reinterpret_cast<const int32_t(*)[2]>(pairs.data()), pairs.size());
  }
  if (facts_.creation || lists_) rebuild();
  made_ = true;
  double total;
  if (!concordem_count(network_, world, &total))
    fail("neighbours on other processors are not known as far as bonds reach; add `reach LENGTH` with a larger length");
  if (!facts_.creation && !lists_) return;
  if (comm->me == 0) {
    utils::logmesg(lmp, "fix {} concordem/bond: {:.0f} bonds of law {}\n", id, total, law_);
    if (total == 0.0)
      error->warning(FLERR, "Fix {} concordem/bond made no bonds: {}", id,
                     lists_ ? "the atoms have none" : "is the factor too small, or the group empty?");
  }
}

// The atoms' own lists of bonds follow.
void FixConcordemBond::take_broken_off_lists()
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
  // Until LAMMPS builds its list of bonds anew, others who read it see that these are off.
  if (count)
    for (int n = 0; n < neighbor->nbondlist; n++) {
      int *bond = neighbor->bondlist[n];
      const int a = MIN(atom->tag[bond[0]], atom->tag[bond[1]]), b = MAX(atom->tag[bond[0]], atom->tag[bond[1]]);
      for (int64_t k = 0; k < count; k++)
        if (pairs[k][0] == a && pairs[k][1] == b) bond[2] = 0;
    }
}

// Another command may have changed the atoms' lists of bonds.
void FixConcordemBond::compare_with_lists()
{
  double mine[3] = {0.0, 0.0, 0.0}, all[3];
  concordem_network_ends(network_, mine);
  for (int i = 0; i < atom->nlocal; i++)
    for (int m = 0; m < atom->num_bond[i]; m++)
      if (atom->bond_type[i][m] > 0) mine[2] += 1.0;
  MPI_Allreduce(mine, all, 3, MPI_DOUBLE, MPI_SUM, world);
  // Right after a restart bonds are not in place yet.
  if (all[0] == 0.0 && all[1] == 0.0) return;
  if (all[0] + all[1] != all[2])
    fail(fmt::format("the atoms' lists hold {:.0f} ends of bonds, but {:.0f} were left at the end of the last run: bonds cannot be "
                     "added or removed after the first run",
                     all[2], all[0] + all[1]));
}
