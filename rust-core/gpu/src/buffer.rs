//! Arrays on a device, with the type of their elements.

#![allow(unsafe_code)]

use std::marker::PhantomData;
use std::mem::MaybeUninit;

use bytemuck::Pod;

use crate::device::{Address, Device, DeviceError};

/// An array on a device; the device must free it.
#[derive(Debug)]
pub struct Buffer<T> {
    address: Option<Address>,
    length: usize,
    of: PhantomData<fn() -> T>,
}

impl<T> Default for Buffer<T> {
    fn default() -> Self {
        Self { address: None, length: 0, of: PhantomData }
    }
}

impl<T> Buffer<T> {
    /// Make room for `length` elements; the present ones are lost if this changes the length.
    pub fn resize(&mut self, device: &mut dyn Device, length: usize) -> Result<(), DeviceError> {
        if self.address.is_none() || self.length != length {
            self.free(device);
            self.address = Some(device.allocate(length * size_of::<T>())?);
            self.length = length;
        }
        Ok(())
    }

    /// Give the memory back.
    pub fn free(&mut self, device: &mut dyn Device) {
        if let Some(address) = self.address.take() {
            device.free(address);
        }
        self.length = 0;
    }

    /// Address of the array; 0 before it has room.
    pub fn address(&self) -> Address {
        self.address.unwrap_or(0)
    }

    /// Address of element `k`.
    fn address_at(&self, k: usize) -> Address {
        self.address() + (k * size_of::<T>()) as Address
    }

    /// Pointer on the device, for arguments.
    pub fn pointer(&self) -> *mut T {
        std::ptr::with_exposed_provenance_mut(self.address() as usize)
    }

    /// Pointer to element `k` on the device.
    pub fn pointer_at(&self, k: usize) -> *mut T {
        self.pointer().wrapping_add(k)
    }

    /// Replace the array by values that have no pointers to the host: coefficients, arguments.
    ///
    /// Safety is that of the kernels: they read `T` with the same layout ([`LAYOUT`](crate::arguments::LAYOUT)).
    pub fn put_raw(&mut self, device: &mut dyn Device, values: &[T]) -> Result<(), DeviceError> {
        self.resize(device, values.len())?;
        device.upload(self.address(), bytes_of(values))
    }
}

/// The memory of these values, of which bytes of padding have no value.
fn bytes_of<T>(values: &[T]) -> &[MaybeUninit<u8>] {
    // Safety: any memory may be read so; the lifetime is that of the values.
    unsafe { std::slice::from_raw_parts(values.as_ptr().cast(), size_of_val(values)) }
}

impl<T: Pod> Buffer<T> {
    /// Replace the array.
    pub fn put(&mut self, device: &mut dyn Device, values: &[T]) -> Result<(), DeviceError> {
        self.resize(device, values.len())?;
        device.upload(self.address(), bytes_of(values))
    }

    /// Replace the elements from `first` on.
    pub fn put_at(&self, device: &mut dyn Device, first: usize, values: &[T]) -> Result<(), DeviceError> {
        debug_assert!(first + values.len() <= self.length);
        device.upload(self.address_at(first), bytes_of(values))
    }

    /// Read the beginning of the array.
    pub fn get(&self, device: &mut dyn Device, values: &mut [T]) -> Result<(), DeviceError> {
        self.get_at(device, 0, values)
    }

    /// Read the elements from `first` on.
    pub fn get_at(&self, device: &mut dyn Device, first: usize, values: &mut [T]) -> Result<(), DeviceError> {
        debug_assert!(first + values.len() <= self.length);
        device.download(self.address_at(first), bytemuck::cast_slice_mut(values))
    }
}
