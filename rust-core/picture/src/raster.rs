//! Drawing: each pixel has four samples, each sample the color of the nearest body. Bands of rows are drawn independently, each with all bodies in
//! their order, so that the picture does not depend on the number of threads.

use concordem_contact::math::Vec3;
use rayon::prelude::*;

use crate::camera::Camera;
use crate::image::{Color, Image, mixed};
use crate::shapes::{Cut, Layer, Line, Polygon, Rod, Sphere};
use crate::walls::Walls;

/// Samples of a pixel along an edge.
const FINE: usize = 2;
/// Rows of samples in a band.
const BAND: usize = 32;
/// Direction to the light: right, up, and towards the eye.
const LIGHT: [f64; 3] = [-0.4, 0.5, 0.768_114_574_786_860_8];
/// Brightness where no light falls.
const SHADE: f64 = 0.45;
/// Brightness of the rim of a flat disc, and its width in samples.
const RIM: (f64, f64) = (0.6, 1.6);
/// Half of the width of a line, in samples.
const LINE: f64 = 1.3;

/// The nearest body at a sample.
#[derive(Debug, Clone, Copy)]
struct Sample {
    /// Place towards the eye, m; none without a body.
    depth: f64,
    color: Color,
}

const EMPTY: Sample = Sample { depth: f64::NEG_INFINITY, color: [255; 3] };

/// Draws layers, each over those before it, and walls through which one sees, behind and before the bodies of the first layer.
pub fn draw(image: &mut Image, layers: &[Layer], walls: &Walls<'_>, camera: &Camera) {
    let width = image.width;
    for (k, layer) in layers.iter().enumerate() {
        let samples = sampled(layer, camera, [width * FINE, image.height * FINE]);
        let has_walls = k == 0 && !walls.all.is_empty();
        let at = |x: usize, y: usize| {
            let row = |fine: usize| (FINE * y + fine) * width * FINE + FINE * x;
            std::array::from_fn::<Sample, { FINE * FINE }, _>(|n| samples[row(n / FINE) + n % FINE])
        };
        image.pixels.par_chunks_mut(width).enumerate().for_each(|(y, pixels)| {
            for (x, pixel) in pixels.iter_mut().enumerate() {
                let four = at(x, y);
                let below = *pixel;
                *pixel = mean(four.map(|sample| if sample.depth.is_finite() { sample.color } else { below }));
                if has_walls {
                    let nearest = four.iter().map(|sample| sample.depth).fold(f64::NEG_INFINITY, f64::max);
                    walls.cover(pixel, camera, [x as f64 + 0.5, y as f64 + 0.5], nearest);
                }
            }
        });
    }
}

/// Mean color of four samples.
fn mean(colors: [Color; FINE * FINE]) -> Color {
    std::array::from_fn(|k| {
        let sum: u32 = colors.iter().map(|color| u32::from(color[k])).sum();
        ((sum + 2) / (FINE * FINE) as u32) as u8
    })
}

/// The samples of a layer.
fn sampled(layer: &Layer, camera: &Camera, [width, height]: [usize; 2]) -> Vec<Sample> {
    let fine = FINE as f64;
    let place = |x: &Vec3| {
        let at = camera.place(x);
        Vec3::new(at.x * fine, at.y * fine, at.z)
    };
    let scale = camera.scale * fine;
    let gone = |middle: Vec3| layer.cuts.iter().any(|cut| cut.removes(&middle));
    let planes: Vec<Plane> = layer.cuts.iter().map(|cut| Plane::of(cut, camera, fine)).collect();
    let discs: Vec<Disc> = layer.spheres.iter().map(|sphere| Disc::of(sphere, place(&sphere.center), scale)).collect();
    let rods = layer.rods.iter().filter(|rod| !gone(0.5 * (rod.ends[0] + rod.ends[1])));
    let mut bars: Vec<Bar> = rods.map(|rod| Bar::of_rod(rod, place, scale)).collect();
    bars.extend(layer.lines.iter().map(|line| Bar::of_line(line, place, scale)));
    let polygons = layer.polygons.iter().filter(|polygon| {
        let sum: Vec3 = polygon.corners.iter().sum();
        !gone(sum / polygon.corners.len().max(1) as f64)
    });
    let faces: Vec<Face> = polygons.flat_map(|polygon| Face::all(polygon, place, scale)).collect();
    let mut samples = vec![EMPTY; width * height];
    samples.par_chunks_mut(BAND * width).enumerate().for_each(|(k, rows)| {
        let mut band = Band { first: (k * BAND) as i64, width: width as i64, rows };
        for disc in &discs {
            band.disc(disc, &planes, layer.is_flat);
        }
        for bar in &bars {
            band.bar(bar);
        }
        for face in &faces {
            band.face(face);
        }
    });
    samples
}

/// A color in the light; `normal`: right, up, and towards the eye.
fn lit(color: Color, normal: [f64; 3]) -> Color {
    let light: f64 = normal.iter().zip(LIGHT).map(|(n, l)| n * l).sum();
    mixed([0; 3], color, SHADE + (1.0 - SHADE) * light.max(0.0))
}

/// A cutting plane in coordinates of samples: what lies on its outer side is removed.
struct Plane {
    /// Normal to the right, up, and towards the eye.
    normal: [f64; 3],
    /// Place of the plane at the first sample along the normal, m, and its change per sample to the right and down.
    offset: f64,
    per_sample: [f64; 2],
}

impl Plane {
    fn of(cut: &Cut, camera: &Camera, fine: f64) -> Self {
        let normal = camera.view.of(&cut.normal);
        let step = 1.0 / (camera.scale * fine);
        let offset = cut.distance - normal.x * camera.corner[0] - normal.y * camera.corner[1];
        Self { normal: normal.into(), offset, per_sample: [-normal.x * step, normal.y * step] }
    }

    /// The part of a line towards the eye that it keeps, from `back` to `front`, and whether its face is at the front.
    fn kept(&self, x: f64, y: f64, [back, front]: [f64; 2]) -> Option<(f64, bool)> {
        let room = self.offset + self.per_sample[0] * x + self.per_sample[1] * y;
        let slope = self.normal[2];
        if slope.abs() < 1e-9 {
            return (room >= 0.0).then_some((front, false));
        }
        let face = room / slope;
        if slope < 0.0 {
            return (front >= face).then_some((front, false));
        }
        (back <= face).then_some((front.min(face), face < front))
    }
}

/// A sphere on the image, in samples.
struct Disc {
    x: f64,
    y: f64,
    /// Place of the center towards the eye, m.
    depth: f64,
    /// Radius in samples.
    radius: f64,
    /// Meters per sample.
    step: f64,
    color: Color,
}

impl Disc {
    fn of(sphere: &Sphere, at: Vec3, scale: f64) -> Self {
        // A sphere smaller than a sample is still seen.
        let radius = (sphere.radius * scale).max(0.7);
        Self { x: at.x, y: at.y, depth: at.z, radius, step: 1.0 / scale, color: sphere.color }
    }
}

/// A rod or a line on the image.
struct Bar {
    ends: [Vec3; 2],
    radius: f64,
    step: f64,
    color: Color,
    is_round: bool,
}

impl Bar {
    fn of_rod(rod: &Rod, place: impl Fn(&Vec3) -> Vec3, scale: f64) -> Self {
        let radius = (rod.radius * scale).max(0.7);
        Self { ends: rod.ends.each_ref().map(place), radius, step: 1.0 / scale, color: rod.color, is_round: true }
    }

    fn of_line(line: &Line, place: impl Fn(&Vec3) -> Vec3, scale: f64) -> Self {
        let ends = line.ends.each_ref().map(place);
        Self { ends, radius: LINE, step: 1.0 / scale, color: line.color, is_round: false }
    }
}

/// A triangle on the image.
struct Face {
    corners: [Vec3; 3],
    color: Color,
}

impl Face {
    /// The triangles of a polygon. Both of its sides are lit.
    fn all(polygon: &Polygon, place: impl Fn(&Vec3) -> Vec3, scale: f64) -> Vec<Self> {
        let corners: Vec<Vec3> = polygon.corners.iter().map(place).collect();
        let triangle = |k: usize| [corners[0], corners[k], corners[k + 1]];
        let flat = |a: &Vec3| Vec3::new(a.x, -a.y, a.z * scale);
        let faces = (1..corners.len().saturating_sub(1)).map(triangle).map(|corners| {
            let [a, b, c] = corners.each_ref().map(flat);
            let normal = (b - a).cross(&(c - a));
            let normal = normal * (normal.z.signum() / normal.norm());
            let color = if normal.x.is_finite() { lit(polygon.color, normal.into()) } else { polygon.color };
            Self { corners, color }
        });
        faces.collect()
    }
}

/// Some rows of samples.
struct Band<'a> {
    /// Number of the first row.
    first: i64,
    width: i64,
    rows: &'a mut [Sample],
}

impl Band<'_> {
    /// Calls `color` for the samples in a box (left, top, right, bottom), which gives place towards the eye and color of what is there.
    fn each(&mut self, [left, top, right, bottom]: [f64; 4], color: impl Fn(f64, f64) -> Option<(f64, Color)>) {
        let count = (self.rows.len() as i64) / self.width.max(1);
        let whole = |from: f64, to: f64, low: i64, high: i64| {
            // Casts saturate.
            ((from - 0.5).ceil() as i64).max(low)..((to - 0.5).floor() as i64).saturating_add(1).min(high)
        };
        for row in whole(top, bottom, self.first, self.first + count) {
            let start = (row - self.first) * self.width;
            for column in whole(left, right, 0, self.width) {
                let sample = &mut self.rows[(start + column) as usize];
                if let Some((depth, color)) = color(column as f64 + 0.5, row as f64 + 0.5)
                    && depth > sample.depth
                {
                    *sample = Sample { depth, color };
                }
            }
        }
    }

    fn disc(&mut self, disc: &Disc, planes: &[Plane], is_flat: bool) {
        let Disc { x, y, depth, radius, step, color } = *disc;
        self.each([x - radius, y - radius, x + radius, y + radius], |px, py| {
            let (right, up) = (px - x, y - py);
            let square = radius * radius - right * right - up * up;
            if square < 0.0 {
                return None;
            }
            if is_flat {
                let is_rim = radius > 4.0 * RIM.1 && square < radius * radius - (radius - RIM.1).powi(2);
                return Some((depth, if is_rim { mixed([0; 3], color, RIM.0) } else { color }));
            }
            let height = square.sqrt();
            let mut span = [depth - height * step, depth + height * step];
            let mut normal = [right / radius, up / radius, height / radius];
            for plane in planes {
                let (front, is_face) = plane.kept(px, py, span)?;
                span[1] = front;
                if is_face {
                    normal = plane.normal;
                }
            }
            Some((span[1], lit(color, normal)))
        });
    }

    fn bar(&mut self, bar: &Bar) {
        let Bar { ends: [a, b], radius, step, color, is_round } = *bar;
        let along = [b.x - a.x, b.y - a.y];
        let square = along[0] * along[0] + along[1] * along[1];
        let frame = [a.x.min(b.x) - radius, a.y.min(b.y) - radius, a.x.max(b.x) + radius, a.y.max(b.y) + radius];
        self.each(frame, |px, py| {
            let share = if square > 0.0 {
                (((px - a.x) * along[0] + (py - a.y) * along[1]) / square).clamp(0.0, 1.0)
            } else {
                0.0
            };
            let (right, up) = (px - a.x - share * along[0], a.y + share * along[1] - py);
            let rest = radius * radius - right * right - up * up;
            if rest < 0.0 {
                return None;
            }
            let (height, depth) = (rest.sqrt(), a.z + share * (b.z - a.z));
            Some(if is_round {
                (depth + height * step, lit(color, [right / radius, up / radius, height / radius]))
            } else {
                (depth, color)
            })
        });
    }

    fn face(&mut self, face: &Face) {
        let Face { corners: [a, b, c], color } = *face;
        let area = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
        if area == 0.0 {
            return;
        }
        let low = a.inf(&b).inf(&c);
        let high = a.sup(&b).sup(&c);
        self.each([low.x, low.y, high.x, high.y], |px, py| {
            let share =
                |one: &Vec3, other: &Vec3| ((other.x - one.x) * (py - one.y) - (other.y - one.y) * (px - one.x)) / area;
            let (of_a, of_b, of_c) = (share(&b, &c), share(&c, &a), share(&a, &b));
            let inside = of_a >= 0.0 && of_b >= 0.0 && of_c >= 0.0;
            inside.then(|| (of_a * a.z + of_b * b.z + of_c * c.z, color))
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::View;

    const RED: Color = [200, 30, 30];
    const BLUE: Color = [30, 60, 200];

    fn sphere(x: f64, y: f64, z: f64, radius: f64, color: Color) -> Sphere {
        Sphere { center: Vec3::new(x, y, z), radius, color }
    }

    /// 200 x 200 pixels of the square from -1 to 1, seen along z from above.
    fn seen(layers: &[Layer]) -> Image {
        let view = View::from_direction(&Vec3::z()).unwrap();
        let extent = [Vec3::repeat(-1.0), Vec3::repeat(1.0)];
        let mut image = Image::white(200, 200);
        draw(&mut image, layers, &Walls::default(), &Camera::around(view, &extent, [0, 0, 200, 200]));
        image
    }

    fn at(image: &Image, x: f64, y: f64) -> Color {
        image.pixels[(((1.0 - y) * 100.0) as usize) * 200 + ((x + 1.0) * 100.0) as usize]
    }

    fn is_red(color: Color) -> bool {
        color[0] > 2 * color[2]
    }

    /// The pixels of a sphere have the area of its circle. Its outline crosses some 4 · 2 R pixels, whose share rounds: a thousandth of the area.
    #[test]
    fn a_sphere_covers_its_circle() {
        let layer = Layer { spheres: vec![sphere(0.1, -0.05, 0.0, 0.6, RED)], is_flat: true, ..Layer::default() };
        let image = seen(&[layer]);
        // White and red differ by 225 in blue; the rim is darker, in red alone.
        let covered: f64 = image.pixels.iter().map(|pixel| f64::from(255 - pixel[1]) / 225.0).sum();
        let area = std::f64::consts::PI * 60.0 * 60.0;
        let rim = 2.0 * std::f64::consts::PI * 60.0;
        assert!(covered > area && covered < area + 0.1 * rim, "{covered} {area}");
    }

    /// The nearer of two spheres hides the other one, in any order; a later layer covers both.
    #[test]
    fn the_nearer_body_hides_the_other() {
        let (near, far) = (sphere(0.0, 0.0, 0.2, 0.3, RED), sphere(0.2, 0.0, -0.2, 0.3, BLUE));
        for spheres in [vec![near, far], vec![far, near]] {
            let layer = Layer { spheres, ..Layer::default() };
            let image = seen(std::slice::from_ref(&layer));
            assert!(is_red(at(&image, 0.1, 0.0)) && !is_red(at(&image, 0.4, 0.0)));
            let over = Layer { spheres: vec![sphere(0.0, 0.0, -0.9, 0.1, BLUE)], ..Layer::default() };
            let image = seen(&[layer, over]);
            assert!(!is_red(at(&image, 0.0, 0.0)) && is_red(at(&image, 0.2, 0.0)));
        }
    }

    /// A cut opens a sphere: one sees the one inside, and nothing where the plane across the view removed the body.
    #[test]
    fn a_cut_opens_a_sphere() {
        let spheres = vec![sphere(0.0, 0.0, 0.0, 0.8, BLUE), sphere(0.0, 0.0, 0.1, 0.3, RED)];
        let cut = |normal: Vec3, distance| {
            seen(&[Layer { spheres: spheres.clone(), cuts: vec![Cut { normal, distance }], ..Layer::default() }])
        };
        // The face of the large sphere is at 0.2; of the small one too, and the first of equals stays.
        assert!(!is_red(at(&cut(Vec3::z(), 2.0), 0.0, 0.0)));
        assert!(!is_red(at(&cut(Vec3::z(), 0.2), 0.0, 0.0)));
        let side = cut(Vec3::x(), 0.25);
        assert_eq!((at(&side, 0.3, 0.0), is_red(at(&side, 0.2, 0.0))), ([255; 3], false));
        assert_eq!(at(&cut(-Vec3::x(), 0.25), -0.3, 0.0), [255; 3]);
        // Nothing is left of a sphere in front of the plane; seen from its other side, the plane is the far wall.
        assert_eq!(at(&cut(Vec3::z(), -0.9), 0.0, 0.0), [255; 3]);
        assert_ne!(at(&cut(-Vec3::z(), 0.5), 0.0, 0.0), [255; 3]);
        assert_eq!(at(&cut(-Vec3::z(), 0.5), 0.75, 0.0), at(&cut(Vec3::z(), 2.0), 0.75, 0.0));
        // Inclined at 45°: the face ends where x + z = 0.4 √2 leaves the sphere.
        let inclined = Vec3::new(1.0, 0.0, 1.0).normalize();
        let image = cut(inclined, 0.4);
        assert_ne!(at(&image, 0.5, 0.0), [255; 3]);
        assert_eq!(at(&image, 0.79, 0.0), [255; 3]);
    }

    /// A rod and a polygon cover their places, with the depth of their points.
    #[test]
    fn rods_and_polygons_are_in_their_places() {
        let rod = Rod { ends: [Vec3::new(-0.8, 0.0, -0.5), Vec3::new(0.8, 0.0, 0.5)], radius: 0.05, color: RED };
        let square = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)];
        let polygon = Polygon { corners: square.map(|(x, y)| Vec3::new(x, y, 0.0)).to_vec(), color: BLUE };
        let image = seen(&[Layer { rods: vec![rod], polygons: vec![polygon], ..Layer::default() }]);
        assert!(is_red(at(&image, 0.3, 0.0)) && !is_red(at(&image, -0.3, 0.0)) && is_red(at(&image, -0.7, 0.0)));
        assert_eq!(at(&image, 0.7, 0.2), [255; 3]);
        let covered = image.pixels.iter().filter(|pixel| !is_red(**pixel) && **pixel != [255; 3]).count();
        // The square without the half of the rod, 0.5 + 0.05 long and 0.1 wide, in front of it.
        assert!((covered as f64 - (10_000.0 - 55.0 * 10.0)).abs() < 80.0, "{covered}");
    }

    /// Equal pixels for any number of threads.
    #[test]
    fn threads_do_not_matter() {
        let spheres = (0..500_u32).map(|k| {
            let place = |n: u32| f64::from(k.wrapping_mul(n) % 1000) / 500.0 - 1.0;
            sphere(place(7919), place(104_729), place(1_299_709), 0.1, [(k % 256) as u8, 90, 40])
        });
        let layer = [Layer { spheres: spheres.collect(), ..Layer::default() }];
        let on = |threads: usize| {
            rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| seen(&layer))
        };
        assert_eq!(on(1), on(3));
    }
}
