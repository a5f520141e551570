//! A known motion, zero poses for it, and how far two clips are from each other.

use std::path::PathBuf;
use std::sync::OnceLock;

use dynaskin_body::{JOINT_COUNT, Joint};
use dynaskin_motion::{Clip, Procedural, ProceduralKind};
use glam::{DQuat, DVec3, Vec3};

use super::zero::OfBody;

/// Limits in degrees and metres: limb directions, twist of thighs and upper arms, collars, width.
pub const LIMB: f64 = 5.0;
pub const TWIST: f64 = 15.0;
pub const COLLAR: f64 = 10.0;
pub const WIDTH_M: f64 = 0.02;
/// The same for turns of the trunk, the head and the feet.
pub const TRUNK: f64 = 33.0;
pub const FOOT: f64 = 35.0;

/// Frames compared, at most.
pub const MAX_COMPARED: usize = 60;

/// Rest joints of the body, read once.
pub fn female_joints_m() -> [Vec3; JOINT_COUNT] {
    static JOINTS_M: OnceLock<[Vec3; JOINT_COUNT]> = OnceLock::new();
    *JOINTS_M.get_or_init(super::female_joints_m)
}

pub fn shared() -> PathBuf {
    std::env::var_os("DYNASKIN_SHARED").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared"),
        PathBuf::from,
    )
}

/// Angle about `axis` between two frames that both have it, in degrees.
pub fn twist(axis: DVec3, a: DQuat, b: DQuat) -> f64 {
    let turn = b * a.inverse();
    let along = DVec3::new(turn.x, turn.y, turn.z).dot(axis);
    2.0 * along.atan2(turn.w).abs().to_degrees()
}

pub fn turn_degrees(a: DQuat, b: DQuat) -> f64 {
    2.0 * a.dot(b).abs().min(1.0).acos().to_degrees()
}

/// What differs more than is allowed, a sentence each; empty where the clips show the same poses.
pub fn differences(clip: &Clip, control: &Clip) -> Vec<String> {
    assert_eq!(clip.frames.len(), control.frames.len());
    let rest_m = female_joints_m();
    let mut worst: std::collections::BTreeMap<String, (f64, f64)> =
        std::collections::BTreeMap::new();
    let mut hold = |what: String, found: f64, limit: f64| {
        let entry = worst.entry(what).or_insert((0.0, limit));
        entry.0 = entry.0.max(found);
    };
    let every = clip.frames.len().div_ceil(MAX_COMPARED);
    for (pose, expected) in clip.frames.iter().zip(&control.frames).step_by(every) {
        let [a, b] = [pose, expected].map(|pose| pose.world_joints(&rest_m));
        for (from, to) in [
            (Joint::LeftHip, Joint::LeftKnee),
            (Joint::LeftKnee, Joint::LeftAnkle),
            (Joint::LeftShoulder, Joint::LeftElbow),
            (Joint::LeftElbow, Joint::LeftWrist),
        ]
        .into_iter()
        .flat_map(|(from, to)| [(from, to), (from.mirrored(), to.mirrored())])
        {
            let [bone, wanted] =
                [&a, &b].map(|w| w.position_m[to as usize] - w.position_m[from as usize]);
            let name = from.name();
            hold(
                format!("direction of {name}"),
                bone.angle_between(wanted).to_degrees(),
                LIMB,
            );
            if name.ends_with("hip") || name.ends_with("shoulder") {
                let [own, wanted_turn] = [&a, &b].map(|world| world.rotation[from as usize]);
                let twist = twist(wanted.normalize(), wanted_turn, own);
                hold(format!("twist of {name}"), twist.min(360.0 - twist), TWIST);
            }
        }
        for collar in [Joint::LeftCollar, Joint::RightCollar] {
            let turn = turn_degrees(
                pose.parent_from_joint[collar as usize],
                expected.parent_from_joint[collar as usize],
            );
            hold(format!("turn of {}", collar.name()), turn, COLLAR);
        }
        for (joint, limit) in [
            (Joint::Pelvis, TRUNK),
            (Joint::Spine1, TRUNK),
            (Joint::Spine2, TRUNK),
            (Joint::Spine3, TRUNK),
            (Joint::LeftAnkle, FOOT),
            (Joint::RightAnkle, FOOT),
        ] {
            let turn = turn_degrees(a.rotation[joint as usize], b.rotation[joint as usize]);
            hold(format!("turn of {}", joint.name()), turn, limit);
        }
        let [width, wanted] = [&a, &b].map(|world| {
            let [left, right] = [Joint::LeftShoulder, Joint::RightShoulder]
                .map(|joint| world.position_m[joint as usize]);
            left.distance(right)
        });
        hold(
            "width of the shoulders".to_owned(),
            (width - wanted).abs(),
            WIDTH_M,
        );
    }
    worst
        .into_iter()
        .filter(|(_, (found, limit))| found > limit)
        .map(|(what, (found, limit))| format!("{what}: {found:.2}, at most {limit}"))
        .collect()
}

/// A walk in place with swinging, bending arms and a bending trunk.
pub fn truth() -> Clip {
    let mut clip = Procedural::new(ProceduralKind::RunInPlace)
        .clip(&female_joints_m())
        .expect("its usual numbers");
    clip.frames.truncate(150);
    for (frame, pose) in clip.frames.iter_mut().enumerate() {
        let phase = (0.07 * frame as f64).sin();
        for (joint, axis, angle) in [
            (Joint::Spine1, DVec3::X, 0.15 * phase),
            (Joint::Spine2, DVec3::Y, 0.2 * phase),
            (Joint::LeftCollar, DVec3::Z, 0.1 * phase),
            (Joint::RightCollar, DVec3::Z, 0.1 * phase),
            (Joint::Neck, DVec3::Y, 0.3 * phase),
        ] {
            let turn = &mut pose.parent_from_joint[joint as usize];
            *turn = (*turn * DQuat::from_axis_angle(axis, angle)).normalize();
        }
    }
    clip
}

pub fn of_body(clip: &Clip) -> OfBody<'_> {
    OfBody {
        clip,
        rest_m: female_joints_m(),
    }
}

/// Both sides turned alike, about axes of the body: x to the left, y up, z ahead.
pub fn both(turns: &[(Joint, DQuat)]) -> Vec<(Joint, DQuat)> {
    turns
        .iter()
        .flat_map(|&(joint, turn)| {
            let mirrored = DQuat::from_xyzw(turn.x, -turn.y, -turn.z, turn.w);
            [(joint, turn), (joint.mirrored(), mirrored)]
        })
        .collect()
}

/// Zero poses that files have, and some that none should have.
pub fn zero_poses() -> Vec<(&'static str, Vec<(Joint, DQuat)>)> {
    use Joint::{
        LeftAnkle, LeftCollar, LeftElbow, LeftHip, LeftKnee, LeftShoulder, Neck, Pelvis,
        RightElbow, RightHip, RightKnee, RightShoulder, Spine1, Spine2, Spine3,
    };
    let x = |degrees: f64| DQuat::from_rotation_x(degrees.to_radians());
    let y = |degrees: f64| DQuat::from_rotation_y(degrees.to_radians());
    let z = |degrees: f64| DQuat::from_rotation_z(degrees.to_radians());
    vec![
        ("T-pose", both(&[(LeftShoulder, z(45.0))])),
        ("arms down", both(&[(LeftShoulder, z(-40.0))])),
        ("arms ahead", both(&[(LeftShoulder, y(-80.0))])),
        ("palms ahead", both(&[(LeftShoulder, x(-90.0))])),
        ("palms back", both(&[(LeftShoulder, x(90.0))])),
        ("arms rolled a little", both(&[(LeftShoulder, x(20.0))])),
        ("forearms rolled", both(&[(LeftElbow, x(90.0))])),
        ("collars up by 15", both(&[(LeftCollar, z(15.0))])),
        ("collars up by 25", both(&[(LeftCollar, z(25.0))])),
        ("collars up by 90", both(&[(LeftCollar, z(90.0))])),
        ("collars down", both(&[(LeftCollar, z(-20.0))])),
        ("collars ahead", both(&[(LeftCollar, y(-30.0))])),
        (
            "hands on hips",
            both(&[(LeftShoulder, z(-20.0)), (LeftElbow, y(-70.0) * z(-60.0))]),
        ),
        ("trunk bent", vec![(Spine1, x(45.0))]),
        ("trunk bent at right angles", vec![(Spine1, x(90.0))]),
        ("trunk twisted", vec![(Spine1, y(30.0))]),
        (
            "slouching",
            vec![
                (Spine1, x(15.0)),
                (Spine2, x(15.0)),
                (Spine3, x(15.0)),
                (Neck, x(-25.0)),
            ],
        ),
        ("leaning", vec![(Pelvis, x(30.0))]),
        ("lying", vec![(Pelvis, x(-90.0))]),
        ("facing back", vec![(Pelvis, y(180.0))]),
        ("looking down", vec![(Neck, x(45.0))]),
        ("toes down", both(&[(LeftAnkle, x(45.0))])),
        ("toes up", both(&[(LeftAnkle, x(-30.0))])),
        ("toes out", both(&[(LeftAnkle, y(45.0))])),
        ("sitting", both(&[(LeftHip, x(-90.0)), (LeftKnee, x(90.0))])),
        (
            "squatting",
            both(&[
                (LeftHip, x(-60.0)),
                (LeftKnee, x(100.0)),
                (LeftAnkle, x(-40.0)),
            ]),
        ),
        ("legs spread", both(&[(LeftHip, z(40.0))])),
        ("knees out", both(&[(LeftHip, y(30.0))])),
        ("shins out", both(&[(LeftKnee, y(40.0))])),
        (
            "each limb otherwise",
            vec![
                (LeftShoulder, z(-30.0) * x(40.0)),
                (RightShoulder, z(20.0)),
                (RightElbow, y(60.0)),
                (LeftHip, x(-40.0)),
                (RightHip, z(-25.0)),
                (LeftKnee, x(30.0)),
            ],
        ),
        (
            "in mid-stride",
            vec![
                (LeftHip, x(-30.0)),
                (RightHip, x(20.0)),
                (RightKnee, x(30.0)),
                (LeftShoulder, z(-30.0) * y(-20.0)),
                (RightShoulder, z(30.0)),
                (Spine1, x(8.0) * y(8.0)),
            ],
        ),
    ]
}
