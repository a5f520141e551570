//! `dynaskin reproduce`: a figure or table of the papers from models and clips of one's own, beside what the
//! paper has.

mod autoencoder;
mod leave_one_out;
mod one_leg_hop;
mod sequences;
mod sizes;

use std::path::PathBuf;

use anyhow::{Context as _, bail};
use clap::{Args, ValueEnum};
use dynaskin_body::BodyModel;
use dynaskin_evaluate::study::{ClipCurves, Contestant, curves};
use dynaskin_evaluate::{Method, Player};
use dynaskin_motion::MODEL_RATE_HZ;
use dynaskin_report::{Curve, Plot, Report, Table};
use dynaskin_runtime::{Bundle, BundleFile};
use dynaskin_train::{ClipEntry, DataSet, Set, Split};
use indicatif::ProgressBar;

use super::evaluate::bundles::{load, stored_split};
use super::evaluate::subject::thousands;
use super::say;
use super::train::{clip_bar, read_body};

const EXAMPLES: &str = "\
Examples:
  dynaskin reproduce dsnet-fig8 --model models/female/methods/dsnet --body models/female/body.glb \\
    --data data/female --out dsnet-fig8.html
  dynaskin reproduce casas-fig7 --model my-casas --data my-fits/clips --out casas-fig7.html
  dynaskin reproduce casas-fig5 --subspaces my-casas/subspaces.csv --out casas-fig5.html
  dynaskin reproduce dsnet-table1 --data my-fits/clips --body my-body/body.glb --out dsnet-table1.html
  dynaskin reproduce parameters --model my-casas --model my-dsnet --out parameters.html";

/// Arguments of `dynaskin reproduce`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct ReproduceArgs {
    /// The figure or table. DSNet is Seo, Zou, Cordier (2021), Casas is Casas & Otaduy (2018).
    #[arg(value_enum)]
    figure: Figure,
    /// Folder of a bundle of the paper's method; may be given several times.
    #[arg(long)]
    model: Vec<PathBuf>,
    /// Folder of clips of the models' body, simulated or fitted to captures.
    #[arg(long)]
    data: Option<PathBuf>,
    /// The body GLB, where it is not in the first bundle's folder.
    #[arg(long)]
    body: Option<PathBuf>,
    /// The held-out clip to show instead of the longest of its motion; for dsnet-fig8.
    #[arg(long)]
    clip: Option<String>,
    /// What `dynaskin train casas-otaduy --compare-subspaces CLIP` wrote; for casas-fig5.
    #[arg(long)]
    subspaces: Option<PathBuf>,
    /// The HTML page to write.
    #[arg(long)]
    out: PathBuf,
}

/// What is in the papers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Figure {
    /// DSNet's error frame by frame in a hop on one leg that was left out. Needs --model of dsnet or dsnet-rbf,
    /// and --data.
    DsnetFig8,
    /// People, motions and sequences of the data. Needs --data and --body, or --data and --model.
    DsnetTable1,
    /// What autoencoder and principal components leave of a sequence that was left out. Needs --subspaces.
    CasasFig5,
    /// Casas & Otaduy's error and that of plain skinning in three motions that were left out. Needs --model of
    /// casas-otaduy or casas-otaduy-unweighted, and --data.
    CasasFig7,
    /// Weights of the papers' networks: as published, with the usual sizes of this project, and of the given
    /// models. Takes --model.
    Parameters,
}

impl Figure {
    fn name(self) -> String {
        let value = self.to_possible_value();
        value.map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// The methods whose bundles it shows.
    fn methods(self) -> &'static [Method] {
        match self {
            Self::DsnetFig8 => &[Method::Dsnet, Method::DsnetRbf],
            Self::CasasFig7 => &[Method::CasasOtaduy, Method::CasasOtaduyUnweighted],
            Self::Parameters | Self::DsnetTable1 | Self::CasasFig5 => &Method::ALL,
        }
    }
}

/// A bundle that is shown.
struct Shown {
    label: String,
    method: Option<Method>,
    bundle: Bundle,
}

/// Models and clips of a figure.
struct Stage {
    data_set: DataSet,
    body: BodyModel,
    /// Plain skinning, then the models in their order.
    contestants: Vec<Contestant>,
    bar: ProgressBar,
}

/// Runs the command.
pub fn run(args: &ReproduceArgs) -> anyhow::Result<()> {
    refuse_unused(args)?;
    // Before the minutes that large networks play.
    dynaskin_files::check_place(&args.out)?;
    let (shown, players) = models(args)?;
    let stage = || Stage::open(args, &shown, players);
    let mut report = match args.figure {
        Figure::CasasFig5 => {
            autoencoder::page(needed(args, args.subspaces.as_deref(), "--subspaces FILE")?)?
        }
        Figure::Parameters => Report::new("Weights of the papers' networks"),
        Figure::DsnetTable1 => sequences::page(&stage()?.data_set),
        Figure::DsnetFig8 => one_leg_hop::page(&mut stage()?, args.clip.as_deref())?,
        Figure::CasasFig7 => leave_one_out::page(&mut stage()?)?,
    };
    if args.figure != Figure::DsnetTable1 {
        if !shown.is_empty() {
            training_section(&mut report, &shown);
        }
        sizes::section(&mut report, &shown)?;
    }
    report.write(&args.out)?;
    say(&format!(
        "{} written to {}",
        args.figure.name(),
        args.out.display()
    ));
    Ok(())
}

/// Refuses options that the figure has no use for.
fn refuse_unused(args: &ReproduceArgs) -> anyhow::Result<()> {
    let figure = args.figure;
    let plays = matches!(
        figure,
        Figure::DsnetFig8 | Figure::DsnetTable1 | Figure::CasasFig7
    );
    for (is_given, is_used, option) in [
        (args.data.is_some(), plays, "--data"),
        (args.body.is_some(), plays, "--body"),
        (args.clip.is_some(), figure == Figure::DsnetFig8, "--clip"),
        (
            args.subspaces.is_some(),
            figure == Figure::CasasFig5,
            "--subspaces",
        ),
    ] {
        if is_given && !is_used {
            bail!("{} has no use for {option}; leave it out", figure.name());
        }
    }
    Ok(())
}

fn needed<T>(args: &ReproduceArgs, given: Option<T>, option: &str) -> anyhow::Result<T> {
    let figure = args.figure.name();
    given.with_context(|| format!("{figure} needs {option}; see dynaskin reproduce --help"))
}

/// The bundles, whose methods have to be the figure's, and their networks.
fn models(args: &ReproduceArgs) -> anyhow::Result<(Vec<Shown>, Vec<Player>)> {
    let methods = args.figure.methods();
    if methods.len() < Method::ALL.len() {
        needed(args, args.model.first(), "--model FOLDER")?;
    }
    let (mut shown, mut players) = (Vec::new(), Vec::new());
    for folder in &args.model {
        let (player, bundle) = load(folder)?;
        let told = bundle.training.get("method").and_then(|name| name.as_str());
        let method = told.and_then(Method::from_name);
        if !method.is_some_and(|method| methods.contains(&method)) {
            let wanted: Vec<&str> = methods.iter().map(|method| method.name()).collect();
            bail!(
                "{} is a bundle of {}; {} shows {}",
                folder.display(),
                told.unwrap_or("no known method"),
                args.figure.name(),
                wanted.join(" and ")
            );
        }
        let name = method.map_or("", Method::label);
        let twice = shown.iter().any(|other: &Shown| other.label == name);
        let label = match twice {
            true => format!("{name} ({})", folder.display()),
            false => name.to_owned(),
        };
        shown.push(Shown {
            label,
            method,
            bundle,
        });
        players.push(player);
    }
    Ok((shown, players))
}

impl Stage {
    fn open(args: &ReproduceArgs, shown: &[Shown], players: Vec<Player>) -> anyhow::Result<Self> {
        let data = needed(args, args.data.as_ref(), "--data FOLDER")?;
        let own = args.model.first().zip(shown.first());
        let own = own.map(|(folder, first)| folder.join(&first.bundle.body.file));
        let path = needed(args, args.body.clone().or(own), "--body FILE")?;
        let (body, body_glb) = read_body(&path)?;
        let sha256 = BundleFile::of("body.glb", &body_glb).sha256;
        let split = match shown.first() {
            Some(first) => stored_split(&first.bundle)?,
            None => Split::default(),
        };
        let data_set = DataSet::open(data, &sha256, &split)?;
        for one in shown {
            one.bundle.body.verify(&body_glb)?;
            if one.bundle.vertices != data_set.vertices {
                bail!(
                    "{} has offsets over other vertices than {}",
                    data.display(),
                    one.label
                );
            }
            if stored_split(&one.bundle)? != split {
                bail!(
                    "{} was trained with another split than {}: it may know what is held out",
                    one.label,
                    shown.first().map_or("", |first| first.label.as_str())
                );
            }
        }
        let labels = shown.iter().map(|one| one.label.clone());
        let mut contestants = vec![Contestant::still()];
        contestants.extend(labels.zip(players).map(|(label, player)| Contestant {
            label,
            player: Some(player),
        }));
        Ok(Self {
            data_set,
            body,
            contestants,
            bar: ProgressBar::hidden(),
        })
    }

    /// The longest clip of a motion that was not learned from, or at least not of its person; or the clip that is
    /// named.
    fn held_out(&self, trials: &[&str], name: Option<&str>) -> Option<&ClipEntry> {
        let stem = |clip: &ClipEntry| {
            let stem = clip.path.file_stem().unwrap_or_default();
            stem.to_string_lossy().into_owned()
        };
        let clips = self.data_set.clips.iter();
        clips
            .filter(|clip| clip.usual_tissue && Set::TEST.contains(&clip.set))
            .filter(|clip| match name {
                Some(name) => stem(clip) == name,
                None => trials.contains(&clip.name.trial.as_str()),
            })
            // Of equally long ones the first, so that a page can be made again.
            .min_by_key(|clip| {
                let is_known = clip.set == Set::UnseenShape;
                (is_known, std::cmp::Reverse(clip.frames), stem(clip))
            })
    }

    /// Shows progress, of so many clips that will be played to all contestants.
    fn begin(&mut self, clips: usize) {
        let plays = clips * self.contestants.len();
        self.bar = clip_bar("playing held-out clips");
        self.bar.set_length(plays as u64);
    }

    fn curves(&mut self, clip: &ClipEntry) -> anyhow::Result<ClipCurves> {
        let played = curves(
            &mut self.contestants,
            &self.data_set,
            &self.body,
            clip,
            || self.bar.inc(1),
        )?;
        if Some(self.bar.position()) >= self.bar.length() {
            self.bar.finish_and_clear();
        }
        Ok(played)
    }

    /// A plot of the mean error over a group of vertices, by [`group_names`].
    fn plot(&self, title: String, curves: &ClipCurves, group: usize) -> Plot {
        let lines = self.contestants.iter().enumerate();
        let lines = lines.map(|(method, contestant)| Curve {
            name: match method {
                0 => "plain skinning".to_owned(),
                _ => contestant.label.clone(),
            },
            points: curves
                .of_group_mm(method, group)
                .into_iter()
                .enumerate()
                .map(|(frame, mm)| (frame as f64 / MODEL_RATE_HZ, mm))
                .collect(),
        });
        Plot {
            title,
            x_label: "time (s)".into(),
            y_label: "mean error (mm)".into(),
            curves: lines.collect(),
        }
    }
}

/// Mean and standard deviation over frames.
fn spread(values: &[f64]) -> [f64; 2] {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let square = values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count;
    [mean, square.sqrt()]
}

/// What is other than in the paper, whatever the figure: `rows` of a paper's side and ours.
fn differences(report: &mut Report, rows: &[[&str; 3]]) {
    report.section("What differs");
    let mut table = Table::new(["", "in the paper", "here"]);
    for row in rows {
        table.row(row.map(str::to_owned).to_vec());
    }
    report.table(&table);
}

/// What the shown bundles learned from.
fn training_section(report: &mut Report, shown: &[Shown]) {
    report.section("How the models here were trained");
    let mut table = Table::new(["model", "clips", "frames", "minutes", "data"]);
    for one in shown {
        let told = |what: &str| one.bundle.training.get(what);
        let number = |what: &str| told(what).and_then(|x| x.as_f64());
        let whole = |what| number(what).map_or_else(String::new, |x| thousands(x as u64));
        table.row(vec![
            one.label.clone(),
            whole("clips"),
            whole("frames"),
            number("minutes").map_or_else(String::new, |x| format!("{x:.0}")),
            told("data")
                .and_then(|x| x.as_str())
                .unwrap_or_default()
                .to_owned(),
        ]);
    }
    report.table(&table);
}
