//! Builds the operators of a scenario with their regions.

use super::{AssemblyError, material_index, set_index, unfit};
use crate::sampling::{Need, SampleKey, SampledRegion, SampledWall, ScheduledOperator};
use crate::schema::quantity::vector;
use crate::schema::{self, SampleRegion, Scenario};
use concordem_contact::math::{Mat3, Vec3};
use concordem_operator::{HalfSpace, Period, Region, Truncation};
use concordem_solver::state::{Cell, Particles, State};

/// The operators of all tables `[[sample]]`.
///
/// # Errors
/// A region does not fit the packing.
pub fn of(
    scenario: &Scenario,
    particles: &Particles,
    cell: Option<&Cell>,
) -> Result<Vec<ScheduledOperator>, AssemblyError> {
    let each = scenario.samples.iter().enumerate().map(|(k, sample)| {
        let path = format!("sample[{k}]");
        let operator = one(scenario, particles, cell, &path, sample)?;
        if let (SampledRegion::Moving { region, gradient, .. }, Some(cell)) = (&operator.region, cell) {
            stays_bounded(scenario, cell, &format!("{path}.region"), &part(region, operator.grid), gradient)?;
        }
        Ok(operator)
    });
    each.collect()
}

/// The region, or a cell of its grid: what an operator is evaluated in.
fn part(region: &Region, grid: Option<[usize; 3]>) -> Region {
    let first = match (region, grid) {
        (Region::Box { low, high }, Some(count)) => Region::grid(*low, *high, count).into_iter().next(),
        _ => None,
    };
    first.unwrap_or_else(|| region.clone())
}

/// Strain of the cell at which regions are tried.
const TRIAL: f64 = 1e-3;

/// Refuses half-spaces that the driven cell will no longer bound, such as a slab across x in a cell whose other edges turn
/// towards x. `gradient`: with which the region deforms, 1/s.
fn stays_bounded(
    scenario: &Scenario,
    cell: &Cell,
    key: &str,
    region: &Region,
    gradient: &Mat3,
) -> Result<(), AssemblyError> {
    for rate in cell_rates(scenario) {
        let time = TRIAL / rate.amax();
        let edges = (rate * time).exp() * cell.matrix;
        let moved = region.moved(&(gradient * time).exp(), &Vec3::zeros(), &Vec3::zeros());
        moved.check_period(Some(&Period::of(edges))).map_err(|error| {
            let message = format!("the loading may turn the edges of the cell, and then {error}");
            unfit(key, message)
        })?;
    }
    Ok(())
}

/// Velocity gradients (1/s) with which the loading may deform the periodic cell.
fn cell_rates(scenario: &Scenario) -> Vec<Mat3> {
    match &scenario.loading {
        schema::Loading::CellStrain { velocity_gradient } => {
            let rate = Mat3::from_fn(|i, j| velocity_gradient[i][j].si());
            if rate == Mat3::zeros() { Vec::new() } else { vec![rate] }
        }
        // The servo drives every component, because the stress of a packing is never exactly the target.
        schema::Loading::CellStress { .. } => {
            let axes = usize::from(scenario.dimension);
            let pairs = (0..axes).flat_map(|i| (0..=i).map(move |j| (i, j)));
            let unit =
                |(i, j)| Mat3::from_fn(|row, column| f64::from((row, column) == (i, j) || (row, column) == (j, i)));
            pairs.map(unit).collect()
        }
        _ => Vec::new(),
    }
}

/// The operator of the table at the key path `path`.
///
/// # Errors
/// The region does not fit the packing.
pub fn one(
    scenario: &Scenario,
    particles: &Particles,
    cell: Option<&Cell>,
    path: &str,
    sample: &schema::OperatorSample,
) -> Result<ScheduledOperator, AssemblyError> {
    let region = if sample.operator.definition().region.has_region() {
        let key = format!("{path}.region");
        let region = region(scenario, particles, cell, &key, sample.region.as_ref())?;
        if let Some(region) = &region {
            let period = cell.map(|cell| Period::of(cell.matrix));
            let checked = part(region, sample.grid).check_period(period.as_ref());
            checked.map_err(|error| unfit(&key, error.to_string()))?;
        }
        region
    } else {
        // The operator reads a wall or sets; the volume is not used.
        Some(Region::All { volume: 1.0 })
    };
    let names = sample.set.iter().chain(sample.sets.iter().flatten());
    let sets = names.map(|name| members(scenario, particles, name)).collect::<Result<Vec<_>, _>>()?;
    let is_list = sample.region.as_ref().is_some_and(SampleRegion::is_list);
    let default = if is_list { Truncation::HalfCrossing } else { Truncation::default() };
    let wall = sample.wall.as_ref().and_then(|name| {
        let wall = scenario.wall_names().iter().position(|wall| wall == name)?;
        Some(SampledWall { wall: wall as u32, area: sample.area.map_or(1.0, schema::Quantity::si) })
    });
    let about = match (&sample.about, &sample.wall) {
        (Some(point), _) => Some(vector(point)),
        // What an operator finds about a point of a wall, it finds about the axis.
        (None, Some(name)) if sample.operator.definition().uses(SampleKey::About) => {
            let message = "this wall has no axis; give the point that the moment refers to";
            Some(axis_point(scenario, name).ok_or_else(|| unfit(&format!("{path}.about"), message.into()))?)
        }
        (None, _) => None,
    };
    let gradient = Mat3::from_fn(|i, j| sample.velocity_gradient[i][j].si());
    Ok(ScheduledOperator {
        name: sample.name().to_owned(),
        operator: sample.operator,
        region: region.map_or(SampledRegion::Cell, |region| SampledRegion::Moving {
            region,
            velocity: vector(&sample.velocity),
            gradient,
        }),
        grid: sample.grid,
        truncation: sample.truncation.unwrap_or(default),
        partition: sample.partition.unwrap_or_default(),
        wall,
        sets,
        about,
        interval: sample.interval.unwrap_or(scenario.output.sample_interval),
    })
}

/// A point of the axis of a plane, a cylinder, or a plate of this name, m.
fn axis_point(scenario: &Scenario, name: &str) -> Option<Vec3> {
    let names = |number: usize, wall: &schema::Wall| wall.name.clone().unwrap_or_else(|| format!("wall {number}"));
    let (_, wall) = scenario.walls.iter().enumerate().find(|(number, wall)| names(*number, wall) == name)?;
    let of_rotation = wall.rotation.as_ref().and_then(|rotation| rotation.point.as_ref());
    of_rotation.map(vector).or_else(|| wall.shape.kind().point())
}

/// Particles of a set, by index.
pub(super) fn members(scenario: &Scenario, particles: &Particles, name: &str) -> Result<Vec<u32>, AssemblyError> {
    let bit = 1_u64 << set_index(scenario, name);
    let members: Vec<u32> = (0..particles.len()).filter(|&p| particles.tags[p] & bit != 0).map(|p| p as u32).collect();
    if members.is_empty() {
        return Err(unfit("sample.set", format!("the set `{name}` has no particles")));
    }
    Ok(members)
}

/// The region; `None` for the periodic cell.
fn region(
    scenario: &Scenario,
    particles: &Particles,
    cell: Option<&Cell>,
    key: &str,
    region: Option<&SampleRegion>,
) -> Result<Option<Region>, AssemblyError> {
    let plane = scenario.dimension == 2;
    let region = match region {
        None | Some(SampleRegion::Cell) => {
            return if cell.is_some() {
                Ok(None)
            } else {
                let example = "{ kind = \"sphere\", center = [0, 0, 0], radius = \"5 mm\" }";
                Err(unfit(key, format!("the packing has no periodic cell; give a region, such as {example}")))
            };
        }
        Some(SampleRegion::All { volume }) => Region::All { volume: volume.si() },
        Some(SampleRegion::Box { minimum, maximum }) => {
            let (low, high) = (vector(minimum), vector(maximum));
            if plane { Region::rectangle([low.x, low.y], [high.x, high.y]) } else { Region::Box { low, high } }
        }
        Some(SampleRegion::Sphere { center, radius }) => {
            let (center, radius) = (vector(center), radius.si());
            if plane { Region::disc(center, radius) } else { Region::Sphere { center, radius } }
        }
        Some(SampleRegion::Cylinder { center, axis, radius, height }) => Region::Cylinder {
            center: vector(center),
            axis: vector(axis).normalize(),
            radius: radius.si(),
            half_length: 0.5 * height.si(),
        },
        Some(SampleRegion::Ellipsoid { center, half_axes }) => {
            Region::Ellipsoid { center: vector(center), axes: Mat3::from_diagonal(&vector(half_axes)) }
        }
        Some(SampleRegion::HalfSpaces { planes, volume }) => {
            let half_space = |plane: &schema::SamplePlane| HalfSpace {
                point: vector(&plane.point),
                normal: vector(&plane.normal).normalize(),
            };
            Region::HalfSpaces { planes: planes.iter().map(half_space).collect(), volume: volume.si() }
        }
        Some(SampleRegion::Set { set, volume }) => {
            let bit = 1_u64 << set_index(scenario, set);
            let member = particles.tags.iter().map(|tags| tags & bit != 0).collect();
            Region::Particles { member, volume: volume.si() }
        }
        Some(SampleRegion::Material { material, volume }) => {
            Region::of_material(&particles.material, material_index(scenario, material), volume.si())
        }
    };
    if let Region::Particles { member, .. } = &region
        && !member.contains(&true)
    {
        return Err(unfit(key, "the region has no particles".into()));
    }
    region.volume().map_err(|error| unfit(key, error.to_string()))?;
    Ok(Some(region))
}

/// Initial positions of all particles, if an operator needs them; else empty.
pub fn initial_positions(samples: &[ScheduledOperator], state: &State) -> Vec<Vec3> {
    let needed = samples.iter().any(|sample| sample.operator.definition().needs(Need::InitialPositions));
    if needed { state.particles.position.clone() } else { Vec::new() }
}

/// Members of every clump, as indices of `particles`. The ids of the particles are those of the packing; the spheres that
/// clumps add follow.
pub fn rigid_bodies(scenario: &Scenario, particles: &Particles) -> Vec<Vec<u32>> {
    let added: usize = scenario.clumps.iter().filter_map(|clump| clump.spheres.as_ref()).map(Vec::len).sum();
    let mut next = particles.len() - added.min(particles.len());
    let member_if = |belongs: &dyn Fn(usize) -> bool| -> Vec<u32> {
        (0..particles.len()).filter(|&p| belongs(p)).map(|p| p as u32).collect()
    };
    let members = |clump: &schema::Clump| match (&clump.set, &clump.spheres) {
        (Some(set), _) => {
            let bit = 1_u64 << set_index(scenario, set);
            member_if(&|p| particles.tags[p] & bit != 0)
        }
        (None, spheres) => {
            let ids = next..next + spheres.as_ref().map_or(0, Vec::len);
            next = ids.end;
            member_if(&|p| ids.contains(&(particles.id[p] as usize)))
        }
    };
    scenario.clumps.iter().map(members).collect()
}
