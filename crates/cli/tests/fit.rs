//! `dynaskin fit` and AMASS-like motions as a user meets them.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

#[path = "common/captures.rs"]
mod captures;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use dynaskin_body::{BodyModel, Joint, Pose, SHAPE_COUNT, SkinMatrices, skin_linear};
use dynaskin_npz::Writer;
use glam::{DQuat, DVec3, Vec3};

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

/// Sequences of two people that begin at rest, and one of a third who never does.
fn write_captures(path: &Path) {
    let body = body();
    let made = |name: &str, is_at_rest: bool| {
        let beta = if name.starts_with("50002") { 1.0 } else { -1.0 };
        let frames = (0..4).map(|frame| {
            let turn = DQuat::from_rotation_x(0.1 * f64::from(frame));
            let mut pose = Pose::REST;
            for joint in [Joint::LeftShoulder, Joint::RightHip, Joint::LeftKnee] {
                pose.parent_from_joint[joint as usize] = turn;
            }
            if !is_at_rest {
                captures::leave_rest(&mut pose);
            }
            captures::scan_m(&body, beta, &pose, |_| Vec3::ZERO)
        });
        (name.to_owned(), frames.collect())
    };
    captures::write(
        path,
        &[
            made("50002_arm", true),
            made("50002_wild", false),
            made("50004_arm", true),
            made("50007_wild", false),
        ],
    );
}

#[test]
fn captures_of_several_people_are_listed_fitted_and_gone_on_with() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("captures.h5");
    write_captures(&scans);
    let scans = scans.to_str().unwrap();
    let text = printed(&dynaskin("fit", &["--scans", scans, "--list"]));
    assert!(text.contains("50004_arm [6890, 3, 4] 4 frames"), "{text}");
    let of_folder = folder.path().to_str().unwrap();
    let of_folder = printed(&dynaskin("fit", &["--scans", of_folder, "--list"]));
    assert!(of_folder.starts_with(scans), "{of_folder}");
    assert_eq!(of_folder.lines().count(), 1 + text.lines().count());
    assert!(
        of_folder.contains("50004_arm [6890, 3, 4] 4 frames"),
        "{of_folder}"
    );
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
    // One who is never at rest stops nobody else, and is told in the end.
    let all = dynaskin("fit-all", &usual);
    refused(
        &all,
        &[
            "1 of 4 sequences",
            "50007_wild",
            "begins at rest",
            "--shape 50007=",
        ],
    );
    let text = String::from_utf8_lossy(&all.stdout);
    assert!(text.contains("50002: shape from 50002_arm"), "{text}");
    assert!(text.contains("3 of 4 sequences are fitted"), "{text}");
    // A log has no bar.
    assert!(text.contains("4 of 4 sequences done"), "{text}");
    assert!(text.contains("[vertices, 3, frames]"), "{text}");
    let people = ["--person", "50002", "--person", "50004"];
    let two = [&usual[..], &people].concat();
    let text = printed(&dynaskin("fit-all", &two));
    assert!(text.contains("3 sequences are there already"), "{text}");
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
    let without = |name| [&two[..], &["--leave-out", name]].concat();
    let text = printed(&dynaskin("fit-all", &without("50004_arm")));
    assert!(
        text.contains("arm__50004.safetensors is taken away"),
        "{text}"
    );
    assert!(text.contains("2 of 2 sequences are fitted"), "{text}");
    assert!(!clip.exists() && out.join("50004_arm.npz").exists());
    refused(
        &dynaskin("fit-all", &without("50004_hop")),
        &["--leave-out 50004_hop", "no such sequence"],
    );
    refused(
        &dynaskin("fit-all", &[&two[..], &["--own-surface"]].concat()),
        &[
            "other settings (own-surface: false; now own-surface: true)",
            "--out",
        ],
    );
}

#[test]
fn settings_of_which_no_fit_came_keep_nobody_from_others() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("scans");
    fs::create_dir(&scans).unwrap();
    write_scans(&scans.join("anna_arm.npz"), &body());
    let out = folder.path().join("fits");
    let [scans, out] = [&scans, &out].map(|path| path.to_str().unwrap());
    let usual = ["--scans", scans, "--out", out, "--joints", "body"];
    refused(
        &dynaskin("fit-all", &[&usual[..], &["--rate", "0"]].concat()),
        &["--rate", "expected 1 to 1000"],
    );
    assert!(!Path::new(out).exists());
    let usual = [&usual[..], &["--rate", "60"]].concat();
    refused(
        &dynaskin("fit-all", &[&usual[..], &["--unit", "m"]].concat()),
        &["anna_arm", "--unit"],
    );
    let text = printed(&dynaskin("fit-all", &usual));
    assert!(text.contains("sequences in millimetres, z up: 1"), "{text}");
    assert!(text.contains("1 of 1 sequences"), "{text}");
    refused(
        &dynaskin("fit-all", &[&usual[..], &["--unit", "mm"]].concat()),
        &["unit: as found; now unit: mm"],
    );
    let list = ["--scans", scans, "--list"];
    assert!(printed(&dynaskin("fit", &list)).contains("anna_arm.npz"));
    let one = format!("{scans}/anna_arm.npz");
    let list = ["--scans", one.as_str(), "--list"];
    assert!(printed(&dynaskin("fit", &list)).contains("anna_arm.npz 3 frames"));
}

/// Names and contents of the files of a folder and the folders in it.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut waiting = vec![folder.to_owned()];
    while let Some(next) = waiting.pop() {
        for entry in fs::read_dir(&next).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                waiting.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap().to_owned();
                found.insert(name, fs::read(path).unwrap());
            }
        }
    }
    found
}

#[cfg(unix)]
#[test]
fn parts_on_many_machines_give_what_one_run_gives() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("captures.h5");
    write_captures(&scans);
    let fit_all = |out: &str, more: &[&str]| {
        let out = folder.path().join(out);
        let mut command = Command::new(env!("CARGO_BIN_EXE_dynaskin"));
        command.arg("fit-all").arg("--body").arg(body_path());
        command.arg("--scans").arg(&scans).arg("--out").arg(out);
        command.args(["--rate", "60", "--person", "50002", "--person", "50004"]);
        command.args(more);
        command
    };
    printed(&fit_all("one", &[]).output().unwrap());

    // As Slurm and Kubernetes count; both at the same time.
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scripts/part.sh");
    let part = |index: usize| {
        let whole = fit_all("parts", &[]);
        let mut command = Command::new("sh");
        command
            .arg(&script)
            .arg(whole.get_program())
            .args(whole.get_args());
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        match index {
            0 => command.envs([
                ("SLURM_ARRAY_TASK_ID", "1"),
                ("SLURM_ARRAY_TASK_COUNT", "2"),
            ]),
            _ => command.envs([("JOB_COMPLETION_INDEX", "1"), ("PARTS", "2")]),
        };
        command.spawn().unwrap()
    };
    for (part, count) in [part(0), part(1)].into_iter().zip([1, 2]) {
        let text = printed(&part.wait_with_output().unwrap());
        let words = format!("{count} of {count} sequences are fitted in this part");
        assert!(text.contains(&words), "{text}");
    }
    let [one, parts] = ["one", "parts"].map(|out| contents(&folder.path().join(out)));
    let missing: Vec<_> = one
        .keys()
        .filter(|name| !parts.contains_key(*name))
        .collect();
    assert_eq!(missing, [Path::new("report.html")]);
    for (name, bytes) in &parts {
        assert!(one.get(name) == Some(bytes), "{} differs", name.display());
    }
    let text = printed(&fit_all("parts", &[]).output().unwrap());
    assert!(text.contains("3 sequences are there already"), "{text}");
    assert!(folder.path().join("parts/report.html").exists());

    // A whole run and a part do not mix, and neither do shapes.
    let lock = dynaskin_files::FolderLock::take(&folder.path().join("parts")).unwrap();
    let shard = fit_all("parts", &["--shard", "1/2"]).output().unwrap();
    refused(&shard, &["in use by another run"]);
    drop(lock);
    let other = ["--shard", "1/2", "--shape", "50004=0,0,0,0,0,0,0,0,0,0"];
    refused(
        &fit_all("parts", &other).output().unwrap(),
        &["50004 has another shape"],
    );
    refused(
        &fit_all("x", &["--shard", "3/2"]).output().unwrap(),
        &["expected I/N"],
    );
    fs::write(folder.path().join("parts/people/50004.json"), "{").unwrap();
    refused(
        &fit_all("parts", &[]).output().unwrap(),
        &["50004.json", "remove it"],
    );
}

/// Two people of two sequences each, long enough to be killed in.
fn write_long_captures(path: &Path) {
    let body = body();
    let sequences = ["50002_arm", "50002_leg", "50004_arm", "50004_leg"].map(|name| {
        let beta = if name.starts_with("50002") { 1.0 } else { -1.0 };
        let frames = (0..24).map(|frame| {
            let mut pose = Pose::REST;
            let turn = DQuat::from_rotation_z(0.02 * f64::from(frame));
            let joint = match name.ends_with("arm") {
                true => Joint::LeftElbow,
                false => Joint::RightHip,
            };
            pose.parent_from_joint[joint as usize] = turn;
            captures::scan_m(&body, beta, &pose, |_| Vec3::ZERO)
        });
        (name.to_owned(), frames.collect())
    });
    captures::write(path, &sequences);
}

/// Fits written whole in a folder: the clip of a sequence is written last.
#[cfg(unix)]
fn clips_of(out: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(out.join("clips")).into_iter().flatten();
    let paths = entries.map(|entry| entry.unwrap().path());
    paths
        .filter(|path| path.extension().is_some_and(|end| end == "safetensors"))
        .collect()
}

#[cfg(unix)]
fn has_half_written_fit(out: &Path) -> bool {
    let entries = fs::read_dir(out).into_iter().flatten();
    let names = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    names.into_iter().any(|name| name.contains(".npz."))
}

#[cfg(unix)]
#[test]
fn a_killed_run_loses_nothing_but_the_sequence_in_work() {
    use std::os::unix::process::ExitStatusExt as _;

    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("captures.h5");
    write_long_captures(&scans);
    let fit_all = |out: &Path| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_dynaskin"));
        command.arg("fit-all").arg("--body").arg(body_path());
        command.arg("--scans").arg(&scans).arg("--out").arg(out);
        command.args(["--rate", "60", "--jobs", "1"]);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    };
    let whole = folder.path().join("whole");
    printed(&fit_all(&whole).output().unwrap());
    let whole = contents(&whole);

    let out = folder.path().join("killed");
    // Killed (SIGKILL) as soon as it is so far.
    let killed_when = |so_far: &dyn Fn() -> bool| {
        let mut child = fit_all(&out).spawn().unwrap();
        while !so_far() {
            let ended = child.try_wait().unwrap();
            assert!(ended.is_none(), "it ended before it was so far");
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        child.kill().unwrap();
        assert_eq!(child.wait().unwrap().signal(), Some(9));
    };
    // Before any person has a shape, and in the first, third and last sequence.
    killed_when(&|| out.join("settings.txt").exists());
    for finished in [0, 2, 3] {
        killed_when(&|| clips_of(&out).len() >= finished && has_half_written_fit(&out));
        // What is there is whole.
        let names = |path: &Path| path.extension().is_some_and(|end| end != "part");
        for (name, bytes) in contents(&out).iter().filter(|(name, _)| names(name)) {
            assert!(whole.get(name) == Some(bytes), "{} differs", name.display());
        }
    }
    let clips = clips_of(&out);
    assert!(clips.len() >= 3, "{clips:?}");
    let written = |clip: &PathBuf| fs::metadata(clip).unwrap().modified().unwrap();
    let before: Vec<_> = clips.iter().map(written).collect();
    let text = printed(&fit_all(&out).output().unwrap());
    let kept = format!("{} sequences are there already", clips.len());
    assert!(text.contains(&kept), "{text}");
    assert!(text.contains("4 of 4 sequences are fitted"), "{text}");
    assert_eq!(clips.iter().map(written).collect::<Vec<_>>(), before);
    // Nothing is missing and nothing is left over.
    assert!(contents(&out) == whole, "{:?}", contents(&out).keys());
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
        &["--rate", "expected 1 to 1000"],
    );
    refused(
        &fit(scans, &[&usual[..], &["--jobs", "1000000"]].concat()),
        &["--jobs"],
    );
    // Before the minutes of a fit.
    let into_folder = ["--scans", scans, "--out", here, "--overwrite"];
    refused(
        &dynaskin("fit", &[&into_folder[..], &usual].concat()),
        &[here, "it is a folder"],
    );
    let below_file = format!("{scans}/fit.npz");
    let into_file = ["--scans", scans, "--out", below_file.as_str()];
    refused(
        &dynaskin("fit", &[&into_file[..], &usual].concat()),
        &["scans.npz", "file"],
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
    assert_eq!(text.matches("| static |").count(), 4, "{text}");
    assert!(
        text.contains("| posed |") && text.contains("| unposed |"),
        "{text}"
    );
}
