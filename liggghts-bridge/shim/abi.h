/* Functions and structures of the Rust library (../src). Generated from the Rust sources by the test c_header: do not edit.

   SPDX-License-Identifier: MIT OR Apache-2.0 */

#pragma once

#include <stddef.h>
#include <stdint.h>

/// Mass of a frozen atom, kg.
constexpr static const double CONCORDEM_FROZEN_MASS = 1e100;

/// Number of reals in [`concordem_network_sums`].
constexpr static const size_t CONCORDEM_SUMS = 15;

/// Place of the length of the longest bond among them, m; the others are to be summed over processors.
constexpr static const size_t CONCORDEM_LONGEST = 11;

/// Number of reals in [`concordem_network_totals`].
constexpr static const size_t CONCORDEM_TOTALS = 12;

/// Number of reals per row of [`concordem_network_take_breaks`].
constexpr static const size_t CONCORDEM_BREAK = 12;

/// Number of reals per row of [`concordem_network_rows`].
constexpr static const size_t CONCORDEM_ROW = 16;

/// Number of reals per line of [`concordem_network_lines`].
constexpr static const size_t CONCORDEM_LINE = 19;

/// Property: Young's modulus and Poisson's ratio.
constexpr static const uint32_t CONCORDEM_ELASTIC = 1;

/// Property: coefficient of restitution.
constexpr static const uint32_t CONCORDEM_RESTITUTION = 2;

/// Property: stiffnesses `kn`, `kt`.
constexpr static const uint32_t CONCORDEM_STIFFNESS = 4;

/// Property: damping `gamman`, `gammat`.
constexpr static const uint32_t CONCORDEM_DAMPING = 8;

/// Property: characteristic velocity.
constexpr static const uint32_t CONCORDEM_VELOCITY = 16;

/// Reals per row of [`Self::rows`].
constexpr static const size_t ConcordemNetwork_ROW = 16;

/// Reals per line of [`Self::lines`].
constexpr static const size_t ConcordemNetwork_LINE = 19;

/// Bonds and contacts of the atoms of one processor.
struct ConcordemNetwork;

/// A contact law for all pairs of types.
struct ConcordemPairLaw;

/// Recorded contact forces.
struct ConcordemPairRecord;

/// Settings and sizes that the shim needs.
struct ConcordemFacts {
  /// Reals stored per atom.
  int32_t atom_width;
  /// How many of these reals ghosts need in every step; they come last. At rebuilds, ghosts also need the one before.
  int32_t communicated;
  /// How bonds are created. 0: not at all, 1: by distance, 2: from a list, 3: within inserted clumps.
  int32_t creation;
  /// Whether to sum stored energies at every step.
  int32_t sample_every_step;
  /// Reals in the record of a bond or contact.
  int32_t record_reals;
  /// Place of the temperature among the reals of an atom; −1 without heat conduction.
  int32_t temperature;
  /// Number of groups that the tables of heat conduction name.
  int32_t heat_groups;
  /// Whether there is a file of `heat_network`.
  int32_t heat_network;
  /// Length of the name of the data file to continue with, bytes; 0: none.
  int32_t state_length;
  /// Whether the script names a contact law, possibly `none`.
  int32_t contact_given;
  /// Whether contacts follow the exclusions of the host: 1 yes, 0 no, −1 if the script does not say.
  int32_t follows_exclusions;
  /// Name of the contact law, padded with zeros.
  char contacts[32];
  /// Step at which bonds are created; negative: the first step.
  int64_t at;
  /// Bonds join atoms closer than this factor times the sum of their radii.
  double factor;
  /// Reach given by the user, m; 0: none.
  double reach;
  /// Temperature at which bonds have their reference lengths, K; 0 without heat conduction.
  double reference_temperature;
};

/// Caller's buffer for an error message, zero-terminated.
struct ConcordemMessage {
  /// First byte of the buffer; if null, the message is dropped.
  char *text;
  /// Size of the buffer, bytes.
  size_t capacity;
};

/// Atom arrays of the host: `owned` atoms of this processor, `count` with ghosts. Vectors are three reals. See `Atoms` in
/// `src/atoms.rs`.
struct ConcordemAtoms {
  int32_t owned;
  int32_t count;
  /// Bit of the fix's group.
  int32_t group;
  /// Reals of `memory` per atom.
  int32_t memory_width;
  /// Bytes of an id: 4 or 8.
  int32_t tag_bytes;
  /// Ids.
  const void *tag;
  const int32_t *kind;
  const int32_t *mask;
  const double *position;
  const double *velocity;
  const double *angular_velocity;
  const double *radius;
  const double *mass;
  /// Mass that resists a contact, kg; null: that of the atom.
  const double *effective_mass;
  double *force;
  double *torque;
  double *memory;
  /// Periodic edge lengths of the box, m; 0 where it is not periodic.
  double edge[3];
  /// Lowest coordinates of the box, m.
  double low[3];
  /// Highest coordinates of the box, m.
  double high[3];
  double dt;
  int64_t step;
};

/// The host's bond lists of the owned atoms.
struct ConcordemBondLists {
  /// Number of bonds of each atom.
  const int32_t *numbers;
  /// Ids of the partners of each atom, as wide as those of the atoms.
  const void *const *partners;
  /// Types of the bonds of each atom; one that is not positive does not count.
  const int32_t *const *types;
};

/// A bond of the user's list.
struct ConcordemBondOfList {
  /// Ids of its atoms, the lower one first.
  int64_t ids[2];
  /// Reference length, m; 0: the current distance.
  double length;
  /// Its line in the file.
  int64_t line;
};

/// What the rules of the host say about an atom.
struct ConcordemRules {
  /// Bits of the rules for two types or groups of which the atom is in the first one.
  uint64_t first;
  /// Of which it is in the second one.
  uint64_t second;
  /// Bits of the rules that exclude pairs within a molecule.
  uint64_t same_molecule;
  /// Bits of those that exclude pairs of two molecules.
  uint64_t other_molecule;
  /// Its molecule.
  int64_t molecule;
};

/// Neighbor lists of a pair style: `list` holds the indices of the `atoms` atoms that have one.
struct ConcordemPairLists {
  int32_t atoms;
  /// Bits of an entry that are the neighbor's index.
  int32_t index_bits;
  const int32_t *list;
  const int32_t *numbers;
  const int32_t *const *neighbors;
  /// Factors on the forces of a pair by the two upper bits of its entry.
  double weights[4];
};

/// An atom or a bond of the file.
struct ConcordemHeatEntry {
  /// Ids of the atoms of a bond, the lower one first; of an atom its id and 0.
  int64_t ids[2];
  /// Heat capacity (J/K) and volume (m³) of an atom, and 0; area (m²) of a bond, and the distances (m) of the atoms with the lower and
  /// the higher id from it.
  double reals[3];
  /// Its line in the file; 0: the file has no such atom or bond.
  int64_t line;
};

/// A normal model of `pair_style gran`, see `Model` in `src/pair.rs`.
struct ConcordemPairModel {
  const char *name;
  /// Number in LIGGGHTS' model hash.
  int32_t number;
  /// Properties that the model reads: bits `CONCORDEM_ELASTIC` to `CONCORDEM_VELOCITY`.
  uint32_t properties;
  int32_t hertzian;
  int32_t is_law;
};

/// Properties of `types` atom types for [`concordem_pair_new`]: one real per type (`young`, `poisson`) or per pair of types; null if
/// the model does not need them.
struct ConcordemPairProperties {
  int32_t types;
  /// 0: off, 1: no history, 2: history.
  int32_t shear;
  const double *young;
  const double *poisson;
  const double *restitution;
  const double *friction;
  const double *stiffness[4];
  double velocity;
};

/// Neighbor lists and atoms: `count` atoms with ghosts; `list` holds the indices of the `atoms` atoms that have neighbor lists.
struct ConcordemPairArrays {
  int32_t owned;
  int32_t count;
  int32_t atoms;
  int32_t frozen;
  int32_t advance;
  int32_t stride;
  const int32_t *list;
  const int32_t *numbers;
  const int32_t *const *neighbors;
  int32_t *const *flags;
  double *const *history;
  const double (*position)[3];
  const double (*velocity)[3];
  const double (*angular_velocity)[3];
  const double *radius;
  const double *mass;
  const int32_t *kind;
  const int32_t *mask;
  double (*force)[3];
  double (*torque)[3];
  /// 1 for each entry of the lists, in order, that is left out; null: none.
  const uint8_t *skip;
  double dt;
};

/// Two overlapping particles.
struct ConcordemSingleContact {
  /// Types, from 1.
  int32_t kind[2];
  /// Whether the history is valid; 0 at the start of the contact.
  int32_t known;
  /// Whether the history advances; 0 during setup.
  int32_t advance;
  /// Radii, m.
  double radius[2];
  /// Masses, kg.
  double mass[2];
  /// Positions, m.
  double position[2][3];
  /// Velocities, m/s.
  double velocity[2][3];
  /// Angular velocities, rad/s.
  double angular_velocity[2][3];
  /// Time step, s.
  double dt;
};

/// Response of a single contact. All are 0 if the law opens it.
struct ConcordemSingleResponse {
  /// Force on the first particle, N.
  double force[3];
  /// Torque on the first particle, N·m.
  double torque[3];
  /// Torque on the second particle, N·m; 0 at a wall.
  double torque_of_second[3];
  /// Normal force, N, compression positive.
  double normal_force;
  /// Secant stiffnesses of the normal and shear springs, N/m.
  double stiffness[2];
};

/// A particle in contact with a wall.
struct ConcordemWallContact {
  /// Type of the particle, from 1.
  int32_t kind;
  /// Type of the wall.
  int32_t wall_kind;
  /// Radius, m.
  double radius;
  /// Mass, kg.
  double mass;
  /// Distance of the center from the wall, m.
  double distance;
  /// Unit vector from the center to the wall.
  double normal[3];
  /// Position, m.
  double position[3];
  /// Velocity, m/s.
  double velocity[3];
  /// Angular velocity, rad/s.
  double angular_velocity[3];
  /// Velocity of the wall at the contact, m/s.
  double wall_velocity[3];
  /// Time step, s; 0 during setup.
  double dt;
};

/// Force of a contact, for the host's virial and for `compute pair/gran/local`.
struct ConcordemPairForce {
  /// Index of the first atom.
  int32_t i;
  /// Index of the second atom.
  int32_t j;
  /// Place of `j` in the list of `i`.
  int64_t place;
  /// Force on `i`, N.
  double force[3];
  /// Torque on `i`, N·m.
  double torque[3];
  /// Position of `i` minus that of `j`, m.
  double between[3];
};

extern "C" {

/// Create a network from the `count` script arguments after the style name. `si`: whether the host has SI units. Returns null and a message if
/// the arguments are invalid.
ConcordemNetwork *concordem_network_new(const char *const *words,
                                        int32_t count,
                                        int32_t types,
                                        int32_t si,
                                        ConcordemFacts *facts,
                                        const ConcordemMessage *message);

/// Write the name of the data file to continue with to `name`, `Facts::state_length` bytes.
void concordem_network_state_file(const ConcordemNetwork *network, char *name);

/// Delete a network.
void concordem_network_delete(ConcordemNetwork *network);

/// Initialize the data of a new atom, `ConcordemFacts::atom_width` reals. `mask`: bits of its groups.
void concordem_network_initial_memory(const ConcordemNetwork *network, int32_t mask, double *memory);

/// Give new owned atoms their place in the order of the particles. The shim must then update the ghosts, with the real before
/// `ConcordemFacts::communicated`.
void concordem_network_place_new(const ConcordemNetwork *network, const ConcordemAtoms *atoms);

/// Rebuild the lists of bonds and contacts after atoms have migrated. `lists`: the host's bond lists, if bonds follow them, else null.
/// `skin`, `cutoff`, `mean_radius` (of the bonded atoms) in m. Returns 0, or −1 and a message.
int64_t concordem_network_rebuild(ConcordemNetwork *network,
                                  const ConcordemAtoms *atoms,
                                  const ConcordemBondLists *lists,
                                  double skin,
                                  double cutoff,
                                  double mean_radius,
                                  const ConcordemMessage *message);

/// Read the next bonds of the user's list, at most `capacity`, on one processor. Returns their number, 0 at the end of the file, or −1 and a
/// message.
int64_t concordem_network_read_bond_list(ConcordemNetwork *network,
                                         ConcordemBondOfList *bonds,
                                         int64_t capacity,
                                         const ConcordemMessage *message);

/// Keep `count` bonds of the user's list on this processor.
void concordem_network_keep_listed(ConcordemNetwork *network, const ConcordemBondOfList *bonds, int64_t count);

/// All bonds of the user's list that this processor keeps are here. Returns 0; or −1 and a message if two lines have the same bond, and sets
/// `line` to the lowest second one.
int64_t concordem_network_sort_listed(ConcordemNetwork *network,
                                      int64_t *line,
                                      const ConcordemMessage *message);

/// Number of bonds of the user's list that this processor keeps. Writes them to `bonds` unless it is null.
int64_t concordem_network_listed(const ConcordemNetwork *network, ConcordemBondOfList *bonds);

/// Queue `count` bonds of the user's list for the next rebuild, and forget those that this processor kept.
void concordem_network_make_listed(ConcordemNetwork *network, const ConcordemBondOfList *bonds, int64_t count);

/// Queue the bonds of the host's lists for the next rebuild.
void concordem_network_make_of_lists(ConcordemNetwork *network, const ConcordemAtoms *atoms, const ConcordemBondLists *lists);

/// Queue the bonds that another command added to the atoms' lists for the next rebuild. Returns their number.
int64_t concordem_network_make_added(ConcordemNetwork *network);

/// Number of atoms with a queued bond. Writes their ids in ascending order to `ids` unless it is null.
int64_t concordem_network_queued_atoms(const ConcordemNetwork *network, int64_t *ids);

/// A number that increases whenever the bonds or the numbers of atoms change.
int64_t concordem_network_generation(const ConcordemNetwork *network);

/// Set what the next rebuild takes out of the unbonded contacts: rules for each of `count` atoms (0: no rules), and `pair_count` pairs of ids.
void concordem_network_exclude(ConcordemNetwork *network,
                               const ConcordemRules *rules,
                               int64_t count,
                               const int64_t (*pairs)[2],
                               int64_t pair_count);

/// By how much radii may have grown since the last rebuild at most, m.
double concordem_network_grown(const ConcordemNetwork *network);

/// Number of owned atoms that existed at the last rebuild.
int64_t concordem_network_known(const ConcordemNetwork *network, const ConcordemAtoms *atoms);

/// Number of atoms that owned atoms are bonded to or touch, and that are neither owned nor ghosts. Writes their ids in ascending order to
/// `ids` unless it is null.
int64_t concordem_network_absent(const ConcordemNetwork *network,
                                 const ConcordemAtoms *atoms,
                                 int64_t *ids);

/// Drop the bonds and contacts of `count` atoms that no longer exist at the next rebuild. `ids`: ascending. Returns the number of bonds
/// between them and an owned atom.
int64_t concordem_network_forget(ConcordemNetwork *network,
                                 const ConcordemAtoms *atoms,
                                 const int64_t *ids,
                                 int64_t count);

/// A time step for which the bonds and contacts of this processor are stable, s: the largest one if `dt` is larger than a quick estimate.
double concordem_network_stable_step(ConcordemNetwork *network,
                                     double dt);

/// Find the pairs of a pair style whose forces the network computes: with a contact law all pairs of the group, else the bonded ones.
/// Sets their `marks` (one per entry, in order, at least `capacity`) to 1 unless it is null. Sets `first` to the ids of the first
/// pair; returns the number of pairs.
int64_t concordem_network_own_pairs(ConcordemNetwork *network,
                                    const ConcordemAtoms *atoms,
                                    const ConcordemPairLists *lists,
                                    uint8_t *marks,
                                    int64_t capacity,
                                    int64_t *first);

/// Number of bonds that broke in the last force computation. Sets `pairs` to their atom ids, the lower one first, valid until the next
/// computation.
int64_t concordem_network_broken_now(const ConcordemNetwork *network,
                                     const int64_t (**pairs)[2]);

/// Queue bonds by distance (`bond distance FACTOR`), or with `limit` the pairs among which to choose. Returns 0, or −1 and a message.
int64_t concordem_network_make_near(ConcordemNetwork *network,
                                    const ConcordemMessage *message);

/// With `bond clumps FACTOR`: queue bonds within clumps; `clump`: a number per atom of the host (`count`), equal within a clump, 0 outside. Returns
/// the number of bonds, or −1 and a message.
int64_t concordem_network_make_clumps(ConcordemNetwork *network,
                                      const double *clump,
                                      int64_t count,
                                      const ConcordemMessage *message);

/// With `limit`: set the ids that owned atoms name as partners, 0 for none, one real per atom and ghost. Returns the number of undecided pairs.
int64_t concordem_network_name_partners(const ConcordemNetwork *network,
                                        double *named,
                                        int64_t count);

/// Queue the bonds of atoms that name each other; `named` as above, of ghosts too.
void concordem_network_bond_named(ConcordemNetwork *network, const double *named, int64_t count);

/// Rotate owned atoms by the angular velocity of the step.
void concordem_network_turn(const ConcordemNetwork *network, const ConcordemAtoms *atoms);

/// Compute forces at the current positions and add them to the atoms' forces. `setup`: nothing moves. `sample`: sum stored energies.
/// `record`: keep the force of every contact. Returns 0, or −1 and a message.
int64_t concordem_network_forces(ConcordemNetwork *network,
                                 const ConcordemAtoms *atoms,
                                 int32_t setup,
                                 int32_t sample,
                                 int32_t record,
                                 const ConcordemMessage *message);

/// Largest number of reals that [`concordem_network_pack`] writes for an atom.
int64_t concordem_network_largest_pack(const ConcordemNetwork *network);

/// Number of reals in the records of atom `tag`. Writes them to `buffer` if it is not null and `capacity` is large enough. `leaves`:
/// the atom leaves this processor.
int64_t concordem_network_pack(ConcordemNetwork *network,
                               int64_t tag,
                               int32_t leaves,
                               double *buffer,
                               int64_t capacity);

/// Read the records that [`concordem_network_pack`] wrote. Returns 0, or −1 and a message.
int64_t concordem_network_unpack(ConcordemNetwork *network,
                                 int64_t tag,
                                 const double *buffer,
                                 int64_t count,
                                 const ConcordemMessage *message);

/// Make room for `count` reals of a restart file.
void concordem_network_reserve_restored(ConcordemNetwork *network, int64_t count);

/// Keep records of a restart file that came with atom `tag`; they may be of any atoms. Returns 0, or −1 and a message.
int64_t concordem_network_restore(ConcordemNetwork *network,
                                  int64_t tag,
                                  const double *buffer,
                                  int64_t count,
                                  const ConcordemMessage *message);

/// Keep a record of a data file, `ConcordemFacts::record_reals` reals. Returns 0, or −1 and a message.
int64_t concordem_network_restore_row(ConcordemNetwork *network, const double *row, const ConcordemMessage *message);

/// Number of records that are kept.
int64_t concordem_network_restored(const ConcordemNetwork *network);

/// Number of reals of the kept record at the place `at` (the sum of these numbers of those before); 0 at the end. Sets `ids` to its
/// two atoms, and `reals` to its reals, which are valid until [`concordem_network_drop_restored`].
int64_t concordem_network_next_restored(const ConcordemNetwork *network, int64_t at, int64_t *ids, const double **reals);

/// Forget the records that are kept.
void concordem_network_drop_restored(ConcordemNetwork *network);

/// Take records for the next rebuild. Returns 0, or −1 and a message.
int64_t concordem_network_deliver(ConcordemNetwork *network, const double *buffer, int64_t count, const ConcordemMessage *message);

/// Take all records that are kept for the next rebuild, if there are no other processors.
void concordem_network_deliver_here(ConcordemNetwork *network);

/// Set `ends` to the numbers of bonds whose lower id, and whose higher id, belongs to an atom that this processor owns at present. Summed
/// over all processors they are equal, unless a bonded atom is gone.
void concordem_network_owned_ends(const ConcordemNetwork *network,
                                  const ConcordemAtoms *atoms,
                                  int64_t *ends);

/// Share all records that are to be stored by this processor among its atoms. Sets `most` to the most reals of an atom. Returns the
/// number of records, or −1 and a message.
int64_t concordem_network_begin_restart(ConcordemNetwork *network,
                                        const ConcordemAtoms *atoms,
                                        int64_t *most,
                                        const ConcordemMessage *message);

/// Number of reals that atom `i` of the host takes into the restart file.
int64_t concordem_network_restart_length(const ConcordemNetwork *network, int64_t i);

/// Set `reals` to those that atom `i` of the host takes into the restart file; they are valid until the next call. Returns their number, or
/// −1 and a message.
int64_t concordem_network_restart_piece(ConcordemNetwork *network,
                                        int64_t i,
                                        const double **reals,
                                        const ConcordemMessage *message);

/// Forget the shares of the atoms.
void concordem_network_end_restart(ConcordemNetwork *network);

/// All records that are to be stored by this processor, `ConcordemFacts::record_reals` reals each. Free them with
/// `concordem_records_delete`.
double *concordem_network_counted_rows(const ConcordemNetwork *network, const ConcordemAtoms *atoms, int64_t *count);

/// Length of the name of group `k` of the tables of heat conduction. Writes it to `name` unless it is null.
int64_t concordem_network_heat_group(const ConcordemNetwork *network, int32_t k, char *name);

/// Set the bits of the groups of the tables of heat conduction, `ConcordemFacts::heat_groups` numbers.
void concordem_network_set_heat_groups(ConcordemNetwork *network, const int32_t *bits);

/// Number of owned atoms in group `k`. Writes their volumes (m³) to `volumes` unless it is null. Returns −1 if no source heats the group.
int64_t concordem_network_heat_volumes(const ConcordemNetwork *network,
                                       const ConcordemAtoms *atoms,
                                       int32_t k,
                                       double *volumes);

/// Set the volume of all atoms of group `k`, m³.
void concordem_network_set_heat_volume(ConcordemNetwork *network, int32_t k, double volume);

/// Read the next atoms and bonds of the file of `heat_network`, at most `capacity`, on one processor. Returns their number, 0 at the end
/// of the file, or −1 and a message.
int64_t concordem_network_read_heat_network(ConcordemNetwork *network,
                                            ConcordemHeatEntry *entries,
                                            int64_t capacity,
                                            const ConcordemMessage *message);

/// Keep `count` atoms and bonds of the file of `heat_network` on this processor.
void concordem_network_keep_heat_entries(ConcordemNetwork *network, const ConcordemHeatEntry *entries, int64_t count);

/// All that this processor keeps of the file of `heat_network` is here. Returns 0; or −1 and a message if two lines have the same atom or
/// bond, and sets `line` to the lowest second one.
int64_t concordem_network_sort_heat_entries(ConcordemNetwork *network,
                                            int64_t *line,
                                            const ConcordemMessage *message);

/// Find `count` atoms and bonds, two `ids` each, among those that this processor keeps.
void concordem_network_heat_entries(const ConcordemNetwork *network,
                                    const int64_t (*ids)[2],
                                    int64_t count,
                                    ConcordemHeatEntry *entries);

/// Number of atoms or bonds that this processor asks for. 0: atoms without numbers of the file of `heat_network`; 1: all atoms, whose
/// numbers are compared; 2: bonds that the next rebuild creates; 3: all bonds, whose numbers are compared. Writes their ids to `ids` unless
/// it is null.
int64_t concordem_network_asked_heat_entries(const ConcordemNetwork *network,
                                             const ConcordemAtoms *atoms,
                                             int32_t asked,
                                             int64_t (*ids)[2]);

/// Take `count` answers.
void concordem_network_take_heat_entries(ConcordemNetwork *network, const ConcordemHeatEntry *entries, int64_t count);

/// All answers to what `concordem_network_asked_heat_entries` returned are here: use them, or compare them. Returns 0, or −1 and a message.
int64_t concordem_network_use_heat_entries(ConcordemNetwork *network,
                                           const ConcordemAtoms *atoms,
                                           int32_t asked,
                                           const ConcordemMessage *message);

/// Drop the bonds of the file of `heat_network` that this processor keeps.
void concordem_network_drop_heat_bonds(ConcordemNetwork *network);

/// Write the numbers of atoms and bonds of the file of `heat_network` that this processor keeps, and of the atoms and bonds that it counts:
/// 4 numbers; zeros without a file.
void concordem_network_heat_counts(const ConcordemNetwork *network,
                                   int64_t *counts);

/// Fail if the time step (s) is beyond the bound of heat conduction. Returns 0, or −1 and a message.
int64_t concordem_network_check_heat_step(const ConcordemNetwork *network, double dt, const ConcordemMessage *message);

/// Conduct heat for one time step. Returns 0, or −1 and a message.
int64_t concordem_network_conduct(ConcordemNetwork *network, const ConcordemAtoms *atoms, const ConcordemMessage *message);

/// Set the temperature (K) of the owned atoms with the bit of a group.
void concordem_network_set_temperature(ConcordemNetwork *network, const ConcordemAtoms *atoms, int32_t bit, double temperature);

/// Add the virial (J; xx, yy, zz, xy, xz, yz) to `total`, and the share of each of `count` atoms to `per_atom` unless it is null.
void concordem_network_virial(const ConcordemNetwork *network, double *total, double *per_atom, int64_t count);

/// Write the stress (Pa, nine reals) of each of `count` atoms at `step` to `per_atom`. Each atom gets half of every branch vector
/// (`half_branch`) or the part up to the contact point. Its volume is that of the sphere, divided by the solid fraction `fraction`
/// unless that is 0. Returns 0, or −1 and a message.
int64_t concordem_network_stress(const ConcordemNetwork *network,
                                 int64_t step,
                                 int32_t half_branch,
                                 double fraction,
                                 double *per_atom,
                                 int64_t count,
                                 const ConcordemMessage *message);

/// Write the sums for [`concordem_couple_of_sums`] at `step`: 18 reals, to be summed over processors. Returns 0, or −1 and a message.
int64_t concordem_network_couple_sums(const ConcordemNetwork *network,
                                      int64_t step,
                                      double *sums,
                                      const ConcordemMessage *message);

/// Couple stress about `centroid` (m), then stress, from the sums over all processors ([`concordem_network_couple_sums`]):
/// `μ = M/V + x⁰⊗(1×σ)` (Stránský 2018, (4.57)). `result`: nine reals in N/m, then nine in Pa. `volume` in m³.
void concordem_couple_of_sums(const double *sums, double volume, const double *centroid, double *result);

/// Write sums over the contacts that this processor counts, [`SUMS`] reals; number [`LONGEST`] is the length of the longest bond, m.
void concordem_network_sums(const ConcordemNetwork *network,
                            double *sums);

/// Write the number of bonds whose first atom, and the number of those whose second atom, this processor owns: 2 reals.
void concordem_network_ends(const ConcordemNetwork *network, double *ends);

/// Write totals for a restart file, [`TOTALS`] reals. Returns the step whose forces are stored, −1 if there is none.
int64_t concordem_network_totals(const ConcordemNetwork *network, double *totals);

/// Continue from a restart file. `totals`: [`TOTALS`] reals. `found_at`: the step whose forces the file contains, −1 if there is none.
void concordem_network_resume(ConcordemNetwork *network,
                              const double *totals,
                              int64_t found_at);

/// Rows of the recorded contacts, [`ROW`] reals each. Free them with [`concordem_rows_delete`].
double *concordem_network_rows(const ConcordemNetwork *network, int64_t *count);

/// Lines of the recorded contacts between atoms whose `mask`, one per atom of the host (`atoms`), has a bit of `group`; [`LINE`] reals each. Free
/// them with [`concordem_records_delete`].
double *concordem_network_lines(const ConcordemNetwork *network,
                                const int32_t *mask,
                                int64_t atoms,
                                int32_t group,
                                int64_t *count);

/// Keep rows for [`concordem_network_take_breaks`] from now on.
void concordem_network_keep_breaks(ConcordemNetwork *network);

/// Rows of the bonds that broke since the last call, [`BREAK`] reals each. Free them with [`concordem_records_delete`].
double *concordem_network_take_breaks(ConcordemNetwork *network, int64_t *count);

/// Free rows.
void concordem_rows_delete(double *rows, int64_t count);

/// Records of all contacts, `length` reals each. Free them with [`concordem_records_delete`].
double *concordem_network_records(const ConcordemNetwork *network, int64_t *count, int64_t *length);

/// Free records.
void concordem_records_delete(double *reals, int64_t count, int64_t length);

/// Hash of the C header that this library was built with. The shim compares it to the hash of its own header.
uint64_t concordem_header_hash();

/// Returns the number of models. Writes model `index` to `model` if it exists.
int32_t concordem_pair_model(int32_t index, ConcordemPairModel *model);

/// Create the law of model `model`. Returns null and a message if the parameters are invalid.
ConcordemPairLaw *concordem_pair_new(int32_t model, const ConcordemPairProperties *properties, const ConcordemMessage *message);

/// Delete a law.
void concordem_pair_delete(ConcordemPairLaw *law);

/// Returns the number of reals in the history of model `model`, or −1 if there is no such model. Writes 1 to `odd` for every real
/// that changes sign when the two atoms are swapped, else 0.
int32_t concordem_pair_history(int32_t model, int32_t *odd, int32_t capacity);

/// Add the forces of all pairs. Returns the number of contacts in `record`, 0 if `record` is null, or −1 and a message.
/// [`concordem_pair_recorded`] returns the recorded forces.
int64_t concordem_pair_compute(const ConcordemPairLaw *law,
                               const ConcordemPairArrays *arrays,
                               ConcordemPairRecord *record,
                               const ConcordemMessage *message);

/// Write the response of a contact of two overlapping particles to `response`. `history` has `width` reals. A cohesion model adds the
/// normal force `added` (N, compression positive) to the force that limits friction; it must be 0 for ConcorDEM laws. Returns 0, or −1
/// and a message.
int64_t concordem_pair_single(const ConcordemPairLaw *law,
                              const ConcordemSingleContact *contact,
                              double added,
                              double *history,
                              int32_t width,
                              ConcordemSingleResponse *response,
                              const ConcordemMessage *message);

/// As [`concordem_pair_single`], for a particle that overlaps a wall.
int64_t concordem_pair_wall(const ConcordemPairLaw *law,
                            const ConcordemWallContact *contact,
                            double added,
                            double *history,
                            int32_t width,
                            ConcordemSingleResponse *response,
                            const ConcordemMessage *message);

/// Create a record for [`concordem_pair_compute`].
ConcordemPairRecord *concordem_pair_record_new();

/// The forces in the record, valid until the next computation.
const ConcordemPairForce *concordem_pair_recorded(const ConcordemPairRecord *record);

/// Delete a record.
void concordem_pair_record_delete(ConcordemPairRecord *record);

/// Write the name of law `index` to `name` (`capacity` bytes, zero-terminated); `bonds` selects the bond laws (1) or the contact laws
/// (0). Returns the length of the name, or −1 if there is no such law or the name does not fit.
int32_t concordem_law_name(int32_t bonds,
                           int32_t index,
                           char *name,
                           size_t capacity);

}  // extern "C"

// Layout of the structures in Rust.
static_assert(offsetof(ConcordemMessage, text) == 0 && sizeof(ConcordemMessage::text) == 8, "ConcordemMessage::text");
static_assert(offsetof(ConcordemMessage, capacity) == 8 && sizeof(ConcordemMessage::capacity) == 8, "ConcordemMessage::capacity");
static_assert(sizeof(ConcordemMessage) == 16 && alignof(ConcordemMessage) == 8, "ConcordemMessage");
static_assert(offsetof(ConcordemAtoms, owned) == 0 && sizeof(ConcordemAtoms::owned) == 4, "ConcordemAtoms::owned");
static_assert(offsetof(ConcordemAtoms, count) == 4 && sizeof(ConcordemAtoms::count) == 4, "ConcordemAtoms::count");
static_assert(offsetof(ConcordemAtoms, group) == 8 && sizeof(ConcordemAtoms::group) == 4, "ConcordemAtoms::group");
static_assert(offsetof(ConcordemAtoms, memory_width) == 12 && sizeof(ConcordemAtoms::memory_width) == 4, "ConcordemAtoms::memory_width");
static_assert(offsetof(ConcordemAtoms, tag_bytes) == 16 && sizeof(ConcordemAtoms::tag_bytes) == 4, "ConcordemAtoms::tag_bytes");
static_assert(offsetof(ConcordemAtoms, tag) == 24 && sizeof(ConcordemAtoms::tag) == 8, "ConcordemAtoms::tag");
static_assert(offsetof(ConcordemAtoms, kind) == 32 && sizeof(ConcordemAtoms::kind) == 8, "ConcordemAtoms::kind");
static_assert(offsetof(ConcordemAtoms, mask) == 40 && sizeof(ConcordemAtoms::mask) == 8, "ConcordemAtoms::mask");
static_assert(offsetof(ConcordemAtoms, position) == 48 && sizeof(ConcordemAtoms::position) == 8, "ConcordemAtoms::position");
static_assert(offsetof(ConcordemAtoms, velocity) == 56 && sizeof(ConcordemAtoms::velocity) == 8, "ConcordemAtoms::velocity");
static_assert(offsetof(ConcordemAtoms, angular_velocity) == 64 && sizeof(ConcordemAtoms::angular_velocity) == 8, "ConcordemAtoms::angular_velocity");
static_assert(offsetof(ConcordemAtoms, radius) == 72 && sizeof(ConcordemAtoms::radius) == 8, "ConcordemAtoms::radius");
static_assert(offsetof(ConcordemAtoms, mass) == 80 && sizeof(ConcordemAtoms::mass) == 8, "ConcordemAtoms::mass");
static_assert(offsetof(ConcordemAtoms, effective_mass) == 88 && sizeof(ConcordemAtoms::effective_mass) == 8, "ConcordemAtoms::effective_mass");
static_assert(offsetof(ConcordemAtoms, force) == 96 && sizeof(ConcordemAtoms::force) == 8, "ConcordemAtoms::force");
static_assert(offsetof(ConcordemAtoms, torque) == 104 && sizeof(ConcordemAtoms::torque) == 8, "ConcordemAtoms::torque");
static_assert(offsetof(ConcordemAtoms, memory) == 112 && sizeof(ConcordemAtoms::memory) == 8, "ConcordemAtoms::memory");
static_assert(offsetof(ConcordemAtoms, edge) == 120 && sizeof(ConcordemAtoms::edge) == 24, "ConcordemAtoms::edge");
static_assert(offsetof(ConcordemAtoms, low) == 144 && sizeof(ConcordemAtoms::low) == 24, "ConcordemAtoms::low");
static_assert(offsetof(ConcordemAtoms, high) == 168 && sizeof(ConcordemAtoms::high) == 24, "ConcordemAtoms::high");
static_assert(offsetof(ConcordemAtoms, dt) == 192 && sizeof(ConcordemAtoms::dt) == 8, "ConcordemAtoms::dt");
static_assert(offsetof(ConcordemAtoms, step) == 200 && sizeof(ConcordemAtoms::step) == 8, "ConcordemAtoms::step");
static_assert(sizeof(ConcordemAtoms) == 208 && alignof(ConcordemAtoms) == 8, "ConcordemAtoms");
static_assert(offsetof(ConcordemFacts, atom_width) == 0 && sizeof(ConcordemFacts::atom_width) == 4, "ConcordemFacts::atom_width");
static_assert(offsetof(ConcordemFacts, communicated) == 4 && sizeof(ConcordemFacts::communicated) == 4, "ConcordemFacts::communicated");
static_assert(offsetof(ConcordemFacts, creation) == 8 && sizeof(ConcordemFacts::creation) == 4, "ConcordemFacts::creation");
static_assert(offsetof(ConcordemFacts, sample_every_step) == 12 && sizeof(ConcordemFacts::sample_every_step) == 4, "ConcordemFacts::sample_every_step");
static_assert(offsetof(ConcordemFacts, record_reals) == 16 && sizeof(ConcordemFacts::record_reals) == 4, "ConcordemFacts::record_reals");
static_assert(offsetof(ConcordemFacts, temperature) == 20 && sizeof(ConcordemFacts::temperature) == 4, "ConcordemFacts::temperature");
static_assert(offsetof(ConcordemFacts, heat_groups) == 24 && sizeof(ConcordemFacts::heat_groups) == 4, "ConcordemFacts::heat_groups");
static_assert(offsetof(ConcordemFacts, heat_network) == 28 && sizeof(ConcordemFacts::heat_network) == 4, "ConcordemFacts::heat_network");
static_assert(offsetof(ConcordemFacts, state_length) == 32 && sizeof(ConcordemFacts::state_length) == 4, "ConcordemFacts::state_length");
static_assert(offsetof(ConcordemFacts, contact_given) == 36 && sizeof(ConcordemFacts::contact_given) == 4, "ConcordemFacts::contact_given");
static_assert(offsetof(ConcordemFacts, follows_exclusions) == 40 && sizeof(ConcordemFacts::follows_exclusions) == 4, "ConcordemFacts::follows_exclusions");
static_assert(offsetof(ConcordemFacts, contacts) == 44 && sizeof(ConcordemFacts::contacts) == 32, "ConcordemFacts::contacts");
static_assert(offsetof(ConcordemFacts, at) == 80 && sizeof(ConcordemFacts::at) == 8, "ConcordemFacts::at");
static_assert(offsetof(ConcordemFacts, factor) == 88 && sizeof(ConcordemFacts::factor) == 8, "ConcordemFacts::factor");
static_assert(offsetof(ConcordemFacts, reach) == 96 && sizeof(ConcordemFacts::reach) == 8, "ConcordemFacts::reach");
static_assert(offsetof(ConcordemFacts, reference_temperature) == 104 && sizeof(ConcordemFacts::reference_temperature) == 8, "ConcordemFacts::reference_temperature");
static_assert(sizeof(ConcordemFacts) == 112 && alignof(ConcordemFacts) == 8, "ConcordemFacts");
static_assert(offsetof(ConcordemPairLists, atoms) == 0 && sizeof(ConcordemPairLists::atoms) == 4, "ConcordemPairLists::atoms");
static_assert(offsetof(ConcordemPairLists, index_bits) == 4 && sizeof(ConcordemPairLists::index_bits) == 4, "ConcordemPairLists::index_bits");
static_assert(offsetof(ConcordemPairLists, list) == 8 && sizeof(ConcordemPairLists::list) == 8, "ConcordemPairLists::list");
static_assert(offsetof(ConcordemPairLists, numbers) == 16 && sizeof(ConcordemPairLists::numbers) == 8, "ConcordemPairLists::numbers");
static_assert(offsetof(ConcordemPairLists, neighbors) == 24 && sizeof(ConcordemPairLists::neighbors) == 8, "ConcordemPairLists::neighbors");
static_assert(offsetof(ConcordemPairLists, weights) == 32 && sizeof(ConcordemPairLists::weights) == 32, "ConcordemPairLists::weights");
static_assert(sizeof(ConcordemPairLists) == 64 && alignof(ConcordemPairLists) == 8, "ConcordemPairLists");
static_assert(offsetof(ConcordemRules, first) == 0 && sizeof(ConcordemRules::first) == 8, "ConcordemRules::first");
static_assert(offsetof(ConcordemRules, second) == 8 && sizeof(ConcordemRules::second) == 8, "ConcordemRules::second");
static_assert(offsetof(ConcordemRules, same_molecule) == 16 && sizeof(ConcordemRules::same_molecule) == 8, "ConcordemRules::same_molecule");
static_assert(offsetof(ConcordemRules, other_molecule) == 24 && sizeof(ConcordemRules::other_molecule) == 8, "ConcordemRules::other_molecule");
static_assert(offsetof(ConcordemRules, molecule) == 32 && sizeof(ConcordemRules::molecule) == 8, "ConcordemRules::molecule");
static_assert(sizeof(ConcordemRules) == 40 && alignof(ConcordemRules) == 8, "ConcordemRules");
static_assert(offsetof(ConcordemBondLists, numbers) == 0 && sizeof(ConcordemBondLists::numbers) == 8, "ConcordemBondLists::numbers");
static_assert(offsetof(ConcordemBondLists, partners) == 8 && sizeof(ConcordemBondLists::partners) == 8, "ConcordemBondLists::partners");
static_assert(offsetof(ConcordemBondLists, types) == 16 && sizeof(ConcordemBondLists::types) == 8, "ConcordemBondLists::types");
static_assert(sizeof(ConcordemBondLists) == 24 && alignof(ConcordemBondLists) == 8, "ConcordemBondLists");
static_assert(offsetof(ConcordemBondOfList, ids) == 0 && sizeof(ConcordemBondOfList::ids) == 16, "ConcordemBondOfList::ids");
static_assert(offsetof(ConcordemBondOfList, length) == 16 && sizeof(ConcordemBondOfList::length) == 8, "ConcordemBondOfList::length");
static_assert(offsetof(ConcordemBondOfList, line) == 24 && sizeof(ConcordemBondOfList::line) == 8, "ConcordemBondOfList::line");
static_assert(sizeof(ConcordemBondOfList) == 32 && alignof(ConcordemBondOfList) == 8, "ConcordemBondOfList");
static_assert(offsetof(ConcordemHeatEntry, ids) == 0 && sizeof(ConcordemHeatEntry::ids) == 16, "ConcordemHeatEntry::ids");
static_assert(offsetof(ConcordemHeatEntry, reals) == 16 && sizeof(ConcordemHeatEntry::reals) == 24, "ConcordemHeatEntry::reals");
static_assert(offsetof(ConcordemHeatEntry, line) == 40 && sizeof(ConcordemHeatEntry::line) == 8, "ConcordemHeatEntry::line");
static_assert(sizeof(ConcordemHeatEntry) == 48 && alignof(ConcordemHeatEntry) == 8, "ConcordemHeatEntry");
static_assert(offsetof(ConcordemPairForce, i) == 0 && sizeof(ConcordemPairForce::i) == 4, "ConcordemPairForce::i");
static_assert(offsetof(ConcordemPairForce, j) == 4 && sizeof(ConcordemPairForce::j) == 4, "ConcordemPairForce::j");
static_assert(offsetof(ConcordemPairForce, place) == 8 && sizeof(ConcordemPairForce::place) == 8, "ConcordemPairForce::place");
static_assert(offsetof(ConcordemPairForce, force) == 16 && sizeof(ConcordemPairForce::force) == 24, "ConcordemPairForce::force");
static_assert(offsetof(ConcordemPairForce, torque) == 40 && sizeof(ConcordemPairForce::torque) == 24, "ConcordemPairForce::torque");
static_assert(offsetof(ConcordemPairForce, between) == 64 && sizeof(ConcordemPairForce::between) == 24, "ConcordemPairForce::between");
static_assert(sizeof(ConcordemPairForce) == 88 && alignof(ConcordemPairForce) == 8, "ConcordemPairForce");
static_assert(offsetof(ConcordemWallContact, kind) == 0 && sizeof(ConcordemWallContact::kind) == 4, "ConcordemWallContact::kind");
static_assert(offsetof(ConcordemWallContact, wall_kind) == 4 && sizeof(ConcordemWallContact::wall_kind) == 4, "ConcordemWallContact::wall_kind");
static_assert(offsetof(ConcordemWallContact, radius) == 8 && sizeof(ConcordemWallContact::radius) == 8, "ConcordemWallContact::radius");
static_assert(offsetof(ConcordemWallContact, mass) == 16 && sizeof(ConcordemWallContact::mass) == 8, "ConcordemWallContact::mass");
static_assert(offsetof(ConcordemWallContact, distance) == 24 && sizeof(ConcordemWallContact::distance) == 8, "ConcordemWallContact::distance");
static_assert(offsetof(ConcordemWallContact, normal) == 32 && sizeof(ConcordemWallContact::normal) == 24, "ConcordemWallContact::normal");
static_assert(offsetof(ConcordemWallContact, position) == 56 && sizeof(ConcordemWallContact::position) == 24, "ConcordemWallContact::position");
static_assert(offsetof(ConcordemWallContact, velocity) == 80 && sizeof(ConcordemWallContact::velocity) == 24, "ConcordemWallContact::velocity");
static_assert(offsetof(ConcordemWallContact, angular_velocity) == 104 && sizeof(ConcordemWallContact::angular_velocity) == 24, "ConcordemWallContact::angular_velocity");
static_assert(offsetof(ConcordemWallContact, wall_velocity) == 128 && sizeof(ConcordemWallContact::wall_velocity) == 24, "ConcordemWallContact::wall_velocity");
static_assert(offsetof(ConcordemWallContact, dt) == 152 && sizeof(ConcordemWallContact::dt) == 8, "ConcordemWallContact::dt");
static_assert(sizeof(ConcordemWallContact) == 160 && alignof(ConcordemWallContact) == 8, "ConcordemWallContact");
static_assert(offsetof(ConcordemSingleContact, kind) == 0 && sizeof(ConcordemSingleContact::kind) == 8, "ConcordemSingleContact::kind");
static_assert(offsetof(ConcordemSingleContact, known) == 8 && sizeof(ConcordemSingleContact::known) == 4, "ConcordemSingleContact::known");
static_assert(offsetof(ConcordemSingleContact, advance) == 12 && sizeof(ConcordemSingleContact::advance) == 4, "ConcordemSingleContact::advance");
static_assert(offsetof(ConcordemSingleContact, radius) == 16 && sizeof(ConcordemSingleContact::radius) == 16, "ConcordemSingleContact::radius");
static_assert(offsetof(ConcordemSingleContact, mass) == 32 && sizeof(ConcordemSingleContact::mass) == 16, "ConcordemSingleContact::mass");
static_assert(offsetof(ConcordemSingleContact, position) == 48 && sizeof(ConcordemSingleContact::position) == 48, "ConcordemSingleContact::position");
static_assert(offsetof(ConcordemSingleContact, velocity) == 96 && sizeof(ConcordemSingleContact::velocity) == 48, "ConcordemSingleContact::velocity");
static_assert(offsetof(ConcordemSingleContact, angular_velocity) == 144 && sizeof(ConcordemSingleContact::angular_velocity) == 48, "ConcordemSingleContact::angular_velocity");
static_assert(offsetof(ConcordemSingleContact, dt) == 192 && sizeof(ConcordemSingleContact::dt) == 8, "ConcordemSingleContact::dt");
static_assert(sizeof(ConcordemSingleContact) == 200 && alignof(ConcordemSingleContact) == 8, "ConcordemSingleContact");
static_assert(offsetof(ConcordemSingleResponse, force) == 0 && sizeof(ConcordemSingleResponse::force) == 24, "ConcordemSingleResponse::force");
static_assert(offsetof(ConcordemSingleResponse, torque) == 24 && sizeof(ConcordemSingleResponse::torque) == 24, "ConcordemSingleResponse::torque");
static_assert(offsetof(ConcordemSingleResponse, torque_of_second) == 48 && sizeof(ConcordemSingleResponse::torque_of_second) == 24, "ConcordemSingleResponse::torque_of_second");
static_assert(offsetof(ConcordemSingleResponse, normal_force) == 72 && sizeof(ConcordemSingleResponse::normal_force) == 8, "ConcordemSingleResponse::normal_force");
static_assert(offsetof(ConcordemSingleResponse, stiffness) == 80 && sizeof(ConcordemSingleResponse::stiffness) == 16, "ConcordemSingleResponse::stiffness");
static_assert(sizeof(ConcordemSingleResponse) == 96 && alignof(ConcordemSingleResponse) == 8, "ConcordemSingleResponse");
static_assert(offsetof(ConcordemPairModel, name) == 0 && sizeof(ConcordemPairModel::name) == 8, "ConcordemPairModel::name");
static_assert(offsetof(ConcordemPairModel, number) == 8 && sizeof(ConcordemPairModel::number) == 4, "ConcordemPairModel::number");
static_assert(offsetof(ConcordemPairModel, properties) == 12 && sizeof(ConcordemPairModel::properties) == 4, "ConcordemPairModel::properties");
static_assert(offsetof(ConcordemPairModel, hertzian) == 16 && sizeof(ConcordemPairModel::hertzian) == 4, "ConcordemPairModel::hertzian");
static_assert(offsetof(ConcordemPairModel, is_law) == 20 && sizeof(ConcordemPairModel::is_law) == 4, "ConcordemPairModel::is_law");
static_assert(sizeof(ConcordemPairModel) == 24 && alignof(ConcordemPairModel) == 8, "ConcordemPairModel");
static_assert(offsetof(ConcordemPairProperties, types) == 0 && sizeof(ConcordemPairProperties::types) == 4, "ConcordemPairProperties::types");
static_assert(offsetof(ConcordemPairProperties, shear) == 4 && sizeof(ConcordemPairProperties::shear) == 4, "ConcordemPairProperties::shear");
static_assert(offsetof(ConcordemPairProperties, young) == 8 && sizeof(ConcordemPairProperties::young) == 8, "ConcordemPairProperties::young");
static_assert(offsetof(ConcordemPairProperties, poisson) == 16 && sizeof(ConcordemPairProperties::poisson) == 8, "ConcordemPairProperties::poisson");
static_assert(offsetof(ConcordemPairProperties, restitution) == 24 && sizeof(ConcordemPairProperties::restitution) == 8, "ConcordemPairProperties::restitution");
static_assert(offsetof(ConcordemPairProperties, friction) == 32 && sizeof(ConcordemPairProperties::friction) == 8, "ConcordemPairProperties::friction");
static_assert(offsetof(ConcordemPairProperties, stiffness) == 40 && sizeof(ConcordemPairProperties::stiffness) == 32, "ConcordemPairProperties::stiffness");
static_assert(offsetof(ConcordemPairProperties, velocity) == 72 && sizeof(ConcordemPairProperties::velocity) == 8, "ConcordemPairProperties::velocity");
static_assert(sizeof(ConcordemPairProperties) == 80 && alignof(ConcordemPairProperties) == 8, "ConcordemPairProperties");
static_assert(offsetof(ConcordemPairArrays, owned) == 0 && sizeof(ConcordemPairArrays::owned) == 4, "ConcordemPairArrays::owned");
static_assert(offsetof(ConcordemPairArrays, count) == 4 && sizeof(ConcordemPairArrays::count) == 4, "ConcordemPairArrays::count");
static_assert(offsetof(ConcordemPairArrays, atoms) == 8 && sizeof(ConcordemPairArrays::atoms) == 4, "ConcordemPairArrays::atoms");
static_assert(offsetof(ConcordemPairArrays, frozen) == 12 && sizeof(ConcordemPairArrays::frozen) == 4, "ConcordemPairArrays::frozen");
static_assert(offsetof(ConcordemPairArrays, advance) == 16 && sizeof(ConcordemPairArrays::advance) == 4, "ConcordemPairArrays::advance");
static_assert(offsetof(ConcordemPairArrays, stride) == 20 && sizeof(ConcordemPairArrays::stride) == 4, "ConcordemPairArrays::stride");
static_assert(offsetof(ConcordemPairArrays, list) == 24 && sizeof(ConcordemPairArrays::list) == 8, "ConcordemPairArrays::list");
static_assert(offsetof(ConcordemPairArrays, numbers) == 32 && sizeof(ConcordemPairArrays::numbers) == 8, "ConcordemPairArrays::numbers");
static_assert(offsetof(ConcordemPairArrays, neighbors) == 40 && sizeof(ConcordemPairArrays::neighbors) == 8, "ConcordemPairArrays::neighbors");
static_assert(offsetof(ConcordemPairArrays, flags) == 48 && sizeof(ConcordemPairArrays::flags) == 8, "ConcordemPairArrays::flags");
static_assert(offsetof(ConcordemPairArrays, history) == 56 && sizeof(ConcordemPairArrays::history) == 8, "ConcordemPairArrays::history");
static_assert(offsetof(ConcordemPairArrays, position) == 64 && sizeof(ConcordemPairArrays::position) == 8, "ConcordemPairArrays::position");
static_assert(offsetof(ConcordemPairArrays, velocity) == 72 && sizeof(ConcordemPairArrays::velocity) == 8, "ConcordemPairArrays::velocity");
static_assert(offsetof(ConcordemPairArrays, angular_velocity) == 80 && sizeof(ConcordemPairArrays::angular_velocity) == 8, "ConcordemPairArrays::angular_velocity");
static_assert(offsetof(ConcordemPairArrays, radius) == 88 && sizeof(ConcordemPairArrays::radius) == 8, "ConcordemPairArrays::radius");
static_assert(offsetof(ConcordemPairArrays, mass) == 96 && sizeof(ConcordemPairArrays::mass) == 8, "ConcordemPairArrays::mass");
static_assert(offsetof(ConcordemPairArrays, kind) == 104 && sizeof(ConcordemPairArrays::kind) == 8, "ConcordemPairArrays::kind");
static_assert(offsetof(ConcordemPairArrays, mask) == 112 && sizeof(ConcordemPairArrays::mask) == 8, "ConcordemPairArrays::mask");
static_assert(offsetof(ConcordemPairArrays, force) == 120 && sizeof(ConcordemPairArrays::force) == 8, "ConcordemPairArrays::force");
static_assert(offsetof(ConcordemPairArrays, torque) == 128 && sizeof(ConcordemPairArrays::torque) == 8, "ConcordemPairArrays::torque");
static_assert(offsetof(ConcordemPairArrays, skip) == 136 && sizeof(ConcordemPairArrays::skip) == 8, "ConcordemPairArrays::skip");
static_assert(offsetof(ConcordemPairArrays, dt) == 144 && sizeof(ConcordemPairArrays::dt) == 8, "ConcordemPairArrays::dt");
static_assert(sizeof(ConcordemPairArrays) == 152 && alignof(ConcordemPairArrays) == 8, "ConcordemPairArrays");

#define CONCORDEM_HEADER_HASH UINT64_C(0x30b5e41854864878)
