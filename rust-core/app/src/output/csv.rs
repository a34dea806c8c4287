//! Series as comma-separated text.

use std::fmt::Write;
use std::path::Path;

use super::error::OutputError;
use super::result::ResultFile;
use super::sealed;

/// Text of all series of a result: a header with names and units in square brackets, then one line per sample.
/// Reading the numbers gives the same bits.
pub fn text(result: &ResultFile) -> Result<String, OutputError> {
    let series = result.series();
    let columns = series.iter().map(|series| result.samples(&series.name)).collect::<Result<Vec<_>, _>>()?;
    let heads: Vec<String> = series.iter().map(|series| field(&format!("{} [{}]", series.name, series.unit))).collect();
    let mut text = heads.join(",");
    text.push('\n');
    for row in 0..columns.first().map_or(0, Vec::len) {
        for (k, column) in columns.iter().enumerate() {
            let separator = if k == 0 { "" } else { "," };
            // The shortest digits that restore the number. Writing to a string cannot fail.
            let _ = write!(text, "{separator}{:?}", column[row]);
        }
        text.push('\n');
    }
    Ok(text)
}

/// Write all series of a result to a file; fails if it exists, unless `overwrite`.
pub fn write(result: &ResultFile, path: &Path, overwrite: bool) -> Result<(), OutputError> {
    if !overwrite && path.exists() {
        return Err(OutputError::Exists { path: path.to_owned() });
    }
    sealed::write_text(path, &text(result)?)
}

/// A field of the header, quoted if necessary (RFC 4180).
fn field(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}
