//! From numbers to colors.

use crate::image::{Color, mixed};

/// A scale of colors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Dark blue to yellow, even to the eye and to color-blind readers.
    Even,
    /// Light gray by orange to dark red, for damage.
    Damage,
    /// Blue by gray to red, for values of both signs.
    Signed,
}

/// Every eighth of viridis (Smith and van der Walt 2015, Matplotlib).
const EVEN: [Color; 9] = [
    [68, 1, 84],
    [71, 44, 122],
    [59, 81, 139],
    [44, 113, 142],
    [33, 144, 141],
    [39, 173, 129],
    [92, 200, 99],
    [170, 220, 50],
    [253, 231, 37],
];
/// The scale of the report.
const DAMAGE: [Color; 3] = [[216, 222, 228], [226, 110, 52], [120, 18, 16]];
/// Five of RdBu (ColorBrewer, Harrower and Brewer 2003), its middle darker than the paper.
const SIGNED: [Color; 5] = [[5, 113, 176], [120, 172, 205], [222, 222, 222], [230, 140, 110], [202, 0, 32]];

/// Colors of kinds, that color-blind readers tell apart (Okabe and Ito 2008); the first one light, as that of the body.
const KINDS: [Color; 8] = [
    [214, 207, 190],
    [0, 114, 178],
    [230, 159, 0],
    [0, 158, 115],
    [213, 94, 0],
    [204, 121, 167],
    [86, 180, 233],
    [110, 98, 84],
];

impl Scale {
    /// The color of a share, from 0 to 1; what lies outside has that of the end.
    pub fn color(self, share: f64) -> Color {
        let stops: &[Color] = match self {
            Self::Even => &EVEN,
            Self::Damage => &DAMAGE,
            Self::Signed => &SIGNED,
        };
        let place = share.clamp(0.0, 1.0) * (stops.len() - 1) as f64;
        let below = (place as usize).min(stops.len() - 2);
        mixed(stops[below], stops[below + 1], place - below as f64)
    }
}

/// The color of a kind; they repeat.
pub fn of_kind(number: usize) -> Color {
    KINDS[number % KINDS.len()]
}

/// A color that is paler than another, for what is behind what matters.
pub fn pale(color: Color) -> Color {
    mixed(color, [255; 3], 0.72)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The ends and the stops of a scale are its colors, beyond its ends too.
    #[test]
    fn scales_have_their_stops() {
        assert_eq!(
            [-1.0, 0.0, 0.125, 1.0, 7.0].map(|share| Scale::Even.color(share)),
            [EVEN[0], EVEN[0], EVEN[1], EVEN[8], EVEN[8]]
        );
        assert_eq!(Scale::Damage.color(0.25), [221, 166, 140]);
        assert_eq!(of_kind(9), of_kind(1));
    }
}
