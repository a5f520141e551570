//! How far the poses of motion files are from those of a control, for `scripts/exporters.mjs`.
//!
//! ```sh
//! cargo run -p dynaskin-motion --example compare_motions -- BODY.glb CONTROL FILE...
//! ```
//!
//! `named=FILE` reads a file with every joint named by the caller as SMPL names it.
//!
//! Prints a line for each file: the largest rotation difference of a joint in degrees, the joint, the
//! time in seconds, the largest distance of the root in millimetres, the file's keys a second and its
//! name, with tabs between. A file and the control are compared at the keys of the one with fewer.
//! A file that is refused has `refused` and the error. The exit code is 1 where a file is refused or
//! differs by more than 0.1 degrees.

#![allow(clippy::print_stdout)]

use std::error::Error;
use std::process::ExitCode;

use dynaskin_body::{BodyModel, JOINT_COUNT, Joint, SHAPE_COUNT};
use dynaskin_motion::{Clip, MotionFile, ReadOptions};
use glam::{DQuat, Vec3};

const LIMIT_DEGREES: f64 = 0.1;
const MM_PER_M: f64 = 1000.0;

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [body, control, files @ ..] = &arguments[..] else {
        return Err("usage: compare_motions BODY.glb CONTROL FILE...".into());
    };
    let body = BodyModel::from_glb(&std::fs::read(body)?)?;
    let rest_m = body.shaped(&[0.0; SHAPE_COUNT]).joints_m;
    let control = read(control, false, &rest_m)?.0;
    let mut all_same = true;
    for file in files {
        let (file, is_named) = match file.strip_prefix("named=") {
            Some(file) => (file, true),
            None => (file.as_str(), false),
        };
        match read(file, is_named, &rest_m) {
            Ok((clip, notes)) => {
                let found = Difference::new(&clip, &control);
                all_same &= found.degrees <= LIMIT_DEGREES;
                println!(
                    "{:.4}\t{}\t{:.3}\t{:.2}\t{:.3}\t{file}",
                    found.degrees,
                    found.joint.name(),
                    found.seconds,
                    found.root_mm,
                    clip.rate_hz,
                );
                for note in notes {
                    eprintln!("{file}: {note}");
                }
            }
            Err(error) => {
                all_same = false;
                println!("refused\t{error}\t\t\t\t{file}");
            }
        }
    }
    Ok(ExitCode::from(u8::from(!all_same)))
}

fn read(
    path: &str,
    is_named: bool,
    rest_m: &[Vec3; JOINT_COUNT],
) -> Result<(Clip, Vec<String>), Box<dyn Error>> {
    let mut options = ReadOptions::default();
    if is_named {
        for joint in Joint::ALL {
            options.name_joint(joint.name(), joint.name())?;
        }
    }
    let found = MotionFile::parse_with(&std::fs::read(path)?, &options)?.clip(rest_m)?;
    Ok((found.clip, found.notes))
}

struct Difference {
    degrees: f64,
    joint: Joint,
    seconds: f64,
    root_mm: f64,
}

impl Difference {
    fn new(clip: &Clip, control: &Clip) -> Self {
        let coarser = if clip.rate_hz < control.rate_hz {
            clip
        } else {
            control
        };
        let mut worst = Self {
            degrees: 0.0,
            joint: Joint::Pelvis,
            seconds: 0.0,
            root_mm: 0.0,
        };
        for frame in 0..coarser.frames.len() {
            let seconds = frame as f64 / coarser.rate_hz;
            let [own, expected] = [clip, control].map(|clip| clip.pose_at(seconds));
            let apart_m = own.root_translation_m.distance(expected.root_translation_m);
            worst.root_mm = worst.root_mm.max(MM_PER_M * apart_m);
            for joint in Joint::ALL {
                let [own, expected] =
                    [&own, &expected].map(|pose| pose.parent_from_joint[joint as usize]);
                let degrees = turn_degrees(own, expected);
                if degrees > worst.degrees {
                    (worst.degrees, worst.joint, worst.seconds) = (degrees, joint, seconds);
                }
            }
        }
        worst
    }
}

/// By the sine of half the angle, which small turns do not lose.
fn turn_degrees(a: DQuat, b: DQuat) -> f64 {
    let between = a.inverse() * b;
    2.0 * between.xyz().length().atan2(between.w.abs()).to_degrees()
}
