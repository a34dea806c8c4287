//! The damage-plastic model against closed forms.

mod shared;

use concordem_continuum::{DamagePlastic, Parameters, State};
use nalgebra::Matrix3;
use shared::{Point, concrete, thesis};

fn relative(found: f64, wanted: f64) -> f64 {
    (found - wanted).abs() / wanted.abs()
}

/// Friction `m` from its definition.
fn friction(p: &Parameters) -> f64 {
    let (c, t, e) = (p.compressive_strength, p.tensile_strength, p.eccentricity);
    3.0 * (c * c - t * t) / (c * t) * e / (e + 1.0)
}

/// Newton steps of the return end at 1e-11 and remove the rest: effective stresses are exact to rounding of the surface.
const EXACT: f64 = 1e-9;

#[test]
fn simple_compression_yields_at_q_times_the_strength() {
    for law in [concrete(), thesis()] {
        let p = *law.parameters();
        for kappa in [0.0, 0.1, 0.3, 0.6, 0.9, 1.0] {
            let q = if kappa < 1.0 {
                p.initial_hardening + (1.0 - p.initial_hardening) * kappa * (kappa * kappa - 3.0 * kappa + 3.0)
            } else {
                1.0
            };
            let state = State { hardening: kappa, ..State::VIRGIN };
            let strain = |stress: f64| law.elasticity().strain(&Matrix3::from_diagonal(&[stress, 0.0, 0.0].into()));
            let limit = -q * p.compressive_strength;
            let below = law.update(&strain(limit * (1.0 - 1e-9)), &state, 0.1).unwrap();
            let above = law.update(&strain(limit * (1.0 + 1e-7)), &state, 0.1).unwrap();
            assert_eq!(below.state, state, "kappa {kappa}");
            assert_ne!(above.state, state, "kappa {kappa}");
        }
    }
}

#[test]
fn effective_strengths_in_tension_and_compression_are_the_parameters() {
    for law in [concrete(), thesis()] {
        let p = *law.parameters();
        for (end, strength) in [(0.4e-3, p.tensile_strength), (-4e-3, -p.compressive_strength)] {
            let mut point = Point::new(&law, 0.1);
            let mut last = None;
            for k in 1..=400 {
                last = Some(point.simple(end * f64::from(k) / 400.0));
            }
            let last = last.unwrap();
            assert!(point.state.hardening > 1.0, "hardening {}", point.state.hardening);
            let effective = last.stress[(0, 0)] / (1.0 - last.damage);
            assert!(relative(effective, strength) < EXACT, "{effective:e} {strength:e}");
        }
    }
}

/// With `σ = λ d` on the final surface, `(3/2)(ρ/f_c)² + m (ρ r/√6 + σ_V)/f_c = 1` is a quadratic equation for λ.
#[test]
fn equal_biaxial_strength_is_the_root_of_a_quadratic_equation() {
    let wanted = 1.16 * 30e6;
    let eccentricity = Parameters::eccentricity_of_biaxial_strength(30e6, 3e6, wanted);
    let fitted = DamagePlastic::new(Parameters { eccentricity, ..*concrete().parameters() }).unwrap();
    for law in [concrete(), thesis(), fitted] {
        let p = *law.parameters();
        let (m, e, c) = (friction(&p), p.eccentricity, p.compressive_strength);
        // ρ = √(2/3) b, σ_V = −2b/3, θ = 0, r = 1/e.
        let slope = m / 3.0 * (1.0 / e - 2.0);
        let root = c * ((slope * slope + 4.0).sqrt() - slope) / 2.0;
        let mut point = Point::new(&law, 0.1);
        let mut last = None;
        for k in 1..=400 {
            last = Some(point.advance(-8e-3 * f64::from(k) / 400.0, [[1.0, -1.0, 0.0], [0.0, 0.0, 1.0]], [0.0; 2]));
        }
        let last = last.unwrap();
        assert!(point.state.hardening > 1.0);
        let effective = -last.stress[(0, 0)] / (1.0 - last.damage);
        assert!(relative(effective, root) < EXACT, "{effective:e} {root:e}");
        if law == fitted {
            assert!(relative(root, wanted) < 1e-12, "{root:e}");
        }
    }
}

#[test]
fn biaxial_strengths_at_other_ratios_are_roots_too() {
    let law = concrete();
    let p = *law.parameters();
    let (m, e, c) = (friction(&p), p.eccentricity, p.compressive_strength);
    for ratio in [0.2, 0.5, 0.8] {
        let direction = nalgebra::Vector3::new(-1.0, -ratio, 0.0);
        let mean = direction.sum() / 3.0;
        let deviator = direction.add_scalar(-mean);
        let rho = deviator.norm();
        // Willam and Warnke's radius from the angle itself.
        let cos = (1.5_f64.sqrt() * deviator.max() / rho).clamp(0.5, 1.0);
        let a = 4.0 * (1.0 - e * e) * cos * cos;
        let b = 2.0 * e - 1.0;
        let r = (a + b * b) / (2.0 * (1.0 - e * e) * cos + b * (a + 5.0 * e * e - 4.0 * e).sqrt());
        let (square, linear) = (1.5 * rho * rho, m * (rho * r / 6.0_f64.sqrt() + mean));
        let root = c * ((linear * linear + 4.0 * square).sqrt() - linear) / (2.0 * square);
        let mut point = Point::new(&law, 0.1);
        let mut last = None;
        for k in 1..=400 {
            last = Some(point.advance(-6e-3 * f64::from(k) / 400.0, [[-ratio, 1.0, 0.0], [0.0, 0.0, 1.0]], [0.0; 2]));
        }
        let last = last.unwrap();
        assert!(point.state.hardening > 1.0, "{ratio}: {}", point.state.hardening);
        let effective = -last.stress[(0, 0)] / (1.0 - last.damage);
        assert!(relative(effective, root) < EXACT, "{ratio}: {effective:e} {root:e}");
    }
}

/// On the compressive meridian (`r = 1`), the final surface is `(d/f_c)² = 1 + m p/f_c` for the strength difference `d` at pressure `p`.
#[test]
fn confined_strength_is_closed() {
    for law in [concrete(), thesis()] {
        let p = *law.parameters();
        let (m, c) = (friction(&p), p.compressive_strength);
        for pressure in [0.05, 0.2, 1.0] {
            let lateral = -pressure * c;
            let mut point = Point::new(&law, 0.1);
            let conditions = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            // First the pressure on all sides. With this hardening the cap lies beyond it; on the cap, two lateral strains do not
            // follow from two lateral stresses.
            point.state.hardening = 0.6;
            let bulk = law.elasticity().bulk;
            for k in 1..=20 {
                let part = f64::from(k) / 20.0;
                point.advance(part * lateral / (3.0 * bulk), conditions, [lateral * part; 2]);
            }
            let (start, end) = (point.strain[0], -0.15 * (1.0 + 2.0 * pressure));
            let mut last = None;
            for k in 1..=600 {
                last = Some(point.advance(start + (end - start) * f64::from(k) / 600.0, conditions, [lateral; 2]));
                if point.state.hardening > 1.05 {
                    break;
                }
            }
            let last = last.unwrap();
            assert!(point.state.hardening > 1.0, "{pressure}: {}", point.state.hardening);
            // Effective stresses satisfy the surface; the lateral one is p/(1−ω).
            let left = 1.0 - last.damage;
            let difference = (last.stress[(1, 1)] - last.stress[(0, 0)]) / left;
            let confining = -last.stress[(1, 1)] / left;
            let wanted = c * (1.0 + m * confining / c).sqrt();
            assert!(relative(difference, wanted) < EXACT, "{pressure}: {difference:e} {wanted:e}");
        }
    }
}

/// At `κ_P ≥ 1` on the hydrostatic axis, `m σ_V/f_c = 1`.
#[test]
fn hydrostatic_tension_ends_at_the_vertex() {
    for law in [concrete(), thesis()] {
        let p = *law.parameters();
        let update = law.update(&(Matrix3::identity() * 1e-3), &State::VIRGIN, 0.1).unwrap();
        let effective = update.stress / (1.0 - update.damage);
        let wanted = Matrix3::identity() * (p.compressive_strength / friction(&p));
        assert!((effective - wanted).norm() < EXACT * wanted.norm(), "{effective} {wanted}");
        assert!(update.state.hardening > 1.0);
    }
}

/// The two conditions from which the potential follows.
#[test]
fn plastic_flow_at_the_strengths_has_the_given_direction() {
    for law in [concrete(), thesis()] {
        for (sign, ratio) in [(1.0, 0.0), (-1.0, law.parameters().dilation)] {
            let p = *law.parameters();
            let strength = if sign > 0.0 { p.tensile_strength } else { -p.compressive_strength };
            let state = State { hardening: 1.0, ..State::VIRGIN };
            let elastic = law.elasticity().strain(&Matrix3::from_diagonal(&[strength, 0.0, 0.0].into()));
            let mut point = Point::new(&law, 0.1);
            point.state = state;
            point.strain = elastic.diagonal();
            point.simple(elastic[(0, 0)] * 1.5);
            let plastic = point.state.plastic_tensor();
            let found = plastic[(1, 1)] / plastic[(0, 0)];
            // Absolute: one ratio is zero.
            assert!((found - ratio).abs() < EXACT, "{found} {ratio}");
        }
    }
}

/// In simple tension `σ = f_t exp(−w/w_f)` with the opening `w = h (ε_inelastic − that at the strength)`; the area is `G_f`, whatever
/// the element size.
#[test]
fn softening_in_tension_is_exponential_and_dissipates_the_fracture_energy() {
    let law = concrete();
    let p = *law.parameters();
    let opening = p.fracture_energy / p.tensile_strength;
    for size in [0.02, 0.1, 0.2] {
        let mut point = Point::new(&law, size);
        // To the strength and just beyond it.
        let mut strain = 0.0;
        while point.state.hardening < 1.0 {
            strain += 2e-7;
            point.simple(strain);
        }
        let plastic = |point: &Point| point.state.plastic_tensor()[(0, 0)];
        let onset = plastic(&point) - point.state.damage;
        let (mut energy, mut last) = (0.0, (0.0, p.tensile_strength));
        let end = strain + 12.0 * opening / size;
        let start = strain;
        let steps = 4000;
        for k in 1..=steps {
            strain = start + (end - start) * f64::from(k) / f64::from(steps);
            let update = point.simple(strain);
            let stress = update.stress[(0, 0)];
            let width = size * (strain - stress / p.young - onset);
            let wanted = p.tensile_strength * (-width / opening).exp();
            // Newton's method on the lateral stresses ends at 1e-13 of the compressive strength, 1e-12 of the tensile one.
            assert!((stress - wanted).abs() < 1e-9 * p.tensile_strength, "{size} {strain:e}: {stress:e} {wanted:e}");
            energy += 0.5 * (stress + last.1) * (width - last.0);
            last = (width, stress);
        }
        // exp(−12) is left, and the trapezoidal rule errs by (12/4000)²/12.
        assert!(relative(energy, p.fracture_energy) < 1e-5, "{size}: {energy}");
    }
}

/// An independent integration in simple compression: with the stress `−q f_c`, the axial plastic strain per hardening is a function of
/// `q` alone. The implicit steps converge to it with their number.
#[test]
fn strain_at_the_compressive_strength_is_an_integral() {
    for law in [concrete(), thesis()] {
        let p = *law.parameters();
        let (m, ratio) = (friction(&p), p.tensile_strength / p.compressive_strength);
        let a = 3.0 * ratio + 0.5 * m;
        let decay = -(1.0 + ratio) / 3.0 / (((1.0 + 2.0 * p.dilation) / (p.dilation - 1.0)) * (3.0 + 0.5 * m) / a).ln();
        let rate = |kappa: f64| {
            let q = law.hardening(kappa);
            let s = -q / 3.0;
            // B = 0 in simple compression, and X = q.
            let mean = q * q * a * ((s - ratio / 3.0) / decay).exp();
            let deviator = 2.0 * q * 1.5_f64.sqrt() + q * q * m / 6.0_f64.sqrt();
            let x = q / 3.0 - 1.0 / 3.0;
            let rise = p.compressive_ductility - p.tensile_ductility;
            let scale = rise * p.ductility_pressure / (p.confined_ductility - p.compressive_ductility);
            let ductility = rise * (x / scale).exp() + p.tensile_ductility;
            (mean / 3.0 - 2.0 * deviator / 6.0_f64.sqrt()) / (mean * mean / 3.0 + deviator * deviator).sqrt()
                * ductility
        };
        let n = 2000;
        let h = 1.0 / f64::from(n);
        let simpson: f64 = (0..n)
            .map(|k| {
                let x = f64::from(k) * h;
                h / 6.0 * (rate(x) + 4.0 * rate(x + 0.5 * h) + rate(x + h))
            })
            .sum();
        let run = |steps: i32| {
            let mut point = Point::new(&law, 0.1);
            let mut last = (0.0, 0.0);
            for k in 1.. {
                point.simple(-4e-3 * f64::from(k) / f64::from(steps));
                let now = (point.state.hardening, point.state.plastic_tensor()[(0, 0)]);
                if now.0 >= 1.0 {
                    let part = (1.0 - last.0) / (now.0 - last.0);
                    return last.1 + part * (now.1 - last.1);
                }
                last = now;
            }
            unreachable!()
        };
        let (coarse, fine) = (run(1000), run(2000));
        let errors = [(coarse - simpson).abs(), (fine - simpson).abs()];
        // First order in the step: half the error, up to the next order.
        assert!((1.8..2.2).contains(&(errors[0] / errors[1])), "{errors:?}");
        assert!(errors[1] < 2e-3 * simpson.abs(), "{simpson:e} {fine:e}");
    }
}
