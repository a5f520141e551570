//! Adults only: checks the proportions of an avatar.
//!
//! Crown to shoulder over stature falls with age: 0.229 at 10 years, 0.22 at 12 to 14, 0.217 at 16, 0.213
//! at 18, 0.203 to 0.206 at 25 (bodies of the MakeHuman community). Realistic adults have 0.175 to 0.209,
//! toons 0.23 and more. Proportions cannot tell fourteen to eighteen years from adults: they are
//! necessary, never sufficient, which is why the caller declares what an avatar depicts as well.

pub use dynaskin_binding::Proportions;
use dynaskin_skeleton::Joint;
use glam::Vec3;

use crate::BindError;
use crate::bones::Bones;
use crate::parts::Part;

/// Ratio of crown to shoulder to stature at and above which an avatar is refused.
pub const MOST_CROWN_TO_SHOULDER: f64 = 0.220;
/// Ratio of crown to shoulder to stature at and above which chest and buttocks do not move.
pub const GUARDED_CROWN_TO_SHOULDER: f64 = 0.212;
/// Ratio of hip height to stature at and below which an avatar is refused.
pub const LEAST_HIP_HEIGHT: f64 = 0.48;
/// Stature in metres below which an avatar is refused.
pub const LEAST_STATURE_M: f64 = 1.45;
/// Median distance from the fitted body in metres above which chest and buttocks do not move.
pub const GUARDED_MEDIAN_M: f64 = 0.02;
/// Taller than any person: the file has a unit of its own, which says nothing of stature.
const TALLEST_M: f64 = 2.6;

/// Measures the avatar's skin (`positions_m` and the part of each vertex that it belongs to most).
pub(crate) fn measured(bones: &Bones, positions_m: &[Vec3], parts: &[Option<Part>]) -> Proportions {
    let extent = |is_wanted: &dyn Fn(Part) -> bool| {
        let of_part = positions_m.iter().zip(parts);
        let heights = of_part
            .filter(|(_, part)| part.is_some_and(is_wanted))
            .map(|(position, _)| f64::from(position.y));
        heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), y| {
            (low.min(y), high.max(y))
        })
    };
    let all = extent(&|_| true);
    let or = |own: f64, other: f64| if own.is_finite() { own } else { other };
    let crown = or(extent(&|part| part == Part::Head).1, all.1);
    let sole = or(extent(&Part::is_foot).0, all.0);
    let stature = crown - sole;
    let height = |left: Joint| {
        let heights = [left, left.mirrored()].map(|joint| bones.place_m(joint));
        let heights: Vec<f64> = heights.iter().flatten().map(|place| place.y).collect();
        heights.iter().sum::<f64>() / heights.len() as f64
    };
    Proportions {
        crown_to_shoulder: (crown - height(Joint::LeftShoulder)) / stature,
        hip_height: (height(Joint::LeftHip) - sole) / stature,
        stature_m: (bones.knows_stature && stature < TALLEST_M).then_some(stature),
    }
}

/// Refuses what has not the proportions of an adult.
///
/// # Errors
/// [`BindError::NotAdult`].
pub(crate) fn check(found: &Proportions) -> Result<(), BindError> {
    // Written so that what is not a number is refused.
    let is_adult = found.crown_to_shoulder < MOST_CROWN_TO_SHOULDER
        && found.hip_height > LEAST_HIP_HEIGHT
        && found
            .stature_m
            .is_none_or(|stature_m| stature_m >= LEAST_STATURE_M);
    if is_adult {
        Ok(())
    } else {
        Err(BindError::NotAdult(*found))
    }
}

/// Whether chest and buttocks stay still for the proportions alone.
pub(crate) fn is_guarded(found: &Proportions) -> bool {
    // Written so that what is not a number is guarded.
    !matches!(found.crown_to_shoulder, ..GUARDED_CROWN_TO_SHOULDER)
}
