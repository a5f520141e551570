//! What the committed bodies promise.

mod common;

use std::collections::{HashMap, HashSet};

use common::default_bodies;
use dynaskin_body::{BodyModel, Joint, PARTS, REGION_COUNT, Region, SHAPE_COUNT};
use glam::Vec3;

/// β with one coefficient set.
fn shape(coefficient: usize, beta: f32) -> [f32; SHAPE_COUNT] {
    std::array::from_fn(|k| if k == coefficient { beta } else { 0.0 })
}

/// The vertex mirrored to the other side, found by position.
fn mirror(body: &BodyModel) -> Vec<usize> {
    let key = |p: Vec3| (p * 10_000.0).round().to_array().map(|x| x as i32);
    let at: HashMap<[i32; 3], usize> = body
        .template_m
        .iter()
        .enumerate()
        .map(|(vertex, &position)| (key(position), vertex))
        .collect();
    assert_eq!(at.len(), body.vertex_count(), "two vertices coincide");
    body.template_m
        .iter()
        .map(|position| at[&key(Vec3::new(-position.x, position.y, position.z))])
        .collect()
}

fn height_m(positions_m: &[Vec3]) -> f32 {
    let ys = || positions_m.iter().map(|position| position.y);
    ys().fold(f32::MIN, f32::max) - ys().fold(f32::MAX, f32::min)
}

fn volume_m3(positions_m: &[Vec3], faces: &[[u32; 3]]) -> f32 {
    let corner = |vertex: u32| positions_m[vertex as usize];
    faces
        .iter()
        .map(|&[a, b, c]| corner(a).dot(corner(b).cross(corner(c))) / 6.0)
        .sum()
}

#[test]
fn surfaces_are_closed_manifolds_of_smpls_size() {
    for body in default_bodies() {
        assert_eq!(body.vertex_count(), 6_890);
        assert_eq!(body.faces.len(), 13_776);
        assert_eq!(body.shape_dirs_m.len(), SHAPE_COUNT);
        let mut edges = HashSet::new();
        for &[a, b, c] in &body.faces {
            for edge in [(a, b), (b, c), (c, a)] {
                assert!(edges.insert(edge), "edge {edge:?} is walked twice");
            }
        }
        assert!(edges.iter().all(|&(a, b)| edges.contains(&(b, a))));
        let used: HashSet<u32> = body.faces.iter().flatten().copied().collect();
        assert_eq!(used.len(), body.vertex_count());
        // Euler's formula for one piece without handles.
        assert_eq!(used.len() + body.faces.len(), edges.len() / 2 + 2);
        assert!(volume_m3(&body.template_m, &body.faces) > 0.0, "inside out");
    }
}

#[test]
fn everything_is_mirrored() {
    for body in default_bodies() {
        let mirror = mirror(&body);
        for (vertex, &twin) in mirror.iter().enumerate() {
            for dirs in &body.shape_dirs_m {
                let flipped = Vec3::new(-dirs[twin].x, dirs[twin].y, dirs[twin].z);
                assert!(dirs[vertex].distance(flipped) < 1.8e-4, "vertex {vertex}");
            }
            for weights in &body.region_weights {
                assert!((weights[vertex] - weights[twin]).abs() < 0.01);
            }
            let thickness = &body.thickness_template_m;
            assert!((thickness[vertex] - thickness[twin]).abs() < 1e-4);
            let heaviest = Joint::ALL[usize::from(body.skin[vertex].joints[0])];
            let weight_of = |v: usize, joint: Joint| -> f32 {
                let skin = body.skin[v];
                (0..4)
                    .filter(|&slot| usize::from(skin.joints[slot]) == joint as usize)
                    .map(|slot| skin.weights[slot])
                    .sum()
            };
            let here = weight_of(vertex, heaviest);
            assert!((here - weight_of(twin, heaviest.mirrored())).abs() < 1e-3);
        }
        for joint in Joint::ALL {
            let [own, twin] = [joint, joint.mirrored()].map(|j| body.joint_template_m[j as usize]);
            assert!(own.distance(Vec3::new(-twin.x, twin.y, twin.z)) < 1e-4);
        }
    }
}

#[test]
fn skin_weights_sum_to_one() {
    for body in default_bodies() {
        for skin in &body.skin {
            assert!((skin.weights.iter().sum::<f32>() - 1.0).abs() < 1e-5);
            assert!(skin.weights.windows(2).all(|pair| pair[0] >= pair[1]));
        }
    }
}

#[test]
fn every_shape_stands_on_the_floor_under_its_pelvis() {
    for body in default_bodies() {
        for coefficient in 0..SHAPE_COUNT {
            for beta in [-2.0, 0.0, 2.0] {
                let shaped = body.shaped(&shape(coefficient, beta));
                let lowest = shaped
                    .positions_m
                    .iter()
                    .map(|p| p.y)
                    .fold(f32::MAX, f32::min);
                assert!(
                    lowest.abs() < 0.003,
                    "β{coefficient} = {beta}: sole at {lowest} m"
                );
                let pelvis = shaped.joints_m[0];
                assert!(pelvis.x.abs() < 1e-4 && pelvis.z.abs() < 1e-3, "{pelvis}");
            }
        }
    }
}

#[test]
fn the_first_coefficient_is_stature_and_the_others_keep_it() {
    for body in default_bodies() {
        let still = body.shaped(&[0.0; SHAPE_COUNT]);
        let tall = body.shaped(&shape(0, 2.0));
        let scale = height_m(&tall.positions_m) / height_m(&still.positions_m);
        assert!((1.04..1.12).contains(&scale), "{scale}");
        for (tall, still) in tall.positions_m.iter().zip(&still.positions_m) {
            assert!(tall.distance(scale * *still) < 4e-4);
        }
        for (tall, still) in tall.joints_m.iter().zip(&still.joints_m) {
            assert!(tall.distance(scale * *still) < 4e-4);
        }
        for coefficient in 1..SHAPE_COUNT {
            let other = body.shaped(&shape(coefficient, 2.0));
            let ratio = height_m(&other.positions_m) / height_m(&still.positions_m);
            assert!((ratio - 1.0).abs() < 0.01, "β{coefficient}: {ratio}");
        }
    }
}

#[test]
fn joints_follow_the_shape_inside_the_body() {
    for body in default_bodies() {
        let wide = body.shaped(&shape(1, 2.0));
        let thin = body.shaped(&shape(1, -2.0));
        let middle = body.shaped(&[0.0; SHAPE_COUNT]);
        for joint in 0..24 {
            let mean = 0.5 * (wide.joints_m[joint] + thin.joints_m[joint]);
            assert!(mean.distance(middle.joints_m[joint]) < 1e-5, "not linear");
        }
        for shaped in [wide, thin, middle] {
            let low = shaped
                .positions_m
                .iter()
                .copied()
                .reduce(Vec3::min)
                .unwrap();
            let high = shaped
                .positions_m
                .iter()
                .copied()
                .reduce(Vec3::max)
                .unwrap();
            for joint in shaped.joints_m {
                assert!(joint.cmpgt(low).all() && joint.cmplt(high).all(), "{joint}");
            }
        }
    }
}

#[test]
fn tissue_is_thicker_on_a_heavier_body() {
    for body in default_bodies() {
        let [thin, heavy] = [-1.5, 1.5].map(|beta| body.shaped(&shape(1, beta)));
        assert!(
            volume_m3(&heavy.positions_m, &body.faces) > volume_m3(&thin.positions_m, &body.faces)
        );
        for region in [Region::Belly, Region::Buttocks, Region::Thighs] {
            let weights = &body.region_weights[region as usize];
            let mean = |thickness: &[f32]| -> f32 {
                let sum: f32 = thickness.iter().zip(weights).map(|(t, w)| t * w).sum();
                sum / weights.iter().sum::<f32>()
            };
            let [thin, heavy] = [&thin, &heavy].map(|shaped| mean(&shaped.thickness_m));
            assert!(heavy > 1.3 * thin, "{region:?}: {thin} m and {heavy} m");
        }
        for shaped in [&thin, &heavy] {
            for (vertex, &thickness) in shaped.thickness_m.iter().enumerate() {
                assert!(thickness < 0.2);
                if body.softness(vertex) > 0.05 {
                    assert!(thickness > 0.001, "vertex {vertex}: {thickness} m");
                }
            }
        }
    }
}

#[test]
fn thickness_at_the_mean_shape_is_near_the_measured_one() {
    // Millimetres, wide about the measurements: D-cup breast 56 at its thickest, gluteal fat at a
    // body-mass index of 24 about 40, distal thigh 16.7 (women) and 6.5 (men).
    let expected = |name: &str, region: Region| match (name, region) {
        ("female", Region::Chest) => 30.0..80.0,
        (_, Region::Buttocks) => 30.0..60.0,
        ("female", Region::Thighs) => 12.0..45.0,
        ("male", Region::Thighs) => 5.0..35.0,
        (_, Region::Calves | Region::UpperArms) => 4.0..30.0,
        _ => 10.0..60.0,
    };
    for body in default_bodies() {
        for region in Region::ALL {
            let weights = &body.region_weights[region as usize];
            let full = (0..body.vertex_count()).filter(|&v| weights[v] > 0.5);
            let thickest = full
                .map(|v| 1e3 * body.thickness_template_m[v])
                .fold(0.0, f32::max);
            let range = expected(&body.name, region);
            assert!(
                range.contains(&thickest),
                "{} {region:?}: {thickest} mm",
                body.name
            );
        }
    }
}

#[test]
fn regions_are_smooth_and_spare_head_hands_and_feet() {
    for body in default_bodies() {
        assert_eq!(body.region_weights.len(), REGION_COUNT);
        for weights in &body.region_weights {
            assert!(weights.iter().filter(|&&w| w > 0.5).count() > 50);
            for &[a, b, c] in &body.faces {
                for (from, to) in [(a, b), (b, c), (c, a)] {
                    let step = (weights[from as usize] - weights[to as usize]).abs();
                    assert!(step < 0.5, "a jump of {step}");
                }
            }
        }
        for vertex in 0..body.vertex_count() {
            let sum: f32 = body.region_weights.iter().map(|w| w[vertex]).sum();
            assert!(sum <= 1.0 + 3.0 / 255.0);
            let joint = Joint::ALL[usize::from(body.skin[vertex].joints[0])];
            let bony = [
                Joint::Head,
                Joint::LeftHand,
                Joint::RightHand,
                Joint::LeftFoot,
                Joint::RightFoot,
            ];
            if bony.contains(&joint) && body.skin[vertex].weights[0] > 0.9 {
                assert_eq!(sum, 0.0, "vertex {vertex} of {joint:?}");
            }
        }
    }
}

#[test]
fn the_parts_of_a_region_share_its_weight_and_one_is_thicker() {
    for body in default_bodies() {
        let parts = body.region_parts();
        assert_eq!(parts.len(), REGION_COUNT * PARTS);
        for (weights, parts) in body.region_weights.iter().zip(parts.chunks(PARTS)) {
            let sum = |weights: &[f32]| weights.iter().sum::<f32>();
            let mean_m = |part: &[f32]| {
                let thickness = body.thickness_template_m.iter().zip(part);
                thickness.map(|(t, w)| t * w).sum::<f32>() / sum(part)
            };
            let (thick, thin) = (&parts[0], &parts[1]);
            assert!((sum(thick) / sum(weights) - 0.5).abs() < 0.01);
            assert!(mean_m(thick) > mean_m(thin));
            for (vertex, weight) in weights.iter().enumerate() {
                assert_eq!(thick[vertex] + thin[vertex], *weight);
            }
        }
    }
}
