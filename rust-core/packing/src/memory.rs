//! Check that a packing fits into memory: estimates the need before anything is allocated.

use super::PackingError;
use concordem_solver::state::particles::Sphere;

/// Bytes per sphere of a packing: the sphere, and half as much again while its list grows.
pub(crate) const SPHERE: f64 = 1.5 * size_of::<Sphere>() as f64;
/// Bytes per sphere of a compaction: particles, contacts, and the neighbor search. Measured: 3 kB at 10,000 spheres.
pub(crate) const COMPACTED: f64 = 3e3;

/// Memory for this process, bytes: the physical memory, or the limit of the control group, or what the limit of the address space (`ulimit -v`)
/// leaves beside what the process has already, if that is less. `None` if the system does not report it.
pub fn total() -> Option<f64> {
    let read = |path: &str| std::fs::read_to_string(path).ok();
    let physical = read("/proc/meminfo").and_then(|text| kilobytes(&text, "MemTotal:"));
    // Without a limit the file contains the word "max".
    let group = read("/sys/fs/cgroup/memory.max").and_then(|text| text.trim().parse::<f64>().ok());
    let process = read("/proc/self/limits").and_then(|text| {
        let taken = read("/proc/self/status").and_then(|text| kilobytes(&text, "VmSize:")).unwrap_or(0.0);
        Some((address_space(&text)? - taken).max(0.0))
    });
    [physical, group, process].into_iter().flatten().reduce(f64::min)
}

/// The entry `name` of a text in which the system reports memory, bytes.
fn kilobytes(text: &str, name: &str) -> Option<f64> {
    let entry = text.lines().find_map(|line| line.strip_prefix(name))?;
    Some(entry.split_whitespace().next()?.parse::<f64>().ok()? * 1024.0)
}

/// Limit of the address space in the text of `/proc/self/limits`, bytes; `None` without a limit.
fn address_space(limits: &str) -> Option<f64> {
    let line = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// An error if this needs more memory than the machine has. `what` completes "this needs about 5 GB of memory for".
///
/// # Errors
/// [`PackingError::Memory`] with both figures.
pub fn affordable_bytes(what: &str, bytes: f64) -> Result<(), PackingError> {
    let Some(total) = total() else { return Ok(()) };
    // NaN is an error too.
    if bytes <= total { Ok(()) } else { Err(PackingError::Memory { what: what.to_owned(), bytes, total }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_of_the_process_counts() {
        let limits = |soft: &str| {
            format!(
                "Limit  Soft Limit  Hard Limit  Units\nMax address space         {soft}            unlimited            bytes\n"
            )
        };
        assert_eq!(address_space(&limits("307200000")), Some(307_200_000.0));
        assert_eq!(address_space(&limits("unlimited")), None);
        assert!(address_space(&std::fs::read_to_string("/proc/self/limits").unwrap()).is_none_or(|bytes| bytes > 0.0));
        let status = std::fs::read_to_string("/proc/self/status").unwrap();
        let [size, peak] = ["VmSize:", "VmPeak:"].map(|name| kilobytes(&status, name).unwrap());
        assert!(1e6 < size && size <= peak, "{size} {peak}");
    }
}
