//! An array as it lies in the file, read by index.

/// An array of numbers with its shape; Fortran and C order look alike through [`Array::at`].
#[derive(Clone, Debug, PartialEq)]
pub struct Array<T> {
    /// Length of each axis.
    pub shape: Vec<usize>,
    /// Elements between neighbours along each axis.
    pub(crate) strides: Vec<usize>,
    /// The elements in the file's order.
    pub(crate) values: Vec<T>,
}

impl<T: Copy> Array<T> {
    /// The element at `index`, one number for each axis.
    ///
    /// # Panics
    /// If an index is beyond its axis.
    pub fn at(&self, index: &[usize]) -> T {
        let offset: usize = index.iter().zip(&self.strides).map(|(i, s)| i * s).sum();
        self.values[offset]
    }

    /// The elements in the file's order: for searches that need no index.
    pub fn values(&self) -> &[T] {
        &self.values
    }

    /// The elements with the last axis running fastest.
    pub fn into_c_order(self) -> Vec<T> {
        if self.strides == strides(self.shape.iter().rev(), true) {
            return self.values;
        }
        let mut index = vec![0; self.shape.len()];
        (0..self.values.len())
            .map(|_| {
                let value = self.at(&index);
                for axis in (0..index.len()).rev() {
                    index[axis] += 1;
                    if index[axis] < self.shape[axis] {
                        break;
                    }
                    index[axis] = 0;
                }
                value
            })
            .collect()
    }
}

/// Strides of axes given fastest first; `reverse` puts the slowest first again.
pub(crate) fn strides<'a>(
    fastest_first: impl Iterator<Item = &'a usize>,
    reverse: bool,
) -> Vec<usize> {
    let mut strides: Vec<usize> = fastest_first
        .scan(1, |stride, length| {
            let own = *stride;
            *stride *= length;
            Some(own)
        })
        .collect();
    if reverse {
        strides.reverse();
    }
    strides
}
