//! Spring bones: what avatars on the web have today.
//!
//! One bone hangs from the skeleton in each soft region, one on either side where the region has
//! two. Its tip is a damped spring in the frame of the joint that carries it, driven by the proper
//! acceleration of the region's centre, and every vertex of the region follows the tip by its
//! region weight. Stiffness, damping and gain of each region are those that explain most of the
//! training set's offsets, in the sense of least squares; they know nothing of body shape, because a
//! spring bone has no input for it.

mod export;
mod rig;
mod tuning;

use dynaskin_runtime::features::FeatureKind;
use serde::{Deserialize, Serialize};
use serde_json::json;

use dynaskin_train::{
    Networks, Set, Tissue, TrainError, TrainingInput, features_of, motion_of, offsets_of,
};
use rig::Rig;
use tuning::{Recording, Spring, tune};

const KIND: FeatureKind = FeatureKind::Inertial;

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

/// Tunes the springs on the training clips of the usual tissue. `progress` is told the number of
/// clips read so far and in all.
///
/// # Errors
/// [`TrainError::Config`], [`TrainError::EmptySplit`], and what reading a clip can give.
pub fn train_spring_bones(
    input: TrainingInput<'_>,
    config: &SpringBonesConfig,
    mut progress: impl FnMut(usize, usize),
) -> Result<Networks, TrainError> {
    config.check()?;
    input.require(&[Set::Training], KIND)?;
    let rig = Rig::of_body(input.body, &input.data_set.vertices)?;
    let clips = || input.data_set.of_set(Set::Training, Tissue::known_to(KIND));
    let all = clips().count();
    let mut recordings = Vec::with_capacity(all);
    for (index, entry) in clips().enumerate() {
        let clip = input.data_set.read(entry)?;
        let features = features_of(KIND, input.body, &motion_of(&clip), &clip)?;
        recordings.push(Recording {
            drive_m_s2: rig.drive(&features),
            target_m: rig.follow(&offsets_of(&clip)),
        });
        progress(index + 1, all);
    }
    let springs: Vec<Spring> = rig
        .regions()
        .map(|(region, bones)| Spring {
            region: region.name(),
            ..tune(&recordings, &bones, &rig, config)
        })
        .collect();
    let per_bone = rig.per_bone(&springs);
    Ok(Networks {
        feature_kind: KIND,
        predictor_onnx: export::predictor_onnx(&rig, &per_bone)?,
        decoder_onnx: export::decoder_onnx(&rig)?,
        latent_count: rig.axes(),
        parameters: 3 * springs.len(),
        description: format!(
            "Spring bones: {} damped springs, one in each soft region or one on either side, driven \
             by the proper acceleration of the region's centre; vertices follow by region weight. \
             Stiffness, damping and gain of each region by least squares over the training set.",
            rig.bone_count()
        ),
        config: json!({ "search": config, "springs": springs }),
        best_epoch: 1,
    })
}
