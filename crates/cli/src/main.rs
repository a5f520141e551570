//! The `dynaskin` command.

mod commands;

use clap::{Parser, Subcommand};

#[derive(Parser)]
#[command(version, about = "Bodies, motions and training data for dynaskin")]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Make body models.
    #[command(subcommand)]
    Body(commands::body::BodyCommand),
    /// Bind a body's soft tissue to somebody else's avatar.
    Bind(commands::bind::BindArgs),
    /// Make avatars whose soft tissue is known, to test binding with.
    Avatars(commands::avatars::AvatarsArgs),
    /// Simulate soft tissue under motions: training data.
    Simulate(commands::simulate::SimulateArgs),
    /// Fit a body to a mesh sequence: shape, poses and soft-tissue offsets.
    Fit(commands::fit::FitArgs),
    /// Fit a body to all sequences of several people, side by side, and report on them.
    FitAll(commands::fit_all::FitAllArgs),
    /// Fit simulated sequences, whose truth is known, and print how far off the fits are.
    FitCheck(commands::fit_check::FitCheckArgs),
    /// Train the networks of a body on simulated clips and measure them on held-out ones.
    Train(Box<commands::train::TrainArgs>),
    /// Write a bundle's networks as files that `dynaskin/slim` plays, after a check against tract.
    Slim(commands::slim::SlimArgs),
    /// Measure a bundle, or compare methods in a report, on clips that they were not trained on.
    Evaluate(commands::evaluate::EvaluateArgs),
    /// Write a page with a figure or table of the papers, from models and clips of your own.
    Reproduce(commands::reproduce::ReproduceArgs),
}

fn main() -> anyhow::Result<()> {
    match Cli::parse().command {
        Command::Body(command) => commands::body::run(&command),
        Command::Bind(args) => commands::bind::run(&args),
        Command::Avatars(args) => commands::avatars::run(&args),
        Command::Simulate(args) => commands::simulate::run(&args),
        Command::Fit(args) => commands::fit::run(&args),
        Command::FitAll(args) => commands::fit_all::run(&args),
        Command::FitCheck(args) => commands::fit_check::run(&args),
        Command::Train(args) => commands::train::run(&args),
        Command::Slim(args) => commands::slim::run(&args),
        Command::Evaluate(args) => commands::evaluate::run(&args),
        Command::Reproduce(args) => commands::reproduce::run(&args),
    }?;
    commands::check_printed()
}
