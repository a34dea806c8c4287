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
#include "memory.h"
#include "modify.h"
#include "neighbor.h"
#include "output.h"
#include "update.h"

#include "host.h"

using namespace LAMMPS_NS;

FixConcordemBond::FixConcordemBond(LAMMPS *lmp, int narg, char **arg) :
    Fix(lmp, narg, arg), network_(NULL), memory_(NULL), original_(NULL), periodic_(false), made_(false), maxexchange(0),
    reach_(0.0), summed_at_(-1), sampled_at_(-1)
{
  message_.text = text_;
  message_.capacity = sizeof(text_);
  text_[0] = 0;
  if (!atom->sphere_flag || !atom->radius_flag || !atom->rmass_flag || !atom->omega_flag || !atom->torque_flag)
    fail("needs atoms with radius, mass, spin, and torque: use `atom_style sphere` (or granular)");
  if (!atom->tag_enable) fail("needs atom ids: remove `atom_modify id no`");
  if (force->newton_pair || force->newton)
    fail("needs `newton off`: put that command before the simulation box is created");
  if (domain->triclinic) fail("needs an orthogonal box, not a triclinic one");
  if (strcmp(update->unit_style, "si") != 0)
    fail("takes its parameters in SI units: use `units si`");

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

// LIGGGHTS' lists of what to call are those of the last set-up: `run N pre no` would go on calling a fix that is gone. As before the
// first run, the next one is set up whatever it says.
void FixConcordemBond::pre_delete(bool unfix)
{
  if (unfix) update->first_update = 0;
}

int FixConcordemBond::setmask()
{
  return FixConst::PRE_EXCHANGE | FixConst::PRE_FORCE;
}

void FixConcordemBond::fail(const std::string &text)
{
  error->fix_error(FLERR, this, text.c_str());
}

// A message that may exist on one processor only: all are stopped.
void FixConcordemBond::fail_on_this_processor()
{
  const std::string text = std::string("fix ") + id + " concordem/bond: " + text_;
  error->one(FLERR, text.c_str());
}

void FixConcordemBond::init()
{
  if (!comm->ghost_velocity)
    fail("needs velocities of neighbours on other processors: add `communicate single vel yes`");
  if (domain->deform_flag) fail("does not follow boxes that deform: remove `fix deform`");
  if (strstr(update->integrate_style, "respa")) fail("does not work with run_style respa");
  if (periodic_ != (domain->xperiodic || domain->yperiodic || domain->zperiodic))
    fail("must be defined after `boundary` or change_box have set the final boundaries");

  // Atoms must be known as far as the longest bond reaches. It may stretch by 5 % before lists are rebuilt with a check.
  double smallest = 0.0;
  const double wanted = !made_ && facts_.creation == 2 ? longest_listed() : 0.0;
  const double longest = concordem_longest(network_, facts_, made_, wanted, atom, groupbit, world, &smallest);
  reach_ = std::max(1.05 * longest + neighbor->skin, facts_.reach);
  // LIGGGHTS sends an atom to a neighbouring processor if its centre is nearer to the border than its own radius and half of
  // the cut-off: it thinks of surfaces that touch. Bonds join centres.
  comm->cutghostuser = std::max(comm->cutghostuser, std::max(reach_, 2.0 * (reach_ - smallest)));
}

void FixConcordemBond::setup_pre_exchange()
{
  pre_exchange();
}

// The buffer for an atom that migrates must hold all its bonds.
void FixConcordemBond::pre_exchange()
{
  const int needed = facts_.atom_width + 2 + static_cast<int>(concordem_network_largest_pack(network_));
  if (needed > maxexchange) {
    comm->maxexchange_fix += needed - maxexchange;
    maxexchange = needed;
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

void FixConcordemBond::make_bonds()
{
  if (facts_.creation == 1 && concordem_network_make_near(network_, &message_) < 0) fail_on_this_processor();
  if (facts_.creation == 2) concordem_network_make_listed(network_);
  if (facts_.creation) rebuild();
  made_ = true;
  double total;
  if (!concordem_count(network_, world, &total))
    fail("neighbours on other processors are not known as far as bonds reach; add `reach LENGTH` with a larger length");
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
  if (concordem_network_forces(network_, &atoms, setup, sample, record, &message_) < 0) fail_on_this_processor();
  if (sample) sampled_at_ = update->ntimestep;
  if (vflag)
    concordem_network_virial(network_, virial, vflag_atom ? vatom[0] : NULL, vflag_atom ? atom->nlocal : 0);
}
