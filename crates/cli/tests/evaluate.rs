//! `dynaskin train METHOD` and `dynaskin evaluate --report` on a few simulated frames.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

#[path = "common/command.rs"]
mod command;

use std::fs;
use std::path::{Path, PathBuf};

use command::{printed, refused};
use dynaskin_sim::ClipData;

fn female_body() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/female/body.glb")
}

/// Simulates the `frames` first frames of `clips` (names, by commas) into the folder `data`.
fn simulate(data: &str, clips: &str, frames: &str) {
    let body = female_body();
    let start = ["simulate", "--body", body.to_str().unwrap(), "--procedural"];
    let rest = ["--no-mirror", "--shapes", "1", "--limit-frames", frames];
    let which = ["--out", data, "--filter", clips];
    printed(&[&start[..], &rest, &which].concat());
}

/// The rows of a CSV file by the names they begin with, as numbers; without its head.
fn csv(path: &Path, names: usize) -> Vec<(Vec<String>, Vec<f64>)> {
    let text = fs::read_to_string(path).unwrap();
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let (names, numbers) = cells.split_at(names);
        let number = |cell: &&str| cell.parse().unwrap_or(f64::NAN);
        (
            names.iter().map(ToString::to_string).collect(),
            numbers.iter().map(number).collect(),
        )
    };
    text.lines().skip(1).map(row).collect()
}

#[test]
fn the_whole_report_has_its_sections_and_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let body = female_body();
    let (data, model) = (path("data"), path("model"));
    // One clip to learn from, one that decides when to stop; a longer one that is held out.
    simulate(&data, "hop-190-090__s0,shake-hips-144-040__s0", "40");
    simulate(&data, "jumping-jacks-090-070__s0", "140");
    let body = body.to_str().unwrap();
    let train = ["--data", &data, "--body", body];
    let small = ["--epochs", "2", "--encoding", "16", "--springs", "24"];
    let smaller = ["--hidden", "12", "--components", "24", "--out", &model];
    printed(&[&["train"], &train[..], &small, &smaller].concat());
    let springs = path("model/methods/spring-bones");
    let method = ["train", "spring-bones", "--without-body"];
    printed(&[&method[..], &train, &["--out", &springs]].concat());

    // A folder that is not there yet.
    let (report, subspaces) = (path("pages/report.html"), path("subspaces.csv"));
    fs::write(
        &subspaces,
        "clip,latents,frame,autoencoder_mm,pca_mm\nhop,50,0,0.2,0.3\nhop,50,1,0.3,0.4\n",
    )
    .unwrap();
    let evaluate = ["evaluate", "--model", &model, "--data", &data, "--card"];
    let more = ["--report", &report, "--subspaces", &subspaces];
    printed(&[&evaluate[..], &more, &["--minutes", "2"]].concat());

    let html = fs::read_to_string(&report).unwrap();
    for section in [
        "Summary",
        "Cost",
        "Errors by region: unseen motion",
        "Each motion left out",
        "A frame as a picture",
        "Three motions left out, frame by frame",
        "Errors by frequency",
        "Delay",
        "2 minutes without a break",
        "Coming to rest",
        "Walking away and turning",
        "Autoencoders and principal components",
        "Decoder and principal components in as many bytes",
        "Different bodies, same motion",
        "Materials",
    ] {
        let heading = format!("<h2>{section}</h2>");
        assert_eq!(html.matches(&heading).count(), 1, "{section}");
    }
    for part in [
        "Error after turning",
        "Spectrum of belly",
        "dynaskin, reconstruction",
    ] {
        assert!(html.contains(part), "the page lacks {part}");
    }
    let table = |what: &str, names: usize| {
        let file = format!("pages/report-{what}.csv");
        csv(&folder.path().join(file), names)
    };
    let methods = ["static", "spring-bones", "dynaskin"];
    // The truth is the same in both minutes, and so is what stands still.
    let drift = table("drift", 1);
    assert!(drift.iter().map(|row| &row.0[0]).eq(methods));
    let [first_mm, last_mm] = [drift[0].1[2], drift[0].1[3]];
    assert!(
        first_mm > 0.1 && first_mm == last_mm,
        "{first_mm} {last_mm}"
    );
    for (name, numbers) in table("delays", 2) {
        assert!(numbers[1].abs() <= 1.0, "{name:?}: {numbers:?}");
    }
    let bands = table("bands", 2);
    assert_eq!(bands.len(), 4 * methods.len());
    assert!(
        bands[..4]
            .iter()
            .all(|row| row.1[0] > 0.0 && row.1[1] == 1.0)
    );
    // Inertial features depend on neither shift nor turn.
    let places = table("places", 1);
    assert_eq!(places.len(), 5 * (methods.len() - 1));
    let ratios: Vec<f64> = places.iter().map(|row| row.1[3]).collect();
    assert!(ratios.iter().all(|ratio| ratio.is_finite()), "{ratios:?}");
    assert!((ratios[5] - ratios[9]).abs() < 1e-3, "{ratios:?}");
    assert!(table("spectra", 2).iter().any(|row| row.1[1] > 0.0));
    for (name, numbers) in table("bytes", 2) {
        // Nothing that is best in the mean square can be much worse than nothing.
        assert!(
            numbers[3] > 0.0 && numbers[3] <= 1.1,
            "{name:?}: {numbers:?}"
        );
    }
    // Three bodies, six regions: simulated, and two methods that are not static.
    assert_eq!(table("bodies", 3).len(), 3 * 6 * 3);
    let shifts = table("material-shifts", 2);
    assert_eq!(shifts.len(), 2 * 6);
    for (name, numbers) in &shifts {
        let softer = numbers[0] < 1.0;
        assert!(name[0] == "dynaskin" && numbers[2].is_finite(), "{name:?}");
        assert_eq!(numbers[1] < 1.0, softer, "{name:?}: {numbers:?}");
    }
    assert_eq!(table("materials", 2).len(), 3 * 6);
    for what in ["errors", "clips", "cost", "motions", "curves", "rest"] {
        assert!(!table(what, 1).is_empty(), "{what}");
    }
    let cost = table("cost", 1);
    assert_eq!(cost[1].1[..2], [1.0, 40.0], "{cost:?}");
    let card = fs::read_to_string(Path::new(&model).join("MODEL_CARD.md")).unwrap();
    let heading = card.find("## Compared with other methods").unwrap();
    assert!(heading < card.find("## Limits").unwrap(), "{card}");
    let row = card[heading..]
        .lines()
        .find(|line| line.starts_with("| dynaskin |"));
    assert_eq!(row.unwrap().matches('|').count(), 7, "{card}");
}

#[test]
fn other_vertices_and_another_body_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (data, model, report) = (path("data"), path("model"), path("report.html"));
    simulate(&data, "hop-190-090__s0,jumping-jacks-090-070__s0", "20");
    let body = female_body();
    let train = ["train", "spring-bones", "--data", &data];
    let more = ["--body", body.to_str().unwrap(), "--out", &model];
    printed(&[train, more].concat());
    let compared = path("model/methods/compared");
    fs::create_dir_all(&compared).unwrap();
    for file in ["predictor.onnx", "decoder.onnx"] {
        fs::copy(
            Path::new(&model).join(file),
            Path::new(&compared).join(file),
        )
        .unwrap();
    }
    let told = fs::read_to_string(Path::new(&model).join("bundle.json")).unwrap();
    let told: serde_json::Value = serde_json::from_str(&told).unwrap();
    let evaluate = |model: &str, data: &str, more: &[&str]| {
        refused(&[&["evaluate", "--model", model, "--data", data], more].concat())
    };
    let with_bundle = |edit: &dyn Fn(&mut serde_json::Value)| {
        let mut bundle = told.clone();
        edit(&mut bundle);
        fs::write(Path::new(&compared).join("bundle.json"), bundle.to_string()).unwrap();
        evaluate(&model, &data, &["--report", &report])
    };
    let other_vertices = |bundle: &mut serde_json::Value| {
        let vertices = bundle["vertices"].as_array_mut().unwrap();
        let last = vertices.last_mut().unwrap();
        *last = (last.as_u64().unwrap() + 1).into();
    };
    let error = with_bundle(&other_vertices);
    assert!(
        error.contains("compared") && error.contains("other vertices"),
        "{error}"
    );
    let error = with_bundle(&|bundle| bundle["body"]["sha256"] = "0".repeat(64).into());
    assert!(
        error.contains("compared") && error.contains("another body"),
        "{error}"
    );
    assert!(!Path::new(&report).exists());

    let with_clips = |edit: &dyn Fn(&mut ClipData)| {
        let edited = tempfile::tempdir().unwrap();
        for entry in fs::read_dir(&data).unwrap() {
            let file = entry.unwrap().path();
            let mut clip = ClipData::read(&file).unwrap();
            edit(&mut clip);
            clip.write(&edited.path().join(file.file_name().unwrap()))
                .unwrap();
        }
        evaluate(&model, edited.path().to_str().unwrap(), &[])
    };
    let error = with_clips(&|clip| *clip.vertices.last_mut().unwrap() += 1);
    assert!(error.contains("other vertices"), "{error}");
    let error = with_clips(&|clip| clip.body_sha256 = "0".repeat(64));
    assert!(error.contains("simulate or fit the clips again"), "{error}");
    let male = body
        .parent()
        .unwrap()
        .with_file_name("male")
        .join("body.glb");
    let error = evaluate(&model, &data, &["--body", male.to_str().unwrap()]);
    assert!(error.contains("body.glb"), "{error}");
}

#[test]
fn a_method_is_trained_and_stands_in_a_report_beside_static() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let body = female_body();
    let body = body.to_str().unwrap();
    let (data, model) = (path("data"), path("model"));
    // Jumping jacks are held out, hops are not.
    simulate(&data, "hop-190-090__s0,jumping-jacks-090-070__s0", "40");
    let train = [
        "train",
        "spring-bones",
        "--data",
        &data,
        "--body",
        body,
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
    printed(&[&evaluate[..], &["--card"]].concat());
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
    let card = fs::read_to_string(Path::new(&model).join("MODEL_CARD.md")).unwrap();
    let rows = card
        .lines()
        .filter(|line| line.starts_with("| spring bones |"));
    assert_eq!(rows.count(), 2, "{card}");
    assert!(card.contains("| static |"), "{card}");
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
    let error = refused(&[&evaluate[..], &["--split", &split]].concat());
    assert!(error.contains("another split"), "{error}");
}
