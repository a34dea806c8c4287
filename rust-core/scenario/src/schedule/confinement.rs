//! Stress across the axis of a specimen whose sides are under pressure, and the change of its volume.

use super::Membrane;
use super::loading::Gauge;
use super::servo::gap;
use concordem_contact::math::Mat3;
use concordem_solver::state::State;

/// A wall at the side of a specimen.
#[derive(Debug, Clone, PartialEq)]
pub enum Side {
    /// A cylinder around it, of this radius (m): the wall, by index.
    Round(usize, f64),
    /// A plane that ends at two other planes, by index; in two dimensions it has unit depth.
    Flat(usize, Option<[usize; 2]>),
}

/// What presses on the sides of a specimen.
#[derive(Debug, Clone, PartialEq)]
pub enum Sides {
    /// The neighboring images of a periodic cell.
    Cell,
    /// Membranes.
    Membranes,
    /// Walls, over the height of the specimen: at the start (m), and its change per strain (m).
    Walls(Vec<Side>, [f64; 2]),
}

/// A specimen that is loaded along an axis while something presses on its sides.
#[derive(Debug, Clone, PartialEq)]
pub struct Confinement {
    /// What presses.
    pub sides: Sides,
    /// Axes across the loading, each with the gauge of the specimen's middle half along it; two, or one in the plane.
    pub lateral: Vec<(usize, Gauge)>,
}

impl Confinement {
    /// Change of the volume over the volume at the start: of a cell `det F − 1`, of a specimen `ε_a + Σ ε_l` with the strains of its middle half,
    /// of which `axial` is the one along the axis.
    pub(super) fn volumetric_strain(&self, state: &State, axial: f64) -> f64 {
        match (&self.sides, &state.cell) {
            (Sides::Cell, Some(cell)) => cell.deformation_gradient.determinant() - 1.0,
            _ => {
                self.lateral.iter().filter_map(|(axis, gauge)| gauge.strain(state, *axis)).fold(axial, |sum, e| sum + e)
            }
        }
    }

    /// Mean stress across the axis, Pa, tension positive: of a cell the mean of its lateral normal stresses, `−p` under membranes of the mean pressure
    /// `p`, and minus the mean over walls of their normal force over their present area. `tensor`: the stress of the cell, Pa; `strain`: along the
    /// axis, at the `time` (s).
    pub(super) fn lateral_stress(
        &self,
        state: &State,
        membranes: &[Membrane],
        tensor: &Mat3,
        (time, strain): (f64, f64),
    ) -> f64 {
        let mean = |values: &mut dyn Iterator<Item = f64>| {
            let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
            if count > 0.0 { sum / count } else { 0.0 }
        };
        match &self.sides {
            Sides::Cell => mean(&mut self.lateral.iter().map(|(axis, _)| tensor[(*axis, *axis)])),
            Sides::Membranes => -mean(&mut membranes.iter().map(|membrane| membrane.pressure_at(time))),
            Sides::Walls(sides, [height, per_strain]) => {
                let height = height + per_strain * strain;
                let pressure = |side: &Side| {
                    let (wall, width) = match side {
                        Side::Round(wall, radius) => (*wall, 2.0 * std::f64::consts::PI * radius),
                        Side::Flat(wall, ends) => (*wall, ends.map_or(1.0, |ends| gap(state, ends))),
                    };
                    state.walls[wall].pressing / (width * height)
                };
                -mean(&mut sides.iter().map(pressure))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use concordem_contact::math::Vec3;
    use concordem_solver::state::{Particles, Sphere};

    /// An affine deformation: the sum of the three strains, to the rounding of coordinates of some meters over their change.
    #[test]
    fn an_affine_deformation_changes_the_volume_by_its_trace() {
        let mut state = State { particles: Particles::default(), ..State::default() };
        for k in 0..175 {
            let position = [k % 5, k / 5 % 5, k / 25].map(f64::from);
            state.particles.push(Sphere { position: Vec3::from(position), radius: 0.5 }, 0, 1.0, 1.0);
        }
        let axial = Gauge::new(&state, 2, 0.0, 6.0);
        let lateral = [0, 1].map(|axis| (axis, axial.turned(&state, axis))).to_vec();
        let confinement = Confinement { sides: Sides::Membranes, lateral };
        let stretch = Vec3::new(1e-3, -2e-3, 5e-4);
        for x in &mut state.particles.position {
            *x += x.component_mul(&stretch) + Vec3::new(7.0, 8.0, 9.0);
        }
        let axial = axial.strain(&state, 2).unwrap();
        let found = confinement.volumetric_strain(&state, axial);
        assert!((axial - 5e-4).abs() < 1e-14 && (found + 5e-4).abs() < 1e-14, "{axial} {found}");
    }
}
