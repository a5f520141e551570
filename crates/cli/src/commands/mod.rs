//! One module per subcommand.

pub mod body;
pub mod simulate;
pub mod train;
