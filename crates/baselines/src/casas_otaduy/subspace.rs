//! Autoencoder against principal components with as many numbers (Fig. 5).

use burn::tensor::{Device, Tensor, TensorData};

use super::autoencoder::Autoencoder;
use super::config::AutoencoderConfig;
use super::data::{ClipFields, prepare};
use super::fit_autoencoder::{encode, fit_autoencoder};
use super::span::Span;
use super::{CasasOtaduyProgress, RunFolder, autoencoder_folder};
use dynaskin_train::{Set, TrainError, TrainingInput, offsets_of};

/// How well two subspaces of the same size hold the frames of a clip.
#[derive(Clone, Debug, PartialEq)]
pub struct SubspaceErrors {
    /// Numbers that stand for a field.
    pub latents: usize,
    /// The autoencoder's mean vertex distance in millimetres, one a frame.
    pub autoencoder_mm: Vec<f64>,
    /// The same of principal components fitted to frames of the same training set.
    pub pca_mm: Vec<f64>,
}

/// Trains an autoencoder for each number of `latents` and compares it with principal components on
/// the clip called `clip`, over all vertices of the data set. The state in `folder` is that of
/// [`super::train_casas_otaduy`]: with `resume`, finished autoencoders are taken as they are.
///
/// # Errors
/// [`TrainError::Config`] where the data set has no such clip or it was learned from, and as
/// [`super::train_casas_otaduy`].
pub fn compare_subspaces(
    input: TrainingInput<'_>,
    config: &AutoencoderConfig,
    latents: &[usize],
    clip: &str,
    folder: RunFolder<'_>,
    progress: &mut dyn FnMut(CasasOtaduyProgress<'_>),
) -> Result<Vec<SubspaceErrors>, TrainError> {
    let entry = input.data_set.clips.iter().find(|entry| {
        let learned = matches!(entry.set, Set::Training | Set::Validation);
        !learned && entry.path.file_stem().is_some_and(|stem| stem == clip)
    });
    let entry = entry.ok_or_else(|| TrainError::Config {
        setting: "clip",
        got: clip.to_owned(),
        expected: "a clip of the data set that is held out".into(),
    })?;
    let offsets_m = offsets_of(&input.data_set.read(entry)?);
    let data = prepare(input, config, |done, all| {
        progress(CasasOtaduyProgress::Clips { done, all });
    })?;
    latents
        .iter()
        .map(|latents| {
            let mut config = config.clone();
            config.widths.latent = *latents;
            let (checkpoint, resume) = folder.checkpoint(&autoencoder_folder(*latents))?;
            let run = (&checkpoint, resume);
            let (model, _) = fit_autoencoder(&data, &config, input.compute, run, |record| {
                progress(CasasOtaduyProgress::Epoch {
                    network: "autoencoder",
                    epochs: config.epochs,
                    record,
                });
            })?;
            Ok(SubspaceErrors {
                latents: *latents,
                autoencoder_mm: distances_mm(
                    &reconstruct(&model, &data.span, &offsets_m),
                    &offsets_m,
                    &data.span,
                ),
                pca_mm: distances_mm(
                    &project(&data.span, *latents, &offsets_m),
                    &offsets_m,
                    &data.span,
                ),
            })
        })
        .collect()
}

/// Frames of offsets in metres, flat, through the autoencoder and back.
fn reconstruct(model: &Autoencoder, span: &Span, offsets_m: &[f32]) -> Vec<f32> {
    let clip = ClipFields {
        features: Vec::new(),
        frames: offsets_m.len() / span.basis.coordinates(),
        fields: span.normalised(offsets_m),
    };
    let latents = encode(model, &clip, span.width());
    let shape = [clip.frames, latents.len() / clip.frames.max(1)];
    let latents = Tensor::from_data(TensorData::new(latents, shape), &Device::flex());
    let fields = model.decode(latents).into_data();
    span.offsets_m(&fields.iter::<f32>().collect::<Vec<_>>())
}

/// The same through the first principal components.
fn project(span: &Span, components: usize, offsets_m: &[f32]) -> Vec<f32> {
    let mut fields = span.normalised(offsets_m);
    let zero = span.zero();
    for field in fields.chunks_exact_mut(span.width()) {
        // Principal components are about zero offset: what is left out has no offset.
        field[components.min(zero.len())..].copy_from_slice(&zero[components.min(zero.len())..]);
    }
    span.offsets_m(&fields)
}

/// Mean distance of vertices in millimetres, one a frame.
fn distances_mm(got_m: &[f32], truth_m: &[f32], span: &Span) -> Vec<f64> {
    let coordinates = span.basis.coordinates();
    let frames = got_m
        .chunks_exact(coordinates)
        .zip(truth_m.chunks_exact(coordinates));
    frames
        .map(|(got, truth)| {
            let vertices = got.chunks_exact(3).zip(truth.chunks_exact(3));
            let lengths = vertices.map(|(a, b)| {
                let squares = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2));
                squares.sum::<f64>().sqrt()
            });
            1000.0 * lengths.sum::<f64>() / (coordinates / 3) as f64
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::span::tests::sample;
    use super::*;

    #[test]
    fn principal_components_of_the_whole_span_leave_nothing() {
        let sample = sample(60, 24, 4);
        let span = Span::fit(&sample, 8, 1).expect("a span");
        let offsets_m = sample.transpose().as_slice().to_vec();
        let all = distances_mm(&project(&span, 8, &offsets_m), &offsets_m, &span);
        let two = distances_mm(&project(&span, 2, &offsets_m), &offsets_m, &span);
        assert_eq!(all.len(), 60);
        assert!(all.iter().all(|mm| *mm < 1e-3), "{all:?}");
        assert!(two.iter().sum::<f64>() > 100.0 * all.iter().sum::<f64>());
    }

    #[test]
    fn distances_are_means_over_vertices() {
        let span = Span::fit(&sample(20, 6, 2), 2, 1).expect("a span");
        let got = distances_mm(&[0.003, 0.004, 0.0, 0.0, 0.0, 0.001], &[0.0; 6], &span);
        assert!((got[0] - 3.0).abs() < 1e-5, "{got:?}");
    }
}
