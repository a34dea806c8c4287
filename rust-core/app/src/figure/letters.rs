//! Letters of Helvetica, a font that every reader of PDF has: their widths, and their bytes in the encoding of Windows.

/// Widths of the characters from the space to the tilde, thousandths of the size (Adobe, Core 14 AFM, Helvetica).
const WIDTHS: [u16; 95] = [
    278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278, 556, 556, 556, 556, 556, 556, 556,
    556, 556, 556, 278, 278, 584, 584, 584, 556, 1015, 667, 667, 722, 722, 667, 611, 778, 722, 278, 500, 667, 556, 833,
    722, 778, 667, 778, 722, 667, 611, 722, 667, 944, 667, 667, 611, 278, 278, 278, 469, 556, 333, 556, 556, 500, 556,
    556, 278, 556, 556, 222, 222, 500, 222, 833, 556, 556, 556, 556, 333, 500, 278, 556, 500, 722, 500, 500, 500, 334,
    260, 334, 584,
];
/// Characters beyond ASCII and Latin-1 with their bytes in WinAnsiEncoding and their widths.
const OTHERS: [(char, u8, u16); 5] =
    [('‰', 0x89, 1000), ('–', 0x96, 556), ('−', 0x96, 556), ('’', 0x92, 222), ('…', 0x85, 1000)];
/// Width of characters of Latin-1, which differ little.
const LATIN: u16 = 556;

/// Byte and width of a character; `None` if the encoding lacks it.
fn letter(character: char) -> Option<(u8, u16)> {
    match character {
        ' '..='~' => Some((character as u8, WIDTHS[character as usize - 32])),
        '\u{a0}'..='\u{ff}' => Some((character as u8, LATIN)),
        _ => OTHERS.iter().find(|(other, ..)| *other == character).map(|&(_, byte, width)| (byte, width)),
    }
}

/// Width of a text of this size.
pub(super) fn width_of(text: &str, size: f64) -> f64 {
    text.chars().map(|character| f64::from(letter(character).map_or(LATIN, |(_, width)| width))).sum::<f64>() * size
        / 1000.0
}

/// Bytes of a text; characters that the encoding lacks become question marks.
pub(super) fn encoded(text: &str) -> Vec<u8> {
    text.chars().map(|character| letter(character).map_or(b'?', |(byte, _)| byte)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_have_their_widths_and_bytes() {
        assert_eq!(width_of("0.5", 10.0), 13.9);
        assert_eq!(width_of("MW~", 1000.0), f64::from(833 + 944 + 584));
        assert_eq!(encoded("−1 ‰, µ, σ"), b"\x961 \x89, \xb5, ?");
    }
}
