//! Poses that arrive, and poses that do not.

use dynaskin_skeleton::Pose;

use super::{Conditioner, LOG};
use crate::clock::{INTERVALS, SourceClock};
use crate::cut::{START_SECONDS, Step, is_cut, is_snap_turn, is_stop, is_sudden_stop};
use crate::smoother::Smoother;

/// Longest time for which a pose that repeats is waited for while no interval is known, in seconds.
const FIRST_WAIT_SECONDS: f64 = 0.04;

/// Poses are held where another one was within this time, in seconds.
const AGAIN_SECONDS: f64 = 0.3;

impl Conditioner {
    /// A new pose, `step` after the one before; whether the body jumped to it.
    pub(super) fn arrive(&mut self, pose: &Pose, step: Step) -> bool {
        let gap = self.now - self.arrived;
        self.arrived = self.now;
        self.log.push_back(self.now);
        if gap > INTERVALS.1 {
            self.log.clear();
            self.log.push_back(self.now);
        }
        while self.log.len() > LOG {
            self.log.pop_front();
        }
        let (time, seconds) = self.time_of_arrival(&step, gap);
        self.raw = Some(pose.clone());
        self.noise.add(&step);
        let jumped = match &self.step {
            Some((before, before_seconds)) => is_cut((before, *before_seconds), (&step, seconds)),
            None => false,
        };
        let stops = self.now - self.began < START_SECONDS && is_stop(self.peak, &step, seconds);
        let cut = match &self.step {
            // The tissue's clock sees the others itself.
            Some((before, before_seconds)) if !self.engaged => {
                stops || is_snap_turn((before, *before_seconds), (&step, seconds))
            }
            _ => stops || jumped,
        };
        self.peak = self.peak.max(step.speed_of_all(seconds));
        self.step_before = self.step.replace((step, seconds));
        if jumped || cut {
            // Another place or motion: that it stands still there is no pose held over a frame.
            self.log.clear();
            self.log.push_back(self.now);
        }
        if cut {
            self.step = None;
            self.peak = 0.0;
            self.began = self.now;
            self.path.clear();
            self.smoother = self.source.tuning().map(Smoother::new);
            self.playhead = time;
            self.playhead_before = time;
        }
        self.add_knot(time, pose);
        cut
    }

    /// When the pose that has just arrived was made, and how long after the one before, in seconds.
    pub(super) fn time_of_arrival(&mut self, step: &Step, gap: f64) -> (f64, f64) {
        if let Some(interval) = self.skipped_interval() {
            return self.skipping_arrival(interval);
        }
        if !self.engaged {
            return (self.now, gap);
        }
        // The first arrivals are taken together: one gap says little where arrivals jitter.
        if let Some(clock) = &mut self.clock
            && (clock.settled() || self.log.len() >= LOG || self.log.len() < 2)
        {
            let mut steps = clock.steps(self.now);
            // One of two poses that came in one frame is never seen. Which interval it is missing from
            // shows when the next is there: how far on its way the body had come.
            let late = steps == 2.0 && self.steps_before == 1.0;
            if let (true, Some((before, _))) = (late, &self.step)
                && before.share_of_both(step) > 0.5
            {
                clock.postpone();
                steps = 1.0;
                let interval = clock.interval;
                if let Some((_, seconds)) = &mut self.step {
                    *seconds += interval;
                }
                if let Some(knot) = self.path.pop_back()
                    && self.smoother.is_none()
                {
                    self.add_knot(knot.time + interval, &knot.pose);
                }
                return self.arrived_after(steps);
            }
            return self.arrived_after(steps);
        }
        if self.log.len() < 2 {
            return (self.now, gap);
        }
        let clock = SourceClock::new(&self.log);
        let (newest, seconds) = (clock.newest, clock.interval.max(gap));
        self.clock = Some(clock);
        (newest, seconds)
    }

    /// As [`Self::time_of_arrival`] for a source that makes more poses than the page shows.
    fn skipping_arrival(&mut self, interval: f64) -> (f64, f64) {
        let is_known = |clock: &SourceClock| (clock.interval - interval).abs() < 0.05 * interval;
        self.engaged = true;
        if !self.clock.as_ref().is_some_and(is_known) {
            self.clock = Some(SourceClock::known(interval, self.now));
            return (self.now, self.skips.intervals() * interval);
        }
        self.arrived_after(self.skips.intervals())
    }

    /// The time of a pose made `steps` intervals after the one before, and the seconds between.
    pub(super) fn arrived_after(&mut self, steps: f64) -> (f64, f64) {
        self.steps_before = steps;
        match &mut self.clock {
            Some(clock) => {
                let seconds = steps * clock.interval;
                (clock.arrive(self.now, steps, &self.log), seconds)
            }
            None => (self.now, self.now - self.arrived),
        }
    }

    /// The pose of the step before once more.
    pub(super) fn repeat(&mut self, dt_seconds: f64) {
        self.run += 1;
        let moved_lately = self.arrived + 1.5 * dt_seconds > self.now && self.log.len() > 1;
        if moved_lately {
            self.last_repeat = Some(self.now);
        }
        // A body that comes to rest or turns back by itself was slowing down; one that was not is
        // held.
        let fast = self.step.as_ref().is_some_and(|(step, seconds)| {
            let before = self.step_before.as_ref().map(|(s, t)| (s, *t));
            is_sudden_stop(before, (step, *seconds))
        });
        if !self.engaged && moved_lately && fast {
            // One alone may be a stop, as of keys joined by straight lines.
            if self.now - self.held < AGAIN_SECONDS {
                // The playhead stays at the last pose until the next one is there.
                self.engaged = true;
                self.clock = None;
            }
            self.held = self.now;
        }
        let missing = self.now - self.arrived;
        if let Some(clock) = &mut self.clock {
            let late = clock.lateness.max(0.0) + self.frame;
            // Once it is known to stand still, its poses are as good as there.
            let patience = if self.stands {
                0.0
            } else {
                1.2 * clock.interval + late
            };
            if self.engaged && self.now - clock.newest > clock.interval + patience {
                let time = clock.skip();
                if let Some(raw) = self.raw.clone() {
                    self.add_knot(time, &raw);
                }
                self.stands = true;
            }
        } else if self.engaged && missing > FIRST_WAIT_SECONDS {
            // It stands still after all.
            if let Some(raw) = self.raw.clone() {
                self.add_knot(self.now, &raw);
            }
        }
    }
}
