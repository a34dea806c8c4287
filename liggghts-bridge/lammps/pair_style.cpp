/* Pair styles, see pair_style.h. A fix finds, stores, and evaluates the contacts: the fix of our bond style if there is one, so that a
   broken bond continues as a contact, else our own.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "pair_style.h"

#include <algorithm>

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "force.h"
#include "memory.h"
#include "utils.h"

#include "bond_style.h"
#include "fix_bond.h"

using namespace LAMMPS_NS;

PairConcordem::PairConcordem(LAMMPS *lmp, const char *law) :
    Pair(lmp), style_(lmp, "Pair", law, "concordem_contacts", "pair_style none")
{
  single_enable = 0;
  one_coeff = 1;
  writedata = 0;
  // Virials are tallied, because there are no forces on ghosts.
  no_virial_fdotr_compute = 1;
  centroidstressflag = CENTROID_NOTAVAIL;
}

PairConcordem::~PairConcordem()
{
  if (allocated) {
    memory->destroy(setflag);
    memory->destroy(cutsq);
  }
}

void PairConcordem::settings(int narg, char **arg)
{
  if (style_.has_fix()) error->all(FLERR, "{}: settings can be given only once; to change them, use `pair_style none` first", style_.name);
  const BondConcordem *bonds = dynamic_cast<BondConcordem *>(force->bond);
  if (bonds && bonds->has_fix())
    error->all(FLERR, "{}: put `pair_style` before the `bond_coeff` of a bond style concordem/...", style_.name);
  style_.settings.assign(arg, arg + narg);
  take_settings();
}

// `reach` is also the cutoff.
void PairConcordem::take_settings()
{
  const std::vector<std::string> &words = style_.settings;
  for (size_t k = 0; k < words.size(); k++) {
    if (words[k] == "bond" || words[k] == "between" || words[k] == "limit" || words[k] == "at" || words[k] == "contact")
      error->all(FLERR, "{}: a pair style creates no bonds and defines its own law; remove `{}`", style_.name, words[k]);
    if (words[k] == "reach" && k + 1 < words.size()) reach_ = utils::numeric(FLERR, words[k + 1], true, lmp);
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
  if (style_.has_fix())
    error->all(FLERR, "{}: pair_coeff can be given only once; to change parameters, use `pair_style none` first", style_.name);
  if (!allocated) allocate();
  // Parameters hold for all types, or come from a file with one table per type; one_coeff makes LAMMPS require `* *`.
  style_.parameters.assign(arg + 2, arg + narg);
  for (int a = 1; a <= atom->ntypes; a++)
    for (int b = a; b <= atom->ntypes; b++) setflag[a][b] = 1;
  const BondConcordem *bonds = dynamic_cast<BondConcordem *>(force->bond);
  if (bonds && bonds->has_fix() && !bonds->has_contacts())
    error->all(FLERR, "{}: put `pair_coeff` before the `bond_coeff` of a bond style concordem/...",
               style_.name);
  // As early as possible, so that the script can use the fix's output. A bond style calls words_beside_bonds instead, possibly later;
  // contacts without parameters of their own imply one.
  const std::vector<std::string> &words = style_.settings;
  const bool alone = !style_.parameters.empty() || std::find(words.begin(), words.end(), "materials") != words.end();
  if (alone && !bonds) add_fix();
}

std::vector<std::string> PairConcordem::words_beside_bonds() const
{
  const std::vector<std::string> &settings = style_.settings, &parameters = style_.parameters;
  std::vector<std::string> words = {"contact", style_.law};
  for (size_t k = 0; k < settings.size(); k += 2) {
    if (settings[k] != "reach")
      error->all(FLERR, "{}: with a bond style concordem/..., move `{}` to `bond_style`, where it applies to both", style_.name,
                 settings[k]);
    words.insert(words.end(), settings.begin() + k, settings.begin() + std::min(k + 2, settings.size()));
  }
  for (size_t k = 0; k < parameters.size(); k++) words.push_back((k % 2 ? "" : "contact.") + parameters[k]);
  return words;
}

void PairConcordem::add_fix()
{
  style_.add_fix("none", false, {"contact", style_.law});
}

void PairConcordem::init_style()
{
  if (utils::strmatch(force->pair_style, "^hybrid"))
    error->all(FLERR, "{} does not support pair_style hybrid. For parameters by atom type, use it alone, with `materials FILE`. Beside a "
                      "pair style of LAMMPS, use that style for all atoms, then `neigh_modify exclude group GROUP GROUP` and `fix ID GROUP "
                      "concordem/bond none contact {} ...` for the contacts within a group", style_.name, style_.law);
  if (dynamic_cast<BondConcordem *>(force->bond)) {
    // The bond style may have been defined after our coefficients; its fix evaluates the contacts.
    hand_over();
  } else if (style_.has_fix()) {
    style_.find_fix();
  } else {
    // Parameters may come from a restart file.
    add_fix();
  }
  std::vector<double> mine(atom->ntypes + 1, 0.0);
  if (!atom->radius_flag) error->all(FLERR, "{} needs atoms with a radius; use `atom_style sphere`", style_.name);
  for (int i = 0; i < atom->nlocal; i++) mine[atom->type[i]] = std::max(mine[atom->type[i]], atom->radius[i]);
  largest_.assign(mine.size(), 0.0);
  MPI_Allreduce(mine.data(), largest_.data(), mine.size(), MPI_DOUBLE, MPI_MAX, world);
  // No neighbor list is requested: the network searches for contacts among owned atoms and ghosts.
}

// Delete our fix: that of the bond style finds the contacts itself, but without their history.
void PairConcordem::hand_over()
{
  if (FixConcordemBond *fix = style_.present_fix()) {
    const double contacts = fix->touching();
    if (contacts > 0.0 && comm->me == 0)
      error->warning(FLERR, "{}: {:.0f} contacts lose their history, because the bond style was defined after a run; put "
                            "`bond_style` and `bond_coeff` before the first run", style_.name, contacts);
  }
  style_.delete_fix();
}

// Distance at which atoms touch, or `reach` if larger, which other commands such as create_bonds may need.
double PairConcordem::init_one(int a, int b)
{
  return std::max(largest_[a] + largest_[b], reach_);
}

void PairConcordem::compute(int eflag, int vflag)
{
  ev_init(eflag, vflag);
  // With a bond style there is no fix of our own: the bond style computes and tallies the forces of bonds and contacts.
  if (style_.has_fix())
    eng_vdwl = style_.find_forces(eflag_global, eflag_atom, vflag_either, vflag_global, virial, vflag_atom, vatom);
}

/* --------------------------------------------------------------------------------------------------------- restart */

void PairConcordem::write_restart(FILE *fp)
{
  style_.write_restart(fp);
}

void PairConcordem::read_restart(FILE *fp)
{
  allocate();
  style_.read_restart(fp);
  take_settings();
  for (int a = 1; a <= atom->ntypes; a++)
    for (int b = a; b <= atom->ntypes; b++) setflag[a][b] = 1;
}
