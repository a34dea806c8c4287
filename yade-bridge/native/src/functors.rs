//! C++ classes of YADE for laws without hand-written ones: material, physics, the functor that makes it, and the law.
//!
//! They are generated from the law's own declarations: the keys of its table ([`RegisteredLaw::Table`]) become attributes of the
//! material, the fields of its history attributes of the physics. What the classes do is in `shim/law.hpp`.

use std::collections::BTreeSet;
use std::fmt::Write;

use concordem_contact::law::{self, Field, LawFacts, LawName, RegisteredLaw};
use serde_json::Value;

/// Parameters among the attributes that the base of materials has, and the others.
const OF_BASE: [&str; 4] = ["young", "poisson", "frictionAngle", "density"];
const OTHERS_OF_BASE: [&str; 2] = ["id", "label"];

/// How an attribute holds a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// Not a number: left out.
    Real,
    /// Always written.
    Truth,
    /// A word, or a value in TOML; empty: left out.
    Text,
}

/// A key of a table.
struct Key {
    name: String,
    attribute: String,
    kind: Kind,
    default: String,
    description: String,
    /// Whether the base has the attribute.
    inherited: bool,
}

/// A law to make classes for.
struct Law {
    facts: &'static LawFacts,
    /// Its Rust type, with which names of classes begin.
    name: &'static str,
    keys: Vec<Key>,
}

/// `normal_stiffness` → `normalStiffness`.
fn camel(name: &str) -> String {
    let mut words = name.split('_');
    let first = words.next().unwrap_or_default().to_owned();
    words.fold(first, |joined, word| {
        let (head, tail) = word.split_at(word.len().min(1));
        joined + &head.to_uppercase() + tail
    })
}

/// A string of C++.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', " "))
}

/// Whether a schema, or one of its alternatives, passes a test.
fn any(schema: &Value, test: &dyn Fn(&Value) -> bool) -> bool {
    let alternatives = ["anyOf", "oneOf", "allOf"].into_iter().filter_map(|name| schema[name].as_array()).flatten();
    test(schema) || alternatives.into_iter().any(|one| any(one, test))
}

fn kind(schema: &Value) -> Kind {
    let is = |wanted: &'static str| {
        move |one: &Value| {
            one["type"] == wanted || one["type"].as_array().is_some_and(|types| types.iter().any(|t| t == wanted))
        }
    };
    if any(schema, &|one| one["x-dimension"].is_string()) || any(schema, &is("number")) || any(schema, &is("integer")) {
        Kind::Real
    } else if schema["type"] == "boolean" {
        Kind::Truth
    } else {
        Kind::Text
    }
}

/// The keys of the table of a law.
fn keys<L: RegisteredLaw>() -> Vec<Key> {
    let schema = schemars::schema_for!(L::Table).to_value();
    let required: BTreeSet<&str> =
        schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    let properties = schema["properties"].as_object();
    let key = |(key, schema): (&String, &Value)| {
        let kind = kind(schema);
        let mut attribute = camel(key);
        let inherited = OF_BASE.contains(&attribute.as_str()) && required.contains(key.as_str());
        let clashes = OF_BASE.iter().chain(&OTHERS_OF_BASE).any(|name| *name == attribute);
        if clashes && !inherited {
            attribute = camel(&format!("{}_{key}", L::NAME));
        }
        let left_out = match (kind, &schema["default"]) {
            (Kind::Truth, _) => String::new(),
            _ if required.contains(key.as_str())
                || schema["description"].as_str().is_some_and(|text| text.contains("left out")) =>
            {
                String::new()
            }
            (_, Value::Null) => " May be left out.".to_owned(),
            (_, default) => format!(" {default} when left out."),
        };
        Key {
            name: key.clone(),
            attribute,
            kind,
            default: match kind {
                Kind::Real => "NaN".to_owned(),
                Kind::Truth => schema["default"].as_bool().unwrap_or_default().to_string(),
                Kind::Text => "\"\"".to_owned(),
            },
            description: schema["description"].as_str().unwrap_or_default().to_owned() + &left_out,
            inherited,
        }
    };
    properties.into_iter().flatten().map(key).collect()
}

macro_rules! laws {
    ($($key:ident: $Law:ident,)*) => {
        vec![$(Law { facts: LawName::$Law.facts(), name: stringify!($Law), keys: keys::<law::$key::$Law>() }),*]
    };
}

/// The name of C++ classes of the type of a law, bases first.
fn classes(law: &Law) -> [String; 4] {
    let name = law.name;
    [
        format!("{name}Mat_Rust"),
        format!("{name}Phys_Rust"),
        format!("Ip2_{name}Mat_{name}Mat_{name}Phys_Rust"),
        format!("Law2_ScGeom_{name}Phys_Rust"),
    ]
}

/// Type and initial value of a field of a history.
fn field_type(field: &Field) -> [&'static str; 2] {
    if field.components == 3 { ["Vector3r", "Vector3r::Zero()"] } else { ["Real", "0"] }
}

fn attribute_of(field: &Field) -> String {
    camel(&format!("history_{}", field.name))
}

impl Law {
    fn material(&self, out: &mut String) -> std::fmt::Result {
        let [material, ..] = classes(self);
        let own = self.keys.iter().filter(|key| !key.inherited);
        writeln!(out, "class {material} : public FrictMat {{\npublic:\n\tvirtual ~{material}() = default;")?;
        writeln!(out, "\tstring table() const;\n\tYADE_CLASS_BASE_DOC_ATTRS_CTOR({material}, FrictMat,")?;
        let about = format!(
            "Parameters of the {} of ConcorDEM; names and meanings as in a scenario. The attributes of FrictMat are those of \
             contacts by YADE's own rule.",
            self.facts.title
        );
        writeln!(out, "\t\t{},", quoted(&about))?;
        for key in own {
            let of = match key.kind {
                Kind::Real => "Real",
                Kind::Truth => "bool",
                Kind::Text => "string",
            };
            writeln!(out, "\t\t(({of},{},{},,{}))", key.attribute, key.default, quoted(&key.description))?;
        }
        writeln!(out, "\t\t,\n\t\tcreateIndex();\n\t);\n\tREGISTER_CLASS_INDEX({material}, FrictMat);\n}};")?;
        writeln!(out, "REGISTER_SERIALIZABLE({material});\n")
    }

    fn history(&self) -> &'static [Field] {
        if self.facts.as_bond.is_some() { self.facts.history } else { self.facts.unbonded_history }
    }

    fn physics(&self, out: &mut String) -> std::fmt::Result {
        let [_, physics, ..] = classes(self);
        let width: usize = self.history().iter().map(|field| field.components).sum();
        writeln!(out, "class {physics} : public LawPhys_Rust {{\npublic:\n\tvirtual ~{physics}() = default;")?;
        writeln!(out, "\tstatic constexpr int width = {width};")?;
        writeln!(out, "\tvoid write(double*) const;\n\tvoid take(const double*);")?;
        writeln!(out, "\tYADE_CLASS_BASE_DOC_ATTRS_CTOR({physics}, LawPhys_Rust,")?;
        writeln!(out, "\t\t{},", quoted(&format!("A {} with its history.", self.facts.title)))?;
        for field in self.history() {
            let [of, zero] = field_type(field);
            let about = quoted(&format!("History: {} ({})", field.description.trim(), field.unit));
            writeln!(out, "\t\t(({of},{},{zero},(Attr::readonly),{about}))", attribute_of(field))?;
        }
        writeln!(out, "\t\t,\n\t\tcreateIndex();\n\t);\n\tREGISTER_CLASS_INDEX({physics}, LawPhys_Rust);\n}};")?;
        writeln!(out, "REGISTER_SERIALIZABLE({physics});\n")
    }

    fn maker(&self, out: &mut String) -> std::fmt::Result {
        let [material, physics, maker, law] = classes(self);
        let bonds = self.facts.as_bond.is_some();
        writeln!(
            out,
            "class {maker} : public Ip2_FrictMat_FrictMat_FrictPhys {{\n\tReal countedRadius = NaN;\n\npublic:"
        )?;
        writeln!(out, "\tLastLook last;\n\tvoid look() {{ countedRadius = NaN; }}")?;
        if !bonds {
            writeln!(out, "\tstatic constexpr long cohesiveThresholdIter = -1;")?;
        }
        writeln!(
            out,
            "\tstring make(const Interaction&, const {material}& one, const {material}& two, {physics}& phys)\n\t{{"
        )?;
        writeln!(
            out,
            "\t\treturn makeLaw(*scene, \"{}\", {bonds}, countedRadius, one, two, phys);\n\t}}",
            self.facts.key
        )?;
        writeln!(
            out,
            "\tvoid go(const shared_ptr<Material>& one, const shared_ptr<Material>& two, const shared_ptr<Interaction>& I) override\n\t{{"
        )?;
        writeln!(
            out,
            "\t\tmakeBondOrContact<{law}, {physics}, {material}>(*this, \"{}\", one, two, I);\n\t}}",
            self.facts.title
        )?;
        writeln!(out, "\tFUNCTOR2D({material}, {material});")?;
        writeln!(out, "\tYADE_CLASS_BASE_DOC_ATTRS({maker}, Ip2_FrictMat_FrictMat_FrictPhys,")?;
        let about = if bonds {
            format!(
                "Joins spheres of {material} by the {} until iteration cohesiveThresholdIter (negative: always). Later, and where \
                 a facet or another shape takes part, it makes the FrictPhys of its base class, for which InteractionLoop needs a \
                 law such as Law2_ScGeom_FrictPhys_CundallStrack.",
                self.facts.title
            )
        } else {
            format!(
                "Makes the {} between spheres of {material}; where a facet or another shape takes part, the FrictPhys of its base \
                 class, for which InteractionLoop needs a law such as Law2_ScGeom_FrictPhys_CundallStrack.",
                self.facts.title
            )
        };
        writeln!(out, "\t\t{},", quoted(&about))?;
        if bonds {
            writeln!(
                out,
                "\t\t((long,cohesiveThresholdIter,10,,\"Iteration until which new contacts are bonds; negative: always.\"))"
            )?;
        }
        writeln!(
            out,
            "\t\t((string,error,,(Attr::noSave|Attr::readonly),\"What stopped the run; empty if nothing did.\"))\n\t);\n}};"
        )?;
        writeln!(out, "REGISTER_SERIALIZABLE({maker});\n")
    }

    fn functor(&self, out: &mut String) -> std::fmt::Result {
        let [_, physics, _, law] = classes(self);
        let key = camel(self.facts.key);
        let contact = format!("LawContactOf<{physics}>");
        writeln!(out, "class {law} : public LawFunctor {{")?;
        let names = ["Damage", "Friction", "Viscous", "Integration", "Elastic"].map(|name| format!("\"{key}{name}\""));
        writeln!(out, "\tLawEnergies energies {{ {} }};\n\npublic:", names.join(", "))?;
        writeln!(out, "\tstring fill({contact}& c, {physics}& phys, const Interaction& I) const")?;
        writeln!(
            out,
            "\t{{\n\t\treturn fillLaw(*scene, \"{}\", {}, c, phys, I);\n\t}}",
            self.facts.key,
            self.facts.as_bond.is_some()
        )?;
        writeln!(
            out,
            "\tConcordemBondOutcome compute({contact}& c) const {{ return concordem_yade_law_step(c.row, &c); }}"
        )?;
        writeln!(
            out,
            "\tstring store(const {contact}& c, ConcordemBondOutcome outcome, {physics}& phys) const {{ return storeLaw(c, outcome, phys); }}"
        )?;
        writeln!(out, "\tvoid show(const {contact}& c, {physics}& phys) const {{ phys.moment = read(c.moment); }}")?;
        writeln!(out, "\tvoid addEnergies(const {contact}& c)\n\t{{\n\t\tenergies.add(*scene->energy,")?;
        writeln!(
            out,
            "\t\t\t{{ c.damageEnergy, c.frictionEnergy, c.viscousEnergy, c.integrationEnergy, c.storedEnergy }});\n\t}}"
        )?;
        writeln!(out, "\tbool go(shared_ptr<IGeom>&, shared_ptr<IPhys>& physics, Interaction* I) override\n\t{{")?;
        writeln!(out, "\t\treturn stepBond<{contact}>(*this, *static_cast<{physics}*>(physics.get()), *I);\n\t}}")?;
        writeln!(out, "\tFUNCTOR2D(ScGeom, {physics});\n\tYADE_CLASS_BASE_DOC_ATTRS({law}, LawFunctor,")?;
        let role = self.facts.as_bond.or(self.facts.as_contact).unwrap_or_default();
        let about = format!(
            "{role} Computed by ConcorDEM from the bodies' own positions and orientations, with increments of finite rotations. \
             With O.trackEnergy, O.energy gets {key}Elastic, {key}Damage, {key}Friction, {key}Viscous, and {key}Integration (error \
             of the work rule). What is not a number stops the run and is told in `error`."
        );
        writeln!(out, "\t\t{},", quoted(&about))?;
        writeln!(out, "\t\t((long,broken,0,(Attr::readonly),\"Bonds that broke.\"))")?;
        writeln!(
            out,
            "\t\t((string,error,,(Attr::noSave|Attr::readonly),\"What stopped the run; empty if nothing did.\"))\n\t);\n}};"
        )?;
        writeln!(out, "REGISTER_SERIALIZABLE({law});\n")
    }

    /// The functions of the material and of the physics.
    fn bodies(&self, out: &mut String) -> std::fmt::Result {
        let [material, physics, ..] = classes(self);
        writeln!(out, "string {material}::table() const\n{{\n\tTomlTable table;")?;
        for Key { name, attribute, .. } in &self.keys {
            writeln!(out, "\ttable.add(\"{name}\", {attribute});")?;
        }
        writeln!(out, "\treturn table.text;\n}}\n\nvoid {physics}::write(double* reals) const\n{{\n\t(void)reals;")?;
        for (write, head) in [(true, ""), (false, "take")] {
            if !write {
                writeln!(out, "}}\n\nvoid {physics}::{head}(const double* reals)\n{{\n\t(void)reals;")?;
            }
            let mut at = 0;
            for field in self.history() {
                let name = attribute_of(field);
                match (write, field.components) {
                    (true, 3) => writeln!(out, "\tput(reals + {at}, {name});")?,
                    (true, _) => writeln!(out, "\treals[{at}] = {name};")?,
                    (false, 3) => writeln!(out, "\t{name} = read(reals + {at});")?,
                    (false, _) => writeln!(out, "\t{name} = reals[{at}];")?,
                }
                at += field.components;
            }
        }
        writeln!(out, "}}\n")
    }
}

/// The C++ source with the classes of all laws for which `hand_written` (the text of the shim's headers) has no physics, and the
/// names of the classes, bases first.
///
/// # Errors
/// None: text grows.
pub fn source(hand_written: &str) -> Result<(String, Vec<String>), std::fmt::Error> {
    let all = concordem_contact::for_each_law!(laws);
    let laws: Vec<Law> =
        all.into_iter().filter(|law| !hand_written.contains(&format!("class {}Phys_Rust ", law.name))).collect();
    let mut names = vec!["LawPhys_Rust".to_owned()];
    let mut out =
        "/* Classes of YADE for laws of ConcorDEM. Generated from the laws by native/build: do not edit.\n\n   \
                   SPDX-License-Identifier: GPL-2.0-or-later */\n#include \"law.hpp\"\n\nnamespace yade {\n\n"
            .to_owned();
    for law in &laws {
        law.material(&mut out)?;
        law.physics(&mut out)?;
        law.functor(&mut out)?;
        law.maker(&mut out)?;
        names.extend(classes(law));
    }
    writeln!(out, "YADE_PLUGIN(({}));\n", names.join(")("))?;
    for law in &laws {
        law.bodies(&mut out)?;
    }
    out.push_str("} // namespace yade\n");
    Ok((out, names))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn laws_without_hand_written_classes_get_them() {
        let (text, names) = source("class LinearBondPhys_Rust : public FrictPhys {").expect("text grows");
        assert!(names.contains(&"Law2_ScGeom_HertzMindlinPhys_Rust".to_owned()));
        assert!(!text.contains("LinearBond"));
        // A required key is the base's attribute, one that may be left out has a name of its own.
        assert!(
            text.contains("table.add(\"young\", young);") && text.contains("table.add(\"young\", frictionalYoung);")
        );
        assert!(text.contains("((Vector3r,historyRestDirection,Vector3r::Zero(),(Attr::readonly),"));
    }

    #[test]
    fn names_of_attributes() {
        assert_eq!(camel("normal_stiffness"), "normalStiffness");
        assert_eq!(camel("young"), "young");
        assert_eq!(quoted("a \"b\"\n"), "\"a \\\"b\\\" \"");
    }
}
