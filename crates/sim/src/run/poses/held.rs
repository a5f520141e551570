//! The poses themselves, by the directions of limbs.

use std::f64::consts::FRAC_PI_2;

use dynaskin_body::{JOINT_COUNT, Joint, Pose};
use glam::{DQuat, DVec3, Vec3};
use rand::RngExt as _;
use rand_pcg::Pcg64Mcg;

use super::movement::direction;

/// Largest turn of a collar up or down, in radians, and to the front or back.
const COLLAR_RAISE: f64 = 0.7;
const COLLAR_AHEAD: f64 = 0.25;
/// How far limbs and trunk are from where their pose has them, in radians.
const SPREAD: f64 = 0.18;

/// Left, then right: collar, shoulder, elbow, wrist, and hip, knee, ankle.
const ARMS: [[Joint; 4]; 2] = [
    [
        Joint::LeftCollar,
        Joint::LeftShoulder,
        Joint::LeftElbow,
        Joint::LeftWrist,
    ],
    [
        Joint::RightCollar,
        Joint::RightShoulder,
        Joint::RightElbow,
        Joint::RightWrist,
    ],
];
const LEGS: [[Joint; 3]; 2] = [
    [Joint::LeftHip, Joint::LeftKnee, Joint::LeftAnkle],
    [Joint::RightHip, Joint::RightKnee, Joint::RightAnkle],
];
const SPINE: [Joint; 3] = [Joint::Spine1, Joint::Spine2, Joint::Spine3];

/// A pose by the directions of its limbs: those of the left side, mirrored on the right. Arms are given
/// against the upright trunk, legs against the pelvis.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    /// Turn of the pelvis about x (leaning ahead is positive), y and z, in radians.
    pelvis: [f64; 3],
    /// Turn of the chest against the pelvis, likewise.
    spine: [f64; 3],
    /// Height of the pelvis over that of standing, in metres.
    height_m: f64,
    upper_arm: [f64; 3],
    forearm: [f64; 3],
    thigh: [f64; 3],
    shin: [f64; 3],
}

const STANDING: Held = Held {
    pelvis: [0.0; 3],
    spine: [0.0; 3],
    height_m: 0.0,
    upper_arm: [0.2, -1.0, 0.0],
    forearm: [0.1, -1.0, 0.2],
    thigh: [0.08, -1.0, 0.0],
    shin: [0.0, -1.0, 0.0],
};
const T_POSE: Held = Held {
    upper_arm: [1.0, 0.0, 0.0],
    forearm: [1.0, 0.0, 0.0],
    ..STANDING
};
const A_POSE: Held = Held {
    upper_arm: [0.7, -0.7, 0.0],
    forearm: [0.7, -0.7, 0.05],
    ..STANDING
};
const SITTING: Held = Held {
    spine: [0.1, 0.0, 0.0],
    height_m: -0.4,
    upper_arm: [0.2, -0.9, 0.3],
    forearm: [0.0, -0.4, 0.9],
    thigh: [0.15, -0.1, 1.0],
    shin: [0.0, -1.0, 0.0],
    ..STANDING
};
const LYING: Held = Held {
    pelvis: [-FRAC_PI_2, 0.0, 0.0],
    height_m: -0.8,
    ..STANDING
};
/// All of them; the first two begin a clip.
pub(super) const HELD: [Held; 15] = [
    T_POSE,
    A_POSE,
    STANDING,
    // Arms overhead.
    Held {
        upper_arm: [0.25, 1.0, 0.05],
        forearm: [0.1, 1.0, 0.1],
        ..STANDING
    },
    // Hands on hips.
    Held {
        upper_arm: [0.8, -0.6, -0.2],
        forearm: [-0.75, -0.4, 0.5],
        ..STANDING
    },
    // Arms ahead.
    Held {
        upper_arm: [0.2, -0.1, 1.0],
        forearm: [0.0, 0.0, 1.0],
        ..STANDING
    },
    // Arms crossed.
    Held {
        upper_arm: [0.25, -0.85, 0.5],
        forearm: [-0.95, 0.0, 0.35],
        ..STANDING
    },
    // Bending.
    Held {
        pelvis: [0.7, 0.0, 0.0],
        spine: [0.8, 0.0, 0.0],
        thigh: [0.08, -0.77, 0.64],
        shin: [0.0, -0.77, 0.64],
        upper_arm: [0.15, -0.2, 1.0],
        forearm: [0.05, -0.2, 1.0],
        ..STANDING
    },
    SITTING,
    // Sitting, arms overhead.
    Held {
        upper_arm: [0.3, 1.0, 0.0],
        forearm: [-0.1, 1.0, 0.0],
        ..SITTING
    },
    LYING,
    // Lying on the front.
    Held {
        pelvis: [FRAC_PI_2, 0.0, 0.0],
        ..LYING
    },
    // Lying on a side.
    Held {
        pelvis: [0.0, 0.0, FRAC_PI_2],
        thigh: [0.05, -0.7, 0.7],
        shin: [0.0, -0.9, -0.4],
        ..LYING
    },
    // Kneeling.
    Held {
        height_m: -0.42,
        thigh: [0.12, -1.0, 0.05],
        shin: [0.0, -0.1, -1.0],
        ..STANDING
    },
    // Squatting.
    Held {
        pelvis: [0.3, 0.0, 0.0],
        spine: [0.25, 0.0, 0.0],
        height_m: -0.45,
        thigh: [0.4, 0.0, 0.9],
        shin: [-0.1, -0.95, -0.3],
        upper_arm: [0.15, -0.3, 0.9],
        forearm: [0.0, 0.0, 1.0],
    },
];

/// A held pose with limbs, trunk and collars a little elsewhere, each side by itself.
pub(super) fn drawn(held: &Held, joints_rest_m: &[Vec3; JOINT_COUNT], rng: &mut Pcg64Mcg) -> Pose {
    let at = |joint: Joint| joints_rest_m[joint as usize].as_dvec3();
    let mut pose = Pose::REST;
    let mut near = |angles: [f64; 3], spread: f64| {
        let turned = DVec3::from_array(angles) + direction(rng) * rng.random_range(0.0..spread);
        DQuat::from_scaled_axis(turned)
    };
    pose.parent_from_joint[0] = near(held.pelvis, 0.15);
    let spine = near(held.spine, SPREAD).to_scaled_axis() / SPINE.len() as f64;
    for joint in SPINE {
        pose.parent_from_joint[joint as usize] = DQuat::from_scaled_axis(spine);
    }
    pose.root_translation_m.y = held.height_m;
    for (side, [collar, shoulder, elbow, wrist]) in ARMS.into_iter().enumerate() {
        let sign = 1.0 - 2.0 * side as f64;
        let upper = aimed(held.upper_arm, sign, rng);
        let fore = aimed(held.forearm, sign, rng);
        let collar_turn = DQuat::from_euler(
            glam::EulerRot::ZYX,
            sign * rng.random_range(-COLLAR_RAISE..COLLAR_RAISE),
            -sign * rng.random_range(-COLLAR_AHEAD..COLLAR_AHEAD),
            0.0,
        );
        // Half of the rigs keep their collars still.
        let collar_turn = if rng.random::<bool>() {
            collar_turn
        } else {
            DQuat::IDENTITY
        };
        let roll = rng.random_range(-0.5..0.5);
        let trunk_from_upper =
            DQuat::from_rotation_arc((at(elbow) - at(shoulder)).normalize_or(DVec3::X), upper)
                * DQuat::from_axis_angle((at(elbow) - at(shoulder)).normalize_or(DVec3::X), roll);
        let trunk_from_fore = DQuat::from_rotation_arc(
            (trunk_from_upper * (at(wrist) - at(elbow))).normalize_or(DVec3::X),
            fore,
        ) * trunk_from_upper;
        pose.parent_from_joint[collar as usize] = collar_turn;
        pose.parent_from_joint[shoulder as usize] =
            (collar_turn.conjugate() * trunk_from_upper).normalize();
        pose.parent_from_joint[elbow as usize] =
            (trunk_from_upper.conjugate() * trunk_from_fore).normalize();
    }
    for (side, [hip, knee, ankle]) in LEGS.into_iter().enumerate() {
        let sign = 1.0 - 2.0 * side as f64;
        let thigh = aimed(held.thigh, sign, rng);
        let shin = aimed(held.shin, sign, rng);
        let pelvis_from_thigh =
            DQuat::from_rotation_arc((at(knee) - at(hip)).normalize_or(DVec3::NEG_Y), thigh);
        let pelvis_from_shin = DQuat::from_rotation_arc(
            (pelvis_from_thigh * (at(ankle) - at(knee))).normalize_or(DVec3::NEG_Y),
            shin,
        ) * pelvis_from_thigh;
        pose.parent_from_joint[hip as usize] = pelvis_from_thigh.normalize();
        pose.parent_from_joint[knee as usize] =
            (pelvis_from_thigh.conjugate() * pelvis_from_shin).normalize();
    }
    pose
}

/// A direction near that of a pose, on the side of `sign`.
fn aimed([x, y, z]: [f64; 3], sign: f64, rng: &mut Pcg64Mcg) -> DVec3 {
    let aim = DVec3::new(sign * x, y, z).normalize_or(DVec3::NEG_Y);
    (aim + direction(rng) * rng.random_range(0.0..SPREAD)).normalize_or(aim)
}

#[cfg(test)]
pub(super) mod tests {
    use rand::SeedableRng as _;

    use super::*;

    pub fn joints() -> [Vec3; JOINT_COUNT] {
        // An A-pose: enough of a person for directions.
        let mut joints = [Vec3::ZERO; JOINT_COUNT];
        for (side, [collar, shoulder, elbow, wrist]) in ARMS.into_iter().enumerate() {
            let sign = 1.0 - 2.0 * side as f32;
            joints[collar as usize] = Vec3::new(0.08 * sign, 1.4, 0.0);
            joints[shoulder as usize] = Vec3::new(0.2 * sign, 1.4, 0.0);
            joints[elbow as usize] = Vec3::new(0.4 * sign, 1.2, 0.0);
            joints[wrist as usize] = Vec3::new(0.6 * sign, 1.0, 0.0);
        }
        for (side, [hip, knee, ankle]) in LEGS.into_iter().enumerate() {
            let sign = 1.0 - 2.0 * side as f32;
            joints[hip as usize] = Vec3::new(0.1 * sign, 0.9, 0.0);
            joints[knee as usize] = Vec3::new(0.1 * sign, 0.5, 0.0);
            joints[ankle as usize] = Vec3::new(0.1 * sign, 0.1, 0.0);
        }
        joints
    }

    #[test]
    fn limbs_point_where_the_pose_has_them() {
        let joints = joints();
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        for (number, held) in HELD.iter().enumerate() {
            let pose = drawn(held, &joints, &mut rng);
            assert!(pose.is_valid(), "pose {number}");
            let world = pose.world_joints(&joints);
            let trunk = world.rotation[Joint::Spine3 as usize];
            let arm = world.position_m[Joint::LeftElbow as usize]
                - world.position_m[Joint::LeftShoulder as usize];
            let wanted = DVec3::from_array(held.upper_arm).normalize();
            let off = (trunk.conjugate() * arm).angle_between(wanted);
            assert!(off < 1.2 * SPREAD, "pose {number}: arm {off}");
            let shin = world.position_m[Joint::RightAnkle as usize]
                - world.position_m[Joint::RightKnee as usize];
            let [x, y, z] = held.shin;
            let wanted = DVec3::new(-x, y, z).normalize();
            let off = (world.rotation[0].conjugate() * shin).angle_between(wanted);
            assert!(off < 1.2 * SPREAD, "pose {number}: shin {off}");
        }
    }
}
