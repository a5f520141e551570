//! Motions made by formula: test motions that need no capture.
//!
//! Each starts and ends standing still, keeps planted soles where they are, and joins its phases
//! with equal position, speed and acceleration. A flight is a parabola under gravity.

mod bounce;
pub(crate) mod figure;
mod grounded;
mod hops;
mod track;

use dynaskin_body::{JOINT_COUNT, Pose};
use dynaskin_skeleton::GRAVITY_M_S2 as GRAVITY;
use glam::Vec3;

use crate::clip::check_range;
use crate::{Clip, MODEL_RATE_HZ, MotionError};
use figure::{Figure, Stance};

/// Time standing still before the motion, in seconds.
const LEAD_SECONDS: f64 = 0.6;
/// Time standing still after the motion, in seconds: tissue rings for about that long.
const TAIL_SECONDS: f64 = 0.8;

/// A motion this crate can make.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ProceduralKind {
    /// Crouch, jump with an arm swing, land, stand up; tempo in jumps per second.
    Jump,
    /// Hopping on both legs; tempo in hops per second.
    Hop,
    /// Hopping on the left leg; tempo in hops per second.
    OneLegHop,
    /// Jumping jacks; tempo in full cycles (apart and together) per second.
    JumpingJacks,
    /// Running on the spot; tempo in steps per second.
    RunInPlace,
    /// Walking ahead (+Z); tempo in steps per second, height is the lift of the swinging foot.
    Walk,
    /// Twisting about the vertical on planted feet; tempo in full cycles per second, height is how
    /// far the knees let the pelvis sink.
    Twist,
    /// Shaking the hips from side to side; tempo in full cycles per second, height is the
    /// amplitude of the pelvis to each side.
    ShakeHips,
}

impl ProceduralKind {
    /// All motions.
    pub const ALL: [Self; 8] = [
        Self::Jump,
        Self::Hop,
        Self::OneLegHop,
        Self::JumpingJacks,
        Self::RunInPlace,
        Self::Walk,
        Self::Twist,
        Self::ShakeHips,
    ];

    /// Name for files and commands, such as `one-leg-hop`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Jump => "jump",
            Self::Hop => "hop",
            Self::OneLegHop => "one-leg-hop",
            Self::JumpingJacks => "jumping-jacks",
            Self::RunInPlace => "run-in-place",
            Self::Walk => "walk",
            Self::Twist => "twist",
            Self::ShakeHips => "shake-hips",
        }
    }

    /// The motion with that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// A usual tempo in hertz and height in metres.
    const fn usual(self) -> (f64, f64) {
        match self {
            Self::Jump => (0.45, 0.28),
            Self::Hop => (1.9, 0.09),
            Self::OneLegHop => (1.9, 0.06),
            Self::JumpingJacks => (0.9, 0.07),
            Self::RunInPlace => (2.8, 0.035),
            Self::Walk => (1.8, 0.07),
            Self::Twist => (1.0, 0.05),
            Self::ShakeHips => (1.8, 0.05),
        }
    }

    /// Range of tempos in hertz.
    const fn tempos_hz(self) -> (f64, f64) {
        match self {
            Self::Jump => (0.1, 1.0),
            Self::Hop | Self::OneLegHop => (0.3, 4.0),
            Self::JumpingJacks => (0.15, 1.6),
            Self::RunInPlace => (1.5, 4.5),
            Self::Walk => (0.6, 2.6),
            Self::Twist => (0.2, 2.0),
            Self::ShakeHips => (0.2, 4.0),
        }
    }

    /// Range of heights in metres.
    const fn heights_m(self) -> (f64, f64) {
        match self {
            Self::Jump => (0.02, 0.6),
            Self::Hop | Self::OneLegHop | Self::JumpingJacks => (0.005, 0.3),
            Self::RunInPlace => (0.005, 0.12),
            Self::Walk => (0.02, 0.2),
            Self::Twist => (0.0, 0.15),
            Self::ShakeHips => (0.0, 0.1),
        }
    }
}

/// A procedural motion and its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Procedural {
    /// Which motion.
    pub kind: ProceduralKind,
    /// Repetitions per second; what one repetition is, [`ProceduralKind`] says.
    pub tempo_hz: f64,
    /// For flights the rise of the pelvis from take-off to the top, in metres; for the other
    /// motions see [`ProceduralKind`].
    pub height_m: f64,
    /// Length of the clip in seconds, with standing still at both ends. As many whole repetitions
    /// as fit are made.
    pub duration_seconds: f64,
}

impl Procedural {
    /// The motion at a usual tempo and height, eight seconds long.
    pub const fn new(kind: ProceduralKind) -> Self {
        let (tempo_hz, height_m) = kind.usual();
        Self {
            kind,
            tempo_hz,
            height_m,
            duration_seconds: 8.0,
        }
    }

    /// Poses at 60 Hz for a body with these rest joint positions (metres, standing in an A-pose or
    /// T-pose on y = 0, facing +Z). The clip is named after the motion.
    ///
    /// # Errors
    /// [`MotionError::Parameter`] for a parameter out of range or a clip too short for one
    /// repetition, [`MotionError::FlightDoesNotFit`] where the height needs more time than the
    /// tempo leaves, [`MotionError::Degenerate`] for joints that are no standing person.
    pub fn clip(&self, joints_rest_m: &[Vec3; JOINT_COUNT]) -> Result<Clip, MotionError> {
        self.clip_at(MODEL_RATE_HZ, joints_rest_m)
    }

    /// The same at `rate_hz`, 1 to 1000.
    ///
    /// # Errors
    /// As [`Self::clip`], and [`MotionError::Parameter`] for another rate.
    pub fn clip_at(
        &self,
        rate_hz: f64,
        joints_rest_m: &[Vec3; JOINT_COUNT],
    ) -> Result<Clip, MotionError> {
        check_range("rate_hz", rate_hz, 1.0, 1000.0)?;
        let (low, high) = self.kind.tempos_hz();
        check_range("tempo_hz", self.tempo_hz, low, high)?;
        let (low, high) = self.kind.heights_m();
        check_range("height_m", self.height_m, low, high)?;
        check_range("duration_seconds", self.duration_seconds, 0.0, 3600.0)?;
        let figure = Figure::new(joints_rest_m)?;
        let stances = self.stances(&figure)?;
        let last = (self.duration_seconds * rate_hz).round() as usize;
        let frames: Vec<Pose> = (0..=last)
            .map(|frame| figure.pose(&stances(frame as f64 / rate_hz)))
            .collect();
        Ok(Clip {
            name: self.kind.name().to_owned(),
            rate_hz,
            frames,
        })
    }

    fn stances<'a>(&self, figure: &'a Figure) -> Result<StanceAt<'a>, MotionError> {
        match self.kind {
            ProceduralKind::Jump => hops::jump(self, figure),
            ProceduralKind::Hop => hops::hop(self, figure),
            ProceduralKind::OneLegHop => hops::one_leg_hop(self, figure),
            ProceduralKind::JumpingJacks => hops::jumping_jacks(self, figure),
            ProceduralKind::RunInPlace => hops::run_in_place(self, figure),
            ProceduralKind::Walk => grounded::walk(self, figure),
            ProceduralKind::Twist => grounded::twist(self, figure),
            ProceduralKind::ShakeHips => grounded::shake_hips(self, figure),
        }
    }

    /// Number of repetitions of `period_seconds` that fit beside `other_seconds`; the next lower
    /// multiple of `multiple`.
    fn repetitions(
        &self,
        period_seconds: f64,
        other_seconds: f64,
        multiple: usize,
    ) -> Result<usize, MotionError> {
        let left = self.duration_seconds - LEAD_SECONDS - TAIL_SECONDS - other_seconds;
        let count = (left / period_seconds + 1e-9).floor().max(0.0) as usize / multiple * multiple;
        if count > 0 {
            return Ok(count);
        }
        let shortest = self.duration_seconds - left + period_seconds * multiple as f64;
        Err(MotionError::Parameter {
            name: "duration_seconds",
            got: self.duration_seconds,
            expected: format!("at least {shortest:.2} s for one repetition at this tempo"),
        })
    }
}

/// What the body does at a time in seconds.
type StanceAt<'a> = Box<dyn Fn(f64) -> Stance + 'a>;
