//! Settings of the search for springs.

use dynaskin_runtime::features::FeatureKind;
use dynaskin_train::TrainError;
use serde::{Deserialize, Serialize};

/// What the springs are driven by.
pub(super) const KIND: FeatureKind = FeatureKind::Inertial;

/// Where the springs of each region are looked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SpringBonesConfig {
    /// Lowest frequency of the damped swing, in hertz.
    pub lowest_hz: f64,
    /// Highest one.
    pub highest_hz: f64,
    /// Lowest damping ratio (1 = critical).
    pub lowest_damping: f64,
    /// Highest one, below 1.
    pub highest_damping: f64,
    /// Points along each axis of the first grid.
    pub grid: usize,
    /// How often the grid is refined about the best point, to half its pitch each time.
    pub refinements: usize,
}

impl Default for SpringBonesConfig {
    fn default() -> Self {
        Self {
            lowest_hz: 0.8,
            highest_hz: 20.0,
            lowest_damping: 0.03,
            highest_damping: 0.97,
            grid: 16,
            refinements: 6,
        }
    }
}

impl SpringBonesConfig {
    /// Whether every setting is in its range.
    ///
    /// # Errors
    /// [`TrainError::Config`], naming the first that is not.
    pub fn check(&self) -> Result<(), TrainError> {
        let pairs = [
            ("lowest_hz", self.lowest_hz, self.highest_hz, 29.0),
            (
                "lowest_damping",
                self.lowest_damping,
                self.highest_damping,
                0.999,
            ),
        ];
        for (setting, low, high, most) in pairs {
            if !(low > 0.0 && low <= high && high <= most) {
                return Err(TrainError::Config {
                    setting,
                    got: format!("{low} (and the highest {high})"),
                    expected: format!("above 0, at most the highest, and that at most {most}"),
                });
            }
        }
        if !(2..=200).contains(&self.grid) {
            return Err(TrainError::Config {
                setting: "grid",
                got: self.grid.to_string(),
                expected: "2 to 200".into(),
            });
        }
        Ok(())
    }
}
