//! Searches for the beam parameters that give target elastic constants.

use super::error::CalibrationError;
use super::response::{CylinderLoad, CylinderResponse, elastic};
use super::specimen::CylinderSpecimen;
use concordem_contact::law::{CohesiveBeam, Section};

/// Range of the radius ratio in the search.
const RATIOS: [f64; 2] = [0.2, 1.2];

/// Beam parameters that give a specimen its target elastic constants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElasticMatch {
    /// The beam, without strength.
    pub beam: CohesiveBeam,
    /// Response of the specimen in tension.
    pub achieved: CylinderResponse,
    /// Number of static solutions computed.
    pub evaluations: u32,
}

/// Finds `r̃` for the target Poisson's ratio, then `E_μ` for the target Young's modulus (Pa); `poisson_beam` is `ν_μ`.
/// `progress` receives the radius ratio and Poisson's ratio of each trial.
///
/// # Errors
/// The target Poisson's ratio is out of reach, or a static solution failed.
pub fn match_elastic(
    sample: &CylinderSpecimen,
    young: f64,
    poisson: f64,
    poisson_beam: f64,
    progress: &mut dyn FnMut(f64, f64),
) -> Result<ElasticMatch, CalibrationError> {
    /// Largest error of Poisson's ratio.
    const TOLERANCE: f64 = 5e-4;
    let mut evaluations = 0;
    let mut evaluate = |ratio: f64| -> Result<(CohesiveBeam, CylinderResponse), CalibrationError> {
        let beam = CohesiveBeam::new(young, poisson_beam, Section::Ratio(ratio))?;
        let response = elastic(sample, &beam, CylinderLoad::Tension)?;
        evaluations += 1;
        progress(ratio, response.poisson);
        Ok((beam, response))
    };
    // Poisson's ratio decreases with the radius ratio: false position with halving (Illinois method).
    let [mut low, mut high] = RATIOS;
    let (mut at_low, mut at_high) = (evaluate(low)?.1.poisson - poisson, evaluate(high)?.1.poisson - poisson);
    if at_low < 0.0 || at_high > 0.0 {
        return Err(CalibrationError::Poisson {
            wanted: poisson,
            low,
            high,
            at_low: at_low + poisson,
            at_high: at_high + poisson,
        });
    }
    let (beam, response) = loop {
        let ratio = (low * at_high - high * at_low) / (at_high - at_low);
        let (beam, response) = evaluate(ratio)?;
        let error = response.poisson - poisson;
        if error.abs() < TOLERANCE || high - low < 1e-6 {
            break (beam, response);
        }
        if error > 0.0 {
            (low, at_low) = (ratio, error);
            at_high *= 0.5;
        } else {
            (high, at_high) = (ratio, error);
            at_low *= 0.5;
        }
    };
    // All moduli are proportional to the modulus of the beam.
    let factor = young / response.modulus;
    let beam = CohesiveBeam { young: beam.young * factor, ..beam };
    let achieved = CylinderResponse {
        modulus: response.modulus * factor,
        bounding_modulus: response.bounding_modulus * factor,
        ..response
    };
    Ok(ElasticMatch { beam, achieved, evaluations })
}
