//! Skinning and unposing over the default body.

mod common;

use std::sync::LazyLock;

use common::default_bodies;
use dynaskin_body::{
    BodyModel, JOINT_COUNT, Pose, SHAPE_COUNT, SkinMatrices, skin_dual_quaternion, skin_linear,
    unpose_dual_quaternion, unpose_linear, vertex_normals,
};
use glam::{DQuat, DVec3, Vec3};
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
    fn dual_quaternion_unposing_is_the_inverse(pose in poses(2.5)) {
        let shaped = BODY.shaped(&[0.0; SHAPE_COUNT]);
        let matrices = SkinMatrices::new(&pose, &shaped.joints_m);
        let mut world = vec![Vec3::ZERO; shaped.positions_m.len()];
        skin_dual_quaternion(&shaped.positions_m, &BODY.skin, &matrices, &mut world);
        let mut rest = world.clone();
        unpose_dual_quaternion(&world, &BODY.skin, &matrices, &mut rest);
        let error = worst_m(&rest, &shaped.positions_m);
        prop_assert!(error <= 1e-5, "{error}");
    }
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
