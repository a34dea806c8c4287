//! Picture of a histogram of directions: a rose on the geode, seen obliquely.

use std::fmt::Write as _;

use concordem_contact::math::{Vec3, sin_cos};
use concordem_operator::structure::Geode;

/// Size of the picture.
const SIZE: f64 = 420.0;
/// Radius of the picture of an isotropic distribution.
const UNIT: f64 = 110.0;
/// Largest density that is drawn to scale; larger ones are drawn at this length.
const LONGEST: f64 = 1.8;
/// Direction of view: azimuth and elevation, rad.
const VIEW: (f64, f64) = (0.6, 0.45);

/// The rose as SVG: each face of the geode at a distance that is the density of links in its direction, over that of an isotropic
/// distribution. A circle shows the isotropic one.
pub(super) fn svg(densities: &[f64], label: &str) -> String {
    let geode = Geode::new();
    let view = View::new();
    let mut polygons: Vec<(f64, [Vec3; 3], f64)> = Vec::new();
    for (face, &density) in geode.faces().iter().zip(densities) {
        let length = density.min(LONGEST);
        let [a, b, c] = face.map(|corner| corner * length);
        let origin = Vec3::zeros();
        for triangle in [[a, b, c], [a, origin, b], [b, origin, c], [c, origin, a]] {
            let normal = (triangle[1] - triangle[0]).cross(&(triangle[2] - triangle[0]));
            if normal.dot(&view.toward) > 0.0 {
                let depth = triangle.iter().sum::<Vec3>().dot(&view.toward);
                polygons.push((depth, triangle, density));
            }
        }
    }
    polygons.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = 0.5 * SIZE;
    let mut svg = format!(
        "<svg class=\"rose\" viewBox=\"0 0 {SIZE} {SIZE}\" width=\"{SIZE}\" role=\"img\" aria-label=\"{label}\">\n\
         <circle cx=\"{half}\" cy=\"{half}\" r=\"{UNIT}\" fill=\"none\" stroke=\"#b9c0c7\"/>\n"
    );
    for (_, triangle, density) in &polygons {
        let points: Vec<String> = triangle.iter().map(|x| view.place(x)).collect();
        let color = color(*density);
        let _ = writeln!(
            svg,
            "<polygon points=\"{}\" fill=\"{color}\" stroke=\"#fff\" stroke-width=\"0.4\"/>",
            points.join(" ")
        );
    }
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        let tip = Vec3::ith(axis, 1.62);
        let place = view.place(&tip);
        let (x, y) = place.split_once(',').unwrap_or(("0", "0"));
        let start = view.place(&Vec3::ith(axis, 1.25));
        let (x0, y0) = start.split_once(',').unwrap_or(("0", "0"));
        let _ = writeln!(
            svg,
            "<line x1=\"{x0}\" y1=\"{y0}\" x2=\"{x}\" y2=\"{y}\" stroke=\"#1f262d\" stroke-width=\"1.2\"/>\
             <text x=\"{x}\" y=\"{y}\" dx=\"6\" font-size=\"14\" fill=\"#1f262d\">{name}</text>"
        );
    }
    svg + "</svg>\n"
}

/// Blue below, gray at, and red above the density of an isotropic distribution.
fn color(density: f64) -> String {
    let t = ((density - 1.0) / 0.5).clamp(-1.0, 1.0);
    let end = if t < 0.0 { [38.0, 92.0, 160.0] } else { [190.0, 60.0, 30.0] };
    let mix = |k: usize| (218.0 + (end[k] - 218.0) * t.abs()).round();
    format!("rgb({},{},{})", mix(0), mix(1), mix(2))
}

/// Orthographic projection.
struct View {
    right: Vec3,
    up: Vec3,
    toward: Vec3,
}

impl View {
    fn new() -> Self {
        let ((sin_a, cos_a), (sin_e, cos_e)) = (sin_cos(VIEW.0), sin_cos(VIEW.1));
        let toward = Vec3::new(cos_a * cos_e, sin_a * cos_e, sin_e);
        let right = Vec3::new(-sin_a, cos_a, 0.0);
        Self { right, up: toward.cross(&right), toward }
    }

    fn place(&self, x: &Vec3) -> String {
        let half = 0.5 * SIZE;
        format!("{:.1},{:.1}", half + UNIT * x.dot(&self.right), half - UNIT * x.dot(&self.up))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half of the faces of a ball point to the viewer; the sides of equal columns cancel in the picture, but are drawn.
    #[test]
    fn faces_toward_the_viewer_are_drawn() {
        let svg = svg(&[1.0; Geode::FACES], "links");
        let drawn = svg.matches("<polygon").count();
        assert!((Geode::FACES / 2..4 * Geode::FACES).contains(&drawn), "{drawn}");
        assert!(svg.contains("rgb(218,218,218)") && !svg.contains("NaN"));
        assert_eq!((color(2.0), color(0.0)), ("rgb(190,60,30)".to_owned(), "rgb(38,92,160)".to_owned()));
    }
}
