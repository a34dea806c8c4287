//! Coefficient of restitution of a sphere, or of a bonded body, that hits a plane wall, and of two spheres that hit each other.

use std::collections::BTreeMap;

use super::meaning::Measured;
use super::{OutputError, Run};
use crate::output::frames::{Frame, Frames};
use concordem_contact::math::Vec3;
use concordem_scenario::schema::quantity::vector;
use concordem_scenario::schema::{Damping, Loading, Scenario};
use concordem_solver::state::columns::ColumnData;

/// A body at one time.
#[derive(Debug, Clone, PartialEq)]
struct Body {
    spheres: Vec<(Vec3, f64)>,
    /// Velocity of the center of mass, m/s.
    velocity: Vec3,
}

/// The coefficient of a body that falls on a plane, `e = v′/v` with the velocities (m/s) of its center of mass along the normal at the first touch, and as it
/// leaves the wall. `bodies`: before and after, `time` (s) apart; `gravity`: acceleration towards the wall, m/s².
///
/// Between these times and the impact the flight is free, so `v² = v₀² + 2 g h`. If the flight after leaves no time for a lower bounce, this was the only
/// one: a second one would need `2 v′/g` more.
fn from_wall(bodies: [&Body; 2], (point, normal): (Vec3, Vec3), gravity: f64, time: f64) -> Option<f64> {
    let [before, after] = bodies.map(|body| {
        let gaps = body.spheres.iter().map(|(x, radius)| (x - point).dot(&normal) - radius);
        (gaps.fold(f64::INFINITY, f64::min), body.velocity.dot(&normal))
    });
    let speed = |(gap, velocity): (f64, f64)| (gap >= 0.0).then(|| (velocity * velocity + 2.0 * gravity * gap).sqrt());
    let (touching, leaving) = (speed(before)?, speed(after)?);
    if gravity > 0.0 {
        let contact = time - (touching + before.1) / gravity - (leaving - after.1) / gravity;
        let is_one = contact > 0.0 && contact < 2.0 * leaving / gravity;
        return is_one.then_some(leaving / touching);
    }
    (gravity == 0.0 && before.1 < 0.0 && after.1 > 0.0).then_some(leaving / touching)
}

/// The coefficient of two spheres in free flight, `e = −(v′·n)/(v·n)` with their relative velocities before and after, and the direction `n`
/// of their centers at the first touch.
fn from_each_other(before: [&Body; 2], after: [&Body; 2]) -> Option<f64> {
    let relative = |[a, b]: [&Body; 2]| {
        let (([(x, r)], [(y, s)]), velocity) = ((&a.spheres[..], &b.spheres[..]), b.velocity - a.velocity) else {
            return None;
        };
        Some((y - x, r + s, velocity))
    };
    let ((x, reach, v), (y, _, w)) = (relative(before)?, relative(after)?);
    let (approach, square) = (x.dot(&v), v.norm_squared());
    let discriminant = approach * approach - square * (x.norm_squared() - reach * reach);
    if approach >= 0.0 || discriminant <= 0.0 || x.norm() < reach || y.norm() < reach || y.dot(&w) <= 0.0 {
        return None;
    }
    let touch = x + v * ((-approach - discriminant.sqrt()) / square);
    Some(-w.dot(&touch) / v.dot(&touch))
}

/// The bodies of a snapshot: what intact bonds connect, and single particles, by the smallest id; `mass`: by id, kg.
fn bodies(frame: &Frame, mass: &BTreeMap<u32, f64>) -> Option<BTreeMap<u32, Body>> {
    let (ColumnData::U32(id), ColumnData::F64(radius), ColumnData::F64(velocity)) =
        (frame.field("id")?, frame.field("radius")?, frame.field("velocity")?)
    else {
        return None;
    };
    let body_of = match frame.field("fragment") {
        Some(ColumnData::U32(fragment)) => fragment,
        _ => id,
    };
    let mut found: BTreeMap<u32, (Body, f64)> = BTreeMap::new();
    let rows = frame
        .points
        .chunks_exact(3)
        .zip(velocity.chunks_exact(3))
        .map(|(x, v)| (Vec3::from_column_slice(x), Vec3::from_column_slice(v)));
    for (k, (position, velocity)) in rows.enumerate() {
        let empty = || (Body { spheres: Vec::new(), velocity: Vec3::zeros() }, 0.0);
        let (body, sum) = found.entry(body_of[k]).or_insert_with(empty);
        let mass = mass.get(&id[k])?;
        body.spheres.push((position, radius[k]));
        body.velocity += velocity * *mass;
        *sum += mass;
    }
    Some(found.into_iter().map(|(id, (body, mass))| (id, Body { velocity: body.velocity / mass, ..body })).collect())
}

/// Whether nothing but contacts and gravity acts on the bodies.
fn is_free(scenario: &Scenario) -> bool {
    let acts = [
        scenario.loading != Loading::None,
        scenario.integration.damping != Damping::default(),
        !scenario.forces.is_empty(),
        !scenario.prescribed.is_empty(),
        !scenario.slaves.is_empty(),
        !scenario.clumps.is_empty(),
        !scenario.membranes.is_empty(),
        scenario.packing.is_periodic(),
        scenario.heat.is_some(),
    ];
    !acts.contains(&true)
}

/// The coefficient of a run; `None` for runs that are no single impact.
fn coefficient(run: &Run) -> Result<Option<f64>, OutputError> {
    let Some(scenario) = run.scenario.as_ref().filter(|scenario| is_free(scenario)) else { return Ok(None) };
    let wall = match &scenario.walls[..] {
        [] => None,
        [wall] if wall.servo.is_none() && vector(&wall.velocity) == Vec3::zeros() => Some(wall.shape.kind()),
        _ => return Ok(None),
    };
    if run.file.snapshot_times()?.len() < 2 {
        return Ok(None);
    }
    let frames = Frames::of_particles(run.file.root(), run.file.path())?;
    let (first, last) = (frames.read(0)?, frames.read(frames.len() - 1)?);
    let table: BTreeMap<String, _> =
        run.file.rows("particles")?.into_iter().map(|(name, column)| (name, column.data)).collect();
    let (Some(ColumnData::U32(id)), Some(ColumnData::F64(mass))) = (table.get("id"), table.get("mass")) else {
        return Ok(None);
    };
    let mass = id.iter().copied().zip(mass.iter().copied()).collect();
    let Some((before, after)) = bodies(&first, &mass).zip(bodies(&last, &mass)) else { return Ok(None) };
    if !before.keys().eq(after.keys()) {
        return Ok(None);
    }
    let all = |bodies: &BTreeMap<u32, Body>| bodies.values().cloned().collect::<Vec<Body>>();
    let (before, after) = (all(&before), all(&after));
    let gravity = vector(&scenario.integration.gravity);
    Ok(match (&before[..], &after[..], wall) {
        ([before], [after], Some(kind)) => {
            kind.point().zip(kind.normal(0)).filter(|_| kind.faces().len() == 1).and_then(|(point, normal)| {
                let normal = normal.normalize();
                let towards = -gravity.dot(&normal);
                // A body of several spheres turns as it falls, and another part of it may strike first.
                let is_known = before.spheres.len() == 1 || towards == 0.0;
                is_known.then(|| from_wall([before, after], (point, normal), towards, last.time - first.time)).flatten()
            })
        }
        ([a, b], [c, d], None) if gravity == Vec3::zeros() => from_each_other([a, b], [c, d]),
        _ => None,
    })
}

/// The coefficient of restitution of a run that is a single impact; empty for others.
pub(super) fn rows(run: &Run) -> Result<Vec<Measured>, OutputError> {
    let row =
        |e| ("e", "coefficient of restitution: normal velocity after the impact over that before".to_owned(), "", e);
    Ok(coefficient(run)?.map(row).into_iter().collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ball(position: Vec3, velocity: Vec3) -> Body {
        Body { spheres: vec![(position, 1.0)], velocity }
    }

    /// Falls from 5 m at rest with g = 10: arrives at 10 m/s after 1 s, leaves at 6 m/s, and is at 1.6 m with 2 m/s 0.4 s later. A second bounce, which leaves at
    /// 3.6 m/s after another 1.2 s, is none.
    #[test]
    fn a_ball_bounces_once() {
        let wall = (Vec3::zeros(), Vec3::z());
        let at = |height: f64, speed: f64| ball(Vec3::new(3.0, 0.0, 1.0 + height), Vec3::new(0.5, 0.0, speed));
        let from = at(5.0, 0.0);
        let e = |after: &Body, time: f64| from_wall([&from, after], wall, 10.0, time);
        assert!((e(&at(1.6, 2.0), 1.401).unwrap() - 0.6).abs() < 1e-12);
        // 3.6 m/s upwards, 0.1 s after it leaves: 0.31 m with 2.6 m/s.
        assert_eq!(e(&at(0.31, 2.6), 1.0 + 1.2 + 0.1), None);
        assert_eq!(e(&at(3.0, -6.0), 0.6), None, "it has not arrived");
        let thrown = |after: f64| from_wall([&at(1.0, -4.0), &at(2.0, after)], wall, 0.0, 1.0);
        assert_eq!((thrown(3.0), thrown(-3.0)), (Some(0.75), None));
    }

    /// An oblique impact of two spheres that touch at 30° to the line of flight: tangential velocities do not count.
    #[test]
    fn two_spheres_collide_obliquely() {
        let (x, y) = (Vec3::x(), Vec3::y());
        let normal = x * 0.75_f64.sqrt() + y * 0.5;
        let tangent = normal.cross(&Vec3::z());
        let v = x * -2.0;
        let before = [ball(Vec3::zeros(), Vec3::zeros()), ball(normal * 2.0 - v, v)];
        let rebound = normal * (-0.8 * v.dot(&normal)) + tangent * 0.3;
        let after = [ball(Vec3::zeros(), Vec3::zeros()), ball(normal * 2.5, rebound)];
        let e =
            |before: &[Body; 2], after: &[Body; 2]| from_each_other([&before[0], &before[1]], [&after[0], &after[1]]);
        assert!((e(&before, &after).unwrap() - 0.8).abs() < 1e-12);
        assert_eq!(e(&before, &before), None, "they still approach");
        let passing = [before[0].clone(), ball(y * 3.0 - v, v)];
        assert_eq!(e(&passing, &after), None);
    }
}
