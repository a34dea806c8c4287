//! Lists of sizes that follow a grading.

use super::{Form, Grading};
use crate::{PackingError, positive};
use concordem_contact::math::cbrt;

/// Largest number of bodies in a list.
const MOST: usize = 50_000_000;

/// Bodies that follow a grading and fill `volume` (m³; m² of the plane if `dimension` is 2), from the largest to the smallest:
/// `form` gives the shapes, one after the other.
///
/// Each body takes the share `κ s^D / V` of the curve that its volume has in the whole, and its size `s` lies in the middle of
/// this share. So each stretch of the curve has as much volume as it should, whatever the shapes, and the sum of the volumes
/// differs from `volume` by half the smallest body at most.
///
/// # Errors
/// A volume that is not positive, less than half the volume of the largest size, or so large that millions of bodies fill it.
pub fn descending(
    grading: &Grading,
    volume: f64,
    dimension: u8,
    form: &mut dyn FnMut() -> Form,
) -> Result<Vec<(Form, f64)>, PackingError> {
    positive("the volume of the aggregates", volume)?;
    let planar = dimension == 2;
    let (smallest, largest) = grading.bounds();
    let finer = grading.finer();
    // All shares are fractions of the part of the curve that is placed.
    let placed = 1.0 - finer;
    let mut bodies = Vec::new();
    let mut upper = 1.0;
    loop {
        let body = form();
        let unit = body.measure(planar);
        let measure = |size: f64| unit * if planar { size * size } else { size * size * size };
        let share = |size: f64| placed * measure(size) / volume;
        // The middle of the share falls as the size grows, so there is one root of s = P⁻¹(upper − share(s)/2).
        let (mut low, mut high) = (smallest, largest);
        loop {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            if middle < grading.size((upper - 0.5 * share(middle)).max(finer)) { low = middle } else { high = middle }
        }
        let (size, share) = (low, share(low));
        if upper - 0.5 * share < finer {
            if bodies.is_empty() {
                let reason = format!(
                    "the volume {volume:e} is less than half that of one aggregate of the smallest size, {smallest:e} m"
                );
                return Err(PackingError::BadSizes { reason });
            }
            return Ok(bodies);
        }
        upper -= share;
        bodies.push((body, size));
        if bodies.len() > MOST {
            return Err(PackingError::TooMany { count: volume / measure(smallest), limit: MOST as f64 });
        }
    }
}

/// Sizes (m) by the rule of Stránský 2018: ascending from the smallest, the second one larger by `first_step` (m), so that each
/// step between two sizes has one sphere: `(P(s + d) − P(s))/(s + d)³` is constant. The number of spheres follows from the
/// first step.
///
/// # Errors
/// A first step that is not positive, or so small that millions of spheres follow.
pub fn ascending(grading: &Grading, first_step: f64) -> Result<Vec<f64>, PackingError> {
    positive("the first step of the sizes", first_step)?;
    let (smallest, largest) = grading.bounds();
    let first = smallest + first_step;
    crate::within("the first step of the sizes", first_step, 0.0, largest - smallest)?;
    let share = (grading.passing(first) - grading.finer()) / (first * first * first);
    positive("the mass of the first step of the sizes", share)?;
    let mut sizes = vec![smallest, first];
    let mut last = first;
    // Sizes of 1 million spheres of equal volume differ by less than this fraction of the range.
    let search = 1e-3 * cbrt(smallest / largest) * smallest;
    loop {
        let missing = |size: f64| grading.passing(size) - grading.passing(last) - share * size * size * size;
        let mut low = last;
        let mut high = last;
        while missing(high) < 0.0 {
            if high >= largest {
                return Ok(sizes);
            }
            low = high;
            high = (high + search).min(largest);
        }
        // The smallest root lies between these two; bisection locates it to the last digit.
        loop {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            if missing(middle) < 0.0 { low = middle } else { high = middle }
        }
        last = high;
        sizes.push(last);
        if sizes.len() > MOST {
            return Err(PackingError::TooMany { count: 1.0 / share, limit: MOST as f64 });
        }
    }
}
