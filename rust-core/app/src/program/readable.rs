//! Numbers as people read them.

/// A number with thousands separators.
pub(super) fn count(number: usize) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (at, digit) in digits.chars().enumerate() {
        if at > 0 && (digits.len() - at).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

/// A size in memory or on the disk.
pub(super) fn bytes(number: usize) -> String {
    let number = number as f64;
    if number >= 1e9 { format!("{:.2} GB", number / 1e9) } else { format!("{:.1} MB", number / 1e6) }
}

/// A duration in a readable unit.
pub(super) fn seconds(time: f64) -> String {
    if time < 1e-3 {
        format!("{:.1} µs", time * 1e6)
    } else if time < 1.0 {
        format!("{:.1} ms", time * 1e3)
    } else if time < 100.0 {
        format!("{time:.1} s")
    } else if time < 7200.0 {
        format!("{:.0} min", time / 60.0)
    } else {
        format!("{:.1} h", time / 3600.0)
    }
}
