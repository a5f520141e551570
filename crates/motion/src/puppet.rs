//! A standing body that is moved by hand.

use std::f64::consts::TAU;

use dynaskin_body::{JOINT_COUNT, Joint, Pose};
use glam::{DVec3, Vec3};

use crate::MotionError;
use crate::procedural::ik::{Arm, IkSolver, Sides, Sole, Stance};

/// Natural frequency (Hz) and damping ratio with which a held part follows the hand: quick, and
/// without swinging, as a hand does not shake what it holds.
const HELD: (f64, f64) = (2.6, 0.75);
/// The same for the whole body once it is let go: it swings past its place twice or so.
const FREE: (f64, f64) = (1.7, 0.28);
/// The same for the part of the trunk that is not held.
const TRUNK: (f64, f64) = (2.0, 0.4);
/// The same for the arms, which hang from the chest.
const ARMS: (f64, f64) = (1.1, 0.3);
/// How far the part of the trunk that is not held goes along, over the way of the held one.
const GOES_ALONG: f64 = 0.45;
/// Share of the pelvis in the lean of the trunk; the spine has the rest.
const PELVIS_SHARE: f64 = 0.25;
/// Largest displacement of a held part per length of leg: sideways, up and down.
const LIMITS: [f64; 3] = [0.26, 0.36, 0.42];
/// Largest lean of the trunk, in radians.
const MAX_LEAN: f64 = 0.7;
/// Rise beyond which the soles leave the floor gradually, in metres.
const LIFT_SOFTNESS_M: f64 = 0.04;
/// A step that lasts longer counts as this long, in seconds: a hidden tab's clock jumps.
const LONGEST_STEP_SECONDS: f64 = 0.25;
/// Targets move with the parts they belong to, so long steps are taken in pieces.
const PIECE_SECONDS: f64 = 1.0 / 240.0;

/// A part of the body that can be held.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Grip {
    /// The pelvis; the chest follows half of the way.
    Pelvis,
    /// The chest, at the third joint of the spine; the pelvis follows half of the way.
    Chest,
}

impl Grip {
    /// All parts.
    pub const ALL: [Self; 2] = [Self::Pelvis, Self::Chest];

    /// Name for programs.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Pelvis => "pelvis",
            Self::Chest => "chest",
        }
    }

    /// The part with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|grip| grip.name() == name)
    }

    const fn joint(self) -> Joint {
        match self {
            Self::Pelvis => Joint::Pelvis,
            Self::Chest => Joint::Spine3,
        }
    }
}

/// A body that stands until a part of it is held and pulled: the rest follows late, feet stay on
/// the floor until the legs are stretched, and let go it swings back. Damped springs move the
/// trunk and the hanging arms, legs are solved by inverse kinematics. The path does not depend on
/// the length of the steps.
pub struct Puppet {
    joints_rest_m: [Vec3; JOINT_COUNT],
    solver: IkSolver,
    trunk_m: f64,
    arm_m: f64,
    held: Option<(Grip, DVec3)>,
    /// Displacements from standing, in metres.
    pelvis: Swing,
    chest: Swing,
    hands: Swing,
}

impl Puppet {
    /// Stands, for a body with these rest joint positions (metres, standing in an A-pose or T-pose
    /// on y = 0, facing +Z).
    ///
    /// # Errors
    /// [`MotionError::Degenerate`] for joints that are no standing person.
    pub fn new(joints_rest_m: &[Vec3; JOINT_COUNT]) -> Result<Self, MotionError> {
        let solver = IkSolver::new(joints_rest_m)?;
        let length = |from: Joint, to: Joint| {
            let [from, to] = [from, to].map(|joint| joints_rest_m[joint as usize].as_dvec3());
            from.distance(to).max(0.05)
        };
        Ok(Self {
            joints_rest_m: *joints_rest_m,
            solver,
            trunk_m: length(Joint::Pelvis, Joint::Spine3),
            arm_m: length(Joint::LeftShoulder, Joint::LeftElbow)
                + length(Joint::LeftElbow, Joint::LeftWrist),
            held: None,
            pelvis: Swing::default(),
            chest: Swing::default(),
            hands: Swing::default(),
        })
    }

    /// Holds a part, and pulls it by `pull_m` (metres, world axes) from where it is when the body
    /// stands. Far pulls stretch less and less; the body stays within its reach.
    ///
    /// # Errors
    /// [`MotionError::Parameter`] for a pull that is not finite.
    pub fn hold(&mut self, grip: Grip, pull_m: DVec3) -> Result<(), MotionError> {
        for got in pull_m.to_array() {
            if !got.is_finite() {
                return Err(MotionError::Parameter {
                    name: "pull_m",
                    got,
                    expected: "finite metres".to_owned(),
                });
            }
        }
        self.held = Some((grip, self.within_reach(pull_m)));
        Ok(())
    }

    /// Lets go.
    pub fn release(&mut self) {
        self.held = None;
    }

    /// The part that is held.
    pub fn held(&self) -> Option<Grip> {
        self.held.map(|(grip, _)| grip)
    }

    /// Moves on by `dt_seconds` and gives the pose. A step below zero counts as none, and one over a
    /// quarter of a second as a quarter of a second.
    pub fn step(&mut self, dt_seconds: f64) -> Pose {
        // Comparisons with NaN are false: no step.
        let dt_seconds = if dt_seconds > 0.0 {
            dt_seconds.min(LONGEST_STEP_SECONDS)
        } else {
            0.0
        };
        let pieces = (dt_seconds / PIECE_SECONDS).ceil();
        for _ in 0..pieces as usize {
            self.advance(dt_seconds / pieces);
        }
        self.pose()
    }

    /// The present pose.
    pub fn pose(&self) -> Pose {
        self.solver.pose(&self.stance())
    }

    /// Where a part is in the present pose: its joint, metres, world.
    pub fn place_m(&self, grip: Grip) -> DVec3 {
        let joints = self.pose().world_joints(&self.joints_rest_m);
        joints.position_m[grip.joint() as usize]
    }

    fn within_reach(&self, pull_m: DVec3) -> DVec3 {
        let [aside, up, down] = LIMITS.map(|limit| limit * self.solver.leg_m);
        let flat = DVec3::new(pull_m.x, 0.0, pull_m.z);
        let height = soft_limit(pull_m.y, if pull_m.y > 0.0 { up } else { down });
        // A length that overflows has no direction.
        let across = flat.normalize_or_zero() * soft_limit(flat.length(), aside);
        across + height * DVec3::Y
    }

    fn advance(&mut self, seconds: f64) {
        let along = |way: DVec3| DVec3::new(GOES_ALONG * way.x, way.y, GOES_ALONG * way.z);
        match self.held {
            None => {
                self.pelvis.advance(DVec3::ZERO, FREE, seconds);
                self.chest.advance(along(self.pelvis.at_m), TRUNK, seconds);
            }
            Some((Grip::Pelvis, pull_m)) => {
                self.pelvis.advance(pull_m, HELD, seconds);
                self.chest.advance(along(self.pelvis.at_m), TRUNK, seconds);
            }
            Some((Grip::Chest, pull_m)) => {
                self.chest.advance(pull_m, HELD, seconds);
                self.pelvis.advance(along(self.chest.at_m), TRUNK, seconds);
            }
        }
        self.hands.advance(self.chest.at_m, ARMS, seconds);
    }

    fn stance(&self) -> Stance {
        let leg_m = self.solver.leg_m;
        let shift_m = self.pelvis.at_m;
        // A leg that leans stays as long as it is.
        let arc_m = (shift_m.x * shift_m.x + shift_m.z * shift_m.z) / (2.0 * leg_m);
        let lean = (self.chest.at_m - shift_m) / self.trunk_m;
        let [ahead, aside] = [lean.z, lean.x].map(|angle| soft_limit(angle, MAX_LEAN));
        let turn = DVec3::new(ahead, 0.0, -aside);
        let swing = (self.hands.at_m - self.chest.at_m) / self.arm_m;
        let arm = |outwards: f64| Arm {
            ahead: soft_limit(swing.z, 1.2) - ahead,
            // Arms go up to the sides when the body falls, and never into the trunk.
            aside: positive_part(outwards + 0.6 * swing.y, 0.1),
            bend: 0.0,
        };
        let sole = Sole {
            shift_m: positive_part(
                shift_m.y - 0.6 * self.solver.tiptoe_rise_m(),
                LIFT_SOFTNESS_M,
            ) * DVec3::Y,
            spring: 1.0,
            ..Sole::default()
        };
        Stance {
            pelvis_shift_m: shift_m - (self.solver.stand_drop_m + arc_m) * DVec3::Y,
            pelvis_turn: PELVIS_SHARE * turn,
            chest_turn: (1.0 - PELVIS_SHARE) * turn,
            soles: Sides {
                left: sole,
                right: sole,
            },
            arms: Sides {
                left: arm(swing.x + aside),
                right: arm(-swing.x - aside),
            },
        }
    }
}

/// A point on a damped spring.
#[derive(Clone, Copy, Debug, Default)]
struct Swing {
    at_m: DVec3,
    speed_m_per_s: DVec3,
}

impl Swing {
    /// Moves towards a target that stands still meanwhile, by the closed solution of the damped
    /// oscillator: steps of any length give the same path. `kind` is its natural frequency in hertz
    /// and its damping ratio, below 1.
    fn advance(&mut self, target_m: DVec3, (hz, damping): (f64, f64), seconds: f64) {
        let decay = damping * TAU * hz;
        let rate = (1.0 - damping * damping).sqrt() * TAU * hz;
        let (sin, cos) = (rate * seconds).sin_cos();
        let fade = (-decay * seconds).exp();
        let from_m = self.at_m - target_m;
        let swing = (self.speed_m_per_s + decay * from_m) / rate;
        let now_m = fade * (cos * from_m + sin * swing);
        self.speed_m_per_s = fade * rate * (cos * swing - sin * from_m) - decay * now_m;
        self.at_m = target_m + now_m;
    }
}

/// `value` where it is small, and never beyond `limit` in either direction.
fn soft_limit(value: f64, limit: f64) -> f64 {
    limit * (value / limit).tanh()
}

/// 0 below 0, and about `value` where that is well above `softness`; twice continuously
/// differentiable, so that tissue feels no blow.
fn positive_part(value: f64, softness: f64) -> f64 {
    if value <= 0.0 {
        return 0.0;
    }
    value * value * value / (value * value + softness * softness)
}
