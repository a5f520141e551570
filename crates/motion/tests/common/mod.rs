//! What several tests need.

use dynaskin_body::JOINT_COUNT;
use glam::Vec3;

/// Rest joints in metres of an average adult woman in an A-pose: upper arms 48 degrees down,
/// elbows bent, legs slightly apart.
pub fn a_pose_m() -> [Vec3; JOINT_COUNT] {
    // Midline joints, then the left ones; the right ones are their mirror images.
    let mut joints = [Vec3::ZERO; JOINT_COUNT];
    let middle = [
        (0, [0.0, 0.8249, 0.0]),
        (3, [0.0, 0.8970, -0.0456]),
        (6, [0.0, 1.0499, -0.0116]),
        (9, [0.0, 1.2022, -0.0106]),
        (12, [0.0, 1.3448, -0.0247]),
        (15, [0.0, 1.4499, 0.0176]),
    ];
    let left = [
        (1, [0.0943, 0.8137, -0.0059]),
        (4, [0.1337, 0.4458, 0.0245]),
        (7, [0.1634, 0.0682, 0.0068]),
        (10, [0.1767, 0.0237, 0.1282]),
        (13, [0.0227, 1.2770, -0.0025]),
        (16, [0.1536, 1.2618, -0.0026]),
        (18, [0.3105, 1.0905, 0.0013]),
        (20, [0.4198, 0.9707, 0.1356]),
        (22, [0.4452, 0.9302, 0.2191]),
    ];
    for (idx, position) in middle {
        joints[idx] = Vec3::from_array(position);
    }
    for (idx, position) in left {
        joints[idx] = Vec3::from_array(position);
        joints[idx + 1] = joints[idx] * Vec3::new(-1.0, 1.0, 1.0);
    }
    joints
}
