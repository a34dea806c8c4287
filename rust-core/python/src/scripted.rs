//! Contact laws written in Python: one call per block of contacts, on NumPy arrays.
//!
//! `concordem/laws.py` describes what such a law is, and checks what it returns. Here is the [`ContactLaw`] that calls it. Blocks are
//! evaluated by several threads, but Python runs in one at a time.

use std::collections::HashMap;
use std::panic::resume_unwind;
use std::sync::{Arc, Mutex, PoisonError, RwLock, Weak};

use concordem::conformance::{self, Native, Properties, Station, Subject, Window};
use concordem::kinematics::PointKinematics;
use concordem::law::{ContactGeometry, ContactLaw, EnergySplit, Response, Status, Stiffness};
use concordem::math::Vec3;
use concordem::solver::forces::{self, BlockLaw, LawLoops, StepContext, Tile, Totals, evaluate_tile_in_blocks};
use concordem::solver::{Model, record, walls};
use concordem::state::columns::ColumnStore;
use concordem::state::contacts::{ContactBlock, ContactFlags, Contacts};
use concordem::state::{Particles, State, Wall};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::arrays::{Scalars, Vectors, rows, scalars, vectors};
use crate::errors::{Raised, caught};
use crate::simulation::HISTORIES;

/// Contacts in one call of Python: calls are cheap compared to the work, and the arrays stay in the cache.
const BLOCK: usize = 4096;
/// Vectors of a history.
const VECTORS: usize = 3;
/// Scalars of a history.
const SCALARS: usize = 4;

concordem::law_state! {
    /// History of a contact of a law in Python.
    pub struct ScriptedState {
        /// First vector of the law.
        vector_1: Vec3, "1", Odd;
        /// Second vector of the law.
        vector_2: Vec3, "1", Odd;
        /// Third vector of the law.
        vector_3: Vec3, "1", Odd;
        /// First scalar of the law.
        scalar_1: f64, "1", Even;
        /// Second scalar of the law.
        scalar_2: f64, "1", Even;
        /// Third scalar of the law.
        scalar_3: f64, "1", Even;
        /// Fourth scalar of the law.
        scalar_4: f64, "1", Even;
        /// Normal force of the last step, positive in tension.
        normal_force: f64, "N", Even;
        /// Shear force on A of the last step.
        shear_force: Vec3, "N", Odd;
        /// Work done on a contact whose law gives no energies; counted as stored.
        work: f64, "J", Even;
    }
}

/// A law in Python with what is known about it.
pub struct ScriptedLaw {
    object: Py<PyAny>,
    /// Stiffnesses found so far, by materials and geometry.
    known: Mutex<HashMap<Key, Stiffness>>,
}

/// Materials, and the bits of a geometry.
type Key = ([u16; 2], [u64; 6]);

/// The laws of all simulations. A simulation owns its laws; numbers of laws that are gone are not used again.
static LAWS: RwLock<Vec<Weak<ScriptedLaw>>> = RwLock::new(Vec::new());

/// A law in Python, and the materials of a pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scripted {
    law: u32,
    materials: [u16; 2],
}

impl ScriptedLaw {
    /// Registers a law. It exists as long as the result.
    fn new(object: Py<PyAny>) -> (Arc<Self>, u32) {
        let law = Arc::new(Self { object, known: Mutex::default() });
        let mut laws = LAWS.write().unwrap_or_else(PoisonError::into_inner);
        // A weak reference keeps the memory of a law that is gone.
        if laws.len().is_power_of_two() {
            laws.iter_mut().filter(|law| law.strong_count() == 0).for_each(|law| *law = Weak::new());
        }
        laws.push(Arc::downgrade(&law));
        (law, laws.len() as u32 - 1)
    }

    /// Stiffnesses of contacts with these materials and geometries.
    fn stiffnesses(&self, materials: &[[u16; 2]], geometries: &[ContactGeometry]) -> PyResult<Vec<Stiffness>> {
        Python::attach(|py| {
            let fields = geometry_arrays(py, geometries)?;
            let pairs = rows::<_, u16>(py, materials, 2)?;
            let call = py.import("concordem.laws")?.getattr("_stiffness")?;
            let found: Bound<'_, PyAny> = call.call1((&self.object, fields, pairs))?;
            let found: Scalars<'_> = found.extract()?;
            let stiffness = |k: &[f64]| Stiffness {
                normal: k[0],
                shear: k[1],
                normal_damping: k[2],
                shear_damping: k[3],
                ..Stiffness::default()
            };
            Ok(found.get()?.chunks_exact(4).map(stiffness).collect())
        })
    }

    /// Stores the stiffnesses of many contacts, so that none needs a call of its own.
    fn learn(&self, contacts: &[([u16; 2], ContactGeometry)]) -> PyResult<()> {
        let (materials, geometries): (Vec<_>, Vec<_>) = contacts.iter().copied().unzip();
        let found = self.stiffnesses(&materials, &geometries)?;
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        known.extend(contacts.iter().map(|(pair, geometry)| (*pair, key(geometry))).zip(found));
        Ok(())
    }

    /// Responses of contacts to a step.
    fn respond(&self, contacts: &[Moved<'_>], dt: f64) -> PyResult<Vec<Response<ScriptedState>>> {
        Python::attach(|py| {
            let reals = |of: &dyn Fn(&Moved<'_>) -> f64| {
                let values: Vec<f64> = contacts.iter().map(of).collect();
                scalars(py, &values).into_any()
            };
            let three = |of: &dyn Fn(&Moved<'_>) -> Vec3| -> PyResult<Bound<'_, PyAny>> {
                let values: Vec<Vec3> = contacts.iter().map(of).collect();
                Ok(vectors(py, &values)?.into_any())
            };
            let geometries: Vec<_> = contacts.iter().map(|one| one.motion.geometry).collect();
            let materials: Vec<_> = contacts.iter().map(|one| one.materials).collect();
            let bonded: Vec<bool> = contacts.iter().map(|one| one.motion.bonded).collect();
            let moved = (
                geometry_arrays(py, &geometries)?,
                rows::<_, u16>(py, &materials, 2)?,
                scalars(py, &bonded),
                reals(&|one| one.motion.length),
                reals(&|one| one.motion.length_old),
                reals(&|one| one.motion.elongation),
                reals(&|one| one.motion.elongation_old),
                reals(&|one| one.motion.gap),
                three(&|one| one.motion.normal)?,
                three(&|one| one.motion.shear_increment)?,
                dt,
            );
            let old_vectors: [Bound<'_, PyAny>; VECTORS] = [
                three(&|one| one.motion.transport.apply(&one.old.vector_1))?,
                three(&|one| one.motion.transport.apply(&one.old.vector_2))?,
                three(&|one| one.motion.transport.apply(&one.old.vector_3))?,
            ];
            let old_scalars: [Bound<'_, PyAny>; SCALARS] = [
                reals(&|one| one.old.scalar_1),
                reals(&|one| one.old.scalar_2),
                reals(&|one| one.old.scalar_3),
                reals(&|one| one.old.scalar_4),
            ];
            let call = py.import("concordem.laws")?.getattr("_respond")?;
            let answer = call.call1((&self.object, moved, old_vectors, old_scalars))?;
            let Answer { normal_force, shear_force, vectors, scalars, status, energy } = answer.extract()?;
            let (normal_force, shear_force, status) = (normal_force.get()?, shear_force.get()?, status.get()?);
            let energy = energy.as_ref().map(Scalars::get).transpose()?;
            let mut responses = Vec::with_capacity(contacts.len());
            for (k, contact) in contacts.iter().enumerate() {
                let vector = |i: usize| vectors[i].get().map(|rows| rows[k]);
                let scalar = |i: usize| scalars[i].get().map(|values| values[k]);
                let state = ScriptedState {
                    vector_1: vector(0)?,
                    vector_2: vector(1)?,
                    vector_3: vector(2)?,
                    scalar_1: scalar(0)?,
                    scalar_2: scalar(1)?,
                    scalar_3: scalar(2)?,
                    scalar_4: scalar(3)?,
                    normal_force: normal_force[k],
                    shear_force: shear_force[k],
                    work: 0.0,
                };
                let status = match status[k] as u8 {
                    0 => Status::Lives,
                    1 => Status::Broke,
                    3 => Status::BrokeInShear,
                    _ => Status::Opened,
                };
                responses.push(contact.response(state, status, energy.map(|all| &all[6 * k..6 * k + 6])));
            }
            Ok(responses)
        })
    }
}

/// What `_respond` returns.
#[derive(FromPyObject)]
struct Answer<'py> {
    normal_force: Scalars<'py>,
    shear_force: Vectors<'py>,
    vectors: [Vectors<'py>; VECTORS],
    scalars: [Scalars<'py>; SCALARS],
    status: Scalars<'py>,
    energy: Option<Scalars<'py>>,
}

/// A contact at the end of a step.
struct Moved<'a> {
    motion: &'a PointKinematics,
    old: &'a ScriptedState,
    materials: [u16; 2],
}

impl Moved<'_> {
    /// The response with this history after the step. `energy`: as [`energies`] reads it; without it, the work done on the contact
    /// counts as stored, and is dissipated when the contact ends.
    fn response(&self, mut state: ScriptedState, status: Status, energy: Option<&[f64]>) -> Response<ScriptedState> {
        let Self { motion, old, .. } = self;
        let energy = energy.map_or_else(
            || {
                let lives = f64::from(u8::from(status == Status::Lives));
                let pull = 0.5 * (old.normal_force + lives * state.normal_force);
                let shear = (motion.transport.apply(&old.shear_force) + state.shear_force * lives) * 0.5;
                let work = old.work + pull * (motion.length - motion.length_old) + shear.dot(&motion.shear_increment);
                state.work = work;
                match status {
                    Status::Lives => EnergySplit { stored_normal: work, ..EnergySplit::default() },
                    // Less than nothing is an error of the trapezoidal rule, as at the kink where a contact begins.
                    Status::Broke | Status::BrokeInShear => {
                        let (damage, integration) = (work.max(0.0), work.min(0.0));
                        EnergySplit { stored_normal: damage, damage, integration, ..EnergySplit::default() }
                    }
                    Status::Opened => {
                        EnergySplit { friction: work.max(0.0), integration: work.min(0.0), ..EnergySplit::default() }
                    }
                }
            },
            energies,
        );
        let force = motion.normal * state.normal_force + state.shear_force;
        Response { force, moment: Vec3::zeros(), state, status, energy }
    }
}

/// Energies in the order of `laws.py`, J.
fn energies(of: &[f64]) -> EnergySplit {
    EnergySplit {
        stored_normal: of[0],
        stored_shear: of[1],
        damage: of[2],
        friction: of[3],
        viscous: of[4],
        integration: of[5],
        ..EnergySplit::default()
    }
}

/// Bits of a geometry.
fn key(geometry: &ContactGeometry) -> [u64; 6] {
    let ContactGeometry { reference_length, area, radius_a, radius_b, mass_a, mass_b } = *geometry;
    [reference_length, area, radius_a, radius_b, mass_a, mass_b].map(f64::to_bits)
}

/// The arrays of a `Geometry`.
fn geometry_arrays<'py>(py: Python<'py>, of: &[ContactGeometry]) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let reals = |get: fn(&ContactGeometry) -> f64| {
        let values: Vec<f64> = of.iter().map(get).collect();
        scalars(py, &values).into_any()
    };
    Ok(vec![
        reals(|g| g.reference_length),
        reals(|g| g.area),
        reals(|g| g.radius_a),
        reals(|g| g.radius_b),
        reals(|g| g.mass_a),
        reals(|g| g.mass_b),
    ])
}

/// The value, or an unwinding that carries the exception to the call of Python that began the work.
fn or_unwind<T>(outcome: PyResult<T>) -> T {
    outcome.unwrap_or_else(|error| resume_unwind(Box::new(Raised::new(error))))
}

impl Scripted {
    /// The law; its simulation owns it.
    fn law(self) -> Arc<ScriptedLaw> {
        let laws = LAWS.read().unwrap_or_else(PoisonError::into_inner);
        laws[self.law as usize].upgrade().expect("the simulation owns its laws")
    }
}

impl ContactLaw for Scripted {
    type State = ScriptedState;
    type Kinematics = PointKinematics;
    const NAME: &'static str = "python";

    fn respond(&self, motion: &PointKinematics, old: &ScriptedState, dt: f64) -> Response<ScriptedState> {
        or_unwind(self.law().respond(&[Moved { motion, old, materials: self.materials }], dt)).remove(0)
    }

    fn stiffness(&self, geometry: &ContactGeometry) -> Stiffness {
        let law = self.law();
        let key = (self.materials, key(geometry));
        if let Some(known) = law.known.lock().unwrap_or_else(PoisonError::into_inner).get(&key) {
            return *known;
        }
        or_unwind(law.learn(&[(self.materials, *geometry)]));
        self.stiffness(geometry)
    }

    fn exchanged(&self) -> Self {
        let [a, b] = self.materials;
        Self { materials: [b, a], ..*self }
    }
}

impl BlockLaw for Scripted {
    fn respond_to_all(contacts: &[forces::Moved<'_, Self>], dt: f64) -> Vec<Response<ScriptedState>> {
        let Some(first) = contacts.first() else { return Vec::new() };
        let moved: Vec<Moved<'_>> = contacts
            .iter()
            .map(|one| Moved { motion: &one.kinematics, old: &one.history, materials: one.law.materials })
            .collect();
        or_unwind(first.law.law().respond(&moved, dt))
    }
}

impl LawLoops for Scripted {
    fn evaluate_tile(context: &StepContext<'_>, rows: &[Self], tile: Tile<'_, Self>) -> Totals {
        evaluate_tile_in_blocks(context, rows, tile, BLOCK)
    }
    fn evaluate_walls(
        block: &mut ContactBlock<Self>,
        context: &StepContext<'_>,
        walls: &mut [Wall],
        sums: forces::ParticleSums<'_>,
        record: Option<&mut record::WallForces>,
    ) -> Totals {
        walls::evaluate(block, context, walls, sums, record)
    }
    fn record_contact(block: &ContactBlock<Self>, k: usize, context: &StepContext<'_>) -> record::ContactRecord {
        record::contact_record(block, k, context)
    }
}

/// The laws that replace those of a scenario.
#[derive(Default)]
pub struct Replacement {
    /// Of bonds.
    pub bonds: Option<Py<PyAny>>,
    /// Of contacts without a bond, also with walls.
    pub contacts: Option<Py<PyAny>>,
}

impl Replacement {
    /// The same laws.
    pub fn clone_ref(&self, py: Python<'_>) -> Self {
        let of = |law: &Option<Py<PyAny>>| law.as_ref().map(|law| law.clone_ref(py));
        Self { bonds: of(&self.bonds), contacts: of(&self.contacts) }
    }

    /// Refuses laws that the scenario has no use for, and objects that are no laws.
    pub fn check(&self, py: Python<'_>, scenario: &concordem::scenario::Scenario) -> PyResult<()> {
        for (name, object, used, help) in [
            ("bond_law", &self.bonds, scenario.bonds.is_some(), "add a [bonds] table, whose law it replaces"),
            (
                "contact_law",
                &self.contacts,
                scenario.contacts.law.law().is_some(),
                "set contacts.law to a law, which it replaces",
            ),
        ] {
            let Some(object) = object else { continue };
            is_law(name, object.bind(py))?;
            let softens = |thermal: &concordem::material::ThermalVariation| {
                thermal.stiffness.is_some() || thermal.strength.is_some()
            };
            if scenario.materials.iter().any(|material| {
                material.thermal.as_ref().and_then(|thermal| thermal.variation.as_ref()).is_some_and(softens)
            }) {
                let message = format!("{name} ignores thermal.variation.stiffness and strength; remove these keys");
                return Err(PyValueError::new_err(message));
            }
            if name == "bond_law" && scenario.materials.iter().any(|material| material.strength_scatter.is_some()) {
                return Err(PyValueError::new_err("bond_law ignores material.strength_scatter; remove the table"));
            }
            if name == "bond_law" && scenario.bonds.as_ref().is_some_and(|bonds| !bonds.strength_factors.is_empty()) {
                return Err(PyValueError::new_err("bond_law ignores bonds.strength_factors; remove the key"));
            }
            if name == "bond_law" && !scenario.bondings.is_empty() {
                let message = "bond_law does not apply to bonds that [[bonding]] makes later; remove the table";
                return Err(PyValueError::new_err(message));
            }
            if name == "bond_law" && scenario.fibers.is_some() {
                let message = "bond_law has no moments, which the beams along fibers need; remove [fibers]";
                return Err(PyValueError::new_err(message));
            }
            if !used {
                return Err(PyValueError::new_err(format!("{name} would have no effect; {help}")));
            }
        }
        Ok(())
    }

    /// Names of the histories of the laws, in the order of their places: of bonds, and of contacts.
    pub fn histories(&self, py: Python<'_>) -> PyResult<[Option<String>; 2]> {
        let names = |name: &str, law: &Option<Py<PyAny>>| {
            let Some(law) = law else { return Ok(None) };
            is_law(name, law.bind(py))?;
            py.import("concordem.laws")?.getattr("_history")?.call1((law,))?.extract().map(Some)
        };
        Ok([names("bond_law", &self.bonds)?, names("contact_law", &self.contacts)?])
    }

    /// Refuses to continue bonds or contacts of a law in Python without it, or with one that has another history; and others with one.
    /// `kept`: the columns of the checkpoint besides the state.
    pub fn check_stored(&self, py: Python<'_>, kept: &ColumnStore) -> PyResult<()> {
        let text =
            |name: &str| kept.get(name).map(|column| String::from_utf8_lossy(column.borrow().bytes()).into_owned());
        let stored = HISTORIES.map(text);
        let whose = [("bonds", "bond_law"), ("contacts without a bond", "contact_law")];
        for (((what, name), stored), given) in whose.into_iter().zip(stored).zip(self.histories(py)?) {
            let problem = match (stored, given) {
                (Some(_), None) => format!("the {what} of the checkpoint have a law in Python; give it as {name}"),
                (None, Some(_)) => format!("the {what} of the checkpoint have no law in Python; omit {name}"),
                (Some(stored), Some(given)) if stored != given => format!(
                    "{name} has the history {given}, but the checkpoint was written with {stored}; give a law with the same names in the \
                     same order"
                ),
                _ => continue,
            };
            return Err(PyValueError::new_err(problem));
        }
        Ok(())
    }

    /// Replaces the laws of an assembled state of `materials` materials. The simulation must keep the result.
    pub fn apply(&self, py: Python<'_>, materials: usize, state: &mut State, model: &Model) -> Vec<Arc<ScriptedLaw>> {
        let mut laws = Vec::new();
        if let Some(object) = &self.bonds {
            let (law, number) = ScriptedLaw::new(object.clone_ref(py));
            for block in &mut state.bonds {
                let replaced = bonds_of(block.contacts(), &state.particles, number);
                let geometry = |k: usize| {
                    let pair = replaced.rows[replaced.flags[k].row as usize].materials;
                    (pair, replaced.geometry(k, &state.particles, false))
                };
                or_unwind(law.learn(&(0..replaced.len()).map(geometry).collect::<Vec<_>>()));
                *block = Box::new(replaced);
            }
            laws.push(law);
        }
        if let Some(object) = &self.contacts {
            let (law, number) = ScriptedLaw::new(object.clone_ref(py));
            let mut rows = Vec::new();
            let pairs = (0..materials as u16).flat_map(|a| (0..materials as u16).map(move |b| [a, b]));
            for pair in pairs {
                if let Some(row) = model.contact_rows.get(pair[0], pair[1]) {
                    rows.resize(rows.len().max(row as usize + 1), Scripted { law: number, materials: pair });
                    rows[row as usize].materials = pair;
                }
            }
            for block in [&mut state.contacts, &mut state.wall_contacts].into_iter().flatten() {
                *block = Box::new(ContactBlock::new(rows.clone()));
            }
            laws.push(law);
        }
        laws
    }
}

/// Refuses an object that is no law. `name`: of the argument.
fn is_law(name: &str, object: &Bound<'_, PyAny>) -> PyResult<()> {
    if object.is_instance(&object.py().import("concordem.laws")?.getattr("Law")?)? {
        return Ok(());
    }
    let kind = object.get_type().name()?;
    let message = format!("{name} is of type {kind}; derive its class from concordem.laws.Law, and give an instance");
    Err(PyTypeError::new_err(message))
}

/// The bonds of a block, with the law of number `law`.
fn bonds_of(block: &dyn Contacts, particles: &Particles, law: u32) -> ContactBlock<Scripted> {
    let mut replaced = ContactBlock::new(Vec::new());
    for k in 0..block.len() {
        let view = block.view(k);
        let (row, pair) = (view.flags.row as usize, view.pair);
        let materials = [pair.a, pair.b].map(|p| particles.material[p as usize]);
        let rows = &mut replaced.rows;
        rows.resize(rows.len().max(row + 1), Scripted { law, materials });
        rows[row].materials = materials;
        debug_assert!(!view.flags.has(ContactFlags::BROKEN));
        replaced.push(view.pair, view.flags, view.reference, view.previous);
    }
    replaced
}

/// Run the conformance suite on a law in Python. Returns whether it passed, and the report.
///
/// `geometry`: reference length (m), area (m²), radii (m), masses (kg); `elastic`, `inelastic`: elongations from and to, and the
/// largest shear displacement, m; `held`: elongation and two shear displacements, m; `claims`: the properties in the order of
/// `Properties`.
#[pyfunction]
fn _law_conformance(
    law: Bound<'_, PyAny>,
    bonded: bool,
    geometry: [f64; 6],
    elastic: [f64; 3],
    inelastic: [f64; 3],
    held: [f64; 3],
    failure: f64,
    dt: f64,
    claims: [bool; 5],
) -> PyResult<(bool, String)> {
    let (_law, number) = ScriptedLaw::new(law.unbind());
    let [reference_length, area, radius_a, radius_b, mass_a, mass_b] = geometry;
    let window = |[from, to, shear]: [f64; 3]| Window { elongation: [from, to], shear };
    let [conservative_normal, conservative_shear, dissipation_nonnegative, continuous_failure, brittle] = claims;
    let subject = Subject {
        name: "the law in Python",
        host: Native(Scripted { law: number, materials: [0, 0] }),
        geometry: ContactGeometry { reference_length, area, radius_a, radius_b, mass_a, mass_b },
        bonded,
        properties: Properties {
            conservative_normal,
            conservative_shear,
            dissipation_nonnegative,
            continuous_failure,
            brittle,
        },
        elastic: window(elastic),
        inelastic: window(inelastic),
        held: Station { elongation: held[0], shear: [held[1], held[2]], twist: 0.0 },
        failure,
        dt,
    };
    let report = caught(|| conformance::check(&subject))?;
    Ok((report.passed(), report.to_string()))
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(_law_conformance, module)?)
}
