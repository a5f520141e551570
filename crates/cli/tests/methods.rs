//! Every method of the table trains on a few simulated frames, gives a bundle that the runtime plays,
//! and refuses data that cannot be learned from.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

#[path = "common/command.rs"]
mod command;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use command::{dynaskin, refused};
use dynaskin_evaluate::Method;
use dynaskin_sim::ClipData;
use tempfile::TempDir;

/// One clip to learn from, one that decides when to stop, and one that is held out.
const CLIPS: [&str; 3] = [
    "hop-190-090__s0",
    "shake-hips-144-040__s0",
    "jumping-jacks-090-070__s0",
];

fn body_of(sex: &str) -> String {
    let models = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models");
    models
        .join(sex)
        .join("body.glb")
        .to_str()
        .unwrap()
        .to_owned()
}

/// A folder with the clips, simulated once for all tests of this file.
fn data() -> &'static Path {
    static DATA: OnceLock<TempDir> = OnceLock::new();
    DATA.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let arguments = [
            "simulate",
            "--body",
            &body_of("female"),
            "--procedural",
            "--out",
            folder.path().to_str().unwrap(),
            "--limit-frames",
            "40",
            "--no-mirror",
            "--filter",
            &CLIPS.join(","),
            "--shapes",
            "1",
        ];
        let output = dynaskin(&arguments);
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{error}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), CLIPS.len());
        folder
    })
    .path()
}

/// A folder of its own with copies of the clips.
fn copied_data() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for entry in fs::read_dir(data()).unwrap() {
        let path = entry.unwrap().path();
        fs::copy(&path, folder.path().join(path.file_name().unwrap())).unwrap();
    }
    folder
}

#[test]
fn every_method_trains_and_gives_a_bundle_that_plays() {
    let folder = tempfile::tempdir().unwrap();
    let data = data().to_str().unwrap();
    for method in Method::ALL {
        let out = folder.path().join(method.name());
        let body = body_of("female");
        let mut arguments = vec!["train", method.name(), "--data", data, "--body", &body];
        arguments.extend(["--out", out.to_str().unwrap()]);
        // As small as a network can be and still be one.
        let small: &[&str] = match method {
            Method::SpringBones => &[],
            Method::Dmpl => &["--components", "20"],
            Method::CasasOtaduy | Method::CasasOtaduyUnweighted => &[
                "--epochs",
                "2",
                "--autoencoder-epochs",
                "2",
                "--autoencoder-frames",
                "40",
                "--autoencoder-widths",
                "24,12,6",
                "--neurons",
                "16",
            ],
            Method::Dsnet | Method::DsnetRbf => &[
                "--epochs",
                "2",
                "--autoencoder-epochs",
                "2",
                "--autoencoder-frames",
                "40",
                "--channels",
                "4",
                "4",
            ],
            Method::Dynaskin => &[
                "--epochs",
                "2",
                "--encoding",
                "16",
                "--springs",
                "24",
                "--hidden",
                "12",
                "--components",
                "24",
            ],
        };
        arguments.extend(small);
        let output = dynaskin(&arguments);
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{arguments:?}: {error}");
        // What was measured is the held-out clip, played by the runtime from the files written.
        let bundle = fs::read_to_string(out.join("bundle.json")).unwrap();
        let bundle: serde_json::Value = serde_json::from_str(&bundle).unwrap();
        assert_eq!(bundle["training"]["method"], method.name());
        let measured = &bundle["measured"]["sets"][0];
        assert_eq!(measured["set"], "unseen-motion", "{method:?}");
        let ratio = measured["soft"]["ratio"].as_f64().unwrap_or(f64::NAN);
        assert!(ratio.is_finite() && ratio > 0.0, "{method:?}: {ratio}");
    }
}

/// Names and contents of a folder's files.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let entries = entries.filter(|entry| entry.path().is_file());
    entries
        .map(|entry| {
            let name = entry.file_name().into_string().unwrap();
            (name, fs::read(entry.path()).unwrap())
        })
        .collect()
}

#[cfg(unix)]
#[test]
fn a_full_disk_leaves_the_bundle_that_was_there() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("bundle");
    let body = body_of("female");
    let train = |seed: &'static str| {
        let mut arguments = vec!["train", "dmpl", "--seed", seed, "--data"];
        arguments.extend([data().to_str().unwrap(), "--body", &body]);
        arguments.extend(["--out", out.to_str().unwrap()]);
        arguments
            .iter()
            .map(|text| (*text).to_owned())
            .collect::<Vec<_>>()
    };
    let first = train("1");
    let first: Vec<&str> = first.iter().map(String::as_str).collect();
    assert!(
        dynaskin(&[&first[..], &["--components", "20"]].concat())
            .status
            .success()
    );
    let before = contents(&out);
    assert!(before.contains_key("bundle.json") && before.contains_key("body.glb"));
    let sizes = ["predictor.onnx", "decoder.onnx"].map(|name| before[name].len());
    // Files may have as many bytes as the smaller network: the other does not fit, as on a full disk.
    let blocks = sizes.into_iter().min().unwrap() / 512 + 8;
    assert!(sizes.into_iter().max().unwrap() / 512 > blocks, "{sizes:?}");
    let output = Command::new("sh")
        .arg("-c")
        .arg(format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$@\""))
        .arg("sh")
        .arg(env!("CARGO_BIN_EXE_dynaskin"))
        .args(train("2"))
        .args(["--components", "18"])
        .output()
        .unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success(), "it fitted");
    assert!(error.contains(".onnx: writing failed"), "{error}");
    assert!(contents(&out) == before, "files changed");
}

#[test]
fn a_second_training_in_the_same_folder_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let _first = dynaskin_files::FolderLock::take(folder.path()).unwrap();
    let out = folder.path().to_str().unwrap();
    let data = data().to_str().unwrap();
    let error = refused(&[
        "train",
        "dmpl",
        "--data",
        data,
        "--body",
        &body_of("female"),
        "--out",
        out,
    ]);
    assert!(error.contains("in use by another run"), "{error}");
}

#[test]
fn an_option_of_another_method_is_refused() {
    let rest = ["--data", "clips", "--body", "body.glb", "--out", "model"];
    for (method, option) in [
        ("dmpl", &["--springs", "500"][..]),
        ("dmpl", &["--published-size"]),
        ("spring-bones", &["--components", "20"]),
        ("casas-otaduy", &["--strides", "2", "2", "2", "2"]),
        ("dsnet", &["--rollout", "8"]),
        ("dsnet-rbf", &["--components", "6"]),
        ("dynaskin", &["--published-size"]),
    ] {
        let after = refused(&[&["train", method][..], &rest, option].concat());
        let told = format!("unexpected argument '{}' found", option[0]);
        assert!(after.contains(&told), "{method}: {after}");
    }
    // Without a method's name our own is meant, whose options go with no other one.
    let guest = refused(&[&["train"][..], &rest, &["--published-size"]].concat());
    assert!(
        guest.contains("unexpected argument '--published-size'"),
        "{guest}"
    );
    let before = refused(&[&["train", "--springs", "500", "dmpl"][..], &rest].concat());
    assert!(before.contains("cannot be used with"), "{before}");
    let nothing = refused(&["train"]);
    for option in ["--data", "--body", "--out"] {
        assert!(nothing.contains(option), "{nothing}");
    }
}

#[test]
fn what_cannot_be_learned_from_is_told() {
    let out = tempfile::tempdir().unwrap();
    let out = out.path().join("model").to_str().unwrap().to_owned();
    let female = body_of("female");
    let train = |data: &Path, body: &str, more: &[&str]| {
        let data = data.to_str().unwrap();
        let start = [
            "train", "--data", data, "--body", body, "--out", &out, "--epochs", "1",
        ];
        refused(&[&start, more].concat())
    };

    let error = train(data(), &body_of("male"), &[]);
    assert!(error.contains("body"), "another body: {error}");

    let without = copied_data();
    fs::remove_file(clip(without.path(), "shake-hips")).unwrap();
    let error = train(without.path(), &female, &[]);
    assert!(error.contains("validation"), "no validation clip: {error}");

    let untaught = copied_data();
    fs::remove_file(clip(untaught.path(), "hop")).unwrap();
    let error = train(untaught.path(), &female, &[]);
    assert!(error.contains("training"), "no training clip: {error}");

    let empty = tempfile::tempdir().unwrap();
    let error = train(empty.path(), &female, &[]);
    assert!(
        error.contains(empty.path().to_str().unwrap()),
        "no clip: {error}"
    );

    // Half a table of compliances.
    let halved = copied_data();
    fs::write(halved.path().join("compliance.json"), "{\"version\": 1,").unwrap();
    let error = train(halved.path(), &female, &[]);
    assert!(error.contains("compliance.json"), "half a table: {error}");

    if cfg!(not(feature = "cuda")) {
        let error = train(data(), &female, &["--device", "cuda"]);
        assert!(error.contains("--features cuda"), "no device: {error}");
    }

    // As many vertices with another one among them, and one vertex less.
    let swap_last = |clip: &mut ClipData| *clip.vertices.last_mut().unwrap() += 1;
    for (what, mixed) in [
        ("another vertex", with_edited_clip(swap_last)),
        ("a vertex less", with_edited_clip(drop_last_vertex)),
    ] {
        let error = train(mixed.path(), &female, &[]);
        assert!(
            error.contains("another vertex list") && error.contains("jumping-jacks"),
            "{what}: {error}"
        );
    }

    // A method without epochs says so instead of going by fewer settings than it was given.
    for option in ["--epochs", "--patience"] {
        let error = refused(&["train", "dmpl", option, "3"]);
        assert!(
            error.contains(&format!("unexpected argument '{option}'")),
            "no epochs: {error}"
        );
    }

    // Offsets that are no numbers.
    let broken = copied_data();
    let path = clip(broken.path(), "hop");
    let mut bytes = fs::read(&path).unwrap();
    let header = u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize;
    let tensors: serde_json::Value = serde_json::from_slice(&bytes[8..8 + header]).unwrap();
    let first = tensors["offsets_m"]["data_offsets"][0].as_u64().unwrap() as usize;
    // Not a number in half precision, in the first vertex.
    bytes[8 + header + first..][..2].copy_from_slice(&0x7e00u16.to_le_bytes());
    fs::write(&path, bytes).unwrap();
    let error = train(broken.path(), &female, &[]);
    assert!(
        error.contains("hop") && error.contains("finite"),
        "not a number: {error}"
    );

    let error = refused(&["train", "crystal-ball"]);
    assert!(error.contains("unrecognized subcommand"), "{error}");
    assert!(
        Method::ALL
            .iter()
            .all(|method| error.contains(method.name())),
        "{error}"
    );
}

/// A folder of clips whose held-out one was edited.
fn with_edited_clip(edit: impl Fn(&mut ClipData)) -> TempDir {
    let folder = copied_data();
    let path = clip(folder.path(), "jumping-jacks");
    let mut held_out = ClipData::read(&path).unwrap();
    edit(&mut held_out);
    held_out.write(&path).unwrap();
    folder
}

fn drop_last_vertex(clip: &mut ClipData) {
    let offsets = clip.offsets_rest_m.chunks(3 * clip.vertices.len());
    let kept = offsets.flat_map(|frame| &frame[..frame.len() - 3]);
    clip.offsets_rest_m = kept.copied().collect();
    clip.vertices.pop();
}

/// The file of the clip whose name begins with `name`.
fn clip(folder: &Path, name: &str) -> PathBuf {
    let named = |path: &PathBuf| {
        path.file_name()
            .unwrap()
            .to_str()
            .unwrap()
            .starts_with(name)
    };
    let paths = fs::read_dir(folder).unwrap();
    paths
        .map(|entry| entry.unwrap().path())
        .find(named)
        .unwrap()
}
