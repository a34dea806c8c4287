use proptest::prelude::*;

use super::*;
use concordem_contact::math::exp;

/// All pairs by brute force: the definition, with images up to `range` cells away.
fn brute_force(positions: &[Vec3], reach: &[f64], cell: Option<&Cell>, range: i8) -> Vec<CandidatePair> {
    let all = if cell.is_some() { -range..=range } else { 0..=0 };
    let mut images: Vec<[i8; 3]> = Vec::new();
    for i in all.clone() {
        for j in all.clone() {
            images.extend(all.clone().map(|k| [i, j, k]));
        }
    }
    let mut pairs = Vec::new();
    for a in 0..positions.len() {
        for b in a..positions.len() {
            for &image in &images {
                if a == b && image <= [0; 3] {
                    continue;
                }
                let shift = cell.map_or(Vec3::zeros(), |cell| cell.shift(image));
                let limit = reach[a] + reach[b];
                if (positions[b] + shift - positions[a]).norm_squared() <= limit * limit {
                    pairs.push(CandidatePair { a: a as u32, b: b as u32, image });
                }
            }
        }
    }
    pairs.sort_unstable();
    pairs
}

fn points(count: usize, low: f64, high: f64) -> impl Strategy<Value = Vec<Vec3>> {
    let coordinate = low..high;
    prop::collection::vec(
        (coordinate.clone(), coordinate.clone(), coordinate).prop_map(|(x, y, z)| Vec3::new(x, y, z)),
        0..count,
    )
}

/// Reaches spread evenly in their logarithm over a ratio of e⁵ ≈ 150, the largest 0.3.
fn reaches() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec((-5.0..0.0_f64).prop_map(|t| 0.3 * exp(t)), 80)
}

/// A cell with edges between 0.3 and 1.3 and skew up to 0.8 of an edge.
fn cells() -> impl Strategy<Value = Cell> {
    (prop::array::uniform3(0.3..1.3_f64), prop::array::uniform6(-0.8..0.8_f64), any::<bool>()).prop_map(
        |(edge, skew, left_handed)| {
            let mut matrix = Mat3::new(
                edge[0],
                skew[0] * edge[1],
                skew[1] * edge[2],
                0.1 * skew[3] * edge[0],
                edge[1],
                skew[2] * edge[2],
                0.1 * skew[4] * edge[0],
                0.1 * skew[5] * edge[1],
                edge[2],
            );
            if left_handed {
                matrix.swap_columns(0, 1);
            }
            Cell::new(matrix)
        },
    )
}

/// With all rows of boxes that it spans, of which nearly all are empty, this search would take days.
#[test]
fn a_facet_may_be_much_larger_than_the_particles() {
    let mut positions: Vec<Vec3> = (0..10).map(|k| Vec3::new(f64::from(k), 0.5, 1.0) / 10.0).collect();
    positions.push(Vec3::new(0.5, 0.5, 0.5));
    let mut reach = vec![1e-6; 10];
    reach.push(2.0);
    let pairs = candidate_pairs_with_others(&positions, &reach, 10, None).unwrap();
    assert_eq!(pairs, (0..10).map(|a| CandidatePair { a, b: 10, image: [0; 3] }).collect::<Vec<_>>());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn open_clouds_equal_brute_force(positions in points(80, -1.0, 1.0), reach in reaches()) {
        let reach = &reach[..positions.len()];
        prop_assert_eq!(candidate_pairs(&positions, reach, None).unwrap(), brute_force(&positions, reach, None, 0));
    }

    #[test]
    fn periodic_boxes_equal_brute_force(
        positions in points(60, -1.0, 2.0), reach in reaches(), size in prop::array::uniform3(0.7..2.0_f64),
    ) {
        let cell = Cell::new_box(Vec3::from(size));
        let reach = &reach[..positions.len()];
        // Positions span 3/0.7 cells, the reach 0.6/0.7 of one: at most 6 images apart.
        prop_assert_eq!(
            candidate_pairs(&positions, reach, Some(&cell)).unwrap(), brute_force(&positions, reach, Some(&cell), 6)
        );
    }

    #[test]
    fn triclinic_cells_smaller_than_the_reach_equal_brute_force(
        fractions in points(10, -1.5, 1.5), reach in reaches(), cell in cells(),
    ) {
        let positions: Vec<Vec3> = fractions.iter().map(|s| cell.matrix * s).collect();
        let reach = &reach[..positions.len()];
        let lattice = Lattice::new(&cell).unwrap();
        // Three cells between positions, and the reach in cell widths.
        let range = 4 + (0.6 / lattice.widths.min()).ceil() as i8;
        prop_assume!(range <= 12);
        prop_assert_eq!(
            candidate_pairs(&positions, reach, Some(&cell)).unwrap(),
            brute_force(&positions, reach, Some(&cell), range)
        );
    }

    /// The first particles and the others, with reaches up to ten times as large.
    #[test]
    fn pairs_with_others_are_those_of_all_pairs(
        positions in points(60, -1.0, 2.0), reach in reaches(), share in 0.0..1.0_f64,
        size in prop::option::of(prop::array::uniform3(0.7..2.0_f64)),
    ) {
        let cell = size.map(|size| Cell::new_box(Vec3::from(size)));
        let count = (share * positions.len() as f64) as usize;
        let reach: Vec<f64> = (0..positions.len()).map(|i| if i < count { reach[i] } else { 10.0 * reach[i] }).collect();
        let all = candidate_pairs(&positions, &reach, cell.as_ref()).unwrap();
        let mixed = |pair: &CandidatePair| (pair.a as usize) < count && pair.b as usize >= count;
        prop_assert_eq!(
            candidate_pairs_with_others(&positions, &reach, count, cell.as_ref()).unwrap(),
            all.into_iter().filter(mixed).collect::<Vec<_>>()
        );
    }

    #[test]
    fn spatial_order_is_a_permutation(positions in points(200, -1.0, 1.0)) {
        let mut order = spatial_order(&positions, None);
        order.sort_unstable();
        prop_assert_eq!(order, (0..positions.len() as u32).collect::<Vec<_>>());
    }

    #[test]
    fn verlet_bound_never_misses_a_pair(
        positions in points(40, 0.0, 1.0), moves in points(40, -0.016, 0.016), strain in prop::array::uniform9(-0.03..0.03_f64),
        drift in prop::array::uniform3(-1.0..1.0_f64),
    ) {
        let count = positions.len().min(moves.len());
        let positions = &positions[..count];
        let (cutoff, skin) = (0.2, 0.1);
        let before = Cell::new_box(Vec3::new(1.0, 1.2, 0.9));
        let f = Mat3::identity() + Mat3::from_row_slice(&strain);
        let after = Cell::new(f * before.matrix);
        let list = VerletList::new(positions, Some(&before), skin, cutoff);
        let moved: Vec<Vec3> =
            positions.iter().zip(&moves).map(|(x, u)| f * x + u + Vec3::from(drift)).collect();
        let listed = candidate_pairs(positions, &vec![0.5 * (cutoff + skin); count], Some(&before)).unwrap();
        let close = candidate_pairs(&moved, &vec![0.5 * cutoff; count], Some(&after)).unwrap();
        if !list.needs_rebuild(&moved, Some(&after)) {
            for pair in close {
                prop_assert!(listed.binary_search(&pair).is_ok(), "{pair:?} is missing");
            }
        }
    }
}

#[test]
fn one_sphere_in_a_tiny_cell_sees_half_of_its_images() {
    // Lattice points within 2.5 edges: 1 + 80 = 81 with the origin; each ± pair once leaves 40.
    let cell = Cell::new_box(Vec3::repeat(1.0));
    let pairs = candidate_pairs(&[Vec3::repeat(7.3)], &[1.25], Some(&cell)).unwrap();
    assert_eq!(pairs.len(), 40);
    assert!(pairs.iter().all(|pair| pair.a == 0 && pair.b == 0 && pair.image > [0; 3]));
}

/// The faces of a skewed cell are closer to each other than its edges are long: at a distance of 0.3, a sphere with a reach of 1 sees
/// its image three cells away.
#[test]
fn one_sphere_in_a_skewed_cell_sees_its_images() {
    let cell = Cell::new(Mat3::new(1.0, 0.95, 0.0, 0.0, 0.3, 0.0, 0.0, 0.0, 1.0));
    let pairs = candidate_pairs(&[Vec3::zeros()], &[0.501], Some(&cell)).unwrap();
    assert_eq!(pairs, brute_force(&[Vec3::zeros()], &[0.501], Some(&cell), 6));
    assert!(pairs.iter().any(|pair| pair.image == [3, -3, 0]), "{pairs:?}");
}

#[test]
fn distant_particles_and_dense_groups_are_found() {
    let mut positions: Vec<Vec3> =
        (0..1000).map(|i| Vec3::new(f64::from(i % 10), f64::from(i / 10 % 10), f64::from(i / 100)) * 0.9).collect();
    positions.push(Vec3::new(1.0e9, -1.0e9, 3.0));
    positions.push(Vec3::new(1.0e9, -1.0e9, 3.5));
    positions.push(Vec3::new(-1.0e15, 0.0, 0.0));
    let reach = vec![0.5; positions.len()];
    let pairs = candidate_pairs(&positions, &reach, None).unwrap();
    assert_eq!(pairs, brute_force(&positions, &reach, None, 0));
    // 3 · 9 · 100 pairs of the cubic lattice, and those of the distant particles.
    assert_eq!(pairs.len(), 2701);
}

/// Wrapping from far away loses the sizes of the particles; a search among all boxes in that distance would not end.
#[test]
fn positions_far_from_a_periodic_cell_are_refused() {
    let cell = Cell::new_box(Vec3::repeat(1.0));
    let error = candidate_pairs(&[Vec3::repeat(1.0e15), Vec3::zeros()], &[0.1, 0.1], Some(&cell)).unwrap_err();
    assert!(matches!(error, NeighborError::TooFar { .. }), "{error}");
}

#[test]
fn threads_do_not_matter() {
    let mut state = 1_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let cell = Cell::new_box(Vec3::repeat(1.0));
    let positions: Vec<Vec3> = (0..20_000).map(|_| Vec3::new(random(), random(), random())).collect();
    let reach: Vec<f64> = (0..20_000).map(|i| if i % 1000 == 0 { 0.1 } else { 0.01 }).collect();
    let run = |threads: usize| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
            (candidate_pairs(&positions, &reach, Some(&cell)).unwrap(), spatial_order(&positions, Some(&cell)))
        })
    };
    let one = run(1);
    assert!(one.0.len() > 5_000);
    for threads in [2, 3, 8] {
        assert_eq!(run(threads), one);
    }
}

#[test]
fn spatial_order_keeps_neighbors_together() {
    // 32³ points on a lattice, shuffled by a multiplication: along the curve of boxes of 4 to 8 points each, the mean
    // step stays near one spacing; in the shuffled order it is about half the edge.
    let count = 32_768_u64;
    let positions: Vec<Vec3> = (0..count)
        .map(|i| {
            let k = i * 20_021 % count;
            Vec3::new((k % 32) as f64, (k / 32 % 32) as f64, (k / 1024) as f64)
        })
        .collect();
    let order = spatial_order(&positions, None);
    let steps = order.windows(2).map(|w| (positions[w[0] as usize] - positions[w[1] as usize]).norm());
    let mean = steps.sum::<f64>() / (count - 1) as f64;
    assert!(mean < 2.0, "mean step {mean}");
}

#[test]
fn bad_input_is_named() {
    let ones = [Vec3::zeros(), Vec3::x()];
    let cell = Cell::new_box(Vec3::repeat(1.0));
    assert!(matches!(
        candidate_pairs(&[Vec3::zeros(), Vec3::new(0.0, f64::NAN, 0.0)], &[1.0; 2], None),
        Err(NeighborError::PositionNotFinite { index: 1, .. })
    ));
    assert!(matches!(
        candidate_pairs(&ones, &[1.0, f64::INFINITY], None),
        Err(NeighborError::BadReach { index: 1, .. })
    ));
    assert!(matches!(candidate_pairs(&ones, &[1.0, -1.0], None), Err(NeighborError::BadReach { index: 1, .. })));
    assert!(matches!(
        candidate_pairs(&ones, &[1.0], None),
        Err(NeighborError::LengthMismatch { positions: 2, reaches: 1 })
    ));
    for flat in [
        Mat3::zeros(),
        Mat3::new(1.0, 2.0, 0.0, 2.0, 4.0, 0.0, 0.0, 0.0, 1.0),
        Mat3::identity() * f64::NAN,
        Mat3::identity() * f64::INFINITY,
    ] {
        assert!(matches!(
            candidate_pairs(&ones, &[1.0; 2], Some(&Cell::new(flat))),
            Err(NeighborError::FlatCell { .. })
        ));
    }
    assert!(matches!(
        candidate_pairs(&ones, &[0.1, 70.0], Some(&cell)),
        Err(NeighborError::CellTooThin { index: 1, axis: 0, .. })
    ));
    // 200 cells apart in x, and touching.
    assert!(matches!(
        candidate_pairs(&[Vec3::zeros(), Vec3::new(200.05, 0.0, 0.0)], &[0.1; 2], Some(&cell)),
        Err(NeighborError::ImageOutOfRange { a: 0, b: 1, .. })
    ));
    assert_eq!(candidate_pairs(&[], &[], Some(&cell)), Ok(Vec::new()));
}

#[test]
fn verlet_criterion() {
    let positions = [Vec3::zeros(), Vec3::x(), Vec3::y()];
    let list = VerletList::new(&positions, None, 0.1, 1.0);
    assert!(!list.needs_rebuild(&positions, None));
    // A common translation uses none of the skin; opposite displacements of 0.04 leave 0.02 of it, of 0.06 nothing.
    let drift = Vec3::new(5.0, -3.0, 2.0);
    let moved =
        |u: f64| [positions[0] + drift, positions[1] + drift - Vec3::x() * u, positions[2] + drift + Vec3::x() * u];
    assert!(!list.needs_rebuild(&moved(0.04), None));
    assert!(list.needs_rebuild(&moved(0.06), None));
    assert!(list.needs_rebuild(&[Vec3::zeros(), Vec3::x(), Vec3::repeat(f64::NAN)], None));
    assert!(list.needs_rebuild(&positions[..2], None));
    assert!(list.needs_rebuild(&positions, Some(&Cell::new_box(Vec3::repeat(1.0)))));

    // Isotropic compression by 5 % with the cell: 0.95·(1 + s) > 1 needs s > 0.0526.
    let cell = |edge: f64| Cell::new_box(Vec3::repeat(edge));
    let shrunk = positions.map(|x| x * 0.95);
    for (skin, rebuild) in [(0.052, true), (0.053, false)] {
        let list = VerletList::new(&positions, Some(&cell(2.0)), skin, 1.0);
        assert_eq!(list.needs_rebuild(&shrunk, Some(&cell(1.9))), rebuild);
    }
}

/// The skin counts along the way, not along the axes, and two particles share it. A cell uses it along the direction of its smallest
/// stretch, whatever its largest is.
#[test]
fn verlet_criterion_in_oblique_directions() {
    let positions = [Vec3::zeros(), Vec3::x(), Vec3::y()];
    let list = VerletList::new(&positions, None, 0.1, 1.0);
    // 0.07·√2 = 0.099, 0.08·√2 = 0.113.
    for (u, rebuild) in [(0.07, false), (0.08, true)] {
        let moved = [positions[0], positions[1] + Vec3::new(u, u, 0.0), positions[2]];
        assert_eq!(list.needs_rebuild(&moved, None), rebuild, "{u}");
    }
    // As for the isotropic compression by 5 %: 0.95·(1 + s) > 1.
    let (short, long) = (Vec3::new(0.6, 0.8, 0.0), Vec3::new(-0.8, 0.6, 0.0));
    let stretch = Mat3::identity() - short * short.transpose() * 0.05 + long * long.transpose() * 0.1;
    let moved = positions.map(|x| stretch * x);
    let (before, after) = (Cell::new_box(Vec3::repeat(2.0)), Cell::new(stretch * 2.0));
    for (skin, rebuild) in [(0.052, true), (0.053, false)] {
        let list = VerletList::new(&positions, Some(&before), skin, 1.0);
        assert_eq!(list.needs_rebuild(&moved, Some(&after)), rebuild, "{skin}");
    }
}
