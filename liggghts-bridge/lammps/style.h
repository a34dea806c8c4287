/* Common part of bond styles and pair styles: the arguments of the script, which restart files contain, and our fix, which computes
   the forces and is deleted with the style.

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
  // `kind`: Bond or Pair. `again`: command with which a script can start over.
  ConcordemStyle(LAMMPS *lmp, const char *kind, const std::string &law, const char *fix_id, const char *again);
  ~ConcordemStyle();

  std::vector<std::string> settings, parameters;

  const std::string law;
  const std::string name;   // in messages
  const char *const fix_id;

  // The fix, null if there is none. Another command may have deleted it since find_fix.
  FixConcordemBond *fix() const { return fix_; }
  bool has_fix() const { return fix_ != nullptr; }

  // Create the fix with bond law `bonds`, `more`, the settings, and the parameters. `lists`: bonds come from the atoms' lists.
  void add_fix(const std::string &bonds, bool lists, const std::vector<std::string> &more);
  // Update the pointer to the fix; fails if another command deleted or replaced the fix.
  void find_fix();
  // The current fix; null if it was deleted or replaced.
  FixConcordemBond *present_fix() const;
  void delete_fix();

  // Compute the forces of a step and, as requested, add the virial. Returns the stored energy (J) if `energy`, else 0.
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
