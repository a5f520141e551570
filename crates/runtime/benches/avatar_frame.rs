//! Cost of one avatar-frame, stage by stage, on a made-up body and bundle of the size of the
//! shipped ones: 6,890 vertices, 4,000 of them soft, an LSTM of 128 cells, 64 latents.

#[path = "../tests/support/mod.rs"]
mod support;

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use criterion::{Criterion, criterion_group, criterion_main};
use dynaskin_body::{BodyModel, PoseCorrectives};
use dynaskin_runtime::features::{FeatureKind, MotionFeatures};
use dynaskin_runtime::{Avatar, Skinning, StageSeconds};
use glam::Vec3;

const DT: f64 = 1.0 / 60.0;

fn features(criterion: &mut Criterion) {
    let body = support::body_of(support::LARGE);
    let mut inertial =
        MotionFeatures::new(FeatureKind::Inertial, &body.joint_template_m, &[0.0; 10]);
    let mut tick = 0;
    criterion.bench_function("features", |bencher| {
        bencher.iter(|| {
            tick += 1;
            black_box(inertial.push(&support::pose_at(f64::from(tick) * DT))[0])
        });
    });
}

fn frame(criterion: &mut Criterion) {
    let mut avatar = Avatar::new(support::model_of(support::LARGE), &[0.0; 10])
        .expect("the made-up bundle loads");
    let start = Instant::now();
    let mut stopwatch = || start.elapsed().as_secs_f64();
    let mut tick = 0;
    type Stage = fn(&StageSeconds) -> f64;
    let stages: [(&str, Stage); 5] = [
        ("step: features", |s| s.features),
        ("step: predict", |s| s.predict),
        ("step: decode", |s| s.decode),
        ("step: apply and normals", |s| s.apply),
        ("step: skin matrices", |s| s.skin),
    ];
    for (name, stage) in stages {
        criterion.bench_function(name, |bencher| {
            bencher.iter_custom(|iterations| {
                let mut seconds = 0.0;
                for _ in 0..iterations {
                    tick += 1;
                    let pose = support::pose_at(f64::from(tick) * DT);
                    let report = avatar.step_timed(&pose, DT, &mut stopwatch);
                    seconds += stage(&report.expect("the motion is valid").seconds);
                }
                std::time::Duration::from_secs_f64(seconds)
            });
        });
    }
    criterion.bench_function("step", |bencher| {
        bencher.iter(|| {
            tick += 1;
            avatar.step(&support::pose_at(f64::from(tick) * DT), DT)
        });
    });
    for (name, skinning) in [
        ("skin", Skinning::Linear),
        ("skin: dual quaternions", Skinning::DualQuaternion),
    ] {
        avatar.set_skinning(skinning);
        criterion.bench_function(name, |bencher| {
            bencher.iter(|| black_box(avatar.skin().0[0]))
        });
    }
}

/// Correctives that move the skin beside their joint alone, as sparse ones do; SMPL's move skin everywhere.
fn near_their_joints(mut body: BodyModel) -> BodyModel {
    for (row, dirs) in body.pose_dirs_m.iter_mut().enumerate() {
        let joint_m = body.joint_template_m[1 + row / 9];
        for (dir, at) in dirs.iter_mut().zip(&body.template_m) {
            if at.distance(joint_m) > 0.3 {
                *dir = Vec3::ZERO;
            }
        }
    }
    body
}

/// The step of a body that has pose correctives, with and without them, and of one that has none; the
/// correctives alone; and the step to a pose that stays.
fn pose_correctives(criterion: &mut Criterion) {
    let everywhere = support::corrected_body_of(support::LARGE);
    let near = near_their_joints(everywhere.clone());
    let mut rest_m = everywhere.template_m.clone();
    criterion.bench_function("pose correctives: as the body has them", |bencher| {
        let mut tick = 0;
        bencher.iter(|| {
            tick += 1;
            rest_m.copy_from_slice(&everywhere.template_m);
            everywhere.add_pose_correctives(&support::pose_at(f64::from(tick) * DT), &mut rest_m);
            black_box(rest_m[0])
        });
    });
    for (name, body) in [("everywhere", &everywhere), ("near joints", &near)] {
        let packed = PoseCorrectives::new(body).expect("the body has some");
        criterion.bench_function(&format!("pose correctives: {name}"), |bencher| {
            let mut tick = 0;
            bencher.iter(|| {
                tick += 1;
                rest_m.copy_from_slice(&body.template_m);
                packed.add(&support::pose_at(f64::from(tick) * DT), &mut rest_m);
                black_box(rest_m[0])
            });
        });
    }
    let model = support::model_with(support::LARGE, everywhere);
    let near = support::model_with(support::LARGE, near);
    let plain = support::model_of(support::LARGE);
    let cases = [
        ("step: body without pose correctives", plain, true),
        ("step: pose correctives off", Arc::clone(&model), false),
        ("step: pose correctives on", Arc::clone(&model), true),
        ("step: pose correctives near their joints on", near, true),
    ];
    let still = Avatar::new(model, &[0.0; 10]);
    let mut still = still.expect("the made-up bundle loads");
    criterion.bench_function("step: pose correctives on, the same pose", |bencher| {
        bencher.iter(|| still.step(&support::pose_at(0.3), DT));
    });
    for (name, model, corrects) in cases {
        let mut avatar = Avatar::new(model, &[0.0; 10]).expect("the made-up bundle loads");
        avatar.set_pose_correctives(corrects);
        let mut tick = 0;
        criterion.bench_function(name, |bencher| {
            bencher.iter(|| {
                tick += 1;
                avatar.step(&support::pose_at(f64::from(tick) * DT), DT)
            });
        });
    }
}

criterion_group!(benches, features, frame, pose_correctives);
criterion_main!(benches);
