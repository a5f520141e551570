//! Autoencoder and regressor on tissue whose law is known: damped oscillators driven by the
//! acceleration of the root.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::config::{AutoencoderConfig, AutoencoderWidths, RegressorConfig};
use super::data::{ClipFields, Prepared};
use super::fit_autoencoder::fit_autoencoder;
use super::fit_regressor::{Lesson, fit_regressor};
use super::head::{Head, LatentScale};
use super::rigidity::Rigidity;
use super::span::Span;
use super::window::{KIND, POSE, differenced, normalise, normaliser};
use dynaskin_train::{Checkpoint, Compute, EpochRecord};

const VERTICES: usize = 10;

/// A root that wanders along x and y, and what it does to two modes: features, and offsets in metres.
fn clip(frames: usize, rng: &mut Pcg64Mcg) -> (Vec<f32>, Vec<f32>) {
    let (mut place, mut speed) = ([[0.0f32; 3]; 2], [0.0f32; 2]);
    let (mut mode, mut swing) = ([0.0f32; 2], [0.0f32; 2]);
    let (mut features, mut offsets_m) = (Vec::new(), Vec::new());
    for _ in 0..frames {
        let mut window = vec![0.0; KIND.count()];
        for axis in 0..2 {
            let push: f32 = rng.random_range(-0.002..0.002);
            speed[axis] = 0.9 * speed[axis] + push - 0.01 * place[axis][0];
            let now = place[axis][0] + speed[axis];
            place[axis] = [now, place[axis][0], place[axis][1]];
            let acceleration = place[axis][0] - 2.0 * place[axis][1] + place[axis][2];
            let stiffness = 0.1 + 0.08 * axis as f32;
            swing[axis] = 0.8 * swing[axis] - stiffness * mode[axis] - acceleration;
            mode[axis] += swing[axis];
            for (pose, place) in place[axis].iter().enumerate() {
                window[pose * POSE + axis] = *place;
            }
        }
        features.extend(window);
        for vertex in 0..VERTICES {
            // Each vertex has its share of both modes, and bends a little where they are large.
            let share = 0.3 + 0.1 * vertex as f32;
            let bent = 20.0 * mode[0] * mode[1];
            offsets_m.extend([
                share * mode[0] + 0.5 * bent,
                share * share * mode[1],
                share * bent,
            ]);
        }
    }
    (features, offsets_m)
}

fn prepared() -> Prepared {
    let mut rng = Pcg64Mcg::seed_from_u64(4);
    let clips: Vec<_> = (0..40).map(|_| clip(160, &mut rng)).collect();
    let rows: Vec<f32> = clips
        .iter()
        .flat_map(|(_, offsets_m)| offsets_m.clone())
        .collect();
    let sample = nalgebra::DMatrix::from_vec(3 * VERTICES, rows.len() / (3 * VERTICES), rows);
    let span = Span::fit(&sample.transpose(), 6, 1).expect("a span");
    let mut rigidity = Rigidity::new(VERTICES);
    let mut fields: Vec<ClipFields> = clips
        .iter()
        .map(|(features, offsets_m)| {
            rigidity.add(offsets_m);
            ClipFields {
                features: differenced(features),
                fields: span.normalised(offsets_m),
                frames: 160,
            }
        })
        .collect();
    let normaliser = normaliser(fields.iter().map(|clip| clip.features.as_slice()));
    for clip in &mut fields {
        normalise(&mut clip.features, &normaliser);
    }
    let validation = fields.split_off(32);
    Prepared {
        span,
        weights: rigidity.weights(),
        normaliser,
        training: fields,
        validation,
    }
}

fn autoencoder_config() -> AutoencoderConfig {
    AutoencoderConfig {
        widths: AutoencoderWidths {
            outer: 12,
            inner: 8,
            latent: 4,
        },
        epochs: 6,
        batch: 64,
        learning_rate: 2e-3,
        ..AutoencoderConfig::default()
    }
}

fn regressor_config(epochs: usize) -> RegressorConfig {
    RegressorConfig {
        hidden: Some(48),
        epochs,
        batch: 256,
        rollout: 8,
        learning_rate: 4e-3,
        ..RegressorConfig::default()
    }
}

#[test]
fn it_learns_oscillators_played_on_its_own_latents() {
    let data = prepared();
    let dir = tempfile::tempdir().expect("a folder");
    let keep = |name: &str| Checkpoint::new(&dir.path().join(name)).expect("a checkpoint");
    let (checkpoint, config) = (keep("autoencoder"), autoencoder_config());
    let (autoencoder, best) =
        fit_autoencoder(&data, &config, Compute::Cpu, (&checkpoint, false), |_| {})
            .expect("an autoencoder");
    assert!(best.validation_ratio < 0.1, "{best:?}");

    let (scale, latents) = LatentScale::fit(&autoencoder, &data);
    let head = Head::new(&autoencoder, &scale);
    let lesson = Lesson {
        data: &data,
        scale: &scale,
        latents,
        head: &head,
    };
    let train = |name: &str, epochs: usize, resume: bool| {
        let checkpoint = keep(name);
        let mut records: Vec<EpochRecord> = Vec::new();
        let config = regressor_config(epochs);
        let (_, best) = fit_regressor(
            &lesson,
            &config,
            Compute::Cpu,
            (&checkpoint, resume),
            |record| {
                records.push(record.clone());
            },
        )
        .expect("a regressor");
        (best, records)
    };
    let (best, records) = train("regressor", 24, false);
    assert!(best.validation_ratio < 0.35, "{best:?}");

    // The same seed gives the same numbers, and finished epochs are taken as they are.
    let losses = |records: &[EpochRecord]| -> Vec<(f32, f32)> {
        let both = |r: &EpochRecord| (r.training_loss, r.validation_ratio);
        records.iter().map(both).collect()
    };
    let again = train("regressor again", 24, false).1;
    assert_eq!(losses(&again), losses(&records));
    let (resumed, none) = train("regressor", 24, true);
    assert_eq!(resumed.validation_ratio, best.validation_ratio);
    assert!(none.is_empty(), "{none:?}");
}
