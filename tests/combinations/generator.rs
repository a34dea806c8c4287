//! Random scenarios: a seed gives one.

#![expect(clippy::format_push_string, reason = "scenarios are short; one line per key reads better than write!")]

use concordem::math::{Mat3, Vec3};
use concordem_tests::random::Random;

use crate::case::{Action, Case, Clump, Joint, Loading, Membrane, Motion, Region, Sample, Servo, Shape, Wall};
use crate::{fibers, finite_walls, heat, in_time, slaves};

/// Distance of neighbors, m.
const SPACING: f64 = 2e-3;

/// The scenario of a seed and a number.
pub fn case(seed: u64, number: u64) -> Case {
    let mut case = basic(seed, number);
    extend(&mut case, seed, number);
    case
}

/// The scenario without what came later.
fn basic(seed: u64, number: u64) -> Case {
    let random = &mut Random::new(seed, number);
    let dimension = if random.happens(0.3) { 2 } else { 3 };
    let bonds = bonds(random, dimension);
    let contacts = contacts(random, dimension, bonds);
    let deformable = random.happens(0.2)
        && [bonds.map_or("none", |b| b.0), contacts]
            .iter()
            .all(|law| !["cpm", "cohesive_beam", "damped_beam", "softening_beam", "jointed"].contains(law));
    let (materials, options) = materials(random, bonds.map(|b| b.0), contacts, deformable, dimension);
    let two = random.happens(0.2);
    let materials = if two { format!("{materials}{}", materials.replacen("\"m\"", "\"n\"", 1)) } else { materials };
    let periodic = random.happens(0.4);
    let counts = counts(random, dimension);
    let spheres = spheres(random, counts, dimension, bonds.is_some(), periodic);
    let count = spheres.len();
    let cell = periodic.then(|| edges(counts, dimension));
    let mut case = Case {
        name: format!("combination {seed}-{number}"),
        dimension,
        kinematics: random.one_of(&["finite", "finite", "finite", "first-order", "yade", "yade-ratcheting"]),
        spheres,
        cell,
        materials,
        second: if two { ids(random, count, 3) } else { Vec::new() },
        aggregates: false,
        bonds,
        contacts,
        options,
        scheme: random.one_of(&["leapfrog", "leapfrog", "velocity-verlet"]),
        damping: damping(random, deformable),
        gravity: Vec3::zeros(),
        time_step: None,
        loading: Loading::None,
        histories: Vec::new(),
        stages: Vec::new(),
        walls: Vec::new(),
        clumps: Vec::new(),
        actions: Vec::new(),
        heat: None,
        fiber: None,
        membrane: None,
        joint: None,
        slaves: Vec::new(),
        samples: Vec::new(),
        interval: random.one_of(&[7, 10, 25]),
        steps: 100 + 2 * random.below(100) as u64,
    };
    if random.happens(0.4) {
        case.gravity = planar(dimension, vector(random, 1e4));
    }
    loading(random, &mut case, counts);
    walls(random, &mut case, counts);
    clumps(random, &mut case);
    actions(random, &mut case);
    for _ in 0..=random.below(4) {
        let sample = sample(random, &case, counts);
        case.samples.push(sample);
    }
    case
}

/// Adds what came later, with numbers of its own, so that scenarios without it stay as they were.
fn extend(case: &mut Case, seed: u64, number: u64) {
    let random = &mut Random::new(!seed, number);
    if random.happens(0.5) {
        in_time::add(random, case);
    }
    case.aggregates = random.happens(0.5);
    let random = &mut Random::new(seed.rotate_left(32) ^ 0x68, number);
    if random.happens(0.2) {
        heat::add(random, case);
    }
    let random = &mut Random::new(seed.rotate_left(32) ^ 0x66, number);
    if random.happens(0.3) {
        fibers::add(random, case);
    }
    let random = &mut Random::new(seed.rotate_left(32) ^ 0x70, number);
    if random.happens(0.5) {
        finite_walls::add(random, case);
    }
    if random.happens(0.2) {
        membrane(random, case);
    }
    let random = &mut Random::new(seed.rotate_left(32) ^ 0x73, number);
    if random.happens(0.4) {
        slaves::add(random, case);
    }
    let random = &mut Random::new(seed.rotate_left(32) ^ 0x74, number);
    if random.happens(0.2) {
        scatter(random, case);
    }
    let random = &mut Random::new(seed.rotate_left(32) ^ 0x76, number);
    if random.happens(0.6) {
        servo(random, case);
    }
    let random = &mut Random::new(seed.rotate_left(32) ^ 0x6a, number);
    if random.happens(0.7) {
        joint(random, case);
    }
}

/// A joint where bonds know joints, with contacts that know them; seldom where it is refused.
fn joint(random: &mut Random, case: &mut Case) {
    let jointed = case.bonds.is_some_and(|(law, _)| law == "jointed");
    let refused = case.cell.is_some() || case.heat.is_some() || case.fiber.is_some();
    if !jointed || refused && random.happens(0.95) {
        return;
    }
    case.contacts = "jointed";
    let sphere = case.spheres[random.below(case.spheres.len())].0;
    let point = sphere + vector(random, 1e-4);
    let normal = vector(random, 1.0);
    let keys = random.one_of(&[
        "friction_coefficient = 0.5",
        "friction_angle = 0.4\ndilation_angle = \"15 deg\"",
        "tensile_strength = 1e6\ncohesion = 2e6\nfriction_coefficient = 0.3",
        "cohesion = 3e5\nfriction_coefficient = 0.7\ndilation_angle = 0.1",
    ]);
    case.joint = Some(Joint { point, normal, keys });
}

/// Strengths that scatter, where bonds have a strength that may.
fn scatter(random: &mut Random, case: &mut Case) {
    let refused = ["deformable", "hydrostatic_strength", "isotropic_prestress", "damage_time", "woo", "yade-public"];
    let strong = case.bonds.is_some_and(|(law, _)| law == "cpm")
        || (case.bonds.is_some() && ["strength =", "cohesion ="].iter().any(|key| case.materials.contains(key)));
    if !strong || refused.iter().any(|key| case.materials.contains(key)) {
        return;
    }
    let distribution = random.one_of(&[
        "weibull_modulus = 4",
        "weibull_modulus = 20, reference_area = 1e-6",
        "log_normal_variation = 0.3",
        "weibull_modulus = 4, correlation_length = 0.01",
    ]);
    let table = format!("strength_scatter = {{ {distribution}, seed = {} }}\n", random.below(1000));
    case.materials = case.materials.replace("density = 2500\n", &format!("density = 2500\n{table}"));
}

/// A servo in place of the velocity of a wall. Forces are some of those that the laws let contacts bear.
fn servo(random: &mut Random, case: &mut Case) {
    let is_flat = |wall: &Wall| matches!(wall.shape, Shape::Plane(..) | Shape::Plate(..) | Shape::Disc(..));
    let flat: Vec<usize> = (0..case.walls.len()).filter(|&k| is_flat(&case.walls[k])).collect();
    if flat.is_empty() {
        return;
    }
    let at = flat[random.below(flat.len())];
    let wall = &mut case.walls[at];
    let mut direction = match &wall.shape {
        Shape::Plane(_, normal) | Shape::Disc(_, normal, _) => *normal,
        // Across its two edges.
        Shape::Plate(_, [a, b]) => a.cross(b).normalize(),
        _ => return,
    };
    // Towards the particles, also from a plate.
    let middle = case.spheres.iter().map(|(x, _)| x).sum::<Vec3>() / case.spheres.len() as f64;
    let place = match &wall.shape {
        Shape::Plane(x, _) | Shape::Disc(x, ..) | Shape::Plate(x, _) => *x,
        _ => return,
    };
    if direction.dot(&(middle - place)) < 0.0 {
        direction = -direction;
    }
    let force = random.between(0.5, 20.0) * if case.dimension == 2 { 100.0 } else { 1.0 };
    wall.velocity = Vec3::zeros();
    wall.servo = Some(Servo { force, maximum_speed: random.between(0.1, 2.0), direction });
    // Long enough to come to the force.
    case.steps = 2 * case.steps + 100;
}

/// A membrane; seldom where it is refused.
fn membrane(random: &mut Random, case: &mut Case) {
    let refused = case.cell.is_some() || case.materials.contains("deformable");
    if refused && random.happens(0.95) {
        return;
    }
    let plane = case.dimension == 2;
    let pressure = random.between(1e3, if plane { 1e5 } else { 1e6 });
    let history = (!case.histories.is_empty() && random.happens(0.5)).then(|| random.below(case.histories.len()));
    let open_along = random.happens(0.4).then(|| random.below(if plane { 2 } else { 3 }));
    case.membrane = Some(Membrane { pressure, history, open_along });
}

/// A vector with components up to `size`.
pub fn vector(random: &mut Random, size: f64) -> Vec3 {
    Vec3::from_fn(|_, _| random.between(-size, size))
}

pub fn planar(dimension: u8, v: Vec3) -> Vec3 {
    if dimension == 2 { Vec3::new(v.x, v.y, 0.0) } else { v }
}

pub fn spin(dimension: u8, w: Vec3) -> Vec3 {
    if dimension == 2 { Vec3::new(0.0, 0.0, w.z) } else { w }
}

fn counts(random: &mut Random, dimension: u8) -> [usize; 3] {
    if dimension == 2 {
        [3 + random.below(5), 3 + random.below(5), 1]
    } else {
        [2 + random.below(3), 2 + random.below(3), 2 + random.below(4)]
    }
}

fn edges(counts: [usize; 3], dimension: u8) -> Vec3 {
    let depth = if dimension == 2 { 1.0 } else { SPACING * counts[2].max(3) as f64 };
    Vec3::new(SPACING * counts[0].max(3) as f64, SPACING * counts[1].max(3) as f64, depth)
}

/// Spheres of unequal radii near the points of a grid, far enough from them that no mesh has ties. Bonded ones overlap.
fn spheres(random: &mut Random, counts: [usize; 3], dimension: u8, bonded: bool, periodic: bool) -> Vec<(Vec3, f64)> {
    let of = |k: usize| if periodic && (k < 2 || dimension == 3) { counts[k].max(3) } else { counts[k] };
    let (jitter, radius) = if bonded { (0.2e-3, (0.85e-3, 1.1e-3)) } else { (0.1e-3, (0.75e-3, 0.87e-3)) };
    let mut spheres = Vec::new();
    for i in 0..of(0) {
        for j in 0..of(1) {
            for k in 0..of(2) {
                let depth = if dimension == 2 { 0.0 } else { k as f64 + 0.5 };
                let point = Vec3::new(i as f64 + 0.5, j as f64 + 0.5, depth) * SPACING;
                let x = point + planar(dimension, vector(random, jitter));
                spheres.push((x, random.between(radius.0, radius.1)));
            }
        }
    }
    spheres
}

fn bonds(random: &mut Random, dimension: u8) -> Option<(&'static str, f64)> {
    let law = match random.below(5) {
        0 => return None,
        2 | 3 if dimension == 3 => "cpm",
        4 if dimension == 3 => "cohesive_beam",
        _ => "linear_bond",
    };
    let ratio = random.one_of(&[1.05, 1.2, 1.45]);
    // Draws no number, so that all else in the scenarios of a seed stays the same.
    let law = match law {
        "cohesive_beam" if ratio == 1.2 => "damped_beam",
        "cohesive_beam" if ratio == 1.45 => "softening_beam",
        "linear_bond" if dimension == 3 && ratio == 1.2 => "jointed",
        law => law,
    };
    Some((law, ratio))
}

fn contacts(random: &mut Random, dimension: u8, bonds: Option<(&str, f64)>) -> &'static str {
    let jointed = bonds.is_some_and(|(law, _)| law == "jointed");
    match random.below(if bonds.is_some() { 6 } else { 5 }) {
        0 | 2 if jointed => "jointed",
        0 => "linear_bond",
        1 if dimension == 3 => "hertz_mindlin",
        2 | 3 if dimension == 3 => "cpm",
        5 => "none",
        _ => "frictional",
    }
}

/// The table of a material, and further tables that it needs.
fn materials(
    random: &mut Random,
    bonds: Option<&str>,
    contacts: &str,
    deformable: bool,
    dimension: u8,
) -> (String, String) {
    let mut text = "[[material]]\nname = \"m\"\ndensity = 2500\n".to_owned();
    let mut options = String::new();
    if deformable {
        let young = random.one_of(&[5e9, 2e10, 1e11]);
        let young = if dimension == 2 { young * 0.01 } else { young };
        text += &format!("deformable = {{ young = {young:?}, poisson = {:?} }}\n", random.between(0.0, 0.4));
        if random.happens(0.5) {
            options = format!("[deformable]\nupdate = \"iterated\"\ndashpots = {}\n", random.happens(0.5));
        }
    }
    let uses = |law: &str| bonds == Some(law) || contacts == law;
    // In the plane masses are a thousand times larger.
    let scale = if dimension == 2 { 100.0 } else { 1.0 };
    if uses("linear_bond") {
        text += &linear_bond(random, scale);
    }
    if uses("jointed") {
        text += &jointed(random);
    }
    if uses("cpm") {
        text += &cpm(random);
    }
    for law in ["cohesive_beam", "damped_beam", "softening_beam"].into_iter().filter(|law| uses(law)) {
        text += &beam(random, law);
    }
    if uses("frictional") {
        let friction = random.between(0.0, 0.8);
        let damping = random.one_of(&[0.0, 0.0, 0.05, 0.3]);
        let stiffness = if dimension == 3 && random.happens(0.5) {
            format!("young = {:?}, stiffness_ratio = {:?}", random.between(5e8, 5e9), random.between(0.0, 1.0))
        } else {
            let normal = random.between(1e6, 1e7) * scale;
            format!("normal_stiffness = {normal:?}, shear_stiffness = {:?}", normal * random.between(0.0, 1.0))
        };
        text += &format!(
            "frictional = {{ {stiffness}, friction_coefficient = {friction:?}, damping_ratio = {damping:?} }}\n"
        );
    }
    if uses("hertz_mindlin") {
        text += &format!(
            "hertz_mindlin = {{ young = {:?}, poisson = {:?}, friction_coefficient = {:?}, restitution = {:?} }}\n",
            random.between(1e9, 2e10),
            random.between(0.0, 0.45),
            random.between(0.0, 0.8),
            random.one_of(&[1.0, 1.0, 0.9, 0.5])
        );
    }
    (text, options)
}

fn linear_bond(random: &mut Random, scale: f64) -> String {
    let normal = random.between(1e6, 1e7) * scale;
    let strength = random.one_of(&[2.0, 10.0, 50.0]) * scale;
    let mut text = format!(
        "normal_stiffness = {normal:?}, shear_stiffness = {:?}, damping_ratio = {:?}, friction_coefficient = {:?}",
        normal * random.between(0.0, 1.0),
        random.one_of(&[0.0, 0.0, 0.05, 0.3]),
        random.between(0.0, 0.8)
    );
    if random.happens(0.7) {
        text +=
            &format!(", normal_strength = {strength:?}, shear_strength = {:?}", strength * random.between(0.5, 3.0));
    }
    if random.happens(0.2) {
        text += ", subtract_initial_gap = false";
    }
    format!("linear_bond = {{ {text} }}\n")
}

fn jointed(random: &mut Random) -> String {
    let strength = random.one_of(&[6e5, 3e6, 1.5e7]);
    let friction = random.one_of(&["friction_coefficient = 0.5", "friction_angle = \"20 deg\""]);
    let residual = random.one_of(&["", ", residual_friction_coefficient = 0.1", ", residual_friction_angle = 0"]);
    format!(
        "jointed = {{ young = {:?}, stiffness_ratio = {:?}, tensile_strength = {:?}, cohesion = {:?}, {friction}{residual} }}\n",
        random.between(1e9, 1e10),
        random.between(0.0, 1.0),
        strength * random.one_of(&[0.0, 0.5, 1.0]),
        strength * random.between(0.5, 3.0)
    )
}

fn cpm(random: &mut Random) -> String {
    let mode = random.one_of(&["thesis", "thesis", "thesis", "yade-public", "woo"]);
    let young = random.between(5e9, 3e10);
    let onset = random.one_of(&[1e-4, 5e-4]);
    let shear_ratio = random.between(0.1, 0.9);
    let ductility: f64 = random.one_of(&[3.0, 30.0]);
    let mut text = format!(
        "young = {young:?}, shear_ratio = {shear_ratio:?}, crack_onset_strain = {onset:?}, cohesion = {:?}, \
         friction_coefficient = {:?}, mode = \"{mode}\"",
        young * onset,
        random.between(0.2, 0.9)
    );
    // That of a bond of 2 mm; the radii are about 1 mm.
    text += &if mode == "thesis" && random.happens(0.3) {
        format!(", fracture_energy = {:?}", young * onset * onset * 2e-3 * (ductility + 0.5))
    } else {
        format!(", relative_ductility = {ductility:?}")
    };
    if random.happens(0.3) {
        text += ", damage_law = \"linear\"";
    }
    if random.happens(0.3) {
        text += &format!(", omega_threshold = {:?}", random.one_of(&[0.5, 0.9, 0.99]));
    }
    if random.happens(0.5) {
        if random.happens(0.4) {
            text += &format!(", soft_strain = {:?}, relative_soft_stiffness = 0.1", -3.0 * onset);
        }
        if random.happens(0.3) {
            text += &format!(", isotropic_prestress = {:?}", -0.3 * young * onset);
        }
        if random.happens(0.3) && mode != "woo" {
            text += ", shear_contribution = 0.5";
        }
        if mode != "yade-public" {
            if random.happens(0.3) {
                text += ", damage_time = 1e-6, damage_rate_exponent = 0.5";
            }
            if random.happens(0.3) {
                text += ", plasticity_time = 1e-6, plasticity_rate_exponent = 0.8";
            }
            if random.happens(0.4) {
                let surface = random.one_of(&["parabolic", "logarithmic", "logarithmic-linear"]);
                text += &format!(", yield_surface = \"{surface}\"");
                if surface != "parabolic" {
                    text += ", yield_log_speed = 0.1";
                }
            }
        }
    }
    format!("cpm = {{ {text} }}\n")
}

fn beam(random: &mut Random, law: &str) -> String {
    let young = random.between(5e9, 3e10);
    let mut text = format!("young = {young:?}, poisson = {:?}", random.between(0.0, 0.45));
    if random.happens(0.7) {
        text += ", radius_ratio = 0.6";
        // Draws no number, so that all else in the scenarios of a seed stays the same.
        text += ["", ", radius_rule = \"smaller\"", ", radius_rule = \"mean\"", ", radius_rule = \"harmonic-mean\""]
            [young.to_bits() as usize % 4];
    } else {
        text += ", radius = 0.5e-3";
    }
    text += random.one_of(&[
        "",
        ", model = \"timoshenko\"",
        ", model = \"dual-spring\", shear_ratio = 0.4",
        ", model = \"spring\"",
    ]);
    text += random.one_of(&["", ", bending_term = \"half-sum\"", ", bending_term = \"larger-end\""]);
    if random.happens(0.6) {
        text += &format!(", tensile_strength = {:?}", young * random.one_of(&[2e-4, 1e-3, 3e-3]));
    }
    if random.happens(0.4) {
        text += &format!(", cohesion = {:?}", young * random.one_of(&[2e-4, 1e-3, 3e-3]));
        text += random.one_of(&["", ", friction_coefficient = 0.7", ", friction_angle = \"35 deg\""]);
        text += random.one_of(&["", ", moment_share = 0.2"]);
    }
    if random.happens(0.2) {
        text += &format!(", hydrostatic_strength = {:?}", young * 1e-4);
    }
    if law == "softening_beam" {
        text = text.replace(&format!(", hydrostatic_strength = {:?}", young * 1e-4), "");
        if !text.contains("strength") && !text.contains("cohesion") {
            text += &format!(", tensile_strength = {:?}", young * 1e-3);
        }
        // At the largest strength ten times what a bond of 4 mm stores.
        text += &format!(", fracture_energy = {:?}", young * 9e-6 * 2e-2);
        text += ["", ", shear_fracture_energy = 1e7", ", shear_fracture_energy = 1e7, mixture_exponent = 2"]
            [(young.to_bits() >> 2) as usize % 3];
        text += ["", ", softening = \"exponential\""][(young.to_bits() >> 5) as usize % 2];
    }
    if law == "damped_beam" {
        if text.contains("poisson = 0.1") && !text.contains("spring") {
            text += ", bending_damping_ratio = 0.3, twist_damping_ratio = 0";
        }
        text += [", damping_ratio = 0.05", ", damping_ratio = 0.7", ", damping_ratio = 0", ", damping_ratio = 0.2"]
            [(young.to_bits() >> 2) as usize % 4];
    }
    format!("{law} = {{ {text} }}\n")
}

fn damping(random: &mut Random, deformable: bool) -> String {
    match random.below(if deformable { 4 } else { 8 }) {
        0 => format!("{{ kind = \"local\", coefficient = {:?} }}", random.between(0.05, 0.7)),
        1 => format!("{{ kind = \"nonviscous\", coefficient = {:?} }}", random.between(0.05, 0.7)),
        2 => "{ kind = \"tchamwa-wielgosz\", phi = 1.2 }".to_owned(),
        3 => "{ kind = \"tchamwa-wielgosz\", phi = 1.1, form = \"position-term\" }".to_owned(),
        _ => "{ kind = \"none\" }".to_owned(),
    }
}

fn loading(random: &mut Random, case: &mut Case, counts: [usize; 3]) {
    let plane = case.dimension == 2;
    if case.cell.is_some() {
        if random.happens(0.5) {
            return;
        }
        let mut tensor = Mat3::from_fn(|_, _| random.between(-30.0, 30.0));
        if random.happens(0.3) {
            // Simple shear.
            tensor = Mat3::zeros();
            tensor[(0, 1)] = random.between(10.0, 60.0);
        } else if random.happens(0.4) {
            let diagonal = tensor.diagonal();
            tensor = Mat3::from_diagonal(&diagonal);
        }
        if plane {
            for k in 0..3 {
                tensor[(2, k)] = 0.0;
                tensor[(k, 2)] = 0.0;
            }
        }
        case.loading = if random.happens(0.6) {
            Loading::CellStrain(tensor)
        } else {
            let symmetric = (tensor + tensor.transpose()) * if plane { 1e6 } else { 1e5 };
            Loading::CellStress(symmetric, 50.0)
        };
        return;
    }
    let axis = random.below(if plane { 2 } else { 3 });
    if counts[axis] < 3 {
        return;
    }
    if case.bonds.is_some() && random.happens(0.25) {
        let rate = random.between(-100.0, 100.0);
        case.loading = Loading::Uniaxial(axis, rate, random.happens(0.5));
    } else if case.contacts != "none" && random.happens(0.15) {
        case.loading = Loading::Platens(axis, random.between(0.1, 2.0));
    }
}

/// Planes beside the particles, a vessel, or a rod; coordinates that 32 bits hold.
fn walls(random: &mut Random, case: &mut Case, counts: [usize; 3]) {
    if case.contacts == "none" || random.happens(0.5) {
        return;
    }
    let plane = case.dimension == 2;
    let axes = if plane { 2 } else { 3 };
    let single = |value: f64| f64::from(value as f32);
    for axis in 0..axes {
        if !random.happens(0.4) {
            continue;
        }
        let mut normal = Vec3::zeros();
        normal[axis] = 1.0;
        let mut velocity = Vec3::zeros();
        if random.happens(0.3) && case.cell.is_none() {
            velocity[axis] = random.between(0.0, 1.0);
        }
        if random.happens(0.3) {
            velocity[(axis + 1) % axes] = random.between(-1.0, 1.0);
        }
        // Below the lowest sphere; in a cell this is the space that must stay free.
        let lowest = case.spheres.iter().map(|(x, r)| x[axis] - r).fold(f64::INFINITY, f64::min);
        let mut point = Vec3::zeros();
        point[axis] = single(lowest - 1e-6);
        case.walls.push(Wall {
            shape: Shape::Plane(point, normal),
            velocity,
            servo: None,
            history: None,
            rotation: None,
        });
        if case.cell.is_none() && random.happens(0.4) {
            let highest = case.spheres.iter().map(|(x, r)| x[axis] + r).fold(f64::NEG_INFINITY, f64::max);
            let mut point = Vec3::zeros();
            point[axis] = single(highest + 1e-6);
            case.walls.push(Wall {
                shape: Shape::Plane(point, -normal),
                velocity: Vec3::zeros(),
                servo: None,
                history: None,
                rotation: None,
            });
        } else if let Some(cell) = &mut case.cell {
            // Room for the sheet between the cell's two ends.
            cell[axis] += 0.3e-3;
        }
    }
    if case.cell.is_none() && random.happens(0.2) {
        let middle = Vec3::new(counts[0] as f64, counts[1] as f64, 0.0) * (0.5 * SPACING);
        let reach = case.spheres.iter().map(|(x, r)| (x - middle).xy().norm() + r).fold(0.0, f64::max);
        let shape = Shape::Cylinder(middle, 2, reach + 1e-6, true, None);
        case.walls.push(Wall { shape, velocity: Vec3::zeros(), servo: None, history: None, rotation: None });
    }
}

/// Some different numbers below `count`, in ascending order.
pub fn ids(random: &mut Random, count: usize, most: usize) -> Vec<usize> {
    let mut ids: Vec<usize> = (0..=random.below(most)).map(|_| random.below(count)).collect();
    ids.sort_unstable();
    ids.dedup();
    ids
}

fn clumps(random: &mut Random, case: &mut Case) {
    if !random.happens(0.25) {
        return;
    }
    let count = case.spheres.len();
    let first = random.below(count - 1);
    let size = 2 + random.below(2);
    let mut clump = Clump { members: (first..count.min(first + size)).collect(), spheres: Vec::new(), motion: None };
    if random.happens(0.3) {
        // Beside the packing.
        let x = Vec3::new(-1.3e-3, 1e-3, if case.dimension == 2 { 0.0 } else { 1e-3 });
        clump.members.clear();
        clump.spheres = vec![(x, 0.9e-3), (x + Vec3::new(-0.6e-3, 0.7e-3, 0.0), 0.6e-3)];
    }
    if random.happens(0.5) {
        let (v, w) = (vector(random, 2.0), vector(random, 500.0));
        clump.motion = Some((planar(case.dimension, v), spin(case.dimension, w)));
    }
    case.clumps.push(clump);
}

fn actions(random: &mut Random, case: &mut Case) {
    let (count, dimension) = (case.spheres.len(), case.dimension);
    let in_clump = |id: &usize| case.clumps.iter().any(|clump| clump.members.contains(id));
    let free = |random: &mut Random, most: usize| {
        let mut ids = ids(random, count, most);
        ids.retain(|id| !in_clump(id));
        ids
    };
    let mut actions = Vec::new();
    // What the loading sets must not be given.
    let starts = !matches!(case.loading, Loading::CellStrain(_) | Loading::Uniaxial(..));
    if starts {
        for _ in 0..random.below(4) {
            let (v, w) = (vector(random, 3.0), vector(random, 1000.0));
            let some = free(random, count);
            actions.push((some, Action::Initial(planar(dimension, v), spin(dimension, w))));
        }
    }
    if random.happens(0.25) {
        let some = free(random, 3);
        let (v, w) = (planar(dimension, vector(random, 1.0)), spin(dimension, vector(random, 200.0)));
        let keep = |random: &mut Random, v: Vec3| [v.x, v.y, v.z].map(|c| random.happens(0.5).then_some(c));
        let (mut velocity, mut angular_velocity) = (keep(random, v), keep(random, w));
        if dimension == 2 {
            velocity[2] = None;
            angular_velocity[0] = None;
            angular_velocity[1] = None;
        }
        if velocity.iter().chain(&angular_velocity).any(Option::is_some) {
            actions.push((some, Action::Prescribe(Motion { velocity, angular_velocity, ..Motion::default() })));
        }
    }
    if random.happens(0.3) {
        let some = ids(random, count, 4);
        let size = if dimension == 2 { 1e3 } else { 10.0 };
        let (f, m) = (vector(random, size), vector(random, 1e-3 * size));
        actions.push((some, Action::Force(planar(dimension, f), spin(dimension, m), None, "body")));
    }
    actions.retain(|(ids, _)| !ids.is_empty());
    case.actions = actions;
}

/// Operators of any region with a shape.
const OF_SHAPES: [&str; 8] = [
    "region-stress",
    "particle-stress",
    "couple-stress",
    "affine-strain",
    "affine-rate",
    "fabric",
    "porosity",
    "damage-tensor",
];

fn sample(random: &mut Random, case: &Case, counts: [usize; 3]) -> Sample {
    let plain = |operator, region| Sample { operator, region, keys: String::new(), velocity: Vec3::zeros() };
    let plane = case.dimension == 2;
    let size = Vec3::new(counts[0] as f64, counts[1] as f64, counts[2] as f64) * SPACING;
    let depth = if plane { 1.0 } else { size.z };
    let volume = size.x * size.y * depth;
    let center = planar(case.dimension, size * 0.5 + vector(random, 1e-3));
    let whole = if case.cell.is_some() { Region::Cell } else { Region::All(volume) };
    match random.below(12) {
        0 => return plain("boundary-stress", Region::All(volume)),
        1 => return plain("power", whole),
        2 if case.cell.is_some() => {
            return plain(random.one_of(&["contact-cell-strain", "contact-cell-rate"]), Region::Cell);
        }
        3 => return plain("coarse-grain", Region::Sphere(center, random.between(1.5e-3, 4e-3))),
        4 if !case.walls.is_empty() => {
            let mut sample = plain("wall-traction", Region::None);
            sample.keys = format!("wall = \"w{}\"\narea = 1e-5\n", random.below(case.walls.len()));
            return sample;
        }
        _ => {}
    }
    let half = size * random.between(0.2, 0.6);
    let mut low = center - half;
    let mut high = center + half;
    if plane {
        (low.z, high.z) = (-0.5, 0.5);
    }
    let region = match random.below(7) {
        0 => Region::Sphere(center, random.between(1.5e-3, 4e-3)),
        1 if !plane => Region::Cylinder(center, Vec3::new(1.0, 2.0, -1.0), 2e-3, 4e-3),
        2 if !plane => Region::Ellipsoid(center, Vec3::new(2e-3, 3e-3, 4e-3)),
        3 | 4 => Region::Box(low, high),
        5 => Region::Set(ids(random, case.spheres.len(), 20), 1e-7),
        _ => whole,
    };
    let list = matches!(region, Region::Set(..));
    let operator = match random.below(6) {
        0 if !list => "cell-strain",
        1 if !list => "cell-rate",
        _ => random.one_of(&OF_SHAPES),
    };
    let mut sample = plain(operator, region);
    match operator {
        "region-stress" | "fabric" if !list => {
            sample.keys =
                format!("truncation = \"{}\"\n", random.one_of(&["branch-clipped", "half-crossing", "internal-only"]));
        }
        "particle-stress" => {
            sample.keys = format!("partition = \"{}\"\n", random.one_of(&["contact-point", "half-branch"]));
        }
        _ => {}
    }
    if matches!(sample.region, Region::Box(..) | Region::Sphere(..)) && random.happens(0.3) {
        sample.velocity = planar(case.dimension, vector(random, 1.0));
    }
    if matches!(sample.region, Region::Box(..)) && random.happens(0.2) {
        sample.keys += if plane { "grid = [2, 1, 1]\n" } else { "grid = [2, 1, 2]\n" };
    }
    sample
}
