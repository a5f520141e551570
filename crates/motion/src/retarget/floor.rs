//! Where the floor is, and how flat the soles stand on it.

use dynaskin_body::{JOINT_COUNT, Joint, Pose};
use glam::{DVec3, Vec3};

/// Below this speed of the sole, in m/s, a foot counts as standing.
const STANDING_SPEED: f64 = 0.4;

/// The left and the right ankle with the joint of their ball.
const FEET: [(Joint, Joint); 2] = [
    (Joint::LeftAnkle, Joint::LeftFoot),
    (Joint::RightAnkle, Joint::RightFoot),
];

/// A sole at one frame.
struct Sole {
    /// Middle between heel and ball, in metres.
    middle_m: DVec3,
    /// The lower one of heel and ball, in metres.
    lowest_m: f64,
    /// Height of the unit vectors up and ahead of the foot: 1 and 0 on a flat sole.
    up_y: f64,
    ahead_y: f64,
    /// Speed of the middle in m/s.
    speed: f64,
}

/// The soles of one foot over the frames.
///
/// The heel lies behind the ankle by a quarter of the distance from ankle to ball, which fits adult
/// feet. Toes are left out: captured toes are noisy, and where they bend the ball stands.
fn soles(
    frames: &[Pose],
    frame_seconds: f64,
    rest_m: &[Vec3; JOINT_COUNT],
    (ankle, ball): (Joint, Joint),
) -> Vec<Sole> {
    let on_floor = |joint: Joint| rest_m[joint as usize].as_dvec3() * DVec3::new(1.0, 0.0, 1.0);
    let (under_ankle_m, ball_m) = (on_floor(ankle), on_floor(ball));
    let heel_m = under_ankle_m - 0.25 * (ball_m - under_ankle_m);
    let ankle_m = rest_m[ankle as usize].as_dvec3();
    let mut soles: Vec<Sole> = Vec::with_capacity(frames.len());
    for pose in frames {
        let world = pose.world_joints(rest_m);
        let rotation = world.rotation[ankle as usize];
        let [heel_m, ball_m] = [heel_m, ball_m]
            .map(|point_m| world.position_m[ankle as usize] + rotation * (point_m - ankle_m));
        let middle_m = 0.5 * (heel_m + ball_m);
        let before_m = soles.last().map_or(middle_m, |before| before.middle_m);
        soles.push(Sole {
            middle_m,
            lowest_m: heel_m.y.min(ball_m.y),
            up_y: (rotation * DVec3::Y).y,
            ahead_y: (rotation * DVec3::Z).y,
            speed: middle_m.distance(before_m) / frame_seconds,
        });
    }
    // The first frame has none before it to measure its speed by.
    if let [first, second, ..] = soles.as_mut_slice() {
        first.speed = second.speed;
    }
    soles
}

fn is_standing(sole: &&Sole) -> bool {
    sole.speed < STANDING_SPEED
}

/// The value below which a fraction of `values` lies.
fn quantile(mut values: Vec<f64>, fraction: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let last = values.len().saturating_sub(1);
    values
        .get((fraction * last as f64).round() as usize)
        .copied()
        .unwrap_or_default()
}

/// Shifts the clip so that its first frame's root lies at x = z = 0 and standing soles at y = 0.
/// Single frames may lie lower: captures have outliers.
pub fn put_on_floor(frames: &mut [Pose], frame_seconds: f64, rest_m: &[Vec3; JOINT_COUNT]) {
    let Some(first) = frames.first() else { return };
    let mut shift_m = -first.root_translation_m;
    let [left, right] = FEET.map(|foot| soles(frames, frame_seconds, rest_m, foot));
    let standing: Vec<f64> = left
        .iter()
        .chain(&right)
        .filter(is_standing)
        .map(|sole| sole.lowest_m)
        .collect();
    shift_m.y = -if standing.len() > frames.len() / 20 {
        quantile(standing, 0.2)
    } else {
        // Running hardly leaves a foot standing.
        let lowest = left
            .iter()
            .zip(&right)
            .map(|(left, right)| left.lowest_m.min(right.lowest_m));
        quantile(lowest.collect(), 0.05)
    };
    for pose in frames {
        pose.root_translation_m += shift_m;
    }
}

/// How far from flat the lowest quarter of all soles is: the median of one minus the cosine of the
/// angle between sole and floor.
pub fn sole_tilt(frames: &[Pose], frame_seconds: f64, rest_m: &[Vec3; JOINT_COUNT]) -> f64 {
    let mut all: Vec<Sole> = FEET
        .into_iter()
        .flat_map(|foot| soles(frames, frame_seconds, rest_m, foot))
        .collect();
    all.sort_by(|a, b| a.middle_m.y.total_cmp(&b.middle_m.y));
    all.truncate(all.len().div_ceil(4));
    quantile(all.into_iter().map(|sole| 1.0 - sole.up_y).collect(), 0.5)
}

/// Angles in radians by which the toes of the left and the right foot point up while standing
/// (median). 0 for a foot that hardly stands still.
pub fn standing_pitch(
    frames: &[Pose],
    frame_seconds: f64,
    rest_m: &[Vec3; JOINT_COUNT],
) -> [f64; 2] {
    FEET.map(|foot| {
        let soles = soles(frames, frame_seconds, rest_m, foot);
        let ahead: Vec<f64> = soles
            .iter()
            .filter(is_standing)
            .map(|sole| sole.ahead_y)
            .collect();
        if ahead.len() < 10 {
            return 0.0;
        }
        quantile(ahead, 0.5).clamp(-1.0, 1.0).asin()
    })
}

/// Whether somebody stands at all: in ten frames or more a foot rests below hips that are more than
/// 0.6 legs above it.
pub fn ever_stands(frames: &[Pose], frame_seconds: f64, rest_m: &[Vec3; JOINT_COUNT]) -> bool {
    let at = |joint: Joint| rest_m[joint as usize].as_dvec3();
    let leg_m = at(Joint::LeftHip).distance(at(Joint::LeftKnee))
        + at(Joint::LeftKnee).distance(at(Joint::LeftAnkle));
    let mut count = 0;
    for foot in FEET {
        let hip = if foot.0 == Joint::LeftAnkle {
            Joint::LeftHip
        } else {
            Joint::RightHip
        };
        let soles = soles(frames, frame_seconds, rest_m, foot);
        for (sole, pose) in soles.iter().zip(frames) {
            let hip_m = pose.world_joints(rest_m).position_m[hip as usize];
            count += usize::from(is_standing(&sole) && hip_m.y - sole.middle_m.y > 0.6 * leg_m);
        }
    }
    count >= 10
}
