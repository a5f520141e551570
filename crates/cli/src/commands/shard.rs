//! One of several parts of a piece of work, for running on several machines.

use std::ops::Range;
use std::str::FromStr;

/// Part I of N, from 1.
#[derive(Clone, Copy, Debug)]
pub struct Shard {
    pub index: usize,
    count: usize,
}

impl Shard {
    /// Every N-th of a list, which gives parts of equal length where it is sorted by length.
    pub fn every_nth<T>(&self, all: &mut Vec<T>) {
        let mut index = 0;
        all.retain(|_| {
            index += 1;
            index % self.count == self.index % self.count
        });
    }

    /// Neighbours in a list of `length`.
    pub fn neighbours(&self, length: usize) -> Range<usize> {
        // No overflow, however many parts were asked for.
        let at = |index: usize| (index as u128 * length as u128 / self.count as u128) as usize;
        at(self.index - 1)..at(self.index)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/').and_then(|(index, count)| {
            let (index, count) = (index.parse().ok()?, count.parse().ok()?);
            (1..=count)
                .contains(&index)
                .then_some(Self { index, count })
        });
        parts.ok_or_else(|| "expected I/N with I from 1 to N, such as 2/8".to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_the_whole_and_share_nothing() {
        for (length, count) in [(7, 3), (2, 5), (0, 2), (10, 1)] {
            let parts = (1..=count).map(|i| format!("{i}/{count}").parse::<Shard>().unwrap());
            let (mut nths, mut neighbours) = (Vec::new(), Vec::new());
            for part in parts {
                let mut all: Vec<usize> = (0..length).collect();
                part.every_nth(&mut all);
                nths.extend(all);
                neighbours.extend(part.neighbours(length));
            }
            nths.sort_unstable();
            assert_eq!(nths, (0..length).collect::<Vec<_>>());
            assert_eq!(neighbours, nths);
        }
        for text in ["0/2", "3/2", "1", "a/b", "1/0"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
