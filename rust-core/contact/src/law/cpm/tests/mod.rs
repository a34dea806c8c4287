//! Single contacts driven by strains: stresses, damage, flow, viscosity, and validation.

mod energy;
mod fracture_energy;

use super::full_model::beta_residual;
use super::*;

/// Two unit spheres 2 m apart, bonded: A = π m², L = 2 m.
fn geometry() -> ContactGeometry {
    ContactGeometry {
        reference_length: 2.0,
        area: contact_area(1.0, 1.0),
        radius_a: 1.0,
        radius_b: 1.0,
        mass_a: 1.0,
        mass_b: 1.0,
    }
}

/// The reference material: Ē = 30 GPa, Ḡ/Ē = 0.2, c₀ = 3 MPa, tan φ = 0.8, ε₀ = 1e-4, ε_f/ε₀ = 30.
fn concrete() -> CpmParameters {
    CpmParameters::new(30e9, 0.2, 3e6, 0.8, 1e-4, 30.0)
}

fn law(parameters: CpmParameters) -> Cpm {
    Cpm::new(&parameters).expect("test parameters are valid")
}

/// Kinematics of a pair along x: strain from `from` to `to`, shear displacement `shear` (m) in this step.
fn straight(from: f64, to: f64, shear: Vec3, bonded: bool) -> PointKinematics {
    let geometry = geometry();
    let length = geometry.reference_length;
    PointKinematics {
        geometry,
        length: length * (1.0 + to),
        length_old: length * (1.0 + from),
        elongation: length * to,
        elongation_old: length * from,
        gap: length * to,
        normal: Vec3::x(),
        shear_increment: shear,
        arm_a: 1.0,
        arm_b: 1.0,
        bonded,
        transport: Transport::identity(Vec3::x()),
    }
}

/// A contact driven by strains; the stresses are forces divided by the area.
struct Bond {
    law: Cpm,
    state: CpmState,
    bonded: bool,
    normal_stress: f64,
    shear_stress: Vec3,
    energy: EnergySplit,
    status: Status,
    work: f64,
    dissipated: EnergySplit,
    dt: f64,
}

impl Bond {
    fn new(law: Cpm) -> Self {
        Self {
            law,
            state: CpmState::default(),
            bonded: true,
            normal_stress: 0.0,
            shear_stress: Vec3::zeros(),
            energy: EnergySplit::default(),
            status: Status::Lives,
            work: 0.0,
            dissipated: EnergySplit::default(),
            dt: 1.0,
        }
    }

    fn go(&mut self, strain: f64, shear_step: Vec3) -> f64 {
        let k = straight(self.state.normal_strain, strain, shear_step * 2.0, self.bonded);
        let (normal_old, shear_old, strain_old) = (self.normal_stress, self.shear_stress, self.state.normal_strain);
        let response = self.law.respond(&k, &self.state, self.dt);
        self.normal_stress = response.force.x / k.geometry.area;
        self.shear_stress = Vec3::new(0.0, response.force.y, response.force.z) / k.geometry.area;
        let volume = k.geometry.area * k.geometry.reference_length;
        self.work += 0.5
            * volume
            * ((normal_old + self.normal_stress) * (strain - strain_old)
                + (shear_old + self.shear_stress).dot(&shear_step));
        self.dissipated.damage += response.energy.damage;
        self.dissipated.friction += response.energy.friction;
        self.dissipated.viscous += response.energy.viscous;
        self.dissipated.integration += response.energy.integration;
        self.energy = response.energy;
        self.state = response.state;
        self.status = response.status;
        self.normal_stress
    }

    fn pull(&mut self, strain: f64) -> f64 {
        self.go(strain, Vec3::zeros())
    }

    fn imbalance(&self) -> f64 {
        let d = &self.dissipated;
        // A broken bond releases the energy that its `stored_*` fields name.
        let stored = if self.status == Status::Broke { 0.0 } else { self.energy.stored() };
        self.work - stored - d.damage - d.friction - d.viscous - d.integration
    }
}

fn close(a: f64, b: f64, relative: f64) {
    assert!((a - b).abs() <= relative * b.abs(), "{a:e} is not {b:e}");
}

/// Single-contact test of Stránský 2018, figures 2.6 and 2.7: stresses of the printed table to half a unit of their last
/// digit, (2.15)–(2.17) to rounding.
#[test]
fn single_bond_in_tension() {
    let law = law(CpmParameters::new(1e9, 1.0, 1e6, 0.5, 1e-4, 1.5));
    let table = [
        (1.0, 100000.0, 0.0),
        (1.1, 93550.70, 0.149539),
        (1.5, 71653.13, 0.522312),
        (2.0, 51341.71, 0.743291),
        (2.5, 36787.94, 0.852848),
        (2.8, 30119.42, 0.892431),
        (3.0, 26359.7, 0.912134),
    ];
    let mut bond = Bond::new(law);
    for (strain, stress, omega) in table {
        let strain = strain * 1e-4;
        let computed = bond.pull(strain);
        assert!((computed - stress).abs() < 0.051, "{computed} {stress}");
        assert!((bond.state.omega - omega).abs() < 5.1e-7);
        // 8 roundings of 1.1e-16, amplified by 1/(1−ω) ≤ 12.
        close(computed, 1e5 * (-(strain - 1e-4) / 1.5e-4).exp(), 1e-14);
    }
    // Cycle: unloading along the secant, full stiffness in compression.
    let mut bond = Bond::new(law);
    bond.pull(1.5e-4);
    assert!((bond.pull(0.3e-4) - 14330.63).abs() < 0.0051);
    assert!((bond.pull(2.8e-4) - 30119.42).abs() < 0.0051);
    close(bond.pull(-0.6e-4), -60000.0, 1e-15);
    assert_eq!(bond.status, Status::Lives);
}

/// A single bond gives the printed digits of YADE 2023.02a, and the closed forms to 1e-12.
#[test]
fn both_damage_laws_meet_the_reference() {
    let table = [
        (5e-5, 0.0, 1.5e6, 0.0, 1.5e6),
        (1e-4, 0.0, 3.0e6, 0.0, 3.0e6),
        (1.5e-4, 0.34482759, 2.94827586e6, 0.34435236, 2.95041436e6),
        (2e-4, 0.51724138, 2.89655172e6, 0.51639195, 2.90164830e6),
        (5e-4, 0.82758621, 2.58620690e6, 0.82496534, 2.62551996e6),
        (1e-3, 0.93103448, 2.06896552e6, 0.92591818, 2.22245466e6),
        (2e-3, 0.98275862, 1.03448276e6, 0.97345903, 1.59245835e6),
    ];
    for mode in [CpmFormulation::Thesis, CpmFormulation::YadePublic, CpmFormulation::Woo] {
        let linear = law(CpmParameters { mode, damage_law: DamageLaw::Linear, ..concrete() });
        let exponential = law(CpmParameters { mode, ..concrete() });
        let (mut first, mut second) = (Bond::new(linear), Bond::new(exponential));
        for (strain, omega_l, stress_l, omega_e, stress_e) in table {
            let l = first.pull(strain);
            let e = second.pull(strain);
            assert!((first.state.omega - omega_l).abs() < 5.1e-9 && (l - stress_l).abs() < 5.1e-3 * 1e0);
            assert!((second.state.omega - omega_e).abs() < 5.1e-9 && (e - stress_e).abs() < 5.1e-3 * 1e0);
            if strain > 1e-4 {
                close(l, 3e6 * (3e-3 - strain) / (3e-3 - 1e-4), 1e-12);
                close(e, 3e6 * (-(strain - 1e-4) / 3e-3).exp(), 1e-12);
            }
        }
    }
}

/// Linear damage ends at ε_f: the bond breaks there even with a threshold of 1.
#[test]
fn linear_damage_breaks_at_the_softening_strain() {
    for mode in [CpmFormulation::Thesis, CpmFormulation::YadePublic] {
        let mut bond = Bond::new(law(CpmParameters { mode, damage_law: DamageLaw::Linear, ..concrete() }));
        bond.pull(2.9e-3);
        assert_eq!(bond.status, Status::Lives);
        bond.pull(3.1e-3);
        assert_eq!(bond.status, Status::Broke);
        assert_eq!(bond.normal_stress, 0.0);
        assert_eq!(bond.state, CpmState::default());
    }
}

/// Damage takes all the work of pulling a bond apart: L A Ē ε₀(ε₀/2 + ε_f(1 − e^{-x})) plus the energy stored at the
/// break. The trapezoidal rule over n = 20000 equal steps of h = 1e-6 has an error of h²/(12 ε_f²) ≈ 1e-8 of the
/// softening part.
#[test]
fn a_broken_bond_has_dissipated_its_fracture_energy() {
    let threshold = 0.999;
    let law = law(CpmParameters { omega_threshold: threshold, ..concrete() });
    let mut bond = Bond::new(law);
    let mut strain = 0.0;
    while bond.status == Status::Lives {
        strain += 1e-6;
        bond.pull(strain);
    }
    let end = law.kappa_of_damage(threshold, 2.0).expect("in range");
    assert!((strain - end).abs() < 1.1e-6);
    let volume = 2.0 * std::f64::consts::PI;
    let expected = volume * 30e9 * 1e-4 * (0.5e-4 + 3e-3 * (1.0 - (-(strain - 1e-4) / 3e-3).exp()));
    close(bond.dissipated.damage, expected, 2e-8);
    close(bond.work, bond.dissipated.damage + bond.dissipated.integration, 1e-12);
    assert!(bond.dissipated.integration.abs() < 1e-3 * bond.dissipated.damage);
}

/// Plateau max(0, (1−ω)c₀ − σ_N tan φ) and unloading slope Ḡ, exact in one step of any size (thesis and YADE).
#[test]
fn shear_plateau_and_unloading() {
    for mode in [CpmFormulation::Thesis, CpmFormulation::YadePublic] {
        for strain in [-2e-4, 0.0, 0.5e-4, 3e-4] {
            let law = law(CpmParameters { mode, ..concrete() });
            let mut bond = Bond::new(law);
            let normal = bond.pull(strain);
            for _ in 0..5 {
                bond.go(strain, Vec3::new(0.0, 3e-4, 4e-4));
            }
            let plateau = ((1.0 - bond.state.omega) * 3e6 - normal * 0.8).max(0.0);
            // tan(atan 0.8) and a norm: a few roundings.
            assert!((bond.shear_stress.norm() - plateau).abs() <= 1e-14 * 3e6);
            if plateau > 0.0 {
                close(bond.shear_stress.y / bond.shear_stress.z, 0.75, 1e-14);
            }
            if mode == CpmFormulation::Thesis && plateau > 1e5 {
                let before = bond.shear_stress;
                let back = Vec3::new(0.0, -3e-6, -4e-6);
                bond.go(strain, back);
                let change = (bond.shear_stress - before).norm();
                close(change, 6e9 * 5e-6, 1e-12);
            }
        }
    }
}

/// YADE's plastic increment is s(1−s)σ_trial/Ḡ: after one step of twice the yield stress, half of the exact one.
#[test]
fn yade_slip_quirk_is_reproduced() {
    let plastic = |mode| {
        let mut bond = Bond::new(law(CpmParameters { mode, ..concrete() }));
        bond.go(0.0, Vec3::new(0.0, 1e-3, 0.0));
        (bond.shear_stress.y, bond.state.plastic_shear_strain.y)
    };
    let (exact_stress, exact) = plastic(CpmFormulation::Thesis);
    let (yade_stress, yade) = plastic(CpmFormulation::YadePublic);
    close(exact_stress, 3e6, 1e-15);
    close(yade_stress, 3e6, 1e-15);
    close(exact, 5e-4, 1e-14);
    close(yade, 2.5e-4, 1e-14);
}

/// Woo's shear stress follows the total strain, so unloading recovers slip; in the thesis formulation it does not.
#[test]
fn woo_shear_has_no_memory() {
    let back = |mode| {
        let mut bond = Bond::new(law(CpmParameters { mode, ..concrete() }));
        bond.go(0.0, Vec3::new(0.0, 8e-4, 0.0));
        bond.go(0.0, Vec3::new(0.0, -4e-4, 0.0));
        bond.shear_stress.y
    };
    close(back(CpmFormulation::Woo), 6e9 * 4e-4, 1e-14);
    close(back(CpmFormulation::Thesis), 6e9 * (5e-4 - 4e-4), 1e-12);
}

/// Each yield surface against its formula and its zero; the third also for smoothness at σ_N = 0.
#[test]
fn yield_surfaces() {
    let (c, t, v): (f64, f64, f64) = (3e6, 0.8, 0.1);
    let surface = |yield_surface| law(CpmParameters { yield_surface, yield_log_speed: v, ..concrete() });
    for omega in [0.0, 0.3, 1.0] {
        for s in [-1e9, -3e7, -1e6, -1.0, 0.0, 1.0, 2e5, 1e6, 1e7] {
            let expected = [
                c * (1.0 - omega) - s * t,
                (c * c - 2.0 * c * t * s).max(0.0).sqrt() - c * omega,
                if s / (c * v) >= 1.0 { 0.0 } else { c * ((1.0 - omega) + t * v * (1.0 - s / (c * v)).ln()) },
            ];
            let check = |yield_surface, expected: f64| {
                let y = surface(yield_surface).yield_stress(s, omega);
                // Rounding of terms as large as |σ_N| t and c.
                assert!((y - expected.max(0.0)).abs() <= 1e-15 * (s.abs() + 4.0 * c), "{yield_surface:?} {s} {y}");
            };
            check(YieldSurface::MohrCoulomb, expected[0]);
            check(YieldSurface::Parabolic, expected[1]);
            check(YieldSurface::Logarithmic, expected[2]);
            check(YieldSurface::LogarithmicLinear, expected[if s > 0.0 { 0 } else { 2 }]);
        }
    }
    // Derivative −tan φ on both sides of 0; one-sided differences of h = 1 Pa are off by h/(2 c v) = 2e-6.
    let f = |s| surface(YieldSurface::LogarithmicLinear).yield_stress(s, 0.2);
    assert!((f(0.0) - f(-1.0) + t).abs() < 2e-6);
    assert!((f(1.0) - f(0.0) + t).abs() < 1e-8);
    // High confinement: the logarithm must stay far below the line.
    assert!(surface(YieldSurface::LogarithmicLinear).yield_stress(-4e8, 0.0) < 0.02 * 3.2e8);
}

/// Residual of the equation of β at its solution, over 20 decades of c; closed form for exponent 1.
#[test]
fn beta_solves_its_equation() {
    for n in [0.05, 0.1, 0.3, 0.5, 1.0, 1.7, 3.0] {
        for decade in -10..=10 {
            let ln_c = f64::from(decade) * 10.0_f64.ln();
            let beta = solve_beta(ln_c, n);
            assert!(beta <= 0.0);
            let residual = beta_residual(beta, ln_c, n).0;
            assert!(residual.abs() <= 1e-12, "n {n} decade {decade}: {residual:e}");
            if n == 1.0 {
                close(beta, -libm::log1p(ln_c.exp()), 1e-13);
            }
        }
    }
    assert_eq!(solve_beta(f64::NEG_INFINITY, 0.3), 0.0);
}

fn viscous(mode: CpmFormulation) -> CpmParameters {
    CpmParameters {
        mode,
        damage_time: 1.0,
        damage_rate_exponent: 0.3,
        plasticity_time: 2.0,
        plasticity_rate_exponent: 0.4,
        ..concrete()
    }
}

/// Slow loading gives the law without viscosity, fast loading the elastic law, in both directions.
///
/// Slow, Δt = 1e30 s: c = ε₀(1−ω)/Δt^0.3 (..)^(−0.7) ≈ 1e-9, the overstress that fraction of the stress. Fast,
/// Δt = 1e-60 s: eᵝ = c^(−1/M) is below 1e-50.
#[test]
fn rate_limits() {
    for mode in [CpmFormulation::Thesis, CpmFormulation::Woo] {
        let run = |dt, parameters| {
            let mut bond = Bond::new(law(parameters));
            bond.dt = dt;
            // In tension no shear strength is left, so slip comes first.
            bond.go(0.0, Vec3::new(0.0, 1e-3, 0.0));
            let shear = bond.shear_stress.y;
            bond.pull(4e-4);
            (bond.normal_stress, shear, bond.state.omega)
        };
        let inviscid = run(1.0, CpmParameters { mode, ..concrete() });
        let slow = run(1e30, viscous(mode));
        let fast = run(1e-60, viscous(mode));
        let medium = run(1e-3, viscous(mode));
        close(slow.0, inviscid.0, 1e-6);
        close(slow.1, inviscid.1, 1e-6);
        close(fast.0, 30e9 * 4e-4, 1e-14);
        close(fast.1, 6e9 * 1e-3, 1e-14);
        assert!(medium.0 > 1.01 * inviscid.0 && medium.0 < 0.99 * fast.0);
        assert!(medium.1 > 1.01 * inviscid.1 && medium.1 < 0.99 * fast.1);
        assert_eq!(slow.2, fast.2);
    }
}

/// Relaxation at constant strain, exponent 1. The distance x = ωe − ε_d obeys ẋ = −x/((1−ω)ε₀τ), in backward Euler
/// steps x_k = x_0/(1 + Δt/((1−ω)ε₀τ))^k exactly; x_0 after the first step from the same formula.
#[test]
fn stress_relaxation_of_damage() {
    let tau = 1e4;
    let p = CpmParameters { damage_time: tau, damage_rate_exponent: 1.0, ..concrete() };
    let mut bond = Bond::new(law(p));
    bond.dt = 1e-3;
    let strain = 5e-4;
    bond.pull(strain);
    let omega = bond.state.omega;
    let ratio = 1.0 / (1.0 + bond.dt / ((1.0 - omega) * 1e-4 * tau));
    for step in 1..=1000 {
        let expected = 30e9 * ((1.0 - omega) * strain + omega * strain * ratio.powi(step));
        // Each step rounds the distance a few times: 1000·4·1.1e-16.
        close(bond.normal_stress, expected, 5e-13);
        bond.pull(strain);
    }
    // The differential equation: backward Euler is off by t Δt/(2 T²) with T = 0.175 s, here 1.6e-2.
    let time_constant = (1.0 - omega) * 1e-4 * tau;
    let exact = (1.0 - omega) * strain + omega * strain * (-1000.0 * bond.dt / time_constant).exp();
    close(bond.normal_stress, 30e9 * exact, 2e-2);
}

/// Relaxation of slip at constant shear strain, exponent 1: |σ_T| − y decays by 1/(1 + ḠΔt/(c₀τ)) per step.
#[test]
fn stress_relaxation_of_slip() {
    let tau = 5.0;
    let p = CpmParameters { plasticity_time: tau, plasticity_rate_exponent: 1.0, ..concrete() };
    let mut bond = Bond::new(law(p));
    bond.dt = 1e-5;
    bond.go(0.0, Vec3::new(0.0, 1e-3, 0.0));
    let ratio = 1.0 / (1.0 + 6e9 * bond.dt / (3e6 * tau));
    for step in 1..=1000 {
        let expected = 3e6 + (6e6 - 3e6) * ratio.powi(step);
        close(bond.shear_stress.y, expected, 5e-13);
        bond.pull(0.0);
    }
    assert!(bond.dissipated.viscous > 0.0 && bond.dissipated.friction > 0.0);
    assert!(bond.imbalance().abs() <= 1e-13 * bond.work);
}

/// The plastic branch in compression has the slope K̃Ē for any step size (thesis); YADE's slope depends on the step
/// size.
#[test]
fn compression_plasticity() {
    let slope = |mode, steps: i32| {
        let p = CpmParameters { mode, soft_strain: -1e-3, relative_soft_stiffness: 0.3, ..concrete() };
        let mut bond = Bond::new(law(p));
        for step in 1..=steps {
            bond.pull(-3e-3 * f64::from(step) / f64::from(steps));
        }
        assert!(bond.imbalance().abs() < 1e-12 * bond.work);
        let end = bond.normal_stress;
        let unloaded = bond.pull(-2.9e-3);
        close(unloaded - end, 30e9 * 1e-4, 1e-11);
        (end - 30e9 * -1e-3) / (30e9 * -2e-3)
    };
    for steps in [3, 300] {
        close(slope(CpmFormulation::Thesis, steps), 0.3, 1e-12);
        close(slope(CpmFormulation::Woo, steps), 0.3, 1e-12);
    }
    // YADE: e − ε_s → K̃(e + Δε − ε_s), which settles at K̃/(1−K̃) Δε: perfectly plastic for small steps
    close(slope(CpmFormulation::YadePublic, 3000), 0.3 / 0.7 * 1e-6 / 2e-3, 1e-6);
}

/// Confinement shifts the origin: no force at rest, slope Ē, and a Mohr–Coulomb radius larger by |σ₀| tan φ.
#[test]
fn isotropic_prestress() {
    for mode in [CpmFormulation::Thesis, CpmFormulation::YadePublic] {
        let mut bond = Bond::new(law(CpmParameters { mode, isotropic_prestress: -5e6, ..concrete() }));
        assert!(bond.pull(0.0).abs() < 1e-8);
        close(bond.pull(1e-4), 30e9 * 1e-4, 1e-14);
        bond.pull(0.0);
        bond.go(0.0, Vec3::new(0.0, 5e-3, 0.0));
        close(bond.shear_stress.y, 3e6 + 0.8 * 5e6, 1e-14);
        assert!(bond.imbalance().abs() < 1e-13 * bond.work);
    }
    // Beyond the plastic limit the shift follows the plastic branch.
    let p =
        CpmParameters { isotropic_prestress: -60e6, soft_strain: -1e-3, relative_soft_stiffness: 0.5, ..concrete() };
    let mut bond = Bond::new(law(p));
    assert!(bond.pull(0.0).abs() < 1e-7);
    close(bond.pull(1e-4), 30e9 * 1e-4, 1e-11);
}

/// An unbonded contact has friction only, no tension, and ends when it opens.
#[test]
fn unbonded_contact() {
    for mode in [CpmFormulation::Thesis, CpmFormulation::YadePublic, CpmFormulation::Woo] {
        let mut bond = Bond::new(law(CpmParameters { mode, ..concrete() }));
        bond.bonded = false;
        close(bond.pull(-1e-4), -3e6, 1e-15);
        assert_eq!(Cpm::damage(&bond.state), 0.0);
        bond.go(-1e-4, Vec3::new(0.0, 5e-3, 0.0));
        close(bond.shear_stress.y, 0.8 * 3e6, 1e-15);
        bond.pull(1e-5);
        assert_eq!((bond.status, bond.normal_stress, bond.shear_stress), (Status::Opened, 0.0, Vec3::zeros()));
        assert!(bond.imbalance().abs() < 1e-13 * bond.work.abs(), "{mode:?} {}", bond.imbalance());
    }
}

/// Doubling Ē and c₀ doubles every stress, to the last bit.
#[test]
fn stresses_scale_with_stiffness_and_cohesion() {
    let p = CpmParameters { soft_strain: -3e-4, relative_soft_stiffness: 0.2, ..concrete() };
    let mut one = Bond::new(law(p));
    let mut two = Bond::new(law(CpmParameters { young: 60e9, cohesion: 6e6, ..p }));
    for (strain, shear) in [(1e-4, 1e-4), (3e-4, 2e-4), (-5e-4, 1e-3), (1e-3, -1e-3), (2e-4, 1e-4)] {
        let step = Vec3::new(0.0, shear, 0.3 * shear);
        one.go(strain, step);
        two.go(strain, step);
        assert_eq!(2.0 * one.normal_stress, two.normal_stress);
        assert_eq!(one.shear_stress * 2.0, two.shear_stress);
    }
}

/// The inverses: g(g⁻¹(ω)) = ω to a few roundings, and the same for ω̂; and the definition (6.6).
#[test]
fn damage_functions_and_their_inverses() {
    for damage_law in [DamageLaw::Linear, DamageLaw::Exponential] {
        for ductility in [1.5, 30.0, 1e4] {
            let law = law(CpmParameters { damage_law, relative_ductility: ductility, ..concrete() });
            for omega in [1e-12, 1e-6, 0.01, 0.1, 0.5, 0.9, 0.999, 1.0 - 1e-9] {
                let kappa = law.kappa_of_damage(omega, 2.0).expect("in range");
                // The derivative dω/dκ·κ is at most 1+ε₀/ε_f times (1−ω)+…, so errors stay roundings of 1.
                assert!((law.damage_function(kappa, 2.0) - omega).abs() < 4e-16 * (1.0 + ductility / 1e4));
                let hat = law.strength_damage(kappa, 2.0);
                let definition = 1.0 - (1.0 - law.damage_function(kappa, 2.0)) * kappa / 1e-4;
                // The definition cancels: 1 − (1−ω)κ/ε₀ loses κ/ε₀ roundings.
                assert!((hat - definition).abs() < 4e-16 * (1.0 + kappa / 1e-4), "{hat} {definition}");
                assert!((law.relative_residual_strength(kappa, 2.0) - (1.0 - hat)).abs() == 0.0);
                let again = law.kappa_of_strength_damage(omega, 2.0).expect("in range");
                assert!((law.strength_damage(again, 2.0) - omega).abs() < 1e-15 * (1.0 + 1.0 / ductility) * 2.0);
            }
            assert_eq!(law.damage_function(0.99e-4, 2.0), 0.0);
            assert_eq!(law.strength_damage(0.5e-4, 2.0), 0.0);
            assert_eq!(law.relative_residual_strength(0.5e-4, 2.0), 1.0);
            assert_eq!(law.kappa_of_damage(0.0, 2.0).expect("in range"), 1e-4);
            assert!(law.kappa_of_damage(1.1, 2.0).is_err() && law.kappa_of_damage(f64::NAN, 2.0).is_err());
            assert!(law.kappa_of_strength_damage(-0.1, 2.0).is_err());
            let state = law.damaged_state(0.5, 2.0).expect("in range");
            assert_eq!(law.respond(&straight(0.0, 1e-6, Vec3::zeros(), true), &state, 1.0).state.omega, 0.5);
        }
    }
}

#[test]
fn parameters_are_checked() {
    let bad = [
        CpmParameters { young: 0.0, ..concrete() },
        CpmParameters { young: f64::NAN, ..concrete() },
        CpmParameters { friction_coefficient: -0.1, ..concrete() },
        CpmParameters { crack_onset_strain: -1e-4, ..concrete() },
        CpmParameters { damage_law: DamageLaw::Linear, relative_ductility: 1.0, ..concrete() },
        CpmParameters { cohesion: 0.0, yield_surface: YieldSurface::Logarithmic, ..concrete() },
        CpmParameters { damage_time: 1.0, damage_rate_exponent: 0.0, ..concrete() },
    ];
    for p in bad {
        assert!(matches!(Cpm::new(&p), Err(CpmError::OutOfRange { .. })), "{p:?}");
    }
    let yade = CpmParameters { mode: CpmFormulation::YadePublic, damage_time: 1.0, ..concrete() };
    assert_eq!(Cpm::new(&yade), Err(CpmError::NotInYade { name: "damage_time" }));
    let soft = CpmParameters { young: 10e9, friction_coefficient: 0.3, never_damage: true, ..concrete() };
    let mean = concrete().average(&soft).expect("alike");
    assert_eq!((mean.young, mean.shear_modulus(), mean.never_damage), (20e9, 0.2 * 20e9, true));
    let linear = CpmParameters { damage_law: DamageLaw::Linear, ..concrete() };
    assert_eq!(concrete().average(&linear), Err(CpmError::Unlike { name: "damage_law" }));
}

/// The thesis formulation and Woo's accept all options; YADE's rejects them.
#[test]
fn options_belong_to_formulations() {
    type Set = fn(&mut CpmParameters);
    let options: [(&str, Set); 4] = [
        ("yield_surface", |p| p.yield_surface = YieldSurface::Parabolic),
        ("yield_surface", |p| p.yield_surface = YieldSurface::LogarithmicLinear),
        ("damage_time", |p| p.damage_time = 1.0),
        ("plasticity_time", |p| p.plasticity_time = 1.0),
    ];
    for (name, set) in options {
        for mode in [CpmFormulation::Thesis, CpmFormulation::YadePublic, CpmFormulation::Woo] {
            let mut parameters = CpmParameters { mode, ..concrete() };
            set(&mut parameters);
            let refused = mode == CpmFormulation::YadePublic;
            let expected = if refused { Err(CpmError::NotInYade { name }) } else { Ok(()) };
            assert_eq!(mode.has_full_model(), !refused);
            assert_eq!(parameters.validate(), expected, "{mode:?}");
            assert_eq!(Cpm::new(&parameters).is_err(), refused, "{mode:?}");
        }
    }
}

/// A bond whose damage has passed the threshold holds as long as its crack is closed, and breaks when it opens; its lost strength is
/// `1 − (1−ω)κ/ε₀`, less than the loss of stiffness.
#[test]
fn a_closed_crack_does_not_break() {
    let law = law(CpmParameters { omega_threshold: 0.9, ..concrete() });
    let old = law.damaged_state(0.95, 2.0).unwrap();
    for (strain, expected) in [(-1e-5, Status::Lives), (1e-5, Status::Broke)] {
        let answer = law.respond(&straight(0.0, strain, Vec3::zeros(), true), &old, 1.0);
        assert_eq!(answer.status, expected, "{strain}");
    }
    let expected = 1.0 - (1.0 - 0.95) * old.kappa / 1e-4;
    // The inverse of the damage function is exact to some roundings.
    assert!(
        (law.lost_strength(Reference { length: 2.0, area: 1.0 }, &old) - expected).abs() < 1e-13 && expected < 0.9,
        "{expected}"
    );
}
