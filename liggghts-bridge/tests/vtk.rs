//! Files of bonds for ParaView, as VTK reads them, beside what a dump of the same steps has.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use crate::harness::{self, Atom, Dice, Host, data_file_for, dump_for, frames, head_for, refused_in, run_in, tables};
use concordem_contact::math::Vec3;
use serde::Deserialize;

const BOTH: [Host; 2] = [Host::Liggghts, Host::Lammps];

/// Length of the periodic box, m.
const EDGE: f64 = 0.06;

/// Step, s.
const DT: f64 = 1e-6;

#[derive(Deserialize)]
struct File {
    time: [f64; 1],
    /// Both centers.
    ends: Vec<[f64; 6]>,
    fields: Fields,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Fields {
    ids: Vec<[u64; 2]>,
    bonded: Vec<f64>,
    damage: Vec<f64>,
    normal_force: Vec<f64>,
    shear_force: Vec<f64>,
    force: Vec<[f64; 3]>,
    moment: Vec<[f64; 3]>,
    area: Vec<f64>,
}

/// A line: both centers, then its fields as in [`Fields`].
type Line = (Vec<f64>, Vec<f64>);

impl File {
    /// By ids.
    fn lines(&self) -> BTreeMap<[u64; 2], Line> {
        let f = &self.fields;
        let of = |k: usize| {
            let one = [f.bonded[k], f.damage[k], f.normal_force[k], f.shear_force[k]];
            let rest = [&one[..], &f.force[k], &f.moment[k], &[f.area[k]]].concat();
            (f.ids[k], (self.ends[k].to_vec(), rest))
        };
        let lines: BTreeMap<_, _> = (0..f.ids.len()).map(of).collect();
        assert_eq!([lines.len(); 2], [f.ids.len(), self.ends.len()]);
        lines
    }
}

/// The files as VTK reads them.
fn read(folder: &Path, names: &[&str]) -> Vec<File> {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let python = tests.join("../../.venv/bin/python");
    assert!(python.exists(), "{} is missing: run .ci/setup first", python.display());
    let output =
        Command::new(python).arg(tests.join("read_lines.py")).args(names).current_dir(folder).output().unwrap();
    assert!(output.status.success(), "{}", harness::text(&output));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn names_in(folder: &Path) -> Vec<String> {
    let name = |entry: std::io::Result<std::fs::DirEntry>| entry.unwrap().file_name().into_string().unwrap();
    let mut names: Vec<String> =
        std::fs::read_dir(folder).unwrap().map(name).filter(|name| name.contains(".vtp")).collect();
    names.sort();
    names
}

/// A bar through a periodic border, whose atoms fly apart.
fn bar(host: Host, folder: &Path) {
    let mut dice = Dice(3);
    let atoms: Vec<Atom> = (0..24_usize)
        .map(|k| {
            let place = Vec3::new((k % 6) as f64, (k / 6 % 2) as f64, (k / 12) as f64) * 0.01;
            Atom {
                velocity: Vec3::x() * (20.0 * place.x) + dice.vector() * 2.0,
                spin: dice.vector() * 50.0,
                ..Atom::resting(place + dice.vector() * 2e-4 + Vec3::x() * 0.003, 0.005)
            }
        })
        .collect();
    data_file_for(host, &folder.join("bar.data"), &atoms, &[], Vec3::new(0.0, -EDGE, -EDGE), Vec3::repeat(EDGE));
}

/// Panics if the line of a row of compute concordem/bond/local has other numbers than it, or other ends than the atoms.
fn check_row(row: &[f64], lines: &BTreeMap<[u64; 2], Line>, atoms: &[harness::Dumped]) {
    let ids = [row[0] as u64, row[1] as u64];
    let (ends, fields) = &lines[&ids];
    let ends = [Vec3::from_column_slice(&ends[..3]), Vec3::from_column_slice(&ends[3..])];
    let (force, normal) = (Vec3::from_column_slice(&row[2..5]), (ends[1] - ends[0]).normalize());
    let tension = force.dot(&normal);
    assert_eq!(fields[4..10], row[2..8]);
    assert_eq!([fields[10], fields[1], fields[0]], row[12..15]);
    // Rounding of the ends, of numbers of some centimeters, and of the force.
    let shear = (force - normal * tension).norm();
    assert!(
        (fields[2] - tension).abs() + (fields[3] - shear).abs() <= 1e-12 * force.norm(),
        "{fields:?} {tension} {shear}"
    );
    assert!(((ends[1] - ends[0]).norm() - row[11]).abs() < 1e-16, "{ends:?} {row:?}");
    for (end, id) in ends.iter().zip(ids) {
        let off = end - atoms[id as usize - 1].position;
        let images = (off.x / EDGE).round();
        assert!((off - Vec3::x() * (images * EDGE)).norm() < 1e-16 && images.abs() <= 1.0, "{end:?} {off:?}");
    }
}

#[test]
fn files_for_paraview_have_the_lines_of_a_dump_on_any_number_of_processors() {
    for host in BOTH {
        let mut first: Vec<BTreeMap<[u64; 2], Line>> = Vec::new();
        for processors in [1, 2, 4] {
            let folder = tempfile::tempdir().unwrap();
            let folder = folder.path();
            bar(host, folder);
            let columns: Vec<String> = (1..=15).map(|k| format!("c_rows[{k}]")).collect();
            let format = if host == Host::Liggghts {
                format!("format \"%.17g{}\"", " %.17g".repeat(14))
            } else {
                "format float %.17g".to_owned()
            };
            let script = head_for(host, "bar.data", "p f f", 2e-3, DT)
                + "fix integrate all nve/sphere\n\
                   fix bonds all concordem/bond linear_bond normal_stiffness 1e6 shear_stiffness 5e5 normal_strength 30 shear_strength 60 \
                   bond distance 1.15 contact frictional contact.normal_stiffness 1e5 contact.shear_stiffness 5e4 contact.friction_coefficient 0.5\n\
                   group some id 1:12\n\
                   fix view all concordem/bond/vtk 20 bonds.*.vtp bonds\nfix part some concordem/bond/vtk 60 some.*.vtp bonds\n\
                   compute rows all concordem/bond/local bonds\n"
                + &format!("dump rows all local 20 rows.dump {}\ndump_modify rows {format}\n", columns.join(" "))
                + &dump_for(host, "out.dump", 20)
                + "run 50\nrun 15\n";
            run_in(host, folder, &script, processors);
            let steps = [0, 20, 40, 60];
            let names = steps.map(|step| format!("bonds.{step}.vtp"));
            let mut all = names_in(folder);
            all.retain(|name| !names.contains(name));
            assert_eq!(all, ["some.0.vtp", "some.60.vtp"]);
            let files = read(folder, &names.each_ref().map(String::as_str));
            let (rows, atoms) = (tables(&folder.join("rows.dump")), frames(&folder.join("out.dump")));
            for (k, (file, step)) in files.iter().zip(steps).enumerate() {
                // The host may add up its time step by step: the rounding of 60 sums.
                assert!((file.time[0] - DT * step as f64).abs() <= 60.0 * f64::EPSILON * DT * 60.0, "{:?}", file.time);
                let lines = file.lines();
                let ((at, rows), (_, atoms)) = (
                    rows.iter().rfind(|(at, _)| *at == step).unwrap(),
                    atoms.iter().rfind(|(at, _)| *at == step).unwrap(),
                );
                assert_eq!((*at, lines.len()), (step, rows.len()));
                for row in rows {
                    check_row(row, &lines, atoms);
                }
                let bonds = lines.values().filter(|(_, fields)| fields[0] == 1.0).count();
                let across =
                    lines.values().filter(|(ends, _)| ends[0].max(ends[3]) > EDGE || ends[0].min(ends[3]) < 0.0);
                match k {
                    0 => assert!(bonds == 48 && across.count() == 4, "{host:?}: {bonds}"),
                    3 => assert!(bonds > 0 && bonds < 48, "some have broken: {host:?}: {bonds}"),
                    _ => {}
                }
                // The same bits, in another order.
                if processors == 1 {
                    first.push(lines);
                } else {
                    assert_eq!(lines, first[k], "{host:?} on {processors}, step {step}");
                }
            }
            let some = read(folder, &["some.60.vtp"]).remove(0).lines();
            let mut wanted = files[3].lines();
            wanted.retain(|ids, _| ids.iter().all(|id| *id <= 12));
            assert!(some == wanted && !some.is_empty(), "{host:?}: {} {}", some.len(), wanted.len());
        }
    }
}

/// The fix that LAMMPS' bond styles define.
#[test]
fn files_for_paraview_have_the_bonds_of_bond_styles() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let atoms: Vec<Atom> = (0..4).map(|k| Atom::resting(Vec3::x() * (0.01 * f64::from(k)), 0.005)).collect();
    data_file_for(
        Host::Lammps,
        &folder.join("row.data"),
        &atoms,
        &[[1, 2], [2, 3], [3, 4]],
        Vec3::repeat(-0.05),
        Vec3::repeat(0.1),
    );
    let script = head_for(Host::Lammps, "row.data", "f f f", 2e-3, DT)
        + "fix integrate all nve/sphere\nbond_style concordem/linear_bond\nbond_coeff 1 normal_stiffness 1e5 shear_stiffness 0\n\
           fix view all concordem/bond/vtk 10 bonds.*.vtp concordem_bonds\ngroup end id 4\nvelocity end set 1 0 0\nrun 10\n";
    run_in(Host::Lammps, folder, &script, 2);
    let lines = read(folder, &["bonds.10.vtp"]).remove(0).lines();
    assert_eq!(lines.keys().collect::<Vec<_>>(), [&[1, 2], &[2, 3], &[3, 4]]);
    // The end has moved by 10 steps; waves are as slow as the atoms are heavy: 1e5 N/m for 1.3 g and 10 µs is 0.8 % of the stretch.
    let force = lines[&[3, 4]].1[2];
    assert!((force / (1e5 * 10.0 * DT) - 1.0).abs() < 0.02, "{force}");
}

#[test]
fn files_for_paraview_are_refused_where_they_cannot_be_written() {
    for host in BOTH {
        let script = |fix: &str| {
            head_for(host, "bar.data", "p f f", 2e-3, DT)
                + "fix integrate all nve/sphere\nfix bonds all concordem/bond linear_bond normal_stiffness 1e6 shear_stiffness 5e5 \
                   bond distance 1.15 contact none\nfix view all concordem/bond/vtk "
                + fix
                + "\nrun 1\n"
        };
        let cases = [
            ("0 bonds.*.vtp bonds", "`0` is no number of steps; give an integer from 1 on"),
            ("10.5 bonds.*.vtp bonds", "`10.5` is no number of steps; give an integer from 1 on"),
            ("10 bonds.vtp bonds", "`bonds.vtp` is no name for files of several steps; give one * for the step"),
            ("10 bonds.*.vtk bonds", "and the ending .vtp"),
            ("10 bonds.*.vtp", "give N FILE FIX-ID after the style"),
            ("10 bonds.*.vtp bonds more", "give N FILE FIX-ID after the style"),
            ("10 bonds.*.vtp integrate", "there is no fix concordem/bond with id integrate"),
            ("10 missing/bonds.*.vtp bonds", "cannot create missing/bonds.0.vtp.part: No such file or directory"),
        ];
        refused_in(host, &cases.map(|(fix, wanted)| (script(fix), wanted)), |folder| bar(host, folder));
    }
}
