//! One module per subcommand.

pub mod body;
pub mod evaluate;
pub mod fit;
pub mod fit_check;
mod motion_files;
pub mod simulate;
pub mod train;
pub use std::io::Write as _;

/// Prints a line of results to standard output (progress goes to standard error). A reader that
/// closed the pipe, such as `head`, is no reason to stop.
fn say(line: &str) {
    let _ = writeln!(std::io::stdout(), "{line}");
}
