/* Where atoms are and which processor owns them, distributed over all processors: no processor holds more than its share.

   SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef CONCORDEM_DIRECTORY_H
#define CONCORDEM_DIRECTORY_H

#include <mpi.h>
#include <stdint.h>

#include <algorithm>
#include <vector>

#include "atom.h"

namespace LAMMPS_NS {

// Send items to processors: `to[p]` goes to processor p. Returns what arrives, ordered by sender, and the number from each sender in
// `from`. Collective.
template <typename T>
std::vector<T> concordem_send(const std::vector<std::vector<T> > &to, MPI_Comm world, std::vector<int> *from = NULL)
{
  const int processors = to.size();
  std::vector<int> sent(processors), received(processors), start(processors + 1, 0), end(processors + 1, 0);
  for (int p = 0; p < processors; p++) sent[p] = to[p].size();
  MPI_Alltoall(&sent[0], 1, MPI_INT, &received[0], 1, MPI_INT, world);
  for (int p = 0; p < processors; p++) {
    start[p + 1] = start[p] + sent[p];
    end[p + 1] = end[p] + received[p];
  }
  std::vector<T> outgoing, incoming(end[processors]);
  outgoing.reserve(start[processors]);
  for (int p = 0; p < processors; p++) outgoing.insert(outgoing.end(), to[p].begin(), to[p].end());
  MPI_Datatype item;
  MPI_Type_contiguous(sizeof(T), MPI_BYTE, &item);
  MPI_Type_commit(&item);
  MPI_Alltoallv(outgoing.data(), &sent[0], &start[0], item, incoming.data(), &received[0], &end[0], item, world);
  MPI_Type_free(&item);
  if (from) *from = received;
  return incoming;
}

// Processor that keeps what belongs to an id. Scrambled, because ids may be multiples of the number of processors.
inline int concordem_keeper(int64_t id, int processors)
{
  return static_cast<int>((static_cast<uint64_t>(id) * UINT64_C(0x9E3779B97F4A7C15) >> 33) % processors);
}

// Most lines of a file that travel at once, to each processor and from each.
const int CONCORDEM_CHUNK = 1 << 14;

struct ConcordemPlace {
  int64_t tag;
  int64_t owner;   // processor, −1 if there is no such atom
  double x[3];
};

inline bool operator<(const ConcordemPlace &a, const ConcordemPlace &b)
{
  return a.tag < b.tag;
}

// The places of atoms of the group that this processor keeps. Sorted by id. Collective.
inline std::vector<ConcordemPlace> concordem_directory(const Atom *atom, int groupbit, MPI_Comm world)
{
  int me, processors;
  MPI_Comm_rank(world, &me);
  MPI_Comm_size(world, &processors);
  std::vector<std::vector<ConcordemPlace> > known(processors);
  for (int i = 0; i < atom->nlocal; i++) {
    if (!(atom->mask[i] & groupbit)) continue;
    const ConcordemPlace place = {static_cast<int64_t>(atom->tag[i]), me, {atom->x[i][0], atom->x[i][1], atom->x[i][2]}};
    known[concordem_keeper(place.tag, processors)].push_back(place);
  }
  std::vector<ConcordemPlace> kept = concordem_send(known, world);
  std::sort(kept.begin(), kept.end());
  return kept;
}

// Places of the atoms `wanted` (ids, in any order) among the owned atoms of all processors in the group; in the order of `wanted`. `kept`:
// the directory. Collective.
inline std::vector<ConcordemPlace> concordem_places(const std::vector<int64_t> &wanted, const std::vector<ConcordemPlace> &kept, MPI_Comm world)
{
  int processors;
  MPI_Comm_size(world, &processors);
  std::vector<std::vector<int64_t> > questions(processors);
  for (size_t k = 0; k < wanted.size(); k++) questions[concordem_keeper(wanted[k], processors)].push_back(wanted[k]);
  std::vector<int> from;
  const std::vector<int64_t> asked = concordem_send(questions, world, &from);
  std::vector<std::vector<ConcordemPlace> > answers(processors);
  size_t at = 0;
  for (int p = 0; p < processors; p++)
    for (int n = 0; n < from[p]; n++, at++) {
      ConcordemPlace place = {asked[at], -1, {0.0, 0.0, 0.0}};
      const std::vector<ConcordemPlace>::const_iterator found = std::lower_bound(kept.begin(), kept.end(), place);
      if (found != kept.end() && found->tag == place.tag) place = *found;
      answers[p].push_back(place);
    }
  const std::vector<ConcordemPlace> answered = concordem_send(answers, world, &from);
  // Answers arrive by processor, in the order of the questions to it.
  std::vector<size_t> next(processors, 0);
  for (int p = 1; p < processors; p++) next[p] = next[p - 1] + from[p - 1];
  std::vector<ConcordemPlace> places;
  places.reserve(wanted.size());
  for (size_t k = 0; k < wanted.size(); k++) places.push_back(answered[next[concordem_keeper(wanted[k], processors)]++]);
  return places;
}

// The same for one search.
inline std::vector<ConcordemPlace> concordem_places(const std::vector<int64_t> &wanted, const Atom *atom, int groupbit, MPI_Comm world)
{
  return concordem_places(wanted, concordem_directory(atom, groupbit, world), world);
}

}

#endif
