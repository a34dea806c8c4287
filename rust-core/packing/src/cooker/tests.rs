//! Packings between walls.

use super::*;
use crate::shape::Mesh;
use concordem_contact::math::Vec3;

/// Radii of mean 1 m and dispersion 25 %.
fn book() -> SizeDistribution {
    SizeDistribution::Uniform { low: 0.875, high: 1.125 }
}

fn cube(edge: f64) -> Shape {
    Shape::new_box(Vec3::repeat(-0.5 * edge), Vec3::repeat(0.5 * edge)).unwrap()
}

/// A cube of 300 spheres.
fn recipe(target: Target) -> Cooker {
    Cooker::new(cube(12.5), book(), target, 3)
}

fn make(recipe: &Cooker) -> Cooked {
    cook(recipe, &mut |_| {}).unwrap()
}

/// Insertion ends at the target, at rest. Softening removes the overlaps: the walls keep a thousandth of their stiffness, so that the
/// pressure falls to some hundredth; a twentieth of the overlap is allowed. The solid fraction at the walls is lower than inside: of six
/// layers in a cube of 12.5 radii, the outer ones have a wall. The bounds enclose 0.55 (loose) to 0.66 (with overlaps).
#[test]
fn a_box_is_filled_to_the_target() {
    let cooked = make(&recipe(Target::Coordination(6.2)));
    let Cooked { filled, last, .. } = cooked;
    assert!(filled.coordination >= 6.2 && filled.coordination < 7.5, "{filled:?}");
    assert!((0.53..0.66).contains(&filled.solid_fraction), "{filled:?}");
    assert!(last.overlap < 0.05 * filled.overlap.max(1e-2), "{last:?} {filled:?}");
    assert!(last.coordination <= filled.coordination, "{last:?} {filled:?}");
    assert!(cooked.network.is_none() && cooked.packets > 1 && cooked.lost == 0);
    // The walls hold the spheres: none sticks out by more than softening needs, which is at most the largest overlap at each of the three
    // contacts of a row from the middle to the wall.
    assert!(filled.largest_overlap < 0.05, "{filled:?}");
    let shape = cube(12.5 + 2.0 * 3.0 * 0.05);
    assert!(cooked.packing.spheres.iter().all(|sphere| shape.contains(&sphere.position, sphere.radius)));
}

/// Radii are not chosen by whether they fit: their mean is that of the distribution. 290 stratified radii of deviation 0.072 have a mean
/// known to 0.072/√290 = 0.0042 if the last of them are missing at random; three times that.
#[test]
fn sizes_are_those_of_the_distribution() {
    let cooked = make(&Cooker { softening: 0, ..recipe(Target::SolidFraction(0.58)) });
    let radii: Vec<f64> = cooked.packing.spheres.iter().map(|sphere| sphere.radius).collect();
    let mean = radii.iter().sum::<f64>() / radii.len() as f64;
    approx::assert_abs_diff_eq!(mean, 1.0, epsilon = 0.0126);
    assert!(radii.iter().all(|r| (0.875..=1.125).contains(r)));
}

/// A solid fraction is reached with the last sphere, and no more; an overlap up to the excess of a packet of one sphere.
#[test]
fn other_targets() {
    let by_fraction = make(&Cooker { softening: 0, ..recipe(Target::SolidFraction(0.5)) });
    let one = 4.0 / 3.0 * std::f64::consts::PI * 1.125_f64.powi(3) / 12.5_f64.powi(3);
    assert!((0.5..0.5 + one).contains(&by_fraction.last.solid_fraction), "{:?}", by_fraction.last);
    assert!(by_fraction.last.overlap < 1e-3, "loose: {:?}", by_fraction.last);
    let by_overlap = make(&Cooker { softening: 0, ..recipe(Target::Overlap(0.02)) });
    // One sphere of 300 compresses the packing by 0.33 % in volume, which adds 2/3 · 0.33 % = 0.002 to the overlap over the radius, more
    // near jamming; twice that.
    assert!((0.02..0.024).contains(&by_overlap.last.overlap), "{:?}", by_overlap.last);
}

/// Frozen links keep their number and their length: a spring network with 6.2 links per sphere is only slightly overconstrained, so few
/// springs stay loaded. Enlarged radii have as many links as the target.
#[test]
fn corrections_keep_the_coordination_number() {
    let frozen = make(&Cooker { correction: Correction::FrozenLinks, ..recipe(Target::Coordination(6.5)) });
    let links = frozen.network.unwrap();
    assert!(frozen.links_inside >= 6.4, "{}", frozen.links_inside);
    let spheres = &frozen.packing.spheres;
    let stretch = |[a, b]: [u32; 2]| {
        let (a, b) = (&spheres[a as usize], &spheres[b as usize]);
        (a.position - b.position).norm() / (a.radius + b.radius) - 1.0
    };
    let worst = links.iter().map(|link| stretch(*link).abs()).fold(0.0, f64::max);
    let mean = links.iter().map(|link| stretch(*link).abs()).sum::<f64>() / links.len() as f64;
    println!("frozen: mean {mean:e}, worst {worst:e}, filled {:?}", frozen.filled);
    assert!(mean < 0.5 * frozen.filled.overlap, "{mean:e} {worst:e}");
    let enlarged = make(&Cooker { correction: Correction::EnlargedRadii, ..recipe(Target::Coordination(6.5)) });
    let inside = boundary(&enlarged.packing.spheres, &cube(12.5)).iter().filter(|outer| !**outer).count() as f64;
    // Whole links, of which at most a tie is added.
    assert!((enlarged.links_inside - 6.5).abs() < 2.5 / inside, "{}", enlarged.links_inside);
    assert!(enlarged.interaction_ratio.unwrap() > 1.0 && enlarged.interaction_ratio.unwrap() < 1.1);
}

/// Spheres stay in a cylinder and in a mesh, and are as dense there.
#[test]
fn cylinders_and_meshes_hold_spheres() {
    let cylinder = Shape::new_cylinder(Vec3::new(0.0, 0.0, -6.0), Vec3::new(0.0, 0.0, 6.0), 6.0).unwrap();
    // A cube of twelve triangles.
    let corner = |k: usize| Vec3::from_fn(|axis, _| if k >> axis & 1 == 1 { 6.0 } else { -6.0 });
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    let mesh = Shape::Mesh(Mesh::new((0..8).map(corner).collect(), triangles).unwrap());
    for shape in [cylinder, mesh] {
        let recipe = Cooker { shape: shape.clone(), softening: 2, ..recipe(Target::Coordination(6.2)) };
        let cooked = make(&recipe);
        println!("{:?} lost {}", cooked.last, cooked.lost);
        assert!(cooked.filled.coordination >= 6.2);
        assert!((0.53..0.66).contains(&cooked.filled.solid_fraction), "{:?}", cooked.filled);
        assert!(cooked.packing.spheres.iter().all(|sphere| shape.contains(&sphere.position, 0.0)));
        assert!(cooked.lost * 100 <= cooked.packing.spheres.len(), "{} lost", cooked.lost);
    }
}

/// Twelve contacts per sphere need overlaps beyond a fifth of the radius; the error names the best value, which is above that of a
/// dense packing.
#[test]
fn targets_out_of_reach_are_refused() {
    // A hundred spheres.
    match cook(&Cooker { shape: cube(9.0), ..recipe(Target::Coordination(15.0)) }, &mut |_| {}) {
        Err(PackingError::TargetNotReached { wanted, best, .. }) => {
            assert!(wanted == 15.0 && best > 7.0 && best < 15.0, "{best}");
        }
        other => panic!("{other:?}"),
    }
}

/// The same bits for one and three threads; another seed gives another packing. More than 1024 spheres, so that the solver
/// has several tiles.
#[test]
fn threads_do_not_matter_and_seeds_do() {
    let run = |edge: f64, threads: usize, seed: u64| {
        let recipe =
            Cooker { shape: cube(edge), seed, softening: 1, unbalanced: 0.2, ..recipe(Target::Coordination(5.0)) };
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| make(&recipe))
    };
    let one = run(21.0, 1, 7);
    assert!(one.packing.spheres.len() > 1024, "{}", one.packing.spheres.len());
    assert!(run(21.0, 3, 7) == one);
    assert!(run(6.0, 2, 7).packing != run(6.0, 2, 8).packing);
}

#[test]
fn invalid_recipes_are_refused() {
    let good = recipe(Target::Coordination(6.2));
    let ball = Shape::new_sphere(Vec3::zeros(), 6.0).unwrap();
    let bad = [
        Cooker { shape: ball, ..good.clone() },
        Cooker { friction: -1.0, ..good.clone() },
        Cooker { attempts: 0, ..good.clone() },
        Cooker { packet: Some(0), ..good.clone() },
        Cooker { target: Target::SolidFraction(0.95), ..good.clone() },
        Cooker { target: Target::Overlap(0.5), ..good.clone() },
        Cooker { target: Target::Coordination(f64::NAN), ..good.clone() },
        Cooker { sizes: SizeDistribution::Single(-1.0), ..good.clone() },
        // Larger than the vessel.
        Cooker { sizes: SizeDistribution::Single(7.0), ..good.clone() },
    ];
    for recipe in bad {
        assert!(cook(&recipe, &mut |_| {}).is_err(), "{recipe:?}");
    }
    let hurried = Cooker { step_limit: 20, unbalanced: 1e-5, ..good };
    assert!(matches!(
        cook(&hurried, &mut |_| {}),
        Err(PackingError::NotAtRest { .. } | PackingError::TargetNotReached { .. })
    ));
}

/// Equal spheres reach Z = 12 in a small cube only with overlaps of a sixth of the radius. The walls, once soft, let a sixth of them go.
#[test]
fn targets_that_press_spheres_through_the_walls_are_refused() {
    let recipe = Cooker::new(cube(9.0), SizeDistribution::Single(1.0), Target::Coordination(12.0), 0);
    let refused = cook(&recipe, &mut |_| {}).unwrap_err();
    assert!(matches!(refused, PackingError::Leaking { .. }), "{refused}");
}
