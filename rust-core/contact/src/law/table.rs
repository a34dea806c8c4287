//! What scenarios and hosts need of a law besides its response: its parameter table and its roles.

use std::fmt::Debug;

use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::{ContactLaw, Factors, Field, Kinematics, LawState, ParameterError};

/// A law with a table of parameters. All laws of [`for_each_law!`](crate::for_each_law) have one.
///
/// Scenarios, result files, and hosts use only this trait and [`ContactLaw`]: the table, the pair coefficients, the
/// roles of the law, and their descriptions. No other code lists the laws.
pub trait RegisteredLaw: ContactLaw {
    /// Parameters of one material, as in `[material.NAME]` of a scenario.
    type Table: LawTable + Clone + PartialEq + Serialize + DeserializeOwned + JsonSchema;
    /// Law of pairs without a bond where `contacts.law` names this law. It is `Self`, unless a broken bond becomes another
    /// law: a broken [`LinearBond`](super::LinearBond) is a [`Frictional`](super::Frictional) contact.
    type Unbonded: ContactLaw;
    /// Name of the law in a sentence: "linear bond".
    const TITLE: &'static str;
    /// What the law does as a bond, in one sentence; `None` if it makes no bonds.
    const AS_BOND: Option<&'static str> = None;
    /// What the law does without a bond, in one sentence; `None` if it acts in bonds only.
    const AS_CONTACT: Option<&'static str> = None;

    /// Pair coefficients of a bond (or contact) between two materials with these tables. Within one material and across
    /// an `[[interface]]`, `a` and `b` are the same table.
    ///
    /// # Errors
    /// Values out of range, by the keys of the table; tables that cannot be combined.
    fn row(a: &Self::Table, b: &Self::Table) -> Result<Self, ParameterError>;

    /// Pair coefficients without a bond. Laws that do not change after breaking write `Self::row(a, b)`.
    ///
    /// # Errors
    /// As [`Self::row`].
    fn unbonded_row(a: &Self::Table, b: &Self::Table) -> Result<Self::Unbonded, ParameterError>;

    /// The table with its parameters multiplied by the factors of an `[[interface]]`. Without this function the law takes none.
    ///
    /// # Errors
    /// A factor of a property that the law, or this table, does not have; its key is that of the factor.
    fn scaled(table: &Self::Table, factors: &Factors) -> Result<Self::Table, Fault> {
        if factors.is_one() {
            return Ok(table.clone());
        }
        let help = format!("give [interface.{}] with all parameters, or remove the factors", Self::NAME);
        Err(Fault::conflict("", format!("the {} takes no factors", Self::TITLE), help))
    }
}

/// Parameters of a law in one material. The schema of the struct has the ranges of single keys; this trait has all
/// other checks.
pub trait LawTable: Debug + Send + Sync {
    /// Faults that the range of a single key does not show: keys that exclude or require each other.
    fn faults(&self) -> Vec<Fault> {
        Vec::new()
    }

    /// Keys given in the table that only bonds use; unbonded contacts ignore them.
    fn keys_of_bonds(&self) -> Vec<&'static str> {
        Vec::new()
    }

    /// Keys given in the table that belong to the particles of one material; an `[[interface]]` cannot have them.
    fn keys_of_particles(&self) -> Vec<&'static str> {
        Vec::new()
    }

    /// Why the law does not act between discs of unit depth; `None` if it does. Most laws have a circular cross-section
    /// or describe spheres, so their forces are not per unit depth.
    fn fault_in_plane(&self) -> Option<Fault> {
        let help = "use \"linear_bond\" or \"frictional\" with stiffnesses in N/m, or dimension = 3";
        Some(Fault::conflict("", "a law of spheres, which has no meaning between discs of unit depth", help))
    }

    /// Why stiffness and strength cannot depend on the temperature; `None` if they can.
    fn fault_of_variation(&self) -> Option<Fault> {
        let help = "remove the factors of stiffness and strength from `thermal.variation`, or use another law";
        Some(Fault::conflict("", "the constants of this law cannot depend on the temperature", help))
    }

    /// A key that must have the same value in all tables of a run, and its value.
    fn uniform_key(&self) -> Option<(&'static str, String)> {
        None
    }

    /// Elastic modulus, Pa: sets the time scale on which platens start. `None` for laws that have none.
    fn modulus(&self) -> Option<f64> {
        None
    }

    /// Mean stress of a particle at which all its bonds break, Pa; `None` without this criterion.
    fn hydrostatic_strength(&self) -> Option<f64> {
        None
    }
}

/// Class of a [`Fault`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FaultKind {
    /// A key is missing.
    Missing,
    /// Keys that contradict each other.
    Conflict,
    /// A value out of range.
    Range,
}

/// A fault of a table, for the user.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// Class.
    pub kind: FaultKind,
    /// Key in the table; empty for the table as a whole.
    pub key: &'static str,
    /// What is wrong.
    pub message: String,
    /// What to do.
    pub help: String,
}

impl Fault {
    /// A missing key.
    pub fn missing(key: &'static str, message: impl Into<String>, help: impl Into<String>) -> Self {
        Self { kind: FaultKind::Missing, key, message: message.into(), help: help.into() }
    }

    /// A key that contradicts others.
    pub fn conflict(key: &'static str, message: impl Into<String>, help: impl Into<String>) -> Self {
        Self { kind: FaultKind::Conflict, key, message: message.into(), help: help.into() }
    }

    /// A value out of range.
    pub fn range(key: &'static str, message: impl Into<String>, help: impl Into<String>) -> Self {
        Self { kind: FaultKind::Range, key, message: message.into(), help: help.into() }
    }
}

/// Constants of a law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LawFacts {
    /// [`ContactLaw::NAME`].
    pub key: &'static str,
    /// [`RegisteredLaw::TITLE`].
    pub title: &'static str,
    /// [`RegisteredLaw::AS_BOND`].
    pub as_bond: Option<&'static str>,
    /// [`RegisteredLaw::AS_CONTACT`].
    pub as_contact: Option<&'static str>,
    /// [`ContactLaw::DEFORMS`].
    pub deforms: bool,
    /// [`ContactLaw::TRANSMITS_MOMENT`].
    pub transmits_moment: bool,
    /// [`Kinematics::READS_ORIENTATIONS`].
    pub reads_orientations: bool,
    /// Fields of the history of a bond.
    pub history: &'static [Field],
    /// Fields of the history of a contact without a bond.
    pub unbonded_history: &'static [Field],
}

impl LawFacts {
    /// Constants of law `L`.
    pub const fn of<L: RegisteredLaw>() -> Self {
        Self {
            key: L::NAME,
            title: L::TITLE,
            as_bond: L::AS_BOND,
            as_contact: L::AS_CONTACT,
            deforms: L::DEFORMS,
            transmits_moment: L::TRANSMITS_MOMENT,
            reads_orientations: L::Kinematics::READS_ORIENTATIONS,
            history: <L::State as LawState>::FIELDS,
            unbonded_history: <<L::Unbonded as ContactLaw>::State as LawState>::FIELDS,
        }
    }
}

/// Access to the table of one law in a [`Material`](crate::material::Material) or
/// [`Interface`](crate::material::Interface).
pub trait HasTable<L: RegisteredLaw> {
    /// The table, if present.
    fn table(&self) -> Option<&L::Table>;
}
