//! Parameters by bond type in LAMMPS.

mod harness;

use concordem_contact::math::Vec3;
use harness::{Atom, Host, attempt_in, data_file_for, head_for, run_in, text, thermo};

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
