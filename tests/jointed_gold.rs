//! The law `jointed` agrees with YADE's JCFpm bit for bit.
//!
//! `golden/yade/make_jointed_gold.py` ran Debian's YADE 2023.02a (2025.2.0 gives the same bytes) and recorded every input and output of
//! `Law2_ScGeom_JCFpmPhys_JointedCohesiveFrictionalPM` and of the geometry functor before it. These tests apply our kinematics and law to
//! the same positions, velocities, and rates. "Equal" means the same 64 bits; only whole specimens have a tolerance.

use concordem::kinematics::sphere_sphere::{ImageShift, Motion, measure};
use concordem::kinematics::{ContactInput, MotionMeasure, PreviousGeometry};
use concordem::law::jointed::{Jointed, JointedState};
use concordem::law::{ContactGeometry, ContactLaw, Reference, Response, Status};
use concordem::math::{Quat, Vec3, yade_order};
use concordem::solver::Model;
use concordem::solver::integrate::Damping;
use concordem::state::contacts::{ContactBlock, ContactFlags, Pair};
use concordem::state::{Constraint, Particles, Sphere, State};
use concordem_tests::gold::{Row, Table, read};
use concordem_tests::{on_threads, one_material, solver};
use std::collections::BTreeMap;

/// Asserts that two numbers are equal in every bit; `place` locates a difference. A zero may have either sign.
fn same(ours: f64, yades: f64, what: &str, place: &str) {
    let equal = ours.to_bits() == yades.to_bits() || ours == 0.0 && yades == 0.0;
    assert!(equal, "{place}: {what} is {ours:e}, YADE has {yades:e}");
}

fn same_vector(ours: &Vec3, yades: &Vec3, what: &str, place: &str) {
    for axis in 0..3 {
        same(ours[axis], yades[axis], &format!("{what}[{axis}]"), place);
    }
}

fn motion(row: &Row<'_>, number: u8) -> Motion {
    Motion {
        position: row.vector(&format!("x{number}")),
        velocity: row.vector(&format!("v{number}")),
        angular_velocity: row.vector(&format!("w{number}")),
        // YADE's measure does not read them.
        rotation_increment: Quat::identity(),
        orientation: Quat::identity(),
    }
}

/// A contact of YADE, and what our law knows of it.
#[derive(Clone, Copy)]
struct Contact {
    bonded: bool,
    geometry: ContactGeometry,
    previous: PreviousGeometry,
    state: JointedState,
}

/// What a test has met.
#[derive(Debug, Default)]
struct Coverage {
    steps: usize,
    slips: usize,
    cracks: [u32; 2],
    opened: usize,
    without_bond: usize,
}

/// The law between the two materials of a case.
fn law_of(materials: &Table, case: &Row<'_>) -> Jointed {
    let [a, b] = [0, 1].map(|k| materials.row(k));
    let smaller = |column: &str| a.real(column).min(b.real(column));
    Jointed {
        young_a: a.real("young"),
        young_b: b.real("young"),
        stiffness_ratio_a: a.real("poisson"),
        stiffness_ratio_b: b.real("poisson"),
        tensile_strength: smaller("tensile_strength"),
        cohesion: smaller("cohesion"),
        friction: case.real("tan_friction"),
        residual_friction: case.real("tan_residual"),
    }
}

/// The contact that begins in this step, with YADE's stiffnesses and limits.
fn begun(law: &Jointed, case: &Row<'_>, row: &Row<'_>, branch: &Vec3, place: &str) -> Contact {
    let [radius_a, radius_b] = ["r1", "r2"].map(|column| case.real(column));
    let length = yade_order::norm(branch);
    let Reference { length: reference_length, area } = Jointed::unbonded_reference(length, radius_a, radius_b);
    let geometry = ContactGeometry { reference_length, area, radius_a, radius_b, mass_a: 1.0, mass_b: 1.0 };
    let bonded = row.flag("cohesive");
    let stiffness = law.stiffness(&geometry);
    same(stiffness.normal, case.real("kn"), "kn", place);
    same(stiffness.shear, case.real("ks"), "ks", place);
    if bonded {
        same(law.tensile_strength * area, case.real("fn_max"), "FnMax", place);
        same(law.cohesion * area, case.real("fs_max"), "FsMax", place);
    }
    let previous = PreviousGeometry { normal: branch / length, length };
    Contact { bonded, geometry, previous, state: JointedState::default() }
}

#[test]
fn two_spheres_bit_for_bit() {
    let tables = read("jointed.bin");
    let mut all = Coverage::default();
    let cases: Vec<&str> = tables.keys().filter_map(|name| name.strip_suffix(".steps")).collect();
    assert_eq!(cases.len(), 17);
    for case in cases {
        let table = |part: &str| &tables[&format!("{case}.{part}")];
        let gold = table("case").row(0);
        let law = law_of(table("materials"), &gold);
        let dt = gold.real("dt");
        let mode = if gold.flag("ratcheting") { MotionMeasure::YadeRatcheting } else { MotionMeasure::Yade };
        let mut contact: Option<Contact> = None;
        let mut cracks = [0; 2];
        for (number, row) in table("steps").rows().enumerate() {
            let place = format!("{case}, step {number}");
            let (a, b) = (motion(&row, 1), motion(&row, 2));
            if row.flag("fresh") {
                contact = Some(begun(&law, &gold, &row, &(b.position - a.position), &place));
            }
            let Some(Contact { bonded, geometry, previous, state: old }) = contact else {
                assert!(!row.flag("alive"), "{place}: a contact without beginning");
                continue;
            };
            let (image, previous) = (&ImageShift::default(), &previous);
            let input = ContactInput { a: &a, b: &b, image, geometry: &geometry, previous, bonded, dt };
            let k = measure(mode, &input);
            let Response { force, state, status, energy, .. } = law.respond(&k, &old, dt);
            all.steps += 1;
            all.without_bond += usize::from(!bonded);
            assert_eq!(status == Status::Lives, row.flag("alive"), "{place}: {status:?}");
            let whole = bonded && old.crack == 0.0;
            if status != Status::Lives {
                let in_shear = status == Status::BrokeInShear;
                assert_eq!(status.is_broken(), bonded, "{place}: {status:?}");
                assert_eq!(in_shear, energy.stored_shear > 0.0, "{place}");
                cracks[usize::from(in_shear)] += u32::from(whole);
                all.opened += usize::from(!whole);
                contact = None;
                continue;
            }
            same(-k.gap, row.real("penetration"), "penetration", &place);
            same_vector(&k.normal, &row.vector("normal"), "normal", &place);
            same_vector(&k.shear_increment, &row.vector("shear_increment"), "shear increment", &place);
            same_vector(&force, &(-row.vector("normal_force") - row.vector("shear_force")), "force", &place);
            same_vector(&state.shear_force, &-row.vector("shear_force"), "shear force", &place);
            let cohesive = bonded && state.crack == 0.0;
            assert_eq!(cohesive, row.flag("cohesive"), "{place}: cohesive");
            cracks[1] += u32::from(whole && !cohesive);
            all.slips += usize::from(energy.friction + energy.damage > 0.0);
            let previous = PreviousGeometry { normal: k.normal, length: k.length };
            contact = Some(Contact { bonded, geometry, previous, state });
        }
        assert_eq!(cracks.map(f64::from), [gold.real("tensile"), gold.real("shear")], "{case}: cracks");
        all.cracks = [0, 1].map(|mode| all.cracks[mode] + cracks[mode]);
    }
    println!("{all:?}");
    assert!(all.steps > 2000 && all.slips > 500 && all.opened > 30 && all.without_bond > 400, "{all:?}");
    assert!(all.cracks[0] >= 3 && all.cracks[1] >= 9, "{all:?}");
}

/// The specimen of a run in YADE's initial state, with YADE's bonds; and the particles of its lower and upper end.
fn specimen(gold: &BTreeMap<String, Table>, run: &str) -> (State, Model, [Vec<usize>; 2]) {
    let setup = gold[&format!("{run}.setup")].row(0);
    let mut particles = Particles::default();
    let mut ends = [Vec::new(), Vec::new()];
    for (p, row) in gold[&format!("{run}.initial")].rows().enumerate() {
        let position = Vec3::new(row.real("x"), row.real("y"), row.real("z"));
        particles.push(Sphere { position, radius: row.real("r") }, 0, row.real("mass"), row.real("inertia"));
        particles.velocity[p] = row.vector("v");
        let end = row.real("end");
        if end != 0.0 {
            particles.constraint[p] = Constraint::translation_along(2).with(Constraint::ROTATION);
            ends[usize::from(end > 0.0)].push(p);
        }
    }
    let real = |column: &str| setup.real(column);
    let friction = real("tan_friction");
    let rock =
        Jointed::new(real("young"), real("poisson"), real("tensile_strength"), real("cohesion"), friction).unwrap();
    let rock = Jointed { residual_friction: real("tan_residual"), ..rock };
    let mut bonds = ContactBlock::new(vec![rock]);
    for row in gold[&format!("{run}.bonds")].rows() {
        let ids = [row.real("id1") as u32, row.real("id2") as u32];
        let (a, b) = (ids[0].min(ids[1]), ids[0].max(ids[1]));
        let l = particles.position[b as usize] - particles.position[a as usize];
        let length = yade_order::norm(&l);
        // YADE's penetration depth is a difference from the sum of the radii.
        assert!((length / row.real("length") - 1.0).abs() < 1e-15, "{a} {b}");
        let [radius_a, radius_b] = [a, b].map(|p| particles.radius[p as usize]);
        let area = Jointed::unbonded_reference(length, radius_a, radius_b).area;
        let bits = ContactFlags::BONDED | ContactFlags::ACTIVE;
        let link = ContactFlags { bits, ..ContactFlags::default() };
        bonds.push(Pair { a, b }, link, Reference { length, area }, PreviousGeometry { normal: l / length, length });
    }
    let mut state = State { particles, bonds: vec![Box::new(bonds)], ..State::default() };
    state.contacts = Some(Box::new(ContactBlock::new(vec![rock])));
    state.clock.dt = setup.real("dt");
    let damping = Damping::Local { translation: real("damping"), rotation: real("damping") };
    let mode = MotionMeasure::YadeRatcheting;
    (state, Model { mode, damping, contact_rows: one_material(), ..Model::default() }, ends)
}

/// A thousand spheres, pulled and pressed beyond the peak, to half of it: every crack in its step of ten and its mode, and the forces on the
/// ends, are those of YADE. Sums over the contacts of a particle are taken in another order, so the runs differ by rounding: the forces by
/// 5e-12 of the largest one until the peak, and by 2.4e-11 to the end. The bounds are about ten times that, because cracks amplify it.
#[test]
fn specimens_follow_yade_beyond_the_peak() {
    let gold = read("jointed.bin");
    for (run, least) in [("tension", [200.0, 0.0]), ("compression", [1500.0, 100.0])] {
        let (mut state, model, ends) = specimen(&gold, run);
        let curve: Vec<Row<'_>> = gold[&format!("{run}.curve")].rows().collect();
        let size = |row: &Row<'_>| row.real("force_low").abs();
        let peak = curve.iter().max_by(|a, b| size(a).total_cmp(&size(b))).expect("a curve").real("step");
        let (mut scale, mut until_peak, mut to_the_end) = (0.0_f64, 0.0_f64, 0.0_f64);
        let mut cracks = [0.0; 2];
        on_threads(1, || {
            let mut solver = solver(model, &mut state);
            for row in &curve {
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
                let error = (ours[0] - yades[0]).abs().max((ours[1] - yades[1]).abs()) / scale;
                to_the_end = to_the_end.max(error);
                if row.real("step") <= peak {
                    until_peak = to_the_end;
                }
                assert_eq!(cracks, ["tensile", "shear"].map(|column| row.real(column)), "{run}, step {step}: cracks");
            }
        });
        println!("{run}: peak at step {peak}, forces until then within {until_peak:.1e}, to the end {to_the_end:.1e}");
        assert!(until_peak < 5e-11 && to_the_end < 2e-10, "{run}: {until_peak:e} {to_the_end:e}");
        assert!(cracks[0] > least[0] && cracks[1] >= least[1], "{run}: {cracks:?}");
    }
}
