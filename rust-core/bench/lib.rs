//! Benchmarks: `cargo bench -p concordem-bench`.
