//! Which bones of an avatar drive the body's joints.

use dynaskin_binding::{Bone, Rig, SkinJoint, Turned, rotation_of};
use dynaskin_motion::Drive;
use dynaskin_skeleton::JOINT_COUNT;
use glam::DQuat;

use crate::avatar::Avatar;
use crate::bones::Bones;

/// The bones that drive the joints, and how they stood.
pub fn rig(avatar: &Avatar, bones: &Bones, turns: [DQuat; JOINT_COUNT]) -> Rig {
    let mut rig = Rig {
        bones: Vec::new(),
        joints: [Turned::WithParent; JOINT_COUNT],
        turns,
        metres_per_unit: bones.bind.metres_per_unit,
    };
    for (joint, drive) in bones.drives.into_iter().enumerate() {
        let mut bone = |node: usize| number(&mut rig.bones, avatar, bones, node);
        rig.joints[joint] = match drive {
            Drive::Joint(node) => Turned::By(bone(node)),
            Drive::Between(low, high, share) => {
                Turned::Between(bone(low), bone(high), share as f32)
            }
            Drive::Parent => Turned::WithParent,
        };
    }
    rig
}

/// The number of the bone of a node.
fn number(known: &mut Vec<Bone>, avatar: &Avatar, bones: &Bones, node: usize) -> u8 {
    let number = known
        .iter()
        .position(|bone| bone.node as usize == node)
        .unwrap_or_else(|| {
            known.push(bone(avatar, bones, node));
            known.len() - 1
        });
    // Two a joint at most.
    number as u8
}

fn bone(avatar: &Avatar, bones: &Bones, node: usize) -> Bone {
    let matrix = bones.bind.world_from_node[node].matrix3;
    let size_m = matrix.determinant().abs().cbrt();
    let mut places = avatar.meshes.iter().enumerate().filter_map(|(mesh, own)| {
        let joint = own.joints.iter().position(|joint| *joint == node)?;
        Some(SkinJoint {
            mesh: mesh as u32,
            joint: joint as u32,
        })
    });
    Bone {
        node: node as u32,
        name: avatar.nodes[node].name.clone(),
        joint: places.next(),
        bind: rotation_of(matrix).unwrap_or(DQuat::IDENTITY),
        size_m: if size_m.is_finite() && size_m > 0.0 {
            size_m
        } else {
            1.0
        },
    }
}
