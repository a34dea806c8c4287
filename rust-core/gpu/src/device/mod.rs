//! What a device must be able to do: hold arrays, and launch kernels in order.

pub mod emulated;

#[cfg(feature = "cuda")]
pub mod cuda;

use std::mem::MaybeUninit;

pub use concordem_solver::DeviceError;

use crate::arguments::Launch;

/// The device that a user calls `gpu`.
///
/// # Errors
/// The program was built without support; there is no driver, no graphics processor, or no file of kernels.
#[cfg(feature = "cuda")]
pub fn gpu() -> Result<Box<dyn Device>, DeviceError> {
    Ok(Box::new(cuda::Cuda::open()?))
}

/// The device that a user calls `gpu`.
///
/// # Errors
/// The program was built without support.
#[cfg(not(feature = "cuda"))]
pub fn gpu() -> Result<Box<dyn Device>, DeviceError> {
    let text = "this program was built without graphics processors; build it with `cargo build --release -p concordem --features gpu`";
    Err(DeviceError(text.to_owned()))
}

/// A kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kernel {
    /// [`kernels::contacts`](crate::kernels::contacts) of the law with this name.
    Contacts(&'static str),
    /// [`kernels::particles`](crate::kernels::particles).
    Particles,
    /// [`kernels::sums`](crate::kernels::sums).
    Sums,
    /// [`kernels::layout`](crate::kernels::layout).
    Layout,
}

impl Kernel {
    /// Name of its entry point.
    pub fn entry(self) -> String {
        match self {
            Self::Contacts(law) => format!("contacts_{law}"),
            Self::Particles => "particles".to_owned(),
            Self::Sums => "sums".to_owned(),
            Self::Layout => "layout".to_owned(),
        }
    }

    /// Threads of a block: found by trials on an H200.
    pub fn block(self) -> usize {
        match self {
            // Few threads that wait for memory, on as many multiprocessors as possible. `rust-core/gpu/ptx` says so in the kernel.
            Self::Sums => 32,
            _ => 64,
        }
    }
}

/// Address of an array on a device.
pub type Address = u64;

/// A device. All calls take effect in their order, with one exception: [`Kernel::Sums`] may run while the launches of the next step do, but
/// ends before those of the step after it begin. [`Self::upload`], [`Self::download`], and [`Self::free`] wait for all launches before them.
pub trait Device: Send + Sync {
    /// What a user calls it.
    fn name(&self) -> String;

    /// Largest rate of its memory, B/s, if it is known.
    fn peak_bandwidth(&self) -> Option<f64> {
        None
    }

    /// An array of this many bytes, aligned to 16.
    ///
    /// # Errors
    /// The memory does not suffice.
    fn allocate(&mut self, bytes: usize) -> Result<Address, DeviceError>;

    /// Give an array back.
    fn free(&mut self, array: Address);

    /// Write a part of an array, from this address on. Bytes of padding have no value.
    ///
    /// # Errors
    /// The device fails.
    fn upload(&mut self, array: Address, bytes: &[MaybeUninit<u8>]) -> Result<(), DeviceError>;

    /// Read a part of an array, from this address on.
    ///
    /// # Errors
    /// The device fails, now or in an earlier launch.
    fn download(&mut self, array: Address, bytes: &mut [u8]) -> Result<(), DeviceError>;

    /// Run a kernel in at least `threads` threads. `arguments`: address of its arguments on the device.
    ///
    /// # Errors
    /// The device fails.
    fn launch(&mut self, kernel: Kernel, threads: usize, arguments: Address, launch: Launch)
    -> Result<(), DeviceError>;
}
