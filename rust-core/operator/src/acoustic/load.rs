//! Emission over the load of a specimen, and whether it remembers its largest load (Kaiser effect).
//!
//! A rock or concrete that is unloaded and loaded again hardly emits below its former largest load (Kaiser 1950). The Felicity ratio is the
//! load at which emission begins again over the former largest load: 1 with full memory, less in a damaged material.

use crate::error::{OperatorError, check_finite, check_length};

/// Emission until an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cumulative {
    /// Number of emissions.
    pub count: usize,
    /// Their energy, J.
    pub energy: f64,
}

/// Emission until each of the instants `at` (s, in any order); an emission at an instant counts. `emissions`: time (s) and energy (J).
///
/// # Errors
/// Numbers that are not finite.
pub fn cumulative(at: &[f64], emissions: &[[f64; 2]]) -> Result<Vec<Cumulative>, OperatorError> {
    check_finite("time", at)?;
    check_finite("emissions", emissions)?;
    let mut sorted = emissions.to_vec();
    // A stable sort by time, so that sums have the same bits in every run.
    sorted.sort_by(|one, other| one[0].total_cmp(&other[0]));
    let mut sums = vec![0.0];
    for [_, energy] in &sorted {
        sums.push(sums[sums.len() - 1] + energy);
    }
    let until = |time: &f64| {
        let count = sorted.partition_point(|emission| emission[0] <= *time);
        Cumulative { count, energy: sums[count] }
    };
    Ok(at.iter().map(until).collect())
}

/// Emission in one reloading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reloading {
    /// Largest load before, in the unit of the load.
    pub former: f64,
    /// When it was reached, s.
    pub time: f64,
    /// Least load between.
    pub least: f64,
    /// Load when emission begins again; `None` if it does not.
    pub onset: Option<f64>,
}

impl Reloading {
    /// The Felicity ratio.
    pub fn felicity(&self) -> Option<f64> {
        Some(self.onset? / self.former)
    }
}

/// The reloadings of a specimen with this load over time (s; both of the same length, times not falling, load positive). It is unloaded when
/// the load falls to `1 − drop` of the largest one so far, and loaded again when it then rises above its least value by `drop` of the largest.
/// Emission begins again with the `onset`-th emission after the least load, until the next unloading. The load between two instants is
/// interpolated.
///
/// ```
/// use concordem_operator::acoustic::load::reloadings;
///
/// // Loaded to 10, unloaded to 2, and loaded to 12; emission at 6, 8 while unloading, 9.
/// let found = reloadings(&[0.0, 1.0, 2.0, 3.0], &[0.0, 10.0, 2.0, 12.0], &[0.6, 1.25, 2.7], 0.1, 1).unwrap();
/// assert_eq!((found.len(), found[0].former, found[0].least), (1, 10.0, 2.0));
/// assert!((found[0].felicity().unwrap() - 0.9).abs() < 1e-15);
/// ```
///
/// # Errors
/// Different lengths, numbers that are not finite, times that fall, a `drop` outside of 0 to 1, no `onset`.
pub fn reloadings(
    time: &[f64],
    load: &[f64],
    emissions: &[f64],
    drop: f64,
    onset: usize,
) -> Result<Vec<Reloading>, OperatorError> {
    check_length("load", load.len(), time.len(), "time")?;
    check_finite("time", time)?;
    check_finite("load", load)?;
    check_finite("emissions", emissions)?;
    if let Some(pair) = time.windows(2).find(|pair| pair[1] < pair[0]) {
        return Err(OperatorError::Constant { name: "time", value: pair[1], demand: "times must not fall" });
    }
    if !(drop > 0.0 && drop < 1.0) {
        return Err(OperatorError::Constant { name: "drop", value: drop, demand: "it must lie between 0 and 1" });
    }
    if onset == 0 {
        return Err(OperatorError::Constant { name: "onset", value: 0.0, demand: "it must be at least 1" });
    }
    let mut emissions = emissions.to_vec();
    emissions.sort_by(f64::total_cmp);
    let found = turns(load, drop).into_iter().map(|turn| {
        let from = emissions.partition_point(|at| *at <= time[turn.least]);
        let at = emissions.get(from + onset - 1).copied().filter(|at| *at <= time[turn.end]);
        Reloading {
            former: load[turn.most],
            time: time[turn.most],
            least: load[turn.least],
            onset: at.map(|at| interpolated(time, load, at)),
        }
    });
    Ok(found.collect())
}

/// Samples of a reloading.
#[derive(Debug, Clone, Copy)]
struct Turn {
    /// The largest load before.
    most: usize,
    /// The least load of the unloading.
    least: usize,
    /// The first one of the next unloading; the last sample if there is none.
    end: usize,
}

/// The unloadings with a reloading.
fn turns(load: &[f64], drop: f64) -> Vec<Turn> {
    let mut turns: Vec<Turn> = Vec::new();
    // Samples of the largest load of all, of the largest one since the last unloading, and of the least one while unloaded.
    let (mut most, mut top) = (0, 0);
    let mut least: Option<usize> = None;
    for (k, &now) in load.iter().enumerate() {
        let Some(low) = least else {
            if now > load[top] {
                top = k;
            }
            if now > load[most] {
                most = k;
            }
            if load[most] > 0.0 && now <= load[top] - drop * load[most] {
                least = Some(k);
                if let Some(turn) = turns.last_mut() {
                    // The break that lets the load fall lies after the largest load.
                    turn.end = (top + 1).min(k);
                }
            }
            continue;
        };
        if now < load[low] {
            least = Some(k);
        } else if now >= load[low] + drop * load[most] {
            turns.push(Turn { most, least: low, end: load.len() - 1 });
            (least, top) = (None, k);
            if now > load[most] {
                most = k;
            }
        }
    }
    turns
}

/// The load at a time, which lies between the first and the last.
fn interpolated(time: &[f64], load: &[f64], at: f64) -> f64 {
    let next = time.partition_point(|time| *time < at).min(time.len() - 1);
    let last = next.saturating_sub(1);
    let length = time[next] - time[last];
    let share = if length > 0.0 { ((at - time[last]) / length).clamp(0.0, 1.0) } else { 1.0 };
    load[last] + share * (load[next] - load[last])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A specimen with known memory: loaded to 10, 20, 30 with unloading to 1 between, and emission from 0.9 of the former largest load on.
    #[test]
    fn felicity_ratios_are_recovered() {
        let (mut time, mut load, mut emissions) = (Vec::new(), Vec::new(), Vec::new());
        let mut now = 0.0;
        let mut go = |from: f64, to: f64, begin: Option<f64>| {
            for k in 0..=200 {
                let at = from + (to - from) * f64::from(k) / 200.0;
                time.push(now);
                load.push(at);
                if begin.is_some_and(|begin| at >= begin) {
                    emissions.push(now);
                }
                now += 1e-3;
            }
        };
        go(0.0, 10.0, Some(2.0));
        go(10.0, 1.0, None);
        go(1.0, 20.0, Some(9.0));
        go(20.0, 1.0, None);
        go(1.0, 30.0, Some(16.0));
        let found = reloadings(&time, &load, &emissions, 0.1, 1).unwrap();
        println!("{found:?}");
        assert_eq!(found.iter().map(|turn| (turn.former, turn.least)).collect::<Vec<_>>(), [(10.0, 1.0), (20.0, 1.0)]);
        // A sample of the load is 1/200 of its path: 0.0095 of 10, 0.0073 of 20.
        assert!((found[0].felicity().unwrap() - 0.9).abs() < 0.0096);
        assert!((found[1].felicity().unwrap() - 0.8).abs() < 0.0074);
        // The tenth emission comes nine samples later.
        let later = reloadings(&time, &load, &emissions, 0.1, 10).unwrap();
        let step = (20.0 - 1.0) / 200.0;
        assert!((later[0].onset.unwrap() - found[0].onset.unwrap() - 9.0 * step).abs() < 1e-9);
        assert_eq!(reloadings(&time, &load, &[], 0.1, 1).unwrap()[0].felicity(), None);
    }

    /// After the failure the load falls and is not restored: no reloading. A cycle below the former largest load counts with that load,
    /// and its emission with its own.
    #[test]
    fn cycles_after_the_peak_count_with_the_largest_load() {
        let time: Vec<f64> = (0..6).map(f64::from).collect();
        assert_eq!(reloadings(&time, &[0.0, 5.0, 10.0, 6.0, 3.0, 0.0], &[2.5, 4.0], 0.1, 1), Ok(vec![]));
        let load = [0.0, 10.0, 2.0, 6.0, 1.0, 7.0];
        let found = reloadings(&time, &load, &[2.5, 3.2, 4.5], 0.1, 1).unwrap();
        assert_eq!(found.len(), 2);
        assert_eq!(
            (found[0].former, found[0].onset, found[1].former, found[1].onset),
            (10.0, Some(4.0), 10.0, Some(4.0))
        );
        // Ripples below the drop are no unloading.
        let load = [0.0, 10.0, 9.5, 10.5, 10.0, 11.0];
        assert_eq!(reloadings(&time, &load, &[], 0.1, 1), Ok(vec![]));
        assert_eq!(reloadings(&[], &[], &[1.0], 0.1, 1), Ok(vec![]));
    }

    #[test]
    fn emission_adds_up() {
        let found = cumulative(&[0.0, 2.0, 1.0], &[[1.5, 4.0], [1.0, 2.0], [0.5, 1.0]]).unwrap();
        let wanted = [(0, 0.0), (3, 7.0), (2, 3.0)].map(|(count, energy)| Cumulative { count, energy });
        assert_eq!(found, wanted);
        assert_eq!(cumulative(&[1.0], &[]), Ok(vec![Cumulative { count: 0, energy: 0.0 }]));
    }

    #[test]
    fn what_has_no_meaning_is_refused() {
        let good = [0.0, 1.0];
        for bad in [f64::NAN, f64::INFINITY] {
            assert!(cumulative(&[bad], &[]).is_err() && cumulative(&[0.0], &[[bad, 1.0]]).is_err());
            assert!(cumulative(&[0.0], &[[1.0, bad]]).is_err());
            assert!(reloadings(&[0.0, bad], &good, &[], 0.1, 1).is_err());
            assert!(reloadings(&good, &[bad, 0.0], &[], 0.1, 1).is_err());
            assert!(reloadings(&good, &good, &[bad], 0.1, 1).is_err());
            assert!(reloadings(&good, &good, &[], bad, 1).is_err());
        }
        assert!(reloadings(&good, &good, &[], 0.0, 1).is_err() && reloadings(&good, &good, &[], 1.0, 1).is_err());
        assert!(reloadings(&good, &good, &[], 0.1, 0).is_err() && reloadings(&good, &good[..1], &[], 0.1, 1).is_err());
        assert!(reloadings(&[1.0, 0.0], &good, &[], 0.1, 1).is_err());
    }
}
