//! Tests of the linear frictional contact.

use super::*;
use crate::conformance::{GEOMETRY, Native, Observed, Properties, Station, Subject, Window, atlas, atlas_paths, check};

/// Overlaps are a large fraction of the length, so rounding of positions hides nothing.
fn subject(name: &'static str, law: Frictional) -> Subject<Native<Frictional>> {
    let window = Window { elongation: [-0.4, 0.1], shear: 0.5 };
    Subject {
        name,
        host: Native(law),
        geometry: GEOMETRY,
        bonded: false,
        properties: Properties {
            conservative_normal: law.damping_ratio == 0.0,
            conservative_shear: false,
            dissipation_nonnegative: true,
            continuous_failure: !law.tension_from_damping,
            brittle: false,
        },
        elastic: window,
        inelastic: window,
        held: Station { elongation: -0.3, shear: [0.1, -0.15], twist: 0.0 },
        failure: 0.1,
        dt: 1e-3,
    }
}

/// The law written out without dashpots: a shear spring of two components with a circular limit.
fn closed_form(kn: f64, kt: f64, friction: f64) -> impl FnMut(&Observed) -> Option<[f64; 3]> {
    let mut before = [0.0; 2];
    let mut spring = [0.0; 2];
    move |now| {
        let s = now.station;
        let pressure = (-kn * s.elongation).max(0.0);
        for k in 0..2 {
            spring[k] += s.shear[k] - before[k];
        }
        before = s.shear;
        let size = kt * (spring[0] * spring[0] + spring[1] * spring[1]).sqrt();
        if size > friction * pressure {
            for x in &mut spring {
                *x *= friction * pressure / size;
            }
        }
        Some([-pressure, kt * spring[0], kt * spring[1]])
    }
}

#[test]
fn undamped_contact_conforms() {
    let law = Frictional::new(ContactStiffness::Given { normal: 1e6, shear: 5e5 }, 0.5, 0.0).unwrap();
    let subject = subject("frictional", law);
    let mut report = check(&subject);
    report.findings.extend(atlas(
        &subject,
        &atlas_paths(&subject.inelastic, 50),
        || closed_form(1e6, 5e5, 0.5),
        1e-12,
        "rounding of orientations over 250 steps",
    ));
    println!("{report}");
    assert!(report.passed(), "{report}");
}

#[test]
fn damped_contacts_conform() {
    let stiffness = ContactStiffness::Moduli { young_a: 5e5, young_b: 9e5, ratio: 0.3 };
    let mut law = Frictional::new(stiffness, 0.4, 0.2).unwrap();
    for tension_from_damping in [false, true] {
        law.tension_from_damping = tension_from_damping;
        let mut subject = subject("damped frictional, unlike particles", law);
        // Fast enough for the dashpot to matter.
        subject.dt = 1e-4;
        let report = check(&subject);
        println!("{report}");
        assert!(report.passed(), "{report}");
    }
}

/// Two springs 2Er in series; for a wall the radius of the sphere is used.
#[test]
fn stiffness_from_moduli() {
    let stiffness = ContactStiffness::Moduli { young_a: 5e5, young_b: 9e5, ratio: 0.3 };
    let (a, b) = (2.0 * 5e5 * 0.8, 2.0 * 9e5 * 1.2);
    let (kn, kt) = stiffness.of(&GEOMETRY);
    // Three roundings on either side.
    assert!((kn * (1.0 / a + 1.0 / b) - 1.0).abs() < 1e-15);
    assert!((kt / kn - 0.3).abs() < 1e-15);
    let wall = ContactGeometry { radius_b: 0.0, mass_b: f64::INFINITY, ..GEOMETRY };
    let b = 2.0 * 9e5 * 0.8;
    assert!((stiffness.of(&wall).0 * (1.0 / a + 1.0 / b) - 1.0).abs() < 1e-15);
}

/// A sphere bouncing off a wall rebounds with the restitution from which the damping ratio was computed. Tolerance
/// 1e-4: 2e4 steps per collision, and the dashpot lags by half a step.
#[test]
fn restitution_of_a_bounce() {
    use crate::law::restitution::{End, damping_of_restitution};
    let wall = ContactGeometry { reference_length: 0.8, radius_b: 0.0, mass_b: f64::INFINITY, ..GEOMETRY };
    for (end, pulls) in [(End::ForceSpent, false), (End::OverlapSpent, true)] {
        for e in [0.3, 0.7, 0.95, 1.0] {
            let stiffness = ContactStiffness::Given { normal: 1e6, shear: 0.0 };
            let mut law = Frictional::new(stiffness, 0.0, damping_of_restitution(e, end)).unwrap();
            law.tension_from_damping = pulls;
            let dt = std::f64::consts::PI / 1e3 / 2e4;
            let (mut length, mut velocity, mut state) = (0.8, -1.0, FrictionalState::default());
            loop {
                let length_old = length;
                length += velocity * dt;
                let k = PointKinematics {
                    geometry: wall,
                    length,
                    length_old,
                    elongation: length - 0.8,
                    elongation_old: length_old - 0.8,
                    gap: length - 0.8,
                    normal: -Vec3::y(),
                    shear_increment: Vec3::zeros(),
                    arm_a: 0.4 + 0.5 * length,
                    arm_b: 0.5 * length - 0.4,
                    bonded: false,
                    transport: crate::kinematics::Transport::identity(-Vec3::y()),
                };
                let response = law.respond(&k, &state, dt);
                if response.status == Status::Opened {
                    break;
                }
                state = response.state;
                velocity += response.force.y * dt / wall.mass_a;
            }
            assert!((velocity - e).abs() < 1e-4, "{end:?} {e}: {velocity}");
        }
    }
}

#[test]
fn bad_parameters_are_named() {
    let stiffness = ContactStiffness::Given { normal: 1e6, shear: 5e5 };
    let message = Frictional::new(stiffness, -0.1, 0.0).unwrap_err().to_string();
    assert_eq!(message, "law frictional: friction_coefficient = -0.1 must be finite and not negative");
    assert!(Frictional::new(ContactStiffness::Given { normal: 0.0, shear: 0.0 }, 0.1, 0.0).is_err());
    let moduli = ContactStiffness::Moduli { young_a: 1e9, young_b: f64::INFINITY, ratio: 0.3 };
    assert!(Frictional::new(moduli, 0.1, 0.0).is_err());
    assert!(Frictional::new(stiffness, 0.1, f64::NAN).is_err());
}

fn table(young: f64, friction: f64, damping: f64) -> FrictionalTable {
    FrictionalTable {
        young: Some(Stress::new(young)),
        stiffness_ratio: Some(Number::new(0.25)),
        normal_stiffness: None,
        shear_stiffness: None,
        friction_coefficient: Number::new(friction),
        damping_ratio: Number::new(damping),
    }
}

/// Two materials: the smoother surface slides, dashpots and stiffnesses in N/m are means, and each sphere keeps its own
/// modulus: two springs `2Er` in series, whoever is A. All numbers are exact.
#[test]
fn two_materials_share_a_contact() {
    let (soft, stiff) = (table(1e6, 0.75, 0.0), table(3e6, 0.25, 0.5));
    let row = Frictional::row(&soft, &stiff).unwrap();
    assert_eq!((row.friction, row.damping_ratio), (0.25, 0.25));
    // 2·(1e6·1)(3e6·2)/(1e6·1 + 3e6·2); at a wall, both with the radius of the sphere.
    let geometry = ContactGeometry { radius_a: 1.0, radius_b: 2.0, ..GEOMETRY };
    let expected = (12e12 / 7e6, 0.25 * (12e12 / 7e6));
    assert_eq!(row.stiffness.of(&geometry), expected);
    let mirrored = ContactGeometry { radius_a: 2.0, radius_b: 1.0, ..GEOMETRY };
    assert_eq!(row.exchanged().stiffness.of(&mirrored), expected);
    let wall = ContactGeometry { radius_a: 1.0, radius_b: 0.0, ..GEOMETRY };
    assert_eq!(row.stiffness.of(&wall).0, 1.5e6);
    let given = |normal: f64| FrictionalTable {
        young: None,
        stiffness_ratio: None,
        normal_stiffness: Some(quantity::Stiffness::new(normal)),
        shear_stiffness: Some(quantity::Stiffness::new(0.5 * normal)),
        ..soft.clone()
    };
    let row = Frictional::row(&given(1e6), &given(3e6)).unwrap();
    assert_eq!(row.stiffness, ContactStiffness::Given { normal: 2e6, shear: 1e6 });
    assert!(Frictional::row(&soft, &given(1e6)).is_err());
}

/// The Coulomb limit is that of the whole normal force, dashpot included: a contact that approaches holds a shear force that
/// its spring alone would not let it hold, `k_t u_t + c_t u̇_t` with `c = 2ξ√(m k)`. Some roundings.
#[test]
fn dashpots_count_for_friction() {
    let (kn, kt, xi, mass) = (1e6, 5e5, 0.2, 2.0 / 3.0);
    let law = Frictional::new(ContactStiffness::Given { normal: kn, shear: kt }, 0.5, xi).unwrap();
    let (cn, ct) = (2.0 * xi * f64::sqrt(mass * kn), 2.0 * xi * f64::sqrt(mass * kt));
    let (dt, rate, shear, shear_rate) = (1e-6, -1.0, 1.2e-3, 0.1);
    let k = PointKinematics {
        geometry: GEOMETRY,
        length: 1.999,
        length_old: 1.999 - rate * dt,
        elongation: -1e-3,
        elongation_old: -1e-3 - rate * dt,
        gap: -1e-3,
        normal: Vec3::x(),
        shear_increment: Vec3::y() * (shear_rate * dt),
        arm_a: 0.8,
        arm_b: 1.199,
        bonded: false,
        transport: crate::kinematics::Transport::identity(Vec3::x()),
    };
    let before =
        FrictionalState { shear_displacement: Vec3::y() * (shear - shear_rate * dt), ..FrictionalState::default() };
    let answer = law.respond(&k, &before, dt);
    let (normal, tangential) = (-kn * 1e-3 + cn * rate, kt * shear + ct * shear_rate);
    assert!(0.5 * kn * 1e-3 < kt * shear && tangential < -0.5 * normal, "the case must tell");
    // The rate is a difference of lengths of 2 over 1e-6.
    assert!((answer.force - Vec3::new(normal, tangential, 0.0)).norm() < 1e-6, "{}", answer.force);
    assert_eq!(answer.energy.friction, 0.0);
    let viscous = Frictional::viscous_force(&k.normal, &answer.state);
    assert!((viscous - Vec3::new(cn * rate, ct * shear_rate, 0.0)).norm() < 1e-6, "{viscous}");
}
