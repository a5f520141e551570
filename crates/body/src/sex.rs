//! The two default bodies.

/// Which default body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sex {
    /// The female adult.
    Female,
    /// The male adult.
    Male,
}

impl Sex {
    /// Name as it stands in file and folder names.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Female => "female",
            Self::Male => "male",
        }
    }
}
