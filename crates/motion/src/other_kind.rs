//! Files that people take for motion files, told by their first bytes, and what to do with each.

/// How many bytes of a text are looked at.
const LOOKED_AT: usize = 2048;

const CONVERT: &str = "convert it to GLB or BVH: Blender and most other programs export both";
const UNPACK: &str = "unpack it, and choose the motion file in it";
const UNPACK_OR_EXPORT: &str = "unpack it, or export GLB or BVH from the program that saved it";
const NO_SKELETON: &str =
    "videos hold no skeleton: a pose estimator such as MediaPipe finds one in them";
const FROM_MARKERS: &str =
    "compute a skeleton's motion from the markers first, and save it as BVH or GLB";
const A_PAGE: &str = "the address gave a page in place of the file; download the file itself";
const SAVEZ: &str = "save `poses`, `trans` and `mocap_framerate` together with `numpy.savez`";
const NO_MOTION: &str = "choose the file that holds the motion";

/// Beginnings of files with binary contents.
const BINARY: &[(&[u8], &str, &str)] = &[
    (b"Kaydara FBX", "an FBX file", CONVERT),
    (b"BLENDER", "a Blender file", CONVERT),
    // Blender packs its files with Zstandard, and earlier with gzip.
    (b"\x28\xb5\x2f\xfd", "a compressed file", UNPACK_OR_EXPORT),
    (b"\x1f\x8b", "a compressed file", UNPACK_OR_EXPORT),
    (b"7z\xbc\xaf\x27\x1c", "a packed archive", UNPACK),
    (b"Rar!", "a packed archive", UNPACK),
    (b"PXR-USDC", "a USD file", CONVERT),
    (b"\x93NUMPY", "a single NumPy array (.npy)", SAVEZ),
    (b"\x89HDF\r\n", "an HDF5 file", SAVEZ),
    (b"\x89PNG", "a picture", NO_MOTION),
    (b"\xff\xd8\xff", "a picture", NO_MOTION),
    (b"GIF8", "a picture", NO_MOTION),
    (b"\x1aE\xdf\xa3", "a video", NO_SKELETON),
    (b"%PDF", "a PDF document", NO_MOTION),
    (b"SQLite format 3", "a database", NO_MOTION),
];

/// Words near the beginning of texts, in lower case.
const TEXT: &[(&str, &str, &str)] = &[
    ("; fbx", "an FBX file", CONVERT),
    ("#usda", "a USD file", CONVERT),
    (
        "version https://git-lfs",
        "a placeholder of Git LFS",
        "fetch the file itself with `git lfs pull`",
    ),
    ("<!doctype html", "a web page", A_PAGE),
    ("<html", "a web page", A_PAGE),
    (":version", "an Acclaim file (.asf, .amc)", CONVERT),
    (
        "pathfiletype",
        "a file of marker positions (.trc)",
        FROM_MARKERS,
    ),
    ("<collada", "a COLLADA file", CONVERT),
];

/// What a file that is no motion file of ours is, and what to do; none for what is not known.
pub(crate) fn other_kind(bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    if let &[0x80, 2..=5, ..] = bytes {
        let what_to_do = "load it in Python and save its arrays with `numpy.savez`";
        return Some(("a Python pickle (.pkl)", what_to_do));
    }
    let binary = BINARY.iter().find(|(start, ..)| bytes.starts_with(start));
    if let Some(&(_, kind, what_to_do)) = binary {
        return Some((kind, what_to_do));
    }
    match bytes {
        [_, _, _, _, b'f', b't', b'y', b'p', ..] => {
            return Some(("a video", NO_SKELETON));
        }
        [
            b'R',
            b'I',
            b'F',
            b'F',
            _,
            _,
            _,
            _,
            b'W',
            b'E',
            b'B',
            b'P',
            ..,
        ] => {
            return Some(("a picture", NO_MOTION));
        }
        // The parameters' block, and the key of C3D.
        [2..=5, 0x50, ..] => {
            return Some(("a file of marker positions (.c3d)", FROM_MARKERS));
        }
        _ => {}
    }
    other_text(bytes)
}

fn other_text(bytes: &[u8]) -> Option<(&'static str, &'static str)> {
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(LOOKED_AT)]).to_lowercase();
    let text = text.trim_start_matches(['\u{feff}', ' ', '\t', '\r', '\n']);
    if text.starts_with('{') {
        return Some(
            if text.contains("\"asset\"") || text.contains("\"accessors\"") {
                (
                    "glTF of several files (.gltf)",
                    "save it as one binary file, GLB",
                )
            } else {
                ("a JSON file", "save the motion as BVH or GLB")
            },
        );
    }
    let begins = |word: &str| match word {
        // After the declaration that XML files begin with.
        "<collada" => text.starts_with("<?xml") && text.contains(word) || text.starts_with(word),
        _ => text.starts_with(word),
    };
    let found = TEXT.iter().find(|(word, ..)| begins(word));
    found.map(|&(_, kind, what_to_do)| (kind, what_to_do))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn usual_mistakes_are_told_by_their_contents() {
        let html = "\u{feff}\n<!DOCTYPE html><html>";
        let lfs = "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a";
        let collada = "<?xml version=\"1.0\"?>\n<COLLADA xmlns=\"\">";
        let gltf = "{\"scenes\": [], \"asset\": {\"version\": \"2.0\"}}";
        for (bytes, kind) in [
            (&b"Kaydara FBX Binary  \0"[..], "FBX"),
            (b"; FBX 7.7.0 project file\n", "FBX"),
            (b"BLENDER-v402", "Blender"),
            (b"\x28\xb5\x2f\xfd....", "compressed"),
            (b"\x80\x04 a pickle", "pickle"),
            (b"\x93NUMPY\x01\0", ".npy"),
            (b"\x89PNG\r\n\x1a\n", "picture"),
            (b"\xff\xd8\xff\xe0\0\x10JFIF", "picture"),
            (b"RIFF\x24\0\0\0WEBPVP8 ", "picture"),
            (b"\0\0\0\x20ftypisom", "video"),
            (b"\x1aE\xdf\xa3\x01", "video"),
            (b"\x02\x50\x10\0", ".c3d"),
            (b"PathFileType\t4\t(X/Y/Z)", ".trc"),
            (b"%PDF-1.7", "PDF"),
            (html.as_bytes(), "web page"),
            (lfs.as_bytes(), "Git LFS"),
            (collada.as_bytes(), "COLLADA"),
            (gltf.as_bytes(), "glTF of several files"),
            (b"{\"frames\": []}", "JSON"),
        ] {
            let (found, what_to_do) = other_kind(bytes).unwrap();
            assert!(found.contains(kind), "{kind}: {found}");
            assert!(what_to_do.len() > 10);
        }
    }

    #[test]
    fn motion_files_and_unknown_texts_are_not_taken_for_others() {
        let known: [&[u8]; 5] = [
            b"HIERARCHY\nROOT Hips",
            b"# a comment\nHIERARCHY",
            b"glTF\x02\0\0\0",
            b"Dear reader, this is no motion.",
            b"",
        ];
        for bytes in known {
            assert_eq!(other_kind(bytes), None);
        }
    }
}
