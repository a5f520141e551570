//! The predictor: its contract, its state and its ticks.

use std::sync::Arc;

use super::fused::Seldom;
use super::plans::{NetworkFile, Plans, Rows, Runner, finite};
use crate::ports::{broken, names, row};
use crate::{Network, RuntimeError};

const NETWORK: Network = Network::Predictor;

/// The predictor: features and state to latent and next state.
#[derive(Debug)]
pub struct Predictor {
    plans: Plans,
    ports: PredictorPorts,
}

/// Where the predictor's values stand among the graph's inputs and outputs.
#[derive(Debug)]
struct PredictorPorts {
    /// What each input is.
    inputs: Vec<Part>,
    /// What each output is.
    outputs: Vec<Part>,
    feature_count: usize,
    latent_count: usize,
    /// Numbers of all states together.
    state_count: usize,
}

/// What a port carries.
#[derive(Clone, Copy, Debug)]
enum Part {
    /// Features or latent.
    Signal,
    /// The part of the state that starts here.
    State(usize),
}

/// The recurrent state between two ticks.
#[derive(Clone, Debug, PartialEq)]
pub struct PredictorState(Vec<f32>);

impl PredictorState {
    /// Its numbers.
    pub(crate) fn into_numbers(self) -> Vec<f32> {
        self.0
    }
}

/// One tick of the predictor, of which [`PredictorSession::step_rows`] makes several at once.
pub(crate) trait PredictorRow {
    /// What the tick sees.
    fn features(&self) -> &[f32];
    /// The state before the tick.
    fn state(&self) -> &[f32];
    /// Where the next state goes.
    fn state_mut(&mut self) -> &mut [f32];
    /// Where the latent goes.
    fn latent_mut(&mut self) -> &mut [f32];
    /// What the predictor keeps for this row from tick to tick, so as not to calculate it again:
    /// empty before the first. It is no part of the state.
    fn kept_mut(&mut self) -> &mut Vec<f32>;
}

/// A use of a [`Predictor`] by one thread.
#[derive(Debug)]
pub struct PredictorSession {
    predictor: Arc<Predictor>,
    runner: Runner,
    /// States after the tick, row by row: taken over once all numbers are known to be finite.
    next: Vec<f32>,
    /// What [`Self::step`] keeps from tick to tick.
    kept: Vec<f32>,
}

impl Predictor {
    /// Reads `bytes`, an ONNX or a lowered file, and checks it against the contract.
    ///
    /// # Errors
    /// What is wrong with the file: [`RuntimeError::NotOnnx`] and its like, or
    /// [`RuntimeError::NotLowered`]; [`RuntimeError::NeedsLowered`] for ONNX without the feature
    /// `tract`; [`RuntimeError::BrokenContract`], [`RuntimeError::Inference`],
    /// [`RuntimeError::NonFinite`] where a run on zeros does not give finite numbers.
    pub fn load(bytes: &[u8]) -> Result<Self, RuntimeError> {
        Self::load_conditioned(bytes, 0)
    }

    /// As [`Self::load`], for a predictor whose last `condition_count` features are about the body
    /// (a lowered file says so itself).
    /// What depends on them alone is calculated again only when they change; they may change at
    /// any tick.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn load_conditioned(bytes: &[u8], condition_count: usize) -> Result<Self, RuntimeError> {
        let file = NetworkFile::read(NETWORK, bytes)?;
        let ports = PredictorPorts::of(&file)?;
        let seldom = seldom(&file, condition_count)?;
        let plans = file.into_plans(Some(seldom))?;
        Ok(Self { plans, ports })
    }

    /// As [`Self::load`], run by tract: the reference.
    ///
    /// # Errors
    /// As [`Self::load`].
    #[cfg(feature = "tract")]
    pub(super) fn load_plain(onnx_bytes: &[u8]) -> Result<Self, RuntimeError> {
        let file = NetworkFile::read(NETWORK, onnx_bytes)?;
        let ports = PredictorPorts::of(&file)?;
        let plans = file.into_plain_plans()?;
        Ok(Self { plans, ports })
    }

    /// F: numbers that [`PredictorSession::step`] takes as features.
    pub fn feature_count(&self) -> usize {
        self.ports.feature_count
    }

    /// L: numbers that [`PredictorSession::step`] writes.
    pub fn latent_count(&self) -> usize {
        self.ports.latent_count
    }

    /// The state before anything was seen: zeros.
    pub fn zero_state(&self) -> PredictorState {
        PredictorState(vec![0.0; self.ports.state_count])
    }
}

/// Which inputs of the predictor change seldom: the last `condition_count` features.
///
/// # Errors
/// [`RuntimeError::BrokenContract`] where there are no features.
pub(super) fn seldom(file: &NetworkFile, condition_count: usize) -> Result<Seldom, RuntimeError> {
    let (port, feature_count) = row(NETWORK, &file.inputs, "features")?;
    Ok(Seldom {
        port,
        numbers: feature_count.saturating_sub(condition_count)..feature_count,
    })
}

impl PredictorPorts {
    fn of(graph: &NetworkFile) -> Result<Self, RuntimeError> {
        let (_, feature_count) = row(NETWORK, &graph.inputs, "features")?;
        let (latent, latent_count) = row(NETWORK, &graph.outputs, "latent")?;
        let mut inputs = Vec::new();
        let mut outputs = vec![Part::Signal; graph.outputs.len()];
        let (mut state_count, mut states) = (0, 0);
        for port in &graph.inputs {
            if port.name == "features" {
                inputs.push(Part::Signal);
                continue;
            }
            if !port.name.starts_with("state_") {
                let place = format!("input `{}`", port.name);
                let expected = "`features` or `state_...`";
                return Err(broken(NETWORK, place, expected, "this name"));
            }
            let (_, count) = row(NETWORK, &graph.inputs, &port.name)?;
            let next = format!("{}_out", port.name);
            let (output, next_count) = row(NETWORK, &graph.outputs, &next)?;
            if count != next_count {
                let place = format!("output `{next}`");
                let (expected, got) = (format!("[1, {count}]"), format!("[1, {next_count}]"));
                return Err(broken(NETWORK, place, expected, got));
            }
            inputs.push(Part::State(state_count));
            outputs[output] = Part::State(state_count);
            state_count += count;
            states += 1;
        }
        if outputs.len() != states + 1 || !matches!(outputs[latent], Part::Signal) {
            let expected = format!("`latent` and {states} states");
            return Err(broken(NETWORK, "outputs", expected, names(&graph.outputs)));
        }
        Ok(Self {
            inputs,
            outputs,
            feature_count,
            latent_count,
            state_count,
        })
    }
}

impl PredictorSession {
    /// Sets up runs of `predictor`.
    ///
    /// # Errors
    /// [`RuntimeError::Inference`] where tract cannot set them up.
    pub fn new(predictor: Arc<Predictor>) -> Result<Self, RuntimeError> {
        Ok(Self {
            runner: Runner::new(&predictor.plans)?,
            predictor,
            next: Vec::new(),
            kept: Vec::new(),
        })
    }

    /// The predictor.
    pub fn predictor(&self) -> &Predictor {
        &self.predictor
    }

    /// One tick: reads `features`, writes `latent`, and moves `state` on.
    ///
    /// # Errors
    /// [`RuntimeError::Inference`], also for `features` or `latent` of a wrong length;
    /// [`RuntimeError::NonFinite`]. `state` then stays as it was.
    pub fn step(
        &mut self,
        features: &[f32],
        state: &mut PredictorState,
        latent: &mut [f32],
    ) -> Result<(), RuntimeError> {
        struct One<'a>(&'a [f32], &'a mut PredictorState, &'a mut [f32], Vec<f32>);
        impl PredictorRow for One<'_> {
            fn features(&self) -> &[f32] {
                self.0
            }
            fn state(&self) -> &[f32] {
                &self.1.0
            }
            fn state_mut(&mut self) -> &mut [f32] {
                &mut self.1.0
            }
            fn latent_mut(&mut self) -> &mut [f32] {
                self.2
            }
            fn kept_mut(&mut self) -> &mut Vec<f32> {
                &mut self.3
            }
        }
        let kept = std::mem::take(&mut self.kept);
        let mut rows = [One(features, state, latent, kept)];
        let stepped = self.step_rows(&mut rows);
        let [One(.., kept)] = rows;
        self.kept = kept;
        stepped
    }

    /// One tick of several rows.
    ///
    /// # Errors
    /// As [`Self::step`], for all rows if for one; latents may have been written.
    pub(crate) fn step_rows(&mut self, rows: &mut [impl PredictorRow]) -> Result<(), RuntimeError> {
        let ports = &self.predictor.ports;
        let rows_count = rows.len();
        for row in rows.iter_mut() {
            let expected = (ports.feature_count, ports.state_count, ports.latent_count);
            let latents = row.latent_mut().len();
            let got = (row.features().len(), row.state().len(), latents);
            if got != expected {
                let reason = format!(
                    "it has features, states and latents of {expected:?} numbers, not {got:?}"
                );
                return Err(RuntimeError::Inference {
                    network: NETWORK,
                    reason,
                });
            }
        }
        let count = ports.state_count;
        self.next.resize(rows_count * count, 0.0);
        let mut tick = Tick {
            ports,
            next: &mut self.next,
            sound: true,
            rows,
        };
        self.runner.run(rows_count, &mut tick)?;
        if !tick.sound {
            return Err(RuntimeError::NonFinite { network: NETWORK });
        }
        for (row, next) in rows.iter_mut().zip(self.next.chunks_exact(count.max(1))) {
            row.state_mut().copy_from_slice(next);
        }
        Ok(())
    }
}

/// The rows of one tick.
struct Tick<'a, R> {
    ports: &'a PredictorPorts,
    rows: &'a mut [R],
    next: &'a mut [f32],
    /// Whether all numbers so far were finite.
    sound: bool,
}

impl<R: PredictorRow> Rows for Tick<'_, R> {
    fn fill(&self, port: usize, row: usize, target: &mut [f32]) {
        match self.ports.inputs[port] {
            Part::Signal => target.copy_from_slice(self.rows[row].features()),
            Part::State(start) => {
                let state = self.rows[row].state();
                target.copy_from_slice(&state[start..start + target.len()]);
            }
        }
    }

    fn take(&mut self, port: usize, row: usize, source: &[f32]) {
        self.sound &= finite(source);
        match self.ports.outputs[port] {
            Part::Signal => self.rows[row].latent_mut().copy_from_slice(source),
            Part::State(start) => {
                let start = row * self.ports.state_count + start;
                self.next[start..start + source.len()].copy_from_slice(source);
            }
        }
    }

    fn kept(&mut self, row: usize) -> &mut Vec<f32> {
        self.rows[row].kept_mut()
    }
}
