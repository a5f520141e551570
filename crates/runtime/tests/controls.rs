//! Controls: response, limits, root inertia, presets and scale.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

#[path = "support/shipped.rs"]
mod shipped;

use dynaskin_body::{Pose, Region};
use dynaskin_motion::{Clip, ProceduralKind};
use dynaskin_runtime::{Avatar, Controls, MAX_RESPONSE, RuntimeError};
use glam::{DVec3, Vec3};
use shipped::{distance, largest};

const DT: f64 = 1.0 / 60.0;

/// Offsets of each frame of `clip`.
fn frames(avatar: &mut Avatar, clip: &Clip) -> Vec<Vec<Vec3>> {
    let step = |pose: &Pose| {
        avatar.step(pose, DT).unwrap();
        avatar.offsets_rest_m().to_vec()
    };
    clip.frames.iter().map(step).collect()
}

fn peak(frames: &[Vec<Vec3>]) -> f32 {
    frames
        .iter()
        .map(|offsets| largest(offsets))
        .fold(0.0, f32::max)
}

/// All regions with the same stiffness and damping.
fn response(stiffness: f32, damping: f32) -> Controls {
    let mut controls = Controls::default();
    for region in &mut controls.regions {
        (region.stiffness, region.damping) = (stiffness, damping);
    }
    controls
}

#[test]
fn stiffer_and_more_damped_tissue_moves_less_and_rests_sooner() {
    let model = shipped::model("female");
    let clip = shipped::clip(ProceduralKind::Hop, &shipped::avatar(&model));
    let hopped = |controls: &Controls| {
        let mut avatar = shipped::avatar(&model);
        avatar.set_controls(controls).unwrap();
        frames(&mut avatar, &clip)
    };
    let plain = hopped(&Controls::default());
    let barely = hopped(&response(1.0, 1.0001));
    let off = plain.iter().zip(&barely).map(|(a, b)| distance(a, b));
    let off = off.fold(0.0, f32::max);
    let (stiff, damped) = (hopped(&response(6.0, 1.0)), hopped(&response(1.0, 4.0)));
    println!(
        "hop: {:.1} mm as predicted, {:.1} stiff, {:.1} damped; filters at 1 off by {:.3} mm",
        1e3 * peak(&plain),
        1e3 * peak(&stiff),
        1e3 * peak(&damped),
        1e3 * off
    );
    assert!(off <= 1e-4, "{off}");
    assert!(peak(&stiff) < 0.7 * peak(&plain));
    assert!(peak(&damped) < 0.85 * peak(&plain));
}

#[test]
fn one_regions_stiffness_changes_the_others_less() {
    let model = shipped::model("female");
    let clip = shipped::clip(ProceduralKind::Hop, &shipped::avatar(&model));
    let mut controls = Controls::default();
    controls.regions[Region::Belly as usize].stiffness = 8.0;
    let (mut stiff, mut plain) = (shipped::avatar(&model), shipped::avatar(&model));
    stiff.set_controls(&controls).unwrap();
    let (stiff, plain) = (frames(&mut stiff, &clip), frames(&mut plain, &clip));
    let weights = &model.body().region_weights;
    // Root of the sum of squares of what changes, over that of the offsets as predicted. Tissue hangs
    // together: in the simulator the same belly changes by 0.87 and the rest by 0.49.
    let changed = |counts: &dyn Fn(f32) -> bool| {
        let (mut off, mut size) = (0.0_f64, 0.0_f64);
        for (a, b) in stiff.iter().zip(&plain) {
            let chosen = weights[Region::Belly as usize].iter().enumerate();
            for (vertex, _) in chosen.filter(|(_, weight)| counts(**weight)) {
                off += f64::from(a[vertex].distance_squared(b[vertex]));
                size += f64::from(b[vertex].length_squared());
            }
        }
        (off / size).sqrt()
    };
    let (belly, elsewhere) = (changed(&|w| w > 0.99), changed(&|w| w < 1e-6));
    println!("belly changes by {belly} of itself, the rest by {elsewhere}");
    assert!(belly > 0.5 && elsewhere < 0.5, "{belly} {elsewhere}");
}

#[test]
fn every_response_is_stable_at_every_rate_and_may_change_in_mid_motion() {
    let model = shipped::model("female");
    let clip = shipped::clip(ProceduralKind::RunInPlace, &shipped::avatar(&model));
    let mut avatar = shipped::avatar(&model);
    let extremes = [1.0 / MAX_RESPONSE, 1.0, MAX_RESPONSE];
    for (number, rate) in [24.0, 60.0, 144.0].into_iter().cycle().take(18).enumerate() {
        let controls = response(extremes[number % 3], extremes[number / 3 % 3]);
        avatar.set_controls(&controls).unwrap();
        for frame in 0..60 {
            let pose = clip.pose_at((f64::from(frame) / rate) % clip.duration_seconds());
            avatar.step(&pose, 1.0 / rate).unwrap();
            let largest = largest(avatar.offsets_rest_m());
            assert!(largest.is_finite() && largest <= 0.2);
        }
    }
    avatar.set_controls(&Controls::default()).unwrap();
    // At rest afterwards, as if nothing had been.
    let mut fresh = shipped::avatar(&model);
    avatar.reset();
    for _ in 0..5 {
        avatar.step(&Pose::REST, DT).unwrap();
        fresh.step(&Pose::REST, DT).unwrap();
    }
    assert_eq!(avatar.offsets_rest_m(), fresh.offsets_rest_m());
}

#[test]
fn limits_hold_and_small_offsets_pass() {
    let model = shipped::model("female");
    let clip = shipped::clip(ProceduralKind::Hop, &shipped::avatar(&model));
    let mut controls = Controls::default();
    for region in &mut controls.regions {
        region.limit_m = 0.01;
    }
    let (mut limited, mut plain) = (shipped::avatar(&model), shipped::avatar(&model));
    limited.set_controls(&controls).unwrap();
    let (limited, plain) = (frames(&mut limited, &clip), frames(&mut plain, &clip));
    assert!(peak(&plain) > 0.012, "the hop does not reach the limit");
    assert!(peak(&limited) <= 0.01 + 1e-7, "{}", peak(&limited));
    for (a, b) in limited.iter().flatten().zip(plain.iter().flatten()) {
        if b.length() < 0.0049 {
            assert_eq!(a, b);
        }
    }
    let mut none = controls;
    none.regions[Region::Belly as usize].limit_m = 0.0;
    let mut avatar = shipped::avatar(&model);
    avatar.set_controls(&none).unwrap();
    let belly = &model.body().region_weights[Region::Belly as usize];
    for offsets in frames(&mut avatar, &clip) {
        let inside = offsets.iter().zip(belly).filter(|(_, w)| **w > 0.999);
        assert!(inside.map(|(o, _)| o.length()).all(|length| length == 0.0));
    }
}

#[test]
fn without_root_inertia_a_lift_that_jerks_moves_nothing() {
    let model = shipped::model("female");
    let jerk = |root_inertia: f32| {
        let mut avatar = shipped::avatar(&model);
        let mut controls = Controls::default();
        controls.root_inertia = root_inertia;
        avatar.set_controls(&controls).unwrap();
        avatar.step(&Pose::REST, 0.0).unwrap();
        let rest = avatar.offsets_rest_m().to_vec();
        let mut worst = 0.0_f32;
        for tick in 0..120 {
            let mut pose = Pose::REST;
            pose.root_translation_m.y = 0.05 * (12.0 * f64::from(tick) * DT).sin();
            avatar.step(&pose, DT).unwrap();
            worst = worst.max(distance(&rest, avatar.offsets_rest_m()));
        }
        worst
    };
    let [none, half, full] = [0.0, 0.5, 1.0].map(jerk);
    println!("jerking lift: {none} m without, {half} m with half, {full} m with all inertia");
    assert!(none < 5e-4, "{none}");
    // More than half of it: tissue stiffens with strain.
    assert!(half < 0.9 * full && full > 2e-3, "{half} {full}");
}

#[test]
fn calm_clothes_calm() {
    let model = shipped::model("female");
    let clip = shipped::clip(ProceduralKind::Hop, &shipped::avatar(&model));
    let (mut calm, mut plain) = (shipped::avatar(&model), shipped::avatar(&model));
    calm.set_controls(&Controls::calm_clothes()).unwrap();
    let (calm, plain) = (
        peak(&frames(&mut calm, &clip)),
        peak(&frames(&mut plain, &clip)),
    );
    println!("hop: {calm} m in calm clothes, {plain} m without");
    assert!(calm < 0.6 * plain && calm <= 0.02 && calm > 1e-3, "{calm}");
}

#[test]
fn a_doll_and_a_giant_show_the_same_picture() {
    let model = shipped::model("female");
    let clip = shipped::clip(ProceduralKind::Jump, &shipped::avatar(&model));
    let mut reference = shipped::avatar(&model);
    let scales = [0.1, 0.5, 3.0, 10.0];
    let mut others = scales.map(|scale| {
        let mut avatar = shipped::avatar(&model);
        avatar.set_scale(scale).unwrap();
        avatar
    });
    for (frame, pose) in clip.frames.iter().enumerate() {
        reference.step(pose, DT).unwrap();
        for (avatar, scale) in others.iter_mut().zip(scales) {
            let mut scaled = pose.clone();
            scaled.root_translation_m *= scale;
            avatar.step(&scaled, DT).unwrap();
            assert!(distance(reference.offsets_rest_m(), avatar.offsets_rest_m()) < 1e-5);
            if frame % 50 == 0 {
                let (skinned, normals) = avatar.skin();
                let (expected, expected_normals) = reference.skin();
                let world: Vec<Vec3> = expected.iter().map(|p| *p * scale as f32).collect();
                assert!(distance(&world, skinned) < 1e-4 * scale as f32);
                assert!(distance(expected_normals, normals) < 1e-3);
            }
        }
    }
}

#[test]
fn growing_on_the_spot_far_from_the_origin_does_not_shake() {
    let model = shipped::model("female");
    let mut avatar = shipped::avatar(&model);
    let mut pose = Pose::REST;
    pose.root_translation_m = DVec3::new(30.0, 0.0, 12.0);
    for _ in 0..10 {
        avatar.step(&pose, DT).unwrap();
    }
    let rest = avatar.offsets_rest_m().to_vec();
    for tick in 0..120 {
        avatar.set_scale(1.0 + f64::from(tick) / 60.0).unwrap();
        let report = avatar.step(&pose, DT).unwrap();
        assert_eq!(report.settled, None);
        assert!(distance(&rest, avatar.offsets_rest_m()) < 5e-4);
    }
}

/// Largest change of the offsets from one frame to the next while `shape` runs along a walk.
fn largest_step(avatar: &mut Avatar, clip: &Clip, shape: impl Fn(f32) -> [f32; 10]) -> f32 {
    let frames = &clip.frames[..200];
    let mut before: Option<Vec<Vec3>> = None;
    let mut largest = 0.0_f32;
    for (frame, pose) in frames.iter().enumerate() {
        let shape = shape(frame as f32 / frames.len() as f32);
        if *avatar.shape() != shape {
            avatar.set_shape(&shape).unwrap();
        }
        avatar.step(pose, DT).unwrap();
        let offsets = avatar.offsets_rest_m();
        if let Some(before) = &before {
            largest = largest.max(distance(before, offsets));
        }
        before = Some(offsets.to_vec());
    }
    largest
}

#[test]
fn the_shape_changes_in_mid_motion_without_a_pop() {
    let model = shipped::model("female");
    let heavy = |share: f32| std::array::from_fn(|k| if k == 1 { 2.0 * share } else { 0.0 });
    let clip = shipped::clip(ProceduralKind::Walk, &shipped::avatar(&model));
    let walk = |shape: &dyn Fn(f32) -> [f32; 10]| {
        let mut avatar = shipped::avatar(&model);
        avatar.set_shape(&shape(0.0)).unwrap();
        largest_step(&mut avatar, &clip, shape)
    };
    let (light, heavy_only) = (walk(&|_| heavy(0.0)), walk(&|_| heavy(1.0)));
    let changing = walk(&heavy);
    let sudden = walk(&|share| heavy(if share < 0.5 { 0.0 } else { 1.0 }));
    println!(
        "largest step of a frame: {light} m light, {heavy_only} m heavy, {changing} m while \
         changing, {sudden} m where it changes at once"
    );
    let usual = light.max(heavy_only);
    assert!(changing <= 1.5 * usual + 1e-3, "{changing}");
    assert!(sudden <= 2.0 * usual + 2e-3, "{sudden}");
}

#[test]
fn controls_out_of_range_are_refused_by_name_and_change_nothing() {
    let model = shipped::model("female");
    let mut avatar = shipped::avatar(&model);
    avatar.set_controls(&Controls::calm_clothes()).unwrap();
    type Spoil = fn(&mut Controls);
    let cases: [(&str, Spoil); 7] = [
        ("strength", |c| c.strength = -1.0),
        ("root inertia", |c| c.root_inertia = f32::NAN),
        ("gain of region chest", |c| c.regions[0].gain = 5.0),
        ("stiffness of region belly", |c| {
            c.regions[1].stiffness = 0.0
        }),
        ("damping of region thighs", |c| {
            c.regions[3].damping = f32::INFINITY
        }),
        ("damping of region calves", |c| c.regions[4].damping = 11.0),
        ("limit in metres of region upper-arms", |c| {
            c.regions[5].limit_m = 0.3
        }),
    ];
    for (name, spoil) in cases {
        let mut controls = Controls::default();
        spoil(&mut controls);
        let error = avatar.set_controls(&controls).unwrap_err();
        assert!(matches!(error, RuntimeError::InvalidControl { .. }));
        assert!(error.to_string().contains(name), "{error}");
        assert_eq!(avatar.controls(), &Controls::calm_clothes());
    }
    for scale in [0.0, 0.09, 11.0, f64::NAN, -1.0] {
        let error = avatar.set_scale(scale).unwrap_err();
        assert!(matches!(error, RuntimeError::InvalidControl { .. }));
        assert_eq!(avatar.scale(), 1.0);
    }
}
