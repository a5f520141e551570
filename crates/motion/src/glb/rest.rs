//! Where the joints of a skin rest.

use glam::{DAffine3, DQuat, DVec3};

use super::AnimatedJoint;

/// Below these, nodes and inverse bind matrices say the same: radians, and parts of a bone.
const SAME_TURN: f64 = 0.01;
const SAME_PLACE: f64 = 0.01;

/// World rotations and positions of the joints as a skin was bound, in the size and with the axes that
/// the nodes have; none where no skin says otherwise than the nodes.
pub fn bound(
    joints: &[AnimatedJoint],
    by_nodes: &[(DQuat, DVec3)],
    binds: &[Option<DAffine3>],
) -> Option<Vec<(DQuat, DVec3)>> {
    let binds: Vec<Option<(DQuat, DVec3)>> = binds
        .iter()
        .map(|bind| {
            bind.map(|bind| {
                let (_, rotation, position) = bind.to_scale_rotation_translation();
                (rotation.normalize(), position)
            })
        })
        .collect();
    let first = binds.iter().position(Option::is_some)?;
    let bones = || {
        joints.iter().enumerate().filter_map(|(idx, joint)| {
            let parent = joint.parent?;
            let bone = binds[idx]?.1 - binds[parent]?.1;
            Some((bone.length(), by_nodes[idx].1.distance(by_nodes[parent].1)))
        })
    };
    let bind_length: f64 = bones().map(|(bind, _)| bind).sum();
    let node_length: f64 = bones().map(|(_, node)| node).sum();
    let scale = node_length / bind_length;
    if !(scale.is_finite() && scale > 0.0) {
        return None;
    }
    let to_world = axes_between(by_nodes, &binds);
    let origin = by_nodes[first].1 - scale * (to_world * binds[first]?.1);
    let mut differs = false;
    let mean_bone = node_length / bones().count().max(1) as f64;
    let mut rest: Vec<(DQuat, DVec3)> = Vec::with_capacity(joints.len());
    for (idx, joint) in joints.iter().enumerate() {
        let node = by_nodes[idx];
        rest.push(match (binds[idx], joint.parent) {
            (Some((rotation, position)), _) => {
                let bind = (
                    (to_world * rotation).normalize(),
                    origin + scale * (to_world * position),
                );
                let turn = 2.0 * bind.0.dot(node.0).abs().min(1.0).acos();
                differs |= turn > SAME_TURN || bind.1.distance(node.1) > SAME_PLACE * mean_bone;
                bind
            }
            (None, Some(parent)) => {
                let turn = rest[parent].0 * by_nodes[parent].0.inverse();
                let from_parent = node.1 - by_nodes[parent].1;
                (
                    (turn * node.0).normalize(),
                    rest[parent].1 + turn * from_parent,
                )
            }
            (None, None) => node,
        });
    }
    differs.then_some(rest)
}

/// The turn by multiples of 90 degrees that takes the axes of the skin's vertices to the world's: the
/// one that most joints agree on.
fn axes_between(by_nodes: &[(DQuat, DVec3)], binds: &[Option<(DQuat, DVec3)>]) -> DQuat {
    let quarter = std::f64::consts::FRAC_PI_2;
    let tops = [
        DQuat::IDENTITY,
        DQuat::from_rotation_x(quarter),
        DQuat::from_rotation_x(-quarter),
        DQuat::from_rotation_x(2.0 * quarter),
        DQuat::from_rotation_z(quarter),
        DQuat::from_rotation_z(-quarter),
    ];
    let agreement = |turn: DQuat| -> f64 {
        let joints = by_nodes.iter().zip(binds);
        joints
            .filter_map(|(node, bind)| Some((turn * (*bind)?.0).dot(node.0).powi(2)))
            .sum()
    };
    let mut best = (f64::MIN, DQuat::IDENTITY);
    for top in tops {
        for about in 0..4 {
            let turn = DQuat::from_rotation_y(f64::from(about) * quarter) * top;
            let agreed = agreement(turn);
            if agreed > best.0 + 1e-6 {
                best = (agreed, turn);
            }
        }
    }
    best.1
}
