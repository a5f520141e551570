//! Methods side by side: what `dynaskin evaluate --report` shows.
//!
//! Every method is a [`Contestant`] and sees the same held-out clips through the runtime's own
//! features and networks. Nothing here is special to a method, so any bundle of the contract can
//! take part.

mod bodies;
mod endurance;
mod floors;
mod groups;
mod reconstruction;
mod resonance;
mod showcase;
mod signals;
mod spectra;
mod splits;

use dynaskin_body::BodyModel;
use dynaskin_motion::Clip;
use dynaskin_runtime::features::FeatureKind;
use dynaskin_sim::{ClipData, SimSettings};

use crate::player::Player;
use dynaskin_train::{DataSet, TrainError, features_of};

pub use bodies::{BODIES, BodyAmplitudes, amplitudes_of_bodies};
pub use endurance::{Drift, Settling, drift, settling};
pub use floors::{FLOOR_STRIDE, Floor, FloorSet, Floors, floors};
pub use groups::{group_names, signal_names};
pub use reconstruction::Reach;
pub use resonance::{
    HIGHEST_HZ, Resonance, ResonanceTest, Shift, resonances, shifts, tests as resonance_tests,
};
pub use showcase::{ClipCurves, Snapshot, curves, snapshot};
pub use spectra::{BANDS_HZ, Lag, Spectrum};
pub use splits::{ClipErrors, Comparison, SetComparison, Spread, compare};

/// One method of a comparison.
pub struct Contestant {
    /// Its name in tables.
    pub label: String,
    /// Its networks; none for the body that plain skinning gives, without any offset.
    pub player: Option<Player>,
}

impl Contestant {
    /// No soft tissue at all: offset zero.
    pub fn still() -> Self {
        Self {
            label: "static".into(),
            player: None,
        }
    }

    /// What its networks take as input; none without networks.
    pub fn feature_kind(&self) -> Option<FeatureKind> {
        self.player.as_ref().map(Player::feature_kind)
    }

    /// Offsets `[frame][slot][xyz]` in metres that it predicts for a motion of a body with shape and
    /// materials of `clip`, from the state at rest.
    ///
    /// # Errors
    /// [`TrainError::Runtime`].
    pub fn predict(
        &mut self,
        model: &BodyModel,
        motion: &Clip,
        clip: &ClipData,
    ) -> Result<Vec<f32>, TrainError> {
        let Some(player) = &mut self.player else {
            return Ok(vec![0.0; motion.frames.len() * 3 * clip.vertices.len()]);
        };
        let features = features_of(player.feature_kind(), model, motion, clip)?;
        player.play(&features)
    }
}

/// The simulator's settings that a data set was made with, without the materials of its clips; the
/// usual ones for a data set that was not simulated.
pub fn simulator_settings(data_set: &DataSet, model: &BodyModel) -> SimSettings {
    let stored: Option<SimSettings> = serde_json::from_str(&data_set.sim_json)
        .ok()
        .and_then(|mut sim: serde_json::Value| sim.get_mut("settings").map(std::mem::take))
        .and_then(|settings| serde_json::from_value(settings).ok());
    stored.unwrap_or_else(|| SimSettings::for_body(model))
}

/// Mean of what an iterator gives; 0 where it gives nothing.
fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
    sum / f64::from(count.max(1))
}
