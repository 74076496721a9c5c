//! The program under what systems and users do to it, and on graphics cards.

mod cache;
#[cfg(unix)]
mod faults;
#[cfg(feature = "gpu")]
mod render_path;
#[cfg(unix)]
mod signals;
mod study;
