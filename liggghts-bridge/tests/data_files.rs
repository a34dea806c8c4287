//! Runs that continue from data files, with the histories of bonds and contacts.

use std::path::Path;

use crate::harness::{FACTOR, Host, attempt_in, bar, data_file_for, dump_for, head_for, run_in, text, thermo};
use concordem_contact::math::Vec3;

const DT: f64 = 5e-7;
const CPM: &str = "young 30e9 shear_ratio 0.2 cohesion 4.5e6 friction_coefficient 0.8 crack_onset_strain 1.5e-4 \
                   relative_ductility 4 omega_threshold 0.99";
const BEAM: &str = "young 5e9 poisson 0.2 radius_ratio 0.6 tensile_strength 5e6";
const CONTACT: [&str; 4] = ["young 1e9", "poisson 0.2", "friction_coefficient 0.4", "restitution 0.7"];

/// How a script defines bonds and contacts. `{state}` stands for the option that continues.
struct Case {
    host: Host,
    boundary: &'static str,
    data: &'static str,
    styles: String,
    fix: &'static str,
}

fn cases() -> Vec<Case> {
    let prefixed = CONTACT.iter().fold(String::new(), |all, parameter| all + " contact." + parameter);
    let case = |host, boundary, data, styles: String, fix| Case { host, boundary, data, styles: styles + "\n", fix };
    let of_fix = format!("fix bonds all concordem/bond cohesive_beam {BEAM} {{state}} contact hertz_mindlin{prefixed}");
    vec![
        case(Host::Liggghts, "f f f", "bar.data", of_fix.clone(), "bonds"),
        case(
            Host::Liggghts,
            "p p p",
            "bar.data",
            format!("fix bonds all concordem/bond cpm {CPM} {{state}} contact cpm"),
            "bonds",
        ),
        case(Host::Lammps, "p p p", "bar.data", of_fix, "bonds"),
        case(
            Host::Lammps,
            "f f f",
            "bonded.data",
            format!("bond_style concordem/cpm contact cpm {{state}}\nbond_coeff * {CPM}"),
            "concordem_bonds",
        ),
        case(
            Host::Lammps,
            "p p p",
            "bonded.data",
            format!(
                "pair_style concordem/hertz_mindlin\npair_coeff * * {}\nbond_style concordem/cohesive_beam {{state}}\nbond_coeff * {BEAM}",
                CONTACT.join(" ")
            ),
            "concordem_bonds",
        ),
        case(
            Host::Lammps,
            "f f f",
            "bar.data",
            format!("pair_style concordem/hertz_mindlin {{state}}\npair_coeff * * {}", CONTACT.join(" ")),
            "concordem_contacts",
        ),
    ]
}

/// Write a bar that is torn apart and drifts across the border of a periodic box.
fn write_bar(case: &Case, folder: &Path) {
    let host = case.host;
    let (mut atoms, bonds) = bar();
    for atom in &mut atoms {
        atom.velocity.x += 40.0;
        // Masses follow from densities with rounding.
        atom.radius *= 0.99;
    }
    let [low, high] = if case.boundary == "p p p" { [-0.01, 0.041] } else { [-0.03, 0.08] };
    let (low, high) = (Vec3::new(low, -0.03, -0.03), Vec3::new(high, 0.08, 0.18));
    data_file_for(host, &folder.join("bar.data"), &atoms, &[], low, high);
    if host == Host::Lammps {
        data_file_for(host, &folder.join("bonded.data"), &atoms, &bonds, low, high);
    }
}

impl Case {
    /// A script that reads `data`; `next` are the commands after that.
    fn script(&self, data: &str, next: &str, option: &str, rest: &str) -> String {
        let head = head_for(self.host, data, self.boundary, 5e-4, DT);
        let fix = self.fix;
        format!(
            "{}{}fix integrate all nve/sphere\nthermo_style custom step f_{fix} f_{fix}[2] f_{fix}[3] f_{fix}[8]\n\
             thermo_modify format float %20.15g\n{}{rest}",
            head.replace(&format!("read_data {data}\n"), &format!("read_data {data}\n{next}")),
            self.styles.replace("{state}", option),
            dump_for(self.host, "out.dump", 100)
        )
    }

    /// File with the state that belongs to data file `data`.
    fn state_of(&self, data: &str) -> String {
        match self.host {
            Host::Liggghts => format!("{data}.{}", self.fix),
            Host::Lammps => data.to_owned(),
        }
    }

    /// The option that creates bonds.
    fn creates(&self) -> String {
        if self.fix == "bonds" { format!("bond distance {FACTOR}") } else { String::new() }
    }

    fn again(&self, option: &str) -> String {
        self.script("half.data", "reset_timestep 100\n", option, "run 100\n")
    }
}

#[test]
fn a_run_continued_from_a_data_file_equals_an_uninterrupted_one() {
    for case in cases() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        write_bar(&case, folder);
        let last = || {
            let all = std::fs::read_to_string(folder.join("out.dump")).unwrap();
            all[all.rfind("ITEM: TIMESTEP").unwrap()..].to_owned()
        };
        let first = case.script(case.data, "", &case.creates(), "run 100\nwrite_data half.data\nrun 100\n");
        let rows = thermo(&run_in(case.host, folder, &first, 2));
        let once = last();
        let (half, end) = (rows.iter().find(|row| row[0] == 100.0).unwrap(), rows.last().unwrap());
        // There are bonds or contacts with history, and bonds break before and after the file is written.
        assert!(half[1] + half[3] > 100.0 && end[0] == 200.0, "{half:?}");
        assert!(case.fix == "concordem_contacts" || (half[2] > 10.0 && end[2] > half[2] + 10.0), "{half:?} {end:?}");
        // Written on two processors; continued on fewer and on more. LAMMPS' MPI waits actively, so there one case on four is enough.
        let numbers = if case.host == Host::Liggghts || case.fix == "concordem_contacts" { [1, 4] } else { [1, 2] };
        for processors in numbers {
            let printed = run_in(case.host, folder, &case.again("state half.data"), processors);
            let name = format!("{:?} {} {}, {processors} processors", case.host, case.boundary, case.styles);
            assert!(once == last(), "{name}");
            let same = thermo(&printed).last().unwrap().clone();
            assert_eq!(same[..4], end[..4], "{name}");
            // Dissipated energies of all processors are summed in another order.
            assert!((same[4] - end[4]).abs() <= 1e-12 * end[4], "{name}: {same:?} {end:?}");
        }
        // The same file without its state: bonds of the atoms' lists start unstrained.
        if case.data == "bonded.data" {
            run_in(case.host, folder, &case.again(""), 1);
            assert!(once != last(), "the histories matter");
        }
    }
}

#[test]
fn states_that_do_not_fit_are_refused() {
    let all = cases();
    for (case, other_law) in [(&all[0], "linear_bond"), (&all[4], "cpm")] {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        write_bar(case, folder);
        let first = case.script(case.data, "", &case.creates(), "run 20\nwrite_data half.data\nwrite_restart half\n");
        run_in(case.host, folder, &first, 2);
        let whole = std::fs::read_to_string(folder.join(case.state_of("half.data"))).unwrap();
        let again = case.again("state state.data");
        let refused = |state: &str, script: &str, wanted: &str| {
            std::fs::write(folder.join(case.state_of("state.data")), state).unwrap();
            // On two processors, because there a refusal could also hang.
            let output = attempt_in(case.host, folder, script, 2);
            assert!(!output.status.success() && text(&output).contains(wanted), "{wanted}: {}", text(&output));
        };
        run_in(case.host, folder, &case.again("state half.data"), 1);
        refused("", &again, "has no state of ConcorDEM");
        refused(&whole[..whole.len() - 300], &again, "the file was edited or cut off, write it again");
        refused(&whole[..whole.rfind("# end of").unwrap()], &again, "the state ends too early");
        let renamed = whole.replace(&format!("state of fix {}:", case.fix), "state of fix links:");
        refused(&renamed, &again, "has the state of fix links, not of this one; give this fix the same id");
        let of_other = whole.replace("law cohesive_beam", &format!("law {other_law}"));
        refused(&of_other, &again, &format!("contains bonds of law {other_law}, not cohesive_beam"));
        refused(&whole.replace("# version ", "# version 9"), &again, "was written by another version of ConcorDEM");
        refused(&whole, &again.replace("state state.data", "state none.data"), "cannot open none.data");
        let delete = "group one id 17\ndelete_atoms group one compress no\n";
        let less = case.script("half.data", delete, "state state.data", "run 1\n");
        refused(&whole, &less, "has atom 17, which does not exist");
        // The restart file has the bonds, too.
        if case.host == Host::Liggghts {
            let twice = again.replace("read_data half.data", "read_restart half").replace("reset_timestep 100\n", "");
            refused(&whole, &twice.replace("atom_style sphere\n", ""), "and so has state.data; remove `state`");
        }
    }
}
