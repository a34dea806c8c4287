//! From a scenario file to something that runs: the schema and its checks, assembly, and the schedule of a run.

pub mod assembly;
pub mod schedule;
pub mod schema;
