//! `dynaskin play` and `completions`, as a user meets them.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

#[path = "common/command.rs"]
mod command;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use command::{dynaskin, refused};
use dynaskin_npz::Writer;

const FRAMES: usize = 61;

/// A second of hops in the rest pose, 60 poses a second.
fn hops(folder: &Path) -> PathBuf {
    let path = folder.join("hops.npz");
    let rises = (0..FRAMES).map(|frame| {
        let phase = std::f64::consts::TAU * frame as f64 / 30.0;
        0.05 * (1.0 - phase.cos())
    });
    let places: Vec<f64> = rises.flat_map(|rise_m| [0.0, rise_m, 0.0]).collect();
    let mut npz = Writer::create(&path).unwrap();
    npz.array("poses", &[FRAMES, 72], &vec![0.0_f64; FRAMES * 72])
        .unwrap();
    npz.array("trans", &[FRAMES, 3], &places).unwrap();
    npz.array("mocap_framerate", &[], &[60.0_f64]).unwrap();
    npz.finish().unwrap();
    path
}

/// The vertices of the last mesh.
fn last_mesh(folder: &Path, frame: usize) -> Vec<[f32; 3]> {
    let text = fs::read_to_string(folder.join(format!("frame-{frame:05}.obj"))).unwrap();
    let vertices = text.lines().filter_map(|line| line.strip_prefix("v "));
    vertices
        .map(|line| {
            let numbers: Vec<f32> = line.split(' ').map(|x| x.parse().unwrap()).collect();
            numbers.try_into().unwrap()
        })
        .collect()
}

#[test]
fn a_motion_becomes_meshes_with_tissue_and_without() {
    let folder = tempfile::tempdir().unwrap();
    let motion = hops(folder.path());
    let play = |name: &str, more: &[&str]| {
        let out = folder.path().join(name);
        let mut arguments = vec!["play", motion.to_str().unwrap(), "--body", "female"];
        arguments.extend(["--up", "y", "--weight", "74", "--stature", "1.66"]);
        arguments.extend(["--out", out.to_str().unwrap()]);
        arguments.extend(more);
        let output = dynaskin(&arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{stderr}");
        (out, String::from_utf8_lossy(&output.stdout).into_owned())
    };
    let (moving, told) = play("moving", &[]);
    assert!(told.contains("a body of 74.0 kg and 1.66 m"), "{told}");
    assert!(told.contains("31 frames, 30 a second"), "{told}");
    let (plain, _) = play("plain", &["--plain"]);
    let [with, without] = [&moving, &plain].map(|out| last_mesh(out, 28));
    assert_eq!(with.len(), 6_890);
    let largest_m = with
        .iter()
        .zip(&without)
        .flat_map(|(a, b)| a.iter().zip(b).map(|(a, b)| (a - b).abs()))
        .fold(0.0, f32::max);
    assert!((0.001..0.2).contains(&largest_m), "{largest_m} m");
    assert!(!moving.join("frame-00031.obj").exists());
}

#[test]
fn what_cannot_be_played_is_refused_with_a_remedy() {
    let folder = tempfile::tempdir().unwrap();
    let motion = hops(folder.path());
    let out = folder.path().join("out");
    let play = |body: &str, out: &Path, more: &[&str]| {
        let mut arguments = vec![
            "play",
            motion.to_str().unwrap(),
            "--up",
            "y",
            "--body",
            body,
        ];
        arguments.extend(["--out", out.to_str().unwrap()]);
        arguments.extend(more);
        refused(&arguments)
    };
    let video = play("female", &folder.path().join("clip.webm"), &[]);
    assert!(video.contains("give NAME.mp4"), "{video}");
    let nobody = play("nobody", &out, &[]);
    assert!(
        nobody.contains("bundle.json") && nobody.contains("models/female"),
        "{nobody}"
    );
    let child = play("female", &out, &["--stature", "1.2"]);
    assert!(child.contains("adults"), "{child}");
    let fast = play("female", &out, &["--fps", "0"]);
    assert!(fast.contains("--fps must be 1 to 240"), "{fast}");
    assert!(!out.exists());
}

/// A folder with a program `ffmpeg` that keeps what it is sent in the file of its last argument, or fails.
#[cfg(unix)]
fn stand_in_for_ffmpeg(folder: &Path, script: &str) -> PathBuf {
    use std::os::unix::fs::PermissionsExt as _;
    let programs = folder.join("programs");
    fs::create_dir_all(&programs).unwrap();
    let program = programs.join("ffmpeg");
    fs::write(&program, format!("#!/bin/sh\n{script}\n")).unwrap();
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    programs
}

#[cfg(unix)]
#[test]
fn a_video_is_whole_or_not_there() {
    let folder = tempfile::tempdir().unwrap();
    let motion = hops(folder.path());
    let out = folder.path().join("hops.mp4");
    let play = |programs: &Path| {
        Command::new(env!("CARGO_BIN_EXE_dynaskin"))
            .current_dir(command::repository())
            .env("PATH", programs)
            .args(["play", motion.to_str().unwrap(), "--body", "female"])
            .args(["--up", "y", "--fps", "10", "--size", "128"])
            .args(["--out", out.to_str().unwrap()])
            .output()
            .unwrap()
    };
    let missing = play(folder.path());
    let words = String::from_utf8_lossy(&missing.stderr).into_owned();
    assert!(
        !missing.status.success() && words.contains("install it"),
        "{words}"
    );

    let failing = stand_in_for_ffmpeg(folder.path(), "echo no such codec >&2; exit 1");
    let failed = play(&failing);
    let words = String::from_utf8_lossy(&failed.stderr).into_owned();
    assert!(
        !failed.status.success() && words.contains("no such codec"),
        "{words}"
    );

    let keeping = "for last; do :; done; /bin/cat > \"$last\"";
    let played = play(&stand_in_for_ffmpeg(folder.path(), keeping));
    let words = String::from_utf8_lossy(&played.stderr).into_owned();
    assert!(played.status.success(), "{words}");
    let pictures = fs::read(&out).unwrap();
    let begin = b"\x89PNG\r\n\x1a\n";
    let count = pictures.windows(begin.len()).filter(|w| w == begin).count();
    assert_eq!(count, 11);
    let left: Vec<_> = fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .filter(|name| name.to_string_lossy().starts_with('.'))
        .collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn shells_complete_the_subcommands() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let output = dynaskin(&["completions", shell]);
        assert!(output.status.success());
        let script = String::from_utf8_lossy(&output.stdout);
        assert!(
            script.contains("simulate") && script.contains("play"),
            "{shell}"
        );
    }
    let help = dynaskin(&["play", "--help"]);
    assert!(String::from_utf8_lossy(&help.stdout).contains("Examples:"));
}
