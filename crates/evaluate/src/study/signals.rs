//! Spectra and delays of all movers and methods, added up clip by clip.

use super::groups::Movers;
use super::spectra::{Analyser, Lag, Spectrum};

/// Sums over clips, `[method][mover]`.
pub(super) struct SignalSums {
    analyser: Analyser,
    pub errors: Vec<Vec<Spectrum>>,
    pub lags: Vec<Vec<Lag>>,
}

impl SignalSums {
    pub fn new(methods: usize, movers: &Movers) -> Self {
        Self {
            analyser: Analyser::new(),
            errors: vec![vec![Spectrum::default(); movers.count()]; methods],
            lags: vec![vec![Lag::default(); movers.count()]; methods],
        }
    }

    /// Adds what a method made of a clip; both are `[mover][axis][frame]` in millimetres.
    pub fn add(&mut self, method: usize, truth: &[[Vec<f64>; 3]], predicted: &[[Vec<f64>; 3]]) {
        for (mover, (truth, predicted)) in truth.iter().zip(predicted).enumerate() {
            let error = std::array::from_fn(|axis| {
                let pairs = truth[axis].iter().zip(&predicted[axis]);
                pairs.map(|(truth, predicted)| predicted - truth).collect()
            });
            self.analyser.add(&error, &mut self.errors[method][mover]);
            self.lags[method][mover].add(truth, predicted);
        }
    }
}
