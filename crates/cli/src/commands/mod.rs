//! One module per subcommand.

pub mod body;
