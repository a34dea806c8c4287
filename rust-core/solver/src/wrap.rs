//! Wrapping: in a periodic cell, particles that have drifted far are moved back by whole cells, and a cell that has sheared far
//! gets shorter edges of the same lattice.
//!
//! Image numbers of contacts are small, and a cell with nearly parallel edges has many images within reach. Both would
//! limit how far a flow can go without wrapping:
//!
//! * **Edges**: `H' = H M` with a matrix M of whole numbers and determinant 1 generates the same lattice. An edge is shortened
//!   by multiples of another as soon as its projection onto that one exceeds it (Lagrange's reduction).
//! * **Particles**: `x' = x − H'n` with whole numbers n, `v' = v − L H'n`, because images of a particle move with the
//!   cell. The image of B that A sees becomes `i' = M⁻¹i + n_B − n_A`, and [`Particles::image`] keeps the sum of all n:
//!   the unwrapped position of a particle is `x + H·image`.
//!
//! Nothing else changes: distances, relative velocities, and contact forces stay. In a moving cell the kinetic energy
//! jumps by `Σ ½m(|v'|² − |v|²)`, as for an observer who switches to another image; the ledger books that as work of
//! the cell.
//!
//! A cell and particles that have not gone far are not touched, so other runs keep every bit. Wrapping depends only on
//! the state, so a resumed run wraps in the same steps.

use concordem_contact::Cell;
use concordem_contact::math::{Mat3, Vec3};

use crate::state::contacts::{ContactFlags, Contacts, Pair};
use crate::state::{Particles, State};

/// Steps between checks.
pub(crate) const INTERVAL: u64 = 256;

/// Cells that a particle may drift before all are wrapped.
const FARTHEST: i64 = 32;

/// Projection of an edge onto another one, as a fraction of that one's length, up to which the edges stay.
const LARGEST_TILT: f64 = 1.0;

/// Index of a cell.
type Index = [i64; 3];

/// A matrix of whole numbers with determinant 1, and its inverse.
struct Basis {
    matrix: [Index; 3],
    inverse: [Index; 3],
}

fn product(matrix: &[Index; 3], index: Index) -> Index {
    std::array::from_fn(|row| (0..3).map(|k| matrix[row][k] * index[k]).sum())
}

fn reals(matrix: &[Index; 3]) -> Mat3 {
    Mat3::from_fn(|i, j| matrix[i][j] as f64)
}

fn vector(index: Index) -> Vec3 {
    Vec3::from(index.map(|n| n as f64))
}

/// The change to shorter edges of the same lattice; `None` while no edge is tilted far.
fn reduction(edges: &Mat3) -> Option<Basis> {
    let identity = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    let mut basis = Basis { matrix: identity, inverse: identity };
    let mut edges = *edges;
    let mut changed = false;
    // Every round shortens an edge; in practice a few rounds are enough.
    for _ in 0..64 {
        let mut done = true;
        for i in 0..3 {
            for j in (0..3).filter(|&j| j != i) {
                let (onto, edge) = (edges.column(i).into_owned(), edges.column(j).into_owned());
                let tilt = edge.dot(&onto) / onto.norm_squared();
                if !tilt.is_finite() || tilt.abs() <= LARGEST_TILT || tilt.abs() > 1e9 {
                    continue;
                }
                let times = tilt.round();
                edges.set_column(j, &(edge - onto * times));
                // M ← M (1 − t e_i e_jᵀ), M⁻¹ ← (1 + t e_i e_jᵀ) M⁻¹
                let times = times as i64;
                for row in &mut basis.matrix {
                    row[j] -= times * row[i];
                }
                for k in 0..3 {
                    basis.inverse[i][k] += times * basis.inverse[j][k];
                }
                (changed, done) = (true, false);
            }
        }
        if done {
            break;
        }
    }
    changed.then_some(basis)
}

/// Wrap cell and particles of a state if they have gone far. Returns whether it did; then the neighbor list must be
/// rebuilt.
///
/// Nothing changes if a bond or a contact would span more than 127 cells afterwards.
pub(crate) fn wrap(state: &mut State) -> bool {
    let Some(old) = state.cell else { return false };
    let basis = reduction(&old.matrix);
    let mut cell = old;
    if let Some(basis) = &basis {
        let matrix = reals(&basis.matrix);
        cell.matrix = old.matrix * matrix;
        cell.matrix_change = old.matrix_change * matrix;
    }
    let Some(inverse) = cell.matrix.try_inverse() else { return false };
    let shifts = shifts(state, &cell, &inverse);
    if basis.is_none() && shifts.is_none() {
        return false;
    }
    let shifts = shifts.unwrap_or_else(|| vec![[0; 3]; state.particles.len()]);
    let in_basis = |image: [i8; 3]| {
        let image = image.map(i64::from);
        basis.as_ref().map_or(image, |basis| product(&basis.inverse, image))
    };
    let of_pair = |pair: Pair, image: [i8; 3]| {
        let (a, b, image) = (shifts[pair.a as usize], shifts[pair.b as usize], in_basis(image));
        small(std::array::from_fn(|k| image[k] + b[k] - a[k]))
    };
    let of_wall = |pair: Pair, image: [i8; 3]| {
        let (a, image) = (shifts[pair.a as usize], in_basis(image));
        small(std::array::from_fn(|k| image[k] - a[k]))
    };
    let fits = |block: &dyn Contacts, of: &dyn Fn(Pair, [i8; 3]) -> Option<[i8; 3]>| {
        (0..block.len())
            .map(|k| block.view(k))
            .filter(|view| has_history(view.flags))
            .all(|view| of(view.pair, view.flags.image).is_some())
    };
    let pairs_fit = state.bonds.iter().chain(&state.contacts).all(|block| fits(block.contacts(), &of_pair));
    let walls_fit = state.wall_contacts.iter().all(|block| fits(block.contacts(), &of_wall));
    if !pairs_fit || !walls_fit {
        return false;
    }
    let renew = |block: &mut dyn Contacts, of: &dyn Fn(Pair, [i8; 3]) -> Option<[i8; 3]>| {
        // Candidates follow from the positions.
        block.retain_where(&|flags| has_history(*flags));
        block.map_images(&|pair, image| of(pair, image).unwrap_or(image));
        block.sort();
    };
    for block in state.bonds.iter_mut().chain(&mut state.contacts) {
        renew(block.contacts_mut(), &of_pair);
    }
    if let Some(block) = &mut state.wall_contacts {
        renew(block.contacts_mut(), &of_wall);
    }
    for bond in &mut state.broken {
        // The two particles of a broken bond may be any number of cells apart; then both are taken from the same cell.
        bond.image = of_pair(bond.pair, bond.image).unwrap_or_default();
    }
    if state.particles.image.is_empty() {
        state.particles.image = vec![[0; 3]; state.particles.len()];
    }
    for (image, shift) in state.particles.image.iter_mut().zip(&shifts) {
        let before = image.map(i64::from);
        let before = basis.as_ref().map_or(before, |basis| product(&basis.inverse, before));
        *image = std::array::from_fn(|k| (before[k] + shift[k]) as i32);
    }
    let energy = shift_particles(state, &cell, &shifts);
    if state.ledger.started {
        state.ledger.boundary_work.add(energy);
    }
    state.cell = Some(cell);
    true
}

/// Whether a contact is more than a candidate.
fn has_history(flags: ContactFlags) -> bool {
    flags.bits & (ContactFlags::BONDED | ContactFlags::ACTIVE | ContactFlags::KEPT_REFERENCE | ContactFlags::BROKEN)
        != 0
}

/// An image number that fits into the flags of a contact.
fn small(image: Index) -> Option<[i8; 3]> {
    let mut fitting = [0; 3];
    for (to, from) in fitting.iter_mut().zip(image) {
        *to = i8::try_from(from).ok()?;
    }
    Some(fitting)
}

/// Number of cells by which to move each particle back; `None` while none has drifted far.
///
/// The members of a clump move together. A particle stays if a prescribed component of its velocity would have to
/// change.
fn shifts(state: &State, cell: &Cell, inverse: &Mat3) -> Option<Vec<Index>> {
    let particles = &state.particles;
    let index = |position: &Vec3| -> Index {
        let s = inverse * position;
        // Not finite, or too far for numbers of cells: the neighbor search reports it.
        let far = !s.iter().all(|c| c.abs() < 1e9);
        if far { [0; 3] } else { [s.x.floor() as i64, s.y.floor() as i64, s.z.floor() as i64] }
    };
    let motion = cell.velocity_gradient * cell.matrix;
    let mut found: Vec<Index> = (0..particles.len())
        .map(|p| {
            let clump = state.clumps.get(particles.clump[p] as usize);
            let index = index(clump.map_or(&particles.position[p], |clump| &clump.position));
            let change = motion * vector(index);
            let held = |axis: usize| particles.constraint[p].translation(axis) && change[axis] != 0.0;
            if clump.is_some() && change != Vec3::zeros() || (0..3).any(held) { [0; 3] } else { index }
        })
        .collect();
    let far = found.iter().flatten().any(|n| n.abs() > FARTHEST);
    far.then(|| std::mem::take(&mut found))
}

/// Move particles and clumps back; returns the change of kinetic energy, J.
fn shift_particles(state: &mut State, cell: &Cell, shifts: &[Index]) -> f64 {
    let Particles { position, velocity, mass, clump, .. } = &mut state.particles;
    let mut energy = 0.0;
    for (p, shift) in shifts.iter().enumerate().filter(|(_, shift)| **shift != [0; 3]) {
        let way = cell.matrix * vector(*shift);
        position[p] -= way;
        let before = velocity[p];
        velocity[p] -= cell.velocity_gradient * way;
        if clump[p] == u32::MAX {
            energy += 0.5 * mass[p] * (velocity[p].norm_squared() - before.norm_squared());
        }
    }
    for body in &mut state.clumps {
        if let Some(&first) = body.members.first() {
            body.position -= cell.matrix * vector(shifts[first as usize]);
        }
    }
    energy
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state::Sphere;
    use crate::state::contacts::ContactBlock;
    use concordem_contact::kinematics::PreviousGeometry;
    use concordem_contact::law::{LinearBond, Reference};

    /// A cell sheared by 1000 gets the edges of the unsheared lattice back, and both matrices are inverse to each other.
    #[test]
    fn sheared_edges_are_reduced() {
        let edges = Mat3::new(2.0, 2000.0, -7.0, 0.0, 2.0, 3.0, 0.0, 0.0, 2.0);
        let Basis { matrix, inverse } = reduction(&edges).unwrap();
        let unit: Vec<Index> =
            (0..3).map(|k| product(&matrix, product(&inverse, [0, 1, 2].map(|i| i64::from(i == k))))).collect();
        assert_eq!(unit, [[1, 0, 0], [0, 1, 0], [0, 0, 1]]);
        let reduced = edges * reals(&matrix);
        // Whole numbers: exact.
        assert_eq!(reduced.column(1).into_owned(), Vec3::new(0.0, 2.0, 0.0));
        assert!(reduced.column(2).norm() <= 2.0 * 3.0_f64.sqrt() && reduced.determinant() == 8.0);
        assert!(reduction(&Mat3::new(2.0, 1.9, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 2.0)).is_none());
    }

    /// Particles that are moved back by whole cells of a moving lattice keep the distance and the relative velocity that their bond
    /// sees, and the cell does the work of the change of their velocities. Whole numbers and quarters: exact.
    #[test]
    fn pairs_do_not_notice_that_particles_move_back() {
        let edges = Mat3::new(2.0, 0.5, 0.0, 0.0, 2.0, 0.25, 0.0, 0.0, 2.0);
        let mut cell = Cell::new(edges);
        cell.velocity_gradient = Mat3::new(0.0, 0.5, 0.0, 0.25, 0.0, 0.0, 0.0, 0.0, -0.25);
        let mut state = State { cell: Some(cell), ..State::default() };
        for (place, velocity) in [([0.25, 0.5, 0.5], [1.0, 0.0, 0.0]), ([40.5, -2.5, 0.25], [0.0, 20.0, -1.0])] {
            let sphere = Sphere { position: edges * Vec3::from(place), radius: 0.5 };
            state.particles.push(sphere, 0, 2.0, 0.2);
            *state.particles.velocity.last_mut().unwrap() = Vec3::from(velocity);
        }
        let mut bonds = ContactBlock::new(vec![LinearBond::new(1.0, 1.0, 0.0, f64::INFINITY, f64::INFINITY).unwrap()]);
        let flags = ContactFlags { bits: ContactFlags::BONDED, image: [-40, 3, 1], ..ContactFlags::default() };
        bonds.push(Pair { a: 0, b: 1 }, flags, Reference::default(), PreviousGeometry::default());
        state.bonds.push(Box::new(bonds));
        state.ledger.started = true;
        let seen = |state: &State| {
            let cell = state.cell.unwrap();
            let shift = cell.shift(state.bonds[0].contacts().view(0).flags.image);
            let Particles { position: x, velocity: v, mass, .. } = &state.particles;
            let kinetic: f64 = v.iter().zip(mass).map(|(v, m)| 0.5 * m * v.norm_squared()).sum();
            (x[1] + shift - x[0], v[1] + cell.velocity_gradient * shift - v[0], kinetic)
        };
        let before = seen(&state);
        assert!(wrap(&mut state));
        let after = seen(&state);
        assert_eq!(state.particles.image, [[0, 0, 0], [40, -3, 0]]);
        assert_eq!(state.particles.position[1], edges * Vec3::new(0.5, 0.5, 0.25));
        assert_eq!((before.0, before.1), (after.0, after.1));
        assert!(after.2 != before.2);
        assert_eq!(state.ledger.boundary_work.get(), after.2 - before.2);
    }
}
