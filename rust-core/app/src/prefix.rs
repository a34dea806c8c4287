//! Prefixes of units, so that numbers on axes and keys are neither long nor tiny.

/// Prefixes, and their powers of ten.
const PREFIXES: [(&str, i32); 7] = [("n", -9), ("µ", -6), ("m", -3), ("", 0), ("k", 3), ("M", 6), ("G", 9)];
/// Units with prefixes.
const PREFIXED: [&str; 7] = ["m", "m/s", "N", "Pa", "J", "s", "W"];

/// A unit with the prefix that fits a range, and the factor of the values; "" for numbers without dimension.
pub(crate) fn with_prefix(unit: &str, [low, high]: [f64; 2]) -> (String, f64) {
    let most = high.abs().max(low.abs());
    if unit == "1" {
        return (String::new(), 1.0);
    }
    if !PREFIXED.contains(&unit) || most == 0.0 {
        return (unit.to_owned(), 1.0);
    }
    let fits = |(_, power): &&(&str, i32)| most < 1000.0 * 10_f64.powi(*power);
    let &(prefix, power) = PREFIXES.iter().find(fits).unwrap_or(&PREFIXES[6]);
    (format!("{prefix}{unit}"), 10_f64.powi(-power))
}
