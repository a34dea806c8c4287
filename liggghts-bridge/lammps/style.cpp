/* Common part of bond styles and pair styles, see style.h.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "style.h"

#include "comm.h"
#include "error.h"
#include "modify.h"
#include "utils.h"

#include "fix_bond.h"

using namespace LAMMPS_NS;

ConcordemStyle::ConcordemStyle(LAMMPS *lmp, const char *kind, const std::string &of, const char *id, const char *again) :
    Pointers(lmp), law(of), name(std::string(kind) + " style concordem/" + of), fix_id(id), again_(again)
{
}

ConcordemStyle::~ConcordemStyle()
{
  delete_fix();
}

void ConcordemStyle::add_fix(const std::string &bonds, bool lists, const std::vector<std::string> &more)
{
  // The user's words come last, so that an error about a missing value names the right word.
  std::vector<std::string> words = {fix_id, "all", "concordem/bond", bonds};
  words.insert(words.end(), more.begin(), more.end());
  words.insert(words.end(), settings.begin(), settings.end());
  words.insert(words.end(), parameters.begin(), parameters.end());
  std::vector<char *> arguments;
  for (std::string &word : words) arguments.push_back(&word[0]);
  fix_ = dynamic_cast<FixConcordemBond *>(modify->add_fix(static_cast<int>(arguments.size()), arguments.data()));
  fix_->serve(this, lists);
  // The state has been read. A restart file contains the settings, and a later state.
  for (size_t k = 0; k + 1 < settings.size(); k += 2)
    if (settings[k] == "state") {
      settings.erase(settings.begin() + k, settings.begin() + k + 2);
      break;
    }
}

FixConcordemBond *ConcordemStyle::present_fix() const
{
  if (!fix_ || !modify) return nullptr;
  FixConcordemBond *found = dynamic_cast<FixConcordemBond *>(modify->get_fix_by_id(fix_id));
  return found && found->serves(this) ? found : nullptr;
}

void ConcordemStyle::find_fix()
{
  fix_ = present_fix();
  if (!fix_)
    error->all(FLERR, "{}: its fix {} was deleted or replaced, and the history of contacts was lost; do not `unfix` it, or start over "
                      "with `{}`", name, fix_id, again_);
}

// On exit, LAMMPS deletes fixes before styles.
void ConcordemStyle::delete_fix()
{
  if (present_fix()) modify->delete_fix(fix_id);
  fix_ = nullptr;
}

double ConcordemStyle::find_forces(bool energy, bool energy_of_atoms, int virial, int global, double *sum, int of_atoms,
                                   double **per_atom)
{
  if (energy_of_atoms)
    error->all(FLERR, "{} has no energies per atom; use the energies of fix {}", name, fix_id);
  // A command of `run N pre no every M` may have deleted the fix without a new setup.
  find_fix();
  fix_->find_forces(energy, virial);
  fix_->add_virial(global, sum, of_atoms, per_atom);
  return energy ? fix_->stored_energy() : 0.0;
}

/* --------------------------------------------------------------------------------------------------------- restart */

// Called on one processor.
void ConcordemStyle::write_restart(FILE *fp) const
{
  write(fp, settings);
  write(fp, parameters);
}

// Called on all processors; the first one reads the file.
void ConcordemStyle::read_restart(FILE *fp)
{
  settings = read(fp);
  parameters = read(fp);
  if (comm->me == 0)
    utils::logmesg(lmp, "  {}: its fix {} will exist from the first run on; to use its output before, repeat the style and its "
                        "coefficients after read_restart\n", name, fix_id);
}

void ConcordemStyle::write(FILE *fp, const std::vector<std::string> &words) const
{
  std::string text;
  for (const std::string &word : words) text.append(word).push_back('\0');
  const int size = text.size();
  fwrite(&size, sizeof(int), 1, fp);
  fwrite(text.data(), 1, size, fp);
}

std::vector<std::string> ConcordemStyle::read(FILE *fp) const
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
