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
    /// Simulate soft tissue under motions: training data.
    Simulate(commands::simulate::SimulateArgs),
}

fn main() -> anyhow::Result<()> {
    match Cli::parse().command {
        Command::Simulate(args) => commands::simulate::run(&args),
    }
}
