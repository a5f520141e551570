//! The playhead, and the path that it runs on.

use dynaskin_skeleton::Pose;

use super::{Conditioned, Conditioner, KNOTS, RELEASE_SECONDS};
use crate::clock::SourceClock;
use crate::path::{Knot, Rates, between, parabola_rates};
use crate::source::PoseSource;

/// The playhead runs at most this much faster or slower than time.
const HURRY: f64 = 0.12;

impl Conditioner {
    pub(super) fn add_knot(&mut self, time: f64, pose: &Pose) {
        let time = self
            .path
            .back()
            .map_or(time, |last| time.max(last.time + 1e-6));
        let knot = match &mut self.smoother {
            Some(smoother) => {
                if let Some(noise) = self.noise.joint_noise_rad() {
                    smoother.set_noise(noise);
                }
                smoother.add(time, pose)
            }
            None => {
                let mut rates = Rates::ZERO;
                if self.engaged {
                    rates = self.rates_at(time, pose);
                }
                Knot {
                    time,
                    pose: pose.clone(),
                    rates,
                }
            }
        };
        if self.path.back().is_none_or(|last| knot.time > last.time) {
            self.path.push_back(knot);
        }
        let kept = if self.engaged { KNOTS } else { 3 };
        while self.path.len() > kept {
            self.path.pop_front();
        }
    }

    pub(super) fn rates_at(&self, time: f64, pose: &Pose) -> Rates {
        let mut last = self.path.iter().rev();
        match (last.next(), last.next()) {
            (Some(before), Some(earlier)) => parabola_rates(earlier, before, time, pose),
            _ => Rates::ZERO,
        }
    }

    pub(super) fn on_path(&self, time: f64) -> Option<Pose> {
        let after = self.path.iter().position(|knot| knot.time >= time);
        match after {
            Some(0) => self.path.front().map(|knot| knot.pose.clone()),
            Some(idx) => Some(between(&self.path[idx - 1], &self.path[idx], time)),
            None => self.path.back().map(|knot| knot.pose.clone()),
        }
    }

    /// How far the playhead is to be behind the host.
    pub(super) fn delay(&self) -> f64 {
        let Some(clock) = &self.clock else {
            return self.now - self.playhead;
        };
        let most = if self.source == PoseSource::Display {
            1.0
        } else {
            2.0
        };
        let late = clock.lateness.clamp(-clock.interval, most * clock.interval);
        let ahead = (1.0 + self.source.lag()) * clock.interval - self.frame;
        // A source of shorter intervals than the page's frames is as late as its latest pose.
        let ahead = if self.skipped_interval().is_some() {
            ahead.max(0.0)
        } else {
            ahead
        };
        (ahead + late + 5e-4).max(0.0)
    }

    pub(super) fn play(&mut self, pose: &Pose, dt_seconds: f64) -> Conditioned {
        self.playhead_before = self.playhead;
        let quiet = self
            .last_repeat
            .is_none_or(|time| self.now - time > RELEASE_SECONDS);
        let skips = self.skipped_interval().is_some();
        let releases = self.source == PoseSource::Display && quiet && self.run == 0 && !skips;
        let standing = self.source == PoseSource::Display && self.clock.is_none() && self.run > 8;
        let target = if releases || standing {
            self.now
        } else {
            self.now - self.delay()
        };
        let even = self.playhead + dt_seconds;
        // An uneven playhead is felt as acceleration: near its place it is only led back slowly.
        let off = target - even;
        let settled = self.clock.as_ref().is_some_and(SourceClock::settled);
        let near = settled && off.abs() < 0.5 * self.frame.max(0.01);
        let (gain, most) = if near { (0.03, 0.02) } else { (0.15, HURRY) };
        let hurry = (gain * off).clamp(-most * dt_seconds, most * dt_seconds);
        if (releases || standing) && self.now - (even + HURRY * dt_seconds) < 1e-6 {
            let dt_seconds = self.now - self.playhead;
            self.engaged = false;
            self.clock = None;
            self.playhead = self.now;
            self.path.clear();
            self.step = None;
            self.log.clear();
            self.log.push_back(self.arrived);
            self.add_knot(self.now, &pose.clone());
            return Conditioned {
                pose: pose.clone(),
                dt_seconds,
                cut: false,
            };
        }
        let hurry = if releases || standing {
            HURRY * dt_seconds
        } else {
            hurry
        };
        let newest = self.path.back().map_or(self.playhead, |knot| knot.time);
        self.playhead = (even + hurry).min(newest).max(self.playhead);
        while self.path.len() > 3 && self.path[1].time <= self.playhead_before {
            self.path.pop_front();
        }
        let pose = self.on_path(self.playhead).unwrap_or_else(|| pose.clone());
        Conditioned {
            pose,
            dt_seconds: self.playhead - self.playhead_before,
            cut: false,
        }
    }
}
