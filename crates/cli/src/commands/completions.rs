//! `dynaskin completions`: what a shell needs to complete the command.

use clap::Args;
use clap_complete::{Shell, generate};

use super::say;

const WHERE: &str = "Examples:
  dynaskin completions bash > ~/.local/share/bash-completion/completions/dynaskin
  dynaskin completions zsh > ~/.zfunc/_dynaskin
  dynaskin completions fish > ~/.config/fish/completions/dynaskin.fish";

/// Arguments of `dynaskin completions`.
#[derive(Debug, Args)]
#[command(after_help = WHERE)]
pub struct CompletionsArgs {
    /// The shell.
    shell: Shell,
}

/// Runs the command. Printed by way of a buffer: clap_complete panics where it cannot write.
pub fn run(args: &CompletionsArgs, command: &mut clap::Command) {
    let mut script = Vec::new();
    generate(args.shell, command, "dynaskin", &mut script);
    say(String::from_utf8_lossy(&script).trim_end());
}
