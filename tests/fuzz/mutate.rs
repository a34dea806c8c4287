//! Random mutations of bytes.

use concordem_tests::random::Random;

/// Numbers at the limits of types and sizes.
const BORDERS: [u64; 10] =
    [0, 1, 0x7f, 0xff, 0xffff, 0x7fff_ffff, 0xffff_ffff, 1 << 40, u64::MAX, 0x7ff8_0000_0000_0000];

/// Words that may confuse readers of text.
const WORDS: [&str; 16] = [
    "nan",
    "-inf",
    "1e999",
    "-1",
    "0",
    "1e-320",
    "1e308",
    "18446744073709551616",
    "\"\"",
    "[]",
    "{}",
    "[[",
    "\u{0}",
    "\n",
    "\"30 GPa\"",
    "true",
];

/// Changes `bytes` in one to four places; `text`: also insert words.
pub fn mutate(bytes: &mut Vec<u8>, random: &mut Random, text: bool) {
    for _ in 0..=random.below(4) {
        if bytes.is_empty() {
            return;
        }
        let at = random.below(bytes.len());
        match random.below(if text { 8 } else { 6 }) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = random.number() as u8,
            2 => {
                let border = BORDERS[random.below(BORDERS.len())].to_le_bytes();
                let length = [1, 2, 4, 8][random.below(4)].min(bytes.len() - at);
                bytes[at..at + length].copy_from_slice(&border[..length]);
            }
            3 => {
                // Copy a piece from elsewhere in the same input.
                let from = random.below(bytes.len());
                let length = random.below(64).min(bytes.len() - at).min(bytes.len() - from);
                bytes.copy_within(from..from + length, at);
            }
            4 => {
                let length = random.below(32).min(bytes.len() - at);
                bytes.drain(at..at + length);
            }
            5 if random.below(8) == 0 => bytes.truncate(at),
            5 => bytes[at] = bytes[at].wrapping_add(1),
            6 => {
                let word = WORDS[random.below(WORDS.len())];
                bytes.splice(at..at, word.bytes());
            }
            _ => {
                // Replace a value of a TOML line, or a number of a text, by another word.
                let end = bytes[at..].iter().position(|b| b" ,]}\n".contains(b)).map_or(bytes.len(), |n| at + n);
                let word = WORDS[random.below(WORDS.len())];
                bytes.splice(at..end, word.bytes());
            }
        }
    }
}
