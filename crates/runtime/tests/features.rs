//! Features of the inertial kinds against motions whose derivatives are known.

use dynaskin_body::{JOINT_COUNT, Joint, Pose, SHAPE_COUNT};
use dynaskin_motion::Clip;
use dynaskin_runtime::RuntimeError;
use dynaskin_runtime::features::{
    FeatureKind, INERTIAL_FEATURE_COUNT, INERTIAL_JOINTS, Materials, MotionFeatures, clip_features,
};
use glam::{DQuat, DVec3, Vec3};

const DT: f64 = 1.0 / 60.0;

fn joints() -> [Vec3; JOINT_COUNT] {
    let mut joints = [Vec3::ZERO; JOINT_COUNT];
    for joint in Joint::ALL {
        let idx = joint as usize;
        let side = (idx % 3) as f32 - 1.0;
        joints[idx] = Vec3::new(0.1 * side, 1.0 + 0.02 * idx as f32, 0.01 * side);
    }
    joints
}

fn named(features: &[f32], name: &str) -> f32 {
    named_of(FeatureKind::Inertial, features, name)
}

fn named_of(kind: FeatureKind, features: &[f32], name: &str) -> f32 {
    let names = kind.names();
    features[names.iter().position(|n| n == name).expect(name)]
}

fn last_features(poses: impl IntoIterator<Item = Pose>) -> Vec<f32> {
    last_features_of(FeatureKind::Inertial, poses)
}

fn last_features_of(kind: FeatureKind, poses: impl IntoIterator<Item = Pose>) -> Vec<f32> {
    let mut inertial = MotionFeatures::new(kind, &joints(), &[0.0; SHAPE_COUNT]);
    let mut last = Vec::new();
    for pose in poses {
        last = inertial.push(&pose).to_vec();
    }
    last
}

/// A made-up motion in which everything moves.
fn wild_pose(tick: usize) -> Pose {
    let time = tick as f64 * DT;
    let mut pose = Pose::REST;
    pose.root_translation_m = DVec3::new(0.3 * time, 0.1 * (9.0 * time).sin(), time * time);
    for joint in Joint::ALL {
        let idx = joint as usize as f64;
        let axis = DVec3::new((idx).sin(), 1.0, (2.0 * idx).cos()).normalize();
        let angle = 0.5 * (5.0 * time + idx).sin();
        pose.parent_from_joint[joint as usize] = DQuat::from_axis_angle(axis, angle);
    }
    pose
}

#[test]
fn names_and_count_agree() {
    let names = FeatureKind::Inertial.names();
    assert_eq!(names.len(), INERTIAL_FEATURE_COUNT);
    assert_eq!(FeatureKind::Inertial.count(), 166);
    let unique: std::collections::HashSet<_> = names.iter().collect();
    assert_eq!(unique.len(), names.len());
    assert_eq!(names[0], "pelvis.proper_acceleration.x");
    assert_eq!(names[165], "shape.9");
    let kind = FeatureKind::InertialMaterials;
    assert_eq!((kind.count(), kind.names().len()), (202, 202));
    assert_eq!(kind.motion_count(), 180);
}

#[test]
fn standing_still_gravity_alone_is_measured() {
    let features = last_features(vec![Pose::REST; 5]);
    for (name, value) in FeatureKind::Inertial.names().iter().zip(features) {
        let expected = if name.ends_with("proper_acceleration.y") {
            9.81
        } else {
            0.0
        };
        assert!((value - expected).abs() < 1e-6, "{name} is {value}");
    }
}

#[test]
fn a_constant_acceleration_is_found_and_free_fall_weighs_nothing() {
    let falling = (0..10).map(|tick| {
        let time = tick as f64 * DT;
        let mut pose = Pose::REST;
        pose.root_translation_m = DVec3::new(1.5 * time * time, -0.5 * 9.81 * time * time, 0.0);
        pose
    });
    let features = last_features(falling);
    assert!((named(&features, "spine2.proper_acceleration.x") - 3.0).abs() < 1e-5);
    assert!(named(&features, "spine2.proper_acceleration.y").abs() < 1e-5);
}

#[test]
fn a_constant_velocity_gives_nothing() {
    let gliding = (0..10).map(|tick| {
        let mut pose = Pose::REST;
        pose.root_translation_m = DVec3::new(0.0, 0.0, 20.0 * tick as f64 * DT);
        pose
    });
    let moving = last_features(gliding);
    let still = last_features(vec![Pose::REST; 10]);
    for (a, b) in moving.iter().zip(&still) {
        assert!((a - b).abs() < 1e-5, "{a} {b}");
    }
}

#[test]
fn an_accelerating_turn_is_found_in_the_joints_frame() {
    // The pelvis turns about +Y with 2 rad/s² from a standstill, after a quarter turn about +X,
    // which takes the joint's own Z axis to the world's -Y.
    let turning = (0..30).map(|tick| {
        let time = tick as f64 * DT;
        let mut pose = Pose::REST;
        pose.parent_from_joint[0] = DQuat::from_rotation_y(time * time)
            * DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
        pose
    });
    let features = last_features(turning);
    let mean_velocity = 2.0 * (28.5 * DT) as f32;
    assert!((named(&features, "pelvis.angular_velocity.z") + mean_velocity).abs() < 1e-5);
    assert!((named(&features, "pelvis.angular_acceleration.z") + 2.0).abs() < 1e-5);
    assert!(named(&features, "pelvis.angular_acceleration.x").abs() < 1e-5);
    assert!((named(&features, "pelvis.proper_acceleration.z") + 9.81).abs() < 1e-5);
}

#[test]
fn the_first_ticks_know_no_acceleration() {
    let first = last_features([wild_pose(40)]);
    assert_eq!(named(&first, "left_knee.angular_velocity.x"), 0.0);
    let second = last_features([wild_pose(40), wild_pose(41)]);
    assert_ne!(named(&second, "left_knee.angular_velocity.x"), 0.0);
    assert_eq!(named(&second, "left_knee.angular_acceleration.x"), 0.0);
    assert_eq!(named(&second, "pelvis.angular_acceleration.y"), 0.0);
    let third = last_features((40..43).map(wild_pose));
    assert_ne!(named(&third, "left_knee.angular_acceleration.x"), 0.0);
}

#[test]
fn moved_and_turned_motion_has_the_same_features() {
    let turn = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2);
    let pelvis_rest = joints()[0].as_dvec3();
    let moved = |tick| {
        let mut pose: Pose = wild_pose(tick);
        pose.root_translation_m = turn * (pose.root_translation_m + pelvis_rest) - pelvis_rest
            + DVec3::new(10.0, 0.0, 3.0);
        pose.parent_from_joint[0] = turn * pose.parent_from_joint[0];
        pose
    };
    let here = last_features((0..50).map(wild_pose));
    let there = last_features((0..50).map(moved));
    for (a, b) in here.iter().zip(&there) {
        assert!((a - b).abs() < 1e-5, "{a} {b}");
    }
}

/// Features after a wild motion whose arms are raised, `share` of it by the collars.
fn raised_by_collars(kind: FeatureKind, share: f64) -> Vec<f32> {
    let poses = (0..5).map(|tick| {
        let mut pose = wild_pose(tick);
        for [collar, shoulder] in [
            [Joint::LeftCollar, Joint::LeftShoulder],
            [Joint::RightCollar, Joint::RightShoulder],
        ] {
            let raise = DQuat::from_rotation_z(0.2 * tick as f64) * DQuat::from_rotation_y(0.4);
            let trunk_from_collar = DQuat::IDENTITY.slerp(raise, share);
            pose.parent_from_joint[collar as usize] = trunk_from_collar;
            pose.parent_from_joint[shoulder as usize] = trunk_from_collar.conjugate() * raise;
        }
        pose
    });
    last_features_of(kind, poses)
}

#[test]
fn how_a_rig_shares_a_raised_arm_between_collar_and_shoulder_does_not_matter() {
    // Mixamo's, VRM's, SMPL's and Xsens's rigs turn collars; CMU's captures keep them still.
    let moved = |share: f64| raised_by_collars(FeatureKind::Inertial, share);
    let at_the_shoulder = moved(0.0);
    assert!(named(&at_the_shoulder, "left_shoulder.angular_velocity.z").abs() > 1.0);
    for share in [0.3, 1.0] {
        for (a, b) in at_the_shoulder.iter().zip(moved(share)) {
            assert!((a - b).abs() <= 1e-4 * a.abs().max(1.0), "{share}: {a} {b}");
        }
    }
}

#[test]
fn kinds_with_materials_tell_collars_apart_from_arms() {
    let kind = FeatureKind::InertialMaterials;
    let (still, shared) = (raised_by_collars(kind, 0.0), raised_by_collars(kind, 0.3));
    let told = |features: &[f32], name: &str| named_of(kind, features, name);
    assert_eq!(told(&still, "left_collar.y_axis.x"), 0.0);
    assert!(told(&shared, "left_collar.y_axis.x").abs() > 0.1);
    // The upper arm points and turns as before.
    for name in ["x_axis.x", "y_axis.x", "x_axis.z", "angular_velocity.z"] {
        let name = format!("left_shoulder.{name}");
        let (a, b) = (told(&still, &name), told(&shared, &name));
        assert!(
            a.abs() > 0.01 && (a - b).abs() < 1e-4 * a.abs().max(1.0),
            "{name}: {a} {b}"
        );
    }
    // Its joint is carried along by the collar.
    let name = "left_shoulder.proper_acceleration.y";
    assert!((told(&still, name) - told(&shared, name)).abs() > 0.1);
    assert!(told(&still, "right_elbow.y_axis.z").abs() > 0.01);
}

#[test]
fn quaternion_signs_do_not_matter() {
    let flipped = |tick: usize| {
        let mut pose = wild_pose(tick);
        if tick % 2 == 1 {
            for rotation in &mut pose.parent_from_joint {
                *rotation = -*rotation;
            }
        }
        pose
    };
    assert_eq!(
        last_features((0..20).map(wild_pose)),
        last_features((0..20).map(flipped))
    );
}

#[test]
fn a_capture_glitch_stays_bounded() {
    let mut poses: Vec<Pose> = (0..20).map(wild_pose).collect();
    poses[19].root_translation_m.y += 0.5;
    poses[19].parent_from_joint[0] *= DQuat::from_rotation_x(3.0);
    let features = last_features(poses);
    assert!(features.iter().all(|f| f.abs() < 401.0));
}

#[test]
fn a_shape_change_is_not_an_acceleration() {
    let mut inertial = MotionFeatures::new(FeatureKind::Inertial, &joints(), &[0.0; SHAPE_COUNT]);
    for _ in 0..4 {
        inertial.push(&Pose::REST);
    }
    let taller = joints().map(|joint| joint * 1.2);
    let shape = [1.0; SHAPE_COUNT];
    inertial.set_shape(&taller, &shape);
    let features = inertial.push(&Pose::REST).to_vec();
    assert!((named(&features, "spine3.proper_acceleration.y") - 9.81).abs() < 1e-5);
    assert_eq!(named(&features, "shape.3"), 1.0);
}

#[test]
fn a_whole_clip_has_the_features_of_its_poses() {
    let mut clip = Clip {
        name: "wild".to_owned(),
        rate_hz: 60.0,
        frames: (0..7).map(wild_pose).collect(),
    };
    let shape = [0.5; SHAPE_COUNT];
    let all = clip_features(
        FeatureKind::Inertial,
        &clip.frames,
        clip.rate_hz,
        &joints(),
        &shape,
        &Materials::default(),
    )
    .unwrap();
    assert_eq!(all.len(), 7 * INERTIAL_FEATURE_COUNT);
    let mut inertial = MotionFeatures::new(FeatureKind::Inertial, &joints(), &shape);
    for (pose, row) in clip.frames.iter().zip(all.chunks(INERTIAL_FEATURE_COUNT)) {
        assert_eq!(inertial.push(pose), row);
    }

    clip.rate_hz = 120.0;
    let error = clip_features(
        FeatureKind::Inertial,
        &clip.frames,
        clip.rate_hz,
        &joints(),
        &shape,
        &Materials::default(),
    )
    .unwrap_err();
    assert!(matches!(error, RuntimeError::ClipRate { .. }), "{error}");

    clip.rate_hz = 60.0;
    clip.frames[3].parent_from_joint[4].x = f64::NAN;
    let error = clip_features(
        FeatureKind::Inertial,
        &clip.frames,
        clip.rate_hz,
        &joints(),
        &shape,
        &Materials::default(),
    )
    .unwrap_err();
    assert!(error.to_string().contains("left_knee"), "{error}");
}

#[test]
fn every_kind_names_all_its_features() {
    for kind in [
        FeatureKind::Inertial,
        FeatureKind::InertialMaterials,
        #[cfg(feature = "guests")]
        FeatureKind::PoseShape,
        #[cfg(feature = "guests")]
        FeatureKind::PoseWindow,
    ] {
        let names = kind.names();
        assert_eq!(names.len(), kind.count(), "{kind:?}");
        let distinct: std::collections::BTreeSet<_> = names.iter().collect();
        assert_eq!(distinct.len(), names.len(), "{kind:?}");
    }
    #[cfg(feature = "guests")]
    assert_eq!(FeatureKind::PoseShape.count(), 69 + 10);
    #[cfg(feature = "guests")]
    assert_eq!(FeatureKind::PoseWindow.count(), 3 * 75 + 10);
}

#[test]
fn materials_are_logarithms_before_the_shape() {
    let mut shape = [0.0; SHAPE_COUNT];
    shape[0] = 1.5;
    let kind = FeatureKind::InertialMaterials;
    let mut features = MotionFeatures::new(kind, &joints(), &shape);
    let mut materials = Materials::default();
    materials.stiffness[1] = 0.5;
    materials.damping[5] = 2.0;
    features.set_materials(&materials);
    let with = features.push(&Pose::REST).to_vec();
    let usual = MotionFeatures::new(FeatureKind::Inertial, &joints(), &shape)
        .push(&Pose::REST)
        .to_vec();
    let (motion, inertial) = (kind.motion_count(), 9 * INERTIAL_JOINTS.len());
    assert_eq!(with[..inertial], usual[..inertial]);
    assert_eq!(
        with[motion + 12..],
        usual[FeatureKind::Inertial.motion_count()..]
    );
    let mut expected = [0.0; 12];
    (expected[1], expected[11]) = (-1.0, 1.0);
    assert_eq!(with[motion..motion + 12], expected);
}

#[cfg(feature = "guests")]
#[test]
fn a_window_holds_the_poses_newest_first_and_repeats_the_first() {
    let pose = |height: f64, angle: f64| {
        let mut pose = Pose::REST;
        pose.root_translation_m.y = height;
        pose.parent_from_joint[Joint::LeftKnee as usize] = DQuat::from_rotation_x(angle);
        pose
    };
    let mut features = MotionFeatures::new(FeatureKind::PoseWindow, &joints(), &[0.0; SHAPE_COUNT]);
    let knee = 3 + 3 * Joint::LeftKnee as usize;
    let seen =
        |features: &[f32]| [0, 75, 150].map(|start| (features[start + 1], features[start + knee]));
    assert_eq!(seen(features.push(&pose(1.0, 0.25))), [(1.0, 0.25); 3]);
    features.push(&pose(2.0, 0.5));
    let last = features.push(&pose(3.0, 0.75));
    assert_eq!(seen(last), [(3.0, 0.75), (2.0, 0.5), (1.0, 0.25)]);
}
