//! The part of an array that is kept while the whole of it is passed by.

use std::io;

/// The first elements along each axis of an array.
#[derive(Clone, Debug)]
pub struct Part {
    /// Length of each axis of what is kept.
    pub kept: Vec<usize>,
    /// Length of each axis in the file.
    whole: Vec<usize>,
    /// The axes, that along which the file's elements are neighbours first.
    fastest_first: Vec<usize>,
}

impl Part {
    /// At most `most[axis]` elements along each axis of an array of this shape.
    pub fn new(shape: &[usize], most: &[usize], is_fortran: bool) -> Self {
        let kept = |axis: usize| shape[axis].min(most.get(axis).copied().unwrap_or(usize::MAX));
        let mut fastest_first: Vec<usize> = (0..shape.len()).collect();
        if !is_fortran {
            fastest_first.reverse();
        }
        Self {
            kept: (0..shape.len()).map(kept).collect(),
            whole: shape.to_vec(),
            fastest_first,
        }
    }

    /// Number of elements that are kept.
    pub fn count(&self) -> usize {
        self.kept.iter().product()
    }

    /// Hands the kept ones of all elements, which come in the file's order, to `visit`, each with its
    /// index.
    pub fn visit<S>(
        &self,
        mut next: impl FnMut() -> Option<io::Result<S>>,
        mut visit: impl FnMut(&[usize], S),
    ) -> io::Result<()> {
        let mut index = vec![0; self.whole.len()];
        if self.whole.contains(&0) {
            return Ok(());
        }
        loop {
            let value = next().ok_or(io::ErrorKind::UnexpectedEof)??;
            if index
                .iter()
                .zip(&self.kept)
                .all(|(place, kept)| place < kept)
            {
                visit(&index, value);
            }
            let mut is_last = true;
            for &axis in &self.fastest_first {
                index[axis] += 1;
                if index[axis] < self.whole[axis] {
                    is_last = false;
                    break;
                }
                index[axis] = 0;
            }
            if is_last {
                return Ok(());
            }
        }
    }
}
