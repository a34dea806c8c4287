//! Relaxation of spheres between walls by damped dynamics.

use crate::{PackingError, Shape};
use concordem_contact::kinematics::sphere_sphere::initial_geometry;
use concordem_contact::law::{ContactStiffness, Frictional, LinearBond, Reference};
use concordem_contact::math::Vec3;
use concordem_solver::integrate::Damping;
use concordem_solver::state::contacts::{ContactBlock, ContactFlags, Pair};
use concordem_solver::state::particles::Sphere;
use concordem_solver::state::surface::{Cylinder, Facets, Plane};
use concordem_solver::state::{Particles, State, Wall, WallShape};
use concordem_solver::{Model, PairCoefficients, Solver};

/// Modulus of the spheres, Pa. Only ratios of stiffnesses matter.
const MODULUS: f64 = 30e9;
/// Density of the spheres, kg/m³. It only sets the unit of time.
const DENSITY: f64 = 1000.0;
/// Shear over normal stiffness.
const STIFFNESS_RATIO: f64 = 0.3;
/// Time step over `min r √(ρ/E)`, as in the periodic compaction.
const TIME_STEP: f64 = 0.5;
/// Local damping.
const DAMPING: f64 = 0.4;
/// Time steps between checks of equilibrium.
const INTERVAL: u64 = 20;
/// Force per sphere over `E R²` below which a packing counts as loose and nothing is left to relax, while it is filled: touching spheres
/// overlap by some 1e-4 of their radius. At Z = 6.2 they overlap by forty times that.
pub(super) const LOOSE: f64 = 1e-4;
/// The same while walls soften, so that the packing ends with the contacts that a small pressure keeps closed.
pub(super) const FREE: f64 = 1e-6;
/// Largest number of time steps between two packets. Loose packings need a hundred, those near jamming come to rest later.
pub(super) const HASTY: u64 = 2000;

/// Rigid or soft walls around spheres.
pub(super) struct Vessel {
    walls: Vec<WallShape>,
    friction: f64,
}

/// When spheres are at rest.
#[derive(Clone, Copy)]
pub(super) struct Rest {
    /// Largest unbalanced force.
    pub unbalanced: f64,
    /// Force per sphere over `E R²` below which there is nothing to relax.
    pub loose: f64,
    /// Largest number of time steps.
    pub steps: u64,
}

/// End of a relaxation.
pub(super) struct Relaxed {
    /// Unbalanced force; 0 if the spheres are loose.
    pub unbalanced: f64,
    /// Time steps done.
    pub steps: u64,
}

impl Vessel {
    pub(super) fn new(shape: &Shape, friction: f64) -> Result<Self, PackingError> {
        let walls = match shape {
            Shape::Box { low, high } => (0..3)
                .flat_map(|k| {
                    let normal = Vec3::ith(k, 1.0);
                    [Plane { point: *low, normal }, Plane { point: *high, normal: -normal }].map(WallShape::rigid)
                })
                .collect(),
            Shape::Cylinder { base, top, radius } => {
                let axis = (top - base).normalize();
                vec![
                    WallShape::rigid(Cylinder { point: *base, axis, radius: *radius, inside: true }),
                    WallShape::rigid(Plane { point: *base, normal: axis }),
                    WallShape::rigid(Plane { point: *top, normal: -axis }),
                ]
            }
            Shape::Mesh(mesh) => vec![WallShape::rigid(Facets { triangles: mesh.corners_of_triangles() })],
            Shape::Hyperboloid { .. } | Shape::Sphere { .. } => {
                let reason = "the cooker fills boxes, cylinders, and closed meshes; make a mesh of this shape";
                return Err(PackingError::BadShape { reason: reason.to_owned() });
            }
        };
        Ok(Self { walls, friction })
    }

    /// Moves spheres until the unbalanced force and the force per sphere reach `rest`, or for its number of steps. `stiffness`: that of the walls over that of the
    /// spheres; `links`: pairs joined by springs whose length at rest is the sum of their radii.
    pub(super) fn relax(
        &self,
        spheres: &mut [Sphere],
        stiffness: f64,
        links: Option<&[[u32; 2]]>,
        rest: Rest,
    ) -> Result<Relaxed, PackingError> {
        let mut state = self.state(spheres, stiffness, links)?;
        let count = spheres.len().max(1) as f64;
        let mean = spheres.iter().map(|sphere| sphere.radius).sum::<f64>() / count;
        let loose = rest.loose * MODULUS * mean * mean;
        let mut rows = PairCoefficients::new(1);
        rows.set(0, 0, 0);
        let damping = Damping::Local { translation: DAMPING, rotation: DAMPING };
        let model = Model { damping, contact_rows: rows.clone(), wall_rows: rows, ..Model::default() };
        let mut solver = Solver::new(model, &mut state)?;
        let mut now = f64::INFINITY;
        while state.clock.step < rest.steps {
            let look = (state.clock.step + 1).is_multiple_of(INTERVAL);
            let report = solver.step_with(&mut state, look)?;
            if !look {
                continue;
            }
            let contacts: u64 = report.active.iter().sum();
            now = if contacts == 0 || (report.force_squared / count).sqrt() < loose {
                0.0
            } else {
                let net = report.kick.net_force_squared / report.kick.free_particles.max(1) as f64;
                (net / (report.force_squared / contacts as f64)).sqrt()
            };
            if now <= rest.unbalanced {
                break;
            }
        }
        for (sphere, position) in spheres.iter_mut().zip(&state.particles.position) {
            sphere.position = *position;
        }
        Ok(Relaxed { unbalanced: now, steps: state.clock.step })
    }

    fn state(&self, spheres: &[Sphere], stiffness: f64, links: Option<&[[u32; 2]]>) -> Result<State, PackingError> {
        let mut particles = Particles::default();
        for sphere in spheres {
            let (mass, inertia) = crate::mass_of(sphere.radius, DENSITY, false);
            particles.push(*sphere, 0, mass, inertia);
        }
        // Two springs in series, each of stiffness 2 E r: the stiffness of the pair is E r for equal moduli, and `stiffness` times that.
        let behind = stiffness / (2.0 - stiffness) * MODULUS;
        let law = |young_b: f64, friction: f64| {
            let moduli = ContactStiffness::Moduli { young_a: MODULUS, young_b, ratio: STIFFNESS_RATIO };
            Frictional::new(moduli, friction, 0.0)
        };
        let smallest = particles.radius.iter().copied().fold(f64::INFINITY, f64::min);
        let bonds = match links {
            None => Vec::new(),
            Some(links) => vec![springs(spheres, links)?],
        };
        let wall = |(k, shape): (usize, &WallShape)| Wall::new(format!("wall {k}"), shape.clone(), 0, Vec3::zeros());
        let mut state = State {
            particles,
            bonds: bonds.into_iter().map(|block| Box::new(block) as _).collect(),
            contacts: Some(Box::new(ContactBlock::new(vec![law(MODULUS, self.friction)?]))),
            wall_contacts: Some(Box::new(ContactBlock::new(vec![law(behind, 0.0)?]))),
            walls: self.walls.iter().enumerate().map(wall).collect(),
            ..State::default()
        };
        state.clock.dt = TIME_STEP * smallest * (DENSITY / MODULUS).sqrt();
        Ok(state)
    }
}

/// Springs without shear stiffness that are unstressed where the spheres touch.
fn springs(spheres: &[Sphere], links: &[[u32; 2]]) -> Result<ContactBlock<LinearBond>, PackingError> {
    let smallest = spheres.iter().map(|sphere| sphere.radius).fold(f64::INFINITY, f64::min);
    let mut law = LinearBond::new(MODULUS * smallest, 0.0, 0.0, f64::INFINITY, f64::INFINITY)?;
    law.subtract_initial_gap = false;
    let mut block = ContactBlock::new(vec![law]);
    for &[a, b] in links {
        let (one, other) = (&spheres[a as usize], &spheres[b as usize]);
        let geometry = initial_geometry(&one.position, &other.position, &Vec3::zeros());
        let flags =
            ContactFlags { row: 0, bits: ContactFlags::BONDED | ContactFlags::ACTIVE, image: [0; 3], padding: 0 };
        let reference = Reference { length: one.radius + other.radius, area: 1.0 };
        block.push(Pair { a, b }, flags, reference, geometry);
    }
    block.sort();
    Ok(block)
}
