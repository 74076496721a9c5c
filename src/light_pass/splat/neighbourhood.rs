//! Where the neighbours of each ray of a row landed.

use super::deposit::RowContext;
use super::footprint::Neighbours;
use super::lattice::TracedRow;
use crate::light_pass::path::Arrival;

/// Finds neighbours along a row, from its first arrival to its last.
pub(super) struct Neighbourhood<'a> {
    context: &'a RowContext<'a>,
    before: Cursor<'a>,
    after: Cursor<'a>,
}

/// Follows the columns of another row.
struct Cursor<'a> {
    row: Option<&'a TracedRow>,
    index: usize,
}

impl<'a> Cursor<'a> {
    fn new(row: Option<&'a TracedRow>) -> Self {
        Self { row, index: 0 }
    }

    /// The arrival in a column that took the same path as `like`; columns must not decrease from call to call.
    fn matching(&mut self, column: u32, like: &Arrival) -> Option<&'a Arrival> {
        let row = self.row?;
        while row.columns.get(self.index).is_some_and(|&c| c < column) {
            self.index += 1;
        }
        row.matching_from(self.index, column, like)
    }
}

impl<'a> Neighbourhood<'a> {
    pub(super) fn new(context: &'a RowContext<'a>) -> Self {
        Self {
            context,
            before: Cursor::new(context.before),
            after: Cursor::new(context.after),
        }
    }

    /// The neighbours of an arrival of the row; indices must not decrease from call to call.
    pub(super) fn of(&mut self, index: usize) -> Neighbours<'a> {
        let row = self.context.row;
        let (column, arrival) = (row.columns[index], &row.arrivals[index]);
        // Arrivals of one ray are consecutive.
        let first = first_of(row, index);
        let last = index + row.columns[index..].iter().take_while(|&&c| c == column).count();
        let left = (first > 0 && row.columns[first - 1] + 1 == column)
            .then(|| row.matching_from(first_of(row, first - 1), column - 1, arrival));
        Neighbours {
            across: [left.flatten(), row.matching_from(last, column + 1, arrival)],
            down: [
                self.before.matching(column, arrival),
                self.after.matching(column, arrival),
            ],
        }
    }
}

/// First arrival in the column of an arrival.
fn first_of(row: &TracedRow, index: usize) -> usize {
    let column = row.columns[index];
    index
        - row.columns[..index]
            .iter()
            .rev()
            .take_while(|&&c| c == column)
            .count()
}
