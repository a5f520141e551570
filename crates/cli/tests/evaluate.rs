//! `dynaskin train --method` and `dynaskin evaluate --report` on a few simulated frames.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn female_body() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/female/body.glb")
}

fn dynaskin(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_dynaskin"))
        .args(arguments)
        .output()
        .unwrap()
}

/// Standard output of a call that has to succeed.
fn printed(arguments: &[&str]) -> String {
    let output = dynaskin(arguments);
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {error}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn a_method_is_trained_and_stands_in_a_report_beside_static() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let body = female_body();
    let body = body.to_str().unwrap();
    let (data, model) = (path("data"), path("model"));
    // Jumping jacks are held out, hops are not.
    let clips = "hop-190-090__s0,jumping-jacks-090-070__s0";
    printed(&[
        "simulate",
        "--body",
        body,
        "--procedural",
        "--out",
        &data,
        "--limit-frames",
        "40",
        "--no-mirror",
        "--filter",
        clips,
        "--shapes",
        "1",
    ]);
    let train = [
        "train",
        "--data",
        &data,
        "--body",
        body,
        "--method",
        "spring-bones",
        "--out",
    ];
    printed(&[&train[..], &[&model]].concat());
    let other = path("model/methods/spring-bones");
    printed(&[&train[..], &[&other, "--without-body"]].concat());
    let bundle = fs::read_to_string(Path::new(&model).join("bundle.json")).unwrap();
    assert!(bundle.contains("\"method\": \"spring-bones\""), "{bundle}");

    let report = path("report.html");
    let wasm = path("wasm.json");
    fs::write(&wasm, "{\"spring-bones\": 0.123}").unwrap();
    let evaluate = [
        "evaluate",
        "--model",
        &model,
        "--data",
        &data,
        "--report",
        &report,
        "--without-simulation",
        "--wasm-times",
        &wasm,
    ];
    printed(&evaluate);
    let html = fs::read_to_string(&report).unwrap();
    for part in [
        "Summary",
        "spring bones",
        "unseen motion",
        "data:image/png",
        "0.123",
        "<svg",
    ] {
        assert!(html.contains(part), "the page lacks {part}");
    }
    let csv = fs::read_to_string(folder.path().join("report-errors.csv")).unwrap();
    let row = |method: &str| -> Vec<f64> {
        let start = format!("unseen motion,{method},all soft,");
        let line = csv.lines().find(|line| line.starts_with(&start)).unwrap();
        line[start.len()..]
            .split(',')
            .map(|cell| cell.parse().unwrap())
            .collect()
    };
    let (still, springs) = (row("static"), row("spring-bones"));
    assert!(
        still[0] > 0.01 && (still[5] - 1.0).abs() < 1e-4,
        "{still:?}"
    );
    // The ratio is that of the means; the same model twice gives the same numbers twice.
    assert!(
        (springs[0] - springs[5] * still[0]).abs() < 1e-3,
        "{springs:?}"
    );
    let twice = csv
        .lines()
        .filter(|line| line.starts_with("unseen motion,spring-bones,chest,"));
    let twice: Vec<&str> = twice.collect();
    assert!(twice.len() == 2 && twice[0] == twice[1], "{twice:?}");

    // A method that learned from what is held out here takes no part.
    let split = path("split.json");
    fs::write(
        &split,
        "{\"test_subjects\": [], \"test_trials\": [\"hop\"], \"validation_trials\": [], \
         \"test_shapes\": []}",
    )
    .unwrap();
    let output = dynaskin(&[&evaluate[..], &["--split", &split]].concat());
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(
        !output.status.success() && error.contains("another split"),
        "{error}"
    );
}
