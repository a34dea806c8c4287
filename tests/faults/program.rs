//! Runs the program within the test process; a small scenario.

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
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let arguments = std::iter::once(OsString::from("concordem")).chain(arguments.into_iter().map(Into::into));
    let mut console = Console { out: &mut out, err: &mut err, interactive: false, out_interactive: false };
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

/// A small block of bonded spheres in tension.
pub const BLOCK: &str = r#"
version = 1
[packing]
kind = "lattice"
lattice = "hcp"
radius = "1 mm"
repeats = [5, 3, 5]
[[material]]
name = "stone"
density = 2500
linear_bond = { normal_stiffness = 1e6, shear_stiffness = 2e5 }
[bonds]
law = "linear_bond"
interaction_ratio = 1.05
[contacts]
law = "none"
[integration]
damping = { kind = "local", coefficient = 0.2 }
[loading]
kind = "uniaxial"
strain_rate = "1 1/s"
[stop]
steps = 100
[output]
sample_interval = 10
"#;
