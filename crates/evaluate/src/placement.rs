//! Plays held-out clips elsewhere, to test whether a model still works after walking away or turning.
//!
//! Soft tissue does not depend on the position or heading of the body: offsets in the rest pose
//! do not change. A network with the root's translation and rotation as input has to learn this;
//! DSNet's input (`pose-shape`) and Casas & Otaduy's (`pose-window`) contain both.

use std::f64::consts::{FRAC_PI_2, PI};

use dynaskin_body::{BodyModel, Joint};
use dynaskin_motion::Clip;
use glam::{DQuat, DVec3};
use serde::{Deserialize, Serialize};

use crate::player::Player;
use crate::report::soft_slots;
use dynaskin_train::{ClipEntry, DataSet, TrainError, features_of, motion_of, offsets_of};

/// Where a motion is played.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Placement {
    /// How far it is moved along x, sideways for a body that faces +z.
    pub shift_m: f64,
    /// How far it is turned about the vertical line through where it begins, in radians.
    pub turn_rad: f64,
}

impl Placement {
    /// As it is; moved by 3 m and by 10 m; turned by 90° and by 180°.
    pub const ALL: [Self; 5] = [
        Self::new(0.0, 0.0),
        Self::new(3.0, 0.0),
        Self::new(10.0, 0.0),
        Self::new(0.0, FRAC_PI_2),
        Self::new(0.0, PI),
    ];

    const fn new(shift_m: f64, turn_rad: f64) -> Self {
        Self { shift_m, turn_rad }
    }

    /// `as it is`, `moved by 3 m`, `turned by 90°`, and both together.
    pub fn label(self) -> String {
        let moved = format!("moved by {} m", self.shift_m);
        let turned = format!("turned by {:.0}°", self.turn_rad.to_degrees());
        match (self.shift_m != 0.0, self.turn_rad != 0.0) {
            (false, false) => "as it is".into(),
            (true, false) => moved,
            (false, true) => turned,
            (true, true) => format!("{moved} and {turned}"),
        }
    }

    /// `motion` played there.
    pub fn apply(self, motion: &Clip) -> Clip {
        let mut placed = motion.clone();
        if self.shift_m == 0.0 && self.turn_rad == 0.0 {
            // To the last digit.
            return placed;
        }
        let turn = DQuat::from_rotation_y(self.turn_rad);
        let start = motion.frames.first().map(|pose| pose.root_translation_m);
        let start = start.unwrap_or_default();
        for pose in &mut placed.frames {
            let from_start = turn * (pose.root_translation_m - start);
            pose.root_translation_m = start + from_start + DVec3::X * self.shift_m;
            let root = &mut pose.parent_from_joint[Joint::Pelvis as usize];
            *root = (turn * *root).normalize();
        }
        placed
    }
}

/// Errors over the soft vertices and all frames of the clips that were played at one place.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlacementErrors {
    /// The place.
    pub placement: Placement,
    /// Mean distance of predicted and true vertices in millimetres.
    pub error_mm: f64,
    /// The same with no offsets.
    pub static_mm: f64,
    /// Error over static.
    pub ratio: f64,
}

/// Plays each of `clips` at each of `placements`. `progress` is told the clips done and in all.
///
/// # Errors
/// [`TrainError::Runtime`] where a pose is invalid or a network fails, and what reading a clip can give.
pub fn evaluate_placements<'a>(
    player: &mut Player,
    data_set: &DataSet,
    model: &BodyModel,
    clips: impl ExactSizeIterator<Item = &'a ClipEntry>,
    placements: &[Placement],
    mut progress: impl FnMut(usize, usize),
) -> Result<Vec<PlacementErrors>, TrainError> {
    let slots = soft_slots(model, &data_set.vertices);
    let all = clips.len();
    let mut errors_m = vec![0.0f64; placements.len()];
    let (mut static_m, mut count) = (0.0f64, 0usize);
    for (done, entry) in clips.enumerate() {
        let clip = data_set.read(entry)?;
        let (motion, truth) = (motion_of(&clip), offsets_of(&clip));
        static_m += sum_of_distances(&truth, None, &slots, data_set.vertices.len());
        count += clip.frame_count() * slots.len();
        for (placement, error_m) in placements.iter().zip(&mut errors_m) {
            let placed = placement.apply(&motion);
            let features = features_of(player.feature_kind(), model, &placed, &clip)?;
            let predicted = player.play(&features)?;
            *error_m += sum_of_distances(&truth, Some(&predicted), &slots, data_set.vertices.len());
        }
        progress(done + 1, all);
    }
    let mean_mm = |sum_m: f64| 1000.0 * sum_m / count.max(1) as f64;
    let errors = placements.iter().zip(errors_m);
    Ok(errors
        .map(|(placement, error_m)| PlacementErrors {
            placement: *placement,
            error_mm: mean_mm(error_m),
            static_mm: mean_mm(static_m),
            ratio: error_m / static_m.max(f64::MIN_POSITIVE),
        })
        .collect())
}

/// Over all frames and the vertices `slots`; from zero where there is no `other`.
fn sum_of_distances(truth: &[f32], other: Option<&[f32]>, slots: &[usize], vertices: usize) -> f64 {
    let mut sum = 0.0;
    for (frame, truth) in truth.chunks_exact(3 * vertices).enumerate() {
        let other = other.map(|other| &other[frame * 3 * vertices..]);
        for slot in slots {
            let square: f32 = (3 * slot..3 * slot + 3)
                .map(|index| (truth[index] - other.map_or(0.0, |other| other[index])).powi(2))
                .sum();
            sum += f64::from(square.sqrt());
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use dynaskin_body::{Pose, SHAPE_COUNT};
    use dynaskin_runtime::features::{FeatureKind, Materials, clip_features};

    fn walk() -> Clip {
        let frames = (0..30).map(|frame| {
            let mut pose = Pose::REST;
            let time = f64::from(frame) / 30.0;
            pose.root_translation_m = DVec3::new(0.3, 0.02 * (9.0 * time).sin(), 1.0 + time);
            pose.parent_from_joint[0] = DQuat::from_rotation_x(0.3 * time);
            pose.parent_from_joint[1] = DQuat::from_rotation_z(0.5 * time);
            pose
        });
        Clip {
            name: "walk".into(),
            rate_hz: 60.0,
            frames: frames.collect(),
        }
    }

    #[test]
    fn a_turned_walk_begins_where_it_began_and_goes_the_other_way() {
        let placed = Placement::new(3.0, PI).apply(&walk());
        let (first, last) = (&placed.frames[0], &placed.frames[29]);
        assert!(
            first
                .root_translation_m
                .abs_diff_eq(DVec3::new(3.3, 0.0, 1.0), 1e-12)
        );
        assert!(
            last.root_translation_m.z < 0.1,
            "{}",
            last.root_translation_m
        );
        assert_eq!(
            Placement::new(0.0, 0.0).apply(&walk()).frames,
            walk().frames
        );
    }

    #[test]
    fn inertial_features_do_not_see_the_place_and_poses_do() {
        let body = dynaskin_train::fixture::symmetric_body(3).shaped(&[0.0; SHAPE_COUNT]);
        let difference = |kind: FeatureKind, placement: Placement| {
            let of = |motion: &Clip| {
                let shape = [0.0; SHAPE_COUNT];
                clip_features(
                    kind,
                    &motion.frames,
                    motion.rate_hz,
                    &body.joints_m,
                    &shape,
                    &Materials::default(),
                )
            };
            let (here, there) = (of(&walk()), of(&placement.apply(&walk())));
            let (here, there) = (here.expect("features"), there.expect("features"));
            let apart = here.iter().zip(&there).map(|(a, b)| (a - b).abs());
            apart.fold(0.0f32, f32::max)
        };
        for placement in &Placement::ALL[1..] {
            assert!(difference(FeatureKind::Inertial, *placement) < 1e-3);
            assert!(difference(FeatureKind::PoseShape, *placement) > 1.0);
        }
    }
}
