//! Simulated frames per second, by the number of vertices (a body has about 2,500 soft ones) and
//! of threads.

#[path = "../tests/common/mod.rs"]
mod common;

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use dynaskin_body::Pose;
use dynaskin_sim::{SimSettings, Solver};
use rayon::prelude::*;

fn frames(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("simulate");
    group.sample_size(10).throughput(Throughput::Elements(1));
    let settings = SimSettings::default();
    for width_m in [0.24_f32, 0.35, 0.5, 0.7] {
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

/// Clips side by side: frames per second should grow with the threads, as clips share nothing.
fn threads(criterion: &mut Criterion) {
    const CLIPS: usize = 4;
    const FRAMES: usize = 5;
    let mut group = criterion.benchmark_group("threads");
    group
        .sample_size(10)
        .throughput(Throughput::Elements((CLIPS * FRAMES) as u64));
    let settings = SimSettings::default();
    let shell = common::slab_shell(0.5, 0.01, 0.03, &settings);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    for count in [1, 2, 4].into_iter().filter(|count| *count <= cores) {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(count)
            .build()
            .expect("a pool of threads");
        group.bench_function(format!("{CLIPS} clips on {count} threads"), |bench| {
            bench.iter(|| {
                pool.install(|| {
                    (0..CLIPS).into_par_iter().for_each(|_| {
                        let mut solver = Solver::new(&shell, &settings);
                        for _ in 0..FRAMES {
                            solver.step(black_box(&Pose::REST)).expect("stable");
                        }
                    });
                });
            });
        });
    }
    group.finish();
}

criterion_group!(benches, frames, threads);
criterion_main!(benches);
