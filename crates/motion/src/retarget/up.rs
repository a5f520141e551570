//! Where up is in a file, judged by the body.

use dynaskin_body::Joint;
use glam::{DQuat, DVec3};

use super::skeleton::Source;

/// Frames looked at, at most.
const MAX_FRAMES: usize = 50;
/// Mean of the unit vectors from knees to shoulders along an axis that somebody stands along.
const STANDS: f64 = 0.75;
/// The same below which somebody hardly stands.
const HARDLY_STANDS: f64 = 0.3;
/// Heights of resting ankles above a floor through the origin, in legs.
const ANKLES: std::ops::Range<f64> = -0.1..0.35;
/// A zero pose stands if its trunk is within this angle (radians) of its legs.
const STRAIGHT: f64 = 0.5;

/// What a body tells of the axes of its file.
struct Stance {
    /// Mean direction from knees to shoulders in the motion.
    mean: DVec3,
    /// The same in the zero pose; 0 where that does not stand.
    rest: DVec3,
    /// Per frame the smaller coordinates of both ankles, and the greater ones, in legs.
    ankles: Vec<[DVec3; 2]>,
}

impl Stance {
    fn new(source: &Source<'_>) -> Self {
        let count = source.motion.frame_count();
        let leg = source.leg_length().max(1e-9);
        let mut sum = DVec3::ZERO;
        let mut ankles = Vec::new();
        for frame in (0..count).step_by(count.div_ceil(MAX_FRAMES).max(1)) {
            let world = source.motion.world_joints(frame);
            let at = |joint| world[source.source_joint(joint)].1;
            sum += knees_to_shoulders(at).normalize_or_zero();
            let [left, right] = [Joint::LeftAnkle, Joint::RightAnkle].map(|ankle| at(ankle) / leg);
            ankles.push([left.min(right), left.max(right)]);
        }
        let at = |joint: Joint| source.rest_of(joint).unwrap_or_default();
        let middle = |left: Joint| at(left) + at(left.mirrored());
        let legs = middle(Joint::LeftHip) - middle(Joint::LeftAnkle);
        let trunk = middle(Joint::LeftShoulder) - middle(Joint::LeftHip);
        let stands = legs.angle_between(trunk) < STRAIGHT;
        Self {
            mean: sum / ankles.len().max(1) as f64,
            rest: if stands {
                knees_to_shoulders(at).normalize_or_zero()
            } else {
                DVec3::ZERO
            },
            ankles,
        }
    }

    /// Whether a floor through the origin across this axis is where ankles rest.
    fn ankles_rest_at_origin(&self, axis: DVec3) -> bool {
        let is_positive = axis.element_sum() > 0.0;
        let lower = |[least, most]: &[DVec3; 2]| {
            if is_positive {
                least.dot(axis)
            } else {
                most.dot(axis)
            }
        };
        let mut heights: Vec<f64> = self.ankles.iter().map(lower).collect();
        heights.sort_by(f64::total_cmp);
        heights
            .get(heights.len() / 10)
            .is_some_and(|low| ANKLES.contains(low))
    }

    /// Whether up is along this axis, which the body is along in the motion.
    fn is_up(&self, axis: DVec3) -> bool {
        let is_clear = self.mean.dot(axis) > STANDS;
        let rests = is_along(self.rest, axis);
        if axis == DVec3::Z {
            // The usual other axis needs less.
            rests || (is_clear && self.ankles_rest_at_origin(axis))
        } else if axis == DVec3::NEG_Y {
            // Handstands end on a floor through the origin, too.
            is_clear && rests
        } else {
            is_clear && (rests || self.ankles_rest_at_origin(axis))
        }
    }
}

/// An axis other than +Y that may be up, the rotation that takes it to +Y, and what is to be said.
struct Axis {
    up: DVec3,
    to_y: fn() -> DQuat,
    note: Option<&'static str>,
}

const QUARTER_TURN: f64 = std::f64::consts::FRAC_PI_2;

const OTHER_AXES: [Axis; 5] = [
    Axis {
        up: DVec3::Z,
        to_y: || DQuat::from_rotation_x(-QUARTER_TURN),
        note: None,
    },
    Axis {
        up: DVec3::X,
        to_y: || DQuat::from_rotation_z(QUARTER_TURN),
        note: Some("the body stands along +X, which is taken for up"),
    },
    Axis {
        up: DVec3::NEG_Y,
        to_y: || DQuat::from_rotation_x(2.0 * QUARTER_TURN),
        note: Some("the body stands along -Y, which is taken for up"),
    },
    Axis {
        up: DVec3::NEG_Z,
        to_y: || DQuat::from_rotation_x(QUARTER_TURN),
        note: Some("the body stands along -Z, which is taken for up"),
    },
    Axis {
        up: DVec3::NEG_X,
        to_y: || DQuat::from_rotation_z(-QUARTER_TURN),
        note: Some("the body stands along -X, which is taken for up"),
    },
];

/// The rotation that takes a file's up to +Y, and what is to be said of it. +Y is up, unless the body
/// stands along another axis throughout. Then its zero pose must do so too, or its ankles must be
/// where a floor through the origin wants them.
pub fn find_up(source: &Source<'_>) -> (DQuat, Option<&'static str>) {
    let stance = Stance::new(source);
    let along = OTHER_AXES
        .into_iter()
        .find(|axis| is_along(stance.mean, axis.up));
    match along {
        Some(axis) if stance.is_up(axis.up) => ((axis.to_y)(), axis.note),
        Some(_) => (
            DQuat::IDENTITY,
            Some("the body lies or is upside down throughout: +Y is taken for up"),
        ),
        None => {
            let note = "where up is cannot be made out by the body: +Y is taken";
            let hardly_stands = stance.mean.y < HARDLY_STANDS;
            (DQuat::IDENTITY, hardly_stands.then_some(note))
        }
    }
}

/// From the middle of the knees to the middle of the shoulders: up, for somebody standing.
fn knees_to_shoulders(at: impl Fn(Joint) -> DVec3) -> DVec3 {
    at(Joint::LeftShoulder) + at(Joint::RightShoulder) - at(Joint::LeftKnee) - at(Joint::RightKnee)
}

/// Whether `axis` is the axis of the world closest to `direction`.
fn is_along(direction: DVec3, axis: DVec3) -> bool {
    let along = direction.dot(axis);
    along > 0.0 && (direction - along * axis).abs().max_element() < along
}
