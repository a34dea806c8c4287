//! One contact across a joint, against closed forms. Tolerances of 1e-12: some tens of roundings.

use concordem::kinematics::{PointKinematics, PreviousGeometry, Transport};
use concordem::law::jointed::{Joint, Jointed, JointedRock, JointedRockState};
use concordem::law::{ContactGeometry, ContactLaw, LawState, Status};
use concordem::math::Vec3;
use concordem::step::{How, Stepped};
use concordem_tests::noise;

const GEOMETRY: ContactGeometry =
    ContactGeometry { reference_length: 2.0, area: 3.0, radius_a: 1.0, radius_b: 1.0, mass_a: 1.0, mass_b: 1.0 };
/// Normal stiffness of the contact, N/m.
const NORMAL: f64 = 2e6 * GEOMETRY.area;
/// Its shear stiffness, N/m.
const SHEAR: f64 = 0.5e6 * GEOMETRY.area;

/// A joint whose normal lies at 0.6 rad to the line of the centers at the start, along x.
fn joint() -> Joint {
    Joint {
        normal: Vec3::new(0.6_f64.cos(), 0.6_f64.sin(), 0.0),
        normal_stiffness: NORMAL / GEOMETRY.area,
        shear_stiffness: SHEAR / GEOMETRY.area,
        tensile_strength: 1e5,
        cohesion: 2e5,
        friction: 0.6,
        dilation: 0.0,
    }
}

fn law(joint: Joint) -> JointedRock {
    joint.validate().unwrap();
    JointedRock { bond: Jointed::new(1e6, 0.4, 1.0, 1.0, 0.1).unwrap(), joint: Some(joint) }
}

/// A contact that moves step by step.
struct Contact {
    law: JointedRock,
    bonded: bool,
    branch: Vec3,
    state: JointedRockState,
    /// Force on A and both energies of the springs after the last step.
    force: Vec3,
    stored: f64,
    /// Work on the contact, and what it has lost or booked as an error of integration, J.
    work: f64,
    lost: f64,
}

impl Contact {
    fn new(joint: Joint, bonded: bool) -> Self {
        let branch = Vec3::x() * 2.0;
        let state = JointedRockState::default();
        let mut contact =
            Self { law: law(joint), bonded, branch, state, force: Vec3::zeros(), stored: 0.0, work: 0.0, lost: 0.0 };
        assert_eq!(contact.step(Vec3::zeros()), Status::Lives);
        contact
    }

    /// Tangent of the joint in the plane of its normal and the line of the centers.
    fn along(&self) -> Vec3 {
        let n = self.normal();
        Vec3::new(-n.y, n.x, 0.0)
    }

    fn normal(&self) -> Vec3 {
        self.law.joint.unwrap().normal
    }

    /// B moves relative to A.
    fn step(&mut self, moved: Vec3) -> Status {
        let (before, now) = (self.branch, self.branch + moved);
        let previous = PreviousGeometry { normal: before.normalize(), length: before.norm() };
        let (normal, length) = (now.normalize(), now.norm());
        let kinematics = PointKinematics {
            geometry: GEOMETRY,
            length,
            length_old: previous.length,
            elongation: length - 2.0,
            elongation_old: previous.length - 2.0,
            gap: length - 2.0,
            normal,
            // Joints do not read it.
            shear_increment: Vec3::repeat(f64::NAN),
            arm_a: 0.5 * length,
            arm_b: 0.5 * length,
            bonded: self.bonded,
            transport: Transport::FirstOrder { swing: previous.normal.cross(&normal), twist: Vec3::zeros() },
        };
        let how = How::new(concordem::kinematics::MotionMeasure::Finite, 1e-3);
        let stepped = Stepped::of(&self.law, kinematics, &self.state, &how);
        let (response, wrenches) = (stepped.response, stepped.wrenches());
        let none = Vec3::zeros();
        assert_eq!((wrenches.a.torque, wrenches.b.torque), (none, none), "no torques");
        let alive = response.status == Status::Lives;
        self.work += 0.5 * (self.force + response.force).dot(&moved);
        self.lost += response.energy.dissipated() + response.energy.integration;
        assert!(response.energy.damage >= 0.0 && response.energy.friction >= 0.0);
        self.stored = if alive { response.energy.stored() } else { 0.0 };
        (self.force, self.state, self.branch) = (response.force, response.state, now);
        let last = if alive { self.law.last_force(&kinematics, &self.state).0 } else { Vec3::zeros() };
        near(&last, &self.force, "last force");
        response.status
    }

    /// Normal and shear force.
    fn forces(&self) -> [f64; 2] {
        [self.normal(), self.along()].map(|direction| self.force.dot(&direction))
    }
}

fn near(x: &Vec3, y: &Vec3, what: &str) {
    assert!((x - y).norm() <= 1e-12 * y.norm().max(1.0), "{what}: {x} {y}");
}

fn equal(x: f64, y: f64, scale: f64, what: &str) {
    assert!((x - y).abs() <= 1e-12 * scale, "{what}: {x:e} {y:e}");
}

/// Opening and sliding act apart, along the normal of the joint and in it, wherever the centers lie.
#[test]
fn springs_act_along_and_across_the_joint() {
    let mut contact = Contact::new(Joint { cohesion: 1e9, tensile_strength: 1e9, ..joint() }, true);
    let (n, t) = (contact.normal(), contact.along());
    contact.step(n * 0.01 + t * 0.02);
    contact.step(n * -0.05 + t * 0.03 + Vec3::z() * 0.01);
    near(&contact.force, &((n * -0.04) * NORMAL + (t * 0.05 + Vec3::z() * 0.01) * SHEAR), "force");
    equal(contact.stored, contact.work, contact.stored, "elastic work");
    // Forces do not depend on which particle is A.
    let swapped = contact.state.swapped();
    assert_eq!((swapped.shear_force, swapped.branch), (-contact.state.shear_force, -contact.state.branch));
}

/// Fifty directions of loading, up to where the closed form meets the tensile strength or the cone: just below the joint holds, just above
/// it cracks, in the mode that comes first.
#[test]
fn the_failure_envelope_is_a_cone_with_a_lid() {
    let (tension, cohesion) = (1e5 * GEOMETRY.area, 2e5 * GEOMETRY.area);
    let mut met = [0; 3];
    for direction in 0..50 {
        let (sine, cosine) = (std::f64::consts::PI * (f64::from(direction) + 0.5) / 50.0).sin_cos();
        let of_tension = if cosine > 0.0 { tension / cosine } else { f64::INFINITY };
        let slope = sine + 0.6 * cosine;
        let of_shear = if slope > 0.0 { cohesion / slope } else { f64::INFINITY };
        let at = |load: f64| {
            let mut contact = Contact::new(joint(), true);
            let moved = contact.normal() * (load * cosine / NORMAL) + contact.along() * (load * sine / SHEAR);
            (contact.step(moved), contact.state.crack)
        };
        let limit = of_tension.min(of_shear);
        if limit == f64::INFINITY {
            assert_eq!(at(1e7), (Status::Lives, 0.0));
            met[2] += 1;
            continue;
        }
        assert_eq!(at(limit * (1.0 - 1e-12)), (Status::Lives, 0.0), "direction {direction}");
        let cracked = if of_tension < of_shear {
            (Status::Broke, 0.0)
        } else if cosine < 0.0 {
            (Status::Lives, 1.0)
        } else {
            (Status::BrokeInShear, 0.0)
        };
        assert_eq!(at(limit * (1.0 + 1e-12)), cracked, "direction {direction}");
        met[usize::from(of_tension >= of_shear)] += 1;
    }
    assert_eq!(met, [15, 26, 9]);
}

/// Pressed, a joint keeps its cohesive limit in the step of the crack, then slides with its friction. Opened and closed again, the contact
/// begins without force, and has no cohesion. All work is stored or lost.
#[test]
fn a_cracked_joint_rubs_and_opens_and_closes_again() {
    let mut contact = Contact::new(joint(), true);
    let (n, t) = (contact.normal(), contact.along());
    contact.step(n * -0.1);
    let pressure = 0.1 * NORMAL;
    let limit = 2e5 * GEOMETRY.area + 0.6 * pressure;
    contact.step(t * (1.01 * limit / SHEAR));
    assert_eq!(contact.state.crack, 1.0);
    for (force, wanted) in contact.forces().into_iter().zip([-pressure, limit]) {
        equal(force, wanted, limit, "crack");
    }
    contact.step(Vec3::zeros());
    assert_eq!(contact.state.crack, 2.0);
    equal(contact.forces()[1], 0.6 * pressure, limit, "after the crack");
    contact.step(t * 0.01);
    equal(contact.forces()[1], 0.6 * pressure, limit, "friction");
    contact.step(n * 0.05 + t * 0.001);
    equal(contact.forces()[1], 0.3 * pressure, limit, "less pressure");
    assert_eq!(contact.step(n * 0.0501), Status::Broke);
    equal(contact.stored + contact.lost, contact.work, limit, "balance");

    let mut again = Contact { bonded: false, state: JointedRockState::default(), ..contact };
    again.step(n * -0.02);
    assert!(again.forces()[0].abs() < 1e-9, "a contact begins without force");
    again.step(n * -0.02 + t * 0.5);
    for (force, wanted) in again.forces().into_iter().zip([-0.02 * NORMAL, 0.6 * 0.02 * NORMAL]) {
        equal(force, wanted, NORMAL, "without cohesion");
    }
    assert_eq!(again.step(n * 0.03), Status::Opened);
}

/// While the faces slide at a constant distance, a slip `s` beyond the limit raises the pressure by `K_n A s tan ψ`, from the next step on.
#[test]
fn dilation_raises_the_pressure() {
    let dilation = 0.2;
    let mut contact = Contact::new(Joint { dilation, cohesion: 0.0, tensile_strength: 0.0, ..joint() }, true);
    contact.state.crack = 2.0;
    let (n, t) = (contact.normal(), contact.along());
    contact.step(n * -0.01);
    let to_limit = 0.6 * 0.01 * NORMAL / SHEAR;
    contact.step(t * (to_limit * 0.999));
    equal(contact.forces()[0], -0.01 * NORMAL, NORMAL, "below the limit nothing climbs");
    let mut slid = 0.0;
    for k in 0..20 {
        contact.step(t * 0.05);
        equal(contact.forces()[0], -(0.01 + dilation * slid) * NORMAL, NORMAL, "pressure");
        // Rising pressure stops the sliding where the spring of the shear force is not yet at its limit.
        if contact.forces()[1] >= -0.6 * contact.forces()[0] * (1.0 - 1e-12) {
            slid += 0.05;
        }
        assert!(k == 0 || slid > 0.0);
    }
    assert!(slid > 0.2);
    equal(contact.stored + contact.lost, contact.work, contact.work.abs().max(1.0), "balance");
}

/// After a slip of two radii the contact ends, although it presses.
#[test]
fn a_contact_ends_where_the_particles_have_passed_each_other() {
    let mut contact = Contact::new(joint(), true);
    let (n, t) = (contact.normal(), contact.along());
    contact.step(n * -0.1);
    let steps = (1..1_000_000).find(|_| contact.step(t * 0.15) != Status::Lives).unwrap();
    // 14 steps are longer than two radii of 1 m; the next one sees it.
    assert_eq!(steps, 15);
    equal(contact.stored + contact.lost, contact.work, contact.work.abs(), "balance");
}

/// Random motion: at any time the work is stored or lost, to rounding, whatever the joint does.
#[test]
fn all_work_is_stored_or_lost() {
    for (case, dilation) in [(0, 0.0), (1, 0.3)] {
        let mut contact = Contact::new(Joint { dilation, ..joint() }, true);
        let mut ends = 0;
        let mut scale = 0.0_f64;
        for k in 0..400 {
            let moved = Vec3::from_fn(|axis, _| 0.02 * noise(k, 3 * case + axis));
            ends += usize::from(contact.step(moved) != Status::Lives);
            if contact.state.rest == 0.0 {
                contact.bonded = false;
            }
            scale = scale.max(contact.work.abs()).max(contact.stored);
            equal(contact.stored + contact.lost, contact.work, 10.0 * scale, "balance");
        }
        assert!(ends >= 4, "{ends}");
    }
}

/// Off joints the law is that of bonds, to the last bit.
#[test]
fn off_joints_the_law_is_jointed() {
    let bond = Jointed::new(1e6, 0.4, 1e5, 1e5, 0.3).unwrap();
    let rock = JointedRock { bond, joint: None };
    let (mut ours, mut wanted) = (JointedRockState::default(), concordem::law::JointedState::default());
    let mut cracks = 0;
    for k in 0..200 {
        let [stretch, before] = [k, k + 1].map(|k| 0.05 * noise(k, 1) - 0.06);
        let kinematics = PointKinematics {
            geometry: GEOMETRY,
            length: 2.0 + stretch,
            length_old: 2.0 + before,
            elongation: stretch,
            elongation_old: before,
            gap: stretch,
            normal: Vec3::x(),
            shear_increment: Vec3::new(0.0, noise(k, 2), noise(k, 3)) * 0.2,
            arm_a: 1.0,
            arm_b: 1.0,
            bonded: true,
            transport: Transport::identity(Vec3::x()),
        };
        let (a, b) = (rock.respond(&kinematics, &ours, 1e-3), bond.respond(&kinematics, &wanted, 1e-3));
        assert_eq!((a.force, a.status, a.energy, a.state.crack), (b.force, b.status, b.energy, b.state.crack));
        assert_eq!(JointedRock::event(&a), Jointed::event(&b));
        assert_eq!(rock.acting(kinematics, &ours).arm_a, 1.0);
        cracks += usize::from(b.state.crack == 1.0);
        (ours, wanted) = (a.state, b.state);
    }
    assert_eq!(cracks, 1);
}
