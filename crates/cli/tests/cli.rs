//! The `dynaskin` command as a user meets it: what it writes, keeps and refuses.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

#[path = "common/command.rs"]
mod command;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use command::{dynaskin, refused};

fn female_body() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/female/body.glb")
}

/// Simulates half a second of one motion; what was printed.
fn simulate(out: &Path) -> String {
    let body = female_body();
    let output = dynaskin(&[
        "simulate",
        "--body",
        body.to_str().unwrap(),
        "--procedural",
        "--out",
        out.to_str().unwrap(),
        "--limit-frames",
        "30",
        "--no-mirror",
        "--filter",
        "twist-100-050__s0,hop-190-090__s0",
        "--shapes",
        "1",
    ]);
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn simulated_clips_are_kept_and_damaged_ones_made_again() {
    let folder = tempfile::tempdir().unwrap();
    let printed = simulate(folder.path());
    assert!(printed.contains("2 clips written (60 frames"), "{printed}");
    let clip = folder.path().join("hop-190-090__s0.safetensors");
    let whole = fs::read(&clip).unwrap();
    let printed = simulate(folder.path());
    assert!(printed.contains("0 clips written"), "{printed}");
    assert!(printed.contains("2 kept"), "{printed}");

    fs::write(&clip, &whole[..whole.len() / 2]).unwrap();
    let printed = simulate(folder.path());
    assert!(printed.contains("1 clips written"), "{printed}");
    assert_eq!(fs::read(&clip).unwrap(), whole, "the same bytes again");

    // Training names the clip that it cannot read.
    fs::write(&clip, &whole[..whole.len() / 2]).unwrap();
    let body = female_body();
    let error = refused(&[
        "train",
        "--data",
        folder.path().to_str().unwrap(),
        "--body",
        body.to_str().unwrap(),
        "--out",
        folder.path().join("model").to_str().unwrap(),
    ]);
    assert!(error.contains("hop-190-090__s0.safetensors"), "{error}");
    assert!(!folder.path().join("model/bundle.json").exists());
}

#[test]
fn compliance_alone_is_worked_out_once() {
    let folder = tempfile::tempdir().unwrap();
    let body = female_body();
    let arguments = [
        "simulate",
        "--body",
        body.to_str().unwrap(),
        "--out",
        folder.path().to_str().unwrap(),
        "--compliance",
        "1",
    ];
    let output = dynaskin(&arguments);
    assert!(output.status.success(), "{output:?}");
    let printed = String::from_utf8_lossy(&output.stdout);
    assert!(printed.contains("compliance of 1 shapes"), "{printed}");
    let path = folder.path().join("compliance.json");
    let table: serde_json::Value = serde_json::from_slice(&fs::read(&path).unwrap()).unwrap();
    let metres = table["rows"][0]["metres"].as_array().unwrap();
    assert_eq!(metres.len(), 36);
    // Breasts give way by millimetres to centimetres.
    let breast_m = metres[0].as_f64().unwrap();
    assert!((0.002..0.1).contains(&breast_m), "{breast_m}");
    let written = fs::metadata(&path).unwrap().modified().unwrap();
    assert!(dynaskin(&arguments).status.success());
    assert_eq!(fs::metadata(&path).unwrap().modified().unwrap(), written);
}

#[test]
fn clips_of_another_body_and_earlier_runs_are_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path().to_str().unwrap();
    simulate(folder.path());
    let clip = folder.path().join("hop-190-090__s0.safetensors");
    let whole = fs::read(&clip).unwrap();
    let male = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/male/body.glb");
    let error = refused(&[
        "simulate",
        "--body",
        male.to_str().unwrap(),
        "--procedural",
        "--out",
        here,
        "--limit-frames",
        "30",
        "--no-mirror",
        "--shapes",
        "1",
        "--filter",
        "hop-190-090__s0",
    ]);
    assert!(error.contains("another body"), "{error}");
    assert_eq!(fs::read(&clip).unwrap(), whole);

    let model = folder.path().join("model");
    fs::create_dir_all(model.join("checkpoint")).unwrap();
    fs::write(model.join("checkpoint/state.json"), "{}").unwrap();
    let body = female_body();
    let error = refused(&[
        "train",
        "--data",
        here,
        "--body",
        body.to_str().unwrap(),
        "--out",
        model.to_str().unwrap(),
    ]);
    assert!(error.contains("--restart"), "{error}");
    assert_eq!(
        fs::read(model.join("checkpoint/state.json")).unwrap(),
        b"{}"
    );
}

#[cfg(target_os = "linux")]
#[test]
fn results_that_cannot_be_printed_are_an_error() {
    let folder = tempfile::tempdir().unwrap();
    let body = female_body();
    let arguments = [
        "simulate",
        "--procedural",
        "--plan",
        "--shapes",
        "1",
        "--out",
    ];
    let mut command = Command::new(env!("CARGO_BIN_EXE_dynaskin"));
    command
        .args(arguments)
        .arg(folder.path())
        .arg("--body")
        .arg(&body);
    let full = fs::File::options().write(true).open("/dev/full").unwrap();
    let output = command.stdout(full).output().unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{error}");
    assert!(error.contains("could not be printed"), "{error}");
    assert!(!error.contains("panicked"), "{error}");
}

#[test]
fn what_is_missing_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path().to_str().unwrap();
    let body = female_body();
    let body = body.to_str().unwrap();
    let simulate = |more: &[&str]| refused(&[&["simulate", "--out", here], more].concat());
    assert!(simulate(&["--body", body]).contains("--mocap FOLDER"));
    let empty = simulate(&["--body", body, "--mocap", here]);
    assert!(empty.contains("holds no motion files"), "{empty}");
    let mocap = |more: &[&str]| simulate(&[&["--body", body, "--mocap", here], more].concat());
    fs::write(folder.path().join("walk.bvh"), "HIERARCHY\nROOT").unwrap();
    let no_pair = mocap(&["--joint", "left_hip"]);
    assert!(no_pair.contains("left_hip=LThigh"), "{no_pair}");
    let no_joint = mocap(&["--joint", "left_wing=LThigh"]);
    assert!(
        no_joint.contains("left_wing") && no_joint.contains("left_hip"),
        "{no_joint}"
    );
    let no_axis = mocap(&["--up", "-q"]);
    assert!(no_axis.contains("y, z or -y"), "{no_axis}");
    let unused = mocap(&["--animation", "walk"]);
    assert!(
        unused.contains("--animation is for glb, vrma files"),
        "{unused}"
    );
    let read = mocap(&["--joint", "left_hip=LThigh", "--rate", "30"]);
    assert!(
        read.contains("walk") && read.contains("BVH line 2"),
        "{read}"
    );
    fs::remove_file(folder.path().join("walk.bvh")).unwrap();
    let nothing = simulate(&["--body", body, "--procedural", "--filter", "cartwheel"]);
    assert!(nothing.contains("--filter cartwheel"), "{nothing}");
    let nobody = simulate(&["--body", "nobody.glb", "--procedural"]);
    assert!(nobody.contains("nobody.glb"), "{nobody}");

    let no_data = refused(&["train", "--data", here, "--body", body, "--out", here]);
    assert!(no_data.contains(here), "{no_data}");
    let no_model = refused(&["evaluate", "--model", here, "--data", here]);
    assert!(no_model.contains("bundle.json"), "{no_model}");
    let no_source = refused(&["body", "build", "--source", here, "--out", here]);
    assert!(no_source.contains("LICENSE.md"), "{no_source}");
}

#[test]
fn refusals_are_one_plain_sentence_that_names_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let body = female_body();
    let body = body.to_str().unwrap();
    let (missing, text, zip) = (at("missing"), at("text"), at("cut.npz"));
    fs::write(&text, b"\xff\xfe no body").unwrap();
    fs::write(&zip, b"PK\x03\x04 cut off").unwrap();
    let here = folder.path().to_str().unwrap();
    let model = Path::new(body)
        .parent()
        .unwrap()
        .to_str()
        .unwrap()
        .to_owned();
    let meshes = at("meshes");
    let none = "there is no such file or folder";
    let cases: &[(&[&str], &str, &str)] = &[
        (
            &["body", "import", &missing, "--out", here, "--no-regions"],
            &missing,
            none,
        ),
        (
            &["body", "import", here, "--out", here, "--no-regions"],
            here,
            "it is a folder",
        ),
        (
            &["body", "import", &zip, "--out", here, "--no-regions"],
            &zip,
            "cut off or damaged",
        ),
        (&["bind", &missing, "--body", body], &missing, none),
        (
            &["simulate", "--body", &missing, "--out", here],
            &missing,
            none,
        ),
        (
            &["simulate", "--body", &text, "--out", here],
            &text,
            "is no GLB file",
        ),
        (
            &[
                "simulate", "--body", body, "--out", here, "--mocap", &missing,
            ],
            &missing,
            none,
        ),
        (
            &["fit", "--body", body, "--scans", &missing, "--list"],
            &missing,
            none,
        ),
        (
            &["fit", "--body", &zip, "--scans", here, "--list"],
            &zip,
            "cut off or damaged",
        ),
        (
            &[
                "fit-all", "--body", body, "--scans", &missing, "--rate", "60", "--out", here,
            ],
            &missing,
            none,
        ),
        (
            &["train", "--body", body, "--data", &missing, "--out", here],
            &missing,
            none,
        ),
        (
            &["train", "--body", body, "--data", &text, "--out", here],
            &text,
            "a file stands where",
        ),
        (
            &["train", "--body", &text, "--data", here, "--out", here],
            &text,
            "is no GLB file",
        ),
        (
            &["evaluate", "--model", &missing, "--data", here],
            &missing,
            none,
        ),
        (
            &["evaluate", "--model", &text, "--data", here],
            &text,
            "a file stands where",
        ),
        (
            &[
                "reproduce",
                "casas-fig5",
                "--subspaces",
                &missing,
                "--out",
                "none.html",
            ],
            &missing,
            none,
        ),
        (
            &[
                "reproduce",
                "casas-fig5",
                "--subspaces",
                &text,
                "--out",
                "none.html",
            ],
            &text,
            "it is no text",
        ),
        (
            &["reproduce", "parameters", "--out", here],
            here,
            "it is a folder",
        ),
        (&["slim", &missing], &missing, none),
        (
            &["play", &missing, "--body", &model, "--out", &meshes],
            &missing,
            none,
        ),
    ];
    for (arguments, place, words) in cases {
        let output = Command::new(env!("CARGO_BIN_EXE_dynaskin"))
            .current_dir(folder.path())
            // What a developer's shell may have set is no news to a user.
            .env("RUST_BACKTRACE", "1")
            .args(*arguments)
            .output()
            .unwrap();
        let error = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {error}");
        assert_eq!(
            error.trim_end().lines().count(),
            1,
            "{arguments:?}: {error}"
        );
        for word in [place, *words] {
            assert!(
                error.contains(word),
                "`{word}` is missing in {arguments:?}: {error}"
            );
        }
        for jargon in ["os error", "EOCD", "Caused by", "backtrace"] {
            assert!(!error.contains(jargon), "{arguments:?}: {error}");
        }
    }
}

#[test]
fn a_reader_that_closes_the_pipe_does_not_matter() {
    let body = female_body();
    let mut child = Command::new(env!("CARGO_BIN_EXE_dynaskin"))
        .args(["simulate", "--procedural", "--plan", "--out", "nowhere"])
        .args(["--body", body.to_str().unwrap()])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && stderr.is_empty(), "{stderr}");
}

/// Arguments of a small simulation into `out`.
fn small<'a>(body: &'a str, out: &'a str) -> Vec<&'a str> {
    vec![
        "simulate",
        "--body",
        body,
        "--procedural",
        "--out",
        out,
        "--limit-frames",
        "30",
        "--filter",
        "twist-100-050,hop-190-090",
    ]
}

#[test]
fn parts_of_a_data_set_make_the_whole() {
    let (whole, parts) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let body = female_body();
    let body = body.to_str().unwrap();
    let names = |folder: &Path| {
        let mut names: Vec<_> = fs::read_dir(folder)
            .unwrap()
            .map(|entry| entry.unwrap().file_name())
            .collect();
        names.sort();
        names
    };
    let output = dynaskin(&small(body, whole.path().to_str().unwrap()));
    assert!(output.status.success());
    for part in ["1/3", "2/3", "3/3"] {
        let mut arguments = small(body, parts.path().to_str().unwrap());
        arguments.extend(["--shard", part]);
        assert!(dynaskin(&arguments).status.success(), "{part}");
    }
    assert!(names(whole.path()).len() >= 6);
    assert_eq!(names(whole.path()), names(parts.path()));
    for name in names(whole.path()) {
        let read = |folder: &Path| fs::read(folder.join(&name)).unwrap();
        assert!(read(whole.path()) == read(parts.path()), "{name:?} differs");
    }
    for bad in ["0/3", "4/3", "x", "1/0", "1"] {
        let mut arguments = small(body, parts.path().to_str().unwrap());
        arguments.extend(["--shard", bad]);
        assert!(refused(&arguments).contains("such as 2/8"), "{bad}");
    }
}

#[test]
fn a_data_set_without_captures_and_a_report_without_its_folder_are_refused() {
    let body = female_body();
    let body = body.to_str().unwrap();
    let out = ["simulate", "--body", body, "--out", "nowhere"];
    let error = refused(&[&out[..], &["--preset", "full"]].concat());
    assert!(error.contains("--mocap FOLDER"), "{error}");
    let error = refused(&["simulate", "--body", body]);
    assert!(error.contains("--out"), "{error}");
}

/// A limit on the size of files stands for a disk that fills up: writing fails in the middle.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_stops_the_run_and_a_second_run_finishes_it() {
    let folder = tempfile::tempdir().unwrap();
    let body = female_body();
    let arguments = small(body.to_str().unwrap(), folder.path().to_str().unwrap());
    let output = Command::new("bash")
        .args(["-c", "trap '' XFSZ; ulimit -f 200; exec \"$0\" \"$@\""])
        .arg(env!("CARGO_BIN_EXE_dynaskin"))
        .args(&arguments)
        .output()
        .unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success());
    assert!(!error.contains("panicked"), "{error}");
    assert!(
        error.contains("the disk is full") && error.contains("same command"),
        "{error}"
    );
    assert_eq!(
        fs::read_dir(folder.path()).unwrap().count(),
        0,
        "no half-written file stays"
    );
    let output = dynaskin(&arguments);
    assert!(output.status.success());
}
