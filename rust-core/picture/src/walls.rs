//! Walls through which one sees: a gray that covers what lies behind them. Only the side that particles touch is drawn, so that a box does not hide
//! what is in it.

use concordem_contact::math::Vec3;
use concordem_contact::wall::ClosestPoint;

use crate::camera::Camera;
use crate::image::{Color, mixed};

/// Color of walls, and the share that they cover.
const GRAY: Color = [70, 84, 98];
const SHARE: f64 = 0.16;
/// Share that the light adds where the wall is seen along its surface.
const INCLINED: f64 = 0.24;
/// Most steps along a ray.
const MOST: usize = 96;
/// Slope of the distance below which a ray runs along the wall.
const ALONG: f64 = 1e-6;

/// A surface by its closest points.
pub trait Sheet: Sync {
    /// Closest point to the point `x` (m), as particles meet it.
    fn closest(&self, x: &Vec3) -> Option<ClosestPoint>;
}

/// A wall, or an element of one.
pub struct Wall<'a> {
    /// Its surface.
    pub sheet: &'a dyn Sheet,
    /// Ball around it, m; `None`: it may be anywhere.
    pub ball: Option<(Vec3, f64)>,
}

/// All walls of a picture.
#[derive(Default)]
pub struct Walls<'a> {
    /// The walls.
    pub all: Vec<Wall<'a>>,
    /// Place of a section towards the eye, m, in which walls are lines; `None`: one sees their surfaces.
    pub section: Option<f64>,
    /// Lowest and highest corner of the box in which they are drawn, m, because some have no end.
    pub bounds: [Vec3; 2],
}

/// Whether a point lies in a box.
fn is_in(x: &Vec3, [low, high]: &[Vec3; 2]) -> bool {
    (0..3).all(|k| x[k] >= low[k] && x[k] <= high[k])
}

impl Walls<'_> {
    /// Covers a pixel with the walls before the nearest body, which is at `nearest` (m towards the eye).
    pub(crate) fn cover(&self, pixel: &mut Color, camera: &Camera, at: [f64; 2], nearest: f64) {
        match self.section {
            Some(depth) if self.is_in_section(camera, at, depth) => *pixel = GRAY,
            Some(_) => {}
            None => self.cover_surfaces(pixel, camera, at, nearest),
        }
    }

    /// Whether a wall passes a pixel at this depth.
    fn is_in_section(&self, camera: &Camera, [x, y]: [f64; 2], depth: f64) -> bool {
        let point = camera.point(x, y, depth);
        let reach = LINE / camera.scale;
        is_in(&point, &self.bounds)
            && self.all.iter().any(|wall| {
                let is_far = wall.ball.is_some_and(|(center, radius)| (center - point).norm() > radius + reach);
                !is_far && wall.sheet.closest(&point).is_some_and(|found| found.distance.abs() <= reach)
            })
    }

    fn cover_surfaces(&self, pixel: &mut Color, camera: &Camera, [x, y]: [f64; 2], nearest: f64) {
        let tolerance = 0.25 / camera.scale;
        let [low, high] = self.bounds;
        let (middle, reach) = (camera.place(&(0.5 * (low + high))).z, 0.5 * (high - low).norm());
        for wall in &self.all {
            let mut depths = [middle - reach, middle + reach];
            if let Some((center, radius)) = wall.ball {
                let at = camera.place(&center);
                if (at.x - x).hypot(at.y - y) > radius * camera.scale + 1.0 {
                    continue;
                }
                let reach = radius + tolerance;
                depths = [at.z - reach, at.z + reach];
            }
            if let Some((depth, slope)) = hit(wall.sheet, camera, [x, y], depths, tolerance)
                && depth > nearest
                && is_in(&camera.point(x, y, depth), &self.bounds)
            {
                *pixel = mixed(*pixel, GRAY, SHARE + INCLINED * (1.0 - slope));
            }
        }
    }
}

/// Half of the width of a wall in a section, px.
const LINE: f64 = 1.2;

/// Where the ray from the eye first meets the surface from the side of the particles: place towards the eye (m), and the cosine between ray and normal.
fn hit(
    sheet: &dyn Sheet,
    camera: &Camera,
    [x, y]: [f64; 2],
    [far, near]: [f64; 2],
    tolerance: f64,
) -> Option<(f64, f64)> {
    // A wall at the border of the body is in the picture.
    let (far, near) = (far - 4.0 * tolerance, near + 4.0 * tolerance);
    let ray = -camera.view.towards;
    let (mut depth, mut is_at_end) = (near, false);
    for _ in 0..MOST {
        let found = sheet.closest(&camera.point(x, y, depth))?;
        // Change of the distance per length along the ray.
        let slope = -found.normal.dot(&ray);
        let distance = found.distance;
        if distance.abs() <= tolerance {
            if slope < -ALONG {
                return Some((depth, -slope));
            }
            depth -= 4.0 * tolerance;
        } else {
            // Where the distance falls, the next place is that of a plane with this normal; it lies at or before the surface of a convex body, and a
            // step back leads from behind the one of a vessel.
            let forward = match (distance > 0.0, slope) {
                (_, slope) if slope < -1e-3 => distance / -slope,
                (false, slope) if slope > 1e-3 => -distance / slope,
                _ => distance.abs(),
            };
            depth -= forward;
        }
        // A step may lead far through a vessel: what is behind its wall leads back.
        if depth < far {
            if is_at_end {
                return None;
            }
            (is_at_end, depth) = (true, far);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::View;

    /// A solid ball, or the inside of a hollow one.
    struct Ball {
        radius: f64,
        is_hollow: bool,
    }

    impl Sheet for Ball {
        fn closest(&self, x: &Vec3) -> Option<ClosestPoint> {
            let rho = x.norm();
            let sign = if self.is_hollow { -1.0 } else { 1.0 };
            let distance = sign * (rho - self.radius);
            (rho > 0.0).then(|| ClosestPoint { normal: x * (-sign / rho), distance, interior: true })
        }
    }

    fn along(ball: &Ball, x: f64) -> Option<f64> {
        let view = View::from_direction(&Vec3::z()).unwrap();
        let camera = Camera::around(view, &[Vec3::repeat(-2.0), Vec3::repeat(2.0)], [0, 0, 400, 400]);
        let at = camera.place(&Vec3::new(x, 0.3, 0.0));
        hit(ball, &camera, [at.x, at.y], [-2.0, 2.0], 1e-6).map(|(depth, _)| depth)
    }

    /// A plane is drawn in its box only, behind what is before it; in a section it is a line.
    #[test]
    fn a_plane_is_drawn_in_its_box() {
        struct Floor;
        impl Sheet for Floor {
            fn closest(&self, x: &Vec3) -> Option<ClosestPoint> {
                Some(ClosestPoint { normal: -Vec3::z(), distance: x.z, interior: true })
            }
        }
        let bounds = [Vec3::repeat(-1.0), Vec3::repeat(1.0)];
        let walls = |section| Walls { all: vec![Wall { sheet: &Floor, ball: None }], section, bounds };
        let extent = [Vec3::repeat(-2.0), Vec3::repeat(2.0)];
        let above = Camera::around(View::from_direction(&Vec3::z()).unwrap(), &extent, [0, 0, 400, 400]);
        let covered = |walls: &Walls, camera: &Camera, x: f64, y: f64, nearest: f64| {
            let mut pixel = [255; 3];
            walls.cover(&mut pixel, camera, [x, y], nearest);
            pixel != [255; 3]
        };
        assert!(covered(&walls(None), &above, 200.0, 200.0, -0.1) && !covered(&walls(None), &above, 200.0, 200.0, 0.1));
        assert!(
            covered(&walls(None), &above, 299.0, 101.0, -0.1) && !covered(&walls(None), &above, 301.0, 200.0, -0.1)
        );
        let front = Camera::around(View::from_direction(&-Vec3::y()).unwrap(), &extent, [0, 0, 400, 400]);
        let line = walls(Some(0.0));
        assert!(covered(&line, &front, 150.0, 200.0, 0.0) && !covered(&line, &front, 150.0, 203.0, 0.0));
        assert!(!covered(&line, &front, 50.0, 200.0, 0.0));
        // From below one looks through it.
        let below = Camera::around(View::from_direction(&-Vec3::z()).unwrap(), &extent, [0, 0, 400, 400]);
        assert!(!covered(&walls(None), &below, 200.0, 200.0, -0.1));
    }

    /// One sees the near side of a ball and, through its open near side, the far side of a vessel; nothing beside them.
    #[test]
    fn near_side_of_a_ball_and_far_side_of_a_vessel() {
        for x in [-0.9, -0.2, 0.1, 0.7] {
            let height = (1.0_f64 - x * x - 0.09).sqrt();
            for (is_hollow, wanted) in [(false, height), (true, -height)] {
                let found = along(&Ball { radius: 1.0, is_hollow }, x).unwrap();
                // The tolerance of the distance, over the cosine between ray and normal.
                assert!((found - wanted).abs() < 1e-6 / height, "{x} {is_hollow} {found} {wanted}");
            }
        }
        assert_eq!(along(&Ball { radius: 1.0, is_hollow: false }, 1.2), None);
        assert_eq!(along(&Ball { radius: 1.0, is_hollow: true }, 1.2), None);
    }
}
