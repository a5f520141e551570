//! One module per subcommand.

pub mod avatars;
pub mod bind;
pub mod body;
mod body_import;
pub mod completions;
pub mod evaluate;
pub mod fit;
pub mod fit_all;
pub mod fit_check;
mod leave_one_out;
mod motion_files;
mod numbers;
pub mod play;
pub mod reproduce;
mod shard;
pub mod simulate;
pub mod slim;
pub mod train;
pub use std::io::{ErrorKind, Write as _};
use std::sync::OnceLock;

use anyhow::bail;

/// Why the first line that could not be printed was not.
static UNPRINTED: OnceLock<String> = OnceLock::new();

/// Prints a line of results to standard output (progress goes to standard error). Where that fails,
/// the work goes on, since its files matter more, and [`check_printed`] tells in the end.
fn say(line: &str) {
    if let Err(error) = writeln!(std::io::stdout(), "{line}") {
        // A reader that has seen enough, such as `head`, loses nothing.
        if error.kind() != ErrorKind::BrokenPipe {
            let _ = UNPRINTED.set(error.to_string());
        }
    }
}

/// An error where not all results could be printed: a full disk behind `> results.txt`, for instance.
pub fn check_printed() -> anyhow::Result<()> {
    if let Err(error) = std::io::stdout().flush()
        && error.kind() != ErrorKind::BrokenPipe
    {
        let _ = UNPRINTED.set(error.to_string());
    }
    match UNPRINTED.get() {
        None => Ok(()),
        Some(reason) => bail!("results could not be printed to standard output: {reason}"),
    }
}
