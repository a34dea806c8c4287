/* fix concordem/bond, see fix_bond.h.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "fix_bond.h"

#include <math.h>
#include <string.h>

#include <algorithm>
#include <vector>

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

using namespace LAMMPS_NS;

namespace {

const double BIG = 1e300;

// Version of what is written to restart files.
const int RESTART_VERSION = 1;

struct RestartHead {
  int version;
  int made;
  char law[32];
  int64_t found_at;
  double totals[CONCORDEM_TOTALS];
};

}  // namespace

FixConcordemBond::FixConcordemBond(LAMMPS *lmp, int narg, char **arg) :
    Fix(lmp, narg, arg), network_(NULL), memory_(NULL), original_(NULL), periodic_(false), made_(false), exchanged_(0),
    reach_(0.0), summed_at_(-1), sampled_at_(-1)
{
  message_.text = text_;
  message_.capacity = sizeof(text_);
  text_[0] = 0;
  if (!atom->sphere_flag || !atom->radius_flag || !atom->rmass_flag || !atom->omega_flag || !atom->torque_flag)
    error->fix_error(FLERR, this, "needs atoms with radius, mass, spin, and torque: use `atom_style sphere` (or granular)");
  if (!atom->tag_enable) error->fix_error(FLERR, this, "needs atom ids: remove `atom_modify id no`");
  if (force->newton_pair || force->newton)
    error->fix_error(FLERR, this, "needs `newton off`: put that command before the simulation box is created");
  if (domain->triclinic) error->fix_error(FLERR, this, "needs an orthogonal box, not a triclinic one");
  if (strcmp(update->unit_style, "si") != 0)
    error->fix_error(FLERR, this, "takes its parameters in SI units: use `units si`");

  network_ = concordem_network_new(arg + 3, narg - 3, atom->ntypes, &facts_, &message_);
  if (!network_) error->fix_error(FLERR, this, text_);
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

  grow_arrays(atom->nmax);
  atom->add_callback(0);
  atom->add_callback(1);
  for (int i = 0; i < atom->nlocal; i++) set_arrays(i);
}

FixConcordemBond::~FixConcordemBond()
{
  atom->delete_callback(id, 0);
  atom->delete_callback(id, 1);
  memory->destroy(memory_);
  memory->destroy(original_);
  concordem_network_delete(network_);
}

int FixConcordemBond::setmask()
{
  return FixConst::PRE_EXCHANGE | FixConst::PRE_FORCE;
}

// A message that may exist on one processor only: all are stopped.
void FixConcordemBond::fail_on_this_processor(const char *file, int line)
{
  std::string text = std::string("fix ") + id + " concordem/bond: " + text_;
  error->one(file, line, text.c_str());
}

bool FixConcordemBond::creation_is_due() const
{
  return !made_ && update->ntimestep >= facts_.at;
}

void FixConcordemBond::init()
{
  if (!comm->ghost_velocity)
    error->fix_error(FLERR, this, "needs velocities of neighbours on other processors: add `communicate single vel yes`");
  if (domain->deform_flag) error->fix_error(FLERR, this, "does not follow boxes that deform: remove `fix deform`");
  if (strstr(update->integrate_style, "respa")) error->fix_error(FLERR, this, "does not work with run_style respa");
  if (periodic_ != (domain->xperiodic || domain->yperiodic || domain->zperiodic))
    error->fix_error(FLERR, this, "must be defined after `boundary` or change_box have set the final boundaries");

  // Atoms must be known as far as the longest bond reaches. It may stretch by 5 % before lists are rebuilt with a check.
  double bounds[3] = {0.0, 0.0, 0.0};   // largest radius, minus the smallest one, longest bond
  for (int i = 0; i < atom->nlocal; i++) {
    if (!(atom->mask[i] & groupbit)) continue;
    bounds[0] = std::max(bounds[0], atom->radius[i]);
    bounds[1] = bounds[1] < 0.0 ? std::max(bounds[1], -atom->radius[i]) : -atom->radius[i];
  }
  if (bounds[1] == 0.0) bounds[1] = -BIG;
  double sums[CONCORDEM_SUMS], all[3];
  concordem_network_sums(network_, sums);
  bounds[2] = sums[CONCORDEM_SUMS - 1];
  MPI_Allreduce(bounds, all, 3, MPI_DOUBLE, MPI_MAX, world);
  const double largest = all[0], smallest = all[1] > -BIG ? -all[1] : 0.0;
  double longest = std::max(all[2], facts_.contacts ? 2.0 * largest : 0.0);
  if (!made_ && facts_.creation == 1) longest = std::max(longest, facts_.factor * 2.0 * largest);
  if (!made_ && facts_.creation == 2) longest = std::max(longest, longest_listed());
  reach_ = std::max(1.05 * longest + neighbor->skin, facts_.reach);
  // LIGGGHTS sends an atom to a neighbouring processor if its centre is nearer to the border than its own radius and half of
  // the cut-off: it thinks of surfaces that touch. Bonds join centres.
  comm->cutghostuser = std::max(comm->cutghostuser, std::max(reach_, 2.0 * (reach_ - smallest)));
}

// Longest bond of the list at the present positions. Fails if a listed atom does not exist.
double FixConcordemBond::longest_listed()
{
  const int64_t count = concordem_network_listed_atoms(network_, NULL);
  std::vector<int32_t> listed(count);
  if (count) concordem_network_listed_atoms(network_, &listed[0]);
  // position and how often the atom was found
  std::vector<double> mine(4 * count, 0.0), all(4 * count, 0.0);
  for (int i = 0; i < atom->nlocal; i++) {
    if (!(atom->mask[i] & groupbit)) continue;
    std::vector<int32_t>::iterator at = std::lower_bound(listed.begin(), listed.end(), atom->tag[i]);
    if (at == listed.end() || *at != atom->tag[i]) continue;
    const int64_t k = at - listed.begin();
    for (int axis = 0; axis < 3; axis++) mine[3 * k + axis] = atom->x[i][axis];
    mine[3 * count + k] = 1.0;
  }
  if (count) MPI_Allreduce(&mine[0], &all[0], 4 * count, MPI_DOUBLE, MPI_SUM, world);
  for (int64_t k = 0; k < count; k++)
    if (all[3 * count + k] != 1.0) {
      snprintf(text_, sizeof(text_), "the list of bonds names atom %d, which is not in group %s", listed[k],
               group->names[igroup]);
      error->fix_error(FLERR, this, text_);
    }
  double edge[3];
  for (int axis = 0; axis < 3; axis++) edge[axis] = domain->periodicity[axis] ? domain->prd[axis] : 0.0;
  return count ? concordem_network_longest_listed(network_, &all[0], edge) : 0.0;
}

void FixConcordemBond::setup_pre_exchange()
{
  pre_exchange();
}

// The buffer for an atom that migrates must hold all its bonds.
void FixConcordemBond::pre_exchange()
{
  const int needed = facts_.atom_width + 2 + static_cast<int>(concordem_network_largest_pack(network_));
  if (needed > exchanged_) {
    comm->maxexchange_fix += needed - exchanged_;
    exchanged_ = needed;
  }
}

void FixConcordemBond::setup_pre_force(int)
{
  communicate();
  rebuild();
  if (creation_is_due()) make_bonds();
  find_forces(true);
}

void FixConcordemBond::pre_force(int)
{
  ConcordemAtoms atoms = arrays();
  concordem_network_turn(network_, &atoms);
  communicate();
  if (neighbor->ago == 0) rebuild();
  find_forces(false);
  // Bonds begin at the end of the step, unstressed, and are first asked in the next one.
  if (creation_is_due()) make_bonds();
}

// Copies get what the network must know of them. On steps with new lists LIGGGHTS itself sends positions of copies, moved
// to their periodic image, which rounds; bonds need what their owner has.
void FixConcordemBond::communicate()
{
  if (periodic_)
    for (int i = 0; i < atom->nlocal; i++)
      for (int axis = 0; axis < 3; axis++) original_[i][axis] = atom->x[i][axis];
  if (comm_forward) comm->forward_comm_fix(this);
}

int FixConcordemBond::pack_comm(int n, int *list, double *buf, int, int *)
{
  const int first = facts_.atom_width - facts_.communicated;
  int m = 0;
  for (int k = 0; k < n; k++) {
    const int i = list[k];
    if (periodic_)
      for (int axis = 0; axis < 3; axis++) buf[m++] = original_[i][axis];
    for (int r = first; r < facts_.atom_width; r++) buf[m++] = memory_[i][r];
  }
  return comm_forward;
}

void FixConcordemBond::unpack_comm(int n, int first_atom, double *buf)
{
  const int first = facts_.atom_width - facts_.communicated;
  int m = 0;
  for (int i = first_atom; i < first_atom + n; i++) {
    if (periodic_)
      for (int axis = 0; axis < 3; axis++) original_[i][axis] = buf[m++];
    for (int r = first; r < facts_.atom_width; r++) memory_[i][r] = buf[m++];
  }
}

ConcordemAtoms FixConcordemBond::arrays()
{
  ConcordemAtoms atoms;
  const int count = atom->nlocal + atom->nghost;
  atoms.owned = atom->nlocal;
  atoms.count = count;
  atoms.group = groupbit;
  atoms.memory_width = facts_.atom_width;
  atoms.tag = atom->tag;
  atoms.type = atom->type;
  atoms.mask = atom->mask;
  atoms.position = count ? (periodic_ ? original_[0] : atom->x[0]) : NULL;
  atoms.velocity = count ? atom->v[0] : NULL;
  atoms.spin = count ? atom->omega[0] : NULL;
  atoms.radius = atom->radius;
  atoms.mass = atom->rmass;
  atoms.force = count ? atom->f[0] : NULL;
  atoms.torque = count ? atom->torque[0] : NULL;
  atoms.memory = count ? memory_[0] : NULL;
  for (int axis = 0; axis < 3; axis++) atoms.edge[axis] = domain->periodicity[axis] ? domain->prd[axis] : 0.0;
  atoms.dt = update->dt;
  atoms.step = update->ntimestep;
  return atoms;
}

void FixConcordemBond::rebuild()
{
  ConcordemAtoms atoms = arrays();
  // The mean radius is of use to bonds that are measured for the first time.
  const double mean = creation_is_due() || !made_ ? mean_radius() : 0.0;
  if (concordem_network_rebuild(network_, &atoms, neighbor->skin, reach_, mean, &message_) < 0)
    fail_on_this_processor(FLERR);
}

void FixConcordemBond::make_bonds()
{
  if (facts_.creation == 1 && concordem_network_make_near(network_, &message_) < 0) fail_on_this_processor(FLERR);
  if (facts_.creation == 2) concordem_network_make_listed(network_);
  if (facts_.creation) rebuild();
  made_ = true;
  double sums[CONCORDEM_SUMS], total;
  concordem_network_sums(network_, sums);
  MPI_Allreduce(&sums[0], &total, 1, MPI_DOUBLE, MPI_SUM, world);
  // Every bond is seen by the processors of both ends, or a copy was missing.
  double ends[2], all[2];
  concordem_network_ends(network_, ends);
  MPI_Allreduce(ends, all, 2, MPI_DOUBLE, MPI_SUM, world);
  if (all[0] != all[1])
    error->fix_error(FLERR, this, "neighbours on other processors are not known as far as bonds reach; add `reach LENGTH` with a larger length");
  if (comm->me == 0 && facts_.creation) {
    for (int k = 0; k < 2; k++) {
      FILE *out = k ? logfile : screen;
      if (out) fprintf(out, "fix %s concordem/bond: %.0f bonds of law %s\n", id, total, law_.c_str());
    }
  }
  if (facts_.creation && total == 0.0 && comm->me == 0)
    error->warning(FLERR, "fix concordem/bond made no bonds: is the factor too small, or the group empty?");
}

// Mean radius of the group. In whole numbers of a unit so small that nothing is lost, since the sum must not depend on how
// the atoms are shared out.
double FixConcordemBond::mean_radius()
{
  double mine = 0.0, largest = 0.0;
  for (int i = 0; i < atom->nlocal; i++)
    if (atom->mask[i] & groupbit) mine = std::max(mine, atom->radius[i]);
  MPI_Allreduce(&mine, &largest, 1, MPI_DOUBLE, MPI_MAX, world);
  if (!(largest > 0.0)) return 0.0;
  int exponent;
  frexp(largest, &exponent);
  const int shift = 53 - exponent;
  // upper and lower 26 bits apart: 2^37 atoms fit
  long long parts[3] = {0, 0, 0}, all[3];
  for (int i = 0; i < atom->nlocal; i++) {
    if (!(atom->mask[i] & groupbit)) continue;
    const long long units = static_cast<long long>(ldexp(atom->radius[i], shift));
    parts[0] += units >> 26;
    parts[1] += units & ((1LL << 26) - 1);
    parts[2] += 1;
  }
  MPI_Allreduce(parts, all, 3, MPI_LONG_LONG, MPI_SUM, world);
  const __int128 sum = (static_cast<__int128>(all[0]) << 26) + all[1];
  return ldexp(static_cast<double>(sum / all[2]), -shift);
}

void FixConcordemBond::find_forces(bool setup)
{
  ConcordemAtoms atoms = arrays();
  const bool output_is_due = setup || update->ntimestep == output->next;
  const bool sample = output_is_due || facts_.sample_every_step;
  if (concordem_network_forces(network_, &atoms, setup, sample, output_is_due, &message_) < 0)
    fail_on_this_processor(FLERR);
  if (sample) sampled_at_ = update->ntimestep;
}

/* ------------------------------------------------------------------------------------------------- atoms come and go */

void FixConcordemBond::grow_arrays(int nmax)
{
  memory->grow(memory_, nmax, facts_.atom_width, "concordem/bond:memory");
  if (periodic_) memory->grow(original_, nmax, 3, "concordem/bond:original");
}

void FixConcordemBond::copy_arrays(int i, int j, int)
{
  memcpy(memory_[j], memory_[i], sizeof(double) * facts_.atom_width);
}

void FixConcordemBond::set_arrays(int i)
{
  concordem_network_initial_memory(network_, memory_[i]);
}

int FixConcordemBond::pack_exchange(int i, double *buf)
{
  int m = 0;
  for (int r = 0; r < facts_.atom_width; r++) buf[m++] = memory_[i][r];
  const int64_t count = concordem_network_pack(network_, atom->tag[i], 1, buf + m + 1, exchanged_);
  if (count > exchanged_) error->one(FLERR, "fix concordem/bond: buffer for migrating atoms too small (internal error)");
  buf[m++] = static_cast<double>(count);
  return m + static_cast<int>(count);
}

int FixConcordemBond::unpack_exchange(int nlocal, double *buf)
{
  int m = 0;
  for (int r = 0; r < facts_.atom_width; r++) memory_[nlocal][r] = buf[m++];
  const int count = static_cast<int>(buf[m++]);
  if (concordem_network_unpack(network_, atom->tag[nlocal], buf + m, count, &message_) < 0) fail_on_this_processor(FLERR);
  return m + count;
}

/* --------------------------------------------------------------------------------------------------------- restart */

void FixConcordemBond::write_restart(FILE *fp)
{
  RestartHead head;
  memset(&head, 0, sizeof(head));
  double mine[CONCORDEM_TOTALS];
  head.version = RESTART_VERSION;
  head.made = made_;
  strncpy(head.law, law_.c_str(), sizeof(head.law) - 1);
  head.found_at = concordem_network_totals(network_, mine);
  MPI_Allreduce(mine, head.totals, CONCORDEM_TOTALS, MPI_DOUBLE, MPI_SUM, world);
  if (comm->me == 0) {
    const int size = sizeof(head);
    fwrite(&size, sizeof(int), 1, fp);
    fwrite(&head, sizeof(head), 1, fp);
  }
}

void FixConcordemBond::restart(char *buf)
{
  RestartHead head;
  memcpy(&head, buf, sizeof(head));
  if (head.version != RESTART_VERSION)
    error->fix_error(FLERR, this, "the restart file was written by another version of this library");
  if (law_ != head.law) {
    snprintf(text_, sizeof(text_), "the restart file holds bonds of law %s, not %s", head.law, law_.c_str());
    error->fix_error(FLERR, this, text_);
  }
  made_ = head.made;
  const double none[CONCORDEM_TOTALS] = {0.0};
  concordem_network_resume(network_, comm->me == 0 ? head.totals : none, head.found_at);
}

int FixConcordemBond::pack_restart(int i, double *buf)
{
  int m = 1;
  for (int r = 0; r < facts_.atom_width; r++) buf[m++] = memory_[i][r];
  m += static_cast<int>(concordem_network_pack(network_, atom->tag[i], 0, buf + m, maxsize_restart()));
  buf[0] = m;
  return m;
}

void FixConcordemBond::unpack_restart(int nlocal, int nth)
{
  double *extra = atom->extra[nlocal];
  int m = 0;
  for (int k = 0; k < nth; k++) m += static_cast<int>(extra[m]);
  const int end = m + static_cast<int>(extra[m]);
  m++;
  for (int r = 0; r < facts_.atom_width; r++) memory_[nlocal][r] = extra[m++];
  if (concordem_network_unpack(network_, atom->tag[nlocal], extra + m, end - m, &message_) < 0) fail_on_this_processor(FLERR);
}

int FixConcordemBond::size_restart(int i)
{
  return 1 + facts_.atom_width + static_cast<int>(concordem_network_pack(network_, atom->tag[i], 0, NULL, 0));
}

int FixConcordemBond::maxsize_restart()
{
  return 1 + facts_.atom_width + static_cast<int>(concordem_network_largest_pack(network_));
}

/* ---------------------------------------------------------------------------------------------------------- output */

void FixConcordemBond::update_sums()
{
  if (summed_at_ == update->ntimestep && update->setupflag == 0) return;
  double mine[CONCORDEM_SUMS];
  concordem_network_sums(network_, mine);
  MPI_Allreduce(mine, sums_, CONCORDEM_SUMS - 1, MPI_DOUBLE, MPI_SUM, world);
  MPI_Allreduce(mine + CONCORDEM_SUMS - 1, sums_ + CONCORDEM_SUMS - 1, 1, MPI_DOUBLE, MPI_MAX, world);
  summed_at_ = update->ntimestep;
}

double FixConcordemBond::compute_scalar()
{
  update_sums();
  return sums_[0];
}

double FixConcordemBond::compute_vector(int n)
{
  if (n >= 3 && n <= 6 && sampled_at_ != update->ntimestep && update->whichflag == 1)
    error->all(FLERR, "fix concordem/bond sums stored energies when output is due; add `energies every` to have them at every step");
  update_sums();
  return sums_[n];
}

double FixConcordemBond::memory_usage()
{
  return static_cast<double>(atom->nmax) * (facts_.atom_width + (periodic_ ? 3 : 0)) * sizeof(double);
}
