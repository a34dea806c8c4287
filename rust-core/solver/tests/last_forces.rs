//! Forces of a step that has been evaluated, which hosts ask for between two steps.

use concordem_contact::kinematics::deformable::{Condition, Deformable, Update};
use concordem_contact::kinematics::{MotionMeasure, sphere_sphere};
use concordem_contact::law::cpm::CpmFormulation;
use concordem_contact::law::{
    BeamModel, CohesiveBeam, ContactLaw, ContactStiffness, Cpm, CpmParameters, Elastic, Frictional, HertzMindlin,
    LinearBond, Reference, Section,
};
use concordem_contact::math::{Vec3, quaternion_of_rotation_vector};
use concordem_solver::forces::LawLoops;
use concordem_solver::integrate::{Damping, KickContext, NetForces};
use concordem_solver::neighbor::candidate_pairs;
use concordem_solver::record::ContactForces;
use concordem_solver::state::contacts::{ContactBlock, ContactFlags, Pair};
use concordem_solver::state::{Cell, Particles, Sphere, State};
use concordem_solver::{Model, PairCoefficients, Solver, integrate};

/// 125 touching unit spheres with bonds to neighbors within 1.5 diameters, and contacts for those that break.
fn block<B: LawLoops, C: LawLoops>(bond: B, contact: C, cell: Option<&Cell>, speed: f64) -> State {
    let mut particles = Particles::default();
    for k in 0..125_usize {
        let position = Vec3::new((k % 5) as f64, (k / 5 % 5) as f64, (k / 25) as f64) * 2.0;
        particles.push(Sphere { position, radius: 1.0 }, 0, 1.0, 0.4);
    }
    for p in 0..125_usize {
        let u = |m: usize| ((p * 7919 + m * 104_729) % 1000) as f64 / 500.0 - 1.0;
        particles.velocity[p] = Vec3::new(u(1), u(2), u(3)) * speed;
        particles.angular_velocity[p] = Vec3::new(u(4), u(5), u(6)) * (2.0 * speed);
    }
    let mut bonds = ContactBlock::new(vec![bond]);
    for pair in candidate_pairs(&particles.position, &[1.5; 125], cell).unwrap() {
        let shift = cell.map_or(Vec3::zeros(), |cell| cell.shift(pair.image));
        let [a, b] = [pair.a, pair.b].map(|p| &particles.position[p as usize]);
        let previous = sphere_sphere::initial_geometry(a, b, &shift);
        let bits = ContactFlags::BONDED | ContactFlags::ACTIVE;
        let flags = ContactFlags { row: 0, bits, image: pair.image, padding: 0 };
        bonds.push(Pair { a: pair.a, b: pair.b }, flags, Reference { length: previous.length, area: 1.0 }, previous);
    }
    let contacts = Some(Box::new(ContactBlock::new(vec![contact])) as Box<_>);
    State { particles, bonds: vec![Box::new(bonds)], contacts, cell: cell.copied(), ..State::default() }
}

/// Rows of contacts that live, with their forces and moments.
fn rows(forces: &ContactForces) -> Vec<([u32; 2], u32, Vec3, Vec3, Vec3)> {
    let c = forces;
    (0..c.pair.len()).map(|k| (c.pair[k], c.place[k], c.force[k], c.moment[k], c.branch[k])).collect()
}

/// A host steps the block. Before every step, `record` gives the forces that the step will compute, and afterwards `last_forces`
/// must give the same ones: rounding of a return to the yield surface, of a rotation by nothing, and of roots, some 1e-15.
fn last_forces_are_those_of_the_step<B: LawLoops, C: LawLoops>(
    name: &str,
    bond: B,
    contact: C,
    model: Model,
    cell: bool,
) {
    let mut contact_rows = PairCoefficients::new(1);
    contact_rows.set(0, 0, 0);
    let model = Model { contact_rows, ..model };
    let mut cell = cell.then(|| Cell::new_box(Vec3::repeat(10.0)));
    let speed = if B::NAME == LinearBond::NAME { 0.1 } else { 0.15 };
    let mut state = block(bond, contact, cell.as_ref(), speed);
    state.clock.dt = 0.1;
    let mut solver = Solver::new(model, &mut state).unwrap();
    let (mut worst, mut broken, mut touching, mut late) = (0.0_f64, 0, 0, 0.0_f64);
    for step in 0..60 {
        let expected = rows(&solver.record(&mut state).unwrap().contacts);
        let report = solver.find_forces(&mut state, false).unwrap();
        broken += report.bond_events.iter().filter(|(_, event)| event.broke).count();
        let found = rows(&solver.last_forces(&state).contacts);
        let next = rows(&solver.record(&mut state).unwrap().contacts);
        // Bonds that broke have left the block, so places are those of the step only if none did.
        let same_places = !report.bonds_broke();
        assert_eq!(found.len(), expected.len(), "{name}, step {step}");
        // At first there are no forces.
        let scale = expected.iter().map(|row| row.2.norm()).fold(0.1, f64::max);
        for (a, b) in found.iter().zip(&expected) {
            assert_eq!((a.0, a.4), (b.0, b.4), "{name}, step {step}");
            assert!(!same_places || a.1 == b.1);
            worst = worst.max((a.2 - b.2).norm().max((a.3 - b.3).norm()) / scale);
        }
        late = late.max(next.iter().zip(&expected).map(|(a, b)| (a.2 - b.2).norm()).fold(0.0, f64::max) / scale);
        touching += found.len() - state.bond_count();
        let mut net = vec![Vec3::zeros(); 125];
        for (pair, _, force, ..) in &found {
            net[pair[0] as usize] += force;
            net[pair[1] as usize] -= force;
        }
        for (sum, force) in net.iter().zip(solver.forces()) {
            // Some ten forces on a particle.
            assert!((sum - force).norm() <= 1e-13 * scale, "{name}, step {step}: {sum} {force}");
        }
        state.clock.step += 1;
        if let Some(cell) = &mut cell {
            cell.velocity_gradient = concordem_contact::math::Mat3::new(0.0, 0.01, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, -0.02);
            cell.matrix_change = cell.velocity_gradient * cell.matrix * 0.1;
            cell.matrix += cell.matrix_change;
            state.cell = Some(*cell);
        }
        let kick = KickContext {
            dt: 0.1,
            fraction: 1.0,
            gravity: Vec3::zeros(),
            damping: Damping::None,
            cell: None,
            gradient_change: None,
            convective: false,
            targets: None,
        };
        let net = NetForces { force: solver.forces(), torque: solver.torques() };
        integrate::kick_and_drift(&kick, &mut state.particles, net);
        for p in 0..125 {
            state.particles.rotation_increment[p] =
                quaternion_of_rotation_vector(&(state.particles.angular_velocity[p] * 0.1));
        }
    }
    println!("{name}: {worst:.1e} (one step later {late:.1e}), {broken} broken, {touching} contacts");
    assert!(broken > 10 && touching > 10, "{name}: {broken} broken, {touching} contacts, which tests little");
    assert!(worst < 1e-12, "{name}: {worst:e}");
    assert!(late > 1e-6, "{name}: the forces of the next step are not distinguished");
}

#[test]
fn last_forces_are_those_that_were_summed() {
    let friction = Frictional::new(ContactStiffness::Given { normal: 1.0, shear: 0.4 }, 0.5, 0.2).unwrap();
    let soft = Elastic { young: 0.5, poisson: 0.3 };
    let hertz = HertzMindlin { shear_damping_ratio: 0.1, ..HertzMindlin::new(soft, soft, 0.4, 0.6).unwrap() };
    let linear = LinearBond::new(1.0, 0.4, 0.1, 0.03, 0.03).unwrap();
    let plain = CpmParameters { omega_threshold: 0.9, ..CpmParameters::new(2.0, 0.4, 0.03, 0.6, 0.002, 1.5) };
    let of_yade = CpmParameters { mode: CpmFormulation::YadePublic, soft_strain: -0.01, ..plain };
    let viscous = CpmParameters { damage_time: 1.0, plasticity_time: 1.0, soft_strain: -0.01, ..plain };
    let woo = CpmParameters { mode: CpmFormulation::Woo, ..viscous };
    let beam = CohesiveBeam { strength: 0.09, ..CohesiveBeam::new(2.0, 0.2, Section::Radius(0.5)).unwrap() };
    let timoshenko = CohesiveBeam { model: BeamModel::Timoshenko { shear_coefficient: 0.9 }, ..beam };
    let model = |mode| Model { mode, ..Model::default() };
    for cell in [false, true] {
        for mode in
            [MotionMeasure::Finite, MotionMeasure::FirstOrder, MotionMeasure::Yade, MotionMeasure::YadeRatcheting]
        {
            last_forces_are_those_of_the_step("linear bonds", linear, friction, model(mode), cell);
            last_forces_are_those_of_the_step("linear bonds, Hertz", linear, hertz, model(mode), cell);
            for (name, parameters) in [("cpm", plain), ("YADE's", of_yade), ("viscous", viscous), ("woo", woo)] {
                let law = Cpm::new(&parameters).unwrap();
                last_forces_are_those_of_the_step(name, law, law, model(mode), cell);
            }
        }
        for (name, law) in [("beams", beam), ("Timoshenko beams", timoshenko)] {
            last_forces_are_those_of_the_step(name, law, friction, Model::default(), cell);
        }
        let deformable = Deformable {
            elasticity: vec![Elastic { young: 4.0, poisson: 0.3 }],
            condition: Condition::Solid,
            update: Update::Lagged,
            dashpots: true,
        };
        let model = Model { deformable: Some(deformable), ..Model::default() };
        last_forces_are_those_of_the_step("deformable particles", linear, friction, model, cell);
    }
}
