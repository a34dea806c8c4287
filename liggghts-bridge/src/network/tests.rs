//! Tests of the network with atoms in plain arrays, as a host has them.

use super::*;
use crate::atoms::{LARGEST_TAG, Tags};
use crate::bond_list::BondOfList;
use crate::options::Units;

/// Arrays of a host with `owned` atoms and ghosts.
struct Arrays {
    narrow: Vec<i32>,
    wide: Vec<i64>,
    owned: usize,
    kind: Vec<i32>,
    mask: Vec<i32>,
    position: Vec<f64>,
    velocity: Vec<f64>,
    radius: Vec<f64>,
    force: Vec<f64>,
    torque: Vec<f64>,
    memory: Vec<f64>,
}

impl Arrays {
    /// Atoms of `chain` as numbers along a chain of overlapping spheres; `ids` gives their ids.
    fn new(network: &Network, owned: &[usize], ghosts: &[usize], ids: impl Fn(usize) -> Tag, is_wide: bool) -> Self {
        let all: Vec<usize> = owned.iter().chain(ghosts).copied().collect();
        let count = all.len();
        let tags: Vec<Tag> = all.iter().map(|&k| ids(k)).collect();
        let mut memory = vec![0.0; count * network.atom_width()];
        for of_atom in memory.chunks_mut(network.atom_width()) {
            network.initial_memory(0, of_atom);
        }
        Self {
            narrow: if is_wide { Vec::new() } else { tags.iter().map(|&tag| i32::try_from(tag).unwrap()).collect() },
            wide: if is_wide { tags } else { Vec::new() },
            owned: owned.len(),
            kind: vec![1; count],
            mask: vec![1; count],
            position: all.iter().flat_map(|&k| [0.01 * k as f64, 1e-4 * (k * k) as f64, 0.0]).collect(),
            velocity: all.iter().flat_map(|&k| [0.1 * k as f64, 0.0, 0.3]).collect(),
            radius: vec![0.005; count],
            force: vec![0.0; 3 * owned.len()],
            torque: vec![0.0; 3 * owned.len()],
            memory,
        }
    }

    fn atoms(&mut self) -> Atoms<'_> {
        Atoms {
            owned: self.owned,
            tag: if self.wide.is_empty() { Tags::Narrow(&self.narrow) } else { Tags::Wide(&self.wide) },
            kind: &self.kind,
            mask: &self.mask,
            group: 1,
            position: &self.position,
            velocity: &self.velocity,
            angular_velocity: &self.velocity,
            radius: &self.radius,
            mass: &self.radius,
            effective_mass: &self.radius,
            force: &mut self.force,
            torque: &mut self.torque,
            memory: &mut self.memory,
            edge: [0.0; 3],
            low: [0.0; 3],
            high: [0.1; 3],
            dt: 1e-6,
            step: 1,
        }
    }
}

fn empty() -> Network {
    of("linear_bond normal_stiffness 1e6 shear_stiffness 5e5 bond distance 1.2")
}

fn of(words: &str) -> Network {
    let words: Vec<String> = words.split_whitespace().map(str::to_owned).collect();
    Network::new(Options::parse(&words, 1, Units::Si).unwrap()).unwrap()
}

fn rebuild(network: &mut Network, arrays: &mut Arrays) -> Result<(), NetworkError> {
    place(network, arrays);
    network.rebuild(&mut arrays.atoms(), 1e-3, 0.1, 0.005, None)
}

/// Give atoms their places, ghosts as well, which get them from their owners in a host.
fn place(network: &Network, arrays: &mut Arrays) {
    let owned = std::mem::replace(&mut arrays.owned, arrays.kind.len());
    network.place_new(&mut arrays.atoms());
    arrays.owned = owned;
}

/// Forces of a step in which an atom moved, after a bonded chain of five atoms whose last one is a ghost was built.
fn forces(ids: impl Fn(usize) -> Tag + Copy, is_wide: bool) -> (Network, Vec<f64>) {
    let mut network = empty();
    let mut arrays = Arrays::new(&network, &[3, 0, 1, 2], &[4], ids, is_wide);
    rebuild(&mut network, &mut arrays).unwrap();
    network.make_near().unwrap();
    assert_eq!(network.fresh.len(), 4);
    rebuild(&mut network, &mut arrays).unwrap();
    arrays.position[0] += 1e-5;
    network.forces(&mut arrays.atoms(), false, true, true).unwrap();
    (network, arrays.force)
}

#[test]
fn ids_of_64_bits_give_the_same_forces() {
    let wide = |k: usize| LARGEST_TAG - 10 + k as Tag;
    let (mut network, of_wide) = forces(wide, true);
    let (_, of_narrow) = forces(|k| 1 + k as Tag, false);
    assert!(of_narrow.iter().any(|force| *force != 0.0));
    assert_eq!(of_wide, of_narrow);
    assert_eq!(network.rows()[..2], [wide(0) as f64, wide(1) as f64]);
    // Records keep the ids on their way to another processor.
    let mut buffer = Vec::new();
    network.pack(wide(1), true, &mut buffer);
    assert_eq!(Record::all_compact(&buffer, network.width).count(), 2);
    let mut other = empty();
    other.unpack(wide(1), &buffer).unwrap();
    let mut arrays = Arrays::new(&other, &[1], &[0, 2], wide, true);
    rebuild(&mut other, &mut arrays).unwrap();
    assert_eq!((other.sums().bonds, other.ends()), (1.0, [1.0, 1.0]));
}

/// All records that `network` is to store.
fn counted(network: &Network, arrays: &mut Arrays) -> Vec<Record> {
    let mut records = Vec::new();
    network.each_counted(&arrays.atoms(), &mut |_, record| records.push(*record));
    records
}

/// Those that the owned atoms take into a restart file.
fn written(network: &mut Network, arrays: &mut Arrays) -> Vec<Record> {
    let [count, most] = network.begin_restart(&arrays.atoms()).unwrap();
    let (mut all, mut longest) = (Vec::new(), 0);
    for i in 0..arrays.owned {
        let length = network.restart_length(i);
        let piece = network.restart_piece(i).unwrap();
        assert_eq!(piece.len(), length);
        longest = longest.max(length);
        all.extend(piece);
    }
    let width = network.width;
    let records: Vec<_> =
        Record::all_compact(&all, width).map(|(at, head)| Record::read_compact(&all[at..], &head, width)).collect();
    assert_eq!((records.len(), longest), (count, most));
    records
}

/// The atoms together take each record once, whether it is of a bond, came with an atom, or was read from another file. A piece whose
/// length has changed is an error.
#[test]
fn atoms_take_all_records_into_a_restart_file() {
    let ids = |k: usize| 1 + k as Tag;
    let (mut network, _) = forces(ids, false);
    let mut arrays = Arrays::new(&network, &[3, 0, 1, 2], &[4], ids, false);
    let of_bonds = written(&mut network, &mut arrays);
    assert_eq!((of_bonds.len(), &of_bonds), (4, &counted(&network, &mut arrays)));
    let mut buffer = Vec::new();
    network.pack(ids(1), true, &mut buffer);
    let mut arrived = empty();
    arrived.unpack(ids(1), &buffer).unwrap();
    let mut arrays_there = Arrays::new(&arrived, &[1], &[0, 2], ids, false);
    // Of its two bonds, the one to the higher id.
    let with_atom = written(&mut arrived, &mut arrays_there);
    assert_eq!((with_atom.len(), &with_atom), (1, &counted(&arrived, &mut arrays_there)));
    let mut read = empty();
    network.begin_restart(&arrays.atoms()).unwrap();
    for i in 0..4 {
        read.restore(ids(i), network.restart_piece(i).unwrap()).unwrap();
    }
    assert_eq!(written(&mut read, &mut arrays), of_bonds);
    // As if a bond had been damaged since.
    network.pieces.lengths[0] -= 1;
    assert!(matches!(network.restart_piece(0), Err(NetworkError::ChangedWhileWritten)));
}

/// The order of sums follows from positions, so forces have the same bits whatever the ids, and so has the force that a row names.
#[test]
fn ids_do_not_change_forces() {
    let (ascending, wanted) = forces(|k| 1 + k as Tag, false);
    let (scattered, found) = forces(|k| [3, 1, 5, 2, 4][k], false);
    assert_eq!(found, wanted);
    assert!(wanted.iter().filter(|force| **force != 0.0).count() > 6, "{wanted:?}");
    // Bond 0: atoms 0 and 1 of the chain, then 1 and 0 by ids. A row states the force on the atom with the lower id.
    let (wanted, found) = (ascending.rows(), scattered.rows());
    assert_eq!((wanted[..2].to_vec(), found[..2].to_vec()), (vec![1.0, 2.0], vec![1.0, 3.0]));
    for k in 2..8 {
        assert_eq!(found[k], -wanted[k], "real {k}");
    }
    assert_eq!(found[8..Network::ROW], wanted[8..Network::ROW]);
}

/// Places follow the curve through the box, whatever the processor, and stay when atoms move. Atoms outside the box, where hosts may put
/// them for a moment, have places, too.
#[test]
fn atoms_keep_their_places() {
    let network = empty();
    let places = |arrays: &mut Arrays| {
        network.place_new(&mut arrays.atoms());
        let atoms = arrays.atoms();
        (0..atoms.owned).map(|i| network.place_of(&atoms, i)).collect::<Vec<_>>()
    };
    let of = |owned: &[usize]| Arrays::new(&network, owned, &[], |k| 1 + k as Tag, false);
    let mut arrays = of(&[0, 1, 2, 3]);
    let here = places(&mut arrays);
    assert!(here.iter().all(|place| (1..=1 << 51).contains(place)), "{here:?}");
    let there = places(&mut of(&[2, 0]));
    assert_eq!(there, [here[2], here[0]]);
    arrays.position.fill(-1.0);
    assert_eq!(places(&mut arrays), here);
    let mut outside = of(&[0]);
    outside.position.copy_from_slice(&[f64::NAN, -1.0, 7.0]);
    assert_ne!(places(&mut outside), [0]);
}

#[test]
fn ids_that_records_cannot_hold_are_refused() {
    for id in [0, -3, LARGEST_TAG + 1] {
        let mut network = empty();
        let mut arrays = Arrays::new(&network, &[0], &[], |_| id, true);
        let error = rebuild(&mut network, &mut arrays).unwrap_err().to_string();
        assert!(error.contains(&format!("at most 2^53, but {id} is not")), "{error}");
    }
}

/// Bonds that stay, leave, and arrive at a rebuild: the history of each goes with its ids.
#[test]
fn bonds_follow_their_atoms_through_rebuilds() {
    let ids = |k: usize| 10 - k as Tag;
    let (mut first, _) = forces(ids, false);
    let history = |network: &mut Network, k: usize| {
        let mut buffer = Vec::new();
        network.pack(ids(k), false, &mut buffer);
        let width = network.width;
        let record = |(at, head)| Record::read_compact(&buffer[at..], &head, width);
        let mut records: Vec<_> = Record::all_compact(&buffer, width).map(record).collect();
        records.sort_by_key(Record::key);
        records
    };
    let all: Vec<_> = (0..4).map(|k| history(&mut first, k)).collect();
    assert!(all[3][0].history.iter().any(|real| *real != 0.0), "there is a history");
    // Atoms 0 and 1 leave; 2 and 3 stay; 1 becomes a ghost. The other processor gets what leaves.
    let mut second = empty();
    for k in [0, 1] {
        let mut buffer = Vec::new();
        first.pack(ids(k), true, &mut buffer);
        second.unpack(ids(k), &buffer).unwrap();
    }
    let mut here = Arrays::new(&first, &[2, 3], &[1, 4], ids, false);
    let mut there = Arrays::new(&second, &[0, 1], &[2], ids, false);
    rebuild(&mut first, &mut here).unwrap();
    rebuild(&mut second, &mut there).unwrap();
    for (k, wanted) in all.iter().enumerate() {
        let owner = if k < 2 { &mut second } else { &mut first };
        assert_eq!(history(owner, k), *wanted, "atom {k}");
    }
    // A bond counts where its atom is that comes first along the curve: 1 before 2 before 3, 4 before 3.
    assert_eq!((first.sums().bonds, second.sums().bonds, first.ends()), (1.0, 2.0, [1.0, 3.0]));
    // They return: the bond of atoms 1 and 2 arrives, although it is held here.
    for k in [0, 1] {
        let mut buffer = Vec::new();
        second.pack(ids(k), true, &mut buffer);
        first.unpack(ids(k), &buffer).unwrap();
    }
    let mut here = Arrays::new(&first, &[2, 3, 0, 1], &[4], ids, false);
    rebuild(&mut first, &mut here).unwrap();
    assert_eq!(first.ends(), [3.0, 4.0]);
    // An atom that is gone, though its bond is here.
    let mut less = Arrays::new(&first, &[2, 3], &[4], ids, false);
    let error = rebuild(&mut first, &mut less).unwrap_err().to_string();
    assert!(error.contains("bond of atoms 8 and 9"), "{error}");
}

/// The atom of a bond gets a type that has no parameters for it.
#[test]
fn a_bond_without_parameters_is_refused() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let bonded = "linear_bond = { normal_stiffness = 1e6, shear_stiffness = 5e5 }";
    let materials = [("a", bonded), ("b", "")];
    let tables = materials.map(|(name, law)| format!("[[material]]\nname = \"{name}\"\ndensity = 1\n{law}\n"));
    std::fs::write(file.path(), tables.concat()).unwrap();
    let text = format!("linear_bond materials {} bond distance 1.2", file.path().display());
    let words: Vec<String> = text.split_whitespace().map(str::to_owned).collect();
    let mut network = Network::new(Options::parse(&words, 2, Units::Si).unwrap()).unwrap();
    let mut arrays = Arrays::new(&network, &[0, 1, 2], &[], |k| 1 + k as Tag, false);
    rebuild(&mut network, &mut arrays).unwrap();
    network.make_near().unwrap();
    rebuild(&mut network, &mut arrays).unwrap();
    assert_eq!(network.sums().bonds, 2.0);
    arrays.kind[1] = 2;
    let error = rebuild(&mut network, &mut arrays).unwrap_err().to_string();
    assert!(error.contains("law linear_bond has no parameters for atom types [1, 2]"), "{error}");
}

/// Lines of the user's list are forgotten once their bonds exist.
#[test]
fn a_list_is_kept_until_its_bonds_exist() {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), "2 1\n2 3 0.011\n").unwrap();
    let mut network =
        of(&format!("linear_bond normal_stiffness 1e6 shear_stiffness 5e5 bond list {}", file.path().display()));
    let mut piece = [BondOfList::default(); 4];
    assert_eq!(network.read_bond_list(&mut piece).unwrap(), 2);
    network.keep_listed(&piece[..2]);
    assert_eq!(network.read_bond_list(&mut piece).unwrap(), 0);
    network.sort_listed().unwrap();
    let listed: Vec<_> = network.listed().iter().map(|bond| (bond.ids, bond.length, bond.line)).collect();
    assert_eq!(listed, [([1, 2], 0.0, 1), ([2, 3], 0.011, 2)]);
    network.make_listed(&piece[..2]);
    assert!(network.listed().is_empty());
    let mut arrays = Arrays::new(&network, &[0, 1, 2], &[], |k| 1 + k as Tag, false);
    rebuild(&mut network, &mut arrays).unwrap();
    assert_eq!(network.sums().bonds, 2.0);
    assert_eq!(network.state.bonds[0].contacts().view(1).reference.length, 0.011);
}

/// Without a mean radius, beams with `radius_ratio` would have no section, carry nothing, and never break.
#[test]
fn sections_need_the_mean_radius_only_with_a_ratio() {
    let made = |section: &str, mean_radius: f64| {
        let mut network = of(&format!("cohesive_beam young 1e9 poisson 0.2 {section} bond distance 1.2"));
        let mut arrays = Arrays::new(&network, &[0, 1], &[], |k| 1 + k as Tag, false);
        place(&network, &mut arrays);
        network.rebuild(&mut arrays.atoms(), 1e-3, 0.1, mean_radius, None).unwrap();
        network.make_near().unwrap();
        let done = network.rebuild(&mut arrays.atoms(), 1e-3, 0.1, mean_radius, None);
        done.map(|()| network.state.bonds[0].contacts().view(0).reference.area)
    };
    // π r², the same products.
    let area = std::f64::consts::PI * (0.003 * 0.003);
    assert_eq!((made("radius 0.003", 0.0).unwrap(), made("radius_ratio 0.5", 0.006).unwrap()), (area, area));
    let error = made("radius_ratio 0.5", 0.0).unwrap_err().to_string();
    assert!(error.contains("bond of atoms 1 and 2 has no section"), "{error}");
}
