//! The pose of the body does not depend on a file's zero pose: files of the shared folder against their
//! controls, and skeletons made here of known motions, whose joints have any axes at all.

// Skipped tests say so.
#![allow(clippy::print_stdout)]

mod common;

use std::path::PathBuf;

use common::female_joints_m;
use dynaskin_body::{JOINT_COUNT, Joint};
use dynaskin_motion::{
    Clip, JointReport, MotionFile, Procedural, ProceduralKind, SourceMotion, retarget,
};
use glam::{DQuat, DVec3};
use proptest::prelude::*;

/// Limits in degrees and metres: limb directions, twist of thighs and upper arms, collars, width.
const LIMB: f64 = 5.0;
const TWIST: f64 = 15.0;
const COLLAR: f64 = 10.0;
const WIDTH_M: f64 = 0.02;

fn file(name: &str) -> Option<(Clip, JointReport)> {
    let shared = std::env::var_os("DYNASKIN_SHARED").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared"),
        PathBuf::from,
    );
    let Ok(bytes) = std::fs::read(shared.join("cases/motions").join(name)) else {
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
    for (pose, expected) in clip.frames.iter().zip(&control.frames) {
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

/// A clip of the body's own as a file would have it whose joints have other axes and another zero pose.
struct Turned<'a> {
    clip: &'a Clip,
    axes: [DQuat; JOINT_COUNT],
    /// Left is called right, and the other way round.
    swapped: bool,
    /// Turns the file's world.
    world: DQuat,
}

impl Turned<'_> {
    fn body_joint(&self, joint: usize) -> Joint {
        Joint::ALL[joint % JOINT_COUNT]
    }
}

impl SourceMotion for Turned<'_> {
    fn joint_count(&self) -> usize {
        JOINT_COUNT
    }

    fn name(&self, joint: usize) -> &str {
        let joint = self.body_joint(joint);
        if self.swapped {
            joint.mirrored().name()
        } else {
            joint.name()
        }
    }

    fn parent(&self, joint: usize) -> Option<usize> {
        self.body_joint(joint)
            .parent()
            .map(|parent| parent as usize)
    }

    fn bone_end(&self, _joint: usize) -> Option<DVec3> {
        None
    }

    fn rest_positions(&self) -> Vec<DVec3> {
        let rest = female_joints_m().map(|joint| joint.as_dvec3());
        let mut zero: Vec<DVec3> = Vec::new();
        for joint in Joint::ALL {
            let place = match joint.parent() {
                None => rest[0],
                Some(parent) => {
                    let parent = parent as usize;
                    zero[parent]
                        + self.axes[parent].inverse() * (rest[joint as usize] - rest[parent])
                }
            };
            zero.push(place);
        }
        zero
    }

    fn frame_count(&self) -> usize {
        self.clip.frames.len()
    }

    fn frame_seconds(&self) -> f64 {
        1.0 / self.clip.rate_hz
    }

    fn world_joints(&self, frame: usize) -> Vec<(DQuat, DVec3)> {
        let world = self.clip.frames[frame].world_joints(&female_joints_m());
        Joint::ALL
            .map(|joint| {
                (
                    self.world * world.rotation[joint as usize] * self.axes[joint as usize],
                    self.world * world.position_m[joint as usize],
                )
            })
            .to_vec()
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

fn turned(clip: &Clip, axes: [DQuat; JOINT_COUNT]) -> Turned<'_> {
    Turned {
        clip,
        axes,
        swapped: false,
        world: DQuat::IDENTITY,
    }
}

fn quaternion() -> impl Strategy<Value = DQuat> {
    [-1.0..1.0_f64, -1.0..1.0, -1.0..1.0, -1.0..1.0]
        .prop_map(|[x, y, z, w]| DQuat::from_xyzw(x, y, z, w))
        .prop_filter("has a length", |turn| turn.length() > 0.2)
        .prop_map(DQuat::normalize)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, max_shrink_iters: 0, ..ProptestConfig::default() })]

    #[test]
    fn any_axes_of_any_joint_give_the_same_pose(axes in proptest::array::uniform24(quaternion())) {
        let clip = truth();
        let (found, report) = retarget(&turned(&clip, axes), &female_joints_m()).expect("a person");
        prop_assert_eq!(differences(&found, &clip), [] as [&str; 0], "{:?}", report.notes);
    }

    #[test]
    fn a_zero_pose_turned_as_a_whole_gives_the_same_pose(axes in quaternion()) {
        let clip = truth();
        let (found, report) =
            retarget(&turned(&clip, [axes; JOINT_COUNT]), &female_joints_m()).expect("a person");
        prop_assert_eq!(differences(&found, &clip), [] as [&str; 0], "{:?}", report.notes);
    }

    #[test]
    fn one_joint_turned_at_zero_gives_the_same_pose(joint in 0..JOINT_COUNT, turn in quaternion()) {
        // The joint and all it carries, as a person who bends there.
        let clip = truth();
        let mut axes = [DQuat::IDENTITY; JOINT_COUNT];
        for below in Joint::ALL {
            let mut above = std::iter::successors(Some(below), |joint| joint.parent());
            if above.any(|above| above as usize == joint) {
                axes[below as usize] = turn;
            }
        }
        let (found, report) = retarget(&turned(&clip, axes), &female_joints_m()).expect("a person");
        prop_assert_eq!(differences(&found, &clip), [] as [&str; 0], "{:?}", report.notes);
    }
}

#[test]
fn exchanged_sides_are_found_and_said() {
    let clip = truth();
    let mut source = turned(&clip, [DQuat::IDENTITY; JOINT_COUNT]);
    source.swapped = true;
    let (found, report) = retarget(&source, &female_joints_m()).expect("a person");
    assert_eq!(differences(&found, &clip), [] as [&str; 0]);
    assert!(
        report.notes.iter().any(|note| note.contains("exchanged")),
        "{:?}",
        report.notes
    );
}

#[test]
fn up_is_found_by_the_body() {
    let clip = truth();
    for up in [DVec3::Z, DVec3::X, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z] {
        let mut source = turned(&clip, [DQuat::IDENTITY; JOINT_COUNT]);
        source.world = if up == DVec3::NEG_Y {
            DQuat::from_rotation_x(std::f64::consts::PI)
        } else {
            DQuat::from_rotation_arc(DVec3::Y, up)
        };
        source.axes = [source.world.inverse(); JOINT_COUNT];
        let (found, report) = retarget(&source, &female_joints_m()).expect("a person");
        let rest_m = female_joints_m();
        for pose in &found.frames {
            let world = pose.world_joints(&rest_m);
            let up_of_trunk = world.position_m[Joint::Neck as usize] - world.position_m[0];
            assert!(up_of_trunk.normalize().y > 0.8, "{up}: {:?}", report.notes);
        }
    }
}
