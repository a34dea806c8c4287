//! Bonds made during a run, together with a loading and with operators: closed forms, and nothing lost at the moment of bonding.

mod shared;

use concordem_contact::math::{Mat3, Vec3};
use concordem_scenario::sampling::Record;
use concordem_scenario::schedule::Simulation;

use shared::simulation;

/// A chain of eight touching spheres of radius 10 mm along z whose contacts and bonds have a stiffness of 1 MN/m. Nothing is bonded at
/// the start.
fn chain(more: &str) -> String {
    let spheres: Vec<[f64; 4]> = (0..8).map(|k| [0.0, 0.0, 0.02 * f64::from(k), 0.01]).collect();
    format!(
        "version = 1
        [packing]
        kind = \"spheres\"
        spheres = {spheres:?}
        [[material]]
        name = \"m\"
        density = 2500
        frictional = {{ normal_stiffness = 1e6, shear_stiffness = 0 }}
        linear_bond = {{ normal_stiffness = 1e6, shear_stiffness = 5e5, normal_strength = 8 }}
        [bonds]
        law = \"linear_bond\"
        at_start = false
        [contacts]
        law = \"frictional\"
        [integration]
        time_step = 2e-5
        damping = {{ kind = \"local\", coefficient = 0.5 }}
        [output]
        sample_interval = 50
        {more}"
    )
}

/// The rows of values of an operator.
type Rows = Vec<Vec<f64>>;

/// Records, the rows of each operator, and the moments of bonding (time and number).
fn run(simulation: &mut Simulation) -> (Vec<Record>, Vec<Rows>, Vec<(f64, usize)>) {
    let (mut records, mut bonded) = (Vec::new(), Vec::new());
    let mut rows = vec![Vec::new(); simulation.schedule.operators.len()];
    loop {
        let advance = simulation.advance().unwrap_or_else(|error| panic!("{error}"));
        records.extend(advance.sample);
        bonded.extend(advance.bonded.map(|count| (simulation.state.clock.time(), count)));
        advance.operators.into_iter().for_each(|row| rows[row.operator].push(row.values));
        if advance.stopped.is_some() {
            records.extend(advance.last);
            return (records, rows, bonded);
        }
    }
}

const OPERATORS: &str = "
    [[sample]]
    operator = \"region-stress\"
    region = { kind = \"all\", volume = 1e-5 }
    [[sample]]
    operator = \"fabric\"
    region = { kind = \"all\", volume = 1e-5 }
    [[sample]]
    operator = \"damage-tensor\"
    region = { kind = \"all\", volume = 1e-5 }
    [[sample]]
    operator = \"gauge\"
    sets = [\"low\", \"high\"]
    [[set]]
    name = \"low\"
    selection = { kind = \"ids\", ids = [2] }
    [[set]]
    name = \"high\"
    selection = { kind = \"ids\", ids = [5] }";

/// End layers press on the chain, the chain is bonded under load, and the ends return: bonds start without force where they are made,
/// so that they are pulled where the contacts were pressed. The force follows the stiffness of the chain, 1/7 of that of a bond, from
/// the length at which it was bonded. Operators count contacts first and bonds later, and their stress is the force of the ends times
/// the length over the volume. Tolerance 1e-3: the rest of the motion at the ends of the stages.
#[test]
fn a_pressed_chain_is_bonded_and_pulled() {
    let shortened = 7e-6;
    let text = chain(&format!(
        "[loading]
        kind = \"uniaxial\"
        strain_rate = -1e-3
        area = 1
        layer_thickness = 0.01
        initial_velocity_field = false
        [[stage]]
        name = \"press\"
        stop = {{ strain = {} }}
        [[stage]]
        name = \"rest\"
        rate = 0
        stop = {{ time = 0.05 }}
        [[stage]]
        name = \"pull\"
        rate = -1
        stop = {{ strain = 0 }}
        [[stage]]
        name = \"rest again\"
        rate = 0
        stop = {{ time = 0.05 }}
        [[bonding]]
        stage = \"rest\"
        interaction_ratio = 1.01
        {OPERATORS}",
        -shortened / 0.14
    ));
    let mut simulation = simulation(&text);
    let (records, rows, bonded) = run(&mut simulation);
    let [(time, count)] = bonded[..] else { panic!("{bonded:?}") };
    assert_eq!(count, 7);
    let before = records.iter().rposition(|record| record.time < time).unwrap();
    let pressed = -1e6 * (-records[before].strain * 0.14) / 7.0;
    assert!((records[before].stress / pressed - 1.0).abs() < 1e-3, "{} {pressed}", records[before].stress);
    // The energy of the contacts, 7 F²/2k, is lost to the bonds, which start without force.
    let energy = 7.0 * pressed * pressed / 2e6;
    let last = records.last().unwrap();
    assert!((last.damage / energy - 1.0).abs() < 1e-3, "{} {energy}", last.damage);
    assert!(last.residual.abs() < 1e-3 * energy, "{} {energy}", last.residual);
    let pulled = 1e6 * (last.strain - records[before].strain) * 0.14 / 7.0;
    assert!((last.stress / pulled - 1.0).abs() < 1e-3 && last.stress > 0.9, "{} {pulled}", last.stress);
    for (at, force) in [(before, pressed), (rows[0].len() - 1, pulled)] {
        let stress = Mat3::from_row_slice(&rows[0][at][..9]);
        let expected = force * 0.14 / 1e-5;
        assert!((stress[(2, 2)] / expected - 1.0).abs() < 1e-3, "{at}: {stress} {expected}");
    }
    // Seven contacts, and seven bonds in their place; the last value but one of the fabric is their number.
    for at in [before, rows[1].len() - 1] {
        assert_eq!(rows[1][at][10], 7.0, "{:?}", rows[1][at]);
    }
    assert_eq!(simulation.intact_bonds(), 7);
    // No bond is damaged, and the gauge of three of seven springs has three sevenths of the change.
    assert!(rows[2].last().unwrap().iter().take(9).all(|d| *d == 0.0), "{:?}", rows[2].last());
    let elongation = rows[3].last().unwrap()[1];
    assert!((elongation - last.strain * 0.14 * 3.0 / 7.0).abs() < 1e-3 * shortened, "{elongation} {}", last.strain);
}

/// Bonds that are made under load break at their strength, not at that minus the load, after the elongation `f/k` of each since they were
/// made. Tolerance 1 %: the chain vibrates by 0.1 % of the force, and a record is taken every 1.3 % of the way.
#[test]
fn bonds_made_under_load_have_their_strength() {
    let text = chain(&format!(
        "[loading]
        kind = \"uniaxial\"
        strain_rate = -5e-4
        area = 1
        layer_thickness = 0.01
        initial_velocity_field = false
        [[stage]]
        name = \"press\"
        stop = {{ strain = -5e-5 }}
        [[stage]]
        name = \"pull\"
        rate = -1
        stop = {{ strain = 1e-3 }}
        [[bonding]]
        stage = \"press\"
        interaction_ratio = 1.01
        {OPERATORS}"
    ));
    let mut simulation = simulation(&text);
    let (records, _, bonded) = run(&mut simulation);
    assert_eq!(bonded.len(), 1);
    let strongest = records.iter().map(|record| record.stress).fold(0.0, f64::max);
    let rest = records.last().unwrap().stress;
    assert!(simulation.intact_bonds() < 7 && rest.abs() < 0.01 * 8.0, "{rest} {strongest}");
    let strain_at_peak = records.iter().find(|record| record.stress == strongest).unwrap().strain;
    let made = records.iter().map(|record| record.strain).fold(0.0, f64::min);
    let stretched = (strain_at_peak - made) * 0.14 / 7.0;
    assert!((strongest / 8.0 - 1.0).abs() < 0.01 && (stretched / 8e-6 - 1.0).abs() < 0.01, "{strongest} {stretched}");
    let center = simulation.state.particles.position.iter().sum::<Vec3>() / 8.0;
    assert!(center.x == 0.0 && center.y == 0.0, "{center}");
}
