//! Tissue pressed against tissue of another limb.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

mod common;

use common::{plain_settings, slab};
use dynaskin_body::{Joint, Pose, SkinWeights};
use dynaskin_sim::{Shell, SimSettings, Solver, Surface};
use glam::{DQuat, Vec3};

const GAP_M: f32 = 0.03;

/// Two slabs face to face, [`GAP_M`] apart: the lower one on the left thigh, the upper one on the
/// right thigh, whose joint lies a metre away so that turning it moves the slab down.
fn two_slabs() -> Surface {
    let lower = slab(0.1, 0.0125, 0.02);
    let count = lower.positions_m.len() as u32;
    let mut both = lower.clone();
    let upper = lower.positions_m.iter().map(|p| *p + Vec3::Y * GAP_M);
    both.positions_m.extend(upper);
    // The upper one faces down: its triangles turn the other way.
    both.faces.extend(
        lower
            .faces
            .iter()
            .map(|[a, b, c]| [a + count, c + count, b + count]),
    );
    for (first, joint) in [(0, Joint::LeftHip), (count, Joint::RightHip)] {
        let skin = SkinWeights {
            joints: [joint as u8, 0, 0, 0],
            weights: [1.0, 0.0, 0.0, 0.0],
        };
        if first == 0 {
            both.skin.fill(skin);
        } else {
            both.skin.extend(vec![skin; count as usize]);
        }
    }
    both.depth_m.extend(lower.depth_m.clone());
    for (weights, more) in both.region_weights.iter_mut().zip(&lower.region_weights) {
        weights.extend(more);
    }
    both.split_order.extend(lower.split_order.clone());
    both.joints_rest_m[Joint::RightHip as usize] = Vec3::new(-1.0, GAP_M, 0.05);
    both
}

fn settings() -> SimSettings {
    let mut settings = plain_settings();
    for tissue in &mut settings.tissues {
        tissue.damping_ratio = 0.5;
    }
    settings
}

/// Vertical displacement of the middle of the lower and the upper slab, after the upper one has
/// moved down by about `down_m` and stayed there.
fn pressed(down_m: f64) -> [f32; 2] {
    let settings = settings();
    let surface = two_slabs();
    let shell = Shell::new(&surface, &settings).unwrap();
    let mut solver = Solver::new(&shell, &settings);
    for tick in 0..120 {
        let mut pose = Pose::REST;
        let share = (f64::from(tick) / 60.0).min(1.0);
        // The middle of the slab is 1.05 m from its joint.
        let angle = -down_m / 1.05 * share;
        pose.parent_from_joint[Joint::RightHip as usize] = DQuat::from_rotation_z(angle);
        solver.step(&pose).unwrap();
    }
    let all: Vec<Vec3> = solver.displacements_world_m().collect();
    let half = all.len() / 2;
    [half / 2, half + half / 2].map(|slot| all[slot].y)
}

#[test]
fn slabs_that_do_not_touch_do_not_move_each_other() {
    for y in pressed(f64::from(GAP_M) - 0.01) {
        // Turning by a degree changes gravity's direction in the slab a little.
        assert!(y.abs() < 2e-4, "{y} m");
    }
}

#[test]
fn pressed_slabs_make_room_for_each_other_evenly() {
    let overlap_m = 0.008;
    let [lower, upper] = pressed(f64::from(GAP_M + overlap_m));
    println!("overlap {overlap_m} m of skinning: lower {lower} m, upper {upper} m");
    assert!(lower < -1e-3 && upper > 1e-3, "{lower} {upper}");
    assert!(
        (lower + upper).abs() < 0.3 * (upper - lower),
        "{lower} {upper}"
    );
    let left_m = overlap_m - (upper - lower);
    assert!(left_m < 0.5 * overlap_m, "{left_m} m of overlap are left");
}

#[test]
fn deep_overlap_of_the_bones_stays_bounded_and_finite() {
    let [lower, upper] = pressed(f64::from(GAP_M) + 0.045);
    assert!(lower.is_finite() && upper.is_finite());
    assert!(lower.abs() < 0.03 && upper.abs() < 0.03, "{lower} {upper}");
}
