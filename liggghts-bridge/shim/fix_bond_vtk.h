/* fix concordem/bond/vtk for LIGGGHTS and LAMMPS: every N steps, a file for ParaView with a line per bond and contact of a fix concordem/bond.

   SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef CONCORDEM_FIX_BOND_VTK_H
#define CONCORDEM_FIX_BOND_VTK_H

#include "fix.h"

#include <stdio.h>

#include <string>
#include <vector>

namespace LAMMPS_NS {

class FixConcordemBond;

class FixConcordemBondVtk : public Fix {
 public:
  FixConcordemBondVtk(LAMMPS *, int, char **);

  int setmask() override;
  void init() override;
  void setup(int) override;
  void end_of_step() override;

 private:
  FixConcordemBond *bonds_ = nullptr;
  std::string bonds_id_, file_;
  bigint written_at_ = -1;   // step of the last file; -1 before

  [[noreturn]] void fail(const std::string &);      // on all processors
  [[noreturn]] void fail_to(const char *verb, const std::string &file);   // on the first processor
  void write();
  void write_arrays(FILE *, const std::vector<int64_t> &counts, const double *lines);
  // Write the numbers of a part of each line, all processors one after the other. `bytes(line, number, out)` appends those of a line.
  template <class Bytes> void write_array(FILE *, const std::vector<int64_t> &counts, const double *lines, int64_t bytes_of_line, Bytes);
};

}

#endif
