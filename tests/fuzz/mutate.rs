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

/// Changes the structure of a text in one to four places: its lines, the fields of a line, their separators; `known` are lines that it may have.
pub fn restructure(bytes: &mut Vec<u8>, random: &mut Random, known: &[String]) {
    let text = String::from_utf8_lossy(bytes).into_owned();
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    for _ in 0..=random.below(4) {
        if lines.is_empty() {
            break;
        }
        let (at, other) = (random.below(lines.len()), random.below(lines.len()));
        match random.below(10) {
            0 => lines.swap(at, other),
            1 => lines.insert(other, lines[at].clone()),
            2 => drop(lines.remove(at)),
            3 => known[random.below(known.len())].clone_into(&mut lines[at]),
            4 => lines.insert(at, known[random.below(known.len())].clone()),
            5 => lines.truncate(at),
            kind => {
                let separator = [' ', ',', ';', '\t'].into_iter().find(|c| lines[at].contains(*c)).unwrap_or(' ');
                let mut fields: Vec<String> = lines[at].split(separator).map(str::to_owned).collect();
                let (field, second) = (random.below(fields.len()), random.below(fields.len()));
                match kind {
                    6 => fields.swap(field, second),
                    7 => fields.insert(second, fields[field].clone()),
                    8 => drop(fields.remove(field)),
                    _ => WORDS[random.below(WORDS.len())].clone_into(&mut fields[field]),
                }
                let another = [separator, separator, separator, ' ', ',', ';', '\t'][random.below(7)];
                lines[at] = fields.join(&another.to_string());
            }
        }
    }
    let end = ["\n", "\n", "\n", "\r\n", "\r"][random.below(5)];
    *bytes = (lines.join(end) + end).into_bytes();
}

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
