//! An operator with its region, options, and interval, and its evaluation on a state.

use super::definition::{Row, Sampling};
use super::operators::Operator;
use super::state::SampledState;
use concordem_contact::math::{Mat3, Vec3};
use concordem_operator::stress::{Partition, region_stress};
use concordem_operator::{OperatorError, Region, Truncation};

/// Region of a scheduled operator.
#[derive(Debug, Clone, PartialEq)]
pub enum SampledRegion {
    /// A region that moves by `x → x⁰ + exp(L t)(x − x⁰) + v t`, where `x⁰` is its center at time zero (the origin if it
    /// has no center).
    Moving {
        /// The region at time zero.
        region: Region,
        /// Velocity `v`, m/s.
        velocity: Vec3,
        /// Velocity gradient `L`, 1/s.
        gradient: Mat3,
    },
    /// The periodic cell at the time of evaluation.
    Cell,
}

/// A wall, and the area that the traction refers to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledWall {
    /// Index of the wall in the state.
    pub wall: u32,
    /// Area, m².
    pub area: f64,
}

/// An operator with its region and interval.
#[derive(Debug, Clone, PartialEq)]
pub struct ScheduledOperator {
    /// Name of its group in the result.
    pub name: String,
    /// The operator.
    pub operator: Operator,
    /// Region of evaluation.
    pub region: SampledRegion,
    /// Number of cells along x, y, z into which a box is divided; each cell gives its own values.
    pub grid: Option<[usize; 3]>,
    /// Treatment of contacts that cross the boundary of the region.
    pub truncation: Truncation,
    /// Division of a branch vector between the two particles of a contact.
    pub partition: Partition,
    /// The wall, for tractions.
    pub wall: Option<SampledWall>,
    /// Particles of the sets, by index, for the operators that read sets: none, one list, or two.
    pub sets: Vec<Vec<u32>>,
    /// Point that moments refer to, m; the mean position of the set if `None`.
    pub about: Option<Vec3>,
    /// Steps between two evaluations.
    pub interval: u64,
}

impl ScheduledOperator {
    /// Number of cells; each cell gives its own values.
    pub fn cells(&self) -> usize {
        self.grid.map_or(1, |count| count.iter().product())
    }

    /// Values at a state: the components of each of [`Operator::quantities`], for each cell of the grid (x fastest).
    ///
    /// An empty region gives not-a-number, not an error, because a moving region may pass through empty space.
    ///
    /// # Errors
    /// The operator cannot be evaluated on this state; also if the deforming cell no longer bounds half-spaces.
    pub fn evaluate(&self, state: &SampledState<'_>) -> Result<Vec<f64>, OperatorError> {
        let rows = self
            .regions(state)
            .iter()
            .map(|region| match self.row(region, state) {
                Err(OperatorError::EmptyRegion { .. } | OperatorError::Flat { .. }) => {
                    Ok(vec![f64::NAN; self.operator.width()])
                }
                other => other,
            })
            .collect::<Result<Vec<_>, _>>()?;
        let mut values = Vec::with_capacity(self.operator.width() * rows.len());
        let mut first = 0;
        for quantity in self.operator.quantities() {
            let last = first + quantity.components;
            for row in &rows {
                values.extend_from_slice(&row[first..last]);
            }
            first = last;
        }
        Ok(values)
    }

    /// Moments `V_p σ_p` (J) of the particles in the region, by index; see
    /// [`particle_moments`](concordem_operator::stress::particle_moments).
    ///
    /// # Errors
    /// The forces do not match the particles.
    pub fn particle_moments(&self, state: &SampledState<'_>) -> Result<Vec<(usize, Mat3)>, OperatorError> {
        let (moments, period) = (state.particle_moments(self.partition)?, state.period());
        let regions = self.regions(state);
        let images: Vec<_> = regions.iter().map(|region| region.images(period.as_ref())).collect();
        let inside = |p: usize| {
            let x = &state.particles.position[p];
            images.iter().any(|images| images.inside(p, x).next().is_some())
        };
        Ok(moments.into_iter().enumerate().filter(|(p, _)| inside(*p)).collect())
    }

    /// Whether the region currently contains neither particles nor contacts.
    ///
    /// # Errors
    /// The region has no valid shape.
    pub fn is_empty(&self, state: &SampledState<'_>) -> Result<bool, OperatorError> {
        if !self.operator.definition().region.has_region() {
            return Ok(false);
        }
        let (contacts, period) = (state.forces.contacts.set(state.particles)?, state.period());
        for region in self.regions(state) {
            let images = region.images(period.as_ref());
            let mut positions = state.particles.position.iter().enumerate();
            let list = matches!(region, Region::Particles { .. });
            let truncation = if list { Truncation::HalfCrossing } else { Truncation::BranchClipped };
            let found = region_stress(&contacts, &region, truncation, period.as_ref())?;
            if positions.any(|(p, x)| images.inside(p, x).next().is_some()) || found.full + found.partial > 0.0 {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// The region now, or the cells of its grid.
    fn regions(&self, state: &SampledState<'_>) -> Vec<Region> {
        let (region, velocity, gradient) = match (&self.region, &state.cell) {
            (SampledRegion::Cell, Some(cell)) => return vec![Region::periodic_cell(&cell.matrix)],
            (SampledRegion::Cell, None) => return vec![Region::All { volume: f64::NAN }],
            (SampledRegion::Moving { region, velocity, gradient }, _) => (region, velocity, gradient),
        };
        let origin = region.center().unwrap_or_else(Vec3::zeros);
        let parts = match (self.grid, region) {
            (Some(count), Region::Box { low, high }) => Region::grid(*low, *high, count),
            _ => vec![region.clone()],
        };
        if *velocity == Vec3::zeros() && *gradient == Mat3::zeros() {
            return parts;
        }
        let deformation = (gradient * state.time).exp();
        parts.iter().map(|part| part.moved(&deformation, &origin, &(velocity * state.time))).collect()
    }

    /// Values in one region.
    fn row(&self, region: &Region, state: &SampledState<'_>) -> Result<Vec<f64>, OperatorError> {
        let contacts = state.forces.contacts.set(state.particles)?;
        let (period, joined) = (state.period(), state.carrying());
        let carrying = joined.as_ref().map_or(Ok(contacts), |joined| joined.set(state.particles))?;
        region.check_period(period.as_ref())?;
        let sampling = Sampling { sample: self, region, state, contacts, carrying, period };
        let mut row = Row::default();
        (self.operator.definition().evaluate)(&sampling, &mut row)?;
        Ok(row.0)
    }
}
