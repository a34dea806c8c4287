//! What leaves the program: result files, checkpoints, tables, and the report.
//!
//! * [`checkpoint`]: the complete state in one file, from which a run goes on bit for bit.
//! * [`run_files`]: the files of a run; whatever happens to the process, the finished result equals that of an
//!   undisturbed run.
//! * [`result`]: reading a finished result.
//! * [`sealed`]: how every file is written (whole or not at all) and checked before it is read.
//! * [`csv`]: series as comma-separated text. [`report`]: the HTML page.

#[cfg(feature = "hdf5")]
pub mod checkpoint;
#[cfg(feature = "hdf5")]
pub mod csv;
#[cfg(feature = "hdf5")]
pub mod error;
#[cfg(feature = "hdf5")]
pub mod hash;
#[cfg(feature = "hdf5")]
mod hdf;
#[cfg(feature = "hdf5")]
mod merge;
#[cfg(feature = "hdf5")]
pub mod provenance;
#[cfg(feature = "hdf5")]
pub mod result;
#[cfg(feature = "hdf5")]
pub mod run_files;
#[cfg(feature = "hdf5")]
pub mod sealed;

#[cfg(feature = "hdf5")]
pub use error::OutputError;
#[cfg(feature = "hdf5")]
pub use result::ResultFile;
#[cfg(feature = "hdf5")]
pub use run_files::{Resumed, RunFiles, RunHeader, SeriesColumn, Snapshot, SnapshotField};
