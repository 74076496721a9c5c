//! Exact sums of flux.
