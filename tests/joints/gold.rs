//! Smooth joints agree with YADE's JCFpm (`smoothJoint`).
//!
//! `golden/yade/make_joints_gold.py` ran Debian's YADE 2023.02a (2025.2.0 gives the same bytes). YADE takes slip from velocities, we take it
//! from positions, so the numbers differ by rounding.

use concordem::kinematics::sphere_sphere::{ImageShift, Motion, measure};
use concordem::kinematics::{ContactInput, MotionMeasure, PreviousGeometry};
use concordem::law::jointed::{Joint, Jointed, JointedRock, JointedRockState};
use concordem::law::{ContactGeometry, ContactLaw, Reference, Status};
use concordem::math::{Quat, Vec3};
use concordem::solver::Model;
use concordem::solver::integrate::Damping;
use concordem::solver::joints::{Joints, Mark};
use concordem::state::contacts::{ContactBlock, ContactFlags, Pair};
use concordem::state::{Constraint, Particles, Sphere, State};
use concordem_tests::gold::{Row, Table, read};
use concordem_tests::{on_threads, one_material, solver};
use std::collections::BTreeMap;

fn motion(row: &Row<'_>, number: u8) -> Motion {
    Motion {
        position: row.vector(&format!("x{number}")),
        velocity: row.vector(&format!("v{number}")),
        angular_velocity: row.vector(&format!("w{number}")),
        rotation_increment: Quat::identity(),
        orientation: Quat::identity(),
    }
}

/// The law of a case, with YADE's stiffnesses and limits of the contact.
fn law_of(case: &Row<'_>, normal: Vec3) -> JointedRock {
    let per_area = |column: &str| case.real(column) / case.real("area");
    let joint = Joint {
        normal,
        normal_stiffness: per_area("kn"),
        shear_stiffness: per_area("ks"),
        tensile_strength: per_area("fn_max"),
        cohesion: per_area("fs_max"),
        friction: case.real("tan_friction"),
        dilation: case.real("tan_dilation"),
    };
    joint.validate().unwrap();
    JointedRock { bond: Jointed::new(1e9, 0.25, 1e6, 2e6, 0.5).unwrap(), joint: Some(joint) }
}

#[derive(Clone, Copy)]
struct Contact {
    bonded: bool,
    geometry: ContactGeometry,
    previous: PreviousGeometry,
    state: JointedRockState,
}

/// The contact that begins in this step.
fn begun(case: &Row<'_>, row: &Row<'_>, [a, b]: [&Motion; 2]) -> Contact {
    let [radius_a, radius_b] = ["r1", "r2"].map(|column| case.real(column));
    let branch = b.position - a.position;
    let before = branch - (b.velocity - a.velocity) * case.real("dt");
    let Reference { length, area } = JointedRock::unbonded_reference(branch.norm(), radius_a, radius_b);
    let geometry = ContactGeometry { reference_length: length, area, radius_a, radius_b, mass_a: 1.0, mass_b: 1.0 };
    // As all contacts of the first step; those without strength are cracked from the start.
    let bonded = row.flag("cohesive");
    let previous = PreviousGeometry { normal: before.normalize(), length: before.norm() };
    Contact { bonded, geometry, previous, state: JointedRockState::default() }
}

/// Fourteen paths of two spheres: forces within 2e-12 of the largest one of the path, distances within 1e-12 of the radius. Openings are a
/// thousandth of the lengths, whose last bit is 2e-16; where the spheres have a gap, that makes 9e-13 of the largest force.
#[test]
fn two_spheres_follow_yade() {
    let tables = read("joints.bin");
    let cases: Vec<&str> = tables.keys().filter_map(|name| name.strip_suffix(".steps")).collect();
    assert_eq!(cases.len(), 14);
    let (mut worst, mut all) = (0.0_f64, [0; 5]);
    for case in cases {
        let table = |part: &str| &tables[&format!("{case}.{part}")];
        let gold = table("case").row(0);
        let law = law_of(&gold, table("joint").row(0).vector("normal"));
        let forces = |row: &Row<'_>| -row.vector("normal_force") - row.vector("shear_force");
        let scale = table("steps").rows().map(|row| forces(&row).norm()).fold(0.0, f64::max);
        let mut contact: Option<Contact> = None;
        let mut cracks = [0; 2];
        for (number, row) in table("steps").rows().enumerate() {
            let place = format!("{case}, step {number}");
            let (a, b) = (motion(&row, 1), motion(&row, 2));
            if row.flag("fresh") {
                contact = Some(begun(&gold, &row, [&a, &b]));
            }
            let Some(Contact { bonded, geometry, previous, state: old }) = contact else {
                assert!(!row.flag("alive"), "{place}: a contact without beginning");
                continue;
            };
            let (image, previous) = (&ImageShift::default(), &previous);
            let input =
                ContactInput { a: &a, b: &b, image, geometry: &geometry, previous, bonded, dt: gold.real("dt") };
            let k = measure(MotionMeasure::YadeRatcheting, &input);
            let response = law.respond(&k, &old, input.dt);
            let whole = bonded && old.crack == 0.0;
            assert_eq!(response.status == Status::Lives, row.flag("alive"), "{place}: {:?}", response.status);
            all[0] += 1;
            if response.status != Status::Lives {
                let in_shear = response.status == Status::BrokeInShear;
                cracks[usize::from(in_shear)] += u32::from(whole);
                all[1] += usize::from(!whole);
                contact = None;
                continue;
            }
            let error = (response.force - forces(&row)).norm() / scale;
            worst = worst.max(error);
            assert!(error < 2e-12, "{place}: force {} instead of {}, {error:e}", response.force, forces(&row));
            for (ours, yades) in [(response.state.rest, row.real("rest")), (response.state.slip, row.real("slip"))] {
                assert!((ours - yades).abs() < 1e-12 * geometry.radius_a, "{place}: {ours:e} {yades:e}");
            }
            let cohesive = bonded && response.state.crack == 0.0;
            assert_eq!(cohesive, row.flag("cohesive"), "{place}: cohesive");
            cracks[1] += u32::from(whole && !cohesive);
            all[2] += usize::from(response.energy.friction + response.energy.damage > 0.0);
            all[3] += usize::from(response.state.dilation > 0.0);
            let previous = PreviousGeometry { normal: k.normal, length: k.length };
            contact = Some(Contact { bonded, geometry, previous, state: response.state });
        }
        assert_eq!(cracks.map(f64::from), [gold.real("tensile"), gold.real("shear")], "{case}: cracks");
        all[4] += (cracks[0] + cracks[1]) as usize;
    }
    println!("steps, ends, slips, dilations, cracks: {all:?}; forces within {worst:.1e}");
    assert!(all[0] > 2500 && all[1] > 100 && all[2] > 500 && all[3] > 100 && all[4] == 9, "{all:?}");
}

/// The specimen of a run in YADE's initial state; and the particles of its lower and upper end.
fn specimen(gold: &BTreeMap<String, Table>, run: &str) -> (State, Model, [Vec<usize>; 2]) {
    let setup = gold[&format!("{run}.setup")].row(0);
    let real = |column: &str| setup.real(column);
    let (mut particles, mut ends, mut marks) = (Particles::default(), [Vec::new(), Vec::new()], Vec::new());
    for (p, row) in gold[&format!("{run}.initial")].rows().enumerate() {
        let position = Vec3::new(row.real("x"), row.real("y"), row.real("z"));
        particles.push(Sphere { position, radius: row.real("r") }, 0, row.real("mass"), row.real("inertia"));
        particles.velocity[p] = row.vector("v");
        let (end, side) = (row.real("end"), row.real("side"));
        if end != 0.0 {
            particles.constraint[p] = Constraint::translation_along(2).with(Constraint::ROTATION);
            ends[usize::from(end > 0.0)].push(p);
        }
        if side != 0.0 {
            marks.push((p as u32, Mark { joint: 0, in_front: side > 0.0, row: 1 }));
        }
    }
    let rock =
        Jointed::new(real("young"), real("poisson"), real("tensile_strength"), real("cohesion"), real("tan_friction"));
    let rock = Jointed { residual_friction: real("tan_residual"), ..rock.unwrap() };
    let joint = Joint {
        normal: setup.vector("normal"),
        normal_stiffness: real("joint_kn"),
        shear_stiffness: real("joint_ks"),
        tensile_strength: real("joint_tensile_strength"),
        cohesion: real("joint_cohesion"),
        friction: real("joint_tan_friction"),
        dilation: real("joint_tan_dilation"),
    };
    let rows = vec![JointedRock { bond: rock, joint: None }, JointedRock { bond: rock, joint: Some(joint) }];
    let joints = Joints::new(marks, vec![0]);
    let mut bonds = ContactBlock::new(rows.clone());
    let mut on_joint = Vec::new();
    for row in gold[&format!("{run}.bonds")].rows() {
        let ids = [row.real("id1") as u32, row.real("id2") as u32];
        let (a, b) = (ids[0].min(ids[1]), ids[0].max(ids[1]));
        let l = particles.position[b as usize] - particles.position[a as usize];
        let [radius_a, radius_b] = [a, b].map(|p| particles.radius[p as usize]);
        let reference = JointedRock::unbonded_reference(l.norm(), radius_a, radius_b);
        let bits = ContactFlags::BONDED | ContactFlags::ACTIVE;
        // YADE counts slip at the velocities before the first step, too: as if the spheres had come from there.
        let before = l - (particles.velocity[b as usize] - particles.velocity[a as usize]) * real("dt");
        let before = if row.flag("on_joint") { before } else { l };
        let previous = PreviousGeometry { normal: before.normalize(), length: before.norm() };
        bonds.push(Pair { a, b }, ContactFlags { bits, ..ContactFlags::default() }, reference, previous);
        if row.flag("on_joint") {
            on_joint.push(bonds.len() - 1);
        }
    }
    assert_eq!(joints.assign(&mut bonds, &particles), on_joint, "{run}");
    for &k in on_joint.iter().filter(|_| !joint.is_cohesive()) {
        bonds.history.set(k, JointedRockState { crack: 2.0, ..JointedRockState::default() });
        bonds.flags[k].bits |= ContactFlags::REPORTED;
    }
    let mut state = State { particles, bonds: vec![Box::new(bonds)], ..State::default() };
    state.contacts = Some(Box::new(ContactBlock::new(rows)));
    state.clock.dt = real("dt");
    let damping = Damping::Local { translation: real("damping"), rotation: real("damping") };
    let mode = MotionMeasure::YadeRatcheting;
    (state, Model { mode, damping, contact_rows: one_material(), joints, ..Model::default() }, ends)
}

/// A thousand spheres with a joint across, which slips and dilates, cracks under pressure, or opens: every crack in its step of ten and its
/// mode, and the forces on the ends, are those of YADE. Sums over the contacts of a particle are taken in another order, so the runs differ
/// by rounding, which cracks amplify: as without joints, 2e-10 of the largest force.
#[test]
fn specimens_follow_yade() {
    let gold = read("joints.bin");
    for (run, least) in [("slipping", [0.0, 0.0]), ("cracking", [50.0, 50.0]), ("opening", [100.0, 0.0])] {
        let (mut state, model, ends) = specimen(&gold, run);
        let (mut scale, mut worst) = (0.0_f64, 0.0_f64);
        let mut cracks = [0.0; 2];
        on_threads(1, || {
            let mut solver = solver(model, &mut state);
            for row in gold[&format!("{run}.curve")].rows() {
                let step = row.real("step") as u64;
                while state.clock.step <= step {
                    let report = solver.step_with(&mut state, false).unwrap();
                    for (_, event) in report.bond_events.iter().filter(|(_, event)| event.fails) {
                        cracks[usize::from(event.stored[1] > 0.0)] += 1.0;
                    }
                }
                let yades = ["force_low", "force_high"].map(|column| row.real(column));
                let ours = [0, 1].map(|end: usize| ends[end].iter().map(|&p| solver.forces()[p].z).sum::<f64>());
                scale = scale.max(yades[0].abs()).max(yades[1].abs());
                worst = worst.max((ours[0] - yades[0]).abs().max((ours[1] - yades[1]).abs()) / scale);
                assert_eq!(cracks, ["tensile", "shear"].map(|column| row.real(column)), "{run}, step {step}: cracks");
                assert!(worst < 2e-10, "{run}, step {step}: {ours:?} {yades:?}, {worst:e}");
            }
        });
        println!("{run}: forces within {worst:.1e}, cracks {cracks:?}");
        assert!(cracks[0] >= least[0] && cracks[1] >= least[1], "{run}: {cracks:?}");
    }
}
