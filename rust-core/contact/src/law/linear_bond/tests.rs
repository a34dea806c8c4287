//! Tests of the brittle linear bond.

use super::*;
use crate::conformance::{GEOMETRY, Native, Observed, Properties, Station, Subject, Window, atlas, atlas_paths, check};
use crate::law::{Frictional, RegisteredLaw};
use crate::quantity::{self, Force, Number};

/// Deformations are a large fraction of the length, so rounding of positions hides nothing.
fn subject(name: &'static str, bond: LinearBond) -> Subject<Native<LinearBond>> {
    let window = Window { elongation: [-0.4, 0.6], shear: 0.5 };
    Subject {
        name,
        host: Native(bond),
        geometry: ContactGeometry { reference_length: 2.1, ..GEOMETRY },
        bonded: true,
        properties: Properties {
            conservative_normal: bond.damping_ratio == 0.0,
            conservative_shear: bond.damping_ratio == 0.0,
            dissipation_nonnegative: true,
            continuous_failure: true,
            brittle: false,
        },
        elastic: window,
        inelastic: window,
        held: Station { elongation: 0.3, shear: [0.2, -0.3], twist: 0.0 },
        failure: 1.0,
        dt: 1e-3,
    }
}

/// (2.23)–(2.40) written out for the prescribed deformation.
fn closed_form(bond: LinearBond, subject: &Subject<Native<LinearBond>>) -> impl FnMut(&Observed) -> Option<[f64; 3]> {
    let mass = 2.0 / 3.0;
    let initial_gap = if bond.subtract_initial_gap { 0.0 } else { 0.1 };
    assert_eq!(subject.geometry.reference_length, 2.1);
    let cn = bond.damping_ratio * 2.0 * (mass * bond.normal_stiffness).sqrt();
    let ct = bond.damping_ratio * 2.0 * (mass * bond.shear_stiffness).sqrt();
    let mut before: Option<Station> = None;
    move |now| {
        let s = now.station;
        let b = before.replace(s).unwrap_or(s);
        let force = [
            bond.normal_stiffness * (s.elongation + initial_gap) + cn * (s.elongation - b.elongation) / now.dt,
            bond.shear_stiffness * s.shear[0] + ct * (s.shear[0] - b.shear[0]) / now.dt,
            bond.shear_stiffness * s.shear[1] + ct * (s.shear[1] - b.shear[1]) / now.dt,
        ];
        let shear = (force[1] * force[1] + force[2] * force[2]).sqrt();
        (force[0] < bond.normal_strength && shear < bond.shear_strength).then_some(force)
    }
}

/// 1e-11: 300 steps, each with a rounding of about 1e-16 of the length in the orientation, measured as shear (and,
/// divided by the step, as rate), relative to shears of a quarter of the length.
fn conforms(subject: &Subject<Native<LinearBond>>) {
    let mut report = check(subject);
    report.findings.extend(atlas(
        subject,
        &atlas_paths(&subject.inelastic, 50),
        || closed_form(subject.host.0, subject),
        1e-11,
        "rounding of orientations over 300 steps",
    ));
    println!("{report}");
    assert!(report.passed(), "{report}");
}

#[test]
fn elastic_bond_conforms() {
    conforms(&subject("linear bond", LinearBond::new(1e6, 4e5, 0.0, f64::INFINITY, f64::INFINITY).unwrap()));
}

#[test]
fn damped_bond_conforms() {
    conforms(&subject("damped bond", LinearBond::new(1e6, 4e5, 0.3, f64::INFINITY, f64::INFINITY).unwrap()));
}

#[test]
fn bond_with_its_initial_gap_conforms() {
    let mut bond = LinearBond::new(1e6, 4e5, 0.0, f64::INFINITY, f64::INFINITY).unwrap();
    bond.subtract_initial_gap = false;
    conforms(&subject("bond under its initial gap", bond));
}

#[test]
fn brittle_bond_conforms() {
    for damping_ratio in [0.0, 0.1] {
        // Breaks at an elongation of 0.45 or a shear of 0.475.
        let bond = LinearBond::new(1e6, 4e5, damping_ratio, 4.5e5, 1.9e5).unwrap();
        let mut subject = subject("brittle bond", bond);
        subject.properties.continuous_failure = false;
        subject.properties.brittle = true;
        subject.elastic = Window { elongation: [-0.4, 0.4], shear: 0.3 };
        conforms(&subject);
    }
}

/// Compression of any size never breaks a bond; shear does, under any normal force.
#[test]
fn which_strength_breaks() {
    let bond = LinearBond::new(1e6, 4e5, 0.0, 1e3, 1e3).unwrap();
    let subject = subject("bond", bond);
    let at = |elongation: f64, shear: f64| {
        let k = PointKinematics {
            geometry: subject.geometry,
            length: 2.1 + elongation,
            length_old: 2.1,
            elongation,
            elongation_old: 0.0,
            gap: 0.1 + elongation,
            normal: Vec3::x(),
            shear_increment: Vec3::new(0.0, shear, 0.0),
            arm_a: 1.0,
            arm_b: 1.0,
            bonded: true,
            transport: crate::kinematics::Transport::identity(Vec3::x()),
        };
        bond.respond(&k, &LinearBondState::default(), 1e-3)
    };
    assert_eq!(at(-0.5, 0.0).status, Status::Lives);
    assert_eq!(at(0.9e-3, 0.0).status, Status::Lives);
    assert_eq!(at(1.1e-3, 0.0).status, Status::Broke);
    assert_eq!(at(-0.5, 2.4e-3).status, Status::Lives);
    assert_eq!(at(-0.5, 2.6e-3).status, Status::BrokeInShear);
    let broken = at(1.1e-3, 0.0);
    assert_eq!(broken.force, Vec3::zeros());
    assert_eq!(broken.energy.damage, 0.5 * (1e6 * 1.1e-3) * 1.1e-3);
}

/// The dashpots count: a bond breaks by the whole force, elastic and viscous, not by the elastic force alone. At half of the
/// elastic strength in tension or shear it breaks as soon as the dashpot bears the other half; and a bond stretched beyond
/// its elastic strength holds as long as it shortens fast enough.
#[test]
fn dashpots_break_bonds() {
    let bond = LinearBond::new(1e6, 4e5, 0.2, 1e3, 1e3).unwrap();
    let geometry = subject("bond", bond).geometry;
    let (normal_viscosity, shear_viscosity) = bond.dashpots(&geometry);
    let dt = 1e-3;
    let status = |elongation: f64, rate: f64, shear: f64, shear_rate: f64| {
        let k = PointKinematics {
            geometry,
            length: 2.1 + elongation,
            length_old: 2.1 + elongation - rate * dt,
            elongation,
            elongation_old: elongation - rate * dt,
            gap: 0.1 + elongation,
            normal: Vec3::x(),
            shear_increment: Vec3::new(0.0, shear_rate * dt, 0.0),
            arm_a: 1.0,
            arm_b: 1.0,
            bonded: true,
            transport: crate::kinematics::Transport::identity(Vec3::x()),
        };
        let shear_displacement = Vec3::new(0.0, shear - shear_rate * dt, 0.0);
        bond.respond(&k, &LinearBondState { shear_displacement, ..LinearBondState::default() }, dt).status
    };
    // 500 N of the spring; the dashpot takes the other 500 N at this rate.
    let (rate, shear_rate) = (500.0 / normal_viscosity, 500.0 / shear_viscosity);
    for (factor, tension, shear) in [(0.99, Status::Lives, Status::Lives), (1.01, Status::Broke, Status::BrokeInShear)]
    {
        assert_eq!(status(0.5e-3, factor * rate, 0.0, 0.0), tension);
        assert_eq!(status(0.0, 0.0, 1.25e-3, factor * shear_rate), shear);
    }
    assert_eq!(status(1.2e-3, -rate, 0.0, 0.0), Status::Lives);
    assert_eq!(status(0.0, 0.0, 3e-3, -shear_rate), Status::Lives);
}

/// What a bond exerts is its springs' force and what it names as viscous, in both directions.
#[test]
fn the_rest_of_the_force_is_viscous() {
    let bond = LinearBond::new(1e6, 4e5, 0.2, f64::INFINITY, f64::INFINITY).unwrap();
    let k = PointKinematics {
        geometry: subject("bond", bond).geometry,
        length: 2.11,
        length_old: 2.108,
        elongation: 0.01,
        elongation_old: 0.008,
        gap: 0.11,
        normal: Vec3::x(),
        shear_increment: Vec3::new(0.0, 1e-3, -2e-3),
        arm_a: 1.0,
        arm_b: 1.0,
        bonded: true,
        transport: crate::kinematics::Transport::identity(Vec3::x()),
    };
    let answer = bond.respond(&k, &LinearBondState::default(), 1e-2);
    let elastic = Vec3::new(1e6 * 0.01, 4e5 * 1e-3, -4e5 * 2e-3);
    let viscous = LinearBond::viscous_force(&k.normal, &answer.state);
    assert!(viscous.iter().all(|component| component.abs() > 1.0), "{viscous}");
    // Some roundings of 1e4 N.
    assert!((answer.force - elastic - viscous).norm() < 1e-11, "{viscous}");
}

/// Between two materials all parameters are means, but for strengths that only one of them has; a broken bond goes on with the
/// same springs and dashpots, and with the friction of the smoother surface. All numbers are exact.
#[test]
fn two_materials_share_a_bond() {
    let table = |factor: f64, strength: Option<f64>, friction: f64| LinearBondTable {
        normal_stiffness: quantity::Stiffness::new(4e6 * factor),
        shear_stiffness: quantity::Stiffness::new(1e6 * factor),
        damping_ratio: Number::new(0.25 * factor),
        normal_strength: Some(Force::new(100.0 * factor)),
        shear_strength: strength.map(Force::new),
        friction_coefficient: Number::new(friction),
        subtract_initial_gap: true,
    };
    let (one, other) = (table(1.0, Some(50.0), 0.5), table(3.0, None, 0.25));
    let bond = LinearBond::row(&one, &other).unwrap();
    assert_eq!(bond, LinearBond::new(8e6, 2e6, 0.5, 200.0, 50.0).unwrap());
    let after = LinearBond::unbonded_row(&one, &other).unwrap();
    let stiffness = crate::law::ContactStiffness::Given { normal: 8e6, shear: 2e6 };
    assert_eq!(after, Frictional::new(stiffness, 0.25, 0.5).unwrap());
    // Springs under their initial gap have no length of their own that a crack could keep.
    let gap = LinearBond { subtract_initial_gap: false, ..bond };
    let reference = Reference { length: 2.1, area: 1.0 };
    assert_eq!((bond.kept_reference(reference), gap.kept_reference(reference)), (Some(reference), None));
}

#[test]
fn bad_parameters_are_named() {
    let message = LinearBond::new(1e6, -1.0, 0.0, 1.0, 1.0).unwrap_err().to_string();
    assert_eq!(message, "law linear_bond: shear_stiffness = -1 must be finite and not negative (N/m)");
    assert!(LinearBond::new(0.0, 1.0, 0.0, 1.0, 1.0).is_err());
    assert!(LinearBond::new(1.0, 1.0, f64::NAN, 1.0, 1.0).is_err());
    assert!(LinearBond::new(1.0, 1.0, 0.0, 0.0, 1.0).is_err());
    assert!(LinearBond::new(1.0, 1.0, 0.0, 1.0, f64::NAN).is_err());
}
