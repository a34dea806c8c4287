//! Random scripts: the same bits on any number of processors, and after a restart on another number. `CONCORDEM_HOST_DECKS` sets their number,
//! `CONCORDEM_HOST_DECKS_SEED` the first one.

use std::fmt::Write as _;
use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::harness::{self, Atom, Dice, Host, data_file_for, dump_for, head_for, run_together, thermo};
use concordem_contact::math::Vec3;

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
    harness::record::random("scripts", seed, count, 20, compare);
}

/// What a run ends with: the last row of numbers, and the last frame of the dump.
type End = (Vec<f64>, String);

/// A deck of a seed.
struct Drawn {
    seed: u64,
    folder: PathBuf,
    deck: Deck,
    /// Processors of the run that is compared with one processor, and writes the file of the middle.
    many: usize,
    /// Those of the run that continues from that file.
    others: usize,
    on_one: End,
}

impl Drawn {
    /// The end in the output of a start that ran this deck.
    fn end(&self, printed: &str) -> End {
        let own = printed.split("\ndeck ").find(|part| part.split_whitespace().next() == Some(&self.seed.to_string()));
        let rows = thermo(own.unwrap_or_else(|| panic!("no deck {} in\n{printed}", self.seed)));
        let text = std::fs::read_to_string(self.folder.join("out.dump")).unwrap();
        let at = text.rfind("ITEM: TIMESTEP").unwrap();
        (rows.last().unwrap().clone(), text[at..].to_owned())
    }
}

/// Run a script of each deck in one start of the program; the decks and their ends.
fn ends<'a>(
    host: Host,
    decks: impl Iterator<Item = &'a Drawn>,
    script: impl Fn(&Deck) -> &str,
    processors: usize,
) -> Vec<(&'a Drawn, End)> {
    let decks: Vec<&Drawn> = decks.collect();
    let Some(first) = decks.first() else { return Vec::new() };
    let whole =
        |one: &&Drawn| format!("shell cd {}\nprint \"deck {}\"\n{}", one.folder.display(), one.seed, script(&one.deck));
    let scripts: Vec<String> = decks.iter().map(whole).collect();
    let printed = run_together(host, first.folder.parent().unwrap(), &scripts, processors);
    decks.into_iter().map(|one| (one, one.end(&printed))).collect()
}

/// Panics if a deck of these seeds has other bits on more processors or after a restart. Decks share starts of a program, which take longer than their
/// steps. Returns their number.
fn compare(seeds: Range<u64>) -> usize {
    let count = seeds.clone().count();
    for (host, remainder) in [(Host::Liggghts, 0), (Host::Lammps, 1)] {
        let folder = tempfile::tempdir().unwrap();
        let draw = |seed: u64| {
            let (mut dice, folder) = (Dice(seed), folder.path().join(seed.to_string()));
            std::fs::create_dir(&folder).unwrap();
            let deck = deck(host, &folder, &mut dice);
            let many = [2, 4, 8][(dice.roll() * 3.0) as usize];
            let others = [1, 2, 4][(dice.roll() * 3.0) as usize];
            Drawn { seed, folder, deck, many, others, on_one: End::default() }
        };
        let mut decks: Vec<Drawn> = seeds.clone().filter(|seed| seed % 2 == remainder).map(draw).collect();
        let on_one: Vec<End> =
            ends(host, decks.iter(), |deck| &deck.whole, 1).into_iter().map(|(_, end)| end).collect();
        for (one, end) in decks.iter_mut().zip(on_one) {
            one.on_one = end;
        }
        for processors in [2, 4, 8] {
            for (one, end) in
                ends(host, decks.iter().filter(|one| one.many == processors), |deck| &deck.whole, processors)
            {
                let Drawn { seed, deck, on_one, .. } = one;
                assert!(
                    *on_one == end,
                    "deck {seed}: {host:?} on {processors} processors: {:?} {:?}\n{}",
                    on_one.0,
                    end.0,
                    deck.whole
                );
            }
        }
        for processors in [1, 2, 4] {
            for (one, end) in
                ends(host, decks.iter().filter(|one| one.others == processors), |deck| &deck.second, processors)
            {
                let Drawn { seed, deck, many, on_one, .. } = one;
                assert!(
                    *on_one == end,
                    "deck {seed}: {host:?} from {many} on {processors} processors: {:?} {:?}\n{}\n{}",
                    on_one.0,
                    end.0,
                    deck.whole,
                    deck.second
                );
            }
        }
    }
    count
}
