//! From the parameter tables of materials to a block of contacts of one law.

use concordem_contact::law::{self, ContactLawName, HasTable, LawName, ParameterError, RegisteredLaw};
use concordem_contact::material::{Interface, Material};

use crate::PairCoefficients;
use crate::forces::{EvaluatedContacts, LawLoops};
use crate::state::contacts::ContactBlock;

/// A block without contacts, and which pair coefficients apply to which materials.
pub type BlockAndRows = (Box<dyn EvaluatedContacts>, PairCoefficients);

/// Why tables do not give a block.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LawError {
    /// The parameters of two materials are not valid for the law.
    #[error("law `{law}` between materials `{}` and `{}`: {source}", materials[0], materials[1])]
    Parameters {
        /// Law.
        law: &'static str,
        /// Names of the two materials.
        materials: Box<[String; 2]>,
        /// What is wrong.
        source: Box<ParameterError>,
    },
    /// The factors of an interface do not apply to the law.
    #[error("law `{law}` between materials `{}` and `{}`: {message}", materials[0], materials[1])]
    Factors {
        /// Law.
        law: &'static str,
        /// Names of the two materials.
        materials: Box<[String; 2]>,
        /// What is wrong, and the remedy.
        message: String,
    },
    /// More pairs of materials than can be numbered.
    #[error(
        "the materials with parameters of \"{law}\" form more pairs than the {most} that can be numbered; give `{law}` \
         to at most 255 materials, or merge those with the same parameters"
    )]
    TooManyPairs {
        /// Law.
        law: &'static str,
        /// Largest number of pairs.
        most: usize,
    },
}

macro_rules! dispatch {
    ($($key:ident: $Law:ident,)*) => {
        /// A block of bonds of `law` without contacts, with all pair coefficients and their assignment to pairs of
        /// `materials`. A pair has none if one of its materials has no table of the law.
        ///
        /// # Errors
        /// Parameters that are not valid for the law; too many pairs of materials.
        pub fn block(law: LawName, materials: &[Material], interfaces: &[Interface]) -> Result<BlockAndRows, LawError> {
            match law {
                $(LawName::$Law => block_of::<law::$key::$Law, _>(materials, interfaces, true, law::$key::$Law::row),)*
            }
        }

        /// [`block`] for contacts without a bond.
        fn unbonded_block(
            law: LawName,
            materials: &[Material],
            interfaces: &[Interface],
        ) -> Result<BlockAndRows, LawError> {
            match law {
                $(LawName::$Law => {
                    block_of::<law::$key::$Law, _>(materials, interfaces, false, law::$key::$Law::unbonded_row)
                })*
            }
        }
    };
}
concordem_contact::for_each_law!(dispatch);

/// [`block`] for contacts without a bond; `None` for [`ContactLawName::NONE`].
///
/// # Errors
/// As [`block`].
pub fn contact_block(
    law: ContactLawName,
    materials: &[Material],
    interfaces: &[Interface],
) -> Result<Option<BlockAndRows>, LawError> {
    law.law().map(|law| unbonded_block(law, materials, interfaces)).transpose()
}

/// A block of law `R` with pair coefficients from tables of law `L`; `bonded`: of bonds.
fn block_of<L: RegisteredLaw, R: LawLoops>(
    materials: &[Material],
    interfaces: &[Interface],
    bonded: bool,
    row: fn(&L::Table, &L::Table) -> Result<R, ParameterError>,
) -> Result<BlockAndRows, LawError>
where
    Material: HasTable<L>,
    Interface: HasTable<L>,
{
    let wrong = |a: &Material, b: &Material, source| LawError::Parameters {
        law: L::NAME,
        materials: Box::new([a.name.clone(), b.name.clone()]),
        source: Box::new(source),
    };
    let mut rows = Vec::new();
    let mut map = PairCoefficients::new(materials.len());
    for (i, a) in materials.iter().enumerate() {
        for (j, b) in materials.iter().enumerate().skip(i) {
            let interface = if i == j { None } else { interfaces.iter().find(|one| one.joins(&a.name, &b.name)) };
            let between = interface.map(|one| table_between::<L>(one, materials, bonded)).transpose()?.flatten();
            let between = between.as_ref();
            let (Some(table_a), Some(table_b)) = (between.or(a.table()), between.or(b.table())) else { continue };
            let made = row(table_a, table_b).map_err(|source| wrong(a, b, source))?;
            // Every ordered pair is numbered, so 255 materials make 65025.
            let most = usize::from(PairCoefficients::NONE);
            if rows.len() + if i == j { 1 } else { 2 } > most {
                return Err(LawError::TooManyPairs { law: L::NAME, most });
            }
            map.set(i as u16, j as u16, rows.len() as u16);
            rows.push(made);
            if i != j {
                map.set(j as u16, i as u16, rows.len() as u16);
                rows.push(made.exchanged());
            }
        }
    }
    for (i, material) in materials.iter().enumerate() {
        let interface = interfaces.iter().find(|one| one.joins(&material.name, &material.name));
        let between = interface.map(|one| table_between::<L>(one, materials, bonded)).transpose()?.flatten();
        if let Some(table) = between {
            let most = usize::from(PairCoefficients::NONE);
            if rows.len() >= most {
                return Err(LawError::TooManyPairs { law: L::NAME, most });
            }
            map.set_apart(i as u16, rows.len() as u16);
            rows.push(row(&table, &table).map_err(|source| wrong(material, material, source))?);
        }
    }
    Ok((Box::new(ContactBlock::new(rows)), map))
}

/// The table of law `L` of an interface: its own, or that of the material `of` times the factors. `bonded`: for bonds.
fn table_between<L: RegisteredLaw>(
    interface: &Interface,
    materials: &[Material],
    bonded: bool,
) -> Result<Option<L::Table>, LawError>
where
    Material: HasTable<L>,
    Interface: HasTable<L>,
{
    if let Some(table) = interface.table() {
        return Ok(Some(table.clone()));
    }
    let factors = interface.factors.unwrap_or_default();
    let of = interface.of.as_ref().and_then(|name| materials.iter().find(|material| material.name == *name));
    let Some(table) = of.and_then(HasTable::<L>::table) else { return Ok(None) };
    let factors = if bonded { factors } else { factors.of_contacts() };
    L::scaled(table, &factors).map(Some).map_err(|fault| LawError::Factors {
        law: L::NAME,
        materials: Box::new(interface.between.clone()),
        message: format!("{}; {}", fault.message, fault.help),
    })
}
