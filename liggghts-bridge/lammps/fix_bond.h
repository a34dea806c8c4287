/* fix concordem/bond in LAMMPS: bonds and contacts of ConcorDEM's laws between the atoms of a group, by its own arguments or on
   behalf of a bond style (bond_style.h).

   SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef CONCORDEM_LAMMPS_FIX_BOND_H
#define CONCORDEM_LAMMPS_FIX_BOND_H

#include "fix.h"

#include <string>

#include "abi.h"

namespace LAMMPS_NS {

class ConcordemStyle;

class FixConcordemBond : public Fix {
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

  void grow_arrays(int) override;
  void copy_arrays(int, int, int) override;
  void set_arrays(int) override;
  int pack_exchange(int, double *) override;
  int unpack_exchange(int, double *) override;
  int pack_forward_comm(int, int *, double *, int, int *) override;
  void unpack_forward_comm(int, int, double *) override;

  void write_restart(FILE *) override;
  void restart(char *) override;
  int pack_restart(int, double *) override;
  void unpack_restart(int, int) override;
  int size_restart(int) override;
  int maxsize_restart() override;

  double compute_scalar() override;
  double compute_vector(int) override;
  double memory_usage() override;

  const ConcordemNetwork *network() const { return network_; }

  // For the styles: from now on this one asks for the forces. `lists`: bonds are those of the atoms' own lists.
  void serve(const ConcordemStyle *, bool lists);
  bool serves(const ConcordemStyle *style) const { return style_ == style; }
  void find_forces(bool energies, bool virial);
  double stored_energy() const;
  double touching();   // contacts without a bond that touch, on all processors
  // Virial of the forces just found, added to the sum and to owned atoms', where wanted.
  void add_virial(int global, double *virial, int per_atom, double **vatom) const;

 private:
  ConcordemNetwork *network_ = nullptr;
  ConcordemFacts facts_;
  std::string law_;
  double **memory_ = nullptr;     // what the network remembers of every atom
  double **original_ = nullptr;   // positions of the originals of copies, in periodic boxes
  bool periodic_ = false;
  const ConcordemStyle *style_ = nullptr;   // asks for the forces
  bool lists_ = false;            // whether bonds are those of the atoms' own lists
  bool made_ = false;             // whether the bonds to be made have been made
  bool setup_ = false;            // whether forces are asked for while a run is set up
  double reach_ = 0.0;            // distance up to which copies of neighbours must be known
  char text_[2048];
  ConcordemMessage message_;
  double sums_[CONCORDEM_SUMS];
  bigint summed_at_ = -1, sampled_at_ = -1;

  bool creation_is_due() const;
  [[noreturn]] void fail(const std::string &);
  [[noreturn]] void fail_on_this_processor();
  void communicate();
  ConcordemAtoms arrays();
  void rebuild();
  void make_bonds();
  double longest_listed();
  double longest_given();
  void take_broken_off_lists();
  void compare_with_lists();
  void update_sums();
};

}

#endif
