/* Words of a script that a style keeps in restart files.

   SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef CONCORDEM_LAMMPS_WORDS_H
#define CONCORDEM_LAMMPS_WORDS_H

#include <cstdio>

#include <string>
#include <vector>

#include "pointers.h"

namespace LAMMPS_NS {

class ConcordemWords : protected Pointers {
 public:
  ConcordemWords(LAMMPS *lmp) : Pointers(lmp) {}

  // Of one processor.
  void write(FILE *, const std::vector<std::string> &) const;
  // Of all; the file is that of the first one.
  std::vector<std::string> read(FILE *) const;
};

}

#endif
