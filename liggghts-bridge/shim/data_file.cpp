/* The state of fix concordem/bond beside data files. write_data calls the functions of FixBondBase below. A data file is read before its
   fixes exist, so they cannot read a section of their own. In LAMMPS the state is in comments of the data file. LIGGGHTS allows no comments
   there, so it is in a file of its own, with the name of the data file and the id of the fix. `state FILE` reads both.

   SPDX-License-Identifier: GPL-2.0-or-later */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "fix_bond_base.h"
#include "update.h"

#include "host.h"

using namespace LAMMPS_NS;

namespace {

// Parts of the state: write_data calls the fix for each.
enum Part { ATOMS, RECORDS, END };

// Reals per line. LIGGGHTS reads lines of at most 255 bytes, and a real has at most 24.
const int PER_LINE = 9;

// Rows that travel at once, in reals.
const int CHUNK = 1 << 16;

void print_reals(FILE *fp, const double *reals, int count)
{
  for (int k = 0; k < count; k++) {
    if (k % PER_LINE == 0) fputs(k ? "\n#" : "#", fp);
    fprintf(fp, " %.17g", reals[k]);   // reads back bit for bit
  }
  fputs("\n", fp);
}

std::string title(const std::string &id)
{
  return "ConcorDEM state of fix " + id;
}

#ifdef CONCORDEM_LAMMPS
std::string name_of_state(const std::string &data_file, const std::string &)
{
  return data_file;
}
#else
std::string name_of_state(const std::string &data_file, const std::string &id)
{
  return data_file + "." + id;
}

// The file of the state while write_data runs.
FILE *beside = NULL;

// Name of an open file; write_data does not pass it on. Empty if it is unknown.
std::string name_of(FILE *fp)
{
  char path[4096];
  const ssize_t length = readlink(("/proc/self/fd/" + std::to_string(fileno(fp))).c_str(), path, sizeof(path));
  return length > 0 && length < static_cast<ssize_t>(sizeof(path)) ? std::string(path, length) : "";
}
#endif

// A file with a state, read on one processor.
class StateFile {
 public:
  explicit StateFile(const std::string &name) : name_(name), file_(fopen(name.c_str(), "r"))
  {
    if (!file_) error = "cannot open " + name + ": " + strerror(errno);
  }
  ~StateFile()
  {
    if (file_) fclose(file_);
    free(line_);
  }

  // Go to the line behind the title of the state of fix `id`.
  void seek(const std::string &id)
  {
    const std::string wanted = "# " + title(id) + ":", any = "# " + title("");
    std::string others;
    while (error.empty() && next_line()) {
      if (wanted.compare(0, wanted.size(), line_, std::min(wanted.size(), length_)) == 0) return;
      const char *colon = strchr(line_, ':');
      if (colon && strncmp(line_, any.c_str(), any.size()) == 0) {
        others += others.empty() ? "" : ", ";
        others.append(static_cast<const char *>(line_) + any.size(), colon);
      }
    }
    if (!error.empty()) return;
    if (others.empty())
      error = name_ + " has no state of ConcorDEM. Write it with write_data while the fix exists; without a state, the bonds of the file "
                      "start unstrained: remove `state`";
    else
      error = name_ + " has the state of fix " + others + ", not of this one; give this fix the same id";
  }

  // The next line, without `#`.
  const char *text()
  {
    if (!next_line() || line_[0] != '#') fail_at_line("the state ends too early");
    return error.empty() ? line_ + 1 : "";
  }

  bool reals(double *to, int count)
  {
    for (int k = 0; k < count && error.empty(); k++) {
      if (k % PER_LINE == 0) at_ = text();
      char *end = NULL;
      to[k] = strtod(at_, &end);
      if (error.empty() && end == at_) fail_at_line("a number is missing");
      at_ = end;
    }
    if (error.empty() && count > 0 && strspn(at_, " \r\n") != strlen(at_)) fail_at_line("too many numbers");
    return error.empty();
  }

  void fail_at_line(const std::string &what)
  {
    if (error.empty())
      error = name_ + ", line " + std::to_string(number_) + ": " + what + "; the file was edited or cut off, write it again";
  }

  std::string error;   // empty if all is well

 private:
  const std::string name_;
  FILE *const file_;
  char *line_ = NULL;
  const char *at_ = "";
  size_t capacity_ = 0, length_ = 0;
  long long number_ = 0;

  bool next_line()
  {
    const ssize_t read = getline(&line_, &capacity_, file_);
    length_ = read > 0 ? static_cast<size_t>(read) : 0;
    number_++;
    return read > 0;
  }
};

}

/* ------------------------------------------------------------------------------------------------------------ write_data */

// Called on all processors, for one part after the other.
void FixBondBase::write_data_section_size(int part, int &rows, int &columns)
{
  rows = 0;
  columns = 1;
  if (part == ATOMS) {
    head_of_data_ = head();
    ConcordemAtoms atoms = arrays();
    int64_t count;
    double *records = concordem_network_counted_rows(network_, &atoms, &count);
    records_of_data_.assign(records, records + count * facts_.record_reals);
    concordem_records_delete(records, count, facts_.record_reals);
    long long mine[2] = {atom->nlocal, static_cast<long long>(records_of_data_.size() / facts_.record_reals)};
    MPI_Allreduce(mine, rows_of_data_, 2, MPI_LONG_LONG, MPI_SUM, world);
    rows = atom->nlocal;
    columns = 2 + facts_.atom_width;
  } else if (part == RECORDS) {
    rows = static_cast<int>(records_of_data_.size() / facts_.record_reals);
    columns = facts_.record_reals;
  }
}

void FixBondBase::write_data_section_pack(int part, double **rows)
{
  if (part == ATOMS) {
    // Data files have densities, from which masses follow up to rounding.
    for (int i = 0; i < atom->nlocal; i++) {
      rows[i][0] = atom->tag[i];
      rows[i][1] = atom->rmass[i];
      std::copy(memory_[i], memory_[i] + facts_.atom_width, rows[i] + 2);
    }
  } else if (part == RECORDS) {
    if (!records_of_data_.empty()) std::copy(records_of_data_.begin(), records_of_data_.end(), rows[0]);
    std::vector<double>().swap(records_of_data_);
  }
}

// Called on one processor.
void FixBondBase::write_data_section_keyword(int part, FILE *fp)
{
#ifndef CONCORDEM_LAMMPS
  if (part == ATOMS) {
    const std::string data_file = name_of(fp);
    beside = data_file.empty() ? NULL : fopen(name_of_state(data_file, id).c_str(), "w");
    if (!beside) {
      snprintf(text_, sizeof(text_), "cannot write the histories of bonds beside the data file: %s", strerror(errno));
      fail_on_this_processor();
    }
  }
  fp = beside;
#endif
  if (part == ATOMS) {
    const ConcordemRestartHead &head = head_of_data_;
    fprintf(fp, "\n# %s: histories of bonds and contacts, read with `state FILE`; do not edit\n", title(id).c_str());
    fprintf(fp, "# version %d law %s contacts %s made %d forces %d virial %d atoms %lld %d records %lld %d\n", head.version, head.law,
            head.contacts, head.made, head.found_at == update->ntimestep, head.virial_at == update->ntimestep, rows_of_data_[0],
            2 + facts_.atom_width, rows_of_data_[1], facts_.record_reals);
    print_reals(fp, head.totals, CONCORDEM_TOTALS);
    double more[11] = {head.mean_radius};
    std::copy(head.edge, head.edge + 3, more + 1);
    std::copy(head.virial, head.virial + 6, more + 4);
    more[10] = head.reference_temperature;
    print_reals(fp, more, 11);
  } else if (part == END) {
    fprintf(fp, "# end of the %s\n", title(id).c_str());
#ifndef CONCORDEM_LAMMPS
    if (fclose(beside) != 0) {
      snprintf(text_, sizeof(text_), "cannot write the histories of bonds beside the data file: %s", strerror(errno));
      fail_on_this_processor();
    }
    beside = NULL;
#endif
  }
}

void FixBondBase::write_data_section(int part, FILE *fp, int count, double **rows, int)
{
#ifndef CONCORDEM_LAMMPS
  fp = beside;
#endif
  const int columns = part == ATOMS ? 2 + facts_.atom_width : facts_.record_reals;
  if (part != END)
    for (int k = 0; k < count; k++) print_reals(fp, rows[k], columns);
}

/* ------------------------------------------------------------------------------------------------------------ state FILE */

namespace {

struct StateCounts {
  int version, made, forces, virial, columns[2];
  long long rows[2];
  char law[32], contacts[32];
};

}

// Continue from a data file. The first processor reads the file in pieces; each takes what belongs to its atoms. Collective.
void FixBondBase::read_state(const std::string &data_file)
{
  const std::string name = name_of_state(data_file, id);
  StateFile *file = comm->me == 0 ? new StateFile(name) : NULL;
  // Fails on all processors if reading failed on the first one.
  const auto check = [&]() {
    int length = file ? static_cast<int>(file->error.size()) : 0;
    MPI_Bcast(&length, 1, MPI_INT, 0, world);
    if (length == 0) return;
    std::string text = file ? file->error : std::string(length, ' ');
    MPI_Bcast(&text[0], length, MPI_CHAR, 0, world);
    delete file;
    fail(text);
  };
  ConcordemRestartHead head;
  memset(&head, 0, sizeof(head));
  StateCounts found;
  memset(&found, 0, sizeof(found));
  double more[11] = {0.0};
  if (file) {
    file->seek(id);
    const char *line = file->error.empty() ? file->text() : "";
    if (file->error.empty() &&
        sscanf(line, " version %d law %31s contacts %31s made %d forces %d virial %d atoms %lld %d records %lld %d", &found.version,
               found.law, found.contacts, &found.made, &found.forces, &found.virial, &found.rows[0], &found.columns[0], &found.rows[1],
               &found.columns[1]) != 10)
      file->fail_at_line("the head of the state is damaged");
    if (file->error.empty()) file->reals(head.totals, CONCORDEM_TOTALS) && file->reals(more, 11);
  }
  check();
  MPI_Bcast(&found, sizeof(found), MPI_BYTE, 0, world);
  MPI_Bcast(head.totals, CONCORDEM_TOTALS, MPI_DOUBLE, 0, world);
  MPI_Bcast(more, 11, MPI_DOUBLE, 0, world);
  const int columns[2] = {2 + facts_.atom_width, facts_.record_reals};
  memcpy(head.law, found.law, sizeof(head.law));
  memcpy(head.contacts, found.contacts, sizeof(head.contacts));
  head.made = found.made;
  head.mean_radius = more[0];
  std::copy(more + 1, more + 4, head.edge);
  std::copy(more + 4, more + 10, head.virial);
  head.reference_temperature = more[10];
  head.found_at = found.forces ? update->ntimestep : -1;
  head.virial_at = found.virial ? update->ntimestep : -1;
  head.atom_width = found.columns[0] - 2;
  head.record_reals = found.columns[1];
  if (found.version != CONCORDEM_RESTART_VERSION) {
    delete file;
    fail(name + " was written by another version of ConcorDEM; use that one");
  }
  resume(head, name);

  std::vector<std::pair<tagint, int> > places;
  for (int i = 0; i < atom->nlocal; i++) places.push_back(std::make_pair(atom->tag[i], i));
  std::sort(places.begin(), places.end());
  const auto place = [&](double tag) {
    const std::pair<tagint, int> first(static_cast<tagint>(tag), -1);
    const auto at = std::lower_bound(places.begin(), places.end(), first);
    return at != places.end() && at->first == first.first ? at->second : -1;
  };
  std::vector<double> piece;
  std::vector<int> mine, known;
  for (int part = ATOMS; part <= RECORDS; part++) {
    const int width = columns[part];
    const long long most = std::max(1, CHUNK / width);
    for (long long done = 0; done < found.rows[part]; done += most) {
      const int count = static_cast<int>(std::min(most, found.rows[part] - done));
      piece.resize(static_cast<size_t>(count) * width);
      for (int k = 0; file && k < count && file->reals(&piece[static_cast<size_t>(k) * width], width); k++) {}
      check();
      MPI_Bcast(piece.data(), count * width, MPI_DOUBLE, 0, world);
      mine.assign(count, 0);
      for (int k = 0; k < count; k++) {
        const double *row = &piece[static_cast<size_t>(k) * width];
        if (part == RECORDS) {
          // One processor keeps it until it is delivered. All atoms of the file exist.
          if (place(row[0]) >= 0 && concordem_network_restore_row(network_, row, &message_) < 0) fail_on_this_processor();
          continue;
        }
        const int i = place(row[0]);
        if (i < 0) continue;
        mine[k] = 1;
        std::copy(row + 2, row + width, memory_[i]);
        // A mass that differs by more than rounding is new.
        if (fabs(atom->rmass[i] - row[1]) <= 1e-14 * row[1]) atom->rmass[i] = row[1];
      }
      if (part == RECORDS) continue;
      known.resize(count);
      MPI_Allreduce(mine.data(), known.data(), count, MPI_INT, MPI_MAX, world);
      const auto missing = std::find(known.begin(), known.end(), 0);
      if (missing != known.end()) {
        delete file;
        fail("the state in " + name + " has atom " + std::to_string(static_cast<long long>(piece[(missing - known.begin()) * width])) +
             ", which does not exist; read the atoms from the same file, with their ids");
      }
    }
  }
  records_of_restart_ = found.rows[RECORDS];
  if (file && strncmp(file->text(), " end of the ConcorDEM state", 27) != 0) file->fail_at_line("the end of the state is missing");
  check();
  delete file;
}
