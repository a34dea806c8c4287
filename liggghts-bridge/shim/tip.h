/* LIGGGHTS-PUBLIC prints a tip of the day after two of ten errors, from memory that it has freed: garbage.

   SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef CONCORDEM_TIP_H
#define CONCORDEM_TIP_H

#include "universe.h"

namespace LAMMPS_NS {

// To be called before an error, which ends the program. LIGGGHTS gives tips if its version contains PUBLIC.
inline void concordem_leave_out_tip(Universe *universe)
{
#ifdef CONCORDEM_LAMMPS
  (void)universe;
#else
  static char none[] = "";
  universe->version = none;
#endif
}

}

#endif
