//! What the arguments of `fix ID group concordem/bond …` say.

use std::path::Path;

use concordem_contact::kinematics::MotionMeasure;
use concordem_contact::kinematics::deformable::Condition;
use concordem_contact::law::{ContactLawName, LawName};
use concordem_contact::material::{Interface, Material};
use serde::Deserialize;
use serde::de::value::{Error as ValueError, StrDeserializer};
use serde::de::{DeserializeOwned, IntoDeserializer};

/// Why arguments make no sense. The message names the argument and what would be right.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum OptionError {
    /// No law, or one that does not exist.
    #[error(
        "unknown law `{name}`; laws of bonds are {}; `none` with `contact LAW` is for contacts only",
        names(LawName::bonds())
    )]
    Law {
        /// What stands where the law is wanted.
        name: String,
    },
    /// A word that is no law of contacts.
    #[error("unknown law of contacts `{name}`; there are none, {}", names(LawName::contacts()))]
    ContactLaw {
        /// The word.
        name: String,
    },
    /// An option without its value.
    #[error("`{key}` needs a value after it: {wanted}")]
    Missing {
        /// The option.
        key: String,
        /// What is wanted.
        wanted: &'static str,
    },
    /// A value that cannot be.
    #[error("`{key} {value}` is not possible: {wanted}")]
    Value {
        /// The option.
        key: String,
        /// The value.
        value: String,
        /// What is wanted.
        wanted: &'static str,
    },
    /// An option given twice.
    #[error("`{key}` is given twice")]
    Twice {
        /// The option.
        key: String,
    },
    /// Parameters that cannot be read.
    #[error("parameters of {place}: {message}")]
    Parameters {
        /// Law, or file.
        place: String,
        /// What is wrong.
        message: String,
    },
    /// Nothing says where bonds come from.
    #[error("nothing says which atoms are bonded; add `bond distance FACTOR`, `bond list FILE`, or `bond none`")]
    NoBonds,
    /// Neither bonds nor contacts.
    #[error(
        "law `none` makes no bonds, and there is no `contact LAW`: nothing would act; add `contact LAW`, or choose a law of bonds"
    )]
    Nothing,
    /// Bonds are to be made without a law for them.
    #[error("`bond` makes bonds, but law `none` has none; remove `bond`, or choose one of {}", names(LawName::bonds()))]
    NoBondLaw,
    /// Parameters both inline and from a file.
    #[error("`{key}` is a parameter, but `materials` names a file of them; give one or the other")]
    InlineAndFile {
        /// The parameter.
        key: String,
    },
    /// A law that particles cannot deform under.
    #[error(
        "`deformable` does not go with law {law}: particles deform under {}; remove `deformable`, or choose one of these",
        names(LawName::ALL.iter().copied().filter(|law| law.facts().deforms))
    )]
    NotDeformable {
        /// The law.
        law: String,
    },
    /// Deformable particles without elastic constants.
    #[error(
        "`deformable` needs `deformable.young` and `deformable.poisson`, or [material.deformable] in the file of materials"
    )]
    NoElasticity,
    /// A file that cannot be read.
    #[error("cannot read {path}: {message}")]
    File {
        /// The file.
        path: String,
        /// Why not.
        message: String,
    },
}

/// Names of laws, with commas.
fn names(laws: impl Iterator<Item = LawName>) -> String {
    laws.map(LawName::key).collect::<Vec<_>>().join(", ")
}

/// A bond of a list: ids in ascending order, and the rest length (m) if it is given.
pub type Listed = ([i32; 2], Option<f64>);

/// Where bonds come from.
#[derive(Debug, Clone, PartialEq)]
pub enum Creation {
    /// From nowhere (but a restart file).
    None,
    /// Between all atoms of the group whose distance is below this times the sum of their radii.
    Distance(f64),
    /// Between listed atoms: tags, and rest lengths where given (m).
    List(Vec<Listed>),
}

/// Arguments of the fix, understood.
#[derive(Debug, Clone)]
pub struct Options {
    /// Law of bonds; `None`: there are only contacts.
    pub law: Option<LawName>,
    /// Law of atoms of the group that touch without a bond.
    pub contact: ContactLawName,
    /// How motion is measured.
    pub mode: MotionMeasure,
    /// Where bonds come from.
    pub creation: Creation,
    /// Step at which they are made; `None`: the first one computed.
    pub at: Option<i64>,
    /// Distance up to which atoms of other processors must be known, m, if the user wants more than is needed at the start.
    pub reach: f64,
    /// Whether stored energies are summed at every step, not only when output is due.
    pub sample_every_step: bool,
    /// How particles deform, if they do.
    pub deformable: Option<Condition>,
    /// Parameters by atom type.
    pub materials: Vec<Material>,
    /// Parameters between types.
    pub interfaces: Vec<Interface>,
}

/// A file of parameters: the tables of a scenario.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MaterialsFile {
    material: Vec<Material>,
    #[serde(default)]
    interface: Vec<Interface>,
}

fn named<T: DeserializeOwned>(name: &str) -> Option<T> {
    let deserializer: StrDeserializer<'_, ValueError> = name.into_deserializer();
    T::deserialize(deserializer).ok()
}

/// A word of the script as a TOML value: numbers and truth values as they are, everything else as a string.
fn toml_value(word: &str) -> toml::Value {
    // A number: TOML would take `1e6` and `5`, but not `.5`, which people write.
    if let Ok(number) = word.parse::<f64>() {
        return toml::Value::Float(number);
    }
    match word {
        "yes" | "true" | "on" => toml::Value::Boolean(true),
        "no" | "false" | "off" => toml::Value::Boolean(false),
        _ => toml::Value::String(word.to_owned()),
    }
}

/// Pairs of tags and rest lengths of a list: two integers, and a length (m) if wanted, per line; `#` begins a comment.
pub fn read_list(path: &Path) -> Result<Vec<Listed>, OptionError> {
    let file = |message: String| OptionError::File { path: path.display().to_string(), message };
    let text = std::fs::read_to_string(path).map_err(|error| file(error.to_string()))?;
    let mut bonds = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let line = line.split('#').next().unwrap_or_default().trim();
        if line.is_empty() {
            continue;
        }
        let words: Vec<&str> = line.split_whitespace().collect();
        let wrong = || {
            file(format!(
                "line {}: `{line}` is not a bond; wanted are two different atom ids and, if the rest length is not the \
                 present distance, that length in meters",
                number + 1
            ))
        };
        let [a, b] = [0, 1].map(|k| words.get(k).and_then(|w| w.parse::<i32>().ok()).filter(|&tag| tag > 0));
        let (Some(a), Some(b)) = (a, b) else { return Err(wrong()) };
        let length = words.get(2).map(|w| w.parse::<f64>().ok().filter(|l| *l > 0.0 && l.is_finite()));
        if words.len() > 3 || a == b || length == Some(None) {
            return Err(wrong());
        }
        bonds.push(([a.min(b), a.max(b)], length.flatten()));
    }
    bonds.sort_unstable_by_key(|bond| bond.0);
    if let Some(twice) = bonds.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        return Err(file(format!("the bond of atoms {} and {} is listed twice", twice[0].0[0], twice[0].0[1])));
    }
    Ok(bonds)
}

/// Arguments as written, before they are checked against each other.
#[derive(Default)]
struct Arguments {
    contact: Option<ContactLawName>,
    mode: Option<MotionMeasure>,
    creation: Option<Creation>,
    at: Option<i64>,
    reach: Option<f64>,
    sample_every_step: Option<bool>,
    deformable: Option<Condition>,
    materials_file: Option<String>,
    /// Parameters of bonds, contacts, and deformation.
    tables: [toml::Table; 3],
    /// The first parameter of the tables.
    first_parameter: Option<String>,
}

/// An option and the words after it.
struct OptionWords<'a, 'b> {
    key: &'a str,
    rest: &'b mut std::slice::Iter<'a, String>,
}

impl<'a> OptionWords<'a, '_> {
    /// The next word.
    fn value(&mut self, wanted: &'static str) -> Result<&'a str, OptionError> {
        let missing = OptionError::Missing { key: self.key.to_owned(), wanted };
        self.rest.next().map(String::as_str).ok_or(missing)
    }

    fn refuse(&self, value: &str, wanted: &'static str) -> OptionError {
        OptionError::Value { key: self.key.to_owned(), value: value.to_owned(), wanted }
    }

    /// Fill `slot` with what `parse` makes of the next word. An option may be given once.
    fn fill<T>(
        &mut self,
        slot: &mut Option<T>,
        wanted: &'static str,
        parse: impl FnOnce(&str) -> Option<T>,
    ) -> Result<(), OptionError> {
        self.once(slot.is_some())?;
        let word = self.value(wanted)?;
        *slot = Some(parse(word).ok_or_else(|| self.refuse(word, wanted))?);
        Ok(())
    }

    fn once(&self, given: bool) -> Result<(), OptionError> {
        if given { Err(OptionError::Twice { key: self.key.to_owned() }) } else { Ok(()) }
    }

    /// `none`, `distance FACTOR`, or `list FILE`.
    fn creation(&mut self) -> Result<Creation, OptionError> {
        const KINDS: &str = "distance FACTOR, list FILE, or none";
        match self.value(KINDS)? {
            "none" => Ok(Creation::None),
            "distance" => {
                let mut factor = None;
                let wanted = "a factor on the sum of the radii, from 0.1 to 10; 1.5 is usual for concrete";
                let in_range = |word: &str| word.parse().ok().filter(|f| (0.1..=10.0).contains(f));
                self.fill(&mut factor, wanted, in_range)?;
                Ok(Creation::Distance(factor.unwrap_or_default()))
            }
            "list" => Ok(Creation::List(read_list(Path::new(self.value("a file with two atom ids per line")?))?)),
            other => Err(self.refuse(other, KINDS)),
        }
    }
}

impl Arguments {
    /// The words after the law.
    fn read(words: &[String]) -> Result<Self, OptionError> {
        let mut arguments = Self::default();
        let mut rest = words.iter();
        while let Some(key) = rest.next() {
            arguments.read_option(OptionWords { key, rest: &mut rest })?;
        }
        Ok(arguments)
    }

    fn read_option(&mut self, mut words: OptionWords<'_, '_>) -> Result<(), OptionError> {
        match words.key {
            "contact" => {
                words.once(self.contact.is_some())?;
                let word = words.value("a law of contacts, or none")?;
                let unknown = || OptionError::ContactLaw { name: word.to_owned() };
                self.contact = Some(ContactLawName::of_key(word).ok_or_else(unknown)?);
                Ok(())
            }
            "kinematics" => words.fill(&mut self.mode, "finite, first-order, yade, or yade-ratcheting", named),
            "bond" => {
                words.once(self.creation.is_some())?;
                self.creation = Some(words.creation()?);
                Ok(())
            }
            "at" => words.fill(&mut self.at, "a step, 0 or later", |word| word.parse().ok().filter(|step| *step >= 0)),
            "reach" => words.fill(&mut self.reach, "a length in meters, positive", |word| {
                word.parse().ok().filter(|length: &f64| *length > 0.0 && length.is_finite())
            }),
            "energies" => words.fill(
                &mut self.sample_every_step,
                "output (sum stored energies when output is due) or every (at every step)",
                |word| ["output", "every"].iter().position(|known| *known == word).map(|k| k == 1),
            ),
            "deformable" => words.fill(&mut self.deformable, "solid, plane-strain, or plane-stress", named),
            "materials" => {
                words.fill(&mut self.materials_file, "a file with [[material]] tables", |word| Some(word.to_owned()))
            }
            _ => self.read_parameter(words),
        }
    }

    /// A parameter of the material, written inline.
    fn read_parameter(&mut self, mut words: OptionWords<'_, '_>) -> Result<(), OptionError> {
        let word = words.value("the value of the parameter")?;
        let [bond, contact, deformable] = &mut self.tables;
        let (table, name) = if let Some(name) = words.key.strip_prefix("contact.") {
            (contact, name)
        } else if let Some(name) = words.key.strip_prefix("deformable.") {
            (deformable, name)
        } else {
            (bond, words.key)
        };
        words.once(table.insert(name.to_owned(), toml_value(word)).is_some())?;
        self.first_parameter.get_or_insert_with(|| words.key.to_owned());
        Ok(())
    }
}

impl Options {
    /// Read the arguments that follow the style; `types` is the number of atom types.
    pub fn parse(words: &[String], types: usize) -> Result<Self, OptionError> {
        let name = words.first().map(String::as_str).unwrap_or_default();
        let law = match name {
            "none" => None,
            _ => Some(
                LawName::bonds()
                    .find(|law| law.key() == name)
                    .ok_or_else(|| OptionError::Law { name: name.to_owned() })?,
            ),
        };
        let mut arguments = Arguments::read(words.get(1..).unwrap_or_default())?;
        let contact = arguments.contact.unwrap_or_default();
        if law.is_none() {
            if contact == ContactLawName::NONE {
                return Err(OptionError::Nothing);
            }
            if !matches!(arguments.creation.get_or_insert(Creation::None), Creation::None) {
                return Err(OptionError::NoBondLaw);
            }
        }
        let (materials, interfaces) = match arguments.materials_file {
            Some(path) => {
                if let Some(key) = arguments.first_parameter {
                    return Err(OptionError::InlineAndFile { key });
                }
                read_materials(&path, types)?
            }
            None => (vec![inline_material(law, contact, arguments.tables)?; types], Vec::new()),
        };
        if arguments.deformable.is_some() {
            check_deformable(law, contact, &materials)?;
        }
        Ok(Self {
            deformable: arguments.deformable,
            law,
            contact,
            mode: arguments.mode.unwrap_or_default(),
            creation: arguments.creation.ok_or(OptionError::NoBonds)?,
            at: arguments.at,
            reach: arguments.reach.unwrap_or(0.0),
            sample_every_step: arguments.sample_every_step.unwrap_or(false),
            materials,
            interfaces,
        })
    }
}

/// Deformable particles need laws that deform them, and elastic constants.
fn check_deformable(law: Option<LawName>, contact: ContactLawName, materials: &[Material]) -> Result<(), OptionError> {
    let refused = [law, contact.law()].into_iter().flatten().find(|law| !law.facts().deforms);
    if let Some(law) = refused {
        return Err(OptionError::NotDeformable { law: law.key().to_owned() });
    }
    if materials.iter().all(|material| material.deformable.is_none()) {
        return Err(OptionError::NoElasticity);
    }
    Ok(())
}

fn read_materials(path: &str, types: usize) -> Result<(Vec<Material>, Vec<Interface>), OptionError> {
    let text = std::fs::read_to_string(path)
        .map_err(|error| OptionError::File { path: path.to_owned(), message: error.to_string() })?;
    let parameters = |message: String| OptionError::Parameters { place: path.to_owned(), message };
    let file: MaterialsFile = toml::from_str(&text).map_err(|error| parameters(error.to_string()))?;
    if file.material.len() != types {
        return Err(parameters(format!(
            "{} [[material]] tables, but the simulation has {types} atom types; one is wanted for each, in order",
            file.material.len()
        )));
    }
    Ok((file.material, file.interface))
}

/// The one material of parameters given in the script: those of bonds, of contacts, and of deformable particles. Without
/// bonds the first are those of contacts.
fn inline_material(
    law: Option<LawName>,
    contact: ContactLawName,
    tables: [toml::Table; 3],
) -> Result<Material, OptionError> {
    let mut material = toml::Table::new();
    material.insert("name".into(), toml::Value::String("all types".into()));
    // Masses are LIGGGHTS' own.
    material.insert("density".into(), toml::Value::Float(1.0));
    let [first, of_contacts, of_particles] = tables;
    if let Some(key) = of_contacts.keys().next()
        && (law.is_none() || contact.law().is_none() || contact.law() == law)
    {
        let message = if law.is_none() {
            format!("`contact.{key}`: without bonds parameters are those of contacts; write `{key}`")
        } else {
            format!(
                "`contact.{key}`: contacts of this law have no parameters of their own; remove it, or choose another law of \
                 contacts: {}",
                names(LawName::contacts().filter(|&other| Some(other) != law))
            )
        };
        return Err(OptionError::Parameters { place: format!("contact law {}", contact.key()), message });
    }
    let key = law.or(contact.law()).map_or("none", LawName::key);
    material.insert(key.into(), toml::Value::Table(first));
    if !of_particles.is_empty() {
        material.insert("deformable".into(), toml::Value::Table(of_particles));
    }
    if let (Some(_), Some(contact)) = (law, contact.law().filter(|&contact| Some(contact) != law)) {
        material.insert(contact.key().into(), toml::Value::Table(of_contacts));
    }
    material.try_into().map_err(|error: toml::de::Error| OptionError::Parameters {
        place: key.to_owned(),
        message: error.to_string().trim().replace('\n', "; "),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Options, String> {
        let words: Vec<String> = text.split_whitespace().map(str::to_owned).collect();
        Options::parse(&words, 2).map_err(|error| error.to_string())
    }

    #[test]
    fn inline_parameters_are_those_of_the_scenario() {
        let options = parse(
            "linear_bond normal_stiffness 1e6 shear_stiffness .5e6 bond distance 1.2 contact frictional \
             contact.normal_stiffness 2e6 contact.friction_coefficient 0.3 kinematics first-order at 10",
        )
        .unwrap();
        assert_eq!(options.law, Some(LawName::LinearBond));
        assert_eq!(options.materials.len(), 2);
        let bond = options.materials[1].linear_bond.as_ref().unwrap();
        assert_eq!(bond.shear_stiffness.si(), 0.5e6);
        assert_eq!(options.materials[0].frictional.as_ref().unwrap().friction_coefficient.si(), 0.3);
        assert_eq!(options.creation, Creation::Distance(1.2));
        assert_eq!((options.mode, options.at), (MotionMeasure::FirstOrder, Some(10)));
    }

    #[test]
    fn contacts_without_bonds_have_the_parameters() {
        let options = parse("none contact frictional normal_stiffness 2e6 friction_coefficient 0.3").unwrap();
        assert_eq!((options.law, options.creation), (None, Creation::None));
        assert_eq!(options.materials[1].frictional.as_ref().unwrap().friction_coefficient.si(), 0.3);
    }

    #[test]
    fn misuse_is_named_with_its_remedy() {
        for (text, wanted) in [
            ("", "unknown law ``"),
            ("hertz_mindlin", "laws of bonds are"),
            ("none", "nothing would act"),
            ("none contact frictional bond distance 1.2", "law `none` has none"),
            ("none contact frictional contact.normal_stiffness 1", "write `normal_stiffness`"),
            ("none contact hertz_mindlin young 1e7", "missing field `poisson`"),
            ("linear_bond bond distance", "needs a value after it: a factor"),
            ("linear_bond bond distance 20", "`bond 20` is not possible: a factor"),
            ("linear_bond normal_stiffness 1 shear_stiffness 1", "add `bond distance FACTOR`"),
            ("linear_bond normal_stiffness 1 bond none", "missing field `shear_stiffness`"),
            ("linear_bond normal_stiffness 1 shear_stiffness 1 colour red bond none", "unknown field `colour`"),
            ("linear_bond normal_stiffness 1 normal_stiffness 1 bond none", "given twice"),
            ("linear_bond contact glue bond none", "unknown law of contacts `glue`"),
            ("linear_bond bond list /no/such/file", "cannot read /no/such/file"),
            ("linear_bond deformable much bond none", "solid, plane-strain, or plane-stress"),
            ("linear_bond normal_stiffness 1 shear_stiffness 1 deformable solid bond none", "needs `deformable.young`"),
            ("linear_bond kinematics fast bond none", "finite, first-order, yade, or yade-ratcheting"),
            ("linear_bond normal_stiffness 1 materials /no/such bond none", "give one or the other"),
            ("linear_bond normal_stiffness 1 shear_stiffness 1 contact.x 1 bond none", "no parameters of their own"),
        ] {
            let message = parse(text).unwrap_err();
            assert!(message.contains(wanted), "{text}: {message}");
        }
    }
}
