//! What a page is given, frame by frame.

use dynaskin_body::{Joint, Pose};
use dynaskin_motion::Clip;
use glam::{DQuat, DVec3};

use crate::Truth;

/// One frame of a page.
#[derive(Clone, Debug)]
pub struct Frame {
    /// When it is drawn, in seconds of the motion.
    pub time: f64,
    /// The pose that the page shows.
    pub pose: Pose,
    /// The time step that the page measured.
    pub dt_seconds: f64,
}

/// What is added to the poses.
#[derive(Clone, Copy, Debug)]
pub enum Noise {
    /// Nothing.
    None,
    /// White along each axis: degrees of every joint and the root, metres of the root.
    White(f64, f64),
    /// A webcam's tracker with its own smoothing.
    Smoothed,
    /// The same without.
    Raw,
}

/// How the page steps.
#[derive(Clone, Copy, Debug)]
pub enum Steps {
    /// By the display's interval.
    Exact,
    /// Off by up to this many seconds, each for itself.
    Off(f64),
    /// Between times read from a clock of this resolution, in seconds.
    Clock(f64),
    /// As `Off`, and the page's own animation moves by the steps that were measured.
    Followed(f64),
}

/// How poses are made.
#[derive(Clone, Copy, Debug)]
pub enum Made {
    /// This many poses a second, arriving with a jitter of up to so many seconds; the newest is shown.
    Live(f64, f64),
    /// Anew for every frame.
    EveryFrame,
    /// A file of so many keys a second, read and played by the page.
    File(f64),
}

/// A source and the page that shows its poses.
#[derive(Clone, Copy, Debug)]
pub struct Source {
    /// Name in tables.
    pub name: &'static str,
    /// How poses are made.
    pub made: Made,
    /// Frames of the display a second.
    pub display_hz: f64,
    /// What is added to the poses.
    pub noise: Noise,
    /// How the page steps.
    pub steps: Steps,
}

/// Random numbers of a linear congruence.
struct Dice(u64);

impl Dice {
    fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15))
    }

    /// Evenly in -1..1.
    fn roll(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        2.0 * (self.0 >> 11) as f64 / (1_u64 << 53) as f64 - 1.0
    }

    /// Of variance 1.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.roll()).sum::<f64>() / 2.0
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.normal(), self.normal(), self.normal())
    }
}

/// Joints of a webcam's tracker: root mean square of the rotation vector in degrees and coefficient
/// of the smoothed one; root mean square and white share of the variance of the raw one. Measured
/// on a real one that watched somebody stand.
const TRACKED: [(Joint, [f64; 4]); 10] = [
    (Joint::Pelvis, [0.60, 0.99, 0.75, 0.42]),
    (Joint::Spine3, [0.68, 0.98, 0.85, 0.43]),
    (Joint::LeftShoulder, [0.80, 0.95, 1.16, 0.67]),
    (Joint::RightShoulder, [0.80, 0.95, 1.16, 0.67]),
    (Joint::LeftElbow, [0.83, 0.90, 1.10, 0.65]),
    (Joint::RightElbow, [0.83, 0.90, 1.10, 0.65]),
    (Joint::LeftHip, [0.19, 0.99, 0.31, 0.66]),
    (Joint::RightHip, [0.19, 0.99, 0.31, 0.66]),
    (Joint::LeftKnee, [0.31, 0.92, 0.58, 0.85]),
    (Joint::RightKnee, [0.31, 0.92, 0.58, 0.85]),
];

/// The same of the root, in millimetres: across and up, then depth.
const TRACKED_ROOT: [[f64; 4]; 3] = [
    [1.35, 0.98, 2.36, 0.70],
    [1.35, 0.98, 2.36, 0.70],
    [2.96, 0.98, 4.65, 0.65],
];

/// Coefficient of the part of the raw tracker's noise that is not white.
const SLOW: f64 = 0.99;

/// Adds noise to one pose after another.
struct Noisy {
    noise: Noise,
    dice: Dice,
    /// Coloured noise of variance 1: three numbers of the root, then three of every tracked joint.
    slow: Option<Vec<f64>>,
}

impl Noisy {
    fn coloured(&mut self, slot: usize, [rms, coefficient, raw_rms, white]: [f64; 4]) -> f64 {
        let raw = matches!(self.noise, Noise::Raw);
        let coefficient = if raw { SLOW } else { coefficient };
        let new = self.dice.normal();
        let count = 3 * (TRACKED.len() + 1);
        let slow = self.slow.get_or_insert_with(|| vec![f64::NAN; count]);
        slow[slot] = if slow[slot].is_nan() {
            new
        } else {
            coefficient * slow[slot] + (1.0 - coefficient * coefficient).sqrt() * new
        };
        let slow = slow[slot];
        if raw {
            raw_rms * (white.sqrt() * self.dice.normal() + (1.0 - white).sqrt() * slow)
        } else {
            rms * slow
        }
    }

    fn add(&mut self, pose: &mut Pose) {
        let turn = |pose: &mut Pose, joint: usize, by: DVec3| {
            let rotation = &mut pose.parent_from_joint[joint];
            *rotation = (*rotation * DQuat::from_scaled_axis(by)).normalize();
        };
        match self.noise {
            Noise::None => {}
            Noise::White(degrees, metres) => {
                pose.root_translation_m += metres * self.dice.vector();
                for joint in 0..pose.parent_from_joint.len() {
                    let by = degrees.to_radians() * self.dice.vector();
                    turn(pose, joint, by);
                }
            }
            Noise::Smoothed | Noise::Raw => {
                let root = std::array::from_fn(|axis| self.coloured(axis, TRACKED_ROOT[axis]));
                pose.root_translation_m += 1e-3 * DVec3::from_array(root);
                for (idx, (joint, size)) in TRACKED.into_iter().enumerate() {
                    let by: [f64; 3] =
                        std::array::from_fn(|axis| self.coloured(3 * (idx + 1) + axis, size));
                    // The table has the length of the vector.
                    let by = DVec3::from_array(by) / 3.0_f64.sqrt();
                    turn(pose, joint as usize, by * 1.0_f64.to_radians());
                }
            }
        }
    }
}

impl Source {
    /// What the page is given while it plays `truth`.
    pub fn frames(&self, truth: &Truth, seed: u64) -> Vec<Frame> {
        let mut dice = Dice::new(seed);
        let count = (truth.seconds * self.display_hz) as usize;
        let times: Vec<f64> = (0..count)
            .map(|frame| frame as f64 / self.display_hz)
            .collect();
        let poses = self.poses(truth, &times, seed);
        let mut frames: Vec<Frame> = Vec::with_capacity(count);
        let mut read_before = 0.0;
        let mut followed = 0.0;
        for (&time, mut pose) in times.iter().zip(poses) {
            let exact = 1.0 / self.display_hz;
            let dt_seconds = match self.steps {
                _ if frames.is_empty() => 0.0,
                Steps::Exact => exact,
                Steps::Off(most) | Steps::Followed(most) => exact + most * dice.roll(),
                Steps::Clock(resolution) => {
                    let read = ((time + 0.0007) / resolution).floor() * resolution;
                    let dt = read - read_before;
                    read_before = read;
                    dt
                }
            };
            followed += dt_seconds;
            if matches!(self.steps, Steps::Followed(_)) {
                pose = truth.at(followed);
            }
            frames.push(Frame {
                time: if matches!(self.steps, Steps::Followed(_)) {
                    followed
                } else {
                    time
                },
                pose,
                dt_seconds,
            });
        }
        frames
    }

    fn poses(&self, truth: &Truth, times: &[f64], seed: u64) -> Vec<Pose> {
        let mut noisy = Noisy {
            noise: self.noise,
            dice: Dice::new(seed + 1000),
            slow: None,
        };
        match self.made {
            Made::EveryFrame => times
                .iter()
                .map(|&time| {
                    let mut pose = truth.at(time);
                    noisy.add(&mut pose);
                    pose
                })
                .collect(),
            Made::File(rate_hz) => {
                let count = (truth.seconds * rate_hz) as usize;
                let keys = (0..=count).map(|key| truth.at(key as f64 / rate_hz));
                let file = Clip {
                    name: String::new(),
                    rate_hz,
                    frames: keys.collect(),
                };
                times.iter().map(|&time| file.pose_at(time)).collect()
            }
            Made::Live(rate_hz, jitter) => {
                let mut dice = Dice::new(seed + 2000);
                let phase = 0.5 * (dice.roll() + 1.0) / rate_hz;
                let mut made: Vec<(f64, Pose)> = Vec::new();
                for index in 0..=(truth.seconds * rate_hz) as usize {
                    let time = phase + index as f64 / rate_hz;
                    let arrival = time + jitter * dice.roll();
                    let last = made.last().map_or(f64::NEG_INFINITY, |(last, _)| *last);
                    let mut pose = truth.at(time);
                    noisy.add(&mut pose);
                    made.push((arrival.max(last), pose));
                }
                let newest = |time: f64| {
                    let arrived = made.partition_point(|(arrival, _)| *arrival <= time);
                    made[arrived.saturating_sub(1)].1.clone()
                };
                times.iter().map(|&time| newest(time)).collect()
            }
        }
    }
}
