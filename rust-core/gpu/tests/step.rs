//! Steps on the emulated device have the bits of the solver: state, ledger, clock.
//!
//! The emulated device runs the kernels with the arguments, launches, and copies of a real one, in shuffled thread order. Only the calls of
//! the driver are not tested.

use concordem_contact::law::cpm::CpmParameters;
use concordem_contact::law::{
    BeamFractureEnergy, CohesiveBeam, ContactLaw, ContactStiffness, Cpm, DampedBeam, Elastic, Frictional, HertzMindlin,
    Jointed,
};
use concordem_contact::law::{LinearBond, Section, Softening, SofteningBeam};
use concordem_contact::math::Vec3;
use concordem_gpu::DeviceSteps;
use concordem_gpu::arguments::Launch;
use concordem_gpu::device::emulated::Emulated;
use concordem_gpu::device::{self, Address, Device, DeviceError, Kernel};
use concordem_packing::bonding::bond as bond_all;
use concordem_packing::{import_text, mass_of};
use concordem_solver::forces::{BondEvent, LawLoops, TILE};
use concordem_solver::integrate::Damping;
use concordem_solver::neighbor::spatial_order;
use concordem_solver::state::columns::{ColumnStore, WriteColumns};
use concordem_solver::state::contacts::ContactBlock;
use concordem_solver::state::{Constraint, Particles, State};
use concordem_solver::{Model, PairCoefficients, Solver, SolverError, StepDevice};

const GRAVITY: Vec3 = Vec3::new(1.0, -2.0, 3.0);
const LOCAL: Damping = Damping::Local { translation: 0.3, rotation: 0.2 };
const DENSITY: f64 = 4800.0;
const YOUNG: f64 = 25e9;

/// 1,160 spheres in two tiles. Both ends along z move apart and keep their velocity; some spheres spin.
fn specimen(rate: f64) -> Particles {
    // In the program, which may run on another machine.
    let text: &[u8] = include_bytes!("../../../tests/golden/yade/packing.txt");
    let packing = import_text(text).unwrap();
    let mut particles = Particles::default();
    for sphere in &packing.spheres {
        let (mass, inertia) = mass_of(sphere.radius, DENSITY, false);
        particles.push(*sphere, 0, mass, inertia);
    }
    let order = spatial_order(&particles.position, None);
    let mut particles = particles.permuted(&order);
    assert!(particles.len() > TILE, "one tile tests little");
    let along = |particles: &Particles, p: usize| particles.position[p].z;
    let (low, high) = (0..particles.len())
        .map(|p| along(&particles, p))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| (low.min(z), high.max(z)));
    for p in 0..particles.len() {
        let share = (along(&particles, p) - low) / (high - low);
        particles.velocity[p].z = rate * (high - low) * (share - 0.5);
        particles.angular_velocity[p] = Vec3::new(1.0, -0.5, 0.3) * f64::from(u8::from(p % 5 == 0));
        if !(0.1..=0.9).contains(&share) {
            particles.constraint[p] = Constraint::translation_along(2).with(Constraint::ROTATION);
        }
    }
    particles
}

/// A specimen with bonds and unbonded contacts of these laws.
fn scene<B: LawLoops, C: LawLoops>(bonds: Option<B>, contacts: Option<C>, damping: Damping, rate: f64) -> Scene {
    let particles = specimen(rate);
    let mut rows = PairCoefficients::new(1);
    rows.set(0, 0, 0);
    let smallest = particles.radius.iter().copied().fold(f64::INFINITY, f64::min);
    let mut state = State { particles, ..State::default() };
    state.clock.dt = 0.5 * smallest * (DENSITY / YOUNG).sqrt();
    if let Some(law) = bonds {
        let mut block = ContactBlock::new(vec![law]);
        bond_all(&mut block, &rows, &state.particles, None, 1.5).unwrap();
        state.bonds.push(Box::new(block));
    }
    let mut model = Model { damping, gravity: GRAVITY, ..Model::default() };
    if let Some(law) = contacts {
        state.contacts = Some(Box::new(ContactBlock::new(vec![law])));
        model.contact_rows = rows;
    }
    Scene { state, model }
}

#[derive(Clone)]
struct Scene {
    state: State,
    model: Model,
}

/// What steps on a device were like.
#[derive(Debug, Default)]
struct Course {
    on_device: u64,
    by_solver: u64,
    rebuilds: u64,
    /// Entries of the event log, and how many of them are the device's.
    events: Vec<(u64, BondEvent)>,
    logged: usize,
}

impl Scene {
    /// `steps` steps of the solver; those for which `sampled` holds sum energies.
    fn solve(&self, steps: u64, sampled: impl Fn(u64) -> bool) -> (State, Result<Vec<(u64, BondEvent)>, SolverError>) {
        let mut state = self.state.clone();
        let mut solver = Solver::new(self.model.clone(), &mut state).unwrap();
        let mut events = Vec::new();
        for step in 0..steps {
            match solver.step_with(&mut state, sampled(step)) {
                Ok(report) => events.extend(report.bond_events.into_iter().map(|(_, event)| (step, event))),
                Err(error) => return (state, Err(error)),
            }
        }
        (state, Ok(events))
    }

    /// The same with a device, from which the state comes back every `back` steps.
    fn on_device(
        &self,
        steps: u64,
        back: u64,
        sampled: impl Fn(u64) -> bool,
    ) -> (State, Result<Course, SolverError>, DeviceSteps) {
        let mut state = self.state.clone();
        let mut solver = Solver::new(self.model.clone(), &mut state).unwrap();
        let mut device = DeviceSteps::new(device()).unwrap();
        let mut course = Course::default();
        let mut take = || -> Result<(), SolverError> {
            while state.clock.step < steps {
                let step = state.clock.step;
                let mut count = solver.steps_for_device(&state).min(steps - step).min(back);
                // The device samples in the last step of a stretch.
                let sample = (step..step + count).find(|step| sampled(*step));
                count = sample.map_or(count, |sample| sample + 1 - step);
                let mut event = count == 0;
                if count > 0 {
                    device.load(&solver, &state).unwrap();
                    let taken = solver.step_on(&mut device, &mut state, count, sample.is_some())?;
                    device.store(&mut state).unwrap();
                    course.on_device += taken.count;
                    course.logged += taken.bond_events.len();
                    course.events.extend(taken.bond_events);
                    event = taken.event;
                }
                if event {
                    let step = state.clock.step;
                    let report = solver.step_with(&mut state, sampled(step))?;
                    course.events.extend(report.bond_events.into_iter().map(|(_, event)| (step, event)));
                    course.by_solver += 1;
                }
            }
            Ok(())
        };
        let taken = take();
        course.rebuilds = solver.neighbor_rebuilds();
        (state, taken.map(|()| course), device)
    }

    /// Solver and device give the same state, to the last bit; how the device's steps were.
    fn compare(&self, steps: u64, back: u64) -> (State, Course) {
        let sampled = |step: u64| step % 32 == 21;
        let (expected, solved) = self.solve(steps, sampled);
        let events = solved.unwrap();
        let (found, course, _) = self.on_device(steps, back, sampled);
        assert_equal(&found, &expected);
        let course = course.unwrap();
        assert_eq!(course.on_device + course.by_solver, steps);
        // As text, which tells zeros of different sign.
        assert_eq!(format!("{:?}", course.events), format!("{events:?}"));
        (found, course)
    }
}

/// All columns, as text that tells zeros of different sign.
fn columns(state: &State) -> String {
    let mut store = ColumnStore::default();
    state.write(&mut store).unwrap();
    format!("{store:?}")
}

fn assert_equal(found: &State, expected: &State) {
    let (found, expected) = (columns(found), columns(expected));
    if let Some(at) = found.bytes().zip(expected.bytes()).position(|(a, b)| a != b) {
        let part = |text: &str| text.bytes().skip(at.saturating_sub(60)).take(120).map(char::from).collect::<String>();
        let column = found[..at].rfind("StoredColumn").map_or(0, |at| at.saturating_sub(60));
        panic!("{}\n  found {}\n  expected {}", &found[column..column + 80], part(&found), part(&expected));
    }
    assert_eq!(found.len(), expected.len());
}

fn cpm() -> Cpm {
    Cpm::new(&CpmParameters::new(YOUNG, 0.2, 3e6, 0.6, 1e-4, 30.0)).unwrap()
}

fn frictional() -> Frictional {
    Frictional::new(ContactStiffness::Given { normal: 1e7, shear: 4e6 }, 0.5, 0.1).unwrap()
}

const NONE: Option<Cpm> = None;

/// The device of the tests: the emulated one, or with `CONCORDEM_TEST_DEVICE=gpu` a graphics processor.
fn device() -> Box<dyn Device> {
    if std::env::var("CONCORDEM_TEST_DEVICE").is_ok_and(|name| name == "gpu") {
        device::gpu().unwrap()
    } else {
        Box::<Emulated>::default()
    }
}

/// The share of the steps that the solver took is small where nothing happens.
fn assert_quiet(course: &Course) {
    assert!(course.on_device > 20 * course.by_solver, "{course:?}");
}

#[test]
fn elastic_concrete_has_the_bits_of_the_solver() {
    let (state, course) = scene(Some(cpm()), NONE, LOCAL, 0.05).compare(200, 70);
    assert_quiet(&course);
    assert!(state.ledger.numerical_damping.get() > 0.0 && state.ledger.boundary_work.get() != 0.0);
}

/// Damage grows in some bonds and not in others, so both formulas of the law's columns meet the scalar one.
#[test]
fn damaged_concrete_has_the_bits_of_the_solver() {
    let (state, course) = scene(Some(cpm()), NONE, LOCAL, 40.0).compare(60, 100);
    assert!(course.on_device > 0);
    assert!(state.ledger.damage.get() > 0.0);
    let block = state.bonds[0].contacts().as_any().downcast_ref::<ContactBlock<Cpm>>().unwrap();
    let damaged = block.history.iter().filter(|history| history.omega > 0.0).count();
    assert!((block.len() / 100..block.len()).contains(&damaged), "{damaged} of {} bonds are damaged", block.len());
}

/// Bonds enter the event log on the device; a step that it discards, because another bond breaks, logs nothing twice.
#[test]
fn the_event_log_has_the_bits_of_the_solver() {
    let mut scene = scene(Some(cpm()), NONE, LOCAL, 40.0);
    scene.model.damage_threshold = 0.01;
    let (_, course) = scene.compare(120, 1000);
    assert_quiet(&course);
    assert!(course.logged > 1000, "{} entries", course.logged);
    // In other steps bonds break, so the solver takes them.
    let brittle = CpmParameters { omega_threshold: 0.8, ..CpmParameters::new(YOUNG, 0.2, 3e6, 0.6, 1e-4, 5.0) };
    let law = Cpm::new(&brittle).unwrap();
    scene = self::scene(Some(law), Some(law), LOCAL, 40.0);
    scene.model.damage_threshold = 0.5;
    let (state, course) = scene.compare(150, 100);
    assert!(course.logged > 10 && state.broken.len() > 10, "{} entries, {} broken", course.logged, state.broken.len());
    let at_break = course.events.iter().filter(|(_, event)| event.broke);
    let both = at_break.filter(|(step, _)| course.events.iter().any(|(other, event)| other == step && !event.broke));
    assert!(both.count() > 3);
}

/// Bonds break, and their pairs go on as unbonded contacts: the solver takes these steps, and the device the others.
#[test]
fn breaking_concrete_has_the_bits_of_the_solver() {
    let brittle = CpmParameters { omega_threshold: 0.8, ..CpmParameters::new(YOUNG, 0.2, 3e6, 0.6, 1e-4, 5.0) };
    let law = Cpm::new(&brittle).unwrap();
    let (state, course) = scene(Some(law), Some(law), LOCAL, 40.0).compare(150, 100);
    assert!(state.broken.len() > 10, "{} bonds broke", state.broken.len());
    assert!(course.on_device > 20 && course.by_solver > 20, "{course:?}");
}

#[test]
fn beams_have_the_bits_of_the_solver() {
    let beam = CohesiveBeam::new(YOUNG, 0.2, Section::Ratio(0.5)).unwrap();
    let (_, course) = scene(Some(beam), NONE, Damping::None, 0.05).compare(130, 1000);
    assert_quiet(&course);
}

#[test]
fn damped_beams_have_the_bits_of_the_solver() {
    let beam = CohesiveBeam::new(YOUNG, 0.2, Section::Ratio(0.5)).unwrap();
    let damped = DampedBeam::new(beam, 0.1).unwrap();
    let (state, course) = scene(Some(damped), NONE, Damping::None, 0.05).compare(130, 1000);
    assert_quiet(&course);
    assert!(state.ledger.viscous.get() > 0.0);
}

/// Beams that soften and break: damage is a matter of the device, the end of a bond stops it.
#[test]
fn softening_beams_have_the_bits_of_the_solver() {
    let beam = CohesiveBeam { strength: 20e6, ..CohesiveBeam::new(YOUNG, 0.2, Section::Ratio(0.5)).unwrap() };
    let energy = BeamFractureEnergy { tension: 1000.0, shear: 3000.0, exponent: 1.5 };
    let softening = SofteningBeam::new(beam, energy, Softening::Exponential).unwrap();
    let (state, course) = scene(Some(softening), Some(frictional()), LOCAL, 4000.0).compare(300, 1000);
    assert!(state.broken.len() > 10 && course.on_device > 20, "{} broke, {course:?}", state.broken.len());
}

/// Beams that break leave frictional contacts between fast spheres, which also rebuilds the neighbor list.
#[test]
fn breaking_beams_and_contacts_have_the_bits_of_the_solver() {
    let beam = CohesiveBeam { strength: 20e6, ..CohesiveBeam::new(YOUNG, 0.2, Section::Ratio(0.5)).unwrap() };
    let (state, course) = scene(Some(beam), Some(frictional()), LOCAL, 4000.0).compare(300, 1000);
    assert!(state.broken.len() > 100, "{} beams broke", state.broken.len());
    assert!(course.rebuilds > 3 && course.on_device > 20, "{course:?}");
}

#[test]
fn linear_bonds_with_dashpots_have_the_bits_of_the_solver() {
    let bond = LinearBond::new(1e6, 4e5, 0.1, f64::INFINITY, f64::INFINITY).unwrap();
    let (state, course) = scene(Some(bond), NONE, LOCAL, 0.05).compare(130, 1000);
    assert_quiet(&course);
    assert!(state.ledger.viscous.get() > 0.0);
}

/// Rock, pulled and pressed: cracks in tension stop the device, those in shear under pressure enter its log.
#[test]
fn rock_has_the_bits_of_the_solver() {
    let rock = Jointed::new(YOUNG, 0.3, 6e6, 12e6, 0.3).unwrap();
    let (state, course) = scene(Some(rock), Some(rock), LOCAL, 40.0).compare(150, 100);
    assert!(state.broken.len() > 10, "{} bonds broke", state.broken.len());
    assert!(course.on_device > 20 && course.by_solver > 20, "{course:?}");
    let slippery = Jointed::new(YOUNG, 0.3, 60e6, 2e6, 0.1).unwrap();
    let (_, course) = scene(Some(slippery), Some(slippery), LOCAL, -40.0).compare(150, 100);
    assert!(course.logged > 10 && course.on_device > 20, "{} entries, {} steps", course.logged, course.on_device);
    assert!(course.events.iter().any(|(_, event)| event.fails && !event.broke && event.stored[0] == 0.0));
}

/// Without bonds, spheres of a dense packing press, slide, and part.
#[test]
fn unbonded_contacts_have_the_bits_of_the_solver() {
    let scene = scene(NONE, Some(frictional()), LOCAL, -20.0);
    let (state, course) = scene.compare(200, 1000);
    assert!(state.ledger.friction.get() > 0.0 && state.ledger.viscous.get() > 0.0);
    assert_eq!((course.on_device, course.by_solver), (199, 1));
    let mut alone = scene.state.clone();
    let mut solver = Solver::new(scene.model.clone(), &mut alone).unwrap();
    let opened: usize = (0..200).map(|_| solver.step_with(&mut alone, false).unwrap().opened.len()).sum();
    assert!(opened > 20, "{opened} contacts opened");
}

/// The solver checks all contacts whose stiffness grows in some steps; the device leaves it these.
#[test]
fn stiffening_contacts_have_the_bits_of_the_solver() {
    let elastic = Elastic { young: 1e9, poisson: 0.3 };
    let law = HertzMindlin::new(elastic, elastic, 0.5, 0.8).unwrap();
    let mut scene = scene(NONE, Some(law), LOCAL, -20.0);
    scene.model.watch_contacts = true;
    let (_, course) = scene.compare(300, 1000);
    assert!(course.on_device > 20 && course.by_solver > 5, "{course:?}");
}

/// Free flight uses up the skin again and again.
#[test]
fn neighbor_lists_are_rebuilt_in_time() {
    let mut scene = scene(Some(cpm()), Some(cpm()), Damping::None, 0.05);
    let smallest = scene.state.particles.radius.iter().copied().fold(f64::INFINITY, f64::min);
    let drift = Vec3::new(0.02 * smallest / scene.state.clock.dt, 0.0, 0.0);
    scene.state.particles.velocity.iter_mut().for_each(|v| *v += drift);
    let (_, course) = scene.compare(100, 1000);
    assert!(course.rebuilds >= 20, "{course:?}");
    assert_quiet(&course);
}

/// A time step far beyond its bound: the same error in the same step.
#[test]
fn motion_that_is_not_finite_is_found_in_its_step() {
    let mut scene = scene(Some(cpm()), NONE, Damping::None, 0.05);
    let law = Cpm::new(&CpmParameters { never_damage: true, ..CpmParameters::new(YOUNG, 0.2, 3e6, 0.6, 1e-4, 30.0) });
    let block = scene.state.bonds[0].contacts_mut().as_any_mut().downcast_mut::<ContactBlock<Cpm>>().unwrap();
    block.rows = vec![law.unwrap()];
    scene.state.clock.dt *= 100.0;
    let (_, expected) = scene.solve(2000, |_| false);
    let expected = expected.unwrap_err();
    assert!(matches!(expected, SolverError::NotFinite { .. }), "{expected}");
    let (_, found, _) = scene.on_device(2000, 1000, |_| false);
    assert_eq!(found.unwrap_err(), expected);
}

/// A device is refused what it does not support.
#[test]
fn unsupported_states_are_refused() {
    let mut scene = scene(Some(cpm()), NONE, Damping::NonViscous { translation: 0.1, rotation: 0.1 }, 0.05);
    let solver = Solver::new(scene.model.clone(), &mut scene.state).unwrap();
    let mut device = DeviceSteps::new(Box::<Emulated>::default()).unwrap();
    let error = device.load(&solver, &scene.state).unwrap_err();
    assert!(error.to_string().contains("damping other than local damping"), "{error}");
}

/// The names of entry points, which `rust-core/gpu/ptx` checks.
#[test]
fn entry_points_have_the_names_of_their_laws() {
    assert_eq!(Kernel::Contacts(CohesiveBeam::NAME).entry(), "contacts_cohesive_beam");
    assert_eq!([Kernel::Particles, Kernel::Sums, Kernel::Layout].map(Kernel::entry), ["particles", "sums", "layout"]);
}

/// A device whose kernels come from other sources.
#[derive(Default)]
struct Foreign(Emulated);

impl Device for Foreign {
    fn name(&self) -> String {
        self.0.name()
    }
    fn allocate(&mut self, bytes: usize) -> Result<Address, DeviceError> {
        self.0.allocate(bytes)
    }
    fn free(&mut self, array: Address) {
        self.0.free(array);
    }
    fn upload(&mut self, array: Address, bytes: &[std::mem::MaybeUninit<u8>]) -> Result<(), DeviceError> {
        self.0.upload(array, bytes)
    }
    fn download(&mut self, array: Address, bytes: &mut [u8]) -> Result<(), DeviceError> {
        self.0.download(array, bytes)?;
        bytes[0] ^= 1;
        Ok(())
    }
    fn launch(&mut self, kernel: Kernel, threads: usize, at: Address, launch: Launch) -> Result<(), DeviceError> {
        self.0.launch(kernel, threads, at, launch)
    }
}

#[test]
fn kernels_of_other_sources_are_refused() {
    let error = DeviceSteps::new(Box::<Foreign>::default()).err().unwrap();
    assert!(error.to_string().contains("make ptx"), "{error}");
}
