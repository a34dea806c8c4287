//! Why a run ends with an error.

use concordem_operator::OperatorError;
use concordem_solver::SolverError;

use crate::schedule::guard::EnergyFault;
use crate::schedule::watch::Swinging;

/// Why a run cannot continue.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// The solver failed.
    #[error(transparent)]
    Solver(#[from] SolverError),
    /// Integration errors have changed the energy, or the motion is unstable.
    #[error("at step {step} (t = {time} s) {}", describe(fault))]
    Energy {
        /// Step.
        step: u64,
        /// Time, s.
        time: f64,
        /// What is wrong.
        fault: Box<EnergyFault>,
    },
    /// Bonds made during the run are too stiff for the time step.
    #[error("at step {step} (t = {time} s), after {made} bonds were made, the time step of {dt:.3e} s exceeds its stability bound of \
             {bound:.3e} s; give integration.time_step = {:.2e}", 0.8 * bound)]
    Bonds {
        /// Step.
        step: u64,
        /// Time, s.
        time: f64,
        /// Number of new bonds.
        made: usize,
        /// Time step, s.
        dt: f64,
        /// Its bound, s.
        bound: f64,
    },
    /// A servo swings about its target.
    #[error("at step {step} (t = {time} s) {} swings about its target and does not come to rest: its error alternates between {:.0} and {:.0} % \
             of the target. Give [integration] more damping, or lower {}", swinging.what, 100.0 * swinging.errors[0],
             100.0 * swinging.errors[1], swinging.remedy)]
    Servo {
        /// Step.
        step: u64,
        /// Time, s.
        time: f64,
        /// The servo.
        swinging: Box<Swinging>,
    },
    /// The run has something that no device supports.
    #[error("the device `{device}` does not support {what}; run without --device")]
    Device {
        /// Name of the device.
        device: String,
        /// What it does not support.
        what: &'static str,
    },
    /// An operator cannot be evaluated.
    #[error("sample `{name}` at step {step}: {source}")]
    Operator {
        /// Name of the sample.
        name: String,
        /// Step.
        step: u64,
        /// Cause.
        source: OperatorError,
    },
}

/// An [`EnergyFault`] in words.
fn describe(fault: &EnergyFault) -> String {
    let EnergyFault { unstable, yade, created, turnover, integration, residual, kinetic, stored } = fault;
    let remedy = "The time step is too large for the contacts that have formed: lower integration.contact_safety or \
                  integration.time_step. With integration.allow_energy_error = true the run continues anyway";
    if *unstable {
        return format!(
            "the motion is unstable: the stored energy is {stored:.3e} J, but kinetic plus stored energy is {:.3e} J. {remedy}",
            kinetic + stored
        );
    }
    let remedy = if *yade {
        "YADE's kinematics create energy where particles rotate: use kinematics = \"finite\", or a smaller \
         integration.time_step. With integration.allow_energy_error = true the run continues anyway"
    } else {
        remedy
    };
    let (verb, without) = if *created > 0.0 { ("gained", "without a source") } else { ("lost", "without a sink") };
    format!(
        "the run has {verb} {:.3e} J {without}, {:.1} % of its energy of {turnover:.3e} J (ledger: integration \
         {integration:.3e} J, residual {residual:.3e} J). {remedy}",
        created.abs(),
        100.0 * created.abs() / turnover
    )
}
