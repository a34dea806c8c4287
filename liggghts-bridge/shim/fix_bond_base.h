/* Host-independent part of fix concordem/bond: arguments, data per atom, ghosts, creation of bonds, restart, sums. The derived fixes
   for LIGGGHTS (fix_bond.h) and LAMMPS (../lammps/fix_bond.h) define when forces are computed and where they are added.

   SPDX-License-Identifier: GPL-2.0-or-later */
#ifndef CONCORDEM_FIX_BOND_BASE_H
#define CONCORDEM_FIX_BOND_BASE_H

#include "fix.h"

#include <array>
#include <string>
#include <vector>

#include "host.h"

namespace LAMMPS_NS {

class FixBondBase : public Fix {
 public:
  FixBondBase(LAMMPS *, int, char **);
  ~FixBondBase() override;

  void grow_arrays(int) override;
  void copy_arrays(int, int, int) override;
  void set_arrays(int) override;
  int pack_exchange(int, double *) override;
  int unpack_exchange(int, double *) override;

  void write_restart(FILE *) override;
  void restart(char *) override;
  int pack_restart(int, double *) override;
  void unpack_restart(int, int) override;
  int size_restart(int) override;
  int maxsize_restart() override;

  void write_data_section_size(int, int &, int &) override;
  void write_data_section_pack(int, double **) override;
  void write_data_section_keyword(int, FILE *) override;
  void write_data_section(int, FILE *, int, double **, int) override;

  double compute_scalar() override;
  double compute_vector(int) override;
  double memory_usage() override;
  int modify_param(int, char **) override;   // `temperature GROUP VALUE`

  const ConcordemNetwork *network() const { return network_; }
  ConcordemNetwork *network() { return network_; }

 protected:
  ConcordemNetwork *network_ = nullptr;
  ConcordemFacts facts_;
  std::string law_;
  bool periodic_ = false;
  bool lists_ = false;     // bonds come from the atoms' bond lists (LAMMPS)
  bool contacts_ = false;  // it computes contacts
  bool made_ = false;      // the bonds of the script have been created
  double reach_ = 0.0;     // distance up to which ghosts are needed, m
  double mean_radius_ = 0.0;                 // of the atoms of the first bonds, m; 0 before
  double edge_[3] = {-1.0, -1.0, -1.0};      // periodic edges at the last setup, m; 0 where not periodic, -1 before
  double virial_[6] = {0.0};                 // our part of the last virial, J
  bigint virial_at_ = -1;                    // its step
  int largest_piece_ = 0;                    // most reals of records of an atom on any processor in the last restart file
  std::string lost_;                         // fix of the restart file whose bonds nobody takes over
  char text_[2048];
  ConcordemMessage message_;
  double sums_[CONCORDEM_SUMS];
  bigint summed_at_ = -1, sampled_at_ = -1;
  int exchange_size_ = 0;       // most reals of an atom that changes its processor, on any processor
  double smallest_ = 0.0;       // radius, m
  double room_ = 0.0;           // by which radii may grow between two rebuilds, m; 0 if no fix changes them
  double stable_step_ = 0.0;    // at the last setup, s; 0 before
#ifndef CONCORDEM_LAMMPS
  int maxexchange = 0;     // our part of the communication buffer; LAMMPS' class Fix has this member
#endif

  // Defined per host, in the file of the derived fix.
  [[noreturn]] void fail(const std::string &);      // on all processors
  [[noreturn]] void fail_on_this_processor();       // with the message in text_, which may exist on one processor only
  void fail_with_text_of(int);                      // on all processors, with the message in text_ of one of them; collective
  void print(const std::string &);                  // to be called on one processor
  void warn(const std::string &);                   // to be called on one processor
  void communicate_ghosts();

  // Fail if the box has changed since the last setup; `setup`: a run begins.
  void check_box(bool setup);
  // Fail if the host minimizes, if a fix changes the box, or if another of our fixes computes the same contacts. Called by init().
  void check_run();
  // The virial of this step, summed over all contacts: at the seam of two runs that of the stored forces.
  void find_virial(bool setup, double *total, double **of_atoms);
  bool creation_is_due() const;
  // Set reach_ from the longest bond, and smallest_. `given`: longest bond in the host's lists.
  void find_reach(double given);

  // What other commands change (changes.cpp).
  void prepare_exchange();       // before atoms change their processors; collective
  void send_sizes();             // before forces, after fixes have changed radii; collective
  void follow_growth();          // after forces; collective
  void follow_changes();         // before rebuild(), when the ghosts are known; collective
  enum Since { SINCE_LAST_CHECK, SINCE_CHANGE };
  void check_step(Since);        // after the bonds exist; collective
  void warn_without_contacts();
  static bool changes_radii(const Fix *);
  double ghost_cutoff() const;   // for which the host's ghosts cover reach_
  void communicate(bool rebuilds);
  int pack_ghosts(int count, const int *list, double *buffer) const;
  void unpack_ghosts(int count, int first_atom, const double *buffer);
  int reals_of_ghost() const { return sent_ ? 1 : sends_sizes_ ? 2 : facts_.communicated + rebuilds_ + (periodic_ ? 3 : 0); }
  ConcordemAtoms arrays();
  void rebuild();
  void make_bonds();
  void choose_bonds();       // of `limit N`; collective
  void make_queued();        // create the bonds that are queued; collective
  void send_to_ghosts(std::vector<double> *);   // one number per atom and ghost; collective
  void check_resumed();      // warn if a continued run has no bonds; collective
  void find_mean_radius();   // of the atoms with a queued bond; collective
  void find_forces(bool setup, bool energies, bool virial);
  void update_sums();

  // Heat conduction (heat.cpp).
  bool conducts() const { return facts_.temperature >= 0; }
  // What this processor asks for from the file of `heat_network`; the numbers are those of concordem_network_asked_heat_entries().
  enum Asked { OF_NEW_ATOMS, OF_ATOMS, OF_NEW_BONDS, OF_BONDS };
  void ask_heat_network(Asked);    // OF_NEW_BONDS: before the rebuild() that creates them; collective
  void give_heat_network();        // before measure_heated_groups(); collective
  void measure_heated_groups();    // before rebuild()
  void check_heat_step();
  void conduct();                  // one step, before atoms change their processors
  void show_temperatures();        // for output

 private:
  double **memory_ = nullptr;     // data that the network stores per atom
  double **original_ = nullptr;   // unshifted positions of ghosts, in periodic boxes only
  bool rebuilds_ = false;         // ghosts also get their place in the order of the particles
  std::vector<double> *sent_ = nullptr;   // ghosts get this number of each atom, and nothing else
  bool sends_sizes_ = false;      // ghosts get radii and masses, and nothing else
  int frozen_ = 0;                // bits of the groups of fix freeze
  std::vector<double> body_mass_;       // of each atom's body, kg; 0 outside bodies; empty without bodies
  std::vector<double> effective_mass_;  // kg
  bigint atoms_before_ = -1;      // on all processors at the last rebuild; -1 before
  bool told_lost_ = false;        // a warning about lost bonds in this run
  double checked_step_ = 0.0;     // time step that check_step has compared, s
  double warned_step_ = 0.0;      // time step of the last warning in this run, s
  std::vector<ConcordemRules> exclusion_rules_;               // for rebuild()
  std::vector<std::array<int64_t, 2> > excluded_pairs_;       // the same
  bool restored_ = false;         // records of a restart or data file wait for their delivery to the owners of their atoms
  int64_t records_of_restart_ = -1;   // their number in the file
  std::string source_;            // the file, for messages
  std::string resumed_;           // file that the bonds come from, until the first setup after it was read
  std::string state_;             // data file that the script continues from, empty if there is none
  ConcordemRestartHead head_of_data_;        // while a data file is written, as the next two
  std::vector<double> records_of_data_;
  long long rows_of_data_[2];                // atoms and records on all processors

  std::vector<std::string> heat_groups_;     // groups that the tables of heat name
  std::vector<int> heat_bits_;               // their bits

  bool compares_ = false;                    // until the first rebuild: atoms and bonds will be compared with the file of `heat_network`

  void begin_heat();
  void read_heat_network();
  void compare_heat_network();
  void drop_heat_bonds();
  void check_heat_network();
  void check_other_fixes();
  ConcordemRestartHead head();    // collective
  void resume(const ConcordemRestartHead &, const std::string &file);
  void read_state(const std::string &file);
  int64_t begin_restart();
  void deliver_restored();        // collective
  void read_bond_list();          // of the user; collective
  double longest_listed();
  // Read a file that may be larger than the memory of a processor: the first one reads it in pieces, and each keeps the lines of the ids that
  // it is the keeper of. Fails if a line is wrong, or has what an earlier line has. Collective. The functions are those of the library.
  template <class Line>
  void share_file(int64_t (*read)(ConcordemNetwork *, Line *, int64_t, const ConcordemMessage *),
                  void (*keep)(ConcordemNetwork *, const Line *, int64_t),
                  int64_t (*sort)(ConcordemNetwork *, int64_t *, const ConcordemMessage *));
  void fail_at_lowest(int64_t line);
  ConcordemBondLists lists_of_atoms() const;   // empty for LIGGGHTS
  // Rules of `neigh_modify exclude` of the host.
  struct ExclusionsOfHost {
    int types, groups, molecules;          // numbers of rules
    const int *type[2], *group[2];         // types, and group bits, of each
    const int *molecule, *same_molecule;   // group bit of each, and whether it excludes pairs within a molecule (NULL: all do)
  };
  ExclusionsOfHost exclusions_of_host() const;
  // Pairs that the host's special bonds take out of contacts.
  void find_special_pairs(std::vector<std::array<int64_t, 2> > &);
  bool has_pair_style_for_spheres() const;   // of the host
  void drop_from_lists(const std::vector<int64_t> &atoms);
  void find_effective_masses();
  void find_exclusions();
  void forget_lost_atoms();
  std::string changer_of_box() const;   // the fix that changes the box, empty if there is none
  std::string lost_in_restart() const;  // the fix of the restart file that has another id, empty if there is none
};

template <class Line>
void FixBondBase::share_file(int64_t (*read)(ConcordemNetwork *, Line *, int64_t, const ConcordemMessage *),
                             void (*keep)(ConcordemNetwork *, const Line *, int64_t),
                             int64_t (*sort)(ConcordemNetwork *, int64_t *, const ConcordemMessage *))
{
  int me, processors;
  MPI_Comm_rank(world, &me);
  MPI_Comm_size(world, &processors);
  std::vector<Line> piece(CONCORDEM_CHUNK);
  for (;;) {
    int count = me == 0 ? static_cast<int>(read(network_, piece.data(), CONCORDEM_CHUNK, &message_)) : 0;
    MPI_Bcast(&count, 1, MPI_INT, 0, world);
    if (count < 0) fail_with_text_of(0);
    if (count == 0) break;
    MPI_Bcast(piece.data(), count * static_cast<int>(sizeof(Line)), MPI_BYTE, 0, world);
    int mine = 0;
    for (int k = 0; k < count; k++)
      if (concordem_keeper(piece[k].ids[0], processors) == me) piece[mine++] = piece[k];
    keep(network_, piece.data(), mine);
  }
  int64_t line = INT64_MAX;
  if (sort(network_, &line, &message_) < 0 && line == INT64_MAX) fail_on_this_processor();
  fail_at_lowest(line);
}

}

#endif
