//! A motion of the body's skeleton at a fixed frame rate.

use dynaskin_body::{Joint, Pose};
use glam::{DQuat, DVec3};

use crate::{MotionError, interpolate};

/// Largest number of frames of a clip: 45 minutes at 60 Hz, about 128 MB of poses. A reader briefly holds
/// them twice, which still fits in a phone's browser.
pub const MAX_CLIP_FRAMES: usize = 162_000;

/// How far, in frames, the last sample may lie beyond the end of a clip, whose last pose it is then.
const LAST_FRAME_SLACK: f64 = 0.01;

/// Poses at equal time steps.
#[derive(Clone, Debug)]
pub struct Clip {
    /// Name for people and files, such as `jump` or `16_04`.
    pub name: String,
    /// Frames per second, finite and above 0.
    pub rate_hz: f64,
    /// The poses, at least one.
    pub frames: Vec<Pose>,
}

impl Clip {
    /// Time from the first to the last frame in seconds.
    pub fn duration_seconds(&self) -> f64 {
        (self.frames.len().saturating_sub(1)) as f64 / self.rate_hz
    }

    /// The pose at `time_seconds` after the first frame; clamped to the clip's ends. Between
    /// frames the motion is smooth: speed and acceleration are continuous.
    /// A clip without frames, which no function of this crate makes, gives the rest pose.
    pub fn pose_at(&self, time_seconds: f64) -> Pose {
        let Some(last) = self.frames.len().checked_sub(1) else {
            return Pose::REST;
        };
        let position = (time_seconds * self.rate_hz).clamp(0.0, last as f64);
        if position.is_nan() {
            return self.frames[0].clone();
        }
        interpolate::pose_at(&self.frames, 1.0 / self.rate_hz, position)
    }

    /// The frames after which the body jumps to the next: a calibration pose before the take, a
    /// joint between two takes. Nothing is interpolated there: the pose before is held until the
    /// next frame, and then changes at once.
    pub fn jumps(&self) -> Vec<usize> {
        (0..self.frames.len())
            .filter(|frame| interpolate::is_jump(&self.frames, 1.0 / self.rate_hz, *frame))
            .collect()
    }

    /// The same motion at `rate_hz`, between frames as by [`Self::pose_at`].
    ///
    /// # Errors
    /// [`MotionError::Parameter`] for a rate outside 1 to 1000 Hz, [`MotionError::EmptyClip`],
    /// [`MotionError::TooLong`].
    pub fn resampled(&self, rate_hz: f64) -> Result<Self, MotionError> {
        check_range("rate_hz", rate_hz, 1.0, 1000.0)?;
        self.sampled(rate_hz, 1.0)
    }

    /// As [`Self::resampled`], without copying a clip that already has that rate.
    ///
    /// # Errors
    /// As [`Self::resampled`].
    pub fn into_resampled(self, rate_hz: f64) -> Result<Self, MotionError> {
        // So near that every sample falls on a frame.
        let drift = (self.rate_hz / rate_hz - 1.0).abs() * self.frames.len() as f64;
        if drift < 1e-10 && (1..=MAX_CLIP_FRAMES).contains(&self.frames.len()) {
            return Ok(Self { rate_hz, ..self });
        }
        self.resampled(rate_hz)
    }

    /// The same motion `speed` times as fast, at the clip's own rate.
    ///
    /// # Errors
    /// [`MotionError::Parameter`] for a speed outside 0.05 to 20, [`MotionError::EmptyClip`],
    /// [`MotionError::TooLong`].
    pub fn time_scaled(&self, speed: f64) -> Result<Self, MotionError> {
        check_range("speed", speed, 0.05, 20.0)?;
        self.sampled(self.rate_hz, speed)
    }

    fn sampled(&self, rate_hz: f64, speed: f64) -> Result<Self, MotionError> {
        if self.frames.is_empty() {
            return Err(MotionError::EmptyClip);
        }
        check_range("rate_hz of the clip", self.rate_hz, 1e-3, 1e5)?;
        // The last sample must not lie beyond the clip's end; but rates such as 30.0003 Hz, which files
        // mean as 30, must not lose the frame that falls on it.
        let steps = (self.duration_seconds() / speed * rate_hz + LAST_FRAME_SLACK).floor();
        if steps >= MAX_CLIP_FRAMES as f64 {
            return Err(MotionError::TooLong {
                frames: steps + 1.0,
                limit: MAX_CLIP_FRAMES,
            });
        }
        Ok(Self {
            name: self.name.clone(),
            rate_hz,
            frames: (0..=steps as usize)
                .map(|frame| self.pose_at(frame as f64 / rate_hz * speed))
                .collect(),
        })
    }

    /// The motion of the mirror image (x to -x), with left and right swapped.
    pub fn mirrored(&self) -> Self {
        Self {
            name: self.name.clone(),
            rate_hz: self.rate_hz,
            frames: self.frames.iter().map(mirrored_pose).collect(),
        }
    }

    /// Turns the motion about the world's vertical through the origin so that the body faces +Z at its beginning,
    /// half a second after the first frame, as the procedural motions do: the first frame of a file is often of a
    /// calibration. A body that lies at that time, its front up or down, keeps its direction.
    pub fn turn_to_front(&mut self) {
        const BEGUN_SECONDS: f64 = 0.5;
        const LEAST_HORIZONTAL: f64 = 0.3;
        let begun = self.pose_at(BEGUN_SECONDS.min(self.duration_seconds() / 2.0));
        let front = begun.parent_from_joint[Joint::Pelvis as usize] * DVec3::Z;
        if front.x.hypot(front.z) < LEAST_HORIZONTAL {
            return;
        }
        let turn = DQuat::from_rotation_y(-front.x.atan2(front.z));
        for pose in &mut self.frames {
            pose.root_translation_m = turn * pose.root_translation_m;
            let pelvis = &mut pose.parent_from_joint[Joint::Pelvis as usize];
            *pelvis = turn * *pelvis;
        }
    }
}

fn mirrored_pose(pose: &Pose) -> Pose {
    let mut mirrored = Pose::REST;
    mirrored.root_translation_m = pose.root_translation_m * DVec3::new(-1.0, 1.0, 1.0);
    for joint in Joint::ALL {
        // A reflection keeps the axis component along its normal and turns the sense around.
        let q = pose.parent_from_joint[joint.mirrored() as usize];
        mirrored.parent_from_joint[joint as usize] = DQuat::from_xyzw(q.x, -q.y, -q.z, q.w);
    }
    mirrored
}

/// Refuses a parameter outside `low..=high` and NaN.
pub fn check_range(name: &'static str, got: f64, low: f64, high: f64) -> Result<(), MotionError> {
    if (low..=high).contains(&got) {
        Ok(())
    } else {
        Err(MotionError::Parameter {
            name,
            got,
            expected: format!("between {low} and {high}"),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The left hip turns about a slanted axis at 2 rad/s while the root moves at (1, 2, 3) m/s.
    fn turning(rate_hz: f64, frames: usize) -> Clip {
        let axis = DVec3::new(1.0, 2.0, -2.0).normalize();
        let pose = |time: f64| {
            let mut pose = Pose::REST;
            pose.root_translation_m = time * DVec3::new(1.0, 2.0, 3.0);
            pose.parent_from_joint[Joint::LeftHip as usize] =
                DQuat::from_axis_angle(axis, 2.0 * time);
            pose
        };
        Clip {
            name: "turning".to_owned(),
            rate_hz,
            frames: (0..frames)
                .map(|frame| pose(frame as f64 / rate_hz))
                .collect(),
        }
    }

    #[track_caller]
    fn check_same(a: &Clip, b: &Clip) {
        assert_eq!((a.rate_hz, a.frames.len()), (b.rate_hz, b.frames.len()));
        for (a, b) in a.frames.iter().zip(&b.frames) {
            assert!(a.root_translation_m.distance(b.root_translation_m) < 1e-9);
            for (a, b) in a.parent_from_joint.iter().zip(b.parent_from_joint) {
                assert!(a.dot(b).abs() > 1.0 - 1e-12);
            }
        }
    }

    #[test]
    fn resampling_keeps_constant_speeds_exactly() {
        let at_30 = turning(30.0, 31);
        check_same(&at_30.resampled(60.0).unwrap(), &turning(60.0, 61));
        check_same(&at_30.resampled(23.0).unwrap(), &turning(23.0, 24));
        check_same(
            &turning(120.0, 241).resampled(60.0).unwrap(),
            &turning(60.0, 121),
        );
        check_same(&at_30.resampled(30.0).unwrap(), &at_30);
        // 1 / 0.0166667 Hz, as files say, is not quite 60 Hz: no frame gets lost.
        let rounded = Clip {
            rate_hz: 1.0 / 0.0166667,
            ..turning(60.0, 61)
        };
        assert_eq!(rounded.resampled(60.0).unwrap().frames.len(), 61);
    }

    #[test]
    fn time_scaling_changes_speed_and_length() {
        let twice = turning(60.0, 121).time_scaled(2.0).unwrap();
        assert_eq!((twice.frames.len(), twice.rate_hz), (61, 60.0));
        assert!((twice.frames[30].root_translation_m.x - 1.0).abs() < 1e-12);
        let half = turning(60.0, 121).time_scaled(0.5).unwrap();
        assert_eq!(half.frames.len(), 241);
    }

    #[test]
    fn a_mirrored_clip_is_the_mirror_image() {
        let clip = turning(60.0, 20);
        check_same(&clip.mirrored().mirrored(), &clip);
        // A symmetric skeleton: joint k of the mirrored pose is where the mirror shows the twin.
        let mut joints_m = [glam::Vec3::ZERO; dynaskin_body::JOINT_COUNT];
        for joint in Joint::ALL {
            let (own, twin) = (joint as usize, joint.mirrored() as usize);
            // Left joints come first.
            let aside_m = 0.2 * (twin as f32 - own as f32);
            joints_m[own] = glam::Vec3::new(aside_m, 0.1 * own.max(twin) as f32, 0.3);
        }
        for (pose, mirrored) in clip.frames.iter().zip(clip.mirrored().frames) {
            let (world, image) = (
                pose.world_joints(&joints_m),
                mirrored.world_joints(&joints_m),
            );
            for joint in Joint::ALL {
                let expected =
                    world.position_m[joint.mirrored() as usize] * DVec3::new(-1.0, 1.0, 1.0);
                assert!(
                    image.position_m[joint as usize].distance(expected) < 1e-6,
                    "{}",
                    joint.name()
                );
            }
        }
    }

    #[test]
    fn a_turned_clip_begins_with_its_front_to_z_and_is_else_the_same() {
        let pelvis = Joint::Pelvis as usize;
        for degrees in [0.0_f64, 40.0, 180.0, -135.0] {
            let mut clip = turning(60.0, 90);
            let turn = DQuat::from_rotation_y(degrees.to_radians());
            for (frame, pose) in clip.frames.iter_mut().enumerate() {
                // The body bends forward and goes on turning; the first frames are of something else.
                let more = DQuat::from_rotation_y(0.01 * (frame as f64 - 30.0));
                pose.parent_from_joint[pelvis] = turn * more * DQuat::from_rotation_x(0.4);
                pose.root_translation_m = turn * pose.root_translation_m;
            }
            clip.frames[0].parent_from_joint[pelvis] = DQuat::from_rotation_y(2.0);
            let mut turned = clip.clone();
            turned.turn_to_front();
            let front = turned.pose_at(0.5).parent_from_joint[pelvis] * DVec3::Z;
            assert!(front.x.abs() < 1e-12 && front.z > 0.9, "{front}");
            for (before, after) in clip.frames.iter().zip(&turned.frames) {
                let back = |q: DQuat| turn.inverse() * q;
                assert!(
                    back(before.parent_from_joint[pelvis])
                        .dot(after.parent_from_joint[pelvis])
                        .abs()
                        > 1.0 - 1e-12
                );
                let moved_m = turn.inverse() * before.root_translation_m;
                assert!(moved_m.distance(after.root_translation_m) < 1e-12);
                assert_eq!(before.parent_from_joint[1..], after.parent_from_joint[1..]);
            }
        }
        // Who lies on the back has no front to turn.
        let mut lying = turning(60.0, 90);
        for pose in &mut lying.frames {
            pose.parent_from_joint[pelvis] =
                DQuat::from_rotation_y(0.7) * DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2);
        }
        let mut turned = lying.clone();
        turned.turn_to_front();
        check_same(&turned, &lying);
    }

    #[test]
    fn impossible_rates_and_lengths_are_refused() {
        let clip = turning(30.0, 31);
        for bad in [0.0, -60.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(
                clip.resampled(bad),
                Err(MotionError::Parameter { .. })
            ));
            assert!(matches!(
                clip.time_scaled(bad),
                Err(MotionError::Parameter { .. })
            ));
        }
        let slow = Clip {
            rate_hz: 0.1,
            ..turning(30.0, 1000)
        };
        assert!(matches!(
            slow.resampled(1000.0),
            Err(MotionError::TooLong { .. })
        ));
        let empty = Clip {
            frames: Vec::new(),
            ..clip
        };
        assert!(matches!(empty.resampled(60.0), Err(MotionError::EmptyClip)));
        assert_eq!(empty.pose_at(1.0), Pose::REST);
    }
}
