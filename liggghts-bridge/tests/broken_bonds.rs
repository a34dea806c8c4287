//! `compute concordem/broken/local` lists each bond that broke once, on any number of processors.

use crate::harness::{Atom, Host, data_file_for, head_for, run_in, tables, thermo};
use concordem_contact::math::Vec3;

/// The atoms at both ends of a row leave it at given speeds, the second one later, so that the bonds break between different outputs.
#[test]
fn each_bond_that_broke_is_listed_once() {
    for host in [Host::Liggghts, Host::Lammps] {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let atom = |k: i32| {
            let speed = match k {
                0 => -2.0,
                5 => 0.5,
                _ => 0.0,
            };
            Atom { velocity: Vec3::x() * speed, ..Atom::resting(Vec3::x() * (0.01 * f64::from(k) - 0.025), 0.005) }
        };
        let atoms: Vec<Atom> = (0..6).map(atom).collect();
        data_file_for(host, &folder.join("row.data"), &atoms, &[], Vec3::repeat(-0.05), Vec3::repeat(0.05));
        let columns = (1..=12).map(|k| format!("c_broken[{k}]")).collect::<Vec<_>>().join(" ");
        let script = head_for(host, "row.data", "f f f", 2e-3, 1e-7)
            + &format!(
                "fix bonds all concordem/bond cohesive_beam young 1e8 poisson 0.3 radius 0.004 tensile_strength 1e6 \
                 bond distance 1.05 contact none\nfix integrate all nve/sphere\nfix steady all setforce 0 0 0\n\
                 compute broken all concordem/broken/local bonds\ndump broken all local 200 broken.dump {columns}\n\
                 thermo_style custom step f_bonds f_bonds[2]\nthermo 200\nrun 3000\n"
            );
        for processors in [1, 2] {
            let rows = thermo(&run_in(host, folder, &script, processors));
            let mut before = 0.0;
            let mut listed = Vec::new();
            for (step, table) in tables(&folder.join("broken.dump")) {
                let broken = rows.iter().find(|row| row[0] == step as f64).unwrap()[2];
                assert_eq!(table.len() as f64, broken - before, "{host:?} on {processors}: {rows:?}");
                assert!(table.iter().all(|row| row[2] <= step as f64 && row[2] + 200.0 > step as f64), "{table:?}");
                before = broken;
                listed.extend(table);
            }
            assert_eq!(listed.len(), 2, "{host:?} on {processors}: {listed:?}");
            for (row, (ids, x)) in listed.iter().zip([([1.0, 2.0], -0.02), ([5.0, 6.0], 0.02)]) {
                assert_eq!(row[..2], ids, "{host:?} on {processors}: {listed:?}");
                // A bond of strength 1e6 Pa and stiffness 1e8 Pa breaks at a strain of 1 %, and its middle moves by half of that.
                assert!((row[3] - x).abs() < 1e-4 && row[4] == 0.0 && row[5] == 0.0, "{listed:?}");
                assert_eq!(row[6..10], [1.0, 0.0, 0.0, 0.0], "pure tension: {listed:?}");
                // The energy at the strength: σ²/(2E) times the volume; the last step goes beyond it by up to v·dt = 2e-7 m of 1e-4 m.
                let energy = 1e12 / 2e8 * std::f64::consts::PI * 0.004 * 0.004 * 0.01;
                assert!((row[10] / energy - 1.0).abs() < 5e-3, "{energy}: {listed:?}");
                assert_eq!(row[11], 0.0, "not in shear: {listed:?}");
            }
        }
    }
}

/// A pair whose spheres slide past each other breaks by the cohesion of the beam, far below its tensile strength.
#[test]
fn a_bond_that_shear_broke_is_marked() {
    for host in [Host::Liggghts, Host::Lammps] {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let atom = |side: f64| Atom { velocity: Vec3::y() * side, ..Atom::resting(Vec3::x() * (0.005 * side), 0.005) };
        data_file_for(
            host,
            &folder.join("pair.data"),
            &[atom(-1.0), atom(1.0)],
            &[],
            Vec3::repeat(-0.05),
            Vec3::repeat(0.05),
        );
        let script = head_for(host, "pair.data", "f f f", 2e-3, 1e-7)
            + "fix bonds all concordem/bond cohesive_beam young 1e8 poisson 0.3 radius 0.004 tensile_strength 1e9 cohesion 1e5 \
               moment_share 0 bond distance 1.05 contact none\nfix integrate all nve/sphere\nfix steady all setforce 0 0 0\n\
               compute broken all concordem/broken/local bonds\ndump broken all local 3000 broken.dump c_broken[1] c_broken[12]\n\
               thermo_style custom step f_bonds f_bonds[2]\nthermo 3000\nrun 3000\n";
        run_in(host, folder, &script, 1);
        let listed: Vec<_> = tables(&folder.join("broken.dump")).into_iter().flat_map(|(_, table)| table).collect();
        assert_eq!(listed, [[1.0, 1.0]], "{host:?}");
    }
}
