//! Curves of runs: one series of a run over another, at given abscissas.

use concordem_scenario::schema::Scenario;
use serde::Deserialize;

use super::axis::spaced;
use super::sampling::Scale;
use super::series::{Rows, Series};

/// Largest number of ordinates of a point, of all curves together.
pub(super) const MOST_ORDINATES: usize = 10_000;

/// A curve that every point of a sweep has.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Name.
    pub name: String,
    /// Series of the abscissas.
    pub x: Series,
    /// Series of the ordinates.
    pub y: Series,
    /// Abscissas, which are equal for all points.
    pub abscissas: Vec<f64>,
}

/// A curve as written in the file.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenCurve {
    name: Option<String>,
    x: String,
    y: String,
    from: f64,
    to: f64,
    count: usize,
}

/// A problem of a curve: key, message, and remedy.
pub(super) type CurveProblem = (&'static str, String, &'static str);

impl WrittenCurve {
    /// The curve, in runs of a scenario; `before`: the curves before it.
    pub(super) fn resolve(self, scenario: &Scenario, before: &[Curve]) -> Result<Curve, CurveProblem> {
        let series = |key, name: &str| {
            let remedy = "name a series of the record, or a component of an operator, without max, min, or mean";
            Series::find(name.trim(), scenario)
                .map_err(|known| (key, format!("a run has no series `{name}`; there are {}", known.join(", ")), remedy))
        };
        let (x, y) = (series("x", &self.x)?, series("y", &self.y)?);
        let name = self.name.unwrap_or_else(|| format!("{} over {}", y.name, x.name));
        if name.is_empty() || name == "." || name == ".." || name.contains(['/', '\0']) {
            let message = format!("{name:?} is no name of a dataset");
            return Err(("name", message, "write a name without slashes, such as \"stress-strain\""));
        }
        if before.iter().any(|curve| curve.name == name) {
            return Err(("name", format!("two curves have the name `{name}`"), "give each curve its own name"));
        }
        if self.from == self.to || !(self.from.is_finite() && self.to.is_finite()) {
            let message = format!("a curve from {} to {} is not possible", self.from, self.to);
            return Err(("to", message, "give two different finite ends"));
        }
        if !(2..=MOST_ORDINATES).contains(&self.count) {
            let message = format!("a curve with {} abscissas is not possible", self.count);
            return Err(("count", message, "give a count from 2 to 10000"));
        }
        let abscissas = spaced(self.from, self.to, self.count, Scale::Linear);
        Ok(Curve { name, x, y, abscissas })
    }
}

impl Curve {
    /// Ordinates at the abscissas.
    pub(super) fn ordinates(&self, rows: &Rows) -> Vec<f64> {
        interpolate(&self.abscissas, &rows.pairs(self.x.place, self.y.place))
    }
}

/// Ordinates of a path at ascending or descending abscissas, each by linear interpolation where the path first passes the abscissa; NaN where
/// it never does. Points of the path without a finite abscissa are left out.
fn interpolate(abscissas: &[f64], path: &[(f64, f64)]) -> Vec<f64> {
    let descends = abscissas.first() > abscissas.last();
    let mut ascending = abscissas.to_vec();
    if descends {
        ascending.reverse();
    }
    let mut found = vec![f64::NAN; ascending.len()];
    let mut path = path.iter().copied().filter(|(x, _)| x.is_finite());
    if let Some(mut before) = path.next() {
        // The path is continuous: what it has passed is a range, which only grows.
        let mut first = ascending.partition_point(|x| *x < before.0);
        let mut end = ascending.partition_point(|x| *x <= before.0);
        found[first..end].fill(before.1);
        for (x, y) in path {
            let between = |at: f64| {
                if at == x { y } else { before.1 + (y - before.1) * ((at - before.0) / (x - before.0)) }
            };
            while end < ascending.len() && ascending[end] <= x {
                found[end] = between(ascending[end]);
                end += 1;
            }
            while first > 0 && ascending[first - 1] >= x {
                first -= 1;
                found[first] = between(ascending[first]);
            }
            before = (x, y);
        }
    }
    if descends {
        found.reverse();
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ordinates_are_those_of_the_first_passage() {
        // Up to 2, back to -1, up to 3.
        let path = [(0.0, 0.0), (2.0, 4.0), (f64::NAN, 9.0), (-1.0, 10.0), (3.0, 20.0)];
        let abscissas = [-2.0, -1.0, -0.5, 0.0, 0.5, 2.0, 2.5, 3.0, 4.0];
        let found = interpolate(&abscissas, &path);
        assert!(found[0].is_nan() && found[8].is_nan());
        assert_eq!(found[1..8], [10.0, 9.0, 0.0, 1.0, 4.0, 18.75, 20.0]);
        let mut reversed = abscissas;
        reversed.reverse();
        let mut descending = interpolate(&reversed, &path);
        descending.reverse();
        assert_eq!(descending[1..8], found[1..8]);
        assert!(interpolate(&abscissas, &[]).iter().all(|y| y.is_nan()));
        // A path that stands still, and an ordinate that is missing.
        let found = interpolate(&[1.0, 2.0], &[(1.0, 5.0), (1.0, 6.0), (2.0, f64::NAN)]);
        assert!(found[0] == 5.0 && found[1].is_nan());
    }

    /// Every ordinate is that of the first pair of neighbours on both sides of the abscissa.
    #[test]
    fn ordinates_equal_those_of_a_plain_search() {
        let mut random = concordem_packing::random::Random::new(3);
        for _ in 0..200 {
            let path: Vec<(f64, f64)> = (0..20).map(|_| (random.index(9) as f64 - 4.0, random.uniform())).collect();
            let abscissas: Vec<f64> = (0..25).map(|k| f64::from(k) * 0.5 - 6.0).collect();
            for (at, found) in abscissas.iter().zip(interpolate(&abscissas, &path)) {
                let passes = |pair: &&[(f64, f64)]| (pair[0].0 - at) * (pair[1].0 - at) <= 0.0;
                let expected = if path[0].0 == *at {
                    path[0].1
                } else {
                    path.windows(2).find(passes).map_or(f64::NAN, |pair| {
                        let share = (at - pair[0].0) / (pair[1].0 - pair[0].0);
                        pair[0].1 + share * (pair[1].1 - pair[0].1)
                    })
                };
                assert!((found - expected).abs() < 1e-12 || (found.is_nan() && expected.is_nan()), "{at}: {path:?}");
            }
        }
    }
}
