//! Running the planned jobs over a pool of threads.

use std::fs;
use std::io::ErrorKind;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;
use serde_json::json;

use super::error::RunError;
use super::{Job, JobReport, Outcome, Run};
use crate::calibration::largest_offsets;
use crate::dataset::{ClipHeader, DatasetError};
use crate::shell::Shell;
use crate::simulate::{ClipLabels, simulate_clip};

/// Number of the simulator's method: a change that alters results raises it, so that clips made
/// before are made anew.
const METHOD: u32 = 4;

/// Simulates all jobs on rayon's current pool and calls `done` after each, from any thread.
/// Reports come back in the order of the jobs; files do not depend on the number of threads.
///
/// # Errors
/// [`RunError::Io`] if the folder cannot be made, [`RunError::Shell`] if the body has no soft
/// tissue. A failing clip is no error here: its report tells.
pub fn execute(
    run: &Run<'_>,
    jobs: &[Job],
    done: impl Fn(&JobReport) + Sync,
) -> Result<Vec<JobReport>, RunError> {
    let unusable = |reason: String| RunError::Io {
        path: run.out.clone(),
        reason,
    };
    fs::create_dir_all(&run.out).map_err(|error| unusable(dynaskin_files::reason(&error)))?;
    dynaskin_files::remove_leftovers(&run.out).map_err(|error| unusable(error.to_string()))?;
    Shell::for_body(run.body, &Run::shape(0), &run.settings)?;
    // A full disk fails every clip: once it is known, no more time is spent.
    let disk_full = AtomicBool::new(false);
    let reports = jobs
        .par_iter()
        .with_max_len(1)
        .map(|job| {
            let outcome = if disk_full.load(Ordering::Relaxed) {
                Outcome::Failed(RunError::DiskFull {
                    path: clip_path(run, job),
                })
            } else {
                one(run, job).unwrap_or_else(Outcome::Failed)
            };
            if matches!(outcome, Outcome::Failed(RunError::DiskFull { .. })) {
                disk_full.store(true, Ordering::Relaxed);
            }
            let report = JobReport {
                name: job.name(),
                frames: job.frames,
                outcome,
            };
            done(&report);
            report
        })
        .collect();
    Ok(reports)
}

fn clip_path(run: &Run<'_>, job: &Job) -> PathBuf {
    run.out.join(format!("{}.safetensors", job.name()))
}

fn one(run: &Run<'_>, job: &Job) -> Result<Outcome, RunError> {
    let name = job.name();
    let path = clip_path(run, job);
    let shape = Run::shape(job.shape);
    let sim_json = json!({
        "method": METHOD,
        "shape": shape,
        "materials": job.materials,
        "rig": job.rig,
        "settings": run.settings,
    })
    .to_string();
    let earlier = ClipHeader::read(&path);
    let replaced = earlier.is_ok();
    if let Ok(header) = earlier {
        if header.body_sha256 != run.body_sha256 {
            return Err(RunError::OtherBody { path });
        }
        if header.sim_json == sim_json
            && header.seed == run.seed
            && header.frame_count == job.frames
        {
            return Ok(Outcome::Kept);
        }
    }
    let joints_rest_m = run.body.shaped(&shape).joints_m;
    let clip = job.motion.clip(&joints_rest_m)?;
    let mut clip = job.rig.applied(&clip, &joints_rest_m);
    clip.frames.truncate(job.frames);
    if job.mirrored {
        clip = clip.mirrored();
    }
    let labels = ClipLabels {
        name: name.clone(),
        body_sha256: run.body_sha256.to_owned(),
        seed: run.seed,
        shape,
        materials: job.materials,
        sim_json,
    };
    let settings = run.settings.with_materials(&job.materials);
    let shell = Shell::for_body(run.body, &shape, &settings)?;
    let simulated = simulate_clip(&shell, &clip, &settings, labels)?;
    simulated.data.write(&path).map_err(|error| match error {
        DatasetError::Io { source, .. } if is_full(&source) => RunError::DiskFull { path },
        other => other.into(),
    })?;
    Ok(Outcome::Written {
        substeps: simulated.substeps,
        largest_m: largest_offsets(run.body, &simulated.data).map(|largest| largest.metres),
        replaced,
    })
}

fn is_full(error: &std::io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge
    )
}
