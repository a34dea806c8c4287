//! Random scripts: the same bits on any number of processors, and after a restart on another number. `CONCORDEM_HOST_DECKS` sets their number,
//! `CONCORDEM_HOST_DECKS_SEED` the first one.

mod harness;

use std::fmt::Write as _;
use std::path::Path;

use concordem_contact::math::Vec3;
use harness::{Atom, Dice, Host, data_file_for, dump_for, head_for, run_in, thermo};

fn number(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |text| text.parse().unwrap_or_else(|_| panic!("{name} is no number: {text}")))
}

fn choose<'a, T: ?Sized>(dice: &mut Dice, choices: &[&'a T]) -> &'a T {
    choices[(dice.roll() * choices.len() as f64) as usize]
}

/// A script in two halves, and one that continues from the file in the middle.
struct Deck {
    whole: String,
    second: String,
}

const HERTZ: &str =
    "hertz_mindlin contact.young 1e8 contact.poisson 0.3 contact.friction_coefficient 0.4 contact.restitution 0.7";
const FRICTIONAL: &str = "frictional contact.normal_stiffness 1e5 contact.shear_stiffness 5e4 contact.friction_coefficient 0.5 contact.damping_ratio 0.1";

/// Two cubes that move at random.
fn write_atoms(host: Host, folder: &Path, dice: &mut Dice) {
    let mut atoms = Vec::new();
    for side in [-1.0, 1.0] {
        let (corner, velocity) =
            (dice.vector() * 0.01 + Vec3::x() * (0.022 * side), dice.vector() * 30.0 - Vec3::x() * (20.0 * side));
        let (edge, spin) = (2 + (dice.roll() * 2.0) as i32, dice.vector() * 300.0);
        for k in 0..edge.pow(3) {
            let place = Vec3::new(f64::from(k % edge), f64::from(k / edge % edge), f64::from(k / edge / edge));
            let radius = 0.005 * (0.9 + 0.1 * dice.roll());
            let kind = 1 + usize::from(dice.roll() > 0.7);
            atoms.push(Atom {
                kind,
                velocity,
                spin,
                ..Atom::resting(corner + place * 0.0099 - Vec3::repeat(0.005), radius)
            });
        }
    }
    atoms[0].kind = 1;
    atoms[1].kind = 2;
    data_file_for(host, &folder.join("atoms.data"), &atoms, &[], Vec3::repeat(-0.06), Vec3::repeat(0.06));
}

fn deck(host: Host, folder: &Path, dice: &mut Dice) -> Deck {
    write_atoms(host, folder, dice);
    let law = choose(
        dice,
        &[
            "linear_bond normal_stiffness 1e6 shear_stiffness 5e5 normal_strength 30 shear_strength 30 damping_ratio 0.1",
            "cohesive_beam young 1e8 poisson 0.3 radius_ratio 0.7 tensile_strength 1e6",
            "cpm young 1e9 shear_ratio 0.2 cohesion 1e5 friction_coefficient 0.8 crack_onset_strain 1.5e-4 relative_ductility 4 omega_threshold 0.99",
        ],
    );
    let contact = choose(dice, &["none", HERTZ, FRICTIONAL, HERTZ]);
    let boundary = choose(dice, &["f f f", "p p p", "f p f"]);
    let growth = "variable d equal 0.0099+2e-6*step\nfix grow some adapt 5 atom diameter v_d\n";
    let first = choose(dice, &["", "neigh_modify exclude group some rest\n", "neigh_modify exclude type 1 2\n"]);
    let other = choose(
        dice,
        &["", "fix still some freeze\n", "fix held some setforce 0 0 0\n", "fix slow all viscous 0.1\n", growth],
    );
    let fix = format!("fix bonds all concordem/bond {law} bond distance 1.1 contact {contact}\n");
    let order = dice.roll() > 0.5;
    let fixes = |fix: &str| if order { format!("{fix}{other}") } else { format!("{other}{fix}") };
    let steps = 20 + (dice.roll() * 200.0) as usize;
    let integrate = "fix integrate all nve/sphere\n";
    let output = |every: usize| {
        format!(
            "thermo_style custom step f_bonds f_bonds[2] f_bonds[3]\nthermo {every}\n{}",
            dump_for(host, "out.dump", every)
        )
    };
    let mut head = head_for(host, "atoms.data", boundary, 2e-3, 5e-7);
    let mut again = match host {
        Host::Liggghts => {
            "units si\natom_modify sort 0 0\nnewton off\ncommunicate single vel yes\nread_restart half\n".to_owned()
        }
        Host::Lammps => "comm_modify vel yes\nread_restart half\n".to_owned(),
    };
    again += "neighbor 2e-3 bin\nneigh_modify every 1 delay 0\ntimestep 5e-7\n";
    if host == Host::Lammps {
        head = head.replace("bpm/sphere", "sphere 1").replace("special_bonds lj 0 1 1 coul 0 1 1\n", "");
        let file = folder.join("atoms.data");
        let text = std::fs::read_to_string(&file).unwrap();
        // Atoms without molecules and bonds.
        let (header, atoms) = text.split_once("\nAtoms\n\n").unwrap();
        let (atoms, velocities) = atoms.split_once("\n\nVelocities").unwrap();
        let header: String = header
            .lines()
            .filter(|line| !line.contains("bond") && !line.contains("special"))
            .fold(String::new(), |out, line| out + line + "\n");
        let row = |out: String, line: &str| {
            let words: Vec<&str> = line.split(' ').collect();
            out + &[&words[..1], &words[2..]].concat().join(" ") + "\n"
        };
        let atoms = atoms.lines().fold(String::new(), row);
        std::fs::write(&file, format!("{header}\nAtoms\n\n{atoms}\nVelocities{velocities}")).unwrap();
    }
    let groups = "group some id 1:4\ngroup rest subtract all some\n";
    let mut whole = format!("{head}{groups}{first}{integrate}{}{}run {steps}\n", fixes(&fix), output(steps));
    writeln!(whole, "write_restart half\nrun {steps}").unwrap();
    let resumed = fixes(&fix.replace("bond distance 1.1", "bond none"));
    let groups = if host == Host::Lammps { "" } else { groups };
    let second = format!("{again}{groups}{first}{integrate}{resumed}{}run {steps}\n", output(2 * steps));
    Deck { whole, second }
}

#[test]
fn random_decks_have_the_same_bits() {
    let (count, seed) = (number("CONCORDEM_HOST_DECKS", 8), number("CONCORDEM_HOST_DECKS_SEED", 1));
    harness::record::random("scripts", seed, count, |seed| {
        compare(seed);
        true
    });
}

/// Panics if the deck of this seed has other bits on more processors or after a restart.
fn compare(seed: u64) {
    let mut dice = Dice(seed);
    let host = if seed.is_multiple_of(2) { Host::Liggghts } else { Host::Lammps };
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let Deck { whole, second } = deck(host, folder, &mut dice);
    let last = |script: &str, processors: usize| {
        let rows = thermo(&run_in(host, folder, script, processors));
        let text = std::fs::read_to_string(folder.join("out.dump")).unwrap();
        let at = text.rfind("ITEM: TIMESTEP").unwrap();
        (rows.last().unwrap().clone(), text[at..].to_owned())
    };
    let wanted = last(&whole, 1);
    let many = [2, 4, 8][(dice.roll() * 3.0) as usize];
    let again = last(&whole, many);
    assert!(wanted == again, "deck {seed}: {host:?} on {many} processors: {:?} {:?}\n{whole}", wanted.0, again.0);
    let others = [1, 2, 4][(dice.roll() * 3.0) as usize];
    let resumed = last(&second, others);
    assert!(
        wanted == resumed,
        "deck {seed}: {host:?} from {many} on {others} processors: {:?} {:?}\n{whole}\n{second}",
        wanted.0,
        resumed.0
    );
}
