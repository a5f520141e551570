//! Translations whose keys are in another unit than the nodes.

use super::AnimatedJoint;

/// Ratios of units that exporters mix: metres, centimetres and millimetres.
const RATIOS: [f64; 4] = [100.0, 1000.0, 0.01, 0.001];
/// A body that crouches or jumps has its pelvis within this factor of where it rests.
const SAME_HEIGHT: f64 = 1.3;
/// Least cosine between where a joint rests and where its keys have it: the same way, not somewhere else.
const SAME_WAY: f64 = 0.9;
/// Samples of a track.
const SAMPLES: usize = 9;

/// What is to be said of a joint that its keys put a hundred or a thousand times as far from its parent as
/// it rests, or the other way round, all the time.
pub fn unit_note(joints: &[AnimatedJoint]) -> Option<String> {
    let (name, ratio) = joints
        .iter()
        .find_map(|joint| Some((&joint.name, ratio(joint)?)))?;
    let (times, moves) = if ratio > 1.0 {
        (ratio, "far")
    } else {
        (1.0 / ratio, "near")
    };
    Some(format!(
        "the keys of `{name}` have it {times:.0} times as {moves} as it rests: the exporter seems to \
         mix units, and the body's way may be wrong by as much; apply the armature's scale and export \
         it again"
    ))
}

fn ratio(joint: &AnimatedJoint) -> Option<f64> {
    let track = joint.translation.as_ref()?;
    let rest = joint.rest.translation;
    let (start, end) = (track.start_seconds(), track.end_seconds());
    RATIOS.into_iter().find(|ratio| {
        (0..SAMPLES).all(|sample| {
            let part = sample as f64 / (SAMPLES - 1) as f64;
            let at = track.vector_at(start + part * (end - start));
            let is_same_way = at.dot(rest) > SAME_WAY * at.length() * rest.length();
            let over = at.length() / (ratio * rest.length());
            is_same_way && (1.0 / SAME_HEIGHT..SAME_HEIGHT).contains(&over)
        })
    })
}
