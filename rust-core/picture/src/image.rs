//! Pixels.

/// Red, green, and blue.
pub type Color = [u8; 3];

/// An image, row by row from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Image {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The pixels.
    pub pixels: Vec<Color>,
}

impl Image {
    /// An image without a drawing.
    pub fn white(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![[255; 3]; width * height] }
    }

    /// Covers a share of a pixel, if it is in the image.
    pub fn cover(&mut self, x: i64, y: i64, color: Color, share: f64) {
        if (0..self.width as i64).contains(&x) && (0..self.height as i64).contains(&y) {
            let pixel = &mut self.pixels[y as usize * self.width + x as usize];
            *pixel = mixed(*pixel, color, share);
        }
    }

    /// Fills a rectangle: left, top, width, height.
    pub fn fill(&mut self, [left, top, width, height]: [i64; 4], color: Color) {
        for y in top..top + height {
            (left..left + width).for_each(|x| self.cover(x, y, color, 1.0));
        }
    }
}

/// A color on the way from one to another; `share`: how far, 0 to 1.
pub fn mixed(one: Color, other: Color, share: f64) -> Color {
    std::array::from_fn(|k| (f64::from(one[k]) + (f64::from(other[k]) - f64::from(one[k])) * share).round() as u8)
}
