//! Both networks of a bundle, and how they come to rest.

use std::sync::Arc;

use super::decoder::{Decoder, DecoderSession};
use super::predictor::{Predictor, PredictorSession, PredictorState};
use crate::RuntimeError;
use crate::bundle::Bundle;

/// Most ticks of standing still until the tissue counts as settled: 2 s, after which tissue of
/// adults has long come to rest.
pub(crate) const MAX_SETTLE_TICKS: usize = 120;

/// Settled is what changes by less than this fraction of the largest latent in one tick.
const SETTLE_TOLERANCE: f32 = 1e-6;

/// The networks of a bundle.
#[derive(Debug)]
pub(crate) struct Networks {
    pub bundle: Bundle,
    pub predictor: Arc<Predictor>,
    pub decoder: Decoder,
}

/// Runs of both by one thread.
#[derive(Debug)]
pub(crate) struct Sessions {
    pub predictor: PredictorSession,
    pub decoder: DecoderSession,
}

/// What the networks come to when nothing moves.
#[derive(Debug)]
pub(crate) struct AtRest {
    pub state: PredictorState,
    pub latent: Vec<f32>,
    /// Three numbers a soft vertex, in metres.
    pub offsets_m: Vec<f32>,
}

impl Sessions {
    /// Sets up runs of `networks`.
    ///
    /// # Errors
    /// [`RuntimeError::Inference`] where tract cannot.
    pub fn new(networks: &Networks) -> Result<Self, RuntimeError> {
        Ok(Self {
            predictor: PredictorSession::new(networks.predictor.clone())?,
            decoder: DecoderSession::new(&networks.decoder)?,
        })
    }

    /// Feeds the same `features` until the latent stays.
    ///
    /// # Errors
    /// [`RuntimeError::Inference`], [`RuntimeError::NonFinite`].
    pub fn at_rest(&mut self, features: &[f32]) -> Result<AtRest, RuntimeError> {
        let predictor = self.predictor.predictor();
        let mut state = predictor.zero_state();
        let mut latent = vec![0.0; predictor.latent_count()];
        let mut before = latent.clone();
        for _ in 0..MAX_SETTLE_TICKS {
            before.copy_from_slice(&latent);
            self.predictor.step(features, &mut state, &mut latent)?;
            if still(&before, &latent) {
                break;
            }
        }
        let mut offsets_m = vec![0.0; 3 * self.decoder.vertex_count()];
        self.decoder.decode(&latent, &mut offsets_m)?;
        Ok(AtRest {
            state,
            latent,
            offsets_m,
        })
    }
}

/// Whether a latent has stopped changing.
pub(crate) fn still(before: &[f32], latent: &[f32]) -> bool {
    let size = latent.iter().fold(0.0_f32, |size, x| size.max(x.abs()));
    let changes = latent.iter().zip(before);
    let change = changes.fold(0.0_f32, |change, (a, b)| change.max((a - b).abs()));
    change <= SETTLE_TOLERANCE * size
}
