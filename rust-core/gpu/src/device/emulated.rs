//! The kernels in a loop on the processor, for tests of everything but the calls of a driver.

#![allow(unsafe_code)]

use std::collections::BTreeMap;
use std::mem::MaybeUninit;
use std::ptr::NonNull;

use super::{Address, Device, DeviceError, Kernel};
use crate::arguments::{ContactArrays, LAYOUT, Launch};
use crate::kernels;

/// A device whose arrays lie in the memory of the process. Its threads run one after another, in a shuffled order.
#[derive(Debug, Default)]
pub struct Emulated {
    arrays: BTreeMap<Address, Array>,
    launches: u64,
}

/// An array that only its pointer reaches. The kernels use that pointer, so that no reference to the array, and no box, may exist besides.
#[derive(Debug)]
struct Array(NonNull<[u128]>);

// Safety: an array has one owner, and all of its uses are calls of a device that is borrowed for them.
unsafe impl Send for Array {}
unsafe impl Sync for Array {}

impl Drop for Array {
    fn drop(&mut self) {
        // Safety: made by `Box::leak`, and dropped once.
        drop(unsafe { Box::from_raw(self.0.as_ptr()) });
    }
}

impl Emulated {
    /// The memory of `bytes` bytes at this address.
    fn memory(&self, at: Address, bytes: usize) -> Result<*mut u8, DeviceError> {
        let (first, array) = self.arrays.range(..=at).next_back().ok_or_else(|| unknown(at))?;
        let offset = (at - first) as usize;
        let room = array.0.len() * size_of::<u128>();
        if offset.checked_add(bytes).is_none_or(|end| end > room) {
            return Err(unknown(at));
        }
        Ok(array.0.as_ptr().cast::<u8>().wrapping_add(offset))
    }
}

impl Device for Emulated {
    fn name(&self) -> String {
        "emulated".to_owned()
    }

    fn allocate(&mut self, bytes: usize) -> Result<Address, DeviceError> {
        // A pattern that no kernel may read: NaN as a number.
        let array = Box::leak(vec![u128::MAX; bytes.div_ceil(16).max(1)].into_boxed_slice());
        let array = NonNull::from(array);
        let address = array.as_ptr().expose_provenance() as Address;
        self.arrays.insert(address, Array(array));
        Ok(address)
    }

    fn free(&mut self, array: Address) {
        self.arrays.remove(&array);
    }

    fn upload(&mut self, array: Address, bytes: &[MaybeUninit<u8>]) -> Result<(), DeviceError> {
        let memory = self.memory(array, bytes.len())?;
        // Safety: the array has so many bytes there, and nothing else uses it now.
        unsafe { std::ptr::copy_nonoverlapping(bytes.as_ptr(), memory.cast(), bytes.len()) };
        Ok(())
    }

    fn download(&mut self, array: Address, bytes: &mut [u8]) -> Result<(), DeviceError> {
        let memory = self.memory(array, bytes.len())?;
        // Safety: as above; what is read has been written as numbers without padding.
        unsafe { std::ptr::copy_nonoverlapping(memory, bytes.as_mut_ptr(), bytes.len()) };
        Ok(())
    }

    fn launch(
        &mut self,
        kernel: Kernel,
        threads: usize,
        arguments: Address,
        launch: Launch,
    ) -> Result<(), DeviceError> {
        if !self.arrays.contains_key(&arguments) {
            return Err(unknown(arguments));
        }
        self.launches += 1;
        // Blocks of 32 threads, as a device has; those of the last block that have nothing to do must do nothing.
        let threads = threads.next_multiple_of(32);
        for thread in shuffled(threads, self.launches) {
            // Safety: the arrays behind the arguments are those of this device, which the host has made as long as they say.
            unsafe { run(kernel, thread, arguments, launch)? };
        }
        Ok(())
    }
}

fn unknown(array: Address) -> DeviceError {
    DeviceError(format!("no array at {array:#x}"))
}

/// The numbers below `count` in another order for each `seed`: `first + k·step` modulo `count`, with a prime as step
/// that does not divide `count`.
fn shuffled(count: usize, seed: u64) -> impl Iterator<Item = usize> {
    const PRIMES: [usize; 3] = [1_000_003, 999_983, 1_299_709];
    let prime = PRIMES[seed as usize % PRIMES.len()];
    let step = if count.is_multiple_of(prime) { 1 } else { prime };
    let first = (seed as usize).wrapping_mul(0x9e37_79b9) % count.max(1);
    (0..count).map(move |k| (first + k * step) % count)
}

/// Run a thread of a kernel.
///
/// Safety: `arguments` are those of the kernel.
unsafe fn run(kernel: Kernel, thread: usize, arguments: Address, launch: Launch) -> Result<(), DeviceError> {
    let at = arguments as usize;
    match kernel {
        Kernel::Particles => unsafe { kernels::particles(thread, std::ptr::with_exposed_provenance(at), launch) },
        Kernel::Sums => unsafe { kernels::sums(thread, std::ptr::with_exposed_provenance(at), launch) },
        Kernel::Layout if thread < LAYOUT.len() => unsafe {
            kernels::layout(thread, std::ptr::with_exposed_provenance_mut(at));
        },
        Kernel::Layout => {}
        Kernel::Contacts(law) => {
            macro_rules! of_law {
                ($($key:ident: $Law:ident,)*) => {
                    match law {
                        $(stringify!($key) => {
                            type Arguments = ContactArrays<concordem_contact::law::$key::$Law>;
                            let arguments: *const Arguments = std::ptr::with_exposed_provenance(at);
                            unsafe { kernels::contacts(thread, arguments, launch) };
                        })*
                        _ => return Err(DeviceError(format!("there is no kernel for the law \"{law}\""))),
                    }
                };
            }
            concordem_contact::for_each_law!(of_law);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Parts of arrays are written and read where they lie, by the host and by a kernel in turns; nothing beyond an array is.
    #[test]
    fn arrays_are_reached_by_their_addresses_alone() {
        let mut device = Emulated::default();
        let size = size_of_val(&LAYOUT);
        let [layout, other] = [device.allocate(size).unwrap(), device.allocate(24).unwrap()];
        let bytes: Vec<MaybeUninit<u8>> = (0..16).map(MaybeUninit::new).collect();
        for _ in 0..2 {
            device.upload(layout + 8, &bytes).unwrap();
            device.launch(Kernel::Layout, LAYOUT.len(), layout, Launch::default()).unwrap();
            device.upload(other + 16, &bytes).unwrap();
            let mut found = [0_u64; LAYOUT.len()];
            device.download(layout, bytemuck::cast_slice_mut(&mut found)).unwrap();
            assert_eq!(found, LAYOUT);
            let mut part = [0_u8; 4];
            device.download(other + 20, &mut part).unwrap();
            assert_eq!(part, [4, 5, 6, 7]);
        }
        // Rooms are whole numbers of 16 bytes.
        assert!(device.upload(other + 17, &bytes).is_err());
        assert!(device.download(layout, &mut vec![0; size.next_multiple_of(16) + 1]).is_err());
        assert!(device.download(layout.min(other) - 1, &mut [0]).is_err());
        device.free(layout);
        assert!(device.launch(Kernel::Layout, LAYOUT.len(), layout, Launch::default()).is_err());
    }

    #[test]
    fn each_thread_runs_once() {
        for (count, seed) in [(32, 1), (96, 7), (4096, 123)] {
            let mut order: Vec<usize> = shuffled(count, seed).collect();
            assert!(order.windows(2).any(|pair| pair[1] < pair[0]), "{count}: in order");
            order.sort_unstable();
            assert_eq!(order, (0..count).collect::<Vec<_>>());
        }
    }
}
