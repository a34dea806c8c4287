//! Operators that a scenario samples.

use super::{AssemblyError, material_index, set_index, unfit};
use crate::math::{Mat3, Vec3};
use crate::operator::Region;
use crate::plan::OperatorSample;
use crate::plan::samples::SampledRegion;
use crate::scenario::quantity::vector;
use crate::scenario::{SampleRegion, Scenario};
use crate::state::{Particles, State};

/// The samples of the plan, for these particles.
pub(crate) fn of(
    scenario: &Scenario,
    particles: &Particles,
    periodic: bool,
) -> Result<Vec<OperatorSample>, AssemblyError> {
    let each = scenario.samples.iter().enumerate().map(|(k, sample)| {
        let key = format!("sample[{k}].region");
        let region = region(scenario, particles, periodic, &key, sample.region.as_ref())?;
        let is_list = sample.region.as_ref().is_some_and(SampleRegion::is_list);
        let default =
            if is_list { crate::operator::Truncation::HalfCrossing } else { crate::operator::Truncation::default() };
        let truncation = sample.truncation.unwrap_or(default);
        Ok(OperatorSample {
            name: sample.name().to_owned(),
            operator: sample.operator,
            region: match region {
                Some(region) => SampledRegion::Moving { region, velocity: vector(&sample.velocity) },
                None => SampledRegion::Cell,
            },
            truncation,
            interval: sample.interval.unwrap_or(scenario.output.sample_interval),
        })
    });
    each.collect()
}

/// The region; nothing for the periodic cell.
pub(crate) fn region(
    scenario: &Scenario,
    particles: &Particles,
    periodic: bool,
    key: &str,
    region: Option<&SampleRegion>,
) -> Result<Option<Region>, AssemblyError> {
    let plane = scenario.dimension == 2;
    let region = match region {
        None | Some(SampleRegion::Cell) => {
            return if periodic {
                Ok(None)
            } else {
                Err(unfit(key, "the packing has no periodic cell; give a region".into()))
            };
        }
        Some(SampleRegion::All { volume }) => Region::All { volume: volume.si() },
        Some(SampleRegion::Box { minimum, maximum }) => {
            let (low, high) = (vector(minimum), vector(maximum));
            if plane { Region::rectangle([low.x, low.y], [high.x, high.y]) } else { Region::Box { low, high } }
        }
        Some(SampleRegion::Sphere { center, radius }) => {
            let (centre, radius) = (vector(center), radius.si());
            if plane { Region::disc(centre, radius) } else { Region::Sphere { centre, radius } }
        }
        Some(SampleRegion::Cylinder { center, axis, radius, height }) => Region::Cylinder {
            centre: vector(center),
            axis: vector(axis).normalize(),
            radius: radius.si(),
            half_length: 0.5 * height.si(),
        },
        Some(SampleRegion::Ellipsoid { center, half_axes }) => {
            Region::Ellipsoid { centre: vector(center), axes: Mat3::from_diagonal(&vector(half_axes)) }
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
        return Err(unfit(key, "no particle belongs to it".into()));
    }
    region.volume().map_err(|error| unfit(key, error.to_string()))?;
    Ok(Some(region))
}

/// Places of all particles, if an operator needs those of the start.
pub(super) fn places(samples: &[OperatorSample], state: &State) -> Vec<Vec3> {
    let needed = samples.iter().any(|sample| sample.operator == crate::plan::Operator::AffineStrain);
    if needed { state.particles.position.clone() } else { Vec::new() }
}
