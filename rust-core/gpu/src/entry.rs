//! Entry points of the kernels on a device.

#![allow(unsafe_code)]

use core::arch::nvptx::{_block_dim_x, _block_idx_x, _thread_idx_x};

use crate::arguments::{ContactArrays, Launch, MotionArrays, SumArrays};
use crate::kernels;

/// Index of this thread in the grid.
fn thread() -> usize {
    // Safety: reads registers of the thread.
    let [thread, block, size] = unsafe { [_thread_idx_x(), _block_idx_x(), _block_dim_x()] };
    block as usize * size as usize + thread as usize
}

macro_rules! contacts_of_laws {
    ($($key:ident: $Law:ident,)*) => { $(
        mod $key {
            use super::*;

            /// Contacts of the law.
            ///
            /// # Safety
            /// The arrays are as long as [`ContactArrays`] says.
            #[unsafe(export_name = concat!("contacts_", stringify!($key)))]
            pub unsafe extern "ptx-kernel" fn contacts(
                arguments: *const ContactArrays<concordem_contact::law::$key::$Law>,
                step: u32,
                from: u32,
                sample: u32,
                serial: u32,
            ) {
                unsafe { kernels::contacts(thread(), arguments, Launch { step, from, sample, serial }) }
            }
        }
    )* };
}
concordem_contact::for_each_law!(contacts_of_laws);

/// Kick and drift.
///
/// # Safety
/// The arrays are as long as [`MotionArrays`] says.
#[unsafe(no_mangle)]
pub unsafe extern "ptx-kernel" fn particles(
    arguments: *const MotionArrays,
    step: u32,
    from: u32,
    sample: u32,
    serial: u32,
) {
    unsafe { kernels::particles(thread(), arguments, Launch { step, from, sample, serial }) }
}

/// Sums by tile.
///
/// # Safety
/// The arrays are as long as [`SumArrays`] says.
#[unsafe(no_mangle)]
pub unsafe extern "ptx-kernel" fn sums(arguments: *const SumArrays, step: u32, from: u32, sample: u32, serial: u32) {
    unsafe { kernels::sums(thread(), arguments, Launch { step, from, sample, serial }) }
}

/// Sizes with which the kernels were compiled.
///
/// # Safety
/// `sizes` has room for them.
#[unsafe(no_mangle)]
pub unsafe extern "ptx-kernel" fn layout(sizes: *mut u64, _step: u32, _from: u32, _sample: u32, _serial: u32) {
    unsafe { kernels::layout(thread(), sizes) }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    // Safety: ends the kernel with an error.
    unsafe { core::arch::nvptx::trap() }
}
