//! Lattices in boxes, and bonded spheres that overlap: used as given, or with a warning.

mod shared;

use concordem_scenario::schema::Scenario;
use shared::{assembled, read};

/// A cubic lattice of spheres of 1 mm in a box of this width and depth, mm.
fn lattice(width: f64) -> String {
    format!(
        "version = 1
        [packing]
        kind = \"lattice\"
        lattice = \"sc\"
        radius = \"1 mm\"
        shape = {{ kind = \"box\", size = [\"{width} mm\", \"{width} mm\", \"40 mm\"], center = [\"3 mm\", 0, \"-1 mm\"] }}
        [[material]]
        name = \"m\"
        density = 2500
        linear_bond = {{ normal_stiffness = 1e6, shear_stiffness = 3e5 }}
        [bonds]
        law = \"linear_bond\"
        interaction_ratio = 1.05
        [contacts]
        law = \"none\"
        [loading]
        kind = \"uniaxial\"
        axis = \"z\"
        strain_rate = \"0.1 1/s\"
        [stop]
        strain = 2e-5
        "
    )
}

/// Ten spheres fill a box of 20 mm, nine one of 18 mm, wherever it lies. They leave a part of one of 19.5 mm free, with a warning that names sizes
/// that fit.
#[test]
fn a_lattice_fills_its_box_or_says_what_is_free() {
    for (width, across) in [(20.0, 10), (18.0, 9)] {
        let assembly = assembled(&lattice(width));
        assert_eq!(assembly.summary.particles, across * across * 20, "{width}");
        assert!(assembly.summary.warnings.is_empty(), "{:?}", assembly.summary.warnings);
        assert_eq!(assembly.summary.bonds, 3 * across * across * 20 - 2 * across * 20 - across * across);
    }
    let assembly = assembled(&lattice(19.5));
    let [warning] = &assembly.summary.warnings[..] else { panic!("{:?}", assembly.summary.warnings) };
    assert!(warning.key.starts_with("packing.shape.size"), "{}", warning.key);
    assert!(warning.message.contains("3.5 mm of 19.5 mm free"), "{}", warning.message);
    assert!(warning.help.contains("1.800000000e-2 or 2.000000000e-2 m"), "{}", warning.help);
}

/// Two bonded spheres at a distance, in radii.
fn pair(distance: f64, contacts: &str) -> String {
    format!(
        "version = 1
        [packing]
        kind = \"spheres\"
        spheres = [[0, 0, 0, 0.5], [{}, 0, 0, 0.5]]
        [[material]]
        name = \"m\"
        density = 1000
        linear_bond = {{ normal_stiffness = 1e6, shear_stiffness = 3e5 }}
        [bonds]
        law = \"linear_bond\"
        interaction_ratio = 1.5
        [contacts]
        law = \"{contacts}\"
        [stop]
        steps = 10
        ",
        0.5 * distance
    )
}

/// Bonds start without force at any distance, so bonded spheres may overlap until one reaches the center of the other. Where a contact follows a
/// broken bond, a deep overlap is worth a warning.
#[test]
fn bonded_spheres_may_overlap() {
    for (distance, contacts, warned) in [(1.4, "none", false), (1.4, "linear_bond", true), (1.6, "linear_bond", false)]
    {
        let scenario = read(&pair(distance, contacts));
        assert_eq!(assembled(&pair(distance, contacts)).summary.bonds, 1);
        let warnings = scenario.warnings();
        let found = warnings.iter().any(|warning| warning.message.contains("more than half of the smaller radius"));
        assert_eq!(found, warned, "{distance} {contacts}: {warnings:?}");
    }
    let error = Scenario::parse("test.toml", &pair(0.9, "none")).unwrap_err().to_string();
    assert!(error.contains("bonded spheres may overlap by the smaller radius"), "{error}");
}
