//! How sudden bodies are: figures of captures, beside which the limits of cuts stand.

use std::path::PathBuf;

use anyhow::Result;
use dynaskin_body::{JOINT_COUNT, Pose};
use dynaskin_conditioning::{Conditioner, SNAP_TURN_RAD_S, Suddenness};
use glam::Vec3;

use crate::truths;

const RATES_HZ: [f64; 6] = [24.0, 30.0, 60.0, 72.0, 90.0, 120.0];

/// Frames between two starts that are tried.
const STRIDE: usize = 5;

#[derive(Clone, Copy, Default)]
struct Most {
    sudden: Suddenness,
    /// Smallest share of a change of the pelvis above the limit in which a joint joined.
    share: f64,
    starts: usize,
    false_starts: usize,
}

/// Prints the largest figures of all `clips` at every rate.
pub fn print(clips: &[PathBuf], joints_rest_m: &[Vec3; JOINT_COUNT]) -> Result<()> {
    let mut most = [Most {
        share: f64::INFINITY,
        ..Most::default()
    }; RATES_HZ.len()];
    for path in clips {
        let truth = truths::capture(path, joints_rest_m, f64::INFINITY)?;
        for (rate, most) in RATES_HZ.into_iter().zip(&mut most) {
            let poses: Vec<Pose> = (0..(truth.seconds * rate) as usize)
                .map(|frame| truth.at(frame as f64 / rate))
                .collect();
            for poses in poses.windows(3) {
                most.see(Suddenness::of(
                    [&poses[0], &poses[1], &poses[2]],
                    1.0 / rate,
                ));
            }
            for start in (0..poses.len()).step_by(STRIDE) {
                most.starts += 1;
                most.false_starts += usize::from(cuts(&poses[start..], rate));
            }
        }
    }
    println!(
        "Largest change of velocity from one pose to the next in {} captures; the smallest share of a \
         change of the pelvis of {SNAP_TURN_RAD_S} rad/s and more in which a joint joined; false cuts \
         where a motion starts at every fifth pose.\n",
        clips.len()
    );
    println!("| rate | root m/s | pelvis rad/s | joints rad/s | share | false cuts of starts |");
    println!("|--:|--:|--:|--:|--:|--:|");
    for (rate, most) in RATES_HZ.into_iter().zip(most) {
        let sudden = most.sudden;
        println!(
            "| {rate} Hz | {:.2} | {:.1} | {:.1} | {:.2} | {} of {} |",
            sudden.root_m_s,
            sudden.pelvis_rad_s,
            sudden.joints_rad_s,
            most.share,
            most.false_starts,
            most.starts
        );
    }
    Ok(())
}

/// Whether there is a cut within half a second of a motion that starts with these poses.
fn cuts(poses: &[Pose], rate: f64) -> bool {
    let mut conditioner = Conditioner::default();
    let poses = poses.iter().take((0.5 * rate) as usize);
    poses.enumerate().any(|(idx, pose)| {
        let dt_seconds = if idx == 0 { 0.0 } else { 1.0 / rate };
        conditioner.push(pose, dt_seconds).cut
    })
}

impl Most {
    fn see(&mut self, sudden: Suddenness) {
        let most = &mut self.sudden;
        most.root_m_s = most.root_m_s.max(sudden.root_m_s);
        most.pelvis_rad_s = most.pelvis_rad_s.max(sudden.pelvis_rad_s);
        most.joints_rad_s = most.joints_rad_s.max(sudden.joints_rad_s);
        if sudden.pelvis_rad_s > SNAP_TURN_RAD_S {
            self.share = self.share.min(sudden.joints_rad_s / sudden.pelvis_rad_s);
        }
    }
}
