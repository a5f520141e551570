//! `dynaskin fit` and AMASS-like motions as a user meets them.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use dynaskin_body::{BodyModel, Joint, Pose, SHAPE_COUNT, SkinMatrices, skin_linear};
use dynaskin_npz::Writer;
use glam::{DQuat, DVec3, Vec3};
use hdf5_writer::{DatasetBuilder, Hdf5Builder, WriteOptions};

fn body_path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/female/body.glb")
}

fn body() -> BodyModel {
    BodyModel::from_glb(&fs::read(body_path()).unwrap()).unwrap()
}

/// `dynaskin COMMAND --body FEMALE ...`.
fn dynaskin(command: &str, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_dynaskin"))
        .arg(command)
        .arg("--body")
        .arg(body_path())
        .args(arguments)
        .output()
        .unwrap()
}

#[track_caller]
fn printed(output: &Output) -> String {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[track_caller]
fn refused(output: &Output, words: &[&str]) {
    let text = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success());
    assert!(!text.contains("panicked"), "{text}");
    for word in words {
        assert!(text.contains(word), "`{word}` is missing in: {text}");
    }
}

/// Poses of an arm that rises while the body turns.
fn poses() -> Vec<Pose> {
    (0..3)
        .map(|frame| {
            let mut pose = Pose::REST;
            let turn = 0.1 * f64::from(frame);
            pose.parent_from_joint[0] = DQuat::from_rotation_y(turn);
            pose.parent_from_joint[Joint::LeftShoulder as usize] =
                DQuat::from_rotation_z(2.0 * turn);
            pose.root_translation_m = DVec3::new(0.0, 0.02, turn);
            pose
        })
        .collect()
}

/// The body of β0 = 1 in these poses, in millimetres and with +Z up, as [T,V,3].
fn write_scans(path: &Path, body: &BodyModel) {
    let mut shape = [0.0; SHAPE_COUNT];
    shape[0] = 1.0;
    let shaped = body.shaped(&shape);
    let mut numbers: Vec<f32> = Vec::new();
    let mut world_m = vec![Vec3::ZERO; body.vertex_count()];
    for pose in poses() {
        let matrices = SkinMatrices::new(&pose, &shaped.joints_m);
        skin_linear(&shaped.positions_m, &body.skin, &matrices, &mut world_m);
        numbers.extend(
            world_m
                .iter()
                .flat_map(|p| [p.x, -p.z, p.y].map(|x| x * 1e3)),
        );
    }
    let mut writer = Writer::create(path).unwrap();
    let shape = [3, body.vertex_count(), 3];
    writer.array("vertices", &shape, &numbers).unwrap();
    writer.finish().unwrap();
}

#[test]
fn scans_become_a_fit_a_clip_and_a_motion() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("scans.npz");
    write_scans(&scans, &body());
    let (scans, fits) = (scans.to_str().unwrap(), folder.path().join("fits"));
    fs::create_dir(&fits).unwrap();
    let out = fits.join("arm.npz");
    let clip = folder.path().join("arm__anna.safetensors");
    let (out, clip) = (out.to_str().unwrap(), clip.to_str().unwrap());
    let usual = ["--scans", scans, "--rate", "60", "--out", out];
    let text = printed(&dynaskin("fit", &[&usual[..], &["--clip", clip]].concat()));
    assert!(
        text.contains("millimetres") && text.contains("z is up"),
        "{text}"
    );
    assert!(text.contains("3 frames at 60 Hz"), "{text}");
    assert!(text.contains("shape 1.000,"), "{text}");
    assert!(Path::new(clip).exists());

    // What is there stays, unless it is said otherwise.
    let before = fs::read(out).unwrap();
    refused(&dynaskin("fit", &usual), &["arm.npz", "--overwrite"]);
    assert_eq!(fs::read(out).unwrap(), before);
    printed(&dynaskin("fit", &[&usual[..], &["--overwrite"]].concat()));
    assert_eq!(
        fs::read_dir(&fits).unwrap().count(),
        1,
        "no temporary file stays"
    );

    let data = folder.path().join("data");
    let arguments = [
        "--mocap",
        fits.to_str().unwrap(),
        "--out",
        data.to_str().unwrap(),
        "--no-mirror",
        "--shapes",
        "1",
    ];
    let text = printed(&dynaskin("simulate", &arguments));
    assert!(text.contains("1 clips written (3 frames"), "{text}");
}

/// Joints that are turned where nobody is at rest.
const LIMBS: [Joint; 10] = [
    Joint::LeftHip,
    Joint::RightHip,
    Joint::LeftKnee,
    Joint::RightKnee,
    Joint::LeftAnkle,
    Joint::RightAnkle,
    Joint::LeftShoulder,
    Joint::RightShoulder,
    Joint::LeftElbow,
    Joint::RightElbow,
];

/// Sequences of two people, [V,3,T], in metres, that begin at rest, and one of a third who never does.
fn write_captures(path: &Path) {
    let body = body();
    let mut builder = Hdf5Builder::new();
    for (name, first_turn) in [
        ("50002_arm", 0.0),
        ("50002_wild", 0.9),
        ("50004_arm", 0.0),
        ("50007_wild", 0.9),
    ] {
        let mut shape = [0.0; SHAPE_COUNT];
        shape[0] = if name.starts_with("50002") { 1.0 } else { -1.0 };
        let shaped = body.shaped(&shape);
        let frames: Vec<Vec<Vec3>> = (0..4)
            .map(|frame| {
                let mut pose = Pose::REST;
                for joint in [Joint::LeftShoulder, Joint::RightHip, Joint::LeftKnee] {
                    pose.parent_from_joint[joint as usize] =
                        DQuat::from_rotation_x(0.1 * f64::from(frame));
                }
                for joint in LIMBS {
                    pose.parent_from_joint[joint as usize] *= DQuat::from_rotation_x(first_turn);
                }
                let matrices = SkinMatrices::new(&pose, &shaped.joints_m);
                let mut world_m = vec![Vec3::ZERO; body.vertex_count()];
                skin_linear(&shaped.positions_m, &body.skin, &matrices, &mut world_m);
                world_m
            })
            .collect();
        let numbers: Vec<f32> = (0..3 * body.vertex_count())
            .flat_map(|at| frames.iter().map(move |frame| frame[at / 3][at % 3]))
            .collect();
        let shape = [body.vertex_count() as u64, 3, 4];
        builder = builder.dataset(DatasetBuilder::typed_data(name, shape, &numbers).unwrap());
    }
    let plan = builder.into_plan().unwrap();
    fs::write(path, plan.encode(WriteOptions::default()).unwrap()).unwrap();
}

#[test]
fn captures_of_several_people_are_listed_fitted_and_gone_on_with() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("captures.h5");
    write_captures(&scans);
    let scans = scans.to_str().unwrap();
    let text = printed(&dynaskin("fit", &["--scans", scans, "--list"]));
    assert!(text.contains("50004_arm [6890, 3, 4] 4 frames"), "{text}");
    let one = folder.path().join("one.npz");
    let usual = [
        "--scans",
        scans,
        "--rate",
        "60",
        "--out",
        one.to_str().unwrap(),
    ];
    refused(
        &dynaskin("fit", &usual),
        &["4 sequences", "--sequence", "50002_arm"],
    );
    let text = printed(&dynaskin(
        "fit",
        &[&usual[..], &["--sequence", "50004_arm"]].concat(),
    ));
    assert!(text.contains("[vertices, 3, frames]"), "{text}");

    let out = folder.path().join("fits");
    let usual = [
        "--scans",
        scans,
        "--rate",
        "60",
        "--out",
        out.to_str().unwrap(),
    ];
    refused(
        &dynaskin("fit-all", &usual),
        &["50007", "begins at rest", "--shape 50007="],
    );
    let people = ["--person", "50002", "--person", "50004"];
    let two = [&usual[..], &people].concat();
    let text = printed(&dynaskin("fit-all", &two));
    assert!(text.contains("50002: shape from 50002_arm"), "{text}");
    assert!(text.contains("3 of 3 sequences are fitted"), "{text}");
    let page = fs::read_to_string(out.join("report.html")).unwrap();
    assert!(
        page.contains("50002_wild") && page.contains("data:image/png"),
        "{page}"
    );
    let clip = out.join("clips/arm__50004.safetensors");
    let data = dynaskin_sim::ClipData::read(&clip).unwrap();
    assert!((data.shape[0] + 1.0).abs() < 0.05, "{:?}", data.shape);

    // One is lost; the others are as they were.
    fs::remove_file(&clip).unwrap();
    let kept = out.join("50002_arm.npz");
    let before = fs::metadata(&kept).unwrap().modified().unwrap();
    let text = printed(&dynaskin("fit-all", &two));
    assert!(text.contains("2 sequences are there already"), "{text}");
    assert!(clip.exists());
    assert_eq!(fs::metadata(&kept).unwrap().modified().unwrap(), before);
    refused(
        &dynaskin("fit-all", &[&two[..], &["--own-surface"]].concat()),
        &["other settings", "--out"],
    );
}

#[test]
fn an_amass_like_file_is_simulated_at_60_hz() {
    let folder = tempfile::tempdir().unwrap();
    let upright = std::f64::consts::FRAC_PI_2;
    let poses: Vec<f64> = (0..13 * 156)
        .map(|i| if i % 156 == 0 { upright } else { 0.0 })
        .collect();
    let mut writer = Writer::create(&folder.path().join("01_02_poses.npz")).unwrap();
    writer.array("poses", &[13, 156], &poses).unwrap();
    writer.array("trans", &[13, 3], &[0.5_f64; 39]).unwrap();
    writer.array("mocap_framerate", &[], &[120.0]).unwrap();
    writer.finish().unwrap();
    let mut writer = Writer::create(&folder.path().join("shape.npz")).unwrap();
    writer.array("betas", &[16], &[0.0; 16]).unwrap();
    writer.finish().unwrap();
    let data = folder.path().join("data");
    let arguments = [
        "--mocap",
        folder.path().to_str().unwrap(),
        "--out",
        data.to_str().unwrap(),
        "--no-mirror",
        "--shapes",
        "1",
    ];
    let text = printed(&dynaskin("simulate", &arguments));
    assert!(text.contains("1 clips written (7 frames"), "{text}");
    // Standing still moves nothing: the world was turned upright.
    let data = fs::read_dir(&data).unwrap().next().unwrap().unwrap().path();
    let clip = dynaskin_sim::ClipData::read(&data).unwrap();
    assert!(clip.offsets_rest_m.iter().all(|x| x.to_f32().abs() < 1e-4));
}

#[test]
fn what_cannot_be_fitted_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("scans.npz");
    write_scans(&scans, &body());
    let (scans, here) = (scans.to_str().unwrap(), folder.path().to_str().unwrap());
    let out = folder.path().join("fit.npz");
    let out = out.to_str().unwrap();
    let fit = |scans: &str, more: &[&str]| {
        dynaskin("fit", &[&["--scans", scans, "--out", out], more].concat())
    };
    let usual = ["--unit", "mm", "--up", "z", "--rate", "60"];
    refused(&fit(scans, &["--unit", "mm"]), &["--rate"]);
    refused(
        &fit(scans, &["--unit", "m", "--rate", "60"]),
        &["frame 0", "--unit"],
    );
    refused(
        &fit(scans, &["--unit", "mm", "--up", "z", "--rate", "0"]),
        &["the frame rate", "1 to 1000 Hz"],
    );
    refused(&fit(here, &usual), &["no .obj or .ply"]);
    refused(
        &fit(
            scans,
            &[&usual[..], &["--clip", "hop.safetensors"]].concat(),
        ),
        &["MOTION__SUBJECT"],
    );
    refused(
        &fit(scans, &[&usual[..], &["--shape", "1,2,3"]].concat()),
        &["--shape"],
    );
    fs::write(folder.path().join("a.npz"), "none").unwrap();
    let broken = folder.path().join("a.npz");
    refused(
        &fit(broken.to_str().unwrap(), &usual),
        &["a.npz", "numpy.savez"],
    );
    assert!(!Path::new(out).exists());
}

#[test]
fn the_check_prints_a_row_for_each_case_and_objective() {
    let text = printed(&dynaskin(
        "fit-check",
        &["--frames", "2", "--case", "static"],
    ));
    assert_eq!(text.matches("| static |").count(), 2, "{text}");
    assert!(
        text.contains("| posed |") && text.contains("| unposed |"),
        "{text}"
    );
}
