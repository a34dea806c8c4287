//! Errors of the arguments.

use concordem_contact::law::LawName;

/// Why the arguments are rejected. The message names the argument and the remedy.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum OptionError {
    /// Missing or unknown bond law.
    #[error("unknown bond law `{name}`; choose one of {}, or `none` with `contact LAW`", names(LawName::bonds()))]
    Law {
        /// The word in place of the law.
        name: String,
    },
    /// Unknown contact law.
    #[error("unknown contact law `{name}`; choose one of none, {}", names(LawName::contacts()))]
    ContactLaw {
        /// The word in place of the law.
        name: String,
    },
    /// An option without a value.
    #[error("`{key}` needs a value: {wanted}")]
    Missing {
        /// The option.
        key: String,
        /// Valid values.
        wanted: &'static str,
    },
    /// An invalid value.
    #[error("`{key} {value}` is invalid; give {wanted}")]
    Value {
        /// The option.
        key: String,
        /// The value.
        value: String,
        /// Valid values.
        wanted: &'static str,
    },
    /// An option given twice.
    #[error("`{key}` is given twice; remove one")]
    Twice {
        /// The option.
        key: String,
    },
    /// Parameters that cannot be read.
    #[error("parameters of {place}: {message}")]
    Parameters {
        /// Law or file.
        place: String,
        /// Cause.
        message: String,
    },
    /// Option `bond` is missing.
    #[error(
        "option `bond` is missing; add `bond distance FACTOR`, `bond clumps FACTOR`, `bond list FILE`, or `bond none`"
    )]
    NoBonds,
    /// Pairs of types without `bond distance`.
    #[error("`between` chooses pairs of `bond distance FACTOR`; add that, or remove `between`")]
    BetweenWhat,
    /// A pair of types that the host does not have.
    #[error("`between {a}-{b}`: atom types are 1 to {types}")]
    NoSuchType {
        /// The lower type.
        a: u16,
        /// The higher type.
        b: u16,
        /// Number of types.
        types: usize,
    },
    /// A step for bonds that come with inserted clumps.
    #[error("`bond clumps` bonds each clump when it is inserted; remove `at`, or use `bond distance`")]
    ClumpsAt,
    /// A limit without `bond distance`.
    #[error("`limit` counts the bonds of `bond distance FACTOR`; add that, or remove `limit`")]
    LimitOfWhat,
    /// Limits of other types than the host has.
    #[error("`limit` has {given} numbers, but there are {types} atom types; give one number for all, or one per type")]
    LimitTypes {
        /// Numbers given.
        given: usize,
        /// Number of types.
        types: usize,
    },
    /// Neither bonds nor contacts.
    #[error("law `none` without `contact LAW` computes no forces; add `contact LAW`, or choose a bond law")]
    Nothing,
    /// Option `bond` without a bond law.
    #[error(
        "`bond` needs a bond law, but the law is `none`; remove `bond`, or choose one of {}",
        names(LawName::bonds())
    )]
    NoBondLaw,
    /// Bonds from a data file and new ones.
    #[error("`{key}` creates bonds, but `state FILE` has the bonds of a data file; remove `{key}`, or `state`")]
    StateAndBonds {
        /// The option that creates bonds.
        key: &'static str,
    },
    /// Parameters by bond type where bonds have no type.
    #[error("parameters by bond type need the bonds of a bond style of LAMMPS; remove the number before the key")]
    NoBondTypes,
    /// Parameters both inline and from a file.
    #[error("parameter `{key}` conflicts with `materials FILE`; remove one of them")]
    InlineAndFile {
        /// The parameter.
        key: String,
    },
    /// A law that does not support deformable particles.
    #[error(
        "law {law} does not support `deformable`; remove `deformable`, or choose one of {}",
        names(LawName::ALL.iter().copied().filter(|law| law.facts().deforms))
    )]
    NotDeformable {
        /// The law.
        law: String,
    },
    /// Deformable particles without elastic constants.
    #[error(
        "`deformable` needs elastic constants; add `deformable.young` and `deformable.poisson`, or [material.deformable] in the \
         materials file"
    )]
    NoElasticity,
    /// A value with a unit where the host has other units.
    #[error(
        "{place}`{key} = {value}`: the script does not use `units si`, so values have no units; give a number in the units of the \
         script"
    )]
    Unit {
        /// The file, with a colon; empty for the script.
        place: String,
        /// The key.
        key: String,
        /// The value.
        value: String,
    },
    /// Heat conduction in other units.
    #[error("`heat` needs `units si`, because its constants have SI units")]
    HeatUnits,
    /// A file that cannot be read.
    #[error("cannot read {path}: {message}")]
    File {
        /// The file.
        path: String,
        /// Cause.
        message: String,
    },
    /// The materials have thermal constants, but there is no heat conduction.
    #[error("the thermal constants of {of} have no effect without heat conduction; add `heat FILE`, or remove them")]
    NoHeat {
        /// Owner of the constants.
        of: String,
    },
    /// Heat conduction that is not possible here.
    #[error("{file}{}: {key}: {message}; {remedy}", line.map_or_else(String::new, |line| format!(", line {line}")))]
    Heat {
        /// The file with `[heat]`, or with `[[material]]`.
        file: String,
        /// Line, if it is known.
        line: Option<usize>,
        /// Key, with its value.
        key: String,
        /// What is wrong.
        message: String,
        /// What to do.
        remedy: String,
    },
}

pub(super) fn names(laws: impl Iterator<Item = LawName>) -> String {
    laws.map(LawName::key).collect::<Vec<_>>().join(", ")
}
