//! Union-find.

use super::numbered;

/// Disjoint sets of the numbers below a count.
pub struct DisjointSets {
    /// Of each number; roots are their own.
    parents: Vec<u32>,
}

impl DisjointSets {
    /// Each number in a set of its own.
    pub fn new(count: usize) -> Self {
        Self {
            parents: (0..count as u32).collect(),
        }
    }

    /// Unites the sets of two numbers.
    pub fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a as u32), self.root(b as u32));
        self.parents[a.max(b) as usize] = a.min(b);
    }

    /// The set of each number; sets are counted in the order of their lowest numbers.
    pub fn sets(mut self) -> Vec<u32> {
        let roots: Vec<u32> = (0..self.parents.len() as u32)
            .map(|number| self.root(number))
            .collect();
        numbered(roots)
    }

    /// Items, one for each number, by set.
    pub fn grouped<T>(self, items: impl IntoIterator<Item = T>) -> Vec<Vec<T>> {
        let mut groups: Vec<Vec<T>> = Vec::new();
        for (item, set) in items.into_iter().zip(self.sets()) {
            let set = set as usize;
            if set == groups.len() {
                groups.push(Vec::new());
            }
            groups[set].push(item);
        }
        groups
    }

    /// The lowest number of a number's set.
    pub fn root(&mut self, mut number: u32) -> u32 {
        // Each step halves the path.
        while self.parents[number as usize] != number {
            let above = self.parents[self.parents[number as usize] as usize];
            self.parents[number as usize] = above;
            number = above;
        }
        number
    }
}
