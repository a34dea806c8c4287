//! Template scenarios, compiled into the program.

/// A commented example scenario.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Template {
    /// Name.
    pub name: &'static str,
    /// Description in one line.
    pub description: &'static str,
    /// The scenario.
    pub text: &'static str,
}

macro_rules! templates {
    ($($name:literal: $description:literal,)*) => {
        /// All templates.
        pub const TEMPLATES: &[Template] = &[$(Template {
            name: $name,
            description: $description,
            text: include_str!(concat!("templates/", $name, ".toml")),
        }),*];
    };
}

templates! {
    "cpm-small": "about 1,000 particles of concrete in tension; seconds",
    "cpm-specimen-tension": "50 mm concrete cube (Stránský 2018, section 2.5.3) in tension; minutes",
    "cpm-specimen-compression": "50 mm concrete cube (Stránský 2018, section 2.5.3) in compression; minutes",
    "cpm-periodic": "periodic cell of concrete under a prescribed strain path",
    "concrete-bending": "notched concrete beam on two supports, bent so that its notch opens at a constant rate; a minute",
    "concrete-hopkinson": "concrete between two steel bars, crushed by the pulse of a striker; seconds",
    "concrete-splitting": "concrete cylinder that splits between two plates (Brazilian test); half a minute",
    "concrete-triaxial": "periodic cell of concrete, consolidated and compressed at constant lateral stress; half a minute",
    "rock-triaxial": "periodic cell of rock with jointed bonds, consolidated and compressed at constant lateral stress; seconds",
    "concrete-mesoscale": "aggregates, mortar, and the weaker zone between them, pulled until the cube breaks; a minute",
    "concrete-fibers": "a prism of concrete with steel fibers, pulled until its fibers slip; seconds",
    "granular-box": "a column of frictional spheres collapses in a box",
    "hertz-impact": "two glass spheres collide",
    "beam-tension": "cylinder of silica made of cohesive beams (Jebahi et al. 2015), pulled until it breaks; a minute",
    "beam-torsion": "the same cylinder, twisted until it breaks",
    "beam-bending": "a prism of the same silica, bent until it breaks",
    "beam-impact": "a pulse travels through a slender cylinder of the same silica and returns; seconds",
    "beam-indentation": "a silica plate in two dimensions, indented by a rigid cylinder; minutes",
    "deformable-discs": "two-dimensional bar of deformable discs, compressed at its ends",
    "linear-bond-bar": "two-dimensional bar of discs with brittle bonds, pulled until it breaks",
}

/// Other words for templates, by which users look for them.
pub const OTHER_NAMES: [(&str, &str); 9] = [
    ("brazilian", "concrete-splitting"),
    ("splitting", "concrete-splitting"),
    ("triaxial", "concrete-triaxial"),
    ("notched-beam", "concrete-bending"),
    ("hopkinson", "concrete-hopkinson"),
    ("mesoscale", "concrete-mesoscale"),
    ("indentation", "beam-indentation"),
    ("granite", "rock-triaxial"),
    ("rock", "rock-triaxial"),
];

/// The template with this name, or with this one of the [other names](OTHER_NAMES).
pub fn template(name: &str) -> Option<&'static Template> {
    let other = OTHER_NAMES.iter().find(|(other, _)| *other == name);
    let name = other.map_or(name, |(_, name)| *name);
    TEMPLATES.iter().chain(SWEEPS.iter().map(|(sweep, _)| sweep)).find(|template| template.name == name)
}

/// Commented example sweeps, each with the name of the template that is its scenario.
pub const SWEEPS: &[(Template, &str)] = &[
    (
        Template {
            name: "elastic-sweep",
            description: "elastic constants over interaction ratio and stiffness ratio, mean of three packings; for `sweep`",
            text: include_str!("templates/elastic-sweep.toml"),
        },
        "cpm-periodic",
    ),
    (
        Template {
            name: "concrete-ensemble",
            description: "stress-strain curves at many values of three parameters, four packings; for `sweep`, then for posteriors",
            text: include_str!("templates/concrete-ensemble.toml"),
        },
        "cpm-small",
    ),
];
