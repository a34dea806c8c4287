//! Strengths of rock from the strengths of its bonds, and the inverse.
//!
//! A cell of bonds with tensile strength `t`, cohesion `c`, and friction coefficient `μ`, all of them small beside the moduli, has
//!
//! ```text
//! f_t/t = T(χ, μ)     f_c/f_t = R(χ, μ)     (σ₁ − f_c)/p = N(χ, μ, p/f_c)     χ = c/t
//! ```
//!
//! where `σ₁` is the strength at the lateral pressure `p`. A friction angle `φ` of the rock is `N = (1 + sin φ)/(1 − sin φ)`. Moduli come from
//! the elastic calibration.
//!
//! `T`, `R`, and `N` are measured on a grid of `(ln χ, μ)` with one packing, and interpolated. All packings are then measured where the surface
//! meets the targets, or comes nearest; the surface is shifted by what their means differ from it, and so on. So the search follows the
//! trend, not the roughness that breaking bonds give each value. Last, `t = f_t/T`, and runs with these strengths show what they reach.

use super::concrete::Scatter;

/// Ratios `c/t` of the grid; without a target for tension, the ratio of the scenario.
pub const COHESION_RATIOS: [f64; 5] = [0.5, 1.5, 4.5, 13.5, 40.5];
/// Friction coefficients of the grid; without a target for friction, the coefficient of the scenario.
pub const FRICTIONS: [f64; 4] = [0.0, 0.5, 1.0, 2.0];
/// Relative errors of `f_c/f_t` and of `N` at which the search ends.
pub const TOLERANCES: [f64; 2] = [0.01, 0.02];
/// Tensile strength of the first bonds over the target in compression, without a target for tension.
const TRIAL: f64 = 0.15;
/// Points at which all packings are measured, at most.
const ROUNDS: usize = 6;

/// Target strengths of the rock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RockTargets {
    /// Tensile strength, Pa, if there is a target for tension.
    pub tensile_strength: Option<f64>,
    /// Compressive strength, Pa, positive.
    pub compressive_strength: f64,
    /// Gain `N` of strength over lateral pressure, and the pressure over the compressive strength, if there is a target for friction.
    pub gain: Option<(f64, f64)>,
}

/// Strengths of bonds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BondStrengths {
    /// Tensile strength, Pa.
    pub tensile_strength: f64,
    /// Cohesion over tensile strength.
    pub cohesion_ratio: f64,
    /// Tangent of the angle of friction.
    pub friction: f64,
}

/// Strengths of one packing.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RockStrengths {
    /// `f_t` over the tensile strength of bonds.
    pub tension: f64,
    /// `f_c/f_t`.
    pub ratio: f64,
    /// `N`; 0 if it was not measured.
    pub gain: f64,
    /// Slope of the curve in compression, Pa.
    pub young: f64,
    /// Whether the stress of a run never fell, so that its largest value is no strength.
    pub rises: bool,
}

/// The search asks for strengths of packings, by their numbers; the answers have the same order.
pub type Measure<'a, E> = dyn FnMut(&[(BondStrengths, usize)]) -> Result<Vec<RockStrengths>, E> + 'a;

/// Means over packings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RockMeans {
    /// `f_t` over the tensile strength of bonds.
    pub tension: Scatter,
    /// `f_c/f_t`.
    pub ratio: Scatter,
    /// `N`.
    pub gain: Scatter,
    /// Modulus in compression, Pa.
    pub young: Scatter,
    /// Number of packings with a run whose stress never fell.
    pub rising: usize,
}

impl RockMeans {
    fn of(found: &[RockStrengths]) -> Self {
        let scatter = |of: fn(&RockStrengths) -> f64| Scatter::of(found.iter().map(of));
        Self {
            tension: scatter(|s| s.tension),
            ratio: scatter(|s| s.ratio),
            gain: scatter(|s| s.gain),
            young: scatter(|s| s.young),
            rising: found.iter().filter(|s| s.rises).count(),
        }
    }
}

/// Result of the calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct RockFit {
    /// Strengths of the bonds.
    pub bonds: BondStrengths,
    /// What the packings reach with them.
    pub reached: RockMeans,
    /// Relative errors of `f_c/f_t` and of `N`.
    pub errors: [f64; 2],
    /// Largest errors that are accepted: the larger of [`TOLERANCES`] and the standard error of the mean over packings.
    pub accepted: [f64; 2],
    /// Whether the strengths reached, or the interpolated values, meet the targets within these errors.
    pub in_reach: bool,
    /// Smallest and largest `f_c/f_t` on the grid.
    pub ratios: (f64, f64),
    /// Smallest and largest `N` on the grid, of any `f_c/f_t`.
    pub gains: (f64, f64),
    /// Smallest and largest `N` where the interpolated `f_c/f_t` is the target; `None` if it is nowhere.
    pub gains_at_ratio: Option<(f64, f64)>,
}

impl RockFit {
    /// Whether the targets are met. Few packings, or small ones, may miss what is in reach, by jumps of their values.
    pub fn meets(&self) -> bool {
        within(self.errors, self.accepted)
    }
}

fn within(errors: [f64; 2], most: [f64; 2]) -> bool {
    errors.iter().zip(most).all(|(error, most)| error.abs() <= most)
}

/// The larger of [`TOLERANCES`] and the relative standard error of the means: nearer values would tell these packings, not the rock.
fn accepted(means: &RockMeans, packings: usize) -> [f64; 2] {
    let error = |scatter: Scatter| (scatter.deviation / (packings as f64).sqrt() / scatter.mean).abs();
    // Without a target for friction the gain is 0, and its error no number.
    [error(means.ratio).max(TOLERANCES[0]), error(means.gain).max(TOLERANCES[1])]
}

/// Finds strengths of bonds for target strengths of a rock, on `packings` packings. What has no target keeps the ratio or the friction of
/// `given`. If the targets are out of reach, the nearest strengths are returned; see [`RockFit::in_reach`].
///
/// # Errors
/// Those of `measure`.
pub fn fit<E>(
    targets: &RockTargets,
    given: &BondStrengths,
    packings: usize,
    measure: &mut Measure<'_, E>,
) -> Result<RockFit, E> {
    // Close to the result, so that inertia and strains are nearly the same in the last runs.
    let trial = targets.tensile_strength.map_or(TRIAL * targets.compressive_strength, |strength| 1.5 * strength);
    let frictions = if targets.gain.is_some() { FRICTIONS.to_vec() } else { vec![given.friction] };
    let ratios = if targets.tensile_strength.is_some() { COHESION_RATIOS.to_vec() } else { vec![given.cohesion_ratio] };
    let logarithms: Vec<f64> = ratios.into_iter().map(libm::log).collect();
    let all = |bonds: BondStrengths| -> Vec<(BondStrengths, usize)> { (0..packings).map(|k| (bonds, k)).collect() };
    // The tensile strength of bonds with which these means would be the target's.
    let scaled = |means: &RockMeans| {
        let reached = means.tension.mean * targets.tensile_strength.map_or(means.ratio.mean, |_| 1.0);
        targets.tensile_strength.unwrap_or(targets.compressive_strength) / reached
    };
    let of_ratio = |logarithm| frictions.iter().map(move |&friction| Point { logarithm, friction });
    let grid: Vec<Point> = logarithms.iter().flat_map(|&logarithm| of_ratio(logarithm)).collect();
    let jobs: Vec<_> = grid.iter().map(|at| (at.bonds(trial), 0)).collect();
    let values = measure(&jobs)?.iter().map(Values::of).collect();
    let mut surface = Surface { logarithms, frictions, values, shift: Values::default() };
    let mut best: Option<(f64, Point, f64)> = None;
    let mut strength = trial;
    for _ in 0..ROUNDS {
        let at = surface.nearest(targets);
        if best.as_ref().is_some_and(|(_, known, _)| known == &at) {
            break;
        }
        let means = RockMeans::of(&measure(&all(at.bonds(strength)))?);
        strength = scaled(&means);
        let values = Values::of_means(&means);
        let misfit = misfit(targets, values);
        if best.as_ref().is_none_or(|(least, ..)| misfit < *least) {
            best = Some((misfit, at, strength));
        }
        if within(errors(targets, values), TOLERANCES) {
            break;
        }
        surface.shift = values.minus(surface.unshifted(at));
    }
    let Some((_, at, strength)) = best else { unreachable!("there is at least one round") };
    let bonds = at.bonds(strength);
    let reached = RockMeans::of(&measure(&all(bonds))?);
    let nearest = errors(targets, surface.at(surface.nearest(targets)));
    // The surface is rough: what has been reached is in reach, whatever it says.
    let accepted = accepted(&reached, packings);
    let in_reach = within(errors(targets, Values::of_means(&reached)), accepted) || within(nearest, accepted);
    let span = |of: fn(&Values) -> f64| {
        surface.values.iter().map(of).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), v| (l.min(v), m.max(v)))
    };
    let (least, most) = span(|values| values.log_ratio);
    Ok(RockFit {
        accepted,
        bonds,
        reached,
        errors: errors(targets, Values::of_means(&reached)),
        in_reach,
        ratios: (libm::exp(least), libm::exp(most)),
        gains: span(|values| values.gain),
        gains_at_ratio: targets.ratio().and_then(|ratio| surface.gains_at(ratio)),
    })
}

impl RockTargets {
    /// `f_c/f_t`, if there is a target for tension.
    pub fn ratio(&self) -> Option<f64> {
        self.tensile_strength.map(|strength| self.compressive_strength / strength)
    }
}

/// Relative errors of `f_c/f_t` and of `N`.
fn errors(targets: &RockTargets, found: Values) -> [f64; 2] {
    let gain = targets.gain.map_or(0.0, |(wanted, _)| found.gain / wanted - 1.0);
    [targets.ratio().map_or(0.0, |wanted| libm::exp(found.log_ratio) / wanted - 1.0), gain]
}

/// What the search makes small.
fn misfit(targets: &RockTargets, found: Values) -> f64 {
    let gain = targets.gain.map_or(0.0, |(wanted, _)| found.gain / wanted - 1.0);
    let ratio = targets.ratio().map_or(0.0, |wanted| found.log_ratio - libm::log(wanted));
    ratio * ratio + gain * gain
}

/// Arguments of the functions.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Point {
    /// `ln χ`.
    logarithm: f64,
    friction: f64,
}

impl Point {
    fn bonds(self, tensile_strength: f64) -> BondStrengths {
        BondStrengths { tensile_strength, cohesion_ratio: libm::exp(self.logarithm), friction: self.friction }
    }
}

/// Values of the functions.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Values {
    log_ratio: f64,
    gain: f64,
}

impl Values {
    fn of(found: &RockStrengths) -> Self {
        Self { log_ratio: libm::log(found.ratio), gain: found.gain }
    }

    fn of_means(means: &RockMeans) -> Self {
        Self { log_ratio: libm::log(means.ratio.mean), gain: means.gain.mean }
    }

    fn minus(self, other: Self) -> Self {
        Self { log_ratio: self.log_ratio - other.log_ratio, gain: self.gain - other.gain }
    }

    fn mixed(self, other: Self, share: f64) -> Self {
        let mix = |a: f64, b: f64| a + share * (b - a);
        Self { log_ratio: mix(self.log_ratio, other.log_ratio), gain: mix(self.gain, other.gain) }
    }
}

/// The functions, linear between the points of the grid in each direction.
struct Surface {
    /// Of the cohesion ratios.
    logarithms: Vec<f64>,
    frictions: Vec<f64>,
    /// For each cohesion ratio, the values of all frictions.
    values: Vec<Values>,
    /// What is added everywhere.
    shift: Values,
}

/// Points of the mesh on which the nearest one is sought, in each direction; and how often a finer mesh follows around it.
const MESH: usize = 60;
const REFINEMENTS: usize = 3;

impl Surface {
    fn unshifted(&self, at: Point) -> Values {
        let place = |values: &[f64], x: f64| -> (usize, f64) {
            let k = values.iter().skip(1).take(values.len().saturating_sub(2)).filter(|v| **v <= x).count();
            let share = values.get(k + 1).map_or(0.0, |next| (x - values[k]) / (next - values[k]));
            (k, share)
        };
        let (i, along) = place(&self.logarithms, at.logarithm);
        let (j, across) = place(&self.frictions, at.friction);
        let (rows, columns) = (self.logarithms.len(), self.frictions.len());
        let row = |i: usize| {
            let value = |j: usize| self.values[i.min(rows - 1) * columns + j.min(columns - 1)];
            value(j).mixed(value(j + 1), across)
        };
        row(i).mixed(row(i + 1), along)
    }

    fn at(&self, at: Point) -> Values {
        let Values { log_ratio, gain } = self.unshifted(at);
        Values { log_ratio: log_ratio + self.shift.log_ratio, gain: gain + self.shift.gain }
    }

    fn bounds(&self) -> [(f64, f64); 2] {
        let ends = |values: &[f64]| (values[0], values[values.len() - 1]);
        [ends(&self.logarithms), ends(&self.frictions)]
    }

    /// The point that comes nearest to the targets; of equally near ones the first, with the least cohesion.
    fn nearest(&self, targets: &RockTargets) -> Point {
        let bounds = self.bounds();
        let mut box_of = bounds;
        let mut best = (f64::INFINITY, Point { logarithm: bounds[0].0, friction: bounds[1].0 });
        for _ in 0..=REFINEMENTS {
            for at in mesh(box_of) {
                let found = misfit(targets, self.at(at));
                if found < best.0 {
                    best = (found, at);
                }
            }
            let Point { logarithm, friction } = best.1;
            let around = |x: f64, (low, high): (f64, f64), (least, most): (f64, f64)| {
                let width = 2.0 * (high - low) / MESH as f64;
                ((x - width).max(least), (x + width).min(most))
            };
            box_of = [around(logarithm, box_of[0], bounds[0]), around(friction, box_of[1], bounds[1])];
        }
        best.1
    }

    /// Smallest and largest gain where the ratio is within half of the mesh's width of this one.
    fn gains_at(&self, ratio: f64) -> Option<(f64, f64)> {
        let wanted = libm::log(ratio);
        let near = mesh(self.bounds()).map(|at| self.at(at)).filter(|found| (found.log_ratio - wanted).abs() < 0.02);
        near.map(|found| found.gain).fold(None, |span, gain| {
            Some(span.map_or((gain, gain), |(least, most): (f64, f64)| (least.min(gain), most.max(gain))))
        })
    }
}

fn mesh([(first, last), (least, most)]: [(f64, f64); 2]) -> impl Iterator<Item = Point> {
    let share = |k: usize| k as f64 / MESH as f64;
    (0..=MESH).flat_map(move |i| {
        (0..=MESH).map(move |j| Point {
            logarithm: first + share(i) * (last - first),
            friction: least + share(j) * (most - least),
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::convert::Infallible;

    const GIVEN: BondStrengths = BondStrengths { tensile_strength: 1.0, cohesion_ratio: 3.0, friction: 0.35 };

    /// Strengths by smooth functions, other by some percent in each packing.
    #[expect(clippy::unnecessary_wraps, reason = "measurements may fail")]
    fn rock(jobs: &[(BondStrengths, usize)]) -> Result<Vec<RockStrengths>, Infallible> {
        let one = |&(bonds, packing): &(BondStrengths, usize)| {
            let BondStrengths { cohesion_ratio, friction, .. } = bonds;
            let luck = 1.0 + 0.03 * (packing as f64 - 1.0);
            let ratio = 5.0 * luck * cohesion_ratio.powf(0.4) / (1.0 + 0.05 * cohesion_ratio) * (1.0 + 0.3 * friction);
            let gain = 1.5 + 2.0 * friction / (1.0 + 0.5 * friction) + 0.1 * cohesion_ratio.ln()
                - 0.1 * (packing as f64 - 1.0);
            RockStrengths { tension: 0.6 * luck, ratio, gain, young: 50e9, rises: false }
        };
        Ok(jobs.iter().map(one).collect())
    }

    /// The targets of known arguments are met within the tolerances, although the surface comes from another packing than the mean.
    #[test]
    fn known_strengths_are_met() {
        for (cohesion_ratio, friction) in [(0.8, 0.2), (3.0, 0.7), (9.0, 1.4), (2.0, 1.9)] {
            let known = BondStrengths { tensile_strength: 10e6, cohesion_ratio, friction };
            let jobs: Vec<_> = (0..3).map(|k| (known, k)).collect();
            let means = RockMeans::of(&rock(&jobs).unwrap());
            let tensile_strength = 10e6 * means.tension.mean;
            let targets = RockTargets {
                tensile_strength: Some(tensile_strength),
                compressive_strength: tensile_strength * means.ratio.mean,
                gain: Some((means.gain.mean, 0.1)),
            };
            let found = fit(&targets, &GIVEN, 3, &mut rock).unwrap();
            println!("{known:?}: {found:?}");
            assert!(found.meets(), "{:?}", found.errors);
            assert!((found.bonds.tensile_strength / 10e6 - 1.0).abs() < 1e-12);
            // Both functions rise with both arguments here, so that several may meet the targets; the strengths must.
            assert!((found.reached.ratio.mean / means.ratio.mean - 1.0).abs() <= TOLERANCES[0]);
            assert!((found.reached.gain.mean / means.gain.mean - 1.0).abs() <= TOLERANCES[1]);
            assert!(found.gains_at_ratio.is_some());
        }
    }

    /// What has no target is kept: the friction, or the ratio of cohesion to tensile strength.
    #[test]
    fn what_has_no_target_is_kept() {
        let targets = RockTargets { tensile_strength: Some(8e6), compressive_strength: 60e6, gain: None };
        let found = fit(&targets, &GIVEN, 2, &mut rock).unwrap();
        assert!(found.meets() && found.bonds.friction.to_bits() == GIVEN.friction.to_bits(), "{found:?}");
        let targets = RockTargets { tensile_strength: None, compressive_strength: 80e6, gain: Some((2.8, 0.1)) };
        let found = fit(&targets, &GIVEN, 2, &mut rock).unwrap();
        assert!(found.meets() && (found.bonds.cohesion_ratio / GIVEN.cohesion_ratio - 1.0).abs() < 1e-15, "{found:?}");
        let compression = found.bonds.tensile_strength * found.reached.tension.mean * found.reached.ratio.mean;
        // The mean of a product is not the product of the means: packings differ by 3 %.
        assert!((compression / 80e6 - 1.0).abs() < 2e-3, "{compression:e}");
    }

    /// Out of reach: the nearest strengths, and what is reached.
    #[test]
    fn what_is_out_of_reach_is_said() {
        let targets = RockTargets { tensile_strength: Some(8e6), compressive_strength: 8e8, gain: None };
        let found = fit(&targets, &GIVEN, 2, &mut rock).unwrap();
        assert!(!found.in_reach && !found.meets() && found.ratios.1 < 20.0, "{found:?}");
        assert!(found.errors[0] < -0.8);
        let targets = RockTargets { tensile_strength: Some(8e6), compressive_strength: 60e6, gain: Some((30.0, 0.1)) };
        let found = fit(&targets, &GIVEN, 2, &mut rock).unwrap();
        assert!(!found.in_reach && !found.meets() && found.gains.1 < 5.0 && found.errors[1] < -0.5, "{found:?}");
    }
}
