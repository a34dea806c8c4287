//! Packings between walls: filled by force, or grown.

use super::place::{Cooking, Placed, Walled, sizes};
use super::{AssemblyError, Progress, unfit};
use crate::schema::{self, Quantity};
use concordem_contact::law::Elastic;
use concordem_contact::math::Vec3;
use concordem_packing::cooker::{Cooker, CookerStage, Target, boundary, cook};
use concordem_packing::{GrownBox, Packing, PackingError, Shape, SizeDistribution, grown_box};
use concordem_solver::state::Sphere;

/// Coordination number at which insertion ends if no end is given (Jebahi et al. 2015).
const COORDINATION: f64 = 6.2;
/// Unbalanced force at which a grown packing is at rest.
const UNBALANCED: f64 = 1e-2;
/// Largest number of steps of a grown packing.
const STEP_LIMIT: u64 = 2_000_000;

/// A vessel and its cross-sections.
type Vessel = (Shape, Option<[f64; 3]>);

/// Fills the vessel by force.
pub(super) fn cooker(
    packing: &schema::Packing,
    (shape, cross_sections): Vessel,
    progress: Progress<'_>,
) -> Result<Placed, AssemblyError> {
    let schema::Packing::Cooker {
        radius,
        radii,
        coordination,
        solid_fraction,
        overlap,
        seed,
        friction,
        packet,
        attempts,
        wall_softening,
        correction,
        ..
    } = packing
    else {
        return Err(unfit("packing.kind", "is not \"cooker\"".into()));
    };
    let sizes = sizes(radius.map(Quantity::si), radii.as_ref());
    let target = match (solid_fraction, overlap) {
        (Some(value), _) => Target::SolidFraction(value.si()),
        (None, Some(value)) => Target::Overlap(value.si()),
        (None, None) => Target::Coordination(coordination.map_or(COORDINATION, Quantity::si)),
    };
    let recipe = Cooker {
        friction: friction.si(),
        packet: packet.map(|packet| packet as usize),
        attempts: *attempts as usize,
        softening: *wall_softening as u32,
        correction: *correction,
        ..Cooker::new(shape.clone(), sizes, target, *seed)
    };
    let cooked = cook(&recipe, &mut |now| match now.stage {
        CookerStage::Filling => progress("filling", now.share),
        CookerStage::Softening => progress("softening walls", now.share),
    })
    .map_err(|error| out_of_reach(error, target))?;
    let cooking = Cooking {
        filled: cooked.filled,
        last: cooked.last,
        links_inside: cooked.links_inside,
        packets: cooked.packets,
        lost: cooked.lost,
        steps: cooked.steps,
    };
    let walled = Walled {
        boundary: boundary(&cooked.packing.spheres, &shape),
        network: cooked.network,
        interaction_ratio: cooked.interaction_ratio,
        cooked: Some(cooking),
    };
    let packing_fraction = Some(cooked.last.solid_fraction);
    let placed = Placed::without_shape(cooked.packing);
    Ok(Placed { packing_fraction, cross_sections, body: Some(shape), walled: Some(walled), ..placed })
}

/// A target out of reach, with its key.
fn out_of_reach(error: PackingError, target: Target) -> AssemblyError {
    if !matches!(error, PackingError::TargetNotReached { .. } | PackingError::Leaking { .. }) {
        return error.into();
    }
    let key = match target {
        Target::Coordination(_) => "packing.coordination",
        Target::SolidFraction(_) => "packing.solid_fraction",
        Target::Overlap(_) => "packing.overlap",
    };
    unfit(key, error.to_string())
}

/// Grows spheres in a cube.
pub(super) fn growth(
    packing: &schema::Packing,
    (shape, cross_sections): Vessel,
    progress: Progress<'_>,
) -> Result<Placed, AssemblyError> {
    let (
        schema::Packing::Growth { count, dispersion, seed, friction, wall_friction, pressure, .. },
        Shape::Box { low, high },
    ) = (packing, &shape)
    else {
        return Err(unfit("packing.shape", "must be a box with three equal edges".into()));
    };
    // Stiffness and density only set the units of force and time.
    let elastic = Elastic { young: 1e9, poisson: 0.25 };
    let half = 0.5 * dispersion.si();
    let recipe = GrownBox {
        sizes: SizeDistribution::Uniform { low: 1.0 - half, high: 1.0 + half },
        count: *count as usize,
        edge: high.x - low.x,
        seed: *seed,
        density: 2000.0,
        elastic,
        friction: friction.si(),
        wall_friction: wall_friction.si(),
        pressure: pressure.si() * elastic.young,
        unbalanced: UNBALANCED,
        step_limit: STEP_LIMIT,
    };
    let grown = grown_box(&recipe, &mut |_, fraction, _, _| progress("growth", (fraction / 0.65).min(0.99)))?;
    let particles = &grown.state.particles;
    let moved = |x: &Vec3| x + low;
    let spheres: Vec<Sphere> = (particles.position.iter().zip(&particles.radius))
        .map(|(x, &radius)| Sphere { position: moved(x), radius })
        .collect();
    let packing = Packing { spheres, cell: None };
    let packing_fraction = Some(packing.solid_volume() / shape.volume()?);
    let boundary = boundary(&packing.spheres, &shape);
    let walled = Walled { boundary, network: None, interaction_ratio: None, cooked: None };
    let placed = Placed::without_shape(packing);
    Ok(Placed { packing_fraction, cross_sections, body: Some(shape), walled: Some(walled), ..placed })
}
