//! The trainer on data whose law is known: damped oscillators whose frequency depends on shape.

use dynaskin_body::SHAPE_COUNT;
use dynaskin_train::{
    BlockSize, Checkpoint, Compute, Locality, PredictorData, Sequence, TrainConfig, TrainError,
    train,
};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

const MOTION: usize = 6;
const LATENT: usize = 8;
const DT_SECONDS: f32 = 1.0 / 60.0;

/// Oscillators driven by random motion; latents are positions of the oscillators, standardised.
fn sequences(count: usize, frames: usize, rng: &mut Pcg64Mcg) -> Vec<Sequence> {
    let mut law = Pcg64Mcg::seed_from_u64(5);
    let drive: Vec<f32> = (0..LATENT * MOTION)
        .map(|_| law.random_range(-1.0..1.0))
        .collect();
    (0..count)
        .map(|_| {
            let stiffness: f32 = rng.random_range(-1.0..1.0);
            let (mut position, mut velocity) = ([0.0f32; LATENT], [0.0f32; LATENT]);
            let (mut motion, mut latents) = (Vec::new(), Vec::new());
            let mut push = [0.0f32; MOTION];
            for _ in 0..frames {
                for push in &mut push {
                    *push = 0.8 * *push + 0.6 * rng.random_range(-1.7..1.7);
                }
                for k in 0..LATENT {
                    let omega =
                        std::f32::consts::TAU * (1.5 + 0.5 * k as f32) * (1.0 + 0.2 * stiffness);
                    let force: f32 = (0..MOTION).map(|j| drive[k * MOTION + j] * push[j]).sum();
                    for _ in 0..8 {
                        let acceleration =
                            omega * omega * (force - position[k]) - 0.5 * omega * velocity[k];
                        velocity[k] += acceleration * DT_SECONDS / 8.0;
                        position[k] += velocity[k] * DT_SECONDS / 8.0;
                    }
                }
                motion.extend(push);
                latents.extend(position.map(|x| x / 1.5));
            }
            let mut condition = vec![0.0; SHAPE_COUNT];
            condition[0] = 1.7 * stiffness;
            Sequence {
                motion,
                condition,
                latents,
                frames,
            }
        })
        .collect()
}

fn data() -> PredictorData {
    let mut rng = Pcg64Mcg::seed_from_u64(11);
    PredictorData {
        training: sequences(64, 240, &mut rng),
        validation: sequences(12, 240, &mut rng),
        deviation_m: vec![0.05; LATENT],
        blocks: vec![BlockSize {
            latents: LATENT,
            vertices: 100,
        }],
        locality: Locality::everywhere(MOTION, SHAPE_COUNT, LATENT),
        motion: MOTION,
        conditions: SHAPE_COUNT,
    }
}

fn config(epochs: usize) -> TrainConfig {
    TrainConfig {
        epochs,
        encoding: 16,
        springs: 24,
        hidden: 16,
        components: LATENT,
        window: 60,
        lanes: 16,
        learning_rate: 1e-2,
        ..TrainConfig::default()
    }
}

#[test]
fn learns_damped_oscillators_it_has_not_seen() {
    let dir = tempfile::tempdir().expect("a folder");
    let checkpoint = Checkpoint::new(dir.path()).expect("a checkpoint");
    let (_, best) = train(
        &data(),
        &config(24),
        Compute::Cpu,
        (&checkpoint, false),
        |_| {},
    )
    .expect("training succeeds");
    // An oscillator's own amplitude is 1; static prediction has ratio 1.
    assert!(best.validation_ratio < 0.25, "{}", best.validation_ratio);
}

#[test]
fn the_seed_fixes_the_numbers_and_a_resumed_run_ends_the_same() {
    let data = data();
    let run = |dir: &std::path::Path, epochs: usize, resume: bool| {
        let checkpoint = Checkpoint::new(dir).expect("a checkpoint");
        let mut losses = Vec::new();
        train(
            &data,
            &config(4),
            Compute::Cpu,
            (&checkpoint, resume),
            |record| {
                losses.push((record.training_loss, record.validation_ratio));
                if losses.len() == epochs {
                    // A run that is killed leaves its files as they are after an epoch.
                    copy(dir, &dir.with_extension("killed"));
                }
            },
        )
        .expect("training succeeds");
        losses
    };
    let dir = tempfile::tempdir().expect("a folder");
    let whole = run(&dir.path().join("a"), 2, false);
    let again = run(&dir.path().join("b"), 2, false);
    assert_eq!(whole, again);
    let resumed = run(&dir.path().join("a.killed"), 9, true);
    assert_eq!(whole[2..], resumed);
}

fn copy(from: &std::path::Path, to: &std::path::Path) {
    std::fs::create_dir_all(to).expect("a folder");
    for entry in std::fs::read_dir(from).expect("a folder") {
        let path = entry.expect("a file").path();
        std::fs::copy(&path, to.join(path.file_name().expect("a name"))).expect("a copy");
    }
}

#[test]
fn other_settings_cannot_be_resumed() {
    let data = data();
    let dir = tempfile::tempdir().expect("a folder");
    let checkpoint = Checkpoint::new(dir.path()).expect("a checkpoint");
    train(
        &data,
        &config(1),
        Compute::Cpu,
        (&checkpoint, false),
        |_| {},
    )
    .expect("training succeeds");
    let other = TrainConfig {
        hidden: 8,
        ..config(2)
    };
    let error = train(&data, &other, Compute::Cpu, (&checkpoint, true), |_| {})
        .expect_err("other settings");
    assert!(matches!(error, TrainError::Checkpoint { .. }), "{error}");
}

#[test]
fn a_run_without_progress_ends_early() {
    let data = data();
    let dir = tempfile::tempdir().expect("a folder");
    let checkpoint = Checkpoint::new(dir.path()).expect("a checkpoint");
    // Steps this small change no weight, so that no epoch is better than the first.
    let still = |epochs, patience_epochs| TrainConfig {
        learning_rate: 1e-12,
        weight_decay: 0.0,
        patience_epochs,
        ..config(epochs)
    };
    let run = |config: TrainConfig, resume: bool| {
        let mut epochs = Vec::new();
        let (_, best) = train(
            &data,
            &config,
            Compute::Cpu,
            (&checkpoint, resume),
            |record| epochs.push(record.epoch),
        )
        .expect("training succeeds");
        assert_eq!(best.epoch, 1);
        epochs
    };
    assert_eq!(run(still(50, 2), false), [1, 2, 3]);
    // It stays ended until somebody has more patience.
    assert!(run(still(50, 2), true).is_empty());
    assert_eq!(run(still(5, 0), true), [4, 5]);
}
