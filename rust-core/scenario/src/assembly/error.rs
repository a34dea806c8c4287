//! Why a scenario cannot be built.

use concordem_packing::PackingError;
use concordem_solver::laws::LawError;
use concordem_solver::neighbor::NeighborError;

/// Why a scenario cannot be built.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AssemblyError {
    /// The packing cannot be made.
    #[error("packing: {0}")]
    Packing(#[from] PackingError),
    /// The neighbor search failed.
    #[error("bonding: {0}")]
    Neighbor(#[from] NeighborError),
    /// The parameters of two materials do not define a law.
    #[error("law `{law}` between materials `{a}` and `{b}`: {message}")]
    Parameters {
        /// Law.
        law: &'static str,
        /// First material.
        a: String,
        /// Second material.
        b: String,
        /// What is wrong.
        message: String,
    },
    /// The scenario does not fit its packing.
    #[error("{key}: {message}")]
    Unfit {
        /// Key of the scenario.
        key: String,
        /// What is wrong, and the remedy.
        message: String,
    },
    /// The time step exceeds the stability bound.
    #[error(
        "integration.time_step is {given:.6e} s, but the assembled system is stable only below {bound:.6e} s \
         (largest frequency {frequency:.4e} rad/s); use \"auto\" or a smaller step, or set \
         integration.allow_unstable = true to run it anyway"
    )]
    Unstable {
        /// Given time step, s.
        given: f64,
        /// Stability bound, s.
        bound: f64,
        /// Largest angular frequency, rad/s.
        frequency: f64,
    },
    /// The time step exceeds the stability bound of a contact that may form.
    #[error(
        "integration.time_step is {given:.6e} s, but {} between the materials `{a}` and `{b}` is stable only below \
         {bound:.6e} s{}; use \"auto\" or a smaller step, or set integration.allow_unstable = true to run it anyway",
        wall.as_ref().map_or_else(|| "a contact".to_owned(), |wall| format!("a contact with the wall `{wall}`")),
        if *overlap > 0.0 {
            format!(" (in an impact at {speed:.4e} m/s, which overlaps by {overlap:.4e} m)")
        } else {
            String::new()
        }
    )]
    UnstableContact {
        /// Given time step, s.
        given: f64,
        /// Stability bound, s.
        bound: f64,
        /// First material.
        a: String,
        /// Second material.
        b: String,
        /// Wall, for a contact with a wall.
        wall: Option<String>,
        /// Speed of the impact, m/s.
        speed: f64,
        /// Overlap in this impact, m.
        overlap: f64,
    },
    /// The iteration between strains of deformable particles and forces would not converge.
    #[error(
        "material.deformable: strains and forces do not converge, the spectral radius of their iteration is \
         {spectral_radius:.5}; the particles' Young's modulus must be above {young:.5e} Pa{}, or set \
         integration.allow_unstable = true to run it anyway",
        if *lagged {
            format!(" (or write deformable.update = \"iterated\" with relaxation below {relaxation:.3})")
        } else {
            format!(" (or lower deformable.relaxation below {relaxation:.3})")
        }
    )]
    NotConvergent {
        /// Spectral radius of the iteration.
        spectral_radius: f64,
        /// Whether the strains lag behind the forces by one step.
        lagged: bool,
        /// Relaxation below which the iteration converges.
        relaxation: f64,
        /// Modulus of the softest material above which the iteration converges, with all moduli scaled by the same
        /// factor, Pa.
        young: f64,
    },
    /// The time step exceeds the stability bound of explicit heat conduction.
    #[error(
        "integration.time_step is {given:.6e} s, but explicit heat conduction is stable only below {bound:.6e} s \
         (thermal time {thermal:.6e} s); use a smaller step or a smaller heat.time_factor, write heat.scheme = \"implicit\", or \
         set integration.allow_unstable = true to run it anyway"
    )]
    UnstableHeat {
        /// Given time step, s.
        given: f64,
        /// Stability bound, s.
        bound: f64,
        /// The same in thermal time, s.
        thermal: f64,
    },
    /// The time step is `"auto"`, and no contact gives a bound.
    #[error("integration.time_step is \"auto\", but no contact gives a bound: give a time step in seconds")]
    NoTimeStep,
    /// A file cannot be read.
    #[error("{path}: {message}")]
    File {
        /// Path.
        path: String,
        /// What happened.
        message: String,
    },
}

impl From<LawError> for AssemblyError {
    fn from(error: LawError) -> Self {
        match error {
            LawError::Parameters { law, materials, source } => {
                let [a, b] = *materials;
                Self::Parameters { law, a, b, message: source.to_string() }
            }
            other => unfit("material", other.to_string()),
        }
    }
}

/// Error for the scenario key `key`, whose value does not fit the assembled system.
pub fn unfit(key: &str, message: String) -> AssemblyError {
    AssemblyError::Unfit { key: key.to_owned(), message }
}
