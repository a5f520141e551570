//! Checks of what callers hand in, shared by all entry points.

use crate::RenderError;

/// `values` has `expected` numbers, all finite.
pub(crate) fn floats(
    what: &'static str,
    values: &[f32],
    expected: usize,
) -> Result<(), RenderError> {
    length(what, values.len(), expected)?;
    finite(what, values)
}

/// All of `values` are finite.
pub(crate) fn finite(what: &'static str, values: &[f32]) -> Result<(), RenderError> {
    match values.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(index) => Err(RenderError::NonFinite {
            what,
            index,
            value: values[index],
        }),
    }
}

/// An array of `got` values has `expected`.
pub(crate) fn length(what: &'static str, got: usize, expected: usize) -> Result<(), RenderError> {
    if got == expected {
        Ok(())
    } else {
        Err(RenderError::WrongLength {
            what,
            expected,
            got,
        })
    }
}
