//! Errors of the network.

use concordem_operator::OperatorError;
use concordem_solver::SolverError;
use concordem_solver::laws::LawError;
use concordem_solver::neighbor::NeighborError;

use crate::atoms::{NoSphere, Tag};

/// An error of the network. The message gives the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NetworkError {
    /// Invalid parameters for the law.
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
    /// The contact forces of this step were not recorded.
    #[error(
        "the bond forces of step {step} were not recorded; request the compute in `thermo_style`, `dump`, or `fix ave/...`, which \
         announce the steps they need"
    )]
    NotRecorded {
        /// Step.
        step: i64,
    },
    /// The bonds changed while the host wrote a restart file.
    #[error(
        "the bonds have changed while the restart file was written, which is incomplete; please report this script"
    )]
    ChangedWhileWritten,
    /// Couple stress in a periodic box.
    #[error("couple stress depends on absolute positions and is undefined in a periodic box; use `boundary f f f`")]
    Periodic,
    /// An atom has a type without parameters.
    #[error(
        "bond of atoms {a} and {b}: law {law} has no parameters for atom types {types:?}; add them to the materials, or remove the \
         atoms from the fix's group"
    )]
    NoRow {
        /// Atom.
        a: Tag,
        /// Atom.
        b: Tag,
        /// Law.
        law: &'static str,
        /// Their types.
        types: [i32; 2],
    },
    /// The other end of a bond is not among the ghosts.
    #[error(
        "bond of atoms {tag} and {partner}: atom {partner} is neither an owned atom nor a ghost on the processor that owns atom \
         {tag}. If it is farther away than the ghost cutoff ({cutoff} m), raise the cutoff with the fix's `reach LENGTH`. If it is \
         in another group now, put it back: both atoms of a bond belong to the group of the fix"
    )]
    OutOfSight {
        /// The atom on this processor.
        tag: Tag,
        /// The missing atom.
        partner: Tag,
        /// Distance up to which ghosts are communicated, m.
        cutoff: f64,
    },
    /// The box is too small for unique periodic images.
    #[error(
        "the periodic box is {edge} m long in {axis}, less than twice the longest bond or contact ({longest} m); enlarge it"
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
        "the records of the bond of atoms {a} and {b} differ between processors; remove the fix that moves atoms on one processor \
         only or that changes ghosts"
    )]
    CopiesDiffer {
        /// Atom.
        a: Tag,
        /// Atom.
        b: Tag,
    },
    /// Bonds of a restart file, but no atom that could take them into another one.
    #[error(
        "a processor has read bonds from a restart file, but has lost all its atoms before the first run, so that it cannot write these bonds \
         to another restart file; add `run 0` before `write_restart`"
    )]
    NoCarrier,
    /// Another command changed the type of a bond.
    #[error(
        "the type of the bond of atoms {a} and {b} changed from {before} to {now}, but a bond keeps its parameters; change types before the \
         first run with bonds, or remove the bond (`delete_bonds ... remove`), `run 0`, and create another one of the new type"
    )]
    OtherType {
        /// Atom.
        a: Tag,
        /// Atom.
        b: Tag,
        /// Its type when it was created.
        before: Tag,
        /// Its type now.
        now: Tag,
    },
    /// A bond is too long for its law.
    #[error(
        "the bond of atoms {a} and {b} is {length:.4e} m long; from {longest:.4e} m on, it stores its fracture energy before it softens: use \
         smaller atoms, or a larger `fracture_energy`"
    )]
    LongBond {
        /// Atom.
        a: Tag,
        /// Atom.
        b: Tag,
        /// Length, m.
        length: f64,
        /// Length from which on bonds are too long, m.
        longest: f64,
    },
    /// A section that refers to the mean radius of the bonded atoms, which is unknown.
    #[error(
        "internal error of fix concordem/bond, please report it: the bond of atoms {a} and {b} has no section, because the mean radius of \
         the bonded atoms is 0; until then, give `radius` instead of `radius_ratio`"
    )]
    NoMeanRadius {
        /// Atom.
        a: Tag,
        /// Atom.
        b: Tag,
    },
    /// A point, or an atom without mass.
    #[error("{0}")]
    NoSphere(#[from] NoSphere),
    /// A force is not finite.
    #[error(
        "at step {step} the force on atom {tag} is not finite; reduce the time step, and check that no two atoms coincide"
    )]
    NotFinite {
        /// Step.
        step: i64,
        /// Atom.
        tag: Tag,
    },
    /// A time step beyond the bound of explicit heat conduction.
    #[error(
        "the time step is {dt:.4e} s, but must be at most {bound:.4e} s for stable heat conduction at atom {tag}; reduce `timestep`, or \
         `time_factor` in [heat]"
    )]
    HeatStep {
        /// The atom that needs it.
        tag: Tag,
        /// Time step, s.
        dt: f64,
        /// Largest stable one on this processor, s.
        bound: f64,
    },
    /// A temperature is not finite.
    #[error("at step {step} the temperature of atom {tag} is not finite; check sources and fluxes in [heat]")]
    TemperatureNotFinite {
        /// Step.
        step: i64,
        /// Atom.
        tag: Tag,
    },
    /// An atom without a heat capacity.
    #[error(
        "atom {tag} has no heat capacity in {path}; add a line `atom {tag} CAPACITY VOLUME`, or take it out of the fix's group"
    )]
    NoHeatAtom {
        /// Atom.
        tag: Tag,
        /// The file of `heat_network`.
        path: String,
    },
    /// Other numbers in the file of `heat_network` than in the restart file.
    #[error("{of} has other numbers in {path} than in the restart file; give the file with which the run began")]
    OtherHeatNetwork {
        /// What differs.
        of: String,
        /// The file of `heat_network`.
        path: String,
    },
    /// A bond without an area.
    #[error(
        "the bond of atoms {a} and {b} has no area in {path}; add a line `bond {a} {b} AREA LENGTH LENGTH` (area 0: it conducts no heat), or \
         create the bonds of the scenario, with `bond list FILE`"
    )]
    NoHeatBond {
        /// Atom.
        a: Tag,
        /// Atom.
        b: Tag,
        /// The file of `heat_network`.
        path: String,
    },
    /// Another command changed the type of an atom in the run.
    #[error(
        "the type of atom {tag} changed between two rebuilds of the neighbor lists, when its copies on other processors keep the old one; \
         change types between runs (`set`), or with a fix that rebuilds the lists"
    )]
    OtherAtomType {
        /// The atom.
        tag: Tag,
    },
    /// The radius of an atom changed, on which conductances depend.
    #[error(
        "the radius of atom {tag} changed in the run, but areas that conduct heat do not follow; remove that fix, or `heat`"
    )]
    HeatOfOtherRadius {
        /// The atom.
        tag: Tag,
    },
    /// The host's arrays have changed since the last rebuild.
    #[error(
        "atom {tag} is not where it was at the last step: a fix moved or deleted atoms at the end of a step. Use a fix that does so at \
         rebuilds of the neighbor lists"
    )]
    Moved {
        /// Atom.
        tag: Tag,
    },
    /// An atom has another id than at the last rebuild.
    #[error(
        "the atom with id {tag} had id {before} before: a command renumbered the atoms (`delete_atoms` without `compress no`, \
         `reset_atoms id`), and bonds are known by the old ids. Add `compress no`, or renumber before the first run with bonds"
    )]
    Renumbered {
        /// Its id.
        tag: Tag,
        /// Its id at the last rebuild.
        before: i64,
    },
    /// An atom id is not positive or not unique.
    #[error(
        "atom ids must be positive, unique, and at most 2^53, but {tag} is not; use the defaults of `atom_modify`, or `reset_ids`"
    )]
    BadTag {
        /// The id.
        tag: Tag,
    },
    /// Invalid record from another processor or a restart file.
    #[error(
        "cannot read the bonds of atom {tag}: the restart file was written with another law or version; use the same ones"
    )]
    BadRecord {
        /// The atom.
        tag: Tag,
    },
}
