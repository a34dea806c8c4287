//! Transmission surface and volume fraction of a sphere by its number of neighbors: Jebahi et al. 2015, table 3.1.
//!
//! A sphere with `n` neighbors stands for a regular polyhedron of `n` faces around it. Its surface `S_t` to each neighbor
//! is the area of a face over `R²`; its volume fraction `f_v` is that of the crystal with `n` neighbors. In between,
//! both are linear; `S_t` below 4 neighbors and `f_v` above 12 continue their last slope. The table of the book stops at
//! 20 neighbors: beyond, `S_t` stays, and `f_v` grows to at most 1.

use std::f64::consts::PI;

/// Area of a face of the regular polyhedron of 4, 6, 8, 12, or 20 faces around the unit sphere.
fn faces() -> [(f64, f64); 5] {
    let five = 5f64.sqrt();
    // Edges of dodecahedron and icosahedron with the inner radius 1.
    let dodecahedron = 2.0 / (2.5 + 1.1 * five).sqrt();
    let icosahedron = 12.0 / (3f64.sqrt() * (3.0 + five));
    [
        (4.0, 6.0 * 3f64.sqrt()),
        (6.0, 4.0),
        (8.0, 1.5 * 3f64.sqrt()),
        (12.0, 0.25 * dodecahedron * dodecahedron * (25.0 + 10.0 * five).sqrt()),
        (20.0, 0.25 * 3f64.sqrt() * icosahedron * icosahedron),
    ]
}

/// Volume fraction of a sphere without neighbors (0), and of the crystals with 4 (diamond), 6 (simple cubic), 8 (body-centered),
/// and 12 (face-centered) neighbors.
fn fractions() -> [(f64, f64); 5] {
    [
        (0.0, 0.0),
        (4.0, PI * 3f64.sqrt() / 16.0),
        (6.0, PI / 6.0),
        (8.0, PI * 3f64.sqrt() / 8.0),
        (12.0, PI * 2f64.sqrt() / 6.0),
    ]
}

/// Straight lines through `points`; the first and the last line continue.
fn interpolate(points: &[(f64, f64); 5], x: f64) -> f64 {
    let after = points[1..4].iter().position(|point| x <= point.0).unwrap_or(3) + 1;
    let ((x0, y0), (x1, y1)) = (points[after - 1], points[after]);
    if x == x1 { y1 } else { y0 + (y1 - y0) * ((x - x0) / (x1 - x0)) }
}

/// Transmission surface `S_t/R²` of a sphere with `neighbors` neighbors.
pub fn transmission_surface(neighbors: u32) -> f64 {
    interpolate(&faces(), f64::from(neighbors.min(20)))
}

/// Volume fraction `f_v` of a sphere with `neighbors` neighbors. A sphere without neighbors exchanges no heat; it has 1.
pub fn volume_fraction(neighbors: u32) -> f64 {
    if neighbors == 0 { 1.0 } else { interpolate(&fractions(), f64::from(neighbors)).min(1.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All rows of table 3.1. The book gives five decimals, and cuts some of them off instead of rounding.
    #[test]
    #[expect(clippy::approx_constant, reason = "numbers as the book prints them")]
    fn table_3_1_of_the_book() {
        let rows = [
            (19.98076, 0.08502),
            (16.78460, 0.17004),
            (13.58845, 0.25506),
            (10.39230, 0.34008),
            (7.19615, 0.43184),
            (4.0, 0.52359),
            (3.29903, 0.60188),
            (2.59807, 0.68017),
            (2.29545, 0.69525),
            (1.99282, 0.71032),
            (1.69019, 0.72540),
            (1.38757, 0.74048),
            (1.30888, 0.75555),
            (1.23020, 0.77063),
            (1.15152, 0.78570),
            (1.07284, 0.80078),
            (0.99415, 0.81586),
            (0.91547, 0.83093),
            (0.83679, 0.84601),
            (0.75810, 0.86109),
        ];
        for (n, (surface, fraction)) in (1..).zip(rows) {
            assert!((transmission_surface(n) - surface).abs() < 1e-5, "{n}: {} {surface}", transmission_surface(n));
            assert!((volume_fraction(n) - fraction).abs() < 1e-5, "{n}: {} {fraction}", volume_fraction(n));
        }
        assert_eq!((transmission_surface(6), volume_fraction(6)), (4.0, PI / 6.0));
    }
}
