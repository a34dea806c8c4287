/* fix concordem/bond for LAMMPS: bonds and contacts of ConcorDEM's laws between the atoms of a group, by its own arguments or on
   behalf of a bond or pair style (style.h).

   SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef CONCORDEM_LAMMPS_FIX_BOND_H
#define CONCORDEM_LAMMPS_FIX_BOND_H

#include "fix_bond_base.h"

namespace LAMMPS_NS {

class ConcordemStyle;

class FixConcordemBond : public FixBondBase {
 public:
  FixConcordemBond(LAMMPS *, int, char **);
  ~FixConcordemBond() override;

  int setmask() override;
  void init() override;
  void setup_pre_exchange() override;
  void pre_exchange() override;
  void setup_pre_force(int) override;
  void pre_force(int) override;
  void setup(int) override;
  void post_force(int) override;

  int pack_forward_comm(int, int *, double *, int, int *) override;
  void unpack_forward_comm(int, int, double *) override;

  // For the styles: this one asks for the forces from now on. `lists`: bonds are those of the atoms' own lists.
  void serve(const ConcordemStyle *, bool lists);
  bool serves(const ConcordemStyle *style) const { return style_ == style; }
  void find_forces(bool energies, bool virial);
  double stored_energy() const;
  double touching();   // contacts without a bond that touch, on all processors
  // Add the virial of the last forces to the sum and to that of owned atoms, where wanted.
  void add_virial(int global, double *virial, int per_atom, double **vatom) const;

 private:
  const ConcordemStyle *style_ = nullptr;   // asks for the forces
  bool setup_ = false;                      // a run is being set up

  double longest_given();
  void remove_broken_from_lists();
  void compare_with_lists();
};

}

#endif
