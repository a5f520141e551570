//! The pose of the body does not depend on a file's zero pose: files of the shared folder against their
//! controls, and skeletons made here of known motions, whose joints have any axes at all.

// Skipped tests say so.
#![allow(clippy::print_stdout)]

mod common;

use std::path::PathBuf;
use std::sync::OnceLock;

use common::zero::{InThree, OfBody, Rezeroed};
use dynaskin_body::{JOINT_COUNT, Joint};
use dynaskin_motion::{
    Bvh, Clip, JointReport, MotionFile, Procedural, ProceduralKind, SourceMotion, retarget,
};
use glam::{DQuat, DVec3, Vec3};
use proptest::prelude::*;

/// Limits in degrees and metres: limb directions, twist of thighs and upper arms, collars, width.
const LIMB: f64 = 5.0;
const TWIST: f64 = 15.0;
const COLLAR: f64 = 10.0;
const WIDTH_M: f64 = 0.02;
/// The same for turns of the trunk, the head and the feet.
const TRUNK: f64 = 33.0;
const FOOT: f64 = 35.0;

/// Frames compared, at most.
const MAX_COMPARED: usize = 60;

/// Rest joints of the body, read once.
fn female_joints_m() -> [Vec3; JOINT_COUNT] {
    static JOINTS_M: OnceLock<[Vec3; JOINT_COUNT]> = OnceLock::new();
    *JOINTS_M.get_or_init(common::female_joints_m)
}

fn shared() -> PathBuf {
    std::env::var_os("DYNASKIN_SHARED").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared"),
        PathBuf::from,
    )
}

fn file(name: &str) -> Option<(Clip, JointReport)> {
    let Ok(bytes) = std::fs::read(shared().join("cases/motions").join(name)) else {
        println!("skipped: {name} needs ../shared/cases/motions");
        return None;
    };
    let motion = MotionFile::parse(&bytes).expect("a motion");
    let found = motion.clip(&female_joints_m()).expect("a person");
    Some((found.clip, found.report.expect("of named joints")))
}

/// Angle about `axis` between two frames that both have it, in degrees.
fn twist(axis: DVec3, a: DQuat, b: DQuat) -> f64 {
    let turn = b * a.inverse();
    let along = DVec3::new(turn.x, turn.y, turn.z).dot(axis);
    2.0 * along.atan2(turn.w).abs().to_degrees()
}

fn turn_degrees(a: DQuat, b: DQuat) -> f64 {
    2.0 * a.dot(b).abs().min(1.0).acos().to_degrees()
}

/// What differs more than is allowed, a sentence each; empty where the clips show the same poses.
fn differences(clip: &Clip, control: &Clip) -> Vec<String> {
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

fn assert_as(name: &str, control: &str) {
    let (Some((clip, _)), Some((control, _))) = (file(name), file(control)) else {
        return;
    };
    assert_eq!(differences(&clip, &control), [] as [&str; 0], "{name}");
}

#[test]
fn collars_and_arms_straight_up_at_zero() {
    assert_as(
        "zero-collars-and-arms-straight-up.bvh",
        "zero-t-pose-control.bvh",
    );
}

#[test]
fn every_bone_along_x_at_zero() {
    assert_as("zero-every-bone-along-x.bvh", "zero-t-pose-control.bvh");
}

#[test]
fn sitting_at_zero() {
    assert_as(
        "zero-sitting-thighs-forward-shins-down.bvh",
        "zero-t-pose-control.bvh",
    );
}

#[test]
fn arms_rolled_at_zero() {
    assert_as(
        "zero-palms-forward-arms-rolled-by-90-deg.bvh",
        "zero-t-pose-control.bvh",
    );
}

#[test]
fn a_skin_bound_otherwise_than_its_nodes_stand() {
    assert_as("glb-nodes-hold-shrug.glb", "glb-control.glb");
    let (Some((clip, _)), Some((control, _))) =
        (file("glb-nodes-hold-shrug.glb"), file("glb-control.glb"))
    else {
        return;
    };
    for (pose, expected) in clip.frames.iter().zip(&control.frames) {
        for joint in Joint::ALL {
            let [a, b] = [pose, expected].map(|pose| pose.parent_from_joint[joint as usize]);
            assert!(turn_degrees(a, b) < 0.1, "{}", joint.name());
        }
    }
}

#[test]
fn feet_without_toes_point_where_the_trunk_faces() {
    assert_as("no-toes-facing-180.bvh", "no-toes-facing-0.bvh");
    for name in ["no-toes-facing-0.bvh", "no-toes-facing-180.bvh"] {
        let Some((clip, _)) = file(name) else { return };
        for pose in &clip.frames {
            let world = pose.world_joints(&female_joints_m());
            for ankle in [Joint::LeftAnkle, Joint::RightAnkle] {
                let ahead = world.rotation[ankle as usize] * DVec3::Z;
                let faces = world.rotation[0] * DVec3::Z;
                assert!(ahead.dot(faces) > 0.6, "{name}: {ahead} for {faces}");
            }
        }
    }
}

/// A walk in place with swinging, bending arms and a bending trunk.
fn truth() -> Clip {
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

fn of_body(clip: &Clip) -> OfBody<'_> {
    OfBody {
        clip,
        rest_m: female_joints_m(),
    }
}

fn quaternion() -> impl Strategy<Value = DQuat> {
    [-1.0..1.0_f64, -1.0..1.0, -1.0..1.0, -1.0..1.0]
        .prop_map(|[x, y, z, w]| DQuat::from_xyzw(x, y, z, w))
        .prop_filter("has a length", |turn| turn.length() > 0.2)
        .prop_map(DQuat::normalize)
}

/// Both sides turned alike, about axes of the body: x to the left, y up, z ahead.
fn both(turns: &[(Joint, DQuat)]) -> Vec<(Joint, DQuat)> {
    turns
        .iter()
        .flat_map(|&(joint, turn)| {
            let mirrored = DQuat::from_xyzw(turn.x, -turn.y, -turn.z, turn.w);
            [(joint, turn), (joint.mirrored(), mirrored)]
        })
        .collect()
}

/// Zero poses that files have, and some that none should have.
fn zero_poses() -> Vec<(&'static str, Vec<(Joint, DQuat)>)> {
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

#[test]
fn poses_that_a_file_may_have_at_zero() {
    let clip = truth();
    let source = of_body(&clip);
    for (name, turns) in zero_poses() {
        let turns: Vec<_> = turns
            .into_iter()
            .map(|(joint, turn)| (joint as usize, turn))
            .collect();
        let rezeroed = Rezeroed::posed(&source, &turns);
        let (found, report) = retarget(&rezeroed, &female_joints_m()).expect("a person");
        assert_eq!(
            differences(&found, &clip),
            [] as [&str; 0],
            "{name}: {:?}",
            report.notes
        );
    }
}

/// Captures of people who run, dance, bend and climb, seen with every zero pose.
#[test]
fn captures_do_not_depend_on_their_zero_pose() {
    for name in ["05_02.bvh", "06_13b.bvh", "16_35.bvh"] {
        let Ok(bytes) = std::fs::read(shared().join("mocap/train").join(name)) else {
            println!("skipped: {name} needs ../shared/mocap/train");
            return;
        };
        let motion = Bvh::parse(&bytes).expect("a motion");
        let (control, report) = retarget(&motion, &female_joints_m()).expect("a person");
        assert_eq!(report.notes, [] as [&str; 0], "{name}");
        let place = |joint: Joint| {
            let (_, source) = report.mapped.iter().find(|(mapped, _)| *mapped == joint)?;
            (0..motion.joint_count()).find(|place| motion.name(*place) == source)
        };
        for (zero, turns) in zero_poses() {
            let turns: Vec<_> = turns
                .into_iter()
                .filter_map(|(joint, turn)| Some((place(joint)?, turn)))
                .collect();
            let rezeroed = Rezeroed::posed(&motion, &turns);
            let (found, report) = retarget(&rezeroed, &female_joints_m()).expect("a person");
            let found = differences(&found, &control);
            assert_eq!(found, [] as [&str; 0], "{name}, {zero}: {:?}", report.notes);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, max_shrink_iters: 0, ..ProptestConfig::default() })]

    #[test]
    fn any_axes_of_any_joint_give_the_same_pose(zero in proptest::collection::vec(quaternion(), JOINT_COUNT)) {
        let clip = truth();
        let source = of_body(&clip);
        let (found, report) =
            retarget(&Rezeroed::new(&source, zero), &female_joints_m()).expect("a person");
        prop_assert_eq!(differences(&found, &clip), [] as [&str; 0], "{:?}", report.notes);
    }

    #[test]
    fn a_zero_pose_turned_as_a_whole_gives_the_same_pose(turn in quaternion()) {
        let clip = truth();
        let source = of_body(&clip);
        let rezeroed = Rezeroed::posed(&source, &[(0, turn)]);
        let (found, report) = retarget(&rezeroed, &female_joints_m()).expect("a person");
        prop_assert_eq!(differences(&found, &clip), [] as [&str; 0], "{:?}", report.notes);
    }

    #[test]
    fn one_joint_turned_at_zero_gives_the_same_pose(joint in 0..JOINT_COUNT, turn in quaternion()) {
        let clip = truth();
        let source = of_body(&clip);
        let rezeroed = Rezeroed::posed(&source, &[(joint, turn)]);
        let (found, report) = retarget(&rezeroed, &female_joints_m()).expect("a person");
        prop_assert_eq!(differences(&found, &clip), [] as [&str; 0], "{:?}", report.notes);
    }
}

#[test]
fn turns_of_joints_without_length_count() {
    let clip = truth();
    let source = of_body(&clip);
    let (found, report) =
        retarget(&InThree { inner: &source }, &female_joints_m()).expect("a person");
    assert_eq!(
        differences(&found, &clip),
        [] as [&str; 0],
        "{:?}",
        report.notes
    );
}

/// The same motion with straight elbows and knees.
fn straight(clip: &Clip) -> Clip {
    let rest_m = female_joints_m().map(|joint| joint.as_dvec3());
    let mut clip = clip.clone();
    for [start, middle, end] in [
        [Joint::LeftShoulder, Joint::LeftElbow, Joint::LeftWrist],
        [Joint::LeftHip, Joint::LeftKnee, Joint::LeftAnkle],
    ]
    .into_iter()
    .flat_map(|limb| [limb, limb.map(Joint::mirrored)])
    {
        let [start_m, middle_m, end_m] = [start, middle, end].map(|joint| rest_m[joint as usize]);
        let straight = DQuat::from_rotation_arc(
            (end_m - middle_m).normalize(),
            (middle_m - start_m).normalize(),
        );
        for pose in &mut clip.frames {
            pose.parent_from_joint[middle as usize] = straight;
        }
    }
    clip
}

#[test]
fn limbs_that_never_bend_are_as_little_twisted_as_can_be_and_that_is_said() {
    let clip = straight(&truth());
    let source = of_body(&clip);
    for degrees in [-90.0_f64, 90.0, 180.0] {
        let turn = DQuat::from_rotation_x(degrees.to_radians());
        let turns = [Joint::LeftShoulder, Joint::RightShoulder].map(|joint| (joint as usize, turn));
        let rezeroed = Rezeroed::posed(&source, &turns);
        let (found, report) = retarget(&rezeroed, &female_joints_m()).expect("a person");
        let differences = differences(&found, &clip);
        assert!(
            differences
                .iter()
                .all(|difference| difference.starts_with("twist")),
            "{degrees}: {differences:?}"
        );
        for arm in ["left_shoulder", "right_shoulder"] {
            let is_said = |note: &String| note.contains("hardly bends") && note.contains(arm);
            assert!(
                report.notes.iter().any(is_said),
                "{degrees}: {:?}",
                report.notes
            );
        }
        for (pose, expected) in found.frames.iter().zip(&clip.frames) {
            for joint in [Joint::LeftShoulder, Joint::RightShoulder] {
                let [own, wanted] = [pose, expected]
                    .map(|pose| pose.world_joints(&female_joints_m()).rotation[joint as usize]);
                assert!(
                    turn_degrees(own, wanted) < 45.0,
                    "{degrees}, {}",
                    joint.name()
                );
            }
        }
    }
}

#[test]
fn somebody_who_only_stands_stands() {
    let mut clip = straight(&truth());
    clip.frames.truncate(1);
    for joint in Joint::ALL {
        // Elbows and knees stay straight.
        if !(joint.name().ends_with("elbow") || joint.name().ends_with("knee")) {
            clip.frames[0].parent_from_joint[joint as usize] = DQuat::IDENTITY;
        }
    }
    let still = clip.frames[0].clone();
    clip.frames.resize(30, still);
    let source = of_body(&clip);
    for (name, turns) in zero_poses() {
        let turns: Vec<_> = turns
            .into_iter()
            .map(|(joint, turn)| (joint as usize, turn))
            .collect();
        let rezeroed = Rezeroed::posed(&source, &turns);
        let (found, report) = retarget(&rezeroed, &female_joints_m()).expect("a person");
        let differences = differences(&found, &clip);
        assert!(
            differences
                .iter()
                .all(|difference| difference.starts_with("twist")),
            "{name}: {differences:?}"
        );
        let is_said = report
            .notes
            .iter()
            .any(|note| note.contains("hardly bends"));
        assert!(
            is_said || differences.is_empty(),
            "{name}: {:?}",
            report.notes
        );
    }
}

#[test]
fn exchanged_sides_are_found_and_said() {
    let clip = truth();
    let source = of_body(&clip);
    for turns in [vec![], zero_poses().remove(1).1] {
        let turns: Vec<_> = turns
            .into_iter()
            .map(|(joint, turn)| (joint as usize, turn))
            .collect();
        let mut rezeroed = Rezeroed::posed(&source, &turns);
        rezeroed.is_swapped = true;
        let (found, report) = retarget(&rezeroed, &female_joints_m()).expect("a person");
        assert_eq!(differences(&found, &clip), [] as [&str; 0]);
        assert!(
            report.notes.iter().any(|note| note.contains("exchanged")),
            "{:?}",
            report.notes
        );
    }
}

/// Takes +Y to another axis.
fn from_y(up: DVec3) -> DQuat {
    if up == DVec3::NEG_Y {
        DQuat::from_rotation_x(std::f64::consts::PI)
    } else {
        DQuat::from_rotation_arc(DVec3::Y, up)
    }
}

#[test]
fn up_is_found_by_the_body() {
    let clip = truth();
    let source = of_body(&clip);
    let rest_m = female_joints_m();
    for up in [DVec3::Z, DVec3::X, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z] {
        let mut rezeroed = Rezeroed::posed(&source, &[(0, from_y(up))]);
        rezeroed.world = from_y(up);
        let (found, report) = retarget(&rezeroed, &rest_m).expect("a person");
        for pose in &found.frames {
            let world = pose.world_joints(&rest_m);
            let up_of_trunk = world.position_m[Joint::Neck as usize] - world.position_m[0];
            assert!(up_of_trunk.normalize().y > 0.8, "{up}: {:?}", report.notes);
        }
    }
}

#[test]
fn people_who_lie_or_stand_on_their_hands_are_not_stood_up() {
    let clip = truth();
    let source = of_body(&clip);
    let rest_m = female_joints_m();
    for along in [DVec3::Z, DVec3::X, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z] {
        let mut rezeroed = Rezeroed::posed(&source, &[]);
        rezeroed.world = from_y(along);
        // Captures begin with the hips above the origin.
        rezeroed.shift = DVec3::new(0.0, 0.2, 0.0) - 0.9 * along;
        let (found, report) = retarget(&rezeroed, &rest_m).expect("a person");
        for pose in &found.frames {
            let world = pose.world_joints(&rest_m);
            let trunk = world.position_m[Joint::Neck as usize] - world.position_m[0];
            assert!(
                trunk.normalize().dot(along) > 0.8,
                "{along}: {:?}",
                report.notes
            );
        }
        for said in ["+Y is taken", "nobody stands"] {
            let is_said = report.notes.iter().any(|note| note.contains(said));
            assert!(is_said, "{along}: {:?}", report.notes);
        }
    }
}
