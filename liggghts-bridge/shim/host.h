/* Functions for both hosts; they use only members that LIGGGHTS and LAMMPS classes have in common.

   SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef CONCORDEM_HOST_H
#define CONCORDEM_HOST_H

#include <math.h>
#include <mpi.h>
#include <stdint.h>
#include <string.h>

#include <algorithm>
#include <vector>

#include "atom.h"
#include "compute.h"
#include "domain.h"
#include "fix.h"
#include "modify.h"
#include "update.h"

#include "abi.h"
#include "directory.h"

namespace LAMMPS_NS {

// Version of restart files. Increase it whenever the head or the meaning of its numbers changes (tests/harness/mod.rs repeats it).
const int CONCORDEM_RESTART_VERSION = 7;

// Head of a restart file. Every version starts with the version number; the length differs.
struct ConcordemRestartHead {
  int version;
  int made;
  char law[32], contacts[32];
  int atom_width, record_reals;
  int64_t found_at, records;
  double totals[CONCORDEM_TOTALS];
  double edge[3], mean_radius, reference_temperature;
  int64_t virial_at;
  double virial[6];
};

static_assert(sizeof(ConcordemRestartHead) == 192 + 8 * CONCORDEM_TOTALS, "the length of the restart head changed: increase CONCORDEM_RESTART_VERSION");

// Length of the box along an axis with periodic images, m; 0 along the others. In two dimensions there are none along z.
inline double concordem_edge(const Domain *domain, int axis)
{
  return domain->periodicity[axis] && !(domain->dimension == 2 && axis == 2) ? domain->prd[axis] : 0.0;
}

inline bool concordem_has_images(const Domain *domain)
{
  return concordem_edge(domain, 0) + concordem_edge(domain, 1) + concordem_edge(domain, 2) > 0.0;
}

// The host's arrays. `original`: unshifted positions of ghosts (NULL: use the host's positions). `effective_mass`: NULL if it is that of the atoms.
inline ConcordemAtoms concordem_arrays(const Atom *atom, const Domain *domain, const Update *update, int groupbit, int width,
                                       double **memory, double **original, const double *effective_mass)
{
  ConcordemAtoms atoms;
  const int count = atom->nlocal + atom->nghost;
  atoms.owned = atom->nlocal;
  atoms.count = count;
  atoms.group = groupbit;
  atoms.memory_width = width;
  atoms.tag_bytes = sizeof(*atom->tag);
  atoms.tag = atom->tag;
  atoms.kind = atom->type;
  atoms.mask = atom->mask;
  atoms.position = count ? (original ? original[0] : atom->x[0]) : NULL;
  atoms.velocity = count ? atom->v[0] : NULL;
  atoms.angular_velocity = count ? atom->omega[0] : NULL;
  atoms.radius = atom->radius;
  atoms.mass = atom->rmass;
  atoms.effective_mass = effective_mass;
  atoms.force = count ? atom->f[0] : NULL;
  atoms.torque = count ? atom->torque[0] : NULL;
  atoms.memory = count ? memory[0] : NULL;
  for (int axis = 0; axis < 3; axis++) {
    atoms.edge[axis] = concordem_edge(domain, axis);
    atoms.low[axis] = domain->boxlo[axis];
    atoms.high[axis] = domain->boxhi[axis];
  }
  atoms.dt = update->dt;
  atoms.step = update->ntimestep;
  return atoms;
}

// Pack our data of ghosts: unshifted positions (unless `original` is NULL) and memory from `first` on. Returns the number of reals.
inline int concordem_pack_ghosts(int count, const int *list, double *buffer, int first, int width, double **memory,
                                 double **original)
{
  int m = 0;
  for (int k = 0; k < count; k++) {
    const int i = list[k];
    if (original)
      for (int axis = 0; axis < 3; axis++) buffer[m++] = original[i][axis];
    for (int r = first; r < width; r++) buffer[m++] = memory[i][r];
  }
  return m;
}

inline void concordem_unpack_ghosts(int count, int first_atom, const double *buffer, int first, int width, double **memory,
                                    double **original)
{
  int m = 0;
  for (int i = first_atom; i < first_atom + count; i++) {
    if (original)
      for (int axis = 0; axis < 3; axis++) original[i][axis] = buffer[m++];
    for (int r = first; r < width; r++) memory[i][r] = buffer[m++];
  }
}

// Whether one of our computes is evaluated at this step, or a file of bonds written.
inline bool concordem_output_is_due(const Modify *modify, const Update *update)
{
  for (int k = 0; k < modify->nfix; k++)
    if (strcmp(modify->fix[k]->style, "concordem/bond/vtk") == 0 && update->ntimestep % modify->fix[k]->nevery == 0) return true;
  for (int k = 0; k < modify->ncompute; k++) {
    Compute *compute = modify->compute[k];
    if (compute->timeflag && strncmp(compute->style, "concordem/", 10) == 0 && compute->matchstep(update->ntimestep)) return true;
  }
  return false;
}

// Whether a program uses this library, and may read the forces of contacts after a run.
inline bool &concordem_is_a_library()
{
  static bool is = false;
  return is;
}

// Whether the script or a program reads the forces of contacts.
inline bool concordem_forces_are_read(const Modify *modify)
{
  for (int k = 0; k < modify->ncompute; k++)
    if (strncmp(modify->compute[k]->style, "concordem/", 10) == 0) return true;
  return concordem_is_a_library();
}

// The bonds of the user's list that this processor keeps, and the places of their atoms: two per bond. Collective.
struct ConcordemListed {
  std::vector<ConcordemBondOfList> bonds;
  std::vector<ConcordemPlace> places;
};

inline ConcordemListed concordem_listed(const ConcordemNetwork *network, const Atom *atom, int groupbit, MPI_Comm world)
{
  ConcordemListed listed;
  listed.bonds.resize(concordem_network_listed(network, NULL));
  concordem_network_listed(network, listed.bonds.data());
  std::vector<int64_t> ends;
  for (size_t k = 0; k < listed.bonds.size(); k++) ends.insert(ends.end(), listed.bonds[k].ids, listed.bonds[k].ids + 2);
  listed.places = concordem_places(ends, atom, groupbit, world);
  return listed;
}

// Distance of two atoms, of the images nearest to each other, m. Not by Domain::minimum_image, whose arguments depend on the version of LAMMPS.
inline double concordem_distance(const double *a, const double *b, const Domain *domain)
{
  double squared = 0.0;
  for (int axis = 0; axis < 3; axis++) {
    double d = b[axis] - a[axis];
    const double edge = concordem_edge(domain, axis);
    if (edge > 0.0) d -= edge * floor(d / edge + 0.5);
    squared += d * d;
  }
  return sqrt(squared);
}

// Longest bond of the user's list that this processor keeps, at the current positions. `missing`: the lowest listed id that is not in the
// group on any processor, or 0. Collective.
inline double concordem_longest_listed(const ConcordemNetwork *network, const Atom *atom, Domain *domain, int groupbit, MPI_Comm world,
                                       int64_t *missing)
{
  const ConcordemListed listed = concordem_listed(network, atom, groupbit, world);
  int64_t lowest = INT64_MAX;
  double longest = 0.0;
  for (size_t k = 0; k < listed.bonds.size(); k++) {
    const ConcordemPlace *ends = &listed.places[2 * k];
    for (int end = 0; end < 2; end++)
      if (ends[end].owner < 0) lowest = std::min(lowest, ends[end].tag);
    longest = std::max(longest, std::max(concordem_distance(ends[0].x, ends[1].x, domain), listed.bonds[k].length));
  }
  MPI_Allreduce(&lowest, missing, 1, MPI_INT64_T, MPI_MIN, world);
  if (*missing == INT64_MAX) *missing = 0;
  return longest;
}

// Bring the bonds of the user's list to the processors that own their atoms, and queue them there. Collective.
inline void concordem_make_listed(ConcordemNetwork *network, const Atom *atom, int groupbit, MPI_Comm world)
{
  const ConcordemListed listed = concordem_listed(network, atom, groupbit, world);
  int processors;
  MPI_Comm_size(world, &processors);
  std::vector<std::vector<ConcordemBondOfList> > to(processors);
  for (size_t k = 0; k < listed.bonds.size(); k++) {
    const int first = listed.places[2 * k].owner, second = listed.places[2 * k + 1].owner;
    if (first >= 0) to[first].push_back(listed.bonds[k]);
    if (second >= 0 && second != first) to[second].push_back(listed.bonds[k]);
  }
  const std::vector<ConcordemBondOfList> mine = concordem_send(to, world);
  concordem_network_make_listed(network, mine.data(), mine.size());
}

// Longest possible bond or contact. `wanted`: longest bond that is about to be created from a list. Sets `smallest` to the smallest
// radius.
inline double concordem_longest(const ConcordemNetwork *network, const ConcordemFacts &facts, bool made, double wanted,
                                const Atom *atom, int groupbit, MPI_Comm world, double *smallest)
{
  const double none = -1e300;
  double bounds[4] = {0.0, none, 0.0, wanted};   // largest radius, minus the smallest, longest bond, wanted
  double all[4];
  for (int i = 0; i < atom->nlocal; i++) {
    if (!(atom->mask[i] & groupbit)) continue;
    bounds[0] = std::max(bounds[0], atom->radius[i]);
    bounds[1] = std::max(bounds[1], -atom->radius[i]);
  }
  double sums[CONCORDEM_SUMS];
  concordem_network_sums(network, sums);
  bounds[2] = sums[CONCORDEM_LONGEST];
  MPI_Allreduce(bounds, all, 4, MPI_DOUBLE, MPI_MAX, world);
  *smallest = all[1] > none ? -all[1] : 0.0;
  double longest = std::max(all[2], strcmp(facts.contacts, "none") != 0 ? 2.0 * all[0] : 0.0);
  if ((!made && facts.creation == 1) || facts.creation == 3) longest = std::max(longest, facts.factor * 2.0 * all[0]);
  if (!made) longest = std::max(longest, all[3]);
  return longest;
}

// A sum of numbers on all processors, in units of 2^-shift.
struct ConcordemExactSum {
  __int128 units;
  long long count;
  int shift;
  double value() const { return ldexp(static_cast<double>(units), -shift); }
};

// Sum positive numbers exactly, in integers, so that the sum does not depend on their distribution over processors. Collective.
inline ConcordemExactSum concordem_exact_sum(const std::vector<double> &values, MPI_Comm world)
{
  double mine = 0.0, largest = 0.0;
  for (size_t k = 0; k < values.size(); k++) mine = std::max(mine, values[k]);
  MPI_Allreduce(&mine, &largest, 1, MPI_DOUBLE, MPI_MAX, world);
  const ConcordemExactSum none = {0, 0, 0};
  if (!(largest > 0.0)) return none;
  int exponent;
  frexp(largest, &exponent);
  const int shift = 53 - exponent;
  // Upper and lower 26 bits are summed separately, which allows 2^37 numbers.
  long long parts[3] = {0, 0, 0}, all[3];
  for (size_t k = 0; k < values.size(); k++) {
    const long long units = static_cast<long long>(ldexp(values[k], shift));
    parts[0] += units >> 26;
    parts[1] += units & ((1LL << 26) - 1);
    parts[2] += 1;
  }
  MPI_Allreduce(parts, all, 3, MPI_LONG_LONG, MPI_SUM, world);
  const ConcordemExactSum sum = {(static_cast<__int128>(all[0]) << 26) + all[1], all[2], shift};
  return sum;
}

// Mean radius of the atoms with a queued bond, 0 if there are none. Does not depend on the distribution of atoms over processors.
inline double concordem_mean_radius(const ConcordemNetwork *network, const Atom *atom, int groupbit, MPI_Comm world)
{
  std::vector<int64_t> queued(concordem_network_queued_atoms(network, NULL));
  concordem_network_queued_atoms(network, queued.data());
  std::vector<double> bonded;
  for (int i = 0; i < atom->nlocal; i++)
    if (atom->mask[i] & groupbit && std::binary_search(queued.begin(), queued.end(), static_cast<int64_t>(atom->tag[i])))
      bonded.push_back(atom->radius[i]);
  const ConcordemExactSum sum = concordem_exact_sum(bonded, world);
  return sum.count ? ldexp(static_cast<double>(sum.units / sum.count), -sum.shift) : 0.0;
}

// Set `bonds` to the total number of bonds; return whether every bond is known to the processors of both its atoms.
inline bool concordem_count(const ConcordemNetwork *network, MPI_Comm world, double *bonds)
{
  double sums[CONCORDEM_SUMS];
  concordem_network_sums(network, sums);
  double mine[3] = {sums[0], 0.0, 0.0}, all[3];
  concordem_network_ends(network, mine + 1);
  MPI_Allreduce(mine, all, 3, MPI_DOUBLE, MPI_SUM, world);
  *bonds = all[0];
  return all[1] == all[2];
}

// Read the head of a restart file; false if it is of another version.
inline bool concordem_read_restart_head(const char *buffer, ConcordemRestartHead *head)
{
  int version;
  memcpy(&version, buffer, sizeof(version));
  if (version != CONCORDEM_RESTART_VERSION) return false;
  memcpy(head, buffer, sizeof(*head));
  head->law[sizeof(head->law) - 1] = head->contacts[sizeof(head->contacts) - 1] = 0;
  return true;
}

// Create the head of a restart file. Collective: all processors must call this.
inline ConcordemRestartHead concordem_restart_head(const ConcordemNetwork *network, const ConcordemFacts &facts, bool made,
                                                   const char *law, MPI_Comm world)
{
  ConcordemRestartHead head;
  memset(&head, 0, sizeof(head));
  double mine[CONCORDEM_TOTALS];
  head.version = CONCORDEM_RESTART_VERSION;
  head.made = made;
  head.atom_width = facts.atom_width;
  head.record_reals = facts.record_reals;
  head.reference_temperature = facts.reference_temperature;
  memcpy(head.contacts, facts.contacts, sizeof(head.contacts));
  strncpy(head.law, law, sizeof(head.law) - 1);
  head.found_at = concordem_network_totals(network, mine);
  MPI_Allreduce(mine, head.totals, CONCORDEM_TOTALS, MPI_DOUBLE, MPI_SUM, world);
  return head;
}

}

#endif
