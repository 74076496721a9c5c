//! Selects a shard of a light pass: every n-th of its numbered tasks. Tasks depend on their numbers alone, so the
//! shards add up to the whole.

/// One shard of several.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShardIndex {
    /// Below `count`.
    index: u32,
    count: u32,
    /// Added to all task numbers, so that passes of few tasks do not all begin with the same shard.
    shift: u64,
}

impl ShardIndex {
    /// Shard `number` of `count`, from 1 on; `None` if there is no such shard.
    pub fn new(number: u32, count: u32) -> Option<Self> {
        (1..=count).contains(&number).then(|| Self {
            index: number - 1,
            count,
            shift: 0,
        })
    }

    /// From 1 on.
    pub fn number(self) -> u32 {
        self.index + 1
    }

    pub fn count(self) -> u32 {
        self.count
    }

    /// The same shard, with all task numbers shifted.
    #[must_use]
    pub fn shifted(self, by: u64) -> Self {
        Self {
            shift: self.shift.wrapping_add(by),
            ..self
        }
    }

    /// Whether a task belongs to the shard.
    pub fn has(self, piece: u64) -> bool {
        piece.wrapping_add(self.shift) % u64::from(self.count) == u64::from(self.index)
    }

    /// Upper bound on the shard's number of tasks, out of so many in all.
    pub fn of(self, pieces: u64) -> u64 {
        pieces.div_ceil(u64::from(self.count))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_piece_belongs_to_one_share() {
        for count in 1..9 {
            for shift in [0, 1, 7] {
                for piece in 0..40 {
                    let shares = (1..=count).filter_map(|number| ShardIndex::new(number, count));
                    let owners = shares.filter(|share| share.shifted(shift).has(piece)).count();
                    assert_eq!(owners, 1, "piece {piece} of {count} shares");
                }
            }
        }
        assert_eq!(ShardIndex::new(0, 3), None);
        assert_eq!(ShardIndex::new(4, 3), None);
        assert_eq!(ShardIndex::new(1, 0), None);
    }
}
