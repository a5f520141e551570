//! Plays a motion in AMASS's layout on a SMPL body of your own, both `.npz`, and writes OBJ files.
//!
//! `cargo run --release --example smpl_npz -- BODY_NPZ MOTION_NPZ OUTPUT_FOLDER`
//!
//! SMPL's files come with a licence of their own; none is part of this project. A body file has no
//! networks, so the skin follows the bones and the file's pose correctives alone: a model for it is
//! trained with `dynaskin train`.
#![allow(clippy::print_stdout)]

#[path = "support/obj.rs"]
mod obj;

use std::error::Error;
use std::fs::File;
use std::path::Path;
use std::sync::Arc;

use dynaskin::motion::Amass;
use dynaskin::{Avatar, BodyModel, Model, SHAPE_COUNT};

/// Frames written a second.
const RATE_HZ: f64 = 30.0;

#[allow(dead_code)] // The tests call `run`.
fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [body, motion, out] = arguments.as_slice() else {
        return Err("give a body, a motion and a folder for the meshes".into());
    };
    let frames = run(Path::new(body), Path::new(motion), Path::new(out))?;
    println!("{frames} meshes in {out}");
    Ok(())
}

/// Gives the number of meshes written.
pub fn run(body: &Path, motion: &Path, out: &Path) -> Result<usize, Box<dyn Error>> {
    let body = BodyModel::from_smpl_npz(&std::fs::read(body)?)?;
    let motion = Amass::read(File::open(motion)?)?;
    // The file's coefficients are of SMPL's shape space, as the body's are.
    let mut shape = [0.0_f32; SHAPE_COUNT];
    for (beta, of_file) in shape.iter_mut().zip(&motion.betas) {
        *beta = *of_file as f32;
    }
    let mut avatar = Avatar::new(Arc::new(Model::body_only(Arc::new(body))), &shape)?;
    let clip = motion.clip(avatar.joints_rest_m());
    let faces = avatar.model().body().faces.clone();
    std::fs::create_dir_all(out)?;
    let frames = (clip.duration_seconds() * RATE_HZ) as usize + 1;
    for frame in 0..frames {
        avatar.step(&clip.pose_at(frame as f64 / RATE_HZ), 1.0 / RATE_HZ)?;
        obj::write_frame(out, frame, avatar.skin(), &faces)?;
    }
    Ok(frames)
}
