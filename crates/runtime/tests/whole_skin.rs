//! Skin stays whole on a shipped body, whatever gains neighbouring regions are given.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

#[path = "support/shipped.rs"]
mod shipped;

use dynaskin_body::Region;
use dynaskin_motion::{Procedural, ProceduralKind};
use dynaskin_runtime::{Avatar, Controls};

const DT: f64 = 1.0 / 60.0;
const MAX_STRAIN: f32 = 0.5;
/// Edges shorter than this are left out, in metres.
const LEAST_EDGE_M: f32 = 0.003;
/// Gains, stiffness and damping of chest, belly, buttocks, thighs, calves and upper arms.
const GAINS: [f32; 6] = [1.93, 0.127, 1.712, 0.162, 0.906, 0.111];
const STIFFNESS: [f32; 6] = [0.762, 1.042, 0.319, 3.955, 0.692, 0.451];
const DAMPING: [f32; 6] = [2.855, 0.655, 1.788, 0.757, 0.295, 3.672];
const LIMITS_M: [f32; 6] = [0.08, 0.12, 0.06, 0.10, 0.025, 0.08];
/// A body of large buttocks, whose skin is drawn most between thighs that hardly move.
const SHAPE: [f32; 10] = [
    -1.73, 4.04, 1.31, 0.04, -0.31, 0.1, -1.21, -0.47, -0.58, 0.32,
];

/// The largest strain of the edges in the rest pose.
fn largest_strain(avatar: &Avatar, faces: &[[u32; 3]]) -> f32 {
    let (offsets, shown) = (avatar.offsets_rest_m(), avatar.positions_rest_m());
    let edges = faces.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]);
    edges
        .map(|pair| pair.map(|vertex| vertex as usize))
        .filter_map(|[a, b]| {
            let rest_m = (shown[a] - offsets[a]).distance(shown[b] - offsets[b]);
            (rest_m >= LEAST_EDGE_M).then(|| offsets[a].distance(offsets[b]) / rest_m)
        })
        .fold(0.0, f32::max)
}

#[test]
fn neighbours_of_other_gains_do_not_tear_the_skin() {
    let model = shipped::model("female");
    let mut avatar = Avatar::new(std::sync::Arc::clone(&model), &SHAPE).unwrap();
    let mut controls = Controls::default();
    controls.strength = 3.07;
    for region in Region::ALL {
        let at = region as usize;
        let of_region = &mut controls.regions[at];
        of_region.gain = GAINS[at];
        of_region.stiffness = STIFFNESS[at];
        of_region.damping = DAMPING[at];
        of_region.limit_m = LIMITS_M[at];
    }
    avatar.set_controls(&controls).unwrap();
    let mut jump = Procedural::new(ProceduralKind::Jump);
    jump.duration_seconds = 6.0;
    let clip = jump.clip(avatar.joints_rest_m()).unwrap();
    let (mut free, mut held) = (0.0_f32, 0.0_f32);
    for tick in 0..240 {
        avatar.set_max_strain(None).unwrap();
        avatar
            .step(&clip.pose_at(1.0 + f64::from(tick) * DT), DT)
            .unwrap();
        if tick % 4 == 3 {
            free = free.max(largest_strain(&avatar, &model.body().faces));
            avatar.set_max_strain(Some(MAX_STRAIN)).unwrap();
            held = held.max(largest_strain(&avatar, &model.body().faces));
        }
    }
    println!("largest strain {free:.2}, held {held:.2}");
    assert!(free > 2.0, "{free}");
    assert!(held < 1.5 * MAX_STRAIN, "{held}");
}
