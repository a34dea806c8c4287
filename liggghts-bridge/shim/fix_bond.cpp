/* fix concordem/bond, see fix_bond.h.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "fix_bond.h"

#include <string.h>

#include <algorithm>

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
  virial_flag = 1;
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
  double smallest = 0.0;
  const double wanted = !made_ && facts_.creation == 2 ? longest_listed() : 0.0;
  const double longest = concordem_longest(network_, facts_, made_, wanted, atom, groupbit, world, &smallest);
  reach_ = std::max(1.05 * longest + neighbor->skin, facts_.reach);
  // LIGGGHTS sends an atom to a neighbouring processor if its centre is nearer to the border than its own radius and half of
  // the cut-off: it thinks of surfaces that touch. Bonds join centres.
  comm->cutghostuser = std::max(comm->cutghostuser, std::max(reach_, 2.0 * (reach_ - smallest)));
}

// Longest bond of the list at the present positions. Fails if a listed atom does not exist.
double FixConcordemBond::longest_listed()
{
  int missing;
  const double longest = concordem_longest_listed(network_, atom, domain, groupbit, world, &missing);
  if (missing) {
    snprintf(text_, sizeof(text_), "the list of bonds names atom %d, which is not in group %s", missing, group->names[igroup]);
    error->fix_error(FLERR, this, text_);
  }
  return longest;
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

void FixConcordemBond::setup_pre_force(int vflag)
{
  communicate();
  rebuild();
  if (creation_is_due()) make_bonds();
  find_forces(true, vflag);
}

void FixConcordemBond::pre_force(int vflag)
{
  ConcordemAtoms atoms = arrays();
  concordem_network_turn(network_, &atoms);
  communicate();
  if (neighbor->ago == 0) rebuild();
  find_forces(false, vflag);
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
  concordem_pack_copies(n, list, buf, facts_.atom_width - facts_.communicated, facts_.atom_width, memory_,
                        periodic_ ? original_ : NULL);
  return comm_forward;
}

void FixConcordemBond::unpack_comm(int n, int first_atom, double *buf)
{
  concordem_unpack_copies(n, first_atom, buf, facts_.atom_width - facts_.communicated, facts_.atom_width, memory_,
                          periodic_ ? original_ : NULL);
}

ConcordemAtoms FixConcordemBond::arrays()
{
  return concordem_arrays(atom, domain, update, groupbit, facts_.atom_width, memory_, periodic_ ? original_ : NULL);
}

void FixConcordemBond::rebuild()
{
  ConcordemAtoms atoms = arrays();
  // The mean radius is of use to bonds that are measured for the first time.
  const double mean = creation_is_due() || !made_ ? concordem_mean_radius(atom, groupbit, world) : 0.0;
  if (concordem_network_rebuild(network_, &atoms, neighbor->skin, reach_, mean, &message_) < 0)
    fail_on_this_processor(FLERR);
}

void FixConcordemBond::make_bonds()
{
  if (facts_.creation == 1 && concordem_network_make_near(network_, &message_) < 0) fail_on_this_processor(FLERR);
  if (facts_.creation == 2) concordem_network_make_listed(network_);
  if (facts_.creation) rebuild();
  made_ = true;
  double total;
  if (!concordem_count(network_, world, &total))
    error->fix_error(FLERR, this,
                     "neighbours on other processors are not known as far as bonds reach; add `reach LENGTH` with a larger length");
  if (comm->me == 0 && facts_.creation) {
    for (int k = 0; k < 2; k++) {
      FILE *out = k ? logfile : screen;
      if (out) fprintf(out, "fix %s concordem/bond: %.0f bonds of law %s\n", id, total, law_.c_str());
    }
  }
  if (facts_.creation && total == 0.0 && comm->me == 0)
    error->warning(FLERR, "fix concordem/bond made no bonds: is the factor too small, or the group empty?");
}

void FixConcordemBond::find_forces(bool setup, int vflag)
{
  ConcordemAtoms atoms = arrays();
  if (vflag) v_setup(vflag);
  else evflag = 0;
  const bool output_is_due = setup || update->ntimestep == output->next;
  const bool sample = output_is_due || facts_.sample_every_step;
  const bool record = output_is_due || vflag || concordem_compute_is_due(modify, update);
  if (concordem_network_forces(network_, &atoms, setup, sample, record, &message_) < 0) fail_on_this_processor(FLERR);
  if (sample) sampled_at_ = update->ntimestep;
  if (vflag)
    concordem_network_virial(network_, virial, vflag_atom ? vatom[0] : NULL, vflag_atom ? atom->nlocal : 0);
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
  const ConcordemRestartHead head = concordem_restart_head(network_, facts_, made_, law_.c_str(), world);
  if (comm->me == 0) {
    const int size = sizeof(head);
    fwrite(&size, sizeof(int), 1, fp);
    fwrite(&head, sizeof(head), 1, fp);
  }
}

void FixConcordemBond::restart(char *buf)
{
  ConcordemRestartHead head;
  if (!concordem_read_restart_head(buf, &head))
    error->fix_error(FLERR, this, "the restart file was written by another version of this library");
  if (law_ != head.law) {
    snprintf(text_, sizeof(text_), "the restart file holds bonds of law %s, not %s", head.law, law_.c_str());
    error->fix_error(FLERR, this, text_);
  }
  if (head.contacts != facts_.contacts)
    error->fix_error(FLERR, this, "the restart file holds contacts of another law; give the same `contact LAW`");
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
