//! Coefficient of restitution and damping ratio, exactly, for linear and for Hertzian contacts.
//!
//! A linear spring-dashpot contact `m ü + c u̇ + k u = 0` with damping ratio `ζ = c/(2√(mk))` and the damped Hertzian
//! contact of Tsuji, Tanaka & Ishida 1992 (Powder Technology 71:239), `m δ̈ + α√(mk) δ^¼ δ̇ + k δ^{3/2} = 0`, have the
//! same restitution when `α = √5 ζ`: with `z = √(4/5) δ^{5/4}` and the velocity `v` as a function of `z`, the second
//! reads `v dv/dz = −(2ζ v + z)`, which is the phase portrait of the first (Antypov & Elliott 2011, EPL 94:50004).
//!
//! The collision ends when the overlap is spent if the contact may pull ([`End::OverlapSpent`]),
//! `e = exp(−ζπ/√(1−ζ²))`, or when the force has fallen to zero if it may not ([`End::ForceSpent`], Schwager & Pöschel
//! 2007, Granular Matter 9:465), `e = exp(−ζτ)`, `τ = 2 arccos(ζ)/√(1−ζ²)`, continued beyond `ζ = 1` by
//! `τ = 2 arcosh(ζ)/√(ζ²−1)`. Here the latter is written with `s = √|1−ζ²|` as `τ = 2 atan2(s, ζ)/s` and
//! `2 arsinh(s)/s`, which lose no digits near `ζ = 1`.

#[cfg(not(feature = "std"))]
use crate::math::Real as _;
use crate::math::{atan2, exp, ln};

/// When a collision ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum End {
    /// When the overlap has gone back to zero; the dashpot pulls on the particles towards the end.
    OverlapSpent,
    /// When the contact force has gone back to zero; it never pulls.
    ForceSpent,
}

/// Coefficient of restitution of the damping ratio `zeta ≥ 0`.
pub fn restitution_of_damping(zeta: f64, end: End) -> f64 {
    let s2 = (1.0 - zeta) * (1.0 + zeta);
    let s = s2.abs().sqrt();
    let duration = match end {
        End::OverlapSpent if s2 > 0.0 => core::f64::consts::PI / s,
        // Critically damped or more: the overlap never returns to zero.
        End::OverlapSpent => return 0.0,
        End::ForceSpent if s == 0.0 => 2.0,
        End::ForceSpent if s2 > 0.0 => 2.0 * atan2(s, zeta) / s,
        End::ForceSpent => 2.0 * libm::asinh(s) / s,
    };
    exp(-zeta * duration)
}

/// Damping ratio that gives the coefficient of restitution `e`, `0 ≤ e ≤ 1`.
///
/// `End::OverlapSpent`: `ζ = −ln e/√(π² + ln² e)`, 1 for `e = 0`. `End::ForceSpent`: by bisection to the last bit;
/// infinite for `e = 0`, which no finite damping gives. NaN for `e` outside of its range.
pub fn damping_of_restitution(e: f64, end: End) -> f64 {
    if !(0.0..=1.0).contains(&e) {
        return f64::NAN;
    }
    match end {
        End::OverlapSpent if e == 0.0 => 1.0,
        End::OverlapSpent => {
            let l = -ln(e);
            l / (core::f64::consts::PI * core::f64::consts::PI + l * l).sqrt()
        }
        End::ForceSpent if e == 0.0 => f64::INFINITY,
        End::ForceSpent if e == 1.0 => 0.0,
        End::ForceSpent => {
            let (mut low, mut high) = (0.0, 1.0);
            while restitution_of_damping(high, end) > e {
                low = high;
                high *= 2.0;
            }
            loop {
                let middle = 0.5 * (low + high);
                if middle <= low || middle >= high {
                    return middle;
                }
                if restitution_of_damping(middle, end) > e {
                    low = middle;
                } else {
                    high = middle;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The two functions are inverse to each other. 1e-14: rounding of `exp` near its argument 0, magnified by
    /// `dζ/de ≤ 10` in range.
    #[test]
    fn inverse() {
        for end in [End::OverlapSpent, End::ForceSpent] {
            for e in [1.0, 0.98, 0.9, 0.5, 0.2, 0.135, 0.1, 0.01] {
                let zeta = damping_of_restitution(e, end);
                assert!((restitution_of_damping(zeta, end) - e).abs() < 1e-14, "{end:?} {e}");
            }
        }
    }

    /// At `ζ = 1` the force vanishes at `τ = 2`, so `e = exp(−2)`; the formula is continuous there.
    /// 1e-7: `e` differs by `|de/dζ| 1e-7 ≈ 0.2e-7` at a distance of 1e-7.
    #[test]
    fn critical_damping() {
        assert!((restitution_of_damping(1.0, End::ForceSpent) - exp(-2.0)).abs() < 1e-15);
        for zeta in [1.0 - 1e-7, 1.0 + 1e-7] {
            assert!((restitution_of_damping(zeta, End::ForceSpent) - exp(-2.0)).abs() < 1e-7);
        }
    }

    /// Both ends of a collision by brute force: the closed form of the linear oscillator, stepped in time. 1e-5: the
    /// end is located to 1e-6 of the period.
    #[test]
    fn against_the_oscillator() {
        for zeta in [0.05, 0.3, 0.8] {
            let w = (1.0_f64 - zeta * zeta).sqrt();
            let velocity = |t: f64| exp(-zeta * t) * (libm::cos(w * t) - zeta / w * libm::sin(w * t));
            let overlap = |t: f64| exp(-zeta * t) * libm::sin(w * t) / w;
            let h = 1e-6;
            let mut t = h;
            while overlap(t) + 2.0 * zeta * velocity(t) > 0.0 {
                t += h;
            }
            assert!((-velocity(t) - restitution_of_damping(zeta, End::ForceSpent)).abs() < 1e-5, "{zeta}");
            while overlap(t) > 0.0 {
                t += h;
            }
            assert!((-velocity(t) - restitution_of_damping(zeta, End::OverlapSpent)).abs() < 1e-5, "{zeta}");
        }
    }

    #[test]
    fn out_of_range_is_nan() {
        assert!(damping_of_restitution(1.1, End::ForceSpent).is_nan());
        assert!(damping_of_restitution(f64::NAN, End::OverlapSpent).is_nan());
        assert!(damping_of_restitution(0.0, End::ForceSpent).is_infinite());
    }
}
