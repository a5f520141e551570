//! How sudden bodies are: the largest figures of captures, beside which the limits of cuts stand.

use anyhow::Result;
use dynaskin_body::{JOINT_COUNT, Pose};
use dynaskin_conditioning::{SNAP_JOINTS_SHARE, Suddenness};
use glam::Vec3;
use std::path::PathBuf;

use crate::truth::Truth;

const RATES_HZ: [f64; 6] = [24.0, 30.0, 60.0, 72.0, 90.0, 120.0];

/// Prints the largest figures of all `clips` at every rate.
pub fn print(clips: &[PathBuf], joints_rest_m: &[Vec3; JOINT_COUNT]) -> Result<()> {
    println!(
        "Largest changes of velocity from one pose to the next in {} captures; snap turn: of the pelvis \
         where no joint changes its own by more than {SNAP_JOINTS_SHARE} of that.\n",
        clips.len()
    );
    println!(
        "| rate | root m/s | pelvis rad/s | joints rad/s | snap turn rad/s | speed of a joint rad/s |"
    );
    println!("|--:|--:|--:|--:|--:|--:|");
    let mut most = [(
        Suddenness::default(),
        0.0_f64,
        0.0_f64,
        0.0_f64,
        f64::INFINITY,
    ); RATES_HZ.len()];
    for path in clips {
        let truth = Truth::capture(path, joints_rest_m, f64::INFINITY)?;
        for (rate, most) in RATES_HZ.into_iter().zip(&mut most) {
            let poses: Vec<Pose> = (0..(truth.seconds * rate) as usize)
                .map(|frame| truth.at(frame as f64 / rate))
                .collect();
            let speeds: Vec<f64> = poses
                .windows(2)
                .map(|p| dynaskin_conditioning::speed_of_all([&p[0], &p[1]], 1.0 / rate))
                .collect();
            let reach = (0.1 * rate) as usize;
            for first in 0..speeds.len() {
                for then in first + 1..speeds.len().min(first + 1 + reach) {
                    if speeds[then] < 0.2 * speeds[first] {
                        most.2 = most.2.max(speeds[first]);
                    }
                }
                most.3 = most.3.max(speeds[first]);
            }
            for poses in poses.windows(3) {
                let sudden = Suddenness::of([&poses[0], &poses[1], &poses[2]], 1.0 / rate);
                let (most, snap, _, _, share) = &mut *most;
                if sudden.pelvis_rad_s > 8.0 {
                    *share = share.min(sudden.joints_rad_s / sudden.pelvis_rad_s);
                }
                most.root_m_s = most.root_m_s.max(sudden.root_m_s);
                most.pelvis_rad_s = most.pelvis_rad_s.max(sudden.pelvis_rad_s);
                most.joints_rad_s = most.joints_rad_s.max(sudden.joints_rad_s);
                most.speed_rad_s = most.speed_rad_s.max(sudden.speed_rad_s);
                if sudden.joints_rad_s < SNAP_JOINTS_SHARE * sudden.pelvis_rad_s {
                    *snap = snap.max(sudden.pelvis_rad_s);
                }
            }
        }
    }
    for (rate, (most, snap, stop, all, share)) in RATES_HZ.into_iter().zip(most) {
        println!(
            "| {rate} Hz | {:.2} | {:.1} | {:.1} | {snap:.1} | {:.1} | {stop:.1} | {all:.1} | {share:.2} |",
            most.root_m_s, most.pelvis_rad_s, most.joints_rad_s, most.speed_rad_s
        );
    }
    Ok(())
}
