//! Poses that avatars are held in and slowly moved between, with a bounce, a shake or a jerk now and then:
//! what captures of sports and everyday movement hardly have.

use std::f64::consts::{FRAC_PI_2, TAU};

use dynaskin_body::{JOINT_COUNT, Joint, Pose};
use dynaskin_motion::{Clip, MODEL_RATE_HZ};
use glam::{DQuat, DVec3, Vec3};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;

/// Time in seconds that a pose is held for.
const HOLD_SECONDS: [f64; 2] = [1.0, 2.6];
/// Time in seconds from one pose to the next.
const CHANGE_SECONDS: [f64; 2] = [0.5, 1.6];
/// What a body does in a held pose: amplitudes in metres and radians, frequency in hertz.
const BOUNCE_M: [f64; 2] = [0.01, 0.05];
const SHAKE_RAD: [f64; 2] = [0.03, 0.12];
const TEMPO_HZ: [f64; 2] = [1.2, 3.0];
/// A jerk: how far the body is moved and turned, how long that takes, and how long its tissue then rings,
/// by which the next one may follow. Metres, radians and seconds.
const JERK_M: [f64; 2] = [0.003, 0.02];
const JERK_RAD: [f64; 2] = [0.01, 0.06];
const JERK_SECONDS: [f64; 2] = [0.05, 0.15];
const RING_SECONDS: [f64; 2] = [0.6, 1.4];
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
struct Held {
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
const HELD: [Held; 15] = [
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

/// A clip of held poses, drawn by its seed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldPoses {
    /// Poses, times, collars and movements depend on nothing else.
    pub seed: u64,
    /// Length of the clip in seconds.
    pub duration_seconds: f64,
    /// What the body does in a pose.
    pub movement: PoseMovement,
}

/// What a body does in the poses it is held in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoseMovement {
    /// It bounces or shakes in half of them and is still in the others.
    Sways,
    /// It is jerked a little in each and left to ring, again and again: the tissue's own frequencies, which
    /// larger movements hide.
    Jerks,
}

/// What stands at a time: a pose, and what the body does in it.
#[derive(Clone, Debug)]
struct Stop {
    pose: Pose,
    /// From when to when it is held, in seconds.
    held: [f64; 2],
    sway: Sway,
    jerks: Vec<Jerk>,
}

/// A short movement of the whole body to where it then stays.
#[derive(Clone, Copy, Debug)]
struct Jerk {
    /// When it begins and ends, in seconds.
    span: [f64; 2],
    moved_m: DVec3,
    /// Axis times radians.
    turned: DVec3,
}

/// A bounce or a shake of the whole body.
#[derive(Clone, Copy, Debug, Default)]
struct Sway {
    bounce_m: f64,
    shake: DVec3,
    tempo_hz: f64,
}

impl HeldPoses {
    /// The clip at 60 Hz for a body with these rest joint positions in metres.
    pub fn clip(&self, joints_rest_m: &[Vec3; JOINT_COUNT]) -> Clip {
        let mut rng = Pcg64Mcg::seed_from_u64(self.seed);
        let mut stops = Vec::new();
        let mut at = 0.0;
        while at < self.duration_seconds {
            let first = stops.is_empty();
            let held = &HELD[rng.random_range(0..if first { 2 } else { HELD.len() })];
            let stop = match self.movement {
                PoseMovement::Sways => {
                    let until = at + between(&mut rng, HOLD_SECONDS);
                    Stop {
                        pose: drawn(held, joints_rest_m, &mut rng),
                        held: [at, until],
                        sway: Sway::drawn(&mut rng),
                        jerks: Vec::new(),
                    }
                }
                PoseMovement::Jerks => {
                    let jerks = Jerk::drawn(at, &mut rng);
                    // The clip begins in the rest pose, which bodies are shown in.
                    let pose = if first {
                        Pose::REST
                    } else {
                        drawn(held, joints_rest_m, &mut rng)
                    };
                    Stop {
                        pose,
                        held: [
                            at,
                            jerks.last().map_or(at, |jerk| jerk.span[1])
                                + between(&mut rng, RING_SECONDS),
                        ],
                        sway: Sway::default(),
                        jerks,
                    }
                }
            };
            let until = stop.held[1];
            stops.push(stop);
            at = until + between(&mut rng, CHANGE_SECONDS);
        }
        let last = (self.duration_seconds * MODEL_RATE_HZ).round() as usize;
        Clip {
            name: format!("held-poses-{}", self.seed),
            rate_hz: MODEL_RATE_HZ,
            frames: (0..=last)
                .map(|frame| at_time(&stops, frame as f64 / MODEL_RATE_HZ))
                .collect(),
        }
    }
}

impl Jerk {
    /// Three jerks of a pose that is held from `at` on.
    fn drawn(at: f64, rng: &mut Pcg64Mcg) -> Vec<Self> {
        let mut until = at;
        let jerks = (0..3).map(|_| {
            let from = until + between(rng, RING_SECONDS);
            until = from + between(rng, JERK_SECONDS);
            let turned = if rng.random::<bool>() {
                direction(rng) * between(rng, JERK_RAD)
            } else {
                DVec3::ZERO
            };
            Self {
                span: [from, until],
                moved_m: direction(rng) * between(rng, JERK_M),
                turned,
            }
        });
        jerks.collect()
    }

    /// Moves a pose as far as the body is at `seconds`.
    fn applied(&self, pose: &mut Pose, seconds: f64) {
        let [from, until] = self.span;
        let share = smooth((seconds - from) / (until - from));
        pose.root_translation_m += self.moved_m * share;
        let turn = DQuat::from_scaled_axis(self.turned * share);
        pose.parent_from_joint[0] = turn * pose.parent_from_joint[0];
    }
}

impl Sway {
    /// Half of the poses are held still.
    fn drawn(rng: &mut Pcg64Mcg) -> Self {
        let tempo_hz = between(rng, TEMPO_HZ);
        match rng.random_range(0..4) {
            0 => Self {
                bounce_m: between(rng, BOUNCE_M),
                tempo_hz,
                ..Self::default()
            },
            1 => Self {
                shake: direction(rng) * between(rng, SHAKE_RAD),
                tempo_hz,
                ..Self::default()
            },
            _ => Self::default(),
        }
    }

    /// Moves a pose `seconds` into its hold of `length` seconds.
    fn applied(&self, pose: &Pose, seconds: f64, length: f64) -> Pose {
        let strength = smooth(seconds / 0.4) * smooth((length - seconds) / 0.4);
        let wave = strength * (TAU * self.tempo_hz * seconds).sin();
        let mut moved = pose.clone();
        moved.root_translation_m.y += self.bounce_m * wave;
        let turn = DQuat::from_scaled_axis(self.shake * wave);
        moved.parent_from_joint[0] = turn * moved.parent_from_joint[0];
        moved
    }
}

/// No speed and no acceleration at both ends (the minimum-jerk profile of Flash and Hogan 1985).
fn smooth(share: f64) -> f64 {
    let s = share.clamp(0.0, 1.0);
    s * s * s * (10.0 + s * (6.0 * s - 15.0))
}

fn between(rng: &mut Pcg64Mcg, [least, most]: [f64; 2]) -> f64 {
    rng.random_range(least..most)
}

fn direction(rng: &mut Pcg64Mcg) -> DVec3 {
    let mut axis = || rng.random_range(-1.0..1.0);
    DVec3::new(axis(), axis(), axis()).normalize_or(DVec3::Y)
}

fn at_time(stops: &[Stop], seconds: f64) -> Pose {
    let after = stops.partition_point(|stop| stop.held[0] <= seconds).max(1);
    let now = &stops[after - 1];
    let [from, until] = now.held;
    match stops.get(after) {
        Some(next) if seconds > until => {
            let share = smooth((seconds - until) / (next.held[0] - until));
            blended(&now.jerked(until), &next.pose, share)
        }
        _ => now
            .sway
            .applied(&now.jerked(seconds), seconds - from, until - from),
    }
}

impl Stop {
    /// Its pose as far as jerks have moved it by then.
    fn jerked(&self, seconds: f64) -> Pose {
        let mut pose = self.pose.clone();
        for jerk in &self.jerks {
            jerk.applied(&mut pose, seconds);
        }
        pose
    }
}

fn blended(from: &Pose, to: &Pose, share: f64) -> Pose {
    let mut pose = from.clone();
    pose.root_translation_m = from.root_translation_m.lerp(to.root_translation_m, share);
    for (now, next) in pose.parent_from_joint.iter_mut().zip(to.parent_from_joint) {
        *now = now.slerp(next, share);
    }
    pose
}

/// A held pose with limbs, trunk and collars a little elsewhere, each side by itself.
fn drawn(held: &Held, joints_rest_m: &[Vec3; JOINT_COUNT], rng: &mut Pcg64Mcg) -> Pose {
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
mod tests {
    use super::*;

    fn joints() -> [Vec3; JOINT_COUNT] {
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

    #[test]
    fn clips_change_steadily_and_repeat_by_their_seed() {
        let held = |seed| HeldPoses {
            seed,
            duration_seconds: 12.0,
            movement: PoseMovement::Sways,
        };
        let clip = held(4).clip(&joints());
        assert_eq!(clip.frames.len(), 721);
        assert_eq!(clip.frames, held(4).clip(&joints()).frames);
        assert_ne!(clip.frames, held(5).clip(&joints()).frames);
        let mut turned = 0.0_f64;
        for pair in clip.frames.windows(2) {
            for (a, b) in pair[0]
                .parent_from_joint
                .iter()
                .zip(pair[1].parent_from_joint)
            {
                turned = turned.max(a.angle_between(b));
            }
        }
        // Half a turn in half a second at its fastest.
        assert!((0.02..0.25).contains(&turned), "{turned} rad in a tick");
    }

    #[test]
    fn jerks_are_small_and_the_body_stays_where_they_left_it() {
        let jerked = HeldPoses {
            seed: 3,
            duration_seconds: 12.0,
            movement: PoseMovement::Jerks,
        };
        let clip = jerked.clip(&joints());
        assert_eq!(clip.frames[0], Pose::REST);
        let speeds_m_s: Vec<f64> = clip
            .frames
            .windows(2)
            .map(|pair| {
                let moved_m = pair[1].root_translation_m - pair[0].root_translation_m;
                moved_m.length() * MODEL_RATE_HZ
            })
            .collect();
        // The first pose alone, which lasts for 2.55 s at least: jerks from 0.6 s on, each followed by stillness.
        let first = &speeds_m_s[..(2.5 * MODEL_RATE_HZ) as usize];
        let fastest = first.iter().fold(0.0_f64, |most, speed| most.max(*speed));
        assert!((0.02..0.8).contains(&fastest), "{fastest} m/s");
        assert!(first[..35].iter().all(|speed| *speed == 0.0));
        let still = first.iter().filter(|speed| **speed == 0.0).count();
        assert!(still > first.len() / 2, "{still} of {}", first.len());
    }
}
