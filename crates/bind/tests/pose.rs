//! The body's pose from an avatar's bones, and back.

// It prints what it measures.
#![allow(clippy::print_stdout)]
// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

mod common;

use common::{Case, shared_file};
use dynaskin_avatars::{RECIPES, Recipe};
use dynaskin_bind::{Binding, Turned};
use dynaskin_body::{Joint, Pose};
use dynaskin_motion::{MotionFile, Procedural, ProceduralKind};
use glam::{DQuat, DVec3, Vec3};

fn case(name: &str) -> Case {
    let recipe: &Recipe = RECIPES.iter().find(|recipe| recipe.name == name).unwrap();
    Case::new(recipe)
}

fn hips_m(pose: &Pose, joints_m: &[Vec3; 24]) -> DVec3 {
    let world = pose.world_joints(joints_m);
    0.5 * (world.position_m[Joint::LeftHip as usize] + world.position_m[Joint::RightHip as usize])
}

/// The pose with its spine bent and turned by `angle` (radians), unevenly over its joints.
fn bent(pose: &Pose, angle: f64) -> Pose {
    let mut pose = pose.clone();
    for (joint, share) in [
        (Joint::Spine1, 0.3),
        (Joint::Spine2, 0.25),
        (Joint::Spine3, 0.45),
    ] {
        let turn =
            DQuat::from_rotation_x(share * angle) * DQuat::from_rotation_y(0.5 * share * angle);
        pose.parent_from_joint[joint as usize] *= turn;
    }
    pose
}

/// How far joints lie off after a pose went through a rig and back, over many poses, metres.
#[derive(Clone, Copy, Debug, Default)]
struct Off {
    spine1: f64,
    spine2: f64,
    /// The chest, and what hangs on it.
    spine3: f64,
    legs: f64,
    /// Of the chest, sideways to the way from the lowest spine joint.
    spine3_aside: f64,
    /// Turns of the joints that are no intermediate joints of the spine, radians.
    turn: f64,
}

/// There and back.
fn off(case: &Case, poses: &[Pose]) -> Off {
    let binding = &case.bound.binding;
    let size = f64::from(binding.size);
    let joints_m = case.body.shaped(&binding.shape).joints_m;
    let mut off = Off::default();
    for pose in poses {
        let bones = binding.rig.world_rotations(pose, &joints_m);
        let hips_m = size * hips_m(pose, &joints_m);
        let again = binding.rig.pose(&bones, hips_m, size, &joints_m);
        let [wanted, found] = [pose, &again].map(|pose| pose.world_joints(&joints_m));
        for joint in Joint::ALL {
            let idx = joint as usize;
            let miss = found.position_m[idx] - wanted.position_m[idx];
            let most = match joint {
                // Hands without bones of their own turn with their wrists.
                Joint::LeftHand | Joint::RightHand => continue,
                Joint::Spine1 => &mut off.spine1,
                Joint::Spine2 => &mut off.spine2,
                joint if is_upper(joint) => &mut off.spine3,
                _ => &mut off.legs,
            };
            *most = most.max(miss.length());
            if joint == Joint::Spine3 {
                let from = wanted.position_m[Joint::Spine1 as usize];
                let way = (wanted.position_m[idx] - from).normalize();
                off.spine3_aside = off.spine3_aside.max(miss.reject_from(way).length());
            }
            if !matches!(joint, Joint::Spine1 | Joint::Spine2) {
                let turn = found.rotation[idx].angle_between(wanted.rotation[idx]);
                off.turn = off.turn.max(turn);
            }
        }
    }
    off
}

/// Whether a joint is the chest or hangs on it.
fn is_upper(joint: Joint) -> bool {
    let mut above = std::iter::successors(Some(joint), |joint| joint.parent());
    above.any(|joint| joint == Joint::Spine3)
}

/// A jump whose spine bends by up to 20 degrees, unevenly over its joints.
fn uneven_jump(case: &Case) -> Vec<Pose> {
    let joints_m = case.body.shaped(&case.bound.binding.shape).joints_m;
    let jump = Procedural::new(ProceduralKind::Jump);
    let clip = jump.clip(&joints_m).unwrap();
    let frames = clip.frames.iter().enumerate().step_by(7);
    frames
        .map(|(frame, pose)| bent(pose, 0.35 * (0.1 * frame as f64).sin()))
        .collect()
}

/// Captured people who dance, turn, jump, crouch and fight; fewer where the folder is not there.
fn captured(case: &Case) -> Vec<Pose> {
    let joints_m = case.body.shaped(&case.bound.binding.shape).joints_m;
    let names = [
        "05_10", "06_07", "127_38", "135_02a", "14_09b", "16_07", "49_02a",
    ];
    let files = names
        .iter()
        .filter_map(|name| shared_file(&format!("mocap/train/{name}.bvh")));
    files
        .flat_map(|bytes| {
            let read = MotionFile::parse(&bytes).unwrap();
            let frames = read.clip(&joints_m).unwrap().clip.frames;
            frames.into_iter().step_by(12)
        })
        .collect()
}

#[test]
fn where_it_was_bound_the_body_stands_as_it_was_fitted() {
    let case = case("vrm0-t");
    let binding: &Binding = &case.bound.binding;
    let joints_m = case.body.shaped(&binding.shape).joints_m;
    let world: Vec<DQuat> = binding.rig.bones.iter().map(|bone| bone.bind).collect();
    let pose = binding
        .rig
        .pose(&world, DVec3::Y, f64::from(binding.size), &joints_m);
    let rotations = pose.world_joints(&joints_m).rotation;
    for (joint, (found, wanted)) in rotations.iter().zip(binding.rig.turns).enumerate() {
        let turned = binding.rig.joints[joint] != Turned::WithParent;
        assert!(
            !turned || found.angle_between(wanted) < 1e-6,
            "joint {joint}"
        );
    }
    // VRM 0.x faces -Z.
    assert!((rotations[0] * DVec3::Z).z < -0.99);
}

#[test]
fn three_spine_bones_are_exact() {
    let case = case("mixamo-t");
    for poses in [uneven_jump(&case), captured(&case)] {
        let off = off(&case, &poses);
        println!("{off:?}");
        for most in [off.spine1, off.spine2, off.spine3, off.legs, off.turn] {
            assert!(most < 1e-6, "{off:?}");
        }
    }
}

#[test]
fn bones_are_exact_through_the_body() {
    for name in [
        "mixamo-t",
        "vrm0-t",
        "vrm1-t-garment",
        "centimetres-t",
        "nameless-t",
    ] {
        let case = case(name);
        let binding = &case.bound.binding;
        let size = f64::from(binding.size);
        let joints_m = case.body.shaped(&binding.shape).joints_m;
        for step in 0..40 {
            // Every bone by another turn of up to 40 degrees.
            let angle = |bone: usize, axis: usize| {
                0.4 * (1.3 * step as f64 + 2.1 * bone as f64 + 0.7 * axis as f64).sin()
            };
            let turn = |bone: usize| {
                DQuat::from_scaled_axis(DVec3::from_array([0, 1, 2].map(|axis| angle(bone, axis))))
            };
            let bones = binding.rig.bones.iter().enumerate();
            let bones: Vec<DQuat> = bones.map(|(idx, bone)| turn(idx) * bone.bind).collect();
            let hips = DVec3::new(0.3, 0.9, -0.2);
            let pose = binding.rig.pose(&bones, hips, size, &joints_m);
            let again = binding.rig.world_rotations(&pose, &joints_m);
            for (bone, (wanted, found)) in bones.iter().zip(&again).enumerate() {
                let away = wanted.angle_between(*found);
                assert!(away < 1e-6, "{name}, bone {bone}: {away}");
            }
            let away_m = (size * hips_m(&pose, &joints_m)).distance(hips);
            assert!(away_m < 1e-9, "{name}: {away_m}");
        }
    }
}

/// Two bones have no place for how far the chest stands from the lowest spine joint, and none for the joint
/// between: everything else arrives.
#[test]
fn two_spine_bones_keep_all_but_the_middle_of_the_spine() {
    for name in ["vrm1-t-garment", "centimetres-t"] {
        let case = case(name);
        for (poses, most_chest_m, most_middle_m) in [
            (uneven_jump(&case), 1.2e-3, 4e-3),
            (captured(&case), 9e-3, 22e-3),
        ] {
            let off = off(&case, &poses);
            println!("{name}: {off:?}");
            assert!(
                off.turn < 1e-6 && off.legs < 1e-6 && off.spine1 < 1e-6,
                "{off:?}"
            );
            assert!(off.spine3_aside < 1e-5, "{off:?}");
            assert!(off.spine3 < most_chest_m, "{off:?}");
            assert!(off.spine2 < most_middle_m, "{off:?}");
        }
    }
}

#[test]
fn one_spine_bone_keeps_turns() {
    let case = case("nameless-t");
    for (poses, most_m) in [(uneven_jump(&case), 9e-3), (captured(&case), 0.34)] {
        let most = off(&case, &poses);
        let each = poses.iter().map(std::slice::from_ref);
        let mut chest_m: Vec<f64> = each.map(|pose| off(&case, pose).spine3).collect();
        chest_m.sort_by(f64::total_cmp);
        let at = |share: usize| chest_m.get(chest_m.len() * share / 100);
        println!("{most:?}; chest median {:?}, 95 % {:?}", at(50), at(95));
        assert!(most.turn < 1e-6 && most.legs < 1e-6, "{most:?}");
        assert!(most.spine3 < most_m, "{most:?}");
    }
}

/// Where one bone is farthest off, a landing, nothing flips or turns the long way: the capture bends its lowest
/// spine joint far forwards and its chest back, and the chest's turn tells only the rest of both.
#[test]
fn one_spine_bone_is_off_where_the_spine_bends_there_and_back() {
    let Some(bytes) = shared_file("mocap/train/49_02a.bvh") else {
        return;
    };
    let case = case("nameless-t");
    let joints_m = case.body.shaped(&case.bound.binding.shape).joints_m;
    let frames = MotionFile::parse(&bytes).unwrap().clip(&joints_m).unwrap();
    let frames = frames.clip.frames;
    let off_m: Vec<f64> = frames
        .iter()
        .map(|pose| off(&case, std::slice::from_ref(pose)).spine3)
        .collect();
    let steps_m = off_m.windows(2).map(|pair| (pair[1] - pair[0]).abs());
    let turn = |pose: &Pose, joint: Joint| pose.parent_from_joint[joint as usize];
    let steps = frames.windows(2).map(|pair| {
        let joints = [Joint::Spine1, Joint::Spine2, Joint::Spine3];
        let step = |joint| turn(&pair[0], joint).angle_between(turn(&pair[1], joint));
        joints.into_iter().map(step).fold(0.0, f64::max)
    });
    let most_step_m = steps_m.fold(0.0, f64::max);
    let most_step_degrees = steps.fold(0.0, f64::max).to_degrees();
    let worst = (0..frames.len())
        .max_by(|a, b| off_m[*a].total_cmp(&off_m[*b]))
        .unwrap();
    // Nods about the body's left, degrees; forwards is positive.
    let nod = |joint: Joint| {
        let turn = turn(&frames[worst], joint).to_scaled_axis();
        turn.x.to_degrees()
    };
    let world = frames[worst].world_joints(&joints_m).rotation;
    let rest = world[0].angle_between(world[Joint::Spine3 as usize]);
    println!(
        "frame {worst}: {:.3} m off; {:.0} degrees forwards, {:.0} back, {:.0} in all; from frame to frame at \
         most {most_step_m:.3} m and {most_step_degrees:.0} degrees",
        off_m[worst],
        nod(Joint::Spine1),
        -nod(Joint::Spine3),
        rest.to_degrees(),
    );
    assert!(nod(Joint::Spine1) > 90.0 && nod(Joint::Spine3) < -20.0);
    assert!(rest.to_degrees() < 75.0, "{rest}");
    assert!(most_step_degrees < 15.0, "{most_step_degrees}");
    assert!(most_step_m < 0.03, "{most_step_m}");
}

/// Poses that bend forwards and backwards alone: both lower spine joints turn on a circle of `radius` (radians)
/// around upright, pelvis and chest stay upright.
fn on_circle(radius: f64, at: f64) -> Pose {
    let mut pose = Pose::REST;
    let (first, second) = (radius * at.cos(), radius * at.sin());
    let turns = [
        (Joint::Spine1, first),
        (Joint::Spine2, second - first),
        (Joint::Spine3, -second),
    ];
    for (joint, angle) in turns {
        pose.parent_from_joint[joint as usize] = DQuat::from_rotation_x(angle);
    }
    pose
}

/// What two bones can keep at all. With the chest's turn kept, and left and right treated alike, the poses of
/// [`on_circle`] have one number of the rig to go through: how far the lower bone nods. Whatever continuous
/// number a method makes of them, it gives the same for some two poses that lie opposite on the circle, and
/// then errs on one of them by half of what their chests are apart.
#[test]
fn two_spine_bones_cannot_keep_more() {
    let case = case("vrm1-t-garment");
    let joints_m = case.body.shaped(&case.bound.binding.shape).joints_m;
    let chest_m = |pose: &Pose| pose.world_joints(&joints_m).position_m[Joint::Spine3 as usize];
    let round = |degree: u32| f64::from(degree).to_radians();
    for (degrees, least_m) in [(1.5, 0.4e-3), (10.0, 3e-3)] {
        let radius = f64::to_radians(degrees);
        let apart_m = |degree: u32| {
            let [one, other] = [degree, degree + 180].map(|at| on_circle(radius, round(at)));
            chest_m(&one).distance(chest_m(&other))
        };
        let bound_m = 0.5 * (0..180).map(apart_m).fold(f64::INFINITY, f64::min);
        let poses: Vec<Pose> = (0..360).map(|at| on_circle(radius, round(at))).collect();
        let found_m = off(&case, &poses).spine3;
        println!("{degrees} degrees: at least {bound_m:.2e} m, here {found_m:.2e} m");
        assert!(bound_m > least_m, "{bound_m}");
        assert!(found_m < 2.0 * bound_m, "{found_m} of {bound_m}");
    }
}
