//! Hard cases: each row of the table is a scene with a law that must hold. `NEPHROID_LONG=1` tries more.

mod charts;
mod contacts;
mod files;
mod glass;
mod invariance;
mod item_buffer;
mod lights;
mod meshes;
mod mirrors;
mod numbers;
mod openings;
mod random;
mod rays;
mod references;

use support::laws::hold;

/// One test for each group of cases.
macro_rules! groups {
    ($($group:ident)*) => {
        $(#[test]
        fn $group() {
            hold(stringify!($group), $group::fill);
        })*
    };
}

groups! { charts contacts files glass invariance item_buffer lights meshes mirrors numbers openings random rays references }
