/* Pair styles, see pair_style.h. Contacts are found, kept, and evaluated by the network behind a fix: by the one of our bond style
   where there is one, so that a bond that breaks goes on as a contact, else by one of our own.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "pair_style.h"

#include <algorithm>

#include "atom.h"
#include "error.h"
#include "force.h"
#include "memory.h"
#include "modify.h"
#include "utils.h"

#include "bond_style.h"
#include "fix_bond.h"
#include "words.h"

using namespace LAMMPS_NS;

static const char *const FIX = "concordem_contacts";

PairConcordem::PairConcordem(LAMMPS *lmp, const char *law) : Pair(lmp), law_(law)
{
  single_enable = 0;
  one_coeff = 1;
  writedata = 0;
  // Forces on copies are never made: virials are tallied.
  no_virial_fdotr_compute = 1;
  centroidstressflag = CENTROID_NOTAVAIL;
}

PairConcordem::~PairConcordem()
{
  // While LAMMPS ends, fixes go first.
  if (fix_ && modify && modify->get_fix_by_id(FIX)) modify->delete_fix(FIX);
  if (allocated) {
    memory->destroy(setflag);
    memory->destroy(cutsq);
  }
}

void PairConcordem::settings(int narg, char **arg)
{
  if (fix_) error->all(FLERR, "Pair style concordem/{}: settings are given once; begin again with `pair_style none`", law_);
  const BondConcordem *bonds = dynamic_cast<BondConcordem *>(force->bond);
  if (bonds && bonds->has_fix())
    error->all(FLERR, "Pair style concordem/{}: put `pair_style` before the `bond_coeff` of a bond style concordem/...", law_);
  settings_.assign(arg, arg + narg);
  take_settings();
}

// `reach` is the cutoff, too.
void PairConcordem::take_settings()
{
  for (size_t k = 0; k < settings_.size(); k++) {
    if (settings_[k] == "bond" || settings_[k] == "at" || settings_[k] == "contact")
      error->all(FLERR, "Pair style concordem/{}: a pair style makes no bonds and is its own law; remove `{}`", law_, settings_[k]);
    if (settings_[k] == "reach" && k + 1 < settings_.size()) reach_ = utils::numeric(FLERR, settings_[k + 1], true, lmp);
  }
}

void PairConcordem::allocate()
{
  allocated = 1;
  const int n = atom->ntypes + 1;
  memory->create(setflag, n, n, "pair:setflag");
  memory->create(cutsq, n, n, "pair:cutsq");
  for (int a = 0; a < n; a++)
    for (int b = 0; b < n; b++) setflag[a][b] = 0;
}

void PairConcordem::coeff(int narg, char **arg)
{
  if (fix_)
    error->all(FLERR, "Pair style concordem/{}: parameters are given once; to change them, begin again with `pair_style none`", law_);
  if (!allocated) allocate();
  // One set for all types, or a file with one for each: LAMMPS wants `* *` (one_coeff).
  parameters_.assign(arg + 2, arg + narg);
  for (int a = 1; a <= atom->ntypes; a++)
    for (int b = a; b <= atom->ntypes; b++) setflag[a][b] = 1;
  // As soon as all is known, so that the script can ask for the fix's output. A bond style, which may come later, asks for our
  // words itself; contacts without parameters of their own go with one.
  const bool alone = !parameters_.empty() || std::find(settings_.begin(), settings_.end(), "materials") != settings_.end();
  if (alone && !dynamic_cast<BondConcordem *>(force->bond)) add_fix();
}

std::vector<std::string> PairConcordem::words_beside_bonds() const
{
  std::vector<std::string> words = {"contact", law_};
  for (size_t k = 0; k < settings_.size(); k += 2) {
    if (settings_[k] != "reach")
      error->all(FLERR, "Pair style concordem/{}: beside a bond style concordem/... give `{}` to `bond_style`, for both", law_,
                 settings_[k]);
    words.insert(words.end(), settings_.begin() + k, settings_.begin() + std::min(k + 2, settings_.size()));
  }
  for (size_t k = 0; k < parameters_.size(); k++) words.push_back((k % 2 ? "" : "contact.") + parameters_[k]);
  return words;
}

void PairConcordem::add_fix()
{
  std::vector<std::string> words = {FIX, "all", "concordem/bond", "none", "contact", law_};
  words.insert(words.end(), settings_.begin(), settings_.end());
  words.insert(words.end(), parameters_.begin(), parameters_.end());
  std::vector<char *> arguments;
  for (std::string &word : words) arguments.push_back(&word[0]);
  fix_ = dynamic_cast<FixConcordemBond *>(modify->add_fix(static_cast<int>(arguments.size()), arguments.data()));
  fix_->serve_pair_style();
}

void PairConcordem::init_style()
{
  if (utils::strmatch(force->pair_style, "^hybrid"))
    error->all(FLERR, "Pair style concordem/{} does not work within pair_style hybrid", law_);
  const bool beside_bonds = dynamic_cast<BondConcordem *>(force->bond) != nullptr;
  if (beside_bonds && fix_) {
    // The bond style came after our coefficients: contacts are its fix's.
    modify->delete_fix(FIX);
    fix_ = nullptr;
  }
  // Parameters may come from a restart file.
  if (!beside_bonds && !fix_) add_fix();
  std::vector<double> mine(atom->ntypes + 1, 0.0);
  if (!atom->radius_flag) error->all(FLERR, "Pair style concordem/{} needs atoms with a radius: use `atom_style sphere`", law_);
  for (int i = 0; i < atom->nlocal; i++) mine[atom->type[i]] = std::max(mine[atom->type[i]], atom->radius[i]);
  largest_.assign(mine.size(), 0.0);
  MPI_Allreduce(mine.data(), largest_.data(), mine.size(), MPI_DOUBLE, MPI_MAX, world);
  // No list is asked for: the network finds contacts among the atoms and copies that are here.
}

// Where atoms can touch; more if the user wants other commands to see farther (create_bonds).
double PairConcordem::init_one(int a, int b)
{
  return std::max(largest_[a] + largest_[b], reach_);
}

void PairConcordem::compute(int eflag, int vflag)
{
  ev_init(eflag, vflag);
  // The bond style asks for the forces of both, and tallies them.
  if (!fix_) return;
  if (eflag_atom)
    error->all(FLERR, "Pair style concordem/{} does not share out energies to atoms; use the energies of fix {}", law_, FIX);
  fix_->find_forces(eflag_global, vflag_either);
  if (eflag_global) eng_vdwl = fix_->stored_energy();
  fix_->add_virial(vflag_global, virial, vflag_atom, vatom);
}

/* --------------------------------------------------------------------------------------------------------- restart */

void PairConcordem::write_restart(FILE *fp)
{
  const ConcordemWords words(lmp);
  words.write(fp, settings_);
  words.write(fp, parameters_);
}

void PairConcordem::read_restart(FILE *fp)
{
  allocate();
  const ConcordemWords words(lmp);
  settings_ = words.read(fp);
  parameters_ = words.read(fp);
  take_settings();
  for (int a = 1; a <= atom->ntypes; a++)
    for (int b = a; b <= atom->ntypes; b++) setflag[a][b] = 1;
}
