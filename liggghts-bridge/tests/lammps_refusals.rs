//! What the LAMMPS plugin refuses, with the remedy in the message.

use crate::harness::lammps::{BEAM, DT, LAW, LINEAR, write_bar};
use crate::harness::{Atom, Host, attempt_in, data_file_for, head_for, refused_in, text};
use concordem_contact::math::Vec3;

#[test]
#[expect(clippy::too_many_lines, reason = "a list of cases")]
fn errors_name_the_remedy() {
    let head = head_for(Host::Lammps, "bonded.data", "f f f", 5e-4, DT);
    let with = |from: &str, to: &str| head.replace(from, to);
    let coeff = format!("bond_coeff * {}\n", BEAM.split_once(' ').unwrap().1);
    let cpm = LAW.split_once(' ').unwrap().1;
    let cases = [
        (format!("{head}bond_style concordem/cpm\nbond_coeff 1 young 30e9\nrun 0\n"), "missing field"),
        (
            format!("{head}bond_style concordem/cohesive_beam\nbond_coeff * young 5e9 tensile_strength 5e6\n"),
            "the radius of the beam is missing; give `radius_ratio`",
        ),
        (
            // The fix of a style does not exist yet.
            format!(
                "{head}bond_style concordem/cohesive_beam\n{coeff}run 0\nwrite_restart half\nclear\nread_restart half\n\
                 thermo_style custom f_concordem_bonds\n"
            ),
            "repeat the style and its coefficients after read_restart",
        ),
        (
            format!("{head}fix b all concordem/bond {BEAM} bond clumps 1.1\n"),
            "`bond clumps` is for templates of LIGGGHTS; use a bond style, and molecules",
        ),
        (format!("{head}fix b all concordem/bond glue bond none\n"), "choose one of cpm, linear_bond, cohesive_beam"),
        (
            format!("{}bond_style concordem/cohesive_beam\n{coeff}run 0\n", with("newton off", "newton on")),
            "newton on off",
        ),
        (
            format!("{}bond_style concordem/cohesive_beam\n{coeff}run 0\n", with("comm_modify vel yes\n", "")),
            "comm_modify vel yes",
        ),
        (format!("{head}bond_style concordem/cohesive_beam bond distance 1.5\n"), "remove `bond`"),
        (format!("{head}bond_style concordem/cohesive_beam between 1-1\n"), "remove `between`"),
        (format!("{head}pair_style concordem/frictional between 1-1\n"), "remove `between`"),
        (format!("{head}bond_style concordem/cohesive_beam\n{coeff}{coeff}"), "bond_coeff can be given only once"),
        (
            format!("{head}compute c all concordem/bond/local nothing\nbond_style zero\nbond_coeff *\nrun 0\n"),
            "there is no fix",
        ),
        (format!("{}fix b all concordem/bond {BEAM} bond none\n", with("units si", "units real")), "use `units si`"),
        (format!("{head}pair_style concordem/glue\n"), "Unrecognized pair style 'concordem/glue'"),
        (format!("{head}pair_style concordem/hertz_mindlin\npair_coeff * * young 1e7\nrun 0\n"), "missing field"),
        (
            format!("{head}pair_style concordem/frictional bond distance 1.2\n"),
            "creates no bonds and defines its own law; remove `bond`",
        ),
        (
            format!(
                "{head}pair_style concordem/cpm\nbond_style concordem/cpm\nbond_coeff * {cpm}\npair_coeff * * young 1e9\n"
            ),
            "put `pair_coeff` before the `bond_coeff`",
        ),
        (
            format!(
                "{head}pair_style concordem/frictional\npair_coeff * * {LINEAR}\nbond_style concordem/cohesive_beam\n{coeff}\
                 run 0\npair_coeff * * {}\n",
                LINEAR.replace("0.3", "0.5")
            ),
            "put `pair_coeff` before the `bond_coeff`",
        ),
        (
            format!("{head}bond_style concordem/cohesive_beam\n{coeff}run 0\nunfix concordem_bonds\nrun 0\n"),
            "start over with `bond_style`",
        ),
        (
            format!("{head}bond_style concordem/cohesive_beam\n{coeff}run 2\nunfix concordem_bonds\nrun 2 pre no\n"),
            "start over with `bond_style`",
        ),
        (
            format!(
                "{head}pair_style concordem/frictional\npair_coeff * * {LINEAR}\nrun 2\nunfix concordem_contacts\nrun 2 pre no\n"
            ),
            "start over with `pair_style none`",
        ),
        (
            format!(
                "{head}bond_style concordem/cohesive_beam\n{coeff}fix concordem_bonds all concordem/bond {BEAM} bond none\nrun 0\n"
            ),
            "deleted or replaced",
        ),
        (
            format!(
                "{head}pair_style concordem/frictional\npair_coeff * * {LINEAR}\nrun 0\nunfix concordem_contacts\nrun 0\n"
            ),
            "start over with `pair_style none`",
        ),
        (
            format!("{head}bond_style concordem/cohesive_beam\n{coeff}pair_style concordem/cpm\n"),
            "put `pair_style` before the `bond_coeff`",
        ),
        (
            format!(
                "{head}pair_style concordem/cpm\npair_coeff * *\nbond_style concordem/cohesive_beam contact cpm\n{coeff}"
            ),
            "the pair style defines the contacts; remove `contact`",
        ),
        (
            format!(
                "{head}pair_style concordem/cpm kinematics first-order\npair_coeff * *\nbond_style concordem/cpm\nbond_coeff * {cpm}\n"
            ),
            "move `kinematics` to `bond_style`",
        ),
        (
            format!(
                "{}pair_style concordem/frictional\npair_coeff * * {LINEAR}\nrun 0\n",
                with("comm_modify vel yes\n", "")
            ),
            "comm_modify vel yes",
        ),
        (
            format!(
                "{head}pair_style hybrid concordem/frictional\npair_coeff * * concordem/frictional {LINEAR}\nrun 0\n"
            ),
            "`fix ID GROUP concordem/bond none contact frictional ...` for the contacts within a group",
        ),
        (
            format!(
                "{head}bond_style hybrid concordem/cohesive_beam\n{}run 0\n",
                coeff.replace('*', "* concordem/cohesive_beam")
            ),
            "`fix ID GROUP concordem/bond cohesive_beam ...` for the bonds of a group",
        ),
    ];
    refused_in(Host::Lammps, &cases, |folder| {
        write_bar(folder);
    });
}

/// Two bonded spheres that touch. Styles of LAMMPS for touching spheres would press them apart a second time, alone or in a hybrid;
/// between other types, they may act. Styles that act at a distance may act between our atoms, too.
#[test]
fn styles_for_touching_spheres_are_found_in_hybrids() {
    let folder = tempfile::tempdir().unwrap();
    let atoms = [0.0, 0.0098, 0.05, 0.0598]
        .map(|x| Atom { kind: if x < 0.03 { 1 } else { 2 }, ..Atom::resting(Vec3::new(x, 0.0, 0.0), 0.005) });
    let (low, high) = (Vec3::repeat(-0.03), Vec3::new(0.13, 0.08, 0.08));
    data_file_for(Host::Lammps, &folder.path().join("pairs.data"), &atoms, &[[3, 4]], low, high);
    let head = head_for(Host::Lammps, "pairs.data", "f f f", 5e-4, 1e-7) + "group ours type 1\n";
    let fix = "bond_style zero\nbond_coeff *\nfix ours ours concordem/bond linear_bond normal_stiffness 1e5 shear_stiffness 1e4 \
               bond distance 1.2\nfix motion all nve/sphere\nrun 2\n";
    let granular = "granular hooke 1e4 10.0 tangential linear_history 1e4 1.0 0.3\n";
    let hooke = "gran/hooke/history 1e4 NULL 10.0 NULL 0.3 0";
    for (styles, wanted) in [
        (
            format!(
                "pair_style hybrid/overlay lj/cut 0.02 granular\npair_coeff * * {granular}pair_coeff * * lj/cut 1e-9 0.001\n"
            ),
            Some("the sub-style granular or gran/... of pair_style hybrid/overlay"),
        ),
        (
            format!(
                "pair_style hybrid {hooke} granular\npair_coeff 1 1 gran/hooke/history\npair_coeff 1 2 gran/hooke/history\n\
                 pair_coeff 2 2 {granular}"
            ),
            Some("the sub-style granular or gran/... of pair_style hybrid "),
        ),
        (
            "pair_style hybrid/overlay bpm/spring lj/cut 0.02\npair_coeff * * bpm/spring 1e4 0.01 1.0\n\
             pair_coeff * * lj/cut 1e-9 0.001\n"
                .to_owned(),
            Some("the sub-style bpm/... of pair_style hybrid/overlay"),
        ),
        (
            "pair_style bpm/spring\npair_coeff * * 1e4 0.01 1.0\n".to_owned(),
            Some("both pair_style bpm/spring and this fix"),
        ),
        (
            format!(
                "pair_style hybrid lj/cut 0.02 granular\npair_coeff 2 2 {granular}pair_coeff 1 * lj/cut 1e-9 0.001\n"
            ),
            None,
        ),
    ] {
        let script = format!("{head}{styles}{fix}");
        let output = attempt_in(Host::Lammps, folder.path(), &script, 1);
        let printed = text(&output);
        assert_eq!(output.status.success(), wanted.is_none(), "{printed}\n{script}");
        assert!(wanted.is_none_or(|wanted| printed.contains(wanted)), "{wanted:?} is not in\n{printed}\n{script}");
    }
}
