//! The `nephroid` program.
fn main() {}
