//! The contacts as linear elements, for the iteration to the largest frequency: the product of the mass-scaled stiffness with a vector.
//!
//! Particles are divided into tiles. A tile has all elements of its particles, in their order, so tiles are independent of each other, and
//! each particle sums its elements in the same order for any number of threads. An element between two tiles is computed in both: some tenth
//! of them. Within a tile, elements are stored in columns for vector instructions.

use nalgebra::Vector6;
use rayon::prelude::*;

use super::{Element, WallElement};
use concordem_contact::math::Vec3;

/// Particles per tile.
const TILE: usize = 1024;
/// Elements whose columns are computed at a time.
const LANES: usize = 16;

/// The elements of all tiles.
pub(super) struct Network {
    tiles: Vec<Tile>,
    /// Displacements and rotations `S x`.
    motion: Vec<Vector6<f64>>,
}

struct Tile {
    /// Index of the first particle.
    first: usize,
    batches: Vec<Batch>,
    walls: Vec<WallElement>,
}

/// Elements in columns. Only the first `count` lanes are in use.
struct Batch {
    count: usize,
    ends: [[u32; 2]; LANES],
    normal: [[f64; LANES]; 3],
    arms: [[f64; LANES]; 2],
    /// Stiffness of the normal, shear, bending, twist.
    stiffness: [[f64; LANES]; 4],
}

/// Motion of the two ends of the elements of a batch: displacement, then rotation.
type Motions = [[[f64; LANES]; 6]; 2];

impl Network {
    /// The elements of `count` particles. Elements with walls follow those between particles.
    pub(super) fn new(count: usize, elements: &[Element], walls: &[WallElement]) -> Self {
        let tile_of = |p: u32| p as usize / TILE;
        let mut of_tile = vec![Vec::new(); count.div_ceil(TILE)];
        for (k, element) in elements.iter().enumerate() {
            let (a, b) = (tile_of(element.a), tile_of(element.b));
            of_tile[a].push(k as u32);
            if b != a {
                of_tile[b].push(k as u32);
            }
        }
        let mut walls_of_tile = vec![Vec::new(); of_tile.len()];
        for &wall in walls {
            walls_of_tile[tile_of(wall.0)].push(wall);
        }
        let tile = |(t, (list, walls)): (usize, (Vec<u32>, Vec<WallElement>))| Tile {
            first: t * TILE,
            batches: list.chunks(LANES).map(|list| Batch::new(elements, list)).collect(),
            walls,
        };
        let lists: Vec<_> = of_tile.into_iter().zip(walls_of_tile).collect();
        Self { tiles: lists.into_par_iter().enumerate().map(tile).collect(), motion: vec![Vector6::zeros(); count] }
    }

    /// `y = S K S x` with the diagonal matrix `S` of `scale`.
    pub(super) fn apply(&mut self, scale: &[Vector6<f64>], x: &[Vector6<f64>], y: &mut [Vector6<f64>]) {
        let motions = self.motion.par_iter_mut().with_min_len(TILE);
        motions.zip(x).zip(scale).for_each(|((motion, x), scale)| *motion = x.component_mul(scale));
        let motion = &self.motion;
        self.tiles.par_iter().zip(y.par_chunks_mut(TILE)).for_each(|(tile, y)| tile.apply(scale, motion, y));
    }
}

impl Tile {
    /// The product for the particles of the tile.
    fn apply(&self, scale: &[Vector6<f64>], motion: &[Vector6<f64>], y: &mut [Vector6<f64>]) {
        y.fill(Vector6::zeros());
        let mut add = |p: usize, contribution: Vector6<f64>| {
            if let Some(y) = y.get_mut(p.wrapping_sub(self.first)) {
                *y += contribution.component_mul(&scale[p]);
            }
        };
        for batch in &self.batches {
            let [on_a, on_b] = pulp::Arch::new().dispatch(Response { batch, motions: &batch.motions(motion) });
            for (lane, ends) in batch.ends[..batch.count].iter().enumerate() {
                add(ends[0] as usize, Vector6::from_fn(|i, _| on_a[i][lane]));
                add(ends[1] as usize, Vector6::from_fn(|i, _| on_b[i][lane]));
            }
        }
        for (p, n, arm, k) in &self.walls {
            let (u, w) = halves(&motion[*p as usize]);
            let f = along_and_across(n, &(-u + n.cross(&(w * *arm))), k.normal, k.shear);
            add(*p as usize, joined(&-f, &(-n.cross(&f) * *arm)));
        }
    }
}

impl Batch {
    fn new(elements: &[Element], list: &[u32]) -> Self {
        let mut batch = Self {
            count: list.len(),
            ends: [[0; 2]; LANES],
            normal: [[0.0; LANES]; 3],
            arms: [[0.0; LANES]; 2],
            stiffness: [[0.0; LANES]; 4],
        };
        for (lane, &k) in list.iter().enumerate() {
            let Element { a, b, normal, arm_a, arm_b, stiffness } = &elements[k as usize];
            batch.ends[lane] = [*a, *b];
            for (column, value) in batch.normal.iter_mut().zip(normal) {
                column[lane] = *value;
            }
            (batch.arms[0][lane], batch.arms[1][lane]) = (*arm_a, *arm_b);
            let all = [stiffness.normal, stiffness.shear, stiffness.bending, stiffness.twist];
            for (column, value) in batch.stiffness.iter_mut().zip(all) {
                column[lane] = value;
            }
        }
        batch
    }

    /// The motions of the ends.
    fn motions(&self, motion: &[Vector6<f64>]) -> Motions {
        let mut columns = [[[0.0; LANES]; 6]; 2];
        for (lane, ends) in self.ends[..self.count].iter().enumerate() {
            for (columns, &p) in columns.iter_mut().zip(ends) {
                let motion = &motion[p as usize];
                for (i, column) in columns.iter_mut().enumerate() {
                    column[lane] = motion[i];
                }
            }
        }
        columns
    }
}

/// Forces and torques on the ends of the elements of a batch, with the widest instructions of the processor.
struct Response<'a> {
    batch: &'a Batch,
    motions: &'a Motions,
}

impl pulp::NullaryFnOnce for Response<'_> {
    type Output = Motions;
    #[inline(always)]
    fn call(self) -> Motions {
        let Self { batch, motions } = self;
        let mut on_ends = [[[0.0; LANES]; 6]; 2];
        for lane in 0..LANES {
            let vector = |columns: &[[f64; LANES]], i: usize| {
                Vec3::new(columns[i][lane], columns[i + 1][lane], columns[i + 2][lane])
            };
            let [(ua, wa), (ub, wb)] = [0, 1].map(|end| (vector(&motions[end], 0), vector(&motions[end], 3)));
            let (n, [arm_a, arm_b]) = (vector(&batch.normal, 0), batch.arms.map(|arms| arms[lane]));
            let [normal, shear, bending, twist] = batch.stiffness.map(|column| column[lane]);
            let f = along_and_across(&n, &(ub - ua + n.cross(&(wa * arm_a + wb * arm_b))), normal, shear);
            let moment = along_and_across(&n, &(wb - wa), twist, bending);
            let torque_per_arm = n.cross(&f);
            let (force_a, torque_a) = (-f, -torque_per_arm * arm_a - moment);
            let torque_b = -torque_per_arm * arm_b + moment;
            for i in 0..3 {
                (on_ends[0][i][lane], on_ends[0][i + 3][lane]) = (force_a[i], torque_a[i]);
                (on_ends[1][i][lane], on_ends[1][i + 3][lane]) = (f[i], torque_b[i]);
            }
        }
        on_ends
    }
}

/// A vector, its parts along and across the normal multiplied by two factors.
#[inline(always)]
fn along_and_across(normal: &Vec3, vector: &Vec3, along: f64, across: f64) -> Vec3 {
    let part = normal * normal.dot(vector);
    part * along + (vector - part) * across
}

/// Translational and rotational parts of a vector.
pub(super) fn halves(v: &Vector6<f64>) -> (Vec3, Vec3) {
    (Vec3::new(v[0], v[1], v[2]), Vec3::new(v[3], v[4], v[5]))
}

/// The inverse of [`halves`].
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
        let mut network = Network::new(n, &elements, &walls);
        for _ in 0..2 {
            let x: Vec<_> = (0..n).map(|_| Vector6::from_fn(|_, _| random())).collect();
            let mut y = vec![Vector6::repeat(f64::NAN); n];
            network.apply(&scale, &x, &mut y);
            let bits = |v: &[Vector6<f64>]| v.iter().flat_map(|v| v.iter().map(|x| x.to_bits())).collect::<Vec<_>>();
            assert_eq!(bits(&y), bits(&direct(&elements, &walls, &scale, &x)));
        }
    }
}
