//! `dynaskin train`: from simulated clips to a measured bundle.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context as _, bail};
use clap::Args;
use dynaskin_body::BodyModel;
use dynaskin_runtime::BundleFile;
use dynaskin_runtime::features::FeatureKind;
use dynaskin_train::{
    BundleParts, Checkpoint, DataSet, DmplConfig, EpochRecord, Method, Networks, Player, Precision,
    Predictor, Prepared, Report, Set, Split, SpringBonesConfig, Tissue, TrainConfig, TrainError,
    TrainingFacts, TrainingInput, decoder_onnx, evaluate, predictor_onnx, prepare, train,
    train_dmpl, train_spring_bones, write_bundle,
};
use indicatif::{ProgressBar, ProgressStyle};

use super::say;
use super::train_dsnet::DsnetArgs;

/// Arguments of `dynaskin train`.
#[derive(Debug, Args)]
pub struct TrainArgs {
    /// Folder of clips made by `dynaskin simulate`.
    #[arg(long)]
    data: PathBuf,
    /// What to train.
    #[arg(long, value_parser = method, default_value = "dynaskin")]
    pub(super) method: Method,
    /// The body GLB that the clips were simulated on.
    #[arg(long)]
    body: PathBuf,
    /// Folder to write the bundle into.
    #[arg(long)]
    pub(super) out: PathBuf,
    /// Folder of the training state; `checkpoint` in the output folder unless given.
    #[arg(long)]
    pub(super) checkpoint: Option<PathBuf>,
    /// Go on with the run whose state is in the checkpoint folder.
    #[arg(long)]
    pub(super) resume: bool,
    /// Forget the run whose state is in the checkpoint folder, and begin anew.
    #[arg(long, conflicts_with = "resume")]
    pub(super) restart: bool,
    /// What is held out, as JSON; the project's own split unless given.
    #[arg(long)]
    split: Option<PathBuf>,
    /// Seed of everything random.
    #[arg(long, default_value_t = TrainConfig::default().seed)]
    seed: u64,
    /// Passes over the training set.
    #[arg(long, default_value_t = TrainConfig::default().epochs)]
    epochs: usize,
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
    /// Peak of the learning rate.
    #[arg(long, default_value_t = TrainConfig::default().learning_rate)]
    learning_rate: f64,
    /// AdamW's weight decay.
    #[arg(long, default_value_t = TrainConfig::default().weight_decay)]
    weight_decay: f32,
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
    pub(super) dsnet: DsnetArgs,
}

fn method(name: &str) -> Result<Method, String> {
    Method::from_name(name).ok_or_else(|| {
        let names = Method::ALL.map(Method::name);
        format!("no such method; there are {}", names.join(", "))
    })
}

impl TrainArgs {
    fn config(&self) -> TrainConfig {
        TrainConfig {
            seed: self.seed,
            epochs: self.epochs,
            encoding: self.encoding,
            springs: self.springs,
            hidden: self.hidden,
            components: self.components.unwrap_or(TrainConfig::default().components),
            window: self.window,
            lanes: self.lanes,
            learning_rate: self.learning_rate,
            weight_decay: self.weight_decay,
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
    };
    let (networks, minutes) = match args.method {
        Method::Dynaskin => train_dynaskin(args, input)?,
        Method::SpringBones => {
            timed(|progress| train_spring_bones(input, &SpringBonesConfig::default(), progress))?
        }
        Method::Dmpl => {
            let config = DmplConfig {
                seed: args.seed,
                components: args.components.unwrap_or(DmplConfig::default().components),
                mirror: !args.no_mirror,
                ..DmplConfig::default()
            };
            timed(|progress| train_dmpl(input, &config, progress))?
        }
        Method::Dsnet | Method::DsnetRbf => super::train_dsnet::train(args, input)?,
        other => bail!("{} cannot be trained yet", other.label()),
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

/// Trains our networks; gives the minutes it took, earlier runs of the checkpoint among them.
fn train_dynaskin(args: &TrainArgs, input: TrainingInput<'_>) -> anyhow::Result<(Networks, f64)> {
    let config = args.config();
    config.check()?;
    let folder = args.checkpoint.clone();
    let folder = folder.unwrap_or_else(|| args.out.join("checkpoint"));
    let checkpoint = Checkpoint::new(&folder)?;
    if checkpoint.holds_run() && !args.resume && !args.restart {
        bail!(
            "{} holds an earlier run: --resume goes on with it, --restart forgets it",
            folder.display()
        );
    }

    let bar = clip_bar("reading clips");
    let prepared = prepare(input.data_set, input.body, &config, |done, all| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
    })?;
    bar.finish_and_clear();

    let start = Instant::now();
    let mut epochs_seen = 0;
    let (predictor, best) = train(&prepared.data, &config, &checkpoint, args.resume, |epoch| {
        epochs_seen += 1;
        say(&epoch_line(
            epoch,
            config.epochs,
            epochs_seen,
            start.elapsed(),
        ));
    })?;
    let networks = dynaskin_networks(&prepared, &predictor, &config, best.epoch)?;
    Ok((networks, checkpoint.seconds()? / 60.0))
}

/// The trained parts as files of the contract.
fn dynaskin_networks(
    prepared: &Prepared,
    predictor: &Predictor,
    config: &TrainConfig,
    best_epoch: usize,
) -> anyhow::Result<Networks> {
    Ok(Networks {
        feature_kind: FeatureKind::InertialMaterials,
        predictor_onnx: predictor_onnx(
            predictor,
            &prepared.normaliser,
            &prepared.data.deviation_m,
            Precision::Half,
        )?,
        decoder_onnx: decoder_onnx(&prepared.basis, Precision::Half)?,
        latent_count: prepared.basis.components(),
        parameters: predictor.weight_count() + prepared.basis.weight_count(),
        description: config.description(),
        config: serde_json::to_value(config)?,
        best_epoch,
    })
}

/// A body and its file.
pub(super) fn read_body(path: &Path) -> anyhow::Result<(BodyModel, Vec<u8>)> {
    let bytes =
        fs::read(path).with_context(|| format!("cannot read the body {}", path.display()))?;
    let body = BodyModel::from_glb(&bytes)
        .with_context(|| format!("cannot use the body {}", path.display()))?;
    Ok((body, bytes))
}

/// Plays the held-out clips and measures.
pub(super) fn measure(
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

/// What a bundle tells of its training; the last three are of the run.
fn facts(
    data_set: &DataSet,
    networks: &Networks,
    split: Split,
    (method, seed, minutes): (Method, u64, f64),
) -> TrainingFacts {
    let tissue = Tissue::known_to(networks.feature_kind);
    let training = || data_set.of_set(Set::Training, tissue);
    let captured = training()
        .filter(|clip| clip.name.subject.is_some())
        .count();
    let varied = training().filter(|clip| !clip.usual_tissue).count();
    let shapes: BTreeSet<&str> = training().map(|clip| clip.name.shape.as_str()).collect();
    let kinds: BTreeSet<&str> = training()
        .filter(|clip| clip.name.subject.is_none())
        .map(|clip| clip.name.trial.as_str())
        .collect();
    let formula = if kinds.is_empty() {
        String::new()
    } else {
        let kinds: Vec<&str> = kinds.into_iter().collect();
        format!(
            " and {} clips of motions made by formula ({})",
            training().count() - captured,
            kinds.join(", ")
        )
    };
    let longest = training().map(|clip| clip.frames).max().unwrap_or(0) as f64 / 60.0;
    TrainingFacts {
        method,
        networks: networks.description.clone(),
        data: format!(
            "Soft tissue simulated by `dynaskin simulate` on {} body shapes: {captured} clips of \
             CMU motion captures (mocap.cs.cmu.edu){formula}, each at most {longest:.1} seconds; \
             {varied} of them with tissue of other stiffness and damping.",
            shapes.len()
        ),
        seed,
        clips: training().count(),
        frames: training().map(|clip| clip.frames).sum(),
        validation_frames: data_set
            .of_set(Set::Validation, tissue)
            .map(|clip| clip.frames)
            .sum(),
        vertices: data_set.vertices.len(),
        parameters: networks.parameters,
        best_epoch: networks.best_epoch,
        minutes,
        config: networks.config.clone(),
        split,
        simulator: simulator(&data_set.sim_json),
    }
}

/// What all clips of a data set share of how they were simulated: not the body shape.
fn simulator(sim_json: &str) -> serde_json::Value {
    let mut simulator: serde_json::Value = serde_json::from_str(sim_json).unwrap_or_default();
    if let Some(fields) = simulator.as_object_mut() {
        fields.remove("shape");
    }
    simulator
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
        epoch.training_loss_mm,
        epoch.validation_loss_mm,
        epoch.validation_ratio,
        epoch.seconds,
        left / 60.0
    )
}

/// A report as lines of text.
pub(super) fn summary(report: &Report) -> String {
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
