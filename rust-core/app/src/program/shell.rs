//! Names of files in commands that messages tell the user to type.

use std::path::Path;

/// The path as one argument for a shell.
pub(super) fn argument(path: &Path) -> String {
    let text = path.to_string_lossy();
    let plain = |c: char| c.is_alphanumeric() || "_./+,:@%=-".contains(c);
    // A name that begins with a dash would be an option.
    let text = if text.starts_with('-') { format!("./{text}") } else { text.into_owned() };
    if !text.is_empty() && text.chars().all(plain) { text } else { format!("'{}'", text.replace('\'', "'\\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A shell reads each name back as one argument, and runs nothing.
    #[test]
    #[cfg(unix)]
    fn a_shell_reads_names_back() {
        for name in ["run.h5", "two words.h5", "$(touch x)", "`x`;'y'\"z\" &", "é*?[a]", "a\nb", "~", "#x", "!x", "\\"]
        {
            let command = format!("printf %s {}", argument(Path::new(name)));
            let output = std::process::Command::new("sh").args(["-c", &command]).output().expect("a shell");
            assert_eq!(String::from_utf8_lossy(&output.stdout), name, "{command}");
        }
        assert_eq!(argument(Path::new("folder/run.h5")), "folder/run.h5");
        assert_eq!(argument(Path::new("-n")), "./-n");
    }
}
