//! Charts, tables, and pictures, read back from the text of a page.

/// Farthest that a point may be from its line: what the simplification omits, and the rounding of coordinates to two decimals, px.
const OFF_LINE: f64 = 0.11;
/// Farthest that a corner of a line may be from the point that it draws: the rounding of both coordinates, px.
const OFF_POINT: f64 = 0.0075;

/// A point of a chart, px.
type Place = [f64; 2];

/// A scale of a chart: values at the ends, positions of the ends, px; and whether it is logarithmic.
struct Scale([f64; 5]);

impl Scale {
    fn of(svg: &str, name: &str) -> Self {
        let numbers = attribute(svg, name).split(' ').map(|text| text.parse().expect("a number")).collect::<Vec<f64>>();
        Self(numbers.try_into().expect("five numbers"))
    }

    fn place(&self, value: f64) -> f64 {
        let Self([low, high, from, to, logarithmic]) = self;
        let share =
            if *logarithmic == 1.0 { (value / low).ln() / (high / low).ln() } else { (value - low) / (high - low) };
        from + share * (to - from)
    }

    fn value(&self, place: f64) -> f64 {
        let Self([low, high, from, to, logarithmic]) = self;
        let share = (place - from) / (to - from);
        if *logarithmic == 1.0 { low * (high / low).powf(share) } else { low + share * (high - low) }
    }
}

/// A chart.
pub struct Drawing {
    x: Scale,
    y: Scale,
    /// The label of the abscissa.
    pub along: String,
    /// Names and corners of the lines, in the order in which they are drawn.
    lines: Vec<(String, Vec<Place>)>,
}

impl Drawing {
    /// The chart with this identifier.
    pub fn of(page: &str, id: &str) -> Self {
        let title = page.find(&format!("<title id=\"{id}-title\">")).unwrap_or_else(|| panic!("no chart {id}"));
        let from = page[..title].rfind("<svg").expect("a drawing");
        let svg = &page[from..from + page[from..].find("</svg>").expect("its end")];
        let line = |text: &str| {
            let corners = attribute(text, "points").split(' ').map(|pair| {
                let (x, y) = pair.split_once(',').expect("two numbers");
                [x, y].map(|text| text.parse().expect("a number"))
            });
            (attribute(text, "data-name").to_owned(), corners.collect())
        };
        let lines = svg.split("<polyline ").skip(1).map(|text| format!(" {text}"));
        Self {
            x: Scale::of(svg, "data-x"),
            y: Scale::of(svg, "data-y"),
            along: attribute(svg, "data-x-label").to_owned(),
            lines: lines.map(|text| line(&text)).collect(),
        }
    }

    /// Names of the lines, in the order in which they are drawn.
    pub fn names(&self) -> Vec<&str> {
        let mut names: Vec<&str> = self.lines.iter().map(|(name, _)| name.as_str()).collect();
        names.dedup();
        names
    }

    /// The parts of a line, which has gaps where values are missing.
    fn parts(&self, name: &str) -> Vec<&[Place]> {
        let own = self.lines.iter().filter(|(other, _)| other == name);
        let parts: Vec<&[Place]> = own.map(|(_, corners)| corners.as_slice()).collect();
        assert!(!parts.is_empty(), "no line {name} in {:?}", self.names());
        parts
    }

    /// Fails unless a line goes through all these points, from the first to the last one, and has no corner elsewhere.
    pub fn shows(&self, name: &str, points: impl IntoIterator<Item = (f64, f64)>) {
        let parts = self.parts(name);
        let placed: Vec<Place> = points.into_iter().map(|(x, y)| [self.x.place(x), self.y.place(y)]).collect();
        assert!(placed.len() > 1, "{name}: a line needs points");
        for point in &placed {
            // A part may be a single corner.
            let sides = parts.iter().flat_map(|part| part.iter().zip(part.iter().skip(1).chain(part.last())));
            let nearest = sides.map(|(from, to)| distance(*point, *from, *to)).fold(f64::INFINITY, f64::min);
            assert!(nearest <= OFF_LINE, "{name}: {point:?} is {nearest} px from the line");
        }
        let is_at = |corner: &Place, point: &Place| distance(*corner, *point, *point) <= OFF_POINT;
        for corner in parts.iter().copied().flatten() {
            assert!(placed.iter().any(|point| is_at(corner, point)), "{name}: nothing is at {corner:?}");
        }
        let ends = [parts[0].first().zip(placed.first()), parts[parts.len() - 1].last().zip(placed.last())];
        for (corner, point) in ends.map(|end| end.expect("a line")) {
            assert!(is_at(corner, point), "{name}: ends at {corner:?}, not {point:?}");
        }
    }

    /// Area between a line and the abscissa, in the units of the axes.
    pub fn area(&self, name: &str) -> f64 {
        let values = |[x, y]: &Place| [self.x.value(*x), self.y.value(*y)];
        let [corners] = self.parts(name)[..] else { panic!("{name} has gaps") };
        let corners: Vec<[f64; 2]> = corners.iter().map(values).collect();
        corners.windows(2).map(|side| 0.5 * (side[0][1] + side[1][1]) * (side[1][0] - side[0][0])).sum()
    }
}

/// Distance of a point from the side between two others.
fn distance(point: Place, from: Place, to: Place) -> f64 {
    let [side, way] = [[to[0] - from[0], to[1] - from[1]], [point[0] - from[0], point[1] - from[1]]];
    let square = side[0] * side[0] + side[1] * side[1];
    let share = if square > 0.0 { ((way[0] * side[0] + way[1] * side[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
    (way[0] - share * side[0]).hypot(way[1] - share * side[1])
}

/// An attribute of the first element that has it.
pub fn attribute<'a>(text: &'a str, name: &str) -> &'a str {
    between(text, &format!(" {name}=\""), "\"")
}

/// The text after the first `from`, up to the next `to`.
pub fn between<'a>(text: &'a str, from: &str, to: &str) -> &'a str {
    let (_, rest) = text.split_once(from).unwrap_or_else(|| panic!("no {from}"));
    rest.split_once(to).unwrap_or_else(|| panic!("no {to} after {from}")).0
}

/// The section of a page with this heading.
pub fn section<'a>(page: &'a str, heading: &str) -> &'a str {
    let from = page.find(&format!("<h2>{heading}</h2>")).unwrap_or_else(|| panic!("no section {heading}"));
    let rest = &page[from + 4..];
    &rest[..rest.find("<h2>").unwrap_or(rest.len())]
}

/// The rows of all tables of a text: the texts of their cells, without tags.
pub fn rows(text: &str) -> Vec<Vec<String>> {
    let cells = |row: &str| {
        let cells = row.split("<td").skip(1).map(|cell| {
            let (_, content) = cell.split_once('>').expect("a cell");
            plain(content.split("</td>").next().unwrap_or(content))
        });
        cells.collect::<Vec<String>>()
    };
    text.split("<tr").skip(1).map(|row| cells(row.split("</tr>").next().unwrap_or(row))).collect()
}

/// A text without tags.
fn plain(html: &str) -> String {
    let parts = html.split('<').enumerate();
    parts.map(|(k, part)| if k == 0 { part } else { part.split_once('>').map_or("", |(_, text)| text) }).collect()
}

/// A number as pages write it: "−1.500", "1.20·10⁻⁹".
pub fn number(text: &str) -> f64 {
    const RAISED: &str = "⁰¹²³⁴⁵⁶⁷⁸⁹";
    let text = text.trim().replace('−', "-");
    let Some((mantissa, power)) = text.split_once("·10") else { return text.parse().expect("a number") };
    let digit = |c: char| {
        let digits = RAISED.chars().position(|raised| raised == c);
        digits.map_or_else(|| "-".to_owned(), |digit| digit.to_string())
    };
    let power: String = power.chars().map(digit).collect();
    format!("{mantissa}e{power}").parse().expect("a number with a power of ten")
}

/// Fails unless a number was written with the digits that pages give: four, or three and a power of ten.
pub fn is_written(text: &str, value: f64) {
    let half_digit = if text.contains('·') { 5.1e-3 } else { 5.1e-4 };
    assert!((number(text) - value).abs() <= half_digit * value.abs(), "{text} {value}");
}

/// Bytes from base 64 (RFC 4648, section 4).
pub fn from_base64(text: &str) -> Vec<u8> {
    const DIGITS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let digits = text.bytes().filter(|c| *c != b'=');
    let values: Vec<u32> =
        digits.map(|c| DIGITS.iter().position(|d| *d == c).expect("a digit of base 64") as u32).collect();
    let mut bytes = Vec::new();
    for group in values.chunks(4) {
        let bits = group.iter().enumerate().fold(0, |bits, (k, value)| bits | value << (18 - 6 * k));
        bytes.extend(bits.to_be_bytes()[1..group.len()].iter());
    }
    bytes
}

/// 16-bit numbers, the low byte first.
pub fn words(bytes: &[u8]) -> Vec<u16> {
    bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect()
}
