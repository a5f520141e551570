//! Ranges of settings.

use std::fmt::Display;
use std::ops::RangeInclusive;

use crate::TrainError;

/// Refuses the first of these settings that is not within its range, such as a NaN.
pub fn within<T: PartialOrd + Display>(
    settings: impl IntoIterator<Item = (&'static str, T, RangeInclusive<T>)>,
) -> Result<(), TrainError> {
    for (setting, got, range) in settings {
        if !range.contains(&got) {
            return Err(TrainError::Config {
                setting,
                got: got.to_string(),
                expected: format!("{} to {}", range.start(), range.end()),
            });
        }
    }
    Ok(())
}
