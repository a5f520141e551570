//! The body's pose from an avatar's bones, and back.

use dynaskin_skeleton::{JOINT_COUNT, Joint, Pose};
use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3};
use serde::{Deserialize, Serialize};

/// A bone of the avatar that turns a joint of the body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bone {
    /// Its node in the file.
    pub node: u32,
    /// The node's name.
    pub name: String,
    /// Where a skin has it; none for nodes that are no joint of a skinned mesh.
    pub joint: Option<SkinJoint>,
    /// Its world rotation where the avatar was bound.
    pub bind: DQuat,
    /// The avatar's metres in one unit of the bone's own space, where the avatar was bound.
    pub size_m: f64,
}

/// A joint of a skinned mesh: finds bones that have no names, or the names of others.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SkinJoint {
    /// Index of the mesh in the binding.
    pub mesh: u32,
    /// Index of the joint in the mesh's skin.
    pub joint: u32,
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
        let rotations: Vec<Option<DQuat>> = world.iter().copied().map(Some).collect();
        self.posed(&rotations, hips_m / size, body_joints_m)
    }

    /// The body's pose in which its joints turn as the avatar's bones do.
    ///
    /// `world_from_bone`: of each of [`Self::bones`], in the world's unit, whatever that is: how large the
    /// avatar stands there shows in the bones. A bone that is flattened to nothing turns as its parent.
    /// `size` is the binding's, `body_joints_m` the rest joints of the bound shape.
    pub fn pose_of_bones(
        &self,
        world_from_bone: &[DAffine3],
        size: f64,
        body_joints_m: &[Vec3; JOINT_COUNT],
    ) -> Pose {
        let rotations: Vec<Option<DQuat>> = world_from_bone
            .iter()
            .map(|bone| rotation_of(bone.matrix3))
            .collect();
        let hips_m = self.hips(world_from_bone) / self.units_per_m(world_from_bone);
        self.posed(&rotations, hips_m / size, body_joints_m)
    }

    /// The bone that turns the pelvis.
    pub fn pelvis_bone(&self) -> usize {
        self.bone_of(Joint::Pelvis).unwrap_or(0)
    }

    /// How far the pelvis must be moved in the world for the avatar to stand where the body does.
    ///
    /// `world_from_bone`: of each of [`Self::bones`], turned as [`Self::world_rotations`] says.
    /// `world_from_root`: of the avatar's root, in whose space the pose is meant.
    pub fn move_to(
        &self,
        pose: &Pose,
        world_from_bone: &[DAffine3],
        world_from_root: &DAffine3,
        size: f64,
        body_joints_m: &[Vec3; JOINT_COUNT],
    ) -> DVec3 {
        let (pelvis_m, hips_from_pelvis_m) = hips_of(body_joints_m);
        let hips_m = pose.parent_from_joint[0] * hips_from_pelvis_m + pelvis_m;
        let hips_m = (hips_m + pose.root_translation_m) * size;
        let root_units = world_from_root.matrix3.determinant().abs().cbrt();
        let hips = hips_m * (self.units_per_m(world_from_bone) / root_units);
        world_from_root.transform_point3(hips) - self.hips(world_from_bone)
    }

    fn bone_of(&self, joint: Joint) -> Option<usize> {
        match self.joints[joint as usize] {
            Turned::By(bone) => Some(usize::from(bone)),
            _ => None,
        }
    }

    /// Units of the world in a metre of the avatar.
    fn units_per_m(&self, world_from_bone: &[DAffine3]) -> f64 {
        let pelvis = self.pelvis_bone();
        match (world_from_bone.get(pelvis), self.bones.get(pelvis)) {
            (Some(now), Some(bone)) => now.matrix3.determinant().abs().cbrt() / bone.size_m,
            _ => 1.0,
        }
    }

    /// The middle between the hip joints in the world.
    fn hips(&self, world_from_bone: &[DAffine3]) -> DVec3 {
        let hips: Vec<DVec3> = [Joint::LeftHip, Joint::RightHip]
            .into_iter()
            .filter_map(|hip| Some(world_from_bone.get(self.bone_of(hip)?)?.translation))
            .collect();
        hips.iter().sum::<DVec3>() / hips.len().max(1) as f64
    }

    /// `rotations`: world rotation of each bone, none for those that have none. `hips_m`: the middle
    /// between the hip joints, in the body's metres.
    fn posed(
        &self,
        rotations: &[Option<DQuat>],
        hips_m: DVec3,
        body_joints_m: &[Vec3; JOINT_COUNT],
    ) -> Pose {
        let turned = |bone: u8| {
            let now = (*rotations.get(usize::from(bone))?)?;
            let bone = self.bones.get(usize::from(bone))?;
            Some(now * bone.bind.conjugate())
        };
        let mut rotation = [DQuat::IDENTITY; JOINT_COUNT];
        let mut pose = Pose::REST;
        for joint in Joint::ALL {
            let idx = joint as usize;
            let parent = joint.parent().map(|parent| parent as usize);
            let since_bind = match self.joints[idx] {
                Turned::By(bone) => turned(bone),
                Turned::Between(low, high, share) => match (turned(low), turned(high)) {
                    (Some(low), Some(high)) => Some(low.slerp(high, f64::from(share))),
                    (low, high) => low.or(high),
                },
                Turned::WithParent => None,
            };
            let with_parent = || {
                parent.map_or(DQuat::IDENTITY, |parent| {
                    rotation[parent] * self.turns[parent].conjugate()
                })
            };
            let since_bind = since_bind.unwrap_or_else(with_parent);
            rotation[idx] = (since_bind * self.turns[idx]).normalize();
            let above = parent.map_or(DQuat::IDENTITY, |parent| rotation[parent]);
            pose.parent_from_joint[idx] = (above.conjugate() * rotation[idx]).normalize();
        }
        let (pelvis_m, hips_from_pelvis_m) = hips_of(body_joints_m);
        pose.root_translation_m = hips_m - rotation[0] * hips_from_pelvis_m - pelvis_m;
        pose
    }

    /// World rotations of [`Self::bones`] in which the avatar stands as the body does: the way back from
    /// [`Self::pose`]. Bones between two joints take the turn of the joint nearest to them.
    ///
    /// Exact for every pose that [`Self::pose`] gives. A pose whose three spine joints turn as two bones
    /// cannot keeps the turns of all other joints and the direction from its lowest spine joint to its
    /// chest; with one bone the chest's turn alone.
    pub fn world_rotations(&self, pose: &Pose, body_joints_m: &[Vec3; JOINT_COUNT]) -> Vec<DQuat> {
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
        self.land_chest(&rotation, body_joints_m, &mut since_bind);
        let bones = self.bones.iter().zip(since_bind);
        bones
            .map(|(bone, turn)| turn.unwrap_or(DQuat::IDENTITY) * bone.bind)
            .collect()
    }

    /// Swings the lower of two spine bones until the chest lies in the direction in which the pose has it.
    ///
    /// The middle of the three joints then turns between both bones, whatever the pose has. Left alone that
    /// would move the chest, and neck, head and arms with it.
    fn land_chest(
        &self,
        rotation: &[DQuat; JOINT_COUNT],
        body_joints_m: &[Vec3; JOINT_COUNT],
        since_bind: &mut [Option<DQuat>],
    ) {
        let [spine1, spine2, spine3] =
            [Joint::Spine1, Joint::Spine2, Joint::Spine3].map(|joint| joint as usize);
        let (Turned::By(low), Turned::Between(from, to, share)) =
            (self.joints[spine1], self.joints[spine2])
        else {
            return;
        };
        let turn = |bone: u8| since_bind.get(usize::from(bone)).copied().flatten();
        let (Some(mut low_turn), Some(high_turn), true) = (turn(low), turn(to), from == low) else {
            return;
        };
        let way = |from: usize, to: usize| (body_joints_m[to] - body_joints_m[from]).as_dvec3();
        let (lower, upper) = (way(spine1, spine2), way(spine2, spine3));
        let wanted = rotation[spine1] * lower + rotation[spine2] * upper;
        for _ in 0..LANDING_ROUNDS {
            let middle_turn = low_turn.slerp(high_turn, f64::from(share));
            let found =
                low_turn * self.turns[spine1] * lower + middle_turn * self.turns[spine2] * upper;
            let (Some(found), Some(wanted)) = (found.try_normalize(), wanted.try_normalize())
            else {
                return;
            };
            low_turn = (DQuat::from_rotation_arc(found, wanted) * low_turn).normalize();
        }
        since_bind[usize::from(low)] = Some(low_turn);
    }
}

/// Rounds in which the chest is brought to its direction. Each leaves a quarter of the way, as the middle
/// joint follows the lower bone by half.
const LANDING_ROUNDS: usize = 16;

/// Where the pelvis rests, and the way from there to the middle between the hips, metres.
fn hips_of(body_joints_m: &[Vec3; JOINT_COUNT]) -> (DVec3, DVec3) {
    let at = |joint: Joint| body_joints_m[joint as usize].as_dvec3();
    let pelvis_m = at(Joint::Pelvis);
    let hips_m = 0.5 * (at(Joint::LeftHip) + at(Joint::RightHip));
    (pelvis_m, hips_m - pelvis_m)
}

/// The rotation nearest to a matrix, of a mirroring one that nearest to its negative; none where it
/// flattens.
pub fn rotation_of(matrix: DMat3) -> Option<DQuat> {
    // Newton's iteration for the polar factor (Higham 1986): few rounds from any scaled rotation.
    let size = matrix.determinant().cbrt();
    if !(size.is_finite() && size != 0.0) {
        return None;
    }
    let mut rotation = matrix * size.recip();
    for _ in 0..24 {
        let next = 0.5 * (rotation + rotation.inverse().transpose());
        let change = next - rotation;
        rotation = next;
        if change.to_cols_array().iter().all(|x| x.abs() < 1e-13) {
            break;
        }
    }
    rotation
        .is_finite()
        .then(|| DQuat::from_mat3(&rotation).normalize())
}
