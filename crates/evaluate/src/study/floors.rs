//! What a decoder can give at best, beside principal components of the whole body in as many bytes.

use dynaskin_body::BodyModel;

use super::Contestant;
use super::groups::Groups;
use super::reconstruction::{Reach, Span};
use dynaskin_train::{
    Basis, DataSet, Draw, Mirror, Set, Tissue, TrainError, offsets_of, sample_offsets,
};

/// Every so many frames of a clip are looked at: neighbours are nearly alike.
pub const FLOOR_STRIDE: usize = 5;
/// Frames that the principal components are fitted to, and their mirror images.
const SAMPLE_FRAMES: usize = 4000;
/// Bytes of a number in half precision, as decoders are stored.
const NUMBER_BYTES: usize = 2;

/// How many times the decoder's bytes principal components are given.
const MULTIPLES: [usize; 3] = [1, 2, 4];

/// A test set that was looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FloorSet {
    /// The set.
    pub set: Set,
    /// Frames that were looked at.
    pub frames: usize,
    /// Mean length of the simulated offsets of the soft vertices, in millimetres.
    pub static_mm: f64,
}

/// A decoder, or so many principal components.
#[derive(Clone, Debug, PartialEq)]
pub struct Floor {
    /// Numbers that a frame is made from.
    pub latents: usize,
    /// Bytes of the graph, or of the components' matrix in half precision.
    pub bytes: usize,
    /// Mean error over the soft vertices with the best latents, in millimetres, one a set.
    pub errors_mm: Vec<f64>,
}

/// A linear decoder beside principal components.
#[derive(Clone, Debug, PartialEq)]
pub struct Floors {
    /// The test sets that have clips of the usual tissue.
    pub sets: Vec<FloorSet>,
    /// The decoder.
    pub decoder: Floor,
    /// Principal components in as many bytes, rounded up, then in twice and four times as many; no
    /// more of them than there are frames to fit them to.
    pub components: Vec<Floor>,
}

/// Compares the decoder of `contestant`, whose graph is `decoder_onnx`, with principal components of
/// the training clips that the method may learn from, mirror images included; none where the decoder
/// is not linear. `progress` is told the clips read and in all.
///
/// # Errors
/// [`TrainError::Config`] without training clips; [`TrainError::Runtime`], and what reading a clip
/// can give.
pub fn floors(
    contestant: &mut Contestant,
    decoder_onnx: &[u8],
    data_set: &DataSet,
    model: &BodyModel,
    mut progress: impl FnMut(usize, usize),
) -> Result<Option<Floors>, TrainError> {
    let Some(player) = &mut contestant.player else {
        return Ok(None);
    };
    if player.linear_decoder()?.is_none() {
        return Ok(None);
    }
    let mut reach = Reach::load(decoder_onnx)?;
    let tissue = Tissue::known_to(player.feature_kind());
    let test = |set| data_set.of_set(set, Tissue::Usual);
    let learned_from = data_set.of_set(Set::Training, tissue).count();
    let all = learned_from
        + Set::TEST
            .into_iter()
            .map(|set| test(set).count())
            .sum::<usize>();

    let coordinates = 3 * data_set.vertices.len();
    let component_bytes = NUMBER_BYTES * coordinates;
    let draw = Draw {
        tissue,
        frames: SAMPLE_FRAMES,
        seed: 1,
    };
    // Bodies that are not symmetric have no mirror images.
    let mirror = Mirror::of_body(model, &data_set.vertices).ok();
    let sample = sample_offsets(data_set, draw, mirror.as_ref(), |done| progress(done, all))?;
    let most = sample.nrows().min(coordinates);
    let mut sizes = MULTIPLES.map(|multiple| {
        let components = (multiple * decoder_onnx.len()).div_ceil(component_bytes);
        components.min(most)
    });
    sizes.sort_unstable();
    let basis = Basis::fit(&sample, sizes[MULTIPLES.len() - 1], draw.seed)?;
    drop(sample);

    let mut found = vec![(
        Floor {
            latents: reach.latent_count(),
            bytes: decoder_onnx.len(),
            errors_mm: Vec::new(),
        },
        reach.span()?,
    )];
    for (index, components) in sizes.into_iter().enumerate() {
        if index == 0 || sizes[index - 1] < components {
            let floor = Floor {
                latents: components,
                bytes: component_bytes * components,
                errors_mm: Vec::new(),
            };
            let rows = basis.truncated(components).rows();
            found.push((floor, Span::of(&rows, coordinates)));
        }
    }
    let groups = Groups::new(model, &data_set.vertices);
    let (mut sets, mut done) = (Vec::new(), learned_from);
    for set in Set::TEST {
        let (mut static_mm, mut frames) = (0.0, 0);
        let mut sums_mm = vec![0.0; found.len()];
        for entry in test(set) {
            let truth_m = strided(&offsets_of(&data_set.read(entry)?), coordinates);
            let sum_mm = |field_m: &[f32]| -> f64 {
                let pairs = truth_m.chunks_exact(coordinates);
                let pairs = pairs.zip(field_m.chunks_exact(coordinates));
                pairs
                    .map(|(a, b)| f64::from(groups.errors_mm(a, b)[1]))
                    .sum()
            };
            static_mm += sum_mm(&vec![0.0; truth_m.len()]);
            for (sum, (_, span)) in sums_mm.iter_mut().zip(&found) {
                *sum += sum_mm(&span.nearest(&truth_m));
            }
            frames += truth_m.len() / coordinates;
            done += 1;
            progress(done, all);
        }
        if frames > 0 {
            let static_mm = static_mm / frames as f64;
            sets.push(FloorSet {
                set,
                frames,
                static_mm,
            });
            for (sum, (floor, _)) in sums_mm.iter().zip(&mut found) {
                floor.errors_mm.push(sum / frames as f64);
            }
        }
    }
    let mut floors = found.into_iter().map(|(floor, _)| floor);
    Ok(floors.next().map(|decoder| Floors {
        sets,
        decoder,
        components: floors.collect(),
    }))
}

/// Every [`FLOOR_STRIDE`]th frame.
fn strided(offsets_m: &[f32], coordinates: usize) -> Vec<f32> {
    let frames = offsets_m.chunks_exact(coordinates);
    frames.step_by(FLOOR_STRIDE).flatten().copied().collect()
}
