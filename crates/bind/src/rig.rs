//! The body's pose from an avatar's bones, and back.

use dynaskin_motion::Drive;
use dynaskin_skeleton::{JOINT_COUNT, Joint, Pose};
use glam::{DQuat, DVec3, Vec3};
use serde::{Deserialize, Serialize};

use crate::avatar::Avatar;
use crate::bones::Bones;

/// A bone of the avatar that turns a joint of the body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bone {
    /// Its node in the file.
    pub node: u32,
    /// The node's name.
    pub name: String,
    /// Its world rotation where the avatar was bound.
    pub bind: DQuat,
}

/// What turns a joint: indices into [`Rig::bones`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Turned {
    /// By one bone.
    By(u8),
    /// Between two bones, by this share of the way.
    Between(u8, u8, f32),
    /// By nothing: as its parent.
    WithParent,
}

/// The bones that turn the body's joints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rig {
    /// The bones.
    pub bones: Vec<Bone>,
    /// `[joint]`, SMPL's order.
    pub joints: [Turned; JOINT_COUNT],
    /// World rotations of the body's joints where the avatar was bound, from the body's rest pose.
    pub turns: [DQuat; JOINT_COUNT],
    /// The avatar's metres per the file's unit.
    pub metres_per_unit: f64,
}

impl Rig {
    pub(crate) fn new(avatar: &Avatar, bones: &Bones, turns: [DQuat; JOINT_COUNT]) -> Self {
        let mut rig = Self {
            bones: Vec::new(),
            joints: [Turned::WithParent; JOINT_COUNT],
            turns,
            metres_per_unit: bones.bind.metres_per_unit,
        };
        for (joint, drive) in bones.drives.into_iter().enumerate() {
            let mut bone = |node: usize| rig.bone(avatar, bones, node);
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
    fn bone(&mut self, avatar: &Avatar, bones: &Bones, node: usize) -> u8 {
        let known = self
            .bones
            .iter()
            .position(|bone| bone.node as usize == node);
        let number = known.unwrap_or_else(|| {
            let matrix = bones.bind.world_from_node[node].matrix3;
            self.bones.push(Bone {
                node: node as u32,
                name: avatar.nodes[node].name.clone(),
                bind: crate::bind_pose::rotation_of(matrix).unwrap_or(DQuat::IDENTITY),
            });
            self.bones.len() - 1
        });
        // Two a joint at most.
        number as u8
    }

    /// The body's pose in which its joints turn as the avatar's bones do.
    ///
    /// `world`: world rotation of each of [`Self::bones`]. `hips_m`: the middle between the avatar's
    /// hip joints, metres. `size` is the binding's, `body_joints_m` the rest joints of the bound shape.
    pub fn pose(
        &self,
        world: &[DQuat],
        hips_m: DVec3,
        size: f64,
        body_joints_m: &[Vec3; JOINT_COUNT],
    ) -> Pose {
        let turned = |bone: u8| {
            let bone = usize::from(bone);
            let now = world.get(bone).copied().unwrap_or(DQuat::IDENTITY);
            self.bones
                .get(bone)
                .map_or(now, |bone| now * bone.bind.conjugate())
        };
        let mut rotation = [DQuat::IDENTITY; JOINT_COUNT];
        let mut pose = Pose::REST;
        for joint in Joint::ALL {
            let idx = joint as usize;
            let parent = joint.parent().map(|parent| parent as usize);
            let since_bind = match self.joints[idx] {
                Turned::By(bone) => turned(bone),
                Turned::Between(low, high, share) => {
                    turned(low).slerp(turned(high), f64::from(share))
                }
                Turned::WithParent => parent.map_or(DQuat::IDENTITY, |parent| {
                    rotation[parent] * self.turns[parent].conjugate()
                }),
            };
            rotation[idx] = (since_bind * self.turns[idx]).normalize();
            let above = parent.map_or(DQuat::IDENTITY, |parent| rotation[parent]);
            pose.parent_from_joint[idx] = (above.conjugate() * rotation[idx]).normalize();
        }
        let at = |joint: Joint| body_joints_m[joint as usize].as_dvec3();
        let pelvis_m = at(Joint::Pelvis);
        let hips_from_pelvis_m = 0.5 * (at(Joint::LeftHip) + at(Joint::RightHip)) - pelvis_m;
        pose.root_translation_m = hips_m / size - rotation[0] * hips_from_pelvis_m - pelvis_m;
        pose
    }

    /// World rotations of [`Self::bones`] in which the avatar stands as the body does: the way back from
    /// [`Self::pose`]. Bones between two joints take the turn of the joint nearest to them.
    pub fn world_rotations(&self, pose: &Pose) -> Vec<DQuat> {
        let mut rotation = [DQuat::IDENTITY; JOINT_COUNT];
        let mut since_bind = vec![None; self.bones.len()];
        for joint in Joint::ALL {
            let idx = joint as usize;
            let above = joint
                .parent()
                .map_or(DQuat::IDENTITY, |parent| rotation[parent as usize]);
            rotation[idx] = above * pose.parent_from_joint[idx];
            let turn = rotation[idx] * self.turns[idx].conjugate();
            match self.joints[idx] {
                Turned::By(bone) => since_bind[usize::from(bone)] = Some(turn),
                Turned::Between(_, high, share) if share > 0.5 => {
                    let high = &mut since_bind[usize::from(high)];
                    *high = high.or(Some(turn));
                }
                _ => {}
            }
        }
        let bones = self.bones.iter().zip(since_bind);
        bones
            .map(|(bone, turn)| turn.unwrap_or(DQuat::IDENTITY) * bone.bind)
            .collect()
    }
}
