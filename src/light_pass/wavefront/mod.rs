//! The wavefront estimator: neighbouring rays span pieces of the wavefront, whose flux is laid out on the receivers.

pub mod coverage;
