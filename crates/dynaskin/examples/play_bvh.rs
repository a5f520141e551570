//! Plays a motion file on a model and writes the moving skin as OBJ files, thirty a second.
//!
//! `cargo run --release --example play_bvh -- MODEL_FOLDER MOTION_FILE OUTPUT_FOLDER`
#![allow(clippy::print_stdout)]

#[path = "support/obj.rs"]
mod obj;

use std::error::Error;
use std::path::Path;

use dynaskin::{Avatar, MotionFile, load_model};

/// Frames written a second.
const RATE_HZ: f64 = 30.0;

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [model, motion, out] = arguments.as_slice() else {
        return Err("give a model's folder, a motion file and a folder for the meshes".into());
    };
    let frames = run(Path::new(model), Path::new(motion), Path::new(out))?;
    println!("{frames} meshes in {out}");
    Ok(())
}

/// Gives the number of meshes written.
pub fn run(model: &Path, motion: &Path, out: &Path) -> Result<usize, Box<dyn Error>> {
    let mut avatar = Avatar::new(load_model(model)?, &[0.0; 10])?;
    let read = MotionFile::parse(&std::fs::read(motion)?)?.clip(avatar.joints_rest_m())?;
    // What the file did not say, and what was made of it.
    for note in &read.notes {
        eprintln!("{}: {note}", motion.display());
    }
    let clip = read.clip;
    let faces = avatar.model().body().faces.clone();
    std::fs::create_dir_all(out)?;
    let frames = (clip.duration_seconds() * RATE_HZ) as usize + 1;
    for frame in 0..frames {
        avatar.step(&clip.pose_at(frame as f64 / RATE_HZ), 1.0 / RATE_HZ)?;
        obj::write_frame(out, frame, avatar.skin(), &faces)?;
    }
    Ok(frames)
}
