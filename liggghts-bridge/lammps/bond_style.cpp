/* Bond styles, see bond_style.h. The atoms' lists say which bonds there are; a fix of ours keeps what the laws remember of them.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "bond_style.h"

#include <cstring>

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "force.h"
#include "memory.h"
#include "modify.h"
#include "utils.h"

#include "fix_bond.h"

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
}

void BondConcordem::compute(int eflag, int vflag)
{
  ev_init(eflag, vflag);
  if (eflag_atom)
    error->all(FLERR, "Bond style concordem/{} does not share out energies to atoms; use the energies of fix {}", law_, FIX);
  fix_->find_forces(eflag_global, vflag_either);
  if (eflag_global) energy = fix_->stored_energy();
  if (vflag_global || vflag_atom) {
    double total[6] = {0.0};
    concordem_network_virial(fix_->network(), total, vflag_atom ? vatom[0] : nullptr, vflag_atom ? atom->nlocal : 0);
    if (vflag_global)
      for (int k = 0; k < 6; k++) virial[k] += total[k];
  }
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

void BondConcordem::write(FILE *fp, const std::vector<std::string> &words) const
{
  std::string text;
  for (const std::string &word : words) text.append(word).push_back('\0');
  const int size = text.size();
  fwrite(&size, sizeof(int), 1, fp);
  fwrite(text.data(), 1, size, fp);
}

std::vector<std::string> BondConcordem::read(FILE *fp) const
{
  int size = 0;
  if (comm->me == 0) utils::sfread(FLERR, &size, sizeof(int), 1, fp, nullptr, error);
  MPI_Bcast(&size, 1, MPI_INT, 0, world);
  std::string text(size, '\0');
  if (comm->me == 0) utils::sfread(FLERR, &text[0], 1, size, fp, nullptr, error);
  MPI_Bcast(&text[0], size, MPI_CHAR, 0, world);
  std::vector<std::string> words;
  for (size_t at = 0; at < text.size(); at += words.back().size() + 1) words.emplace_back(text.c_str() + at);
  return words;
}

// Settings go here, too: LAMMPS asks only some bond styles for theirs.
void BondConcordem::write_restart(FILE *fp)
{
  write(fp, settings_);
  write(fp, parameters_);
}

void BondConcordem::read_restart(FILE *fp)
{
  allocate();
  settings_ = read(fp);
  parameters_ = read(fp);
  for (int type = 1; type <= atom->nbondtypes; type++) setflag[type] = 1;
}
