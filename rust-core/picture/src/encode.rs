//! Files: PNG, and animated PNG for several images.

use crate::image::Image;
pub use png::EncodingError;

/// The file of one image, or the animation of several of equal size that repeats without end, with this many per second.
///
/// # Errors
/// There is no image, or they differ in size.
pub fn png(images: &[Image], rate: f64) -> Result<Vec<u8>, EncodingError> {
    let first = images.first().ok_or_else(|| std::io::Error::other("there is no image"))?;
    if images.iter().any(|image| (image.width, image.height) != (first.width, first.height)) {
        return Err(std::io::Error::other("the images differ in size").into());
    }
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, first.width as u32, first.height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    if images.len() > 1 {
        encoder.set_animated(images.len() as u32, 0)?;
        encoder.set_frame_delay((1000.0 / rate).round().clamp(1.0, 60_000.0) as u16, 1000)?;
    }
    let mut writer = encoder.write_header()?;
    for image in images {
        writer.write_image_data(image.pixels.as_flattened())?;
    }
    writer.finish()?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pixels come back from the file, of each image of an animation.
    #[test]
    fn pixels_come_back() {
        let mut images = [Image::white(3, 2), Image::white(3, 2)];
        images[0].fill([1, 0, 1, 2], [10, 20, 30]);
        images[1].fill([0, 1, 3, 1], [40, 50, 60]);
        let bytes = png(&images, 4.0).unwrap();
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        assert_eq!(reader.info().animation_control.unwrap().num_frames, 2);
        for image in &images {
            let mut pixels = vec![0; 18];
            reader.next_frame(&mut pixels).unwrap();
            assert_eq!(pixels, image.pixels.as_flattened());
            assert_eq!(reader.info().frame_control.unwrap().delay_num, 250);
        }
        assert!(png(&[Image::white(3, 2), Image::white(2, 3)], 1.0).is_err());
        assert!(png(&[], 1.0).is_err());
    }
}
