//! `dynaskin slim`, as a user meets it.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

#[path = "common/command.rs"]
mod command;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::Arc;

use command::{printed, refused, repository};
use dynaskin_body::{BodyModel, Pose};
use dynaskin_runtime::{Avatar, Bundle, Model};

/// Everything in a folder, by name.
fn contents(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).unwrap().map(Result::unwrap);
    let files = entries.filter(|entry| entry.path().is_file());
    files
        .map(|entry| {
            let name = entry.file_name().into_string().unwrap();
            (name, fs::read(entry.path()).unwrap())
        })
        .collect()
}

/// A copy of a bundle of `models/`, as it was before it was lowered.
fn copy(bundle: &str) -> tempfile::TempDir {
    let from = repository().join("models").join(bundle);
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in contents(&from) {
        let bytes = match name.as_str() {
            "bundle.json" => {
                let mut bundle = Bundle::from_json(&bytes).unwrap();
                bundle.lowered = None;
                bundle.to_json().unwrap().into_bytes()
            }
            _ if name.ends_with(".lowered") => continue,
            _ => bytes,
        };
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    folder
}

fn slim(folder: &Path) -> [String; 2] {
    ["slim".to_owned(), folder.to_str().unwrap().to_owned()]
}

/// What the command says of a bundle that it cannot lower; every file is as before.
fn refusal(folder: &Path, more: &[&str]) -> String {
    let before = contents(folder);
    let arguments = slim(folder);
    let mut arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    arguments.extend(more);
    let said = refused(&arguments);
    assert!(contents(folder) == before, "{said}");
    let stays = format!("{} stays as it was", folder.display());
    assert!(said.contains(&stays), "{said}");
    said
}

#[test]
fn a_bundle_gets_the_files_that_the_slim_core_plays() {
    let folder = copy("female");
    let told = printed(&slim(folder.path()).each_ref().map(String::as_str));
    assert!(told.contains("2000 random ticks beside tract"), "{told}");
    let files = contents(folder.path());
    let bundle = Bundle::from_json(&files["bundle.json"]).unwrap();
    let named = bundle.lowered.clone().unwrap();
    let [predictor, decoder] = [&named.predictor, &named.decoder].map(|file| &files[&file.file]);
    named.predictor.verify(predictor).unwrap();
    named.decoder.verify(decoder).unwrap();
    // `dynaskin/slim` is tested with these.
    let shipped = contents(&repository().join("models/female"));
    assert!(predictor == &shipped["predictor.lowered"] && decoder == &shipped["decoder.lowered"]);
    let body = Arc::new(BodyModel::from_glb(&files["body.glb"]).unwrap());
    let play = |predictor: &[u8], decoder: &[u8]| {
        let body = Arc::clone(&body);
        let model = Model::from_parts(bundle.clone(), body, predictor, decoder).unwrap();
        let mut avatar = Avatar::new(Arc::new(model), &[0.0; 10]).unwrap();
        for tick in 0..40 {
            let mut pose = Pose::REST;
            pose.root_translation_m.y = 0.05 * f64::from(tick).sin();
            avatar.step(&pose, 1.0 / 60.0).unwrap();
        }
        avatar.offsets_rest_m().to_vec()
    };
    let offsets_m = play(predictor, decoder);
    let expected_m = play(&files["predictor.onnx"], &files["decoder.onnx"]);
    assert!(expected_m.iter().any(|offset| offset.length() > 1e-3));
    for (offset, expected) in offsets_m.iter().zip(&expected_m) {
        assert!((*offset - *expected).length() <= 1e-6);
    }
    // Once more, it finds the same.
    printed(&slim(folder.path()).each_ref().map(String::as_str));
    assert!(contents(folder.path()) == files);
}

#[test]
fn a_bundle_that_is_not_whole_is_refused() {
    let folder = copy("female");
    let change = |name: &str, to: Option<&[u8]>| {
        let path = folder.path().join(name);
        let had = fs::read(&path).unwrap();
        match to {
            Some(bytes) => fs::write(&path, bytes).unwrap(),
            None => fs::remove_file(&path).unwrap(),
        }
        let said = refusal(folder.path(), &[]);
        fs::write(&path, had).unwrap();
        said
    };
    for (name, bytes, expected) in [
        ("bundle.json", Some(&b"{"[..]), "bundle.json"),
        ("bundle.json", Some(b"<!doctype html>"), "web page"),
        ("bundle.json", None, "bundle.json"),
        ("predictor.onnx", None, "predictor.onnx"),
        ("decoder.onnx", Some(b"another file"), "decoder.onnx"),
        ("body.glb", Some(b"another file"), "body.glb"),
    ] {
        let said = change(name, bytes);
        assert!(said.contains(expected), "{name}: {said}");
    }
    let missing = folder.path().join("nowhere");
    let said = refused(&slim(&missing).each_ref().map(String::as_str));
    assert!(said.contains("nowhere"), "{said}");
}

#[test]
fn a_graph_that_only_tract_plays_is_refused() {
    let folder = copy("female/methods/dsnet");
    let body = repository().join("models/female/body.glb");
    let said = refusal(folder.path(), &["--body", body.to_str().unwrap()]);
    assert!(said.contains("bundle.json"), "{said}");
    assert!(said.contains("cannot be lowered"), "{said}");
}

#[test]
fn where_a_file_cannot_be_written_none_is() {
    let folder = copy("female");
    // Whoever runs the test, root too, cannot write a file in the place of a folder.
    fs::create_dir(folder.path().join("decoder.lowered")).unwrap();
    let said = refusal(folder.path(), &[]);
    assert!(said.contains("decoder.lowered"), "{said}");
}
