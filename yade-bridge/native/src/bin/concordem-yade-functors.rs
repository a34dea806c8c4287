//! Writes the C++ classes of laws without hand-written ones: `concordem-yade-functors SHIM FOLDER`. FOLDER gets `laws.cpp` and
//! `classes.txt`, the names of the classes, bases first. Laws whose physics is in a header of SHIM are left out.

use std::path::PathBuf;
use std::{env, fs};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut words = env::args_os().skip(1).map(PathBuf::from);
    let (Some(shim), Some(folder)) = (words.next(), words.next()) else {
        return Err("give the folder of the shim, and the one to write to".into());
    };
    let mut hand_written = String::new();
    for entry in fs::read_dir(shim)? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "hpp") {
            hand_written += &fs::read_to_string(path)?;
        }
    }
    let (text, names) = concordem_yade::functors::source(&hand_written)?;
    fs::write(folder.join("laws.cpp"), text)?;
    fs::write(folder.join("classes.txt"), names.join("\n") + "\n")?;
    Ok(())
}
