//! Binds files and prints what was found, and the time it took: `bind_files BODY.glb AVATAR...`.

// It prints what it measures.
#![allow(clippy::print_stdout)]

use std::time::Instant;

use dynaskin_bind::{Avatar, BindOptions, bind};
use dynaskin_body::BodyModel;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut paths = std::env::args().skip(1);
    let body = paths.next().ok_or("the first argument is a body.glb")?;
    let body = BodyModel::from_glb(&std::fs::read(body)?)?;
    for path in paths {
        let bytes = std::fs::read(&path)?;
        let start = Instant::now();
        let bound =
            Avatar::from_glb(&bytes).and_then(|avatar| bind(&avatar, &body, &BindOptions::adult()));
        let seconds = start.elapsed().as_secs_f64();
        match bound {
            Err(error) => println!("{path}: {error}"),
            Ok(bound) => {
                let report = &bound.binding.report;
                println!(
                    "{path}: {} vertices, {} move, within 2 cm {:.3}, median {:.1} mm, size {:.3}, shape {:.1?}, \
                     crown {:.3}, hips {:.3}, stature {:.2?} m, {} bytes, {seconds:.3} s",
                    report.vertices,
                    report.moving,
                    report.share_close,
                    1e3 * report.median_m,
                    bound.binding.size,
                    bound.binding.shape,
                    report.proportions.crown_to_shoulder,
                    report.proportions.hip_height,
                    report.proportions.stature_m,
                    bound.binding.to_bytes().len(),
                );
                println!(
                    "  off {:?}; twice {:?}; notes {:?}; missing {:?}",
                    report.regions_off, report.double_motion, report.notes, report.missing
                );
            }
        }
    }
    Ok(())
}
