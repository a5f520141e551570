//! `dynaskin train spring-bones` and `dmpl`, which are fitted at once, without epochs.

use std::time::Instant;

use clap::Args;
use dynaskin_baselines::{DmplConfig, SpringBonesConfig, train_dmpl, train_spring_bones};
use dynaskin_train::{Networks, TrainError, TrainingInput};

use super::{CommonArgs, clip_bar};

/// Options of spring bones.
#[derive(Debug, Args)]
pub struct SpringBonesArgs {
    #[command(flatten)]
    pub common: CommonArgs,
}

impl SpringBonesArgs {
    /// Fits the springs; gives the minutes it took, too.
    pub fn train(&self, input: TrainingInput<'_>) -> anyhow::Result<(Networks, f64)> {
        timed(|progress| train_spring_bones(input, &SpringBonesConfig::default(), progress))
    }
}

/// Options of Dyna and DMPL.
#[derive(Debug, Args)]
pub struct DmplArgs {
    #[command(flatten)]
    pub common: CommonArgs,
    /// Principal components.
    #[arg(long, default_value_t = DmplConfig::default().components)]
    components: usize,
    /// Do not learn from mirror images.
    #[arg(long)]
    no_mirror: bool,
}

impl DmplArgs {
    /// Fits the regression; gives the minutes it took, too.
    pub fn train(&self, input: TrainingInput<'_>) -> anyhow::Result<(Networks, f64)> {
        let config = DmplConfig {
            seed: input.seed,
            components: self.components,
            mirror: !self.no_mirror,
            ..DmplConfig::default()
        };
        timed(|progress| train_dmpl(input, &config, progress))
    }
}

/// Training without epochs, shown as a bar over the clips; gives the minutes it took, too.
fn timed(
    train: impl FnOnce(&mut dyn FnMut(usize, usize)) -> Result<Networks, TrainError>,
) -> anyhow::Result<(Networks, f64)> {
    let start = Instant::now();
    let bar = clip_bar("reading clips");
    let networks = train(&mut |done, all| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
    })?;
    bar.finish_and_clear();
    Ok((networks, start.elapsed().as_secs_f64() / 60.0))
}
