//! How a limb's first bone is rolled about itself: the zero pose, the hinge after it and the least
//! twisted mean against each other.

use dynaskin_body::Joint;
use glam::DVec3;

use super::frames::twist_degrees;

/// In degrees about the bone.
pub struct HingeLimits {
    pub name: &'static str,
    /// A zero pose whose hinge is drawn within this of how it bends is kept.
    pub drawn: f64,
    /// The same where the hinge tells nothing, against the least twisted mean.
    pub drawn_unsure: f64,
    /// No limb is twisted by more on average: a hinge that says so bends backwards.
    pub believed: f64,
}

/// Guesses that agree within this need no word.
const AGREED: f64 = 15.0;

/// Where the axis of a hinge is in the bone before it, and who says so.
pub struct Twist {
    pub axis: DVec3,
    /// Whether the zero pose is drawn otherwise.
    pub is_rolled: bool,
    pub is_by_hinge: bool,
    bends_back: bool,
    guesses_agree: bool,
}

impl Twist {
    /// `drawn` is the axis of the zero pose, `hinge` the one found to bend about, `untwisted` that of
    /// the least twisted mean, in the rest space of the bone `along`.
    pub fn new(
        along: DVec3,
        drawn: DVec3,
        hinge: Option<DVec3>,
        untwisted: DVec3,
        limits: &HingeLimits,
    ) -> Self {
        let believed =
            hinge.filter(|axis| twist_degrees(along, *axis, untwisted) < limits.believed);
        let (axis, limit) = match believed {
            Some(axis) => (axis, limits.drawn),
            None => (untwisted, limits.drawn_unsure),
        };
        let apart = twist_degrees(along, axis, drawn);
        Self {
            axis,
            is_rolled: apart > limit,
            is_by_hinge: believed.is_some(),
            bends_back: hinge.is_some() && believed.is_none(),
            guesses_agree: apart < AGREED,
        }
    }

    /// What is to be said of the limb.
    pub fn note(&self, limb: Joint, limits: &HingeLimits) -> Option<String> {
        let (limb, hinge) = (limb.name(), limits.name);
        let taken = if self.is_rolled {
            "the least twisted on average is taken"
        } else {
            "it is as drawn"
        };
        if self.bends_back {
            Some(format!(
                "the {hinge} bends backwards, so it does not tell how {limb} is twisted: {taken}"
            ))
        } else if self.is_by_hinge {
            self.is_rolled
                .then(|| format!("the twist of {limb} comes from how the {hinge} bends"))
        } else {
            (!self.guesses_agree).then(|| {
                format!(
                    "the {hinge} hardly bends, so it does not tell how {limb} is twisted: {taken}"
                )
            })
        }
    }
}
