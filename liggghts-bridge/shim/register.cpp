/* Registers our styles in a running LIGGGHTS.

   Every LIGGGHTS instance fills maps with its styles when it is created and after the command `clear`. This library is loaded
   before LIGGGHTS (LD_PRELOAD, or as the first library with RTLD_GLOBAL) and overrides the functions that look up styles: the
   overrides add our styles to the maps, then call the original functions.

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
#include "fix_bond_vtk.h"

using namespace LAMMPS_NS;

namespace {

// The version this library was built against; other versions have other class layouts.
const char *const VERSION = "Version LIGGGHTS-PUBLIC 3.8.0,";

template <typename Style> Fix *new_fix(LAMMPS *lmp, int narg, char **arg)
{
  // The class layout of the headers must match that of the program.
  if (lammps_extract_atom(lmp, const_cast<char *>("x")) != lmp->atom->x ||
      lammps_extract_atom(lmp, const_cast<char *>("radius")) != lmp->atom->radius) {
    fprintf(stderr, "ERROR: concordem-liggghts was built against headers that do not match this LIGGGHTS; rebuild it\n");
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
          "ERROR: concordem-liggghts was built for \"%s\", but this program is \"%s\"; install the Debian packages "
          "liggghts and libliggghts-dev 3.8.0 and rebuild it\n",
          VERSION, version ? version : "unknown");
  MPI_Abort(lmp->world, 1);
}

// The function of the same name in LIGGGHTS itself.
template <typename Function> Function original(const char *symbol)
{
  void *found = dlsym(RTLD_NEXT, symbol);
  if (!found) {
    fprintf(stderr, "ERROR: concordem-liggghts: this program has no symbol %s; use LIGGGHTS 3.8.0\n", symbol);
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
    (*fix_map)["concordem/bond/vtk"] = &new_fix<FixConcordemBondVtk>;
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
    (*compute_map)["concordem/broken/local"] = &new_compute<ComputeConcordemBrokenLocal>;
    (*compute_map)["concordem/stress/atom"] = &new_compute<ComputeConcordemStressAtom>;
    (*compute_map)["concordem/couple"] = &new_compute<ComputeConcordemCouple>;
  }
  static void (*const next)(Modify *, int, char **, char *) =
      original<void (*)(Modify *, int, char **, char *)>("_ZN9LAMMPS_NS6Modify11add_computeEiPPcS1_");
  next(this, narg, arg, suffix);
}

}
