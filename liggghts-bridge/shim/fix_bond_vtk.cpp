/* fix concordem/bond/vtk, see fix_bond_vtk.h.

   A file is a VTK XML PolyData: a header, then the arrays in binary, one after the other. The first processor writes it and receives the parts of
   the others, piece by piece.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include "fix_bond_vtk.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include <algorithm>
#include <numeric>

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "modify.h"
#include "update.h"

#include "host.h"

#ifdef CONCORDEM_LAMMPS
#include "../lammps/fix_bond.h"
#else
#include "fix_bond.h"
#endif
#include "tip.h"

using namespace LAMMPS_NS;

namespace {

// Numbers of a line that the file has as a field: from `first` of concordem_network_lines() on; `whole`: integers.
struct Field {
  const char *name;
  bool whole;
  int components, first;
};

const Field FIELDS[] = {{"ids", true, 2, 6},          {"bonded", false, 1, 8}, {"damage", false, 1, 9},  {"normal_force", false, 1, 10},
                        {"shear_force", false, 1, 11}, {"force", false, 3, 12}, {"moment", false, 3, 15}, {"area", false, 1, 18}};

// Lines that travel at once.
const int64_t PIECE = 1 << 16;

template <class Number> void append(std::vector<char> &bytes, Number number)
{
  const char *first = reinterpret_cast<const char *>(&number);
  bytes.insert(bytes.end(), first, first + sizeof(number));
}

bool ends_with(const std::string &text, const std::string &end)
{
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

double time_of(const Update *update)
{
#ifdef CONCORDEM_LAMMPS
  return update->atime + (update->ntimestep - update->atimestep) * update->dt;
#else
  return update->get_cur_time();
#endif
}

const char *byte_order()
{
  const uint16_t one = 1;
  return *reinterpret_cast<const char *>(&one) ? "LittleEndian" : "BigEndian";
}

// Up to the arrays, for `count` lines.
void write_header(FILE *out, int64_t count, double time)
{
  fprintf(out, "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"%s\" header_type=\"UInt64\">\n<PolyData>\n", byte_order());
  fprintf(out, "<FieldData><DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" format=\"ascii\">%.17g</DataArray></FieldData>\n", time);
  fprintf(out, "<Piece NumberOfPoints=\"%lld\" NumberOfVerts=\"0\" NumberOfLines=\"%lld\" NumberOfStrips=\"0\" NumberOfPolys=\"0\">\n",
          static_cast<long long>(2 * count), static_cast<long long>(count));
  int64_t offset = 0;
  const auto announce = [&](const char *name, bool whole, int components, int64_t per_line) {
    fprintf(out, "<DataArray type=\"%s\" Name=\"%s\" NumberOfComponents=\"%d\" format=\"appended\" offset=\"%lld\"/>\n", whole ? "Int64" : "Float64", name,
            components, static_cast<long long>(offset));
    offset += 8 + 8 * per_line * count;   // an array begins with its number of bytes
  };
  fprintf(out, "<Points>\n");
  announce("Points", false, 3, 6);
  fprintf(out, "</Points>\n<Lines>\n");
  announce("connectivity", true, 1, 2);
  announce("offsets", true, 1, 1);
  fprintf(out, "</Lines>\n<CellData>\n");
  for (const Field &field : FIELDS) announce(field.name, field.whole, field.components, field.components);
  fprintf(out, "</CellData>\n</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_");
}

}

FixConcordemBondVtk::FixConcordemBondVtk(LAMMPS *lmp, int narg, char **arg) : Fix(lmp, narg, arg)
{
  if (narg != 6) fail("give N FILE FIX-ID after the style: steps between files, their name with a * for the step, and the id of a fix concordem/bond");
  char *end;
  const long every = strtol(arg[3], &end, 10);
  if (*end || every < 1 || every > MAXSMALLINT) fail(std::string("`") + arg[3] + "` is no number of steps; give an integer from 1 on");
  nevery = static_cast<int>(every);
  file_ = arg[4];
  if (std::count(file_.begin(), file_.end(), '*') != 1 || !ends_with(file_, ".vtp"))
    fail("`" + file_ + "` is no name for files of several steps; give one * for the step and the ending .vtp, for example bonds.*.vtp");
  bonds_id_ = arg[5];
}

void FixConcordemBondVtk::fail(const std::string &text)
{
#ifdef CONCORDEM_LAMMPS
  error->all(FLERR, "Fix {} {}: {}", id, style, text);
#else
  concordem_leave_out_tip(universe);
  error->fix_error(FLERR, this, text.c_str());
#endif
  abort();   // unreachable
}

void FixConcordemBondVtk::fail_to(const char *verb, const std::string &file)
{
  const std::string text = std::string("fix ") + id + " " + style + ": cannot " + verb + " " + file + ": " + strerror(errno);
  concordem_leave_out_tip(universe);
  error->one(FLERR, text.c_str());
  abort();   // unreachable
}

int FixConcordemBondVtk::setmask()
{
  return FixConst::END_OF_STEP;
}

void FixConcordemBondVtk::init()
{
  const int k = modify->find_fix(bonds_id_.c_str());
  bonds_ = k < 0 ? nullptr : dynamic_cast<FixConcordemBond *>(modify->fix[k]);
  if (!bonds_) fail("there is no fix concordem/bond with id " + bonds_id_ + "; check the id (the fix of bond styles is concordem_bonds)");
}

void FixConcordemBondVtk::setup(int)
{
  if (update->ntimestep % nevery == 0) write();
}

void FixConcordemBondVtk::end_of_step()
{
  write();
}

// The arrays in the order of the header.
void FixConcordemBondVtk::write_arrays(FILE *out, const std::vector<int64_t> &counts, const double *lines)
{
  write_array(out, counts, lines, 48, [](const double *line, int64_t, std::vector<char> &bytes) {
    for (int k = 0; k < 6; k++) append(bytes, line[k]);
  });
  write_array(out, counts, lines, 16, [](const double *, int64_t number, std::vector<char> &bytes) {
    for (int k = 0; k < 2; k++) append(bytes, int64_t(2 * number + k));
  });
  write_array(out, counts, lines, 8, [](const double *, int64_t number, std::vector<char> &bytes) { append(bytes, int64_t(2 * number + 2)); });
  for (const Field &field : FIELDS)
    write_array(out, counts, lines, 8 * field.components, [&](const double *line, int64_t, std::vector<char> &bytes) {
      for (int k = field.first; k < field.first + field.components; k++) {
        if (field.whole) append(bytes, static_cast<int64_t>(line[k]));
        else append(bytes, line[k]);
      }
    });
}

template <class Bytes>
void FixConcordemBondVtk::write_array(FILE *out, const std::vector<int64_t> &counts, const double *lines, int64_t bytes_of_line, Bytes bytes)
{
  const auto put = [&](const std::vector<char> &piece) {
    if (fwrite(piece.data(), 1, piece.size(), out) != piece.size()) fail_to("write", file_);
  };
  std::vector<char> piece;
  if (comm->me == 0) {
    append(piece, static_cast<uint64_t>(std::accumulate(counts.begin(), counts.end(), int64_t(0)) * bytes_of_line));
    put(piece);
  }
  int64_t before = 0;
  for (int p = 0; p < comm->nprocs; p++) {
    for (int64_t first = 0; first < counts[p] && (comm->me == 0 || comm->me == p); first += PIECE) {
      const int64_t last = std::min(first + PIECE, counts[p]);
      piece.clear();
      if (comm->me == p)
        for (int64_t k = first; k < last; k++) bytes(lines + k * CONCORDEM_LINE, before + k, piece);
      piece.resize((last - first) * bytes_of_line);
      const int size = static_cast<int>(piece.size());
      if (comm->me != p) MPI_Recv(piece.data(), size, MPI_BYTE, p, 0, world, MPI_STATUS_IGNORE);
      else if (p > 0) MPI_Send(piece.data(), size, MPI_BYTE, 0, 0, world);
      if (comm->me == 0) put(piece);
    }
    before += counts[p];
  }
}

void FixConcordemBondVtk::write()
{
  // Runs that follow each other share a step.
  if (written_at_ == update->ntimestep) return;
  written_at_ = update->ntimestep;
  int64_t count = 0;
  double *lines = concordem_network_lines(bonds_->network(), atom->mask, atom->nlocal + atom->nghost, groupbit, &count);
  std::vector<int64_t> counts(comm->nprocs);
  MPI_Allgather(&count, 1, MPI_INT64_T, counts.data(), 1, MPI_INT64_T, world);

  std::string file = file_;
  file.replace(file.find('*'), 1, std::to_string(static_cast<long long>(update->ntimestep)));
  // A viewer may look into the folder now.
  const std::string part = file + ".part";
  FILE *const out = comm->me == 0 ? fopen(part.c_str(), "wb") : nullptr;
  if (comm->me == 0 && !out) fail_to("create", part);
  if (out) write_header(out, std::accumulate(counts.begin(), counts.end(), int64_t(0)), time_of(update));
  write_arrays(out, counts, lines);
  concordem_records_delete(lines, count, CONCORDEM_LINE);
  if (!out) return;
  fprintf(out, "\n</AppendedData>\n</VTKFile>\n");
  const bool wrong = ferror(out) != 0;
  if (fclose(out) != 0 || wrong) fail_to("write", part);
  if (rename(part.c_str(), file.c_str()) != 0) fail_to("write", file);
}
