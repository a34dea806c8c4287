//! Our styles in the stock LIGGGHTS and LAMMPS, one file per topic.

mod harness;

/// `make test` runs these tests beside all others, which it finds by `--skip inside_hosts::`.
#[path = "."]
mod inside_hosts {
    mod added_bonds;
    mod atom_phases;
    mod bad_input;
    mod beams;
    mod bond_list;
    mod bond_types;
    mod borders;
    mod bpm_examples;
    mod broken_bonds;
    mod changes;
    mod chosen_bonds;
    mod clumps;
    mod data_files;
    mod decks;
    mod deformable;
    mod driver;
    mod examples;
    mod follows;
    mod host_commands;
    mod host_heat;
    mod hybrid_atoms;
    mod impact;
    mod lammps;
    mod lammps_refusals;
    mod large_ids;
    mod libraries;
    mod migration;
    mod no_bonds;
    mod operators;
    mod order;
    mod pair_beside;
    mod pair_contact;
    mod public_decks;
    mod restart_files;
    mod setup_checks;
    mod specimen;
    mod two_particles;
    mod vtk;
}
