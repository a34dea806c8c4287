//! The springs are those of the cohesive beam, the dashpots dissipate what they take, and each mode decays as its ratio says.

use super::*;
use crate::conformance::frame::{FrameRecord, FrameStation, FrameSubject, check, drive, legs};
use crate::conformance::{GEOMETRY, Native, Pose, Random};
use crate::law::{Section, ShearStrength};
use crate::math::{Quat, quaternion_of_rotation_vector};

const UNEQUAL: BeamDamping = BeamDamping { normal: 0.1, shear: 0.3, bending: 0.2, twist: 0.4 };

fn beam() -> CohesiveBeam {
    CohesiveBeam::new(2.0e9, 0.3, Section::Radius(0.3)).unwrap()
}

fn subject<L: ContactLaw<Kinematics = FrameKinematics>>(law: L, dt: f64) -> FrameSubject<Native<L>> {
    let area = law.bonded_area(GEOMETRY.radius_a, GEOMETRY.radius_b, 1.0);
    let geometry = ContactGeometry { reference_length: 2.1, area, ..GEOMETRY };
    let [elongation, rotation, twist] = [0.4, 0.7, 2.0];
    FrameSubject { name: "damped beam", host: Native(law), geometry, elongation, rotation, twist, failure: None, dt }
}

/// In steps of 10¹² s nothing viscous flows, and the law is the conservative one that the suite knows.
#[test]
fn a_slow_damped_beam_conforms() {
    let report = check(&subject(DampedBeam { beam: beam(), damping: UNEQUAL }, 1e12));
    println!("{report}");
    assert!(report.passed(), "{report}");
}

/// A path through large deformations, on top of a rigid motion.
fn path<L: ContactLaw<Kinematics = FrameKinematics>>(
    subject: &FrameSubject<Native<L>>,
    seed: u64,
) -> Vec<FrameRecord<L::State>> {
    let mut random = Random::new(seed);
    let mut any = |size: f64| random.uniform(-size, size);
    let mut knots = vec![FrameStation::default()];
    for _ in 0..5 {
        let (a, b) = ([any(0.7), any(0.7)], [any(0.7), any(0.7)]);
        knots.push(FrameStation { elongation: any(0.4), a, b, twist: any(2.0) });
    }
    let (axis, away) = (random.direction(), random.direction());
    let rigid = |share: f64| Pose {
        position: away * (6.0 * share),
        orientation: quaternion_of_rotation_vector(&(axis * (5.0 * share))),
    };
    drive(subject, &legs(&knots, 40), &rigid, &[Quat::identity(); 2], false)
}

/// The work beyond the work on the same beam without dashpots is what the ledger books, step by step; loads balance; and what is
/// dissipated is positive. Tolerances: roundings of the forces, which are sums of both parts.
#[test]
fn dashpots_dissipate_the_work_done_on_them() {
    let dt = 1e-4;
    let (mut viscous, mut errors) = (0.0, 0.0_f64);
    for seed in 0..5 {
        let damped = path(&subject(DampedBeam { beam: beam(), damping: UNEQUAL }, dt), seed);
        let elastic = path(&subject(beam(), dt), seed);
        let scale = damped.iter().map(|r| r.work.abs()).fold(0.0, f64::max);
        assert_eq!(damped.len(), elastic.len());
        for (with, without) in damped.iter().zip(&elastic) {
            let booked = with.response.energy.viscous + with.response.energy.integration;
            errors = errors.max((with.work - without.work - booked).abs() / scale);
            assert!(with.response.energy.viscous >= 0.0);
            viscous += booked;
        }
        assert!(viscous > 0.1 * scale, "{viscous} {scale}");
    }
    println!("largest difference {errors:e}");
    assert!(errors < 1e-13, "{errors}");
}

/// A bond that breaks books half of the last work of its dashpots, and the ledger of the whole path closes as without dashpots.
#[test]
fn a_breaking_bond_keeps_the_books() {
    let weak = CohesiveBeam { strength: 2e8, shear: ShearStrength::default(), ..beam() };
    let damped = path(&subject(DampedBeam { beam: weak, damping: UNEQUAL }, 1e-4), 3);
    let last = damped.last().unwrap();
    assert_eq!(last.response.status, Status::Broke);
    let before = damped[damped.len() - 2].response.state;
    assert!(before.dashpot_force.norm() > 0.0);
    let elastic = path(&subject(weak, 1e-4), 3);
    assert_eq!(damped.len(), elastic.len());
    let of_springs = elastic.last().unwrap();
    let booked =
        last.response.energy.viscous + last.response.energy.integration - of_springs.response.energy.integration;
    let difference = last.work - of_springs.work - booked;
    assert!(difference.abs() < 1e-13 * last.work.abs().max(of_springs.released), "{difference}");
    assert_eq!(last.response.energy.damage, of_springs.response.energy.damage);
}

/// Forces of the last step, from the history: those of the response, to the last bit.
#[test]
fn the_history_gives_the_last_forces() {
    let law = DampedBeam { beam: beam(), damping: UNEQUAL };
    for record in path(&subject(law, 1e-4), 1) {
        let still = FrameKinematics {
            displacement: Vec3::zeros(),
            turn_a: Vec3::zeros(),
            turn_b: Vec3::zeros(),
            ..record.kinematics
        };
        let (force, moment) = law.last_force(&still, &record.response.state);
        assert_eq!((force, moment), (record.response.force, record.response.moment));
    }
}

/// Without dashpots the response is that of the cohesive beam, to the last bit.
#[test]
fn without_dashpots_it_is_the_cohesive_beam() {
    let law = DampedBeam::new(beam(), 0.0).unwrap();
    let (damped, elastic) = (path(&subject(law, 1e-4), 2), path(&subject(beam(), 1e-4), 2));
    for (one, other) in damped.iter().zip(&elastic) {
        assert_eq!((one.response.force, one.response.moment), (other.response.force, other.response.moment));
        assert_eq!(one.response.energy, other.response.energy);
    }
}

#[test]
fn impossible_damping_is_refused() {
    assert!(DampedBeam::new(beam(), -0.1).is_err());
    assert!(DampedBeam::new(beam(), f64::NAN).is_err());
}
