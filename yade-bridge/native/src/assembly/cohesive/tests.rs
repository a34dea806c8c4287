//! Closed forms of the law, its symmetry, and what the assembly keeps. Comparisons with YADE are in `yade-bridge/tests/yade/`.

use concordem_contact::kinematics::{ImageShift, Motion, MotionMeasure, initial_geometry};
use concordem_contact::law::{ContactLaw as _, LawState as _, Reference, Status};
use concordem_contact::math::{Quat, Vec3, quaternion_of_rotation_vector};
use concordem_contact::step::{Contact, Ends, How, Stepped, step};

use super::super::concrete::Bodies;
use super::super::histories::Contacts;
use super::super::{Assembly, BodyState, Origin};
use super::*;

const RADIUS: f64 = 0.01;
/// Of both spheres: k_n = E R, k_s = ν E R.
const STIFFNESS: [f64; 2] = [1e5, 4e4];
const DT: f64 = 1e-5;

fn material() -> Material {
    Material {
        young: 1e7,
        poisson: 0.4,
        friction_coefficient: 0.5,
        rolling_stiffness: 2.0,
        twisting_stiffness: 3.0,
        rolling_friction: 0.1,
        twisting_friction: 0.2,
        normal_cohesion: 2e5,
        shear_cohesion: 1e5,
        cohesive: true,
        fragile: true,
        moments: true,
    }
}

fn rules(version: Version) -> Rules {
    Rules {
        version,
        cohesion_on_new_contacts: true,
        moments_without_cohesion: false,
        incremental_moments: false,
        shear_creep_viscosity: 0.0,
    }
}

fn law(version: Version) -> CohesiveFriction {
    CohesiveFriction { materials: [material(); 2], rules: rules(version) }
}

fn at(position: Vec3, velocity: Vec3, turn: Vec3) -> Motion {
    Motion {
        position,
        velocity,
        angular_velocity: Vec3::zeros(),
        rotation_increment: Quat::identity(),
        orientation: quaternion_of_rotation_vector(&turn),
    }
}

/// A contact after a first step in which its spheres overlap by 1e-4 m, then one in which B has moved by `slide` and turned by `turn`.
fn stepped(law: &CohesiveFriction, slide: Vec3, turn: Vec3, exchanged: bool) -> Stepped<CohesiveFriction> {
    let (a, b) = (Vec3::zeros(), Vec3::x() * (2.0 * RADIUS - 1e-4));
    let none = Vec3::zeros();
    let pair = |b, velocity, turn| {
        let both = [at(a, none, none), at(b, velocity, turn)];
        if exchanged { [both[1], both[0]] } else { both }
    };
    let reference = Reference { length: 2.0 * RADIUS, area: 1.0 };
    let image = ImageShift::default();
    let how = How::new(MotionMeasure::YadeRatcheting, DT);
    let once = |contact: &Contact<CohesiveFrictionState>, [a, b]: [Motion; 2]| {
        let ends =
            Ends { motion: [&a, &b], radius: [RADIUS; 2], mass: [1.0; 2], image: &image, surface_displacement: None };
        step(law, contact, &ends, &how)
    };
    let start = pair(b, none, none);
    let previous = initial_geometry(&start[0].position, &start[1].position, &none);
    let history = CohesiveFrictionState::default();
    let first = once(&Contact { bonded: false, reference, previous, history }, start);
    assert_eq!(first.response.status, Status::Lives);
    let contact = Contact { bonded: false, reference, previous: first.geometry(), history: first.response.state };
    once(&contact, pair(b + slide, slide / DT, turn))
}

/// Relative, of a handful of roundings.
fn close(found: f64, wanted: f64) -> bool {
    (found - wanted).abs() <= 1e-12 * wanted.abs()
}

#[test]
fn springs_and_moments_have_their_closed_forms() {
    for version in [Version::V2023, Version::V2025] {
        // Below the friction of 2023.02a, 0.1 R F = 0.01 N m in bending.
        let turn = Vec3::new(1e-3, 1e-3, 0.0);
        let found = stepped(&law(version), Vec3::zeros(), turn, false);
        assert!(close(found.response.force.x, -STIFFNESS[0] * 1e-4), "{version:?}");
        let by_shear = RADIUS * RADIUS * STIFFNESS[1];
        // The moment on A opposes that A lags behind B.
        assert!(close(found.response.moment.x, 3.0 * by_shear * 1e-3), "{version:?} {}", found.response.moment);
        assert!(close(found.response.moment.y, 2.0 * by_shear * 1e-3), "{version:?} {}", found.response.moment);
        let energy = found.response.energy;
        assert!(
            close(energy.stored_normal, 0.5 * STIFFNESS[0] * 1e-8) && close(energy.stored_twist, 1.5 * by_shear * 1e-6)
        );
    }
}

#[test]
fn each_limit_breaks_a_fragile_contact() {
    let tension = Vec3::x() * 4e-4;
    let shear = Vec3::y() * 1e-3;
    // a_n/4 r = 0.05 N m beside 0.1 R F = 0.01 N m, and a_s/2 r = 0.05 N m beside 0.02 N m.
    let (bending, twist) = (Vec3::y() * 0.01, Vec3::x() * 0.01);
    for version in [Version::V2023, Version::V2025] {
        let law = law(version);
        assert_eq!(stepped(&law, tension, Vec3::zeros(), false).response.status, Status::Opened);
        let slid = stepped(&law, shear, Vec3::zeros(), false).response;
        assert_eq!((slid.status, slid.state.cohesive, slid.state.shear_adhesion), (Status::Lives, 0.0, 0.0));
        // Friction is left: tan φ = 0.5.
        assert!(close(slid.state.shear_force.norm(), 0.5 * slid.state.normal_force) && slid.state.normal_force > 1.0);
        for turn in [bending, twist] {
            let turned = stepped(&law, Vec3::zeros(), turn, false).response.state;
            let keeps = version == Version::V2023;
            assert_eq!(turned.cohesive, f64::from(u8::from(keeps)), "{version:?} {turn}");
            let moment = turned.bending_moment.norm() + turned.twisting_moment.norm();
            // 2023.02a: the friction of 10 N at a radius. 2025.2.0: friction in bending, and none in twist.
            let friction = if turn.x > 0.0 { if keeps { 0.2 } else { 0.0 } } else { 0.1 };
            assert!((moment - friction * RADIUS * 10.0).abs() < 1e-12, "{version:?} {turn}: {moment}");
        }
    }
}

#[test]
fn plastic_contacts_yield_at_their_adhesion() {
    let soft = |version| {
        let mut law = law(version);
        law.materials[0].fragile = false;
        law.materials[1].fragile = false;
        law
    };
    // 20 N at 1e5 N/m: B is pulled 1e-4 m further than the adhesion bears.
    let found = stepped(&soft(Version::V2025), Vec3::x() * 4e-4, Vec3::zeros(), false).response;
    assert!(close(found.force.x, 20.0) && close(found.state.plastic_overlap, -1e-4), "{found:?}");
    assert_eq!(found.state.cohesive, 1.0);
    // YADE 2023.02a has unpMax = 0: such a contact ends.
    assert_eq!(stepped(&soft(Version::V2023), Vec3::x() * 4e-4, Vec3::zeros(), false).response.status, Status::Opened);
}

#[test]
fn both_ends_see_the_same_contact() {
    for version in [Version::V2023, Version::V2025] {
        for incremental_moments in [false, true] {
            let mut law = law(version);
            law.materials[1].young = 3e7;
            law.rules.incremental_moments = incremental_moments;
            let (slide, turn) = (Vec3::new(-1e-5, 2e-5, 0.0), Vec3::new(1e-3, 2e-3, -1e-3));
            let one = stepped(&law, slide, turn, false).response;
            let two = stepped(&law.exchanged(), slide, turn, true).response;
            assert!((one.force + two.force).norm() < 1e-12 * one.force.norm(), "{version:?}");
            assert!((one.moment + two.moment).norm() <= 1e-12 * one.moment.norm(), "{version:?}");
            let swapped = two.state.swapped();
            for (a, b) in one.state.as_reals().iter().zip(swapped.as_reals()) {
                // A third of the digits of the smallest number that is not zero, 1e-5.
                assert!((a - b).abs() <= 1e-12 * a.abs().max(1e-5), "{version:?} {a} {b}");
            }
        }
    }
}

/// Three spheres in a row: the first two have a contact with its history, the third comes from the right.
fn assembly() -> Assembly {
    let position = [Vec3::zeros(), Vec3::x() * 0.0199, Vec3::x() * 0.0402];
    let velocity = [Vec3::zeros(), Vec3::new(0.02, 0.05, 0.0), Vec3::new(-3.0, 0.0, 0.0)];
    let bodies = Bodies {
        id: &[7, 3, 11],
        position: &position,
        velocity: &velocity,
        orientation: &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        angular_velocity: &[Vec3::new(1.0, 0.5, 0.0), Vec3::zeros(), Vec3::zeros()],
        radius: &[RADIUS; 3],
        mass: &[0.01; 3],
        inertia: &[4e-7; 3],
        material: &[0; 3],
        constraint: &[0; 3],
        lost: &[0; 3],
    };
    let history = stepped(&law(Version::V2025), Vec3::zeros(), Vec3::zeros(), false).response.state;
    let contacts = Contacts {
        pair: &[[1, 0]],
        image: &[[0; 3]],
        normal: &[-Vec3::x()],
        distance: &[0.0199],
        history: history.as_reals(),
    };
    let origin = Origin::Cohesive {
        kinematics: MotionMeasure::YadeRatcheting,
        materials: vec![material()],
        rules: Rules { cohesion_on_new_contacts: false, ..rules(Version::V2025) },
    };
    Assembly::with_histories(&bodies, &contacts, &[], origin, None, DT).expect("the input is valid")
}

/// Move the spheres as a host does; returns the bits of forces and torques of all steps.
fn drive(assembly: &mut Assembly, steps: usize) -> Vec<u64> {
    let mut bits = Vec::new();
    for _ in 0..steps {
        let p = &assembly.state.particles;
        let (position, velocity, spin) = (p.position.clone(), p.velocity.clone(), p.angular_velocity.clone());
        let orientation = p.orientation.clone();
        let motion = |k: usize| {
            let turned: Quat = quaternion_of_rotation_vector(&(spin[k] * DT)) * orientation[k];
            BodyState {
                position: position[k] + velocity[k] * DT,
                velocity: velocity[k],
                angular_velocity: spin[k],
                orientation: [turned.i, turned.j, turned.k, turned.w],
                constraint: 0,
            }
        };
        assembly.take_motions(DT, |k, _| Ok(motion(k))).expect("finite");
        assembly.find_forces(DT, None, true).expect("a step");
        let loads = assembly.solver.forces().iter().chain(assembly.solver.torques());
        bits.extend(loads.flat_map(|f| f.iter().map(|x| x.to_bits())));
    }
    bits
}

#[test]
fn a_saved_assembly_continues_bitwise_equal() {
    let mut straight = assembly();
    assert_eq!(straight.bond_count(), 1);
    drive(&mut straight, 30);
    let words = straight.to_words().expect("words");
    let mut again = Assembly::from_words(&words).expect("the same");
    assert_eq!(again.to_words().expect("words"), words);
    let forces = drive(&mut straight, 100);
    assert_eq!(drive(&mut again, 100), forces);
    // The third sphere has come, without cohesion.
    let block = straight.state.contacts.as_ref().expect("contacts").contacts();
    assert_eq!((0..block.len()).filter(|&k| block.view(k).flags.carries()).count(), 2);
    assert!(straight.bond_count() == 1 && forces.iter().any(|&bits| f64::from_bits(bits).abs() > 1.0));
}

#[test]
fn contacts_without_history_are_refused() {
    let refused = |history: CohesiveFrictionState, text: &str| {
        let bodies = Bodies {
            id: &[7, 3],
            position: &[Vec3::zeros(), Vec3::x() * 0.0199],
            velocity: &[Vec3::zeros(); 2],
            orientation: &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            angular_velocity: &[Vec3::zeros(); 2],
            radius: &[RADIUS; 2],
            mass: &[0.01; 2],
            inertia: &[4e-7; 2],
            material: &[0; 2],
            constraint: &[0; 2],
            lost: &[0; 2],
        };
        let contacts = Contacts {
            pair: &[[0, 1]],
            image: &[[0; 3]],
            normal: &[Vec3::x()],
            distance: &[0.0199],
            history: history.as_reals(),
        };
        let origin = Origin::Cohesive {
            kinematics: MotionMeasure::Yade,
            materials: vec![material()],
            rules: rules(Version::V2023),
        };
        let message = Assembly::with_histories(&bodies, &contacts, &[], origin, None, DT).err().unwrap_or_default();
        assert!(message.contains("the contact of bodies 7 and 3") && message.contains(text), "{message}");
    };
    let good = stepped(&law(Version::V2023), Vec3::zeros(), Vec3::zeros(), false).response.state;
    refused(CohesiveFrictionState::default(), "no stiffness");
    refused(CohesiveFrictionState { shear_force: Vec3::repeat(f64::NAN), ..good }, "take one step");
}
