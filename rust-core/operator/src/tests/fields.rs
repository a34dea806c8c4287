//! Affine fields and identities of the kinematic operators on triangulations and power diagrams: P10, P11, P15, P16, P23.
//!
//! Fields of size 1 on unit cells of some hundred particles: rounding leaves at most 1e-15 times the number of cells in
//! a sum; the tolerance is 1e-12.

use super::super::strain::{
    Dimension, affine_fit, bagi_strain, boundary_strain, cell_gradient, cell_strain, cosserat, satake_strain,
};
use super::super::tessellation::{Domain, Face, Neighbor, PowerDiagram, delaunay, power_diagram, power_polygons};
use super::*;

const EXACT: f64 = 1e-12;

#[track_caller]
fn exact(a: &Mat3, b: &Mat3) {
    let error = (a - b).abs().max();
    assert!(error < EXACT, "{a}{b} differ by {error:e}");
}

fn unit(dimension: Dimension) -> Mat3 {
    let mut unit = Mat3::identity();
    if dimension == Dimension::Two {
        unit[(2, 2)] = 0.0;
    }
    unit
}

/// A random gradient; in the plane without a third row or column.
fn gradient(r: &mut Random, dimension: Dimension) -> Mat3 {
    let mut g = r.matrix();
    if dimension == Dimension::Two {
        for k in 0..3 {
            g[(2, k)] = 0.0;
            g[(k, 2)] = 0.0;
        }
    }
    g
}

/// A random rotation; in the plane about z.
fn spin(r: &mut Random, dimension: Dimension) -> Vec3 {
    if dimension == Dimension::Two { Vec3::new(0.0, 0.0, r.real()) } else { r.vector() }
}

fn skewed_cell(dimension: Dimension) -> Mat3 {
    match dimension {
        Dimension::Two => Mat3::new(1.0, 0.2, 0.0, 0.1, 0.9, 0.0, 0.0, 0.0, 1.0),
        Dimension::Three => Mat3::new(1.0, 0.2, 0.1, 0.0, 0.9, -0.15, 0.05, 0.0, 1.1),
    }
}

/// The random packing of the unit cube mapped into a skewed periodic cell, with some particles moved to other images.
fn periodic_packing(n: usize, dimension: Dimension, seed: u64) -> (Vec<Vec3>, Vec<f64>, Mat3) {
    let (mut position, radius) = packing(n, 0.45, dimension == Dimension::Two, seed);
    let cell = skewed_cell(dimension);
    for (p, x) in position.iter_mut().enumerate() {
        let mut shift = Vec3::new((p % 3) as f64 - 1.0, (p % 2) as f64, (p % 5) as f64 - 2.0);
        if dimension == Dimension::Two {
            shift.z = 0.0;
        }
        *x = cell * (*x + shift);
    }
    (position, radius, cell)
}

fn affine_fields(dimension: Dimension, seed: u64, jitter: f64) {
    let mut r = Random::new(seed ^ 0x4d);
    let n = if dimension == Dimension::Two { 9 } else { 5 };
    let (position, radius) = packing(n, jitter, dimension == Dimension::Two, seed);
    let (g, u0, theta) = (gradient(&mut r, dimension), spin(&mut r, dimension), spin(&mut r, dimension));
    // A reference configuration that differs from the one of the mesh.
    let reference: Vec<Vec3> =
        position.iter().map(|x| x + gradient(&mut Random::new(5), dimension) * x * 0.05).collect();
    let displacement: Vec<Vec3> = reference.iter().map(|x| u0 + g * x).collect();
    let whole = Region::All { volume: 1.0 };
    let fit = affine_fit(&reference, &displacement, &[], &whole, None, dimension).unwrap();
    exact(&fit.gradient, &g);
    let mesh = delaunay(&position, dimension, None).unwrap();
    exact(&cell_strain(&mesh, &reference, &displacement, None).unwrap().gradient, &g);
    let bagi = bagi_strain(&mesh, &reference, &displacement, None).unwrap();
    exact(&bagi.gradient, &g);
    exact(&bagi.unity, &unit(dimension));
    // Both count the volume of the same body.
    let cells = cell_strain(&mesh, &reference, &displacement, None).unwrap().volume;
    assert!((bagi.volume - cells).abs() < EXACT, "{} {cells}", bagi.volume);
    exact(&boundary_strain(&mesh, &reference, &displacement).unwrap(), &g);
    // Satake with particle rotations and walls that move along.
    let domain = Domain::Box { low: Vec3::repeat(-0.05), high: Vec3::repeat(1.05) };
    let diagram = power_diagram(&position, &radius, &domain, dimension).unwrap();
    let volume = if dimension == Dimension::Two { 1.1 * 1.1 } else { 1.1_f64.powi(3) };
    assert!((diagram.volume() - volume).abs() < EXACT, "{}", diagram.volume());
    outlines_of_faces(&diagram, &position, &radius, &domain);
    let displacement: Vec<Vec3> = position.iter().map(|x| u0 + g * x).collect();
    let border: Vec<Vec3> =
        diagram.border().map(|face| u0 + g * (position[face.point as usize] + face.centroid)).collect();
    let rotation = vec![theta; position.len()];
    let satake = satake_strain(&diagram, &displacement, &rotation, &border, None).unwrap();
    exact(&satake.unity, &unit(dimension));
    let expected = g + cosserat::cross_of_identity(&theta);
    let mut expected = expected;
    if dimension == Dimension::Two {
        expected[(2, 2)] = 0.0;
    }
    exact(&satake.gradient, &expected);
    exact(&satake.gradient.transpose(), &cosserat::strain(&g, &theta));
}

/// The polygons of half of the pairs are the faces between them, to rounding (fewer particles may be looked at), and their corners have the
/// area and the power of both particles.
fn outlines_of_faces(diagram: &PowerDiagram, position: &[Vec3], radius: &[f64], domain: &Domain) {
    let pair_of = |face: &Face| match face.neighbor {
        Neighbor::Particle { point, image } if point != face.point => Some(([face.point, point], image, face.area)),
        _ => None,
    };
    let mut faces: Vec<_> = diagram.faces.iter().filter_map(pair_of).filter(|([a, b], ..)| (a + b) % 2 == 0).collect();
    let wanted: Vec<[u32; 2]> = faces.iter().map(|([a, b], ..)| [*b, *a]).collect();
    let mut polygons = power_polygons(position, radius, domain, diagram.dimension, &wanted).unwrap();
    faces.sort_by_key(|(pair, image, _)| (*pair, *image));
    polygons.sort_by_key(|polygon| (polygon.pair, polygon.image));
    assert!(faces.len() == polygons.len() && !faces.is_empty());
    for ((pair, image, area), polygon) in faces.iter().zip(&polygons) {
        assert_eq!((polygon.pair, polygon.image), (*pair, *image));
        assert!((polygon.area - area).norm() < EXACT, "{} {area}", polygon.area);
        let [first, rest @ ..] = &polygon.corners[..] else { panic!("a face without corners") };
        let sum: Vec3 = rest.windows(2).map(|w| (w[0] - first).cross(&(w[1] - first)) * 0.5).sum();
        assert!((sum - area).norm() < EXACT, "{sum} {area}");
        let [a, b] = pair.map(|p| p as usize);
        let shift = match domain {
            Domain::Periodic(edges) => edges * Vec3::from(image.map(f64::from)),
            _ => Vec3::zeros(),
        };
        for corner in &polygon.corners {
            let mut from = [corner - position[a], corner - position[b] - shift];
            if diagram.dimension == Dimension::Two {
                for x in &mut from {
                    x.z = 0.0;
                }
            }
            let power = |x: &Vec3, r: f64| x.norm_squared() - r * r;
            assert!((power(&from[0], radius[a]) - power(&from[1], radius[b])).abs() < EXACT);
        }
    }
}

fn periodic_fields(dimension: Dimension, n: usize, seed: u64) {
    let mut r = Random::new(seed ^ 0x4e);
    let (mut position, radius, cell) = periodic_packing(n, dimension, seed);
    let (g, u0, theta) = (gradient(&mut r, dimension), spin(&mut r, dimension), spin(&mut r, dimension));
    let mut edges = cell;
    if dimension == Dimension::Two {
        edges[(2, 2)] = 1.0;
        // The rotation of a clump rounds: such a disc must not count as one of the next image, 1 m away.
        position.iter_mut().step_by(3).for_each(|x| x.z = -1e-20);
    }
    let period = Period { edges, change: g * edges };
    let displacement: Vec<Vec3> = position.iter().map(|x| u0 + g * x).collect();
    let mesh = delaunay(&position, dimension, Some(&cell)).unwrap();
    assert_eq!(mesh.hull().count(), 0);
    exact(&cell_gradient(&period).unwrap(), &g);
    exact(&cell_strain(&mesh, &position, &displacement, Some(&period)).unwrap().gradient, &g);
    let bagi = bagi_strain(&mesh, &position, &displacement, Some(&period)).unwrap();
    exact(&bagi.gradient, &g);
    exact(&bagi.unity, &unit(dimension));
    let region =
        Region::Cylinder { center: cell * Vec3::new(0.1, 0.1, 0.0), axis: Vec3::z(), radius: 0.4, half_length: 0.5 };
    let fit = affine_fit(&position, &displacement, &[], &region, Some(&period), dimension).unwrap();
    exact(&fit.gradient, &g);
    let diagram = power_diagram(&position, &radius, &Domain::Periodic(cell), dimension).unwrap();
    assert!((diagram.volume() - edges.determinant().abs()).abs() < EXACT);
    outlines_of_faces(&diagram, &position, &radius, &Domain::Periodic(cell));
    let rotation = vec![theta; position.len()];
    let satake = satake_strain(&diagram, &displacement, &rotation, &[], Some(&period)).unwrap();
    exact(&satake.unity, &unit(dimension));
    exact(&satake.gradient.transpose(), &cosserat::strain(&g, &theta));
    // P16 without an affine field: the strain from cells, the strain from edges, and the cell's own change agree.
    let any: Vec<Vec3> = position.iter().map(|_| spin(&mut r, dimension)).collect();
    let cells = cell_strain(&mesh, &position, &any, Some(&period)).unwrap().gradient;
    exact(&cells, &bagi_strain(&mesh, &position, &any, Some(&period)).unwrap().gradient);
    exact(&cells, &g);
}

proptest! {
    #![proptest_config(cases(12))]

    #[test]
    fn p10_p11_p15_affine_fields_in_space(seed in any::<u64>()) {
        affine_fields(Dimension::Three, seed, 0.45);
    }

    #[test]
    fn p10_p11_p15_affine_fields_in_the_plane(seed in any::<u64>()) {
        affine_fields(Dimension::Two, seed, 0.45);
    }

    #[test]
    fn p10_p11_p15_periodic_fields_in_space(seed in any::<u64>()) {
        periodic_fields(Dimension::Three, 4, seed);
    }

    #[test]
    fn p10_p11_p15_periodic_fields_in_the_plane(seed in any::<u64>()) {
        periodic_fields(Dimension::Two, 7, seed);
    }

    /// The three strains of one triangulation agree for any motion (P16). A rigid rotation is an antisymmetric gradient
    /// for Bagi and zero for Satake (P9).
    #[test]
    fn p16_p9_any_motion(seed in any::<u64>(), plane in any::<bool>()) {
        let dimension = if plane { Dimension::Two } else { Dimension::Three };
        let (position, radius) = packing(if plane { 8 } else { 4 }, 0.45, plane, seed);
        let mut r = Random::new(seed ^ 0x4f);
        let mut u: Vec<Vec3> = position.iter().map(|_| spin(&mut r, Dimension::Three)).collect();
        if plane {
            for u in &mut u {
                u.z = 0.0;
            }
        }
        let mesh = delaunay(&position, dimension, None).unwrap();
        let cells = cell_strain(&mesh, &position, &u, None).unwrap();
        let mean = cells.gradient;
        // Random displacements of size 1 over spacings of 0.1 make gradients of size 10.
        let near = |g: Mat3| (g - mean).abs().max() < 10.0 * EXACT;
        prop_assert!(near(bagi_strain(&mesh, &position, &u, None).unwrap().gradient));
        prop_assert!(near(boundary_strain(&mesh, &position, &u).unwrap()));
        let omega = spin(&mut r, dimension);
        let turn: Vec<Vec3> = position.iter().map(|x| omega.cross(x)).collect();
        let g = bagi_strain(&mesh, &position, &turn, None).unwrap().gradient;
        exact(&g, &-cosserat::cross_of_identity(&omega));
        let domain = Domain::Box { low: Vec3::repeat(-0.05), high: Vec3::repeat(1.05) };
        let diagram = power_diagram(&position, &radius, &domain, dimension).unwrap();
        let border: Vec<Vec3> =
            diagram.border().map(|face| omega.cross(&(position[face.point as usize] + face.centroid))).collect();
        let spins = vec![omega; position.len()];
        let satake = satake_strain(&diagram, &turn, &spins, &border, None).unwrap();
        exact(&satake.gradient, &Mat3::zeros());
    }

    /// No-void limit: Voronoi cells fill space; stress over cells averages to the branch sum (P23).
    #[test]
    fn p23_cells_fill_space(seed in any::<u64>()) {
        use super::super::stress::{Partition, particle_moments, region_stress};
        let (position, radius, cell) = periodic_packing(4, Dimension::Three, seed);
        let zeros = vec![0.0; radius.len()];
        let volume = cell.determinant();
        for radius in [&radius, &zeros] {
            let diagram = power_diagram(&position, radius, &Domain::Periodic(cell), Dimension::Three).unwrap();
            prop_assert!((diagram.volume() - volume).abs() < EXACT);
            // A contact with a random force at each face.
            let mut r = Random::new(seed ^ 0x50);
            let (mut pair, mut branch, mut point, mut force) = (vec![], vec![], vec![], vec![]);
            for face in &diagram.faces {
                if let Neighbor::Particle { point: q, .. } = face.neighbor {
                    pair.push([face.point, q]);
                    branch.push(face.branch);
                    point.push(position[face.point as usize] + face.centroid);
                    force.push(r.vector());
                }
            }
            let set = ContactSet::new(&position, &pair, &branch, &point, &force, None).unwrap();
            let moments = particle_moments(&set, &LoadSet::none(), Partition::ContactPoint);
            let mean: Mat3 = moments.iter().zip(&diagram.volumes).map(|(m, v)| (m / *v) * (v / volume)).sum();
            let whole = region_stress(&set, &Region::periodic_cell(&cell), Truncation::BranchClipped, None).unwrap();
            close(&mean, &whole.stress, 100.0);
        }
    }
}

/// Degenerate points: cubic lattices, in a box and periodic, where every triangulation is as good as another and all
/// power cells are cubes.
#[test]
fn lattices() {
    for dimension in [Dimension::Two, Dimension::Three] {
        affine_fields(dimension, 3, 0.0);
        let plane = dimension == Dimension::Two;
        let (position, _) = packing(6, 0.0, plane, 1);
        let cell = Mat3::identity();
        let mesh = delaunay(&position, dimension, Some(&cell)).unwrap();
        let zero = vec![0.0; position.len()];
        let diagram = power_diagram(&position, &zero, &Domain::Periodic(cell), dimension).unwrap();
        let each = 1.0 / position.len() as f64;
        assert!(diagram.volumes.iter().all(|v| (v - each).abs() < 1e-15));
        let g = Mat3::new(0.1, 0.2, 0.0, -0.3, 0.4, 0.0, 0.0, 0.0, 0.0);
        let u: Vec<Vec3> = position.iter().map(|x| g * x).collect();
        let period = Period { edges: cell, change: g };
        exact(&cell_strain(&mesh, &position, &u, Some(&period)).unwrap().gradient, &g);
        let satake = satake_strain(&diagram, &u, &[], &[], Some(&period)).unwrap();
        exact(&satake.gradient, &g);
    }
}

/// Laguerre cells against counts of random points by power: the sampling error of a fraction s by N points is √(s/N).
#[test]
fn power_cells_by_counting() {
    let (position, radius) = packing(3, 0.45, false, 4);
    let domain = Domain::Box { low: Vec3::zeros(), high: Vec3::repeat(1.0) };
    let diagram: PowerDiagram = power_diagram(&position, &radius, &domain, Dimension::Three).unwrap();
    let mut r = Random::new(9);
    let n = 100_000;
    let mut count = vec![0.0; position.len()];
    for _ in 0..n {
        let x = Vec3::new(r.share(), r.share(), r.share());
        let power = |p: &usize| (x - position[*p]).norm_squared() - radius[*p] * radius[*p];
        let nearest = (0..position.len()).min_by(|p, q| power(p).total_cmp(&power(q))).unwrap();
        count[nearest] += 1.0 / f64::from(n);
    }
    for (volume, count) in diagram.volumes.iter().zip(&count) {
        let error = 4.0 * (volume / f64::from(n)).sqrt();
        assert!((volume - count).abs() < error + 1e-4, "{volume} {count}");
    }
}

/// Cells by region: a grid of boxes contains each cell once, and an affine field is exact in each part, periodic or
/// not.
#[test]
fn cells_of_regions() {
    for dimension in [Dimension::Two, Dimension::Three] {
        let mut r = Random::new(17);
        let plane = dimension == Dimension::Two;
        let (position, _) = packing(if plane { 9 } else { 5 }, 0.45, plane, 3);
        let u: Vec<Vec3> = position.iter().map(|_| spin(&mut r, Dimension::Three)).collect();
        let mesh = delaunay(&position, dimension, None).unwrap();
        let all = cell_strain(&mesh, &position, &u, None).unwrap();
        let parts: Vec<_> = Region::grid(Vec3::repeat(-0.01), Vec3::repeat(1.01), [3, 2, if plane { 1 } else { 2 }])
            .iter()
            .map(|cell| all.within(&mesh, &position, cell, None).unwrap())
            .collect();
        assert_eq!(parts.iter().map(|part| part.cells.len()).sum::<usize>(), mesh.len());
        let mean: Mat3 = parts.iter().map(|part| part.gradient * part.volume).sum::<Mat3>() / all.volume;
        // Random displacements of size 1 over spacings of 0.1.
        assert!((mean - all.gradient).abs().max() < 10.0 * EXACT);
        let far = Region::Sphere { center: Vec3::repeat(9.0), radius: 1.0 };
        assert!(all.within(&mesh, &position, &far, None).is_err());
        let list = Region::of_particles(position.len(), |p| p % 2 == 0, 1.0);
        assert_eq!(all.within(&mesh, &position, &list, None), Err(OperatorError::NoSurface));
        // A sphere across the border of a periodic cell.
        let (position, _, cell) = periodic_packing(if plane { 7 } else { 4 }, dimension, 5);
        let mut edges = cell;
        if plane {
            edges[(2, 2)] = 1.0;
        }
        let g = gradient(&mut r, dimension);
        let period = Period { edges, change: g * edges };
        let u: Vec<Vec3> = position.iter().map(|x| g * x).collect();
        let mesh = delaunay(&position, dimension, Some(&cell)).unwrap();
        let all = cell_strain(&mesh, &position, &u, Some(&period)).unwrap();
        let ball = Region::Cylinder { center: Vec3::zeros(), axis: Vec3::z(), radius: 0.4, half_length: 0.6 };
        let part = all.within(&mesh, &position, &ball, Some(&period)).unwrap();
        exact(&part.gradient, &g);
        assert!(part.cells.len() > 10 && part.cells.len() < mesh.len());
        if plane {
            // The same for a disc and for a grid of boxes that are infinite across the plane.
            let disc = all.within(&mesh, &position, &Region::disc(Vec3::zeros(), 0.4), Some(&period)).unwrap();
            assert_eq!(disc.cells, part.cells);
            let Region::Box { low, high } = Region::rectangle([-0.3, -0.2], [0.5, 0.4]) else { unreachable!() };
            let count = |region: &Region| {
                let images = region.images(Some(&period));
                position.iter().enumerate().map(|(p, x)| images.inside(p, x).count()).sum::<usize>()
            };
            let parts: usize = Region::grid(low, high, [4, 3, 1]).iter().map(count).sum();
            assert_eq!(parts, count(&Region::Box { low, high }));
            assert!(parts > 10 && Region::grid(low, high, [4, 3, 1]).iter().all(|part| part.volume().is_ok()));
        }
    }
}

/// Thread counts do not change a bit.
#[test]
fn same_bits_for_any_number_of_threads() {
    use super::super::stress::{Partition, particle_moments, region_stress};
    let mut r = Random::new(6);
    let n = 5000;
    let position: Vec<Vec3> = (0..n).map(|_| r.vector()).collect();
    let mut c = Cluster { position, ..Cluster::default() };
    for k in 0..40_000 {
        // Contacts sorted by particle and with nearby particles, as in the solver.
        let a = (k * n / 40_000).min(n - 40);
        let b = a + 1 + r.below(30);
        c.push(a, b, &mut r);
    }
    c.velocity = c.position.iter().map(|_| r.vector()).collect();
    let work = || {
        let set = c.set();
        let region = Region::Sphere { center: Vec3::zeros(), radius: 0.8 };
        let stress = region_stress(&set, &region, Truncation::BranchClipped, None).unwrap().stress;
        let moments = particle_moments(&set, &LoadSet::none(), Partition::ContactPoint);
        let fit = affine_fit(&c.position, &c.velocity, &[], &region, None, Dimension::Three).unwrap();
        (stress, moments, fit)
    };
    let on = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(work);
    let one = on(1);
    // Sums in pieces with halos equal plain sums.
    let mut plain = vec![Mat3::zeros(); n];
    for k in 0..c.pair.len() {
        let (contact, [a, b]) = (c.set().get(k), c.pair[k].map(|p| p as usize));
        plain[a] += contact.arm_a * contact.force.transpose();
        plain[b] -= contact.arm_b * contact.force.transpose();
    }
    for (found, expected) in one.1.iter().zip(&plain) {
        close(found, expected, 100.0);
    }
    assert_eq!(one, on(2));
    assert_eq!(one, on(7));
}
