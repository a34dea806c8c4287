//! Checks a graphics processor against the solver, and measures its speed. `rust-core/gpu/measure` runs it.
//!
//! Arguments: the device (`gpu` or `emulated`), the least number of steps to be timed, and cases `LAW:PARTICLES`. Prints JSON. It needs no
//! files but the kernels, and no libraries but the driver.

use std::error::Error;
use std::process::{Child, Command, ExitCode, Stdio};
use std::time::Instant;

use concordem_contact::law::cpm::CpmParameters;
use concordem_contact::law::{CohesiveBeam, ContactLaw, Cpm, LinearBond, Section};
use concordem_contact::math::Vec3;
use concordem_gpu::device::{self, Device, DeviceError, emulated::Emulated};
use concordem_gpu::{DeviceSteps, bytes_per_step};
use concordem_packing::bonding::bond;
use concordem_packing::mass_of;
use concordem_solver::forces::LawLoops;
use concordem_solver::integrate::Damping;
use concordem_solver::neighbor::spatial_order;
use concordem_solver::state::columns::{Column, ColumnError, ColumnSink, WriteColumns};
use concordem_solver::state::contacts::ContactBlock;
use concordem_solver::state::{Particles, Sphere, State};
use concordem_solver::{Model, PairCoefficients, Solver, StepDevice};

/// m.
const RADIUS: f64 = 1e-3;
/// Pa.
const YOUNG: f64 = 25e9;
/// kg/m³.
const DENSITY: f64 = 4800.0;
/// Steps that solver and device take from the same state.
const COMPARED: u64 = 40;

/// A cube of touching spheres on a face-centered lattice, bonded to their neighbors, with a velocity field that strains it.
fn cube<L: LawLoops>(law: L, count: usize) -> Result<(State, Model), Box<dyn Error>> {
    let edge = (count as f64 / 4.0).cbrt().round() as usize;
    let cell = 2.0 * 2.0_f64.sqrt() * RADIUS;
    let (mass, inertia) = mass_of(RADIUS, DENSITY, false);
    let mut particles = Particles::default();
    for k in 0..edge * edge * edge {
        let corner = Vec3::new((k % edge) as f64, (k / edge % edge) as f64, (k / edge / edge) as f64);
        for offset in [[0.0, 0.0, 0.0], [0.5, 0.5, 0.0], [0.5, 0.0, 0.5], [0.0, 0.5, 0.5]] {
            let position = (corner + Vec3::from(offset)) * cell;
            particles.push(Sphere { position, radius: RADIUS }, 0, mass, inertia);
        }
    }
    let order = spatial_order(&particles.position, None);
    let mut particles = particles.permuted(&order);
    let length = edge as f64 * cell;
    for (x, v) in particles.position.iter().zip(&mut particles.velocity) {
        let wave = (7.0 * x.x / length).sin() * (5.0 * x.y / length).cos();
        *v = Vec3::new(0.02 * wave, -0.01 * wave, 0.5 * (x.z / length - 0.5));
    }
    let mut rows = PairCoefficients::new(1);
    rows.set(0, 0, 0);
    let mut bonds = ContactBlock::new(vec![law]);
    bond(&mut bonds, &rows, &particles, None, 1.2)?;
    let mut state = State { particles, ..State::default() };
    state.bonds.push(Box::new(bonds));
    state.contacts = Some(Box::new(ContactBlock::new(vec![law])));
    state.clock.dt = 0.4 * RADIUS * (DENSITY / YOUNG).sqrt();
    let damping = Damping::Local { translation: 0.3, rotation: 0.3 };
    Ok((state, Model { damping, contact_rows: rows, skin: 0.1, ..Model::default() }))
}

/// [`cube`] with bonds of the law of this name.
fn scene(law: &str, count: usize) -> Result<(State, Model), Box<dyn Error>> {
    match law {
        Cpm::NAME => cube(Cpm::new(&CpmParameters::new(YOUNG, 0.2, 3e6, 0.6, 1e-4, 30.0))?, count),
        CohesiveBeam::NAME => cube(CohesiveBeam::new(YOUNG, 0.2, Section::Ratio(0.5))?, count),
        LinearBond::NAME => cube(LinearBond::new(5e7, 1e7, 0.1, f64::INFINITY, f64::INFINITY)?, count),
        _ => Err(format!("there is no case of the law \"{law}\"").into()),
    }
}

/// Hash of the bits of all columns; faster than those of the standard library, for some 30 GB.
#[derive(Default)]
struct Hashed(u64);

impl Hashed {
    fn add(&mut self, numbers: impl Iterator<Item = u64>) {
        for number in numbers {
            self.0 = (self.0.rotate_left(5) ^ number).wrapping_mul(0x517c_c1b7_2722_0a95);
        }
    }
}

impl ColumnSink for Hashed {
    fn column(&mut self, path: &str, column: Column<'_>) -> Result<(), ColumnError> {
        self.add(path.bytes().map(u64::from));
        match column {
            Column::F64 { data, .. } => self.add(data.iter().map(|real| real.to_bits())),
            Column::U64 { data, .. } => self.add(data.iter().copied()),
            Column::U32 { data, .. } => self.add(data.iter().map(|&number| number.into())),
            Column::U16 { data, .. } => self.add(data.iter().map(|&number| number.into())),
            Column::U8 { data, .. } => self.add(data.iter().map(|&number| number.into())),
            Column::I8 { data, .. } => self.add(data.iter().map(|&number| u64::from(number as u8))),
        }
        Ok(())
    }
}

fn hash(state: &State) -> Result<u64, ColumnError> {
    let mut hashed = Hashed::default();
    state.write(&mut hashed)?;
    Ok(hashed.0)
}

/// Power of the card (W), read ten times per second by `nvidia-smi`, if there is one.
struct Power(Option<Child>);

impl Power {
    fn start() -> Self {
        let arguments = ["--query-gpu=power.draw", "--format=csv,noheader,nounits", "-lms", "100", "-i", "0"];
        Self(Command::new("nvidia-smi").args(arguments).stdout(Stdio::piped()).stderr(Stdio::null()).spawn().ok())
    }

    /// Mean since the start.
    fn stop(self) -> Option<f64> {
        let mut child = self.0?;
        child.kill().ok()?;
        let output = child.wait_with_output().ok()?;
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let values: Vec<f64> = text.lines().filter_map(|line| line.trim().parse().ok()).collect();
        (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
    }
}

/// Take `count` steps on the device, those with an event excepted; returns the number of these.
fn take(device: &mut DeviceSteps, solver: &mut Solver, state: &mut State, count: u64) -> Result<u64, Box<dyn Error>> {
    let end = state.clock.step + count;
    let mut events = 0;
    while state.clock.step < end {
        if solver.step_on(device, state, end - state.clock.step, false)?.event {
            device.store(state)?;
            solver.step_with(state, false)?;
            device.load(solver, state)?;
            events += 1;
        }
    }
    Ok(events)
}

fn measure(
    device: Box<dyn Device>,
    law: &str,
    particles: usize,
    steps: u64,
    seconds: f64,
) -> Result<String, Box<dyn Error>> {
    let (mut state, model) = scene(law, particles)?;
    let (particles, bonds) = (state.particles.len(), state.bonds[0].len());
    let (name, peak) = (device.name(), device.peak_bandwidth());
    let mut device = DeviceSteps::new(device)?;
    let mut solver = Solver::new(model.clone(), &mut state)?;
    solver.step_with(&mut state, true)?;

    let mut copy = state.clone();
    let mut alone = Solver::new(model, &mut copy)?;
    let begun = Instant::now();
    for _ in 0..COMPARED {
        alone.step_with(&mut copy, false)?;
    }
    let solver_time = begun.elapsed().as_secs_f64() / COMPARED as f64;
    device.load(&solver, &state)?;
    let mut events = take(&mut device, &mut solver, &mut state, COMPARED)?;
    device.store(&mut state)?;
    let equal = hash(&copy)? == hash(&state)?;
    drop((copy, alone));

    let begun = Instant::now();
    device.load(&solver, &state)?;
    let load = begun.elapsed().as_secs_f64();
    let power = Power::start();
    let begun = Instant::now();
    let mut taken = 0;
    // Long enough for the power, too.
    while taken == 0 || begun.elapsed().as_secs_f64() < seconds {
        events += take(&mut device, &mut solver, &mut state, steps)?;
        taken += steps;
    }
    let time = begun.elapsed().as_secs_f64() / taken as f64;
    let watts = power.stop();
    let begun = Instant::now();
    device.store(&mut state)?;
    let store = begun.elapsed().as_secs_f64();

    let bytes = bytes_per_step(&state);
    let optional = |value: Option<f64>| value.map_or("null".to_owned(), |value| format!("{value:e}"));
    Ok(format!(
        "{{ \"device\": \"{name}\", \"law\": \"{law}\", \"particles\": {particles}, \"bonds\": {bonds}, \"equal_bits\": {equal}, \"compared_steps\": {COMPARED}, \
         \"timed_steps\": {taken}, \"steps_with_events\": {events}, \"seconds_per_step\": {time:e}, \"particle_steps_per_second\": {:e}, \
         \"nanoseconds_per_bond_step\": {:e}, \"solver_threads\": {}, \"solver_seconds_per_step\": {solver_time:e}, \"bytes_per_bond_step\": {:.0}, \
         \"bytes_per_second\": {:e}, \"share_of_bandwidth\": {}, \"watts\": {}, \"nanojoules_per_bond_step\": {}, \
         \"load_seconds\": {load:e}, \"store_seconds\": {store:e} }}",
        particles as f64 / time,
        1e9 * time / bonds as f64,
        rayon::current_num_threads(),
        bytes as f64 / bonds as f64,
        bytes as f64 / time,
        optional(peak.map(|peak| bytes as f64 / time / peak)),
        optional(watts),
        optional(watts.map(|watts| 1e9 * watts * time / bonds as f64)),
    ))
}

/// The device of this name.
fn open(name: &str) -> Result<Box<dyn Device>, DeviceError> {
    if name == "emulated" { Ok(Box::<Emulated>::default()) } else { device::gpu() }
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [name, steps, cases @ ..] = &arguments[..] else {
        return Err("usage: measure gpu|emulated STEPS LAW:PARTICLES ...".into());
    };
    let (steps, seconds) = (steps.parse()?, if name == "emulated" { 0.0 } else { 6.0 });
    let mut results = Vec::new();
    for case in cases {
        let (law, count) = case.split_once(':').ok_or_else(|| format!("{case} is not LAW:PARTICLES"))?;
        results.push(measure(open(name)?, law, count.parse()?, steps, seconds)?);
        eprintln!("{}", results.last().map_or("", |text| text));
    }
    println!("[{}]", results.join(",\n "));
    Ok(())
}
