//! The `dynaskin` command.

mod commands;
mod told;

use std::io::Write as _;
use std::process::ExitCode;

use clap::{CommandFactory as _, Parser, Subcommand};

const EXAMPLES: &str = "Examples:
  dynaskin play walk.bvh --body female --weight 80 --out walk.mp4
  dynaskin bind me.vrm --body models/female/body.glb --depicts adult
  dynaskin fit --body models/female/body.glb --scans hop.npz --unit m --rate 60 --out hop_fit.npz
  dynaskin simulate --body models/female/body.glb --out data/female --preset full --mocap captures --plan
  dynaskin train --data data/female --body models/female/body.glb --out models/female
  dynaskin evaluate --model models/female --data data/female --report report.html

Each subcommand has --help. `dynaskin completions SHELL` prints completions for bash, zsh, fish, elvish and PowerShell.";

#[derive(Parser)]
#[command(
    version,
    about = "Bodies, motions and training data for dynaskin",
    after_help = EXAMPLES
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Play a motion on a body, and write the moving skin as a video or as meshes.
    Play(commands::play::PlayArgs),
    /// Make body models.
    #[command(subcommand)]
    Body(commands::body::BodyCommand),
    /// Bind a body's soft tissue to somebody else's avatar.
    Bind(commands::bind::BindArgs),
    /// Make avatars with known soft tissue, to test binding.
    Avatars(commands::avatars::AvatarsArgs),
    /// Simulate soft tissue in motion, as training data.
    Simulate(commands::simulate::SimulateArgs),
    /// Fit a body to a mesh sequence: shape, poses and soft-tissue offsets.
    Fit(commands::fit::FitArgs),
    /// Fit a body to all sequences of several people, side by side, and report on them.
    FitAll(commands::fit_all::FitAllArgs),
    /// Fit simulated sequences with known truth, and print the errors.
    FitCheck(commands::fit_check::FitCheckArgs),
    /// Train the networks of a body on simulated clips and measure them on held-out ones.
    #[command(after_help = commands::train::EXAMPLES)]
    Train(Box<commands::train::TrainArgs>),
    /// Write a bundle's networks as files for `dynaskin/slim`, after a check against tract.
    Slim(commands::slim::SlimArgs),
    /// Measure a bundle on clips that it was not trained on, or compare methods in a report.
    Evaluate(commands::evaluate::EvaluateArgs),
    /// Write a page with a figure or table of the papers, from models and clips of your own.
    Reproduce(commands::reproduce::ReproduceArgs),
    /// Print completions for a shell.
    Completions(commands::completions::CompletionsArgs),
}

fn main() -> ExitCode {
    let Err(error) = run() else {
        return ExitCode::SUCCESS;
    };
    // Nobody may be reading.
    let _ = writeln!(std::io::stderr(), "Error: {}", told::sentence(&error));
    ExitCode::FAILURE
}

fn run() -> anyhow::Result<()> {
    match Cli::parse().command {
        Command::Play(args) => commands::play::run(&args),
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
        Command::Completions(args) => {
            commands::completions::run(&args, &mut Cli::command());
            Ok(())
        }
    }?;
    commands::check_printed()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_has_examples_that_it_takes() {
        let mut cli = Cli::command();
        cli.build();
        let own = cli.get_subcommands().filter(|one| one.get_name() != "help");
        let leaves: Vec<_> = own
            .flat_map(|one| match one.get_name() {
                "body" => one
                    .get_subcommands()
                    .filter(|two| two.get_name() != "help")
                    .collect(),
                _ => vec![one],
            })
            .collect();
        assert!(leaves.len() > 10);
        for command in leaves {
            let name = command.get_name();
            let help = command.get_after_help().map(ToString::to_string);
            let help = help.unwrap_or_default().replace("\\\n", "");
            let examples: Vec<&str> = help
                .lines()
                .filter(|line| line.trim_start().starts_with("dynaskin "))
                .collect();
            assert!(!examples.is_empty(), "{name} has no examples");
            for example in examples {
                // The shell's own parts.
                let words = example.split_whitespace();
                let words = words.take_while(|word| !matches!(*word, ">" | "|"));
                let parsed = Cli::try_parse_from(words);
                assert!(parsed.is_ok(), "{example}: {:?}", parsed.err());
            }
        }
    }
}
