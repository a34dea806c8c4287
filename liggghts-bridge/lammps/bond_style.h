/* bond_style concordem/cohesive_beam, concordem/cpm, concordem/linear_bond: the atoms' own bonds by ConcorDEM's laws.

   SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef CONCORDEM_LAMMPS_BOND_STYLE_H
#define CONCORDEM_LAMMPS_BOND_STYLE_H

#include "bond.h"

#include <string>
#include <vector>

namespace LAMMPS_NS {

class FixConcordemBond;

class BondConcordem : public Bond {
 public:
  BondConcordem(LAMMPS *, const char *law);
  ~BondConcordem() override;
  void settings(int, char **) override;
  void coeff(int, char **) override;
  void init_style() override;
  void compute(int, int) override;
  double equilibrium_distance(int) override;
  void write_restart(FILE *) override;
  void read_restart(FILE *) override;
  double single(int, double, int, int, double &) override;
  bool has_fix() const { return fix_ != nullptr; }

 private:
  std::string law_;
  std::vector<std::string> settings_, parameters_;
  FixConcordemBond *fix_ = nullptr;   // keeps the bonds
  bool with_pair_style_ = false;      // whether it keeps the contacts of a pair style of ours, too

  void allocate();
  void add_fix();
};

}

#endif
