//! Sends tissue through the networks: one avatar's or that of any number at once.
//!
//! Each network is called once per tick for all that tick, and the decoder once per step for all
//! whose surface changes. At each stage a [`Member`] says whether it takes part. The pipeline knows
//! rows of tissue and the networks, and neither clock nor surface.

use crate::RuntimeError;
use crate::networks::{
    BATCH, DecoderRow, MAX_SETTLE_TICKS, Networks, PredictorRow, Sessions, still,
};
use crate::tissue::Tissue;

/// Time spent per stage of a step, in the stopwatch's seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct StageSeconds {
    /// Kinematics and features of all ticks.
    pub features: f64,
    /// The predictor, all ticks.
    pub predict: f64,
    /// The decoder, once.
    pub decode: f64,
    /// Gains, scattering, rest positions and normals.
    pub apply: f64,
    /// Forward kinematics and skin matrices; positions and normals where [`crate::Avatar::skin`]
    /// was called.
    pub skin: f64,
}

/// A stopwatch of the host: seconds since any fixed instant.
pub type Stopwatch<'a> = &'a mut dyn FnMut() -> f64;

/// One whose step is planned. Each stage gives the tissue that takes part in the networks' run after
/// it, if any does.
pub(crate) trait Member {
    /// Gets ready to settle, where that is planned.
    fn begin_settling(&mut self) -> Option<&mut Tissue>;
    /// Computes the features of tick `index`, where there is one.
    fn begin_tick(&mut self, index: usize) -> Option<&mut Tissue>;
    /// Gets ready to show the surface; gives tissue that has to be decoded for that.
    fn begin_showing(&mut self) -> Option<&mut Tissue>;
    /// Shows what was decoded.
    fn show(&mut self);
}

/// The networks of one thread, and room for a list of rows.
#[derive(Debug)]
pub(crate) struct Pipeline {
    sessions: Sessions,
    /// Always empty between two stages: its allocation is used again.
    room: Vec<&'static mut Tissue>,
}

impl Pipeline {
    /// Sets up runs of `networks`.
    ///
    /// # Errors
    /// [`RuntimeError::Inference`] where tract cannot.
    pub fn new(networks: &Networks) -> Result<Self, RuntimeError> {
        Ok(Self {
            sessions: Sessions::new(networks)?,
            room: Vec::new(),
        })
    }

    /// Moves the tissue of all `members` as they have planned it, and shows it.
    ///
    /// # Errors
    /// [`RuntimeError::Inference`], [`RuntimeError::NonFinite`]: some surfaces may have moved on, and
    /// states may be halfway between two ticks.
    pub fn run<M: Member>(
        &mut self,
        members: &mut [&mut M],
        seconds: &mut StageSeconds,
        stopwatch: Stopwatch<'_>,
    ) -> Result<(), RuntimeError> {
        self.settle(members, seconds, stopwatch)?;
        self.tick(members, seconds, stopwatch)?;
        self.show(members, seconds, stopwatch)
    }

    /// Lets the tissue of those that settle come to rest in their new pose.
    fn settle<M: Member>(
        &mut self,
        members: &mut [&mut M],
        seconds: &mut StageSeconds,
        stopwatch: Stopwatch<'_>,
    ) -> Result<(), RuntimeError> {
        let mut rows = emptied(std::mem::take(&mut self.room));
        rows.extend(
            members
                .iter_mut()
                .filter_map(|member| member.begin_settling()),
        );
        if !rows.is_empty() {
            let start = stopwatch();
            for _ in 0..MAX_SETTLE_TICKS {
                if rows.is_empty() {
                    break;
                }
                predict(&mut self.sessions, &mut rows)?;
                rows.retain(|tissue| {
                    let [latent, before] = tissue.latents();
                    !still(before, latent)
                });
            }
            seconds.predict += stopwatch() - start;
        }
        self.room = emptied(rows);
        Ok(())
    }

    /// Runs the ticks of those that tick.
    fn tick<M: Member>(
        &mut self,
        members: &mut [&mut M],
        seconds: &mut StageSeconds,
        stopwatch: Stopwatch<'_>,
    ) -> Result<(), RuntimeError> {
        for index in 0.. {
            let start = stopwatch();
            let mut rows = emptied(std::mem::take(&mut self.room));
            rows.extend(
                members
                    .iter_mut()
                    .filter_map(|member| member.begin_tick(index)),
            );
            if rows.is_empty() {
                self.room = emptied(rows);
                break;
            }
            let ready = stopwatch();
            predict(&mut self.sessions, &mut rows)?;
            let predicted = stopwatch();
            seconds.features += ready - start;
            seconds.predict += predicted - ready;
            rows.retain_mut(|tissue| tissue.begin_response());
            if !rows.is_empty() {
                self.sessions.decoder.decode_rows(&mut rows)?;
                rows.iter_mut().for_each(|tissue| tissue.respond());
                seconds.decode += stopwatch() - predicted;
            }
            self.room = emptied(rows);
        }
        Ok(())
    }

    /// Decodes and shows, batch by batch: what was decoded is still in the processor's cache when it
    /// is shown.
    fn show<M: Member>(
        &mut self,
        members: &mut [&mut M],
        seconds: &mut StageSeconds,
        stopwatch: Stopwatch<'_>,
    ) -> Result<(), RuntimeError> {
        let mut start = stopwatch();
        let (mut shown, mut asked) = (0, 0);
        while asked < members.len() {
            let mut rows = emptied(std::mem::take(&mut self.room));
            let mut end = shown;
            for member in &mut members[asked..] {
                asked += 1;
                if let Some(tissue) = member.begin_showing() {
                    rows.push(tissue);
                    end = asked;
                    if rows.len() == BATCH {
                        break;
                    }
                }
            }
            let decodes = !rows.is_empty();
            if decodes {
                self.sessions.decoder.decode_rows(&mut rows)?;
            }
            self.room = emptied(rows);
            if decodes {
                let decoded = stopwatch();
                members[shown..end].iter_mut().for_each(|m| m.show());
                shown = end;
                seconds.decode += decoded - start;
                start = stopwatch();
                seconds.apply += start - decoded;
            }
        }
        if shown < members.len() {
            members[shown..].iter_mut().for_each(|m| m.show());
            seconds.apply += stopwatch() - start;
        }
        Ok(())
    }
}

/// One tick of the predictor.
fn predict(sessions: &mut Sessions, rows: &mut [&mut Tissue]) -> Result<(), RuntimeError> {
    rows.iter_mut().for_each(|tissue| tissue.begin_tick());
    sessions.predictor.step_rows(rows)
}

/// An empty list in the room of `rows`, for other rows: collecting in place keeps the allocation.
fn emptied<'a>(mut rows: Vec<&mut Tissue>) -> Vec<&'a mut Tissue> {
    rows.clear();
    rows.into_iter()
        .map(|_| -> &mut Tissue { unreachable!("the list is empty") })
        .collect()
}

impl PredictorRow for &mut Tissue {
    fn features(&self) -> &[f32] {
        Tissue::features(self)
    }

    fn state(&self) -> &[f32] {
        Tissue::state(self)
    }

    fn state_mut(&mut self) -> &mut [f32] {
        Tissue::state_mut(self)
    }

    fn latent_mut(&mut self) -> &mut [f32] {
        Tissue::latent_mut(self)
    }

    fn kept_mut(&mut self) -> &mut Vec<f32> {
        Tissue::kept_mut(self)
    }
}

impl DecoderRow for &mut Tissue {
    fn latent(&self) -> &[f32] {
        self.decoder_input()
    }

    fn offsets_m(&mut self) -> &mut [f32] {
        self.decoder_output()
    }
}
