//! What conditioning adds to a step.

use std::sync::Arc;
use std::time::Instant;

use anyhow::Result;
use dynaskin_runtime::{Avatar, Model, PoseSource};

use dynaskin_pose_sources::Frame;

/// Steps that are timed together.
const BLOCK: usize = 20;
const ROUNDS: usize = 40;

/// Median seconds of a step on `frames` with and without conditioning, taken in turns.
pub fn seconds(model: &Arc<Model>, source: PoseSource, frames: &[Frame]) -> Result<[f64; 2]> {
    let sources = [source, PoseSource::AsGiven];
    let mut avatars = Vec::new();
    for source in sources {
        let mut avatar = Avatar::new(Arc::clone(model), &[0.0; 10])?;
        avatar.set_pose_source(source);
        avatars.push(avatar);
    }
    let mut times: [Vec<f64>; 2] = Default::default();
    let mut frames = frames.iter().cycle();
    for _ in 0..ROUNDS {
        let block: Vec<&Frame> = frames.by_ref().take(BLOCK).collect();
        for (avatar, times) in avatars.iter_mut().zip(&mut times) {
            let start = Instant::now();
            for frame in &block {
                avatar.step(&frame.pose, frame.dt_seconds)?;
            }
            times.push(start.elapsed().as_secs_f64() / BLOCK as f64);
        }
    }
    Ok(times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    }))
}
