//! From clips to what the networks learn from: a basis of the offsets, features and latents.

use dynaskin_body::{BodyModel, SHAPE_COUNT};
use dynaskin_runtime::features::FeatureKind;

use super::blocks::{BlockBasis, partition};
use super::build::Build;
use super::config::TrainConfig;
use super::lanes::Sequence;
use super::locality::Locality;
use super::spin::{SPIN_COUNT, Spin};
use super::trainer::{BlockSize, PredictorData};
use crate::TrainError;
use crate::data::{DataSet, Tissue, features_of, motion_of, offsets_of};
use crate::mirror::Mirror;
use crate::normaliser::Normaliser;
use crate::sample::{Draw, mirrored_latents, sample_offsets};
use crate::split::Set;

/// What dynaskin's networks take as input.
pub const KIND: FeatureKind = FeatureKind::InertialMaterials;

/// Turns the runtime's features into what the predictor hears.
#[derive(Clone, Debug)]
pub struct Hearing {
    /// Scaling of the motion features.
    pub normaliser: Normaliser,
    /// Products of angular velocities.
    pub spin: Spin,
    /// What is told about the body.
    pub build: Build,
}

impl Hearing {
    /// How many numbers are about the motion.
    pub const MOTION_COUNT: usize = KIND.motion_count() + SPIN_COUNT;

    /// Motion of each frame, `[frame][number]` flat: the scaled features, then the products.
    pub fn motion(&self, features: &[f32]) -> Vec<f32> {
        let (normalised, _) = self.normaliser.apply(features);
        let frames = features.chunks_exact(KIND.count());
        let motion = frames.zip(normalised.chunks_exact(KIND.motion_count()));
        motion
            .flat_map(|(raw, scaled)| [scaled, &self.spin.of(raw)].concat())
            .collect()
    }
}

/// Everything that training and export need.
#[derive(Debug)]
pub struct Prepared {
    /// Subspace of the offsets.
    pub basis: BlockBasis,
    /// What the predictor hears of the features.
    pub hearing: Hearing,
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
    let basis = BlockBasis::fit(&sample, blocks, config.components, config.seed)?;
    drop(sample);

    let build = Build::of_body(model, data_set.compliance.as_ref());
    let locality = if config.local {
        Locality::of_body(model, &data_set.vertices, &basis, &build)
    } else {
        Locality::everywhere(Hearing::MOTION_COUNT, build.count(), basis.components())
    };
    let induced = mirror
        .as_ref()
        .map(|mirror| basis.induced(|from, to| mirror.apply(from, to)));
    let mut raw = Vec::new();
    let mut done = training;
    for set in [Set::Training, Set::Validation] {
        for entry in data_set.of_set(set, tissue) {
            let clip = data_set.read(entry)?;
            let latents = basis.project(&offsets_of(&clip));
            let motion = motion_of(&clip);
            if let (Some(induced), Set::Training) = (&induced, set) {
                raw.push(RawSequence {
                    features: features_of(KIND, model, &motion.mirrored(), &clip)?,
                    latents: mirrored_latents(induced, basis.components(), &latents),
                    set,
                });
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
        (build, config.shape_loudness),
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
    (mut build, shape_loudness): (Build, f32),
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
    build.fit(bodies.iter().map(Vec::as_slice), shape_loudness);
    let training = raw.iter().filter(|r| r.set == Set::Training);
    let spin = Spin::fit(training.flat_map(|r| r.features.chunks_exact(KIND.count())));
    let hearing = Hearing {
        normaliser,
        spin,
        build,
    };
    let mut data = PredictorData {
        training: Vec::new(),
        validation: Vec::new(),
        deviation_m: basis.deviation_m.clone(),
        blocks: basis.blocks.iter().map(BlockSize::of).collect(),
        locality,
        motion: Hearing::MOTION_COUNT,
        conditions: hearing.build.count(),
    };
    for sequence in raw {
        let body = first_frame(&sequence);
        let motion = hearing.motion(&sequence.features);
        let mut latents = sequence.latents;
        for frame in latents.chunks_exact_mut(basis.components()) {
            for (latent, deviation) in frame.iter_mut().zip(&basis.deviation_m) {
                *latent /= deviation.max(f32::MIN_POSITIVE);
            }
        }
        let to = if sequence.set == Set::Training {
            &mut data.training
        } else {
            &mut data.validation
        };
        to.push(Sequence {
            frames: sequence.features.len() / KIND.count(),
            condition: hearing.build.of(&body),
            motion,
            latents,
        });
    }
    Prepared {
        basis,
        hearing,
        data,
    }
}
