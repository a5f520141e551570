//! Pose correctives as avatars add them are those of the body.

mod common;

use common::default_bodies;
use dynaskin_body::{BodyModel, JOINT_COUNT, POSE_DIR_COUNT, Pose, PoseCorrectives};
use glam::{DQuat, DVec3, Vec3};

/// A default body with correctives of up to a centimetre that fade away from their joint.
fn corrected() -> BodyModel {
    let mut body = default_bodies().remove(0);
    let mut state = 7_u32;
    let mut next = move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 23) as f32 - 1.0
    };
    body.pose_dirs_m = (0..POSE_DIR_COUNT)
        .map(|row| {
            let joint_m = body.joint_template_m[1 + row / 9];
            let at = body.template_m.iter();
            at.map(|at| {
                let size_m = 0.01 * (-at.distance(joint_m) / 0.05).exp();
                size_m * Vec3::new(next(), next(), next())
            })
            .collect()
        })
        .collect();
    body
}

fn poses() -> [Pose; 3] {
    let turned = |size: f64| {
        let mut pose = Pose::REST;
        pose.root_translation_m = DVec3::new(0.3, 1.0, -2.0);
        pose.parent_from_joint = std::array::from_fn(|joint| {
            let at = joint as f64;
            let axis = DVec3::new(at.sin(), (1.7 * at).cos(), 0.3).normalize();
            DQuat::from_axis_angle(axis, size * (2.3 * at).cos())
        });
        pose
    };
    [turned(0.02), turned(0.9), turned(3.1)]
}

#[test]
fn packed_they_move_the_skin_as_the_equation_does() {
    let made = corrected();
    // As the numbers of a file are, which keeps 16 bits.
    let stored = BodyModel::from_glb(&made.to_glb().expect("the body is whole")).expect("the same");
    for (body, largest_m) in [(&made, 5e-6), (&stored, 3e-6)] {
        let packed = PoseCorrectives::new(body).expect("there are some");
        for pose in poses() {
            let mut expected = body.template_m.clone();
            body.add_pose_correctives(&pose, &mut expected);
            let mut got = body.template_m.clone();
            packed.add(&pose, &mut got);
            let apart = got.iter().zip(&expected).map(|(a, b)| a.distance(*b));
            let worst_m = apart.fold(0.0, f32::max);
            assert!(worst_m <= largest_m, "{worst_m}");
        }
        let far = &poses()[2];
        let mut moved = body.template_m.clone();
        packed.add(far, &mut moved);
        let moved = moved
            .iter()
            .zip(&body.template_m)
            .map(|(a, b)| a.distance(*b));
        assert!(moved.fold(0.0, f32::max) > 0.01);
    }
}

#[test]
fn the_rest_pose_corrects_nothing_and_a_body_without_them_has_none() {
    let mut body = corrected();
    let packed = PoseCorrectives::new(&body).expect("there are some");
    let mut got = body.template_m.clone();
    packed.add(&Pose::REST, &mut got);
    assert_eq!(got, body.template_m);
    // A turn of the whole body, too.
    let mut turned = Pose::REST;
    turned.parent_from_joint[0] = DQuat::from_rotation_y(1.0);
    packed.add(&turned, &mut got);
    assert_eq!(got, body.template_m);
    body.pose_dirs_m.clear();
    assert!(PoseCorrectives::new(&body).is_none());
    body.pose_dirs_m = vec![vec![Vec3::ZERO; body.vertex_count()]; 9 * (JOINT_COUNT - 2)];
    assert!(PoseCorrectives::new(&body).is_none());
}
