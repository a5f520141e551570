//! What must hold of a file that a reader accepts.

use std::path::Path;
use std::sync::Arc;

use dynaskin_body::{BodyModel, Pose, SHAPE_COUNT};
use dynaskin_decoding::{DecoderMatrix, Tables};
use dynaskin_fit::{MeshKind, ScanOptions, ScanUnit, Scans};
use dynaskin_hdf5::{Hdf5, Kind};
use dynaskin_motion::{GltfMotion, MotionFile, UpAxis};
use dynaskin_runtime::{
    Avatar, Bundle, BundleFile, Decoder, DecoderSession, LinearDecoder, Model, Predictor,
    PredictorSession, RuntimeError,
};
use dynaskin_sim::ClipData;

use crate::{is_in_share, stage};

/// Of so many accepted networks one is optimised and run: that takes a hundred times as long as reading.
const PLANNED: u64 = 32;

/// Names a file in messages.
const NOWHERE: &str = "fuzzed";

/// A motion file of any kind: its poses are valid and play.
pub fn motion(file: &[u8]) -> bool {
    if file.starts_with(b"glTF") {
        // What a page lists before it reads the motion.
        drop(GltfMotion::animations(file));
    }
    let Ok(motion) = MotionFile::parse(file) else {
        return false;
    };
    let joints_rest_m = stage::body().joint_template_m;
    let Ok(found) = motion.clip(&joints_rest_m) else {
        return false;
    };
    let clip = found.clip;
    assert!(!clip.frames.is_empty(), "an accepted motion has frames");
    assert!(
        clip.rate_hz.is_finite() && clip.rate_hz > 0.0,
        "{}",
        clip.rate_hz
    );
    for (frame, pose) in clip.frames.iter().enumerate() {
        assert!(pose.is_valid(), "frame {frame} of an accepted motion");
    }
    stage::play(|tick| clip.pose_at(tick as f64 * stage::TICK_SECONDS));
    true
}

/// A SMPL-family body: finite at every shape, and it can be posed.
pub fn npz_body(file: &[u8]) -> bool {
    match BodyModel::from_smpl_npz(file) {
        Ok(body) => {
            try_body(body);
            true
        }
        Err(_) => false,
    }
}

/// A body of ours: as [`npz_body`], and it is written as it was read.
pub fn glb_body(file: &[u8]) -> bool {
    let Ok(body) = BodyModel::from_glb(file) else {
        return false;
    };
    if is_in_share(file, 8)
        && let Ok(written) = body.to_glb()
    {
        let again = BodyModel::from_glb(&written).expect("a body that was written is read");
        assert_eq!(again.vertex_count(), body.vertex_count());
    }
    try_body(body);
    true
}

fn try_body(body: BodyModel) {
    for beta in [0.0, 5.0, -5.0] {
        let shaped = body.shaped(&[beta; SHAPE_COUNT]);
        let places = shaped.positions_m.iter().chain(&shaped.joints_m);
        assert!(
            places.into_iter().all(|p| p.is_finite()),
            "finite at β = {beta}"
        );
        assert!(
            shaped.thickness_m.iter().all(|t| t.is_finite()),
            "finite at β = {beta}"
        );
    }
    let mut corrected = body.template_m.clone();
    body.add_pose_correctives(&stage::pose_at(5), &mut corrected);
    assert!(
        corrected.iter().all(|p| p.is_finite()),
        "finite pose correctives"
    );
    let model = Arc::new(Model::body_only(Arc::new(body)));
    for beta in [0.0, 5.0] {
        let avatar = Avatar::new(Arc::clone(&model), &[beta; SHAPE_COUNT]);
        let mut avatar = avatar.expect("an accepted body makes an avatar");
        for tick in 0..stage::TICKS / 2 {
            let stepped = avatar.step(&stage::pose_at(tick), stage::TICK_SECONDS);
            stepped.expect("it can be posed");
        }
        stage::assert_finite(&mut avatar);
    }
}

/// A bundle: it is written as it was read, and a share makes models with the made-up networks.
pub fn bundle(file: &[u8]) -> bool {
    let Ok(mut bundle) = Bundle::from_json(file) else {
        return false;
    };
    for named in [&bundle.body, &bundle.predictor, &bundle.decoder] {
        assert!(
            Path::new(&named.file).file_name() == Some(named.file.as_ref()),
            "`{}` names a file beside the bundle",
            named.file
        );
    }
    let json = bundle.to_json().expect("an accepted bundle can be written");
    let mut again = Bundle::from_json(json.as_bytes()).expect("what was written is read");
    // What people wrote into these may come back with another last digit: serde_json reads that fast.
    again.training.clone_from(&bundle.training);
    again.measured.clone_from(&bundle.measured);
    assert_eq!(again, bundle);
    if is_in_share(file, PLANNED) {
        let (predictor, decoder) = stage::networks();
        bundle.predictor = BundleFile::of("predictor.onnx", predictor);
        bundle.decoder = BundleFile::of("decoder.onnx", decoder);
        let body = Arc::clone(stage::body());
        if let Ok(model) = Model::from_parts(bundle, body, predictor, decoder) {
            try_model(Arc::new(model));
        }
    }
    true
}

fn try_model(model: Arc<Model>) {
    let avatar = Avatar::new(model, &[0.0; SHAPE_COUNT]);
    let mut avatar = avatar.expect("the made-up networks run");
    for tick in 0..stage::TICKS {
        let stepped = avatar.step(&stage::pose_at(tick), stage::TICK_SECONDS);
        stepped.expect("they go on running");
    }
    stage::assert_finite(&mut avatar);
}

/// Whether a network's file is lowered: then it is run as it is, and no time goes into optimising.
pub fn is_lowered(file: &[u8]) -> bool {
    file.starts_with(b"dynaskin-lowered")
}

/// A predictor: of ONNX files a share is optimised and ticks, of lowered ones all; it gives finite numbers or says that it does not.
pub fn predictor(file: &[u8]) -> bool {
    if !is_lowered(file) {
        if dynaskin_onnx::read(file, 1).is_err() {
            return false;
        }
        if !is_in_share(file, PLANNED) {
            return true;
        }
    }
    let Ok(predictor) = Predictor::load(file) else {
        return false;
    };
    let predictor = Arc::new(predictor);
    let mut session = match PredictorSession::new(Arc::clone(&predictor)) {
        Ok(session) => session,
        Err(error) => panic!("a loaded predictor has sessions: {error}"),
    };
    let mut state = predictor.zero_state();
    let mut latent = vec![0.0; predictor.latent_count()];
    let mut features = vec![0.0; predictor.feature_count()];
    for tick in 0..stage::TICKS {
        for (idx, feature) in features.iter_mut().enumerate() {
            *feature = ((tick * 31 + idx * 7) as f32 * 0.37).sin() * 20.0;
        }
        match session.step(&features, &mut state, &mut latent) {
            Ok(()) => assert!(latent.iter().all(|x| x.is_finite()), "a finite latent"),
            Err(error) => return assert_honest(&error),
        }
    }
    true
}

/// A decoder: as [`predictor`]. Where it is a matrix, a graphics card is given whole tables of finite numbers, which
/// make the same offsets.
pub fn decoder(file: &[u8]) -> bool {
    if !is_lowered(file) {
        if dynaskin_onnx::read(file, 1).is_err() {
            return false;
        }
        if !is_in_share(file, PLANNED) {
            return true;
        }
    }
    let Ok(decoder) = Decoder::load(file) else {
        return false;
    };
    let mut session = match DecoderSession::new(&decoder) {
        Ok(session) => session,
        Err(error) => panic!("a loaded decoder has sessions: {error}"),
    };
    let mut offsets_m = vec![0.0; 3 * decoder.vertex_count()];
    for size in [0.0, 0.5, -3.0, 1e4] {
        let latent = vec![size; decoder.latent_count()];
        match session.decode(&latent, &mut offsets_m) {
            Ok(()) => assert!(offsets_m.iter().all(|x| x.is_finite()), "finite offsets"),
            Err(error) => return assert_honest(&error),
        }
    }
    if let Some(linear) = decoder.linear() {
        assert_tables(linear, decoder.vertex_count());
    }
    true
}

fn assert_tables(linear: &LinearDecoder, vertex_count: usize) {
    let vertices: Vec<u32> = (0..vertex_count as u32).collect();
    let tables = Tables::new(&DecoderMatrix {
        vertex_count,
        faces: &[],
        soft_vertices: &vertices,
        starts: linear.starts(),
        latents: linear.latents(),
        weights_m: linear.weights().as_flattened(),
        latent_count: linear.latent_count(),
    });
    let tables = tables.expect("a recognised matrix has tables");
    for (lists, range) in tables.vertices.iter().zip(linear.starts().windows(2)) {
        assert_eq!(lists[..2], *range, "each vertex has its own weights");
    }
    let weights = linear.weights().iter().zip(linear.latents());
    for (texel, ([x, y, z], &latent)) in tables.weights.iter().zip(weights) {
        assert_eq!(*texel, [*x, *y, *z, latent as f32]);
    }
}

/// A network that loads may put out infinite numbers for some inputs; nothing else may go wrong.
fn assert_honest(error: &RuntimeError) -> bool {
    assert!(matches!(error, RuntimeError::NonFinite { .. }), "{error}");
    true
}

/// A saved state: an avatar goes on from it.
pub fn state(file: &[u8]) -> bool {
    stage::try_state(file, is_in_share(file, 8))
}

/// A clip of the data set: valid poses that play, and finite offsets of ascending vertices.
pub fn clip(file: &[u8]) -> bool {
    let Ok(clip) = ClipData::from_bytes(Path::new(NOWHERE), file) else {
        return false;
    };
    assert!(clip.poses.iter().all(Pose::is_valid), "valid poses");
    assert!(
        clip.offsets_rest_m.iter().all(|x| x.is_finite()),
        "finite offsets"
    );
    assert!(
        clip.vertices.is_sorted_by(|a, b| a < b),
        "ascending vertices"
    );
    let numbers = clip.frame_count() * clip.vertices.len() * 3;
    assert_eq!(clip.offsets_rest_m.len(), numbers, "offsets of every frame");
    true
}

/// A mesh: as many finite positions as the body has.
pub fn mesh(kind: MeshKind, file: &[u8]) -> bool {
    let (path, body) = (Path::new(NOWHERE), stage::body());
    let Ok(positions) = kind.positions(path, file, body) else {
        return false;
    };
    let options = ScanOptions {
        unit: Some(ScanUnit::Metre),
        up: Some(UpAxis::Y),
        rate_hz: 60.0,
        key: String::new(),
        sequence: None,
    };
    let Ok(scans) = Scans::new(path, body, positions, &options) else {
        return false;
    };
    assert_eq!(scans.frame_count(), 1);
    let positions = scans
        .frames_m(0..1)
        .expect("an accepted frame is read again");
    assert!(positions.iter().all(|p| p.is_finite()), "finite positions");
    true
}

/// Most elements along an axis that are read of an accepted array: what it says it has may be much.
const MOST_READ: usize = 64;

/// Arrays: each is as long as it says.
pub fn hdf5(file: &[u8]) -> bool {
    let Ok(opened) = Hdf5::from_bytes(Path::new(NOWHERE), file.to_vec()) else {
        return false;
    };
    let Ok(listed) = opened.list() else {
        return false;
    };
    let mut is_whole = true;
    for one in &listed {
        let Ok(array) = opened.array(&one.name) else {
            is_whole = false;
            continue;
        };
        let lengths = array.shape().iter().map(|&length| length.min(MOST_READ));
        let piece: Vec<_> = lengths.map(|length| 0..length).collect();
        // Many axes make many numbers.
        let count = piece.iter().try_fold(1_usize, |product, range| {
            Some(product * range.len()).filter(|&count| count <= 1 << 20)
        });
        let Some(count) = count else {
            continue;
        };
        let read = match array.kind() {
            Kind::Single | Kind::Double => array.floats(&piece).map(|numbers| numbers.len()),
            Kind::Integer => array.integers(&piece).map(|numbers| numbers.len()),
            _ => continue,
        };
        match read {
            Ok(read) => assert_eq!(read, count, "numbers of `{}`", one.name),
            Err(_) => is_whole = false,
        }
    }
    is_whole
}
