//! Large steps, invariances, saved states, refused input.

mod shared;

use concordem_continuum::{ContinuumError, DamagePlastic, Parameters, State};
use nalgebra::{Matrix3, Rotation3, Vector3};
use shared::{Point, Random, concrete, thesis};

/// Random paths with strain steps from 1e-5 to 0.03: every step is solved, the effective stress lies on or inside the surface, and
/// no step gains energy.
#[test]
fn every_step_of_random_paths_is_solved() {
    let mut random = Random(3);
    for law in [concrete(), thesis()] {
        for path in 0..400 {
            let amplitude = 10_f64.powf(-3.2 + 1.7 * random.next());
            let mut state = State::VIRGIN;
            let mut strain = Matrix3::zeros();
            for step in 0..6 {
                let pressure = Matrix3::identity() * random.next();
                strain += (random.symmetric() + pressure) * amplitude;
                let update = law
                    .update(&strain, &state, 0.1)
                    .unwrap_or_else(|error| panic!("path {path} step {step}: {error}\n{strain}{state:?}"));
                let next = update.state;
                assert!(next.hardening >= state.hardening && next.damage >= state.damage);
                // Elastic strain and stress of the new state: the stored plastic strain gives the returned stress.
                let effective = law.elasticity().stress(&(strain - next.plastic_tensor()));
                let again = law.update(&strain, &next, 0.1).unwrap();
                assert_eq!(again.state, next, "path {path} step {step}: the result lies outside the surface");
                // Rounding of the trial stress.
                let scale = law.elasticity().stress(&strain).norm() + 1e5;
                assert!((effective * (1.0 - update.damage) - update.stress).norm() < 1e-13 * scale, "path {path}");
                // Plastic dissipation σ̄ : Δε_p.
                let plastic = next.plastic_tensor() - state.plastic_tensor();
                assert!(effective.component_mul(&plastic).sum() >= -1e-9 * scale * plastic.norm(), "path {path}");
                state = next;
            }
        }
    }
}

/// Rotated strain and state give the rotated stress, and the same scalars.
#[test]
fn law_is_isotropic() {
    let law = concrete();
    let mut random = Random(5);
    for _ in 0..100 {
        let rotation =
            Rotation3::from_scaled_axis(Vector3::new(random.next(), random.next(), random.next()) * 3.0).into_inner();
        let turned = |t: &Matrix3<f64>| rotation * t * rotation.transpose();
        let first = (random.symmetric() - Matrix3::identity() * 0.3) * 1e-3;
        let second = first + random.symmetric() * 5e-4;
        let one = law.update(&first, &State::VIRGIN, 0.1).unwrap();
        let two = law.update(&second, &one.state, 0.1).unwrap();
        let one_turned = law.update(&turned(&first), &State::VIRGIN, 0.1).unwrap();
        let two_turned = law.update(&turned(&second), &one_turned.state, 0.1).unwrap();
        // Rounding 1e-16 of strains of 1e-3, through hardening in tension with its slope of 3e4.
        assert!((turned(&two.stress) - two_turned.stress).norm() < 1e-9 * 3e6, "{}", two.stress);
        assert!((two.damage - two_turned.damage).abs() < 1e-10);
    }
}

/// States as reals and as text come back to the last bit, and the run goes on with the same bits.
#[test]
fn saved_states_continue_bit_by_bit() {
    let law = thesis();
    let mut point = Point::new(&law, 2.0);
    for k in 1..=60 {
        point.simple(-5e-5 * f64::from(k));
        let text = serde_json::to_string(&point.state).unwrap();
        let read: State = serde_json::from_str(&text).unwrap();
        assert_eq!(read.to_reals().map(f64::to_bits), point.state.to_reals().map(f64::to_bits));
        assert_eq!(State::from_reals(&point.state.to_reals()), point.state);
        let strain = Matrix3::from_diagonal(&(point.strain * 1.1));
        let (one, two) = (law.update(&strain, &point.state, 2.0).unwrap(), law.update(&strain, &read, 2.0).unwrap());
        assert_eq!(one.stress.map(f64::to_bits), two.stress.map(f64::to_bits));
        assert_eq!(one.tangent.map(f64::to_bits), two.tangent.map(f64::to_bits));
    }
    assert!(point.state.damage > 0.0);
}

#[test]
fn bad_parameters_and_states_are_refused_by_name() {
    let good = Parameters::new(30e9, 0.2, 30e6, 3e6, 100.0);
    let bad = [
        (Parameters { young: 0.0, ..good }, "young"),
        (Parameters { poisson: 0.5, ..good }, "poisson"),
        (Parameters { compressive_strength: -30e6, ..good }, "compressive_strength"),
        (Parameters { tensile_strength: 31e6, ..good }, "tensile_strength"),
        // f_c/f_t = 60: the friction of the surface leaves its flow rule undefined near the cap.
        (Parameters { tensile_strength: 0.5e6, ..good }, "tensile_strength"),
        (Parameters { fracture_energy: f64::NAN, ..good }, "fracture_energy"),
        (Parameters { eccentricity: 0.5, ..good }, "eccentricity"),
        (Parameters { initial_hardening: 1.0, ..good }, "initial_hardening"),
        (Parameters { confined_ductility: 0.002, ..good }, "confined_ductility"),
        (Parameters { compressive_ductility: 1e-7, ..good }, "compressive_ductility"),
        (Parameters { dilation: 0.85, ..good }, "dilation"),
        (Parameters { softening_ductility: -1.0, ..good }, "softening_ductility"),
    ];
    for (parameters, wanted) in bad {
        match DamagePlastic::new(parameters) {
            Err(ContinuumError::Parameter { name, .. }) => assert_eq!(name, wanted),
            other => panic!("{wanted}: {other:?}"),
        }
    }
    let law = DamagePlastic::new(good).unwrap();
    let zero = Matrix3::zeros();
    // E G_f/f_t² = 1/3 m.
    let error = law.update(&zero, &State::VIRGIN, 0.34).unwrap_err().to_string();
    assert!(error.contains("size is 3.4e-1") && error.contains("3.33"), "{error}");
    assert_eq!(
        law.update(&zero.map(|_| f64::NAN), &State::VIRGIN, 0.1),
        Err(ContinuumError::NotFinite { what: "strain" })
    );
    let broken = State { hardening: 0.5, damage: 1e-3, ..State::VIRGIN };
    assert!(matches!(law.update(&zero, &broken, 0.1), Err(ContinuumError::State { .. })));
    let broken = State { hardening: -0.5, ..State::VIRGIN };
    assert!(matches!(law.update(&zero, &broken, 0.1), Err(ContinuumError::State { .. })));
}
