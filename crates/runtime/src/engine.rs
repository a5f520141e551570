//! Runs the networks for any number of avatars at once.
//!
//! Each network is called once per tick for all avatars that tick, and the decoder once per step
//! for all whose surface changes. One avatar alone goes through the same code.

use crate::RuntimeError;
use crate::avatar::{Avatar, StageSeconds, Stopwatch};
use crate::model::Networks;
use crate::onnx::{BATCH, DecoderRows, DecoderSession, PredictorRows, PredictorSession};
use crate::tissue::{MAX_SETTLE_TICKS, Tissue};

/// The sessions of one thread, and its scratch.
#[derive(Debug)]
pub(crate) struct Engine {
    pub predictor: PredictorSession,
    pub decoder: DecoderSession,
    /// Which of the avatars take part in the call at hand.
    chosen: Vec<usize>,
}

impl Engine {
    /// Sets up runs of `networks`.
    ///
    /// # Errors
    /// [`RuntimeError::Inference`] where tract cannot.
    pub fn new(networks: &Networks) -> Result<Self, RuntimeError> {
        Ok(Self {
            predictor: PredictorSession::new(networks.predictor.clone())?,
            decoder: DecoderSession::new(&networks.decoder)?,
            chosen: Vec::new(),
        })
    }

    /// Moves the tissue of all `avatars` as they have planned it, and shows it.
    fn run(
        &mut self,
        avatars: &mut [&mut Avatar],
        seconds: &mut StageSeconds,
        stopwatch: Stopwatch<'_>,
    ) -> Result<(), RuntimeError> {
        self.settle(avatars, seconds, stopwatch)?;
        self.tick(avatars, seconds, stopwatch)?;
        self.show(avatars, seconds, stopwatch)
    }

    /// Decodes and shows, batch by batch: what was decoded is still in the processor's cache when it
    /// is shown.
    fn show(
        &mut self,
        avatars: &mut [&mut Avatar],
        seconds: &mut StageSeconds,
        stopwatch: Stopwatch<'_>,
    ) -> Result<(), RuntimeError> {
        let mut start = stopwatch();
        self.choose(avatars, |avatar| avatar.begin_showing());
        let mut shown = 0;
        for chosen in self.chosen.chunks(BATCH) {
            let rows = &mut Chosen { avatars, chosen };
            self.decoder.decode_rows(rows)?;
            let decoded = stopwatch();
            let end = chosen.last().map_or(shown, |last| last + 1);
            avatars[shown..end].iter_mut().for_each(|a| a.show());
            shown = end;
            seconds.decode += decoded - start;
            start = stopwatch();
            seconds.apply += start - decoded;
        }
        avatars[shown..].iter_mut().for_each(|a| a.show());
        if shown < avatars.len() {
            seconds.apply += stopwatch() - start;
        }
        Ok(())
    }

    /// Lets the tissue of those that settle come to rest in their new pose.
    fn settle(
        &mut self,
        avatars: &mut [&mut Avatar],
        seconds: &mut StageSeconds,
        stopwatch: Stopwatch<'_>,
    ) -> Result<(), RuntimeError> {
        self.choose(avatars, |avatar| avatar.begin_settling());
        if self.chosen.is_empty() {
            return Ok(());
        }
        let start = stopwatch();
        for _ in 0..MAX_SETTLE_TICKS {
            if self.chosen.is_empty() {
                break;
            }
            self.predict(avatars)?;
            self.chosen
                .retain(|&idx| !avatars[idx].tissue().is_some_and(Tissue::has_settled));
        }
        seconds.predict += stopwatch() - start;
        Ok(())
    }

    /// Runs the ticks of those that tick.
    fn tick(
        &mut self,
        avatars: &mut [&mut Avatar],
        seconds: &mut StageSeconds,
        stopwatch: Stopwatch<'_>,
    ) -> Result<(), RuntimeError> {
        for index in 0.. {
            let start = stopwatch();
            self.choose(avatars, |avatar| avatar.feel_tick(index));
            if self.chosen.is_empty() {
                break;
            }
            let felt = stopwatch();
            self.predict(avatars)?;
            let predicted = stopwatch();
            self.chosen.retain(|&idx| {
                let tissue = avatars[idx].tissue_mut();
                tissue.is_some_and(Tissue::begin_response)
            });
            seconds.features += felt - start;
            seconds.predict += predicted - felt;
            if !self.chosen.is_empty() {
                self.decode(avatars)?;
                for &idx in &self.chosen {
                    if let Some(tissue) = avatars[idx].tissue_mut() {
                        tissue.respond();
                    }
                }
                seconds.decode += stopwatch() - predicted;
            }
        }
        Ok(())
    }

    fn choose(&mut self, avatars: &mut [&mut Avatar], choice: impl Fn(&mut Avatar) -> bool) {
        self.chosen.clear();
        for (idx, avatar) in avatars.iter_mut().enumerate() {
            if choice(avatar) {
                self.chosen.push(idx);
            }
        }
    }

    /// One tick of the predictor for the chosen.
    fn predict(&mut self, avatars: &mut [&mut Avatar]) -> Result<(), RuntimeError> {
        for &idx in &self.chosen {
            if let Some(tissue) = avatars[idx].tissue_mut() {
                tissue.begin_tick();
            }
        }
        let chosen = &self.chosen;
        self.predictor.step_rows(&mut Chosen { avatars, chosen })
    }

    /// One run of the decoder for the chosen.
    fn decode(&mut self, avatars: &mut [&mut Avatar]) -> Result<(), RuntimeError> {
        let chosen = &self.chosen;
        self.decoder.decode_rows(&mut Chosen { avatars, chosen })
    }
}

/// Moves `avatars` on by the steps they have planned. Without networks there is no `engine`.
///
/// # Errors
/// [`RuntimeError::Inference`], [`RuntimeError::NonFinite`]: some surfaces may have moved on, and
/// for all avatars the next pose counts as the first.
pub(crate) fn step(
    engine: Option<&mut Engine>,
    avatars: &mut [&mut Avatar],
    stopwatch: Stopwatch<'_>,
) -> Result<StageSeconds, RuntimeError> {
    let mut seconds = StageSeconds::default();
    if let Some(engine) = engine
        && let Err(error) = engine.run(avatars, &mut seconds, stopwatch)
    {
        // The states may be halfway between two ticks.
        for avatar in avatars {
            avatar.reset();
        }
        return Err(error);
    }
    let start = stopwatch();
    for avatar in avatars.iter_mut() {
        avatar.commit();
    }
    seconds.skin = stopwatch() - start;
    Ok(seconds)
}

/// The chosen of several avatars, all of which have tissue.
struct Chosen<'a, 'b> {
    avatars: &'a mut [&'b mut Avatar],
    chosen: &'a [usize],
}

impl Chosen<'_, '_> {
    fn tissue(&self, row: usize) -> Option<&Tissue> {
        self.avatars[self.chosen[row]].tissue()
    }

    fn tissue_mut(&mut self, row: usize) -> Option<&mut Tissue> {
        self.avatars[self.chosen[row]].tissue_mut()
    }
}

impl PredictorRows for Chosen<'_, '_> {
    fn count(&self) -> usize {
        self.chosen.len()
    }

    fn features(&self, row: usize) -> &[f32] {
        self.tissue(row).map_or(&[], Tissue::features)
    }

    fn state(&self, row: usize) -> &[f32] {
        self.tissue(row).map_or(&[], Tissue::state)
    }

    fn state_mut(&mut self, row: usize) -> &mut [f32] {
        self.tissue_mut(row).map_or(&mut [], Tissue::state_mut)
    }

    fn latent_mut(&mut self, row: usize) -> &mut [f32] {
        self.tissue_mut(row).map_or(&mut [], Tissue::latent_mut)
    }
}

impl DecoderRows for Chosen<'_, '_> {
    fn count(&self) -> usize {
        self.chosen.len()
    }

    fn latent(&self, row: usize) -> &[f32] {
        self.tissue(row).map_or(&[], Tissue::decoder_input)
    }

    fn offsets_m(&mut self, row: usize) -> &mut [f32] {
        self.tissue_mut(row).map_or(&mut [], Tissue::decoder_output)
    }
}
