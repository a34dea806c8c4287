//! Regions: truncation, images, maps of fields, coarse-graining.

use super::super::coarse_grain::{Kernel, coarse_grain};
use super::super::couple_stress::conjugate;
use super::super::fabric::fabric;
use super::super::strain::Dimension;
use super::super::stress::{
    Partition, kinetic_stress, particle_moments, region_stress, region_stress_from_particles, solid_fraction,
};
use super::*;

/// Contacts with branch vectors of length `length` distributed evenly over a cube of side 2 around the origin, unit
/// tension each.
fn network(count: usize, length: f64, seed: u64) -> Cluster {
    let mut r = Random::new(seed);
    let mut c = Cluster::default();
    for k in 0..count {
        let (middle, n) = (r.vector(), r.direction());
        c.position.push(middle - n * (0.5 * length));
        c.position.push(middle + n * (0.5 * length));
        c.pair.push([2 * k as u32, 2 * k as u32 + 1]);
        c.branch.push(n * length);
        c.point.push(middle);
        c.force.push(n);
        c.moment.push(Vec3::zeros());
    }
    c
}

/// The fraction of the stress that internal-only sampling keeps in a homogeneous network: `1 − ¾ l/R + (l/R)³/16` in a
/// sphere, about `1 − (3/2) l/a` in a cube (exactly `1 − (3/2) l/a + (2/π)(l/a)² − (1/4π)(l/a)³`, from the mean of
/// `Π(a − l|n_k|)`). Half and clipped weights are unbiased. The number N of contacts in the region scatters by 1/√N,
/// which the common reference removes.
#[test]
fn truncation_bias() {
    use std::f64::consts::PI;
    let count = 400_000;
    let mut worst = 0.0_f64;
    for ratio in [0.1, 0.24, 0.4] {
        let reach = 0.6;
        let ball = Region::Sphere { center: Vec3::zeros(), radius: reach };
        let cube = Region::cube(Vec3::zeros(), 2.0 * reach);
        let c = network(count, ratio * reach, 5);
        let set = c.set();
        let cases = [
            (&ball, 1.0 - 0.75 * ratio + ratio.powi(3) / 16.0),
            (&cube, {
                let q = 0.5 * ratio;
                1.0 - 1.5 * q + 2.0 / PI * q * q - q.powi(3) / (4.0 * PI)
            }),
        ];
        for (region, kept) in cases {
            let pressure = |truncation| region_stress(&set, region, truncation, None).unwrap();
            let clipped = pressure(Truncation::BranchClipped);
            let expected = count as f64 / 8.0 * ratio * reach;
            // N contacts inside: four times the relative sampling error 1/√N.
            let error = 4.0 / (count as f64 / 8.0 * clipped.volume).sqrt();
            assert!((clipped.stress.trace() / expected - 1.0).abs() < error, "{} {expected}", clipped.stress.trace());
            let half = pressure(Truncation::HalfCrossing).stress.trace() / expected;
            assert!((half - 1.0).abs() < error, "{half}");
            let internal = pressure(Truncation::InternalOnly).stress.trace() / clipped.stress.trace();
            worst = worst.max((internal - kept).abs());
            assert!((internal - kept).abs() < error, "{internal} {kept} ± {error}");
        }
    }
    println!("truncation bias of spheres and cubes: largest deviation from the law {worst:.1e}");
}

/// The fraction of a segment inside each kind of region against a count of points along it (error 1/points).
#[test]
fn clipping_by_counting() {
    let mut r = Random::new(12);
    let skew = Mat3::identity() + r.matrix() * 0.3;
    let regions = [
        Region::Box { low: Vec3::repeat(-0.5), high: Vec3::new(0.4, 0.5, 0.6) },
        Region::Sphere { center: Vec3::new(0.1, 0.0, 0.0), radius: 0.6 },
        Region::Cylinder { center: Vec3::zeros(), axis: Vec3::new(0.6, 0.0, 0.8), radius: 0.4, half_length: 0.5 },
        Region::Ellipsoid { center: Vec3::zeros(), axes: skew * 0.6 },
        Region::Parallelepiped { corner: Vec3::repeat(-0.4), edges: skew * 0.8 },
        Region::HalfSpaces {
            planes: vec![
                HalfSpace { point: Vec3::repeat(0.2), normal: Vec3::new(1.0, 1.0, 0.5) },
                HalfSpace { point: Vec3::repeat(-0.4), normal: Vec3::new(-1.0, 0.3, -0.5) },
            ],
            volume: 1.0,
        },
        Region::disc(Vec3::zeros(), 0.5),
    ];
    for region in &regions {
        let mut partial = 0;
        for _ in 0..200 {
            let (x, l) = (r.vector(), r.vector());
            let n = 2000;
            let inside =
                (0..n).filter(|&k| region.contains(0, &(x + l * ((f64::from(k) + 0.5) / f64::from(n))))).count();
            let share = region.fraction_of_segment(&x, &l);
            assert!((share - inside as f64 / f64::from(n)).abs() <= 1.0 / f64::from(n), "{region:?} {share}");
            partial += i32::from(share > 0.0 && share < 1.0);
        }
        assert!(partial > 10, "{region:?}");
        region.volume().unwrap();
    }
}

/// The depth is a lower bound of the distance to the border, with the sign of the side: no point of the ball with this
/// radius is on the other side.
#[test]
fn depth_is_a_bound() {
    let mut r = Random::new(18);
    let skew = Mat3::identity() + r.matrix() * 0.3;
    let half = |point: f64, normal: Vec3| HalfSpace { point: Vec3::repeat(point), normal };
    for region in [
        Region::Box { low: Vec3::repeat(-0.5), high: Vec3::new(0.4, 0.5, 0.6) },
        Region::Sphere { center: Vec3::new(0.1, 0.0, 0.0), radius: 0.6 },
        Region::Cylinder { center: Vec3::zeros(), axis: Vec3::new(0.6, 0.0, 0.8), radius: 0.4, half_length: 0.5 },
        Region::Ellipsoid { center: Vec3::zeros(), axes: skew * 0.6 },
        Region::Parallelepiped { corner: Vec3::repeat(-0.4), edges: skew * 0.8 },
        Region::HalfSpaces {
            planes: vec![half(0.2, Vec3::new(1.0, 1.0, 0.5)), half(-0.4, Vec3::new(-1.0, 0.3, -0.5))],
            volume: 1.0,
        },
        Region::rectangle([-0.5, -0.4], [0.5, 0.4]),
        Region::disc(Vec3::zeros(), 0.5),
    ] {
        let (mut inside, mut largest) = (0, 0.0_f64);
        for _ in 0..300 {
            let x = r.vector();
            let depth = region.depth(&x);
            assert_eq!(depth > 0.0, region.contains(0, &x), "{region:?} {x}");
            inside += i32::from(depth > 0.0);
            largest = largest.max(depth);
            for _ in 0..30 {
                let near = x + r.direction() * (depth.abs() * 0.999_999 * r.share());
                assert_eq!(region.contains(0, &near), depth > 0.0, "{region:?} {x} {near}");
            }
        }
        assert!(inside > 10 && inside < 290 && largest > 0.1, "{region:?} {inside} {largest}");
    }
    assert_eq!(Region::All { volume: 1.0 }.depth(&Vec3::zeros()), f64::INFINITY);
}

/// Volumes by counting points; regions that move with a deformation keep their particles.
#[test]
fn moving_regions() {
    let mut r = Random::new(13);
    let f = Mat3::identity() + r.matrix() * 0.2;
    let (origin, shift) = (Vec3::new(0.3, 0.0, 0.1), Vec3::new(1.0, 2.0, 3.0));
    for region in [
        Region::Box { low: Vec3::repeat(-0.5), high: Vec3::new(0.4, 0.5, 0.6) },
        Region::Sphere { center: Vec3::new(0.1, 0.0, 0.0), radius: 0.6 },
        Region::Ellipsoid { center: Vec3::zeros(), axes: f * 0.6 },
        Region::HalfSpaces {
            planes: vec![HalfSpace { point: Vec3::zeros(), normal: Vec3::new(1.0, 1.0, 0.5) }],
            volume: 0.5,
        },
    ] {
        let moved = region.moved(&f, &origin, &shift);
        let growth = moved.volume().unwrap() / region.volume().unwrap();
        assert!((growth - f.determinant()).abs() < 1e-13);
        for _ in 0..1000 {
            let x = r.vector();
            let image = origin + f * (x - origin) + shift;
            assert_eq!(region.contains(0, &x), moved.contains(0, &image), "{region:?}");
        }
        let virials = region.translated(&shift);
        assert!((virials.volume().unwrap() - region.volume().unwrap()).abs() < 1e-14);
    }
    // A cylinder along its axis.
    let cylinder = Region::Cylinder { center: Vec3::zeros(), axis: Vec3::z(), radius: 0.4, half_length: 0.5 };
    let stretch = Mat3::from_diagonal(&Vec3::new(0.9, 0.9, 1.3));
    let moved = cylinder.moved(&stretch, &Vec3::zeros(), &shift);
    for _ in 0..1000 {
        let x = r.vector();
        assert_eq!(cylinder.contains(0, &x), moved.contains(0, &(stretch * x + shift)));
    }
}

/// A region anywhere in a periodic packing gives the same as one in the middle of many copies.
#[test]
fn regions_across_the_periodic_border() {
    let mut r = Random::new(14);
    let cell = Mat3::new(1.0, 0.2, 0.1, 0.0, 0.9, -0.15, 0.05, 0.0, 1.1);
    let mut c = Cluster::default();
    for _ in 0..40 {
        c.position.push(cell * Vec3::new(r.share(), r.share(), r.share()));
    }
    for _ in 0..120 {
        let (a, b) = (r.below(40), r.below(40));
        c.push(a, b, &mut r);
        let last = c.branch.len() - 1;
        c.branch[last] = r.direction() * 0.3;
    }
    c.velocity = c.position.iter().map(|_| r.vector()).collect();
    let mass: Vec<f64> = c.position.iter().map(|_| 0.5 + r.share()).collect();
    let many_masses = mass.repeat(7 * 7 * 7);
    let set = c.set();
    let period = Period::of(cell);
    // Copies: all contacts repeated around.
    let mut copies = Cluster::default();
    for x in -3..=3 {
        for y in -3..=3 {
            for z in -3..=3 {
                let shift = cell * Vec3::new(f64::from(x), f64::from(y), f64::from(z));
                let base = copies.position.len() as u32;
                copies.position.extend(c.position.iter().map(|p| p + shift));
                copies.pair.extend(c.pair.iter().map(|p| [p[0] + base, p[1] + base]));
                copies.branch.extend(&c.branch);
                copies.point.extend(c.point.iter().map(|p| p + shift));
                copies.force.extend(&c.force);
                copies.moment.extend(&c.moment);
                copies.velocity.extend(&c.velocity);
            }
        }
    }
    for region in [
        Region::Sphere { center: Vec3::new(0.95, 0.9, 0.1), radius: 0.45 },
        Region::Box { low: Vec3::new(-0.4, 0.3, 0.6), high: Vec3::new(0.5, 1.2, 1.3) },
        Region::Cylinder {
            center: Vec3::new(1.3, 0.1, 0.2),
            axis: Vec3::new(0.6, 0.0, 0.8),
            radius: 0.2,
            half_length: 0.9,
        },
        Region::Sphere { center: Vec3::new(0.5, 0.5, 0.5), radius: 1.2 },
    ] {
        let inside = region_stress(&set, &region, Truncation::BranchClipped, Some(&period)).unwrap();
        let around = region_stress(&copies.set(), &region, Truncation::BranchClipped, None).unwrap();
        // Branch vectors end where they end, not at a particle, so only the clipped form compares.
        close(&inside.stress, &around.stress, 300.0 / inside.volume);
        assert_eq!(inside.full, around.full);
        assert_eq!(inside.partial, around.partial);
        // Operators that count particles, and contacts with both ends inside.
        let kinetic = |c: &Cluster, m: &[f64], period| kinetic_stress(&c.position, m, &c.velocity, &region, period);
        let (one, many) = (kinetic(&c, &mass, Some(&period)).unwrap(), kinetic(&copies, &many_masses, None).unwrap());
        close(&one, &many, 300.0 / inside.volume);
        let solid = |c: &Cluster, m: &[f64], period| solid_fraction(&c.position, m, &region, period).unwrap();
        assert!((solid(&c, &mass, Some(&period)) / solid(&copies, &many_masses, None) - 1.0).abs() < 1e-13);
        let average = |c: &Cluster, period| {
            let moments = particle_moments(&c.set(), &LoadSet::none(), Partition::ContactPoint);
            region_stress_from_particles(&c.position, &moments, &region, period).unwrap()
        };
        // Moments at the ends of a branch vector across the border belong to its image; all images have the same.
        close(&average(&c, Some(&period)), &average_of_copies(&c, &copies, &region), 300.0 / inside.volume);
        let center = region.center().unwrap();
        let one = conjugate(&set, &region, &center, Some(&period)).unwrap();
        let many = conjugate(&copies.set(), &region, &center, None).unwrap();
        assert_eq!(one.contacts, many.contacts);
        close(&one.stress, &many.stress, 300.0 / inside.volume);
        close(&one.couple_stress, &many.couple_stress, 300.0 / inside.volume);
        close_vector(&one.rigid_moment, &Vec3::zeros(), 300.0 / inside.volume);
    }
}

/// The particle average over copies, each with the moment of its original.
fn average_of_copies(c: &Cluster, copies: &Cluster, region: &Region) -> Mat3 {
    let moments = particle_moments(&c.set(), &LoadSet::none(), Partition::ContactPoint);
    let all: Vec<Mat3> = (0..copies.position.len()).map(|p| moments[p % c.position.len()]).collect();
    region_stress_from_particles(&copies.position, &all, region, None).unwrap()
}

/// The kernel has unit integral, also along branch vectors, and the field of stress adds up to the branch sum. Both by
/// a grid of points, whose error for a function with two derivatives of bounded variation falls with the fourth power
/// of the spacing.
#[test]
fn coarse_grained_stress_adds_up() {
    let mut r = Random::new(15);
    let mut c = Cluster::default();
    for _ in 0..12 {
        c.position.push(r.vector() * 0.5);
    }
    for k in 0..12 {
        c.push(k, (k + 5) % 12, &mut r);
    }
    let kernel = Kernel::new(0.5, Dimension::Three).unwrap();
    let mass: Vec<f64> = (0..12).map(|_| 0.5 + r.share()).collect();
    let velocity: Vec<Vec3> = (0..12).map(|_| r.vector()).collect();
    let (n, half) = (40, 1.05);
    let step = 2.0 * half / f64::from(n);
    let mut points = Vec::new();
    for x in 0..n {
        for y in 0..n {
            for z in 0..n {
                points.push(Vec3::new(f64::from(x), f64::from(y), f64::from(z)).map(|k| (k + 0.5) * step - half));
            }
        }
    }
    let fields = coarse_grain(&c.set(), &mass, &velocity, &kernel, &points, None).unwrap();
    let volume = step.powi(3);
    let stress: Mat3 = fields.iter().map(|f| f.stress * volume).sum();
    let expected: Mat3 = c.branch.iter().zip(&c.force).map(|(l, f)| l * f.transpose()).sum();
    assert!((stress - expected).abs().max() < 1e-4, "{stress}{expected}");
    let total: f64 = fields.iter().map(|f| f.density * volume).sum();
    assert!((total - mass.iter().sum::<f64>()).abs() < 1e-4);
    let momentum: Vec3 = fields.iter().map(|f| f.momentum * volume).sum();
    let expected: Vec3 = mass.iter().zip(&velocity).map(|(m, v)| v * *m).sum();
    assert!((momentum - expected).norm() < 1e-4);
    // In the plane.
    let kernel = Kernel::new(0.3, Dimension::Two).unwrap();
    let n = 400;
    let at = |k: i32| (f64::from(k) + 0.5) / f64::from(n) - 0.5;
    let sum: f64 =
        (0..n).flat_map(|x| (0..n).map(move |y| (x, y))).map(|(x, y)| kernel.at(&Vec3::new(at(x), at(y), 0.0))).sum();
    assert!((sum / f64::from(n * n) - 1.0).abs() < 1e-6, "{sum}");
}

/// Fabric of an isotropic network: one third of the unit matrix within the sampling error; coordination number by
/// count.
#[test]
fn fabric_of_an_even_network() {
    let c = network(100_000, 0.2, 16);
    let f = fabric(&c.set(), &Region::cube(Vec3::zeros(), 1.0), Truncation::HalfCrossing, None).unwrap();
    assert!((f.tensor.trace() - 1.0).abs() < 1e-12);
    // Var(n²) = 4/45: standard error 0.3/√N.
    let error = 4.0 * 0.3 / f.contacts.sqrt();
    assert!((f.tensor - Mat3::identity() / 3.0).abs().max() < error);
    assert!((f.branch_length - 0.2).abs() < 1e-12);
    // Every particle has one contact: 2·N_c/N_p = 1 within the scatter of the contacts across the border.
    assert!((f.coordination - 1.0).abs() < 0.05, "{}", f.coordination);
}

/// A particle on the border of two boxes of a grid belongs to one of them, and the volume of a cylinder is that of its whole length;
/// an infinite one has unit depth. Exact numbers.
#[test]
fn borders_and_volumes() {
    let places: Vec<f64> = (0..4).map(|k| 0.5 * f64::from(k)).collect();
    let mut position = Vec::new();
    for x in &places {
        for y in &places {
            position.extend(places.iter().map(|z| Vec3::new(*x, *y, *z)));
        }
    }
    let grid = Region::grid(Vec3::zeros(), Vec3::repeat(2.0), [4; 3]);
    let (mut count, one) = (0.0, vec![1.0; position.len()]);
    for cell in &grid {
        let inside = solid_fraction(&position, &one, cell, None).unwrap() * cell.volume().unwrap();
        assert_eq!(inside, 1.0);
        count += inside;
    }
    assert_eq!(count, 64.0);
    let cylinder =
        |half_length: f64| Region::Cylinder { center: Vec3::zeros(), axis: Vec3::z(), radius: 2.0, half_length };
    assert_eq!(cylinder(3.0).volume().unwrap(), std::f64::consts::PI * 4.0 * 6.0);
    assert_eq!(cylinder(f64::INFINITY).volume().unwrap(), std::f64::consts::PI * 4.0);
}

/// Coarse-grained fields of a deforming cell are those of its copies, whose velocities change from cell to cell.
#[test]
fn coarse_fields_across_a_moving_border() {
    let mut r = Random::new(17);
    let period = Period { edges: Mat3::new(1.0, 0.2, 0.0, 0.0, 0.9, -0.1, 0.0, 0.0, 1.1), change: r.matrix() };
    let mut c = Cluster::default();
    for _ in 0..10 {
        c.position.push(period.edges * Vec3::new(r.share(), r.share(), r.share()));
        c.velocity.push(r.vector());
    }
    for k in 0..20 {
        c.push(k % 10, (k + 3) % 10, &mut r);
    }
    let mass: Vec<f64> = (0..10).map(|_| 0.5 + r.share()).collect();
    let mut copies = Cluster::default();
    for k in 0..125 {
        let image = Vec3::new(f64::from(k % 5) - 2.0, f64::from(k / 5 % 5) - 2.0, f64::from(k / 25) - 2.0);
        let (shift, base) = (period.edges * image, copies.position.len() as u32);
        copies.position.extend(c.position.iter().map(|x| x + shift));
        copies.velocity.extend(c.velocity.iter().map(|v| v + period.change * image));
        copies.pair.extend(c.pair.iter().map(|p| p.map(|p| p + base)));
        copies.branch.extend(&c.branch);
        copies.point.extend(c.point.iter().map(|x| x + shift));
        copies.force.extend(&c.force);
        copies.moment.extend(&c.moment);
    }
    let kernel = Kernel::new(0.4, Dimension::Three).unwrap();
    let point = [period.edges * Vec3::repeat(0.95)];
    let one = coarse_grain(&c.set(), &mass, &c.velocity, &kernel, &point, Some(&period)).unwrap()[0];
    let many = coarse_grain(&copies.set(), &mass.repeat(125), &copies.velocity, &kernel, &point, None).unwrap()[0];
    assert!(one.density > 0.0 && (one.density - many.density).abs() < ROUNDING * 100.0);
    close_vector(&one.momentum, &many.momentum, 300.0);
    close(&one.kinetic_stress, &many.kinetic_stress, 1000.0);
    close(&one.stress, &many.stress, 300.0);
}
