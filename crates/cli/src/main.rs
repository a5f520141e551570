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
}

fn main() -> anyhow::Result<()> {
    match Cli::parse().command {
        Command::Body(command) => commands::body::run(&command),
    }
}
