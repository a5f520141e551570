//! From clips to what autoencoder and regressor learn from.

use nalgebra::DMatrix;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::config::AutoencoderConfig;
use super::rigidity::Rigidity;
use super::span::Span;
use super::window::{KIND, differenced, normalise, normaliser};
use dynaskin_train::{
    Normaliser, Set, Tissue, TrainError, TrainingInput, features_of, motion_of, offsets_of,
};

/// A clip in the networks' units.
#[derive(Clone, Debug)]
pub(super) struct ClipFields {
    /// Normalised features, `[frame][feature]` flat.
    pub features: Vec<f32>,
    /// Normalised offset fields, `[frame][span]` flat.
    pub fields: Vec<f32>,
    /// Number of frames.
    pub frames: usize,
}

/// Everything that training and export need.
#[derive(Debug)]
pub(super) struct Prepared {
    /// Coordinates of offset fields.
    pub span: Span,
    /// Eq. 7, one a vertex.
    pub weights: Vec<f32>,
    /// Scaling of the differenced features.
    pub normaliser: Normaliser,
    /// Learned from.
    pub training: Vec<ClipFields>,
    /// Decide which epoch is kept.
    pub validation: Vec<ClipFields>,
}

/// Reads the clips twice: for the span and the weights, then for the fields. `progress` is told the
/// number of clips read and in all.
pub(super) fn prepare(
    input: TrainingInput<'_>,
    config: &AutoencoderConfig,
    mut progress: impl FnMut(usize, usize),
) -> Result<Prepared, TrainError> {
    let data_set = input.data_set;
    let tissue = Tissue::known_to(KIND);
    let count = |set| data_set.of_set(set, tissue).count();
    for set in [Set::Training, Set::Validation] {
        if count(set) == 0 {
            return Err(TrainError::EmptySplit {
                set: set.name(),
                clips: data_set.clips.len(),
            });
        }
    }
    let all = 2 * count(Set::Training) + count(Set::Validation);
    let mut done = 0;
    let (sample, rigidity) = survey(input, config, || {
        done += 1;
        progress(done, all);
    })?;
    let span = Span::fit(&sample, config.span, config.seed)?;
    drop(sample);

    let mut read = |set| {
        let mut clips = Vec::new();
        for entry in data_set.of_set(set, tissue) {
            let clip = data_set.read(entry)?;
            let features = features_of(KIND, input.body, &motion_of(&clip), &clip)?;
            clips.push(ClipFields {
                features: differenced(&features),
                fields: span.normalised(&offsets_of(&clip)),
                frames: clip.frame_count(),
            });
            done += 1;
            progress(done, all);
        }
        Ok::<_, TrainError>(clips)
    };
    let (mut training, mut validation) = (read(Set::Training)?, read(Set::Validation)?);
    let normaliser = normaliser(training.iter().map(|clip| clip.features.as_slice()));
    for clip in training.iter_mut().chain(&mut validation) {
        normalise(&mut clip.features, &normaliser);
    }
    Ok(Prepared {
        weights: rigidity.weights(),
        span,
        normaliser,
        training,
        validation,
    })
}

/// Random frames of the training clips, one a row, and how rigid their vertices are.
fn survey(
    input: TrainingInput<'_>,
    config: &AutoencoderConfig,
    mut progress: impl FnMut(),
) -> Result<(DMatrix<f32>, Rigidity), TrainError> {
    let data_set = input.data_set;
    let training = || data_set.of_set(Set::Training, Tissue::known_to(KIND));
    let coordinates = 3 * data_set.vertices.len();
    let frames: usize = training().map(|clip| clip.frames).sum();
    let share = config.span_frames as f64 / frames.max(1) as f64;
    let mut rng = Pcg64Mcg::seed_from_u64(config.seed);
    let mut rigidity = Rigidity::new(data_set.vertices.len());
    let mut columns = Vec::new();
    for entry in training() {
        let clip = data_set.read(entry)?;
        let offsets_m = offsets_of(&clip);
        if offsets_m.iter().any(|x| !x.is_finite()) {
            return Err(TrainError::NotFinite {
                place: entry.path.display().to_string(),
            });
        }
        rigidity.add(&offsets_m);
        for frame in offsets_m.chunks_exact(coordinates) {
            if rng.random::<f64>() < share {
                columns.extend_from_slice(frame);
            }
        }
        progress();
    }
    let rows = columns.len() / coordinates;
    let sample = DMatrix::from_vec(coordinates, rows, columns).transpose();
    Ok((sample, rigidity))
}
