//! Representative cells: periodic packings as material points.

use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use concordem::assembly::restart::{self, Continuation};
use concordem::assembly::{Assembly, assemble};
use concordem::output::checkpoint;
use concordem::packing::memory::affordable_bytes;
use concordem_continuum::HandOver;
use concordem_multiscale::{CellError, RepresentativeCell, Response, Snapshot, deform};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::arrays::{Tensors, result, scalars, tensor, tensors, vectors};
use crate::errors::{OrRaise, caught, detach_here, of_assembly, of_restart};
use crate::scenario::Scenario;
use crate::shared::Shared;
use crate::warnings::warn;
use crate::work::{Pool, guarded};

type Any<'py> = PyResult<Bound<'py, PyAny>>;

/// Periodic cells of one scenario that follow the deformation gradients of a continuum, in parallel over all processors.
///
/// All cells start equal. `threads`: number of threads; the results do not depend on it. Raises ContinuumError if the scenario has no
/// periodic cell, or a loading of its own.
#[pyclass(frozen, module = "concordem.coupling")]
pub struct RepresentativeCells {
    cells: Shared<Vec<RepresentativeCell>>,
    pool: Pool,
    count: usize,
    scenario: Py<Scenario>,
    /// The cells as they were built: the frame of states from files.
    assembly: Mutex<Assembly>,
}

/// Steps of particles from which on signals must be answered meanwhile: a tenth of a second.
const LONG: usize = 200_000;

/// States of all cells at one moment.
#[pyclass(frozen, module = "concordem.coupling")]
pub struct CellStates(Vec<Snapshot>);

/// The results of all cells, or the error of the first one that failed, with its index.
fn all<T>(found: Vec<Result<T, CellError>>) -> PyResult<Vec<T>> {
    let mut values = Vec::with_capacity(found.len());
    for (cell, value) in found.into_iter().enumerate() {
        values.push(value.map_err(|error| (cell, error)).or_raise()?);
    }
    Ok(values)
}

#[pymethods]
impl RepresentativeCells {
    #[new]
    #[pyo3(signature = (scenario, count=1, threads=None, progress=None))]
    fn new(
        py: Python<'_>,
        scenario: &Bound<'_, Scenario>,
        count: usize,
        threads: Option<usize>,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        if count == 0 {
            return Err(PyValueError::new_err("count is 0; give at least 1"));
        }
        let Scenario { inner, folder } = scenario.get();
        let assembly = guarded(py, threads, progress.as_ref(), |progress| assemble(inner, folder, progress))?;
        let assembly = assembly.map_err(|error| of_assembly(inner, error))?;
        warn(py, inner, &assembly.summary.warnings)?;
        let each = bytes_of_cell(&assembly);
        affordable_bytes(&format!("{count} cells"), count as f64 * each).or_raise()?;
        let pool = Pool::new(threads)?;
        let cells: Vec<_> = detach_here(py, || {
            pool.inside(|| (0..count).into_par_iter().map(|_| RepresentativeCell::new(&assembly)).collect())
        })?;
        let cells = Shared::new(
            all(cells)?,
            "the cells are deforming in another thread; wait for it",
            "a cell failed in the middle of a step, so its state is invalid; build the cells again",
        );
        let assembly = Mutex::new(assembly);
        Ok(Self { cells, pool, count, scenario: scenario.clone().unbind(), assembly })
    }

    /// Deform each cell to its deformation gradient F = ∂x/∂X since the start, linearly in `steps` of its own steps.
    ///
    /// Args: `gradient` (n, 3, 3). Raises ContinuumError with the index of the cell: inverted gradient, failed step, last bond lost. The
    /// other cells are deformed then. After Ctrl-C each cell has taken a part of the steps: restore a state.
    #[pyo3(signature = (gradient, steps=1))]
    fn deform(&self, py: Python<'_>, gradient: Tensors<'_>, steps: u32) -> PyResult<()> {
        let gradient = gradient.get()?;
        if gradient.len() != self.count {
            let message = format!("{} gradients for {} cells; give one per cell", gradient.len(), self.count);
            return Err(PyValueError::new_err(message));
        }
        let mut cells = self.cells.lock()?;
        let pool = &self.pool;
        let particles: usize = cells.iter().map(|cell| cell.state().particles.len()).sum();
        let found = if particles.saturating_mul(steps as usize) < LONG {
            cells.change(py, |cells| pool.inside(|| deform(cells, &gradient, steps)))
        } else {
            cells.change_answering(py, pool, |cells| deform(cells, &gradient, steps))
        };
        all(found?).map(drop)
    }

    /// Stress, couple stress, damage, and intact bonds of all cells at their present positions. Does not change their states.
    ///
    /// `formulas` of the damage tensor: "printed" or "coded", see handover_tensor. Returns CellResponse.
    #[pyo3(signature = (formulas="printed"))]
    fn response<'py>(&self, py: Python<'py>, formulas: &str) -> Any<'py> {
        let formulas = match formulas {
            "printed" => HandOver::Printed,
            "coded" => HandOver::Coded,
            other => {
                let message = format!("formulas is \"{other}\"; give \"printed\" or \"coded\"");
                return Err(PyValueError::new_err(message));
            }
        };
        let mut cells = self.cells.lock()?;
        let pool = &self.pool;
        let found: Vec<_> = cells
            .change(py, |cells| pool.inside(|| cells.par_iter_mut().map(RepresentativeCell::response).collect()))?;
        let found: Vec<Response> = all(found)?;
        let damage = if found.iter().all(|response| response.damage.is_some()) {
            Some(tensors(py, found.iter().filter_map(|r| r.damage.map(|links| formulas.tensor(&links))).collect())?)
        } else {
            None
        };
        let reals = |of: fn(&Response) -> f64| scalars(py, &found.iter().map(of).collect::<Vec<f64>>());
        let bonds: Vec<u64> = found.iter().map(|response| response.bonds as u64).collect();
        let fields = (
            tensors(py, found.iter().map(|response| response.stress).collect())?,
            tensors(py, found.iter().map(|response| response.couple_stress).collect())?,
            damage,
            reals(|response| response.volume),
            scalars(py, &bonds),
            reals(|response| response.work),
        );
        result(py, "CellResponse", fields)
    }

    /// Elastic stiffness of the intact bonds, all particles in equilibrium, without damage; Pa, (n, 6, 6), components 11, 22, 33, 23, 31,
    /// 12 with engineering shears.
    fn stiffness<'py>(&self, py: Python<'py>) -> Any<'py> {
        let mut cells = self.cells.lock()?;
        let pool = &self.pool;
        let found: Vec<_> =
            cells.change(py, |cells| pool.inside(|| cells.par_iter().map(RepresentativeCell::stiffness).collect()))?;
        let mut reals = Vec::with_capacity(36 * self.count);
        for matrix in all(found)? {
            reals.extend_from_slice(matrix.transpose().as_slice());
        }
        Ok(PyArray1::from_vec(py, reals).reshape([self.count, 6, 6])?.into_any())
    }

    /// Deformation gradients since the start, (n, 3, 3).
    #[getter]
    fn deformation_gradient<'py>(&self, py: Python<'py>) -> Any<'py> {
        let cells = self.cells.lock()?;
        Ok(tensors(py, cells.iter().map(RepresentativeCell::deformation_gradient).collect())?.into_any())
    }

    /// Time step of the cells, s.
    #[getter]
    fn time_step(&self) -> PyResult<f64> {
        Ok(self.cells.lock()?[0].state().clock.dt)
    }

    /// Mass over volume of the cells at present, kg/m³, (n,).
    #[getter]
    fn density<'py>(&self, py: Python<'py>) -> Any<'py> {
        let cells = self.cells.lock()?;
        let density = |cell: &RepresentativeCell| {
            let state = cell.state();
            state.particles.mass.iter().sum::<f64>() / state.cell.map_or(1.0, |cell| cell.volume())
        };
        Ok(scalars(py, &cells.iter().map(density).collect::<Vec<f64>>()).into_any())
    }

    /// Particles of cell `cell`, as copies, for pictures. Returns CellParticles. Raises ValueError for a cell that does not exist.
    fn particles<'py>(&self, py: Python<'py>, cell: usize) -> Any<'py> {
        if cell >= self.count {
            let message = format!("cell is {cell}, but there are {} cells, counted from 0", self.count);
            return Err(PyValueError::new_err(message));
        }
        let cells = self.cells.lock()?;
        let state = cells[cell].state();
        let particles = &state.particles;
        let edges = state.cell.map_or_else(concordem::math::Mat3::identity, |cell| cell.matrix);
        let fields = (vectors(py, &particles.position)?, scalars(py, &particles.radius), tensor(py, &edges)?);
        result(py, "CellParticles", fields)
    }

    /// Hashes of the complete states.
    fn state_hashes(&self) -> PyResult<Vec<String>> {
        let cells = self.cells.lock()?;
        self.pool
            .inside(|| cells.iter().map(|cell| concordem::output::hash::state_hash(cell.state())).collect::<Vec<_>>())
            .into_iter()
            .map(OrRaise::or_raise)
            .collect()
    }

    /// The complete states, in memory.
    fn save(&self) -> PyResult<CellStates> {
        Ok(CellStates(self.cells.lock()?.iter().map(RepresentativeCell::snapshot).collect()))
    }

    /// Go back to states of `save`; the cells then continue bit by bit.
    fn restore(&self, py: Python<'_>, states: &Bound<'_, CellStates>) -> PyResult<()> {
        let states = &states.get().0;
        if states.len() != self.count {
            let message = format!("{} states for {} cells; restore states of these cells", states.len(), self.count);
            return Err(PyValueError::new_err(message));
        }
        let mut cells = self.cells.lock()?;
        let pool = &self.pool;
        let found: Vec<_> = cells.change(py, |cells| {
            pool.inside(|| cells.par_iter_mut().zip(states).map(|(cell, state)| cell.restore(state)).collect())
        })?;
        all(found).map(drop)
    }

    /// Write the complete states to the folder `folder`, a checkpoint for each cell; returns their hashes.
    fn write(&self, py: Python<'_>, folder: PathBuf) -> PyResult<Vec<String>> {
        let cells = self.cells.lock()?;
        let text = &self.scenario.get().inner.source.text;
        std::fs::create_dir_all(&folder)
            .map_err(|error| PyOSError::new_err(format!("{}: {error}", folder.display())))?;
        let write = |(k, cell): (usize, &RepresentativeCell)| checkpoint::write(&file(&folder, k), cell.state(), text);
        let written: Vec<_> = detach_here(py, || self.pool.inside(|| cells.iter().enumerate().map(write).collect()))?;
        written.into_iter().map(OrRaise::or_raise).collect()
    }

    /// Go back to the states that `write` put into the folder `folder`; the cells then continue bit by bit.
    ///
    /// Checks seals and hashes of the files, the number of cells, their particles, and that the scenario is the same. If one does not
    /// fit, all cells keep their states.
    fn read(&self, py: Python<'_>, folder: PathBuf) -> PyResult<()> {
        let inner = &self.scenario.get().inner;
        let surplus = file(&folder, self.count);
        if surplus.exists() {
            let message = format!("{} exists, but there are only {} cells", surplus.display(), self.count);
            return Err(PyValueError::new_err(message));
        }
        let mut assembly = self.assembly.lock().unwrap_or_else(PoisonError::into_inner);
        let mut states = Vec::with_capacity(self.count);
        for k in 0..self.count {
            let path = file(&folder, k);
            let mut stored = detach_here(py, || self.pool.inside(|| checkpoint::read(&path)))?.or_raise()?;
            let before =
                concordem::scenario::Scenario::parse(&path.display().to_string(), &stored.provenance).or_raise()?;
            let changes = caught(|| restart::check(&before, inner, Continuation::NewResult))?.or_raise()?;
            if let Some(change) = changes.first() {
                let message = format!(
                    "{}: written with another scenario: {} was {}, and is {}",
                    path.display(),
                    change.key,
                    change.before,
                    change.after
                );
                return Err(PyValueError::new_err(message));
            }
            let fresh = assembly.state.clone();
            let (frame, columns) = (&mut *assembly, &mut stored.columns);
            let applied = caught(|| self.pool.inside(|| restart::apply(frame, columns, inner, &[], false)));
            let state = std::mem::replace(&mut assembly.state, fresh);
            applied?.map_err(|error| of_restart(inner, error))?;
            states.push(Snapshot::of(state));
        }
        let mut cells = self.cells.lock()?;
        let pool = &self.pool;
        let found: Vec<_> = cells.change(py, |cells| {
            pool.inside(|| cells.par_iter_mut().zip(&states).map(|(cell, state)| cell.restore(state)).collect())
        })?;
        all(found).map(drop)
    }

    fn __len__(&self) -> usize {
        self.count
    }
}

/// Memory of a cell, bytes: its state, and as much again for its solver.
fn bytes_of_cell(assembly: &Assembly) -> f64 {
    let Assembly { state, .. } = assembly;
    let bonds: usize = state.bonds.iter().map(|bonds| bonds.len() * bonds.bytes_per_contact()).sum();
    2.0 * (size_of_val(&state.particles.position[..]) * VECTORS + bonds) as f64
}

/// Vectors per particle in a state: place, motion, orientation, mass.
const VECTORS: usize = 8;

/// File of a cell's state.
fn file(folder: &Path, cell: usize) -> PathBuf {
    folder.join(format!("cell-{cell:05}.h5"))
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<RepresentativeCells>()?;
    module.add_class::<CellStates>()
}
