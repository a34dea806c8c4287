//! A program with support for graphics processors, on a machine without their driver.

#![cfg(feature = "cuda")]

use concordem_gpu::device::gpu;

/// One sentence says what is missing, with the remedy, and nothing panics. Where there is a driver, the next thing that is missing is named, if
/// anything is.
#[test]
fn a_machine_without_a_driver_says_so() {
    let driver =
        ["/usr/lib/x86_64-linux-gnu", "/usr/lib64", "/usr/lib", "/usr/local/nvidia/lib64", "/usr/local/cuda/compat"]
            .iter()
            .any(|folder| std::path::Path::new(folder).join("libcuda.so.1").exists());
    match gpu() {
        Ok(device) => assert!(driver, "{} without a driver", device.name()),
        Err(error) if driver => assert!(error.to_string().contains("make ptx"), "{error}"),
        Err(error) => {
            let text = error.to_string();
            assert!(text.contains("libcuda.so") && text.contains("run without --device gpu"), "{text}");
        }
    }
}
