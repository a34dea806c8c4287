//! Contacts in columns give the bits of the scalar path.

use concordem_contact::kinematics::MotionMeasure;
use concordem_contact::kinematics::deformable::{Condition, Deformable, Update};
use concordem_contact::law::cpm::CpmFormulation;
use concordem_contact::law::{
    BeamModel, BendingTerm, CohesiveBeam, ContactLaw as _, ContactStiffness, Cpm, CpmParameters, Elastic, Frictional,
    HertzMindlin, LinearBond, Section, ShearStrength,
};
use concordem_contact::math::{Mat3, Vec3, quaternion_of_rotation_vector};
use concordem_solver::forces::LawLoops;
use concordem_solver::state::columns::{ColumnData, ColumnStore};
use concordem_solver::state::contacts::{ContactBlock, Contacts};
use concordem_solver::state::{Cell, Sphere, State};
use concordem_solver::{Model, PairCoefficients, Solver};

use super::block_of;

/// Sampled steps take the scalar path, other steps evaluate contacts in columns. Both give the same bits, for all laws
/// and measures, in two tiles, with pair coefficients that change, rotated bodies, and bonds that break. The last step
/// is sampled in both runs, so that the ledgers are equal.
fn columns_match_the_scalar_path<L: LawLoops>(
    name: &str,
    rows: &[L],
    mode: MotionMeasure,
    periodic: bool,
    turned: bool,
) {
    columns_match_the_scalar_path_in(name, rows, None, &Model { mode, ..Model::default() }, periodic, turned);
}

/// Whether two states have the same bits; `==` of their columns takes 0 for -0.
fn same_bits(one: &ColumnStore, other: &ColumnStore) -> bool {
    let bits = |data: &ColumnData| match data {
        ColumnData::F64(numbers) => numbers.iter().map(|number| number.to_bits()).collect(),
        _ => Vec::new(),
    };
    one == other && one.iter().zip(other.iter()).all(|((_, a), (_, b))| bits(&a.data) == bits(&b.data))
}

/// Replace the parameters of all contacts.
fn replace_rows<L: LawLoops>(contacts: &mut dyn Contacts, law: L) {
    contacts.as_any_mut().downcast_mut::<ContactBlock<L>>().unwrap().rows.fill(law);
}

/// `later`: the law of all contacts from the 20th step on.
fn columns_match_the_scalar_path_in<L: LawLoops>(
    name: &str,
    rows: &[L],
    later: Option<L>,
    model: &Model,
    periodic: bool,
    turned: bool,
) {
    let size = if L::NAME == LinearBond::NAME { 0.04 } else { 0.08 };
    let run = |sampled: bool| {
        let mut state = block_of(11, rows.to_vec(), periodic);
        let particles = &mut state.particles;
        for p in 0..particles.len() {
            let u = |m: usize| ((p * 7919 + m * 104_729) % 1000) as f64 / 500.0 - 1.0;
            particles.velocity[p] = Vec3::new(u(1), u(2), u(3)) * size;
            particles.angular_velocity[p] = Vec3::new(u(4), u(5), u(6)) * (2.5 * size);
            if turned && p % 3 > 0 {
                particles.orientation[p] = quaternion_of_rotation_vector(&Vec3::new(u(7), 2.0 * u(8), 3.0 * u(9)));
            }
        }
        state.clock.dt = 0.1;
        let mut solver = Solver::new(model.clone(), &mut state).unwrap();
        let (bonds, mut broken) = (state.bond_count(), 0);
        for step in 0..50 {
            if let (20, Some(law)) = (step, later) {
                replace_rows(&mut *state.bonds[0], law);
            }
            let report = solver.step_with(&mut state, sampled || step == 49).unwrap();
            broken += report.bond_events.iter().filter(|(_, bond_event)| bond_event.broke).count();
        }
        assert!((10..bonds * 9 / 10).contains(&broken), "{name}: {broken} of {bonds} broke, which tests little");
        ColumnStore::of(&state).unwrap()
    };
    let mode = model.mode;
    assert!(same_bits(&run(true), &run(false)), "{name}, {mode:?}, periodic {periodic}, turned {turned}");
}

#[test]
fn columns_give_the_bits_of_the_scalar_path() {
    let every = [MotionMeasure::Finite, MotionMeasure::FirstOrder, MotionMeasure::Yade, MotionMeasure::YadeRatcheting];
    let linear = LinearBond::new(1.0, 0.4, 0.1, 0.03, 0.03).unwrap();
    let concrete = CpmParameters { omega_threshold: 0.9, ..CpmParameters::new(2.0, 0.4, 0.03, 0.6, 0.002, 1.5) };
    let of_yade = CpmParameters { mode: CpmFormulation::YadePublic, ..concrete };
    let beam = CohesiveBeam { strength: 0.09, ..CohesiveBeam::new(2.0, 0.2, Section::Radius(0.5)).unwrap() };
    let larger_end = CohesiveBeam { bending_term: BendingTerm::LargerEnd, strength: 0.2, ..beam };
    let model = BeamModel::Timoshenko { shear_coefficient: 0.9 };
    let shear = ShearStrength { cohesion: 0.05, friction_coefficient: 0.6, moment_share: 0.3 };
    let spring = CohesiveBeam { model: BeamModel::Spring, strength: 0.03, ..beam };
    for periodic in [false, true] {
        for mode in every {
            columns_match_the_scalar_path("linear_bond", &[linear], mode, periodic, false);
            for dashpots in [false, true] {
                // Strains as large as those of the bonds; without dashpots the formulas omit roots.
                let elasticity = vec![Elastic { young: 4.0, poisson: 0.3 }];
                let deformable =
                    Deformable { elasticity, condition: Condition::Solid, update: Update::Lagged, dashpots };
                let model = Model { mode, deformable: Some(deformable), ..Model::default() };
                let bond = LinearBond { damping_ratio: if dashpots { 0.1 } else { 0.0 }, ..linear };
                columns_match_the_scalar_path_in("deformable particles", &[bond], None, &model, periodic, false);
            }
            let undamped = LinearBond { damping_ratio: 0.0, ..linear };
            let model = Model { mode, ..Model::default() };
            let name = "linear_bond that loses its dashpots";
            columns_match_the_scalar_path_in(name, &[linear], Some(undamped), &model, periodic, false);
            columns_match_the_scalar_path("linear_bond without dashpots", &[undamped], mode, periodic, false);
            for (name, parameters) in [("cpm", concrete), ("cpm of YADE", of_yade)] {
                columns_match_the_scalar_path(name, &[Cpm::new(&parameters).unwrap()], mode, periodic, false);
            }
        }
        for turned in [false, true] {
            for (name, rows) in [
                ("slender beams", vec![beam]),
                ("Timoshenko beams", vec![CohesiveBeam { model, ..beam }]),
                ("beams of two rows", vec![beam, CohesiveBeam { young: 1.5, ..beam }]),
                ("beams by their larger end", vec![larger_end]),
                ("beams of rock", vec![CohesiveBeam { shear, ..beam }]),
                ("springs", vec![spring]),
            ] {
                columns_match_the_scalar_path(name, &rows, MotionMeasure::Finite, periodic, turned);
            }
        }
        columns_match_the_scalar_path("slender beams", &[beam], MotionMeasure::YadeRatcheting, periodic, true);
    }
}

/// Unbonded contacts in columns give the bits of the scalar path, which sampled steps take: in two tiles, while contacts stick, slip,
/// open, and close, with and without dashpots, in a periodic cell and outside.
/// `later`: the law from the 20th step on.
fn sliding_columns_match_the_scalar_path<L: LawLoops>(name: &str, law: L, later: Option<L>, periodic: bool) {
    let mut rows = PairCoefficients::new(1);
    rows.set(0, 0, 0);
    let model = Model { contact_rows: rows, ..Model::default() };
    let run = |sampled: bool| {
        let (n, mut state) = (11, State::default());
        for k in 0..n * n * n {
            // Overlaps of 0.04, and a wall of gaps in the middle that some contacts cross.
            let place = Vec3::new((k % n) as f64, (k / n % n) as f64, (k / (n * n)) as f64) * 1.96;
            let position = if k % n > 5 { place + Vec3::x() * 0.06 } else { place };
            state.particles.push(Sphere { position, radius: 1.0 }, 0, 1.0, 0.4);
            let u = |m: usize| ((k * 7919 + m * 104_729) % 1000) as f64 / 500.0 - 1.0;
            state.particles.velocity[k] = Vec3::new(u(1), u(2), u(3)) * 0.05;
            state.particles.angular_velocity[k] = Vec3::new(u(4), u(5), u(6)) * 0.05;
        }
        state.cell = periodic.then(|| {
            let mut cell = Cell::new_box(Vec3::repeat(1.96 * n as f64));
            cell.velocity_gradient = Mat3::new(1e-3, 2e-3, 0.0, 0.0, -1e-3, 0.0, 0.0, 0.0, 0.0);
            cell
        });
        state.contacts = Some(Box::new(ContactBlock::new(vec![law])));
        state.clock.dt = 0.05;
        let mut solver = Solver::new(model.clone(), &mut state).unwrap();
        let (mut opened, mut slipped, mut active) = (0, 0.0, 0);
        for step in 0..60 {
            if let (20, Some(law)) = (step, later) {
                replace_rows(state.contacts.as_deref_mut().unwrap(), law);
            }
            let report = solver.step_with(&mut state, sampled || step == 59).unwrap();
            opened += report.opened.len();
            slipped += report.energy.friction;
            active = report.active[1];
        }
        assert!(
            opened > 10 && active > 500 && slipped > 0.0,
            "{name}: {opened} opened, {active} are left, {slipped} J"
        );
        ColumnStore::of(&state).unwrap()
    };
    assert!(same_bits(&run(true), &run(false)), "{name}, periodic {periodic}");
}

#[test]
fn unbonded_columns_give_the_bits_of_the_scalar_path() {
    let grain = Elastic { young: 10.0, poisson: 0.3 };
    let hertz = HertzMindlin::new(grain, grain, 0.3, 0.8).unwrap();
    let undamped = HertzMindlin::new(grain, grain, 0.3, 1.0).unwrap();
    let given = ContactStiffness::Given { normal: 2.0, shear: 1.0 };
    let moduli = ContactStiffness::Moduli { young_a: 2.0, young_b: 2.0, ratio: 0.5 };
    for periodic in [false, true] {
        sliding_columns_match_the_scalar_path("Hertz", hertz, None, periodic);
        sliding_columns_match_the_scalar_path("Hertz, undamped", undamped, None, periodic);
        let shear = HertzMindlin { shear_damping_ratio: 0.2, ..hertz };
        sliding_columns_match_the_scalar_path("Hertz with a shear dashpot", shear, None, periodic);
        sliding_columns_match_the_scalar_path("Hertz that loses its shear dashpot", shear, Some(hertz), periodic);
        let pulls = shear.with_tension_from_damping(0.8).unwrap();
        sliding_columns_match_the_scalar_path("Hertz that pulls", pulls, None, periodic);
        for (stiffness, damping) in [(given, 0.0), (given, 0.2), (moduli, 0.2)] {
            let law = Frictional::new(stiffness, 0.3, damping).unwrap();
            sliding_columns_match_the_scalar_path("linear springs", law, None, periodic);
        }
        let damped = Frictional::new(given, 0.3, 0.2).unwrap();
        let elastic = Frictional::new(given, 0.3, 0.0).unwrap();
        sliding_columns_match_the_scalar_path(
            "linear springs that lose their dashpots",
            damped,
            Some(elastic),
            periodic,
        );
    }
}
