//! Random packings of discs in the plane, compressed beyond touching.
//!
//! Frictionless discs jam at a solid fraction of 0.84. Specimens of plane models are denser (0.93 in Madan 2019,
//! section 4.5), so their discs overlap and bonds start at these lengths. The solid fraction fixes the area of the
//! cell. Discs start at random positions and push each other apart until they are at rest.

use std::f64::consts::PI;

use super::{Packing, PackingError, Random, compactable, positive, within};
use crate::mass_of;
use concordem_contact::law::{ContactStiffness, Frictional};
use concordem_contact::math::Vec3;
use concordem_solver::integrate::Damping;
use concordem_solver::neighbor::spatial_order;
use concordem_solver::state::contacts::ContactBlock;
use concordem_solver::state::{Cell, Constraint, Particles, Sphere, State};
use concordem_solver::{Model, PairCoefficients, Solver};

/// Normal stiffness of the contacts, N/m, and density, kg/m³. They only set the units of force and time.
const STIFFNESS: f64 = 7e10;
const DENSITY: f64 = 2000.0;
/// Unbalanced force (root mean square net force of a disc over that of a contact) at which the packing is at rest.
const UNBALANCED: f64 = 1e-3;
/// Steps between checks of the unbalanced force, and largest number of steps.
const INTERVAL: u64 = 100;
const LONGEST: u64 = 100_000;

/// A periodic packing of discs of the given `radii` (m) with the given solid fraction, in the plane z = 0. The cell is
/// `aspect` times as long along x as along y, and 1 m along z. `progress` gets the number of steps over their limit.
///
/// # Errors
/// Radii that are not positive, a solid fraction outside 0.1 to 1.1, or discs that do not come to rest.
pub fn random_discs(
    radii: &[f64],
    solid_fraction: f64,
    aspect: f64,
    random: &mut Random,
    progress: &mut dyn FnMut(f64),
) -> Result<Packing, PackingError> {
    compactable(radii.len() as f64)?;
    within("the solid fraction", solid_fraction, 0.1, 1.1)?;
    positive("the aspect of the cell", aspect)?;
    for radius in radii {
        positive("the radius", *radius)?;
    }
    let area = radii.iter().map(|r| PI * r * r).sum::<f64>() / solid_fraction;
    let (width, height) = ((area * aspect).sqrt(), (area / aspect).sqrt());
    let cell = Cell::new_box(Vec3::new(positive("the width of the cell", width)?, height, 1.0));
    let mut packing = Packing { spheres: Vec::with_capacity(radii.len()), cell: Some(cell) };
    for &radius in radii {
        let position = Vec3::new(width * random.uniform(), height * random.uniform(), 0.0);
        packing.spheres.push(Sphere { position, radius });
    }
    let order = spatial_order(&packing.positions(), Some(&cell));
    packing.spheres = order.iter().map(|&k| packing.spheres[k as usize]).collect();

    let mut particles = Particles::default();
    for (p, sphere) in packing.spheres.iter().enumerate() {
        let (mass, inertia) = mass_of(sphere.radius, DENSITY, true);
        particles.push(*sphere, 0, mass, inertia);
        particles.constraint[p] = Constraint::OUT_OF_PLANE;
    }
    // Equal masses come to rest fastest.
    let mean = particles.mass.iter().sum::<f64>() / particles.len() as f64;
    particles.mass.fill(mean);
    let law = Frictional::new(ContactStiffness::Given { normal: STIFFNESS, shear: 0.0 }, 0.0, 0.0)?;
    let mut rows = PairCoefficients::new(1);
    rows.set(0, 0, 0);
    let mut state = State {
        particles,
        cell: Some(cell),
        contacts: Some(Box::new(ContactBlock::new(vec![law]))),
        ..State::default()
    };
    state.clock.dt = 0.25 * (mean / STIFFNESS).sqrt();
    let damping = Damping::Local { translation: 0.4, rotation: 0.4 };
    let mut solver = Solver::new(Model { damping, contact_rows: rows, ..Model::default() }, &mut state)?;
    for step in 1..=LONGEST {
        let check = step % INTERVAL == 0;
        let report = solver.step_with(&mut state, check)?;
        if !check {
            continue;
        }
        progress(step as f64 / LONGEST as f64);
        let contacts: u64 = report.active.iter().sum();
        let contact = report.force_squared / contacts.max(1) as f64;
        let net = report.kick.net_force_squared / report.kick.free_particles.max(1) as f64;
        // Discs without any contact are also at rest.
        let unbalanced = if contact > 0.0 { (net / contact).sqrt() } else { 0.0 };
        if unbalanced < UNBALANCED {
            for (sphere, position) in packing.spheres.iter_mut().zip(&state.particles.position) {
                sphere.position = *position;
            }
            return Ok(packing);
        }
    }
    Err(PackingError::Restless { steps: LONGEST })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{PackingSummary, SizeDistribution};

    /// Above jamming (0.841, 4 contacts) the coordination number grows with the root of the distance:
    /// `4 + 3.6 √(φ − 0.841)` in two dimensions (O'Hern, Silbert, Liu, Nagel 2003, Phys. Rev. E 68:011306), 5.09 here.
    /// Measured: 5.07, 5.15, 5.11 with seeds 1 to 3. The bits depend only on the seed.
    #[test]
    fn discs_overlap_at_the_solid_fraction_of_the_source() {
        let sizes = SizeDistribution::Uniform { low: 0.8e-3, high: 1.2e-3 };
        let radii = sizes.radii(400, 1).unwrap();
        let make = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| random_discs(&radii, 0.932, 1.0, &mut Random::new(1), &mut |_| ()).unwrap())
        };
        let packing = make(1);
        assert_eq!(packing, make(3));
        let summary = PackingSummary::new(&packing, 1.0).unwrap();
        assert!((5.0..5.2).contains(&summary.coordination), "{}", summary.coordination);
        assert!(packing.spheres.iter().all(|s| s.position.z == 0.0));
        let cell = packing.cell.unwrap();
        let solid: f64 = radii.iter().map(|r| PI * r * r).sum();
        // Two roots and a sum: some roundings of 400 terms.
        assert!((solid / cell.volume() / 0.932 - 1.0).abs() < 1e-13);
    }

    /// Below the density of jamming discs separate. Damping stops the last ones before they do: with seeds 1 to 3 at
    /// most two pairs overlap, by at most 2e-4 of their radii.
    #[test]
    fn loose_discs_do_not_touch() {
        let radii = vec![1e-3; 100];
        let packing = random_discs(&radii, 0.6, 2.0, &mut Random::new(3), &mut |_| ()).unwrap();
        let edges = packing.cell.unwrap().matrix;
        // Two roots: some roundings.
        approx::assert_relative_eq!(edges[(0, 0)], 2.0 * edges[(1, 1)], max_relative = 1e-14);
        approx::assert_relative_eq!(edges[(0, 0)] * edges[(1, 1)], 1e-4 * PI / 0.6, max_relative = 1e-14);
        let summary = PackingSummary::new(&packing, 1.0).unwrap();
        assert!(summary.coordination < 0.05 && summary.largest_overlap < 1e-3, "{summary:?}");
    }

    #[test]
    fn invalid_parameters_are_refused() {
        let make = |radii: &[f64], fraction| random_discs(radii, fraction, 1.0, &mut Random::new(0), &mut |_| ());
        assert!(matches!(make(&[], 0.9), Err(PackingError::NotPositive { .. })));
        assert!(matches!(make(&[1.0, -1.0], 0.9), Err(PackingError::NotPositive { .. })));
        assert!(matches!(make(&[1.0], 1.5), Err(PackingError::OutOfRange { .. })));
    }
}
