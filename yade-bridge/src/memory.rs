//! Reads and writes fields of many C++ objects at once, by address.
//!
//! Only this module accesses foreign memory in bulk. The caller (`concordem.yade`) passes addresses that it has just read from the
//! host's containers, and offsets that were found and checked by its `_layout.py`.

use numpy::{PyReadonlyArray1, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use concordem::prefetch::{AHEAD, prefetch};

use concordem_python::arrays::scalars;

/// Read a number at an address.
///
/// Safety: the address must point to mapped memory with a `T`.
#[inline(always)]
pub unsafe fn peek<T: Copy>(address: usize) -> T {
    unsafe { std::ptr::read_unaligned(address as *const T) }
}

/// Write a number to an address.
///
/// Safety: as [`peek`], and the memory must be writable.
#[inline(always)]
pub unsafe fn poke<T: Copy>(address: usize, value: T) {
    unsafe { std::ptr::write_unaligned(address as *mut T, value) }
}

/// Read fields of `N` numbers. Prefetches, because objects are scattered in memory.
fn collect<T: Copy, const N: usize>(addresses: &[u64], offset: usize, none: T) -> Vec<[T; N]> {
    let field = |(k, &address): (usize, &u64)| {
        if let Some(&next) = addresses.get(k + AHEAD) {
            prefetch((next as usize).wrapping_add(offset));
        }
        // Safety: see the module; a null address means no object.
        if address == 0 { [none; N] } else { unsafe { peek(address as usize + offset) } }
    };
    addresses.iter().enumerate().map(field).collect()
}

fn array<'py, T: numpy::Element + bytemuck::Pod>(
    py: Python<'py>,
    addresses: &[u64],
    offset: usize,
    components: usize,
    none: T,
) -> PyResult<Bound<'py, PyAny>> {
    fn of<'py, T: numpy::Element + bytemuck::Pod, const N: usize>(
        py: Python<'py>,
        addresses: &[u64],
        offset: usize,
        none: T,
    ) -> Bound<'py, PyAny>
    where
        [T; N]: bytemuck::Pod,
    {
        scalars(py, bytemuck::cast_slice::<[T; N], T>(&collect::<T, N>(addresses, offset, none))).into_any()
    }
    match components {
        1 => Ok(of::<T, 1>(py, addresses, offset, none)),
        2 => Ok(of::<T, 2>(py, addresses, offset, none)),
        3 => Ok(of::<T, 3>(py, addresses, offset, none)),
        4 => Ok(of::<T, 4>(py, addresses, offset, none)),
        5 => Ok(of::<T, 5>(py, addresses, offset, none)),
        6 => Ok(of::<T, 6>(py, addresses, offset, none)),
        7 => Ok(of::<T, 7>(py, addresses, offset, none)),
        8 => Ok(of::<T, 8>(py, addresses, offset, none)),
        9 => Ok(of::<T, 9>(py, addresses, offset, none)),
        10 => Ok(of::<T, 10>(py, addresses, offset, none)),
        11 => Ok(of::<T, 11>(py, addresses, offset, none)),
        other => Err(PyValueError::new_err(format!("components is {other}; give 1 to 11"))),
    }
}

/// Read the field at `offset` of all objects at `addresses`. Returns an array of shape (n,) or (n, components). For a null address,
/// reals are NaN and other numbers 0.
#[pyfunction]
#[pyo3(signature = (addresses, offset, kind="f64", components=1))]
fn memory_gather<'py>(
    py: Python<'py>,
    addresses: PyReadonlyArray1<'py, u64>,
    offset: usize,
    kind: &str,
    components: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let list = addresses.as_slice()?;
    let flat = match kind {
        "f64" => array(py, list, offset, components, f64::NAN)?,
        "i32" => array(py, list, offset, components, 0_i32)?,
        "u64" => array(py, list, offset, components, 0_u64)?,
        "u8" => array(py, list, offset, components, 0_u8)?,
        other => return Err(PyValueError::new_err(format!("kind is \"{other}\"; give f64, i32, u64, or u8"))),
    };
    if components == 1 { Ok(flat) } else { flat.call_method1("reshape", (list.len(), components)) }
}

/// Write rows of reals to the field at `offset` of all objects at `addresses`.
#[pyfunction]
fn memory_scatter(
    addresses: PyReadonlyArray1<'_, u64>,
    offset: usize,
    values: PyReadonlyArray1<'_, f64>,
) -> PyResult<()> {
    let (list, values) = (addresses.as_slice()?, values.as_slice()?);
    let components = if list.is_empty() { 0 } else { values.len() / list.len() };
    if components * list.len() != values.len() {
        let message = format!("{} numbers cannot be distributed evenly to {} objects", values.len(), addresses.len());
        return Err(PyValueError::new_err(message));
    }
    for (&address, row) in list.iter().zip(values.chunks_exact(components.max(1))) {
        for (k, &value) in row.iter().enumerate() {
            // Safety: see the module.
            unsafe { poke(address as usize + offset + 8 * k, value) };
        }
    }
    Ok(())
}

/// Write ints to the field at `offset` of all objects at `addresses`.
#[pyfunction]
fn memory_scatter_i32(
    addresses: PyReadonlyArray1<'_, u64>,
    offset: usize,
    values: PyReadonlyArray1<'_, i32>,
) -> PyResult<()> {
    let (list, values) = (addresses.as_slice()?, values.as_slice()?);
    if list.len() != values.len() {
        return Err(PyValueError::new_err(format!(
            "{} numbers for {} objects; give one per object",
            values.len(),
            list.len()
        )));
    }
    for (&address, &value) in list.iter().zip(values) {
        // Safety: see the module.
        unsafe { poke(address as usize + offset, value) };
    }
    Ok(())
}

/// Targets of a `std::vector<boost::shared_ptr<T>>` at `address`; 0 for empty pointers.
pub unsafe fn targets(address: usize) -> Vec<u64> {
    // Safety: guaranteed by the caller.
    let (begin, end): (usize, usize) = unsafe { (peek(address), peek(address + 8)) };
    (begin..end).step_by(16).map(|at| unsafe { peek::<u64>(at) }).collect()
}

/// Addresses of the objects in a vector of shared pointers.
#[pyfunction]
fn memory_targets(py: Python<'_>, address: usize) -> Bound<'_, PyAny> {
    // Safety: see the module.
    scalars(py, &unsafe { targets(address) }).into_any()
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(memory_gather, module)?)?;
    module.add_function(wrap_pyfunction!(memory_scatter, module)?)?;
    module.add_function(wrap_pyfunction!(memory_scatter_i32, module)?)?;
    module.add_function(wrap_pyfunction!(memory_targets, module)?)
}
