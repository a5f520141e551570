//! `dynaskin train`: from simulated clips to a measured bundle.

mod casas_otaduy;
mod dsnet;
mod dynaskin;
mod facts;
mod subspaces;

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context as _, bail};
use clap::Args;
use dynaskin_baselines::{
    DmplConfig, RunFolder, SpringBonesConfig, train_dmpl, train_spring_bones,
};
use dynaskin_body::BodyModel;
use dynaskin_evaluate::{BundleParts, Method, Player, Report, evaluate, write_bundle};
use dynaskin_runtime::BundleFile;
use dynaskin_train::{
    Compute, DataSet, EpochRecord, Networks, Set, Split, Tissue, TrainConfig, TrainError,
    TrainingInput,
};
use indicatif::{ProgressBar, ProgressStyle};

use super::say;
use casas_otaduy::CasasOtaduyArgs;
use dsnet::DsnetArgs;
use facts::facts;
pub(in crate::commands) use subspaces::SubspaceRow;

/// Arguments of `dynaskin train`.
#[derive(Debug, Args)]
pub struct TrainArgs {
    /// Folder of clips made by `dynaskin simulate`.
    #[arg(long)]
    data: PathBuf,
    /// What to train.
    #[arg(long, value_parser = method, default_value = "dynaskin")]
    method: Method,
    /// The body GLB that the clips were simulated on.
    #[arg(long)]
    body: PathBuf,
    /// Folder to write the bundle into.
    #[arg(long)]
    out: PathBuf,
    /// Folder of the training state; `checkpoint` in the output folder unless given.
    #[arg(long)]
    checkpoint: Option<PathBuf>,
    /// Go on with the run whose state is in the checkpoint folder.
    #[arg(long)]
    resume: bool,
    /// Forget the run whose state is in the checkpoint folder, and begin anew.
    #[arg(long, conflicts_with = "resume")]
    restart: bool,
    /// What is held out, as JSON; the project's own split unless given.
    #[arg(long)]
    split: Option<PathBuf>,
    /// Seed of everything random.
    #[arg(long, default_value_t = TrainConfig::default().seed)]
    seed: u64,
    /// What to train on: cpu, cuda or vulkan; the latter two need the cargo feature of that name.
    #[arg(long, value_parser = compute, default_value = "cpu")]
    device: Compute,
    /// Passes over the training set; as many as the method usually takes unless given.
    #[arg(long)]
    epochs: Option<usize>,
    /// End the training of a network once so many epochs in a row were no better than one before on
    /// the validation clips; 0 goes through all epochs. What the method usually has unless given.
    #[arg(long, value_name = "EPOCHS")]
    patience: Option<usize>,
    /// Width of the encoding.
    #[arg(long, default_value_t = TrainConfig::default().encoding)]
    encoding: usize,
    /// Damped springs.
    #[arg(long, default_value_t = TrainConfig::default().springs)]
    springs: usize,
    /// Cells of the LSTM.
    #[arg(long, default_value_t = TrainConfig::default().hidden)]
    hidden: usize,
    /// Principal components; as many as the method usually has unless given.
    #[arg(long)]
    components: Option<usize>,
    /// Frames a window of back-propagation through time.
    #[arg(long, default_value_t = TrainConfig::default().window)]
    window: usize,
    /// Sequences side by side in a batch.
    #[arg(long, default_value_t = TrainConfig::default().lanes)]
    lanes: usize,
    /// Peak of the learning rate; what the method usually has unless given.
    #[arg(long)]
    learning_rate: Option<f64>,
    /// AdamW's weight decay.
    #[arg(long, default_value_t = TrainConfig::default().weight_decay)]
    weight_decay: f32,
    /// How much the change of the error from tick to tick counts beside the error.
    #[arg(long, default_value_t = TrainConfig::default().velocity_weight)]
    velocity_weight: f32,
    /// How loud the shape coefficients are beside the thickness of the tissue.
    #[arg(long, default_value_t = TrainConfig::default().shape_loudness)]
    shape_loudness: f32,
    /// The body is in another folder already: do not write it.
    #[arg(long)]
    without_body: bool,
    /// Let every spring hear every joint.
    #[arg(long)]
    global: bool,
    /// Do not learn from mirror images.
    #[arg(long)]
    no_mirror: bool,
    #[command(flatten)]
    paper: PaperArgs,
    #[command(flatten)]
    dsnet: DsnetArgs,
    #[command(flatten)]
    casas_otaduy: CasasOtaduyArgs,
}

/// Settings that the methods of the papers share.
#[derive(Debug, Args)]
#[command(next_help_heading = "Methods of the papers")]
struct PaperArgs {
    /// The sizes of the paper, which are not made for two cores.
    #[arg(long)]
    published_size: bool,
    /// Passes of the autoencoder's training.
    #[arg(long)]
    autoencoder_epochs: Option<usize>,
    /// Frames of each of these passes, drawn from the training set.
    #[arg(long)]
    autoencoder_frames: Option<usize>,
    /// Peak of the autoencoder's learning rate.
    #[arg(long)]
    autoencoder_learning_rate: Option<f64>,
}

fn compute(name: &str) -> Result<Compute, String> {
    Compute::from_name(name).ok_or_else(|| {
        let names = Compute::ALL.map(Compute::name);
        format!("no such device; there are {}", names.join(", "))
    })
}

fn method(name: &str) -> Result<Method, String> {
    Method::from_name(name).ok_or_else(|| {
        let names = Method::ALL.map(Method::name);
        format!("no such method; there are {}", names.join(", "))
    })
}

impl TrainArgs {
    fn checkpoint_folder(&self) -> PathBuf {
        let folder = self.checkpoint.clone();
        folder.unwrap_or_else(|| self.out.join("checkpoint"))
    }

    fn refuse_to_overwrite(&self, holds_run: bool) -> anyhow::Result<()> {
        if holds_run && !self.resume && !self.restart {
            bail!(
                "{} holds an earlier run: --resume goes on with it, --restart forgets it",
                self.checkpoint_folder().display()
            );
        }
        Ok(())
    }

    /// Refuses settings of training by epochs for a method that is fitted at once.
    fn refuse_epochs(&self) -> anyhow::Result<()> {
        let given = [
            ("--epochs", self.epochs.is_some()),
            ("--patience", self.patience.is_some()),
            ("--learning-rate", self.learning_rate.is_some()),
            ("--resume", self.resume),
            ("--device", self.device != Compute::Cpu),
        ];
        let given = given.into_iter().filter(|(_, given)| *given);
        let names: Vec<&str> = given.map(|(name, _)| name).collect();
        if !names.is_empty() {
            bail!(
                "{} is fitted at once, on the processor: leave out {}",
                self.method.name(),
                names.join(", ")
            );
        }
        Ok(())
    }

    fn config(&self) -> TrainConfig {
        TrainConfig {
            seed: self.seed,
            epochs: self.epochs.unwrap_or(TrainConfig::default().epochs),
            patience_epochs: self
                .patience
                .unwrap_or(TrainConfig::default().patience_epochs),
            encoding: self.encoding,
            springs: self.springs,
            hidden: self.hidden,
            components: self.components.unwrap_or(TrainConfig::default().components),
            window: self.window,
            lanes: self.lanes,
            learning_rate: self
                .learning_rate
                .unwrap_or(TrainConfig::default().learning_rate),
            weight_decay: self.weight_decay,
            velocity_weight: self.velocity_weight,
            shape_loudness: self.shape_loudness,
            local: !self.global,
            mirror: !self.no_mirror,
            ..TrainConfig::default()
        }
    }
}

/// Runs `dynaskin train`.
pub fn run(args: &TrainArgs) -> anyhow::Result<()> {
    let split = match &args.split {
        Some(path) => Split::read(path)?,
        None => Split::default(),
    };
    let (body, body_glb) = read_body(&args.body)?;
    let body_sha256 = BundleFile::of("body.glb", &body_glb).sha256;
    let data_set = DataSet::open(&args.data, &body_sha256, &split)?;
    say(&listing(&data_set));

    let input = TrainingInput {
        data_set: &data_set,
        body: &body,
        seed: args.seed,
        compute: args.device,
    };
    // A device that is not there should not be found missing after all clips are read.
    args.device.device()?;
    let (networks, minutes) = match args.method {
        Method::Dynaskin => dynaskin::train(args, input)?,
        Method::SpringBones => {
            args.refuse_epochs()?;
            timed(|progress| train_spring_bones(input, &SpringBonesConfig::default(), progress))?
        }
        Method::Dmpl => {
            args.refuse_epochs()?;
            let config = DmplConfig {
                seed: args.seed,
                components: args.components.unwrap_or(DmplConfig::default().components),
                mirror: !args.no_mirror,
                ..DmplConfig::default()
            };
            timed(|progress| train_dmpl(input, &config, progress))?
        }
        Method::Dsnet | Method::DsnetRbf => dsnet::train(args, input)?,
        Method::CasasOtaduy | Method::CasasOtaduyUnweighted => {
            let folder = RunFolder {
                path: &args.checkpoint_folder(),
                data: &data_set.fingerprint(),
                resume: args.resume,
            };
            args.refuse_to_overwrite(folder.holds_run())?;
            let common = casas_otaduy::Common {
                epochs: args.epochs,
                patience_epochs: args.patience,
                learning_rate: args.learning_rate,
                paper: &args.paper,
                weighted: args.method == Method::CasasOtaduy,
                folder,
                out: &args.out,
            };
            casas_otaduy::train(&args.casas_otaduy, input, common)?
        }
    };

    let facts = facts(
        &data_set,
        &networks,
        split,
        (args.method, args.seed, minutes),
    );
    let parts = BundleParts {
        name: &body.name,
        body_glb: &body_glb,
        with_body: !args.without_body,
        networks: &networks,
        vertices: &data_set.vertices,
        training: &facts,
    };
    let mut player = Player::new(
        networks.feature_kind,
        &networks.predictor_onnx,
        &networks.decoder_onnx,
    )?;
    let report = measure(&mut player, &data_set, &body)?;
    write_bundle(&args.out, &parts, &report)?;
    say(&summary(&report));
    say(&format!("bundle written to {}", args.out.display()));
    Ok(())
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

/// A body and its file.
pub(in crate::commands) fn read_body(path: &Path) -> anyhow::Result<(BodyModel, Vec<u8>)> {
    let bytes =
        fs::read(path).with_context(|| format!("cannot read the body {}", path.display()))?;
    let body = BodyModel::from_glb(&bytes)
        .with_context(|| format!("cannot use the body {}", path.display()))?;
    Ok((body, bytes))
}

/// Plays the held-out clips and measures.
pub(in crate::commands) fn measure(
    player: &mut Player,
    data_set: &DataSet,
    body: &BodyModel,
) -> anyhow::Result<Report> {
    let bar = clip_bar("playing held-out clips");
    let report = evaluate(player, data_set, body, |done, all| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
    })?;
    bar.finish_and_clear();
    Ok(report)
}

fn listing(data_set: &DataSet) -> String {
    let sets = [Set::Training, Set::Validation]
        .into_iter()
        .chain(Set::TEST);
    let mut text = format!(
        "{}: {} clips over {} vertices",
        data_set.dir.display(),
        data_set.clips.len(),
        data_set.vertices.len()
    );
    for set in sets {
        let clips = || data_set.of_set(set, Tissue::Any);
        let frames: usize = clips().map(|clip| clip.frames).sum();
        let varied = clips().filter(|clip| !clip.usual_tissue).count();
        let clips = clips().count();
        text.push_str(&format!(
            "\n  {:24} {clips:4} clips {frames:7} frames ({varied} clips with varied tissue)",
            set.name()
        ));
    }
    text
}

fn epoch_line(epoch: &EpochRecord, epochs: usize, seen: usize, elapsed: Duration) -> String {
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

/// A report as lines of text.
pub(in crate::commands) fn summary(report: &Report) -> String {
    let mut text = String::from(
        "set                      region       static mm  error mm  floor mm  error/static",
    );
    for set in &report.sets {
        let soft = ("all soft".to_owned(), set.soft);
        for (index, (region, errors)) in std::iter::once(&soft).chain(&set.regions).enumerate() {
            let name = if index == 0 { set.set.name() } else { "" };
            text.push_str(&format!(
                "\n{name:24} {region:12} {:9.2} {:9.2} {:>9} {:13.3}",
                errors.static_mm,
                errors.error_mm,
                errors
                    .floor_mm
                    .map_or("-".to_owned(), |mm| format!("{mm:.2}")),
                errors.ratio
            ));
        }
    }
    if let Some(ratio) = report.unseen_motion_ratio() {
        text.push_str(&format!(
            "\nmotions not trained on: error / static {ratio:.3}"
        ));
    }
    text.push_str(&format!(
        "\nafter ten seconds at rest: {:.5} mm",
        report.rest_after_ten_seconds_mm
    ));
    text
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
