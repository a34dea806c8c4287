//! Control of a loading by the opening of a crack.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::quantity::{Number, Time, Velocity};

/// The loading moves so that the elongation of a gauge grows at a given rate. It turns back where it must, as with a brittle specimen that
/// snaps back: its displacement w follows `dw/dt = gain (r - de/dt) + (r t - e)/T + 0.1/T^2 Integral(r t - e)`, with the elongation e,
/// its rate r, and the response time T, up to the velocity or strain rate of the loading. Stages multiply r by their factor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OpeningControl {
    /// Name of a `[[sample]]` with the operator "gauge". Required. Example: `gauge = "crack mouth"`.
    pub gauge: String,
    /// Rate of the elongation of the gauge, m/s; negative if the loading shortens the gauge. Required. Example:
    /// `rate = "1 mm/s"`.
    pub rate: Velocity,
    /// Time in which the loading makes up for an error of the elongation, s. Take about a quarter of the period of the
    /// slowest vibration of the specimen: with less, loading and specimen swing. Required. Example: `response_time = "50 us"`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub response_time: Time,
    /// Displacement of the loading per error of the elongation, at once; default: 0.5. With a larger one the loading follows faster where
    /// the specimen snaps back, but may swing with waves in it.
    #[serde(default = "half")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub gain: Number,
}

fn half() -> Number {
    Number::new(0.5)
}
