//! Packings between walls: filled by force, or grown.

use super::cache::{FROM_CACHE, PackingCache, Stored};
use super::placed::{Cooking, Placed, Walled};
use super::radii::sizes;
use super::{AssemblyError, Progress, unfit};
use crate::schema::{self, Quantity};
use concordem_contact::law::Elastic;
use concordem_contact::math::Vec3;
use concordem_packing::cooker::{Cooker, CookerStage, Measured, Target, boundary, cook};
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

/// A packing between walls, from the cache if it is there; besides the cache, the bytes of the mesh that is filled.
pub(super) fn cached(
    packing: &schema::Packing,
    vessel: Vessel,
    cache: Option<(&PackingCache, &[u8])>,
    progress: Progress<'_>,
) -> Result<Placed, AssemblyError> {
    let keys = format!("{packing:?}");
    let depends_on = |mesh| [keys.as_bytes(), mesh];
    if let Some((cache, mesh)) = cache
        && let Some(stored) = cache.read(&depends_on(mesh))
        && let Some(placed) = placed_from(stored, &vessel)
    {
        progress(FROM_CACHE, 1.0);
        return Ok(placed);
    }
    let placed = match packing {
        schema::Packing::Growth { .. } => growth(packing, vessel, progress),
        _ => cooker(packing, vessel, progress),
    }?;
    if let Some((cache, mesh)) = cache {
        cache.write(&depends_on(mesh), &stored_of(&placed));
    }
    Ok(placed)
}

/// What the cache stores of a packing between walls. A grown packing has the solid fraction only.
fn stored_of(placed: &Placed) -> Stored {
    let walled = placed.walled.as_ref();
    let mut numbers = vec![placed.packing_fraction.unwrap_or(f64::NAN)];
    if let Some(cooking) = walled.and_then(|walled| walled.cooked.as_ref()) {
        let Cooking { filled, last, links_inside, packets, lost, steps } = cooking;
        let ratio = walled.and_then(|walled| walled.interaction_ratio).unwrap_or(f64::NAN);
        numbers.extend([*links_inside, *packets as f64, *lost as f64, *steps as f64, ratio]);
        for measured in [filled, last] {
            let Measured { count, solid_fraction, coordination, at_boundary, overlap, largest_overlap } = measured;
            numbers.extend([*count as f64, *solid_fraction, *coordination, *at_boundary, *overlap, *largest_overlap]);
        }
    }
    let links = walled.and_then(|walled| walled.network.clone());
    Stored { packing: placed.packing.clone(), links, numbers }
}

/// The packing that [`stored_of`] stored; `None` if the numbers do not fit.
fn placed_from(stored: Stored, (shape, cross_sections): &Vessel) -> Option<Placed> {
    let Stored { packing, links, numbers } = stored;
    let (&fraction, numbers) = numbers.split_first()?;
    let measured = |from: usize| -> Option<Measured> {
        let [count, solid_fraction, coordination, at_boundary, overlap, largest_overlap]: [f64; 6] =
            numbers.get(from..from + 6)?.try_into().ok()?;
        Some(Measured { count: count as usize, solid_fraction, coordination, at_boundary, overlap, largest_overlap })
    };
    let (cooked, ratio) = match numbers {
        [] => (None, f64::NAN),
        [links_inside, packets, lost, steps, ratio, ..] => {
            let (packets, lost, steps) = (*packets as usize, *lost as usize, *steps as u64);
            let (filled, last) = (measured(5)?, measured(11)?);
            (Some(Cooking { filled, last, links_inside: *links_inside, packets, lost, steps }), *ratio)
        }
        _ => return None,
    };
    let walled = Walled {
        boundary: boundary(&packing.spheres, shape),
        network: links,
        interaction_ratio: Some(ratio).filter(|ratio| !ratio.is_nan()),
        cooked,
    };
    let placed = Placed::without_shape(packing);
    let packing_fraction = Some(fraction).filter(|fraction| !fraction.is_nan());
    let (body, cross_sections) = (Some(shape.clone()), *cross_sections);
    Some(Placed { packing_fraction, cross_sections, body, walled: Some(walled), ..placed })
}

/// Fills the vessel by force.
fn cooker(
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
fn growth(
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
