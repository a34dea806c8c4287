//! Histories, factors that change with time, and stages of the loading.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::quantity::{Angle, Number, Stress, Time};

/// A factor that changes with time. Motions, forces, walls, and stages name it in their key `history`; it multiplies what they
/// give.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct History {
    /// Name of the history. Required. Example: `name = "up and down"`.
    pub name: String,
    /// The factor over time. Required.
    /// Example: `shape = { kind = "table", points = [["0 ms", 0], ["1 ms", 1], ["2 ms", 0]] }`.
    pub shape: HistoryShape,
}

/// A factor over time. The time of a stage starts with the stage, all others with the run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum HistoryShape {
    /// Points in time, with straight lines between them. Before the first and after the last point the factor is constant.
    Table {
        /// Times (s) and factors; times must increase. Required. Example: `points = [["0 ms", 0], ["1 ms", 1]]`.
        #[schemars(length(min = 1))]
        points: Vec<(Time, Number)>,
        /// Whether the table begins again after its last point; default: false.
        #[serde(default)]
        repeat: bool,
        /// Whether polynomials of fifth degree, without velocity and acceleration at the points, replace the straight lines;
        /// default: false.
        #[serde(default)]
        smooth: bool,
    },
    /// `mean + amplitude sin(2 pi t/period + phase)`.
    Sine {
        /// Period, s. Required. Example: `period = "2 ms"`.
        #[schemars(extend("exclusiveMinimum" = 0))]
        period: Time,
        /// Amplitude; default: 1.
        #[serde(default = "one")]
        amplitude: Number,
        /// Mean; default: 0.
        #[serde(default = "zero")]
        mean: Number,
        /// Phase at time zero, rad; default: 0. Example: `phase = "90 deg"`.
        #[serde(default = "no_phase")]
        phase: Angle,
    },
    /// A formula of the time `t` in seconds, with `+ - * / ^`, parentheses, `pi`, and functions such as `sin`, `exp`, `sqrt`, `min`.
    Expression {
        /// The formula. Required. Example: `expression = "1e-3*sin(2*pi*50*t)"`.
        expression: String,
        /// Time up to which the largest value and the steepest slope of the formula are searched, on which the time step depends, s;
        /// default: `stop.time`. The formula holds after it, too. Example: `until = "20 ms"`.
        #[schemars(extend("exclusiveMinimum" = 0))]
        until: Option<Time>,
    },
}

fn one() -> Number {
    Number::new(1.0)
}

fn zero() -> Number {
    Number::new(0.0)
}

fn no_phase() -> Angle {
    Angle::new(0.0)
}

/// A stage of the loading. Stages follow each other; the run ends with the last one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stage {
    /// Name of the stage. Required. Example: `name = "unload"`.
    pub name: String,
    /// Factor of the rate of `loading`, or of the target of "cell-stress" loading if no axis follows a strain rate; default: 1.
    /// -1 reverses the motion, 0 holds it.
    #[serde(default = "one")]
    pub rate: Number,
    /// What the axes with a `strain_rate` follow in "cell-stress" loading; default: "strain-rate".
    #[serde(default)]
    pub control: Control,
    /// Name of a history that multiplies `rate`; its time starts with the stage. Default: none.
    pub history: Option<String>,
    /// Conditions that end the stage; the first one that holds ends it. Required: at least one.
    pub stop: StageStop,
}

/// What the axes with a strain rate follow in a stage.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Control {
    /// Their strain rate, times the `rate` of the stage.
    #[default]
    StrainRate,
    /// Their stress, as all other axes: for the consolidation before a triaxial test.
    Stress,
}

/// Conditions that end a stage; the first one that holds ends it. All are checked with each row of the results
/// (`output.sample_interval`), `steps` after every step.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct StageStop {
    /// The strain passes this value, from above or below. Example: `strain = 5e-4`.
    pub strain: Option<Number>,
    /// The stress passes this value, Pa, from above or below. Example: `stress = 0`.
    pub stress: Option<Stress>,
    /// The stress drops to this fraction of its peak in the stage, to which the stress at its start belongs: a stage that unloads
    /// drops from there. Example: `drop_to = 0.5`.
    #[schemars(extend("minimum" = 0, "exclusiveMaximum" = 1))]
    pub drop_to: Option<Number>,
    /// Time since the start of the stage, s. Example: `time = "0.2 ms"`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub time: Option<Time>,
    /// Steps since the start of the stage. Example: `steps = 2000`.
    #[schemars(range(min = 1))]
    pub steps: Option<u64>,
    /// Equilibrium, as in `stop` of the run. Example: `unbalanced = 1e-3`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub unbalanced: Option<Number>,
}
