//! Reading and writing files: bounded reads, whole or not at all writes. The only place that opens files.

mod read;
mod write;

pub use read::read_file;
pub use write::write_atomically;
