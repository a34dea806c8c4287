//! A fiber in a random scenario.

use std::fmt::Write as _;

use concordem::math::Vec3;
use concordem_tests::random::Random;

use crate::case::{Case, Loading};

/// Diameter of the fiber, m; the spheres have some 2 mm.
const DIAMETER: f64 = 0.6e-3;
/// Distance below which the fiber would remove spheres, over the sum of radii.
const CLEARING: f64 = 0.2;
/// Places tried.
const TRIES: usize = 200;

/// A straight fiber with its material.
#[derive(Clone, Debug)]
pub struct Fiber {
    pub ends: [Vec3; 2],
}

impl Fiber {
    /// The table of the fiber.
    pub fn text(&self) -> String {
        let list = |x: &Vec3| format!("[{:?}, {:?}, {:?}]", x.x, x.y, x.z);
        let [from, to] = &self.ends;
        format!(
            "[fibers]\nclearing = {CLEARING:?}\n[[fibers.group]]\nmaterial = \"f\"\ndiameter = {DIAMETER:?}\nlines = [[{}, {}]]\n",
            list(from),
            list(to)
        )
    }
}

/// Adds a fiber that removes no sphere, so that the numbers of the spheres stay, if the scenario can have one and there is a place.
pub fn add(random: &mut Random, case: &mut Case) {
    let Some((law, _)) = case.bonds else { return };
    let refused =
        ["deformable", "at_start"].iter().any(|key| case.materials.contains(key) || case.options.contains(key));
    // Walls and platens would have to keep their distance.
    let walled = !case.walls.is_empty() || matches!(case.loading, Loading::Platens(..));
    if case.dimension == 2 || case.heat.is_some() || refused || walled {
        return;
    }
    let Some(ends) = (0..TRIES).find_map(|_| free_place(random, case)) else { return };
    // The block of the first material under another name, heavier because the particles are smaller.
    let first = case.materials.find("[[material]]").unwrap_or(0);
    let end = case.materials[first + 1..].find("[[material]]").map_or(case.materials.len(), |at| first + 1 + at);
    let mut material =
        case.materials[first..end].replacen("\"m\"", "\"f\"", 1).replacen("density = 2500", "density = 50000", 1);
    if law != "cohesive_beam" {
        let strength = random.one_of(&["", ", tensile_strength = 1e6", ", tensile_strength = 1e7"]);
        let young = random.between(1e9, 1e10);
        let _ = writeln!(material, "cohesive_beam = {{ young = {young:?}, radius_ratio = 1{strength} }}");
    }
    case.materials += &material;
    case.fiber = Some(Fiber { ends });
}

/// A place between the spheres, and its ends.
fn free_place(random: &mut Random, case: &Case) -> Option<[Vec3; 2]> {
    let spheres = case.spheres.iter().chain(case.clumps.iter().flat_map(|clump| &clump.spheres));
    let spheres: Vec<(Vec3, f64)> = spheres.copied().collect();
    let bounds = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    let (low, high) = spheres.iter().fold(bounds, |(low, high), (x, _)| (low.inf(x), high.sup(x)));
    let start = Vec3::from_fn(|i, _| random.between(low[i], high[i]));
    let direction = Vec3::from_fn(|_, _| random.between(-1.0, 1.0));
    let count = 3 + random.below(4);
    let along = direction.try_normalize(0.1)? * DIAMETER;
    let centers: Vec<Vec3> = (0..count).map(|k| start + along * k as f64).collect();
    let images = case.cell.map_or_else(
        || vec![Vec3::zeros()],
        |cell| {
            let image = |k: i32| Vec3::new(f64::from(k % 3 - 1), f64::from(k / 3 % 3 - 1), f64::from(k / 9 - 1));
            (0..27).map(|k| image(k).component_mul(&cell)).collect()
        },
    );
    let far = |x: &Vec3, y: &Vec3, least: f64| images.iter().all(|shift| (x + shift - y).norm() > least);
    let free = |center: &Vec3| spheres.iter().all(|(x, r)| far(x, center, 1.01 * CLEARING * (r + 0.5 * DIAMETER)));
    // Its own images are not bonded to it.
    let apart = |image: &Vec3| {
        *image == Vec3::zeros()
            || centers.iter().all(|x| centers.iter().all(|y| (x + image - y).norm() > 1.01 * DIAMETER))
    };
    (centers.iter().all(free) && images.iter().all(apart))
        .then(|| [start - along * 0.5, centers[count - 1] + along * 0.5])
}
