//! Pairs of softening beams in a run: what they dissipate, by the ledger.

use concordem::scatter::{Distribution, Scatter};
use concordem_tests::pairs::PulledPairs;
use concordem_tests::runs::run;

/// Pairs whose strengths scatter take the same energy to break, whatever their strength. Tolerance: the square of a step at the kink of the
/// onset, some 200 steps after the start.
#[test]
fn beams_of_any_strength_dissipate_their_fracture_energy() {
    let (count, energy) = (20, 40.0);
    let area = std::f64::consts::PI * 1e-6;
    for softening in ["linear", "exponential"] {
        let material = &format!(
            "softening_beam = {{ young = 1e9, radius_ratio = 1, tensile_strength = 4e6, fracture_energy = {energy:?}, \
             softening = \"{softening}\" }}\nstrength_scatter = {{ weibull_modulus = 8, seed = 3 }}"
        );
        // Onset at 8 µm; linear beams have broken after some 20 µm, exponential ones after 100 µm.
        let steps = 3_000;
        let text = PulledPairs { count, law: "softening_beam", material, time_step: 4e-5, steps }.scenario();
        let simulation = run(&text);
        assert_eq!(simulation.state.broken.len(), count, "{softening}");
        let ledger = &simulation.state.ledger;
        let dissipated = (ledger.damage.get() + ledger.integration.get()) / (count as f64 * energy * area);
        assert!((dissipated - 1.0).abs() < 1e-4, "{softening}: {dissipated}");
        // The strengths did scatter.
        let scatter = Scatter { seed: 3, distribution: Distribution::weibull(8.0, None) };
        let factors: Vec<f64> = (0..count as u32).map(|k| scatter.factor([2 * k, 2 * k + 1], area)).collect();
        let spread = factors.iter().fold(0.0_f64, |most, factor| most.max((factor - 1.0).abs()));
        assert!(spread > 0.1, "{spread}");
    }
}
