//! Lowered files: the same numbers as ONNX files, and none that breaks anything.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used, clippy::print_stdout)] // The numbers are for people to read.

#[path = "support/mod.rs"]
mod support;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use dynaskin_body::BodyModel;
use dynaskin_motion::{Procedural, ProceduralKind};
use dynaskin_runtime::features::{Materials, clip_features};
use dynaskin_runtime::{
    Avatar, Bundle, BundleFile, Decoder, DecoderSession, LoweredFiles, LoweredNetworks, Model,
    Network, Predictor, PredictorSession, RuntimeError, lower,
};
use proptest::prelude::*;
use sha2::{Digest as _, Sha256};

/// Largest difference of an offset from tract's, in metres.
const TOLERANCE_M: f32 = 1e-6;

const HASH: usize = 32;

fn models() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models")
}

/// A bundle of `models/` and its files by name.
fn shipped(folder: &str) -> (Bundle, impl Fn(&str) -> Vec<u8>) {
    let folder = models().join(folder);
    let read = move |file: &str| std::fs::read(folder.join(file)).unwrap();
    (Bundle::from_json(&read("bundle.json")).unwrap(), read)
}

/// What `dynaskin slim` writes into bundle.json.
fn named(bundle: &Bundle, lowered: &LoweredNetworks) -> Bundle {
    let files = LoweredFiles {
        predictor: BundleFile::of("predictor.lowered", &lowered.predictor),
        decoder: BundleFile::of("decoder.lowered", &lowered.decoder),
    };
    Bundle {
        lowered: Some(files),
        ..bundle.clone()
    }
}

/// The made-up bundle and its networks, lowered.
fn made_up() -> (Bundle, LoweredNetworks) {
    let (predictor, decoder) = (
        support::predictor_of(support::SMALL),
        support::decoder_of(support::SMALL),
    );
    let bundle = support::bundle(&predictor, &decoder);
    let lowered = lower(&bundle, &predictor, &decoder).unwrap();
    (bundle, lowered)
}

#[test]
fn shipped_networks_give_what_tract_gives() {
    for name in ["female", "male"] {
        let (bundle, read) = shipped(name);
        let (predictor, decoder) = (read("predictor.onnx"), read("decoder.onnx"));
        let lowered = lower(&bundle, &predictor, &decoder).unwrap();
        let body = BodyModel::from_glb(&read("body.glb")).unwrap();
        let joints_m = body.shaped(&[0.0; 10]).joints_m;
        let clip = Procedural::new(ProceduralKind::Hop)
            .clip(&joints_m)
            .unwrap();
        let kind = bundle.feature_kind;
        let numbers = clip_features(
            kind,
            &clip.frames,
            clip.rate_hz,
            &joints_m,
            &[0.0; 10],
            &Materials::default(),
        );
        let numbers = numbers.unwrap();
        let ticks = numbers.chunks(kind.count()).map(<[f32]>::to_vec);
        let comparison = lowered.compare(&predictor, &decoder, ticks).unwrap();
        println!("{name}: {comparison:?}");
        assert!(comparison.ticks > 100 && comparison.largest_offset_m > 1e-3);
        assert!(
            comparison.largest_difference_m <= TOLERANCE_M,
            "{comparison:?}"
        );
    }
}

#[test]
fn the_lowered_files_in_models_are_those_of_their_networks() {
    for name in ["female", "male"] {
        let (bundle, read) = shipped(name);
        let lowered = lower(&bundle, &read("predictor.onnx"), &read("decoder.onnx")).unwrap();
        let files = bundle.lowered.as_ref();
        let files = files.expect("`dynaskin slim` has written the lowered files");
        let expected = named(&bundle, &lowered).lowered.unwrap();
        assert_eq!(files, &expected, "run `dynaskin slim models/{name}` again");
        assert_eq!(read(&files.predictor.file), lowered.predictor);
        assert_eq!(read(&files.decoder.file), lowered.decoder);
    }
}

#[test]
fn an_avatar_moves_by_the_same_bits_and_takes_over_saved_states() {
    let (bundle, lowered) = made_up();
    let (predictor, decoder) = (
        support::predictor_of(support::SMALL),
        support::decoder_of(support::SMALL),
    );
    let body = Arc::new(support::body_of(support::SMALL));
    let onnx = Model::from_parts(bundle.clone(), Arc::clone(&body), &predictor, &decoder).unwrap();
    let bundle = named(&bundle, &lowered);
    let slim = Model::from_parts(bundle, body, &lowered.predictor, &lowered.decoder).unwrap();
    let mut onnx = Avatar::new(Arc::new(onnx), &[0.0; 10]).unwrap();
    let mut slim = Avatar::new(Arc::new(slim), &[0.0; 10]).unwrap();
    let mut moved = false;
    for tick in 0..120 {
        let pose = support::pose_at(f64::from(tick) / 60.0);
        onnx.step(&pose, 1.0 / 60.0).unwrap();
        slim.step(&pose, 1.0 / 60.0).unwrap();
        assert_eq!(onnx.offsets_rest_m(), slim.offsets_rest_m());
        moved |= onnx
            .offsets_rest_m()
            .iter()
            .any(|offset| offset.length() > 1e-4);
        if tick == 60 {
            slim.restore(&onnx.save()).unwrap();
        }
    }
    assert!(moved);
}

#[test]
fn graphs_that_only_tract_runs_are_refused_with_their_node() {
    let (bundle, read) = shipped("female/methods/dsnet");
    let refused = lower(&bundle, &read("predictor.onnx"), &read("decoder.onnx")).unwrap_err();
    let RuntimeError::CannotLower {
        network,
        node,
        operator,
    } = &refused
    else {
        panic!("{refused}");
    };
    assert_eq!(*network, Network::Decoder);
    assert!(!node.is_empty() && !operator.is_empty(), "{refused}");
}

#[test]
fn files_that_do_not_belong_together_are_refused() {
    let (bundle, lowered) = made_up();
    let body = || Arc::new(support::body_of(support::SMALL));
    let whole = named(&bundle, &lowered);
    let load = |bundle: Bundle, predictor: &[u8], decoder: &[u8]| {
        Model::from_parts(bundle, body(), predictor, decoder).unwrap_err()
    };
    let unnamed = load(bundle, &lowered.predictor, &lowered.decoder);
    assert!(matches!(unnamed, RuntimeError::NoLowered), "{unnamed}");
    let exchanged = load(whole.clone(), &lowered.decoder, &lowered.predictor);
    assert!(
        matches!(exchanged, RuntimeError::HashMismatch { .. }),
        "{exchanged}"
    );
    let mut other = whole;
    other.predictor.sha256 = "0".repeat(64);
    let stale = load(other, &lowered.predictor, &lowered.decoder);
    assert!(
        stale.to_string().contains("another `predictor.onnx`"),
        "{stale}"
    );
    let wrong = Predictor::load(&lowered.decoder).unwrap_err();
    assert!(wrong.to_string().contains("other network"), "{wrong}");
}

/// `bytes` with a checksum that fits.
fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let length = bytes.len() - HASH;
    let checksum = Sha256::digest(&bytes[..length]);
    bytes[length..].copy_from_slice(&checksum);
    bytes
}

#[test]
fn changed_and_cut_files_are_refused() {
    let (_, LoweredNetworks { predictor, .. }) = made_up();
    for length in (16..predictor.len()).step_by(97) {
        let refused = Predictor::load(&predictor[..length]).unwrap_err();
        assert!(
            matches!(refused, RuntimeError::NotLowered { .. }),
            "{refused}"
        );
    }
    for place in (16..predictor.len()).step_by(101) {
        let mut changed = predictor.clone();
        changed[place] ^= 4;
        let refused = Predictor::load(&changed).unwrap_err();
        assert!(
            matches!(refused, RuntimeError::NotLowered { .. }),
            "{refused}"
        );
    }
    let mut later = predictor;
    later[16] += 1;
    let refused = Predictor::load(&sealed(later)).unwrap_err();
    assert!(refused.to_string().contains("version is 2"), "{refused}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Whoever makes such a file may make its checksum fit: it is refused, or it runs.
    #[test]
    fn files_with_wrong_numbers_harm_nothing(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..4),
        is_near_start in any::<bool>(),
    ) {
        let (_, LoweredNetworks { predictor, decoder }) = made_up();
        let changed = |bytes: &[u8]| {
            let mut bytes = bytes.to_vec();
            let length = bytes.len() - HASH;
            // Steps and ports stand before the weights, which are most of a file.
            let end = if is_near_start { length.min(2_000) } else { length };
            for (place, byte) in &changes {
                bytes[52 + place.index(end - 52)] = *byte;
            }
            sealed(bytes)
        };
        if let Ok(predictor) = Predictor::load(&changed(&predictor)) {
            let mut state = predictor.zero_state();
            let features = vec![0.5; predictor.feature_count()];
            let mut latent = vec![0.0; predictor.latent_count()];
            let mut session = PredictorSession::new(Arc::new(predictor)).unwrap();
            for _ in 0..3 {
                let _ = session.step(&features, &mut state, &mut latent);
            }
        }
        if let Ok(decoder) = Decoder::load(&changed(&decoder)) {
            let latent = vec![0.5; decoder.latent_count()];
            let mut offsets_m = vec![0.0; 3 * decoder.vertex_count()];
            let _ = DecoderSession::new(&decoder).unwrap().decode(&latent, &mut offsets_m);
        }
    }
}
