//! A bundle's networks, played tick by tick by the runtime on features of a clip.

use std::path::Path;
use std::sync::Arc;

use dynaskin_runtime::features::FeatureKind;
use dynaskin_runtime::{
    Bundle, Decoder, DecoderSession, Predictor, PredictorSession, RuntimeError,
};

use crate::TrainError;
use crate::evaluate::LinearDecoder;

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
        let predictor = Predictor::load(predictor_onnx)?;
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
        let mut offsets_m = vec![0.0; frames * 3 * self.vertices];
        let mut state = self.predictor.predictor().zero_state();
        let mut latent = vec![0.0; self.latents];
        for (features, offsets_m) in features
            .chunks_exact(self.kind.count())
            .zip(offsets_m.chunks_exact_mut(3 * self.vertices))
        {
            self.predictor.step(features, &mut state, &mut latent)?;
            self.decoder.decode(&latent, offsets_m)?;
        }
        Ok(offsets_m)
    }

    /// What the decoder gives for each unit latent.
    pub(crate) fn decoder_matrix(&mut self) -> Result<LinearDecoder, RuntimeError> {
        let coordinates = 3 * self.vertices;
        let mut fields = vec![0.0; self.latents * coordinates];
        let mut latent = vec![0.0; self.latents];
        for (index, field) in fields.chunks_exact_mut(coordinates).enumerate() {
            latent[index] = 1.0;
            self.decoder.decode(&latent, field)?;
            latent[index] = 0.0;
        }
        Ok(LinearDecoder::new(fields, self.latents))
    }
}
