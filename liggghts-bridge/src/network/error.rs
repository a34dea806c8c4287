//! Why the network cannot go on.

use concordem_operator::OperatorError;
use concordem_solver::SolverError;
use concordem_solver::laws::LawError;
use concordem_solver::neighbor::NeighborError;

/// An error of the network. The message says what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NetworkError {
    /// The parameters are not valid for the law.
    #[error("{0}")]
    Parameters(#[from] LawError),
    /// The neighbor search failed.
    #[error("{0}")]
    Neighbor(#[from] NeighborError),
    /// The solver failed.
    #[error("{0}")]
    Solver(#[from] SolverError),
    /// An operator failed.
    #[error("{0}")]
    Operator(#[from] OperatorError),
    /// The forces of the contacts were not recorded.
    #[error(
        "the forces of bonds at step {step} were not kept: nothing had asked for them beforehand; ask by `thermo_style`, `dump`, \
         or `fix ave/...`, which announce the steps they need"
    )]
    NotRecorded {
        /// Step.
        step: i64,
    },
    /// Couple stress depends on positions: not possible in a periodic box.
    #[error("couple stress depends on positions and has no meaning in a periodic box; use `boundary f f f`")]
    Periodic,
    /// An atom has a type without parameters.
    #[error(
        "bond of atoms {a} and {b}: no parameters of law {law} for atom types {types:?}; add them to the materials, or leave \
         the atoms out of the fix's group"
    )]
    NoRow {
        /// Atom.
        a: i32,
        /// Atom.
        b: i32,
        /// Law.
        law: &'static str,
        /// Their types.
        types: [i32; 2],
    },
    /// The other end of a bond is not among the ghosts.
    #[error(
        "bond of atoms {tag} and {partner}: atom {partner} is not known to the processor that owns atom {tag}. Either it is \
         farther away than atoms are communicated ({cutoff} m): raise it with the fix's `reach LENGTH`; or it was deleted or \
         left the simulation box: bonded atoms cannot be"
    )]
    OutOfSight {
        /// The atom that is here.
        tag: i32,
        /// The one that is not.
        partner: i32,
        /// Distance up to which ghosts are communicated, m.
        cutoff: f64,
    },
    /// The box is too small for unique periodic images.
    #[error(
        "the periodic box is {edge} m long in {axis}, less than twice the longest bond or contact ({longest} m): make it \
         larger"
    )]
    BoxTooSmall {
        /// Axis.
        axis: char,
        /// Its length, m.
        edge: f64,
        /// The longest bond or reach, m.
        longest: f64,
    },
    /// Two processors hold different records of the same bond.
    #[error(
        "the copies of the bond of atoms {a} and {b} differ between processors: something moves atoms on one processor alone, \
         or changes copies of atoms; such a fix cannot be used with bonds"
    )]
    CopiesDiffer {
        /// Atom.
        a: i32,
        /// Atom.
        b: i32,
    },
    /// A force is not a number.
    #[error(
        "at step {step} the force on atom {tag} is not a number; the time step may be too large, or atoms lie on top of each \
         other"
    )]
    NotFinite {
        /// Step.
        step: i64,
        /// Atom.
        tag: i32,
    },
    /// An id that is not positive or not unique.
    #[error("atom ids must be positive and unique; {tag} is not (use `atom_modify` defaults, or `reset_ids`)")]
    BadTag {
        /// The id.
        tag: i32,
    },
    /// Numbers from another processor or a restart file are no record.
    #[error("bonds of atom {tag} cannot be read: the restart file belongs to another law or version")]
    BadRecord {
        /// The atom.
        tag: i32,
    },
}
