//! Pictures of spheres, rods, polygons, and walls: parallel projection, hidden parts removed, equal bytes for any number of threads.
//!
//! * [`View`] and [`Camera`]: from where, and where on the image.
//! * [`Layer`], [`Walls`], [`draw`]: what is drawn. A later layer covers the earlier ones, so that cracks show through a body.
//! * [`colors`]: from numbers to colors. [`key`]: the bar of colors, names, and the scale beside the drawing.
//! * [`Image`] and [`png()`]: pixels, and the file.

mod camera;
pub mod colors;
mod encode;
mod image;
pub mod key;
mod raster;
mod shapes;
mod text;
mod walls;

pub use camera::{Camera, View};
pub use encode::{EncodingError, png};
pub use image::{Color, Image};
pub use raster::draw;
pub use shapes::{Cut, Layer, Line, Polygon, Rod, Sphere};
pub use text::{TEXT_HEIGHT, TEXT_WIDTH, text};
pub use walls::{Sheet, Wall, Walls};
