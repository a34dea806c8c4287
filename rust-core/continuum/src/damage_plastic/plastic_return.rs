//! Return of a trial stress to the yield surface, fully implicit, in the invariants over the compressive strength.
//!
//! The potential does not depend on the Lode angle, so the deviator keeps its direction, and four unknowns remain: mean stress
//! `s`, deviator `p`, hardening `κ`, and multiplier `ℓ`, with `k = K/(2G)` and `η = f_c/(2G)`:
//!
//! ```text
//! s − s_tr + k ℓ g_s = 0                                 p − p_tr + ℓ g_p = 0
//! κ − κ_n − ℓ η √(g_s²/3 + g_p²) (2 cos θ)²/x_h(s) = 0    f(s, p, q(κ)) = 0
//! ```
//!
//! Where the surface meets the hydrostatic axis it has a vertex, and `p = 0` replaces the flow rule.

use nalgebra::{Matrix3, Matrix4, Vector3, Vector4};

use super::hardening::Hardening;
use super::surface::Surface;

/// Residuals below this are solved; one more Newton step then removes what is left, as far as rounding allows.
const SOLVED: f64 = 1e-11;
/// Newton steps that a solvable problem takes at most; 5 to 8 are usual.
const NEWTON_STEPS: usize = 40;
/// Shortest part of the way from the surface to the trial stress before the return is given up.
const SHORTEST: f64 = 1.0 / 4096.0;

/// A stress outside the yield surface.
#[derive(Debug, Clone, Copy)]
pub struct Trial {
    /// `σ_V/f_c`.
    pub s: f64,
    /// `ρ/f_c`.
    pub p: f64,
    /// `cos θ`.
    pub cos_lode: f64,
    /// `κ` before the step.
    pub kappa: f64,
}

/// The stress on the yield surface.
#[derive(Debug, Clone, Copy)]
pub struct Returned {
    /// `σ_V/f_c`.
    pub s: f64,
    /// `ρ/f_c`.
    pub p: f64,
    /// `κ` after the step.
    pub kappa: f64,
    /// Derivatives of `(s, p, κ)` (rows) with respect to `(s, p, cos θ)` of the trial stress (columns).
    pub slope: Matrix3<f64>,
}

/// What the return depends on.
#[derive(Debug, Clone, Copy)]
pub struct PlasticReturn<'a> {
    /// Surfaces.
    pub surface: &'a Surface,
    /// Hardening.
    pub hardening: &'a Hardening,
    /// `k = K/(2G)`.
    pub bulk: f64,
    /// `η = f_c/(2G)`.
    pub strain: f64,
}

/// Residuals, their derivatives by the unknowns, and by `cos θ`.
type System = (Vector4<f64>, Matrix4<f64>, Vector4<f64>);

impl PlasticReturn<'_> {
    /// The returned stress; `None` if none is found.
    ///
    /// Large steps in tension harden from `q₀` to 1 within a small part of the step, which Newton's method overlooks. They end on the
    /// final surface, where the stress does not depend on `κ`.
    pub fn solve(&self, trial: &Trial) -> Option<Returned> {
        let elastic = Vector4::new(trial.s, trial.p, trial.kappa, 0.0);
        let hardening = (trial.kappa < 1.0).then(|| self.regular(elastic, trial, trial.kappa)).flatten();
        hardening
            .and_then(|found| self.returned(&found, trial))
            .or_else(|| {
                let start = self.on_final_surface(trial)?;
                self.regular(start, trial, 1.0).and_then(|found| self.returned(&found, trial))
            })
            .or_else(|| self.vertex(trial))
            .or_else(|| self.follow(trial).and_then(|found| self.returned(&found, trial)))
    }

    /// The return to the surface `q = 1`; `None` if it ends at the vertex, or with `κ < 1`.
    ///
    /// Flow rule and surface give `p` and then `s` as functions of `ℓ`, and `s − s_tr + kℓ g_s` increases with `ℓ`, because both `s` and
    /// the dilatancy do: one root.
    fn on_final_surface(&self, trial: &Trial) -> Option<Vector4<f64>> {
        let section = self.surface.yield_function(0.0, 1.0, 1.0, trial.cos_lode);
        // f = (3/2)p² + m(s + p r/√6) − 1 at s = 0, p = 1.
        let (m, deviatoric) = (self.surface.friction, section.value - 0.5);
        let (by_p, constant) = (3.0, self.surface.flow(0.0, 0.0, 1.0).deviator);
        let stress = |l: f64| {
            let p = (trial.p - l * constant) / (1.0 + by_p * l);
            ((1.0 - 1.5 * p * p - deviatoric * p) / m, p)
        };
        let value = |l: f64| {
            let (s, p) = stress(l);
            s - trial.s + self.bulk * l * self.surface.flow(s, p, 1.0).mean
        };
        let (mut low, mut high) = (0.0, trial.p / constant);
        if !(value(low) < 0.0 && value(high) > 0.0) {
            return None;
        }
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            if value(middle) < 0.0 { low = middle } else { high = middle }
        }
        let (s, p) = stress(high);
        let flow = self.surface.flow(s, p, 1.0);
        let norm = (flow.mean * flow.mean / 3.0 + flow.deviator * flow.deviator).sqrt();
        let (ductility, _) = self.hardening.ductility(s);
        let kappa = trial.kappa + high * self.strain * 4.0 * trial.cos_lode * trial.cos_lode / ductility * norm;
        (kappa >= 1.0).then(|| Vector4::new(s, p, kappa, high))
    }

    fn system(&self, x: &Vector4<f64>, trial: &Trial) -> System {
        let [s, p, kappa, l] = [x[0], x[1], x[2], x[3]];
        let (q, q_slope) = self.hardening.variable(kappa);
        let flow = self.surface.flow(s, p, q);
        let f = self.surface.yield_function(s, p, q, trial.cos_lode);
        let (ductility, ductility_slope) = self.hardening.ductility(s);
        let norm = (flow.mean * flow.mean / 3.0 + flow.deviator * flow.deviator).sqrt();
        let norm_by = |mean: f64, deviator: f64| (flow.mean * mean / 3.0 + flow.deviator * deviator) / norm;
        let rate = self.strain * 4.0 * trial.cos_lode * trial.cos_lode / ductility;
        let residual = Vector4::new(
            s - trial.s + self.bulk * l * flow.mean,
            p - trial.p + l * flow.deviator,
            kappa - trial.kappa - l * rate * norm,
            f.value,
        );
        let (mean_kappa, deviator_kappa) = (flow.mean_hardening * q_slope, flow.deviator_hardening * q_slope);
        let jacobian = Matrix4::new(
            1.0 + self.bulk * l * flow.mean_mean,
            self.bulk * l * flow.mean_deviator,
            self.bulk * l * mean_kappa,
            self.bulk * flow.mean,
            //
            l * flow.mean_deviator,
            1.0 + l * flow.deviator_deviator,
            l * deviator_kappa,
            flow.deviator,
            //
            -l * rate * (norm_by(flow.mean_mean, flow.mean_deviator) - norm * ductility_slope / ductility),
            -l * rate * norm_by(flow.mean_deviator, flow.deviator_deviator),
            1.0 - l * rate * norm_by(mean_kappa, deviator_kappa),
            -rate * norm,
            //
            f.by_mean,
            f.by_deviator,
            f.by_hardening * q_slope,
            0.0,
        );
        let by_cos = Vector4::new(0.0, 0.0, -2.0 * l * rate * norm / trial.cos_lode, f.by_cos_lode);
        (residual, jacobian, by_cos)
    }

    /// Size of the residuals: stresses relative to the strength or the trial stress, `κ` to itself.
    fn merit(residual: &Vector4<f64>, x: &Vector4<f64>, trial: &Trial) -> f64 {
        let stress = 1.0 + trial.s.abs() + trial.p;
        let kappa = x[2].abs().max(1.0);
        let found = (residual[0] / stress).abs().max((residual[1] / stress).abs());
        let merit = found.max((residual[2] / kappa).abs()).max((residual[3] / (stress * stress)).abs());
        if merit.is_finite() { merit } else { f64::INFINITY }
    }

    /// Newton's method from a start, with `κ` kept at or above `least`; `None` if it does not converge.
    fn regular(&self, start: Vector4<f64>, trial: &Trial, least: f64) -> Option<Vector4<f64>> {
        let mut x = start;
        let (mut residual, mut jacobian, _) = self.system(&x, trial);
        let mut merit = Self::merit(&residual, &x, trial);
        for _ in 0..NEWTON_STEPS {
            let step = jacobian.lu().solve(&residual)?;
            let mut part = 1.0;
            let solved = merit < SOLVED;
            loop {
                let mut next = x - step * part;
                next[2] = next[2].max(least);
                let (r, j, _) = self.system(&next, trial);
                let m = Self::merit(&r, &next, trial);
                if m < merit || part < 1e-3 || solved {
                    if solved && m > merit {
                        return Some(x);
                    }
                    (x, residual, jacobian, merit) = (next, r, j, m);
                    break;
                }
                part *= 0.5;
            }
            if solved {
                return Some(x);
            }
        }
        None
    }

    /// The result with its derivatives; `None` if the solution is none of this step.
    fn returned(&self, x: &Vector4<f64>, trial: &Trial) -> Option<Returned> {
        let [s, p, kappa, l] = [x[0], x[1], x[2], x[3]];
        if !(p >= 0.0 && p <= trial.p * (1.0 + 1e-9) + 1e-12 && l >= 0.0 && kappa >= trial.kappa) {
            return None;
        }
        let (_, jacobian, by_cos) = self.system(x, trial);
        let inverse = jacobian.try_inverse()?;
        let column = |k: usize| inverse.column(k).fixed_rows::<3>(0).into_owned();
        let cos: Vector4<f64> = -(inverse * by_cos);
        let slope = Matrix3::from_columns(&[column(0), column(1), Vector3::new(cos[0], cos[1], cos[2])]);
        Some(Returned { s, p, kappa, slope })
    }

    /// The same solution by following it from where the way from the origin to the trial stress leaves the surface. The origin is
    /// always inside.
    fn follow(&self, trial: &Trial) -> Option<Vector4<f64>> {
        let (q, _) = self.hardening.variable(trial.kappa);
        let at = |t: f64| Trial { s: t * trial.s, p: t * trial.p, ..*trial };
        let outside = |t: f64| self.surface.yield_function(t * trial.s, t * trial.p, q, trial.cos_lode).value > 0.0;
        let (mut inside, mut beyond) = (0.0, 1.0);
        while beyond - inside > 1e-12 {
            let middle = 0.5 * (inside + beyond);
            if outside(middle) { beyond = middle } else { inside = middle }
        }
        let mut now = beyond;
        let start = at(now);
        let mut x = Vector4::new(start.s, start.p, trial.kappa, 0.0);
        let mut part = 0.125 * (1.0 - now);
        let shortest = SHORTEST * (1.0 - now);
        while now < 1.0 {
            let next = if now + part > 1.0 - shortest { 1.0 } else { now + part };
            let target = at(next);
            match self.regular(x, &target, trial.kappa) {
                Some(found) if found[1] >= 0.0 && found[3] >= 0.0 => {
                    (x, now, part) = (found, next, 2.0 * part);
                }
                _ if part > shortest => part *= 0.25,
                _ => return None,
            }
        }
        Some(x)
    }

    /// Return to the vertex on the hydrostatic axis; `None` if the trial stress does not lie in its cone.
    fn vertex(&self, trial: &Trial) -> Option<Returned> {
        let rate = 4.0 * self.strain * trial.cos_lode * trial.cos_lode;
        // κ, and its derivatives by s, by the trial s, by the trial p, by cos θ.
        let kappa_at = |s: f64| {
            let volume = (trial.s - s) / self.bulk;
            let norm = (volume * volume / 3.0 + trial.p * trial.p).sqrt();
            let (ductility, slope) = self.hardening.ductility(s);
            let (by_s, by_p) =
                if norm > 0.0 { (volume / (3.0 * self.bulk * norm), trial.p / norm) } else { (0.0, 0.0) };
            let scale = rate / ductility;
            let by_mean = scale * (-by_s - norm * slope / ductility);
            let value = trial.kappa + scale * norm;
            (value, by_mean, scale * by_s, scale * by_p, 2.0 * scale * norm / trial.cos_lode)
        };
        let value = |s: f64| {
            let (kappa, by_s, ..) = kappa_at(s);
            let (q, q_slope) = self.hardening.variable(kappa);
            let f = self.surface.yield_function(s, 0.0, q, trial.cos_lode);
            (f.value, f.by_mean + f.by_hardening * q_slope * by_s, f.by_hardening * q_slope)
        };
        let (mut inside, mut beyond) = (0.0, trial.s);
        if value(beyond).0 <= 0.0 {
            return None;
        }
        let mut s = 0.5 * (inside + beyond);
        for _ in 0..200 {
            let (f, slope, _) = value(s);
            if f > 0.0 {
                beyond = s;
            } else {
                inside = s;
            }
            let newton = s - f / slope;
            let (low, high) = if inside < beyond { (inside, beyond) } else { (beyond, inside) };
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            if (next - s).abs() <= f64::EPSILON * s.abs() || next == s {
                s = next;
                break;
            }
            s = next;
        }
        let (_, slope, by_kappa) = value(s);
        let (kappa, by_s, by_trial, by_p, by_cos) = kappa_at(s);
        let (q, _) = self.hardening.variable(kappa);
        let flow = self.surface.flow(s, 0.0, q);
        let multiplier = (trial.s - s) / (self.bulk * flow.mean);
        if !(multiplier >= 0.0 && trial.p <= multiplier * flow.deviator * (1.0 + 1e-9)) {
            return None;
        }
        let mean = Vector3::new(by_trial, by_p, by_cos) * (-by_kappa / slope);
        let hardening = mean * by_s + Vector3::new(by_trial, by_p, by_cos);
        let slope = Matrix3::from_rows(&[mean.transpose(), Vector3::zeros().transpose(), hardening.transpose()]);
        Some(Returned { s, p: 0.0, kappa, slope })
    }
}
