//! Results do not depend on the ids of the atoms: particles are ordered along space.

use crate::harness::{Atom, Dice, Host, data_file_for, dump_for, frames, head_for, run_in, thermo};
use concordem_contact::math::Vec3;

/// A cluster that falls apart, with ids in two orders, on one and two processors: the same bits of each atom.
#[test]
fn ids_do_not_change_results() {
    let mut dice = Dice(7);
    let atoms: Vec<Atom> = (0..64)
        .map(|k: usize| {
            let place = Vec3::new((k % 4) as f64, (k / 4 % 4) as f64, (k / 16) as f64) * 0.0101;
            let mut atom = Atom::resting(place + dice.vector() * 4e-4 + Vec3::repeat(0.012), 0.005);
            atom.velocity = dice.vector() * 5.0;
            atom
        })
        .collect();
    let mut shuffled: Vec<usize> = (0..atoms.len()).collect();
    for k in 0..shuffled.len() {
        shuffled.swap(k, (dice.roll() * 64.0) as usize);
    }
    let law = "linear_bond normal_stiffness 1e5 shear_stiffness 5e4 damping_ratio 0.1 normal_strength 20 shear_strength 20 \
               friction_coefficient 0.3 bond distance 1.45 contact linear_bond";
    for host in [Host::Liggghts, Host::Lammps] {
        let mut found = Vec::new();
        for of_id in [&(0..atoms.len()).collect(), &shuffled] {
            let folder = tempfile::tempdir().unwrap();
            let numbered: Vec<Atom> = of_id.iter().map(|&k| atoms[k]).collect();
            let (low, high) = (Vec3::zeros(), Vec3::repeat(0.0605));
            data_file_for(host, &folder.path().join("data"), &numbered, &[], low, high);
            let script = head_for(host, "data", "p p p", 2e-4, 2e-6)
                + &format!("fix integrate all nve/sphere\nfix bonds all concordem/bond {law}\n")
                + "thermo_style custom step f_bonds f_bonds[2]\n"
                + &dump_for(host, "out", 250)
                + "run 250\n";
            for processors in [1, 2] {
                let rows = thermo(&run_in(host, folder.path(), &script, processors));
                let [_, held, broken] = rows.last().unwrap()[..] else { panic!("{rows:?}") };
                assert!(held > 10.0 && broken > 10.0, "{rows:?}");
                let last = frames(&folder.path().join("out")).pop().unwrap().1;
                let mut by_atom: Vec<_> = of_id.iter().copied().zip(last).collect();
                by_atom.sort_by_key(|(k, _)| *k);
                found.push(by_atom);
            }
        }
        assert!(found.iter().all(|other| *other == found[0]), "{host:?}");
    }
}

/// LAMMPS keeps a bond in its list until the list is rebuilt. Another fix that reads the list must not see a broken bond, whichever of
/// its atoms has the lower id: `fix bond/break` would break it again and count it.
#[test]
fn a_broken_bond_is_no_bond_for_other_fixes() {
    for signs in [[1.0, -1.0], [-1.0, 1.0]] {
        let folder = tempfile::tempdir().unwrap();
        let atoms = signs.map(|sign| {
            let mut atom = Atom::resting(Vec3::new(0.005 * sign, 0.0, 0.0), 0.005);
            atom.velocity.x = 0.1 * sign;
            atom
        });
        data_file_for(
            Host::Lammps,
            &folder.path().join("data"),
            &atoms,
            &[[1, 2]],
            Vec3::repeat(-0.1),
            Vec3::repeat(0.1),
        );
        // The beam, which could stretch by 1.3 µm, breaks at 0.4 µm; `bond/break` acts beyond 10 µm, which the spheres pass at some 60 steps.
        let script = head_for(Host::Lammps, "data", "f f f", 1e-3, 1e-6)
            + "pair_style zero 0.015\npair_coeff * *\nspecial_bonds lj 0 1 1 coul 1 1 1\n\
               bond_style concordem/cohesive_beam\nbond_coeff * young 5e9 poisson 0.2 radius_ratio 0.6 tensile_strength 2e5\n\
               fix integrate all nve/bpm/sphere\nfix other all bond/break 1 1 0.01001\n\
               thermo_style custom step f_concordem_bonds f_concordem_bonds[2] f_other[2]\nrun 200\n";
        let rows = thermo(&run_in(Host::Lammps, folder.path(), &script, 1));
        assert_eq!(rows.last().unwrap()[1..], [0.0, 1.0, 0.0], "{signs:?}");
    }
}
