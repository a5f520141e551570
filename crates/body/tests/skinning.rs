//! Skinning and unposing over the default body.

mod common;

use std::sync::LazyLock;

use common::default_bodies;
use dynaskin_body::{
    BodyModel, JOINT_COUNT, Joint, Pose, SHAPE_COUNT, SkinMatrices, Skinning, skin_dual_quaternion,
    skin_linear, skin_surface, unpose_dual_quaternion, unpose_linear, vertex_normals,
};
use glam::{Affine3A, DQuat, DVec3, Vec3};
use proptest::prelude::*;

static BODY: LazyLock<BodyModel> = LazyLock::new(|| default_bodies().remove(0));

/// Poses with every joint turned up to `limit` radians about any axis.
fn poses(limit: f64) -> impl Strategy<Value = Pose> {
    let number = -1.0..1.0_f64;
    let turn = prop::array::uniform3(number).prop_map(move |xyz| {
        let scaled = DVec3::from_array(xyz) * (limit / 3.0_f64.sqrt());
        DQuat::from_scaled_axis(scaled)
    });
    (
        prop::array::uniform3(-3.0..3.0_f64),
        prop::collection::vec(turn, JOINT_COUNT),
    )
        .prop_map(|(translation, turns)| Pose {
            root_translation_m: DVec3::from_array(translation),
            parent_from_joint: std::array::from_fn(|joint| turns[joint]),
        })
}

fn worst_m(a: &[Vec3], b: &[Vec3]) -> f32 {
    a.iter()
        .zip(b)
        .map(|(a, b)| a.distance(*b))
        .fold(0.0, f32::max)
}

/// Linear-blend skinning in double precision, straight from the equation.
fn reference(pose: &Pose, rest_m: &[Vec3], joints_m: &[Vec3; JOINT_COUNT]) -> Vec<Vec3> {
    let world = pose.world_joints(joints_m);
    rest_m
        .iter()
        .zip(&BODY.skin)
        .map(|(rest, skin)| {
            let moved: DVec3 = (0..4)
                .map(|slot| {
                    let joint = usize::from(skin.joints[slot]);
                    let local = (*rest - joints_m[joint]).as_dvec3();
                    let placed = world.rotation[joint] * local + world.position_m[joint];
                    f64::from(skin.weights[slot]) * placed
                })
                .sum();
            moved.as_vec3()
        })
        .collect()
}

/// Dual-quaternion skinning of a body that is `scale` times as large, in double precision, straight from the
/// equations.
fn dual_reference(
    pose: &Pose,
    scale: f64,
    rest_m: &[Vec3],
    joints_m: &[Vec3; JOINT_COUNT],
) -> Vec<Vec3> {
    let world = pose.world_joints(joints_m);
    let motions: [(DQuat, DQuat); JOINT_COUNT] = std::array::from_fn(|joint| {
        let real = world.rotation[joint];
        let moved = scale * (world.position_m[joint] - real * joints_m[joint].as_dvec3());
        let half = 0.5 * moved;
        (real, DQuat::from_xyzw(half.x, half.y, half.z, 0.0) * real)
    });
    let skinned = rest_m.iter().zip(&BODY.skin).map(|(rest, skin)| {
        let pivot = motions[usize::from(skin.joints[0])].0;
        let zero = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0);
        let (real, dual) = (0..4).fold((zero, zero), |(real, dual), slot| {
            let motion = motions[usize::from(skin.joints[slot])];
            let weight = f64::from(skin.weights[slot]);
            let weight = weight * if motion.0.dot(pivot) < 0.0 { -1.0 } else { 1.0 };
            (real + motion.0 * weight, dual + motion.1 * weight)
        });
        let (real, dual) = (real * real.length().recip(), dual * real.length().recip());
        let moved = (dual * real.conjugate()) * 2.0;
        let turned = real * (scale * rest.as_dvec3());
        (turned + DVec3::new(moved.x, moved.y, moved.z)).as_vec3()
    });
    skinned.collect()
}

/// Matrices of a body that is `scale` times as large.
fn scaled(pose: &Pose, joints_m: &[Vec3; JOINT_COUNT], scale: f32) -> SkinMatrices {
    let mut matrices = SkinMatrices::new(pose, joints_m);
    let larger = Affine3A::from_scale(Vec3::splat(scale));
    matrices.world_from_rest = matrices.world_from_rest.map(|matrix| larger * matrix);
    matrices
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn linear_skinning_is_the_equation_and_unposing_its_inverse(
        pose in poses(1.2), beta in prop::array::uniform10(-2.0..2.0_f32)
    ) {
        let shaped = BODY.shaped(&beta);
        let matrices = SkinMatrices::new(&pose, &shaped.joints_m);
        let mut world = vec![Vec3::ZERO; shaped.positions_m.len()];
        skin_linear(&shaped.positions_m, &BODY.skin, &matrices, &mut world);
        let expected = reference(&pose, &shaped.positions_m, &shaped.joints_m);
        prop_assert!(worst_m(&world, &expected) < 5e-6);
        let mut rest = world.clone();
        unpose_linear(&world, &BODY.skin, &matrices, &mut rest);
        let error = worst_m(&rest, &shaped.positions_m);
        prop_assert!(error <= 1e-5, "{error}");
    }

    #[test]
    fn dual_quaternion_skinning_is_the_equation_at_any_scale(
        pose in poses(2.5), scale in 0.1..10.0_f32
    ) {
        let shaped = BODY.shaped(&[0.3; SHAPE_COUNT]);
        let matrices = scaled(&pose, &shaped.joints_m, scale);
        let mut world = vec![Vec3::ZERO; shaped.positions_m.len()];
        skin_dual_quaternion(&shaped.positions_m, &BODY.skin, &matrices, &mut world);
        let expected =
            dual_reference(&pose, f64::from(scale), &shaped.positions_m, &shaped.joints_m);
        let error = worst_m(&world, &expected);
        prop_assert!(error <= 1e-5 * scale.max(1.0), "{error}");
        let normals = vertex_normals(&shaped.positions_m, &BODY.faces);
        let (mut positions, mut turned) = (world.clone(), world.clone());
        let rest = (&*shaped.positions_m, &*normals);
        let target = (&mut *positions, &mut *turned);
        skin_surface(Skinning::DualQuaternion, &BODY.skin, &matrices, rest, target);
        prop_assert_eq!(positions, world);
        prop_assert!(turned.iter().all(|normal| (normal.length() - 1.0).abs() < 1e-5));
    }

    #[test]
    fn no_pose_takes_skin_further_from_the_pelvis_than_adapters_reckon(pose in poses(3.1)) {
        let shaped = BODY.shaped(&[0.0; SHAPE_COUNT]);
        let matrices = SkinMatrices::new(&pose, &shaped.joints_m);
        let mut world = vec![Vec3::ZERO; shaped.positions_m.len()];
        skin_dual_quaternion(&shaped.positions_m, &BODY.skin, &matrices, &mut world);
        let pelvis = matrices.world_from_rest[0].transform_point3(shaped.joints_m[0]);
        let farthest = world.iter().map(|at| at.distance(pelvis)).fold(0.0, f32::max);
        prop_assert!(farthest < reach_m(&shaped.positions_m, &shaped.joints_m), "{farthest}");
    }

    #[test]
    fn dual_quaternion_unposing_is_the_inverse(pose in poses(2.5), scale in 0.5..2.0_f32) {
        let shaped = BODY.shaped(&[0.0; SHAPE_COUNT]);
        let matrices = scaled(&pose, &shaped.joints_m, scale);
        let mut world = vec![Vec3::ZERO; shaped.positions_m.len()];
        skin_dual_quaternion(&shaped.positions_m, &BODY.skin, &matrices, &mut world);
        let mut rest = world.clone();
        unpose_dual_quaternion(&world, &BODY.skin, &matrices, &mut rest);
        let error = worst_m(&rest, &shaped.positions_m);
        prop_assert!(error <= 1e-5, "{error}");
    }
}

/// As `reachM` of the SDK's adapters: the longest chain of bones, and twice the largest distance of skin from
/// its nearest joint.
fn reach_m(positions_m: &[Vec3], joints_m: &[Vec3; JOINT_COUNT]) -> f32 {
    let mut chains = [0.0_f32; JOINT_COUNT];
    for joint in Joint::ALL {
        if let Some(parent) = joint.parent() {
            let length = joints_m[joint as usize].distance(joints_m[parent as usize]);
            chains[joint as usize] = chains[parent as usize] + length;
        }
    }
    let nearest = |at: &Vec3| {
        let all = joints_m.iter().map(|joint| joint.distance(*at));
        all.fold(f32::INFINITY, f32::min)
    };
    let farthest = positions_m.iter().map(nearest).fold(0.0, f32::max);
    chains.into_iter().fold(0.0, f32::max) + 2.0 * farthest
}

/// Quaternions of a joint and its parent on opposite sides: an arm that has gone round once.
#[test]
fn a_turn_the_long_way_round_is_the_same_turn() {
    let shaped = BODY.shaped(&[0.0; SHAPE_COUNT]);
    let mut pose = Pose::REST;
    pose.parent_from_joint[18] = DQuat::from_rotation_z(0.9);
    let mut other = pose.clone();
    other.parent_from_joint[18] = -pose.parent_from_joint[18];
    let mut skins = [&pose, &other].map(|pose| {
        let matrices = SkinMatrices::new(pose, &shaped.joints_m);
        let mut world = vec![Vec3::ZERO; shaped.positions_m.len()];
        skin_dual_quaternion(&shaped.positions_m, &BODY.skin, &matrices, &mut world);
        world
    });
    assert!(worst_m(&skins[0], &skins[1]) < 1e-6);
    // Shoulder and elbow each turned by 2 rad: the hand's quaternion lies beyond the trunk's.
    pose.parent_from_joint[16] = DQuat::from_rotation_x(2.0);
    pose.parent_from_joint[18] = DQuat::from_rotation_x(2.0);
    let matrices = SkinMatrices::new(&pose, &shaped.joints_m);
    skin_dual_quaternion(&shaped.positions_m, &BODY.skin, &matrices, &mut skins[0]);
    let expected = dual_reference(&pose, 1.0, &shaped.positions_m, &shaped.joints_m);
    assert!(worst_m(&skins[0], &expected) < 1e-5);
    let edges = BODY
        .faces
        .iter()
        .flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
    let longest = |points: &[Vec3]| {
        let lengths = edges
            .clone()
            .map(|(a, b)| points[a as usize].distance(points[b as usize]));
        lengths.fold(0.0, f32::max)
    };
    // A vertex blended to the wrong side lies on the other side of its joint.
    assert!(longest(&skins[0]) < 4.0 * longest(&shaped.positions_m));
}

#[test]
fn the_rest_pose_moves_nothing() {
    let shaped = BODY.shaped(&[0.5; SHAPE_COUNT]);
    let matrices = SkinMatrices::new(&Pose::REST, &shaped.joints_m);
    let mut world = vec![Vec3::ZERO; shaped.positions_m.len()];
    skin_linear(&shaped.positions_m, &BODY.skin, &matrices, &mut world);
    assert!(worst_m(&world, &shaped.positions_m) < 1e-6);
    skin_dual_quaternion(&shaped.positions_m, &BODY.skin, &matrices, &mut world);
    assert!(worst_m(&world, &shaped.positions_m) < 1e-6);
}

#[test]
fn both_skinnings_agree_on_a_body_moved_as_one() {
    let shaped = BODY.shaped(&[0.0; SHAPE_COUNT]);
    let mut pose = Pose::REST;
    pose.root_translation_m = DVec3::new(1.0, 0.5, -2.0);
    pose.parent_from_joint[0] = DQuat::from_rotation_y(1.0) * DQuat::from_rotation_x(0.4);
    let matrices = SkinMatrices::new(&pose, &shaped.joints_m);
    let mut linear = vec![Vec3::ZERO; shaped.positions_m.len()];
    let mut dual = linear.clone();
    skin_linear(&shaped.positions_m, &BODY.skin, &matrices, &mut linear);
    skin_dual_quaternion(&shaped.positions_m, &BODY.skin, &matrices, &mut dual);
    assert!(worst_m(&linear, &dual) < 2e-6);
    // A rigid motion turns the normals with it.
    let rest_normals = vertex_normals(&shaped.positions_m, &BODY.faces);
    let normals = vertex_normals(&linear, &BODY.faces);
    let turn = pose.parent_from_joint[0].as_quat();
    for (normal, rest) in normals.iter().zip(&rest_normals) {
        assert!(normal.distance(turn * *rest) < 1e-2);
    }
}

#[test]
fn dual_quaternions_keep_a_twisted_wrist_thick() {
    let shaped = BODY.shaped(&[0.0; SHAPE_COUNT]);
    let [elbow, wrist] = [18, 20].map(|joint| shaped.joints_m[joint]);
    let axis = (wrist - elbow).normalize();
    let mut pose = Pose::REST;
    pose.parent_from_joint[20] = DQuat::from_axis_angle(axis.as_dvec3(), 2.6);
    let matrices = SkinMatrices::new(&pose, &shaped.joints_m);
    let mut linear = shaped.positions_m.clone();
    let mut dual = shaped.positions_m.clone();
    skin_linear(&shaped.positions_m, &BODY.skin, &matrices, &mut linear);
    skin_dual_quaternion(&shaped.positions_m, &BODY.skin, &matrices, &mut dual);
    let radius = |points: &[Vec3], vertex: usize| {
        let local = points[vertex] - wrist;
        (local - axis * local.dot(axis)).length()
    };
    let blended: Vec<usize> = (0..BODY.vertex_count())
        .filter(|&v| {
            let skin = BODY.skin[v];
            skin.joints[..2].contains(&20)
                && skin.joints[..2].contains(&18)
                && skin.weights[1] > 0.3
        })
        .collect();
    assert!(blended.len() > 5, "no blended vertices at the wrist");
    let mean = |points: &[Vec3]| -> f32 {
        let sum: f32 = blended.iter().map(|&v| radius(points, v)).sum();
        sum / blended.len() as f32
    };
    assert!(mean(&linear) < 0.75 * mean(&shaped.positions_m));
    assert!(mean(&dual) > 0.9 * mean(&shaped.positions_m));
}
