/* fix concordem/bond for LIGGGHTS: bonds and contacts with ConcorDEM laws between the atoms of a group.

   SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef CONCORDEM_FIX_BOND_H
#define CONCORDEM_FIX_BOND_H

#include <vector>

#include "fix_bond_base.h"

namespace LAMMPS_NS {

class FixConcordemBond : public FixBondBase {
 public:
  FixConcordemBond(LAMMPS *, int, char **);

  int setmask() override;
  void init() override;
  void initial_integrate(int) override;
  void setup_pre_exchange() override;
  void pre_exchange() override;
  void setup_pre_force(int) override;
  void pre_force(int) override;
  void pre_delete(bool unfix) override;

  int pack_comm(int, int *, double *, int, int *) override;
  void unpack_comm(int, int, double *) override;

  // Set `marks` (one per entry of the list, in order) to 1 for the pairs whose forces this fix computes.
  void mark_pairs(class NeighList *, std::vector<unsigned char> &marks);
  // A number that increases whenever these pairs change.
  int64_t generation() const { return concordem_network_generation(network_); }

  // Ghosts must cover the length of bonds, not the distance of touching surfaces.
  bool use_rad_for_cut_neigh_and_ghost() override { return false; }

 private:
  void find_forces_and_virial(bool setup, int vflag);
  void reserve_exchange();
  int64_t own_pairs(class NeighList *, unsigned char *marks, int64_t capacity, int64_t *first);
  void check_pair_style();
  void check_clumps();
  void number_clumps();
  void bond_clumps();   // after rebuild(); collective
};

}

#endif
