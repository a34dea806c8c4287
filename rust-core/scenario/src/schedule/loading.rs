//! Loading of a specimen, and measurement of its stress and strain.

use super::Flexure;
use concordem_contact::math::{Mat3, Vec3, quaternion_of_rotation_vector, rotate};
use concordem_packing::TIE;
use concordem_solver::state::State;
use concordem_solver::{Slider, Solver, StepReport};

/// Loading of a specimen.
#[derive(Debug, Clone, PartialEq)]
pub enum Loading {
    /// No loading beyond constraints, walls, and forces.
    None,
    /// End layers with prescribed velocity along `axis`.
    Uniaxial {
        /// Axis, 0 to 2.
        axis: usize,
        /// Indices of the particles of the lower and the upper layer.
        layers: [Vec<u32>; 2],
        /// Speed of each layer, m/s; positive in tension.
        speed: f64,
        /// Initial distance between the mean positions of the layers, m.
        distance: f64,
        /// Length that the strain refers to, m.
        length: f64,
        /// Cross-section, m².
        area: f64,
        /// Particles for measuring the strain away from the layers.
        gauge: Gauge,
    },
    /// End layers that rotate rigidly in opposite directions, each about its own center. Along the axis of the specimen they
    /// move freely as rigid bodies, so that no axial force builds up.
    Turning {
        /// Axis of the specimen, 0 to 2.
        axis: usize,
        /// Axis of the rotation: that of the specimen for torsion, another one for bending.
        about: usize,
        /// Indices of the particles of the lower and the upper layer.
        layers: [Vec<u32>; 2],
        /// Rate of change of the angle between the layers, rad/s; each layer rotates at half of it.
        rate: f64,
        /// Distance between the centers of the layers, m.
        length: f64,
        /// Stress at the surface divided by the end moment, 1/m³: `h/2I` in bending, `R/I_O` in torsion.
        stress_of_moment: f64,
        /// Distance of the surface from the neutral plane or the axis, m.
        lever: f64,
        /// Cross-section, m².
        area: f64,
    },
    /// The periodic cell deforms with a given velocity gradient.
    CellStrain {
        /// Initial volume of the cell, m³.
        initial_volume: f64,
        /// Velocity gradient, 1/s.
        velocity_gradient: Mat3,
    },
    /// A servo deforms the periodic cell until it reaches a stress.
    CellStress {
        /// Target stress, Pa.
        stress: Mat3,
        /// Strain rates of axes that do not follow the stress, 1/s.
        strain_rate: [Option<f64>; 3],
        /// Largest rate of any strain component, 1/s.
        maximum_rate: f64,
        /// Upper bound of the stiffness of the cell before the first step, Pa, or of loose particles under the target; 0 without contacts.
        stiffness: f64,
        /// Strain that brings the cell from its first state to the target, at most; 0 without contacts.
        strain: f64,
        /// Time in which loose particles come to rest under the target, s; 0 with bonds, and without contacts.
        settling: f64,
        /// Relative error at which the target counts as reached.
        tolerance: f64,
        /// Stress to which the error is relative, Pa: the largest component of the target; for zero stress, the stress
        /// at the strain `ZERO_STRESS_STRAIN`.
        reference: f64,
    },
    /// Two plates that press on the specimen.
    Platens {
        /// Axis, 0 to 2.
        axis: usize,
        /// Indices of the lower and the upper wall.
        walls: [usize; 2],
        /// Speed of each plate towards the specimen, m/s.
        speed: f64,
        /// Initial distance between the plates, m.
        length: f64,
        /// Cross-section, m².
        area: f64,
        /// Factor of the stress: 1, or −1 where pressing on a cylinder pulls its middle apart.
        sign: f64,
        /// Particles for measuring the strain away from the plates.
        gauge: Gauge,
    },
    /// A beam on two supports, bent by rollers.
    Flexure(Flexure),
}

/// In a cell without stress, contact forces below this fraction of those at the reference stress are rounding errors.
const ROUNDING: f64 = 1e-6;

/// Particles of the middle half of a specimen, with their initial coordinates.
///
/// End layers are stiffer than the rest, so the strain computed from their distance is smaller than that of the material
/// (and includes deformation at the grips). The gauge strain is the slope of the straight line fitted by least squares to
/// the axial displacement of these particles over their axial coordinate.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Gauge {
    /// Index and initial axial coordinate (m) relative to the mean.
    particles: Vec<(u32, f64)>,
    /// Mean of the initial axial coordinates, m.
    mean: f64,
}

impl Gauge {
    /// Gauge over the middle half of the range from `bottom` to `top` (m, along `axis`).
    pub fn new(state: &State, axis: usize, bottom: f64, top: f64) -> Self {
        let (middle, quarter) = (0.5 * (bottom + top), 0.25 * (top - bottom));
        let coordinate = |p: usize| state.particles.position[p][axis];
        let inside: Vec<usize> =
            (0..state.particles.len()).filter(|&p| (coordinate(p) - middle).abs() <= quarter * (1.0 + TIE)).collect();
        let mean = inside.iter().map(|&p| coordinate(p)).sum::<f64>() / inside.len().max(1) as f64;
        Self { particles: inside.into_iter().map(|p| (p as u32, coordinate(p) - mean)).collect(), mean }
    }

    /// Gauge of the same particles along another axis.
    pub(crate) fn turned(&self, state: &State, axis: usize) -> Self {
        let coordinate = |p: u32| state.particles.position[p as usize][axis];
        let mean = self.particles.iter().map(|&(p, _)| coordinate(p)).sum::<f64>() / self.particles.len().max(1) as f64;
        Self { particles: self.particles.iter().map(|&(p, _)| (p, coordinate(p) - mean)).collect(), mean }
    }

    /// The gauge strain; `None` if there are fewer than two distinct coordinates.
    pub(super) fn strain(&self, state: &State, axis: usize) -> Option<f64> {
        let (mut moment, mut square) = (0.0, 0.0);
        for &(p, x) in &self.particles {
            moment += x * (state.particles.position[p as usize][axis] - self.mean - x);
            square += x * x;
        }
        (square > 0.0).then(|| moment / square)
    }
}

/// Mean of `values` over a layer.
fn mean_of(layer: &[u32], values: &[Vec3]) -> Vec3 {
    layer.iter().map(|&p| values[p as usize]).sum::<Vec3>() / layer.len() as f64
}

/// Mean stress and strain of the specimen.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Measure {
    /// Strain along the loading axis (periodic cell: the component of `F − 1` of the largest magnitude; bending: the strain
    /// of the outer fiber; torsion: the shear angle of the surface, rad).
    pub strain: f64,
    /// Stress along the loading axis (periodic cell: the component with those indices), Pa.
    pub stress: f64,
    /// Full mean stress of a periodic cell, Pa.
    pub tensor: Mat3,
}

impl Loading {
    /// Drives the cell, the ends, or the plates; called before every step.
    ///
    /// `factor`: of the rate, from the present stage; `None` without stages. A servo of a cell is driven by [`Self::apply_to_cell`].
    pub(super) fn apply(&self, state: &mut State, solver: &mut Solver, factor: Option<f64>) {
        if let Some(factor) = factor {
            self.apply_factor(state, solver, factor);
        }
        let factor = factor.unwrap_or(1.0);
        if let Self::Turning { about, layers, rate, .. } = self {
            let rate = rate * factor;
            let dt = state.clock.dt;
            let particles = &state.particles;
            let targets = solver.targets_mut(particles);
            for (side, layer) in layers.iter().enumerate() {
                let mut angular_velocity = Vec3::zeros();
                angular_velocity[*about] = if side == 0 { -0.5 * rate } else { 0.5 * rate };
                let turn = quaternion_of_rotation_vector(&(angular_velocity * dt));
                let center = mean_of(layer, &particles.position);
                for &p in layer {
                    // The velocity with which the particle is on the circle at the end of the step. The solver adds that along the axis.
                    let arm = particles.position[p as usize] - center;
                    targets[p as usize] = ((rotate(&turn, &arm) - arm) / dt, angular_velocity);
                }
            }
        }
    }

    /// Axes of the cell that follow a strain rate and not their stress. `by_stress`: see [`Stage::by_stress`](super::Stage::by_stress).
    pub(super) fn driven(&self, by_stress: bool) -> [bool; 3] {
        match self {
            Self::CellStress { strain_rate, .. } if !by_stress => strain_rate.map(|rate| rate.is_some()),
            _ => [false; 3],
        }
    }

    /// Sets the motions that are constant without stages to `factor` times their rate.
    fn apply_factor(&self, state: &mut State, solver: &mut Solver, factor: f64) {
        match self {
            Self::None | Self::Turning { .. } | Self::CellStress { .. } => {}
            Self::Uniaxial { axis, layers, speed, .. } => {
                let targets = solver.targets_mut(&state.particles);
                for (layer, speed) in layers.iter().zip([-speed * factor, speed * factor]) {
                    for &p in layer {
                        targets[p as usize].0[*axis] = speed;
                    }
                }
            }
            Self::Platens { axis, walls, speed, .. } => {
                for (wall, speed) in walls.iter().zip([speed * factor, -speed * factor]) {
                    state.walls[*wall].velocity[*axis] = speed;
                }
            }
            Self::Flexure(flexure) => flexure.move_rollers(state, solver, factor),
            Self::CellStrain { velocity_gradient, .. } => {
                if let Some(cell) = &state.cell {
                    solver.set_velocity_gradient(cell, velocity_gradient * factor);
                }
            }
        }
    }

    /// Constant velocity gradient of the periodic cell, 1/s; `None` if a servo sets it.
    pub(super) fn cell_gradient(&self) -> Option<Mat3> {
        match self {
            Self::None => Some(Mat3::zeros()),
            Self::CellStrain { velocity_gradient, .. } => Some(*velocity_gradient),
            _ => None,
        }
    }

    /// The ends that move freely along the axis.
    pub(super) fn sliders(&self) -> Vec<Slider> {
        let Self::Turning { axis, layers, .. } = self else { return Vec::new() };
        layers.iter().map(|layer| Slider { particles: layer.clone(), axis: *axis }).collect()
    }

    /// Strain at `state`, whose positions must be those at which the next step evaluates the forces. `loaded_time`: time of a
    /// run at constant rate that has turned its ends as far, s.
    pub(super) fn strain(&self, state: &State, loaded_time: f64) -> f64 {
        match self {
            Self::None => 0.0,
            Self::Uniaxial { axis, layers, distance, length, .. } => {
                let mean = |layer: &[u32]| {
                    layer.iter().map(|&p| state.particles.position[p as usize][*axis]).sum::<f64>() / layer.len() as f64
                };
                (mean(&layers[1]) - mean(&layers[0]) - distance) / length
            }
            Self::Turning { rate, length, lever, .. } => rate * loaded_time * lever / length,
            Self::CellStrain { .. } | Self::CellStress { .. } => {
                let (i, j) = self.component(state);
                state.cell.as_ref().map_or(0.0, |cell| (cell.deformation_gradient - Mat3::identity())[(i, j)])
            }
            Self::Platens { axis, walls, length, .. } => {
                (state.walls[walls[1]].displacement[*axis] - state.walls[walls[0]].displacement[*axis]) / length
            }
            Self::Flexure(flexure) => flexure.strain(state),
        }
    }

    /// Strain of the middle half of the specimen; [`Self::strain`] for loadings without a gauge.
    pub(super) fn gauge_strain(&self, state: &State, loaded_time: f64) -> f64 {
        let gauged = match self {
            Self::Uniaxial { axis, gauge, .. } | Self::Platens { axis, gauge, .. } => gauge.strain(state, *axis),
            _ => None,
        };
        gauged.unwrap_or_else(|| self.strain(state, loaded_time))
    }

    /// Stress of the last step.
    pub(super) fn stress(&self, state: &State, solver: &Solver, report: &StepReport, volume: f64) -> Measure {
        let mut measure = Measure::default();
        if state.cell.is_some() {
            measure.tensor = report.virial / volume;
        }
        measure.stress = match self {
            Self::None => 0.0,
            Self::Uniaxial { axis, layers, area, .. } => {
                let force = |layer: &[u32]| layer.iter().map(|&p| solver.forces()[p as usize][*axis]).sum::<f64>();
                0.5 * (force(&layers[0]) - force(&layers[1])) / area
            }
            Self::Turning { about, layers, stress_of_moment, .. } => {
                let moment = |side: usize| {
                    let center = mean_of(&layers[side], &state.particles.position);
                    let layer = layers[side].iter().map(|&p| p as usize);
                    layer
                        .map(|p| {
                            let arm = state.particles.position[p] - center;
                            (arm.cross(&solver.forces()[p]) + solver.torques()[p])[*about]
                        })
                        .sum::<f64>()
                };
                0.5 * (moment(0) - moment(1)) * stress_of_moment
            }
            Self::CellStrain { .. } | Self::CellStress { .. } => measure.tensor[self.component(state)],
            Self::Platens { axis, walls, area, sign, .. } => {
                // In compression the force on the lower plate points down.
                sign * 0.5 * (state.walls[walls[0]].force[*axis] - state.walls[walls[1]].force[*axis]) / area
            }
            Self::Flexure(flexure) => flexure.stress(state, solver),
        };
        measure
    }

    /// The component that strain and stress of a periodic cell refer to: the first one of the largest magnitude in the
    /// velocity gradient, in the strain rates of axes, or in the target stress.
    pub(crate) fn component(&self, state: &State) -> (usize, usize) {
        let matrix = match self {
            Self::CellStress { strain_rate, .. } if strain_rate.iter().flatten().any(|rate| *rate != 0.0) => {
                Mat3::from_diagonal(&Vec3::from(strain_rate.map(|rate| rate.unwrap_or(0.0))))
            }
            Self::CellStress { stress, .. } => *stress,
            Self::CellStrain { velocity_gradient, .. } => *velocity_gradient,
            _ => state.cell.as_ref().map_or_else(Mat3::zeros, |cell| cell.velocity_gradient),
        };
        let mut best = (0, 0);
        for i in 0..3 {
            for j in 0..3 {
                if matrix[(i, j)].abs() > matrix[best].abs() {
                    best = (i, j);
                }
            }
        }
        best
    }

    /// Whether a servo has reached its target, and contacts carry forces unless the target is zero. `contact_force`: root mean
    /// square of the contact forces, N; `factor`: of the target, from the present stage, as `by_stress`.
    pub(super) fn reached(&self, measure: &Measure, contact_force: f64, factor: f64, by_stress: bool) -> bool {
        match self {
            Self::CellStress { stress, tolerance, reference, .. } => {
                let wanted = contact_force > 0.0 || *stress == Mat3::zeros();
                let driven = self.driven(by_stress);
                let mut error = measure.tensor - if driven.contains(&true) { *stress } else { stress * factor };
                (0..3).filter(|&axis| driven[axis]).for_each(|axis| error[(axis, axis)] = 0.0);
                wanted && error.abs().max() <= tolerance * reference
            }
            _ => contact_force > 0.0,
        }
    }

    /// Whether contact forces of this root mean square (N) between particles of this radius (m) are rounding errors of
    /// a cell without stress, so that they say nothing about equilibrium.
    pub(super) fn is_rounding(&self, contact_force: f64, radius: f64) -> bool {
        match self {
            Self::CellStress { stress, reference, .. } if *stress == Mat3::zeros() => {
                contact_force <= ROUNDING * reference * (4.0 * radius * radius)
            }
            _ => false,
        }
    }

    /// Strain divided by the angle between the ends, 1/rad, if the ends rotate.
    pub fn strain_of_angle(&self) -> Option<f64> {
        if let Self::Turning { length, lever, .. } = self { Some(lever / length) } else { None }
    }

    /// Volume that the stress refers to, m³.
    pub(crate) fn volume(&self, state: &State) -> Option<f64> {
        let of_specimen = self.dimensions().map(|(area, length)| area * length);
        of_specimen.or_else(|| state.cell.map(|cell| cell.volume()))
    }

    /// Cross-section (m²) and length (m) of the loaded specimen.
    pub fn dimensions(&self) -> Option<(f64, f64)> {
        match self {
            Self::Uniaxial { area, length, .. }
            | Self::Platens { area, length, .. }
            | Self::Turning { area, length, .. } => Some((*area, *length)),
            Self::Flexure(Flexure { area, span, .. }) => Some((*area, *span)),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use concordem_solver::state::{Particles, Sphere};

    /// A slope of 2e-3 in the middle half, none outside, and a rigid shift: the gauge strain is 2e-3. Tolerance: the
    /// rounding 2⁻⁵³·10 of coordinates near 10 m, over displacements of 2e-3 per meter, is 1e-12 relative.
    #[test]
    fn gauge_measures_the_middle_half_alone() {
        let mut state = State { particles: Particles::default(), ..State::default() };
        for k in 0..=20 {
            let position = Vec3::new(0.3, -0.1 * f64::from(k), 0.5 * f64::from(k));
            state.particles.push(Sphere { position, radius: 0.25 }, 0, 1.0, 1.0);
        }
        let gauge = Gauge::new(&state, 2, 0.0, 10.0);
        assert_eq!(gauge.particles.len(), 11);
        for x in &mut state.particles.position {
            x.z += 7e-4 + 2e-3 * (x.z - 5.0).clamp(-2.5, 2.5);
        }
        let strain = gauge.strain(&state, 2).unwrap();
        assert!((strain / 2e-3 - 1.0).abs() < 1e-12, "{strain}");
        assert_eq!(Gauge::default().strain(&state, 2), None);
    }
}
