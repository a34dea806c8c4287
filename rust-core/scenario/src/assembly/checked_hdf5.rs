//! Safe reading of untrusted HDF5 files: checks sizes, types, and strings before the HDF5 library allocates memory.

use hdf5::{Container, Dataset, H5Type};

/// Largest ratio of the size of a dataset to the size of its file: the best compression of `deflate`.
const MOST_COMPRESSION: u64 = 1032;

/// Number of values in a dataset that needs `bytes` of memory per value, in a file of `file_length` bytes.
///
/// # Errors
/// The dataset claims more values than the file can hold.
pub fn checked_len(dataset: &Dataset, bytes: usize, file_length: u64) -> Result<usize, String> {
    let space = dataset.space().map_err(|error| error.to_string())?;
    let shape = space.shape();
    let too_large = || format!("claims the shape {shape:?}, more than its file of {file_length} bytes can hold");
    if !space.is_simple() && !space.is_scalar() {
        return Err("has no values".to_owned());
    }
    let count = shape.iter().try_fold(1_usize, |product, &n| product.checked_mul(n)).ok_or_else(too_large)?;
    let total = (count as u64).checked_mul(bytes as u64).ok_or_else(too_large)?;
    if total > file_length.saturating_mul(MOST_COMPRESSION) {
        return Err(too_large());
    }
    Ok(count)
}

/// Values of a dataset, of exactly the type `T`.
///
/// # Errors
/// The dataset has another type, or claims more values than the file can hold.
pub fn values<T: H5Type>(dataset: &Dataset, file_length: u64) -> Result<Vec<T>, String> {
    let count = checked_len(dataset, size_of::<T>(), file_length)?;
    // The library fails to read an empty dataset.
    if count == 0 {
        return Ok(Vec::new());
    }
    let values = dataset.as_reader().no_convert().read_raw().map_err(|error| error.to_string())?;
    if values.len() == count { Ok(values) } else { Err("changed its size while it was read".to_owned()) }
}

/// The value of a scalar attribute or dataset.
///
/// # Errors
/// It is not a single number of exactly this type.
pub fn number<T: H5Type>(container: &Container) -> Result<T, String> {
    single(container)?;
    container.as_reader().no_convert().read_scalar().map_err(|error| error.to_string())
}

/// Refuses dataspaces without values, for which the library would leave memory uninitialized.
fn single(container: &Container) -> Result<(), String> {
    let space = container.space().map_err(|error| error.to_string())?;
    if space.is_scalar() { Ok(()) } else { Err(format!("has the shape {:?} where one value is needed", space.shape())) }
}
