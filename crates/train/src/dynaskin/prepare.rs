//! From clips to what the networks learn from: a basis of the offsets, features and latents.

use dynaskin_body::{BodyModel, SHAPE_COUNT};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;

use super::blocks::{BlockBasis, partition};
use super::build::Build;
use super::config::TrainConfig;
use super::inputs::{KIND, PredictorInputs};
use super::lanes::Sequence;
use super::locality::{Locality, LocalityMirror};
use super::spin::Spin;
use super::symmetry::SignedPermutation;
use super::trainer::{BlockSize, PredictorData};
use crate::TrainError;
use crate::data::{DataSet, Tissue, features_of, motion_of, offsets_of};
use crate::mirror::Mirror;
use crate::normaliser::Normaliser;
use crate::sample::{Draw, sample_offsets};
use crate::sources::given;
use crate::split::Set;

/// Tells the draw of sources from others of the same seed.
const SOURCES: u64 = 0x50_75_72_63_65;

/// Everything that training and export need.
#[derive(Debug)]
pub struct Prepared {
    /// Subspace of the offsets.
    pub basis: BlockBasis,
    /// The predictor's inputs.
    pub inputs: PredictorInputs,
    /// Sequences.
    pub data: PredictorData,
}

/// Fits the basis and turns the training and validation clips into sequences. `progress` is told
/// the number of clips read so far and in all.
///
/// # Errors
/// [`TrainError::EmptySplit`], [`TrainError::Config`] and whatever reading a clip can give.
pub fn prepare(
    data_set: &DataSet,
    model: &BodyModel,
    config: &TrainConfig,
    mut progress: impl FnMut(usize, usize),
) -> Result<Prepared, TrainError> {
    let tissue = Tissue::known_to(KIND);
    for set in [Set::Training, Set::Validation] {
        if data_set.of_set(set, tissue).next().is_none() {
            return Err(TrainError::EmptySplit {
                set: set.name(),
                clips: data_set.clips.len(),
            });
        }
    }
    let mirror = if config.mirror {
        Some(Mirror::of_body(model, &data_set.vertices)?)
    } else {
        None
    };
    let training = data_set.of_set(Set::Training, tissue).count();
    let validation = data_set.of_set(Set::Validation, tissue).count();
    let all = 2 * training + validation;
    let draw = Draw {
        tissue,
        frames: config.pca_frames,
        seed: config.seed,
    };
    let sample = sample_offsets(data_set, draw, mirror.as_ref(), |done| progress(done, all))?;
    let blocks = partition(model, &data_set.vertices, mirror.as_ref());
    let basis = BlockBasis::fit(
        &sample,
        blocks,
        config.components,
        config.seed,
        mirror.as_ref(),
    )?;
    drop(sample);

    let build = Build::of_body(model, data_set.compliance.as_ref());
    let locality = if config.local {
        Locality::of_body(model, &data_set.vertices, &basis, &build)
    } else {
        Locality::everywhere(
            PredictorInputs::MOTION_COUNT,
            build.count(),
            basis.components(),
        )
    };
    let locality = match &mirror {
        Some(mirror) => {
            let (blocks, latents) = basis.mirrored(mirror);
            // One block for the whole body is its own mirror image.
            let blocks = if config.local { blocks } else { vec![0] };
            locality.tied(LocalityMirror {
                blocks,
                motion: SignedPermutation::of_motion(),
                latents,
            })
        }
        None => locality,
    };
    let mut raw = Vec::new();
    let mut sources = Pcg64Mcg::seed_from_u64(config.seed ^ SOURCES);
    let mut done = training;
    for set in [Set::Training, Set::Validation] {
        for entry in data_set.of_set(set, tissue) {
            let clip = data_set.read(entry)?;
            let latents = basis.project(&offsets_of(&clip));
            let motion = motion_of(&clip);
            if set == Set::Training && sources.random::<f64>() < config.source_share {
                let seed = sources.random();
                if let Some(given) = given(&motion, seed) {
                    raw.push(RawSequence {
                        features: features_of(KIND, model, &given.motion, &clip)?,
                        latents: given.labels(&latents, basis.components()),
                        set,
                    });
                }
            }
            raw.push(RawSequence {
                features: features_of(KIND, model, &motion, &clip)?,
                latents,
                set,
            });
            done += 1;
            progress(done, all);
        }
    }
    Ok(normalised(
        raw,
        basis,
        model,
        (build, config.shape_scale),
        locality,
    ))
}

/// A clip before scaling.
struct RawSequence {
    features: Vec<f32>,
    latents: Vec<f32>,
    set: Set,
}

fn normalised(
    raw: Vec<RawSequence>,
    basis: BlockBasis,
    model: &BodyModel,
    (mut build, shape_scale): (Build, f32),
    locality: Locality,
) -> Prepared {
    let training = raw.iter().filter(|r| r.set == Set::Training);
    let normaliser = Normaliser::fit(
        KIND,
        &model.shaped(&[0.0; SHAPE_COUNT]),
        training.map(|r| r.features.as_slice()),
    );
    let first_frame = |sequence: &RawSequence| {
        let body = KIND.motion_count()..KIND.count();
        sequence.features[body].to_vec()
    };
    let training = raw.iter().filter(|r| r.set == Set::Training);
    let bodies: Vec<Vec<f32>> = training.map(first_frame).collect();
    build.fit(bodies.iter().map(Vec::as_slice), shape_scale);
    let training = raw.iter().filter(|r| r.set == Set::Training);
    let spin = Spin::fit(training.flat_map(|r| r.features.chunks_exact(KIND.count())));
    let mut inputs = PredictorInputs {
        normaliser,
        spin,
        build,
    };
    if locality.mirror.is_some() {
        inputs.tie();
    }
    let mut data = PredictorData {
        training: Vec::new(),
        validation: Vec::new(),
        deviation_m: basis.deviation_m.clone(),
        blocks: basis.blocks.iter().map(BlockSize::of).collect(),
        locality,
        motion: PredictorInputs::MOTION_COUNT,
        conditions: inputs.build.count(),
    };
    for sequence in raw {
        let body = first_frame(&sequence);
        let motion = inputs.motion(&sequence.features);
        let mut latents = sequence.latents;
        for frame in latents.chunks_exact_mut(basis.components()) {
            for (latent, deviation) in frame.iter_mut().zip(&basis.deviation_m) {
                *latent /= deviation;
            }
        }
        let to = if sequence.set == Set::Training {
            &mut data.training
        } else {
            &mut data.validation
        };
        to.push(Sequence {
            frames: sequence.features.len() / KIND.count(),
            condition: inputs.build.of(&body),
            motion,
            latents,
        });
    }
    Prepared {
        basis,
        inputs,
        data,
    }
}
