//! Placed inclusions, with a grid to find them.

use super::{Inclusion, Region};
use concordem_contact::math::Vec3;

/// Inclusions in a region. In a periodic cell all images count.
#[derive(Debug, Clone)]
pub struct Field {
    region: Region,
    inclusions: Vec<Inclusion>,
    grid: Grid,
}

/// An inclusion, and the number of cells by which it is moved.
#[derive(Debug, Clone, Copy)]
struct Entry {
    number: u32,
    image: [i32; 3],
}

/// Cells of equal size over the region. Each lists the inclusions whose boxes meet it.
#[derive(Debug, Clone)]
struct Grid {
    counts: [i64; 3],
    cells: Vec<Vec<Entry>>,
}

/// Cells per inclusion. More cells list large inclusions more often; fewer have longer lists.
const CELLS_PER_INCLUSION: f64 = 2.0;
/// Largest number of cells along an axis.
const MOST_CELLS: i64 = 1000;

impl Grid {
    fn new(region: &Region, expected: usize) -> Self {
        let lengths = Vec3::from_fn(|i, _| region.edges.column(i).norm());
        let axes = if region.planar { 2 } else { 3 };
        let volume: f64 = (0..axes).map(|i| lengths[i]).product();
        let wanted = (expected.max(1) as f64 * CELLS_PER_INCLUSION).min(3e7);
        let edge = if axes == 2 { (volume / wanted).sqrt() } else { concordem_contact::math::cbrt(volume / wanted) };
        let count = |i: usize| if i < axes { ((lengths[i] / edge) as i64).clamp(1, MOST_CELLS) } else { 1 };
        let counts = [count(0), count(1), count(2)];
        Self { counts, cells: vec![Vec::new(); counts.iter().product::<i64>() as usize] }
    }

    /// Calls `visit` with the number of each cell that a box meets, and the image of the region it lies in, until `visit` is
    /// false; the box is given by its center and half of its edges, relative to the region.
    fn visit(
        &self,
        periodic: bool,
        center: &Vec3,
        half: &Vec3,
        visit: &mut dyn FnMut(usize, [i32; 3]) -> bool,
    ) -> bool {
        let span = |i: usize| {
            let count = self.counts[i];
            let place = |x: f64| {
                let cell = (x * count as f64).floor();
                // Boxes beyond a mould belong to its outermost cells.
                if periodic { cell as i64 } else { cell.clamp(0.0, (count - 1) as f64) as i64 }
            };
            place(center[i] - half[i])..=place(center[i] + half[i])
        };
        for k in span(2) {
            for j in span(1) {
                for i in span(0) {
                    let [nx, ny, nz] = self.counts;
                    let cell = i.rem_euclid(nx) + nx * (j.rem_euclid(ny) + ny * k.rem_euclid(nz));
                    let image = [i.div_euclid(nx), j.div_euclid(ny), k.div_euclid(nz)].map(|image| image as i32);
                    if !visit(cell as usize, image) {
                        return false;
                    }
                }
            }
        }
        true
    }
}

impl Field {
    /// An empty field, with a grid for the expected number of inclusions.
    pub(crate) fn new(region: Region, expected: usize) -> Self {
        let grid = Grid::new(&region, expected);
        Self { region, inclusions: Vec::new(), grid }
    }

    /// The region.
    pub fn region(&self) -> &Region {
        &self.region
    }

    /// All inclusions, in the order in which they were placed.
    pub fn inclusions(&self) -> &[Inclusion] {
        &self.inclusions
    }

    /// Volume of all inclusions, m³; area in the plane, m².
    pub fn volume(&self) -> f64 {
        self.inclusions.iter().map(|inclusion| inclusion.measure(self.region.planar)).sum()
    }

    /// Relative coordinates of the center of a body, and half of the edges of a box around it, larger by `margin` (m).
    fn relative_box(&self, center: &Vec3, half: &Vec3, margin: f64) -> (Vec3, Vec3) {
        let inverse = &self.region.inverse;
        let mut half = inverse.map(f64::abs) * half.add_scalar(margin);
        let mut center = inverse * (center - self.region.origin);
        if self.region.planar {
            (center.z, half.z) = (0.0, 0.0);
        }
        (center, half)
    }

    pub(crate) fn add(&mut self, inclusion: Inclusion) {
        let number = self.inclusions.len() as u32;
        let (center, half) = self.relative_box(&inclusion.center, &inclusion.half_box(), 0.0);
        let Self { grid, region, .. } = self;
        let mut places = Vec::new();
        grid.visit(region.is_periodic(), &center, &half, &mut |cell, image| {
            places.push((cell, image));
            true
        });
        for (cell, image) in places {
            grid.cells[cell].push(Entry { number, image: image.map(|cells| -cells) });
        }
        self.inclusions.push(inclusion);
    }

    /// Displacement of an image by whole cells, m.
    fn shift(&self, image: [i32; 3]) -> Vec3 {
        self.region.edges * Vec3::from(image.map(f64::from))
    }

    /// Whether no inclusion, and no image of one, is so near to `new` that `near` is true for it and its shift.
    pub(crate) fn is_free(&self, new: &Inclusion, margin: f64, near: &dyn Fn(&Inclusion, &Vec3) -> bool) -> bool {
        let (center, half) = self.relative_box(&new.center, &new.half_box(), margin);
        self.grid.visit(self.region.is_periodic(), &center, &half, &mut |cell, image| {
            self.grid.cells[cell].iter().all(|entry| {
                let relative = [0, 1, 2].map(|i| entry.image[i] + image[i]);
                let shift = if relative == [0; 3] { Vec3::zeros() } else { self.shift(relative) };
                !near(&self.inclusions[entry.number as usize], &shift)
            })
        })
    }

    /// Shifts (m) to the nearest images of the region in half of all directions; none for a mould.
    pub(crate) fn images(&self) -> Vec<Vec3> {
        if !self.region.is_periodic() {
            return Vec::new();
        }
        let depth = if self.region.planar { 0..=0 } else { -1..=1 };
        let all = depth.flat_map(|k| (-1..=1).flat_map(move |j| (-1..=1).map(move |i| [i, j, k])));
        all.filter(|[i, j, k]| (*k, *j, *i) > (0, 0, 0)).map(|image| self.shift(image)).collect()
    }

    /// Number of the inclusion that contains a point (m), at least `depth` (m) below its surface; `depth` gets its group. The first
    /// one, if several do.
    pub fn at(&self, point: &Vec3, depth: &dyn Fn(usize) -> f64) -> Option<usize> {
        let mut found: Option<u32> = None;
        let (center, half) = self.relative_box(point, &Vec3::zeros(), 0.0);
        self.grid.visit(self.region.is_periodic(), &center, &half, &mut |cell, image| {
            for entry in &self.grid.cells[cell] {
                if found.is_some_and(|number| number <= entry.number) {
                    continue;
                }
                let inclusion = &self.inclusions[entry.number as usize];
                let shift = self.shift([0, 1, 2].map(|i| entry.image[i] + image[i]));
                if inclusion.contains(&(point - shift), depth(inclusion.group)) {
                    found = Some(entry.number);
                }
            }
            true
        });
        found.map(|number| number as usize)
    }
}
