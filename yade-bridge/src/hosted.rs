//! An assembly whose particles belong to a host program: its bonds and contacts are ours.
//!
//! Two uses. `advance` takes whole steps, as a stand-in for the host's own loop. `contact_step` computes the forces of one
//! step at the places where the host has its bodies, and adds them to the host's forces, so that all the rest stays the
//! host's.

use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard};
use std::time::{Duration, Instant};

use concordem::assembly::assemble;
use concordem::kinematics::{Frame, Mode};
use concordem::law::cpm::{Cpm, CpmParameters, CpmState};
use concordem::law::{LawState, Reference};
use concordem::math::{Mat3, Quat, Vec3, quaternion_of_rotation_vector};
use concordem::neighbor::spatial_order;
use concordem::output::{checkpoint, hash};
use concordem::solver::integrate::Damping;
use concordem::solver::{MaterialRows, Model, Solver, StepReport};
use concordem::state::contacts::{ContactBlock, Link, Pair};
use concordem::state::{Cell, Constraint, Particles, Sphere, State};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde::Deserialize;

use crate::arrays::{
    Flags, Images, Indices, Pairs, Rows, Scalars, Tensor, Vector, Vectors, rows, scalars, tensor, vectors,
};
use crate::errors::{OrRaise, of_assembly};
use crate::memory::{peek, targets};
use crate::scenario::{Scenario, table_of};
use crate::simulation::{guarded, inside, pool};
use crate::state::contact_table;

/// A function that adds a vector to a body's force or torque: `this`, id, vector.
type AddVector = unsafe extern "C" fn(*mut std::ffi::c_void, i32, *const f64);

/// Where the host keeps its bodies and forces.
struct Host {
    /// Vector of shared pointers to bodies.
    bodies: usize,
    /// Offset of the pointer to the state in a body.
    state: usize,
    /// Offsets in a state: position, velocity, angular velocity, orientation.
    fields: [usize; 4],
    /// Object of the forces.
    forces: usize,
    add_force: AddVector,
    add_torque: AddVector,
    /// What was behind every id when the host was attached: body and state.
    seen: Vec<(u64, u64)>,
}

struct Inner {
    state: State,
    solver: Solver,
    host: Option<Host>,
    broken: u64,
    /// Bonds that each particle has lost.
    losses: Vec<u32>,
    /// Whether the law reads orientations and rotations.
    needs_rotation: bool,
}

/// An assembly under a host.
#[pyclass(frozen, weakref, module = "concordem._core")]
pub struct Hosted {
    inner: Mutex<Inner>,
    pool: Option<rayon::ThreadPool>,
}

fn mode_of(name: &str) -> PyResult<Mode> {
    match name {
        "finite" => Ok(Mode::Finite),
        "first-order" => Ok(Mode::FirstOrder),
        "yade" => Ok(Mode::Yade),
        "yade-ratcheting" => Ok(Mode::YadeRatcheting),
        other => Err(PyValueError::new_err(format!(
            "kinematics is \"{other}\"; it may be \"finite\", \"first-order\", \"yade\", \"yade-ratcheting\""
        ))),
    }
}

/// `None` where the dictionary has no such entry.
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
        Err(PyValueError::new_err(format!("`{name}` has {found} entries where {wanted} are needed")))
    }
}

/// Particles from arrays in the host's order.
fn particles_of(arrays: &Bound<'_, PyDict>) -> PyResult<Particles> {
    let position: Vectors<'_> = get(arrays, "position")?;
    let position = position.get()?;
    let n = position.len();
    let radius: Scalars<'_> = get(arrays, "radius")?;
    let (mass, inertia): (Scalars<'_>, Scalars<'_>) = (get(arrays, "mass")?, get(arrays, "inertia")?);
    let (velocity, spin): (Vectors<'_>, Vectors<'_>) = (get(arrays, "velocity")?, get(arrays, "angular_velocity")?);
    let orientation: Rows<'_> = get(arrays, "orientation")?;
    let (id, material): (Indices<'_>, Indices<'_>) = (get(arrays, "id")?, get(arrays, "material")?);
    let constraint: Indices<'_> = get(arrays, "constraint")?;
    let (radius, mass, inertia) = (radius.get()?, mass.get()?, inertia.get()?);
    let (velocity, spin, id, material) = (velocity.get()?, spin.get()?, id.get()?, material.get()?);
    for (name, found) in [
        ("radius", radius.len()),
        ("mass", mass.len()),
        ("inertia", inertia.len()),
        ("velocity", velocity.len()),
        ("angular_velocity", spin.len()),
        ("orientation", orientation.shape().0),
        ("id", id.len()),
        ("material", material.len()),
        ("constraint", constraint.get()?.len()),
    ] {
        same_length(name, found, n)?;
    }
    let mut particles = Particles::default();
    for p in 0..n {
        let finite = position[p].iter().chain(&velocity[p]).chain(&spin[p]).all(|x: &f64| x.is_finite());
        if !finite || !(radius[p] > 0.0 && mass[p] > 0.0 && inertia[p] > 0.0) {
            let message = format!(
                "body {} has a place or motion that is not finite, or no positive radius, mass, and inertia",
                id[p]
            );
            return Err(PyValueError::new_err(message));
        }
        let material = u16::try_from(material[p]).map_err(|_| PyValueError::new_err("more than 65535 materials"))?;
        particles.push(Sphere { position: position[p], radius: radius[p] }, material, mass[p], inertia[p]);
    }
    particles.id = id.to_vec();
    particles.velocity = velocity.to_vec();
    particles.angular_velocity = spin.to_vec();
    particles.orientation = orientation.get()?.chunks_exact(4).map(|q| Quat::new(q[3], q[0], q[1], q[2])).collect();
    particles.constraint = constraint.get()?.iter().map(|&mask| Constraint(mask as u8)).collect();
    Ok(particles)
}

/// The parameter rows of the concrete law, one for each pair of materials `(a, b)` with `a ≤ b`.
fn cpm_rows(list: &Bound<'_, PyAny>, materials: usize) -> PyResult<(Vec<Cpm>, MaterialRows)> {
    let mut laws = Vec::new();
    let mut map = MaterialRows::new(materials);
    for item in list.try_iter()? {
        let (a, b, parameters): (u16, u16, Bound<'_, PyDict>) = item?.extract()?;
        let table = toml::Value::Table(table_of(parameters.as_any(), "")?);
        let parameters = CpmParameters::deserialize(table).map_err(|e| PyValueError::new_err(e.to_string()))?;
        let law = Cpm::new(&parameters).map_err(|e| PyValueError::new_err(e.to_string()))?;
        map.set(a, b, laws.len() as u16);
        map.set(b, a, laws.len() as u16);
        laws.push(law);
    }
    Ok((laws, map))
}

/// The cell behind (edges, deformation gradient, velocity gradient).
fn cell_of((edges, gradient, rate): (Tensor, Tensor, Tensor), dt: f64) -> Cell {
    Cell {
        matrix: edges.0,
        deformation_gradient: gradient.0,
        velocity_gradient: rate.0,
        // By the motion of the last step, H = (1 + LΔt) H_old.
        matrix_change: (Mat3::identity() + rate.0 * dt)
            .try_inverse()
            .map_or_else(Mat3::zeros, |back| edges.0 - back * edges.0),
    }
}

impl Hosted {
    fn lock(&self) -> PyResult<MutexGuard<'_, Inner>> {
        self.inner.try_lock().map_err(|_| PyRuntimeError::new_err("the assembly is at work in another thread"))
    }
}

#[pymethods]
impl Hosted {
    /// Spheres with bonds and contacts of the concrete law and their histories.
    ///
    /// `bodies`: arrays id, position, velocity, orientation (x, y, z, w), angular_velocity, radius, mass, inertia, material,
    /// constraint. `contacts`: pair (rows of bodies), image, bonded, length (reference), area, normal, distance, history.
    /// `laws`: (material, material, parameters).
    #[staticmethod]
    #[pyo3(signature = (bodies, contacts, laws, materials, dt, kinematics, damping=0.0, gravity=None, cell=None, threads=None))]
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
    ) -> PyResult<Self> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(PyValueError::new_err(format!("the time step is {dt}")));
        }
        let unordered = particles_of(bodies)?;
        let cell = cell.map(|cell| cell_of(cell, dt));
        let order = spatial_order(&unordered.position, cell.as_ref());
        let mut place = vec![0_u32; order.len()];
        for (new, &old) in order.iter().enumerate() {
            place[old as usize] = new as u32;
        }
        let mut particles = unordered.permuted(&order);
        for (increment, spin) in particles.rotation_increment.iter_mut().zip(&particles.angular_velocity) {
            *increment = quaternion_of_rotation_vector(&(spin * dt));
        }
        let (laws, contact_rows) = cpm_rows(laws, materials)?;
        let (mut bonds, mut loose) = (ContactBlock::new(laws.clone()), ContactBlock::new(laws));

        let pair: Pairs<'_> = get(contacts, "pair")?;
        let (image, bonded): (Images<'_>, Flags<'_>) = (get(contacts, "image")?, get(contacts, "bonded")?);
        let (image, bonded) = (image.get()?, bonded.get()?);
        let (length, area): (Scalars<'_>, Scalars<'_>) = (get(contacts, "length")?, get(contacts, "area")?);
        let (normal, distance): (Vectors<'_>, Scalars<'_>) = (get(contacts, "normal")?, get(contacts, "distance")?);
        let history: Rows<'_> = get(contacts, "history")?;
        let (pair, length, area, distance) = (pair.get()?, length.get()?, area.get()?, distance.get()?);
        let (normal, count) = (normal.get()?, pair.len());
        let width = size_of::<CpmState>() / 8;
        for (name, found) in [
            ("image", image.len()),
            ("bonded", bonded.len()),
            ("length", length.len()),
            ("area", area.len()),
            ("normal", normal.len()),
            ("distance", distance.len()),
            ("history", history.shape().0),
        ] {
            same_length(name, found, count)?;
        }
        same_length("columns of history", history.shape().1, if count == 0 { history.shape().1 } else { width })?;
        for k in 0..count {
            let [one, two] = pair[k];
            let at = |p: u32| {
                place.get(p as usize).copied().ok_or_else(|| {
                    PyValueError::new_err(format!("contact {k} names row {p}, but there are {} bodies", place.len()))
                })
            };
            let (mut a, mut b) = (at(one)?, at(two)?);
            let row = contact_rows
                .get(particles.material[a as usize], particles.material[b as usize])
                .ok_or_else(|| PyValueError::new_err(format!("contact {k} is between materials without a law")))?;
            let (mut normal, mut image) = (normal[k], image[k]);
            let mut state: CpmState =
                bytemuck::pod_read_unaligned(bytemuck::cast_slice(&history.get()?[k * width..(k + 1) * width]));
            if !(length[k] > 0.0
                && area[k] > 0.0
                && normal.norm_squared() > 0.5
                && state.as_reals().iter().all(|x| x.is_finite()))
            {
                return Err(PyValueError::new_err(format!(
                    "contact {k} of rows {one} and {two} has no reference length and area, no normal, or a history that \
                     is not finite"
                )));
            }
            if a > b {
                std::mem::swap(&mut a, &mut b);
                normal = -normal;
                image = image.map(|i| -i);
                state = state.swapped();
            }
            let flags = Link::ACTIVE | if bonded[k] { Link::BONDED } else { 0 };
            let link = Link { row, flags, image, padding: 0 };
            let block = if bonded[k] { &mut bonds } else { &mut loose };
            block.push(
                Pair { a, b },
                link,
                Reference { length: length[k], area: area[k] },
                Frame { normal, length: distance[k] },
            );
            if let Some(last) = block.history.last_mut() {
                *last = state;
            }
        }
        bonds.sort();
        loose.sort();
        let mut state = State { particles, cell, bonds: vec![Box::new(bonds)], ..State::default() };
        state.contacts = Some(Box::new(loose));
        state.clock.dt = dt;
        let model = Model {
            mode: mode_of(kinematics)?,
            damping: if damping == 0.0 {
                Damping::None
            } else {
                Damping::Local { translation: damping, rotation: damping }
            },
            gravity: gravity.unwrap_or_default().0,
            contact_rows,
            ..Model::default()
        };
        Self::new(state, model, threads)
    }

    /// The spheres of a scenario, with its bonds and contacts, as they would be built for a run. `bodies` says which body
    /// of the host each sphere of the scenario is, and gives its mass and inertia.
    #[staticmethod]
    #[pyo3(signature = (scenario, bodies, mass, inertia, dt, threads=None))]
    fn of_scenario(
        py: Python<'_>,
        scenario: &Bound<'_, Scenario>,
        bodies: Indices<'_>,
        mass: Scalars<'_>,
        inertia: Scalars<'_>,
        dt: f64,
        threads: Option<usize>,
    ) -> PyResult<Self> {
        let Scenario { inner, folder } = scenario.get();
        let folder: &PathBuf = folder;
        let assembly = guarded(py, threads, None, |progress| assemble(inner, folder, progress))?;
        let assembly = assembly.map_err(|error| of_assembly(inner, error))?;
        let (mut state, model) = (assembly.state, assembly.model);
        let (bodies, mass, inertia) = (bodies.get()?, mass.get()?, inertia.get()?);
        let n = state.particles.len();
        for (name, found) in [("bodies", bodies.len()), ("mass", mass.len()), ("inertia", inertia.len())] {
            same_length(name, found, n)?;
        }
        let limit = assembly.summary.bounds.spectral.max(assembly.summary.bounds.per_particle);
        if !(dt > 0.0 && dt < limit) && !inner.integration.allow_unstable {
            return Err(PyValueError::new_err(format!(
                "the host's time step is {dt:.4e} s, but the bonds are stable only below {limit:.4e} s (with the masses of \
                 the scenario's density); set O.dt, or integration.allow_unstable"
            )));
        }
        for p in 0..n {
            let sphere = state.particles.id[p] as usize;
            state.particles.mass[p] = mass[sphere];
            state.particles.inertia[p] = inertia[sphere];
            state.particles.id[p] = bodies[sphere];
        }
        state.clock.dt = dt;
        Self::new(state, model, threads)
    }

    /// Take whole steps on our own; the number of bonds that broke.
    fn advance(&self, py: Python<'_>, steps: u64) -> PyResult<u64> {
        let mut left = steps;
        while left > 0 {
            let mut inner = self.lock()?;
            let (inner, left) = (&mut *inner, &mut left);
            let pool = self.pool.as_ref();
            py.detach(|| {
                inside(pool, || {
                    let start = Instant::now();
                    while *left > 0 && start.elapsed() < Duration::from_millis(50) {
                        let report = inner.solver.step_with(&mut inner.state, false)?;
                        inner.count(&report);
                        *left -= 1;
                    }
                    Ok(())
                })
            })
            .map_err(|error: concordem::solver::SolverError| crate::errors::Raise::raise(error))?;
            py.check_signals()?;
        }
        Ok(self.lock()?.broken)
    }

    /// Attach the host's memory. Addresses and offsets must have been compared with what the host itself says.
    ///
    /// `container`: the vector of bodies; `forces`: the object of the forces; `offsets`: of the state in a body, and of
    /// position, velocity, angular velocity, and orientation in a state.
    fn attach(&self, container: usize, forces: usize, offsets: [usize; 5]) -> PyResult<()> {
        let symbol = |name: &'static [u8]| -> PyResult<AddVector> {
            // Safety: the name ends with a zero byte.
            let address = unsafe { libc::dlsym(libc::RTLD_DEFAULT, name.as_ptr().cast()) };
            if address.is_null() {
                let name = String::from_utf8_lossy(&name[..name.len() - 1]).into_owned();
                return Err(PyRuntimeError::new_err(format!("the host does not export {name}")));
            }
            // Safety: a member function of that mangled name takes `this`, an int, and a reference to three doubles.
            Ok(unsafe { std::mem::transmute::<*mut std::ffi::c_void, AddVector>(address) })
        };
        let add_force = symbol(b"_ZN4yade14ForceContainer8addForceEiRKN5Eigen6MatrixIdLi3ELi1ELi0ELi3ELi1EEE\0")?;
        let add_torque = symbol(b"_ZN4yade14ForceContainer9addTorqueEiRKN5Eigen6MatrixIdLi3ELi1ELi0ELi3ELi1EEE\0")?;
        let mut inner = self.lock()?;
        // Safety: the caller's promise.
        let bodies = unsafe { targets(container) };
        let mut seen = Vec::with_capacity(inner.state.particles.len());
        for &id in &inner.state.particles.id {
            let body = bodies.get(id as usize).copied().filter(|&body| body != 0);
            let body = body.ok_or_else(|| PyRuntimeError::new_err(format!("the host has no body {id}")))?;
            // Safety: a body of the host.
            seen.push((body, unsafe { peek::<u64>(body as usize + offsets[0]) }));
        }
        inner.host = Some(Host {
            bodies: container,
            state: offsets[0],
            fields: [offsets[1], offsets[2], offsets[3], offsets[4]],
            forces,
            add_force,
            add_torque,
            seen,
        });
        Ok(())
    }

    /// Forces of this step at the host's places, added to the host's forces; how many bonds broke.
    #[pyo3(signature = (dt, cell=None))]
    fn contact_step(&self, py: Python<'_>, dt: f64, cell: Option<(Tensor, Tensor, Tensor)>) -> PyResult<usize> {
        let mut inner = self.lock()?;
        let Inner { state, solver, host, needs_rotation, .. } = &mut *inner;
        let host = host.as_ref().ok_or_else(|| PyRuntimeError::new_err("no host is attached"))?;
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(PyValueError::new_err(format!("the time step is {dt}")));
        }
        if cell.is_some() != state.cell.is_some() {
            return Err(PyRuntimeError::new_err("the host's scene has become periodic, or is so no more"));
        }
        if let Some(cell) = cell {
            state.cell = Some(cell_of(cell, dt));
        }
        state.clock.dt = dt;
        gather(state, host, *needs_rotation, dt)?;
        let pool = self.pool.as_ref();
        let report = py.detach(|| inside(pool, || solver.find_forces(state, false))).or_raise()?;
        state.clock.step += 1;
        let this = host.forces as *mut std::ffi::c_void;
        for (p, (force, torque)) in solver.forces().iter().zip(solver.torques()).enumerate() {
            let id = state.particles.id[p] as i32;
            if !(force.norm_squared() + torque.norm_squared()).is_finite() {
                return Err(PyRuntimeError::new_err(format!(
                    "the force on body {id} is not finite; is the time step too large?"
                )));
            }
            // Safety: `this` is the host's object, and bodies with these ids exist (compared in `gather`).
            unsafe {
                (host.add_force)(this, id, force.as_ptr());
                (host.add_torque)(this, id, torque.as_ptr());
            }
        }
        Ok(inner.count(&report))
    }

    /// Places and motion of the particles by body.
    fn bodies<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let inner = self.lock()?;
        let p = &inner.state.particles;
        let dict = PyDict::new(py);
        dict.set_item("id", scalars(py, &p.id))?;
        dict.set_item("position", vectors(py, &p.position)?)?;
        dict.set_item("velocity", vectors(py, &p.velocity)?)?;
        dict.set_item("angular_velocity", vectors(py, &p.angular_velocity)?)?;
        dict.set_item("orientation", rows::<_, f64>(py, &p.orientation, 4)?)?;
        dict.set_item("radius", scalars(py, &p.radius))?;
        Ok(dict)
    }

    /// Tables of all contacts that carry something, `a` and `b` being the host's bodies: bonds by law, and `unbonded`.
    fn contacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let inner = self.lock()?;
        let dict = PyDict::new(py);
        let ids = &inner.state.particles.id;
        for block in &inner.state.bonds {
            dict.set_item(block.law(), contact_table(py, block.contacts(), ids, true)?)?;
        }
        if let Some(block) = &inner.state.contacts {
            dict.set_item("unbonded", contact_table(py, block.contacts(), ids, true)?)?;
        }
        Ok(dict)
    }

    /// Contact forces at the present places as operators read them: pair (rows of `bodies`), branch, point, force, moment.
    fn forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let mut inner = self.lock()?;
        let Inner { state, solver, .. } = &mut *inner;
        let forces = py.detach(|| solver.record(state)).or_raise()?;
        let c = &forces.contacts;
        let fields = (
            rows::<_, u32>(py, &c.pair, 2)?,
            vectors(py, &c.branch)?,
            vectors(py, &c.point)?,
            vectors(py, &c.force)?,
            vectors(py, &c.moment)?,
        );
        crate::arrays::result(py, "Contacts", fields)
    }

    /// Net forces and torques of the last step by particle.
    fn net_forces<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let inner = self.lock()?;
        Ok((vectors(py, inner.solver.forces())?.into_any(), vectors(py, inner.solver.torques())?.into_any()))
    }

    /// Edges of the periodic cell and its deformation gradient; None without one.
    #[getter]
    fn cell<'py>(&self, py: Python<'py>) -> PyResult<Option<(Bound<'py, PyAny>, Bound<'py, PyAny>)>> {
        let both =
            |cell: Cell| Ok((tensor(py, &cell.matrix)?.into_any(), tensor(py, &cell.deformation_gradient)?.into_any()));
        self.lock()?.state.cell.map(both).transpose()
    }

    /// Bonds that have not broken.
    #[getter]
    fn bond_count(&self) -> PyResult<usize> {
        Ok(self.lock()?.state.bond_count())
    }

    /// Bonds that broke so far.
    #[getter]
    fn broken(&self) -> PyResult<u64> {
        Ok(self.lock()?.broken)
    }

    /// Bonds that each particle has lost so far, in the order of `bodies`.
    fn losses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(scalars(py, &self.lock()?.losses).into_any())
    }

    /// Steps taken.
    #[getter]
    fn steps(&self) -> PyResult<u64> {
        Ok(self.lock()?.state.clock.step)
    }

    /// Neighbour searches so far.
    #[getter]
    fn searches(&self) -> PyResult<u64> {
        Ok(self.lock()?.solver.searches())
    }

    /// Hash of everything that changes.
    fn state_hash(&self) -> PyResult<String> {
        hash::state_hash(&self.lock()?.state).or_raise()
    }

    /// Write everything that changes to a file, with a text of the caller's.
    fn save(&self, path: PathBuf, text: &str) -> PyResult<String> {
        checkpoint::write(&path, &self.lock()?.state, text).or_raise()
    }

    /// Replace everything that changes by what `save` wrote.
    fn restore(&self, path: PathBuf, losses: Indices<'_>) -> PyResult<()> {
        let mut checkpoint = checkpoint::read(&path).or_raise()?;
        let mut inner = self.lock()?;
        let Inner { state, solver, broken, losses: lost, .. } = &mut *inner;
        let ids = state.particles.id.clone();
        same_length("losses", losses.get()?.len(), ids.len())?;
        lost.copy_from_slice(losses.get()?);
        *broken = lost.iter().map(|&n| u64::from(n)).sum::<u64>() / 2;
        state.read(&mut checkpoint.columns).or_raise()?;
        // Their order may be another one: it is that of the places where the assembly was made first.
        let sorted = |mut ids: Vec<u32>| {
            ids.sort_unstable();
            ids
        };
        if sorted(state.particles.id.clone()) != sorted(ids) {
            return Err(PyRuntimeError::new_err("the file belongs to other bodies"));
        }
        *solver = Solver::new(solver.model().clone(), state).or_raise()?;
        Ok(())
    }
}

/// The text that `Hosted.save` stored with the state.
#[pyfunction]
fn hosted_text(path: PathBuf) -> PyResult<String> {
    Ok(checkpoint::read(&path).or_raise()?.provenance)
}

impl Inner {
    /// Note the bonds that broke in a step; their number.
    fn count(&mut self, report: &StepReport) -> usize {
        let mut count = 0;
        for (_, incident) in report.incidents.iter().filter(|(_, incident)| incident.broke) {
            self.losses[incident.pair.a as usize] += 1;
            self.losses[incident.pair.b as usize] += 1;
            count += 1;
        }
        self.broken += count as u64;
        count
    }
}

impl Hosted {
    fn new(mut state: State, model: Model, threads: Option<usize>) -> PyResult<Self> {
        // Of the host's modes, only those of YADE read velocities in place of rotations.
        let beams = state.bonds.iter().any(|block| block.law() == "cohesive_beam");
        let needs_rotation = beams || !matches!(model.mode, Mode::Yade | Mode::YadeRatcheting);
        let solver = Solver::new(model, &mut state).or_raise()?;
        let losses = vec![0; state.particles.len()];
        let inner = Inner { state, solver, host: None, broken: 0, losses, needs_rotation };
        Ok(Self { inner: Mutex::new(inner), pool: pool(threads)? })
    }
}

/// Places and motion from the host's bodies, which must be those that were there at first.
fn gather(state: &mut State, host: &Host, rotation: bool, dt: f64) -> PyResult<()> {
    // Safety: the container belongs to the scene, which the caller compared before.
    let (begin, end): (usize, usize) = unsafe { (peek(host.bodies), peek(host.bodies + 8)) };
    let count = (end - begin) / 16;
    let p = &mut state.particles;
    for (k, &(body, object)) in host.seen.iter().enumerate() {
        let id = p.id[k] as usize;
        // Safety: within the vector; the body is looked into only if it is the one that was seen at first. (One erased
        // and another one made at the same address has another state at the same address at most: then it is a body.)
        let now = if id < count { unsafe { peek::<u64>(begin + 16 * id) } } else { 0 };
        if now != body || unsafe { peek::<u64>(body as usize + host.state) } != object {
            return Err(PyRuntimeError::new_err(format!(
                "body {id} is gone or was replaced; its bonds cannot go on. Take it out of the engine first"
            )));
        }
        let at = object as usize;
        let three =
            |offset: usize| unsafe { Vec3::new(peek(at + offset), peek(at + offset + 8), peek(at + offset + 16)) };
        let (x, v, w) = (three(host.fields[0]), three(host.fields[1]), three(host.fields[2]));
        if !(x + v + w).iter().all(|c| c.is_finite()) {
            return Err(PyRuntimeError::new_err(format!("place or motion of body {id} is not finite")));
        }
        p.position[k] = x;
        p.velocity[k] = v;
        p.angular_velocity[k] = w;
        if rotation {
            let q: [f64; 4] = unsafe { peek(at + host.fields[3]) };
            p.orientation[k] = Quat::new(q[3], q[0], q[1], q[2]);
            p.rotation_increment[k] = quaternion_of_rotation_vector(&(w * dt));
        }
    }
    Ok(())
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Hosted>()?;
    module.add_function(wrap_pyfunction!(hosted_text, module)?)
}
