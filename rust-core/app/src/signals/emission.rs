//! Acoustic emissions of a result.

use std::collections::BTreeMap;

use crate::output::{OutputError, ResultFile};
use concordem_operator::OperatorError;
use concordem_operator::acoustic::{Break, Emission, emissions};
use concordem_scenario::schema::Scenario;
use concordem_solver::fracture::Event;
use concordem_solver::state::columns::ColumnData;

/// Breaks within this distance and time of each other are one emission.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rule {
    /// Distance, m.
    pub distance: f64,
    /// Duration, s.
    pub duration: f64,
}

impl Rule {
    /// The rule with these values, or with those of the run: the mean diameter of its particles, and the time that a longitudinal wave takes for the
    /// distance. `None` if the law of the bonds has no modulus, from which the speed of the wave would follow.
    ///
    /// # Errors
    /// The particles cannot be read.
    pub fn of(
        result: &ResultFile,
        scenario: &Scenario,
        distance: Option<f64>,
        duration: Option<f64>,
    ) -> Result<Option<Self>, OutputError> {
        let distance = distance.map_or_else(|| mean_diameter(result), Ok)?;
        let duration = duration.or_else(|| wave_time(scenario, distance));
        Ok(duration.map(|duration| Self { distance, duration }))
    }

    /// The emissions of these events.
    ///
    /// # Errors
    /// Numbers that are not finite.
    pub fn emissions(&self, events: &[Event]) -> Result<Vec<Emission>, OperatorError> {
        let breaks: Vec<Break> = events.iter().map(break_of).collect();
        emissions(&breaks, self.distance, self.duration)
    }
}

fn break_of(event: &Event) -> Break {
    let Event { time, position, energy, .. } = *event;
    Break { time, position, energy: energy.max(0.0), shear_share: shear_share(event) }
}

fn shear_share(event: &Event) -> f64 {
    let [_, shear, _, twist] = event.mode_shares;
    shear + twist
}

/// Whether the bond broke in shear, by the criterion of its law.
pub fn is_sheared(event: &Event) -> bool {
    event.in_shear
}

/// The events without those of damage whose bond broke later, so that each bond counts once.
#[must_use]
pub fn once_per_bond(events: &[Event]) -> Vec<Event> {
    let mut broken: BTreeMap<[u32; 2], usize> = BTreeMap::new();
    let mut counts = |event: &&Event| {
        let breaks = broken.entry([event.id_a, event.id_b]).or_default();
        let is_superseded = event.damage < 1.0 && *breaks > 0;
        if is_superseded {
            // A pair that was bonded again has an earlier bond as well.
            *breaks -= 1;
        } else if event.damage >= 1.0 {
            *breaks += 1;
        }
        !is_superseded
    };
    let mut kept: Vec<Event> = events.iter().rev().filter(&mut counts).copied().collect();
    kept.reverse();
    kept
}

/// Whether bonds soften in many steps, so that the energy of an event is not all that its bond takes.
pub fn is_gradual(events: &[Event]) -> bool {
    events.iter().any(|event| event.damage < 1.0)
}

/// Mean diameter of the particles, m.
fn mean_diameter(result: &ResultFile) -> Result<f64, OutputError> {
    let columns = result.rows("particles")?;
    let radii = columns.iter().find(|(name, _)| name == "radius").map(|(_, column)| &column.data);
    let Some(ColumnData::F64(radii)) = radii else { return Ok(f64::NAN) };
    Ok(2.0 * radii.iter().sum::<f64>() / radii.len() as f64)
}

/// Time that a longitudinal wave in the first material with bonds takes for a distance (m), s.
fn wave_time(scenario: &Scenario, distance: f64) -> Option<f64> {
    let law = scenario.bonds.as_ref()?.law;
    let material = scenario.materials.iter().find(|material| material.has(law))?;
    let modulus = material.table_of(law)?.modulus()?;
    Some(distance / (modulus / material.density.si()).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use concordem_contact::math::Vec3;

    /// Of a bond that is damaged and breaks, the break counts; of one that is only damaged, the damage; a pair that was bonded again counts twice.
    #[test]
    fn each_bond_counts_once() {
        let event = |step: u64, [id_a, id_b]: [u32; 2], damage: f64| Event {
            time: 0.0,
            step,
            id_a,
            id_b,
            position: Vec3::zeros(),
            mode_shares: [1.0, 0.0, 0.0, 0.0],
            in_shear: false,
            energy: 1.0,
            damage,
            joint: None,
        };
        let events = [
            event(1, [0, 1], 0.9),
            event(2, [2, 3], 0.9),
            event(3, [0, 1], 1.0),
            event(4, [4, 5], 1.0),
            event(5, [0, 1], 0.95),
        ];
        let steps = |events: &[Event]| events.iter().map(|event| event.step).collect::<Vec<_>>();
        assert_eq!(steps(&once_per_bond(&events)), [2, 3, 4, 5]);
        assert_eq!(steps(&once_per_bond(&events[..2])), [1, 2]);
    }
}
