//! Which motions there are, and their parameters.

use crate::MotionError;

/// Time standing still before the motion, in seconds.
pub const LEAD_SECONDS: f64 = 0.6;
/// Time standing still after the motion, in seconds: tissue rings for about that long.
pub const TAIL_SECONDS: f64 = 0.8;

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
    pub(super) const fn usual(self) -> (f64, f64) {
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
    pub(super) const fn tempos_hz(self) -> (f64, f64) {
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
    pub(super) const fn heights_m(self) -> (f64, f64) {
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

    /// Number of repetitions of `period_seconds` that fit beside `other_seconds`; the next lower
    /// multiple of `multiple`.
    pub(super) fn repetitions(
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
