//! Invalid input causes a LIGGGHTS error with a remedy; all processors stop, and none hangs.

use crate::harness::{Atom, Host, attempt, data_file, head, refused_in, run, set_restart_version, text, thermo};
use concordem_contact::math::Vec3;

const GOOD: &str =
    "fix bonds all concordem/bond linear_bond normal_stiffness 1e5 shear_stiffness 1e4 bond distance 1.2\n";

fn script(edit: impl FnOnce(String) -> String) -> String {
    edit(head("row.data", "f f f", 1e-3, 1e-6) + "fix integrate all nve/sphere\n" + GOOD + "thermo 1\nrun 2\n")
}

#[test]
#[expect(clippy::too_many_lines, reason = "a list of cases")]
fn invalid_input_stops_all_processors_with_a_remedy() {
    let prepare = |folder: &std::path::Path| {
        let atoms: Vec<Atom> =
            (0..8).map(|k| Atom::resting(Vec3::new(0.01 * f64::from(k), 0.03, 0.03), 0.005)).collect();
        data_file(&folder.join("row.data"), &atoms, Vec3::repeat(-0.01), Vec3::new(0.09, 0.07, 0.07));
        std::fs::write(folder.join("far.txt"), "1 8\n").unwrap();
        std::fs::write(
            folder.join("two.toml"),
            "[[material]]\nname = \"a\"\ndensity = 1\n\n[[material]]\nname = \"b\"\ndensity = 1\n",
        )
        .unwrap();
        std::fs::write(folder.join("empty.toml"), "[[material]]\nname = \"a\"\ndensity = 1\n").unwrap();
    };
    let with = |old: &'static str, new: &'static str| {
        script(move |s| {
            assert!(s.contains(old));
            s.replace(old, new)
        })
    };
    let folder = tempfile::tempdir().unwrap();
    prepare(folder.path());
    let good = attempt(folder.path(), &script(|s| s), 2);
    assert!(good.status.success(), "{}", text(&good));
    let cases = [
        (with("linear_bond", "glue"), "unknown bond law `glue`; choose one of cpm, linear_bond, cohesive_beam"),
        (with("shear_stiffness 1e4", ""), "missing field `shear_stiffness`"),
        (
            with("thermo 1\n", "pair_style gran model concordem/hertz tangential history rolling_friction luding\npair_coeff * *\n"),
            "model concordem/hertz: `rolling_friction luding` reads the history of LIGGGHTS' normal model luding; choose cdt",
        ),
        (
            with("thermo 1\n", "pair_style gran model concordem/hertz tangential history surface multicontact\npair_coeff * *\n"),
            "model concordem/hertz: it knows spheres with the default surface only; remove `surface ...`",
        ),
        (
            with("thermo 1\n", "pair_style gran model concordem/frictional cohesion sjkr tangential_reduce on\npair_coeff * *\n"),
            "model concordem/frictional: its friction limit has no cohesion; remove `tangential_reduce on`",
        ),
        (
            with("thermo 1\n", "pair_style gran model concordem/hertz tangential history cohesion sjkr limitForce on\npair_coeff * *\n"),
            "Unknown argument or wrong keyword order: 'limitForce'",
        ),
        (
            with("thermo 1\n", "pair_style gran model concordem/hertz tangential history\npair_coeff * *\nfix floor all wall/gran model \
                 concordem/hertz tangential history cohesion easo/capillary/viscous primitive type 1 zplane 0\n"),
            "choose washino/capillary/viscous for the wall",
        ),
        (with("shear_stiffness 1e4", "shear_stiffness -1"), "shear_stiffness = -1 must be finite and not negative"),
        (with("bond distance 1.2", ""), "add `bond distance FACTOR`"),
        (
            with(
                "linear_bond normal_stiffness 1e5 shear_stiffness 1e4",
                "cpm young 1e9 shear_ratio 0.2 cohesion 1e6 friction_coefficient 1 crack_onset_strain 1e-3 fracture_energy 4",
            ),
            "1.0000e-2 m long; from 8.0000e-3 m on, it stores its fracture energy before it softens",
        ),
        (with("newton off\n", "newton on\n"), "needs `newton off`"),
        (with("communicate single vel yes\n", ""), "add `communicate single vel yes`"),
        (with("units si", "units real"), "use `units si`"),
        (
            with("normal_stiffness 1e5 shear_stiffness 1e4", "materials two.toml"),
            "2 [[material]] tables for 1 atom types",
        ),
        (
            with(
                "normal_stiffness 1e5 shear_stiffness 1e4 bond distance 1.2",
                "materials empty.toml bond list far.txt",
            ),
            "law linear_bond has no parameters for atom types [1, 1]",
        ),
        (
            // An unbreakable bond across a processor border is stretched beyond the ghost cutoff.
            with("run 2\n", "group left id 1 2 3 4\ngroup right id 5 6 7 8\nfix left left move linear -20 0 0 units box\n\
                 fix right right move linear 20 0 0 units box\nrun 1000\n")
                .replace("fix integrate all nve/sphere\n", ""),
            "raise the cutoff with the fix's `reach LENGTH`",
        ),
        (
            with(
                "run 2\n",
                "run 1\nwrite_restart r.bin\nclear\nunits si\nnewton off\ncommunicate single vel yes\nread_restart r.bin\n\
              fix bonds all concordem/bond linear_bond normal_stiffness 1e5 shear_stiffness 1e4 contact frictional \
              contact.normal_stiffness 1 contact.shear_stiffness 1 contact.friction_coefficient 0 bond none\n",
            ),
            "the restart file contains contacts of law none, not frictional",
        ),
        (with("linear_bond normal_stiffness 1e5 shear_stiffness 1e4 bond distance 1.2", "none"), "computes no forces"),
        (
            // Atoms without a radius.
            "units si\natom_style atomic\nboundary f f f\nnewton off\nregion b block 0 1 0 1 0 1\ncreate_box 1 b\n"
                .to_owned()
                + GOOD,
            "use `atom_style sphere`",
        ),
        (
            with("thermo 1\n", "thermo 1\ncompute rows all concordem/bond/local nobody\n"),
            "there is no fix concordem/bond with id nobody",
        ),
        (
            with("thermo 1\n", "compute rows all concordem/bond/local\n"),
            "the id of a fix concordem/bond is missing",
        ),
        (with("thermo 1\n", "compute s all concordem/stress/atom bonds volume cube\n"), "give sphere, or packing FRACTION"),
        (with("thermo 1\n", "compute c all concordem/couple bonds volume 0 centroid 0 0 0\n"), "`volume` must be positive"),
        (
            with("thermo 1\n", "compute c all concordem/couple bonds volume 1 centroid nan 0 0\n"),
            "`centroid nan` is not a finite number",
        ),
        (
            with("boundary f f f", "boundary p p p").replace(
                "thermo 1\n",
                "compute c all concordem/couple bonds volume 1 centroid 0 0 0\nthermo_style custom step c_c[1]\nthermo 1\n",
            ),
            "undefined in a periodic box",
        ),
        (
            with(
                "run 2\n",
                "run 1\nwrite_restart r.bin\nclear\nunits si\nnewton off\ncommunicate single vel yes\nread_restart r.bin\n\
              fix bonds all concordem/bond cpm young 1e9 shear_ratio 0.2 cohesion 1e6 friction_coefficient 1 \
              crack_onset_strain 1e-3 relative_ductility 5 bond none\n",
            ),
            "the restart file contains bonds of law linear_bond, not cpm",
        ),
        (with("boundary f f f", "boundary f p f").replace("1.2", "6"), "less than twice the longest bond or contact"),
    ];
    refused_in(Host::Liggghts, &cases, prepare);
}

/// `run N pre no` does not call a deleted fix. Bonds pull on two spheres that fly apart until the fix is deleted; from then on the
/// kinetic energy is constant to the digits printed.
#[test]
fn a_deleted_fix_is_not_called() {
    let folder = tempfile::tempdir().unwrap();
    let mut atoms = [Atom::resting(Vec3::zeros(), 0.005), Atom::resting(Vec3::new(0.01, 0.0, 0.0), 0.005)];
    atoms[0].velocity.x = -1.0;
    atoms[1].velocity.x = 1.0;
    data_file(&folder.path().join("row.data"), &atoms, Vec3::repeat(-0.03), Vec3::repeat(0.06));
    for processors in [1, 2] {
        let more = "thermo_style custom step ke\nrun 50\nunfix bonds\nrun 50 pre no\n";
        let printed = run(folder.path(), &script(|s| s.replace("run 2\n", more)), processors);
        let energies: Vec<f64> = thermo(&printed).iter().map(|row| row[1]).collect();
        let half = energies.iter().rposition(|energy| *energy != energies[energies.len() - 1]).expect("forces") + 1;
        assert!(energies.len() == 102 && (50..=51).contains(&half), "{energies:?}");
    }
}

/// The stock program without the library rejects our styles, also when it reads a restart file with bonds.
#[test]
fn without_the_library_the_style_is_unknown() {
    let folder = tempfile::tempdir().unwrap();
    let atoms = [Atom::resting(Vec3::repeat(0.03), 0.005)];
    data_file(&folder.path().join("row.data"), &atoms, Vec3::zeros(), Vec3::repeat(0.06));
    let written = attempt(folder.path(), &script(|s| s + "write_restart r.bin\n"), 2);
    assert!(written.status.success(), "{}", text(&written));
    let again = format!("units si\nnewton off\ncommunicate single vel yes\nread_restart r.bin\n{GOOD}run 1\n");
    std::fs::write(folder.path().join("in"), again).unwrap();
    let output = std::process::Command::new("timeout")
        .args(["60", "liggghts", "-in", "in", "-log", "none"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    assert!(!output.status.success());
    assert!(text(&output).contains("Invalid fix style: \"concordem/bond\""), "{}", text(&output));
}

/// The head of version 1 was shorter, so only the version number may be read.
#[test]
fn restart_files_of_other_versions_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let atoms: Vec<Atom> = (0..8).map(|k| Atom::resting(Vec3::new(0.01 * f64::from(k), 0.03, 0.03), 0.005)).collect();
    data_file(&folder.path().join("row.data"), &atoms, Vec3::repeat(-0.01), Vec3::new(0.09, 0.07, 0.07));
    let file = folder.path().join("r.bin");
    let written = attempt(folder.path(), &script(|s| s + "write_restart r.bin\n"), 1);
    assert!(written.status.success(), "{}", text(&written));
    set_restart_version(&file, "linear_bond", 1);
    let again = format!(
        "units si\nnewton off\ncommunicate single vel yes\nread_restart r.bin\n{}run 1\n",
        GOOD.replace("bond distance 1.2", "bond none")
    );
    let output = attempt(folder.path(), &again, 1);
    assert!(!output.status.success());
    assert!(text(&output).contains("was written by another version of ConcorDEM"), "{}", text(&output));
}
