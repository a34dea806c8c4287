//! The consistent tangent against differences of the stress, in every branch of the return.

mod shared;

use concordem_continuum::{DamagePlastic, State, voigt};
use nalgebra::{Matrix3, Matrix6, Vector6};
use shared::{Random, concrete, thesis};

/// Differences of fourth order.
fn differences(law: &DamagePlastic, strain: &Matrix3<f64>, state: &State, size: f64, step: f64) -> Matrix6<f64> {
    let mut result = Matrix6::zeros();
    for column in 0..6 {
        let mut unit = Vector6::zeros();
        unit[column] = if column < 3 { 1.0 } else { 0.5 };
        let unit = voigt::tensor(&unit);
        let stress = |factor: f64| {
            voigt::components(&law.update(&(strain + unit * (factor * step)), state, size).unwrap().stress)
        };
        let difference = (stress(1.0) - stress(-1.0)) * (8.0 / 12.0) - (stress(2.0) - stress(-2.0)) / 12.0;
        result.set_column(column, &(difference / step));
    }
    result
}

fn check(law: &DamagePlastic, strain: &Matrix3<f64>, state: &State, what: &str) {
    let size = 0.1;
    let update = law.update(strain, state, size).unwrap();
    // Rounding of stresses over the step, 1e-15 · 1e8 Pa/1e-9, is 1e-9 of the stiffness; near the hydrostatic axis the Lode angle
    // turns within strains of 1e-6, which leaves 1e-8 of truncation.
    let reference = differences(law, strain, state, size, 1e-9);
    // Near the hydrostatic axis the Lode angle, and with it the hardening, turns so fast that tangents exceed the stiffness.
    let error = (update.tangent - reference).norm() / (law.elasticity().stiffness().norm() + reference.norm());
    assert!(error < 2e-7, "{what}: error {error:e}\nstrain {strain}\nstate {state:?}\n{}{}", update.tangent, reference);
}

/// States that a path of random strains leaves behind.
fn states(law: &DamagePlastic, random: &mut Random) -> Vec<State> {
    let mut states = vec![State::VIRGIN];
    for _ in 0..6 {
        let direction = random.symmetric() - Matrix3::identity() * (0.6 + 0.4 * random.next());
        let mut state = State::VIRGIN;
        let amplitude = 10_f64.powf(-3.5 + 0.7 * random.next());
        for k in 1..=5 {
            state = law.update(&(direction * (amplitude * f64::from(k) / 5.0)), &state, 0.1).unwrap().state;
        }
        states.push(state);
    }
    states
}

#[test]
fn tangent_is_the_derivative_of_the_stress_for_random_strains() {
    let mut random = Random(7);
    let (mut hardening, mut damaging) = (0, 0);
    for law in [concrete(), thesis()] {
        for state in states(&law, &mut random) {
            for _ in 0..40 {
                let amplitude = 10_f64.powf(-3.7 + 0.8 * random.next());
                let pressure = Matrix3::identity() * (0.8 * random.next() - 0.3);
                let strain = state.plastic_tensor() + (random.symmetric() - pressure) * amplitude;
                let next = law.update(&strain, &state, 0.1).unwrap();
                // Differences across the yield surface or the onset of damage have no meaning.
                let near = |value: f64, limit: f64| (value - limit).abs() < 1e-3;
                if next.state.hardening - state.hardening < 1e-3 || near(next.state.hardening, 1.0) {
                    continue;
                }
                if next.damage > 0.0 {
                    damaging += 1;
                } else {
                    hardening += 1;
                }
                check(&law, &strain, &state, "random");
            }
        }
    }
    assert!(hardening > 20 && damaging > 50, "{hardening} {damaging}");
}

#[test]
fn tangent_holds_at_the_vertices() {
    for law in [concrete(), thesis()] {
        let shear = Matrix3::new(0.3, 0.2, -0.1, 0.2, -0.5, 0.4, -0.1, 0.4, 0.2);
        // The cone of the vertex in tension ends the step on the axis.
        for volume in [2e-4, 1e-3] {
            let strain = Matrix3::identity() * volume + shear * (0.02 * volume);
            let update = law.update(&strain, &State::VIRGIN, 0.1).unwrap();
            let deviator = update.stress - Matrix3::identity() * (update.stress.trace() / 3.0);
            assert!(deviator.norm() < 1e-12 * update.stress.norm(), "{}", update.stress);
            check(&law, &strain, &State::VIRGIN, "vertex in tension");
        }
        // On the cap.
        let strength = law.parameters().compressive_strength / law.elasticity().bulk;
        let strain = -Matrix3::identity() * (0.9 * strength) + shear * (0.001 * strength);
        let update = law.update(&strain, &State::VIRGIN, 0.1).unwrap();
        assert!(update.state.hardening > 0.0 && update.state.hardening < 1.0);
        let deviator = update.stress - Matrix3::identity() * (update.stress.trace() / 3.0);
        assert!(deviator.norm() < 1e-12 * update.stress.norm(), "{}", update.stress);
        check(&law, &strain, &State::VIRGIN, "cap");
    }
}

/// In simple compression two principal stresses are equal, and `cos θ` has a kink; by symmetry the mean of both sides counts, for
/// which differences of second order stand here.
#[test]
fn tangent_holds_in_simple_tension_and_on_a_step_across_the_onset_of_damage() {
    let law = concrete();
    let state = State { hardening: 0.9, ..State::VIRGIN };
    for axial in [3e-4, 1e-3] {
        let strain = Matrix3::from_diagonal(&[axial, -0.2 * axial, -0.2 * axial].into());
        let update = law.update(&strain, &state, 0.1).unwrap();
        assert!(update.damage > 0.0);
        check(&law, &strain, &state, "across the onset");
    }
}

#[test]
fn elastic_tangent_is_the_damaged_stiffness() {
    let law = concrete();
    let state = State { hardening: 1.5, damage: 1e-4, ..State::VIRGIN };
    let update = law.update(&(Matrix3::identity() * -1e-5), &state, 0.1).unwrap();
    assert!(update.damage > 0.1, "{}", update.damage);
    assert_eq!(update.tangent, law.elasticity().stiffness() * (1.0 - update.damage));
}
