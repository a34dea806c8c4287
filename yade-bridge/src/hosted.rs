//! Bonds and contacts between particles of a host.
//!
//! `advance` computes whole steps instead of the host (hand-over). `contact_step` computes the forces of one step at the positions of
//! the host's bodies and adds them to the host's forces; the host does the rest (bonded engine).

mod clumps;
mod host;
mod motion;

use std::path::PathBuf;
use std::time::{Duration, Instant};

use concordem::assembly::assemble;
use concordem::law::cpm::{CpmParameters, CpmState, friction_of_yade};
use concordem::output::{checkpoint, hash};
use concordem::solver::own_thread::{self, Workers};
use concordem::solver::{Solver, SolverError};
use concordem::state::Cell;
use concordem::state::contacts::ContactFlags;
use concordem_yade::assembly::jointed::Crack;
use concordem_yade::assembly::{
    Assembly, Bodies, Contacts, ContactsWithHistories, Origin, PAUSE_SOFT, PairParameters, STORED, Spheres, cell_of,
    motion_measure,
};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Deserialize;

use concordem_python::arrays::{
    Flags, Images, Indices, Pairs, Rows, Scalars, Tensor, Vector, Vectors, rows, scalars, tensor, tensors, vectors,
};
use concordem_python::errors::{OrRaise, caught, of_assembly};
use concordem_python::scenario::{Scenario, table_of};
use concordem_python::shared::{Access, Shared};
use concordem_python::state::contact_table;
use concordem_python::warnings::warn;
use concordem_python::work::{Pool, guarded};
use host::{Engines, Host};
use motion::{Motion, MotionLayout};

const NO_HOST: &str = "no host is attached; call attach() first";

struct Inner {
    assembly: Assembly,
    host: Option<Host>,
    /// The engines of the host's scene when they were last checked.
    engines: Option<Engines>,
}

/// An assembly that a host drives.
#[pyclass(frozen, weakref, module = "concordem._core")]
pub struct Hosted {
    inner: Shared<Inner>,
    /// `None`: all processors.
    workers: Option<Workers>,
}

/// A crack for Python, see `Hosted.take_happenings`.
type CrackRow = (u64, [u32; 2], u8, [f64; 3], [f64; 3], f64, f64, f64);

/// An entry of a dictionary; an error if it is missing.
fn get<'py, T: FromPyObjectOwned<'py, Error = PyErr>>(dict: &Bound<'py, PyDict>, name: &str) -> PyResult<T> {
    let value = dict.get_item(name)?.ok_or_else(|| PyValueError::new_err(format!("`{name}` is missing")))?;
    value.extract().map_err(|error: PyErr| {
        let py = dict.py();
        let named = PyValueError::new_err(format!("`{name}`: {}", error.value(py)));
        named.set_cause(py, Some(error));
        named
    })
}

fn same_length(name: &str, found: usize, wanted: usize) -> PyResult<()> {
    if found == wanted {
        Ok(())
    } else {
        Err(PyValueError::new_err(format!("`{name}` has {found} entries, but must have {wanted}")))
    }
}

/// Arrays of the host's bodies.
struct BodyColumns<'py> {
    id: Indices<'py>,
    position: Vectors<'py>,
    velocity: Vectors<'py>,
    orientation: Rows<'py>,
    angular_velocity: Vectors<'py>,
    radius: Scalars<'py>,
    mass: Scalars<'py>,
    inertia: Scalars<'py>,
    material: Indices<'py>,
    constraint: Indices<'py>,
    lost: Indices<'py>,
}

impl<'py> BodyColumns<'py> {
    fn of(bodies: &Bound<'py, PyDict>) -> PyResult<Self> {
        Ok(Self {
            id: get(bodies, "id")?,
            position: get(bodies, "position")?,
            velocity: get(bodies, "velocity")?,
            orientation: get(bodies, "orientation")?,
            angular_velocity: get(bodies, "angular_velocity")?,
            radius: get(bodies, "radius")?,
            mass: get(bodies, "mass")?,
            inertia: get(bodies, "inertia")?,
            material: get(bodies, "material")?,
            constraint: get(bodies, "constraint")?,
            lost: get(bodies, "lost")?,
        })
    }

    fn get(&self) -> PyResult<Bodies<'_>> {
        Ok(Bodies {
            id: self.id.get()?,
            position: self.position.get()?,
            velocity: self.velocity.get()?,
            orientation: self.orientation.get()?,
            angular_velocity: self.angular_velocity.get()?,
            radius: self.radius.get()?,
            mass: self.mass.get()?,
            inertia: self.inertia.get()?,
            material: self.material.get()?,
            constraint: self.constraint.get()?,
            lost: self.lost.get()?,
        })
    }
}

/// Parameters of the concrete law, one entry per pair of materials `(a, b)` with `a ≤ b`.
fn pair_parameters(list: &Bound<'_, PyAny>) -> PyResult<Vec<PairParameters>> {
    let mut pairs = Vec::new();
    for item in list.try_iter()? {
        let (a, b, parameters): (u16, u16, Bound<'_, PyDict>) = item?.extract()?;
        pairs.push(PairParameters { a, b, parameters: cpm_parameters(&parameters)? });
    }
    Ok(pairs)
}

/// Parameters of the concrete law.
fn cpm_parameters(parameters: &Bound<'_, PyDict>) -> PyResult<CpmParameters> {
    let wrong = |error: &dyn std::fmt::Display| PyValueError::new_err(error.to_string());
    let mut table = table_of(parameters.as_any(), "")?;
    // YADE's materials have the angle, its contacts the tangent.
    if let Some(angle) = table.remove("friction_angle").and_then(|angle| angle.as_float()) {
        let friction = friction_of_yade(angle).map_err(|error| wrong(&error))?;
        table.insert("friction_coefficient".to_owned(), friction.into());
    }
    CpmParameters::deserialize(toml::Value::Table(table)).map_err(|error| wrong(&error))
}

/// A structure from a dictionary.
fn read_table<T: serde::de::DeserializeOwned>(table: &Bound<'_, PyDict>) -> PyResult<T> {
    let table = toml::Value::Table(table_of(table.as_any(), "")?);
    T::deserialize(table).map_err(|error| PyValueError::new_err(error.to_string()))
}

/// Structures from dictionaries.
fn read_tables<T: serde::de::DeserializeOwned>(tables: &[Bound<'_, PyDict>]) -> PyResult<Vec<T>> {
    tables.iter().map(read_table).collect()
}

/// The cell from (edges, deformation gradient, velocity gradient).
fn cell_from((edges, gradient, rate): (Tensor, Tensor, Tensor), dt: f64) -> Cell {
    cell_of(edges.0, gradient.0, rate.0, dt)
}

impl Hosted {
    /// Compute within a step of the host.
    fn compute<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        match &self.workers {
            Some(workers) => own_thread::inside(workers, work),
            None => Pool::All.inside(work),
        }
    }

    /// Compute apart from the steps of the host.
    fn inside<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        match &self.workers {
            Some(workers) => workers.install(work),
            None => Pool::All.inside(work),
        }
    }

    fn threads(&self) -> usize {
        self.workers.as_ref().map_or_else(|| Pool::All.threads(), Workers::threads)
    }

    /// Lock for a step of the host, whose waiting threads make room.
    fn read_for_step(&self, py: Python<'_>) -> PyResult<Access<'_, Inner>> {
        // A reader may hold the lock while it makes objects of Python.
        let inner = self.wait(py)?;
        let threads = self.threads();
        let pause = inner.host.as_ref().and_then(|host| host.pause);
        if let Some(pause) = pause.filter(|_| inner.assembly.wants_host_threads_paused(threads)) {
            // Safety: OpenMP's function, called by the thread that starts the host's parallel loops.
            unsafe { pause(PAUSE_SOFT) };
        }
        Ok(inner)
    }

    /// Lock; wait while another thread reads, or computes a step.
    fn wait(&self, py: Python<'_>) -> PyResult<Access<'_, Inner>> {
        self.inner.wait(py)
    }
}

#[pymethods]
impl Hosted {
    /// Spheres with bonds and contacts of the concrete law, with their histories.
    ///
    /// `bodies`: arrays id, position, velocity, orientation (x, y, z, w), angular_velocity, radius, mass, inertia, material,
    /// constraint, lost (number of bonds and contacts that each body has already lost). `contacts`: pair (rows of bodies), image, bonded,
    /// length (reference), area, normal, distance, history, radii, reference_overlap, stored, see [`Contacts`].
    /// `laws`: (material, material, parameters). `clumps`: see [`clumps::of_arrays`]. `own`: parameters of contacts that differ from those of
    /// their materials; `contacts` then also has own, one more than the place of its own, or 0.
    #[staticmethod]
    #[pyo3(signature = (
        bodies, contacts, laws, materials, dt, kinematics, damping=0.0, gravity=None, cell=None, threads=None, clumps=None,
        own=None
    ))]
    fn concrete(
        bodies: &Bound<'_, PyDict>,
        contacts: &Bound<'_, PyDict>,
        laws: &Bound<'_, PyAny>,
        materials: usize,
        dt: f64,
        kinematics: &str,
        damping: f64,
        gravity: Option<Vector>,
        cell: Option<(Tensor, Tensor, Tensor)>,
        threads: Option<usize>,
        clumps: Option<&Bound<'_, PyDict>>,
        own: Option<Vec<Bound<'_, PyDict>>>,
    ) -> PyResult<Self> {
        let columns = BodyColumns::of(bodies)?;
        let pair: Pairs<'_> = get(contacts, "pair")?;
        let (image, bonded): (Images<'_>, Flags<'_>) = (get(contacts, "image")?, get(contacts, "bonded")?);
        let (length, area): (Scalars<'_>, Scalars<'_>) = (get(contacts, "length")?, get(contacts, "area")?);
        let (normal, distance): (Vectors<'_>, Scalars<'_>) = (get(contacts, "normal")?, get(contacts, "distance")?);
        let (history, stored): (Rows<'_>, Rows<'_>) = (get(contacts, "history")?, get(contacts, "stored")?);
        for (name, table, wanted) in
            [("history", &history, size_of::<CpmState>() / 8), ("stored", &stored, STORED.len())]
        {
            let (rows, width) = table.shape();
            if rows > 0 && width != wanted {
                return Err(PyValueError::new_err(format!("`{name}` has {width} columns, but must have {wanted}")));
            }
        }
        let radii: Scalars<'_> = get(contacts, "radii")?;
        let reference_overlap: Scalars<'_> = get(contacts, "reference_overlap")?;
        let own = own.unwrap_or_default();
        let own_of: Option<Indices<'_>> = if own.is_empty() { None } else { Some(get(contacts, "own")?) };
        let given = Contacts {
            pair: pair.get()?,
            image: image.get()?,
            bonded: bonded.get()?,
            length: length.get()?,
            area: area.get()?,
            normal: normal.get()?,
            distance: distance.get()?,
            history: history.get()?,
            radii: radii.get()?,
            reference_overlap: reference_overlap.get()?,
            stored: stored.get()?,
            own: own_of.as_ref().map(Indices::get).transpose()?.unwrap_or_default(),
        };
        let origin = Origin::Concrete {
            kinematics: motion_measure(kinematics).map_err(PyValueError::new_err)?,
            materials,
            damping,
            gravity: gravity.unwrap_or_default().0.into(),
            pairs: pair_parameters(laws)?,
            own: own.iter().map(cpm_parameters).collect::<PyResult<_>>()?,
        };
        let cell = cell.map(|cell| cell_from(cell, dt));
        let clumps = clumps.map(clumps::of_arrays).transpose()?.unwrap_or_default();
        let made =
            Assembly::concrete(&columns.get()?, &given, &clumps, origin, cell, dt).map_err(PyValueError::new_err)?;
        Self::new(made, threads)
    }

    /// Spheres of YADE's `CohFrictMat` (`law` is "cohesive") or `JCFpmMat` ("jointed") with their contacts.
    ///
    /// `bodies`, `clumps`: as in `concrete`. `contacts`: pair (rows of bodies), image, normal, distance, history, see
    /// [`ContactsWithHistories`]. `materials`: attributes of each; `rules`: what holds for all contacts.
    #[staticmethod]
    #[pyo3(signature = (law, bodies, contacts, materials, rules, dt, kinematics, cell=None, threads=None, clumps=None))]
    fn with_histories(
        law: &str,
        bodies: &Bound<'_, PyDict>,
        contacts: &Bound<'_, PyDict>,
        materials: Vec<Bound<'_, PyDict>>,
        rules: &Bound<'_, PyDict>,
        dt: f64,
        kinematics: &str,
        cell: Option<(Tensor, Tensor, Tensor)>,
        threads: Option<usize>,
        clumps: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let columns = BodyColumns::of(bodies)?;
        let (pair, image): (Pairs<'_>, Images<'_>) = (get(contacts, "pair")?, get(contacts, "image")?);
        let (normal, distance): (Vectors<'_>, Scalars<'_>) = (get(contacts, "normal")?, get(contacts, "distance")?);
        let history: Rows<'_> = get(contacts, "history")?;
        let given = ContactsWithHistories {
            pair: pair.get()?,
            image: image.get()?,
            normal: normal.get()?,
            distance: distance.get()?,
            history: history.get()?,
        };
        let kinematics = motion_measure(kinematics).map_err(PyValueError::new_err)?;
        let origin = match law {
            "cohesive" => {
                Origin::Cohesive { kinematics, materials: read_tables(&materials)?, rules: read_table(rules)? }
            }
            "jointed" => Origin::Jointed { kinematics, materials: read_tables(&materials)?, rules: read_table(rules)? },
            _ => {
                return Err(PyValueError::new_err(format!("law is \"{law}\"; give \"cohesive\" or \"jointed\"")));
            }
        };
        let cell = cell.map(|cell| cell_from(cell, dt));
        let clumps = clumps.map(clumps::of_arrays).transpose()?.unwrap_or_default();
        let made = Assembly::with_histories(&columns.get()?, &given, &clumps, origin, cell, dt);
        Self::new(made.map_err(PyValueError::new_err)?, threads)
    }

    /// The spheres of a scenario with its bonds and contacts, built as for a run. `bodies`: the host's body id of each sphere of the
    /// scenario; `mass` (kg) and `inertia` (kg m²) are those of the bodies. `clumps`: see [`clumps::of_arrays`].
    #[staticmethod]
    #[pyo3(signature = (scenario, bodies, mass, inertia, dt, threads=None, clumps=None))]
    fn of_scenario(
        py: Python<'_>,
        scenario: &Bound<'_, Scenario>,
        bodies: Indices<'_>,
        mass: Scalars<'_>,
        inertia: Scalars<'_>,
        dt: f64,
        threads: Option<usize>,
        clumps: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let clumps = clumps.map(clumps::of_arrays).transpose()?.unwrap_or_default();
        let Scenario { inner, folder } = scenario.get();
        let folder: &PathBuf = folder;
        let assembly = guarded(py, threads, None, |progress| assemble(inner, folder, progress))?;
        let assembly = assembly.map_err(|error| of_assembly(inner, error))?;
        warn(py, inner, &assembly.summary.warnings)?;
        let spheres = Spheres { id: bodies.get()?, mass: mass.get()?, inertia: inertia.get()?, clumps: &clumps };
        let allow = inner.integration.allow_unstable;
        let made = Assembly::of_scenario(assembly, allow, Origin::Elsewhere {}, spheres, dt);
        Self::new(made.map_err(PyValueError::new_err)?, threads)
    }

    /// A copy of the bonds of the native engine, from the words that it saves with its scene.
    #[staticmethod]
    #[pyo3(signature = (words, threads=None))]
    fn of_words(words: &[u8], threads: Option<usize>) -> PyResult<Self> {
        let words: Vec<i32> = words.as_chunks().0.iter().map(|&word| i32::from_le_bytes(word)).collect();
        Self::new(Assembly::from_words(&words).map_err(PyValueError::new_err)?, threads)
    }

    /// Compute `steps` whole steps with our solver; returns the number of bonds that broke.
    fn advance(&self, py: Python<'_>, steps: u64) -> PyResult<u64> {
        let mut left = steps;
        while left > 0 {
            let left = &mut left;
            let steps = |Inner { assembly, .. }: &mut Inner| {
                self.inside(|| {
                    let start = Instant::now();
                    while *left > 0 && start.elapsed() < Duration::from_millis(50) {
                        let report = assembly.solver.step_with(&mut assembly.state, false)?;
                        assembly.count(&report);
                        *left -= 1;
                    }
                    Ok::<(), SolverError>(())
                })
            };
            self.wait(py)?.change(py, steps)?.or_raise()?;
            py.check_signals()?;
        }
        Ok(self.wait(py)?.assembly.broken)
    }

    /// Attach the host's memory. The caller must have checked addresses and offsets against the host's Python values.
    ///
    /// `container`: the vector of bodies; `forces`: the object of the forces; `offsets`: of the state in a body, and of
    /// position, velocity, angular velocity, orientation, and prescribed degrees of freedom in a state.
    fn attach(&self, py: Python<'_>, container: usize, forces: usize, offsets: [usize; 6]) -> PyResult<()> {
        let mut inner = self.wait(py)?;
        let host = Host::new(&inner.assembly.state.particles.id, container, forces, offsets)?;
        inner.change(py, |inner| inner.host = Some(host))
    }

    /// Move the bodies in `contact_step`, in place of the host's integrator; `None`: the host moves them. Returns the number of bodies
    /// of the host; with another number, `undisturbed` is false.
    #[pyo3(signature = (layout))]
    fn move_bodies(&self, py: Python<'_>, layout: Option<MotionLayout>) -> PyResult<usize> {
        let mut inner = self.wait(py)?;
        let host = inner.host.as_ref().ok_or_else(|| PyRuntimeError::new_err(NO_HOST))?;
        let count = host.body_count();
        let motion = layout.map(|layout| Motion::new(layout, count)).transpose()?;
        inner.change(py, move |inner| {
            if let Some(host) = &mut inner.host {
                host.motion = motion;
            }
            count
        })
    }

    /// Number of bodies of the host, deleted ones included.
    #[getter]
    fn body_count(&self, py: Python<'_>) -> PyResult<usize> {
        self.wait(py)?.host.as_ref().map(Host::body_count).ok_or_else(|| PyRuntimeError::new_err(NO_HOST))
    }

    /// Remember the host's engines. `container`: their vector; `dead`: offset of that flag in an engine.
    fn watch(&self, py: Python<'_>, container: usize, dead: usize) -> PyResult<()> {
        self.wait(py)?.change(py, |inner| inner.engines = Some(Engines::new(container, dead)))
    }

    /// Whether the host has the engines of the last `watch`, with the same flags, and, if the bodies are moved here, its integrator and its
    /// number of bodies are as they were.
    fn undisturbed(&self, py: Python<'_>) -> PyResult<bool> {
        let inner = self.wait(py)?;
        let same = inner.engines.as_ref().is_some_and(Engines::are_the_same);
        let moved = inner.host.as_ref().and_then(|host| Some((host.motion.as_ref()?, host.body_count())));
        Ok(same && moved.is_none_or(|(motion, bodies)| motion.is_undisturbed(bodies)))
    }

    /// Compute the forces at the positions of the host's bodies and add them to the host's forces; with `move_bodies`, move the bodies as
    /// well. Returns whether the host's collider must search, because a body that was moved here has left its bound.
    #[pyo3(signature = (dt, cell=None))]
    fn contact_step(&self, py: Python<'_>, dt: f64, cell: Option<(Tensor, Tensor, Tensor)>) -> PyResult<bool> {
        let mut inner = self.read_for_step(py)?;
        let cell = cell.map(|cell| cell_from(cell, dt));
        let done = inner.change(py, |Inner { assembly, host, .. }| {
            let host = host.as_ref().ok_or(NO_HOST)?;
            let step = || {
                host.gather(assembly, dt)?;
                assembly.find_forces(dt, cell, false)
            };
            self.compute(step)?;
            // On this thread, in whose part of the host's forces they go.
            host.add_forces(assembly);
            let Some(motion) = &host.motion else { return Ok(false) };
            Ok::<_, String>(motion.step(host, &assembly.state.particles.id, dt, self.workers.as_ref()))
        })?;
        done.map_err(PyRuntimeError::new_err)
    }

    /// With `move_bodies`, compute up to `most` steps at once, at most for some 20 ms. Nothing but the bonds and contacts may act on the bodies
    /// after the first step; if a script has added forces, only that one is computed. Afterwards, the host has the motion and the forces of the
    /// last step. Returns the number of steps, and the error that has ended them.
    fn contact_steps(&self, py: Python<'_>, dt: f64, most: u64) -> PyResult<(u64, Option<String>)> {
        /// A pause of the run waits so long.
        const LONGEST: Duration = Duration::from_millis(20);
        let mut inner = self.read_for_step(py)?;
        inner.change(py, |Inner { assembly, host, .. }| {
            let Some((host, motion)) = host.as_ref().and_then(|host| Some((host, host.motion.as_ref()?))) else {
                return (0, Some(NO_HOST.to_owned()));
            };
            if let Err(error) = self.compute(|| host.gather(assembly, dt)) {
                return (0, Some(error));
            }
            motion.synchronize(host);
            if motion.is_pushed(host, &assembly.state.particles.id) {
                if let Err(error) = self.compute(|| assembly.find_forces(dt, None, false)) {
                    return (0, Some(error));
                }
                host.add_forces(assembly);
                motion.step(host, &assembly.state.particles.id, dt, self.workers.as_ref());
                return (1, None);
            }
            let outcome = self.compute(|| motion.several(host, assembly, dt, most, LONGEST));
            if outcome.0 > 0 {
                host.add_forces(assembly);
                motion.synchronize(host);
            }
            outcome
        })
    }

    /// Positions, motion, and body ids of the particles.
    fn bodies<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let inner = self.wait(py)?;
        let p = &inner.assembly.state.particles;
        let dict = PyDict::new(py);
        dict.set_item("id", scalars(py, &p.id))?;
        dict.set_item("position", vectors(py, &p.position)?)?;
        dict.set_item("velocity", vectors(py, &p.velocity)?)?;
        dict.set_item("angular_velocity", vectors(py, &p.angular_velocity)?)?;
        dict.set_item("orientation", rows::<_, f64>(py, &p.orientation, 4)?)?;
        dict.set_item("radius", scalars(py, &p.radius))?;
        Ok(dict)
    }

    /// Position, velocity, orientation (x, y, z, w), angular velocity, and angular momentum of the clumps, in the order in which they
    /// were given.
    fn clumps<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        clumps::motion(py, &self.wait(py)?.assembly.state)
    }

    /// Tables of all active contacts: bonds by law, and `unbonded`. `a` and `b` are the host's body ids.
    fn contacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let inner = self.wait(py)?;
        let dict = PyDict::new(py);
        let ids = &inner.assembly.state.particles.id;
        for block in &inner.assembly.state.bonds {
            dict.set_item(block.law(), contact_table(py, block.contacts(), ids, true)?)?;
        }
        if let Some(block) = &inner.assembly.state.contacts {
            dict.set_item("unbonded", contact_table(py, block.contacts(), ids, true)?)?;
        }
        Ok(dict)
    }

    /// What tells the active contacts, in the order of `contacts`: the particles as two halves of a number, whether each is a bond, and the bits of
    /// its reference length.
    fn contact_rows<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let inner = self.wait(py)?;
        let state = &inner.assembly.state;
        let mut found: Vec<u64> = Vec::new();
        for block in state.bonds.iter().chain(&state.contacts) {
            let block = block.contacts();
            let (pairs, references) = (block.pairs(), block.references());
            for (k, flags) in block.flags().iter().enumerate().filter(|(_, flags)| flags.carries()) {
                let bonded = u64::from(flags.has(ContactFlags::BONDED));
                let pair = u64::from(pairs[k].a) << 32 | u64::from(pairs[k].b);
                found.extend([pair, bonded, references.get(k).length.to_bits()]);
            }
        }
        Ok(scalars(py, &found).into_any())
    }

    /// Positions of the particles, m, (n, 3), and the contact forces of the last step: pair (rows of `bodies`), branch, point, force,
    /// moment. `present`: positions and branch vectors of the host's bodies now, as in YADE's operators; else those of the last step.
    fn forces<'py>(&self, py: Python<'py>, present: bool) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let inner = self.wait(py)?;
        let Inner { assembly, host, .. } = &*inner;
        let now =
            if present { host.as_ref().map(|host| host.present_positions(assembly)).transpose() } else { Ok(None) };
        let now = now.map_err(PyRuntimeError::new_err)?;
        let c = self.inside(|| assembly.last_forces(now.as_deref()));
        let positions = vectors(py, now.as_deref().unwrap_or(&assembly.state.particles.position))?.into_any();
        let fields = (
            rows::<_, u32>(py, &c.pair, 2)?,
            vectors(py, &c.branch)?,
            vectors(py, &c.point)?,
            vectors(py, &c.force)?,
            vectors(py, &c.moment)?,
        );
        Ok((positions, concordem_python::arrays::result(py, "Contacts", fields)?))
    }

    /// YADE's `normDmg`, `numBrokenCohesive`, and `stress` (Pa, (n, 3, 3)) of the particles, in the order of `bodies`.
    fn particle_results<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let inner = self.wait(py)?;
        let found = self.inside(|| inner.assembly.particle_results()).or_raise()?;
        Ok((
            scalars(py, &found.damage).into_any(),
            scalars(py, &found.lost).into_any(),
            tensors(py, found.stress)?.into_any(),
        ))
    }

    /// Net forces (N) and torques (N·m) of the last step per particle, (n, 3) each.
    fn net_forces<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let inner = self.wait(py)?;
        Ok((
            vectors(py, inner.assembly.solver.forces())?.into_any(),
            vectors(py, inner.assembly.solver.torques())?.into_any(),
        ))
    }

    /// Edges (m, as columns) and deformation gradient of the periodic cell; None without a cell.
    #[getter]
    fn cell<'py>(&self, py: Python<'py>) -> PyResult<Option<(Bound<'py, PyAny>, Bound<'py, PyAny>)>> {
        let both =
            |cell: Cell| Ok((tensor(py, &cell.matrix)?.into_any(), tensor(py, &cell.deformation_gradient)?.into_any()));
        self.wait(py)?.assembly.state.cell.map(both).transpose()
    }

    /// Number of intact bonds.
    #[getter]
    fn bond_count(&self, py: Python<'_>) -> PyResult<usize> {
        Ok(self.wait(py)?.assembly.bond_count())
    }

    /// Number of active bonds and contacts.
    #[getter]
    fn contact_count(&self, py: Python<'_>) -> PyResult<usize> {
        let inner = self.wait(py)?;
        let state = &inner.assembly.state;
        let active = |flags: &&ContactFlags| flags.carries();
        Ok(state
            .bonds
            .iter()
            .chain(&state.contacts)
            .map(|block| block.contacts().flags().iter().filter(active).count())
            .sum())
    }

    /// Number of bonds broken so far.
    #[getter]
    fn broken(&self, py: Python<'_>) -> PyResult<u64> {
        Ok(self.wait(py)?.assembly.broken)
    }

    /// Number of bonds that each particle has lost so far, and of its unbonded contacts that opened, in the order of `bodies`.
    fn losses<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let inner = self.wait(py)?;
        let Assembly { losses, openings, .. } = &inner.assembly;
        Ok((scalars(py, losses).into_any(), scalars(py, openings).into_any()))
    }

    /// Take what has happened to jointed bonds since the last call: the cracks, each as (steps before, ids, 1 in tension or 2 in shear, point,
    /// normal, mean radius, energy, area), and the ids of the bodies of bonds that began.
    fn take_happenings(&self, py: Python<'_>) -> PyResult<(Vec<CrackRow>, Vec<[u32; 2]>)> {
        let mut inner = self.wait(py)?;
        let taken = inner.change(py, |inner| std::mem::take(&mut inner.assembly.happenings))?;
        let row = |crack: &Crack| {
            let &Crack { step, ids, kind, point, normal, size, energy, area } = crack;
            (step, ids, kind as u8, point.into(), normal.into(), size, energy, area)
        };
        Ok((taken.cracks.iter().map(row).collect(), taken.begun))
    }

    /// Temperature of each particle, K, in the order of `bodies`; None without heat conduction.
    #[getter]
    fn temperatures<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        Ok(self.wait(py)?.assembly.temperatures().map(|temperature| scalars(py, temperature).into_any()))
    }

    /// Number of steps so far.
    #[getter]
    fn steps(&self, py: Python<'_>) -> PyResult<u64> {
        Ok(self.wait(py)?.assembly.state.clock.step)
    }

    /// Number of neighbor-list rebuilds so far.
    #[getter]
    fn searches(&self, py: Python<'_>) -> PyResult<u64> {
        Ok(self.wait(py)?.assembly.solver.neighbor_rebuilds())
    }

    /// Hash of the complete state.
    fn state_hash(&self, py: Python<'_>) -> PyResult<String> {
        hash::state_hash(&self.wait(py)?.assembly.state).or_raise()
    }

    /// Write the state and a text of the caller to a file; returns the state hash.
    fn save(&self, py: Python<'_>, path: PathBuf, text: &str) -> PyResult<String> {
        checkpoint::write(&path, &self.wait(py)?.assembly.state, text).or_raise()
    }

    /// Replace the state by one that `save` wrote, with the numbers of `losses`.
    fn restore(&self, py: Python<'_>, path: PathBuf, losses: Indices<'_>, openings: Indices<'_>) -> PyResult<()> {
        let mut checkpoint = checkpoint::read(&path).or_raise()?;
        let mut inner = self.wait(py)?;
        let Assembly { state, solver, .. } = &inner.assembly;
        let count = state.particles.len();
        let losses = losses.get()?;
        same_length("losses", losses.len(), count)?;
        let openings = openings.get()?;
        same_length("openings", openings.len(), count)?;
        // Read into a copy, so that a file of other bodies does not change the state.
        let mut stored = state.clone();
        caught(|| stored.read(&mut checkpoint.columns).and_then(|()| stored.check_indices()))?.or_raise()?;
        // The order of particles follows the positions at creation, so it may differ.
        let sorted = |mut ids: Vec<u32>| {
            ids.sort_unstable();
            ids
        };
        if sorted(stored.particles.id.clone()) != sorted(state.particles.id.clone()) {
            return Err(PyRuntimeError::new_err(
                "the file contains other bodies than the scene; load the file that was saved with this scene",
            ));
        }
        let before = &state.particles.id;
        clumps::place_members(&mut stored, before).map_err(PyRuntimeError::new_err)?;
        let solver = caught(|| self.inside(|| Solver::new(solver.model().clone(), &mut stored)))?.or_raise()?;
        inner.change(py, |Inner { assembly, .. }| {
            assembly.state = stored;
            assembly.solver = solver;
            assembly.losses.copy_from_slice(losses);
            assembly.openings.copy_from_slice(openings);
            assembly.broken = losses.iter().map(|&n| u64::from(n)).sum::<u64>() / 2;
        })
    }
}

/// The text that `Hosted.save` stored with the state.
#[pyfunction]
fn hosted_text(path: PathBuf) -> PyResult<String> {
    Ok(checkpoint::read(&path).or_raise()?.provenance)
}

impl Hosted {
    fn new(assembly: Assembly, threads: Option<usize>) -> PyResult<Self> {
        let inner = Shared::new(
            Inner { assembly, host: None, engines: None },
            "another thread is using the assembly; wait for it",
            "the assembly failed in the middle of a step, so its state is invalid; build it again",
        );
        let workers = match threads {
            Some(0) => return Err(PyValueError::new_err("threads is 0; give at least 1")),
            threads => threads.map(Workers::new).transpose(),
        };
        let workers = workers.map_err(|error| PyRuntimeError::new_err(format!("cannot start the threads: {error}")))?;
        Ok(Self { inner, workers })
    }
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Hosted>()?;
    module.add_function(wrap_pyfunction!(hosted_text, module)?)
}
