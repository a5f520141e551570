//! Methods side by side: what `dynaskin evaluate --report` shows.
//!
//! Every method is a [`Contestant`] and sees the same held-out clips through the runtime's own
//! features and networks. Nothing here is special to a method, so any bundle of the contract can
//! take part.

mod bodies;
mod contestant;
mod endurance;
mod floors;
mod groups;
mod reconstruction;
mod resonance;
mod showcase;
mod signals;
mod spectra;
mod splits;

use dynaskin_body::BodyModel;
use dynaskin_sim::SimSettings;
use dynaskin_train::DataSet;

pub use bodies::{BODIES, BodyAmplitudes, amplitudes_of_bodies};
pub use contestant::Contestant;
pub use endurance::{Drift, Settling, drift, settling};
pub use floors::{FLOOR_STRIDE, Floor, FloorSet, Floors, floors};
pub use groups::{group_names, signal_names};
pub use reconstruction::Reach;
pub use resonance::{
    HIGHEST_HZ, Resonance, ResonanceTest, Shift, resonances, shifts, tests as resonance_tests,
};
pub use showcase::{ClipCurves, Snapshot, curves, snapshot};
pub use spectra::{BANDS_HZ, Lag, Spectrum};
pub use splits::{ClipErrors, Comparison, SetComparison, Spread, compare};

/// The simulator's settings that a data set was made with, without the materials of its clips; the
/// usual ones for a data set that was not simulated.
pub fn simulator_settings(data_set: &DataSet, model: &BodyModel) -> SimSettings {
    let stored: Option<SimSettings> = serde_json::from_str(&data_set.sim_json)
        .ok()
        .and_then(|mut sim: serde_json::Value| sim.get_mut("settings").map(std::mem::take))
        .and_then(|settings| serde_json::from_value(settings).ok());
    stored.unwrap_or_else(|| SimSettings::for_body(model))
}
