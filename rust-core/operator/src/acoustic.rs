//! Acoustic emission: breaks of bonds that are close in space and time are one event, as a laboratory records it.
//!
//! **Rule.** Two breaks belong to the same event if their distance is at most `distance` and their times differ by at most `duration`, or if a
//! chain of such breaks connects them (as in Hazzard and Young 2000, "Simulating acoustic emissions in bonded-particle models of rock", where
//! an event ends when a shear wave has left its source). The rule does not depend on the order of the breaks.
//!
//! **Size.** The energy `E` (J) of an event is the sum over its breaks, its magnitude `M = ⅔ log₁₀ E − 3.2` (Gutenberg and Richter 1956).
//!
//! **b-value.** The numbers of events above a magnitude fall as `10^(−bM)` above the magnitude of completeness `M_c`. By maximum likelihood
//! `b = log₁₀ e/(mean(M) − M_c)` over the events with `M ≥ M_c`, with the standard error `b/√n` (Aki 1965).

pub mod load;
pub mod source;

use std::collections::HashMap;

use concordem_contact::math::Vec3;

use super::error::{OperatorError, check_not_negative, check_positive};

/// A break of a bond.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Break {
    /// Time, s.
    pub time: f64,
    /// Place, m.
    pub position: Vec3,
    /// Energy released, J.
    pub energy: f64,
    /// Share of shear and twist in the energy, 0 to 1.
    pub shear_share: f64,
}

/// An event: breaks that a recorder hears as one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Emission {
    /// Time of the first break, s.
    pub time: f64,
    /// From the first to the last break, s.
    pub duration: f64,
    /// Mean place of the breaks, weighted by their energy, m.
    pub position: Vec3,
    /// Number of breaks.
    pub breaks: usize,
    /// Energy, J.
    pub energy: f64,
    /// Share of shear and twist in the energy, 0 to 1.
    pub shear_share: f64,
}

impl Emission {
    /// Magnitude; minus infinity without energy.
    pub fn magnitude(&self) -> f64 {
        magnitude(self.energy)
    }
}

/// Magnitude of an event that releases `energy` (J): `⅔ log₁₀ E − 3.2`.
pub fn magnitude(energy: f64) -> f64 {
    2.0 / 3.0 * libm::log10(energy) - 3.2
}

/// Events of the breaks that lie at most `distance` (m) and `duration` (s) apart, in the order of time; see the [module](self). Distances do
/// not reach through periodic faces.
///
/// ```
/// use concordem_contact::math::Vec3;
/// use concordem_operator::acoustic::{Break, emissions};
///
/// let at = |time, x| Break { time, position: Vec3::x() * x, energy: 1.0, shear_share: 0.0 };
/// // The second break is near the first one, the third is far, the fourth is late.
/// let breaks = [at(0.0, 0.0), at(1.0, 0.5), at(1.0, 9.0), at(5.0, 0.0)];
/// let events = emissions(&breaks, 1.0, 2.0).unwrap();
/// assert_eq!(events.iter().map(|event| event.breaks).collect::<Vec<_>>(), [2, 1, 1]);
/// ```
///
/// # Errors
/// Distance or duration not positive, breaks that are not finite, negative energies.
pub fn emissions(breaks: &[Break], distance: f64, duration: f64) -> Result<Vec<Emission>, OperatorError> {
    for (name, value) in [("distance", distance), ("duration", duration)] {
        check_positive(name, value)?;
    }
    check_not_negative("energy", breaks.iter().map(|one| one.energy))?;
    for one in breaks {
        let value = one.time + one.energy + one.shear_share + one.position.sum();
        if !value.is_finite() {
            return Err(OperatorError::Constant {
                name: "time, position, energy, or share",
                value,
                demand: "it must be finite",
            });
        }
    }
    let mut order: Vec<usize> = (0..breaks.len()).collect();
    // Equal times in the given order: sums have the same bits in every run.
    order.sort_by(|&i, &j| breaks[i].time.total_cmp(&breaks[j].time));
    let sources = connected(breaks, &order, distance, duration);
    // Number of the event with a source.
    let mut place = vec![usize::MAX; breaks.len()];
    let mut events: Vec<Emission> = Vec::new();
    for &k in &order {
        let Break { time, position, energy, shear_share } = breaks[k];
        let next = events.len();
        let at = place[sources[k]].min(next);
        if at == next {
            place[sources[k]] = next;
            let position = Vec3::zeros();
            events.push(Emission { time, duration: 0.0, position, breaks: 0, energy: 0.0, shear_share: 0.0 });
        }
        let event = &mut events[at];
        event.duration = time - event.time;
        event.breaks += 1;
        event.energy += energy;
        event.shear_share += energy * shear_share;
        event.position += position * energy;
    }
    let mut first: Vec<Vec3> = vec![Vec3::zeros(); events.len()];
    for &k in order.iter().rev() {
        first[place[sources[k]]] = breaks[k].position;
    }
    for (event, first) in events.iter_mut().zip(first) {
        if event.energy > 0.0 {
            event.position /= event.energy;
            event.shear_share /= event.energy;
        } else {
            event.position = first;
        }
    }
    Ok(events)
}

/// For each break the number of one break of its event. `order`: breaks by time.
fn connected(breaks: &[Break], order: &[usize], distance: f64, duration: f64) -> Vec<usize> {
    let mut parent: Vec<usize> = (0..breaks.len()).collect();
    let box_of = |x: &Vec3| [x.z, x.y, x.x].map(|coordinate| (coordinate / distance).floor() as i64);
    // Breaks by boxes of the edge `distance`, and in a box by time, for the sort is stable.
    let mut sorted: Vec<([i64; 3], usize)> = order.iter().map(|&k| (box_of(&breaks[k].position), k)).collect();
    sorted.sort_by_key(|&(place, _)| place);
    let boxes: Vec<&[([i64; 3], usize)]> = sorted.chunk_by(|one, other| one.0 == other.0).collect();
    let mut join = |one: usize, other: usize| {
        if (breaks[one].position - breaks[other].position).norm() <= distance {
            let (one, other) = (root(&mut parent, one), root(&mut parent, other));
            parent[one.max(other)] = one.min(other);
        }
    };
    let late = |one: usize, other: usize| breaks[other].time - breaks[one].time > duration;
    // Each box with itself and the neighbors after it: as boxes are passed in order, so are those at each offset.
    for near in (13..27).map(|n| [n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1]) {
        let mut at = 0;
        for own in &boxes {
            let wanted: [i64; 3] = std::array::from_fn(|axis| own[0].0[axis].saturating_add(near[axis]));
            while boxes.get(at).is_some_and(|other| other[0].0 < wanted) {
                at += 1;
            }
            let Some(others) = boxes.get(at).filter(|others| others[0].0 == wanted) else { continue };
            let mut from = 0;
            for &(_, one) in *own {
                from += others[from..].iter().take_while(|(_, other)| late(*other, one)).count();
                let recent = others[from..].iter().take_while(|(_, other)| !late(one, *other));
                recent.for_each(|&(_, other)| join(one, other));
            }
        }
    }
    (0..breaks.len()).map(|k| root(&mut parent, k)).collect()
}

fn root(parent: &mut [usize], mut k: usize) -> usize {
    while parent[k] != k {
        parent[k] = parent[parent[k]];
        k = parent[k];
    }
    k
}

/// A b-value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BValue {
    /// The b-value, 1.
    pub b: f64,
    /// Its standard error, 1.
    pub error: f64,
    /// Magnitude of completeness, from which on events count.
    pub completeness: f64,
    /// Number of events that count.
    pub count: usize,
}

/// Width of the classes of magnitude.
const CLASS: f64 = 0.1;

/// Added to the most frequent magnitude (Woessner and Wiemer 2005).
const CORRECTION: f64 = 0.2;

/// Fewest events of which a b-value means something.
const FEWEST: usize = 10;

/// The b-value of events with these magnitudes; magnitudes that are not finite do not count. `completeness`: the magnitude from which on events count; `None`:
/// the most frequent class of 0.1 and 0.2 beyond (Wiemer and Wyss 2000; Woessner and Wiemer 2005). `None` if fewer than ten count.
///
/// ```
/// use concordem_operator::acoustic::b_value;
///
/// // Quantiles of b = 1 above magnitude 2.
/// let magnitudes: Vec<f64> = (0..1000).map(|k| 2.0 - ((k as f64 + 0.5) / 1000.0).log10()).collect();
/// let found = b_value(&magnitudes, Some(2.0)).unwrap().unwrap();
/// assert!((found.b - 1.0).abs() < 0.01 && found.count == 1000);
/// ```
///
/// # Errors
/// A completeness that is not finite.
pub fn b_value(magnitudes: &[f64], completeness: Option<f64>) -> Result<Option<BValue>, OperatorError> {
    if let Some(value) = completeness.filter(|magnitude| !magnitude.is_finite()) {
        return Err(OperatorError::Constant { name: "completeness", value, demand: "it must be finite" });
    }
    let finite = || magnitudes.iter().copied().filter(|magnitude| magnitude.is_finite());
    let completeness = completeness.or_else(|| most_frequent(finite()).map(|class| class + CORRECTION));
    let Some(completeness) = completeness else { return Ok(None) };
    let counting: Vec<f64> = finite().filter(|magnitude| *magnitude >= completeness).collect();
    let count = counting.len();
    let excess = counting.iter().map(|magnitude| magnitude - completeness).sum::<f64>() / count as f64;
    if count < FEWEST || excess <= 0.0 {
        return Ok(None);
    }
    let b = std::f64::consts::LOG10_E / excess;
    Ok(Some(BValue { b, error: b / (count as f64).sqrt(), completeness, count }))
}

/// Lower bound of the class with most magnitudes; the smallest one of several.
fn most_frequent(magnitudes: impl Iterator<Item = f64>) -> Option<f64> {
    let mut classes: HashMap<i64, usize> = HashMap::new();
    for magnitude in magnitudes {
        *classes.entry((magnitude / CLASS).floor() as i64).or_default() += 1;
    }
    let (class, _) = classes.into_iter().max_by_key(|&(class, count)| (count, std::cmp::Reverse(class)))?;
    Some(class as f64 * CLASS)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pseudorandom numbers between 0 and 1 (Knuth's multiplier).
    struct Numbers(u64);

    impl Numbers {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
        }
    }

    /// Catalogues with a known b-value give it back within three standard errors, with the magnitude of completeness given and found. Below
    /// completeness, fewer events are seen.
    #[test]
    fn known_b_values_are_recovered() {
        let numbers = &mut Numbers(7);
        for b in [0.6, 1.0, 1.7] {
            let complete = -6.0;
            let mut magnitudes: Vec<f64> = (0..5000).map(|_| complete - numbers.next().log10() / b).collect();
            let given = b_value(&magnitudes, Some(complete)).unwrap().unwrap();
            println!("b = {b}: {given:?}");
            assert!((given.b - b).abs() < 3.0 * given.error, "{b} {given:?}");
            assert_eq!(given.count, 5000);
            assert!((given.error - given.b / 5000_f64.sqrt()).abs() < 1e-15);
            // The small events: a tenth of what the law demands in each class below.
            magnitudes.extend((0..200).map(|_| complete - 0.5 * numbers.next()));
            let found = b_value(&magnitudes, None).unwrap().unwrap();
            println!("found: {found:?}");
            assert!(found.completeness >= complete, "{found:?}");
            assert!((found.b - b).abs() < 3.0 * found.error, "{b} {found:?}");
        }
        assert_eq!(b_value(&[1.0; 9], Some(0.0)), Ok(None));
        assert_eq!(b_value(&[f64::NEG_INFINITY; 90], None), Ok(None));
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(b_value(&[1.0; 90], Some(bad)).is_err(), "{bad}");
        }
    }

    /// Synthetic sources, farther apart than the rule connects: each is found again, with its energy, place, and share of shear, in
    /// any order of the breaks.
    #[test]
    fn clusters_are_recovered() {
        let numbers = &mut Numbers(3);
        let mut wanted: Vec<(f64, Vec3, usize, f64)> = Vec::new();
        let mut breaks = Vec::new();
        for source in 0..200 {
            let center = Vec3::new(f64::from(source % 10), f64::from(source / 10 % 10), 0.0) * 10.0;
            let start = f64::from(source / 100) * 50.0 + numbers.next();
            let count = 1 + (numbers.next() * 20.0) as usize;
            let mut energy = 0.0;
            for k in 0..count {
                // A chain: each break within 0.6 m and 0.9 s of the last one.
                let offset = Vec3::new(0.3 * k as f64, 0.3 * numbers.next(), 0.3 * numbers.next());
                let one = 10_f64.powf(-4.0 * numbers.next());
                energy += one;
                breaks.push(Break {
                    time: start + 0.9 * k as f64,
                    position: center + offset,
                    energy: one,
                    shear_share: 0.25,
                });
            }
            wanted.push((start, center, count, energy));
        }
        wanted.sort_by(|one, other| one.0.total_cmp(&other.0));
        let found = emissions(&breaks, 1.0, 3.0).unwrap();
        assert_eq!(found.len(), wanted.len());
        for (event, (start, center, count, energy)) in found.iter().zip(&wanted) {
            assert_eq!((event.time, event.breaks), (*start, *count));
            assert!((event.energy / energy - 1.0).abs() < 1e-14);
            assert!((event.shear_share - 0.25).abs() < 1e-14);
            assert!((event.position - center).norm() < 6.5);
            assert!((event.duration - 0.9 * (count - 1) as f64).abs() < 1e-12);
        }
        breaks.reverse();
        let reversed = emissions(&breaks, 1.0, 3.0).unwrap();
        let members = |events: &[Emission]| events.iter().map(|event| (event.time, event.breaks)).collect::<Vec<_>>();
        assert_eq!(members(&reversed), members(&found));
    }

    /// Chains in space and in time connect; both must be near at once.
    #[test]
    fn breaks_connect_only_if_near_in_space_and_time() {
        let at = |time: f64, x: f64| Break { time, position: Vec3::x() * x, energy: 0.0, shear_share: 0.0 };
        let sizes = |breaks: &[Break]| -> Vec<usize> {
            emissions(breaks, 1.0, 1.0).unwrap().iter().map(|event| event.breaks).collect()
        };
        assert_eq!(sizes(&[at(0.0, 0.0), at(1.0, 1.0), at(2.0, 2.0), at(3.0, 3.0)]), [4]);
        assert_eq!(sizes(&[at(0.0, 0.0), at(1.1, 0.0)]), [1, 1]);
        assert_eq!(sizes(&[at(0.0, 0.0), at(0.0, 1.1)]), [1, 1]);
        // The last one joins two events that began apart.
        assert_eq!(sizes(&[at(0.0, 0.0), at(0.0, 1.6), at(0.5, 0.8)]), [3]);
        // Without energy the place is that of the first break.
        assert_eq!(emissions(&[at(0.0, -7.5)], 1.0, 1.0).unwrap()[0].position.x, -7.5);
        assert_eq!(emissions(&[], 1.0, 1.0).unwrap(), []);
    }

    #[test]
    fn what_has_no_meaning_is_refused() {
        let at = |time: f64| Break { time, position: Vec3::zeros(), energy: 1.0, shear_share: 0.0 };
        assert!(emissions(&[at(f64::NAN)], 1.0, 1.0).is_err());
        assert!(emissions(&[Break { shear_share: f64::NAN, ..at(0.0) }], 1.0, 1.0).is_err());
        for (distance, duration) in [(0.0, 1.0), (1.0, -1.0), (f64::INFINITY, 1.0), (1.0, f64::NAN)] {
            assert!(emissions(&[at(0.0)], distance, duration).is_err());
        }
    }
}
