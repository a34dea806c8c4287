/* Models concordem/... of pair_style gran and fix wall/gran: contacts with ConcorDEM laws or LIGGGHTS' own formulas. They use
   LIGGGHTS' neighbor lists and contact history, and are registered in its public factories when this library is loaded.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include <algorithm>
#include <string>
#include <vector>

#include "atom.h"
#include "comm.h"
#include "force.h"
#include "contact_models.h"
#include "error.h"
#include "fix_property_global.h"
#include "fix_wall_gran.h"
#include "granular_pair_style.h"
#include "granular_wall.h"
#include "modify.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "pair_gran.h"
#include "update.h"

#include "abi.h"
#include "fix_bond.h"
#include "pair_contact.h"

using namespace LAMMPS_NS;
using namespace LIGGGHTS;

namespace {

std::vector<ConcordemPairModel> all_models()
{
  std::vector<ConcordemPairModel> models(concordem_pair_model(-1, NULL));
  for (size_t index = 0; index < models.size(); index++) concordem_pair_model(static_cast<int32_t>(index), &models[index]);
  return models;
}

const std::vector<ConcordemPairModel> &models()
{
  static const std::vector<ConcordemPairModel> all = all_models();
  return all;
}

// LIGGGHTS stores the vectors of all atoms contiguously.
double (*vectors(double *first))[3]
{
  return reinterpret_cast<double(*)[3]>(first);
}

// Index of the model in LIGGGHTS' model hash; its lowest six bits are the number of the normal model.
int index_of(int64_t hash)
{
  for (size_t index = 0; index < models().size(); index++)
    if (models()[index].number == (hash & 63)) return static_cast<int>(index);
  return -1;   // unreachable: the factories pass registered numbers only
}

// Number of tangential models: 0 off, 1 no_history, 2 history (LIGGGHTS' numbers).
const int SHEARS = 3;

// Numbers of LIGGGHTS' cohesion, rolling, and surface models. They are registered with ours only to be rejected with a remedy.
const int COHESIONS[] = {0, 1, 2, 7, 8}, ROLLINGS[] = {0, 1, 2, 3, 4, 6}, SURFACES[] = {0, 2, 5};

// A model with its parameters.
class ConcordemModel : protected Pointers {
 protected:
  ConcordemModel(LAMMPS *lmp, int64_t hash) :
      Pointers(lmp), index_(index_of(hash)), model_(models().at(index_)), shear_((hash >> 6) & 63), law_(NULL), width_(0), offset_(0)
  {
    message_.text = text_;
    message_.capacity = sizeof(text_);
    text_[0] = 0;
    const char *other = hash >> 12 & 63 ? "cohesion" : hash >> 18 & 63 ? "rolling_friction" : hash >> 24 & 63 ? "surface" : NULL;
    if (!other) return;
    snprintf(text_, sizeof(text_),
             "model %s does not support `%s`; remove it, or use a model of LIGGGHTS, and beside fix concordem/bond take the pairs of its "
             "group out of the neighbor lists: `neigh_modify exclude group GROUP GROUP`",
             model_.name, other);
    error->all(FLERR, text_);
  }

  ~ConcordemModel()
  {
    concordem_pair_delete(law_);
  }

  const int index_;
  const ConcordemPairModel model_;
  const int shear_;
  ConcordemPairLaw *law_;
  int width_, offset_;
  char text_[1024];
  ConcordemMessage message_;

  void set(int narg, char **arg, IContactHistorySetup *setup)
  {
    if (narg > 0) {
      snprintf(text_, sizeof(text_), "model %s has no setting `%s`; remove it", model_.name, arg[0]);
      error->all(FLERR, text_);
    }
    if (model_.is_law && shear_ != 0) {
      snprintf(text_, sizeof(text_), "model %s includes the tangential force; remove `tangential ...`", model_.name);
      error->all(FLERR, text_);
    }
    int32_t odd[64];
    width_ = concordem_pair_history(index_, odd, 64);
    for (int k = 0; k < width_; k++) {
      char name[64];
      snprintf(name, sizeof(name), "concordem%d", k);
      const int offset = setup->add_history_value(name, odd[k] ? "1" : "0");
      if (k == 0) offset_ = offset;
    }
  }

  void make_law()
  {
    const int n = atom->ntypes;
    ConcordemPairProperties properties;
    memset(&properties, 0, sizeof(properties));
    std::vector<double> young, poisson, restitution, friction, stiffness[4];
    if (reads(CONCORDEM_ELASTIC)) {
      young = per_type("youngsModulus");
      poisson = per_type("poissonsRatio");
    }
    if (reads(CONCORDEM_RESTITUTION)) restitution = per_pair("coefficientRestitution");
    friction = shear_ == 0 && !model_.is_law ? std::vector<double>(n * n, 0.0) : per_pair("coefficientFriction");
    if (reads(CONCORDEM_STIFFNESS)) {
      stiffness[0] = per_pair("kn");
      stiffness[1] = per_pair("kt");
    }
    if (reads(CONCORDEM_DAMPING)) {
      stiffness[2] = per_pair("gamman");
      stiffness[3] = per_pair("gammat");
    }
    if (reads(CONCORDEM_VELOCITY))
      properties.velocity = property("characteristicVelocity", "scalar", 0, 0)->compute_scalar();
    properties.types = n;
    properties.shear = shear_;
    properties.young = young.data();
    properties.poisson = poisson.data();
    properties.restitution = restitution.data();
    properties.friction = friction.data();
    for (int k = 0; k < 4; k++) properties.stiffness[k] = stiffness[k].data();
    concordem_pair_delete(law_);
    law_ = concordem_pair_new(index_, &properties, &message_);
    if (!law_) {
      const std::string text = std::string("model ") + model_.name + ": " + text_;
      error->all(FLERR, text.c_str());
    }
  }

  bool reads(uint32_t property) const { return model_.properties & property; }

  FixPropertyGlobal *property(const char *name, const char *kind, int len1, int len2)
  {
    return static_cast<FixPropertyGlobal *>(
        modify->find_fix_property(name, "property/global", kind, len1, len2, model_.name));
  }

  std::vector<double> per_type(const char *name)
  {
    FixPropertyGlobal *fix = property(name, "peratomtype", atom->ntypes, 0);
    std::vector<double> values(atom->ntypes);
    for (int a = 0; a < atom->ntypes; a++) values[a] = fix->compute_vector(a);
    return values;
  }

  std::vector<double> per_pair(const char *name)
  {
    const int n = atom->ntypes;
    FixPropertyGlobal *fix = property(name, "peratomtypepair", n, n);
    std::vector<double> values(n * n);
    for (int a = 0; a < n; a++)
      for (int b = 0; b < n; b++) values[a * n + b] = fix->compute_array(a, b);
    return values;
  }
};

class ConcordemPair : public PairStyles::IGranularPairStyle, private ConcordemModel {
 public:
  ConcordemPair(LAMMPS *lmp, PairGran *, int64_t hash) :
      ConcordemModel(lmp, hash), hash_(hash), record_(concordem_pair_record_new()), recorded_(0)
  {
  }

  ~ConcordemPair()
  {
    concordem_pair_record_delete(record_);
  }

  int64_t hashcode() { return hash_; }
  double stressStrainExponent() { return model_.hertzian ? 1.5 : 1.0; }
  int get_history_offset(const std::string) { return -1; }
  bool contact_match(const std::string type, const std::string model) { return type == "model" && model == model_.name; }
  void write_restart_settings(FILE *fp) { fwrite(&hash_, sizeof(hash_), 1, fp); }

  void read_restart_settings(FILE *fp, int64_t hash)
  {
    if (comm_rank() != 0) return;
    int64_t selected = -1;
    if (fread(&selected, sizeof(selected), 1, fp) != 1 || (hash != -1 ? hash : selected) != hash_)
      error->one(FLERR, "the restart file was written with other models of pair_style gran; use the same models in the script");
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
    if (pair->storeContactForces() || pair->storeContactForcesStress() || pair->storeSumDelta() || pair->fr_pair())
      error->all(FLERR,
                 "pair_style gran model concordem/... does not support fixes that store contact forces, or rigid bodies; remove them");
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
    arrays.skip = pairs_of_fixes(list);
    if (!acts) {
      unused_.assign(6 * count, 0.0);
      arrays.force = vectors(&unused_[0]);
      arrays.torque = vectors(&unused_[3 * count]);
    }
    // Rows of LIGGGHTS' models are computed on request. Rows of ConcorDEM laws are recorded at every step, because LIGGGHTS does not
    // announce the steps that request them.
    const bool record = pair->evflag || !acts || (pair->cpl() && model_.is_law);
    recorded_ = concordem_pair_compute(law_, &arrays, record ? record_ : NULL, &message_);
    if (recorded_ < 0) error->one(FLERR, text_);
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

  std::vector<FixConcordemBond *> bonds_;   // the fixes that compute forces of pairs
  std::vector<unsigned char> skip_;         // 1 for each entry of the neighbor list that is such a pair
  int64_t skip_of_ = -1;                    // when skip_ was determined

  // 1 for each entry of the neighbor list whose forces a fix concordem/bond computes; NULL if there is no such fix.
  const unsigned char *pairs_of_fixes(NeighList *list)
  {
    bonds_.clear();
    int64_t now = neighbor->ncalls;
    for (int k = 0; k < modify->nfix; k++) {
      FixConcordemBond *fix = dynamic_cast<FixConcordemBond *>(modify->fix[k]);
      if (!fix) continue;
      bonds_.push_back(fix);
      now += fix->generation();
    }
    if (bonds_.empty()) return NULL;
    // Every build of the lists also increases the generation of each fix.
    if (now != skip_of_) {
      size_t entries = 0;
      for (int ii = 0; ii < list->inum; ii++) entries += list->numneigh[list->ilist[ii]];
      skip_.assign(std::max<size_t>(entries, 1), 0);
      for (size_t k = 0; k < bonds_.size(); k++) bonds_[k]->mark_pairs(list, skip_);
      skip_of_ = now;
    }
    return &skip_[0];
  }

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
    data.cri = data.radi - 0.5 * data.deltan;
    data.crj = data.radj - 0.5 * data.deltan;
    data.itype = atom->type[f.i];
    data.jtype = atom->type[f.j];
    pair->cpl_add_pair(data, forces);
  }
};

PairStyles::IGranularPairStyle *new_pair(LAMMPS *lmp, PairGran *parent, int64_t hash)
{
  return new ConcordemPair(lmp, parent, hash);
}

class ConcordemWall : public Walls::IGranularWall, private ConcordemModel {
 public:
  ConcordemWall(LAMMPS *lmp, FixWallGran *, int64_t hash) : ConcordemModel(lmp, hash) {}

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
  bool contact_match(const std::string type, const std::string model) { return type == "model" && model == model_.name; }

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
    if (wall->store_force_contact() || wall->store_force_contact_stress() || wall->store_sum_normal_force() ||
        wall->heattransfer_flag())
      error->all(FLERR, "fix wall/gran model concordem/... does not support stored contact forces, sums of normal forces, or heat "
                        "transfer; remove that setting");
    ConcordemWallContact contact;
    contact.kind = atom->type[i];
    contact.wall_kind = wall->atom_type_wall();
    contact.radius = data.radi;
    contact.mass = wall->fix_rigid() && wall->body(i) >= 0 ? wall->masstotal(wall->body(i)) : atom->rmass[i];
    contact.distance = data.radi - data.deltan;
    contact.dt = wall->shearupdate() && wall->computeflag() ? update->dt : 0.0;
    for (int axis = 0; axis < 3; axis++) {
      contact.normal[axis] = -data.delta[axis] / contact.distance;
      contact.position[axis] = atom->x[i][axis];
      contact.velocity[axis] = atom->v[i][axis];
      contact.angular_velocity[axis] = atom->omega[i][axis];
      contact.wall_velocity[axis] = wall_velocity[axis];
    }
    const bool local = wall->compute_wall_gran_local() && wall->addflag();
    if (local) {
      double point[3];
      for (int axis = 0; axis < 3; axis++) point[axis] = atom->x[i][axis] - data.delta[axis];
      wall->compute_wall_gran_local()->add_wall_1(mesh_number, mesh ? mesh->id(triangle) : 0, i, point, wall_velocity);
    }
    double wrench[6];
    if (concordem_pair_wall(law_, &contact, history, width_, wrench, &message_) < 0) error->one(FLERR, text_);
    if (wall->computeflag())
      for (int axis = 0; axis < 3; axis++) {
        atom->f[i][axis] += wrench[axis];
        atom->torque[i][axis] += wrench[3 + axis];
      }
    if (local)
      wall->compute_wall_gran_local()->add_wall_2(i, wrench[0], wrench[1], wrench[2], wrench[3], wrench[4], wrench[5],
                                                  data.contact_history, contact.distance * contact.distance, contact.normal);
    if (wall->store_force())
      for (int axis = 0; axis < 3; axis++) wall->fix_wallforce()->array_atom[i][axis] += wrench[axis];
    if (mesh_fix) {
      double to_wall[3];
      for (int axis = 0; axis < 3; axis++) to_wall[axis] = -data.delta[axis];
      mesh_fix->add_particle_contribution(i, wrench, to_wall, triangle, wall_velocity);
    }
  }
};

Walls::IGranularWall *new_wall(LAMMPS *lmp, FixWallGran *parent, int64_t hash)
{
  return new ConcordemWall(lmp, parent, hash);
}

struct Registration {
  Registration()
  {
    for (const ConcordemPairModel &model : models()) {
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
  return index_of(pair->hashcode()) >= 0;
}

}
