//! Hard cases: each has a law that must hold.

#[path = "stability/catalogue.rs"]
mod catalogue;
#[path = "support/chain_laws.rs"]
#[allow(dead_code)]
mod chain_laws;
#[path = "stability/chains.rs"]
mod chains;
#[path = "stability/extreme_lamps.rs"]
mod extreme_lamps;
#[path = "stability/hidden_cells.rs"]
mod hidden_cells;
#[path = "stability/intersection.rs"]
mod intersection;
#[path = "stability/item_buffer.rs"]
mod item_buffer;
#[path = "stability/sums.rs"]
mod sums;
#[path = "stability/surroundings.rs"]
mod surroundings;
#[path = "stability/wavefront.rs"]
mod wavefront;
