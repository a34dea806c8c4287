/* compute concordem/bond/local, see compute_bond_local.cpp.

   SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef CONCORDEM_COMPUTE_BOND_LOCAL_H
#define CONCORDEM_COMPUTE_BOND_LOCAL_H

#include "compute.h"

#include <stdint.h>

#include <string>

namespace LAMMPS_NS {

class FixConcordemBond;

class ComputeConcordemBondLocal : public Compute {
 public:
  ComputeConcordemBondLocal(LAMMPS *, int &, int, char **);
  ~ComputeConcordemBondLocal();
  void init();
  void compute_local();

 private:
  std::string fix_id_;
  FixConcordemBond *fix_;
  int64_t capacity_;
};

}

#endif
