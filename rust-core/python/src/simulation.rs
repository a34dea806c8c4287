//! A running simulation.
//!
//! The interpreter's lock is released during steps. Every 50 ms, control returns to Python between two steps; Python may raise
//! KeyboardInterrupt, after which the simulation can continue.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use concordem::assembly::{Placed, Summary};
use concordem::output::{checkpoint, hash};
use concordem::schedule::simulation::Written;
use concordem::schedule::{Record, StopReason};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::addresses::Addresses;
use crate::arrays::{Pairs, TableColumn, Vector, Vectors, result, scalars, table, tensor, vectors};
use crate::errors::{OrRaise, detach_here};
use crate::meshes::{mesh_names, mesh_state};
use crate::results::events;
use crate::scenario::Scenario;
use crate::scripted::Replacement;
use crate::shared::{Access, Shared};
use crate::state::State;
use crate::work::{Pool, REPORT, close, reporter};

pub mod build;
mod evaluated;
mod given;
mod inner;
mod kept;
mod sampled;
mod snapshot;
mod walls;
mod written;

use build::Options;
pub use inner::Inner;
pub use kept::HISTORIES;
use kept::{Kept, Records};
use sampled::recorded;
pub use sampled::{by_quantity, scheduled};
pub use snapshot::SimulationSnapshot;

/// A simulation of a scenario.
#[pyclass(frozen, weakref, module = "concordem")]
pub struct Simulation {
    inner: Shared<Inner>,
    pool: Pool,
    /// The packing, which a change of the scenario does not make again.
    placed: Arc<Placed>,
    /// Laws in Python.
    laws: Replacement,
    /// Names of the histories of those of bonds and of contacts.
    histories: [Option<String>; 2],
}

impl Simulation {
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
            let (share, step) = (inner.share(), inner.run.state.clock.step);
            let sample = inner.records.samples.last().copied().unwrap_or_default();
            drop(inner);
            if let Err(error) = py.check_signals() {
                break Err(error);
            }
            if let Some(report) = &report
                && last.elapsed() >= REPORT
            {
                last = Instant::now();
                let share = if steps == u64::MAX { share } else { Some(1.0 - left as f64 / steps as f64) };
                let share = share.unwrap_or(f64::NAN);
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

/// Facts about an assembled system as a Python `Summary`.
pub fn summary_of<'py>(py: Python<'py>, s: &Summary) -> PyResult<Bound<'py, PyAny>> {
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
    /// A simulation of a scenario; see Scenario.simulation, which calls it by name, because scenarios do not know simulations.
    #[staticmethod]
    fn _of(
        scenario: &Bound<'_, Scenario>,
        threads: Option<usize>,
        progress: Option<Bound<'_, PyAny>>,
        bond_law: Option<Py<PyAny>>,
        contact_law: Option<Py<PyAny>>,
        snapshots: bool,
    ) -> PyResult<Self> {
        let laws = Replacement { bonds: bond_law, contacts: contact_law };
        Self::build(scenario, Options { threads, snapshots, laws }, progress.as_ref(), None)
    }

    /// Continue from a checkpoint that `save` wrote, or from a result; the records so far come with it, from a result without its
    /// snapshots. `scenario`: continue with this scenario instead of the stored one; other tables `[[sample]]` begin new records.
    ///
    /// `bond_law`, `contact_law`: the laws in Python with which the checkpoint was written; `snapshots`: see Scenario.simulation.
    #[staticmethod]
    #[pyo3(signature = (path, scenario=None, threads=None, bond_law=None, contact_law=None, snapshots=true))]
    fn load(
        py: Python<'_>,
        path: PathBuf,
        scenario: Option<Bound<'_, Scenario>>,
        threads: Option<usize>,
        bond_law: Option<Py<PyAny>>,
        contact_law: Option<Py<PyAny>>,
        snapshots: bool,
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
        Self::build(&scenario, Options { threads, snapshots, laws }, None, Some((path, checkpoint)))
    }

    /// Write the complete state and the records so far to a checkpoint; returns the state hash.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<String> {
        let mut inner = self.lock()?;
        inner.change(py, Inner::book_written)?;
        let (state, text) = (&inner.run.state, &inner.header.scenario);
        let kept = Kept { records: &inner.records, histories: &self.histories };
        detach_here(py, || self.pool.inside(|| checkpoint::write_with(&path, state, text, &kept)))?.or_raise()
    }

    /// Write the result of the run so far, as the program does: time series, operators, events, snapshots, and the state,
    /// for reports, exports, measurements, and ParaView. Returns its path.
    ///
    /// Parameters
    /// ----------
    /// path : path of the HDF5 file; by default the scenario's, as for the program.
    /// overwrite : whether to replace a file that exists.
    ///
    /// A run that has ended gives the file that the program gives for the same scenario, but for the entries `run_id`, `wall_time_s`,
    /// `ended_utc`, `first_step_after_s`, `stability_bound_s`, `scenario_file`, and `threads`. Of a run that has not ended, the result also has record
    /// and snapshot of the present state, and says that it has not ended. If Python has changed the run, `changed_from_python` says how.
    ///
    /// Raises
    /// ------
    /// ResultError : the file exists, or cannot be written. ValueError : the name does not end in .h5, .hdf5, or .vtkhdf.
    ///
    /// >>> import concordem, os, tempfile
    /// >>> simulation = concordem.Scenario.template("hertz-impact").simulation(threads=1)
    /// >>> reason = simulation.step(20)
    /// >>> path = simulation.write(os.path.join(tempfile.mkdtemp(), "impact.h5"))
    /// >>> concordem.Result(path).provenance["stopped_because"]
    /// 'not ended: written from Python after step 20'
    #[pyo3(signature = (path=None, overwrite=false))]
    fn write(&self, py: Python<'_>, path: Option<PathBuf>, overwrite: bool) -> PyResult<PathBuf> {
        let mut inner = self.lock()?;
        let scenario = inner.scenario.get();
        let path = path.map_or_else(|| scenario.result_path(), Ok)?;
        let csv = scenario.inner.output.csv;
        inner.change(py, |inner| self.pool.inside(|| inner.write(&path, csv, overwrite)))?.or_raise()
    }

    /// Keep a snapshot of the present state for the result, besides those that the scenario asks for.
    fn keep_snapshot(&self, py: Python<'_>) -> PyResult<()> {
        let mut inner = self.lock()?;
        inner.change(py, |inner| self.pool.inside(|| inner.keep_snapshot()))?.or_raise()
    }

    /// Everything that steps change, in memory, to go back to with `restore`: state, motion and loads set from Python, records so far.
    fn snapshot(&self, py: Python<'_>) -> PyResult<SimulationSnapshot> {
        let mut inner = self.lock()?;
        inner.change(py, Inner::book_written)?;
        Ok(SimulationSnapshot::of(&inner))
    }

    /// Go back, or on, to a snapshot of this simulation or of another one of the same scenario; it then continues bit by bit, with the
    /// threads of this one. Arrays of `state` stay valid and show the state of the snapshot. `net_forces` are zero until the next step.
    ///
    /// Raises ValueError for a snapshot of another scenario, or of a simulation with other laws in Python.
    fn restore(&self, py: Python<'_>, snapshot: &Bound<'_, SimulationSnapshot>) -> PyResult<()> {
        let kept = snapshot.get();
        let mut inner = self.lock()?;
        kept.check(&inner)?;
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

    /// The scenario, with what `change` has changed.
    #[getter]
    fn scenario(&self, py: Python<'_>) -> PyResult<Py<Scenario>> {
        Ok(self.lock()?.scenario.clone_ref(py))
    }

    /// Reason for the end of the run; None if it has not ended.
    #[getter]
    fn stopped(&self) -> PyResult<Option<&'static str>> {
        Ok(self.lock()?.run.stopped().map(name_of))
    }

    /// Progress of the run, or of its present stage, 0 to 1, by the stop nearest to being met; None if no stop can be estimated.
    #[getter]
    fn progress(&self) -> PyResult<Option<f64>> {
        Ok(self.lock()?.share())
    }

    /// Numbers of particles and bonds, time step bound, and the like; see Summary.
    #[getter]
    fn summary<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        summary_of(py, &self.lock()?.summary)
    }

    /// The time series so far, a structured array; `concordem.units` gives the units.
    #[getter]
    fn samples<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let inner = self.lock()?;
        let table_rows: Vec<Vec<f64>> = inner.records.samples.iter().map(Record::to_row).collect();
        let columns = Record::columns(inner.run.schedule.confinement.is_some())
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
        let state = &inner.run.state;
        let present = (&state.particles, state.cell.as_ref());
        let sample = scheduled(py, &inner.scenario.get().inner, present, ("sample", operator), options)?;
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
        evaluated::forces(py, &mut self.lock()?, &self.pool, border)
    }

    /// All bonds at the current positions, broken ones included, with their damage. Returns Bonds.
    ///
    /// Broken bonds keep the direction that they had when they broke, and have lost all strength.
    fn bonds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        evaluated::bonds(py, &mut self.lock()?, &self.pool)
    }

    /// Velocities (m/s) and angular velocities (rad/s) that prescribed degrees of freedom take from the next step on, (n, 3) each, one
    /// row per particle; rows of free particles, and components that `[[prescribe]]` does not prescribe, have no effect.
    ///
    /// Histories of the scenario set the motion of their particles in every step, whatever is set here. Raises ValueError for arrays of
    /// another length and numbers that are not finite.
    fn set_motion(&self, py: Python<'_>, velocity: Vectors<'_>, angular_velocity: Vectors<'_>) -> PyResult<()> {
        given::motion(py, &mut self.lock()?, velocity.get()?, angular_velocity.get()?)
    }

    /// Loads on the particles from the next step on, besides those of the scenario: forces (N) and moments about the centers (N·m),
    /// (n, 3) each, one row per particle. They stay until the next call.
    ///
    /// Raises ValueError for arrays of another length, numbers that are not finite, and scenarios whose loads change with time.
    #[pyo3(signature = (force, moment=None))]
    fn set_loads(&self, py: Python<'_>, force: Vectors<'_>, moment: Option<Vectors<'_>>) -> PyResult<()> {
        given::loads(py, &mut self.lock()?, force.get()?, moment.as_ref().map(Vectors::get).transpose()?)
    }

    /// Change keys of the scenario while the simulation goes on: those that `--from` of the program may change, such as gravity, damping,
    /// stop, loading, prescribed motions, forces, velocities and servos of walls, and numbers in the tables of laws.
    ///
    /// Parameters
    /// ----------
    /// settings : key paths and values, as for Scenario.with_settings.
    ///
    /// The simulation goes on as if it were saved and loaded with the changed scenario: the energy balance starts anew where energies jump
    /// without work. Arrays of `state` stay valid. Results and checkpoints have the changed scenario, and name the changes.
    ///
    /// Raises
    /// ------
    /// ScenarioError : a key cannot change, with the reason, or its value is wrong; the simulation then stays as it was. UnstableError : the
    /// time step is too large for the changed scenario.
    ///
    /// >>> import concordem
    /// >>> simulation = concordem.Scenario.template("hertz-impact").simulation(threads=1)
    /// >>> reason = simulation.step(10)
    /// >>> simulation.change({"integration.gravity": [0, 0, -9.81]})
    /// >>> simulation.scenario.to_dict()["integration"]["gravity"][2]
    /// -9.81
    fn change(&self, settings: &Bound<'_, PyAny>) -> PyResult<()> {
        self.changed(settings)
    }

    /// Energies, works, and dissipations so far, J, of the last step, by the names of the samples.
    fn energies<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        evaluated::energies(py, &self.lock()?.run)
    }

    /// Names of the walls, in the order of their numbers in tables of contacts.
    #[getter]
    fn wall_names(&self) -> PyResult<Vec<String>> {
        Ok(self.lock()?.run.state.walls.iter().map(|wall| wall.name.clone()).collect())
    }

    /// Place, velocities, force, and torque of the wall `name`, as copies. Returns WallState.
    fn wall<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        walls::state(py, &self.lock()?.run, name)
    }

    /// Move the wall `name` from the next step on.
    ///
    /// Parameters
    /// ----------
    /// velocity : m/s, (3,).
    /// angular_velocity : about the axis of its `rotation` in the scenario, rad/s, (3,); by default as before.
    ///
    /// Raises
    /// ------
    /// ValueError : there is no such wall; a history, a servo, or the loading moves it; it is a mesh, which `drive_mesh` moves; it has no
    /// axis; a number is not finite.
    #[pyo3(signature = (name, velocity, angular_velocity=None))]
    fn drive_wall(
        &self,
        py: Python<'_>,
        name: &str,
        velocity: Vector,
        angular_velocity: Option<Vector>,
    ) -> PyResult<()> {
        walls::drive(py, &mut self.lock()?, name, velocity.0, angular_velocity.map(|vector| vector.0))
    }

    /// Put the wall `name` at a displacement from its place in the scenario, m, (3,), at once: contacts with particles jump, and the energy
    /// balance starts anew. Raises ValueError as `drive_wall`.
    fn place_wall(&self, py: Python<'_>, name: &str, displacement: Vector) -> PyResult<()> {
        walls::place(py, &mut self.lock()?, name, displacement.0)
    }

    /// Let bonds break in the next step, with entries in the event log; their energy counts as damage. Returns how many there are.
    ///
    /// Parameters
    /// ----------
    /// pairs : ids of the two particles of each bond, (n, 2).
    ///
    /// Raises
    /// ------
    /// ValueError : no such particle, or a pair without an intact bond; nothing is changed then.
    fn break_bonds(&self, py: Python<'_>, pairs: Pairs<'_>) -> PyResult<usize> {
        given::broken_bonds(py, &mut self.lock()?, pairs.get()?)
    }

    /// Bond all pairs of particles whose center distance is at most `interaction_ratio` times the sum of their radii, as `[[bonding]]` does.
    /// Pairs that have a bond, or had one that broke, get none. Returns the number of new bonds.
    ///
    /// Raises
    /// ------
    /// ValueError : the scenario has no [bonds], or their law is one in Python. SolverError : the new bonds are too stiff for the time step;
    /// nothing is changed then.
    fn make_bonds(&self, py: Python<'_>, interaction_ratio: f64) -> PyResult<usize> {
        if self.laws.bonds.is_some() {
            let message = "bonds of a law in Python cannot be made during a run; bond the particles in the scenario";
            return Err(PyValueError::new_err(message));
        }
        given::new_bonds(py, &mut self.lock()?, &self.pool, interaction_ratio)
    }

    /// Names of the walls that are meshes.
    #[getter]
    fn mesh_names(&self) -> PyResult<Vec<String>> {
        Ok(mesh_names(&self.lock()?.run))
    }

    /// Vertices, triangles, velocities, and forces of the mesh `name`, as copies. Returns MeshState.
    fn mesh<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        mesh_state(py, &self.lock()?.run, name)
    }

    /// Velocities of the vertices of the mesh `name` from the next step on, m/s, (n, 3).
    ///
    /// Raises ValueError for a mesh that follows `motion` of the scenario, another number of rows, and numbers that are not finite.
    fn drive_mesh(&self, py: Python<'_>, name: &str, velocities: Vectors<'_>) -> PyResult<()> {
        given::mesh_velocities(py, &mut self.lock()?, name, velocities.get()?)
    }

    /// Place the vertices of the mesh `name`: `positions` (m, (n, 3)), to which they came with `velocities` (m/s, (n, 3)) in the last step.
    ///
    /// For a host that advances the vertices with the forces of a step: call it after every step. The vertices then rest until the next
    /// call. The work of the vertices counts in the ledger.
    ///
    /// Raises ValueError for a mesh that follows `motion` of the scenario, another number of rows, numbers that are not finite, and
    /// triangles without area; the mesh then stays as it was.
    fn place_mesh(&self, py: Python<'_>, name: &str, positions: Vectors<'_>, velocities: Vectors<'_>) -> PyResult<()> {
        given::mesh_positions(py, &mut self.lock()?, name, positions.get()?, velocities.get()?)
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

    /// A simulation in the same state, with the same scenario and laws, which goes on for itself; `copy.copy` and `copy.deepcopy` give it.
    fn __copy__(&self, py: Python<'_>) -> PyResult<Self> {
        self.copied(py)
    }

    fn __deepcopy__(&self, py: Python<'_>, _memo: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.copied(py)
    }

    /// Pickle goes through a checkpoint.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let (py, this) = (slf.py(), slf.get());
        let laws = this.laws.clone_ref(py);
        let (scenario, keeps_snapshots) = {
            let inner = this.lock()?;
            (inner.scenario.clone_ref(py), inner.keeps_snapshots)
        };
        let settings = (this.pool.wanted(), laws.bonds, laws.contacts, keeps_snapshots);
        py.import("concordem._copies")?.call_method1("reduced", (slf, scenario, settings))
    }

    /// Table of the main facts, for notebooks.
    fn _repr_html_<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("concordem._html")?.call_method1("simulation", (slf,))
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

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Simulation>()?;
    module.add_class::<SimulationSnapshot>()?;
    module.add_class::<State>()?;
    sampled::register(module)
}
