//! Packings of deformable discs and spheres, and their elastic constants: shared by tests and by the study
//! `examples/deformable_study.rs`.

use std::f64::consts::{PI, TAU};

use concordem::kinematics::deformable::{Condition, Deformable, Update};
use concordem::law::{Elastic, LinearBond};
use concordem::math::{Mat3, Vec3};
use concordem::packing::bonding::{self, bond};
use concordem::packing::mass_of;
use concordem::packing::{Packing, Random, random_discs};
use concordem::solver::integrate::Damping;
use concordem::solver::{Model, Solver, time_step};
use concordem::state::contacts::{ContactBlock, ContactFlags};
use concordem::state::{Constraint, Particles, State};

use crate::one_material;

/// Normal stiffness of contacts of discs in the source, N/m.
pub const NORMAL: f64 = 7e10;
/// Density of the particles, kg/m³.
pub const DENSITY: f64 = 2000.0;

/// Particles of modulus `young` (Pa) and Poisson's ratio `poisson`, with lagging strains.
pub fn elastic(young: f64, poisson: f64, condition: Condition) -> Deformable {
    Deformable { elasticity: vec![Elastic { young, poisson }], condition, update: Update::Lagged, dashpots: false }
}

/// Particles of a packing, discs if `planar`, at rest.
pub fn bodies(packing: &Packing, planar: bool) -> Particles {
    let mut particles = Particles::default();
    for (p, sphere) in packing.spheres.iter().enumerate() {
        let (mass, inertia) = mass_of(sphere.radius, DENSITY, planar);
        particles.push(*sphere, 0, mass, inertia);
        if planar {
            particles.constraint[p] = Constraint::OUT_OF_PLANE;
        }
    }
    particles
}

/// A periodic packing of overlapping discs in a cell that is `aspect` times as long along x as along y: discs of log-normal
/// radii about `median` between `low` and `high` (m) are placed at random in a cell of area `Σ πR²/fraction` and relax
/// without friction until their net forces are 1e-3 of the contact forces.
pub fn disc_packing(count: usize, radii: [f64; 3], spread: f64, fraction: f64, aspect: f64, seed: u64) -> Packing {
    let [low, median, high] = radii;
    let mut random = Random::new(seed);
    let mut sizes = Vec::with_capacity(count);
    while sizes.len() < count {
        // Box and Muller (1958).
        let (u, v) = (1.0 - random.uniform(), random.uniform());
        let normal = (-2.0 * u.ln()).sqrt() * (TAU * v).cos();
        let radius = median * (spread * normal).exp();
        if (low..=high).contains(&radius) {
            sizes.push(radius);
        }
    }
    random_discs(&sizes, fraction, aspect, &mut random, &mut |_| ()).expect("discs that rest")
}

fn unbalanced(report: &concordem::solver::StepReport) -> f64 {
    let contacts: u64 = report.active.iter().sum();
    let contact = report.force_squared / contacts.max(1) as f64;
    let net = report.kick.net_force_squared / report.kick.free_particles.max(1) as f64;
    if contact > 0.0 { (net / contact).sqrt() } else { 0.0 }
}

/// The interaction ratio at which a packing has `target` bonds per particle.
pub fn ratio_for_coordination(packing: &Packing, target: f64) -> f64 {
    let found =
        bonding::ratio_for_coordination(&packing.spheres, packing.cell.as_ref(), target).expect("a sound packing");
    found.expect("a packing with as many near pairs").0
}

/// A bonded periodic packing.
pub struct Sample {
    /// The packing.
    pub packing: Packing,
    /// Whether the particles are discs.
    pub planar: bool,
    /// Interaction ratio.
    pub ratio: f64,
    /// Normal stiffness, N/m.
    pub normal: f64,
}

/// Elastic constants of an isotropic body from compressions along the axes: from the means of `C11` and `C12` over the axes.
/// In two dimensions they are those of the plane: `ν = C12/C11`, `E = C11(1−ν²)`, `K = (C11+C12)/2`.
#[derive(Debug, Clone, Copy)]
pub struct Constants {
    /// `C11`, Pa.
    pub c11: f64,
    /// `C12`, Pa.
    pub c12: f64,
    /// Shear modulus from a simple shear, `C44`, Pa; does not assume isotropy.
    pub c44: f64,
    /// Young's modulus, Pa.
    pub young: f64,
    /// Poisson's ratio.
    pub poisson: f64,
}

impl Sample {
    /// The bonded, unloaded state at rest; `shear_ratio`: tangential over normal stiffness.
    pub fn state(&self, shear_ratio: f64) -> State {
        let law = LinearBond::new(self.normal, shear_ratio * self.normal, 0.0, f64::INFINITY, f64::INFINITY)
            .expect("valid stiffness");
        let particles = bodies(&self.packing, self.planar);
        let mut bonds = ContactBlock::new(vec![law]);
        bond(&mut bonds, &one_material(), &particles, self.packing.cell.as_ref(), self.ratio).expect("sound");
        State { particles, cell: self.packing.cell, bonds: vec![Box::new(bonds)], ..State::default() }
    }

    /// `A = N_c R² k_n/V` of the Voigt moduli in the plane (Madan 2019, (4.15)–(4.18), (4.32)), Pa, and bonds per disc.
    pub fn voigt_modulus(&self) -> (f64, f64) {
        let state = self.state(0.0);
        let count = state.particles.len() as f64;
        let square = state.particles.radius.iter().map(|r| r * r).sum::<f64>() / count;
        let volume = self.packing.cell.map_or(1.0, |cell| cell.volume());
        (state.bond_count() as f64 * square * self.normal / volume, 2.0 * state.bond_count() as f64 / count)
    }

    /// Stress per strain under the symmetric strain of `direction` times 1e-6, at rest.
    pub fn stress(&self, shear_ratio: f64, deformable: Option<&Deformable>, direction: &Mat3) -> Mat3 {
        const STRAIN: f64 = 1e-6;
        const LOADING: u32 = 50;
        let mut state = self.state(shear_ratio);
        let bounds = time_step::bounds_with(&state, deformable).0;
        state.clock.dt = 0.6 * bounds.spectral.max(bounds.per_particle);
        let damping = Damping::Local { translation: 0.3, rotation: 0.3 };
        let model = Model { damping, deformable: deformable.cloned(), ..Model::default() };
        let mut solver = Solver::new(model, &mut state).expect("a sound state");
        let cell = state.cell.expect("periodic");
        solver.set_velocity_gradient(&cell, direction * (STRAIN / (f64::from(LOADING) * state.clock.dt)));
        for _ in 0..LOADING {
            solver.step_with(&mut state, false).expect("stable");
        }
        solver.set_velocity_gradient(&state.cell.expect("periodic"), Mat3::zeros());
        for step in 0..60_000 {
            let look = step % 50 == 49;
            let report = solver.step_with(&mut state, look).expect("stable");
            // In a lattice forces balance from the start, but strains converge by a factor ρ per step.
            if look && step > 500 && unbalanced(&report) < 1e-5 {
                break;
            }
        }
        let report = solver.step(&mut state).expect("stable");
        report.virial / (state.cell.map_or(1.0, |cell| cell.volume()) * STRAIN)
    }

    /// Elastic constants.
    pub fn constants(&self, shear_ratio: f64, deformable: Option<&Deformable>) -> Constants {
        let axes = if self.planar { 2 } else { 3 };
        let (mut c11, mut c12) = (0.0, 0.0);
        for axis in 0..axes {
            let mut direction = Mat3::zeros();
            direction[(axis, axis)] = 1.0;
            let stress = self.stress(shear_ratio, deformable, &direction);
            for other in 0..axes {
                let value = stress[(other, other)] / axes as f64;
                if other == axis {
                    c11 += value;
                } else {
                    c12 += value / (axes as f64 - 1.0);
                }
            }
        }
        let mut shear = Mat3::zeros();
        (shear[(0, 1)], shear[(1, 0)]) = (0.5, 0.5);
        let stress = self.stress(shear_ratio, deformable, &shear);
        let c44 = 0.5 * (stress[(0, 1)] + stress[(1, 0)]);
        let (young, poisson) = if self.planar {
            let poisson = c12 / c11;
            (c11 * (1.0 - poisson * poisson), poisson)
        } else {
            let poisson = c12 / (c11 + c12);
            (c11 * (1.0 + poisson) * (1.0 - 2.0 * poisson) / (1.0 - poisson), poisson)
        };
        Constants { c11, c12, c44, young, poisson }
    }
}

/// Mean field in the plane for `Z` contacts per disc, `(E/A, ν)`: Voigt moduli (Madan 2019, (4.15)–(4.18)), reduced by the
/// strain of a disc under the mean stress according to (2.44)–(2.53); `softness` is `k_n/E_p`. Derived for this project.
pub fn mean_field(coordination: f64, shear_ratio: f64, softness: f64, poisson: f64) -> (f64, f64) {
    let isotropic = coordination * softness * (1.0 + poisson) * (1.0 - 2.0 * poisson) / PI;
    let deviatoric = coordination * softness * (1.0 + poisson) / TAU;
    let bulk = 1.0 / (1.0 + isotropic);
    let shear = 0.5 * (1.0 + shear_ratio) / (1.0 + deviatoric);
    (4.0 * bulk * shear / (bulk + shear), (bulk - shear) / (bulk + shear))
}

/// The same for spheres of radius `R` in a packing of solid fraction `φ`: `(E/(k_n/R), ν)`; `softness` is `k_n/(R E_p)`.
pub fn mean_field_solid(coordination: f64, fraction: f64, shear_ratio: f64, softness: f64, poisson: f64) -> (f64, f64) {
    let isotropic = coordination * softness * (1.0 - 2.0 * poisson) / TAU;
    let deviatoric = coordination * softness * (1.0 + poisson) / (5.0 * PI);
    let bulk = fraction * coordination / (6.0 * PI * (1.0 + isotropic));
    let shear = fraction * coordination * (2.0 + 3.0 * shear_ratio) / (20.0 * PI * (1.0 + deviatoric));
    (9.0 * bulk * shear / (3.0 * bulk + shear), (3.0 * bulk - 2.0 * shear) / (2.0 * (3.0 * bulk + shear)))
}

/// Growth of random velocities in `steps` undamped steps of a twentieth of the rigid time step bound; infinite beyond a
/// factor of 1e6. The step is that small because lagged strains lower the bound by a factor of `√(1−ρ)` at worst.
pub fn growth(sample: &Sample, deformable: &Deformable, steps: usize) -> f64 {
    let mut state = sample.state(0.0);
    state.clock.dt = 0.05 * time_step::bounds(&state).spectral;
    for p in 0..state.particles.len() {
        let mut v = crate::noise_vector(p, 1) * 1e-6;
        if sample.planar {
            v.z = 0.0;
        }
        state.particles.velocity[p] = v;
    }
    let size = |s: &State| s.particles.velocity.iter().map(Vec3::norm_squared).sum::<f64>().sqrt();
    let start = size(&state);
    let model = Model { deformable: Some(deformable.clone()), ..Model::default() };
    let mut solver = Solver::new(model, &mut state).expect("a sound state");
    for step in 0..steps {
        if solver.step_with(&mut state, false).is_err() || (step % 20 == 0 && size(&state) > 1e6 * start) {
            return f64::INFINITY;
        }
    }
    size(&state) / start
}

/// Speed of a pulse along x through a bar: the packing with free ends (and free sides for displacements along x; for
/// displacements along y the sides stay periodic). The displacement `½A(1 + cos(2πx/L))`, `0 ≤ x ≤ L/2`, is prescribed over
/// 200 steps, and then the particles are released (Madan 2019, (5.5), with a parenthesis corrected). The speed is the
/// distance over the time between the peaks of the mean displacement of two strips, mean of five pairs.
pub fn wave_speed(
    sample: &Sample,
    shear_ratio: f64,
    deformable: Option<&Deformable>,
    transverse: bool,
    wave_length: f64,
) -> f64 {
    const GROWING: usize = 200;
    let mut state = sample.state(shear_ratio);
    let cell = state.cell.expect("periodic");
    let (length, height) = (cell.matrix[(0, 0)], cell.matrix[(1, 1)]);
    // Wrap particles into the cell first, because bonds may also refer to images of particles outside it.
    for p in 0..state.particles.len() {
        let x = &mut state.particles.position[p];
        x.x -= (x.x / length).floor() * length;
        x.y -= (x.y / height).floor() * height;
    }
    let law = LinearBond::new(sample.normal, shear_ratio * sample.normal, 0.0, f64::INFINITY, f64::INFINITY)
        .expect("valid stiffness");
    let mut bonds = ContactBlock::new(vec![law]);
    bond(&mut bonds, &one_material(), &state.particles, Some(&cell), sample.ratio).expect("sound");
    bonds.retain(|link: &ContactFlags| link.image[0] == 0 && (transverse || link.image[1] == 0));
    state.bonds = vec![Box::new(bonds)];
    if !transverse {
        state.cell = None;
    }
    let bounds = time_step::bounds_with(&state, deformable).0;
    state.clock.dt = 0.3 * bounds.spectral.max(bounds.per_particle);
    let dt = state.clock.dt;
    let along = usize::from(transverse);
    let start: Vec<Vec3> = state.particles.position.clone();
    let constraints = state.particles.constraint.clone();
    let amplitude = 1e-6 * wave_length;
    for (p, place) in start.iter().enumerate() {
        state.particles.constraint[p] = Constraint::ALL;
        if place.x < 0.5 * wave_length {
            let displacement = 0.5 * amplitude * (1.0 + (TAU * place.x / wave_length).cos());
            state.particles.velocity[p][along] = displacement / (GROWING as f64 * dt);
        }
    }
    let model = Model { deformable: deformable.cloned(), ..Model::default() };
    let mut solver = Solver::new(model, &mut state).expect("a sound state");
    for _ in 0..GROWING {
        solver.step_with(&mut state, false).expect("stable");
    }
    state.particles.velocity.fill(Vec3::zeros());
    state.particles.constraint = constraints;
    // Ten strips of a twentieth of the wave length, five pairs.
    let width = 0.05 * wave_length;
    let near: Vec<f64> = (0..5).map(|k| 0.55 * wave_length + width * f64::from(k)).collect();
    let far: Vec<f64> = near.iter().map(|x| x + 0.4 * wave_length).collect();
    let strips: Vec<Vec<usize>> = near
        .iter()
        .chain(&far)
        .map(|x| (0..start.len()).filter(|&p| (start[p].x - x).abs() < width).collect())
        .collect();
    let mut traces: Vec<Vec<f64>> = vec![Vec::new(); strips.len()];
    // As long as the slowest pulse of interest needs, but before reflections from the end arrive.
    let slowest = 0.45 * (sample.voigt_modulus().0 / DENSITY).sqrt();
    let steps = (0.9 * length / slowest / dt) as usize;
    for _ in 0..steps {
        solver.step_with(&mut state, false).expect("stable");
        for (strip, trace) in strips.iter().zip(&mut traces) {
            let mean = strip.iter().map(|&p| state.particles.position[p][along] - start[p][along]).sum::<f64>();
            trace.push(mean / strip.len() as f64);
        }
    }
    let peak = |trace: &[f64]| {
        // The first peak above the threshold: later peaks are reflections.
        let threshold = 0.1 * amplitude;
        let at = (1..trace.len() - 1)
            .find(|&k| {
                trace[k] > threshold && trace[k] >= trace[k - 1] && trace[k] > trace[k + 1] && {
                    let ahead = &trace[k..trace.len().min(k + 200)];
                    ahead.iter().all(|later| *later <= trace[k])
                }
            })
            .unwrap_or(0);
        if at == 0 {
            return f64::NAN;
        }
        let (slope, curve) = (0.5 * (trace[at + 1] - trace[at - 1]), trace[at + 1] - 2.0 * trace[at] + trace[at - 1]);
        (at as f64 - slope / curve) * dt
    };
    let pairs = (0..5).map(|k| (far[k] - near[k]) / (peak(&traces[k + 5]) - peak(&traces[k])));
    pairs.sum::<f64>() / 5.0
}
