//! Arguments of `fix ID group concordem/bond …`.

use std::collections::BTreeMap;

use concordem_contact::kinematics::MotionMeasure;
use concordem_contact::kinematics::deformable::Condition;
use concordem_contact::law::linear_bond::LinearBondTable;
use concordem_contact::law::{ContactLawName, Fault, LawName};
use concordem_contact::material::{Interface, Material};
use serde::Deserialize;
use serde::de::value::{Error as ValueError, StrDeserializer};
use serde::de::{DeserializeOwned, IntoDeserializer};

mod error;
mod heat;

pub use error::OptionError;
use error::names;
use heat::Beside;
pub use heat::HeatTables;

/// How bonds are created.
#[derive(Debug, Clone, PartialEq)]
pub enum Creation {
    /// Not at all, except from a restart file.
    None,
    /// Between all atoms of the group closer than this factor times the sum of their radii.
    Distance(f64),
    /// Within each clump that the host inserts, by the same rule.
    Clumps(f64),
    /// Between the atoms that this file lists.
    List(String),
}

/// Units of the host.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Units {
    /// The units of the laws; a value may have any unit.
    Si,
    /// Units in which force is mass times acceleration without a factor: `lj`, `cgs`, `micro`, `nano`. Values have no units.
    Consistent,
}

/// Parsed arguments of the fix.
#[derive(Debug, Clone)]
pub struct Options {
    /// Bond law; `None` if there are only unbonded contacts.
    pub law: Option<LawName>,
    /// Law of unbonded contacts between atoms of the group.
    pub contact: ContactLawName,
    /// Whether the script names it, possibly `none`.
    pub contact_given: bool,
    /// Whether contacts follow the exclusions of the host; `None` if the script does not say.
    pub follows_exclusions: Option<bool>,
    /// Kinematics.
    pub mode: MotionMeasure,
    /// How bonds are created.
    pub creation: Creation,
    /// Pairs of atom types (from 0, ascending) that `bond distance` bonds; `None`: all.
    pub between: Option<Vec<[u16; 2]>>,
    /// Most bonds that `bond distance` gives an atom, by its type; `None`: any number.
    pub limit: Option<Vec<u32>>,
    /// Step at which bonds are created; `None` for the first step of the run.
    pub at: Option<i64>,
    /// Data file with the bonds, contacts, and histories to continue with.
    pub state: Option<String>,
    /// Minimum reach given by the user, m; 0 if none.
    pub reach: f64,
    /// Whether stored energies are summed at every step instead of only when output is due.
    pub sample_every_step: bool,
    /// Condition of deformable particles; `None` if particles are rigid.
    pub deformable: Option<Condition>,
    /// Heat conduction; `None`: there is none.
    pub heat: Option<HeatTables>,
    /// Parameters by atom type.
    pub materials: Vec<Material>,
    /// Parameters of bonds by bond type; empty if they belong to atom types.
    pub bond_types: Vec<Material>,
    /// Parameters between types.
    pub interfaces: Vec<Interface>,
}

/// A materials file; the tables are those of a scenario.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MaterialsFile {
    material: Vec<Material>,
    #[serde(default)]
    interface: Vec<Interface>,
}

/// The value that a name in a file or script stands for.
pub(crate) fn named<T: DeserializeOwned>(name: &str) -> Option<T> {
    let deserializer: StrDeserializer<'_, ValueError> = name.into_deserializer();
    T::deserialize(deserializer).ok()
}

/// A word of the script as a TOML value: number, boolean, or string.
fn toml_value(word: &str) -> toml::Value {
    // Not TOML's parser, which rejects `.5`.
    if let Ok(number) = word.parse::<f64>() {
        return toml::Value::Float(number);
    }
    match word {
        "yes" | "true" | "on" => toml::Value::Boolean(true),
        "no" | "false" | "off" => toml::Value::Boolean(false),
        _ => toml::Value::String(word.to_owned()),
    }
}

/// Arguments before they are checked against each other.
#[derive(Default)]
struct Arguments {
    contact: Option<ContactLawName>,
    follows_exclusions: Option<bool>,
    mode: Option<MotionMeasure>,
    creation: Option<Creation>,
    between: Option<Vec<[u16; 2]>>,
    limit: Option<Vec<u32>>,
    at: Option<i64>,
    reach: Option<f64>,
    sample_every_step: Option<bool>,
    deformable: Option<Condition>,
    materials_file: Option<String>,
    state: Option<String>,
    heat_file: Option<String>,
    heat_network: Option<String>,
    /// Parameters of bonds, contacts, deformation, and heat.
    tables: [toml::Table; 4],
    /// Parameters of bonds by bond type.
    by_bond_type: BTreeMap<usize, toml::Table>,
    /// The first parameter that was given inline.
    first_parameter: Option<String>,
}

/// An option and the words that follow it.
struct OptionWords<'a, 'b> {
    key: &'a str,
    rest: &'b mut std::slice::Iter<'a, String>,
}

impl<'a> OptionWords<'a, '_> {
    fn value(&mut self, wanted: &'static str) -> Result<&'a str, OptionError> {
        let missing = OptionError::Missing { key: self.key.to_owned(), wanted };
        self.rest.next().map(String::as_str).ok_or(missing)
    }

    fn refuse(&self, value: &str, wanted: &'static str) -> OptionError {
        OptionError::Value { key: self.key.to_owned(), value: value.to_owned(), wanted }
    }

    /// Parse the next word into `slot`; an error if `slot` is already filled.
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

    /// `none`, `distance FACTOR`, `clumps FACTOR`, or `list FILE`.
    fn creation(&mut self) -> Result<Creation, OptionError> {
        const KINDS: &str = "distance FACTOR, clumps FACTOR, list FILE, or none";
        match self.value(KINDS)? {
            "none" => Ok(Creation::None),
            "distance" => self.factor().map(Creation::Distance),
            "clumps" => self.factor().map(Creation::Clumps),
            "list" => Ok(Creation::List(self.value("a file with two atom ids per line")?.to_owned())),
            other => Err(self.refuse(other, KINDS)),
        }
    }

    fn factor(&mut self) -> Result<f64, OptionError> {
        let mut factor = None;
        let wanted = "a factor on the sum of the radii, from 0.1 to 10 (1.5 is usual for concrete)";
        let in_range = |word: &str| word.parse().ok().filter(|f| (0.1..=10.0).contains(f));
        self.fill(&mut factor, wanted, in_range)?;
        Ok(factor.unwrap_or_default())
    }
}

/// `A-B`, two types from 1, as two types from 0, ascending.
fn type_pair(text: &str) -> Option<[u16; 2]> {
    let (a, b) = text.split_once('-')?;
    let from_0 = |word: &str| word.parse::<u16>().ok()?.checked_sub(1);
    let [a, b] = [from_0(a)?, from_0(b)?];
    Some([a.min(b), a.max(b)])
}

impl Arguments {
    /// Read the words after the law.
    fn read(words: &[String], types: usize) -> Result<Self, OptionError> {
        let mut arguments = Self::default();
        let mut rest = words.iter();
        while let Some(key) = rest.next() {
            arguments.read_option(OptionWords { key, rest: &mut rest })?;
        }
        if arguments.between.is_some() && !matches!(arguments.creation, Some(Creation::Distance(_))) {
            return Err(OptionError::BetweenWhat);
        }
        if let Some(limit) = &mut arguments.limit {
            if !matches!(arguments.creation, Some(Creation::Distance(_))) {
                return Err(OptionError::LimitOfWhat);
            }
            match limit[..] {
                [all] => *limit = vec![all; types],
                _ if limit.len() != types => return Err(OptionError::LimitTypes { given: limit.len(), types }),
                _ => {}
            }
        }
        if arguments.at.is_some() && matches!(arguments.creation, Some(Creation::Clumps(_))) {
            return Err(OptionError::ClumpsAt);
        }
        if let Some([a, b]) = arguments.between.iter().flatten().find(|[_, b]| usize::from(*b) >= types) {
            return Err(OptionError::NoSuchType { a: a + 1, b: b + 1, types });
        }
        Ok(arguments)
    }

    fn read_option(&mut self, mut words: OptionWords<'_, '_>) -> Result<(), OptionError> {
        match words.key {
            "contact" => {
                words.once(self.contact.is_some())?;
                let word = words.value("a contact law, or none")?;
                let unknown = || OptionError::ContactLaw { name: word.to_owned() };
                self.contact = Some(ContactLawName::of_key(word).ok_or_else(unknown)?);
                Ok(())
            }
            "exclude" => words.fill(
                &mut self.follows_exclusions,
                "follow (no contacts of pairs that the host excludes) or ignore",
                |word| ["ignore", "follow"].iter().position(|known| *known == word).map(|k| k == 1),
            ),
            "kinematics" => words.fill(&mut self.mode, "finite, first-order, yade, or yade-ratcheting", named),
            "bond" => {
                words.once(self.creation.is_some())?;
                self.creation = Some(words.creation()?);
                Ok(())
            }
            "between" => words.fill(&mut self.between, "pairs of atom types without spaces, such as 1-1,1-2", |word| {
                word.split(',').map(type_pair).collect()
            }),
            "limit" => words.fill(
                &mut self.limit,
                "a number of bonds per atom, or one number per atom type, such as 4,2",
                |word| word.split(',').map(|number| number.parse().ok().filter(|number| *number > 0)).collect(),
            ),
            "at" => {
                words.fill(&mut self.at, "a step number, 0 or more", |word| word.parse().ok().filter(|step| *step >= 0))
            }
            "reach" => words.fill(&mut self.reach, "a positive length in meters", |word| {
                word.parse().ok().filter(|length: &f64| *length > 0.0 && length.is_finite())
            }),
            "energies" => words.fill(
                &mut self.sample_every_step,
                "output (sum stored energies when output is due) or every (sum them at every step)",
                |word| ["output", "every"].iter().position(|known| *known == word).map(|k| k == 1),
            ),
            "deformable" => words.fill(&mut self.deformable, "solid, plane-strain, or plane-stress", named),
            "state" => words.fill(&mut self.state, "a file that write_data wrote", |word| Some(word.to_owned())),
            "heat" => words.fill(&mut self.heat_file, "a file with a table [heat]", |word| Some(word.to_owned())),
            "heat_network" => words.fill(
                &mut self.heat_network,
                "a file with the heat capacities of the atoms and the areas of their bonds",
                |word| Some(word.to_owned()),
            ),
            "materials" => {
                words.fill(&mut self.materials_file, "a file with [[material]] tables", |word| Some(word.to_owned()))
            }
            _ => self.read_parameter(words),
        }
    }

    /// With `state`, the bonds are those of the file.
    fn refuse_bonds_beside_state(&mut self) -> Result<(), OptionError> {
        if self.state.is_none() {
            return Ok(());
        }
        let creates = !matches!(self.creation.get_or_insert(Creation::None), Creation::None);
        match creates.then_some("bond").or_else(|| self.at.map(|_| "at")) {
            Some(key) => Err(OptionError::StateAndBonds { key }),
            None => Ok(()),
        }
    }

    /// Refuse what needs SI units.
    fn refuse_units(&self) -> Result<(), OptionError> {
        if self.heat_file.is_some() {
            return Err(OptionError::HeatUnits);
        }
        match self.tables.iter().chain(self.by_bond_type.values()).find_map(with_unit) {
            Some((key, value)) => Err(OptionError::Unit { place: String::new(), key, value }),
            None => Ok(()),
        }
    }

    /// Read an inline material parameter.
    fn read_parameter(&mut self, mut words: OptionWords<'_, '_>) -> Result<(), OptionError> {
        let word = words.value("the parameter's value")?;
        let [bond, contact, deformable, thermal] = &mut self.tables;
        let of_type = words.key.split_once('.').and_then(|(number, name)| Some((number.parse::<usize>().ok()?, name)));
        let (table, name) = if let Some((bond_type, name)) = of_type {
            (self.by_bond_type.entry(bond_type).or_default(), name)
        } else if let Some(name) = words.key.strip_prefix("contact.") {
            (contact, name)
        } else if let Some(name) = words.key.strip_prefix("deformable.") {
            (deformable, name)
        } else if let Some(name) = words.key.strip_prefix("thermal.") {
            (thermal, name)
        } else {
            (bond, words.key)
        };
        words.once(table.insert(name.to_owned(), toml_value(word)).is_some())?;
        self.first_parameter.get_or_insert_with(|| words.key.to_owned());
        Ok(())
    }
}

impl Options {
    /// Parse the arguments after the style name; `types` is the number of atom types.
    ///
    /// # Errors
    /// Invalid or contradictory arguments, or a file that cannot be read.
    pub fn parse(words: &[String], types: usize, units: Units) -> Result<Self, OptionError> {
        let name = words.first().map(String::as_str).unwrap_or_default();
        let law = match name {
            "none" => None,
            _ => Some(
                LawName::bonds()
                    .find(|law| law.key() == name)
                    .ok_or_else(|| OptionError::Law { name: name.to_owned() })?,
            ),
        };
        let mut arguments = Arguments::read(words.get(1..).unwrap_or_default(), types)?;
        if units == Units::Consistent {
            arguments.refuse_units()?;
        }
        let contact = arguments.contact.unwrap_or_default();
        if law.is_none() {
            if contact == ContactLawName::NONE {
                return Err(OptionError::Nothing);
            }
            if !matches!(arguments.creation.get_or_insert(Creation::None), Creation::None) {
                return Err(OptionError::NoBondLaw);
            }
        }
        arguments.refuse_bonds_beside_state()?;
        let (materials, interfaces) = match arguments.materials_file {
            Some(path) => {
                if let Some(key) = arguments.first_parameter {
                    return Err(OptionError::InlineAndFile { key });
                }
                read_materials(&path, types, units)?
            }
            None => (
                vec![inline_material(law, contact, arguments.tables, arguments.by_bond_type.is_empty())?; types],
                Vec::new(),
            ),
        };
        let bond_types = bond_types(law, contact, arguments.by_bond_type)?;
        if !bond_types.is_empty() && !matches!(arguments.creation, Some(Creation::None)) {
            return Err(OptionError::NoBondTypes);
        }
        check_tables(&bond_types, &[])?;
        check_tables(&materials, &interfaces)?;
        check_particles(law, contact, arguments.deformable.is_some(), &materials)?;
        if law == Some(LawName::LinearBond) && materials.iter().any(Material::expands) {
            check_expansion(if bond_types.is_empty() { &materials } else { &bond_types }, &interfaces)?;
        }
        let heat = HeatTables::read(
            arguments.heat_file.as_deref(),
            arguments.heat_network.as_deref(),
            &materials,
            &Beside {
                bond_law: law,
                contacts: contact != ContactLawName::NONE,
                deforms: arguments.deformable.is_some(),
            },
        )?;
        Ok(Self {
            heat,
            deformable: arguments.deformable,
            law,
            contact,
            contact_given: arguments.contact.is_some(),
            follows_exclusions: arguments.follows_exclusions,
            mode: arguments.mode.unwrap_or_default(),
            creation: arguments.creation.ok_or(OptionError::NoBonds)?,
            between: arguments.between,
            limit: arguments.limit,
            at: arguments.at,
            state: arguments.state,
            reach: arguments.reach.unwrap_or(0.0),
            sample_every_step: arguments.sample_every_step.unwrap_or(false),
            materials,
            bond_types,
            interfaces,
        })
    }
}

/// The keys of each table must agree, as in scenarios; and the hosts must support them.
fn check_tables(materials: &[Material], interfaces: &[Interface]) -> Result<(), OptionError> {
    let of_materials = materials.iter().flat_map(Material::tables);
    for (law, table) in of_materials.chain(interfaces.iter().flat_map(Interface::tables)) {
        if let Some(fault) = table.faults().into_iter().next() {
            let key = if fault.key.is_empty() { String::new() } else { format!("`{}`: ", fault.key) };
            let message = format!("{key}{}; {}", fault.message, fault.help);
            return Err(OptionError::Parameters { place: law.key().to_owned(), message });
        }
    }
    let with_failure =
        materials.iter().flat_map(Material::tables).find(|(_, table)| table.hydrostatic_strength().is_some());
    if let Some((law, _)) = with_failure {
        let message = "`hydrostatic_strength`: failure of whole particles is not available here; remove it, or use ConcorDEM's solver";
        return Err(OptionError::Parameters { place: law.key().to_owned(), message: message.to_owned() });
    }
    Ok(())
}

/// What particles that deform, and strengths that scatter, need of the laws and of each other.
fn check_particles(
    law: Option<LawName>,
    contact: ContactLawName,
    deforms: bool,
    materials: &[Material],
) -> Result<(), OptionError> {
    if deforms {
        check_deformable(law, contact, materials)?;
    }
    check_scatter(law, deforms, materials)
}

/// Strengths scatter only where bonds of the atom types have one, and between rigid particles.
fn check_scatter(law: Option<LawName>, deforms: bool, materials: &[Material]) -> Result<(), OptionError> {
    let place = "strength_scatter".to_owned();
    if deforms && materials.iter().any(|material| material.strength_scatter.is_some()) {
        let message = "not with deformable particles; remove one of the two".to_owned();
        return Err(OptionError::Parameters { place, message });
    }
    let of_field = |material: &Material| {
        material.strength_scatter.as_ref().is_some_and(|scatter| scatter.correlation_length.is_some())
    };
    if materials.iter().any(of_field) {
        let message = "`correlation_length`: atoms do not know their places at the start; remove the key, or use the solver of ConcorDEM";
        return Err(OptionError::Parameters { place, message: message.to_owned() });
    }
    let Some(fault) = materials.iter().flat_map(|material| material.faults_of_scatter(law)).next() else {
        return Ok(());
    };
    let key = if fault.key.is_empty() { String::new() } else { format!("`{}`: ", fault.key) };
    Err(OptionError::Parameters { place, message: format!("{key}{}; {}", fault.message, fault.help) })
}

/// Bonds that expand need a length at which they are without force.
fn check_expansion(of_bonds: &[Material], interfaces: &[Interface]) -> Result<(), OptionError> {
    let tables = of_bonds.iter().map(|material| &material.linear_bond);
    let mut tables = tables.chain(interfaces.iter().map(|interface| &interface.linear_bond)).flatten();
    let Some(Fault { key, message, help, .. }) = tables.find_map(LinearBondTable::fault_of_expansion) else {
        return Ok(());
    };
    let message = format!("`{key}`: {message}; {help}");
    Err(OptionError::Parameters { place: LawName::LinearBond.key().to_owned(), message })
}

/// Deformable particles need laws that support them, and elastic constants.
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

/// The first value with a unit, and its key.
fn with_unit(table: &toml::Table) -> Option<(String, String)> {
    table.iter().find_map(|(key, value)| match value {
        toml::Value::String(text) if text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) => {
            Some((key.clone(), text.clone()))
        }
        toml::Value::Table(inner) => with_unit(inner),
        toml::Value::Array(all) => all.iter().filter_map(toml::Value::as_table).find_map(with_unit),
        _ => None,
    })
}

fn read_materials(path: &str, types: usize, units: Units) -> Result<(Vec<Material>, Vec<Interface>), OptionError> {
    let text = std::fs::read_to_string(path)
        .map_err(|error| OptionError::File { path: path.to_owned(), message: error.to_string() })?;
    let parameters = |message: String| OptionError::Parameters { place: path.to_owned(), message };
    let file: MaterialsFile = toml::from_str(&text).map_err(|error| parameters(error.to_string()))?;
    if units == Units::Consistent
        && let Some((key, value)) = toml::from_str(&text).ok().and_then(|table| with_unit(&table))
    {
        return Err(OptionError::Unit { place: format!("{path}: "), key, value });
    }
    if file.material.len() != types {
        return Err(parameters(format!(
            "{} [[material]] tables for {types} atom types; give one table per atom type, in order",
            file.material.len()
        )));
    }
    if let Some(interface) = file.interface.iter().find(|one| one.between[0] == one.between[1]) {
        return Err(parameters(format!(
            "the [[interface]] between `{0}` and `{0}` has no effect: only scenarios with [aggregates] have interfaces within a \
             material; give the parameters in the [[material]]",
            interface.between[0]
        )));
    }
    Ok((file.material, file.interface))
}

/// Parameters of bonds by bond type, from 1 on.
fn bond_types(
    law: Option<LawName>,
    contact: ContactLawName,
    tables: BTreeMap<usize, toml::Table>,
) -> Result<Vec<Material>, OptionError> {
    let Some(law) = law else { return Ok(Vec::new()) };
    let wrong = |message: String| OptionError::Parameters { place: law.key().to_owned(), message };
    if !tables.is_empty() && contact.law() == Some(law) {
        let others = names(LawName::contacts().filter(|&other| other != law));
        return Err(wrong(format!(
            "contacts of law {0} take the parameters of its bonds, which here belong to bond types; choose another contact law: {others}",
            law.key()
        )));
    }
    let mut all = Vec::new();
    for (expected, (bond_type, table)) in (1..).zip(tables) {
        if bond_type != expected {
            return Err(wrong(format!(
                "bond type {expected} has no parameters; add `bond_coeff {expected} KEY VALUE ...`"
            )));
        }
        let mut material = material_table(&format!("bond type {bond_type}"));
        material.insert(law.key().into(), toml::Value::Table(table));
        let of_type = |error: toml::de::Error| {
            wrong(format!("bond type {bond_type}: {}", error.to_string().trim().replace('\n', "; ")))
        };
        all.push(material.try_into().map_err(of_type)?);
    }
    Ok(all)
}

/// A material with this name and no laws.
fn material_table(name: &str) -> toml::Table {
    let mut material = toml::Table::new();
    material.insert("name".into(), toml::Value::String(name.to_owned()));
    // Unused: masses come from the host.
    material.insert("density".into(), toml::Value::Float(1.0));
    material
}

/// The material given inline in the script. `tables`: parameters of bonds (of contacts if there is no bond law), of contacts, and of
/// deformable particles; thermal constants. `with_bonds`: parameters of bonds belong to atom types.
fn inline_material(
    law: Option<LawName>,
    contact: ContactLawName,
    tables: [toml::Table; 4],
    with_bonds: bool,
) -> Result<Material, OptionError> {
    let mut material = material_table("all types");
    let [first, of_contacts, of_particles, thermal] = tables;
    if let Some(key) = of_contacts.keys().next()
        && (law.is_none() || contact.law().is_none() || contact.law() == law)
    {
        let message = if law.is_none() {
            format!("`contact.{key}`: without a bond law, contact parameters have no prefix; write `{key}`")
        } else {
            format!(
                "`contact.{key}`: this contact law has no parameters of its own; remove it, or choose another contact law: {}",
                names(LawName::contacts().filter(|&other| Some(other) != law))
            )
        };
        return Err(OptionError::Parameters { place: format!("contact law {}", contact.key()), message });
    }
    let key = law.or(contact.law()).map_or("none", LawName::key);
    if with_bonds {
        material.insert(key.into(), toml::Value::Table(first));
    } else if let Some(key) = first.keys().next() {
        let message = format!("`{key}` belongs to no bond type; give all parameters by bond type, or none");
        return Err(OptionError::Parameters { place: law.map_or("none", LawName::key).to_owned(), message });
    }
    if !of_particles.is_empty() {
        material.insert("deformable".into(), toml::Value::Table(of_particles));
    }
    if !thermal.is_empty() {
        material.insert("thermal".into(), toml::Value::Table(thermal));
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
mod tests;
