//! What a test that fails leaves behind to look at.

/// Writes a file into the build folder's `evidence`, and says where it is.
pub fn keep_bytes(name: &str, bytes: &[u8]) -> String {
    let folder = crate::build_folder().join("evidence");
    std::fs::create_dir_all(&folder).expect("the build folder can be written");
    let path = folder.join(name);
    std::fs::write(&path, bytes).expect("the build folder can be written");
    format!("see {}", path.display())
}
