//! The part of an array that is kept while the whole of it is passed by.

use std::io;

/// The first elements along each axis of an array.
#[derive(Clone, Debug)]
pub struct Part {
    /// Length of each axis of what is kept.
    pub kept: Vec<usize>,
    /// Length in the file and length kept of the axis along which the file's elements are neighbours.
    run: (usize, usize),
    /// The same of all other axes, the next fastest first.
    outer: Vec<(usize, usize)>,
}

impl Part {
    /// At most `most[axis]` elements along each axis of an array of this shape.
    pub fn new(shape: &[usize], most: &[usize], is_fortran: bool) -> Self {
        let kept = |axis: usize| shape[axis].min(most.get(axis).copied().unwrap_or(usize::MAX));
        let mut axes: Vec<usize> = (0..shape.len()).collect();
        if !is_fortran {
            axes.reverse();
        }
        let mut lengths = axes.iter().map(|&axis| (shape[axis], kept(axis)));
        let run = lengths.next().unwrap_or((1, 1));
        Self {
            kept: (0..shape.len()).map(kept).collect(),
            run,
            outer: lengths.collect(),
        }
    }

    /// Takes the kept ones of all elements, which come in the file's order.
    pub fn take<S, T>(
        &self,
        mut next: impl FnMut() -> Option<io::Result<S>>,
        convert: impl Fn(S) -> T,
    ) -> io::Result<Vec<T>> {
        let count = |(whole, kept): (usize, usize), (length, part)| (whole * length, kept * part);
        let (runs, kept_runs) = self.outer.iter().copied().fold((1, 1), count);
        let (length, kept) = self.run;
        if length == 0 {
            return Ok(Vec::new());
        }
        let mut values = Vec::with_capacity(kept_runs * kept);
        let mut index = vec![0; self.outer.len()];
        for _ in 0..runs {
            let is_kept = index
                .iter()
                .zip(&self.outer)
                .all(|(place, (_, kept))| place < kept);
            for place in 0..length {
                let value = next().ok_or(io::ErrorKind::UnexpectedEof)??;
                if is_kept && place < kept {
                    values.push(convert(value));
                }
            }
            for (place, (length, _)) in index.iter_mut().zip(&self.outer) {
                *place += 1;
                if *place < *length {
                    break;
                }
                *place = 0;
            }
        }
        Ok(values)
    }
}
