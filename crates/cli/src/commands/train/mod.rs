//! `dynaskin train`: from simulated clips to a measured bundle.

mod args;
mod casas_otaduy;
mod dsnet;
mod dynaskin;
mod facts;
mod fitted;
mod progress;
mod subspaces;

use std::fs;
use std::path::Path;

use anyhow::{Context as _, bail};
use clap::{ArgMatches, Args, Command, FromArgMatches, Subcommand};
use dynaskin_baselines::dsnet::ShapeInput;
use dynaskin_body::{BodyModel, Trait};
use dynaskin_evaluate::{BundleParts, Method, Player, Report, evaluate, write_bundle};
use dynaskin_files::FolderLock;
use dynaskin_runtime::BundleFile;
use dynaskin_train::{Compute, DataSet, Networks, Set, Split, Tissue, TrainingInput};

use super::say;
use args::CommonArgs;
use casas_otaduy::CasasOtaduyArgs;
use dsnet::DsnetArgs;
use dynaskin::DynaskinArgs;
use facts::facts;
use fitted::{DmplArgs, SpringBonesArgs};
pub(in crate::commands) use progress::clip_bar;
pub(in crate::commands) use subspaces::SubspaceRow;

/// What `dynaskin train --help` ends with.
pub const EXAMPLES: &str = "\
Examples:
  dynaskin train --data data/female --body models/female/body.glb --out models/female
  dynaskin train --data data/female --body models/female/body.glb --out models/female --resume
  dynaskin train dmpl --data data/female --body models/female/body.glb --out models/female/methods/dmpl";

/// What to train, and how: `dynaskin train METHOD`, where our own method is meant without a name.
///
/// Each method has a subcommand with its own options, so that an option of another one is refused.
#[derive(Debug, Subcommand)]
pub enum TrainCommand {
    /// Our own networks: what is trained without a method's name.
    Dynaskin(DynaskinArgs),
    /// Damped springs per region, tuned on the training clips.
    SpringBones(SpringBonesArgs),
    /// Principal components and a linear auto-regression, as in Dyna and DMPL.
    Dmpl(DmplArgs),
    /// Casas & Otaduy 2018, with the loss that weighs vertices by their rigidity.
    CasasOtaduy(CasasOtaduyArgs),
    /// The same without those weights.
    CasasOtaduyUnweighted(CasasOtaduyArgs),
    /// DSNet 2021: shape enters at every step.
    Dsnet(DsnetArgs),
    /// Its variant whose radial basis functions set the LSTM's first state from the shape.
    DsnetRbf(DsnetArgs),
}

/// The methods' names, which a usage line shows where none of them was given.
const NAMES: &str =
    "spring-bones|dmpl|casas-otaduy|casas-otaduy-unweighted|dsnet|dsnet-rbf|dynaskin";

/// Arguments of `dynaskin train`: a method's subcommand, or the options of our own.
#[derive(Debug)]
pub struct TrainArgs(TrainCommand);

impl FromArgMatches for TrainArgs {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        Ok(Self(if matches.subcommand_name().is_some() {
            TrainCommand::from_arg_matches(matches)?
        } else {
            TrainCommand::Dynaskin(DynaskinArgs::from_arg_matches(matches)?)
        }))
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl Args for TrainArgs {
    fn augment_args(command: Command) -> Command {
        TrainCommand::augment_subcommands(DynaskinArgs::augment_args(command))
            .subcommand_required(false)
            .arg_required_else_help(false)
            .args_conflicts_with_subcommands(true)
            .subcommand_negates_reqs(true)
            .subcommand_help_heading("Methods")
            .subcommand_value_name(NAMES)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl TrainCommand {
    fn method(&self) -> Method {
        match self {
            Self::Dynaskin(_) => Method::Dynaskin,
            Self::SpringBones(_) => Method::SpringBones,
            Self::Dmpl(_) => Method::Dmpl,
            Self::CasasOtaduy(_) => Method::CasasOtaduy,
            Self::CasasOtaduyUnweighted(_) => Method::CasasOtaduyUnweighted,
            Self::Dsnet(_) => Method::Dsnet,
            Self::DsnetRbf(_) => Method::DsnetRbf,
        }
    }

    fn common(&self) -> &CommonArgs {
        match self {
            Self::Dynaskin(args) => &args.common,
            Self::SpringBones(args) => &args.common,
            Self::Dmpl(args) => &args.common,
            Self::CasasOtaduy(args) | Self::CasasOtaduyUnweighted(args) => &args.common,
            Self::Dsnet(args) | Self::DsnetRbf(args) => &args.common,
        }
    }

    /// What to train on; methods that are fitted at once know the processor only.
    fn device(&self) -> Compute {
        match self {
            Self::Dynaskin(args) => args.epochs.device,
            Self::SpringBones(_) | Self::Dmpl(_) => Compute::Cpu,
            Self::CasasOtaduy(args) | Self::CasasOtaduyUnweighted(args) => args.epochs.device,
            Self::Dsnet(args) | Self::DsnetRbf(args) => args.epochs.device,
        }
    }

    /// Trains; gives the minutes it took, earlier runs of the checkpoint among them.
    fn train(&self, input: TrainingInput<'_>) -> anyhow::Result<(Networks, f64)> {
        match self {
            Self::Dynaskin(args) => dynaskin::train(args, input),
            Self::SpringBones(args) => args.train(input),
            Self::Dmpl(args) => args.train(input),
            Self::CasasOtaduy(args) => casas_otaduy::train(args, true, input),
            Self::CasasOtaduyUnweighted(args) => casas_otaduy::train(args, false, input),
            Self::Dsnet(args) => dsnet::train(args, ShapeInput::EveryStep, input),
            Self::DsnetRbf(args) => dsnet::train(args, ShapeInput::FirstState, input),
        }
    }
}

/// What the body's shapes look like, where `traits.json` lies beside the body.
fn read_traits(body: &Path) -> anyhow::Result<Vec<Trait>> {
    let path = body.with_file_name("traits.json");
    if !path.exists() {
        return Ok(Vec::new());
    }
    let text = fs::read(&path).with_context(|| format!("reading {}", path.display()))?;
    serde_json::from_slice(&text).with_context(|| {
        let remedy =
            "dynaskin body build writes it anew; without it, bundles know no shapes in words";
        format!("{} holds no traits ({remedy})", path.display())
    })
}

/// Runs `dynaskin train`.
pub fn run(TrainArgs(command): &TrainArgs) -> anyhow::Result<()> {
    let common = command.common();
    let (body, body_glb) = read_body(&common.body)?;
    let traits = read_traits(&common.body)?;
    let body_sha256 = BundleFile::of("body.glb", &body_glb).sha256;
    let (data_set, split) = data_set(common, &body_sha256)?;
    say(&listing(&data_set));

    let input = TrainingInput {
        data_set: &data_set,
        body: &body,
        seed: common.seed,
        compute: command.device(),
    };
    // A device that is not there should not be found missing after all clips are read.
    input.compute.device()?;
    // Before hours of training: two runs would leave the files of both in one folder.
    let _lock = FolderLock::take(&common.out)?;
    dynaskin_files::remove_leftovers(&common.out)?;
    let (networks, minutes) = command.train(input)?;

    let facts = facts(
        &data_set,
        &networks,
        split,
        (command.method(), common.seed, minutes),
    );
    let parts = BundleParts {
        name: &body.name,
        body_glb: &body_glb,
        body_copyright: &body.copyright,
        with_body: !common.without_body,
        networks: &networks,
        vertices: &data_set.vertices,
        learned: data_set.learned(networks.feature_kind)?,
        traits: &traits,
        training: &facts,
    };
    let mut player = Player::new(
        networks.feature_kind,
        &networks.predictor_onnx,
        &networks.decoder_onnx,
    )?;
    let report = measure(&mut player, &data_set, &body)?;
    write_bundle(&common.out, &parts, &report)?;
    say(&summary(&report));
    say(&format!("bundle written to {}", common.out.display()));
    Ok(())
}

/// The clips, and what of them is held out.
fn data_set(common: &CommonArgs, body_sha256: &str) -> anyhow::Result<(DataSet, Split)> {
    let split = match &common.split {
        Some(path) => Split::read(path)?,
        None => Split::default(),
    };
    let mut data_set = DataSet::open(&common.data, body_sha256, &split)?;
    if common.hold_out.is_empty() {
        return Ok((data_set, split));
    }
    let names = data_set.clips.iter().map(|clip| &clip.name);
    let split = Split::of_names(names, &common.hold_out, &common.validate_on)?;
    data_set.split_by(&split);
    Ok((data_set, split))
}

/// A body and its file.
pub(in crate::commands) fn read_body(path: &Path) -> anyhow::Result<(BodyModel, Vec<u8>)> {
    let bytes =
        fs::read(path).with_context(|| format!("cannot read the body {}", path.display()))?;
    Ok((glb_body(path, &bytes)?, bytes))
}

/// The body of a file that has been read.
pub(in crate::commands) fn glb_body(path: &Path, bytes: &[u8]) -> anyhow::Result<BodyModel> {
    if !bytes.starts_with(b"glTF") {
        bail!(
            "{} is no GLB file, as bodies are; `dynaskin body import` makes one of a SMPL body in an .npz archive",
            path.display()
        );
    }
    BodyModel::from_glb(bytes).with_context(|| format!("cannot use the body {}", path.display()))
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
