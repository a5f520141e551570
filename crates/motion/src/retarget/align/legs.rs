//! Thighs and shins.

use dynaskin_body::Joint;
use glam::DVec3;

use super::frames::{turn_frame, twist_degrees};
use super::{Alignment, Builder, Side};
use crate::retarget::evidence::bone;

/// A thigh whose knee is drawn within these degrees of how it bends is not rolled.
const THIGH_TWIST: f64 = 7.0;
/// The same where the knee hardly bends, against the toes or the least twisted mean.
const UNSURE_THIGH_TWIST: f64 = 30.0;
/// The same for shins, which twist themselves.
const SHIN_TWIST: f64 = 25.0;
/// Toes tell where a knee points if they agree by this length of their mean.
const TOES_AGREE: f64 = 0.5;

impl Builder<'_> {
    /// Thigh and shin: their bones, and about them the axis that the knee bends about.
    pub(super) fn leg(&mut self, alignment: &mut Alignment, side: Side) {
        let [hip, knee, ankle] =
            [Joint::LeftHip, Joint::LeftKnee, Joint::LeftAnkle].map(|of| side.of(of));
        let (Some(own), Some(middle), Some(end)) = (self.at(hip), self.at(knee), self.at(ankle))
        else {
            return;
        };
        let hinge = self.evidence.hinge([own, middle, end]);
        let bone = self.target_bone(hip, knee);

        let mut upper = self.along_bone(alignment.of(hip), hip, knee);
        let (left_in_thigh, limit) = match &hinge {
            Some(hinge) => (hinge.in_upper, THIGH_TWIST),
            None => (self.left_without_knee(alignment, side), UNSURE_THIGH_TWIST),
        };
        if let Some(along) = self.zero_bone(hip, knee) {
            let is_rolled = twist_degrees(along, left_in_thigh, upper * DVec3::X) > limit;
            if std::env::var("ZP").is_ok() {
                eprintln!(
                    "ZP {} {} rolled {:.0}",
                    hip.name(),
                    hinge.is_some(),
                    twist_degrees(along, left_in_thigh, upper * DVec3::X)
                );
            }
            if is_rolled && let Some(turn) = turn_frame([bone, DVec3::X], [along, left_in_thigh]) {
                upper = turn;
            }
            self.say_twist(hip, "knee", is_rolled, hinge.is_some());
        }
        alignment.set(hip, upper);

        let mut lower = self.along_bone(upper, knee, ankle);
        let left_in_shin = match &hinge {
            Some(hinge) => hinge.in_lower,
            None => self
                .evidence
                .mean_in(middle, |world| world[own].0 * (upper * DVec3::X)),
        };
        if let Some(along) = self.zero_bone(knee, ankle)
            && twist_degrees(along, left_in_shin, lower * DVec3::X) > SHIN_TWIST
            && let Some(turn) = turn_frame(
                [self.target_bone(knee, ankle), DVec3::X],
                [along, left_in_shin],
            )
        {
            lower = turn;
        }
        alignment.set(knee, lower);
    }

    /// The body's left in a thigh whose knee hardly bends: across the toes, else as untwisted from the
    /// pelvis as can be.
    fn left_without_knee(&self, alignment: &Alignment, side: Side) -> DVec3 {
        let [hip, knee, ankle, foot] = [
            Joint::LeftHip,
            Joint::LeftKnee,
            Joint::LeftAnkle,
            Joint::LeftFoot,
        ]
        .map(|of| side.of(of));
        let (Some(own), Some(middle), Some(end)) = (self.at(hip), self.at(knee), self.at(ankle))
        else {
            return DVec3::ZERO;
        };
        let across_toes = self.at(foot).map(|toes| {
            self.evidence.mean_in(own, |world| {
                let down = bone(world, middle, end);
                bone(world, end, toes).cross(down).normalize_or_zero()
            })
        });
        across_toes
            .filter(|left| left.length() > TOES_AGREE)
            .unwrap_or_else(|| {
                let pelvis = self.at(Joint::Pelvis).unwrap_or_default();
                let turn = alignment.of(Joint::Pelvis);
                let bone = self.target_bone(hip, knee);
                self.evidence
                    .untwisted([own, middle], (pelvis, turn), bone, DVec3::X)
            })
    }
}
