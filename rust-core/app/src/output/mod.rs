//! What leaves the program: result files, checkpoints, tables, and the report.
//!
//! * [`checkpoint`]: the complete state in one file, from which a run goes on bit for bit.
//! * [`run_files`]: the files of a run; whatever happens to the process, the finished result equals that of an
//!   undisturbed run.
//! * [`result`]: reading a finished result.
//! * [`sealed`]: how every file is written (whole or not at all) and checked before it is read.
//! * [`csv`]: series as comma-separated text. [`report`]: the HTML page.
//! * [`mod@sweep`]: the files of a sweep.

pub mod checkpoint;
pub mod csv;
pub mod error;
pub mod hash;
mod hdf;
mod merge;
pub mod provenance;
pub mod report;
pub mod result;
pub mod run_files;
pub mod sealed;
pub mod sweep;

pub use concordem_scenario::assembly::sphere_pack;
pub use error::OutputError;
pub use result::ResultFile;
pub use run_files::{OperatorTable, Resumed, RunFiles, RunHeader, SeriesColumn, Snapshot, SnapshotField};
