//! Cylinders cut from periodic packings, or filled between walls.

use std::f64::consts::PI;

use super::error::CalibrationError;
use concordem_contact::law::CohesiveBeam;
use concordem_contact::math::Vec3;
use concordem_packing::bonding::{bond, ratio_for_coordination, ratio_inside};
use concordem_packing::cooker::{Cooker, Target, boundary, cook};
use concordem_packing::mass_of;
use concordem_packing::random_dense::{Progress, RandomDense, random_dense};
use concordem_packing::{Crop, Packing, Shape, SizeDistribution, tile_and_crop};
use concordem_solver::PairCoefficients;
use concordem_solver::neighbor::spatial_order;
use concordem_solver::state::contacts::ContactBlock;
use concordem_solver::state::{Particles, Sphere, State};

/// Size, packing, and bonds of a specimen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CylinderRecipe {
    /// Number of spheres in the periodic packing, and approximately in the cylinder.
    pub count: usize,
    /// Seed of the packing.
    pub seed: u64,
    /// Mean radius, m.
    pub mean_radius: f64,
    /// Dispersion of radii κ.
    pub dispersion: f64,
    /// Bonds per particle in the periodic packing.
    pub coordination: f64,
    /// Length of the cylinder over its diameter.
    pub slenderness: f64,
    /// Whether the cylinder is filled between walls, with whole spheres at its surface, instead of cut from a periodic packing.
    pub walled: bool,
}

impl CylinderRecipe {
    /// The specimen of Jebahi et al. 2015: mean radius 1 mm, κ = 25 %, 6.2 bonds per particle, slenderness 2.
    pub fn book(count: usize, seed: u64) -> Self {
        Self { count, seed, mean_radius: 1e-3, dispersion: 0.25, coordination: 6.2, slenderness: 2.0, walled: false }
    }
}

/// A cylinder along x, centered at the origin, and its periodic packing.
#[derive(Debug, Clone)]
pub struct CylinderSpecimen {
    /// Size, packing, and bonds.
    pub recipe: CylinderRecipe,
    /// The periodic packing, or that between walls.
    pub unit: Packing,
    /// Spheres with their centers inside the cylinder.
    pub spheres: Vec<Sphere>,
    /// Radius of the cylinder, m.
    pub radius: f64,
    /// Length of the cylinder, m.
    pub length: f64,
    /// Solid volume per volume of the periodic packing.
    pub solid_fraction: f64,
    /// Touching neighbors per sphere of the periodic packing.
    pub touching: f64,
    /// Bonds per particle of the periodic packing.
    pub coordination: f64,
    /// Interaction ratio of the bonds.
    pub interaction_ratio: f64,
}

impl CylinderSpecimen {
    /// Compacts a periodic packing and cuts the cylinder from it, or fills the cylinder between walls (without progress).
    ///
    /// # Errors
    /// The packing fails, or has too few near pairs for the target number of bonds.
    pub fn new(recipe: &CylinderRecipe, progress: &mut dyn FnMut(Progress)) -> Result<Self, CalibrationError> {
        if recipe.walled {
            return Self::between_walls(recipe);
        }
        let half = 0.5 * recipe.dispersion * recipe.mean_radius;
        let sizes = SizeDistribution::Uniform { low: recipe.mean_radius - half, high: recipe.mean_radius + half };
        let dense = RandomDense { sizes, ..RandomDense::jammed(recipe.count, recipe.mean_radius, 0.0, recipe.seed) };
        let compaction = random_dense(&dense, progress)?;
        let (unit, summary) = (compaction.packing, compaction.summary);
        let found = ratio_for_coordination(&unit.spheres, unit.cell.as_ref(), recipe.coordination)?;
        let (interaction_ratio, coordination) =
            found.ok_or(CalibrationError::Coordination { coordination: recipe.coordination })?;
        // The volume of the cylinder, π R² · 2R·slenderness, is that of the packing.
        let volume = unit.cell.map_or(0.0, |cell| cell.volume());
        let radius = concordem_contact::math::cbrt(volume / (2.0 * PI * recipe.slenderness));
        let length = 2.0 * radius * recipe.slenderness;
        let end = Vec3::new(0.5 * length, 0.0, 0.0);
        let shape = Shape::new_cylinder(-end, end, radius)?;
        let spheres = tile_and_crop(&unit, &shape, Crop::Centers, Vec3::zeros())?.spheres;
        let solid_fraction = unit.packing_fraction().unwrap_or(0.0);
        Ok(Self {
            recipe: *recipe,
            spheres,
            radius,
            length,
            solid_fraction,
            touching: summary.coordination,
            coordination,
            interaction_ratio,
            unit,
        })
    }

    /// Fills the cylinder between walls. Its volume is that of `count` spheres at the solid fraction 0.62 of such packings.
    fn between_walls(recipe: &CylinderRecipe) -> Result<Self, CalibrationError> {
        let half = 0.5 * recipe.dispersion * recipe.mean_radius;
        let (low, high) = (recipe.mean_radius - half, recipe.mean_radius + half);
        // The mean cube of uniform radii is R̄³(1 + κ²/4).
        let cube = recipe.mean_radius.powi(3) * (1.0 + 0.25 * recipe.dispersion * recipe.dispersion);
        let volume = recipe.count as f64 * 4.0 / 3.0 * PI * cube / 0.62;
        let radius = concordem_contact::math::cbrt(volume / (2.0 * PI * recipe.slenderness));
        let length = 2.0 * radius * recipe.slenderness;
        let end = Vec3::new(0.5 * length, 0.0, 0.0);
        let shape = Shape::new_cylinder(-end, end, radius)?;
        let sizes = SizeDistribution::Uniform { low, high };
        let target = Target::Coordination(recipe.coordination);
        let cooked = cook(&Cooker::new(shape.clone(), sizes, target, recipe.seed), &mut |_| {})?;
        let spheres = cooked.packing.spheres.clone();
        let found = ratio_inside(&spheres, None, &boundary(&spheres, &shape), recipe.coordination)?;
        let (interaction_ratio, coordination) =
            found.ok_or(CalibrationError::Coordination { coordination: recipe.coordination })?;
        Ok(Self {
            recipe: *recipe,
            unit: cooked.packing,
            spheres,
            radius,
            length,
            solid_fraction: cooked.last.solid_fraction,
            touching: cooked.last.coordination,
            coordination,
            interaction_ratio,
        })
    }

    /// Density of the spheres, kg/m³, for which the cylinder has the mass of a material of density `bulk` (kg/m³), \[2.26\].
    pub fn sphere_density(&self, bulk: f64) -> f64 {
        let solid: f64 = self.spheres.iter().map(|s| 4.0 / 3.0 * PI * s.radius * s.radius * s.radius).sum();
        bulk * PI * self.radius * self.radius * self.length / solid
    }

    /// State of the bonded specimen at rest; `sphere_density` in kg/m³.
    ///
    /// # Errors
    /// Invalid beam parameters.
    pub fn state(&self, beam: CohesiveBeam, sphere_density: f64) -> Result<State, CalibrationError> {
        beam.validate()?;
        let mut particles = Particles::default();
        for sphere in &self.spheres {
            let (mass, inertia) = mass_of(sphere.radius, sphere_density, false);
            particles.push(*sphere, 0, mass, inertia);
        }
        let order = spatial_order(&particles.position, None);
        let particles = particles.permuted(&order);
        let mut rows = PairCoefficients::new(1);
        rows.set(0, 0, 0);
        let mut bonds = ContactBlock::new(vec![beam]);
        bond(&mut bonds, &rows, &particles, None, self.interaction_ratio)?;
        Ok(State { particles, bonds: vec![Box::new(bonds)], ..State::default() })
    }
}
