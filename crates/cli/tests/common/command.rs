//! The `dynaskin` command, run in the repository's folder.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The repository's folder.
pub fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Runs the command to its end.
pub fn dynaskin(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_dynaskin"))
        .current_dir(repository())
        .args(arguments)
        .output()
        .unwrap()
}

/// Standard output of a call that has to succeed.
#[allow(dead_code, reason = "not all tests need it")]
pub fn printed(arguments: &[&str]) -> String {
    let output = dynaskin(arguments);
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {error}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Standard error of a call that has to fail, without a panic.
#[allow(dead_code, reason = "not all tests need it")]
pub fn refused(arguments: &[&str]) -> String {
    let output = dynaskin(arguments);
    assert!(!output.status.success(), "{arguments:?} went well");
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!error.contains("panicked"), "{error}");
    error
}
