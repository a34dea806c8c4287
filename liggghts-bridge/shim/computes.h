/* Computes for the bonds and contacts of a fix concordem/bond, for LIGGGHTS and LAMMPS.

   SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef CONCORDEM_COMPUTES_H
#define CONCORDEM_COMPUTES_H

#include "compute.h"

#include <string>

namespace LAMMPS_NS {

class FixConcordemBond;

// Base class. The first argument is the id of the fix. Forces exist only at steps that output commands announce.
class ComputeOfBonds : public Compute {
 public:
  ComputeOfBonds(LAMMPS *, int &iarg, int narg, char **arg);
  ~ComputeOfBonds();
  void init();

 protected:
  FixConcordemBond *fix_;
  int capacity_;
  char text_[2048];

  void fail(const std::string &);
  void fail_on_this_processor();
  double number(const char *key, const char *word);

 private:
  std::string fix_id_;
};

// One row per bond and contact, for `dump local`.
class ComputeConcordemBondLocal : public ComputeOfBonds {
 public:
  ComputeConcordemBondLocal(LAMMPS *, int &iarg, int narg, char **arg);
  ~ComputeConcordemBondLocal();
  void compute_local();
};

// One row per bond that broke since the last output, for `dump local`.
class ComputeConcordemBrokenLocal : public ComputeOfBonds {
 public:
  ComputeConcordemBrokenLocal(LAMMPS *, int &iarg, int narg, char **arg);
  ~ComputeConcordemBrokenLocal();
  void init();
  void compute_local();
};

// Stress per atom, Pa.
class ComputeConcordemStressAtom : public ComputeOfBonds {
 public:
  ComputeConcordemStressAtom(LAMMPS *, int &iarg, int narg, char **arg);
  ~ComputeConcordemStressAtom();
  void compute_peratom();

 private:
  int half_branch_;
  double fraction_;
};

// Couple stress (N/m) and stress (Pa) of the specimen.
class ComputeConcordemCouple : public ComputeOfBonds {
 public:
  ComputeConcordemCouple(LAMMPS *, int &iarg, int narg, char **arg);
  ~ComputeConcordemCouple();
  void compute_vector();

 private:
  double volume_;
  double centroid_[3];
};

}

#endif
