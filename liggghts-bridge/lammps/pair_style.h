/* pair_style concordem/hertz_mindlin, concordem/frictional, concordem/linear_bond, concordem/cpm: unbonded contacts with ConcorDEM
   laws.

   SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef CONCORDEM_LAMMPS_PAIR_STYLE_H
#define CONCORDEM_LAMMPS_PAIR_STYLE_H

#include "pair.h"

#include <string>
#include <vector>

#include "style.h"

namespace LAMMPS_NS {

class PairConcordem : public Pair {
 public:
  PairConcordem(LAMMPS *, const char *law);
  ~PairConcordem() override;
  void settings(int, char **) override;
  void coeff(int, char **) override;
  void init_style() override;
  double init_one(int, int) override;
  void compute(int, int) override;
  void write_restart(FILE *) override;
  void read_restart(FILE *) override;

  // Arguments that define our contacts in the fix of a bond style.
  std::vector<std::string> words_beside_bonds() const;

 private:
  ConcordemStyle style_;              // its fix stores the contacts; there is none if the fix of a bond style does
  double reach_ = 0.0;                // minimum cutoff given by the user, m
  std::vector<double> largest_;       // largest radius of each type, m

  void allocate();
  void take_settings();
  void add_fix();
  void hand_over();
};

}

#endif
