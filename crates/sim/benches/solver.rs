//! Simulated frames per second: a slab of about as many vertices as a body has soft ones.

#[path = "../tests/common/mod.rs"]
mod common;

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use dynaskin_body::Pose;
use dynaskin_sim::{SimSettings, Solver};

fn frames(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("simulate");
    group.sample_size(10).throughput(Throughput::Elements(1));
    let settings = SimSettings::default();
    for width_m in [0.3_f32, 0.55] {
        let shell = common::slab_shell(width_m, 0.01, 0.03, &settings);
        let mut solver = Solver::new(&shell, &settings);
        let mut tick = 0.0;
        group.bench_function(
            format!("frame of {} vertices", shell.vertices().len()),
            |bench| {
                bench.iter(|| {
                    tick += 1.0 / 60.0;
                    let mut pose = Pose::REST;
                    pose.root_translation_m.y = 0.05 * f64::sin(15.0 * tick);
                    solver.step(black_box(&pose)).expect("stable");
                });
            },
        );
    }
    group.finish();
}

criterion_group!(benches, frames);
criterion_main!(benches);
