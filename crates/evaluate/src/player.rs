//! A bundle's networks, played tick by tick by the runtime on features of a clip.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use dynaskin_runtime::features::FeatureKind;
use dynaskin_runtime::{
    Bundle, Decoder, DecoderSession, Predictor, PredictorSession, RuntimeError,
};

use crate::linear::LinearDecoder;
use dynaskin_train::TrainError;

/// The networks of one bundle.
pub struct Player {
    predictor: PredictorSession,
    decoder: DecoderSession,
    kind: FeatureKind,
    latents: usize,
    vertices: usize,
}

impl Player {
    /// Loads the two graphs.
    ///
    /// # Errors
    /// [`TrainError::Runtime`] where the runtime refuses one.
    pub fn new(
        kind: FeatureKind,
        predictor_onnx: &[u8],
        decoder_onnx: &[u8],
    ) -> Result<Self, TrainError> {
        let predictor = Predictor::load_conditioned(predictor_onnx, kind.condition_count())?;
        let decoder = Decoder::load(decoder_onnx)?;
        Ok(Self {
            kind,
            latents: decoder.latent_count(),
            vertices: decoder.vertex_count(),
            decoder: DecoderSession::new(&decoder)?,
            predictor: PredictorSession::new(Arc::new(predictor))?,
        })
    }

    /// Loads the networks of the bundle in the folder `dir`, and its `bundle.json`.
    ///
    /// # Errors
    /// [`TrainError::Io`], [`TrainError::Runtime`].
    pub fn load(dir: &Path) -> Result<(Self, Bundle), TrainError> {
        let read = |file: &str| {
            let path = dir.join(file);
            std::fs::read(&path).map_err(TrainError::io(&path, "reading"))
        };
        let bundle = Bundle::from_json(&read("bundle.json")?)?;
        let predictor = read(&bundle.predictor.file)?;
        let decoder = read(&bundle.decoder.file)?;
        bundle.predictor.verify(&predictor)?;
        bundle.decoder.verify(&decoder)?;
        Ok((
            Self::new(bundle.feature_kind, &predictor, &decoder)?,
            bundle,
        ))
    }

    /// What the predictor takes as input.
    pub fn feature_kind(&self) -> FeatureKind {
        self.kind
    }

    /// Number of vertices that the decoder moves.
    pub fn vertex_count(&self) -> usize {
        self.vertices
    }

    /// Offsets of every frame of `features` (`[frame][feature]` flat), from the state at rest;
    /// `[frame][vertex][xyz]` flat, in metres.
    ///
    /// # Errors
    /// [`TrainError::Runtime`] where a network fails.
    pub fn play(&mut self, features: &[f32]) -> Result<Vec<f32>, TrainError> {
        let frames = features.len() / self.kind.count();
        let mut offsets_m = Vec::with_capacity(frames * 3 * self.vertices);
        self.visit(
            features,
            |_| true,
            |_, offsets| offsets_m.extend_from_slice(offsets),
        )?;
        Ok(offsets_m)
    }

    /// As [`Self::play`], but shows each frame that is `wanted` to `see` instead of keeping them:
    /// its index and its offsets.
    ///
    /// # Errors
    /// [`TrainError::Runtime`] where a network fails.
    pub fn visit(
        &mut self,
        features: &[f32],
        wanted: impl Fn(usize) -> bool,
        mut see: impl FnMut(usize, &[f32]),
    ) -> Result<(), TrainError> {
        let mut offsets_m = vec![0.0; 3 * self.vertices];
        let mut state = self.predictor.predictor().zero_state();
        let mut latent = vec![0.0; self.latents];
        for (frame, features) in features.chunks_exact(self.kind.count()).enumerate() {
            self.predictor.step(features, &mut state, &mut latent)?;
            if wanted(frame) {
                self.decoder.decode(&latent, &mut offsets_m)?;
                see(frame, &offsets_m);
            }
        }
        Ok(())
    }

    /// Medians over the frames of `features` of the time that the predictor and the decoder take
    /// for one, in milliseconds.
    ///
    /// # Errors
    /// [`TrainError::Runtime`] where a network fails.
    pub fn time_ms(&mut self, features: &[f32]) -> Result<[f64; 2], TrainError> {
        let mut offsets_m = vec![0.0; 3 * self.vertices];
        let mut state = self.predictor.predictor().zero_state();
        let mut latent = vec![0.0; self.latents];
        let mut times_ms = [Vec::new(), Vec::new()];
        for features in features.chunks_exact(self.kind.count()) {
            let start = Instant::now();
            self.predictor.step(features, &mut state, &mut latent)?;
            let between = Instant::now();
            self.decoder.decode(&latent, &mut offsets_m)?;
            times_ms[0].push((between - start).as_secs_f64() * 1000.0);
            times_ms[1].push(between.elapsed().as_secs_f64() * 1000.0);
        }
        Ok(times_ms.map(|mut times| {
            times.sort_by(f64::total_cmp);
            times.get(times.len() / 2).copied().unwrap_or(0.0)
        }))
    }

    /// The decoder as a matrix; none where it is not linear, so that what it gives for unit latents
    /// does not tell what it gives for others.
    pub(crate) fn linear_decoder(&mut self) -> Result<Option<LinearDecoder>, RuntimeError> {
        let coordinates = 3 * self.vertices;
        let mut fields = vec![0.0; self.latents * coordinates];
        let mut latent = vec![0.0; self.latents];
        for (index, field) in fields.chunks_exact_mut(coordinates).enumerate() {
            latent[index] = 1.0;
            self.decoder.decode(&latent, field)?;
            latent[index] = 0.0;
        }
        // Latents of both signs and of sizes that nonlinear units do not pass unchanged.
        for (k, latent) in latent.iter_mut().enumerate() {
            *latent = if k % 2 == 0 { 0.7 } else { -1.9 };
        }
        let mut field = vec![0.0; coordinates];
        self.decoder.decode(&latent, &mut field)?;
        let (mut difference, mut size) = (0.0, 0.0);
        for (coordinate, got) in field.iter().enumerate() {
            let units = fields.iter().skip(coordinate).step_by(coordinates);
            let terms = units
                .zip(&latent)
                .map(|(x, l)| f64::from(*x) * f64::from(*l));
            let (sum, sizes) = terms.fold((0.0, 0.0), |(sum, sizes), term| {
                (sum + term, sizes + term.abs())
            });
            difference += (f64::from(*got) - sum).abs();
            size += sizes;
        }
        let linear = difference <= 1e-4 * size;
        Ok(linear.then(|| LinearDecoder::new(fields, self.latents)))
    }
}
