//! The simulator on the bodies that the project ships.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

use std::path::Path;

use dynaskin_body::{BodyModel, Pose};
use dynaskin_motion::{Clip, Procedural, ProceduralKind};
use dynaskin_sim::{Run, Shell, SimSettings, Solver, drawn_shape};
use glam::{DQuat, DVec3, Vec3};
use rand::{RngExt as _, SeedableRng as _};

fn body(name: &str) -> BodyModel {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../models")
        .join(name)
        .join("body.glb");
    BodyModel::from_glb(&std::fs::read(path).unwrap()).unwrap()
}

fn motion(body: &BodyModel, kind: ProceduralKind, frames: std::ops::Range<usize>) -> Clip {
    let joints = body.shaped(&Run::shape(0)).joints_m;
    let mut clip = Procedural::new(kind).clip(&joints).unwrap();
    clip.frames = clip.frames[frames].to_vec();
    clip
}

/// Offsets of the last frame and the largest of any.
fn played(shell: &Shell, settings: &SimSettings, frames: &[Pose]) -> (Vec<Vec3>, f32) {
    let mut solver = Solver::new(shell, settings);
    let mut largest = 0.0_f32;
    for pose in frames {
        solver.step(pose).unwrap();
        largest = solver
            .offsets_rest_m()
            .map(|o| o.length())
            .fold(largest, f32::max);
    }
    (solver.offsets_rest_m().collect(), largest)
}

#[test]
fn a_mirrored_motion_gives_mirrored_offsets() {
    let body = body("female");
    let settings = SimSettings::for_body(&body);
    let shell = Shell::for_body(&body, &Run::shape(0), &settings).unwrap();
    // A hop on the left leg, through the first hops.
    let clip = motion(&body, ProceduralKind::OneLegHop, 60..180);
    let (left, largest) = played(&shell, &settings, &clip.frames);
    let (right, _) = played(&shell, &settings, &clip.mirrored().frames);
    assert!(largest > 0.01, "the hop must move the tissue: {largest} m");

    let at = |slot: usize| body.template_m[shell.vertices()[slot] as usize];
    let twin = |slot: usize| {
        let wanted = at(slot) * Vec3::new(-1.0, 1.0, 1.0);
        (0..left.len())
            .min_by(|a, b| {
                at(*a)
                    .distance_squared(wanted)
                    .total_cmp(&at(*b).distance_squared(wanted))
            })
            .unwrap()
    };
    let mut squares = [0.0_f32; 2];
    for slot in (0..left.len()).step_by(7) {
        let mirrored = left[twin(slot)] * Vec3::new(-1.0, 1.0, 1.0);
        squares[0] += (mirrored - right[slot]).length_squared();
        squares[1] += right[slot].length_squared();
    }
    let relative = (squares[0] / squares[1]).sqrt();
    println!("RMS difference to the mirror image: {relative:.4}");
    assert!(relative < 0.02, "{relative}");
}

#[test]
fn jitter_flips_and_teleports_stay_bounded() {
    let body = body("female");
    let settings = SimSettings::for_body(&body);
    let mut generator = rand_pcg::Pcg64Mcg::seed_from_u64(3);
    for shape in [0, 1, 5] {
        let shell = Shell::for_body(&body, &Run::shape(shape), &settings).unwrap();
        let mut clip = motion(&body, ProceduralKind::RunInPlace, 100..190);
        for pose in &mut clip.frames {
            // Jitter of about a degree and 3 mm a frame: hundreds of m/s².
            let mut noise = |size: f64| {
                DVec3::from_array(std::array::from_fn(|_| {
                    size * (generator.random::<f64>() - 0.5)
                }))
            };
            pose.root_translation_m += noise(6e-3);
            for rotation in &mut pose.parent_from_joint {
                *rotation *= DQuat::from_scaled_axis(noise(0.03));
            }
        }
        clip.frames[40].parent_from_joint[0] *= DQuat::from_rotation_y(3.0);
        clip.frames[60].root_translation_m += DVec3::new(5.0, 1.0, 0.0);
        let (last, largest) = played(&shell, &settings, &clip.frames);
        println!("shape {shape}: largest offset {largest} m");
        assert!(last.iter().all(|offset| offset.is_finite()));
        assert!(largest < 0.2, "shape {shape}: {largest} m");
    }
}

#[test]
fn arms_that_press_on_the_trunk_dent_it() {
    let body = body("female");
    let settings = SimSettings::for_body(&body);
    let shell = Shell::for_body(&body, &Run::shape(1), &settings).unwrap();
    // From the A-pose the arms come down to the sides within a second, and stay.
    let frames: Vec<Pose> = (0..150)
        .map(|tick| {
            let share = (f64::from(tick) / 60.0).min(1.0);
            let mut pose = Pose::REST;
            pose.parent_from_joint[16] = DQuat::from_rotation_z(-0.75 * share);
            pose.parent_from_joint[17] = DQuat::from_rotation_z(0.75 * share);
            pose
        })
        .collect();
    let (pressed, _) = played(&shell, &settings, &frames);
    let free = SimSettings {
        contact: false,
        ..settings.clone()
    };
    let (through, _) = played(&shell, &free, &frames);
    let dent = pressed
        .iter()
        .zip(&through)
        .map(|(a, b)| (*a - *b).length())
        .fold(0.0, f32::max);
    println!("contact moves the skin by up to {dent} m");
    assert!((0.004..0.06).contains(&dent), "{dent} m");
}

/// Between two bodies that are nearly alike nothing may jump, or no network can learn what a shape does.
#[test]
fn the_depth_of_tissue_changes_steadily_with_the_shape() {
    const STEPS: usize = 12;
    for name in ["female", "male"] {
        let body = body(name);
        let settings = SimSettings::for_body(&body);
        for line in 0..4 {
            let (from, to) = (drawn_shape(2 * line), drawn_shape(2 * line + 1));
            let depths_m: Vec<Vec<f32>> = (0..STEPS)
                .map(|step| {
                    let share = 0.3 * step as f32 / STEPS as f32;
                    let shape = std::array::from_fn(|k| from[k] + share * (to[k] - from[k]));
                    let shell = Shell::for_body(&body, &shape, &settings).unwrap();
                    shell.depth_m().to_vec()
                })
                .collect();
            let mut bent_m = 0.0_f32;
            let mut squares = 0.0_f32;
            for steps in depths_m.windows(3) {
                for ((before, now), after) in steps[0].iter().zip(&steps[1]).zip(&steps[2]) {
                    let bend_m = after - 2.0 * now + before;
                    bent_m = bent_m.max(bend_m.abs());
                    squares += bend_m * bend_m;
                }
            }
            let count = ((STEPS - 2) * depths_m[0].len()) as f32;
            let rms_m = (squares / count).sqrt();
            println!("{name}, line {line}: largest bend {bent_m} m, {rms_m} m RMS");
            assert!(bent_m < 1e-3 && rms_m < 1e-4, "{name}, line {line}");
        }
    }
}
