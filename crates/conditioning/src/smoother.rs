//! Noise taken off poses that come at the source's interval.
//!
//! A Kalman filter for a body that is pushed about at random (white acceleration), one for the
//! root and one for each joint, with a look back over the next pose after Rauch, Tung and Striebel
//! (AIAA Journal 3, 1965). A one-euro filter (Casiez, Roussel and Vogel, CHI 2012) has a cut-off
//! that follows the speed. Here the strength of the pushes does the same: it is measured on the
//! second differences, less what noise alone would give them.

use std::collections::VecDeque;

use dynaskin_skeleton::{JOINT_COUNT, Pose};
use glam::{DQuat, DVec3};

use crate::path::{Knot, Rates, between_knots, turn_between};

/// The root and every joint.
const GROUPS: usize = JOINT_COUNT + 1;

/// What is expected of a tracker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Tuning {
    /// Noise of the root, in metres, where that of joints is one radian.
    pub root_noise_m_rad: f64,
    /// Standard deviations of a joint's turn along each axis, in radians: smallest, largest.
    pub joint_noise_rad: (f64, f64),
    /// How strongly a body that stands still is pushed: the variance of the noise times the cube of
    /// this, in 1/s. Smaller is calmer.
    pub stillness: f64,
    /// Poses of the future that are waited for, 0 to 1.
    pub lag: f64,
    /// Weight of the newest second difference in the measured push.
    pub alertness: f64,
    /// Factor on the measured push.
    pub trust: f64,
}

#[derive(Clone, Copy, Debug, Default)]
struct Covariance {
    place: f64,
    cross: f64,
    rate: f64,
}

/// One pose filtered with all before it.
#[derive(Clone, Debug)]
struct Filtered {
    time: f64,
    pose: Pose,
    rates: Rates,
    covariance: [Covariance; GROUPS],
    /// As predicted from the one before.
    predicted: Pose,
    predicted_covariance: [Covariance; GROUPS],
}

#[derive(Clone, Debug)]
pub(crate) struct Smoother {
    tuning: Tuning,
    past: VecDeque<Filtered>,
    raw: VecDeque<(f64, Pose)>,
    push: [f64; GROUPS],
    /// Standard deviation of the turn of joints that tell nothing themselves, in radians.
    joint_noise_rad: f64,
    gauges: [Gauge; GROUPS],
    /// Where the body usually is.
    place: Option<Pose>,
    /// Poses for which it has stood still.
    stood: u32,
}

/// Measures the noise of the root or of one joint while the body stands still.
#[derive(Clone, Copy, Debug, Default)]
struct Gauge {
    bend: DVec3,
    count: u32,
    /// Variance along each axis, once known.
    noise: Option<f64>,
}

/// Weight of the newest pose in the place and the noise of a body that stands.
const GAUGE_WEIGHT: f64 = 0.08;

/// How far root and joints of somebody who stands are from where they usually are, in metres and
/// radians.
const STANDS: (f64, f64) = (0.015, 0.07);

/// How many times the noise's own second differences are taken off where the body moves, and where it
/// stands still.
const TAKEN: (f64, f64) = (0.5, 4.0);

/// Poses for which the body must stand before its noise is measured.
const STOOD: u32 = 8;

impl Smoother {
    pub fn new(tuning: Tuning) -> Self {
        Self {
            tuning,
            past: VecDeque::new(),
            raw: VecDeque::new(),
            push: [0.0; GROUPS],
            joint_noise_rad: tuning.joint_noise_rad.1,
            gauges: [Gauge::default(); GROUPS],
            place: None,
            stood: 0,
        }
    }

    fn noise(&self, group: usize) -> f64 {
        let scale = if group == 0 {
            self.tuning.root_noise_m_rad
        } else {
            1.0
        };
        let (least, most) = self.tuning.joint_noise_rad;
        let square = |noise: f64| (scale * noise).powi(2);
        let noise = self.gauges[group].noise;
        let noise = noise.unwrap_or(square(self.joint_noise_rad));
        noise.clamp(square(least), square(most))
    }

    /// Says how noisy joints were found to be, as a standard deviation in radians along each axis.
    pub fn set_noise(&mut self, joint_noise_rad: f64) {
        let (least, most) = self.tuning.joint_noise_rad;
        self.joint_noise_rad = joint_noise_rad.clamp(least, most);
    }

    /// Takes the pose of `time`, later than all before; gives the pose that is now known as well
    /// as it will be.
    pub fn add(&mut self, time: f64, pose: &Pose) -> Knot {
        self.measure_push(time, pose);
        let next = match self.past.back() {
            Some(last) if time > last.time => self.filtered(last, time, pose),
            _ => {
                let covariance = std::array::from_fn(|group| Covariance {
                    place: self.noise(group),
                    cross: 0.0,
                    rate: self.noise(group) * 100.0,
                });
                Filtered {
                    time,
                    pose: pose.clone(),
                    rates: Rates::ZERO,
                    covariance,
                    predicted: pose.clone(),
                    predicted_covariance: covariance,
                }
            }
        };
        self.past.push_back(next);
        while self.past.len() > 2 {
            self.past.pop_front();
        }
        self.smoothed()
    }

    fn measure_push(&mut self, time: f64, pose: &Pose) {
        let calm = self.calm(pose);
        if let (Some((t0, first)), Some((t1, second))) = (self.raw.front(), self.raw.back())
            && self.raw.len() == 2
            && time > *t1
            && t1 > t0
        {
            let seconds = 0.5 * (time - t0);
            // Poses at uneven times: the middle one against the line through its neighbours.
            let u = (t1 - t0) / (time - t0);
            let taken = TAKEN.0 + (TAKEN.1 - TAKEN.0) * calm;
            for group in 0..GROUPS {
                let (from, to) = steps(first, second, pose, group);
                let bend = 2.0 * ((1.0 - u) * from - u * to);
                let gauge = &mut self.gauges[group];
                let third = bend - gauge.bend;
                gauge.bend = bend;
                if self.stood > STOOD {
                    let found = third.length_squared() / 60.0;
                    let noise = gauge.noise.get_or_insert(found);
                    gauge.count += 1;
                    let weight = (1.0 / f64::from(gauge.count)).max(GAUGE_WEIGHT);
                    *noise += weight * (found - *noise);
                }
                let squared = bend.length_squared() / 3.0;
                let noise = 6.0 * self.noise(group);
                let push = 1.5 * (squared - taken * noise) / seconds.powi(3);
                let weight = self.tuning.alertness;
                self.push[group] += weight * (push - self.push[group]);
            }
        }
        self.raw.push_back((time, pose.clone()));
        while self.raw.len() > 2 {
            self.raw.pop_front();
        }
    }

    /// How surely the body stands still, 0 to 1.
    fn calm(&mut self, pose: &Pose) -> f64 {
        let Some(place) = &mut self.place else {
            self.place = Some(pose.clone());
            return 0.0;
        };
        let mut farthest = place.root_translation_m.distance(pose.root_translation_m) / STANDS.0;
        let off = pose.root_translation_m - place.root_translation_m;
        place.root_translation_m += GAUGE_WEIGHT * off;
        for (joint, usual) in place.parent_from_joint.iter_mut().enumerate() {
            let off = turn_between(*usual, pose.parent_from_joint[joint]);
            farthest = farthest.max(off.length() / STANDS.1);
            *usual = (*usual * DQuat::from_scaled_axis(GAUGE_WEIGHT * off)).normalize();
        }
        self.stood = if farthest < 1.0 {
            self.stood.saturating_add(1)
        } else {
            0
        };
        if self.stood > STOOD {
            (2.0 * (1.0 - farthest)).clamp(0.0, 1.0)
        } else {
            0.0
        }
    }

    fn filtered(&self, last: &Filtered, time: f64, pose: &Pose) -> Filtered {
        let dt = time - last.time;
        let mut next = last.clone();
        next.time = time;
        next.predicted.root_translation_m = last.pose.root_translation_m + dt * last.rates.root_m_s;
        for group in 0..GROUPS {
            let noise = self.noise(group);
            let push = (self.tuning.trust * self.push[group]).max(0.0)
                + noise * self.tuning.stillness.powi(3);
            let before = last.covariance[group];
            let ahead = Covariance {
                place: before.place
                    + dt * (2.0 * before.cross + dt * before.rate)
                    + push * dt * dt * dt / 3.0,
                cross: before.cross + dt * before.rate + push * dt * dt / 2.0,
                rate: before.rate + push * dt,
            };
            next.predicted_covariance[group] = ahead;
            let sum = (ahead.place + noise).max(1e-300);
            let (place_gain, rate_gain) = (ahead.place / sum, ahead.cross / sum);
            next.covariance[group] = Covariance {
                place: (1.0 - place_gain) * ahead.place,
                cross: (1.0 - place_gain) * ahead.cross,
                rate: ahead.rate - rate_gain * ahead.cross,
            };
            if group == 0 {
                let off = pose.root_translation_m - next.predicted.root_translation_m;
                next.pose.root_translation_m = next.predicted.root_translation_m + place_gain * off;
                next.rates.root_m_s = last.rates.root_m_s + rate_gain * off;
            } else {
                let joint = group - 1;
                let rate = last.rates.joints_rad_s[joint];
                let predicted =
                    last.pose.parent_from_joint[joint] * DQuat::from_scaled_axis(dt * rate);
                next.predicted.parent_from_joint[joint] = predicted;
                let off = turn_between(predicted, pose.parent_from_joint[joint]);
                next.pose.parent_from_joint[joint] =
                    (predicted * DQuat::from_scaled_axis(place_gain * off)).normalize();
                next.rates.joints_rad_s[joint] = rate + rate_gain * off;
            }
        }
        next
    }

    /// The oldest pose that is kept, with all that came after it.
    fn smoothed(&self) -> Knot {
        let Some(newest) = self.past.back() else {
            return Knot {
                time: 0.0,
                pose: Pose::REST,
                rates: Rates::ZERO,
            };
        };
        let mut knot = Knot {
            time: newest.time,
            pose: newest.pose.clone(),
            rates: newest.rates,
        };
        for (this, next) in self.past.iter().rev().skip(1).zip(self.past.iter().rev()) {
            let dt = next.time - this.time;
            let (mut pose, mut rates) = (this.pose.clone(), this.rates);
            for group in 0..GROUPS {
                let here = this.covariance[group];
                let ahead = next.predicted_covariance[group];
                // here * F^T, then times the inverse of `ahead`.
                let (a, b) = (here.place + dt * here.cross, here.cross);
                let (c, d) = (here.cross + dt * here.rate, here.rate);
                let scale = ahead.place * ahead.rate - ahead.cross * ahead.cross;
                if scale <= 1e-14 * ahead.place * ahead.rate {
                    continue;
                }
                let gain = [
                    (a * ahead.rate - b * ahead.cross) / scale,
                    (b * ahead.place - a * ahead.cross) / scale,
                    (c * ahead.rate - d * ahead.cross) / scale,
                    (d * ahead.place - c * ahead.cross) / scale,
                ];
                let (off, rate_off) = if group == 0 {
                    (
                        knot.pose.root_translation_m - next.predicted.root_translation_m,
                        knot.rates.root_m_s - this.rates.root_m_s,
                    )
                } else {
                    let joint = group - 1;
                    (
                        turn_between(
                            next.predicted.parent_from_joint[joint],
                            knot.pose.parent_from_joint[joint],
                        ),
                        knot.rates.joints_rad_s[joint] - this.rates.joints_rad_s[joint],
                    )
                };
                let place = gain[0] * off + gain[1] * rate_off;
                let rate = gain[2] * off + gain[3] * rate_off;
                if group == 0 {
                    pose.root_translation_m += place;
                    rates.root_m_s += rate;
                } else {
                    let joint = group - 1;
                    let turned = pose.parent_from_joint[joint] * DQuat::from_scaled_axis(place);
                    pose.parent_from_joint[joint] = turned.normalize();
                    rates.joints_rad_s[joint] += rate;
                }
            }
            let earlier = Knot {
                time: this.time,
                pose,
                rates,
            };
            // Between two states of such a body the likeliest way is the cubic.
            let time = knot.time - self.tuning.lag * dt;
            knot = between_knots(&earlier, &knot, time);
        }
        knot
    }
}

/// From the first to the second pose and from there to the third.
fn steps(first: &Pose, second: &Pose, third: &Pose, group: usize) -> (DVec3, DVec3) {
    if group == 0 {
        let middle_m = second.root_translation_m;
        (
            middle_m - first.root_translation_m,
            third.root_translation_m - middle_m,
        )
    } else {
        let joint = group - 1;
        let middle = second.parent_from_joint[joint];
        (
            -turn_between(middle, first.parent_from_joint[joint]),
            turn_between(middle, third.parent_from_joint[joint]),
        )
    }
}
