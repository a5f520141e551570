//! The networks in `models/`, those of the compared methods among them, over many random ticks: the
//! same numbers as tract without dynaskin.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used, clippy::print_stdout)] // The numbers are for people to read.

mod plain_tract;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use dynaskin_body::BodyModel;
use dynaskin_motion::{Procedural, ProceduralKind};
use dynaskin_runtime::features::{FeatureKind, Materials, clip_features};
use dynaskin_runtime::{Bundle, Decoder, DecoderSession, Predictor, PredictorSession};
use plain_tract::PlainTract;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;

const TICKS: usize = 10_000;

/// Ticks for which one body stays.
const TICKS_PER_BODY: usize = 100;

/// Largest difference of an offset, in metres.
const TOLERANCE_M: f32 = 1e-6;

/// Latents may differ by this share of their largest number: rounding lives on in the state.
const LATENT_TOLERANCE: f32 = 1e-4;

fn models() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models")
}

/// Features of all ticks of some motions on the body of `body_folder`.
fn features(kind: FeatureKind, body_folder: &Path) -> Vec<Vec<f32>> {
    let body = BodyModel::from_glb(&std::fs::read(body_folder.join("body.glb")).unwrap()).unwrap();
    let shape = [0.0; 10];
    let joints_m = body.shaped(&shape).joints_m;
    let mut ticks = Vec::new();
    for motion in [
        ProceduralKind::Hop,
        ProceduralKind::Walk,
        ProceduralKind::JumpingJacks,
    ] {
        let clip = Procedural::new(motion).clip(&joints_m).unwrap();
        let materials = Materials::default();
        let (frames, rate_hz) = (&clip.frames, clip.rate_hz);
        let numbers = clip_features(kind, frames, rate_hz, &joints_m, &shape, &materials).unwrap();
        ticks.extend(numbers.chunks(kind.count()).map(<[f32]>::to_vec));
    }
    ticks
}

/// Plays random ticks of real motions, scaled at random, on random bodies. Latents are compared at every
/// tick, offsets at every `decoded`-th.
fn the_same_as_tract(folder: &str, decoded: usize) {
    let folder = models().join(folder);
    let body_folder = folder
        .ancestors()
        .find(|f| f.join("body.glb").is_file())
        .unwrap();
    let read = |file: &str| std::fs::read(folder.join(file)).unwrap();
    let kind = Bundle::from_json(&read("bundle.json"))
        .unwrap()
        .feature_kind;
    let (motion, conditions) = (kind.motion_count(), kind.condition_count());
    let load = Predictor::load_conditioned(&read("predictor.onnx"), conditions);
    let decoder = Decoder::load(&read("decoder.onnx")).unwrap();
    let mut predictor = PredictorSession::new(Arc::new(load.unwrap())).unwrap();
    let mut decodes = DecoderSession::new(&decoder).unwrap();
    let mut plain = PlainTract::optimised(&folder);
    let mut state = predictor.predictor().zero_state();
    let mut latent = vec![0.0; predictor.predictor().latent_count()];
    let mut offsets_m = vec![0.0; 3 * decoder.vertex_count()];
    let ticks = features(kind, body_folder);
    let mut rng = Pcg64Mcg::seed_from_u64(19);
    let mut body = vec![0.0; conditions];
    let (mut worst, mut worst_m, mut largest_m) = (0.0_f32, 0.0_f32, 0.0_f32);
    for tick in 0..TICKS {
        if tick % TICKS_PER_BODY == 0 {
            body.fill_with(|| rng.random_range(-1.5..1.5));
        }
        let mut numbers = ticks[rng.random_range(0..ticks.len())].clone();
        let scale = rng.random_range(0.5..1.2);
        numbers[..motion].iter_mut().for_each(|n| *n *= scale);
        numbers[motion..].copy_from_slice(&body);
        predictor.step(&numbers, &mut state, &mut latent).unwrap();
        let expected = plain.tick(&numbers);
        let size = expected.iter().fold(0.0_f32, |size, x| size.max(x.abs()));
        let differs = |a: &[f32], b: &[f32]| {
            let pairs = a.iter().zip(b);
            pairs.fold(0.0_f32, |most, (a, b)| most.max((a - b).abs()))
        };
        worst = worst.max(differs(&latent, &expected) / size.max(f32::MIN_POSITIVE));
        if tick % decoded == 0 {
            decodes.decode(&latent, &mut offsets_m).unwrap();
            let expected_m = plain.decode(&expected);
            worst_m = worst_m.max(differs(&offsets_m, &expected_m));
            largest_m = expected_m
                .iter()
                .fold(largest_m, |most, x| most.max(x.abs()));
        }
    }
    println!(
        "{}: latents {worst:.1e} of the largest, offsets {worst_m:.1e} m of {largest_m:.3} m",
        folder.strip_prefix(models()).unwrap().display(),
    );
    assert!(largest_m > 1e-3, "nothing moved");
    assert!(worst <= LATENT_TOLERANCE, "{worst}");
    assert!(worst_m <= TOLERANCE_M, "{worst_m} m");
}

/// A test a bundle, so that they run beside each other. Convolutions take long: they are decoded
/// seldom, and are tract's own on both sides.
macro_rules! bundles {
    ($($name:ident: $folder:literal, $decoded:literal;)*) => {
        $(
            #[test]
            fn $name() {
                the_same_as_tract($folder, $decoded);
            }
        )*

        #[test]
        fn every_bundle_is_among_them() {
            let mut expected = Vec::new();
            for body in ["female", "male"] {
                expected.push(body.to_owned());
                for entry in std::fs::read_dir(models().join(body).join("methods")).unwrap() {
                    let name = entry.unwrap().file_name();
                    expected.push(format!("{body}/methods/{}", name.to_str().unwrap()));
                }
            }
            expected.sort();
            let mut folders = vec![$($folder),*];
            folders.sort_unstable();
            assert_eq!(folders, expected);
        }
    };
}

bundles! {
    female: "female", 1;
    female_casas_otaduy: "female/methods/casas-otaduy", 10;
    female_casas_otaduy_unweighted: "female/methods/casas-otaduy-unweighted", 10;
    female_dmpl: "female/methods/dmpl", 10;
    female_dsnet: "female/methods/dsnet", 500;
    female_dsnet_rbf: "female/methods/dsnet-rbf", 500;
    female_spring_bones: "female/methods/spring-bones", 10;
    male: "male", 1;
    male_casas_otaduy: "male/methods/casas-otaduy", 10;
    male_casas_otaduy_unweighted: "male/methods/casas-otaduy-unweighted", 10;
    male_dmpl: "male/methods/dmpl", 10;
    male_dsnet: "male/methods/dsnet", 500;
    male_dsnet_rbf: "male/methods/dsnet-rbf", 500;
    male_spring_bones: "male/methods/spring-bones", 10;
}
