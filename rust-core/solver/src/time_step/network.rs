//! The contacts as linear elements, for the iteration to the largest frequency: the product of the mass-scaled stiffness with a vector.
//!
//! Particles are divided into tiles. A tile computes all elements of its particles, in their order, so tiles are independent of each other,
//! and each particle sums its elements in the same order for any number of threads. An element between two tiles is computed in both: some
//! tenth of them. Within a tile, the formula runs over columns.

use nalgebra::Vector6;
use rayon::prelude::*;

use super::{Element, WallElement};
use concordem_contact::columns::{Arrays, BATCH, Columns, Formula};
use concordem_contact::math::Vec3;

/// Particles per tile.
const TILE: usize = 1024;

/// The elements, and those of each tile.
pub(super) struct Network {
    elements: Vec<Element>,
    tiles: Vec<Tile>,
    /// Displacements and rotations `S x`.
    motion: Vec<Vector6<f64>>,
}

struct Tile {
    /// Index of the first particle.
    first: usize,
    /// Indices of the elements, ascending.
    elements: Vec<u32>,
    walls: Vec<WallElement>,
}

concordem_contact::columns! {
    /// An element and the motions of its ends.
    struct Moved {
        normal: Vec3,
        arm_a: f64,
        arm_b: f64,
        normal_stiffness: f64,
        shear_stiffness: f64,
        bending_stiffness: f64,
        twist_stiffness: f64,
        displacement_a: Vec3,
        rotation_a: Vec3,
        displacement_b: Vec3,
        rotation_b: Vec3,
    }
    /// Force on the second end, the opposite of that on the first one, and torques on both.
    struct Loads {
        force: Vec3,
        torque_a: Vec3,
        torque_b: Vec3,
    }
}

/// Forces and torques of an element.
struct Linear;

impl Formula for Linear {
    type Input = Moved;
    type Output = Loads;
    #[inline(always)]
    fn apply(&self, moved: Moved) -> Loads {
        let Moved { normal: n, arm_a, arm_b, .. } = moved;
        let contact = n.cross(&(moved.rotation_a * arm_a + moved.rotation_b * arm_b));
        let relative = moved.displacement_b - moved.displacement_a + contact;
        let force = along_and_across(&n, &relative, moved.normal_stiffness, moved.shear_stiffness);
        let rotation = moved.rotation_b - moved.rotation_a;
        let moment = along_and_across(&n, &rotation, moved.twist_stiffness, moved.bending_stiffness);
        let torque_per_arm = n.cross(&force);
        Loads { force, torque_a: -torque_per_arm * arm_a - moment, torque_b: -torque_per_arm * arm_b + moment }
    }
}

/// A vector, its parts along and across the normal multiplied by two factors.
#[inline(always)]
fn along_and_across(normal: &Vec3, vector: &Vec3, along: f64, across: f64) -> Vec3 {
    let part = normal * normal.dot(vector);
    part * along + (vector - part) * across
}

impl Network {
    /// The elements of `count` particles. Elements with walls follow those between particles.
    pub(super) fn new(count: usize, elements: Vec<Element>, walls: &[WallElement]) -> Self {
        let tile = |t: usize| Tile { first: t * TILE, elements: Vec::new(), walls: Vec::new() };
        let mut tiles: Vec<Tile> = (0..count.div_ceil(TILE)).map(tile).collect();
        for (k, element) in elements.iter().enumerate() {
            let (a, b) = (element.a as usize / TILE, element.b as usize / TILE);
            tiles[a].elements.push(k as u32);
            if b != a {
                tiles[b].elements.push(k as u32);
            }
        }
        for &wall in walls {
            tiles[wall.0 as usize / TILE].walls.push(wall);
        }
        Self { elements, tiles, motion: vec![Vector6::zeros(); count] }
    }

    /// `y = S K S x` with the diagonal matrix `S` of `scale`.
    pub(super) fn apply(&mut self, scale: &[Vector6<f64>], x: &[Vector6<f64>], y: &mut [Vector6<f64>]) {
        let motions = self.motion.par_iter_mut().with_min_len(TILE);
        motions.zip(x).zip(scale).for_each(|((motion, x), scale)| *motion = x.component_mul(scale));
        let (elements, motion) = (&self.elements[..], &self.motion[..]);
        self.tiles.par_iter().zip(y.par_chunks_mut(TILE)).for_each(|(tile, y)| {
            pulp::Arch::new().dispatch(Product { tile, elements, scale, motion, y });
        });
    }
}

/// The product for the particles of a tile, with the widest instructions of the processor.
struct Product<'a> {
    tile: &'a Tile,
    elements: &'a [Element],
    scale: &'a [Vector6<f64>],
    motion: &'a [Vector6<f64>],
    y: &'a mut [Vector6<f64>],
}

impl Product<'_> {
    /// Adds force and torque to a particle, if it lies in the tile.
    #[inline(always)]
    fn add(&mut self, p: u32, force: &Vec3, torque: &Vec3) {
        if let Some(y) = self.y.get_mut((p as usize).wrapping_sub(self.tile.first)) {
            *y += joined(force, torque).component_mul(&self.scale[p as usize]);
        }
    }
}

impl pulp::NullaryFnOnce for Product<'_> {
    type Output = ();
    #[inline(always)]
    fn call(mut self) {
        let Self { tile, elements, motion, .. } = self;
        self.y.fill(Vector6::zeros());
        let mut columns = Columns::default();
        for list in tile.elements.chunks(BATCH) {
            let moved = columns.input::<Moved>();
            for (lane, &k) in list.iter().enumerate() {
                let Element { a, b, normal, arm_a, arm_b, stiffness } = &elements[k as usize];
                moved.normal.set(lane, *normal);
                moved.arm_a.set(lane, *arm_a);
                moved.arm_b.set(lane, *arm_b);
                moved.normal_stiffness.set(lane, stiffness.normal);
                moved.shear_stiffness.set(lane, stiffness.shear);
                moved.bending_stiffness.set(lane, stiffness.bending);
                moved.twist_stiffness.set(lane, stiffness.twist);
                let (displacement, rotation) = halves(&motion[*a as usize]);
                moved.displacement_a.set(lane, displacement);
                moved.rotation_a.set(lane, rotation);
                let (displacement, rotation) = halves(&motion[*b as usize]);
                moved.displacement_b.set(lane, displacement);
                moved.rotation_b.set(lane, rotation);
            }
            columns.apply(&Linear);
            let loads = columns.output::<Loads>();
            for (lane, &k) in list.iter().enumerate() {
                let Element { a, b, .. } = elements[k as usize];
                let force = loads.force.get(lane);
                self.add(a, &-force, &loads.torque_a.get(lane));
                self.add(b, &force, &loads.torque_b.get(lane));
            }
        }
        for (p, n, arm, k) in &tile.walls {
            let (displacement, rotation) = halves(&motion[*p as usize]);
            let force = along_and_across(n, &(-displacement + n.cross(&(rotation * *arm))), k.normal, k.shear);
            self.add(*p, &-force, &(-n.cross(&force) * *arm));
        }
    }
}

/// Translational and rotational parts of a vector.
#[inline(always)]
pub(super) fn halves(v: &Vector6<f64>) -> (Vec3, Vec3) {
    (Vec3::new(v[0], v[1], v[2]), Vec3::new(v[3], v[4], v[5]))
}

/// The inverse of [`halves`].
#[inline(always)]
pub(super) fn joined(force: &Vec3, torque: &Vec3) -> Vector6<f64> {
    Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use concordem_contact::law::Stiffness;

    /// The product, element by element on one thread.
    fn direct(
        elements: &[Element],
        walls: &[WallElement],
        scale: &[Vector6<f64>],
        x: &[Vector6<f64>],
    ) -> Vec<Vector6<f64>> {
        let mut y = vec![Vector6::zeros(); x.len()];
        let split = |p: usize| halves(&x[p].component_mul(&scale[p]));
        let mut add = |p: usize, force: Vec3, torque: Vec3| y[p] += joined(&force, &torque).component_mul(&scale[p]);
        for e in elements {
            let ((ua, wa), (ub, wb)) = (split(e.a as usize), split(e.b as usize));
            let n = e.normal;
            let relative = ub - ua + n.cross(&(wa * e.arm_a + wb * e.arm_b));
            let normal_part = n * n.dot(&relative);
            let f = normal_part * e.stiffness.normal + (relative - normal_part) * e.stiffness.shear;
            let rotation = wb - wa;
            let twist = n * n.dot(&rotation);
            let moment = twist * e.stiffness.twist + (rotation - twist) * e.stiffness.bending;
            let torque_per_arm = n.cross(&f);
            add(e.a as usize, -f, -torque_per_arm * e.arm_a - moment);
            add(e.b as usize, f, -torque_per_arm * e.arm_b + moment);
        }
        for (p, n, arm, k) in walls {
            let (u, w) = split(*p as usize);
            let relative = -u + n.cross(&(w * *arm));
            let normal_part = n * n.dot(&relative);
            let f = normal_part * k.normal + (relative - normal_part) * k.shear;
            add(*p as usize, -f, -n.cross(&f) * *arm);
        }
        y
    }

    /// Tiles and columns give the bits of the plain sum over elements, with elements within and between tiles, with periodic images (a = b
    /// included), with walls, and with batches that are not full.
    #[test]
    fn tiles_and_columns_give_the_bits_of_the_plain_sum() {
        let n = 2 * TILE + 77;
        let mut seed = 1_u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let stiffness = |random: &mut dyn FnMut() -> f64| Stiffness {
            normal: 2.0 + random(),
            shear: 1.0 + random(),
            bending: 0.5 + random(),
            twist: 0.5 + random(),
            ..Stiffness::default()
        };
        let mut elements = Vec::new();
        for a in 0..n as u32 {
            for step in [0, 1, 33, TILE as u32] {
                let b = (a + step) % n as u32;
                let normal = Vec3::new(random(), random(), random()).normalize();
                let (arm_a, arm_b, stiffness) = (1.0 + random(), 1.0 + random(), stiffness(&mut random));
                elements.push(Element { a, b, normal, arm_a, arm_b, stiffness });
            }
        }
        let walls: Vec<WallElement> = (0..n as u32)
            .step_by(7)
            .map(|p| (p, Vec3::new(random(), random(), random()).normalize(), 1.0, stiffness(&mut random)))
            .collect();
        let scale: Vec<_> = (0..n).map(|_| Vector6::from_fn(|_, _| 1.5 + random())).collect();
        let mut network = Network::new(n, elements.clone(), &walls);
        for _ in 0..2 {
            let x: Vec<_> = (0..n).map(|_| Vector6::from_fn(|_, _| random())).collect();
            let mut y = vec![Vector6::repeat(f64::NAN); n];
            network.apply(&scale, &x, &mut y);
            let bits = |v: &[Vector6<f64>]| v.iter().flat_map(|v| v.iter().map(|x| x.to_bits())).collect::<Vec<_>>();
            assert_eq!(bits(&y), bits(&direct(&elements, &walls, &scale, &x)));
        }
    }
}
