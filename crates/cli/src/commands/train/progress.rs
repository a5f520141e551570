//! What a run shows of its progress.

use std::time::Duration;

use dynaskin_train::EpochRecord;
use indicatif::{ProgressBar, ProgressStyle};

/// A line about an epoch, and about how long the rest takes.
pub(super) fn epoch_line(
    epoch: &EpochRecord,
    epochs: usize,
    seen: usize,
    elapsed: Duration,
) -> String {
    let left = elapsed.as_secs_f64() / seen as f64 * (epochs - epoch.epoch) as f64;
    format!(
        "epoch {:3}/{epochs}  loss {:.3} mm  validation {:.3} mm, {:.3} of static  {:.0} s, {:.0} \
         min left",
        epoch.epoch,
        epoch.training_loss,
        epoch.validation_loss,
        epoch.validation_ratio,
        epoch.seconds,
        left / 60.0
    )
}

/// A bar over things to be done.
pub(in crate::commands) fn clip_bar(what: &'static str) -> ProgressBar {
    let bar = ProgressBar::new(1).with_message(what);
    if let Ok(style) = ProgressStyle::with_template("{msg} {bar:30} {pos}/{len}, {eta} left") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(Duration::from_millis(500));
    bar
}
