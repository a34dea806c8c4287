//! The state as NumPy arrays.
//!
//! Particle arrays are views without copies. This is sound because the core guarantees never to move, grow, or replace these arrays (a
//! test of the core and the comparison of their addresses (`addresses.rs`) after every run check it), and because a view keeps the simulation alive.
//! Contacts change at every neighbor-list rebuild, so their tables are copies.

use concordem::law::state::COLUMNS_OF_EVERY_CONTACT;
use concordem::schedule::simulation::Written;
use concordem::state::Particles;
use concordem::state::contacts::{ContactFlags, Contacts};
use numpy::ndarray::{ArrayView1, ArrayView2};
use numpy::{Element, PyArray1, PyArray2};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{TableColumn, rows, scalars, table, tensor};
use crate::simulation::Simulation;

/// Particles, contacts, cell, and clock of a simulation.
#[pyclass(frozen, module = "concordem")]
pub struct State {
    simulation: Py<Simulation>,
}

/// A view with `components` numbers per row of memory that `owner` keeps alive.
///
/// Safety: `data` must point to `rows·components` numbers that do not move while `owner` exists.
unsafe fn view<'py, T: Element>(
    owner: Bound<'py, PyAny>,
    data: *const T,
    rows: usize,
    components: usize,
    writable: bool,
) -> PyResult<Bound<'py, PyAny>> {
    // An empty vector has a dangling pointer; NumPy stores it but does not read from it.
    let array = if components == 1 {
        let view = unsafe { ArrayView1::from_shape_ptr(rows, data) };
        unsafe { PyArray1::borrow_from_array(&view, owner) }.into_any()
    } else {
        let view = unsafe { ArrayView2::from_shape_ptr((rows, components), data) };
        unsafe { PyArray2::borrow_from_array(&view, owner) }.into_any()
    };
    if !writable {
        array.call_method1("setflags", (false,))?;
    }
    Ok(array)
}

/// Arrays that cannot be written, and why.
const FIXED: [(&str, &str); 9] = [
    ("ids", "they name the particles in results and events"),
    ("orientations", "histories of contacts are relative to them; give angular_velocities, which turn the particles"),
    ("radii", "contacts, masses, and the bound of the time step follow from them; change the packing, and begin again"),
    ("masses", "the bound of the time step follows from them; change the density, and begin again"),
    ("inertias", "the bound of the time step follows from them; change the density, and begin again"),
    ("materials", "the laws of contacts follow from them; give sets a material in the scenario, and begin again"),
    ("clumps", "masses and motions of the clumps follow from them; change [[clump]], and begin again"),
    ("tags", "loadings and operators follow from them; change [[set]], and begin again"),
    (
        "temperatures",
        "the balance of heat follows from them; give [[heat.source]] or [[heat.prescribe]] in the scenario",
    ),
];

impl State {
    pub(crate) fn new(simulation: Py<Simulation>) -> Self {
        Self { simulation }
    }

    /// A view of a particle array.
    fn particles<'py, S, T: Element>(
        &self,
        py: Python<'py>,
        of: impl Fn(&Particles) -> &Vec<S>,
        writable: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let owner = self.simulation.bind(py);
        let inner = owner.get().lock()?;
        let data = of(&inner.run.state.particles);
        let components = size_of::<S>() / size_of::<T>();
        // Sound: S consists of `components` numbers T; see also the module.
        unsafe { view(owner.clone().into_any(), data.as_ptr().cast::<T>(), data.len(), components, writable) }
    }
}

#[pymethods]
impl State {
    /// Ids of the particles: their indices in the user's packing, (n,).
    #[getter]
    fn ids<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.particles::<_, u32>(py, |p| &p.id, false)
    }
    /// Positions, m, (n, 3).
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.particles::<_, f64>(py, |p| &p.position, false)
    }
    /// Temperatures, K, (n,), a copy; None without heat conduction.
    #[getter]
    fn temperatures<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let inner = self.simulation.bind(py).get().lock()?;
        let heat = inner.run.state.heat.as_ref();
        Ok(heat.map(|heat| PyArray1::from_slice(py, &heat.temperature).into_any()))
    }
    /// Velocities at the half step before the positions, m/s, (n, 3).
    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.particles::<_, f64>(py, |p| &p.velocity, false)
    }
    /// Angular velocities at the half step before the positions, rad/s, (n, 3).
    #[getter]
    fn angular_velocities<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.particles::<_, f64>(py, |p| &p.angular_velocity, false)
    }
    /// Orientations: unit quaternions (x, y, z, w), body to world, (n, 4).
    #[getter]
    fn orientations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.particles::<_, f64>(py, |p| &p.orientation, false)
    }
    /// Radii, m.
    #[getter]
    fn radii<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.particles::<_, f64>(py, |p| &p.radius, false)
    }
    /// Masses, kg.
    #[getter]
    fn masses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.particles::<_, f64>(py, |p| &p.mass, false)
    }
    /// Moments of inertia, kg·m².
    #[getter]
    fn inertias<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.particles::<_, f64>(py, |p| &p.inertia, false)
    }
    /// Indices of the materials in the scenario, (n,).
    #[getter]
    fn materials<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.particles::<_, u16>(py, |p| &p.material, false)
    }
    /// Indices of the clumps, (n,); 2³²−1 for none.
    #[getter]
    fn clumps<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.particles::<_, u32>(py, |p| &p.clump, false)
    }
    /// Bit masks of the scenario's named sets, (n,).
    #[getter]
    fn tags<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.particles::<_, u64>(py, |p| &p.tags, false)
    }

    /// A writable view of `positions`, `velocities`, or `angular_velocities`. Raises ValueError for the other arrays, with the reason.
    ///
    /// The change of the kinetic energy by velocities that are written between steps counts as external work. New positions start the energy
    /// balance anew. What another thread of Python writes during a step is not defined.
    fn writable<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        if let Some((_, reason)) = FIXED.iter().find(|(fixed, _)| *fixed == name) {
            return Err(PyValueError::new_err(format!("\"{name}\" is not writable: {reason}")));
        }
        {
            let mut inner = self.simulation.bind(py).get().lock()?;
            if inner.written.is_none() {
                inner.change(py, |inner| inner.written = Some(Written::of(&inner.run.state)))?;
            }
        }
        match name {
            "positions" => self.particles::<_, f64>(py, |p| &p.position, true),
            "velocities" => self.particles::<_, f64>(py, |p| &p.velocity, true),
            "angular_velocities" => self.particles::<_, f64>(py, |p| &p.angular_velocity, true),
            _ => Err(PyValueError::new_err(format!(
                "\"{name}\" is not writable; positions, velocities, and angular_velocities are"
            ))),
        }
    }

    /// Edge vectors of the periodic cell as columns, m.
    #[getter]
    fn cell<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let inner = self.simulation.get().lock()?;
        inner.run.state.cell.map(|cell| Ok(tensor(py, &cell.matrix)?.into_any())).transpose()
    }

    /// Number of steps so far.
    #[getter]
    fn step(&self) -> PyResult<u64> {
        Ok(self.simulation.get().lock()?.run.state.clock.step)
    }

    /// Time, s.
    #[getter]
    fn time(&self) -> PyResult<f64> {
        Ok(self.simulation.get().lock()?.run.state.clock.time())
    }

    /// Time step, s.
    #[getter]
    fn time_step(&self) -> PyResult<f64> {
        Ok(self.simulation.get().lock()?.run.state.clock.dt)
    }

    /// Number of intact bonds.
    #[getter]
    fn bond_count(&self) -> PyResult<usize> {
        Ok(self.simulation.get().lock()?.run.state.bond_count())
    }

    /// Tables of all active contacts: bonds by law, `unbonded`, and `walls`.
    fn contacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let inner = self.simulation.get().lock()?;
        let state = &inner.run.state;
        let dict = PyDict::new(py);
        let ids = &state.particles.id;
        for block in &state.bonds {
            dict.set_item(block.law(), contact_table(py, block.contacts(), ids, true)?)?;
        }
        if let Some(block) = &state.contacts {
            dict.set_item("unbonded", contact_table(py, block.contacts(), ids, true)?)?;
        }
        if let Some(block) = &state.wall_contacts {
            dict.set_item("walls", contact_table(py, block.contacts(), ids, false)?)?;
        }
        Ok(dict)
    }

    fn __len__(&self) -> PyResult<usize> {
        Ok(self.simulation.get().lock()?.run.state.particles.len())
    }
}

/// All active contacts of a block, with their histories.
pub fn contact_table<'py>(
    py: Python<'py>,
    block: &dyn Contacts,
    ids: &[u32],
    particles: bool,
) -> PyResult<Bound<'py, PyAny>> {
    let kept: Vec<usize> = (0..block.len()).filter(|&k| block.view(k).flags.carries()).collect();
    let views: Vec<_> = kept.iter().map(|&k| block.view(k)).collect();
    let u32s = |of: &dyn Fn(&concordem::state::contacts::ContactView) -> u32| {
        let values: Vec<u32> = views.iter().map(of).collect();
        scalars(py, &values).into_any()
    };
    let reals = |of: &dyn Fn(&concordem::state::contacts::ContactView) -> f64| {
        let values: Vec<f64> = views.iter().map(of).collect();
        scalars(py, &values).into_any()
    };
    let second = |b: u32| if particles { ids[b as usize] } else { b };
    let images: Vec<[i8; 3]> = views.iter().map(|v| v.flags.image).collect();
    let normals: Vec<_> = views.iter().map(|v| v.previous.normal).collect();
    let bonded: Vec<bool> = views.iter().map(|v| v.flags.has(ContactFlags::BONDED)).collect();
    let damage: Vec<f64> = kept.iter().map(|&k| block.damage(k)).collect();
    let mut columns: Vec<(&str, &str, Bound<'py, PyAny>)> = vec![
        ("a", "1", u32s(&|v| ids[v.pair.a as usize])),
        ("b", "1", u32s(&|v| second(v.pair.b))),
        ("index_a", "1", u32s(&|v| v.pair.a)),
        ("index_b", "1", u32s(&|v| v.pair.b)),
        ("image", "1", rows::<_, i8>(py, &images, 3)?.into_any()),
        ("bonded", "1", scalars(py, &bonded).into_any()),
        ("reference_length", "m", reals(&|v| v.reference.length)),
        ("area", "m^2", reals(&|v| v.reference.area)),
        ("length", "m", reals(&|v| v.previous.length)),
        ("normal", "1", rows::<_, f64>(py, &normals, 3)?.into_any()),
        ("damage", "1", scalars(py, &damage).into_any()),
    ];
    // Laws keep these names free.
    assert!(columns.iter().map(|column| column.0).eq(COLUMNS_OF_EVERY_CONTACT.iter().copied()));
    let mut first = 0;
    for field in block.history_fields() {
        let row = |&k: &usize| (first..first + field.components).map(move |n| block.history_column(n)[k]);
        let values: Vec<f64> = kept.iter().flat_map(row).collect();
        let flat = scalars(py, &values).into_any();
        let values =
            if field.components == 1 { flat } else { flat.call_method1("reshape", (kept.len(), field.components))? };
        columns.push((field.name, field.unit, values));
        first += field.components;
    }
    let column = |(name, unit, values): (&str, &str, _)| TableColumn { name: name.into(), unit: unit.into(), values };
    table(py, columns.into_iter().map(column).collect())
}
