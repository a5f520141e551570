//! A data set from plan to files: deterministic, resumable, on a whole figure.

// A failed step of a test is a failed test.
#![allow(clippy::unwrap_used)]

#[path = "common/figure.rs"]
mod figure;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use dynaskin_body::{BodyModel, Region};
use dynaskin_motion::{ReadOptions, UpAxis};
use dynaskin_sim::{
    ClipData, Job, Motion, Outcome, Run, RunError, Shell, SimSettings, captures, execute,
    procedurals,
};

fn run<'a>(body: &'a BodyModel, out: &Path) -> Run<'a> {
    Run {
        body,
        body_sha256: "test",
        settings: SimSettings::default(),
        seed: 1,
        out: out.to_owned(),
        limit_frames: Some(90),
        mirrored: true,
        vary_materials: true,
        further_shapes: true,
        vary_rigs: true,
        shapes: 7,
    }
}

fn two_motions() -> Vec<Motion> {
    let names = ["hop-190-090", "twist-100-050"];
    procedurals()
        .into_iter()
        .filter(|motion| names.contains(&motion.name()))
        .collect()
}

fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    fs::read_dir(folder)
        .unwrap()
        .map(|entry| {
            let path = entry.unwrap().path();
            (
                path.file_name().unwrap().display().to_string(),
                fs::read(path).unwrap(),
            )
        })
        .collect()
}

fn execute_with(threads: usize, run: &Run<'_>, jobs: &[Job]) -> Vec<Outcome> {
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .unwrap();
    let reports = pool.install(|| execute(run, jobs, |_| {})).unwrap();
    reports.into_iter().map(|report| report.outcome).collect()
}

#[test]
fn files_depend_on_no_thread_count_and_finished_ones_are_kept() {
    let body = figure::figure();
    let (one, two) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let first = run(&body, one.path());
    let second = run(&body, two.path());
    let jobs = first.plan(&two_motions()).unwrap();
    // Two motions on three training shapes each.
    assert!(jobs.len() >= 6, "{}", jobs.len());
    let varied = jobs
        .iter()
        .filter(|job| !job.materials.is_nominal())
        .count();
    assert!(
        varied > 0 && varied < jobs.len(),
        "{varied} of {}",
        jobs.len()
    );
    for outcome in execute_with(1, &first, &jobs) {
        assert!(matches!(outcome, Outcome::Written { .. }), "{outcome:?}");
    }
    execute_with(3, &second, &jobs);
    assert!(
        files(one.path()) == files(two.path()),
        "files differ between 1 and 3 threads"
    );

    // A second run keeps everything but what is missing or damaged.
    let names: Vec<String> = jobs.iter().map(Job::name).collect();
    let path = |k: usize| one.path().join(format!("{}.safetensors", names[k]));
    fs::remove_file(path(0)).unwrap();
    fs::write(path(1), b"half a fi").unwrap();
    let left = one.path().join(".killed.safetensors-1a2b3c.part");
    fs::write(&left, b"half a fi").unwrap();
    let outcomes = execute_with(2, &first, &jobs);
    for (k, outcome) in outcomes.iter().enumerate() {
        assert_eq!(matches!(outcome, Outcome::Kept), k > 1, "{k}: {outcome:?}");
        // A damaged clip is made again, which replaces nothing.
        let replaces = matches!(outcome, Outcome::Written { replaced: true, .. });
        assert!(!replaces, "{k}: {outcome:?}");
    }
    assert!(
        files(one.path()) == files(two.path()),
        "resuming gives the same files"
    );
    assert!(!left.exists(), "what a killed run left is gone");

    // Other settings make them anew.
    let mut stiffer = run(&body, one.path());
    stiffer.settings.tissues[1].shear_modulus_pa *= 2.0;
    let outcomes = execute_with(2, &stiffer, &jobs[..1]);
    assert!(matches!(
        outcomes[0],
        Outcome::Written { replaced: true, .. }
    ));
}

#[test]
fn a_hop_moves_the_tissue_by_centimetres_and_standing_still_by_nothing() {
    let body = figure::figure();
    let folder = tempfile::tempdir().unwrap();
    let mut run = run(&body, folder.path());
    run.limit_frames = Some(240);
    let motions = two_motions();
    let jobs: Vec<Job> = run
        .plan(&motions[..1])
        .unwrap()
        .into_iter()
        .take(1)
        .collect();
    let outcomes = execute_with(1, &run, &jobs);
    let Outcome::Written { largest_m, .. } = &outcomes[0] else {
        panic!("{outcomes:?}");
    };
    assert!(
        (0.005..0.15).contains(&largest_m[Region::Belly as usize]),
        "{largest_m:?}"
    );
    let path = folder
        .path()
        .join(format!("{}.safetensors", jobs[0].name()));
    let clip = ClipData::read(&path).unwrap();
    assert_eq!(clip.frame_count(), 240);
    let shell = Shell::for_body(&body, &clip.shape, &run.settings).unwrap();
    assert_eq!(clip.vertices, shell.vertices());
    // The motion starts with standing still in nearly the rest pose: tissue rests there too.
    let largest = |frame: usize| {
        (0..clip.vertices.len())
            .map(|slot| clip.offset_rest_m(frame, slot).length())
            .fold(0.0, f32::max)
    };
    assert!(largest(10) < 0.004, "{}", largest(10));
    assert!((0..240).any(|frame| largest(frame) > 0.01));
}

#[test]
fn missing_captures_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("nowhere");
    let error = captures(&missing, &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, RunError::Io { .. }) && error.to_string().contains("nowhere"));
    let error = captures(folder.path(), &ReadOptions::default()).unwrap_err();
    assert!(matches!(error, RunError::NoCaptures { .. }), "{error}");

    fs::write(folder.path().join("bad.bvh"), "HIERARCHY\nROOT").unwrap();
    let mut options = ReadOptions::default();
    options.name_joint("left_hip", "LThigh").unwrap();
    options.rate_hz = Some(30.0);
    let Motion::Capture { options: own, .. } = &captures(folder.path(), &options).unwrap()[0]
    else {
        panic!("a capture");
    };
    assert_eq!(*own, options);
    options.up = Some(UpAxis::Y);
    let error = captures(folder.path(), &options).unwrap_err();
    assert!(
        error.to_string().contains("--up is for npz files"),
        "{error}"
    );
    let body = figure::figure();
    let run = run(&body, folder.path());
    let error = run
        .plan(&captures(folder.path(), &ReadOptions::default()).unwrap())
        .unwrap_err();
    assert!(error.to_string().contains("bad"), "{error}");
}
