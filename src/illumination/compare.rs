//! How far two maps are apart.
