//! Lowering: a bundle's ONNX files as files that a core without tract plays, held to tract.

use std::sync::Arc;

use sha2::{Digest, Sha256};

use super::plans::NetworkFile;
use super::predictor::seldom;
use super::{Decoder, DecoderSession, Predictor, PredictorSession};
use crate::bundle::Bundle;
use crate::{Network, RuntimeError};

/// The networks of a bundle as lowered files.
#[derive(Clone, Debug)]
pub struct LoweredNetworks {
    /// The predictor's file.
    pub predictor: Vec<u8>,
    /// The decoder's file.
    pub decoder: Vec<u8>,
}

/// What lowered networks gave beside tract.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Comparison {
    /// Ticks that were played.
    pub ticks: usize,
    /// Largest difference of an offset along an axis, in metres.
    pub largest_difference_m: f32,
    /// Largest offset along an axis, in metres.
    pub largest_offset_m: f32,
}

/// Lowers the networks of `bundle`.
///
/// # Errors
/// [`RuntimeError::HashMismatch`]; [`RuntimeError::NotOnnx`] and its like;
/// [`RuntimeError::CannotLower`] for a graph with an operator that only tract runs.
pub fn lower(
    bundle: &Bundle,
    predictor_onnx: &[u8],
    decoder_onnx: &[u8],
) -> Result<LoweredNetworks, RuntimeError> {
    bundle.predictor.verify(predictor_onnx)?;
    bundle.decoder.verify(decoder_onnx)?;
    let predictor = NetworkFile::read(Network::Predictor, predictor_onnx)?;
    let seldom = seldom(&predictor, bundle.feature_kind.condition_count())?;
    let decoder = NetworkFile::read(Network::Decoder, decoder_onnx)?;
    let hash = |bytes: &[u8]| Sha256::digest(bytes).into();
    Ok(LoweredNetworks {
        predictor: predictor.lower(hash(predictor_onnx), Some(seldom))?,
        decoder: decoder.lower(hash(decoder_onnx), None)?,
    })
}

impl LoweredNetworks {
    /// Plays `ticks`, each the features of one tick, with these networks and with tract, which runs
    /// the graphs of the ONNX files as they stand there. Both keep states of their own.
    ///
    /// # Errors
    /// Those of [`Predictor::load`]; [`RuntimeError::Inference`] for features of a wrong number,
    /// [`RuntimeError::NonFinite`].
    pub fn compare(
        &self,
        predictor_onnx: &[u8],
        decoder_onnx: &[u8],
        ticks: impl IntoIterator<Item = Vec<f32>>,
    ) -> Result<Comparison, RuntimeError> {
        let predictor = Predictor::load(&self.predictor)?;
        let mut lowered = Player::new(predictor, &Decoder::load(&self.decoder)?)?;
        let predictor = Predictor::load_plain(predictor_onnx)?;
        let mut plain = Player::new(predictor, &Decoder::load_plain(decoder_onnx)?)?;
        let mut comparison = Comparison::default();
        for features in ticks {
            let got_m = lowered.tick(&features)?;
            let expected_m = plain.tick(&features)?;
            comparison.ticks += 1;
            for (got_m, expected_m) in got_m.iter().zip(expected_m) {
                let difference_m = (got_m - expected_m).abs();
                comparison.largest_difference_m = comparison.largest_difference_m.max(difference_m);
                comparison.largest_offset_m = comparison.largest_offset_m.max(expected_m.abs());
            }
        }
        Ok(comparison)
    }
}

/// Both networks, one after the other.
struct Player {
    predictor: PredictorSession,
    decoder: DecoderSession,
    state: super::PredictorState,
    latent: Vec<f32>,
    offsets_m: Vec<f32>,
}

impl Player {
    fn new(predictor: Predictor, decoder: &Decoder) -> Result<Self, RuntimeError> {
        Ok(Self {
            state: predictor.zero_state(),
            latent: vec![0.0; predictor.latent_count()],
            offsets_m: vec![0.0; 3 * decoder.vertex_count()],
            predictor: PredictorSession::new(Arc::new(predictor))?,
            decoder: DecoderSession::new(decoder)?,
        })
    }

    fn tick(&mut self, features: &[f32]) -> Result<&[f32], RuntimeError> {
        self.predictor
            .step(features, &mut self.state, &mut self.latent)?;
        self.decoder.decode(&self.latent, &mut self.offsets_m)?;
        Ok(&self.offsets_m)
    }
}
