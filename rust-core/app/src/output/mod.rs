//! Files: results, checkpoints, and tables.
//!
//! * [`checkpoint`]: the complete state in one file; a resumed run continues bit for bit.
//! * [`crack_faces`]: the surfaces of cracks in a result.
//! * [`run_files`]: the files of a run; the finished result equals that of an uninterrupted run, whatever happens to the
//!   process.
//! * [`result`]: reading a finished result.
//! * [`sealed`]: writes every file completely or not at all, and checks it before reading.
//! * [`csv`]: series as comma-separated text.
//! * [`mod@sweep`]: the files of a sweep.

pub mod checkpoint;
pub mod crack_faces;
pub mod csv;
pub mod error;
mod events;
pub mod export;
pub(crate) mod frames;
pub mod hash;
mod hdf;
mod particles_at;
mod read_back;
pub mod result;
pub mod run_files;
pub mod sealed;
mod slice;
pub(crate) mod stream;
pub mod sweep;
mod vtk;

pub use concordem_files::sphere_pack;
pub use error::OutputError;
pub use particles_at::ParticlesAt;
pub use result::ResultFile;
pub use run_files::{
    BondSnapshot, OperatorTable, Resumed, RunFiles, RunHeader, SeriesColumn, Snapshot, SnapshotField, SoFar,
    StoredSnapshot,
};
pub use slice::{SliceAt, SliceFrame};
