//! glTF loading.
