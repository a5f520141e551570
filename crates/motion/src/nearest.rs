//! Which procedural motion a clip resembles most.

use dynaskin_body::{JOINT_COUNT, Joint, Pose};
use glam::{DVec3, Vec3};

use crate::procedural::{LEAD_SECONDS, TAIL_SECONDS};
use crate::{Clip, MotionError, Procedural, ProceduralKind};

/// Poses are compared at this rate.
const RATE_HZ: f64 = 60.0;
/// Of a longer clip so many seconds are compared.
const LONGEST_SECONDS: f64 = 60.0;
/// The pelvis's vertical speed counts as so many rad/s for each m/s.
const RAD_PER_METRE: f64 = 3.0;
/// How much a movement as large but faster counts, beside what moves: tells running from walking.
const SPEED_PART: f64 = 0.1;

impl ProceduralKind {
    /// The motion that a clip resembles most, by how fast hips, knees, shoulders, spine and pelvis move, and
    /// whether left and right do the same or take turns. The clip's joints are those of a body with these rest
    /// joint positions (metres, as for [`Procedural::clip`]). A clip that stands still gives
    /// [`Self::ShakeHips`], which moves least.
    ///
    /// # Errors
    /// [`MotionError::EmptyClip`], [`MotionError::Degenerate`] for joints that are no standing person.
    pub fn nearest(clip: &Clip, joints_rest_m: &[Vec3; JOINT_COUNT]) -> Result<Self, MotionError> {
        if clip.frames.is_empty() {
            return Err(MotionError::EmptyClip);
        }
        let of_clip = Movement::of(clip, 0.0, clip.duration_seconds());
        let mut nearest = (f64::INFINITY, Self::ShakeHips);
        for kind in Self::ALL {
            let motion = Procedural::new(kind).clip(joints_rest_m)?;
            let end = motion.duration_seconds() - TAIL_SECONDS;
            let distance = of_clip.distance(&Movement::of(&motion, LEAD_SECONDS, end));
            if distance < nearest.0 {
                nearest = (distance, kind);
            }
        }
        Ok(nearest.1)
    }
}

/// Root mean squares over a clip, in rad/s.
struct Movement([f64; NUMBERS]);

const NUMBERS: usize = 13;

impl Movement {
    fn of(clip: &Clip, from_seconds: f64, to_seconds: f64) -> Self {
        let seconds = (to_seconds - from_seconds).clamp(0.0, LONGEST_SECONDS);
        let steps = (seconds * RATE_HZ).floor().max(1.0) as usize;
        let at = |step: usize| clip.pose_at(from_seconds + step as f64 / RATE_HZ);
        let mut squares = [0.0; NUMBERS];
        let mut before = at(0);
        for step in 1..=steps {
            let now = at(step);
            for (square, number) in squares.iter_mut().zip(numbers(&before, &now)) {
                *square += number * number;
            }
            before = now;
        }
        Self(squares.map(|square| (square / steps as f64).sqrt()))
    }

    /// 0 for the same movement. Mostly the angle between the two, so that a hesitant walk is a walk.
    fn distance(&self, other: &Self) -> f64 {
        let dot = |a: &Self, b: &Self| -> f64 { a.0.iter().zip(&b.0).map(|(a, b)| a * b).sum() };
        // A tenth of a degree a second stands still.
        let size = |of: &Self| dot(of, of).sqrt().max(2e-3);
        let cosine = dot(self, other) / (size(self) * size(other));
        let faster = (size(self) / size(other)).ln();
        1.0 - cosine + SPEED_PART * faster * faster
    }
}

/// How fast a body moves from one pose to the next: of pairs of joints what left and right do alike, and what they do
/// in turn.
fn numbers(before: &Pose, now: &Pose) -> [f64; NUMBERS] {
    let turn = |joint: Joint| {
        let [before, now] = [before, now].map(|pose| pose.parent_from_joint[joint as usize]);
        let turn = before.conjugate() * now;
        // Both signs are the same rotation; the shorter way is meant.
        let turn = if turn.w < 0.0 { -turn } else { turn };
        turn.to_scaled_axis() * RATE_HZ
    };
    // A mirror image turns the other way about all axes but x.
    let pair = |left: Joint| {
        let mirrored = turn(left.mirrored()) * DVec3::new(1.0, -1.0, -1.0);
        [1.0, -1.0].map(|sign| (turn(left) + sign * mirrored) / 2.0)
    };
    let [hips, hips_in_turn] = pair(Joint::LeftHip);
    let [knees, knees_in_turn] = pair(Joint::LeftKnee);
    let [arms, arms_in_turn] = pair(Joint::LeftShoulder);
    let spine = turn(Joint::Spine1) + turn(Joint::Spine2) + turn(Joint::Spine3);
    let pelvis = turn(Joint::Pelvis);
    let rise_m = now.root_translation_m.y - before.root_translation_m.y;
    [
        hips.length(),
        hips_in_turn.length(),
        knees.length(),
        knees_in_turn.length(),
        // Arms that are raised aside are jumping jacks, arms that swing are jumps.
        arms.z,
        arms_in_turn.z,
        arms.truncate().length(),
        arms_in_turn.truncate().length(),
        spine.y,
        spine.z,
        pelvis.y,
        pelvis.z,
        rise_m * RATE_HZ * RAD_PER_METRE,
    ]
}
