/* Models of LIGGGHTS for cohesion and rolling friction beside our models of pair_style gran and fix wall/gran.

   LIGGGHTS' own loops (pair_gran_base.h, fix_wall_gran_base.h) call a contact model that consists of five parts. Here, the normal and
   the tangential part are our law; surface, cohesion, and rolling friction are LIGGGHTS' templates, compiled into this library. Without
   cohesion and rolling friction, the faster loop in pair_contact.cpp runs.

   This file is compiled with hidden symbols (../build), so that LIGGGHTS does not use its copies of the templates.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include <string.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "atom.h"
#include "comm.h"
#include "contact_models.h"
#include "error.h"
#include "fix_wall_gran.h"
#include "fix_wall_gran_base.h"
#include "force.h"
#include "modify.h"
#include "neigh_list.h"
#include "pair_gran.h"
#include "update.h"

// For fix insert/stream/predefined, which Debian's LIGGGHTS does not have, libliggghts-dev has a class without this function. Nothing
// calls what replaces it.
#include "fix_insert_stream.h"
#define has_inserted setmask
#include "pair_gran_base.h"
#undef has_inserted

#include "pair_model.h"

using namespace LAMMPS_NS;
using namespace LIGGGHTS;
using namespace LIGGGHTS::ContactModels;

namespace {

CohesionModelBase *new_cohesion(int number, LAMMPS *lmp, IContactHistorySetup *setup, ContactModelBase *contact)
{
  switch (number) {
    case COHESION_SJKR: return new CohesionModel<COHESION_SJKR>(lmp, setup, contact);
    case COHESION_SJKR2: return new CohesionModel<COHESION_SJKR2>(lmp, setup, contact);
    case COHESION_WASHINO_CAPILLARY_VISCOUS: return new CohesionModel<COHESION_WASHINO_CAPILLARY_VISCOUS>(lmp, setup, contact);
    case COHESION_EASO_CAPILLARY_VISCOUS: return new CohesionModel<COHESION_EASO_CAPILLARY_VISCOUS>(lmp, setup, contact);
    default: return new CohesionModel<COHESION_OFF>(lmp, setup, contact);
  }
}

RollingModelBase *new_rolling(int number, LAMMPS *lmp, IContactHistorySetup *setup, ContactModelBase *contact)
{
  switch (number) {
    case ROLLING_CDT: return new RollingModel<ROLLING_CDT>(lmp, setup, contact);
    case ROLLING_EPSD: return new RollingModel<ROLLING_EPSD>(lmp, setup, contact);
    case ROLLING_EPSD2: return new RollingModel<ROLLING_EPSD2>(lmp, setup, contact);
    case ROLLING_EPSD3: return new RollingModel<ROLLING_EPSD3>(lmp, setup, contact);
    default: return new RollingModel<ROLLING_OFF>(lmp, setup, contact);
  }
}

// A contact of LIGGGHTS' loops. Its functions have the names and the order of calls of LIGGGHTS' ContactModel (contact_models.h).
class Contact : public ContactModelBase {
 public:
  // Histories are added in LIGGGHTS' order: normal, cohesion, tangential, rolling.
  Contact(LAMMPS *lmp, IContactHistorySetup *setup, bool is_wall, int64_t hash) :
      ContactModelBase(lmp, is_wall), host_(lmp), hash_(hash), parts_(hash), model_(lmp, hash), of_fixes_(lmp),
      pair_(dynamic_cast<PairGran *>(setup)), wall_(dynamic_cast<FixWallGran *>(setup)), surface_(lmp, setup, this), history_at_(-1), nothing_(),
      reduces_friction_(false), skip_(NULL)
  {
    if (parts_.rolling == LUDING)
      model_.fail("`rolling_friction luding` reads the history of LIGGGHTS' normal model luding; choose cdt, epsd, epsd2, or epsd3");
    // surfacesClose reads v[j], where j is not an atom.
    if (is_wall && parts_.cohesion == COHESION_EASO_CAPILLARY_VISCOUS)
      model_.fail("at a wall, LIGGGHTS' code of `cohesion easo/capillary/viscous` reads the velocity of an atom in place of that of the wall; "
                  "choose washino/capillary/viscous for the wall");
    if (model_.model().is_law) history_at_ = model_.add_history(setup, true);
    cohesion_.reset(new_cohesion(parts_.cohesion, lmp, setup, this));
    if (!model_.model().is_law && model_.has_history()) history_at_ = model_.add_history(setup, true);
    rolling_.reset(new_rolling(parts_.rolling, lmp, setup, this));
  }

  int64_t hashcode() { return hash_; }
  double stressStrainExponent() { return model_.model().hertzian ? 1.5 : 1.0; }
  bool contact_match(const std::string type, const std::string name) { return concordem_model_is(hash_, type, name); }
  void tally_pp(double, int, int, int) {}
  void tally_pw(double, int, int, int) {}

  void registerSettings(Settings &settings)
  {
    cohesion_->registerSettings(settings);
    rolling_->registerSettings(settings);
    // A second target of the setting of the cohesion models.
    if (parts_.cohesion != COHESION_OFF) settings.registerOnOff("tangential_reduce", reduces_friction_, false);
  }

  void postSettings(IContactHistorySetup *setup)
  {
    if (reduces_friction_ && model_.model().is_law)
      model_.fail("its friction limit has no cohesion; remove `tangential_reduce on`, or choose one of LIGGGHTS' formulas");
    surface_.postSettings(setup, this);
    cohesion_->postSettings(setup, this);
    rolling_->postSettings(setup, this);
  }

  void connectToProperties(PropertyRegistry &registry)
  {
    cohesion_->connectToProperties(registry);
    rolling_->connectToProperties(registry);
    model_.make_law();
  }

  void beginPass(SurfacesIntersectData &data, ForceData &on_i, ForceData &on_j)
  {
    // More reals than the model: those of the models beside it.
    model_.check(pair_, model_.has_history() || parts_.rolling != ROLLING_OFF || pair_->dnum() > model_.width());
    skip_ = of_fixes_.find(pair_->list);
    cohesion_->beginPass(data, on_i, on_j);
    rolling_->beginPass(data, on_i, on_j);
  }

  void endPass(SurfacesIntersectData &data, ForceData &on_i, ForceData &on_j)
  {
    rolling_->endPass(data, on_i, on_j);
    cohesion_->endPass(data, on_i, on_j);
  }

  bool checkSurfaceIntersect(SurfacesIntersectData &data)
  {
    return !of_a_fix(data) && surface_.checkSurfaceIntersect(data);
  }

  void surfacesIntersect(SurfacesIntersectData &data, ForceData &on_i, ForceData &on_j)
  {
    surface_.surfacesIntersect(data, on_i, on_j);
    // Cohesion first: with `tangential_reduce on` it adds to the force that limits friction.
    data.Fn = 0.0;
    cohesion_->surfacesIntersect(data, on_i, on_j);
    const bool advance = data.computeflag && data.shearupdate;
    double *const history = history_at_ < 0 ? nothing_ : data.contact_history + history_at_;
    ConcordemSingleResponse response;
    const int64_t done = is_wall() ? at_wall(data, history, &response) : between(data, advance, history, &response);
    if (done < 0) model_.fail_with_message();
    if (data.contact_flags && advance) *data.contact_flags |= CONTACT_NORMAL_MODEL;
    for (int axis = 0; axis < 3; axis++) {
      on_i.delta_F[axis] += response.force[axis];
      on_i.delta_torque[axis] += response.torque[axis];
      on_j.delta_F[axis] -= response.force[axis];
      on_j.delta_torque[axis] += response.torque_of_second[axis];
    }
    data.Fn += response.normal_force;
    data.kn = response.stiffness[0];
    data.kt = response.stiffness[1];
    rolling_->surfacesIntersect(data, on_i, on_j);
  }

  void endSurfacesIntersect(SurfacesIntersectData &data, TriMesh *, ForceData &on_i, ForceData &on_j)
  {
    cohesion_->endSurfacesIntersect(data, on_i, on_j);
  }

  void surfacesClose(SurfacesCloseData &data, ForceData &on_i, ForceData &on_j)
  {
    if (data.contact_flags) *data.contact_flags &= ~CONTACT_NORMAL_MODEL;
    if (history_at_ >= 0) std::fill_n(data.contact_history + history_at_, model_.width(), 0.0);
    if (of_a_fix(data)) return;
    cohesion_->surfacesClose(data, on_i, on_j);
    rolling_->surfacesClose(data, on_i, on_j);
  }

 private:
  static const int LUDING = ROLLING_LUDING;

  LAMMPS *host_;
  const int64_t hash_;
  const ConcordemHash parts_;
  ConcordemModel model_;
  ConcordemPairsOfFixes of_fixes_;
  PairGran *pair_;      // NULL in walls
  FixWallGran *wall_;   // NULL in pair styles
  SurfaceModel<SURFACE_DEFAULT> surface_;
  std::unique_ptr<CohesionModelBase> cohesion_;
  std::unique_ptr<RollingModelBase> rolling_;
  int history_at_;        // −1: the law keeps nothing between steps
  double nothing_[64];    // what the law then gets as its history
  bool reduces_friction_;
  const unsigned char *skip_;   // NULL if no fix concordem/bond computes pairs

  // Whether a fix concordem/bond computes the forces of the pair.
  bool of_a_fix(const SurfacesCloseData &data) const
  {
    if (!skip_) return false;
    const unsigned char *const pairs = of_fixes_.of(data.i);
    if (data.contact_flags) return pairs[data.contact_flags - pair_->listgranhistory->firstneigh[data.i]];
    const int *const neighbors = pair_->list->firstneigh[data.i];
    const int count = pair_->list->numneigh[data.i];
    for (int k = 0; k < count; k++)
      if ((neighbors[k] & NEIGHMASK) == data.j) return pairs[k];
    return false;
  }

  int64_t between(const SurfacesIntersectData &data, bool advance, double *history, ConcordemSingleResponse *response) const
  {
    const Atom *const atom = host_->atom;
    const int frozen = pair_->freeze_group_bit();
    const int of[2] = {data.i, data.j};
    ConcordemSingleContact contact;
    contact.known = data.contact_flags && *data.contact_flags & CONTACT_NORMAL_MODEL;
    contact.advance = advance;
    contact.dt = host_->update->dt;
    contact.radius[0] = data.radi;
    contact.radius[1] = data.radj;
    contact.mass[0] = data.mi;
    contact.mass[1] = data.mj;
    for (int end = 0; end < 2; end++) {
      const int atom_of = of[end];
      contact.kind[end] = atom->type[atom_of];
      if (atom->mask[atom_of] & frozen) contact.mass[end] = CONCORDEM_FROZEN_MASS;
      memcpy(contact.position[end], atom->x[atom_of], sizeof(contact.position[end]));
      memcpy(contact.velocity[end], atom->v[atom_of], sizeof(contact.velocity[end]));
      memcpy(contact.angular_velocity[end], atom->omega[atom_of], sizeof(contact.angular_velocity[end]));
    }
    return concordem_pair_single(model_.law(), &contact, data.Fn, history, model_.width(), response, model_.message());
  }

  int64_t at_wall(const SurfacesIntersectData &data, double *history, ConcordemSingleResponse *response)
  {
    model_.check(wall_);
    const ConcordemWallContact contact = model_.wall_contact(wall_, data, data.v_j);
    return concordem_pair_wall(model_.law(), &contact, data.Fn, history, model_.width(), response, model_.message());
  }
};

}  // namespace

namespace LAMMPS_NS {

PairStyles::IGranularPairStyle *concordem_pair_beside(LAMMPS *lmp, PairGran *parent, int64_t hash)
{
  return new PairStyles::Granular<Contact>(lmp, parent, hash);
}

Walls::IGranularWall *concordem_wall_beside(LAMMPS *lmp, FixWallGran *parent, int64_t hash)
{
  return new Walls::Granular<Contact>(lmp, parent, hash);
}

}
