//! What the operating system says of files, in words for people.

use std::io::{Error, ErrorKind};

/// Why the operating system refused, and what to do. What is not known by its kind stays as the system says it.
pub fn reason(error: &Error) -> String {
    let known = match error.kind() {
        ErrorKind::NotFound => {
            "there is no such file or folder; check the path, and from which folder the command runs"
        }
        ErrorKind::PermissionDenied => {
            "you may not read or write it; change its permissions, or choose another place"
        }
        ErrorKind::AlreadyExists => "there is a file of that name already; choose another name",
        ErrorKind::IsADirectory => "it is a folder, and a file is needed",
        ErrorKind::NotADirectory => "a file stands where a folder is needed; choose another place",
        ErrorKind::StorageFull => {
            "the disk is full; free some space, and give the same command again"
        }
        ErrorKind::QuotaExceeded => {
            "no more space is given to you on this disk; free some, and give the same command again"
        }
        ErrorKind::ReadOnlyFilesystem => "nothing can be written there; choose another place",
        ErrorKind::InvalidFilename => "its name is too long or not one of the file system's",
        // What reading as text gives for other bytes.
        ErrorKind::InvalidData if error.to_string().contains("valid UTF-8") => {
            "it is no text, and a text file is needed"
        }
        _ => return error.to_string(),
    };
    known.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_refusals_are_plain_and_others_stay() {
        for (kind, words) in [
            (ErrorKind::NotFound, "no such file"),
            (ErrorKind::StorageFull, "the disk is full"),
            (ErrorKind::IsADirectory, "it is a folder"),
        ] {
            let text = reason(&Error::from(kind));
            assert!(text.contains(words), "{text}");
        }
        let other = Error::other("the cable is out");
        assert_eq!(reason(&other), "the cable is out");
    }
}
