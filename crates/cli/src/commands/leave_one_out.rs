//! The motions that Casas & Otaduy (2018) leave out one by one (section 4.2), by the names of clips: as this project makes
//! them by formula, and as Dyna and D-FAUST call them.

/// Hops on one leg.
pub const ONE_LEG_HOPS: [&str; 3] = ["one-leg-hop", "one_leg_jump", "one_leg_loose"];
/// Running on the spot.
pub const RUNS_IN_PLACE: [&str; 2] = ["run-in-place", "running_on_spot"];
/// Jumping jacks.
pub const JUMPING_JACKS: [&str; 2] = ["jumping-jacks", "jumping_jacks"];
