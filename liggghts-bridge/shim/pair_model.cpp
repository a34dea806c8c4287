/* Models concordem/... of pair_style gran and fix wall/gran: parameters and history, see pair_model.h.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include <algorithm>

#include "atom.h"
#include "contact_models.h"
#include "error.h"
#include "fix_property_global.h"
#include "fix_wall_gran.h"
#include "force.h"
#include "modify.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "pair_gran.h"
#include "update.h"

#include "fix_bond.h"
#include "pair_model.h"
#include "tip.h"

using namespace LIGGGHTS;

namespace {

std::vector<ConcordemPairModel> all_models()
{
  std::vector<ConcordemPairModel> models(concordem_pair_model(-1, NULL));
  for (size_t index = 0; index < models.size(); index++) concordem_pair_model(static_cast<int32_t>(index), &models[index]);
  return models;
}

}  // namespace

namespace LAMMPS_NS {

const std::vector<ConcordemPairModel> &concordem_models()
{
  static const std::vector<ConcordemPairModel> all = all_models();
  return all;
}

int concordem_model_of(int64_t hash)
{
  for (size_t index = 0; index < concordem_models().size(); index++)
    if (concordem_models()[index].number == ConcordemHash(hash).normal) return static_cast<int>(index);
  return -1;
}

bool concordem_model_is(int64_t hash, const std::string &type, const std::string &name)
{
  const ConcordemHash is(hash);
  ContactModels::Factory &factory = ContactModels::Factory::instance();
  if (type == "normal") return is.normal == factory.getNormalModelId(name);
  if (type == "tangential") return is.shear == factory.getTangentialModelId(name);
  if (type == "cohesion") return is.cohesion == factory.getCohesionModelId(name);
  if (type == "rolling_friction") return is.rolling == factory.getRollingModelId(name);
  if (type == "surface") return is.surface == factory.getSurfaceModelId(name);
  return false;
}

ConcordemModel::ConcordemModel(LAMMPS *lmp, int64_t hash) :
    Pointers(lmp), index_(concordem_model_of(hash)), model_(concordem_models().at(index_)), shear_(ConcordemHash(hash).shear), law_(NULL),
    width_(concordem_pair_history(index_, odd_, 64)), offset_(0)
{
  message_.text = text_;
  message_.capacity = sizeof(text_);
  text_[0] = 0;
  if (model_.is_law && shear_ != 0) fail("it includes the tangential force; remove `tangential ...`");
  if (ConcordemHash(hash).surface != 0)
    fail("it knows spheres with the default surface only; remove `surface ...`, or use a model of LIGGGHTS, and beside fix concordem/bond "
         "take the pairs of its group out of the neighbor lists: `neigh_modify exclude group GROUP GROUP`");
}

ConcordemModel::~ConcordemModel()
{
  concordem_pair_delete(law_);
}

void ConcordemModel::fail(const char *format, ...)
{
  char text[1200];
  const int begun = snprintf(text, sizeof(text), "model %s: ", model_.name);
  va_list arguments;
  va_start(arguments, format);
  vsnprintf(text + begun, sizeof(text) - begun, format, arguments);
  va_end(arguments);
  concordem_leave_out_tip(universe);
  error->all(FLERR, text);
}

void ConcordemModel::fail_with_message()
{
  concordem_leave_out_tip(universe);
  error->one(FLERR, text_);
}

int ConcordemModel::add_history(IContactHistorySetup *setup, bool hosts_names)
{
  for (int k = 0; k < width_; k++) {
    char name[64];
    if (hosts_names && !model_.is_law)
      snprintf(name, sizeof(name), "shear%c", 'x' + k);
    else
      snprintf(name, sizeof(name), "concordem%d", k);
    const int offset = setup->add_history_value(name, odd_[k] ? "1" : "0");
    if (k == 0) offset_ = offset;
  }
  return offset_;
}

void ConcordemModel::set(int narg, char **arg, IContactHistorySetup *setup)
{
  if (narg > 0) fail("it has no setting `%s`; remove it", arg[0]);
  add_history(setup, false);
}

void ConcordemModel::make_law()
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
    const std::string text = text_;
    fail("%s", text.c_str());
  }
}

FixPropertyGlobal *ConcordemModel::property(const char *name, const char *kind, int len1, int len2)
{
  return static_cast<FixPropertyGlobal *>(
      modify->find_fix_property(name, "property/global", kind, len1, len2, model_.name));
}

std::vector<double> ConcordemModel::per_type(const char *name)
{
  FixPropertyGlobal *fix = property(name, "peratomtype", atom->ntypes, 0);
  std::vector<double> values(atom->ntypes);
  for (int a = 0; a < atom->ntypes; a++) values[a] = fix->compute_vector(a);
  return values;
}

std::vector<double> ConcordemModel::per_pair(const char *name)
{
  const int n = atom->ntypes;
  FixPropertyGlobal *fix = property(name, "peratomtypepair", n, n);
  std::vector<double> values(n * n);
  for (int a = 0; a < n; a++)
    for (int b = 0; b < n; b++) values[a * n + b] = fix->compute_array(a, b);
  return values;
}

void ConcordemModel::check(PairGran *pair, bool keeps_history)
{
  if (pair->storeContactForces() || pair->storeContactForcesStress() || pair->storeSumDelta() || pair->fr_pair())
    fail("it does not support fixes that store contact forces, or rigid bodies; remove them");
  // LIGGGHTS never sets the histories in such lists.
  if (keeps_history && pair->list->listskip)
    fail("in pair_style hybrid with pairs of types that are not its own, LIGGGHTS does not keep histories of contacts; use tangential off and no rolling friction, or "
         "hybrid/overlay with pair_coeff * * gran");
}

void ConcordemModel::check(FixWallGran *wall)
{
  if (wall->store_force_contact() || wall->store_force_contact_stress() || wall->store_sum_normal_force() || wall->heattransfer_flag())
    fail("it does not support stored contact forces of walls, sums of normal forces, or heat transfer; remove that setting");
}

ConcordemWallContact ConcordemModel::wall_contact(FixWallGran *wall, const ContactModels::SurfacesIntersectData &data,
                                                  const double *wall_velocity)
{
  const int i = data.i;
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
  return contact;
}

const unsigned char *ConcordemPairsOfFixes::find(NeighList *list)
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
    first_.clear();
    for (int ii = 0; ii < list->inum; ii++) {
      const int i = list->ilist[ii];
      if (first_.size() <= static_cast<size_t>(i)) first_.resize(i + 1, 0);
      first_[i] = entries;
      entries += list->numneigh[i];
    }
    skip_.assign(std::max<size_t>(entries, 1), 0);
    for (size_t k = 0; k < bonds_.size(); k++) bonds_[k]->mark_pairs(list, skip_);
    skip_of_ = now;
  }
  return &skip_[0];
}

}
