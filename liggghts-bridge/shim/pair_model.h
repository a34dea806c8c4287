/* What the models concordem/... of pair_style gran and fix wall/gran share: the list of models, their parameters, and the pairs that
   fixes concordem/bond take over.

   SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef CONCORDEM_PAIR_MODEL_H
#define CONCORDEM_PAIR_MODEL_H

#include <stdint.h>

#include <string>
#include <vector>

#include "contact_interface.h"
#include "granular_pair_style.h"
#include "granular_wall.h"
#include "pointers.h"

#include "abi.h"

namespace LAMMPS_NS {

class FixConcordemBond;
class FixPropertyGlobal;
class FixWallGran;
class NeighList;
class PairGran;

// All models `concordem/...`.
const std::vector<ConcordemPairModel> &concordem_models();

// Index of the model in LIGGGHTS' model hash, whose lowest six bits are the number of the normal model; −1 if it is not one of ours.
int concordem_model_of(int64_t hash);

// Numbers of LIGGGHTS' models in a model hash.
struct ConcordemHash {
  explicit ConcordemHash(int64_t hash) :
      normal(hash & 63), shear(hash >> 6 & 63), cohesion(hash >> 12 & 63), rolling(hash >> 18 & 63), surface(hash >> 24 & 63)
  {
  }
  int normal, shear, cohesion, rolling, surface;
};

// Whether the model of type `type` ("normal", "tangential", "cohesion", "rolling_friction", "surface") has the name `name`.
bool concordem_model_is(int64_t hash, const std::string &type, const std::string &name);

// A model with its parameters.
class ConcordemModel : protected Pointers {
 public:
  ConcordemModel(LAMMPS *lmp, int64_t hash);
  ~ConcordemModel();

  // Number of reals in the history of a contact.
  int width() const { return width_; }
  const ConcordemPairModel &model() const { return model_; }
  const ConcordemPairLaw *law() const { return law_; }
  const ConcordemMessage *message() const { return &message_; }
  // Whether the model keeps a shear displacement or a history of its own between steps.
  bool has_history() const { return model_.is_law || shear_ == 2; }

  // Add the history of the law; returns the place of its first real. With `hosts_names`, LIGGGHTS' formulas have the names of LIGGGHTS.
  int add_history(LIGGGHTS::IContactHistorySetup *setup, bool hosts_names);
  // Read the properties, and make the law.
  void make_law();
  // End with a message that begins with the name of the model.
  void fail(const char *format, ...) __attribute__((format(printf, 2, 3)));
  // End on this processor with the message of a failed call.
  void fail_with_message();
  // End if the script needs what our models do not support.
  void check(PairGran *pair, bool keeps_history);
  void check(FixWallGran *wall);
  // A particle that overlaps a wall. `data` has the particle, its radius, the overlap, and the vector from the wall.
  ConcordemWallContact wall_contact(FixWallGran *wall, const LIGGGHTS::ContactModels::SurfacesIntersectData &data,
                                    const double *wall_velocity);

 protected:
  const int index_;
  const ConcordemPairModel model_;
  const int shear_;
  ConcordemPairLaw *law_;
  int32_t odd_[64];   // whether each real of the history changes sign when the two atoms are swapped
  const int width_;   // reals of the history
  int offset_;        // the first of them in LIGGGHTS' history of a contact
  char text_[1024];
  ConcordemMessage message_;

  void set(int narg, char **arg, LIGGGHTS::IContactHistorySetup *setup);
  bool reads(uint32_t property) const { return model_.properties & property; }
  FixPropertyGlobal *property(const char *name, const char *kind, int len1, int len2);
  std::vector<double> per_type(const char *name);
  std::vector<double> per_pair(const char *name);
};

// Entries of the neighbor list whose forces a fix concordem/bond computes.
class ConcordemPairsOfFixes : protected Pointers {
 public:
  explicit ConcordemPairsOfFixes(LAMMPS *lmp) : Pointers(lmp) {}

  // 1 for each such entry, in order; NULL if there is no such fix.
  const unsigned char *find(NeighList *list);
  // The same for the pairs of atom `i`.
  const unsigned char *of(int i) const { return &skip_[first_[i]]; }

 private:
  std::vector<FixConcordemBond *> bonds_;
  std::vector<unsigned char> skip_;
  std::vector<size_t> first_;   // first entry of each atom
  int64_t skip_of_ = -1;        // when skip_ was determined
};

// Models of LIGGGHTS for cohesion and rolling friction beside ours (pair_beside.cpp).
LIGGGHTS::PairStyles::IGranularPairStyle *concordem_pair_beside(LAMMPS *, PairGran *, int64_t hash);
LIGGGHTS::Walls::IGranularWall *concordem_wall_beside(LAMMPS *, FixWallGran *, int64_t hash);

}

#endif
