/* Words of a script in restart files, see words.h.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "words.h"

#include "comm.h"
#include "utils.h"

using namespace LAMMPS_NS;

void ConcordemWords::write(FILE *fp, const std::vector<std::string> &words) const
{
  std::string text;
  for (const std::string &word : words) text.append(word).push_back('\0');
  const int size = text.size();
  fwrite(&size, sizeof(int), 1, fp);
  fwrite(text.data(), 1, size, fp);
}

std::vector<std::string> ConcordemWords::read(FILE *fp) const
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
