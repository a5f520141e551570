//! Running the planned jobs over a pool of threads.

use std::collections::HashMap;
use std::fs;
use std::sync::OnceLock;

use dynaskin_body::{REGION_COUNT, Region};
use rayon::prelude::*;
use serde_json::json;

use super::{Job, JobReport, Outcome, Run, RunError};
use crate::dataset::{ClipData, ClipHeader};
use crate::shell::{Shell, ShellError};
use crate::simulate::{ClipLabels, simulate_clip};

/// Number of the simulator's method: a change that alters results raises it, so that clips made
/// before are made anew.
const METHOD: u32 = 2;

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
    fs::create_dir_all(&run.out).map_err(|error| RunError::Io {
        path: run.out.clone(),
        reason: error.to_string(),
    })?;
    Shell::for_body(run.body, &Run::shape(0), &run.settings)?;
    let mut shells: HashMap<usize, OnceLock<Result<Shell, ShellError>>> = HashMap::new();
    for job in jobs {
        shells.entry(job.shape).or_default();
    }
    let reports = jobs
        .par_iter()
        .with_max_len(1)
        .map(|job| {
            let shell = shells[&job.shape]
                .get_or_init(|| Shell::for_body(run.body, &Run::shape(job.shape), &run.settings));
            let outcome = match shell {
                Ok(shell) => one(run, job, shell).unwrap_or_else(Outcome::Failed),
                Err(error) => Outcome::Failed(error.clone().into()),
            };
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

fn one(run: &Run<'_>, job: &Job, shell: &Shell) -> Result<Outcome, RunError> {
    let name = job.name();
    let path = run.out.join(format!("{name}.safetensors"));
    let shape = Run::shape(job.shape);
    let sim_json = json!({
        "method": METHOD,
        "shape": shape,
        "settings": run.settings,
    })
    .to_string();
    if let Ok(header) = ClipHeader::read(&path) {
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
    let mut clip = job.motion.clip(&run.body.shaped(&shape).joints_m)?;
    clip.frames.truncate(job.frames);
    if job.mirrored {
        clip = clip.mirrored();
    }
    let labels = ClipLabels {
        name: name.clone(),
        body_sha256: run.body_sha256.to_owned(),
        seed: run.seed,
        shape,
        sim_json,
    };
    let simulated = simulate_clip(shell, &clip, &run.settings, labels)?;
    simulated.data.write(&path)?;
    Ok(Outcome::Written {
        substeps: simulated.substeps,
        largest_m: largest_per_region(run, &simulated.data),
    })
}

/// Largest offset in metres over all frames, among the vertices that are mostly of each region.
fn largest_per_region(run: &Run<'_>, clip: &ClipData) -> [f32; REGION_COUNT] {
    let mut largest = [0.0_f32; REGION_COUNT];
    for (slot, vertex) in clip.vertices.iter().enumerate() {
        let weight = |region: Region| run.body.region_weights[region as usize][*vertex as usize];
        let Some(region) = Region::ALL.into_iter().find(|region| weight(*region) > 0.5) else {
            continue;
        };
        for frame in 0..clip.frame_count() {
            let size = clip.offset_rest_m(frame, slot).length();
            largest[region as usize] = largest[region as usize].max(size);
        }
    }
    largest
}
