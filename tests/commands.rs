//! Runs commands of the program within the test process.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use concordem::program::{Console, run};

/// Output of a command.
pub struct Given {
    /// Exit code.
    pub code: u8,
    /// Standard output.
    pub out: String,
    /// Standard error.
    pub err: String,
}

/// Runs a command within this process.
pub fn concordem<S: Into<OsString>>(arguments: impl IntoIterator<Item = S>) -> Given {
    concordem_storing(None, arguments)
}

/// Runs a command within this process, which stores packings in a folder.
pub fn concordem_storing<S: Into<OsString>>(
    packings: Option<PathBuf>,
    arguments: impl IntoIterator<Item = S>,
) -> Given {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let arguments = std::iter::once(OsString::from("concordem")).chain(arguments.into_iter().map(Into::into));
    let (interactive, out_interactive) = (false, false);
    let mut console =
        Console { out: &mut out, err: &mut err, interactive, out_interactive, packings, code: None, host: None };
    let code = run(arguments, &mut console);
    let text = |bytes| String::from_utf8(bytes).expect("the program writes UTF-8");
    Given { code, out: text(out), err: text(err) }
}

/// Writes a file.
pub fn write(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, text).expect("a temporary folder can be written to");
    path
}

/// A path as text.
pub fn text(path: &Path) -> &str {
    path.to_str().expect("temporary folders have plain names")
}
