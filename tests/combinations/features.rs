//! What a scenario combines, so that the report can count it.

use crate::case::{Action, Case, Loading, Region, Shape};
use crate::slaves::Moved;

/// A feature.
pub struct Feature {
    /// Features of one group exclude each other; empty: none is excluded.
    group: &'static str,
    pub name: &'static str,
    is_in: fn(&Case) -> bool,
}

const fn one(group: &'static str, name: &'static str, is_in: fn(&Case) -> bool) -> Feature {
    Feature { group, name, is_in }
}

const fn any(name: &'static str, is_in: fn(&Case) -> bool) -> Feature {
    one("", name, is_in)
}

/// All features of the random scenarios.
pub const FEATURES: &[Feature] = &[
    one("dimension", "2D", |case| case.dimension == 2),
    one("dimension", "3D", |case| case.dimension == 3),
    one("kinematics", "kinematics finite", |case| case.kinematics == "finite"),
    one("kinematics", "kinematics first-order", |case| case.kinematics == "first-order"),
    one("kinematics", "kinematics yade", |case| case.kinematics == "yade"),
    one("kinematics", "kinematics yade-ratcheting", |case| case.kinematics == "yade-ratcheting"),
    one("bonds", "no bonds", |case| case.bonds.is_none()),
    one("bonds", "bonds linear_bond", |case| bonds(case, "linear_bond")),
    one("bonds", "bonds cpm", |case| bonds(case, "cpm")),
    one("bonds", "bonds cohesive_beam", |case| bonds(case, "cohesive_beam")),
    one("bonds", "bonds damped_beam", |case| bonds(case, "damped_beam")),
    one("bonds", "bonds softening_beam", |case| bonds(case, "softening_beam")),
    one("bonds", "bonds jointed", |case| bonds(case, "jointed")),
    one("contacts", "no contacts", |case| case.contacts == "none"),
    one("contacts", "contacts linear_bond", |case| case.contacts == "linear_bond"),
    one("contacts", "contacts cpm", |case| case.contacts == "cpm"),
    one("contacts", "contacts jointed", |case| case.contacts == "jointed"),
    one("contacts", "contacts hertz_mindlin", |case| case.contacts == "hertz_mindlin"),
    one("contacts", "contacts frictional", |case| case.contacts == "frictional"),
    one("cpm", "cpm thesis", |case| case.materials.contains("\"thesis\"")),
    one("cpm", "cpm yade-public", |case| case.materials.contains("yade-public")),
    one("cpm", "cpm woo", |case| case.materials.contains("\"woo\"")),
    any("cpm fracture energy", |case| case.materials.contains("fracture_energy")),
    any("cpm rate-dependent", |case| ["damage_time", "plasticity_time"].iter().any(|key| case.materials.contains(key))),
    any("hydrostatic strength", |case| case.materials.contains("hydrostatic_strength")),
    any("strength scatter", |case| case.materials.contains("strength_scatter")),
    any("strength field", |case| case.materials.contains("correlation_length")),
    any("deformable", |case| case.materials.contains("deformable")),
    any("iterated strains", |case| case.options.contains("iterated")),
    any("two materials", |case| !case.second.is_empty()),
    any("aggregates", |case| case.aggregates && !case.second.is_empty()),
    any("fiber", |case| case.fiber.is_some()),
    one("scheme", "leapfrog", |case| case.scheme == "leapfrog"),
    one("scheme", "velocity-verlet", |case| case.scheme == "velocity-verlet"),
    one("damping", "no damping", |case| case.damping.contains("none")),
    one("damping", "damping local", |case| case.damping.contains("\"local\"")),
    one("damping", "damping nonviscous", |case| case.damping.contains("nonviscous")),
    one("damping", "damping tchamwa-wielgosz", |case| case.damping.contains("tchamwa-wielgosz")),
    any("gravity", |case| case.gravity.norm() > 0.0),
    any("cell", |case| case.cell.is_some()),
    one("loading", "no loading", |case| matches!(case.loading, Loading::None)),
    one("loading", "loading cell-strain", |case| matches!(case.loading, Loading::CellStrain(_))),
    one("loading", "loading cell-stress", |case| matches!(case.loading, Loading::CellStress(..))),
    one("loading", "loading uniaxial", |case| matches!(case.loading, Loading::Uniaxial(..))),
    one("loading", "loading platens", |case| matches!(case.loading, Loading::Platens(..))),
    any("histories", |case| !case.histories.is_empty()),
    any("stages", |case| !case.stages.is_empty()),
    any("plane", |case| wall(case, |shape| matches!(shape, Shape::Plane(..)))),
    any("cylinder", |case| wall(case, |shape| matches!(shape, Shape::Cylinder(.., None)))),
    any("finite cylinder", |case| wall(case, |shape| matches!(shape, Shape::Cylinder(.., Some(_))))),
    any("plate", |case| wall(case, |shape| matches!(shape, Shape::Plate(..)))),
    any("disc", |case| wall(case, |shape| matches!(shape, Shape::Disc(..)))),
    any("mesh", |case| wall(case, |shape| matches!(shape, Shape::Mesh(..)))),
    any("moving wall", |case| case.walls.iter().any(|wall| wall.velocity.norm() > 0.0)),
    any("servo of a wall", |case| case.walls.iter().any(|wall| wall.servo.is_some())),
    any("turning wall", |case| case.walls.iter().any(|wall| wall.rotation.is_some())),
    any("membrane", |case| case.membrane.is_some()),
    any("joint", |case| case.joint.is_some()),
    any("clump of packed particles", |case| case.clumps.iter().any(|clump| clump.spheres.is_empty())),
    any("clump of added spheres", |case| case.clumps.iter().any(|clump| !clump.spheres.is_empty())),
    any("prescribed motion", |case| action(case, |action| matches!(action, Action::Prescribe(_)))),
    any("force", |case| action(case, |action| matches!(action, Action::Force(..)))),
    any("initial velocity", |case| action(case, |action| matches!(action, Action::Initial(..)))),
    any("recorded particles", |case| slave(case, |moved| matches!(moved, Moved::Particles(_)))),
    any("recorded mesh velocities", |case| slave(case, |moved| matches!(moved, Moved::Driven(_)))),
    any("recorded mesh places", |case| slave(case, |moved| matches!(moved, Moved::Placed(_)))),
    one("heat", "no heat", |case| case.heat.is_none()),
    one("heat", "heat power", |case| heat(case, "model = \"power\"")),
    one("heat", "heat disordered", |case| heat(case, "model = \"disordered\"")),
    one("heat", "heat ordered", |case| heat(case, "model = \"ordered\"")),
    one("heat", "heat contacts", |case| heat(case, "model = \"contacts\"")),
    any("heat through contacts", |case| heat(case, "contact = ")),
    any("implicit heat", |case| heat(case, "implicit")),
    any("heat without motion", |case| heat(case, "motion = false")),
    any("heat of dissipation", |case| heat(case, "dissipation = true")),
    any("heat through cracks", |case| heat(case, "crack_resistance")),
    any("heat through a wall", |case| heat(case, "wall = ")),
    any("radiation", |case| heat(case, "radiation")),
    any("thermal expansion", |case| case.materials.contains("expansion = 1e")),
    any("softening", |case| ["stiffness = [", "strength = ["].iter().any(|key| case.materials.contains(key))),
    any("moving region", |case| case.samples.iter().any(|sample| sample.velocity.norm() > 0.0)),
    any("grid of regions", |case| case.samples.iter().any(|sample| sample.keys.contains("grid"))),
    any("region of a set", |case| case.samples.iter().any(|sample| matches!(sample.region, Region::Set(..)))),
    any("sample region-stress", |case| sample(case, "region-stress")),
    any("sample particle-stress", |case| sample(case, "particle-stress")),
    any("sample boundary-stress", |case| sample(case, "boundary-stress")),
    any("sample couple-stress", |case| sample(case, "couple-stress")),
    any("sample affine-strain", |case| sample(case, "affine-strain")),
    any("sample affine-rate", |case| sample(case, "affine-rate")),
    any("sample cell-strain", |case| sample(case, "cell-strain")),
    any("sample cell-rate", |case| sample(case, "cell-rate")),
    any("sample contact-cell-strain", |case| sample(case, "contact-cell-strain")),
    any("sample contact-cell-rate", |case| sample(case, "contact-cell-rate")),
    any("sample fabric", |case| sample(case, "fabric")),
    any("sample porosity", |case| sample(case, "porosity")),
    any("sample damage-tensor", |case| sample(case, "damage-tensor")),
    any("sample power", |case| sample(case, "power")),
    any("sample coarse-grain", |case| sample(case, "coarse-grain")),
    any("sample wall-traction", |case| sample(case, "wall-traction")),
    any("sample heat-flux", |case| sample(case, "heat-flux")),
    any("sample set-force", |case| sample(case, "set-force")),
    any("sample set-motion", |case| sample(case, "set-motion")),
    any("sample gauge", |case| sample(case, "gauge")),
];

fn bonds(case: &Case, law: &str) -> bool {
    case.bonds.is_some_and(|(other, _)| other == law)
}

fn wall(case: &Case, is: fn(&Shape) -> bool) -> bool {
    case.walls.iter().any(|wall| is(&wall.shape))
}

fn action(case: &Case, is: fn(&Action) -> bool) -> bool {
    case.actions.iter().any(|(_, action)| is(action))
}

fn slave(case: &Case, is: fn(&Moved) -> bool) -> bool {
    case.slaves.iter().any(|slave| is(&slave.moved))
}

fn heat(case: &Case, key: &str) -> bool {
    case.heat.as_ref().is_some_and(|heat| heat.keys.contains(key))
}

fn sample(case: &Case, operator: &str) -> bool {
    case.samples.iter().any(|sample| sample.operator == operator)
}

/// Features of a scenario, as indices, ascending.
pub fn of(case: &Case) -> Vec<usize> {
    (0..FEATURES.len()).filter(|&k| (FEATURES[k].is_in)(case)).collect()
}

/// Whether two features can be in one scenario, as far as their groups tell.
pub fn can_meet(a: usize, b: usize) -> bool {
    FEATURES[a].group.is_empty() || FEATURES[a].group != FEATURES[b].group
}

/// The features of a scenario on one line.
pub fn line(case: &Case) -> String {
    let names: Vec<&str> = of(case).into_iter().map(|k| FEATURES[k].name).collect();
    format!("n={}: {}", case.spheres.len(), names.join(", "))
}
