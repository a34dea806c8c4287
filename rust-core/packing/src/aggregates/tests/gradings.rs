//! Gradings, mixes, and lists of sizes.

use crate::aggregates::mix::{Component, air, volume_fraction};
use crate::aggregates::{Form, Grading, Polyhedron, sizes};
use crate::{PackingError, Random};
use std::sync::Arc;

/// The mixes of Stránský 2018, chapter 8: largest size (m), first step (m), unit weight (kg/m³), and number of spheres of a cube of
/// 50 mm, for low and high strength.
const LOW: [(f64, f64, f64, usize); 3] =
    [(9.5e-3, 5.475e-6, 2318.0, 254), (12.5e-3, 13e-6, 2408.0, 139), (19e-3, 12.8e-6, 2428.0, 134)];
const HIGH: [(f64, f64, f64, usize); 3] =
    [(9.5e-3, 5.4e-6, 2399.0, 257), (12.5e-3, 13e-6, 2448.0, 139), (19e-3, 13e-6, 2462.0, 132)];

/// The components of a mix, and its gradings.
type Mix = ([Component; 4], [(f64, f64, f64, usize); 3]);

/// Water, cement, aggregates of all sizes, and plasticizer, kg/m³; the program of the thesis has 352.8 of cement in the low mix, the
/// text 325.8.
fn mixes() -> [Mix; 2] {
    let mix = |water: f64, cement: f64, plasticizer: f64| {
        [(water, 1000.0), (cement, 3100.0), (1872.0, 2590.0), (plasticizer, 1000.0)]
            .map(|(content, density)| Component { content, density })
    };
    [(mix(187.0, 352.8, 4.4), LOW), (mix(160.7, 422.4, 9.0), HIGH)]
}

/// The author's program gives these counts, and refuses a list whose volume differs from the mix by 0.5 %.
#[test]
fn lists_of_stransky_have_their_counts_and_volumes() {
    for (mix, gradings) in mixes() {
        let total: f64 = mix.iter().map(|component| component.content).sum();
        for (largest, first_step, unit_weight, count) in gradings {
            let grading = Grading::stransky(largest).unwrap();
            let list = sizes::ascending(&grading, first_step).unwrap();
            assert_eq!(list.len(), count, "{largest} {first_step}");
            // Two of the unit weights exceed the sum of the contents, so the fraction of air is negative there.
            let fraction = volume_fraction(&mix, mix[2], 0.0).unwrap() * (unit_weight / total) * 750.0 / 1872.0;
            assert!(fraction > 0.27 && fraction < 0.284, "{fraction}");
            let volume: f64 = list.iter().map(|d| std::f64::consts::PI / 6.0 * d * d * d).sum();
            assert!((volume / (fraction * 1.25e-4) - 1.0).abs() < 5e-3, "{largest}: {volume}");
            let last = list[list.len() - 1];
            let range = if largest < 12e-3 {
                9.45e-3..9.501e-3
            } else if largest < 15e-3 {
                12.365e-3..12.375e-3
            } else {
                17.75e-3..18.05e-3
            };
            assert!(range.contains(&last), "{last}");
        }
    }
}

#[test]
fn air_from_the_unit_weight() {
    let mix = mixes()[0].0;
    // 2416.2 kg/m³ without air.
    assert!((air(&mix, 2318.0).unwrap() - (1.0 - 2318.0 / 2416.2)).abs() < 1e-12);
    assert!(air(&mix, 2500.0).is_err());
    assert!(volume_fraction(&mix, mix[2], 1.5).is_err());
}

/// Sizes of any shape follow the curve by volume: below each sieve lies the volume that should, up to one body.
#[test]
fn descending_sizes_follow_the_curve() {
    let curves = [
        Grading::sieves(vec![(2e-3, 0.0), (4e-3, 0.3), (8e-3, 0.5), (10e-3, 0.5), (16e-3, 1.0)]).unwrap(),
        Grading::fuller(2e-3, 16e-3, 0.5).unwrap(),
        Grading::stransky(19e-3).unwrap(),
    ];
    for (dimension, volume) in [(3, 1e-4), (2, 0.05)] {
        for grading in &curves {
            let mut random = Random::new(3);
            // The body that is one too many has another shape than the last one, with up to three times its volume.
            let shapes: [(f64, &mut dyn FnMut() -> Form); 3] = [
                (1.0, &mut || Form::Sphere),
                (1.0, &mut || Form::Ellipsoid { elongation: 1.5, flatness: 0.7 }),
                (3.0, &mut || Form::Polyhedron(Arc::new(Polyhedron::random(12, 1.3, 0.8, &mut random).unwrap()))),
            ];
            for (spread, form) in shapes {
                if dimension == 2 && spread > 1.0 {
                    continue;
                }
                let bodies = sizes::descending(grading, volume, dimension, form).unwrap();
                let planar = dimension == 2;
                let measure = |(form, size): &(Form, f64)| {
                    form.measure(planar) * if planar { size * size } else { size * size * size }
                };
                let total: f64 = bodies.iter().map(measure).sum();
                let (smallest, largest) = grading.bounds();
                let (least, most) = bodies.iter().fold((f64::INFINITY, 0.0_f64), |(least, most), body| {
                    (least.min(measure(body)), most.max(measure(body)))
                });
                // Half the smallest body, and its roundings.
                assert!((total - volume).abs() <= 0.5001 * spread * least, "{dimension}: {total} {least}");
                assert!(bodies.windows(2).all(|pair| pair[0].1 >= pair[1].1 * (1.0 - 0.2)));
                for k in 1..8 {
                    let sieve = smallest + (largest - smallest) * f64::from(k) / 8.0;
                    let finer = grading.passing(smallest);
                    let wanted = (grading.passing(sieve) - finer) / (1.0 - finer);
                    let below: f64 = bodies.iter().filter(|(_, size)| *size <= sieve).map(measure).sum();
                    assert!((below - wanted * volume).abs() <= most, "{dimension} {sieve}: {below} {wanted}");
                }
            }
        }
    }
}

#[test]
fn curves_and_their_inverses() {
    let curves = [
        Grading::sieves(vec![(1e-3, 0.2), (4e-3, 0.3), (8e-3, 0.7), (16e-3, 1.0)]).unwrap(),
        Grading::fuller(1e-3, 16e-3, 0.45).unwrap(),
    ];
    for curve in curves {
        for k in 1..100 {
            let size = 1e-3 + 15e-3 * f64::from(k) / 100.0;
            // Roundings of a few logarithms.
            assert!((curve.size(curve.passing(size)) / size - 1.0).abs() < 1e-12);
        }
        let (part, share) = curve.clone().from(4e-3).unwrap();
        assert!((share - (1.0 - curve.passing(4e-3))).abs() < 1e-15);
        assert_eq!(part.bounds(), (4e-3, 16e-3));
    }
    // Fuller: a quarter of the largest size, half the mass.
    let fuller = Grading::fuller(1e-3, 16e-3, 0.5).unwrap();
    assert!((fuller.passing(4e-3) - 0.5).abs() < 1e-15);
    // Half-way in the logarithm between two sieves, half the mass between them.
    let sieves = Grading::sieves(vec![(1e-3, 0.0), (4e-3, 1.0)]).unwrap();
    assert!((sieves.passing(2e-3) - 0.5).abs() < 1e-15);
}

#[test]
fn bad_gradings_are_refused() {
    for points in [
        vec![(1e-3, 0.0)],
        vec![(1e-3, 0.0), (2e-3, 0.9)],
        vec![(1e-3, 1.0), (2e-3, 1.0)],
        vec![(2e-3, 0.0), (1e-3, 1.0)],
        vec![(1e-3, 0.5), (2e-3, 0.2), (3e-3, 1.0)],
        vec![(0.0, 0.0), (2e-3, 1.0)],
        vec![(1e-3, f64::NAN), (2e-3, 1.0)],
    ] {
        assert!(Grading::sieves(points.clone()).is_err(), "{points:?}");
    }
    assert!(Grading::fuller(2e-3, 1e-3, 0.5).is_err());
    assert!(Grading::fuller(1e-3, 2e-3, 0.0).is_err());
    assert!(Grading::stransky(10e-3).is_none());
    let curve = Grading::stransky(9.5e-3).unwrap();
    assert!(curve.clone().from(1e-3).is_err());
    assert!(sizes::ascending(&curve, 0.0).is_err() && sizes::ascending(&curve, 1.0).is_err());
    let few = sizes::descending(&curve, 1e-9, 3, &mut || Form::Sphere);
    assert!(matches!(few, Err(PackingError::BadSizes { .. })));
}
