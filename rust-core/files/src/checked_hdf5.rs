//! Safe use of the HDF5 library: the options for opening files, and reading of untrusted ones, whose sizes and types are checked before
//! the library allocates memory.

use hdf5::{Container, Dataset, H5Type};

/// Largest ratio of the size of a dataset to the size of its file: the best compression of `deflate`.
const MOST_COMPRESSION: u64 = 1032;

/// Options for opening HDF5 files: closing a file closes all its objects, and file locks are off.
///
/// Locks are not needed, because no other process uses an unfinished file and a finished one never changes. They fail
/// on some network file systems, and a child process that another thread starts while a file is open would keep the
/// lock.
///
/// HDF5 2 writes by default a layout that HDF5 1.6 cannot read, nor the readers here that do without the library: ask for the oldest one.
pub fn options() -> hdf5::FileBuilder {
    let mut options = hdf5::File::with_options();
    options.with_fapl(|fapl| {
        fapl.fclose_degree(hdf5::file::FileCloseDegree::Strong).file_locking(false).libver_earliest()
    });
    options
}

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
