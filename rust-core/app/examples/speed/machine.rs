//! What the machine tells: processor time, memory, and the bandwidth of the memory on one core, which gives the least time that a step
//! can take.

use std::hint::black_box;
use std::time::Instant;

/// Processor time of all threads of this process, s (Linux; 0 elsewhere).
pub fn processor_time() -> f64 {
    let Ok(tasks) = std::fs::read_dir("/proc/self/task") else { return 0.0 };
    let nanoseconds: u64 = tasks
        .filter_map(|task| std::fs::read_to_string(task.ok()?.path().join("schedstat")).ok())
        .filter_map(|text| text.split(' ').next()?.parse::<u64>().ok())
        .sum();
    nanoseconds as f64 * 1e-9
}

/// Largest memory of this process so far, bytes (Linux; NaN elsewhere).
pub fn peak_memory() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.trim().strip_suffix(" kB")?.parse::<f64>().ok())
        .map_or(f64::NAN, |kibibytes| 1024.0 * kibibytes)
}

/// Eight times a level-3 cache of 32 MiB, so that the memory answers and not a cache.
const BYTES: usize = 256 << 20;
const ROUNDS: usize = 7;

/// Bytes per second that one core reads, and reads plus writes in a copy; medians, as JSON.
pub fn measure() -> String {
    let source = vec![1u64; BYTES / 8];
    let mut target = vec![0u64; BYTES / 8];
    let read = median(|| {
        // Eight sums, so that additions do not wait for each other.
        let mut sums = [0u64; 8];
        for eight in black_box(&source).chunks_exact(8) {
            for (sum, value) in sums.iter_mut().zip(eight) {
                *sum = sum.wrapping_add(*value);
            }
        }
        black_box(sums);
    });
    let copy = median(|| black_box(&mut target).copy_from_slice(black_box(&source)));
    let per_second = |bytes: usize, seconds: f64| bytes as f64 / seconds;
    format!(
        "{{\"read_bytes_per_s\": {:.4e}, \"copy_bytes_per_s\": {:.4e}}}",
        per_second(BYTES, read),
        per_second(2 * BYTES, copy)
    )
}

fn median(mut work: impl FnMut()) -> f64 {
    work();
    let mut times: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            let began = Instant::now();
            work();
            began.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_unstable_by(f64::total_cmp);
    times[ROUNDS / 2]
}
