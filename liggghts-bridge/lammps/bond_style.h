/* bond_style concordem/cohesive_beam, concordem/cpm, concordem/linear_bond: the atoms' bonds with ConcorDEM laws.

   SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef CONCORDEM_LAMMPS_BOND_STYLE_H
#define CONCORDEM_LAMMPS_BOND_STYLE_H

#include "bond.h"

#include <map>
#include <string>
#include <vector>

#include "style.h"

namespace LAMMPS_NS {

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
  bool has_fix() const { return style_.has_fix(); }
  // Whether the contacts of the fix match the current pair style.
  bool has_contacts() const { return contact_words_ == contact_words(); }

 private:
  ConcordemStyle style_;                       // its fix stores the bonds
  std::map<int, std::vector<std::string>> by_type_;   // parameters of the bond types given so far, if not all at once
  std::vector<std::string> contact_words_;     // arguments from our pair style when the fix was created

  void allocate();
  void add_fix();
  std::vector<std::string> contact_words() const;
};

}

#endif
