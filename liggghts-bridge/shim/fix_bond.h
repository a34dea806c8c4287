/* fix concordem/bond: bonds and contacts of ConcorDEM's laws between the atoms of a group.

   SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef CONCORDEM_FIX_BOND_H
#define CONCORDEM_FIX_BOND_H

#include "fix.h"

#include <string>

#include "abi.h"

namespace LAMMPS_NS {

class FixConcordemBond : public Fix {
 public:
  FixConcordemBond(LAMMPS *, int, char **);
  ~FixConcordemBond();

  int setmask();
  void init();
  void setup_pre_exchange();
  void pre_exchange();
  void setup_pre_force(int);
  void pre_force(int);
  void pre_delete(bool unfix);

  void grow_arrays(int);
  void copy_arrays(int, int, int);
  void set_arrays(int);
  int pack_exchange(int, double *);
  int unpack_exchange(int, double *);
  int pack_comm(int, int *, double *, int, int *);
  void unpack_comm(int, int, double *);

  void write_restart(FILE *);
  void restart(char *);
  int pack_restart(int, double *);
  void unpack_restart(int, int);
  int size_restart(int);
  int maxsize_restart();

  // Copies of neighbours are needed as far as bonds reach, not as far as surfaces do.
  bool use_rad_for_cut_neigh_and_ghost() { return false; }

  double compute_scalar();
  double compute_vector(int);
  double memory_usage();

  const ConcordemNetwork *network() const { return network_; }

 private:
  ConcordemNetwork *network_;
  ConcordemFacts facts_;
  std::string law_;
  double **memory_;     // what the network remembers of every atom
  double **original_;   // positions of the originals of copies, in periodic boxes
  bool periodic_;
  bool made_;           // whether the bonds to be made have been made
  int maxexchange;      // our share of the communication buffer; LAMMPS' class Fix has such a member itself
  double reach_;        // distance up to which copies of neighbours must be known
  char text_[2048];
  ConcordemMessage message_;
  double sums_[CONCORDEM_SUMS];
  bigint summed_at_, sampled_at_;

  bool creation_is_due() const;
  void fail(const std::string &);
  void fail_on_this_processor();
  void communicate();
  ConcordemAtoms arrays();
  void rebuild();
  void make_bonds();
  double longest_listed();
  void find_forces(bool setup, int vflag);
  void update_sums();
};

}

#endif
