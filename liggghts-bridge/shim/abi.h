/* What the Rust side offers (src/abi.rs).

   SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef CONCORDEM_ABI_H
#define CONCORDEM_ABI_H

#include <stddef.h>
#include <stdint.h>

extern "C" {

struct ConcordemNetwork;

/* Atoms as LIGGGHTS holds them: `owned` of this processor, `count` with the copies of neighbours. */
struct ConcordemAtoms {
  int32_t owned, count, group, memory_width;
  const int32_t *tag, *type, *mask;
  const double *position, *velocity, *spin, *radius, *mass;
  double *force, *torque, *memory;
  double edge[3];
  double dt;
  int64_t step;
};

struct ConcordemFacts {
  int32_t atom_width, communicated, creation, sample_every_step, contacts;
  int64_t at;
  double factor, reach;
};

struct ConcordemMessage {
  char *text;
  size_t capacity;
};

/* Reals of concordem_network_sums, _totals, and of a row of _rows. */
enum { CONCORDEM_SUMS = 12, CONCORDEM_TOTALS = 9, CONCORDEM_ROW = 16 };

// Name of law `index` of bonds, or of contacts; its length, -1 past the last.
int32_t concordem_law_name(int32_t bonds, int32_t index, char *name, size_t capacity);

ConcordemNetwork *concordem_network_new(const char *const *words, int32_t count, int32_t types, ConcordemFacts *,
                                        const ConcordemMessage *);
void concordem_network_delete(ConcordemNetwork *);
void concordem_network_initial_memory(const ConcordemNetwork *, double *);
int64_t concordem_network_rebuild(ConcordemNetwork *, const ConcordemAtoms *, double skin, double cutoff, double mean_radius,
                                  const ConcordemMessage *);
void concordem_network_make_listed(ConcordemNetwork *);
void concordem_network_make_given(ConcordemNetwork *, const int32_t (*pairs)[2], int64_t count);
int64_t concordem_network_broken_now(const ConcordemNetwork *, const int32_t (**pairs)[2]);
void concordem_network_virial(const ConcordemNetwork *, double *total, double *per_atom, int64_t count);
int64_t concordem_network_listed_atoms(const ConcordemNetwork *, int32_t *);
double concordem_network_longest_listed(const ConcordemNetwork *, const double *positions, const double *edges);
int64_t concordem_network_make_near(ConcordemNetwork *, const ConcordemMessage *);
void concordem_network_turn(const ConcordemNetwork *, const ConcordemAtoms *);
int64_t concordem_network_forces(ConcordemNetwork *, const ConcordemAtoms *, int32_t setup, int32_t sample, int32_t record,
                                 const ConcordemMessage *);
int64_t concordem_network_largest_pack(ConcordemNetwork *);
int64_t concordem_network_pack(ConcordemNetwork *, int32_t tag, int32_t leaves, double *, int64_t capacity);
int64_t concordem_network_unpack(ConcordemNetwork *, int32_t tag, const double *, int64_t count, const ConcordemMessage *);
void concordem_network_sums(const ConcordemNetwork *, double *);
void concordem_network_ends(const ConcordemNetwork *, double *);
int64_t concordem_network_totals(const ConcordemNetwork *, double *);
void concordem_network_resume(ConcordemNetwork *, const double *, int64_t found_at);
int64_t concordem_network_stress(const ConcordemNetwork *, int64_t step, int32_t half_branch, double fraction, double *per_atom,
                                 int64_t count, const ConcordemMessage *);
int64_t concordem_network_couple_sums(const ConcordemNetwork *, int64_t step, double *sums, const ConcordemMessage *);
void concordem_couple_of_sums(const double *sums, double volume, const double *centroid, double *result);
double *concordem_network_rows(const ConcordemNetwork *, int64_t *count);
void concordem_rows_delete(double *, int64_t count);
double *concordem_network_records(const ConcordemNetwork *, int64_t *count, int64_t *length);
void concordem_records_delete(double *, int64_t count, int64_t length);

struct ConcordemPairLaw;
struct ConcordemPairRecord;

struct ConcordemPairProperties {
  int32_t types, shear;
  const double *young, *poisson, *restitution, *friction;
  const double *stiffness[4];
  double velocity;
};

struct ConcordemPairArrays {
  int32_t owned, count, atoms, frozen, advance, stride;
  const int32_t *list, *numbers;
  int32_t *const *neighbours;
  int32_t *const *flags;
  double *const *history;
  const double *position, *velocity, *spin, *radius, *mass;
  const int32_t *type, *mask;
  double *force, *torque;
  double dt;
};

struct ConcordemPairForce {
  int32_t i, j;
  double force[3], torque[3], between[3];
};

struct ConcordemWallContact {
  int32_t type, wall_type;
  double radius, mass, distance;
  double normal[3], position[3], velocity[3], spin[3], wall_velocity[3];
  double dt;
};

ConcordemPairLaw *concordem_pair_new(int32_t model, const ConcordemPairProperties *, const ConcordemMessage *);
void concordem_pair_delete(ConcordemPairLaw *);
int32_t concordem_pair_history(int32_t model, int32_t *odd, int32_t capacity);
int64_t concordem_pair_compute(const ConcordemPairLaw *, const ConcordemPairArrays *, ConcordemPairRecord *,
                               const ConcordemMessage *);
int64_t concordem_pair_wall(const ConcordemPairLaw *, const ConcordemWallContact *, double *history, int32_t width, double *wrench,
                            const ConcordemMessage *);
ConcordemPairRecord *concordem_pair_record_new();
const ConcordemPairForce *concordem_pair_recorded(const ConcordemPairRecord *);
void concordem_pair_record_delete(ConcordemPairRecord *);

}

#endif
