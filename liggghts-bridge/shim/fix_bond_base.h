/* The part of fix concordem/bond that does not depend on the host: arguments, data per atom, ghosts, creation of bonds, restart, sums.
   The fixes for LIGGGHTS (fix_bond.h) and for LAMMPS (../lammps/fix_bond.h) derive from it and add when forces are computed and
   where they go.

   SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef CONCORDEM_FIX_BOND_BASE_H
#define CONCORDEM_FIX_BOND_BASE_H

#include "fix.h"

#include <string>

#include "abi.h"

namespace LAMMPS_NS {

class FixBondBase : public Fix {
 public:
  FixBondBase(LAMMPS *, int, char **);
  ~FixBondBase() override;

  void grow_arrays(int) override;
  void copy_arrays(int, int, int) override;
  void set_arrays(int) override;
  int pack_exchange(int, double *) override;
  int unpack_exchange(int, double *) override;

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

 protected:
  ConcordemNetwork *network_ = nullptr;
  ConcordemFacts facts_;
  std::string law_;
  bool periodic_ = false;
  bool lists_ = false;     // bonds are those of the atoms' own lists (LAMMPS)
  bool made_ = false;      // the bonds of the script exist
  double reach_ = 0.0;     // distance up to which ghosts must be known
  char text_[2048];
  ConcordemMessage message_;
  double sums_[CONCORDEM_SUMS];
  bigint summed_at_ = -1, sampled_at_ = -1;
#ifndef CONCORDEM_LAMMPS
  int maxexchange = 0;     // our part of the communication buffer; LAMMPS' class Fix has this member
#endif

  // The host's own: message with the name of the fix, then stop. The second is for a message in text_ that may exist on one processor
  // only. The third and the fourth: print a line, and a warning.
  [[noreturn]] void fail(const std::string &);
  [[noreturn]] void fail_on_this_processor();
  void print(double bonds);
  void warn_no_bonds();
  void communicate_ghosts();

  bool creation_is_due() const;
  // Distance from the longest bond, and the smallest radius. `given`: longest bond of the host's lists.
  void find_reach(double given, double *smallest);
  int exchange_size() const;
  void communicate();
  int pack_ghosts(int count, const int *list, double *buffer) const;
  void unpack_ghosts(int count, int first_atom, const double *buffer);
  ConcordemAtoms arrays();
  void rebuild();
  void make_bonds();
  void find_forces(bool setup, bool energies, bool virial);
  void update_sums();

 private:
  double **memory_ = nullptr;     // what the network stores per atom
  double **original_ = nullptr;   // positions of ghosts before periodic borders shift them, in periodic boxes

  double longest_listed();
  void queue_bonds_of_lists();    // LAMMPS
};

}

#endif
