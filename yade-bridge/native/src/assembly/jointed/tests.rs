//! Closed forms of the law, its symmetry, and what the assembly keeps and notes. Comparisons with YADE are in `yade-bridge/tests/yade/`.

use std::f64::consts::PI;

use concordem_contact::kinematics::{ImageShift, Motion, MotionMeasure, initial_geometry};
use concordem_contact::law::{ContactLaw as _, LawState as _, Reference, Status};
use concordem_contact::math::{Quat, Vec3};
use concordem_contact::step::{Contact, Ends, How, Stepped, step};

use super::super::concrete::Bodies;
use super::super::histories::Contacts;
use super::super::{Assembly, BodyState, Origin};
use super::law::event;
use super::*;

const RADIUS: f64 = 0.01;
/// Of two equal spheres: k_n = E R, k_s = ν E R.
const STIFFNESS: [f64; 2] = [1e5, 4e4];
const STRENGTH: f64 = 2e5;
const COHESION: f64 = 3e5;
const AREA: f64 = PI * RADIUS * RADIUS;
const DT: f64 = 1e-5;

fn material() -> Material {
    Material {
        young: 1e7,
        poisson: 0.4,
        friction_coefficient: 0.5,
        residual_friction_coefficient: 0.3,
        tensile_strength: STRENGTH,
        cohesion: COHESION,
        kind: 0,
    }
}

fn law() -> JointedFriction {
    JointedFriction { materials: [material(); 2], rules: Rules { bonds_new_contacts: true, never_erase: false } }
}

fn at(position: Vec3, velocity: Vec3) -> Motion {
    Motion {
        position,
        velocity,
        angular_velocity: Vec3::zeros(),
        rotation_increment: Quat::identity(),
        orientation: Quat::identity(),
    }
}

/// A contact that begins at an overlap of 1e-4 m, then steps in which B moves by each of these displacements (m).
fn ride(law: &JointedFriction, moves: &[Vec3], exchanged: bool) -> Stepped<JointedFriction> {
    let mut place = Vec3::x() * (2.0 * RADIUS - 1e-4);
    let image = ImageShift::default();
    let how = How::new(MotionMeasure::YadeRatcheting, DT);
    let once = |contact: &Contact<JointedFrictionState>, place: Vec3, moved: Vec3| {
        let both = [at(Vec3::zeros(), Vec3::zeros()), at(place, moved / DT)];
        let [a, b] = if exchanged { [both[1], both[0]] } else { both };
        let ends =
            Ends { motion: [&a, &b], radius: [RADIUS; 2], mass: [1.0; 2], image: &image, surface_displacement: None };
        step(law, contact, &ends, &how)
    };
    let ends = if exchanged { [place, Vec3::zeros()] } else { [Vec3::zeros(), place] };
    let reference = Reference { length: 2.0 * RADIUS, area: 1.0 };
    let previous = initial_geometry(&ends[0], &ends[1], &Vec3::zeros());
    let begun = Contact { bonded: false, reference, previous, history: JointedFrictionState::default() };
    let mut last = once(&begun, place, Vec3::zeros());
    for &moved in moves {
        let contact = Contact { bonded: false, reference, previous: last.geometry(), history: last.response.state };
        place += moved;
        last = once(&contact, place, moved);
    }
    last
}

/// Relative, of a handful of roundings.
fn close(found: f64, wanted: f64) -> bool {
    (found - wanted).abs() <= 1e-12 * wanted.abs()
}

#[test]
fn a_contact_begins_without_force_as_a_bond_or_not() {
    let found = ride(&law(), &[], false).response;
    let s = found.state;
    assert_eq!((found.force, s.cohesive, s.event), (Vec3::zeros(), 1.0, f64::from(event::BOND)));
    assert!(close(s.largest_tension, STRENGTH * AREA) && close(s.largest_shear, COHESION * AREA));
    assert!(s.friction_coefficient == 0.5 && close(s.rest_overlap, 1e-4));
    let mut others = [law(); 3];
    others[0].rules.bonds_new_contacts = false;
    others[1].materials[1].kind = 1;
    others[2].materials[0] = Material { tensile_strength: 0.0, cohesion: 0.0, ..material() };
    for other in others {
        let s = ride(&other, &[], false).response.state;
        assert_eq!((s.cohesive, s.largest_tension, s.largest_shear, s.event), (0.0, 0.0, 0.0, 0.0));
        assert!(s.friction_coefficient == 0.3);
    }
}

#[test]
fn springs_act_from_the_overlap_of_the_start() {
    let found = ride(&law(), &[Vec3::new(-1e-6, 0.0, 0.0)], false).response;
    assert!((found.force - Vec3::x() * -0.1).norm() < 1e-10, "{}", found.force);
    // The displacement is the difference of two lengths that are 10⁴ times as large.
    assert!((found.energy.stored_normal / 0.5e-7 - 1.0).abs() < 1e-9);
    let slid = ride(&law(), &[Vec3::new(0.0, 1e-6, 0.0)], false).response;
    // A moves behind B. YADE's measure without ratcheting scales the motion by the sum of the radii over the distance.
    let scale = 2.0 * RADIUS / (2.0 * RADIUS - 1e-4);
    assert!((slid.force.y - scale * STIFFNESS[1] * 1e-6).abs() < 1e-9, "{}", slid.force);
}

#[test]
fn a_bond_cracks_in_tension_at_its_strength() {
    let limit = STRENGTH * AREA / STIFFNESS[0];
    for (factor, cracks) in [(0.999, false), (1.001, true)] {
        let found = ride(&law(), &[Vec3::x() * (0.5 * limit), Vec3::x() * ((factor - 0.5) * limit)], false).response;
        assert_eq!(found.status, Status::Lives);
        let s = found.state;
        let happened = if cracks { event::TENSION | event::END } else { 0 };
        assert_eq!((s.event, s.cohesive), (f64::from(happened), if cracks { 0.0 } else { 1.0 }), "{factor}");
        if cracks {
            let half = 0.5 * limit * STIFFNESS[0];
            // Of the forces before the step.
            assert!((s.crack_energy / (0.5 * half * half / STIFFNESS[0]) - 1.0).abs() < 1e-9 && s.cracked == 1.0);
            assert_eq!(found.force, Vec3::zeros());
        }
    }
    // Without a tensile strength of its own, the cone ends it, in shear.
    let mut cone = law();
    cone.materials[0].tensile_strength = 0.0;
    let tip = COHESION * AREA / 0.5 / STIFFNESS[0];
    for (factor, cracks) in [(0.999, false), (1.001, true)] {
        let s = ride(&cone, &[Vec3::x() * (factor * tip)], false).response.state;
        assert_eq!(s.event, f64::from(if cracks { event::SHEAR | event::END } else { 0 }), "{factor}");
    }
}

#[test]
fn a_pressed_bond_cracks_in_shear_and_slides() {
    // So weak that the spheres stay side by side.
    let weak = Material { cohesion: 3e3, ..material() };
    let law = JointedFriction { materials: [weak; 2], ..law() };
    let pressed = Vec3::new(-1e-5, 0.0, 0.0);
    let normal = STIFFNESS[0] * 1e-5;
    let cone = 3e3 * AREA + normal * 0.5;
    let to_the_limit = Vec3::y() * (cone / STIFFNESS[1]);
    assert_eq!(ride(&law, &[pressed, to_the_limit * 0.9], false).response.state.event, 0.0);
    let found = ride(&law, &[pressed, to_the_limit * 1.2], false).response;
    let s = found.state;
    assert_eq!((s.event, s.cohesive, s.largest_tension, s.largest_shear), (f64::from(event::SHEAR), 0.0, 0.0, 0.0));
    // In the step of the crack, the whole limit acts; the arc of the motion changes the pressure by less than 1 %.
    let limit = 3e3 * AREA + s.normal_force * s.friction_coefficient;
    assert!(close(s.shear_force.norm(), limit) && s.normal_force > 0.99 * normal);
    let next = ride(&law, &[pressed, to_the_limit * 1.2, Vec3::y() * 1e-8], false).response.state;
    assert!(close(next.shear_force.norm(), next.normal_force * 0.5), "{next:?}");
    // It ends where its spheres part, and goes on with neverErase.
    let apart = [pressed, to_the_limit * 1.2, Vec3::x() * 1e-3];
    assert_eq!(ride(&law, &apart, false).response.state.event, f64::from(event::END));
    let kept = JointedFriction { rules: Rules { never_erase: true, ..law.rules }, ..law };
    let back = [apart[0], apart[1], apart[2], Vec3::x() * -1.1e-3];
    let idle = ride(&kept, &apart, false).response;
    assert_eq!((idle.state.event, idle.force, idle.state.cracked), (0.0, Vec3::zeros(), 1.0));
    assert!(ride(&kept, &back, false).response.force.x < -1.0);
}

#[test]
fn both_ends_see_the_same_contact() {
    let mut law = law();
    law.materials[1] = Material { young: 3e7, poisson: 0.2, friction_coefficient: 0.4, ..material() };
    let moves = [Vec3::new(-1e-5, 2e-5, 0.0), Vec3::new(1e-6, 2e-5, -1e-5)];
    let one = ride(&law, &moves, false).response;
    let two = ride(&law.exchanged(), &moves, true).response;
    assert!(one.force.norm() > 1.0 && (one.force + two.force).norm() < 1e-12 * one.force.norm());
    for (a, b) in one.state.as_reals().iter().zip(two.state.swapped().as_reals()) {
        assert!((a - b).abs() <= 1e-12 * a.abs().max(1e-5), "{a} {b}");
    }
}

/// Two bonds between three spheres; the last one is pulled off, and a fourth one comes.
fn assembly() -> Assembly {
    let position = [Vec3::zeros(), Vec3::x() * 0.0201, Vec3::x() * 0.0402, Vec3::new(0.0, 0.0203, 0.0)];
    let velocity = [Vec3::zeros(), Vec3::zeros(), Vec3::new(0.5, 0.0, 0.0), Vec3::new(0.0, -3.0, 0.0)];
    let bodies = Bodies {
        id: &[7, 3, 11, 5],
        position: &position,
        velocity: &velocity,
        orientation: &[0.0, 0.0, 0.0, 1.0].repeat(4),
        angular_velocity: &[Vec3::zeros(); 4],
        radius: &[RADIUS; 4],
        mass: &[0.01; 4],
        inertia: &[4e-7; 4],
        material: &[0; 4],
        constraint: &[0; 4],
        lost: &[0; 4],
    };
    let bond = ride(&law(), &[], false).response.state;
    let bond = JointedFrictionState { event: 0.0, rest_overlap: -1e-4, ..bond };
    let contacts = Contacts {
        pair: &[[0, 1], [2, 1]],
        image: &[[0; 3]; 2],
        normal: &[Vec3::x(), -Vec3::x()],
        distance: &[0.0201; 2],
        history: &[bond.as_reals(), bond.as_reals()].concat(),
    };
    let rules = Rules { bonds_new_contacts: false, never_erase: false };
    let origin = Origin::Jointed { kinematics: MotionMeasure::YadeRatcheting, materials: vec![material()], rules };
    Assembly::with_histories(&bodies, &contacts, &[], origin, None, DT).expect("the input is valid")
}

/// Move the spheres as a host does; returns the bits of forces of all steps.
fn drive(assembly: &mut Assembly, steps: usize) -> Vec<u64> {
    let mut bits = Vec::new();
    for _ in 0..steps {
        let p = &assembly.state.particles;
        let (position, velocity) = (p.position.clone(), p.velocity.clone());
        let motion = |k: usize| BodyState {
            position: position[k] + velocity[k] * DT,
            velocity: velocity[k],
            orientation: [0.0, 0.0, 0.0, 1.0],
            ..BodyState::default()
        };
        assembly.take_motions(DT, |k, _| Ok(motion(k))).expect("finite");
        assembly.find_forces(DT, None, true).expect("a step");
        bits.extend(assembly.solver.forces().iter().flat_map(|f| f.iter().map(|x| x.to_bits())));
    }
    bits
}

#[test]
fn cracks_are_noted_once_and_end_the_contact() {
    let mut assembly = assembly();
    assert_eq!(assembly.bond_count(), 2);
    drive(&mut assembly, 300);
    let [crack] = assembly.happenings.cracks[..] else { panic!("{:?}", assembly.happenings) };
    assert_eq!((crack.ids, crack.kind, assembly.bond_count(), assembly.broken), ([3, 11], CrackKind::Tension, 1, 1));
    // 6.3e-4 m at 5e-6 m per step.
    let steps = STRENGTH * AREA / STIFFNESS[0] / (0.5 * DT);
    assert!((crack.step as f64 - steps).abs() < 2.0, "{} {steps}", crack.step);
    assert!((crack.normal - Vec3::x()).norm() < 1e-12 && close(crack.area, AREA) && close(crack.size, RADIUS));
    assert!((crack.point.x - 0.0201 - 0.5 * (0.0201 + 0.5 * DT * (crack.step + 1) as f64)).abs() < 1e-12);
    assert!((crack.energy / (0.5 * STIFFNESS[0] * (0.5 * DT * crack.step as f64).powi(2)) - 1.0).abs() < 1e-9);
    let block = assembly.state.contacts.as_ref().expect("contacts").contacts();
    // The bond, and the fourth sphere, which has come without cohesion.
    assert_eq!(block.flags().iter().filter(|flags| flags.carries()).count(), 2);
    let mut lost: Vec<(u32, u32)> =
        assembly.state.particles.id.iter().copied().zip(assembly.losses.iter().copied()).collect();
    lost.sort_unstable();
    assert_eq!(lost, [(3, 1), (5, 0), (7, 0), (11, 1)]);
}

#[test]
fn a_saved_assembly_continues_bitwise_equal() {
    let mut straight = assembly();
    drive(&mut straight, 60);
    let words = straight.to_words().expect("words");
    let mut again = Assembly::from_words(&words).expect("the same");
    assert_eq!(again.to_words().expect("words"), words);
    let forces = drive(&mut straight, 200);
    assert_eq!(drive(&mut again, 200), forces);
    assert_eq!(again.happenings.cracks, straight.happenings.cracks);
    assert!(again.broken == 1 && forces.iter().any(|&bits| f64::from_bits(bits).abs() > 1.0));
}
