/* Models concordem/... of pair_style gran and fix wall/gran: contacts with ConcorDEM laws or LIGGGHTS' own formulas. They use
   LIGGGHTS' neighbor lists and contact history, and are registered in its public factories when this library is loaded.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include <string>
#include <vector>

#include "atom.h"
#include "comm.h"
#include "force.h"
#include "contact_models.h"
#include "error.h"
#include "fix_wall_gran.h"
#include "granular_pair_style.h"
#include "granular_wall.h"
#include "neigh_list.h"
#include "pair_gran.h"
#include "update.h"

#include "abi.h"
#include "pair_contact.h"
#include "pair_model.h"
#include "tip.h"

using namespace LAMMPS_NS;
using namespace LIGGGHTS;

namespace {

// LIGGGHTS stores the vectors of all atoms contiguously.
double (*vectors(double *first))[3]
{
  return reinterpret_cast<double(*)[3]>(first);
}

class ConcordemPair : public PairStyles::IGranularPairStyle, private ConcordemModel {
 public:
  ConcordemPair(LAMMPS *lmp, PairGran *, int64_t hash) :
      ConcordemModel(lmp, hash), hash_(hash), record_(concordem_pair_record_new()), recorded_(0), of_fixes_(lmp)
  {
  }

  ~ConcordemPair()
  {
    concordem_pair_record_delete(record_);
  }

  int64_t hashcode() { return hash_; }
  double stressStrainExponent() { return model_.hertzian ? 1.5 : 1.0; }
  int get_history_offset(const std::string) { return -1; }
  bool contact_match(const std::string type, const std::string model) { return concordem_model_is(hash_, type, model); }
  void write_restart_settings(FILE *fp) { fwrite(&hash_, sizeof(hash_), 1, fp); }

  void read_restart_settings(FILE *fp, int64_t hash)
  {
    if (comm_rank() != 0) return;
    int64_t selected = -1;
    if (fread(&selected, sizeof(selected), 1, fp) != 1 || (hash != -1 ? hash : selected) != hash_) {
      concordem_leave_out_tip(universe);
      error->one(FLERR, "the restart file was written with other models of pair_style gran; use the same models in the script");
    }
  }

  void settings(int narg, char **arg, IContactHistorySetup *setup)
  {
    set(narg, arg, setup);
  }

  void init_granular()
  {
    make_law();
  }

  void compute_force(PairGran *pair, int eflag, int vflag, int addflag)
  {
    // compute pair/gran/local calls this at the end of the step. LIGGGHTS' models then recompute the forces with the velocities at that
    // time, as LIGGGHTS does. ConcorDEM laws return the forces that acted in the step.
    const bool acts = pair->computeflag();
    if (!acts && !(pair->cpl() && addflag)) return;
    if (!acts && model_.is_law) {
      add_rows(pair);
      return;
    }
    if (acts && (eflag || vflag))
      pair->ev_setup(eflag, vflag);
    else
      pair->evflag = pair->vflag_fdotr = 0;
    check(pair, has_history());
    const int nlocal = atom->nlocal, count = nlocal + atom->nghost;
    recorded_ = 0;
    if (!count) return;
    NeighList *list = pair->list, *contacts = pair->listgranhistory;
    ConcordemPairArrays arrays;
    arrays.owned = nlocal;
    arrays.count = count;
    arrays.atoms = list->inum;
    arrays.frozen = pair->freeze_group_bit();
    arrays.advance = acts && pair->shearupdate();
    arrays.stride = pair->dnum();
    arrays.list = list->ilist;
    arrays.numbers = list->numneigh;
    arrays.neighbors = list->firstneigh;
    arrays.flags = contacts->firstneigh;
    if (offset_ == 0) {
      arrays.history = contacts->firstdouble;
    } else {
      shifted_.resize(count);
      for (int ii = 0; ii < list->inum; ii++) {
        const int i = list->ilist[ii];
        shifted_[i] = contacts->firstdouble[i] + offset_;
      }
      arrays.history = &shifted_[0];
    }
    arrays.position = vectors(atom->x[0]);
    arrays.velocity = vectors(atom->v[0]);
    arrays.angular_velocity = vectors(atom->omega[0]);
    arrays.radius = atom->radius;
    arrays.mass = atom->rmass;
    arrays.kind = atom->type;
    arrays.mask = atom->mask;
    arrays.force = vectors(atom->f[0]);
    arrays.torque = vectors(atom->torque[0]);
    arrays.dt = update->dt;
    arrays.skip = of_fixes_.find(list);
    if (!acts) {
      unused_.assign(6 * count, 0.0);
      arrays.force = vectors(&unused_[0]);
      arrays.torque = vectors(&unused_[3 * count]);
    }
    // Rows of LIGGGHTS' models are computed on request. Rows of ConcorDEM laws are recorded at every step, because LIGGGHTS does not
    // announce the steps that request them.
    const bool record = pair->evflag || !acts || (pair->cpl() && model_.is_law);
    recorded_ = concordem_pair_compute(law_, &arrays, record ? record_ : NULL, &message_);
    if (recorded_ < 0) fail_with_message();
    if (!acts) {
      add_rows(pair);
      return;
    }
    if (!pair->evflag) return;
    const ConcordemPairForce *forces = concordem_pair_recorded(record_);
    for (int64_t k = 0; k < recorded_; k++) {
      const ConcordemPairForce &f = forces[k];
      pair->ev_tally_xyz(f.i, f.j, nlocal, force->newton_pair, 0.0, 0.0, f.force[0], f.force[1], f.force[2], f.between[0],
                         f.between[1], f.between[2]);
    }
  }

 private:
  int64_t hash_;
  ConcordemPairRecord *record_;
  int64_t recorded_;   // number of contacts in record_
  std::vector<double *> shifted_;
  std::vector<double> unused_;

  ConcordemPairsOfFixes of_fixes_;

  int comm_rank()
  {
    int rank;
    MPI_Comm_rank(world, &rank);
    return rank;
  }

  void add_rows(PairGran *pair)
  {
    const ConcordemPairForce *forces = concordem_pair_recorded(record_);
    for (int64_t k = 0; k < recorded_; k++) add_local(pair, forces[k]);
    pair->cpl_pair_finalize();
  }

  // Add a row to compute pair/gran/local.
  void add_local(PairGran *pair, const ConcordemPairForce &f)
  {
    ContactModels::SurfacesIntersectData data;
    ContactModels::ForceData forces;
    data.i = f.i;
    data.j = f.j;
    data.radi = atom->radius[f.i];
    data.radj = atom->radius[f.j];
    data.radsum = data.radi + data.radj;
    data.rsq = 0.0;
    for (int axis = 0; axis < 3; axis++) {
      data.delta[axis] = f.between[axis];
      data.rsq += f.between[axis] * f.between[axis];
      forces.delta_F[axis] = f.force[axis];
      forces.delta_torque[axis] = f.torque[axis];
    }
    data.r = sqrt(data.rsq);
    data.rinv = 1.0 / data.r;
    for (int axis = 0; axis < 3; axis++) data.en[axis] = data.delta[axis] * data.rinv;
    data.deltan = data.radsum - data.r;
    data.contact_history = pair->dnum() ? &pair->listgranhistory->firstdouble[f.i][f.place * pair->dnum()] : NULL;
    data.cri = data.radi - 0.5 * data.deltan;
    data.crj = data.radj - 0.5 * data.deltan;
    data.itype = atom->type[f.i];
    data.jtype = atom->type[f.j];
    pair->cpl_add_pair(data, forces);
  }
};

// Whether models of LIGGGHTS act beside ours.
bool beside(int64_t hash)
{
  return ConcordemHash(hash).cohesion != 0 || ConcordemHash(hash).rolling != 0;
}

PairStyles::IGranularPairStyle *new_pair(LAMMPS *lmp, PairGran *parent, int64_t hash)
{
  if (beside(hash)) return concordem_pair_beside(lmp, parent, hash);
  return new ConcordemPair(lmp, parent, hash);
}

class ConcordemWall : public Walls::IGranularWall, private ConcordemModel {
 public:
  ConcordemWall(LAMMPS *lmp, FixWallGran *, int64_t hash) : ConcordemModel(lmp, hash), hash_(hash) {}

  void settings(int narg, char **arg, IContactHistorySetup *setup)
  {
    set(narg, arg, setup);
  }

  void init_granular()
  {
    make_law();
  }

  bool checkSurfaceIntersect(ContactModels::SurfacesIntersectData &) { return true; }
  int get_history_offset(const std::string) { return -1; }
  bool contact_match(const std::string type, const std::string model) { return concordem_model_is(hash_, type, model); }

  void compute_force(FixWallGran *wall, ContactModels::SurfacesIntersectData &data, bool overlaps, double *wall_velocity,
                     FixMeshSurface *mesh_fix, int mesh_number, TriMesh *mesh, int triangle)
  {
    const int i = data.i;
    double *history = width_ ? data.contact_history + offset_ : NULL;
    data.has_force_update = overlaps;
    if (!overlaps) {
      for (int k = 0; k < width_; k++) history[k] = 0.0;
      return;
    }
    check(wall);
    const ConcordemWallContact contact = wall_contact(wall, data, wall_velocity);
    const bool local = wall->compute_wall_gran_local() && wall->addflag();
    if (local) {
      double point[3];
      for (int axis = 0; axis < 3; axis++) point[axis] = atom->x[i][axis] - data.delta[axis];
      wall->compute_wall_gran_local()->add_wall_1(mesh_number, mesh ? mesh->id(triangle) : 0, i, point, wall_velocity);
    }
    ConcordemSingleResponse response;
    if (concordem_pair_wall(law_, &contact, 0.0, history, width_, &response, &message_) < 0) fail_with_message();
    double *const force = response.force, *const torque = response.torque;
    if (wall->computeflag())
      for (int axis = 0; axis < 3; axis++) {
        atom->f[i][axis] += force[axis];
        atom->torque[i][axis] += torque[axis];
      }
    double normal[3] = {contact.normal[0], contact.normal[1], contact.normal[2]};
    if (local)
      wall->compute_wall_gran_local()->add_wall_2(i, force[0], force[1], force[2], torque[0], torque[1], torque[2],
                                                  data.contact_history, contact.distance * contact.distance, normal);
    if (wall->store_force())
      for (int axis = 0; axis < 3; axis++) wall->fix_wallforce()->array_atom[i][axis] += force[axis];
    if (mesh_fix) {
      double to_wall[3];
      for (int axis = 0; axis < 3; axis++) to_wall[axis] = -data.delta[axis];
      mesh_fix->add_particle_contribution(i, force, to_wall, triangle, wall_velocity);
    }
  }

 private:
  int64_t hash_;
};

Walls::IGranularWall *new_wall(LAMMPS *lmp, FixWallGran *parent, int64_t hash)
{
  if (beside(hash)) return concordem_wall_beside(lmp, parent, hash);
  return new ConcordemWall(lmp, parent, hash);
}

// Number of tangential models: 0 off, 1 no_history, 2 history (LIGGGHTS' numbers).
const int SHEARS = 3;

// Numbers of LIGGGHTS' cohesion, rolling, and surface models. Surface models are registered with ours only to be rejected with a remedy.
const int COHESIONS[] = {0, 1, 2, 7, 8}, ROLLINGS[] = {0, 1, 2, 3, 4, 6}, SURFACES[] = {0, 2, 5};

struct Registration {
  Registration()
  {
    for (const ConcordemPairModel &model : concordem_models()) {
      ContactModels::Factory::instance().addNormalModel(model.name, model.number);
      for (int shear = 0; shear < SHEARS; shear++)
        for (int cohesion : COHESIONS)
          for (int rolling : ROLLINGS)
            for (int surface : SURFACES) {
              const int hash = static_cast<int>(Utils::generate_gran_hashcode(model.number, shear, cohesion, rolling, surface));
              PairStyles::Factory::instance().addStyle("gran", hash, &new_pair);
              Walls::Factory::instance().addStyle("gran", hash, &new_wall);
            }
    }
  }
} registration;

}  // namespace

namespace LAMMPS_NS {

bool concordem_is_our_model(PairGran *pair)
{
  return concordem_model_of(pair->hashcode()) >= 0;
}

}
