//! Static elastic response of a cylinder in tension, bending, and torsion.

use std::f64::consts::PI;

use super::error::CalibrationError;
use super::specimen::CylinderSpecimen;
use crate::calibration::deformation::{cylinder_size, fit};
use concordem_contact::law::CohesiveBeam;
use concordem_contact::math::{Quat, Vec3, quaternion_of_rotation_vector};
use concordem_operator::interruption::look;
use concordem_solver::fracture::fragments::fragments;
use concordem_solver::fracture::virial::mean_stress;
use concordem_solver::integrate::Damping;
use concordem_solver::state::{Constraint, Sphere, State};
use concordem_solver::{Model, Solver, time_step};

/// Load on a specimen.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CylinderLoad {
    /// The ends move apart along the axis and are free across it.
    Tension,
    /// The ends rotate rigidly in opposite directions about z.
    Bending,
    /// The ends rotate rigidly in opposite directions about the axis.
    Torsion,
}

/// Elastic response to one load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CylinderResponse {
    /// Modulus from the end load, the cross-section of the cut cylinder, and the deformation of the middle half, Pa:
    /// Young's modulus in tension and bending, shear modulus in torsion.
    pub modulus: f64,
    /// Poisson's ratio from the lateral strain of the middle half, in tension.
    pub poisson: f64,
    /// Modulus in tension from the bounding cross-section and the distance of the ends, \[2.22\], Pa.
    pub bounding_modulus: f64,
    /// Poisson's ratio from the relative changes of the bounding radius and the length, \[2.23\].
    pub bounding_poisson: f64,
    /// Shares of the stored energy: normal, shear, bending, twist.
    pub shares: [f64; 4],
    /// Mean stresses of the particles in the middle half.
    pub pressures: ParticlePressures,
    /// Relative difference of the loads on both ends (in bending and torsion it includes shear forces in a nonuniform
    /// specimen).
    pub imbalance: f64,
    /// Number of steps to equilibrium.
    pub steps: u64,
}

/// Scatter of the mean stresses \[4.23\] that decide on the failure of particles, relative to the stress that the load
/// causes in a homogeneous bar: axial in tension and bending, shear in torsion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParticlePressures {
    /// Mean and standard deviation, over the stress at the particle, of particles deeper than two largest radii
    /// (in bending and torsion: where that stress is more than half of the stress at the surface).
    pub bulk: [f64; 2],
    /// The same within one largest radius of the surface.
    pub skin: [f64; 2],
    /// Largest value of all particles over the stress at the surface. The failure threshold divided by this value
    /// gives the stress at the first failure.
    pub largest: f64,
    /// Sum over all particles, weighted by the volumes of their spheres, divided by the stress at the
    /// surface and the volume of the middle half. In equilibrium it is 1/3 in tension, and 0 in bending and torsion.
    pub sum: f64,
}

impl ParticlePressures {
    /// `resisting`: end load of the specimen, N or N·m.
    fn of(state: &State, start: &[Vec3], sample: &CylinderSpecimen, load: CylinderLoad, resisting: f64) -> Self {
        let thickness = largest_radius(sample);
        let (r, l) = (sample.radius, sample.length);
        let (stress, share): (f64, fn(&Vec3, f64) -> f64) = match load {
            CylinderLoad::Tension => (resisting / (PI * r * r), |_, _| 1.0),
            CylinderLoad::Torsion => (resisting / (0.5 * PI * r.powi(3)), |x, r| x.y.hypot(x.z) / r),
            CylinderLoad::Bending => (resisting / (0.25 * PI * r.powi(3)), |x, r| -x.y / r),
        };
        let pressures = mean_stress(state, false).unwrap_or_default();
        let (mut bulk, mut skin) = (Vec::new(), Vec::new());
        let (mut largest, mut sum) = (f64::NEG_INFINITY, 0.0);
        for ((x, pressure), radius) in start.iter().zip(&pressures).zip(&state.particles.radius) {
            if x.x.abs() >= 0.25 * l {
                continue;
            }
            let pressure = pressure / stress;
            largest = largest.max(pressure);
            sum += pressure * 4.0 / 3.0 * PI * radius.powi(3);
            let depth = r - x.y.hypot(x.z);
            let share = share(x, r);
            if share.abs() <= 0.5 {
                continue;
            }
            if depth > 2.0 * thickness {
                bulk.push(pressure / share);
            } else if depth < thickness {
                skin.push(pressure / share);
            }
        }
        let scatter = |values: &[f64]| {
            let count = values.len() as f64;
            let mean = values.iter().sum::<f64>() / count;
            [mean, (values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt()]
        };
        Self { bulk: scatter(&bulk), skin: scatter(&skin), largest, sum: sum / (PI * r * r * 0.5 * l) }
    }
}

/// Strain (in bending and torsion: at the surface) at which elastic constants are measured. Small against 1, large
/// against rounding.
const STRAIN: f64 = 1e-5;
/// Relative change of the load in [`INTERVAL`] steps at equilibrium.
const SETTLED: f64 = 1e-5;
/// Steps between checks of the load.
const INTERVAL: u64 = 100;
/// Largest number of steps.
pub(super) const STEP_LIMIT: u64 = 100_000;

/// Static elastic response of a specimen; bonds do not break.
///
/// # Errors
/// Invalid beam parameters; no equilibrium; too few spheres to measure the deformation.
pub fn elastic(
    specimen: &CylinderSpecimen,
    beam: &CohesiveBeam,
    load: CylinderLoad,
) -> Result<CylinderResponse, CalibrationError> {
    let beam = CohesiveBeam { strength: f64::INFINITY, ..*beam };
    let mut state = specimen.state(beam, 3000.0)?;
    state.clock.dt = 0.8 * time_step::bounds(&state).spectral;
    let damping = Damping::Local { translation: 0.4, rotation: 0.4 };
    let mut solver = Solver::new(Model { damping, ..Model::default() }, &mut state)?;
    // The unloaded state of all bonds.
    solver.step(&mut state)?;

    let start = state.particles.position.clone();
    let regions = Regions::of(&state, specimen);
    deform(&mut state, &start, load, specimen.radius);
    // The end particles stay at their positions after this deformation.
    let constraint = if load == CylinderLoad::Tension { Constraint::translation_along(0) } else { Constraint::ALL };
    for &p in regions.ends.iter().flatten() {
        state.particles.constraint[p] = constraint;
    }
    let loads = equilibrium(&mut state, &mut solver, &regions, &start, load)?;
    // Only a recorded step computes the energies; it moves the particles by a negligible amount.
    solver.step_with(&mut state, true)?;
    response(specimen, &state, &regions, &start, load, loads)
}

/// Particles of the largest fragment by their positions before loading.
struct Regions {
    /// Lower and upper end.
    ends: [Vec<usize>; 2],
    /// Within one largest radius of the surface.
    surface: Vec<usize>,
    /// The middle half.
    middle: Vec<usize>,
}

impl Regions {
    fn of(state: &State, specimen: &CylinderSpecimen) -> Self {
        let start = &state.particles.position;
        let (r, l, largest_radius) = (specimen.radius, specimen.length, largest_radius(specimen));
        let pieces = fragments(state);
        let largest = most_frequent(&pieces);
        let of = |inside: &dyn Fn(&Vec3) -> bool| -> Vec<usize> {
            (0..start.len()).filter(|&p| pieces[p] == largest && inside(&start[p])).collect()
        };
        Self {
            ends: [-1.0, 1.0].map(|side| of(&|x| side * x.x > 0.5 * l - 2.0 * largest_radius)),
            surface: of(&|x| x.y.hypot(x.z) > r - largest_radius),
            middle: of(&|x| x.x.abs() < 0.25 * l),
        }
    }
}

fn largest_radius(specimen: &CylinderSpecimen) -> f64 {
    specimen.recipe.mean_radius * (1.0 + 0.5 * specimen.recipe.dispersion)
}

/// Displaces and rotates all particles by a uniform strain, twist, or curvature of [`STRAIN`], close to the solution.
fn deform(state: &mut State, start: &[Vec3], load: CylinderLoad, radius: f64) {
    for (p, x) in start.iter().enumerate() {
        let (displacement, rotation) = match load {
            CylinderLoad::Tension => (Vec3::new(x.x, -0.2 * x.y, -0.2 * x.z) * STRAIN, Vec3::zeros()),
            CylinderLoad::Torsion => {
                let rate = STRAIN / radius;
                (Vec3::new(0.0, -x.x * x.z, x.x * x.y) * rate, Vec3::new(rate * x.x, 0.0, 0.0))
            }
            CylinderLoad::Bending => {
                let curvature = STRAIN / radius;
                (Vec3::new(-x.x * x.y, 0.5 * x.x * x.x, 0.0) * curvature, Vec3::new(0.0, 0.0, curvature * x.x))
            }
        };
        state.particles.position[p] += displacement;
        state.particles.orientation[p] = quaternion_of_rotation_vector(&rotation);
        state.particles.rotation_increment[p] = Quat::identity();
    }
}

/// Relaxes the specimen; returns the reactions at both ends, N or N·m.
fn equilibrium(
    state: &mut State,
    solver: &mut Solver,
    regions: &Regions,
    start: &[Vec3],
    load: CylinderLoad,
) -> Result<[f64; 2], CalibrationError> {
    let centers =
        regions.ends.each_ref().map(|end| end.iter().map(|&p| start[p]).sum::<Vec3>() / end.len().max(1) as f64);
    let mut last = [0.0; 2];
    loop {
        look();
        for _ in 0..INTERVAL {
            solver.step_with(state, false)?;
        }
        let values = end_loads(state, solver, regions, centers, load);
        let mean = 0.5 * (values[0] + values[1]);
        // The end moments of a nonuniform specimen differ, because it also carries a small shear force.
        let change = (values[0] - last[0]).abs().max((values[1] - last[1]).abs()) / mean.abs();
        if change < SETTLED {
            return Ok(values);
        }
        if state.clock.step > STEP_LIMIT {
            return Err(CalibrationError::NotSettled { steps: state.clock.step, change });
        }
        last = values;
    }
}

fn end_loads(state: &State, solver: &Solver, regions: &Regions, centers: [Vec3; 2], load: CylinderLoad) -> [f64; 2] {
    [0, 1].map(|side: usize| {
        let sum: f64 = regions.ends[side]
            .iter()
            .map(|&p| {
                let f = solver.forces()[p];
                let moment = (state.particles.position[p] - centers[side]).cross(&f) + solver.torques()[p];
                match load {
                    CylinderLoad::Tension => f.x,
                    CylinderLoad::Torsion => moment.x,
                    CylinderLoad::Bending => moment.z,
                }
            })
            .sum();
        if side == 0 { sum } else { -sum }
    })
}

/// Moduli and scatter of the loaded specimen.
fn response(
    specimen: &CylinderSpecimen,
    state: &State,
    regions: &Regions,
    start: &[Vec3],
    load: CylinderLoad,
    loads: [f64; 2],
) -> Result<CylinderResponse, CalibrationError> {
    let too_small = || CalibrationError::TooSmall { count: start.len() };
    let r = specimen.radius;
    let mean = 0.5 * (loads[0] + loads[1]);
    let pressures = ParticlePressures::of(state, start, specimen, load, mean);
    let places: Vec<Vec3> = regions.middle.iter().map(|&p| start[p]).collect();
    let moved: Vec<Vec3> = regions.middle.iter().map(|&p| state.particles.position[p] - start[p]).collect();
    let found = fit(&places, &moved, 0).ok_or_else(too_small)?;
    let modulus = match load {
        CylinderLoad::Tension => mean / (PI * r * r * found.axial),
        CylinderLoad::Torsion => mean / (0.5 * PI * r.powi(4) * found.twist),
        CylinderLoad::Bending => mean / (0.25 * PI * r.powi(4) * found.curvature[1]),
    };
    let spheres = |positions: &[Vec3]| -> Vec<Sphere> {
        positions.iter().zip(&state.particles.radius).map(|(x, r)| Sphere { position: *x, radius: *r }).collect()
    };
    let sets = [&regions.ends[0][..], &regions.ends[1][..], &regions.surface[..]];
    let before = cylinder_size(&spheres(start), 0, sets, false).ok_or_else(too_small)?;
    let after = cylinder_size(&spheres(&state.particles.position), 0, sets, false).ok_or_else(too_small)?;
    let stretch = (after.length - before.length) / before.length;
    let shrink = (after.radius - before.radius) / before.radius;
    let stored = state.ledger.stored;
    let total: f64 = stored.iter().sum();
    let only_tension = |value: f64| if load == CylinderLoad::Tension { value } else { f64::NAN };
    Ok(CylinderResponse {
        modulus,
        poisson: only_tension(-found.lateral / found.axial),
        bounding_modulus: only_tension(mean / (PI * before.radius * before.radius) / stretch),
        bounding_poisson: only_tension(-shrink / stretch),
        shares: stored.map(|energy| energy / total),
        pressures,
        imbalance: ((loads[0] - loads[1]) / mean).abs(),
        steps: state.clock.step,
    })
}

/// The most frequent number; 0 if there are none.
pub(super) fn most_frequent(names: &[u32]) -> u32 {
    let mut sorted = names.to_vec();
    sorted.sort_unstable();
    sorted.chunk_by(|a, b| a == b).max_by_key(|chunk| chunk.len()).map_or(0, |chunk| chunk[0])
}
