//! Heat conduction: the network of the assembled particles, initial temperatures, sources, and the surface.

use super::bodies::members;
use super::motions::history;
use super::{AssemblyError, unfit};
use crate::checks::length;
use crate::schedule::{HeatHistories, History};
use crate::schema::quantity::vector;
use crate::schema::{Heat, HeatBoundary, HeatNetwork, HeatPairs, HeatScheme, HeatSource, Quantity, Scenario, Shape};
use concordem_contact::math::Vec3;
use concordem_operator::HalfSpace;
use concordem_solver::heat::implicit::to_steady_state;
use concordem_solver::heat::network::{self, Exposure, NearPair, Network, Plane};
use concordem_solver::heat::pass::HeatPass;
use concordem_solver::heat::{
    ContactConduction, Curves, Exchange, HeatModel, Held, MaterialCurves, Source, Spread, Supply, SurfaceExchange,
    ThermalMaterial, WallExchange, capacities, expansion,
};
use concordem_solver::state::{Particles, State};
use concordem_solver::{Model, Solver};

/// Sides of the prism around a cylinder. Its cross-section is 0.3 % larger than the circle.
const SIDES: u32 = 32;

/// Smallest distance of a center from the surface, in radii. The packing may put centers on the surface, where the
/// conductance to a prescribed temperature would be infinite.
const NEAREST: f64 = 0.1;

/// Radii of a spot around the particles within which its center must lie.
const REACH: f64 = 3.0;

/// Adds heat conduction to state and model, and returns the histories that drive it.
///
/// # Errors
/// The network cannot be made; a face without particles; a spot outside the body.
pub(super) fn build(
    scenario: &Scenario,
    state: &mut State,
    whole: &mut Model,
) -> Result<Option<HeatHistories>, AssemblyError> {
    let Some(heat) = &scenario.heat else { return Ok(None) };
    let materials: Vec<ThermalMaterial> = scenario.materials.iter().map(ThermalMaterial::of).collect();
    let mut network = network_of(scenario, heat, state)?;
    for exposure in &mut network.exposures {
        let radius = state.particles.radius[exposure.particle as usize];
        exposure.distance = exposure.distance.max(NEAREST * radius);
    }
    let bulk: Vec<Option<f64>> =
        scenario.materials.iter().map(|m| m.thermal.as_ref()?.bulk_density.map(Quantity::si)).collect();
    let capacity = capacities(&network, &state.particles, &materials, &bulk);
    if let Some(p) = capacity.iter().position(|capacity| !(capacity.is_finite() && *capacity > 0.0)) {
        let id = state.particles.id[p];
        let message = format!("the particle with id {id} has no volume in the power diagram; use \"disordered\"");
        return Err(unfit("heat.model", message));
    }
    let mut histories = HeatHistories { time_factor: heat.time_factor.si(), ..HeatHistories::default() };
    let supply = supply(scenario, heat, state, &network, &mut histories)?;
    let temperature = heat.temperature.si();
    let curves = Curves {
        materials: scenario.materials.iter().map(MaterialCurves::of).collect(),
        of: state.particles.material.clone(),
    };
    let model = HeatModel {
        materials,
        curves,
        network,
        capacity,
        supply,
        reference_temperature: heat.reference_temperature.map_or(temperature, Quantity::si),
        time_factor: heat.time_factor.si(),
        implicit: heat.scheme == HeatScheme::Implicit,
        mechanics: heat.motion,
        dissipation: heat.dissipation,
        crack_resistance: heat.crack_resistance.map_or(f64::INFINITY, Quantity::si),
        contact: heat.contact.as_ref().map(|contact| {
            ContactConduction::of(contact, scenario.dimension == 2, !scenario.integration.allow_unstable)
        }),
    };
    let mut temperatures = vec![temperature; state.particles.len()];
    for initial in &heat.initials {
        for p in members(scenario, &state.particles, &initial.set) {
            temperatures[p] = initial.temperature.si();
        }
    }
    let mut started = model.start(temperatures);
    if heat.steady {
        // A solver finds the particles that touch walls and each other.
        let mut probe = state.clone();
        if !model.supply.walls.is_empty() || model.contact.is_some() {
            Solver::new(whole.clone(), &mut probe).map_err(|error| unfit("heat.steady", error.to_string()))?;
        }
        let mut pass = HeatPass::new(&model, &probe);
        pass.factors = histories.factors(0.0, 0.0);
        to_steady_state(&model, &state.particles, &mut pass, &mut started)
            .map_err(|error| unfit("heat.steady", error.to_string()))?;
    }
    state.heat = Some(started);
    if model.mechanics && model.expands() {
        expansion::start(&model, state);
    }
    if model.mechanics {
        let factors = model.largest_stiffness_factors();
        for block in state.bonds.iter_mut().chain(&mut state.contacts) {
            block.contacts_mut().set_largest_factor(&factors);
        }
    }
    whole.heat = Some(model);
    Ok(Some(histories))
}

/// Largest explicit time step, s (time of the run); infinite for implicit steps and without heat conduction.
pub(super) fn bound(model: Option<&HeatModel>, state: &State) -> f64 {
    match (model, &state.heat) {
        (Some(model), Some(heat)) if !model.implicit => {
            HeatPass::new(model, state).stable_step(model, &state.particles, heat) / model.time_factor
        }
        _ => f64::INFINITY,
    }
}

fn network_of(scenario: &Scenario, heat: &Heat, state: &State) -> Result<Network, AssemblyError> {
    let (particles, cell, planar) = (&state.particles, state.cell.as_ref(), scenario.dimension == 2);
    let planes = if cell.is_some() || heat.model == HeatNetwork::Contacts {
        Vec::new()
    } else {
        planes(scenario, heat.model, particles)
    };
    if heat.model == HeatNetwork::Power {
        return network::power(particles, cell, &planes, planar).map_err(|error| {
            let message = format!("{error}: all centers must lie in the shape of the packing; use \"disordered\"");
            unfit("heat.model", message)
        });
    }
    let contacts = heat.model == HeatNetwork::Contacts;
    let mut pairs: Vec<NearPair> = if contacts || heat.pairs == Some(HeatPairs::Bonds) {
        let views = state.bonds.iter().flat_map(|block| (0..block.len()).map(|k| block.view(k)));
        views.map(|view| (view.pair.a, view.pair.b, view.previous.normal * view.previous.length)).collect()
    } else {
        network::touching(particles, cell, heat.contact_ratio.map_or(1.0, Quantity::si))?
    };
    if contacts {
        // A clump is one body, and its members have no contacts with each other.
        if !state.clumps.is_empty() {
            let clump = |p: u32| particles.clump[p as usize];
            let touching = network::touching(particles, cell, 1.0)?.into_iter();
            pairs.extend(touching.filter(|pair| clump(pair.0) == clump(pair.1) && clump(pair.0) != u32::MAX));
        }
        return Ok(network::grains(particles, &pairs, planar));
    }
    if pairs.is_empty() && particles.len() > 1 {
        let message = "no two particles touch, so no heat flows; check positions and radii, or give a larger \
                       `contact_ratio`, such as 1.1";
        return Err(unfit("heat.model", message.to_owned()));
    }
    Ok(match heat.model {
        HeatNetwork::Ordered => network::ordered(particles, &pairs, &planes, planar),
        _ => network::disordered(particles, &pairs, &planes),
    })
}

/// The planes that bound the body: of the shape of the packing if it is a cylinder or a box, otherwise of the bounding box of the
/// spheres.
pub(super) fn planes(scenario: &Scenario, model: HeatNetwork, particles: &Particles) -> Vec<Plane> {
    let largest = particles.radius.iter().copied().fold(0.0, f64::max);
    // Centers may lie on the surface up to rounding.
    let outward = |point: Vec3, normal: Vec3, face: u32| Plane {
        inside: HalfSpace { point: point + normal * (2e-9 * largest), normal },
        face,
    };
    let center = |shape: &Shape| shape.center().map_or_else(Vec3::zeros, |center| vector(&center));
    match scenario.packing.shape() {
        Some(shape @ Shape::Cylinder { radius, height, axis, .. }) => {
            let (center, along) = (center(shape), Vec3::ith(axis.index(), 1.0));
            let (half, radius) = (along * (0.5 * height.si()), radius.si());
            let mut planes = vec![outward(center - half, -along, 0), outward(center + half, along, 1)];
            let [u, v] = [1, 2].map(|k| Vec3::ith((axis.index() + k) % 3, 1.0));
            planes.extend((0..SIDES).map(|k| {
                let angle = 2.0 * std::f64::consts::PI * f64::from(k) / f64::from(SIDES);
                let normal = u * libm::cos(angle) + v * libm::sin(angle);
                outward(center + normal * radius, normal, 2)
            }));
            planes
        }
        shape => {
            let (low, high) = match shape {
                Some(shape @ Shape::Box { size, .. }) if model != HeatNetwork::Ordered => {
                    let half = vector(size) * 0.5;
                    (center(shape) - half, center(shape) + half)
                }
                _ => particles
                    .position
                    .iter()
                    .zip(&particles.radius)
                    .fold((Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY)), |(low, high), (x, r)| {
                        (low.inf(&x.add_scalar(-r)), high.sup(&x.add_scalar(*r)))
                    }),
            };
            let faces = scenario.heat_faces().len() as u32;
            let plane = |face: u32| {
                let normal = Vec3::ith(face as usize / 2, if face % 2 == 1 { 1.0 } else { -1.0 });
                outward(if face % 2 == 1 { high } else { low }, normal, face)
            };
            (0..faces).map(plane).collect()
        }
    }
}

/// Everything that enters from outside, with its histories.
fn supply(
    scenario: &Scenario,
    heat: &Heat,
    state: &State,
    network: &Network,
    histories: &mut HeatHistories,
) -> Result<Supply, AssemblyError> {
    let mut supply = Supply::default();
    let of = |name: &Option<String>| -> Option<History> { name.as_deref().and_then(|name| history(scenario, name)) };
    for (at, source) in heat.sources.iter().enumerate() {
        supply.sources.push(heat_source(scenario, at, source, state, network)?);
        histories.sources.push(of(&source.history));
    }
    for (at, boundary) in heat.boundaries.iter().enumerate() {
        let wall = boundary.wall.as_ref();
        if let Some(wall) = wall.and_then(|wall| scenario.wall_names().iter().position(|name| name == wall)) {
            let planar = scenario.dimension == 2;
            supply.walls.push(WallExchange { wall, exchange: Exchange::of(boundary), planar });
            histories.walls.push(of(&boundary.history));
        } else if let (Some(set), None, Some(temperature)) = (&boundary.set, &boundary.face, boundary.temperature) {
            let particles: Vec<u32> = members(scenario, &state.particles, set).iter().map(|&p| p as u32).collect();
            // A later temperature overrides an earlier one.
            for earlier in &mut supply.held {
                earlier.particles.retain(|p| particles.binary_search(p).is_err());
            }
            supply.held.push(Held { particles, temperature: temperature.si() });
            histories.held.push(of(&boundary.history));
        } else {
            let exposures = exposures(scenario, at, boundary, state, network)?;
            supply.surfaces.push(SurfaceExchange { exposures, exchange: Exchange::of(boundary) });
            histories.surfaces.push(of(&boundary.history));
        }
    }
    Ok(supply)
}

/// The parts of the surface that a boundary names.
fn exposures(
    scenario: &Scenario,
    at: usize,
    boundary: &HeatBoundary,
    state: &State,
    network: &Network,
) -> Result<Vec<Exposure>, AssemblyError> {
    let face = boundary.face.as_deref().filter(|face| *face != "all");
    let number = face.and_then(|face| scenario.heat_faces().iter().position(|name| *name == face));
    let set = boundary.set.as_deref().map(|set| members(scenario, &state.particles, set));
    let chosen = |exposure: &&Exposure| {
        number.is_none_or(|number| exposure.face as usize == number)
            && set.as_ref().is_none_or(|set| set.binary_search(&(exposure.particle as usize)).is_ok())
    };
    let exposures: Vec<Exposure> = network.exposures.iter().filter(chosen).copied().collect();
    if exposures.is_empty() {
        let message = "no particle reaches this part of the surface; check the face and the set, or use the model \
                       \"power\", in which cells fill the body";
        return Err(unfit(&format!("heat.boundary[{at}]"), message.to_owned()));
    }
    Ok(exposures)
}

fn heat_source(
    scenario: &Scenario,
    at: usize,
    source: &HeatSource,
    state: &State,
    network: &Network,
) -> Result<Source, AssemblyError> {
    let power = source.power.map_or(0.0, Quantity::si);
    if let Some(spot) = &source.spot {
        let (center, velocity, radius) = (vector(&spot.center), vector(&spot.velocity), spot.radius.si());
        let factor = scenario.heat.as_ref().map_or(1.0, |heat| heat.time_factor.si());
        let key = format!("heat.source[{at}].spot.center");
        near(&key, "starts", &center, radius, state)?;
        if let Some(end) = scenario.stop.time {
            near(&key, "ends", &(center + velocity * (end.si() * factor)), radius, state)?;
        }
        return Ok(Source { power, spread: Spread::Gaussian { center, velocity, radius } });
    }
    let particles = source.set.as_deref().map_or_else(Vec::new, |set| members(scenario, &state.particles, set));
    let volume: f64 = particles.iter().map(|&p| network.volume[p]).sum();
    let shares = particles.iter().map(|&p| (p as u32, network.volume[p] / volume)).collect();
    let power = source.density.map_or(power, |density| density.si() * volume);
    Ok(Source { power, spread: Spread::Shares(shares) })
}

/// Refuses a spot that heats nothing at a point.
fn near(key: &str, when: &str, center: &Vec3, radius: f64, state: &State) -> Result<(), AssemblyError> {
    let particles = &state.particles;
    let distance = |(x, r): (&Vec3, &f64)| (x - center).norm() - r;
    let nearest = particles.position.iter().zip(&particles.radius).map(distance).fold(f64::INFINITY, f64::min);
    if nearest <= REACH * radius {
        return Ok(());
    }
    let message = format!(
        "the spot {when} {} from the nearest particle, outside the body: further than {REACH} of its radii. Check its center, its \
         velocity in thermal time, and the end of the run",
        length(nearest)
    );
    Err(unfit(key, message))
}
