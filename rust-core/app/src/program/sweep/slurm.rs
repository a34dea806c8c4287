//! A script that computes the parts of a sweep as an array job of SLURM.

use std::path::Path;

use super::{Sweep, SweepArguments, check_parts, command, result_path, shell};
use crate::output::sealed::{write_new_text, write_text};
use crate::program::{Console, Failure};

pub(super) fn write(
    arguments: &SweepArguments,
    path: &Path,
    parts: usize,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let sweep = Sweep::read_with(&arguments.sweep, arguments.settings.list())?;
    result_path(arguments, console)?;
    check_parts(parts, &sweep)?;
    let text = script(arguments, path, parts, sweep.points());
    if arguments.force { write_text(path, &text) } else { write_new_text(path, &text) }?;
    if !arguments.work.quiet {
        console.tell(&format!("wrote {}, which says how to submit it", path.display()));
    }
    console.print(&format!("{}\n", path.display()))
}

/// One line of a script: a name with control characters is quoted without them.
fn word(text: &str) -> String {
    if text.chars().any(char::is_control) {
        let escaped = |byte: u8| match byte {
            b' '..=b'~' if !b"\\'".contains(&byte) => char::from(byte).to_string(),
            other => format!("\\x{other:02x}"),
        };
        return format!("$'{}'", text.bytes().map(escaped).collect::<String>());
    }
    shell::argument(Path::new(text))
}

fn script(arguments: &SweepArguments, path: &Path, parts: usize, points: usize) -> String {
    let command = command(arguments, &word);
    let name = word(&path.to_string_lossy());
    let csv = if arguments.csv { " --csv" } else { "" };
    let threads = arguments.work.threads.unwrap_or(1);
    format!(
        r#"#!/bin/bash
# Computes a sweep of {points} points in {parts} parts, and merges them. Written by concordem sweep --slurm.
#
# Submit both jobs from the folder in which the script was written; the second one waits for all parts:
#   job=$(sbatch --parsable {name})
#   sbatch --dependency=afterok:"${{job%%;*}}" --array=1 {name} merge
# If a part was killed, submit both jobs again: finished points are not computed again.

#SBATCH --job-name=concordem-sweep
#SBATCH --array=1-{parts}
# Threads of each part: as many runs side by side.
#SBATCH --cpus-per-task={threads}
# Adapt: the longest time of a part, its memory, and the partition.
#SBATCH --time=24:00:00
##SBATCH --mem=4G
##SBATCH --partition=NAME

threads="${{SLURM_CPUS_PER_TASK:-{threads}}}"
# Load the program here if it is not in the path, such as: module load concordem

if [ "${{1:-}}" = merge ]; then
    exec {command} --merge{csv} -q -j "$threads"
fi
exec {command} --part "$SLURM_ARRAY_TASK_ID/{parts}" -q -j "$threads"
"#
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The shell of the script reads each name back as one argument from one line.
    #[test]
    #[cfg(unix)]
    fn a_name_is_one_line_and_one_argument() {
        for name in ["s.toml", "two words", "a\nb", "it's\r\n\\x\u{1b}[31m", "é\n$(touch x)", "$(touch x)", "-n"] {
            let quoted = word(name);
            assert!(!quoted.contains(char::is_control), "{quoted}");
            let command = format!("printf %s {quoted}");
            let output = std::process::Command::new("bash").args(["-c", &command]).output().expect("a shell");
            let expected = if name == "-n" { "./-n" } else { name };
            assert_eq!(String::from_utf8_lossy(&output.stdout), expected, "{command}");
        }
    }
}
