//! From where a body is seen, and where it lies on the image.

use concordem_contact::math::Vec3;

/// Sine of the angle from z below which the view is along z.
const PARALLEL: f64 = 1e-6;

/// Directions of a parallel projection, unit vectors perpendicular to each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// To the right of the image.
    pub right: Vec3,
    /// Up in the image.
    pub up: Vec3,
    /// From the body to the eye.
    pub towards: Vec3,
}

impl View {
    /// The view of an eye in this direction from the body; z points up, or y if the eye is above or below. `None` if the direction is zero or not
    /// finite.
    pub fn from_direction(direction: &Vec3) -> Option<Self> {
        let length = direction.norm();
        if !(length > 0.0 && length.is_finite()) {
            return None;
        }
        let towards = direction / length;
        let vertical = if towards.x.hypot(towards.y) < PARALLEL { Vec3::y() } else { Vec3::z() };
        let right = vertical.cross(&towards).normalize();
        Some(Self { right, up: towards.cross(&right), towards })
    }

    /// Coordinates of a point: to the right, up, and towards the eye, m.
    pub fn of(&self, x: &Vec3) -> Vec3 {
        Vec3::new(x.dot(&self.right), x.dot(&self.up), x.dot(&self.towards))
    }

    /// The point with these coordinates.
    pub fn back(&self, place: &Vec3) -> Vec3 {
        self.right * place.x + self.up * place.y + self.towards * place.z
    }
}

/// A view at a scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// The directions.
    pub view: View,
    /// Pixels per meter.
    pub scale: f64,
    /// Place of the corner at the upper left of the image, m to the right and up.
    pub corner: [f64; 2],
}

impl Camera {
    /// The camera that fits an extent (lowest and highest coordinates in the view, m) into a frame (left, top, width, height, px), as large as it goes.
    pub fn around(view: View, extent: &[Vec3; 2], frame: [usize; 4]) -> Self {
        let [low, high] = extent;
        let [left, top, width, height] = frame.map(|pixels| pixels as f64);
        let size = (high - low).map(|length| length.max(f64::MIN_POSITIVE));
        let scale = (width / size.x).min(height / size.y);
        let middle = 0.5 * (low + high);
        let corner = [middle.x - (left + 0.5 * width) / scale, middle.y + (top + 0.5 * height) / scale];
        Self { view, scale, corner }
    }

    /// Place of a point on the image (px from the upper left), and towards the eye (m).
    pub fn place(&self, x: &Vec3) -> Vec3 {
        let at = self.view.of(x);
        Vec3::new((at.x - self.corner[0]) * self.scale, (self.corner[1] - at.y) * self.scale, at.z)
    }

    /// The point at this place of the image.
    pub fn point(&self, x: f64, y: f64, depth: f64) -> Vec3 {
        self.view.back(&Vec3::new(self.corner[0] + x / self.scale, self.corner[1] - y / self.scale, depth))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Views along the axes show what drawings show: x to the right and z up from the front, x to the right and y up from above.
    #[test]
    fn views_along_the_axes() {
        let view = |x, y, z| View::from_direction(&Vec3::new(x, y, z)).unwrap();
        assert_eq!((view(0.0, -3.0, 0.0).right, view(0.0, -3.0, 0.0).up), (Vec3::x(), Vec3::z()));
        assert_eq!((view(0.0, 0.0, 2.0).right, view(0.0, 0.0, 2.0).up), (Vec3::x(), Vec3::y()));
        assert_eq!((view(1.0, 0.0, 0.0).right, view(1.0, 0.0, 0.0).up), (Vec3::y(), Vec3::z()));
        assert_eq!(View::from_direction(&Vec3::zeros()), None);
    }

    /// A body fills its frame in one direction and is in its middle in the other; points go to the image and back.
    #[test]
    fn a_body_fills_its_frame() {
        let view = View::from_direction(&Vec3::new(1.0, -2.0, 1.0)).unwrap();
        let camera = Camera::around(view, &[Vec3::new(-1.0, -1.0, -3.0), Vec3::new(3.0, 1.0, 3.0)], [10, 20, 400, 300]);
        assert_eq!(camera.scale, 100.0);
        let corner = camera.place(&view.back(&Vec3::new(-1.0, 1.0, 0.5)));
        // Rounding of a few operations.
        assert!((corner - Vec3::new(10.0, 70.0, 0.5)).norm() < 1e-12, "{corner}");
        let x = Vec3::new(0.3, 0.2, -0.1);
        let at = camera.place(&x);
        assert!((camera.point(at.x, at.y, at.z) - x).norm() < 1e-14);
    }
}
