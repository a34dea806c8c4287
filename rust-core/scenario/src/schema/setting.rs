//! Keys given on the command line (`--set KEY=VALUE`) or from Python, which replace those of a scenario file.

use std::ops::Range;
use std::sync::Arc;

use super::large::{protect, protect_value, restore};
use toml_edit::{Array, DocumentMut, InlineTable, Item, Table, Value};

/// A key with its value, which replaces or adds a key of a scenario.
///
/// ```
/// use concordem_scenario::schema::{Scenario, Setting};
///
/// let text = "[packing]\nradius = \"1 mm\" # small\n";
/// let settings = [Setting::parse("packing.radius=2 mm")?, Setting::parse("packing.seed=3")?];
/// let changed = Setting::apply(text, &settings)?;
/// assert_eq!(changed, "[packing]\nradius = \"2 mm\" # small\nseed = 3\n");
/// # Ok::<(), String>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Setting {
    /// Key path, such as `material[0].cpm.young`.
    pub key: String,
    /// Value as TOML.
    pub value: String,
    /// The whole as given, such as `packing.radius=2 mm`.
    pub given: String,
    /// Where it was given.
    pub door: Door,
}

/// Where a user gives settings; messages show them as they were given there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Door {
    /// `--set KEY=VALUE`.
    CommandLine,
    /// `with_settings({"KEY": VALUE})`.
    Python,
}

impl Door {
    /// What stands before a setting, between its key and its value, and after it.
    fn frame(self) -> [&'static str; 3] {
        match self {
            Self::CommandLine => ["--set ", "=", ""],
            Self::Python => ["with_settings({", ": ", "})"],
        }
    }

    /// Name of the place, where others have the name of a file.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::CommandLine => "command line",
            Self::Python => "with_settings",
        }
    }
}

/// The text of a scenario file before settings were applied, and the settings.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Given {
    /// Text of the file.
    pub text: Arc<str>,
    /// The settings.
    pub settings: Vec<Setting>,
}

/// A step on the way to a value.
enum Step<'a> {
    Key(&'a str),
    /// An item of a list, by number or by name.
    Item(&'a str),
}

impl Setting {
    /// Reads `KEY=VALUE`. The value is TOML; words and quantities need no quotes (`bonds.law=cpm`, `packing.radius=2 mm`).
    ///
    /// # Errors
    /// There is no `=`, or no key.
    pub fn parse(text: &str) -> Result<Self, String> {
        let Some((key, value)) = text.split_once('=') else {
            return Err(format!("write = and the value without a space: {text}=\"2 mm\""));
        };
        let (key, value) = (key.trim(), value.trim());
        if key.is_empty() || value.is_empty() {
            return Err("write a key and a value: packing.radius=\"2 mm\"".to_owned());
        }
        let is_toml = protect_value(value).parse::<Value>().is_ok();
        let value = if is_toml { value.to_owned() } else { Value::from(value).to_string() };
        Ok(Self { key: key.to_owned(), value, given: text.to_owned(), door: Door::CommandLine })
    }

    /// An entry of a Python dictionary: a key with a value in TOML, in which strings need quotes, unlike in [`Self::parse`]; `shown`: the
    /// value as Python writes it.
    ///
    /// # Errors
    /// The key is empty.
    pub fn of_python(key: &str, value: String, shown: &str) -> Result<Self, String> {
        let key = key.trim();
        if key.is_empty() {
            return Err("a setting has an empty key; write it like packing.radius".to_owned());
        }
        Ok(Self { key: key.to_owned(), value, given: format!("\"{key}\": {shown}"), door: Door::Python })
    }

    /// As messages show it: with the door at which it was given, such as `--set packing.radius=2 mm`.
    pub fn shown(&self) -> String {
        let [before, _, after] = self.door.frame();
        format!("{before}{}{after}", self.given)
    }

    /// Range of the key or of the value in [`Self::shown`].
    pub(super) fn place(&self, of_key: bool) -> Range<usize> {
        let [before, between, _] = self.door.frame();
        let end = self.given.find(between).unwrap_or(0);
        let (start, end) = if of_key { (0, end) } else { (end + between.len(), self.given.len()) };
        before.len() + start..before.len() + end
    }

    /// The text of a scenario with these settings; everything else, also comments, stays as it is.
    ///
    /// # Errors
    /// The text is not TOML, or a key leads into a value that is not a table. The message names the setting.
    pub fn apply(text: &str, settings: &[Self]) -> Result<String, String> {
        Ok(Self::apply_located(text, settings)?.0)
    }

    /// Like [`Self::apply`]; also the settings with keys as problems name them: `material[0].density` for `material.density` and
    /// `material[concrete].density`.
    pub(crate) fn apply_located(text: &str, settings: &[Self]) -> Result<(String, Vec<Self>), String> {
        let mut document: DocumentMut =
            protect(text).parse().map_err(|error: toml_edit::TomlError| error.to_string())?;
        let mut located = Vec::new();
        for setting in settings {
            let key = setting.put(document.as_table_mut());
            let key = key.map_err(|problem| format!("{}: {problem}", setting.shown()))?;
            located.push(Self { key, ..setting.clone() });
        }
        Ok((restore(&document.to_string()), located))
    }

    fn steps(&self) -> Vec<Step<'_>> {
        let mut steps = Vec::new();
        for segment in self.key.split('.') {
            let mut parts = segment.split(['[', ']']).map(str::trim).filter(|part| !part.is_empty());
            match parts.next() {
                Some(number) if number.bytes().all(|byte| byte.is_ascii_digit()) => steps.push(Step::Item(number)),
                Some(key) => steps.push(Step::Key(key)),
                None => {}
            }
            steps.extend(parts.map(Step::Item));
        }
        steps
    }

    /// Puts the value into a document; returns the key with the number of every item.
    fn put(&self, root: &mut Table) -> Result<String, String> {
        let value: Value =
            protect_value(&self.value).parse().map_err(|error: toml_edit::TomlError| error.message().to_owned())?;
        let steps = self.steps();
        let mut place = Place::Table(root);
        let mut path = String::new();
        for (k, step) in steps.iter().enumerate() {
            let last = k + 1 == steps.len();
            place = match step {
                Step::Key(key) => {
                    path += if place.is_list() { "[0]" } else { "" };
                    path += if path.is_empty() { "" } else { "." };
                    path += key;
                    place.enter(key, last)?
                }
                Step::Item(name) => {
                    path += &place.number_of(name).map_or_else(|| format!("[{name}]"), |at| format!("[{at}]"));
                    place.pick(name)?
                }
            };
        }
        place.replace(value)?;
        Ok(path)
    }

    /// Whether the key path `key` is the key of this setting, or lies in its value.
    pub fn causes(&self, key: &str) -> bool {
        let plain = |path: &str| path.replace('[', ".").replace(']', "");
        let (own, key) = (plain(&self.key), plain(key));
        key == own || key.strip_prefix(&own).is_some_and(|rest| rest.starts_with('.'))
    }
}

impl Given {
    /// The setting that a problem at the key path `key` comes from; `missing`: the file has no such key.
    pub(super) fn cause(&self, key: &str, missing: bool) -> Option<&Setting> {
        // The last one wins, as in the text.
        let same = self.settings.iter().rev().find(|setting| setting.causes(key));
        // A table that only the setting has made.
        let made =
            || self.settings.iter().rev().find(|s| missing && !key.is_empty() && s.key.starts_with(&format!("{key}.")));
        same.or_else(made)
    }
}

/// A place in a document: a table, a list, or a value.
enum Place<'a> {
    Table(&'a mut Table),
    Inline(&'a mut InlineTable),
    Item(&'a mut Item),
    List(&'a mut Array),
    Value(&'a mut Value),
}

const NO_TABLE: &str = "the key leads into a value that is not a table";

impl<'a> Place<'a> {
    /// The place of a key of this table. A missing key is added: a value if it is the `last` one, otherwise a table.
    fn enter(self, key: &str, last: bool) -> Result<Place<'a>, String> {
        let place = self.only_item(key)?;
        match place {
            Place::Table(table) => {
                let fresh = if last { Item::None } else { Item::Table(Table::new()) };
                Ok(Place::of_item(table.entry(key).or_insert(fresh)))
            }
            Place::Inline(table) => {
                let fresh = if last { Value::from(0) } else { Value::InlineTable(InlineTable::new()) };
                Ok(Place::of_value(table.entry(key).or_insert(fresh)))
            }
            _ => Err(NO_TABLE.to_owned()),
        }
    }

    /// If this is a list with a single table, that table: `material.density` means `material[0].density`.
    fn only_item(self, key: &str) -> Result<Place<'a>, String> {
        let count = match &self {
            Place::Item(Item::ArrayOfTables(list)) => list.len(),
            Place::List(list) => list.len(),
            _ => return Ok(self),
        };
        if count == 1 {
            self.pick("0")
        } else {
            Err(format!("there are {count} items; write [0] or the name before `.{key}`"))
        }
    }

    fn is_list(&self) -> bool {
        matches!(self, Place::Item(Item::ArrayOfTables(_)) | Place::List(_))
    }

    /// Number of an item of a list, from its number or its key `name`.
    fn number_of(&self, which: &str) -> Option<usize> {
        if let Ok(number) = which.parse() {
            return Some(number);
        }
        match self {
            Place::Item(Item::ArrayOfTables(list)) => {
                list.iter().position(|table| table.get("name").and_then(Item::as_str) == Some(which))
            }
            Place::List(list) => list.iter().position(|value| {
                value.as_inline_table().and_then(|table| table.get("name")).and_then(Value::as_str) == Some(which)
            }),
            _ => None,
        }
    }

    /// An item of a list, by number or by its key `name`.
    fn pick(self, which: &str) -> Result<Place<'a>, String> {
        let at = self.number_of(which);
        let none = |count: usize| format!("there is no item `{which}`; there are {count}, counted from 0");
        match self {
            Place::Item(Item::ArrayOfTables(list)) => {
                let count = list.len();
                at.and_then(|at| list.get_mut(at)).map(Place::Table).ok_or_else(|| none(count))
            }
            Place::List(list) => {
                let count = list.len();
                at.and_then(|at| list.get_mut(at)).map(Place::of_value).ok_or_else(|| none(count))
            }
            _ => Err("the key before the brackets is not a list".to_owned()),
        }
    }

    fn of_item(item: &'a mut Item) -> Self {
        match item {
            Item::Table(table) => Self::Table(table),
            Item::Value(_) => match item {
                Item::Value(value) => Self::of_value(value),
                other => Self::Item(other),
            },
            other => Self::Item(other),
        }
    }

    fn of_value(value: &'a mut Value) -> Self {
        match value {
            Value::InlineTable(table) => Self::Inline(table),
            Value::Array(list) => Self::List(list),
            other => Self::Value(other),
        }
    }

    /// Puts a value here; the comment after the old one stays.
    fn replace(self, mut new: Value) -> Result<(), String> {
        match self {
            Place::Value(old) => {
                *new.decor_mut() = old.decor().clone();
                *old = new;
            }
            Place::List(old) => {
                *new.decor_mut() = old.decor().clone();
                // A list can only be replaced by a list in place.
                let Value::Array(list) = new else { return Err("the key is a list; write [...]".to_owned()) };
                *old = list;
            }
            Place::Inline(old) => {
                *new.decor_mut() = old.decor().clone();
                let Value::InlineTable(table) = new else {
                    return Err("the key is a table; write { ... }, or set one of its keys".to_owned());
                };
                *old = table;
            }
            Place::Item(item @ Item::None) => *item = Item::Value(new),
            Place::Table(old) => {
                let Value::InlineTable(table) = new else {
                    return Err("the key is a table; write { ... }, or set one of its keys".to_owned());
                };
                old.clear();
                table.into_iter().for_each(|(key, value)| drop(old.insert(&key, Item::Value(value))));
            }
            Place::Item(item) => {
                if !new.is_array() {
                    return Err("the key is a list of tables; write [{ ... }], or set a key of one".to_owned());
                }
                *item = Item::Value(new);
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# head\nversion = 1\n[packing]\nkind = \"spheres\" # listed\nspheres = [[0, 0, 0, 1]]\n\n[[material]]\n\
                        name = \"a\"\ncpm = { young = 1e9 } # law\n[[material]]\nname = \"b\"\ndensity = 1 # kg/m^3\n";

    fn changed(settings: &[&str]) -> Result<String, String> {
        let settings: Vec<Setting> = settings.iter().map(|text| Setting::parse(text).unwrap()).collect();
        Setting::apply(TEXT, &settings)
    }

    #[test]
    fn values_are_replaced_and_the_rest_stays() {
        let text = changed(&[
            "material[0].cpm.young=25 GPa",
            "material[b].density=2500",
            "packing.spheres[0][3]=0.5",
            "output.csv=true",
            "stop.strain = 1e-3",
        ])
        .unwrap();
        let expected = TEXT
            .replace("young = 1e9", "young = \"25 GPa\"")
            .replace("density = 1 #", "density = 2500 #")
            .replace("0, 0, 0, 1", "0, 0, 0, 0.5")
            + "\n[output]\ncsv = true\n\n[stop]\nstrain = 1e-3\n";
        assert_eq!(text, expected);
    }

    /// Seeds may have 64 bits.
    #[test]
    fn large_integers_stay_and_are_set() {
        let text = "seed = 18446744073709551615\nradius = 1\n";
        let set = |setting: &str| Setting::apply(text, &[Setting::parse(setting).unwrap()]).unwrap();
        assert_eq!(set("radius=2"), "seed = 18446744073709551615\nradius = 2\n");
        assert_eq!(set("seed=9223372036854775808"), "seed = 9223372036854775808\nradius = 1\n");
        assert_eq!(set("seeds=[9223372036854775808]"), format!("{text}seeds = [9223372036854775808]\n"));
    }

    /// A table is replaced as a whole, and so is a list of tables.
    #[test]
    fn tables_are_replaced_as_a_whole() {
        let text = changed(&[
            "packing={kind=\"file\", path=\"a b.txt\", shape={kind=\"periodic\"}}",
            "material=[{name=\"c\", density=3}]",
            "stop={steps=1}",
        ])
        .unwrap();
        let table: toml::Table = toml::from_str(&text).unwrap();
        let expected = "version = 1\nmaterial = [{ name = \"c\", density = 3 }]\n[packing]\nkind = \"file\"\npath = \"a b.txt\"\n\
                        shape = { kind = \"periodic\" }\n[stop]\nsteps = 1\n";
        assert_eq!(table, toml::from_str::<toml::Table>(expected).unwrap(), "{text}");
    }

    #[test]
    fn wrong_keys_are_refused_with_the_setting() {
        for (setting, message) in [
            ("material.density=1", "there are 2 items"),
            ("material[5].density=1", "there is no item `5`; there are 2"),
            ("material[c].density=1", "there is no item `c`"),
            ("version.a=1", "not a table"),
            ("packing=1", "set one of its keys"),
            ("material=1", "list of tables"),
        ] {
            let error = changed(&[setting]).expect_err(setting);
            assert!(error.starts_with(&format!("--set {setting}: ")) && error.contains(message), "{error}");
        }
        for wrong in ["packing.radius", "=3", "a="] {
            assert!(Setting::parse(wrong).is_err(), "{wrong}");
        }
    }

    /// Messages show a setting as it was given, and point to its key or its value.
    #[test]
    fn each_door_shows_settings_as_they_were_given() {
        let parsed = Setting::parse("packing.radius=2 mm").unwrap();
        let python = Setting::of_python("packing.radius", "\"2 mm\"".to_owned(), "'2 mm'").unwrap();
        for (setting, shown, key, value) in [
            (parsed, "--set packing.radius=2 mm", "packing.radius", "2 mm"),
            (python, "with_settings({\"packing.radius\": '2 mm'})", "\"packing.radius\"", "'2 mm'"),
        ] {
            let text = setting.shown();
            assert_eq!((&text[..], &text[setting.place(true)], &text[setting.place(false)]), (shown, key, value));
        }
    }
}
