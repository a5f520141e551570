//! Where the floor is.

use dynaskin_body::{JOINT_COUNT, Joint, Pose, WorldJoints};
use glam::{DVec3, Vec3};

/// Points of both soles in the rest pose with the joint that carries each.
///
/// Heel and toe tip lie beyond ankle and ball by a quarter and by half of the distance between
/// them, which fits adult feet.
fn sole_points_m(rest_m: &[Vec3; JOINT_COUNT]) -> [(Joint, DVec3); 6] {
    let side = |ankle: Joint, foot: Joint| {
        let [heel, ball] = [ankle, foot]
            .map(|joint| rest_m[joint as usize].as_dvec3() * DVec3::new(1.0, 0.0, 1.0));
        let along = ball - heel;
        [
            (ankle, heel - 0.25 * along),
            (ankle, ball),
            (foot, ball + 0.5 * along),
        ]
    };
    let left = side(Joint::LeftAnkle, Joint::LeftFoot);
    let right = side(Joint::RightAnkle, Joint::RightFoot);
    [left[0], left[1], left[2], right[0], right[1], right[2]]
}

fn heights_m(
    world: &WorldJoints,
    rest_m: &[Vec3; JOINT_COUNT],
    points_m: &[(Joint, DVec3); 6],
) -> [f64; 6] {
    points_m.map(|(joint, point_m)| {
        let idx = joint as usize;
        let lever_m = point_m - rest_m[idx].as_dvec3();
        (world.position_m[idx] + world.rotation[idx] * lever_m).y
    })
}

/// Height in metres of the lowest point of both soles in each frame.
fn lowest_m(frames: &[Pose], rest_m: &[Vec3; JOINT_COUNT]) -> Vec<f64> {
    let points_m = sole_points_m(rest_m);
    frames
        .iter()
        .map(|pose| {
            heights_m(&pose.world_joints(rest_m), rest_m, &points_m)
                .into_iter()
                .fold(f64::INFINITY, f64::min)
        })
        .collect()
}

/// The value below which a fraction of `values` lies.
fn quantile(values: &[f64], fraction: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().saturating_sub(1);
    sorted
        .get((fraction * last as f64).round() as usize)
        .copied()
        .unwrap_or_default()
}

/// Shifts the clip so that its first frame's root lies at x = z = 0 and the soles come down to
/// y = 0. A few frames may lie lower: captures have outliers.
pub fn put_on_floor(frames: &mut [Pose], rest_m: &[Vec3; JOINT_COUNT]) {
    let Some(first) = frames.first() else { return };
    let mut shift_m = -first.root_translation_m;
    shift_m.y = -quantile(&lowest_m(frames, rest_m), 0.05);
    for pose in frames {
        pose.root_translation_m += shift_m;
    }
}

/// How far from flat the soles stand while they stand: the median over the frames with the lowest
/// feet of one minus the cosine between sole and floor.
pub fn sole_tilt(frames: &[Pose], rest_m: &[Vec3; JOINT_COUNT]) -> f64 {
    let points_m = sole_points_m(rest_m);
    let mut lowest: Vec<(f64, f64)> = Vec::with_capacity(2 * frames.len());
    for pose in frames {
        let world = pose.world_joints(rest_m);
        let heights = heights_m(&world, rest_m, &points_m);
        for (side, ankle) in [Joint::LeftAnkle, Joint::RightAnkle]
            .into_iter()
            .enumerate()
        {
            let height_m = heights[3 * side..3 * side + 2].iter().sum::<f64>();
            lowest.push((
                height_m,
                1.0 - (world.rotation[ankle as usize] * DVec3::Y).y,
            ));
        }
    }
    lowest.sort_by(|a, b| a.0.total_cmp(&b.0));
    let standing: Vec<f64> = lowest
        .iter()
        .take(lowest.len().div_ceil(4))
        .map(|f| f.1)
        .collect();
    quantile(&standing, 0.5)
}
