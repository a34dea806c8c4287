/* Bond styles, see bond_style.h. The atoms' lists say which bonds there are; a fix of ours keeps what the laws remember of them.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "bond_style.h"

#include <algorithm>

#include "atom.h"
#include "error.h"
#include "force.h"
#include "memory.h"
#include "modify.h"
#include "utils.h"

#include "fix_bond.h"
#include "pair_style.h"
#include "words.h"

using namespace LAMMPS_NS;

static const char *const FIX = "concordem_bonds";

BondConcordem::BondConcordem(LAMMPS *lmp, const char *law) : Bond(lmp), law_(law)
{
  // Bonds can go.
  partial_flag = 1;
  writedata = 0;
}

BondConcordem::~BondConcordem()
{
  // While LAMMPS ends, fixes go first.
  if (fix_ && modify && modify->get_fix_by_id(FIX)) modify->delete_fix(FIX);
  if (allocated) memory->destroy(setflag);
}

void BondConcordem::settings(int narg, char **arg)
{
  settings_.assign(arg, arg + narg);
  for (const std::string &word : settings_)
    if (word == "bond" || word == "at")
      error->all(FLERR, "Bond style concordem/{}: bonds are those of the atoms (create_bonds, read_data); remove `{}`", law_, word);
}

void BondConcordem::allocate()
{
  allocated = 1;
  memory->create(setflag, atom->nbondtypes + 1, "bond:setflag");
  for (int type = 1; type <= atom->nbondtypes; type++) setflag[type] = 0;
}

void BondConcordem::coeff(int narg, char **arg)
{
  if (fix_)
    error->all(FLERR, "Bond style concordem/{}: parameters are given once; to change them, begin again with `bond_style`", law_);
  if (!allocated) allocate();
  int low, high;
  utils::bounds(FLERR, arg[0], 1, atom->nbondtypes, low, high, error);
  if (low != 1 || high != atom->nbondtypes)
    error->all(FLERR,
               "Bond style concordem/{}: parameters belong to atom types, not bond types; write `bond_coeff * KEY VALUE ...`, or "
               "`bond_style concordem/{} materials FILE` and `bond_coeff *`",
               law_, law_);
  parameters_.assign(arg + 1, arg + narg);
  for (int type = low; type <= high; type++) setflag[type] = 1;
  add_fix();
}

// As soon as all is known, so that the script can ask for the fix's output.
void BondConcordem::add_fix()
{
  std::vector<std::string> words = {FIX, "all", "concordem/bond", law_};
  words.insert(words.end(), settings_.begin(), settings_.end());
  words.insert(words.end(), parameters_.begin(), parameters_.end());
  words.insert(words.end(), {"bond", "none"});
  const PairConcordem *contacts = dynamic_cast<PairConcordem *>(force->pair);
  with_pair_style_ = contacts;
  if (contacts) {
    if (std::find(settings_.begin(), settings_.end(), "contact") != settings_.end())
      error->all(FLERR, "Bond style concordem/{}: contacts are those of the pair style; remove `contact`", law_);
    const std::vector<std::string> more = contacts->words_beside_bonds();
    words.insert(words.end(), more.begin(), more.end());
  }
  std::vector<char *> arguments;
  for (std::string &word : words) arguments.push_back(&word[0]);
  fix_ = dynamic_cast<FixConcordemBond *>(modify->add_fix(static_cast<int>(arguments.size()), arguments.data()));
  fix_->serve_bond_style();
}

void BondConcordem::init_style()
{
  if (force->newton_bond)
    error->all(FLERR, "Bond style concordem/{} needs bonds with both of their atoms: put `newton on off` or `newton off` before the "
                      "simulation box is created", law_);
  if (atom->molecular != Atom::MOLECULAR)
    error->all(FLERR, "Bond style concordem/{} needs atoms with bonds of their own: use `atom_style bpm/sphere`", law_);
  if (utils::strmatch(force->bond_style, "^hybrid"))
    error->all(FLERR, "Bond style concordem/{} does not work within bond_style hybrid", law_);
  // Parameters may come from a restart file.
  if (!fix_) add_fix();
  if (with_pair_style_ != (dynamic_cast<PairConcordem *>(force->pair) != nullptr))
    error->all(FLERR, "Bond style concordem/{}: the pair style was changed after bond_coeff; begin again with `bond_style`", law_);
}

void BondConcordem::compute(int eflag, int vflag)
{
  ev_init(eflag, vflag);
  if (eflag_atom)
    error->all(FLERR, "Bond style concordem/{} does not share out energies to atoms; use the energies of fix {}", law_, FIX);
  fix_->find_forces(eflag_global, vflag_either);
  if (eflag_global) energy = fix_->stored_energy();
  fix_->add_virial(vflag_global, virial, vflag_atom, vatom);
}

// An estimate for the distance up to which copies of neighbours are known; the fix sets that distance itself.
double BondConcordem::equilibrium_distance(int)
{
  return 0.0;
}

double BondConcordem::single(int, double, int, int, double &)
{
  error->all(FLERR, "Bond style concordem/{} has bonds with history; use compute concordem/bond/local {}", law_, FIX);
}

/* --------------------------------------------------------------------------------------------------------- restart */

// Settings go here, too: LAMMPS asks only some bond styles for theirs.
void BondConcordem::write_restart(FILE *fp)
{
  const ConcordemWords words(lmp);
  words.write(fp, settings_);
  words.write(fp, parameters_);
}

void BondConcordem::read_restart(FILE *fp)
{
  allocate();
  const ConcordemWords words(lmp);
  settings_ = words.read(fp);
  parameters_ = words.read(fp);
  for (int type = 1; type <= atom->nbondtypes; type++) setflag[type] = 1;
}
