//! Reads and writes fields of many C++ objects at once, by address.
//!
//! Only this module accesses foreign memory in bulk. The caller (`concordem.yade`) passes addresses that it has just read from the
//! host's containers, and offsets that were found and checked by its `_layout.py`.

use numpy::{PyArrayMethods, PyReadonlyArray1, PyUntypedArrayMethods};
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

/// Fields of an object, as numbers of bytes from its start and to the start of a row.
struct Fields {
    /// Words of eight bytes, for which no length must be asked.
    words: Vec<(usize, usize)>,
    /// Single bytes.
    bytes: Vec<(usize, usize)>,
    /// Bytes of a row.
    width: usize,
    /// First byte of an object, and the one behind the last.
    span: std::ops::Range<usize>,
}

impl Fields {
    /// From (offset, bytes) of each.
    fn new(fields: &[(usize, usize)]) -> Self {
        let (mut words, mut bytes, mut width) = (Vec::new(), Vec::new(), 0);
        for &(offset, size) in fields {
            let whole = size / 8 * 8;
            words.extend((0..whole).step_by(8).map(|n| (offset + n, width + n)));
            bytes.extend((whole..size).map(|n| (offset + n, width + n)));
            width += size;
        }
        let start = fields.iter().map(|field| field.0).min().unwrap_or(0);
        let end = fields.iter().map(|field| field.0 + field.1).max().unwrap_or(0);
        Self { words, bytes, width, span: start..end }
    }

    /// Prefetch an object that is read soon.
    fn prefetch(&self, address: Option<&u64>) {
        if let Some(&address) = address {
            self.span.clone().step_by(64).for_each(|offset| prefetch((address as usize).wrapping_add(offset)));
        }
    }

    /// Read an object.
    ///
    /// Safety: as [`peek`], for all fields.
    unsafe fn read(&self, address: u64, row: &mut [u8]) {
        for &(offset, at) in &self.words {
            let word: [u8; 8] = unsafe { peek(address as usize + offset) };
            row[at..at + 8].copy_from_slice(&word);
        }
        for &(offset, at) in &self.bytes {
            row[at] = unsafe { peek(address as usize + offset) };
        }
    }
}

/// Read several fields of all objects at `addresses`, each object once: (offset, bytes) of each. Returns the bytes, (n, sum of the widths).
#[pyfunction]
fn memory_rows<'py>(
    py: Python<'py>,
    addresses: PyReadonlyArray1<'py, u64>,
    fields: Vec<(usize, usize)>,
) -> PyResult<Bound<'py, PyAny>> {
    exchange(py, addresses.as_slice()?, &[], &Fields::new(&fields))
}

/// Write several fields of reals of all objects at `addresses`, each object once: (offset, rows) of each. Then read as [`memory_rows`].
#[pyfunction]
fn memory_exchange<'py>(
    py: Python<'py>,
    addresses: PyReadonlyArray1<'py, u64>,
    written: Vec<(usize, PyReadonlyArray1<'py, f64>)>,
    read: Vec<(usize, usize)>,
) -> PyResult<Bound<'py, PyAny>> {
    let list = addresses.as_slice()?;
    let mut columns = Vec::with_capacity(written.len());
    for (offset, values) in &written {
        let values = values.as_slice()?;
        let components = values.len().checked_div(list.len()).unwrap_or(0);
        if components * list.len() != values.len() {
            let message = format!("{} numbers cannot be distributed evenly to {} objects", values.len(), list.len());
            return Err(PyValueError::new_err(message));
        }
        columns.push((*offset, components, values));
    }
    exchange(py, list, &columns, &Fields::new(&read))
}

/// Write columns (offset, components, values), then read fields, object by object.
fn exchange<'py>(
    py: Python<'py>,
    list: &[u64],
    columns: &[(usize, usize, &[f64])],
    fields: &Fields,
) -> PyResult<Bound<'py, PyAny>> {
    let found = numpy::PyArray2::<u8>::zeros(py, [list.len(), fields.width], false);
    let mut access = found.readwrite();
    let rows = access.as_slice_mut()?;
    for (k, &address) in list.iter().enumerate() {
        fields.prefetch(list.get(k + AHEAD));
        for &(offset, components, values) in columns {
            for (n, &value) in values[k * components..(k + 1) * components].iter().enumerate() {
                // Safety: see the module.
                unsafe { poke(address as usize + offset + 8 * n, value) };
            }
        }
        // Safety: see the module.
        unsafe { fields.read(address, &mut rows[k * fields.width..(k + 1) * fields.width]) };
    }
    drop(access);
    Ok(found.into_any())
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
    write_each(addresses.as_slice()?, offset, values.as_slice()?)
}

/// Write flags to the field at `offset` of all objects at `addresses`.
#[pyfunction]
fn memory_scatter_u8(
    addresses: PyReadonlyArray1<'_, u64>,
    offset: usize,
    values: PyReadonlyArray1<'_, u8>,
) -> PyResult<()> {
    write_each(addresses.as_slice()?, offset, values.as_slice()?)
}

/// Write one value to each object of a list.
fn write_each<T: Copy>(list: &[u64], offset: usize, values: &[T]) -> PyResult<()> {
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
    module.add_function(wrap_pyfunction!(memory_rows, module)?)?;
    module.add_function(wrap_pyfunction!(memory_exchange, module)?)?;
    module.add_function(wrap_pyfunction!(memory_scatter, module)?)?;
    module.add_function(wrap_pyfunction!(memory_scatter_i32, module)?)?;
    module.add_function(wrap_pyfunction!(memory_scatter_u8, module)?)?;
    module.add_function(wrap_pyfunction!(memory_targets, module)?)
}
