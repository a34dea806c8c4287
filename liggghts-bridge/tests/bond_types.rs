//! Parameters by bond type in LAMMPS.

use crate::harness::{Atom, Host, attempt_in, data_file_for, head_for, run_in, text, thermo};
use concordem_contact::math::Vec3;

const DT: f64 = 5e-7;

/// Two pairs with bonds of two types vibrate as with the parameters of each type alone, also after a restart.
#[test]
fn parameters_belong_to_bond_types() {
    let folder = tempfile::tempdir().unwrap();
    let at = |x: f64, y: f64, v: f64| {
        let mut atom = Atom::resting(Vec3::new(x, y, 0.0), 0.005);
        atom.velocity.x = v;
        atom
    };
    let atoms = [at(-0.005, 0.0, 0.1), at(0.005, 0.0, -0.1), at(-0.005, 0.03, 0.1), at(0.005, 0.03, -0.1)];
    data_file_for(
        Host::Lammps,
        &folder.path().join("four.data"),
        &atoms,
        &[[1, 2], [3, 4]],
        Vec3::repeat(-0.1),
        Vec3::repeat(0.1),
    );
    let head = head_for(Host::Lammps, "four.data extra/bond/types 1", "f f f", 5e-4, DT) + "set atom 3*4 bond 2\n";
    let of = |young: &str| format!("young {young} poisson 0.2 radius_ratio 0.6 tensile_strength 1e12\n");
    let rest = "fix integrate all nve/sphere\nvariable a equal vx[1]\nvariable b equal vx[3]\nthermo_style custom step v_a v_b\n\
                thermo 10\nthermo_modify format float %20.15g\n";
    let style = "bond_style concordem/cohesive_beam\n";
    let rows = |coefficients: &str, processors: usize| {
        let script = format!("{head}{style}{coefficients}{rest}run 100\nwrite_restart half\nrun 100\n");
        thermo(&run_in(Host::Lammps, folder.path(), &script, processors))
    };
    let column = |rows: &[Vec<f64>], k: usize| rows.iter().map(|row| row[k]).collect::<Vec<f64>>();
    let (soft, stiff) =
        (rows(&format!("bond_coeff * {}", of("1e9")), 1), rows(&format!("bond_coeff * {}", of("5e9")), 1));
    assert_ne!(column(&soft, 1), column(&stiff, 1));
    let both = format!("bond_coeff 2 {}bond_coeff 1 {}", of("5e9"), of("1e9"));
    for processors in [1, 2] {
        let both = rows(&both, processors);
        assert_eq!((column(&both, 1), column(&both, 2)), (column(&soft, 1), column(&stiff, 2)));
        let again = format!(
            "read_restart half\ncomm_modify vel yes\nneighbor 5e-4 bin\nneigh_modify every 1 delay 0\ntimestep {DT:e}\n{rest}run 100\n"
        );
        let again = thermo(&run_in(Host::Lammps, folder.path(), &again, 3 - processors));
        assert_eq!(again[1..], both[both.len() - 10..]);
    }
    for (coefficients, wanted) in [
        (format!("bond_coeff 1 {}", of("1e9")), "all bond coeffs are not set"),
        (format!("bond_coeff 1 {}bond_coeff 2 poisson 0.2\n", of("1e9")), "bond type 2: missing field `young`"),
        (
            format!("bond_coeff 1 {}bond_coeff 2 young 1e9 poisson 0.2\n", of("1e9")),
            "the radius of the beam is missing",
        ),
    ] {
        let output = attempt_in(Host::Lammps, folder.path(), &format!("{head}{style}{coefficients}{rest}run 0\n"), 1);
        let printed = text(&output).to_lowercase();
        assert!(!output.status.success() && printed.contains(wanted), "`{wanted}` is not in\n{printed}");
    }
}

/// A bond keeps its parameters. A command that changes its type between runs or during a run must not be ignored; without parameters by
/// type, types have no effect.
#[test]
fn a_changed_type_of_a_bond_is_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let at = |x: f64, v: f64| {
        let mut atom = Atom::resting(Vec3::new(x, 0.0, 0.0), 0.005);
        atom.velocity.x = v;
        atom
    };
    // A chain across the border between two processors.
    let atoms = [at(-0.015, 0.1), at(-0.005, -0.1), at(0.005, 0.1), at(0.015, -0.1)];
    let data = folder.path().join("chain.data");
    data_file_for(Host::Lammps, &data, &atoms, &[[1, 2], [2, 3], [3, 4]], Vec3::repeat(-0.1), Vec3::repeat(0.1));
    let head = head_for(Host::Lammps, "chain.data extra/bond/types 1", "f f f", 5e-4, DT)
        + "pair_style zero 0.0105\npair_coeff * *\nspecial_bonds lj 0 1 1 coul 1 1 1\nbond_style concordem/cohesive_beam\n";
    let of = |young: &str| format!("young {young} poisson 0.2 radius_ratio 0.6 tensile_strength 1e12\n");
    let by_type = format!("bond_coeff 1 {}bond_coeff 2 {}", of("1e9"), of("5e9"));
    let alike = format!("bond_coeff * {}", of("1e9"));
    let rest = "fix integrate all nve/sphere\nvariable a equal vx[1]\nvariable d equal vx[4]\n\
                thermo_style custom step f_concordem_bonds v_a v_d\nthermo 10\nthermo_modify format float %20.15g\n";
    let run = |coefficients: &str, between: &str, processors: usize| {
        let script = format!("{head}{coefficients}{rest}run 20\n{between}run 20\n");
        (attempt_in(Host::Lammps, folder.path(), &script, processors), script)
    };
    let rows = |coefficients: &str, between: &str, processors: usize| {
        let (output, script) = run(coefficients, between, processors);
        assert!(output.status.success(), "{}\n{script}", text(&output));
        thermo(&text(&output))
    };
    for processors in [1, 2] {
        for atoms in ["2*3", "1*2"] {
            let change = format!("set atom {atoms} bond 2\n");
            let (output, script) = run(&by_type, &change, processors);
            let wanted = format!(
                "the type of the bond of atoms {} changed from 1 to 2, but a bond keeps its parameters",
                atoms.replace('*', " and ")
            );
            assert!(!output.status.success() && text(&output).contains(&wanted), "{}\n{script}", text(&output));
            // Back again before the next run, nothing has changed.
            let back = format!("{change}set atom {atoms} bond 1\n");
            assert_eq!(rows(&by_type, &back, processors), rows(&by_type, "", processors));
            assert_eq!(rows(&alike, &change, processors), rows(&alike, "", processors));
        }
        // The remedies.
        let remade =
            "group two id 2 3\ndelete_bonds two bond 1 remove special\nrun 0\ncreate_bonds single/bond 2 2 3\n";
        let remade = rows(&by_type, remade, processors);
        assert_eq!(remade.last().unwrap()[1], 3.0);
        assert_ne!(remade.last().unwrap()[2..], rows(&by_type, "", processors).last().unwrap()[2..]);
        let first = format!("{by_type}set atom 2*3 bond 2\n");
        assert_eq!(rows(&first, "", processors).last().unwrap()[1], 3.0);
    }
}
