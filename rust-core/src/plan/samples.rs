//! Operators that are evaluated during a run.

use crate::math::{Mat3, Quat, Vec3, atan2};
use crate::operator::strain::{Dimension, affine_fit};
use crate::operator::stress::{kinetic_stress, region_stress, solid_fraction};
use crate::operator::{OperatorError, Period, Region, Truncation, couple_stress, damage, fabric};
use crate::solver::record::Forces;
use crate::state::contacts::Link;
use crate::state::{Cell, Particles, State};

/// What an operator gives: a name and a unit for a number of reals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Quantity {
    /// Name.
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Reals: 1, 3, or 9 (a tensor by rows).
    pub components: usize,
    /// Meaning.
    pub description: &'static str,
}

/// An operator that can be evaluated during a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Operator {
    /// Stress by the branch sum, and its kinetic part.
    RegionStress,
    /// Stress and couple stress about the region's centre, from contacts internal to the region.
    CoupleStress,
    /// Best affine fit of displacement and rotation since the start: gradient, strain, Cosserat strain, curvature.
    AffineStrain,
    /// Fabric tensor and coordination number.
    Fabric,
    /// Solid fraction and porosity.
    Porosity,
    /// Damage tensor of the bonds (their damage as the law has it, broken ones counted as 1).
    DamageTensor,
}

const fn tensor(name: &'static str, unit: &'static str, description: &'static str) -> Quantity {
    Quantity { name, unit, components: 9, description }
}
const fn vector(name: &'static str, unit: &'static str, description: &'static str) -> Quantity {
    Quantity { name, unit, components: 3, description }
}
const fn scalar(name: &'static str, unit: &'static str, description: &'static str) -> Quantity {
    Quantity { name, unit, components: 1, description }
}

impl Operator {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::RegionStress, Self::CoupleStress, Self::AffineStrain, Self::Fabric, Self::Porosity, Self::DamageTensor];

    /// Its name in scenarios and results.
    pub fn name(self) -> &'static str {
        match self {
            Self::RegionStress => "region-stress",
            Self::CoupleStress => "couple-stress",
            Self::AffineStrain => "affine-strain",
            Self::Fabric => "fabric",
            Self::Porosity => "porosity",
            Self::DamageTensor => "damage-tensor",
        }
    }

    /// What it gives, in the order of the values.
    pub fn quantities(self) -> &'static [Quantity] {
        const VOLUME: Quantity = scalar("volume", "m^3", "Volume of the region");
        const CONTACTS: Quantity = scalar("contacts", "1", "Contacts that counted");
        const PARTICLES: Quantity = scalar("particles", "1", "Particles that counted");
        match self {
            Self::RegionStress => {
                const {
                    &[
                        tensor("stress", "Pa", "Branch sum, rows: normal, columns: force; tension positive"),
                        tensor("kinetic_stress", "Pa", "Kinetic part, -sum m v'v'/V, not in `stress`"),
                        VOLUME,
                        CONTACTS,
                    ]
                }
            }
            Self::CoupleStress => {
                const {
                    &[
                        tensor("stress", "Pa", "Stress of contacts internal to the region"),
                        tensor("couple_stress", "N/m", "Couple stress about the region's centre"),
                        vector("rigid_force", "N/m^3", "Sum of internal forces per volume; rounding"),
                        vector("rigid_moment", "N/m^2", "Sum of internal moments per volume; rounding"),
                        VOLUME,
                        CONTACTS,
                    ]
                }
            }
            Self::AffineStrain => {
                const {
                    &[
                        tensor("gradient", "1", "Displacement gradient du_i/dx_j, positions of the start"),
                        tensor("cosserat_strain", "1", "Cosserat strain du_j/dx_i - e_ijk phi_k"),
                        tensor("curvature", "1/m", "Curvature dphi_j/dx_i"),
                        vector("rotation", "rad", "Mean rotation of particles"),
                        scalar("residual", "m", "Root mean square of displacement that is not affine"),
                        PARTICLES,
                    ]
                }
            }
            Self::Fabric => {
                const {
                    &[
                        tensor("fabric", "1", "Fabric tensor, trace 1"),
                        scalar("coordination", "1", "Mean number of contacts per particle"),
                        CONTACTS,
                        PARTICLES,
                    ]
                }
            }
            Self::Porosity => {
                const {
                    &[
                        scalar("solid_fraction", "1", "Volume of particles over volume of the region, by centres"),
                        scalar("porosity", "1", "One minus the solid fraction"),
                        VOLUME,
                    ]
                }
            }
            Self::DamageTensor => {
                const {
                    &[
                        tensor("damage", "1", "Damage tensor by least squares for even directions"),
                        scalar("mean_damage", "1", "Mean damage of the bonds"),
                        CONTACTS,
                    ]
                }
            }
        }
    }

    /// Number of reals of a row.
    pub fn width(self) -> usize {
        self.quantities().iter().map(|quantity| quantity.components).sum()
    }
}

/// Where an operator samples.
#[derive(Debug, Clone, PartialEq)]
pub enum SampledRegion {
    /// A region, which moves with a velocity (m/s).
    Moving {
        /// The region at time zero.
        region: Region,
        /// Velocity, m/s.
        velocity: Vec3,
    },
    /// The periodic cell, whatever its volume is by then.
    Cell,
}

/// An operator with its region and interval.
#[derive(Debug, Clone, PartialEq)]
pub struct OperatorSample {
    /// Name, of the group in the result.
    pub name: String,
    /// What is evaluated.
    pub operator: Operator,
    /// Where.
    pub region: SampledRegion,
    /// How contacts at the border count.
    pub truncation: Truncation,
    /// Steps between two evaluations.
    pub interval: u64,
}

/// Bonds as the damage tensor needs them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Bonds {
    /// Middle, m.
    pub middle: Vec<Vec3>,
    /// Direction.
    pub normal: Vec<Vec3>,
    /// Damage, 0 to 1.
    pub damage: Vec<f64>,
}

impl Bonds {
    /// Those of a state.
    pub fn of(state: &State) -> Self {
        let mut bonds = Self::default();
        for block in &state.bonds {
            for k in 0..block.len() {
                let view = block.view(k);
                let a = state.particles.position[view.pair.a as usize];
                bonds.middle.push(a + view.frame.normal * (0.5 * view.frame.length));
                bonds.normal.push(view.frame.normal);
                bonds.damage.push(if view.link.has(Link::BROKEN) { 1.0 } else { block.damage(k) });
            }
        }
        bonds
    }
}

/// What operators need of a moment of a run.
pub struct Sampled<'a> {
    /// Particles.
    pub particles: &'a Particles,
    /// Periodic cell.
    pub cell: Option<Cell>,
    /// Time, s.
    pub time: f64,
    /// Bonds; may be empty when no damage tensor is wanted.
    pub bonds: &'a Bonds,
    /// Forces of contacts.
    pub forces: &'a Forces,
    /// Position of every particle at the start, m.
    pub places: &'a [Vec3],
    /// Whether discs of unit depth.
    pub plane: bool,
}

impl OperatorSample {
    /// Values at a state, in the order of [`Operator::quantities`].
    ///
    /// A region in which an operator has nothing to work with gives not-a-number, not an error: a moving region may pass
    /// through empty space.
    pub fn evaluate(&self, at: &Sampled<'_>) -> Result<Vec<f64>, OperatorError> {
        match self.values(at) {
            Err(OperatorError::EmptyRegion { .. } | OperatorError::Flat { .. }) => {
                Ok(vec![f64::NAN; self.operator.width()])
            }
            other => other,
        }
    }

    fn region(&self, at: &Sampled<'_>) -> Region {
        match (&self.region, &at.cell) {
            (SampledRegion::Cell, Some(cell)) => Region::periodic_cell(&cell.matrix),
            (SampledRegion::Cell, None) => Region::All { volume: f64::NAN },
            (SampledRegion::Moving { region, velocity }, _) if *velocity == Vec3::zeros() => region.clone(),
            (SampledRegion::Moving { region, velocity }, _) => region.translated(&(velocity * at.time)),
        }
    }

    fn values(&self, at: &Sampled<'_>) -> Result<Vec<f64>, OperatorError> {
        let particles = at.particles;
        let region = &self.region(at);
        let contacts = at.forces.contacts.set(particles)?;
        let period = at.cell.map(|cell| Period::of(cell.matrix));
        let mut row = Vec::with_capacity(self.operator.width());
        let put = |row: &mut Vec<f64>, m: &Mat3| row.extend(m.transpose().iter());
        match self.operator {
            Operator::RegionStress => {
                let mean = region_stress(&contacts, region, self.truncation, period.as_ref())?;
                let motion: Vec<Vec3> = match &at.cell {
                    // In a deforming cell only what departs from its motion counts.
                    Some(cell) => particles
                        .velocity
                        .iter()
                        .zip(&particles.position)
                        .map(|(v, x)| v - cell.velocity_gradient * x)
                        .collect(),
                    None => particles.velocity.clone(),
                };
                let kinetic = match kinetic_stress(&particles.position, &particles.mass, &motion, region) {
                    Err(OperatorError::EmptyRegion { .. }) => Mat3::zeros(),
                    other => other?,
                };
                put(&mut row, &mean.stress);
                put(&mut row, &kinetic);
                row.extend([mean.volume, mean.full + mean.partial]);
            }
            Operator::CoupleStress => {
                let centre = region
                    .centre()
                    .unwrap_or_else(|| particles.position.iter().sum::<Vec3>() / particles.len().max(1) as f64);
                let conjugate = couple_stress::conjugate(&contacts, region, &centre)?;
                put(&mut row, &conjugate.stress);
                put(&mut row, &conjugate.couple_stress);
                row.extend(conjugate.rigid_force.iter().chain(conjugate.rigid_moment.iter()));
                row.extend([conjugate.volume, conjugate.contacts as f64]);
            }
            Operator::AffineStrain => {
                let displacement: Vec<Vec3> =
                    particles.position.iter().zip(at.places).map(|(now, then)| now - then).collect();
                let rotation: Vec<Vec3> = particles.orientation.iter().map(rotation_vector).collect();
                let start = at.cell.map(|cell| {
                    let edges = cell.deformation_gradient.try_inverse().unwrap_or_else(Mat3::identity) * cell.matrix;
                    Period { edges, change: cell.matrix - edges }
                });
                let dimension = if at.plane { Dimension::Two } else { Dimension::Three };
                let fit = affine_fit(at.places, &displacement, &rotation, region, start.as_ref(), dimension)?;
                put(&mut row, &fit.gradient);
                put(&mut row, &fit.cosserat_strain());
                put(&mut row, &fit.curvature);
                row.extend(fit.rotation.iter());
                row.extend([(fit.residual[0] / fit.particles as f64).sqrt(), fit.particles as f64]);
            }
            Operator::Fabric => {
                let fabric = fabric::fabric(&contacts, region, self.truncation, period.as_ref())?;
                put(&mut row, &fabric.tensor);
                row.extend([fabric.coordination, fabric.contacts, fabric.particles as f64]);
            }
            Operator::Porosity => {
                let volume = |r: &f64| crate::assembly::mass_of(*r, 1.0, at.plane).0;
                let volumes: Vec<f64> = particles.radius.iter().map(volume).collect();
                let solid = solid_fraction(&particles.position, &volumes, region)?;
                row.extend([solid, 1.0 - solid, region.volume()?]);
            }
            Operator::DamageTensor => {
                // A list of particles has no place that a bond's middle could lie in.
                if matches!(region, Region::Particles { .. }) {
                    return Err(OperatorError::NoSurface);
                }
                let (mut normal, mut damage) = (Vec::new(), Vec::new());
                for (k, middle) in at.bonds.middle.iter().enumerate() {
                    if region.contains(0, middle) {
                        normal.push(at.bonds.normal[k]);
                        damage.push(at.bonds.damage[k]);
                    }
                }
                put(&mut row, &damage::damage_tensor(&normal, &damage)?);
                row.extend([damage.iter().sum::<f64>() / damage.len() as f64, damage.len() as f64]);
            }
        }
        Ok(row)
    }
}

/// Rotation vector (rad) of a unit quaternion, the short way round.
pub fn rotation_vector(q: &Quat) -> Vec3 {
    let (im, w) = if q.w < 0.0 { (-q.imag(), -q.w) } else { (q.imag(), q.w) };
    let s = im.norm();
    // For small angles 2 atan2(s, w)/s → 2/w without loss.
    if s == 0.0 { Vec3::zeros() } else { im * (2.0 * atan2(s, w) / s) }
}
