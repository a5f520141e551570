//! The same motion on other kinds of rig: collars that turn, fewer bones in the spine.

use dynaskin_body::{JOINT_COUNT, Joint, Pose};
use dynaskin_motion::Clip;
use glam::{DQuat, DVec3, Vec3};
use serde::Serialize;
use sha2::{Digest as _, Sha256};

/// What a rig lets collars (clavicles) do of what the arms do.
///
/// The skeleton of the CMU captures keeps its collars still and turns the whole arm at the shoulder.
/// Mixamo's, VRM's, SMPL's and Xsens's share the raise and the swing of an arm between both joints.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CollarHabit {
    /// The collar's share of the swing that brings the upper arm from straight sideways to where it is.
    pub share: f64,
    /// By how much collars are lowered besides, in radians.
    pub lowered: f64,
}

/// What a rig makes of a motion besides.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RigHabit {
    /// What its collars do.
    pub collars: CollarHabit,
    /// How many bones its spine has between pelvis and chest, 1 to 3.
    pub spine_bones: u8,
}

impl RigHabit {
    /// As captures have it.
    pub const NONE: Self = Self {
        collars: CollarHabit {
            share: 0.0,
            lowered: 0.0,
        },
        spine_bones: 3,
    };

    /// Half of the clips stay as they are. The others get a share of the arm's swing and a lowering of
    /// the collars, and every second of them a spine of one or two bones. Depends on nothing but name
    /// and seed.
    pub fn drawn(name: &str, seed: u64) -> Self {
        let digest = Sha256::new()
            .chain_update(b"rig")
            .chain_update(seed.to_le_bytes())
            .chain_update(name.as_bytes())
            .finalize();
        if digest[0].is_multiple_of(2) {
            return Self::NONE;
        }
        let even = |byte: usize| f64::from(digest[byte]) / 255.0;
        Self {
            collars: CollarHabit {
                share: MOST_SHARE * even(1),
                lowered: MOST_LOWERED * (2.0 * even(2) - 0.5),
            },
            spine_bones: [1, 2, 3, 3][usize::from(digest[3] % 4)],
        }
    }

    /// `clip` on a rig of this habit; `joints_rest_m` are the rest joints of the clip's body, metres.
    pub fn applied(&self, clip: &Clip, joints_rest_m: &[Vec3; JOINT_COUNT]) -> Clip {
        if *self == Self::NONE {
            return clip.clone();
        }
        let mut turned = self.collars.applied(clip, joints_rest_m);
        for pose in &mut turned.frames {
            let [s1, s2, s3] = SPINE.map(|joint| pose.parent_from_joint[joint as usize]);
            let shared = match self.spine_bones {
                1 => [s1 * s2 * s3, DQuat::IDENTITY, DQuat::IDENTITY],
                2 => [s1, s2 * s3, DQuat::IDENTITY],
                _ => [s1, s2, s3],
            };
            for (joint, turn) in SPINE.into_iter().zip(shared) {
                pose.parent_from_joint[joint as usize] = turn.normalize();
            }
        }
        turned
    }
}

/// Largest share of an arm's swing that a collar takes, and by how much it is lowered at most, in
/// radians.
const MOST_SHARE: f64 = 0.4;
const MOST_LOWERED: f64 = 0.2;

const SPINE: [Joint; 3] = [Joint::Spine1, Joint::Spine2, Joint::Spine3];

/// Each collar, its shoulder, the elbow after it, and which way is sideways.
const SIDES: [(Joint, Joint, Joint, DVec3); 2] = [
    (
        Joint::LeftCollar,
        Joint::LeftShoulder,
        Joint::LeftElbow,
        DVec3::X,
    ),
    (
        Joint::RightCollar,
        Joint::RightShoulder,
        Joint::RightElbow,
        DVec3::NEG_X,
    ),
];

impl CollarHabit {
    /// `clip` on a rig of this habit. The upper arms turn against the trunk as before, and the shoulder
    /// joints move with the collars. `joints_rest_m` are the rest joints of the clip's body, metres.
    pub fn applied(&self, clip: &Clip, joints_rest_m: &[Vec3; JOINT_COUNT]) -> Clip {
        Clip {
            frames: clip
                .frames
                .iter()
                .map(|pose| self.pose(pose, joints_rest_m))
                .collect(),
            ..clip.clone()
        }
    }

    fn pose(&self, pose: &Pose, joints_rest_m: &[Vec3; JOINT_COUNT]) -> Pose {
        let mut turned = pose.clone();
        for (collar, shoulder, elbow, sideways) in SIDES {
            let at = |joint: Joint| joints_rest_m[joint as usize].as_dvec3();
            let local = |joint: Joint| pose.parent_from_joint[joint as usize];
            let trunk_from_arm = local(collar) * local(shoulder);
            let arm = trunk_from_arm * (at(elbow) - at(shoulder)).normalize_or(sideways);
            let swing = DQuat::from_rotation_arc(sideways, arm.normalize());
            let lowered = DQuat::from_rotation_z(-self.lowered * sideways.x);
            let trunk_from_collar = lowered * DQuat::IDENTITY.slerp(swing, self.share);
            turned.parent_from_joint[collar as usize] = trunk_from_collar;
            turned.parent_from_joint[shoulder as usize] =
                (trunk_from_collar.conjugate() * trunk_from_arm).normalize();
        }
        turned
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn collars_take_their_share_and_arms_turn_as_before() {
        let mut joints_rest_m = [Vec3::ZERO; JOINT_COUNT];
        joints_rest_m[Joint::LeftShoulder as usize] = Vec3::new(0.2, 1.4, 0.0);
        joints_rest_m[Joint::LeftElbow as usize] = Vec3::new(0.4, 1.2, 0.0);
        joints_rest_m[Joint::RightShoulder as usize] = Vec3::new(-0.2, 1.4, 0.0);
        joints_rest_m[Joint::RightElbow as usize] = Vec3::new(-0.4, 1.2, 0.0);
        let habit = CollarHabit {
            share: 0.3,
            lowered: 0.1,
        };
        let rest = habit.pose(&Pose::REST, &joints_rest_m);
        // The arm hangs 45 degrees below sideways: 0.3 of that and the rest of the lowering.
        for (collar, side) in [(Joint::LeftCollar, 1.0), (Joint::RightCollar, -1.0)] {
            let expected = -side * (0.3 * std::f64::consts::FRAC_PI_4 + 0.1);
            let turn = rest.parent_from_joint[collar as usize].to_scaled_axis();
            assert!((turn - DVec3::Z * expected).length() < 1e-6, "{turn}");
        }
        for (collar, shoulder, ..) in SIDES {
            let both =
                rest.parent_from_joint[collar as usize] * rest.parent_from_joint[shoulder as usize];
            assert!(both.angle_between(DQuat::IDENTITY) < 1e-6);
        }
    }

    #[test]
    fn rigs_keep_the_chest_and_the_arms() {
        let joints_rest_m: [Vec3; JOINT_COUNT] =
            std::array::from_fn(|k| Vec3::new((k as f32 * 0.7).sin(), 0.05 * k as f32, 0.0));
        let mut pose = Pose::REST;
        for (joint, turn) in pose.parent_from_joint.iter_mut().enumerate() {
            *turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.1 * joint as f64, 0.2, -0.1);
        }
        let clip = Clip {
            name: "one".into(),
            rate_hz: 60.0,
            frames: vec![pose],
        };
        let mut habits = Vec::new();
        for number in 0..40 {
            let habit = RigHabit::drawn(&format!("clip{number}"), 1);
            habits.push(habit);
            let [before, after] = [&clip, &habit.applied(&clip, &joints_rest_m)]
                .map(|clip| clip.frames[0].world_joints(&joints_rest_m).rotation);
            for joint in [Joint::Spine3, Joint::LeftShoulder, Joint::RightElbow] {
                let off = before[joint as usize].angle_between(after[joint as usize]);
                assert!(off < 1e-6, "{habit:?}: {joint:?} by {off}");
            }
        }
        let still = habits.iter().filter(|h| **h == RigHabit::NONE).count();
        let short = habits.iter().filter(|h| h.spine_bones < 3).count();
        assert!(
            (10..30).contains(&still) && (3..20).contains(&short),
            "{still} {short}"
        );
    }
}
