//! Cost of one avatar-frame, stage by stage, on a made-up body and bundle of the size of the
//! shipped ones: 6,890 vertices, 4,000 of them soft, an LSTM of 128 cells, 64 latents.

#[path = "../tests/support/mod.rs"]
mod support;

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use criterion::{Criterion, criterion_group, criterion_main};
use dynaskin_runtime::features::{FeatureKind, MotionFeatures};
use dynaskin_runtime::{Avatar, StageSeconds};

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
    criterion.bench_function("skin", |bencher| {
        bencher.iter(|| black_box(avatar.skin().0[0]))
    });
}

/// The step of a body that has pose correctives, with and without them, and of one that has none.
fn pose_correctives(criterion: &mut Criterion) {
    let body = support::corrected_body_of(support::LARGE);
    let model = support::model_with(support::LARGE, body);
    let plain = support::model_of(support::LARGE);
    let cases = [
        ("step: body without pose correctives", plain, true),
        ("step: pose correctives off", Arc::clone(&model), false),
        ("step: pose correctives on", model, true),
    ];
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
