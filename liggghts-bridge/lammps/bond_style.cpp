/* Bond styles, see bond_style.h. The atoms' lists define the bonds; our fix stores their history.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "bond_style.h"

#include <algorithm>

#include "atom.h"
#include "error.h"
#include "force.h"
#include "memory.h"
#include "utils.h"

#include "pair_style.h"

using namespace LAMMPS_NS;

BondConcordem::BondConcordem(LAMMPS *lmp, const char *law) : Bond(lmp), style_(lmp, "Bond", law, "concordem_bonds", "bond_style")
{
  partial_flag = 1;   // bonds can break
  writedata = 0;
}

BondConcordem::~BondConcordem()
{
  if (allocated) memory->destroy(setflag);
}

void BondConcordem::settings(int narg, char **arg)
{
  style_.settings.assign(arg, arg + narg);
  for (const std::string &word : style_.settings)
    if (word == "bond" || word == "between" || word == "limit" || word == "at")
      error->all(FLERR, "{}: bonds come from the atoms (create_bonds, read_data); remove `{}`", style_.name, word);
}

void BondConcordem::allocate()
{
  allocated = 1;
  memory->create(setflag, atom->nbondtypes + 1, "bond:setflag");
  for (int type = 1; type <= atom->nbondtypes; type++) setflag[type] = 0;
}

void BondConcordem::coeff(int narg, char **arg)
{
  if (has_fix())
    error->all(FLERR, "{}: bond_coeff can be given only once; to change parameters, repeat `bond_style` first", style_.name);
  if (!allocated) allocate();
  int low, high;
  utils::bounds(FLERR, arg[0], 1, atom->nbondtypes, low, high, error);
  for (int type = low; type <= high; type++) setflag[type] = 1;
  if (low == 1 && high == atom->nbondtypes) {
    style_.parameters.assign(arg + 1, arg + narg);
  } else {
    // By bond type: each key has the type as a prefix.
    for (int type = low; type <= high; type++) {
      by_type_[type].clear();
      for (int k = 1; k < narg; k++) by_type_[type].push_back((k % 2 ? std::to_string(type) + "." : "") + arg[k]);
    }
    if (static_cast<int>(by_type_.size()) < atom->nbondtypes) return;
    style_.parameters.clear();
    for (const auto &of_type : by_type_)
      style_.parameters.insert(style_.parameters.end(), of_type.second.begin(), of_type.second.end());
  }
  add_fix();
}

// Called as early as possible, so that the script can use the fix's output.
void BondConcordem::add_fix()
{
  contact_words_ = contact_words();
  if (!contact_words_.empty() &&
      std::find(style_.settings.begin(), style_.settings.end(), "contact") != style_.settings.end())
    error->all(FLERR, "{}: the pair style defines the contacts; remove `contact`", style_.name);
  std::vector<std::string> more = {"bond", "none"};
  more.insert(more.end(), contact_words_.begin(), contact_words_.end());
  style_.add_fix(style_.law, true, more);
}

// Arguments that our pair style, if there is one, adds to the fix.
std::vector<std::string> BondConcordem::contact_words() const
{
  const PairConcordem *contacts = dynamic_cast<PairConcordem *>(force->pair);
  return contacts ? contacts->words_beside_bonds() : std::vector<std::string>();
}

void BondConcordem::init_style()
{
  if (force->newton_bond)
    error->all(FLERR, "{} needs every bond stored with both of its atoms; put `newton on off` or `newton off` before the "
                      "creation of the simulation box", style_.name);
  if (atom->molecular != Atom::MOLECULAR)
    error->all(FLERR, "{} needs atoms with bond lists; use `atom_style bpm/sphere`", style_.name);
  if (utils::strmatch(force->bond_style, "^hybrid"))
    error->all(FLERR, "{} does not support bond_style hybrid. For parameters by bond type, use it alone, with one `bond_coeff` per type. "
                      "Beside bonds of LAMMPS, keep their bond style, and use `fix ID GROUP concordem/bond {} ...` for the bonds of a "
                      "group", style_.name, style_.law);
  // Parameters may come from a restart file.
  if (has_fix()) style_.find_fix();
  else add_fix();
  if (!has_contacts())
    error->all(FLERR, "{}: the pair style changed after bond_coeff; repeat `bond_style` and `bond_coeff`", style_.name);
}

void BondConcordem::compute(int eflag, int vflag)
{
  ev_init(eflag, vflag);
  energy = style_.find_forces(eflag_global, eflag_atom, vflag_either, vflag_global, virial, vflag_atom, vatom);
}

// LAMMPS uses this to estimate the ghost cutoff; our fix sets the cutoff itself.
double BondConcordem::equilibrium_distance(int)
{
  return 0.0;
}

double BondConcordem::single(int, double, int, int, double &)
{
  error->all(FLERR, "{} cannot evaluate a single bond, because its bonds have a history; use compute concordem/bond/local {}",
             style_.name, style_.fix_id);
}

/* --------------------------------------------------------------------------------------------------------- restart */

// Includes the settings, because LAMMPS calls write_restart_settings for some bond styles only.
void BondConcordem::write_restart(FILE *fp)
{
  style_.write_restart(fp);
}

void BondConcordem::read_restart(FILE *fp)
{
  allocate();
  style_.read_restart(fp);
  for (int type = 1; type <= atom->nbondtypes; type++) setflag[type] = 1;
}
