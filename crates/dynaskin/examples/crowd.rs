//! Steps a crowd that jumps and runs, each avatar a different body at its own distance.
//!
//! `cargo run --release --example crowd -- MODEL_FOLDER NUMBER`
#![allow(clippy::print_stdout)]

use std::error::Error;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use dynaskin::motion::{Procedural, ProceduralKind};
use dynaskin::{Avatar, Clip, Crowd, CrowdReport, LevelOfDetail, MODEL_RATE_HZ, Pose, load_model};

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [model, number] = arguments.as_slice() else {
        return Err("give a model's folder and the number of avatars".into());
    };
    const STEPS: usize = 300;
    let start = Instant::now();
    let (report, _) = run(Path::new(model), number.parse()?, STEPS)?;
    let CrowdReport {
        full, half, asleep, ..
    } = report;
    println!("{full} avatars at full detail, {half} at half, {asleep} asleep");
    let milliseconds = start.elapsed().as_secs_f64() * 1000.0 / STEPS as f64;
    println!("{milliseconds:.2} ms a step of 1/60 s, loading the model included");
    Ok(())
}

/// Steps `number` avatars `steps` times. Gives the last report, and each avatar's longest offset in
/// metres.
pub fn run(
    model: &Path,
    number: usize,
    steps: usize,
) -> Result<(CrowdReport, Vec<f32>), Box<dyn Error>> {
    let model = load_model(model)?;
    let mut crowd = Crowd::new(Arc::clone(&model))?;
    crowd.set_level_of_detail(Some(LevelOfDetail::default()))?;
    let (mut avatars, mut clips) = (Vec::new(), Vec::<Clip>::new());
    for index in 0..number {
        // From lean to heavy, each three metres behind the one before.
        let mut shape = [0.0; 10];
        shape[1] = (index % 5) as f32 - 2.0;
        let mut avatar = Avatar::new(Arc::clone(&model), &shape)?;
        avatar.set_distance_m(3.0 * (index + 1) as f64)?;
        let kind = [ProceduralKind::Jump, ProceduralKind::RunInPlace][index % 2];
        clips.push(Procedural::new(kind).clip(avatar.joints_rest_m())?);
        avatars.push(avatar);
    }
    let mut report = CrowdReport::default();
    for step in 0..steps {
        let seconds = step as f64 / MODEL_RATE_HZ;
        let poses: Vec<Pose> = clips
            .iter()
            .map(|clip| clip.pose_at(seconds % clip.duration_seconds()))
            .collect();
        let mut all: Vec<&mut Avatar> = avatars.iter_mut().collect();
        report = crowd.step_all(&mut all, &poses, 1.0 / MODEL_RATE_HZ, &mut || 0.0)?;
    }
    let longest_m = avatars.iter().map(|avatar| {
        let offsets_m = avatar.offsets_rest_m().iter();
        offsets_m
            .map(|offset_m| offset_m.length())
            .fold(0.0, f32::max)
    });
    Ok((report, longest_m.collect()))
}
