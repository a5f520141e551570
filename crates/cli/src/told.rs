//! An error as one sentence, for people who do not know the program's parts.

use std::io;

use dynaskin_files::reason;

/// What went wrong, from the command's view down to the cause. What an error repeats of its cause is said once,
/// and what the operating system says of files in plain words, with what to do.
pub fn sentence(error: &anyhow::Error) -> String {
    let mut text = String::new();
    let mut refusals: Vec<(String, String)> = Vec::new();
    for cause in error.chain() {
        let mut part = cause.to_string();
        if let Some(refusal) = cause.downcast_ref::<io::Error>() {
            refusals.push((part.clone(), reason(refusal)));
            part = reason(refusal);
        }
        let is_said = text.contains(&part) || text.contains(&cause.to_string());
        if !is_said {
            if !text.is_empty() {
                text.push_str(": ");
            }
            text.push_str(&part);
        }
    }
    for (of_system, plain) in refusals {
        text = text.replace(&of_system, &plain);
    }
    text
}

#[cfg(test)]
mod tests {
    use anyhow::Context as _;
    use dynaskin_fit::FitError;

    use super::*;

    fn refused() -> FitError {
        FitError::Io {
            path: "a/b.npz".into(),
            action: "opening",
            source: io::Error::from_raw_os_error(2),
        }
    }

    #[test]
    fn causes_are_said_once_and_in_plain_words() {
        let plain = "a/b.npz: opening failed: there is no such file or folder";
        let error = anyhow::Error::from(refused()).context("the body");
        let text = sentence(&error);
        assert!(text.starts_with(&format!("the body: {plain}")), "{text}");
        assert_eq!(text.matches("no such file").count(), 1, "{text}");
        assert!(!text.contains("os error"), "{text}");
        let read: Result<(), io::Error> = Err(io::Error::from_raw_os_error(2));
        let text = sentence(&read.context("cannot read a.glb").unwrap_err());
        assert!(
            text.starts_with("cannot read a.glb: there is no such file"),
            "{text}"
        );
    }
}
