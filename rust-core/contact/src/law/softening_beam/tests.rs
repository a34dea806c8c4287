//! The beam begins to soften where its criterion says, dissipates its fracture energy in every mode and shape at every length, unloads to
//! the origin, and is whole under pressure.

use super::*;
use crate::conformance::frame::{FrameRecord, FrameStation, FrameSubject, check, drive, legs};
use crate::conformance::{GEOMETRY, Native, Random, at_rest};
use crate::law::{Section, ShearStrength};
use crate::math::Quat;

const YOUNG: f64 = 2.0e9;
const STRENGTH: f64 = 20.0;
const COHESION: f64 = 30.0;
const FRICTION: f64 = 0.6;
const LENGTH: f64 = 2.1;
const RADIUS: f64 = 0.3;

/// Strains of 1e-8 at the strength and below 1e-6 at the end, so that forces are linear in the deformations to this part.
fn beam() -> CohesiveBeam {
    let shear = ShearStrength { cohesion: COHESION, friction_coefficient: FRICTION, moment_share: 0.7 };
    CohesiveBeam { strength: STRENGTH, shear, ..CohesiveBeam::new(YOUNG, 0.3, Section::Radius(RADIUS)).unwrap() }
}

/// Energies of five times those at onset in tension, `½σ²l/E`, and more in shear.
fn law(softening: Softening) -> SofteningBeam {
    let tension = 5.0 * 0.5 * STRENGTH * STRENGTH * LENGTH / YOUNG;
    let energy = BeamFractureEnergy { tension, shear: 30.0 * tension, exponent: 1.7 };
    SofteningBeam::new(beam(), energy, softening).unwrap()
}

fn subject(law: SofteningBeam, length: f64) -> FrameSubject<Native<SofteningBeam>> {
    let area = law.bonded_area(GEOMETRY.radius_a, GEOMETRY.radius_b, 1.0);
    let geometry = ContactGeometry { reference_length: length, area, ..GEOMETRY };
    let [elongation, rotation, twist] = [0.4, 0.7, 2.0];
    FrameSubject {
        name: "softening beam",
        host: Native(law),
        geometry,
        elongation,
        rotation,
        twist,
        failure: None,
        dt: 1e-3,
    }
}

type Records = Vec<FrameRecord<SofteningBeamState>>;

fn path(law: SofteningBeam, length: f64, knots: &[FrameStation], steps: usize) -> Records {
    drive(&subject(law, length), &legs(knots, steps), &at_rest, &[Quat::identity(); 2], false)
}

fn times(direction: &FrameStation, size: f64) -> FrameStation {
    let by = |[y, z]: [f64; 2]| [size * y, size * z];
    FrameStation {
        elongation: size * direction.elongation,
        a: by(direction.a),
        b: by(direction.b),
        twist: size * direction.twist,
    }
}

/// Stress ratio λ and share of shear and twist of a small deformation, from the formulas of the elements.
fn onset(geometry: &ContactGeometry, d: &FrameStation) -> (f64, f64) {
    let (area, l, law) = (geometry.area, geometry.reference_length, beam());
    let inertia = area * area / (4.0 * core::f64::consts::PI);
    let shear_modulus = YOUNG / (2.0 * (1.0 + law.poisson));
    let size = |[y, z]: [f64; 2]| y.hypot(z);
    let sum = [d.a[0] + d.b[0], d.a[1] + d.b[1]];
    let difference = [d.b[0] - d.a[0], d.b[1] - d.a[1]];
    let normal = YOUNG * d.elongation / l;
    let shear = 6.0 * YOUNG * inertia / (l * l) * size(sum) / area;
    let bending = YOUNG * inertia / l * size(difference) * RADIUS / inertia;
    let torsion = shear_modulus * d.twist.abs() / l * RADIUS;
    let share = law.shear.moment_share;
    let tension = (normal + share * bending).max(0.0) / STRENGTH;
    let sheared = (shear + share * torsion) / (COHESION + FRICTION * (-normal).max(0.0));
    let of_shear = 1.5 * YOUNG * inertia / l * size(sum).powi(2) + shear_modulus * inertia / l * d.twist.powi(2);
    let of_bending = 0.5 * YOUNG * inertia / l * size(difference).powi(2);
    let of_normal = if normal > 0.0 { 0.5 * normal * area * d.elongation } else { 0.0 };
    (tension.hypot(sheared), of_shear / (of_shear + of_bending + of_normal))
}

/// Four pure modes, and random mixtures of tension with them.
fn directions() -> Vec<FrameStation> {
    let mut random = Random::new(3);
    let pure = [
        FrameStation { elongation: 1.0, ..FrameStation::default() },
        FrameStation { a: [0.6, 0.8], b: [0.6, 0.8], ..FrameStation::default() },
        FrameStation { a: [0.6, 0.8], b: [-0.6, -0.8], ..FrameStation::default() },
        FrameStation { twist: 1.0, ..FrameStation::default() },
    ];
    let mixed = (0..46).map(|_| {
        let mut any = |low: f64| random.uniform(low, 1.0);
        FrameStation { elongation: any(0.0), a: [any(-1.0), any(-1.0)], b: [any(-1.0), any(-1.0)], twist: any(-1.0) }
    });
    pure.into_iter().chain(mixed).collect()
}

/// Fifty load directions: damage begins at λ = 1, and the work until the beam has broken is `G_c S`, by the ledger and by the work of the
/// forces. Tolerances: the onset lies within a step; the rest is the trapezoidal error of the kink there, the square of a step.
#[test]
fn fifty_directions_dissipate_their_fracture_energy() {
    let (mut largest, mut ledger) = (0.0_f64, 0.0_f64);
    for softening in [Softening::Linear, Softening::Exponential] {
        let law = law(softening);
        for direction in directions() {
            let geometry = subject(law, LENGTH).geometry;
            let (ratio, share) = onset(&geometry, &direction);
            let expected = law.energy.at(share) * geometry.area;
            let energy = expected / stored(&geometry, &direction, ratio);
            let last = match softening {
                Softening::Linear => 1.01 * energy,
                Softening::Exponential => 1.0 + 3.6 * (energy - 1.0),
            };
            let steps = 40_000;
            let records = path(law, LENGTH, &[FrameStation::default(), times(&direction, last / ratio)], steps);
            let end = records.last().unwrap();
            assert!(end.response.status.is_broken(), "{direction:?}");
            let first = records.iter().position(|r| r.response.state.stiffness_loss > 0.0).unwrap();
            let [before, begun] = [first - 1, first].map(|k| last * eased(k as f64 / steps as f64));
            assert!(before <= 1.0 + 1e-6 && begun >= 1.0 - 1e-6, "{begun} {direction:?}");
            let booked: f64 = records.iter().map(|r| r.response.energy.damage + r.response.energy.integration).sum();
            let work: f64 = records.iter().map(|r| r.work).sum();
            largest = largest.max((booked / expected - 1.0).abs());
            ledger = ledger.max((work / booked - 1.0).abs());
        }
    }
    println!("energies {largest:e}, ledger {ledger:e}");
    assert!(largest < 1e-6, "{largest:e}");
    assert!(ledger < 1e-6, "{ledger:e}");
}

/// Part of a leg after the part `t` of its steps.
fn eased(t: f64) -> f64 {
    0.5 - 0.5 * (core::f64::consts::PI * t).cos()
}

/// Pressed, then sheared: damage begins at `c + p tan φ` and takes `G_II S`; the end of the beam releases what the pressed spring stores.
#[test]
fn pressure_delays_the_damage_by_shear() {
    let law = law(Softening::Linear);
    let geometry = subject(law, LENGTH).geometry;
    let pressed = -2.0 * STRENGTH / YOUNG * LENGTH;
    let limit = COHESION + 2.0 * FRICTION * STRENGTH;
    let end = |size: f64| FrameStation { elongation: pressed, a: [size, 0.0], b: [size, 0.0], twist: 0.0 };
    let shear_at = |size: f64| onset(&geometry, &end(size)).0 * limit;
    let first = limit / shear_at(1.0);
    let steps = 40_000;
    let records = path(law, LENGTH, &[FrameStation::default(), end(0.0), end(20.0 * first)], steps);
    assert_eq!(records.last().unwrap().response.status, Status::BrokeInShear);
    let begun = records.iter().position(|r| r.response.state.stiffness_loss > 0.0).unwrap() - steps;
    let [before, begun] = [begun - 1, begun].map(|k| 20.0 * eased(k as f64 / steps as f64));
    assert!(before <= 1.0 + 1e-6 && begun >= 1.0 - 1e-6, "{begun}");
    let booked: f64 = records.iter().map(|r| r.response.energy.damage + r.response.energy.integration).sum();
    let of_pressure = 0.5 * YOUNG * geometry.area / LENGTH * pressed * pressed;
    let expected = law.energy.shear * geometry.area;
    assert!(((booked - of_pressure) / expected - 1.0).abs() < 1e-5, "{booked} {of_pressure} {expected}");
}

/// Energy stored at the strength, J.
fn stored(geometry: &ContactGeometry, direction: &FrameStation, ratio: f64) -> f64 {
    let intact = SofteningBeam { beam: CohesiveBeam { strength: 1e30, ..beam() }, ..law(Softening::Linear) };
    let intact = SofteningBeam {
        beam: CohesiveBeam { shear: ShearStrength { cohesion: 1e30, ..intact.beam.shear }, ..intact.beam },
        ..intact
    };
    let knots = [FrameStation::default(), times(direction, 1.0 / ratio)];
    path(intact, geometry.reference_length, &knots, 1).last().unwrap().response.energy.stored()
}

/// The same material at four lengths and sections: the energy per area is the same.
#[test]
fn the_energy_per_area_does_not_depend_on_the_length() {
    for (length, scale) in [(0.5, 1.0), (1.0, 2.0), (2.0, 1.0), (4.0, 0.5)] {
        let law = law(Softening::Exponential);
        let section = Section::Radius(RADIUS * scale);
        let law = SofteningBeam { beam: CohesiveBeam { section, ..law.beam }, ..law };
        let strained = FrameStation { elongation: 2e-6, ..FrameStation::default() };
        let records = path(law, length, &[FrameStation::default(), strained], 80_000);
        assert!(records.last().unwrap().response.status.is_broken());
        let booked: f64 = records.iter().map(|r| r.response.energy.damage + r.response.energy.integration).sum();
        let per_area = booked / subject(law, length).geometry.area;
        assert!((per_area / law.energy.tension - 1.0).abs() < 1e-5, "{length}: {per_area}");
    }
}

/// All strains times a factor.
fn stronger(law: SofteningBeam, factor: f64) -> SofteningBeam {
    let SofteningBeam { beam, energy, softening } = law;
    let shear = ShearStrength { cohesion: beam.shear.cohesion * factor, ..beam.shear };
    let beam = CohesiveBeam { strength: beam.strength * factor, shear, ..beam };
    let by = factor * factor;
    SofteningBeam {
        beam,
        energy: BeamFractureEnergy { tension: energy.tension * by, shear: energy.shear * by, ..energy },
        softening,
    }
}

/// A damaged beam: its forces are `1−D` of those of the elastic one on the way to the origin and back, which costs nothing; pressed, its
/// normal force is whole, and its crossing of zero is booked. Tolerance: roundings.
#[test]
fn a_damaged_beam_unloads_to_the_origin_and_closes() {
    let law = stronger(law(Softening::Linear), 1e5);
    let pulled = |elongation: f64| FrameStation { elongation, ..FrameStation::default() };
    let onset = law.beam.strength / YOUNG * LENGTH;
    let knots = [pulled(0.0), pulled(2.0 * onset), pulled(-onset), pulled(1.9 * onset)];
    let records = path(law, LENGTH, &knots, 500);
    let damage = records[500].response.state.stiffness_loss;
    assert!(damage > 0.5 && damage < 1.0, "{damage}");
    let k = YOUNG * subject(law, LENGTH).geometry.area / LENGTH;
    for record in &records[501..] {
        assert_eq!(record.response.state.stiffness_loss, damage);
        assert_eq!(record.response.energy.damage, 0.0);
        let elongation = record.kinematics.point.length - LENGTH;
        let factor = if elongation > 0.0 { 1.0 - damage } else { 1.0 };
        let axial = record.response.force.dot(&record.kinematics.point.normal);
        assert!((axial - factor * k * elongation).abs() < 1e-9 * k * onset, "{axial}");
    }
    let work: f64 = records[501..].iter().map(|r| r.work).sum();
    let change = records.last().unwrap().response.energy.stored() - records[500].response.energy.stored();
    let booked: f64 = records[501..].iter().map(|r| r.response.energy.integration).sum();
    assert!(booked.abs() > 1e-6 * work.abs(), "the crossings are not booked");
    assert!((work - change - booked).abs() < 1e-9 * work.abs(), "{work} {change} {booked}");
}

/// Beyond the longest bond the beam stores more than it shall dissipate, and breaks at once.
#[test]
fn a_bond_that_is_too_long_breaks_at_its_strength() {
    let law = law(Softening::Linear);
    let longest = law.longest_bond();
    assert!((longest - 5.0 * LENGTH).abs() < 1e-12, "{longest}");
    for (length, steps_of_damage) in [(0.99 * longest, 1), (1.01 * longest, 0)] {
        let last = FrameStation { elongation: 1.2 * STRENGTH / YOUNG * length, ..FrameStation::default() };
        let records = path(law, length, &[FrameStation::default(), last], 12_000);
        assert!(records.last().unwrap().response.status.is_broken());
        let damaged = records.iter().filter(|r| r.response.state.stiffness_loss > 0.0).count();
        assert_eq!(damaged.min(1), steps_of_damage, "{length}");
    }
    let unbreakable = SofteningBeam { beam: CohesiveBeam { strength: f64::INFINITY, ..law.beam }, ..law };
    assert_eq!(unbreakable.longest_bond(), f64::INFINITY);
}

/// Below its strength it is the cohesive beam, to the last bit, and conserves energy.
#[test]
fn an_intact_beam_is_the_cohesive_beam() {
    let strong = CohesiveBeam { strength: 1e30, shear: ShearStrength::default(), ..beam() };
    let law = SofteningBeam { beam: strong, ..law(Softening::Linear) };
    let report = check(&subject(law, LENGTH));
    println!("{report}");
    assert!(report.passed(), "{report}");
    let knots = [
        FrameStation::default(),
        FrameStation { elongation: 0.3, a: [0.3, -0.2], b: [0.1, 0.5], twist: 0.7 },
        FrameStation { elongation: -0.3, a: [0.1, -0.2], b: [0.4, 0.5], twist: -0.7 },
    ];
    let elastic = FrameSubject {
        name: "cohesive beam",
        host: Native(strong),
        geometry: subject(law, LENGTH).geometry,
        elongation: 0.4,
        rotation: 0.7,
        twist: 2.0,
        failure: None,
        dt: 1e-3,
    };
    let elastic = drive(&elastic, &legs(&knots, 50), &at_rest, &[Quat::identity(); 2], false);
    for (one, other) in path(law, LENGTH, &knots, 50).iter().zip(&elastic) {
        assert_eq!((one.response.force, one.response.moment), (other.response.force, other.response.moment));
        assert_eq!(one.response.energy, other.response.energy);
    }
}

/// Without a cohesion the largest principal stress decides: the same energies.
#[test]
fn the_principal_stress_decides_without_a_cohesion() {
    let law = law(Softening::Exponential);
    let law = SofteningBeam { beam: CohesiveBeam { shear: ShearStrength::default(), ..law.beam }, ..law };
    let twisted = FrameStation { twist: 1e-4, ..FrameStation::default() };
    let records = path(law, LENGTH, &[FrameStation::default(), twisted], 200_000);
    let end = records.last().unwrap();
    assert_eq!(end.response.status, Status::Broke);
    let (dissipated, ..) = SofteningBeam::event(&law.respond(&end.kinematics, &end.old, 1e-3));
    let expected = law.energy.shear * subject(law, LENGTH).geometry.area;
    assert!((dissipated / expected - 1.0).abs() < 1e-5, "{dissipated} {expected}");
}

/// Forces of the last step, from the history: those of the response.
#[test]
fn the_history_gives_the_last_forces() {
    let knots = [FrameStation::default(), FrameStation { elongation: 6e-8, a: [1e-8, 0.0], ..FrameStation::default() }];
    let law = law(Softening::Exponential);
    for record in path(law, LENGTH, &knots, 200) {
        let (force, moment) = law.last_force(&record.kinematics, &record.response.state);
        assert_eq!((force, moment), (record.response.force, record.response.moment));
    }
}

#[test]
fn impossible_energies_are_refused() {
    let refuses = |tension, shear, exponent| {
        SofteningBeam::new(beam(), BeamFractureEnergy { tension, shear, exponent }, Softening::Linear).is_err()
    };
    assert!(refuses(0.0, 1.0, 1.0) && refuses(1.0, f64::NAN, 1.0) && refuses(1.0, 1.0, 0.0));
}
