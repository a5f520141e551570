//! What a body does in a pose it is held in.

use std::f64::consts::TAU;

use dynaskin_body::Pose;
use glam::{DQuat, DVec3};
use rand::RngExt as _;
use rand_pcg::Pcg64Mcg;

/// What a body does in a held pose: amplitudes in metres and radians, frequency in hertz.
const BOUNCE_M: [f64; 2] = [0.01, 0.05];
const SHAKE_RAD: [f64; 2] = [0.03, 0.12];
const TEMPO_HZ: [f64; 2] = [1.2, 3.0];
/// A jerk: how far the body is moved and turned, how long that takes, and how long its tissue then rings,
/// by which the next one may follow. Metres, radians and seconds.
const JERK_M: [f64; 2] = [0.003, 0.02];
const JERK_RAD: [f64; 2] = [0.01, 0.06];
const JERK_SECONDS: [f64; 2] = [0.05, 0.15];
pub(super) const RING_SECONDS: [f64; 2] = [0.6, 1.4];

/// A short movement of the whole body to where it then stays.
#[derive(Clone, Copy, Debug)]
pub(super) struct Jerk {
    /// When it begins and ends, in seconds.
    pub(super) span: [f64; 2],
    moved_m: DVec3,
    /// Axis times radians.
    turned: DVec3,
}

/// A bounce or a shake of the whole body.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sway {
    bounce_m: f64,
    shake: DVec3,
    tempo_hz: f64,
}

impl Jerk {
    /// Three jerks of a pose that is held from `at` on.
    pub(super) fn drawn(at: f64, rng: &mut Pcg64Mcg) -> Vec<Self> {
        let mut until = at;
        let jerks = (0..3).map(|_| {
            let from = until + between(rng, RING_SECONDS);
            until = from + between(rng, JERK_SECONDS);
            let turned = if rng.random::<bool>() {
                direction(rng) * between(rng, JERK_RAD)
            } else {
                DVec3::ZERO
            };
            Self {
                span: [from, until],
                moved_m: direction(rng) * between(rng, JERK_M),
                turned,
            }
        });
        jerks.collect()
    }

    /// Moves a pose as far as the body is at `seconds`.
    pub(super) fn applied(&self, pose: &mut Pose, seconds: f64) {
        let [from, until] = self.span;
        let share = smooth((seconds - from) / (until - from));
        pose.root_translation_m += self.moved_m * share;
        let turn = DQuat::from_scaled_axis(self.turned * share);
        pose.parent_from_joint[0] = turn * pose.parent_from_joint[0];
    }
}

impl Sway {
    /// Half of the poses are held still.
    pub(super) fn drawn(rng: &mut Pcg64Mcg) -> Self {
        let tempo_hz = between(rng, TEMPO_HZ);
        match rng.random_range(0..4) {
            0 => Self {
                bounce_m: between(rng, BOUNCE_M),
                tempo_hz,
                ..Self::default()
            },
            1 => Self {
                shake: direction(rng) * between(rng, SHAKE_RAD),
                tempo_hz,
                ..Self::default()
            },
            _ => Self::default(),
        }
    }

    /// Moves a pose `seconds` into its hold of `length` seconds.
    pub(super) fn applied(&self, pose: &Pose, seconds: f64, length: f64) -> Pose {
        let strength = smooth(seconds / 0.4) * smooth((length - seconds) / 0.4);
        let wave = strength * (TAU * self.tempo_hz * seconds).sin();
        let mut moved = pose.clone();
        moved.root_translation_m.y += self.bounce_m * wave;
        let turn = DQuat::from_scaled_axis(self.shake * wave);
        moved.parent_from_joint[0] = turn * moved.parent_from_joint[0];
        moved
    }
}

/// No speed and no acceleration at both ends (the minimum-jerk profile of Flash and Hogan 1985).
pub(super) fn smooth(share: f64) -> f64 {
    let s = share.clamp(0.0, 1.0);
    s * s * s * (10.0 + s * (6.0 * s - 15.0))
}

pub(super) fn between(rng: &mut Pcg64Mcg, [least, most]: [f64; 2]) -> f64 {
    rng.random_range(least..most)
}

pub(super) fn direction(rng: &mut Pcg64Mcg) -> DVec3 {
    let mut axis = || rng.random_range(-1.0..1.0);
    DVec3::new(axis(), axis(), axis()).normalize_or(DVec3::Y)
}
