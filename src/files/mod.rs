//! Reading and writing files: bounded reads, whole or not at all writes. The only place that opens files.

pub mod cache;
mod folder;
mod part;
mod png;
mod read;
mod slug;
mod staged;
mod write;

pub use folder::{OutputFolder, check_output_file, remove_file};
pub use part::{file_bytes, read_part};
pub use png::png;
pub use read::read_file;
pub use slug::slug;
pub use staged::StagedFolder;
pub use write::{to_json, write_atomically};
