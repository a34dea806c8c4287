//! Order along a space-filling curve.

use rayon::prelude::*;

use super::{Lattice, typical_bounds};
use crate::state::Cell;
use concordem_contact::math::{Vec3, cbrt};

/// Mean number of particles per box of the curve: neighbors within a box keep their old order, so that small motions
/// rarely change the order.
const PARTICLES_PER_BOX: f64 = 4.0;

/// Indices of the particles in the order of a Hilbert curve (Skilling 2004, AIP Conf. Proc. 707, 381) through a grid of
/// boxes with a few particles each. Particles in the same box keep the order of their indices.
///
/// With a cell (edge vectors as columns, m) positions are wrapped into it. Positions that are not finite go to an arbitrary
/// box; the neighbor search reports them.
pub fn spatial_order(positions: &[Vec3], cell: Option<&Cell>) -> Vec<u32> {
    let lattice = cell.and_then(|cell| Lattice::new(cell).ok());
    let wrapped = |position: &Vec3| lattice.map_or(*position, |lattice| lattice.wrapped(position));
    let (low, size) = lattice.as_ref().map_or_else(
        || {
            let (low, high) = typical_bounds(positions);
            (low, high - low)
        },
        |lattice| {
            // The bounding box of a skewed cell is that of the eight sums of edge vectors.
            let h = lattice.cell.matrix;
            let corner = |keep: fn(f64) -> bool| {
                Vec3::from_fn(|axis, _| h.row(axis).iter().copied().filter(|value| keep(*value)).sum())
            };
            let (low, high): (Vec3, Vec3) = (corner(|value| value < 0.0), corner(|value| value > 0.0));
            (low, high - low)
        },
    );
    let longest = size.max();
    if !(longest > 0.0 && longest.is_finite()) {
        return (0..positions.len() as u32).collect();
    }
    // Flat clouds have fewer boxes across: an extent below one box is one box.
    let wanted = (positions.len() as f64 / PARTICLES_PER_BOX).max(1.0);
    let thin = longest / cbrt(wanted);
    let volume: f64 = size.iter().map(|extent| extent.max(thin)).product();
    let edge = cbrt(volume / wanted);
    let bits = ((longest / edge).max(1.0) as u64).ilog2() + 1;
    let bits = bits.min(20);
    let boxes = f64::from(1_u32 << bits);
    let mut order: Vec<(u64, u32)> = positions
        .par_iter()
        .enumerate()
        .map(|(index, position)| {
            let u = (wrapped(position) - low) * (boxes / longest);
            let clamp = |value: f64| value.clamp(0.0, boxes - 1.0) as u32;
            (hilbert([clamp(u.x), clamp(u.y), clamp(u.z)], bits), index as u32)
        })
        .collect();
    order.par_sort_unstable();
    order.into_iter().map(|(_, index)| index).collect()
}

/// Distance along the Hilbert curve through a cube of 2^`bits` boxes per edge, at most 2^21; `x` below 2^`bits`.
pub fn hilbert(mut x: [u32; 3], bits: u32) -> u64 {
    // Inverse undo of the excess work of the Gray code.
    let top = 1_u32 << (bits - 1);
    let mut q = top;
    while q > 1 {
        let p = q - 1;
        for axis in 0..3 {
            if x[axis] & q == 0 {
                let t = (x[0] ^ x[axis]) & p;
                x[0] ^= t;
                x[axis] ^= t;
            } else {
                x[0] ^= p;
            }
        }
        q >>= 1;
    }
    // Gray encode.
    x[1] ^= x[0];
    x[2] ^= x[1];
    let mut t = 0;
    q = top;
    while q > 1 {
        if x[2] & q != 0 {
            t ^= q - 1;
        }
        q >>= 1;
    }
    for value in &mut x {
        *value ^= t;
    }
    // Interleave, axis 0 most significant.
    let mut key = 0;
    for bit in (0..bits).rev() {
        for value in x {
            key = key << 1 | u64::from(value >> bit & 1);
        }
    }
    key
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curve_visits_every_box_and_steps_to_a_face_neighbor() {
        let bits = 3;
        let mut path: Vec<(u64, [i32; 3])> = Vec::new();
        for x in 0..8 {
            for y in 0..8 {
                for z in 0..8 {
                    path.push((hilbert([x, y, z], bits), [x as i32, y as i32, z as i32]));
                }
            }
        }
        path.sort_unstable();
        for (place, (key, _)) in path.iter().enumerate() {
            assert_eq!(*key, place as u64);
        }
        for pair in path.windows(2) {
            let distance: i32 = (0..3).map(|k| (pair[0].1[k] - pair[1].1[k]).abs()).sum();
            assert_eq!(distance, 1);
        }
    }
}
