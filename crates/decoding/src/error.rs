//! What can be wrong with a matrix or with the numbers of a body.

use thiserror::Error;

/// Why a matrix or numbers of a body were refused.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum DecodingError {
    /// An array has the wrong length.
    #[error("{what} has {got} values, expected {expected}")]
    WrongLength {
        /// Which array.
        what: &'static str,
        /// Its required number of values.
        expected: usize,
        /// Its number of values.
        got: usize,
    },
    /// An array holds NaN or an infinity.
    #[error("{what} holds {value} at index {index}; every number must be finite")]
    NonFinite {
        /// Which array.
        what: &'static str,
        /// Index of the first such value.
        index: usize,
        /// The value.
        value: f32,
    },
    /// A value lies outside its range.
    #[error("{what} is {value} at index {index}, expected {expected}")]
    OutOfRange {
        /// Which array.
        what: &'static str,
        /// Index in the array.
        index: usize,
        /// The value.
        value: u32,
        /// The range in words.
        expected: String,
    },
}

/// `values` has `expected` numbers, all finite.
pub(crate) fn floats(
    what: &'static str,
    values: &[f32],
    expected: usize,
) -> Result<(), DecodingError> {
    length(what, values.len(), expected)?;
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(index) => Err(DecodingError::NonFinite {
            what,
            index,
            value: values[index],
        }),
    }
}

/// An array of `got` values has `expected`.
pub(crate) fn length(what: &'static str, got: usize, expected: usize) -> Result<(), DecodingError> {
    if got == expected {
        return Ok(());
    }
    Err(DecodingError::WrongLength {
        what,
        expected,
        got,
    })
}
