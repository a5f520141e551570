//! One method of a comparison.

use dynaskin_body::BodyModel;
use dynaskin_motion::Clip;
use dynaskin_runtime::features::FeatureKind;
use dynaskin_sim::ClipData;
use dynaskin_train::{TrainError, features_of};

use crate::player::Player;

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

/// Mean of what an iterator gives; 0 where it gives nothing.
pub(super) fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
    sum / f64::from(count.max(1))
}
