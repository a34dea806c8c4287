//! What runs of one material share: tables of laws, particles, bonds, and what lies inside.

/// Tables of a scenario that make the material, as text to compare; seeds do not count. Those of a text that is no TOML are empty.
pub(super) fn material(scenario: &str) -> String {
    let mut table: toml::Table = toml::from_str(scenario).unwrap_or_default();
    table.iter_mut().for_each(|(_, value)| forget_seeds(value));
    let packing = part(
        &table,
        "packing",
        &["kind", "radius", "radii", "dispersion", "lattice", "friction", "protocol", "solid_fraction"],
    );
    let whole =
        ["dimension", "material", "bonds", "contacts", "interface", "aggregates", "fibers"].map(|key| table.get(key));
    format!("{packing:?} {whole:?}")
}

/// Values of these keys of a table.
pub(super) fn part(scenario: &toml::Table, name: &str, keys: &[&str]) -> Vec<Option<toml::Value>> {
    keys.iter().map(|key| scenario.get(name)?.get(key).cloned()).collect()
}

/// Removes all seeds: specimens of one material may differ in them.
fn forget_seeds(value: &mut toml::Value) {
    match value {
        toml::Value::Table(table) => {
            table.remove("seed");
            table.iter_mut().for_each(|(_, value)| forget_seeds(value));
        }
        toml::Value::Array(list) => list.iter_mut().for_each(forget_seeds),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_loading_and_size_make_no_other_material() {
        let text = "[packing]\nkind = \"random-dense\"\nseed = 1\n[[material]]\nyoung = 1\nstrength_scatter = { seed = 2 }\n[loading]\nrate = 1\n";
        let of = |from: &str, to: &str| {
            assert!(text.contains(from), "{from}");
            material(&text.replacen(from, to, 1))
        };
        for (from, to) in [("seed = 1", "seed = 7"), ("{ seed = 2 }", "{ seed = 8 }"), ("rate = 1", "rate = 9")] {
            assert_eq!(of(from, to), material(text), "{to}");
        }
        for (from, to) in [("young = 1", "young = 2"), ("random-dense", "lattice")] {
            assert_ne!(of(from, to), material(text), "{to}");
        }
    }
}
