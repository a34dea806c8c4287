//! Heat conduction and thermal expansion in a random scenario.

#![expect(clippy::format_push_string, reason = "scenarios are short; one line per key reads better than write!")]

use concordem::math::Vec3;
use concordem_tests::random::Random;

use crate::case::{Case, Heat, Region};
use crate::generator::ids;

/// Heat capacity per mass of all materials, J/(kg·K).
pub const SPECIFIC_HEAT: f64 = 800.0;

/// Factors on the stiffness, and on the strength of bonds that have one; none with laws and options that take none.
fn softening(random: &mut Random, case: &Case) -> &'static str {
    let refused = [
        "deformable",
        "hertz_mindlin",
        "hydrostatic_strength",
        "isotropic_prestress",
        "damage_time",
        "woo",
        "yade-public",
    ];
    if refused.iter().any(|key| case.materials.contains(key)) {
        return "";
    }
    let strong = case.bonds.is_some_and(|(law, _)| law == "cpm") || case.materials.contains("strength");
    if !strong {
        return ", stiffness = [1, 0.5]";
    }
    random.one_of(&[", stiffness = [1, 0.5]", ", strength = [0.6, 1]", ", stiffness = [1, 1.5], strength = [1, 0.5]"])
}

/// How particles that touch exchange heat; the last one holds for spheres.
const CONTACTS: [&str; 3] =
    ["contact = { resistance = 1e-5 }\n", "contact = { resistance = 0 }\n", "contact = { constriction = true }\n"];

/// Adds heat conduction. Everything hot is a set of particles, which no twin changes. The steps of the motion are some 0.1 µs, those of
/// conduction seconds.
pub fn add(random: &mut Random, case: &mut Case) {
    let expansion = if case.bonds.is_some() && random.happens(0.7) { random.one_of(&[1e-6, 1e-5]) } else { 0.0 };
    let conductivity = random.one_of(&[0.5, 1.5, 100.0]);
    let variation = if random.happens(0.3) {
        let expands = if expansion > 0.0 { ", expansion = [1, 1.5]" } else { "" };
        let softens = if case.bonds.is_some() && random.happens(0.7) { softening(random, case) } else { "" };
        format!(
            ", variation = {{ temperature = [280, 350], specific_heat = [1, 2], conductivity = [1, 0.5]{expands}{softens} }}"
        )
    } else {
        String::new()
    };
    let variation_softens = variation.contains("stiffness");
    let thermal = format!(
        "thermal = {{ specific_heat = {SPECIFIC_HEAT:?}, conductivity = {conductivity:?}, expansion = {expansion:?}{variation} }}\n"
    );
    case.materials = case.materials.replace("density = 2500\n", &format!("density = 2500\n{thermal}"));
    let touching = case.contacts != "none";
    let models = ["power", "power", "disordered", "ordered", "contacts", "contacts"];
    let model = random.one_of(if touching { &models } else { &models[..4] });
    let grains = model == "contacts";
    let mut keys =
        format!("model = \"{model}\"\ntemperature = 300\ntime_factor = {:?}\n", random.one_of(&[1.0, 1e5, 1e6]));
    if touching && (grains || random.happens(0.4)) {
        let spheres = case.dimension == 3;
        keys += random.one_of(if spheres { &CONTACTS } else { &CONTACTS[..2] });
    }
    if model != "power" && !grains {
        keys +=
            if case.bonds.is_some() && random.happens(0.5) { "pairs = \"bonds\"\n" } else { "contact_ratio = 1.3\n" };
    }
    if random.happens(0.3) {
        keys += "scheme = \"implicit\"\n";
    }
    if expansion > 0.0 && random.happens(0.3) {
        keys += "reference_temperature = 280\n";
    }
    if case.bonds.is_some() && random.happens(0.3) {
        keys += "crack_resistance = 1e-4\n";
    }
    if !variation_softens && random.happens(0.1) {
        keys += "motion = false\n";
        case.gravity = Vec3::zeros();
    } else if random.happens(0.3) {
        keys += "dissipation = true\n";
    }
    keys += &format!("[[heat.initial]]\nset = \"hot\"\ntemperature = {:?}\n", random.between(250.0, 400.0));
    if random.happens(0.5) {
        keys += &format!("[[heat.source]]\nset = \"hot\"\npower = {:?}\n", random.between(-1.0, 5.0));
    }
    if random.happens(0.3) {
        keys += "[[heat.boundary]]\nset = \"hot\"\ntemperature = 350\n";
    }
    if case.cell.is_none() && !grains && random.happens(0.3) {
        keys += "[[heat.boundary]]\nradiation = { emissivity = 0.8, ambient = 500 }\n";
    }
    if !case.walls.is_empty() && case.contacts != "none" && random.happens(0.5) {
        let exchange = random.one_of(&["temperature = 350", "convection = { coefficient = 1000, ambient = 350 }"]);
        keys += &format!("[[heat.boundary]]\nwall = \"w0\"\n{exchange}\n");
    }
    // Regions and truncations of the heat flux are those of the fabric.
    for sample in &mut case.samples {
        if sample.operator == "fabric" && !matches!(sample.region, Region::Set(..)) && random.happens(0.5) {
            sample.operator = "heat-flux";
        }
    }
    let hot = ids(random, case.spheres.len(), 5);
    case.heat = Some(Heat { keys, hot });
}
