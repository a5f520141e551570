//! Thighs and shins.

use dynaskin_body::Joint;
use glam::DVec3;

use super::frames::{turn_frame, twist_degrees};
use super::twist::{HingeLimits, Twist};
use super::{Alignment, Builder, Side};
use crate::retarget::evidence::bone;

const KNEE: HingeLimits = HingeLimits {
    name: "knee",
    drawn: 8.0,
    drawn_unsure: 20.0,
    believed: 90.0,
};
/// A shin whose knee is drawn within these degrees of how it bends is not rolled: shins twist
/// themselves.
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
        let bone = self.target_bone(hip, knee);
        let hinge = self.evidence.hinge([own, middle, end]);
        let along = self.zero_bone(hip, knee).unwrap_or_default();
        let mut upper = self.along_bone(alignment.of(hip), hip, knee);
        let twist = Twist::new(
            along,
            upper * DVec3::X,
            hinge.as_ref().map(|hinge| hinge.in_upper),
            self.left_without_knee(alignment, side),
            &KNEE,
        );
        if twist.is_rolled
            && let Some(turn) = turn_frame([bone, DVec3::X], [along, twist.axis])
        {
            upper = turn;
        }
        self.notes.extend(twist.note(hip, &KNEE));
        alignment.set(hip, upper);

        let hinge = hinge.filter(|_| twist.is_by_hinge);
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
