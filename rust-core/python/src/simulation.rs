//! A running simulation.
//!
//! The interpreter's lock is released during steps. Every 50 ms, control returns to Python between two steps; Python may raise
//! KeyboardInterrupt, after which the simulation can continue.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use concordem::assembly::restart::{self, Continuation};
use concordem::assembly::{Assembly, Summary, assemble_with, place};
use concordem::output::{ResultFile, checkpoint, hash};
use concordem::sampling::Bonds as SampledBonds;
use concordem::schedule::simulation::Written;
use concordem::schedule::{Record, Simulation as Run, StopReason};
use concordem::state::Load;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{TableColumn, Vectors, result, rows, scalars, table, tensor, vectors};
use crate::errors::{OrRaise, caught, detach_here, of_assembly, of_restart};
use crate::meshes::{free_mesh, mesh_number, no_mesh};
use crate::results::events;
use crate::scenario::Scenario;
use crate::scripted::{Replacement, ScriptedLaw};
use crate::shared::{Access, Shared};
use crate::state::{Addresses, State};
use crate::warnings::warn;
use crate::work::{Pool, REPORT, SLICE, close, guarded, reporter};

mod kept;
mod sampled;
mod snapshot;

pub use kept::HISTORIES;
use kept::{Kept, Records};
use sampled::{by_quantity, recorded, scheduled};
pub use snapshot::SimulationSnapshot;

/// The data that steps change.
pub struct Inner {
    /// State, solver, and schedule.
    pub run: Run,
    records: Records,
    addresses: Addresses,
    /// Loads of the scenario.
    loads: Vec<Load>,
    /// The motion after the last step, once a caller has a view to which it can write.
    pub written: Option<Written>,
}

/// A simulation of a scenario.
#[pyclass(frozen, weakref, module = "concordem")]
pub struct Simulation {
    inner: Shared<Inner>,
    pool: Pool,
    scenario: Py<Scenario>,
    summary: Summary,
    /// Laws in Python, which the blocks of contacts know by number.
    _laws: Vec<Arc<ScriptedLaw>>,
    /// Names of the histories of those of bonds and of contacts.
    histories: [Option<String>; 2],
    /// Tells its snapshots from those of others.
    identity: Arc<()>,
}

impl Inner {
    /// Book what Python has written since the last step.
    fn book_written(&mut self) {
        if let Some(written) = &mut self.written {
            written.book(&mut self.run.state);
            *written = Written::of(&self.run.state);
        }
    }

    /// Advance until the interval ends, `steps` steps are done, or the run ends.
    fn advance(&mut self, steps: &mut u64) -> Result<Option<StopReason>, concordem::schedule::simulation::RunError> {
        let start = Instant::now();
        self.book_written();
        // Python may have written velocities since the last step; what is prescribed starts from them, as in a checkpoint.
        self.run.solver.set_targets(None);
        while *steps > 0 {
            if let Some(reason) = self.run.stopped() {
                return Ok(Some(reason));
            }
            let advance = self.run.advance()?;
            *steps -= 1;
            self.records.samples.extend(advance.sample.into_iter().chain(advance.last));
            for row in advance.operators {
                self.records.operators[row.operator].push(row);
            }
            self.records.events.extend(advance.events);
            if start.elapsed() > SLICE {
                break;
            }
        }
        if self.written.is_some() {
            self.written = Some(Written::of(&self.run.state));
        }
        Ok(self.run.stopped())
    }
}

impl Simulation {
    /// Build a scenario, from the start or from a checkpoint.
    pub fn build(
        scenario: &Bound<'_, Scenario>,
        threads: Option<usize>,
        progress: Option<&Bound<'_, PyAny>>,
        checkpoint: Option<(PathBuf, checkpoint::Checkpoint)>,
        laws: &Replacement,
    ) -> PyResult<Self> {
        let py = scenario.py();
        let Scenario { inner, folder } = scenario.get();
        laws.check(py, inner)?;
        let mut scripted = Vec::new();
        let mut replace = |state: &mut _, model: &_| {
            scripted = Python::attach(|py| laws.apply(py, inner.materials.len(), state, model));
        };
        let assembly = guarded(py, threads, progress, |progress| {
            let placed = place(inner, folder, progress)?;
            assemble_with(inner, folder, &placed, &mut replace, progress)
        })?;
        let mut assembly = assembly.map_err(|error| of_assembly(inner, error))?;
        let loads = assembly.state.particles.loads.clone();
        if assembly.schedule.initial_positions.is_empty() {
            // `sample` may ask for any operator later.
            assembly.schedule.initial_positions.clone_from(&assembly.state.particles.position);
        }
        warn(py, inner, &assembly.summary.warnings)?;
        let pool = Pool::new(threads)?;
        let mut records = Records::none(&assembly.schedule);
        if let Some((path, mut checkpoint)) = checkpoint {
            let before = concordem::scenario::Scenario::parse("<checkpoint>", &checkpoint.provenance).or_raise()?;
            let changes = caught(|| restart::check(&before, inner, Continuation::NewResult))?.or_raise()?;
            let columns = &mut checkpoint.columns;
            let further = !changes.is_empty();
            caught(|| pool.inside(|| restart::apply(&mut assembly, columns, inner, &changes, further)))?
                .map_err(|error| of_restart(inner, error))?;
            let operators = !changes.iter().any(|change| change.key.starts_with("sample"));
            records = match caught(|| ResultFile::open(&path))? {
                Ok(result) => Records::of_result(&result, &assembly.schedule, operators).or_raise()?,
                // Not a result.
                Err(_) => Records::read(&checkpoint.kept, &assembly.schedule, operators).or_raise()?,
            };
        }
        let Assembly { state, model, schedule, summary } = assembly;
        let run = detach_here(py, || pool.inside(|| Run::new(state, model, schedule)))?.or_raise()?;
        let addresses = Addresses::of(&run.state.particles);
        if run.stopped().is_none() {
            records.before(run.state.clock.step);
        }
        let inner = Inner { run, records, addresses, loads, written: None };
        let inner = Shared::new(
            inner,
            "the simulation is running in another thread; access it from its progress function, or wait",
            "the simulation failed in the middle of a step, so its state is invalid; load a checkpoint, or start again",
        );
        let (scenario, identity) = (scenario.clone().unbind(), Arc::new(()));
        let histories = laws.histories(py)?;
        Ok(Self { inner, pool, scenario, summary, _laws: scripted, histories, identity })
    }

    /// Lock the data; an error if another thread is stepping, or if a step failed.
    pub fn lock(&self) -> PyResult<Access<'_, Inner>> {
        self.inner.lock()
    }

    /// Compute up to `steps` steps, with checks for signals and progress reports.
    fn go(&self, py: Python<'_>, steps: u64, progress: Option<&Bound<'_, PyAny>>) -> PyResult<Option<&'static str>> {
        let report = reporter(py, progress)?;
        let mut left = steps;
        let mut last = Instant::now();
        let outcome = loop {
            let mut inner = self.lock()?;
            let (left_ref, pool) = (&mut left, &self.pool);
            let stopped = inner.change(py, move |inner| pool.inside(|| inner.advance(left_ref)))?;
            if Addresses::of(&inner.run.state.particles) != inner.addresses {
                // The core guarantees not to move the particle arrays; otherwise views would dangle.
                eprintln!("internal error of concordem, please report it: the particle arrays have moved");
                std::process::abort();
            }
            let stopped = stopped.or_raise()?;
            let (share, step) = (inner.run.progress(), inner.run.state.clock.step);
            let sample = inner.records.samples.last().copied().unwrap_or_default();
            drop(inner);
            if let Err(error) = py.check_signals() {
                break Err(error);
            }
            if let Some(report) = &report
                && last.elapsed() >= REPORT
            {
                last = Instant::now();
                let share = if steps == u64::MAX { share } else { 1.0 - left as f64 / steps as f64 };
                let text = format!("step {step}, strain {:.3e}, stress {:.3e} Pa", sample.strain, sample.stress);
                if let Err(error) = report.call1(py, (text, share)) {
                    break Err(error);
                }
            }
            if stopped.is_some() || left == 0 {
                break Ok(stopped.map(name_of));
            }
        };
        close(py, report.as_ref())?;
        outcome
    }
}

fn name_of(reason: StopReason) -> &'static str {
    match reason {
        StopReason::Drop => "drop",
        StopReason::Strain => "strain",
        StopReason::Time => "time",
        StopReason::Steps => "steps",
        StopReason::Equilibrium => "equilibrium",
        StopReason::Stages => "stages",
    }
}

#[pymethods]
impl Simulation {
    /// Continue from a checkpoint that `save` wrote, or from a result; the records so far come with it. `scenario`: continue with this
    /// scenario instead of the stored one; other tables `[[sample]]` begin new records.
    #[staticmethod]
    /// `bond_law`, `contact_law`: the laws in Python with which the checkpoint was written; see Scenario.simulation.
    #[pyo3(signature = (path, scenario=None, threads=None, bond_law=None, contact_law=None))]
    fn load(
        py: Python<'_>,
        path: PathBuf,
        scenario: Option<Bound<'_, Scenario>>,
        threads: Option<usize>,
        bond_law: Option<Py<PyAny>>,
        contact_law: Option<Py<PyAny>>,
    ) -> PyResult<Self> {
        let pool = Pool::new(threads)?;
        let checkpoint = detach_here(py, || pool.inside(|| checkpoint::read(&path)))?.or_raise()?;
        let laws = Replacement { bonds: bond_law, contacts: contact_law };
        laws.check_stored(py, &checkpoint.kept)?;
        let scenario = if let Some(scenario) = scenario {
            scenario
        } else {
            let inner = concordem::scenario::Scenario::parse(&path.display().to_string(), &checkpoint.provenance);
            let folder = path.parent().map(PathBuf::from).unwrap_or_default();
            Bound::new(py, Scenario::with_warnings(py, inner.or_raise()?, folder)?)?
        };
        Self::build(&scenario, threads, None, Some((path, checkpoint)), &laws)
    }

    /// Write the complete state and the records so far to a checkpoint; returns the state hash.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<String> {
        let mut inner = self.lock()?;
        inner.change(py, Inner::book_written)?;
        let (state, text) = (&inner.run.state, &self.scenario.get().inner.source.text);
        let kept = Kept { records: &inner.records, histories: &self.histories };
        detach_here(py, || self.pool.inside(|| checkpoint::write_with(&path, state, text, &kept)))?.or_raise()
    }

    /// Everything that steps change, in memory, to go back to with `restore`: state, motion and loads set from Python, records so far.
    fn snapshot(&self, py: Python<'_>) -> PyResult<SimulationSnapshot> {
        let mut inner = self.lock()?;
        inner.change(py, Inner::book_written)?;
        Ok(SimulationSnapshot::of(&inner, &self.identity))
    }

    /// Go back to a snapshot of this simulation; it then continues bit by bit, with its threads and its laws in Python. Arrays of `state`
    /// stay valid and show the state of the snapshot. `net_forces` are zero until the next step.
    ///
    /// Raises ValueError for a snapshot of another simulation.
    fn restore(&self, py: Python<'_>, snapshot: &Bound<'_, SimulationSnapshot>) -> PyResult<()> {
        let kept = snapshot.get();
        kept.check(&self.identity)?;
        let mut inner = self.lock()?;
        inner.change(py, |inner| self.pool.inside(|| kept.restore(inner)))?.or_raise()?;
        inner.change(py, |inner| {
            if inner.written.is_some() {
                inner.written = Some(Written::of(&inner.run.state));
            }
        })
    }

    /// Run until a condition of the scenario's `[stop]` is met; returns its name.
    #[pyo3(signature = (progress=None))]
    fn run(&self, py: Python<'_>, progress: Option<Bound<'_, PyAny>>) -> PyResult<Option<&'static str>> {
        self.go(py, u64::MAX, progress.as_ref())
    }

    /// Compute `count` steps, or fewer if the run ends. Returns the reason for the end, or None.
    #[pyo3(signature = (count=1, progress=None))]
    fn step(&self, py: Python<'_>, count: u64, progress: Option<Bound<'_, PyAny>>) -> PyResult<Option<&'static str>> {
        if count == u64::MAX {
            return Err(PyValueError::new_err("count is out of range; give 0 or more"));
        }
        self.go(py, count, progress.as_ref())
    }

    /// Particles, contacts, cell, and clock.
    #[getter]
    fn state(slf: &Bound<'_, Self>) -> State {
        State::new(slf.clone().unbind())
    }

    /// The scenario.
    #[getter]
    fn scenario(&self, py: Python<'_>) -> Py<Scenario> {
        self.scenario.clone_ref(py)
    }

    /// Reason for the end of the run; None if it has not ended.
    #[getter]
    fn stopped(&self) -> PyResult<Option<&'static str>> {
        Ok(self.lock()?.run.stopped().map(name_of))
    }

    /// Progress of the run, 0 to 1.
    #[getter]
    fn progress(&self) -> PyResult<f64> {
        Ok(self.lock()?.run.progress())
    }

    /// Numbers of particles and bonds, time step bound, and the like; see Summary.
    #[getter]
    fn summary<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let s = &self.summary;
        let (area, length) = s.specimen.unzip();
        let bounds = &s.bounds;
        let fields = (
            s.particles,
            s.bonds,
            s.coordination,
            s.packing_fraction,
            area,
            length,
            bounds.spectral.max(bounds.per_particle),
            s.convergence.map(|c| c.spectral_radius),
            s.memory,
        );
        result(py, "Summary", fields)
    }

    /// The time series so far, a structured array; `concordem.units` gives the units.
    #[getter]
    fn samples<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let inner = self.lock()?;
        let table_rows: Vec<Vec<f64>> = inner.records.samples.iter().map(Record::to_row).collect();
        let columns = Record::COLUMNS
            .iter()
            .enumerate()
            .map(|(k, column)| {
                let values: Vec<f64> = table_rows.iter().map(|row| row[k]).collect();
                TableColumn {
                    name: column.name.to_owned(),
                    unit: column.unit.to_owned(),
                    values: scalars(py, &values).into_any(),
                }
            })
            .collect();
        table(py, columns)
    }

    /// Records of the operators in the scenario's `[[sample]]` so far, by name.
    #[getter]
    fn operator_samples<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let inner = self.lock()?;
        recorded(py, &inner.run.schedule.operators, &inner.records.operators)
    }

    /// Values of an operator at the current positions, by the names of its quantities: numbers, vectors (3,), and tensors (3, 3); with
    /// `grid` one row per cell. `concordem.operators.sampled_operators()` has the names.
    ///
    /// `options`: keys of a table `[[sample]]` such as `region`, `wall`, or `set`, with values as in the constructor of Scenario. Raises
    /// ScenarioError if they do not fit the operator or the scenario.
    #[pyo3(signature = (operator, **options))]
    fn sample<'py>(
        &self,
        py: Python<'py>,
        operator: &str,
        options: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let mut inner = self.lock()?;
        let sample = scheduled(py, self.scenario.get(), &inner.run, operator, options)?;
        let pool = &self.pool;
        let values = inner.change(py, |inner| pool.inside(|| inner.run.sample(&sample)))?.or_raise()?;
        by_quantity(py, &sample, &values)
    }

    /// The event log so far, a structured array.
    #[getter]
    fn events<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        events(py, &self.lock()?.records.events)
    }

    /// Forces of all contacts at the current positions, for operators. Returns Forces.
    ///
    /// `border`: rows of particles. Of the contacts between particles, only those between one of these and another particle are then
    /// evaluated; with an empty list, none. Contacts with walls are the same. Raises ValueError for rows that do not exist.
    #[pyo3(signature = (border=None))]
    fn forces<'py>(&self, py: Python<'py>, border: Option<Vec<u32>>) -> PyResult<Bound<'py, PyAny>> {
        let mut inner = self.lock()?;
        let pool = &self.pool;
        let count = inner.run.state.particles.len();
        let member = border.map(|rows| members_of(&rows, count)).transpose()?;
        let record = |Inner { run, .. }: &mut Inner| {
            pool.inside(|| match &member {
                Some(member) => run.solver.record_border(&mut run.state, member),
                None => run.solver.record(&mut run.state),
            })
        };
        let forces = inner.change(py, record)?.or_raise()?;
        let (c, w) = (&forces.contacts, &forces.walls);
        let contacts = (
            rows::<_, u32>(py, &c.pair, 2)?,
            vectors(py, &c.branch)?,
            vectors(py, &c.point)?,
            vectors(py, &c.force)?,
            vectors(py, &c.moment)?,
        );
        let loads = (scalars(py, &w.particle), vectors(py, &w.point)?, vectors(py, &w.force)?, vectors(py, &w.moment)?);
        let (contacts, loads) = (result(py, "Contacts", contacts)?, result(py, "Loads", loads)?);
        let meshes = PyDict::new(py);
        for (wall, on_vertices) in
            inner.run.state.walls.iter().zip(&w.vertices).filter(|(wall, _)| wall.mesh().is_some())
        {
            meshes.set_item(&wall.name, vectors(py, on_vertices)?)?;
        }
        result(py, "Forces", (contacts, loads, meshes))
    }

    /// All bonds at the current positions, broken ones included, with their damage. Returns Bonds.
    ///
    /// Broken bonds keep the direction that they had when they broke, and have lost all strength.
    fn bonds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let mut inner = self.lock()?;
        let pool = &self.pool;
        let find = |Inner { run, .. }: &mut Inner| {
            pool.inside(|| run.solver.record(&mut run.state).map(|forces| SampledBonds::of(&run.state, &forces)))
        };
        let bonds = inner.change(py, find)?.or_raise()?;
        let fields = (
            rows::<_, u32>(py, &bonds.pair, 2)?,
            vectors(py, &bonds.midpoint)?,
            vectors(py, &bonds.normal)?,
            scalars(py, &bonds.damage),
            scalars(py, &bonds.lost_strength),
        );
        result(py, "Bonds", fields)
    }

    /// Velocities (m/s) and angular velocities (rad/s) that prescribed degrees of freedom take from the next step on, (n, 3) each, one
    /// row per particle; rows of free particles, and components that `[[prescribe]]` does not prescribe, have no effect.
    ///
    /// Histories of the scenario set the motion of their particles in every step, whatever is set here. Raises ValueError for arrays of
    /// another length and numbers that are not finite.
    fn set_motion(&self, py: Python<'_>, velocity: Vectors<'_>, angular_velocity: Vectors<'_>) -> PyResult<()> {
        let (velocity, angular) = (velocity.get()?, angular_velocity.get()?);
        let mut inner = self.lock()?;
        let particles = inner.run.state.particles.len();
        if velocity.len() != particles || angular.len() != particles {
            let (v, a) = (velocity.len(), angular.len());
            let message = format!(
                "{v} velocities and {a} angular velocities for {particles} particles; give one row per particle"
            );
            return Err(PyValueError::new_err(message));
        }
        let finite = |vectors: &[concordem::math::Vec3]| vectors.iter().all(|v| v.iter().all(|c| c.is_finite()));
        if !(finite(velocity) && finite(angular)) {
            return Err(PyValueError::new_err("a velocity is not finite"));
        }
        inner.change(py, |Inner { run, .. }| {
            run.state.motion = Some(velocity.iter().copied().zip(angular.iter().copied()).collect());
        })
    }

    /// Loads on the particles from the next step on, besides those of the scenario: forces (N) and moments about the centers (N·m),
    /// (n, 3) each, one row per particle. They stay until the next call.
    ///
    /// Raises ValueError for arrays of another length, numbers that are not finite, and scenarios whose loads change with time.
    #[pyo3(signature = (force, moment=None))]
    fn set_loads(&self, py: Python<'_>, force: Vectors<'_>, moment: Option<Vectors<'_>>) -> PyResult<()> {
        let force = force.get()?;
        let moment = moment.as_ref().map(Vectors::get).transpose()?;
        let mut inner = self.lock()?;
        let particles = inner.run.state.particles.len();
        for (name, given) in [("forces", Some(force.len())), ("moments", moment.map(<[_]>::len))] {
            if let Some(given) = given.filter(|given| *given != particles) {
                let message = format!("{given} {name} for {particles} particles; give one row per particle");
                return Err(PyValueError::new_err(message));
            }
        }
        if !force.iter().chain(moment.into_iter().flatten()).all(|v| v.iter().all(|c| c.is_finite())) {
            return Err(PyValueError::new_err("a load is not finite"));
        }
        if !inner.run.schedule.histories.membranes.is_empty() {
            let message =
                "the scenario's [[membrane]] sets the loads in every step; remove it, and give its forces here";
            return Err(PyValueError::new_err(message));
        }
        if !inner.run.schedule.histories.loads.is_empty() {
            let message = "the histories of the scenario's [[force]] set the loads in every step; remove their `history`, and give these \
                           loads here";
            return Err(PyValueError::new_err(message));
        }
        inner.change(py, |Inner { run, loads, .. }| {
            let particles = &mut run.state.particles;
            particles.loads.clone_from(loads);
            for (p, force) in force.iter().enumerate() {
                let moment = moment.map_or_else(concordem::math::Vec3::zeros, |moment| moment[p]);
                if *force != concordem::math::Vec3::zeros() || moment != concordem::math::Vec3::zeros() {
                    particles.add_load(p as u32, *force, moment);
                }
            }
        })
    }

    /// Names of the walls that are meshes.
    #[getter]
    fn mesh_names(&self) -> PyResult<Vec<String>> {
        let inner = self.lock()?;
        Ok(inner.run.state.walls.iter().filter(|wall| wall.mesh().is_some()).map(|wall| wall.name.clone()).collect())
    }

    /// Vertices, triangles, velocities, and forces of the mesh `name`, as copies. Returns MeshState.
    fn mesh<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let inner = self.lock()?;
        let wall = mesh_number(&inner.run, name)?;
        let Some(mesh) = inner.run.state.walls[wall].mesh() else { return Err(no_mesh(&inner.run, name)) };
        let fields = (
            vectors(py, &mesh.position)?,
            rows::<_, u32>(py, mesh.triangles(), 3)?,
            vectors(py, &mesh.previous_velocity)?,
            vectors(py, &mesh.force)?,
        );
        result(py, "MeshState", fields)
    }

    /// Velocities of the vertices of the mesh `name` from the next step on, m/s, (n, 3).
    ///
    /// Raises ValueError for a mesh that follows `motion` of the scenario, another number of rows, and numbers that are not finite.
    fn drive_mesh(&self, py: Python<'_>, name: &str, velocities: Vectors<'_>) -> PyResult<()> {
        let velocity = velocities.get()?;
        let mut inner = self.lock()?;
        let wall = free_mesh(&inner.run, name, &[velocity])?;
        let drive = move |Inner { run, .. }: &mut Inner| match run.state.walls[wall].mesh_mut() {
            Some(mesh) => mesh.drive(velocity),
            None => Ok(()),
        };
        inner.change(py, drive)?.map_err(|error| PyValueError::new_err(format!("mesh \"{name}\": {error}")))
    }

    /// Place the vertices of the mesh `name`: `positions` (m, (n, 3)), to which they came with `velocities` (m/s, (n, 3)) in the last step.
    ///
    /// For a host that advances the vertices with the forces of a step: call it after every step. The vertices then rest until the next
    /// call. The work of the vertices counts in the ledger.
    ///
    /// Raises ValueError for a mesh that follows `motion` of the scenario, another number of rows, numbers that are not finite, and
    /// triangles without area; the mesh then stays as it was.
    fn place_mesh(&self, py: Python<'_>, name: &str, positions: Vectors<'_>, velocities: Vectors<'_>) -> PyResult<()> {
        let (position, velocity) = (positions.get()?, velocities.get()?);
        let mut inner = self.lock()?;
        let wall = free_mesh(&inner.run, name, &[position, velocity])?;
        let place = move |Inner { run, .. }: &mut Inner| {
            let state = &mut run.state;
            let Some(mesh) = state.walls[wall].mesh_mut() else { return Ok(()) };
            let work = mesh.place(position, velocity, state.clock.dt)?;
            state.ledger.add_boundary_work(work);
            Ok(())
        };
        let placed: Result<(), concordem::state::MeshError> = inner.change(py, place)?;
        placed.map_err(|error| PyValueError::new_err(format!("mesh \"{name}\": {error}")))
    }

    /// Net contact force (N) and torque (N·m) of the last step on every particle, (n, 3) each.
    fn net_forces<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let inner = self.lock()?;
        let solver = &inner.run.solver;
        Ok((vectors(py, solver.forces())?.into_any(), vectors(py, solver.torques())?.into_any()))
    }

    /// Stress `(1/V) Σ l⊗f` of the periodic cell in the last step, Pa, (3, 3); None without a cell.
    #[getter]
    fn cell_stress<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let inner = self.lock()?;
        let Some(cell) = inner.run.state.cell else { return Ok(None) };
        Ok(Some(tensor(py, &(inner.run.last_report().virial / cell.volume()))?.into_any()))
    }

    /// Hash of the complete state.
    fn state_hash(&self, py: Python<'_>) -> PyResult<String> {
        let mut inner = self.lock()?;
        inner.change(py, Inner::book_written)?;
        self.pool.inside(|| hash::state_hash(&inner.run.state)).or_raise()
    }

    fn __repr__(&self) -> PyResult<String> {
        let inner = self.lock()?;
        let state = &inner.run.state;
        Ok(format!(
            "<concordem.Simulation: {} particles, {} bonds, step {}>",
            state.particles.len(),
            state.bond_count(),
            state.clock.step
        ))
    }
}

/// Whether each of `count` particles is among these rows.
fn members_of(rows: &[u32], count: usize) -> PyResult<Vec<bool>> {
    let mut member = vec![false; count];
    for &row in rows {
        let Some(place) = member.get_mut(row as usize) else {
            let message = format!("border names row {row}, but there are {count} particles; rows are counted from 0");
            return Err(PyValueError::new_err(message));
        };
        *place = true;
    }
    Ok(member)
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Simulation>()?;
    module.add_class::<SimulationSnapshot>()?;
    module.add_class::<State>()?;
    sampled::register(module)
}
