//! Linear statics of bonded assemblies: bonds as a network of elastic links, solved without time steps.
//!
//! Young's modulus and Poisson's ratio of a bonded model follow from four methods, from crude to exact: closed form and
//! affine sum ([`operator`](concordem_operator), Stránský 2018, (3.38) and (3.31)), the static network with particles
//! free to move off the affine field ([`mod@cell_stiffness`]), and the relaxed state of the dynamic solver
//! ([`relaxed`]).
//!
//! * [`link`]: a link's 12 degrees of freedom (3.39)–(3.57);
//! * [`network`]: all links of a state, and particles that no link holds;
//! * [`mod@closed_form`]: links with uniformly distributed directions, rigid or deformable particles;
//! * [`solve`]: conjugate gradients, prescribed displacements, loads;
//! * [`mod@cell_stiffness`]: periodic cell under six unit strains (3.58)–(3.63), exact derivatives;
//! * [`moduli`]: constants and measures of isotropy (3.64)–(3.68).

pub mod cell_stiffness;
pub mod closed_form;
mod iterative;
mod krylov;
pub mod link;
pub mod moduli;
pub mod network;
pub mod relaxed;
pub mod solve;
mod stiffness_product;

pub use cell_stiffness::{CellStiffness, Derivatives, cell_stiffness, cell_stiffness_and_derivatives};
pub use closed_form::{ClosedForm, closed_form};
pub use iterative::Accuracy;
pub use link::Link;
pub use moduli::ElasticConstants;
pub use network::LinkNetwork;
pub use solve::{Support, solve_supported};

/// Order of the components of strain and stress: 11, 22, 33, 23, 31, 12; shear strains are engineering strains.
pub const COMPONENTS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1)];

/// Why a static problem has no solution.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum StaticsError {
    /// The assembly has no bonds.
    #[error("the assembly has no bonds; a static network needs them")]
    NoLinks,
    /// A periodic problem without a cell.
    #[error("the assembly has no periodic cell; macroscopic strains need one")]
    NoCell,
    /// The iteration did not reach its accuracy.
    #[error(
        "{what}: conjugate gradients stopped at a relative residual of {residual:.1e} after {iterations} iterations; the \
         limit is {wanted:.1e}"
    )]
    NotConverged {
        /// Which system.
        what: String,
        /// Relative residual reached.
        residual: f64,
        /// Largest relative residual allowed.
        wanted: f64,
        /// Iterations done.
        iterations: usize,
    },
    /// Loads on a mechanism.
    #[error("{what}: the loads act on a part that is not held (a mechanism or a body without supports)")]
    Unsupported {
        /// Which system.
        what: String,
    },
    /// A support that does not exist.
    #[error(
        "support or load on degree of freedom {freedom} of particle {particle}; there are {particles} particles with 6 each"
    )]
    Place {
        /// Particle.
        particle: usize,
        /// Degree of freedom.
        freedom: usize,
        /// Number of particles.
        particles: usize,
    },
    /// The stiffness cannot be inverted.
    #[error("the cell has no stiffness against some strain: it is a mechanism")]
    Soft,
    /// The dynamic solver failed.
    #[error("relaxation: {0}")]
    Relaxation(String),
}

/// The code of the README is tested.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
