//! Motions that tell little of their skeleton, exchanged sides, other axes of the world, and joints
//! without length.

mod common;

use common::poses::{differences, female_joints_m, of_body, truth, turn_degrees, zero_poses};
use common::zero::{InThree, Rezeroed};
use dynaskin_body::Joint;
use dynaskin_motion::{Clip, retarget};
use glam::{DQuat, DVec3};

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
