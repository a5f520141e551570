//! `dynaskin evaluate`: a bundle measured on held-out clips, or many side by side in a report.

pub(super) mod bundles;
mod card;
mod cost;
mod dynamics;
mod groups;
mod motions;
mod page;
mod pictures;
mod places;
mod shapes;
mod simulated;
pub(super) mod subject;
pub(super) mod subspaces;
mod tables;

use std::path::PathBuf;

use anyhow::{Context as _, bail};
use clap::Args;
use dynaskin_body::BodyModel;
use dynaskin_evaluate::{Placement, Player, evaluate_placements};
use dynaskin_runtime::Bundle;
use dynaskin_train::{DataSet, Set, Split, Tissue};

use super::say;
use super::train::{clip_bar, measure, read_body, summary};

const EXAMPLES: &str = "\
Examples:
  dynaskin evaluate --model models/female --data data/female
  dynaskin evaluate --model models/female --data data/female --report report.html --card";

/// Arguments of `dynaskin evaluate`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct EvaluateArgs {
    /// Folder of the bundle.
    #[arg(long)]
    model: PathBuf,
    /// Folder of clips made by `dynaskin simulate` on the bundle's body.
    #[arg(long)]
    data: PathBuf,
    /// The body GLB, if it is not in the bundle's folder.
    #[arg(long)]
    body: Option<PathBuf>,
    /// Play the held-out motions moved by 3 m and 10 m and turned by 90° and 180° instead.
    #[arg(long)]
    moved: bool,
    /// The split that says what is held out, as JSON [default: the one stored in the bundle].
    #[arg(long)]
    split: Option<PathBuf>,
    /// Write an HTML report to this file, and its numbers as CSV files beside it.
    #[arg(long)]
    report: Option<PathBuf>,
    /// Write the report's summary into the model card in the bundle's folder, too.
    #[arg(long, requires = "report")]
    card: bool,
    /// Folder whose subfolders hold bundles to compare with in the report [default: `methods` in the
    /// bundle's folder, if it exists].
    #[arg(long, requires = "report")]
    methods: Option<PathBuf>,
    /// Minutes of the report's continuous motion.
    #[arg(long, requires = "report", default_value_t = 10, value_parser = clap::value_parser!(u16).range(2..=120))]
    minutes: u16,
    /// Leave out the sections of the report that need simulation: other bodies and materials.
    #[arg(long, requires = "report")]
    without_simulation: bool,
    /// Curves of autoencoders and principal components for the report, as `dynaskin train
    /// casas-otaduy --compare-subspaces` writes them [default: `methods/casas-otaduy/subspaces.csv` in the bundle's
    /// folder, if it exists].
    #[arg(long, requires = "report")]
    subspaces: Option<PathBuf>,
    /// Times in wasm for the report: a file such as `artifacts/methods-male.json`, which
    /// `npm run bench:methods male` writes.
    #[arg(long, requires = "report")]
    wasm_times: Option<PathBuf>,
}

/// Runs `dynaskin evaluate`.
pub fn run(args: &EvaluateArgs) -> anyhow::Result<()> {
    let (mut player, bundle) = bundles::load(&args.model)?;
    let own = args.model.join(&bundle.body.file);
    let (body, body_glb) = read_body(args.body.as_ref().unwrap_or(&own))?;
    bundle.body.verify(&body_glb)?;
    let split = split_of(args, &bundle)?;
    let data_set = DataSet::open(&args.data, &bundle.body.sha256, &split)?;
    if data_set.vertices != bundle.vertices {
        bail!(
            "{} has offsets over other vertices than {}: simulate with the settings that the \
             bundle was trained on",
            args.data.display(),
            args.model.display()
        );
    }
    if args.moved {
        return say_moved(&mut player, &data_set, &body);
    }
    let Some(path) = &args.report else {
        let report = measure(&mut player, &data_set, &body)?;
        say(&summary(&report));
        return Ok(());
    };
    // Before the minutes that the report takes.
    dynaskin_files::check_place(path)?;
    let folder = args.methods.clone().or_else(|| {
        let usual = args.model.join("methods");
        usual.is_dir().then_some(usual)
    });
    let mut found = bundles::others(folder.as_deref(), &bundle, &split)?;
    let subspaces = args.subspaces.clone().or_else(|| {
        let usual = folder.as_ref()?.join("casas-otaduy").join("subspaces.csv");
        usual.is_file().then_some(usual)
    });
    found.push(bundles::own(&args.model, player, bundle));
    let subject = subject::Subject {
        data_set: &data_set,
        body: &body,
        minutes: usize::from(args.minutes),
        simulate: !args.without_simulation,
        wasm_times: args.wasm_times.as_deref(),
        subspaces: subspaces.as_deref(),
        card: args.card.then_some(args.model.as_path()),
    };
    page::write(path, &subject, found)?;
    say(&format!("report written to {}", path.display()));
    Ok(())
}

/// Prints errors over static of the held-out motions of the usual tissue, played elsewhere.
fn say_moved(player: &mut Player, data_set: &DataSet, body: &BodyModel) -> anyhow::Result<()> {
    let clips: Vec<_> = data_set.of_set(Set::UnseenMotion, Tissue::Usual).collect();
    let bar = clip_bar("playing held-out motions");
    let clips = clips.into_iter();
    let errors = evaluate_placements(
        player,
        data_set,
        body,
        clips,
        &Placement::ALL,
        |done, all| {
            bar.set_length(all as u64);
            bar.set_position(done as u64);
        },
    )?;
    bar.finish_and_clear();
    say("held-out motions         static mm  error mm  error/static");
    for errors in errors {
        say(&format!(
            "{:24} {:9.2} {:9.2} {:13.3}",
            errors.placement.label(),
            errors.static_mm,
            errors.error_mm,
            errors.ratio
        ));
    }
    Ok(())
}

fn split_of(args: &EvaluateArgs, bundle: &Bundle) -> anyhow::Result<Split> {
    if let Some(path) = &args.split {
        return Ok(Split::read(path)?);
    }
    bundles::stored_split(bundle).with_context(|| {
        format!(
            "{} does not tell what was held out, or not in a way that can be read: give --split",
            args.model.display()
        )
    })
}
