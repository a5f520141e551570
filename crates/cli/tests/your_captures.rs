//! The commands of docs/your-captures.md, run one after the other on made files.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

#[path = "common/captures.rs"]
mod captures;
#[path = "common/smpl_file.rs"]
mod smpl_file;

use std::f64::consts::TAU;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

use dynaskin_body::{BodyModel, Joint, Pose};
use dynaskin_motion::{Procedural, ProceduralKind};
use dynaskin_runtime::{Avatar, Model};
use dynaskin_sim::ClipData;
use glam::{DQuat, Vec3};
use smpl_file::Made;

/// Commands that the guide may have, beside those that are run.
const NOT_RUN: [&str; 4] = ["cargo", "export", "npm", "python3"];
/// Commands that a reader has to type.
const MOST_COMMANDS: usize = 15;
const FRAMES: usize = 40;
/// How far the tissue moves, downwards.
const AMPLITUDE_M: f64 = 0.006;

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The commands of the guide, continued lines joined.
fn commands() -> Vec<String> {
    let guide = fs::read_to_string(repository().join("docs/your-captures.md")).unwrap();
    let blocks = guide.split("```sh\n").skip(1);
    blocks
        .flat_map(|block| {
            let (code, _) = block.split_once("```").unwrap();
            let joined = code.replace("\\\n", " ");
            joined.lines().map(str::to_owned).collect::<Vec<_>>()
        })
        .collect()
}

/// What makes a command short enough for a test.
fn smaller(command: &str) -> &'static str {
    if command.starts_with("dynaskin train") {
        " --epochs 2 --encoding 16 --springs 24 --hidden 12 --components 24"
    } else if command.starts_with("dynaskin evaluate") {
        " --minutes 2"
    } else {
        ""
    }
}

/// Runs a command where the files are; gives what it prints.
fn run(folder: &Path, command: &str) -> String {
    // The test gives an option of its own, which may not stand twice.
    let command = command.replace(" --epochs 40", "");
    let dynaskin = Path::new(env!("CARGO_BIN_EXE_dynaskin"));
    let path = std::env::var("PATH").unwrap();
    let output = Command::new("sh")
        .args(["-e", "-c", &format!("{command}{}", smaller(&command))])
        .env(
            "PATH",
            format!("{}:{path}", dynaskin.parent().unwrap().display()),
        )
        .current_dir(folder)
        .output()
        .unwrap();
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command}: {error}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// A body of SMPL's layout, and captures of two people with tissue that swings.
fn make_files(folder: &Path) {
    let models = folder.join("models/female");
    fs::create_dir_all(&models).unwrap();
    let glb = fs::read(repository().join("models/female/body.glb")).unwrap();
    fs::write(models.join("body.glb"), &glb).unwrap();
    let ours = BodyModel::from_glb(&glb).unwrap();
    let smpl = folder.join("smpl_female.npz");
    Made::of(&ours).write(&ours, &smpl);
    let body = BodyModel::from_smpl_npz(&fs::read(&smpl).unwrap()).unwrap();
    let softness: Vec<f32> = (0..ours.vertex_count())
        .map(|vertex| {
            ours.region_weights
                .iter()
                .map(|region| region[vertex])
                .sum()
        })
        .collect();
    let mut sequences = Vec::new();
    for (name, beta, hertz, moved) in [
        ("50002_jumping_jacks", 0.8, 2.0, Joint::LeftShoulder),
        ("50002_one_leg_jump", 0.8, 3.0, Joint::RightKnee),
        ("50002_shake_hips", 0.8, 2.5, Joint::Spine1),
        ("50004_one_leg_jump", -0.8, 3.0, Joint::RightKnee),
    ] {
        let frames = (0..FRAMES).map(|frame| {
            // From 0 to 1 and back, from rest.
            let swing = |ticks: f64| 0.5 - 0.5 * (TAU * hertz * ticks.max(0.0) / 60.0).cos();
            let ticks = frame as f64;
            let mut pose = Pose::REST;
            pose.root_translation_m.y = 0.1 * swing(ticks);
            pose.parent_from_joint[moved as usize] = DQuat::from_rotation_z(0.3 * swing(ticks));
            // It follows late.
            let down_m = -2.0 * AMPLITUDE_M * swing(ticks - 3.0);
            captures::scan_m(&body, beta, &pose, |vertex| {
                softness[vertex].min(1.0) * Vec3::new(0.0, down_m as f32, 0.0)
            })
        });
        sequences.push((name.to_owned(), frames.collect()));
    }
    captures::write(&folder.join("captures.hdf5"), &sequences);
}

/// Steps the model of a folder through hops; gives the largest offset in metres.
fn largest_offset_m(model: &Path, shape: &[f32]) -> f32 {
    let mut read = |file: &str| fs::read(model.join(file)).map_err(|error| error.to_string());
    let bundle = read("bundle.json").unwrap();
    let model = Arc::new(Model::load(&bundle, &mut read).unwrap());
    assert!(!model.body().pose_dirs_m.is_empty(), "no pose correctives");
    let mut avatar = Avatar::new(Arc::clone(&model), shape).unwrap();
    let hop = Procedural {
        duration_seconds: 4.0,
        ..Procedural::new(ProceduralKind::Hop)
    };
    let clip = hop.clip(avatar.joints_rest_m()).unwrap();
    let mut largest_m: f32 = 0.0;
    for pose in &clip.frames {
        avatar.step(pose, 1.0 / 60.0).unwrap();
        let (skinned_m, _) = avatar.skin();
        assert!(skinned_m.iter().all(|place| place.is_finite()));
        let offsets = avatar.offsets_rest_m().iter().map(|offset| offset.length());
        largest_m = offsets.fold(largest_m, f32::max);
    }
    largest_m
}

#[test]
fn the_guide_leads_from_captures_to_a_model_that_plays() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    make_files(folder);
    let commands = commands();
    assert!(commands.len() <= MOST_COMMANDS, "{commands:?}");
    let mut printed = Vec::new();
    for command in &commands {
        let program = command.split_whitespace().next().unwrap();
        match program {
            "dynaskin" | "mkdir" | "cp" => printed.push(run(folder, command)),
            _ => assert!(NOT_RUN.contains(&program), "who runs {command}?"),
        }
    }
    let printed = printed.join("\n");
    for words in [
        "SMPL: 6890 vertices",
        "50004_one_leg_jump [6890, 3, 40] 40 frames",
        "4 of 4 sequences are fitted",
        "unseen motion and shape",
        "report written to my-report.html",
    ] {
        assert!(printed.contains(words), "`{words}` is missing in {printed}");
    }
    let clip = folder.join("my-fits/clips/one_leg_jump__50004.safetensors");
    let clip = ClipData::read(&clip).unwrap();
    assert!((clip.shape[0] + 0.8).abs() < 0.1, "{:?}", clip.shape);
    let deepest_m = clip
        .offsets_rest_m
        .iter()
        .map(|x| x.to_f32())
        .fold(0.0, f32::min);
    let off_m = deepest_m + 2.0 * AMPLITUDE_M as f32;
    assert!(off_m.abs() < 2e-3, "{deepest_m} m");

    let bundle = fs::read_to_string(folder.join("my-model/bundle.json")).unwrap();
    let bundle: serde_json::Value = serde_json::from_str(&bundle).unwrap();
    let split = &bundle["training"]["split"];
    assert_eq!(split["test_trials"], serde_json::json!(["one_leg_jump"]));
    assert_eq!(split["test_shapes"], serde_json::json!(["50004"]));

    // A page has no use for the state of the training, and it is large.
    assert!(folder.join("my-model/checkpoint").is_dir());
    assert!(!folder.join("my-page/my-model/checkpoint").exists());
    // As the page does it.
    let person = fs::read_to_string(folder.join("my-page/50004.json")).unwrap();
    let person: serde_json::Value = serde_json::from_str(&person).unwrap();
    let betas = person["shape"].as_array().unwrap();
    let shape: Vec<f32> = betas
        .iter()
        .map(|beta| beta.as_f64().unwrap() as f32)
        .collect();
    let largest_m = largest_offset_m(&folder.join("my-page/my-model"), &shape);
    assert!(largest_m > 1e-6, "nothing moves: {largest_m} m");
}
