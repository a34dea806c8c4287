/* fix concordem/bond for LAMMPS: bonds and contacts with ConcorDEM laws between the atoms of a group. It is created by the user's
   script, or by a bond or pair style (style.h).

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
  void initial_integrate(int) override;
  void setup_pre_exchange() override;
  void pre_exchange() override;
  void setup_pre_force(int) override;
  void pre_force(int) override;
  void setup_pre_reverse(int, int) override;
  void pre_reverse(int, int) override;

  int pack_forward_comm(int, int *, double *, int, int *) override;
  void unpack_forward_comm(int, int, double *) override;

  // For bond and pair styles: from now on, `style` calls find_forces. `lists`: bonds come from the atoms' lists.
  void serve(const ConcordemStyle *, bool lists);
  bool serves(const ConcordemStyle *style) const { return style_ == style; }
  void find_forces(bool energies, bool virial);
  double stored_energy() const;
  double touching();   // number of unbonded contacts that touch, on all processors
  // Add the virial of the last forces to `virial` if `global`, and to that of owned atoms if `per_atom`.
  void add_virial(int global, double *virial, int per_atom, double **vatom);

 private:
  const ConcordemStyle *style_ = nullptr;   // calls find_forces; null if the fix does so itself
  bool setup_ = false;                      // during the setup of a run
  bool last_break_ = false;                 // a bond that breaks ends the run
  bool due_ = false;                        // the forces of this step have not been asked for
  bigint stepped_at_ = -1;                  // the last step whose forces were asked for; -1 before

  double longest_given();
  void remove_broken_from_lists();
  void free_broken_pairs(const int64_t (*pairs)[2], int64_t count);
  void check_fixes();
  void begin_forces();
  void check_special_bonds();
  std::string special_bonds_text() const;
  void check_pair_style();
  void check_pairs_of(const class Pair *, const char *family);
  void make_added();
};

}

#endif
