/* fix concordem/bond for LIGGGHTS, see fix_bond.h.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "fix_bond.h"

#include <stdlib.h>
#include <string.h>

#include <algorithm>

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "neighbor.h"
#include "update.h"

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
  return FixConst::PRE_EXCHANGE | FixConst::PRE_FORCE;
}

void FixConcordemBond::init()
{
  if (!comm->ghost_velocity)
    fail("needs the velocities of ghosts; add `communicate single vel yes`");
  if (domain->deform_flag) fail("does not support deforming boxes; remove `fix deform`");
  if (strstr(update->integrate_style, "respa")) fail("does not support run_style respa; use run_style verlet");
  if (periodic_ != (domain->xperiodic || domain->yperiodic || domain->zperiodic))
    fail("the boundaries changed after its definition; define it after `boundary` and change_box");

  double smallest = 0.0;
  find_reach(0.0, &smallest);
  // LIGGGHTS makes an atom a ghost of a neighboring processor if its center is closer to the border than its radius plus half of the
  // cutoff. That suffices for surfaces that touch, but not for bonds, which join centers.
  comm->cutghostuser = std::max(comm->cutghostuser, std::max(reach_, 2.0 * (reach_ - smallest)));
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
  communicate();
  rebuild();
  if (creation_is_due()) make_bonds();
  find_forces_and_virial(true, vflag);
}

void FixConcordemBond::pre_force(int vflag)
{
  ConcordemAtoms atoms = arrays();
  concordem_network_turn(network_, &atoms);
  communicate();
  if (neighbor->ago == 0) rebuild();
  find_forces_and_virial(false, vflag);
  // New bonds start unstrained at the end of the step; the next step evaluates them.
  if (creation_is_due()) make_bonds();
}

int FixConcordemBond::pack_comm(int n, int *list, double *buf, int, int *)
{
  pack_ghosts(n, list, buf);
  return comm_forward;
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
  if (vflag)
    concordem_network_virial(network_, virial, vflag_atom ? vatom[0] : NULL, vflag_atom ? atom->nlocal : 0);
}

/* ------------------------------------------------------------------------- functions of the base class specific to LIGGGHTS */

void FixBondBase::fail(const std::string &text)
{
  error->fix_error(FLERR, this, text.c_str());
  abort();   // unreachable: fix_error ends the program
}

void FixBondBase::fail_on_this_processor()
{
  const std::string text = std::string("fix ") + id + " concordem/bond: " + text_;
  error->one(FLERR, text.c_str());
  abort();   // unreachable: one ends the program
}

void FixBondBase::communicate_ghosts()
{
  comm->forward_comm_fix(this);
}

void FixBondBase::queue_bonds_of_lists() {}

void FixBondBase::print(double bonds)
{
  for (int k = 0; k < 2; k++) {
    FILE *out = k ? logfile : screen;
    if (out) fprintf(out, "fix %s concordem/bond: %.0f bonds of law %s\n", id, bonds, law_.c_str());
  }
}

void FixBondBase::warn_no_bonds()
{
  error->warning(FLERR, "fix concordem/bond created no bonds; check the distance factor and the group");
}
