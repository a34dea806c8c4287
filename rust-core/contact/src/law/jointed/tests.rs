//! Tests of the jointed bond.

use super::*;
use crate::conformance::{GEOMETRY, Native, Observed, Properties, Station, Subject, Window, atlas, atlas_paths, check};
use crate::kinematics::Transport;
use crate::law::{Factors, LawTable, RegisteredLaw};
use crate::quantity::{Angle, Number, Stress};

const BONDED: ContactGeometry = ContactGeometry { reference_length: 2.1, ..GEOMETRY };

/// `k_n` of [`bond`] in [`GEOMETRY`]: 2 · 0.8 · 1.2/(0.8 + 1.2) times the modulus.
const NORMAL: f64 = 0.96e6;
/// `k_t`.
const SHEAR: f64 = 0.4 * NORMAL;

/// A bond that bears these forces (N) in tension, and in shear without normal force.
fn bond(tension: f64, shear: f64, friction: f64) -> Jointed {
    Jointed::new(1e6, 0.4, tension / GEOMETRY.area, shear / GEOMETRY.area, friction).unwrap()
}

fn subject(name: &'static str, bond: Jointed, bonded: bool) -> Subject<Native<Jointed>> {
    let window = Window { elongation: [-0.4, 0.4], shear: 0.3 };
    Subject {
        name,
        host: Native(bond),
        geometry: BONDED,
        bonded,
        properties: Properties {
            conservative_normal: true,
            conservative_shear: true,
            dissipation_nonnegative: true,
            continuous_failure: true,
            brittle: false,
        },
        elastic: window,
        inelastic: window,
        held: Station { elongation: 0.2, shear: [0.1, -0.15], twist: 0.0 },
        failure: 1.0,
        dt: 1e-3,
    }
}

/// The law written out for the prescribed deformation, with a shear spring of two components.
fn closed_form(bond: Jointed, bonded: bool) -> impl FnMut(&Observed) -> Option<[f64; 3]> {
    let (tension, cohesion) = (bond.tensile_strength * GEOMETRY.area, bond.cohesion * GEOMETRY.area);
    let friction = if bonded { bond.friction } else { bond.residual_friction };
    let (mut before, mut force, mut whole) = ([0.0; 2], [0.0; 2], bonded);
    move |now| {
        let s = now.station;
        let normal = NORMAL * s.elongation;
        let trial = [0, 1].map(|k| force[k] + SHEAR * (s.shear[k] - before[k]));
        before = s.shear;
        if whole && normal > tension {
            return None;
        }
        if !whole && normal > 0.0 {
            force = [0.0; 2];
            return (!bonded).then_some([0.0; 3]);
        }
        let limit = if whole { cohesion } else { 0.0 } - friction * normal;
        let size = (trial[0] * trial[0] + trial[1] * trial[1]).sqrt();
        force = trial;
        if size > limit {
            if whole && normal > 0.0 {
                return None;
            }
            whole = false;
            force = trial.map(|part| part * limit / size);
        }
        Some([normal, force[0], force[1]])
    }
}

/// 1e-11: 300 steps, each with a rounding of about 1e-16 of the length in the orientation, measured as shear, relative to shears of a
/// quarter of the length.
fn conforms(subject: &Subject<Native<Jointed>>) {
    let mut report = check(subject);
    report.findings.extend(atlas(
        subject,
        &atlas_paths(&subject.inelastic, 50),
        || closed_form(subject.host.0, subject.bonded),
        1e-11,
        "rounding of orientations over 300 steps",
    ));
    println!("{report}");
    assert!(report.passed(), "{report}");
}

#[test]
fn elastic_bond_conforms() {
    conforms(&subject("elastic", bond(1e9, 1e9, 0.2), true));
    let unlike = Jointed { young_b: 3e6, stiffness_ratio_b: 0.7, ..bond(1e9, 1e9, 0.2) };
    let report = check(&subject("elastic between unlike materials", unlike, true));
    assert!(report.passed(), "{report}");
}

/// It cracks at an elongation of 0.45, or at a shear of 0.9 less what tension takes.
#[test]
fn brittle_bond_conforms() {
    let mut subject = subject("brittle", bond(0.45 * NORMAL, 0.9 * SHEAR, 0.2), true);
    subject.properties.continuous_failure = false;
    subject.properties.brittle = true;
    subject.inelastic = Window { elongation: [-0.4, 0.6], shear: 1.5 };
    conforms(&subject);
}

#[test]
fn contact_without_bond_conforms() {
    let law = Jointed { residual_friction: 0.3, ..bond(1e9, 1e9, 5.0) };
    let mut subject = subject("without bond", law, false);
    let window = Window { elongation: [-0.4, 0.1], shear: 0.5 };
    (subject.elastic, subject.inelastic) = (window, window);
    subject.properties.conservative_shear = false;
    subject.held = Station { elongation: -0.3, shear: [0.1, -0.15], twist: 0.0 };
    subject.failure = 0.1;
    conforms(&subject);
}

/// A step from rest to an elongation and a shear, both m.
fn moved(before: f64, elongation: f64, slide: f64, bonded: bool) -> PointKinematics {
    PointKinematics {
        geometry: BONDED,
        length: 2.1 + elongation,
        length_old: 2.1 + before,
        elongation,
        elongation_old: before,
        gap: 0.1 + elongation,
        normal: Vec3::x(),
        shear_increment: Vec3::new(0.0, slide, 0.0),
        arm_a: 1.0,
        arm_b: 1.0,
        bonded,
        transport: Transport::identity(Vec3::x()),
    }
}

/// Fifty directions of loading, each up to where the closed form meets the tensile strength or the cone: just below the bond holds, just
/// above it cracks, in the mode that comes first. 1e-12: some tens of roundings.
#[test]
fn the_failure_envelope_is_a_cone_with_a_lid() {
    let law = bond(1e5, 2e5, 0.6);
    let (mut in_tension, mut in_shear) = (0, 0);
    for direction in 0..50 {
        let (sine, cosine) = (std::f64::consts::PI * (f64::from(direction) + 0.5) / 50.0).sin_cos();
        // (cosine, sine): normal and shear force per unit of the load.
        let of_tension = if cosine > 0.0 { 1e5 / cosine } else { f64::INFINITY };
        let slope = sine + 0.6 * cosine;
        let of_shear = if slope > 0.0 { 2e5 / slope } else { f64::INFINITY };
        let at = |load: f64| {
            let k = moved(0.0, load * cosine / NORMAL, load * sine / SHEAR, true);
            law.respond(&k, &JointedState::default(), 1e-3)
        };
        let limit = of_tension.min(of_shear);
        if limit == f64::INFINITY {
            let response = at(1e9);
            assert_eq!((response.status, response.state.crack), (Status::Lives, 0.0));
            continue;
        }
        let holds = at(limit * (1.0 - 1e-12));
        assert_eq!((holds.status, holds.state.crack), (Status::Lives, 0.0), "direction {direction}");
        let cracks = at(limit * (1.0 + 1e-12));
        let (energy, [normal, shear, ..], is_shear) = Jointed::event(&cracks);
        assert_eq!(is_shear, of_shear <= of_tension, "direction {direction}");
        if of_tension < of_shear {
            in_tension += 1;
            assert_eq!((cracks.status, shear), (Status::Broke, 0.0), "direction {direction}");
            assert!(normal > 0.0 && energy == normal);
        } else {
            in_shear += 1;
            let pressed = cosine < 0.0;
            assert_eq!(
                cracks.status,
                if pressed { Status::Lives } else { Status::BrokeInShear },
                "direction {direction}"
            );
            assert_eq!((normal, Jointed::damage(&cracks.state)), (0.0, f64::from(u8::from(pressed))));
            assert!(shear > 0.0 && energy == shear);
        }
    }
    // Every mode is met, and the cone ends: nine directions press too steeply to slide.
    assert_eq!((in_tension, in_shear), (15, 26));
}

/// Under pressure the bond keeps the cohesive limit in the step in which it cracks. In the next one the shear force falls to friction, and
/// what it stored above that is damage; slip after that is friction. Apart, nothing remains. All in closed form.
#[test]
fn a_bond_that_cracks_under_pressure_slides_on() {
    let law = Jointed { residual_friction: 0.1, ..bond(1e5, 2e5, 0.5) };
    let pressure = NORMAL * 0.1;
    let (high, low) = (2e5 + 0.5 * pressure, 0.5 * pressure);
    let stored = |force: f64| 0.5 * force * force / SHEAR;
    // A handful of roundings.
    let near = |x: f64, y: f64| assert!((x / y - 1.0).abs() < 1e-14, "{x} {y}");

    let crack = law.respond(&moved(0.0, -0.1, 1.0, true), &JointedState::default(), 1e-3);
    assert_eq!((crack.status, crack.state.crack), (Status::Lives, 1.0));
    near(crack.force.y, high);
    near(crack.energy.damage, 0.5 * high * (1.0 - high / SHEAR));
    assert_eq!(crack.energy.friction, 0.0);

    let fall = law.respond(&moved(-0.1, -0.1, 0.0, true), &crack.state, 1e-3);
    assert_eq!((fall.status, fall.state.crack), (Status::Lives, 2.0));
    near(fall.force.y, low);
    near(fall.force.x, -pressure);
    near(fall.energy.damage, stored(high) - stored(low));
    assert_eq!(fall.energy.friction, 0.0);

    let slip = law.respond(&moved(-0.1, -0.1, 0.01, true), &fall.state, 1e-3);
    near(slip.force.y, low);
    near(slip.energy.friction, low * 0.01);
    assert_eq!(slip.energy.damage, 0.0);

    // The force of the last step, not what the history allows in the next one.
    let (last, _) = law.last_force(&moved(-0.1, -0.1, 0.0, true), &crack.state);
    assert_eq!(last, crack.force);

    let apart = law.respond(&moved(-0.1, 1e-9, 0.0, true), &slip.state, 1e-3);
    assert_eq!((apart.status, apart.force, apart.energy.damage), (Status::Broke, Vec3::zeros(), 0.0));
    near(apart.energy.friction, stored(low));
}

/// Contacts begin without force, between spheres and at walls, hold together without any, and slide with the residual friction.
#[test]
fn contacts_begin_without_force() {
    assert_eq!(Jointed::unbonded_reference(1.9, 1.0, 0.8).length, 1.9);
    assert_eq!(Jointed::unbonded_reference(0.9, 1.0, 0.0).length, 0.9);
    let law = Jointed { residual_friction: 0.25, ..bond(1e5, 2e5, 0.5) };
    let touch = law.respond(&moved(0.05, 0.0, 0.1, false), &JointedState::default(), 1e-3);
    assert_eq!((touch.status, touch.force), (Status::Lives, Vec3::zeros()));
    let pressed = law.respond(&moved(0.0, -0.1, 1.0, false), &touch.state, 1e-3);
    assert_eq!((pressed.state.crack, Jointed::damage(&pressed.state)), (0.0, 0.0));
    assert!((pressed.force.y / (0.25 * NORMAL * 0.1) - 1.0).abs() < 1e-15);
    let opened = law.respond(&moved(-0.1, 1e-9, 0.0, false), &pressed.state, 1e-3);
    assert_eq!(opened.status, Status::Opened);
}

/// Without a tensile strength of its own, a bond ends at the tip of the cone.
#[test]
fn the_tip_of_the_cone_is_the_strength_without_tensile_strength() {
    let law = bond(0.0, 1e5, 0.5);
    let at = |force: f64| law.respond(&moved(0.0, force / NORMAL, 0.0, true), &JointedState::default(), 1e-3).status;
    assert_eq!(at(1.999_999e5), Status::Lives);
    assert_eq!(at(2.000_001e5), Status::BrokeInShear);
}

/// Springs and their force have the factor of the stiffness, the limits that of the strength.
#[test]
fn warm_bonds_are_softer_and_weaker() {
    let law = bond(1e5, 1e5, 0.5);
    let factors = TemperatureFactors { stiffness: 0.5, strength: 0.25 };
    let cold = law.respond(&moved(0.0, 0.01, 0.02, true), &JointedState::default(), 1e-3);
    let warm = law.respond_at(&factors, &moved(0.01, 0.01, 0.0, true), &cold.state, 1e-3);
    assert_eq!(warm.force, cold.force * 0.5);
    assert_eq!(warm.state, cold.state);
    let tension = |elongation: f64| {
        law.respond_at(&factors, &moved(0.0, elongation, 0.0, true), &JointedState::default(), 1e-3).status
    };
    let limit = 0.25e5 / (0.5 * NORMAL);
    assert_eq!((tension(limit * 0.999), tension(limit * 1.001)), (Status::Lives, Status::Broke));
}

fn table(factor: f64) -> JointedTable {
    JointedTable {
        young: Stress::new(1e9 * factor),
        stiffness_ratio: Number::new(0.25 * factor),
        tensile_strength: Stress::new(1e6 * factor),
        cohesion: Stress::new(4e6 / factor),
        friction_coefficient: Some(Number::new(0.5 * factor)),
        friction_angle: None,
        residual_friction_coefficient: None,
        residual_friction_angle: Some(Angle::new(0.1)),
    }
}

/// Between two materials the springs are in series, and the weaker and smoother one decides. At a wall the radius of the sphere counts
/// twice.
#[test]
fn two_materials_share_a_bond() {
    let law = Jointed::row(&table(1.0), &table(2.0)).unwrap();
    let limits = (law.tensile_strength, law.cohesion, law.friction, law.residual_friction);
    assert_eq!(limits, (1e6, 2e6, 0.5, libm::tan(0.1)));
    let stiffness = law.stiffness(&BONDED);
    // Springs 2ER and 2ERν in series; three roundings on either side.
    let series = |a: f64, b: f64| 1.0 / (1.0 / a + 1.0 / b);
    let [a, b] = [2e9 * 0.8, 4e9 * 1.2];
    assert!((stiffness.normal / series(a, b) - 1.0).abs() < 1e-15);
    assert!((stiffness.shear / series(a * 0.25, b * 0.5) - 1.0).abs() < 1e-15);
    let wall = ContactGeometry { radius_b: 0.0, mass_b: f64::INFINITY, ..BONDED };
    assert!((law.stiffness(&wall).normal / series(2e9 * 0.8, 4e9 * 0.8) - 1.0).abs() < 1e-15);
    let smooth = Jointed { stiffness_ratio_a: 0.0, stiffness_ratio_b: 0.0, ..law };
    assert_eq!(smooth.stiffness(&BONDED).shear, 0.0);
    let residual = JointedTable { residual_friction_angle: None, ..table(1.0) };
    assert_eq!(Jointed::row(&residual, &residual).unwrap().residual_friction, 0.5);
    let half = Factors { stiffness: Number::new(0.5), strength: Number::new(0.25), ..Factors::default() };
    let scaled = Jointed::scaled(&table(1.0), &half).unwrap();
    assert_eq!((scaled.young.si(), scaled.tensile_strength.si(), scaled.cohesion.si()), (5e8, 2.5e5, 1e6));
}

#[test]
fn bad_parameters_are_named() {
    let faults = |change: fn(&mut JointedTable)| {
        let mut table = table(1.0);
        change(&mut table);
        table.faults().iter().map(|fault| (fault.key, fault.message.clone())).collect::<Vec<_>>()
    };
    assert_eq!(faults(|_| ()), []);
    let found = faults(|t| t.friction_coefficient = None);
    assert_eq!(found, [("friction_angle", "neither `friction_angle` nor `friction_coefficient`".to_owned())]);
    let found = faults(|t| t.friction_angle = Some(Angle::new(0.5)));
    assert_eq!(found, [("friction_angle", "both `friction_angle` and `friction_coefficient`".to_owned())]);
    let found = faults(|t| t.residual_friction_angle = Some(Angle::new(30.0)));
    assert_eq!(found, [("residual_friction_angle", "must be less than a right angle".to_owned())]);
    let found = faults(|t| (t.tensile_strength, t.cohesion) = (Stress::new(0.0), Stress::new(0.0)));
    assert_eq!(found, [("cohesion", "bonds have neither tensile strength nor cohesion".to_owned())]);
    let message = Jointed::new(1e9, -1.0, 1.0, 1.0, 0.5).unwrap_err().to_string();
    assert_eq!(message, "law jointed: stiffness_ratio = -1 must be finite and not negative");
    assert!(Jointed::new(f64::NAN, 0.5, 1.0, 1.0, 0.5).is_err());
    assert!(Jointed::new(1e9, 0.5, f64::INFINITY, 1.0, 0.5).is_err());
}
