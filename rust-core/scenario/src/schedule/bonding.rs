//! Bonds made during a run, by a criterion.

use concordem_packing::bonding::bond_more;
use concordem_solver::neighbor::NeighborError;
use concordem_solver::state::State;
use concordem_solver::state::contacts::Pair;
use concordem_solver::{Model, PairCoefficients, Solver, SolverError};

/// Bonds that are made once during a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Bonding {
    /// When.
    pub moment: Moment,
    /// Largest center distance of bonded particles over the sum of their radii.
    pub interaction_ratio: f64,
    /// The two materials that are bonded; `None`: all.
    pub between: Option<[u16; 2]>,
}

/// When bonds are made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Moment {
    /// At the end of the stage with this index.
    EndOfStage(usize),
    /// From a time (s) on, as soon as the kinetic energy (J) is below a value, if one is given.
    After {
        /// Time, s.
        time: f64,
        /// Kinetic energy, J.
        kinetic_energy: Option<f64>,
    },
}

impl Bonding {
    /// Whether the bonds are made in this `state`; `ended`: the stage that has just ended.
    pub(super) fn is_due(&self, state: &State, ended: Option<usize>) -> bool {
        match self.moment {
            Moment::EndOfStage(stage) => ended == Some(stage),
            Moment::After { time, kinetic_energy } => {
                state.clock.time() >= time && kinetic_energy.is_none_or(|limit| state.ledger.kinetic < limit)
            }
        }
    }

    /// Makes the bonds, in place of the unbonded contacts of their pairs; returns their number. Pairs that have a bond, or had one that
    /// broke, get none.
    pub(super) fn make(&self, state: &mut State, rows: &PairCoefficients) -> Result<usize, NeighborError> {
        let Some(block) = state.bonds.first_mut() else { return Ok(0) };
        let block = block.contacts_mut();
        let mut present: Vec<(Pair, [i8; 3])> =
            block.pairs().iter().zip(block.flags()).map(|(pair, flags)| (*pair, flags.image)).collect();
        present.extend(state.broken.iter().map(|bond| (bond.pair, bond.image)));
        present.sort_unstable();
        let particles = &state.particles;
        let fits = |pair: Pair| {
            let found = [pair.a, pair.b].map(|p| particles.material[p as usize]);
            self.between.is_none_or(|[a, b]| found == [a, b] || found == [b, a])
        };
        let wanted = |pair: Pair, image: [i8; 3]| fits(pair) && present.binary_search(&(pair, image)).is_err();
        let made = bond_more(block, rows, particles, state.cell.as_ref(), self.interaction_ratio, &wanted)?;
        if let Some(contacts) = &mut state.contacts {
            contacts.contacts_mut().retain_pairs(&|pair, image| made.binary_search(&(pair, image)).is_err());
        }
        Ok(made.len())
    }
}

/// Energy stored in all contacts at the present positions, J: that of the next step.
pub(super) fn stored_energy(model: &Model, state: &State) -> Result<f64, SolverError> {
    let mut probe = state.clone();
    let report = Solver::new(model.clone(), &mut probe)?.find_forces(&mut probe, true)?;
    let energy = report.energy;
    Ok(energy.stored_normal + energy.stored_shear + energy.stored_bending + energy.stored_twist)
}
