//! The kernels in a loop on the processor, for tests of everything but the calls of a driver.

#![allow(unsafe_code)]

use std::collections::BTreeMap;

use super::{Address, Device, DeviceError, Kernel};
use crate::arguments::{ContactArrays, LAYOUT, Launch};
use crate::kernels;

/// A device whose arrays lie in the memory of the process. Its threads run one after another, in a shuffled order.
#[derive(Debug, Default)]
pub struct Emulated {
    arrays: BTreeMap<Address, Box<[u128]>>,
    launches: u64,
}

impl Device for Emulated {
    fn name(&self) -> String {
        "emulated".to_owned()
    }

    fn allocate(&mut self, bytes: usize) -> Result<Address, DeviceError> {
        // A pattern that no kernel may read: NaN as a number.
        let mut array = vec![u128::MAX; bytes.div_ceil(16).max(1)].into_boxed_slice();
        let address = array.as_mut_ptr().expose_provenance() as Address;
        self.arrays.insert(address, array);
        Ok(address)
    }

    fn free(&mut self, array: Address) {
        self.arrays.remove(&array);
    }

    fn upload(&mut self, array: Address, bytes: &[u8]) -> Result<(), DeviceError> {
        let (first, of) = self.arrays.range_mut(..=array).next_back().ok_or_else(|| unknown(array))?;
        let of = bytemuck::cast_slice_mut::<u128, u8>(of).get_mut((array - first) as usize..);
        of.and_then(|of| of.get_mut(..bytes.len())).ok_or_else(|| unknown(array))?.copy_from_slice(bytes);
        Ok(())
    }

    fn download(&mut self, array: Address, bytes: &mut [u8]) -> Result<(), DeviceError> {
        let (first, of) = self.arrays.range(..=array).next_back().ok_or_else(|| unknown(array))?;
        let of = bytemuck::cast_slice::<u128, u8>(of).get((array - first) as usize..);
        bytes.copy_from_slice(of.and_then(|of| of.get(..bytes.len())).ok_or_else(|| unknown(array))?);
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
