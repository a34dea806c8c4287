/* What the bond styles and the pair styles have in common: words of the script, kept in restart files, and a fix of ours that does
   the work and goes with the style.

   SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef CONCORDEM_LAMMPS_STYLE_H
#define CONCORDEM_LAMMPS_STYLE_H

#include <cstdio>

#include <string>
#include <vector>

#include "pointers.h"

namespace LAMMPS_NS {

class FixConcordemBond;

class ConcordemStyle : protected Pointers {
 public:
  // `kind` is Bond or Pair, `again` the command by which the script can begin anew.
  ConcordemStyle(LAMMPS *lmp, const char *kind, const std::string &law, const char *fix_id, const char *again);
  ~ConcordemStyle();

  std::vector<std::string> settings, parameters;

  const std::string law;
  const std::string name;   // in messages
  const char *const fix_id;

  // The fix, null if there is none. It may be gone since it was last looked for.
  FixConcordemBond *fix() const { return fix_; }
  bool has_fix() const { return fix_ != nullptr; }

  // Of the law `bonds`, with the settings, the parameters, and `more`. `lists`: its bonds are those of the atoms' own lists.
  void add_fix(const std::string &bonds, bool lists, const std::vector<std::string> &more);
  // Fails if the fix was taken away or replaced by another command.
  void find_fix();
  // The fix as it is now; null if it is not ours any more.
  FixConcordemBond *present_fix() const;
  void delete_fix();

  // Forces of a step, with their virial where wanted; the energy stored if `energy`.
  double find_forces(bool energy, bool energy_of_atoms, int virial, int global, double *sum, int of_atoms, double **per_atom);

  void write_restart(FILE *) const;
  void read_restart(FILE *);

 private:
  const char *const again_;
  FixConcordemBond *fix_ = nullptr;

  void write(FILE *, const std::vector<std::string> &) const;
  std::vector<std::string> read(FILE *) const;
};

}

#endif
