/* Makes our styles known to a running LIGGGHTS.

   LIGGGHTS keeps its styles in maps that every instance fills when it is made (and after the command `clear`). This library
   is loaded before LIGGGHTS (LD_PRELOAD, or first of all libraries with RTLD_GLOBAL) and stands in for the functions that
   look styles up: they add ours to the instance's maps and go on as usual.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "atom.h"
#include "lammps.h"
#include "library.h"
#include "modify.h"
#include "universe.h"

#include "computes.h"
#include "fix_bond.h"

using namespace LAMMPS_NS;

namespace {

// What this library was built against; other versions have other class layouts.
const char *const VERSION = "Version LIGGGHTS-PUBLIC 3.8.0,";

template <typename Style> Fix *new_fix(LAMMPS *lmp, int narg, char **arg)
{
  // The layout seen through the headers must be that of the program.
  if (lammps_extract_atom(lmp, const_cast<char *>("x")) != lmp->atom->x ||
      lammps_extract_atom(lmp, const_cast<char *>("radius")) != lmp->atom->radius) {
    fprintf(stderr, "ERROR: concordem-liggghts was built against other headers than this LIGGGHTS; build it again\n");
    MPI_Abort(lmp->world, 1);
  }
  return new Style(lmp, narg, arg);
}

template <typename Style> Compute *new_compute(LAMMPS *lmp, int iarg, int narg, char **arg)
{
  return new Style(lmp, iarg, narg, arg);
}

void check_version(LAMMPS *lmp)
{
  const char *version = lmp->universe->version;
  if (version && strncmp(version, VERSION, strlen(VERSION)) == 0) return;
  fprintf(stderr,
          "ERROR: concordem-liggghts was built for \"%s\", but this program is \"%s\"; install Debian's packages liggghts "
          "and libliggghts-dev 3.8.0 and build it again\n",
          VERSION, version ? version : "unknown");
  MPI_Abort(lmp->world, 1);
}

// The function of the same name in LIGGGHTS itself.
template <typename Function> Function original(const char *symbol)
{
  void *found = dlsym(RTLD_NEXT, symbol);
  if (!found) {
    fprintf(stderr, "ERROR: concordem-liggghts: this program has no %s; it is not the LIGGGHTS 3.8.0 it was built for\n", symbol);
    exit(1);
  }
  return reinterpret_cast<Function>(found);
}

}  // namespace

namespace LAMMPS_NS {

void Modify::add_fix(int narg, char **arg, char *suffix)
{
  if (!fix_map->count("concordem/bond")) {
    check_version(lmp);
    (*fix_map)["concordem/bond"] = &new_fix<FixConcordemBond>;
  }
  static void (*const next)(Modify *, int, char **, char *) =
      original<void (*)(Modify *, int, char **, char *)>("_ZN9LAMMPS_NS6Modify7add_fixEiPPcS1_");
  next(this, narg, arg, suffix);
}

void Modify::add_compute(int narg, char **arg, char *suffix)
{
  if (!compute_map->count("concordem/bond/local")) {
    check_version(lmp);
    (*compute_map)["concordem/bond/local"] = &new_compute<ComputeConcordemBondLocal>;
    (*compute_map)["concordem/stress/atom"] = &new_compute<ComputeConcordemStressAtom>;
    (*compute_map)["concordem/couple"] = &new_compute<ComputeConcordemCouple>;
  }
  static void (*const next)(Modify *, int, char **, char *) =
      original<void (*)(Modify *, int, char **, char *)>("_ZN9LAMMPS_NS6Modify11add_computeEiPPcS1_");
  next(this, narg, arg, suffix);
}

}
