//! Text of one size: Noto Sans Mono, drawn beforehand, so that no font of the machine changes the picture.

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

use crate::image::{Color, Image};

/// Height of a line, px.
pub const TEXT_HEIGHT: usize = 20;
/// Width of a character, px.
pub const TEXT_WIDTH: usize = get_raster_width(FontWeight::Regular, RasterHeight::Size20);

/// Writes a line; `left` and `top` of its first character, px. Characters that the font lacks become question marks.
pub fn text(image: &mut Image, line: &str, [left, top]: [i64; 2], color: Color) {
    let raster = |letter: char| get_raster(letter, FontWeight::Regular, RasterHeight::Size20);
    for (k, letter) in line.chars().enumerate() {
        let Some(letter) = raster(letter).or_else(|| raster('?')) else { continue };
        let x = left + (k * TEXT_WIDTH) as i64;
        for (row, shares) in letter.rows().enumerate() {
            for (column, share) in shares.iter().enumerate().filter(|(_, share)| **share > 0) {
                image.cover(x + column as i64, top + row as i64, color, f64::from(*share) / 255.0);
            }
        }
    }
}
