//! Linear-blend and dual-quaternion skinning, and their inverses.
//!
//! Both map a rest-pose position (template, shape, pose correctives and offsets already added) to
//! the world, per vertex. Unposing inverts the map of each vertex, so an offset measured in the
//! world becomes an offset in the rest pose.

use dynaskin_skeleton::DualQuat;
use glam::{Affine3A, DMat3, DVec3, Mat3A, Vec3, Vec3A};

use crate::{JOINT_COUNT, Pose, SkinWeights, Skinning};

/// World-from-rest transform of every joint, for one shape and one pose.
#[derive(Clone, Debug)]
pub struct SkinMatrices {
    /// `world_from_rest[joint]` maps a rest-pose position rigidly attached to the joint to the
    /// world, in metres.
    pub world_from_rest: [Affine3A; JOINT_COUNT],
}

impl SkinMatrices {
    /// Forward kinematics in double precision, rounded once at the end.
    pub fn new(pose: &Pose, joints_rest_m: &[Vec3; JOINT_COUNT]) -> Self {
        let world = pose.world_joints(joints_rest_m);
        let world_from_rest = std::array::from_fn(|idx| {
            let rotation = world.rotation[idx];
            let translation_m = world.position_m[idx] - rotation * joints_rest_m[idx].as_dvec3();
            Affine3A::from_rotation_translation(rotation.as_quat(), translation_m.as_vec3())
        });
        Self { world_from_rest }
    }

    /// The linearly blended transform of one vertex. Not rigid where joints disagree.
    #[inline]
    pub fn blended(&self, skin: &SkinWeights) -> Affine3A {
        let mut x_axis = Vec3A::ZERO;
        let mut y_axis = Vec3A::ZERO;
        let mut z_axis = Vec3A::ZERO;
        let mut translation = Vec3A::ZERO;
        for (&joint, &weight) in skin.joints.iter().zip(&skin.weights) {
            let transform = &self.world_from_rest[joint as usize];
            x_axis += transform.matrix3.x_axis * weight;
            y_axis += transform.matrix3.y_axis * weight;
            z_axis += transform.matrix3.z_axis * weight;
            translation += transform.translation * weight;
        }
        Affine3A {
            matrix3: Mat3A::from_cols(x_axis, y_axis, z_axis),
            translation,
        }
    }
}

impl SkinMatrices {
    /// Inverse of the blended transform of one vertex, in double precision (single would lose
    /// 1e-5 m where a blend is nearly singular): `rest = linear * (world - translation)`.
    ///
    /// Where opposite rotations cancel, the blended matrix is singular; such a vertex keeps the
    /// rotation of its first joint.
    #[inline]
    pub fn unposing(&self, skin: &SkinWeights) -> Unposing {
        let mut blended = self.blended(skin);
        if blended.matrix3.determinant().abs() < 1e-3 {
            blended = self.world_from_rest[skin.joints[0] as usize];
        }
        let linear = DMat3::from_cols_array(&blended.matrix3.to_cols_array().map(f64::from));
        Unposing {
            linear: linear.inverse(),
            translation_m: Vec3::from(blended.translation).as_dvec3(),
        }
    }
}

/// The map of one vertex from the world back to the rest pose.
#[derive(Clone, Copy, Debug)]
pub struct Unposing {
    /// Inverse of the blended matrix.
    pub linear: DMat3,
    /// Translation of the blended transform in metres.
    pub translation_m: DVec3,
}

impl Unposing {
    /// The rest position of a world position, in metres.
    #[inline]
    pub fn rest_m(&self, world_m: Vec3) -> DVec3 {
        self.linear * (world_m.as_dvec3() - self.translation_m)
    }
}

/// Linear-blend skinning (both papers' Eq. 1): `rest_m` to `world_m`, metres, `[vertex]`.
///
/// # Panics
/// When the slices differ in length.
pub fn skin_linear(
    rest_m: &[Vec3],
    skin: &[SkinWeights],
    matrices: &SkinMatrices,
    world_m: &mut [Vec3],
) {
    assert!(rest_m.len() == skin.len() && rest_m.len() == world_m.len());
    for ((rest, skin), world) in rest_m.iter().zip(skin).zip(world_m) {
        *world = matrices.blended(skin).transform_point3(*rest);
    }
}

/// Skins positions and unit normals in one pass: `rest` into `skinned`, each `[vertex]`; where the slices
/// differ in length, as many as the shortest has.
///
/// Normals take the blended matrix itself, not its inverse transpose: it is a scaled rotation but for
/// a shear where joints disagree in linear skinning.
pub fn skin_surface(
    skinning: Skinning,
    weights: &[SkinWeights],
    matrices: &SkinMatrices,
    rest: (&[Vec3], &[Vec3]),
    skinned: (&mut [Vec3], &mut [Vec3]),
) {
    match skinning {
        Skinning::Linear => {
            skin_each(weights, rest, skinned, |weights| matrices.blended(weights));
        }
        Skinning::DualQuaternion => {
            let joints = dual_quats(matrices);
            skin_each(weights, rest, skinned, |weights| {
                blended_dual_quat(&joints, weights).to_affine()
            });
        }
    }
}

fn skin_each(
    weights: &[SkinWeights],
    rest: (&[Vec3], &[Vec3]),
    skinned: (&mut [Vec3], &mut [Vec3]),
    world_from_rest: impl Fn(&SkinWeights) -> Affine3A,
) {
    let sources = weights.iter().zip(rest.0.iter().zip(rest.1));
    let targets = skinned.0.iter_mut().zip(skinned.1);
    for ((weights, (position, normal)), (skinned_position, skinned_normal)) in sources.zip(targets)
    {
        let world_from_rest = world_from_rest(weights);
        *skinned_position = world_from_rest.transform_point3(*position);
        *skinned_normal = world_from_rest
            .transform_vector3(*normal)
            .normalize_or(*normal);
    }
}

/// Inverse of [`skin_linear`] per vertex: `world_m` to `rest_m`.
///
/// A vertex whose blend is singular is handled as [`SkinMatrices::unposing`] says.
///
/// # Panics
/// When the slices differ in length.
pub fn unpose_linear(
    world_m: &[Vec3],
    skin: &[SkinWeights],
    matrices: &SkinMatrices,
    rest_m: &mut [Vec3],
) {
    assert!(world_m.len() == skin.len() && world_m.len() == rest_m.len());
    for ((world, skin), rest) in world_m.iter().zip(skin).zip(rest_m) {
        *rest = matrices.unposing(skin).rest_m(*world).as_vec3();
    }
}

fn dual_quats(matrices: &SkinMatrices) -> [DualQuat; JOINT_COUNT] {
    matrices
        .world_from_rest
        .each_ref()
        .map(DualQuat::from_affine)
}

/// The blended motion of one vertex. The first joint weighs most, so it has a weight.
#[inline]
fn blended_dual_quat(joints: &[DualQuat; JOINT_COUNT], skin: &SkinWeights) -> DualQuat {
    let weighted = skin.joints.iter().zip(&skin.weights);
    DualQuat::blend(weighted.map(|(&joint, &weight)| (&joints[usize::from(joint)], weight)))
}

/// Dual-quaternion skinning (Kavan et al. 2008): rigid per vertex, so elbows and wrists keep
/// their volume when twisted. A uniform scale of the matrices comes first.
///
/// # Panics
/// When the slices differ in length.
pub fn skin_dual_quaternion(
    rest_m: &[Vec3],
    skin: &[SkinWeights],
    matrices: &SkinMatrices,
    world_m: &mut [Vec3],
) {
    assert!(rest_m.len() == skin.len() && rest_m.len() == world_m.len());
    let joints = dual_quats(matrices);
    for ((rest, skin), world) in rest_m.iter().zip(skin).zip(world_m) {
        *world = blended_dual_quat(&joints, skin)
            .to_affine()
            .transform_point3(*rest);
    }
}

/// Inverse of [`skin_dual_quaternion`] per vertex.
///
/// # Panics
/// When the slices differ in length.
pub fn unpose_dual_quaternion(
    world_m: &[Vec3],
    skin: &[SkinWeights],
    matrices: &SkinMatrices,
    rest_m: &mut [Vec3],
) {
    assert!(world_m.len() == skin.len() && world_m.len() == rest_m.len());
    let joints = dual_quats(matrices);
    for ((world, skin), rest) in world_m.iter().zip(skin).zip(rest_m) {
        let motion = blended_dual_quat(&joints, skin);
        *rest = motion.real.conjugate() * (*world - motion.translation_m()) / motion.scale;
    }
}
