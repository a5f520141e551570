//! The body's pose from an avatar's bones, and back.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

mod common;

use common::Case;
use dynaskin_avatars::{RECIPES, Recipe};
use dynaskin_bind::{Binding, Turned};
use dynaskin_body::{Joint, Pose};
use dynaskin_motion::{Procedural, ProceduralKind};
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

/// There and back over a motion: the farthest that a joint lies off, metres.
fn farthest_m(case: &Case) -> f64 {
    let binding = &case.bound.binding;
    let size = f64::from(binding.size);
    let joints_m = case.body.shaped(&binding.shape).joints_m;
    let clip = Procedural::new(ProceduralKind::Jump)
        .clip(&joints_m)
        .unwrap();
    let mut farthest_m = 0.0_f64;
    for (frame, pose) in clip.frames.iter().enumerate().step_by(7) {
        let pose = &bent(pose, 0.35 * (0.1 * frame as f64).sin());
        let world = binding.rig.world_rotations(pose);
        let again = binding
            .rig
            .pose(&world, size * hips_m(pose, &joints_m), size, &joints_m);
        let [wanted, found] = [pose, &again].map(|pose| pose.world_joints(&joints_m).position_m);
        for (joint, (wanted, found)) in wanted.iter().zip(found).enumerate() {
            // Hands without bones of their own turn with their wrists.
            if joint < Joint::LeftHand as usize {
                farthest_m = farthest_m.max(wanted.distance(found));
            }
        }
    }
    farthest_m
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
    let farthest_m = farthest_m(&case("mixamo-t"));
    println!("farthest {:.4} mm", 1e3 * farthest_m);
    assert!(farthest_m < 1e-6, "{farthest_m}");
}

#[test]
fn fewer_spine_bones_are_close() {
    for name in ["vrm1-t-garment", "nameless-t"] {
        let farthest_m = farthest_m(&case(name));
        println!("{name}: farthest {:.2} mm", 1e3 * farthest_m);
        assert!(farthest_m < 0.03, "{name}: {farthest_m}");
    }
}
