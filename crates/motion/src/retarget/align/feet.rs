//! Feet: where the toes point, and how the sole lies.

use dynaskin_body::Joint;
use glam::{DMat3, DQuat, DVec3};

use super::frames::{degrees, turn_frame};
use super::{Alignment, Builder, Side};
use crate::retarget::evidence::bone;

/// Largest correction of the pitch of the soles, in radians, if the toes do not ask for more. Larger
/// angles than rest poses explain are how somebody stands.
const MAX_SOLE_PITCH: f64 = 0.2;
/// The same for feet whose toes are where those of a flat foot are once corrected.
const MAX_PITCH_OF_FLAT: f64 = 1.2;
/// The bone from ankle to toes points down from a flat sole by at least and most this, in radians:
/// ankles lie higher than toes. Runners and dancers on their toes stand steeper.
const LEAST_TOES_DOWN: f64 = 0.1;
const MOST_TOES_DOWN: f64 = 0.45;
/// Drawn toes are between these degrees from the shin.
const DRAWN_TOES: std::ops::Range<f64> = 40.0..95.0;
/// The end of a foot's bone is where toes are if it is this far from the shin, in radians, on average.
const TOES_FROM_SHIN: f64 = 0.5;
/// A sole is drawn flat on the floor if the shin stands on it within these degrees.
const STANDING_SHIN: f64 = 30.0;
/// Feet without toes are drawn across the shin within these degrees.
const SOLE_TILT: f64 = 25.0;
/// Toes point where the knee does within these degrees.
const FOOT_TURN: f64 = 40.0;
/// Least length of a mean of unit vectors that counts: captured ankles turn wildly at times.
const AGREED: f64 = 0.8;
/// Toes are in front of the shin by at least this sine on average.
const TOES_AHEAD: f64 = 0.3;

/// What the soles of the source's rest pose are flat against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SoleReference {
    /// The floor across the trunk.
    Floor,
    /// The plane across the shin: feet that turn with spread legs, as in CMU's skeletons.
    Shin,
}

impl Builder<'_> {
    pub(super) fn foot(&mut self, alignment: &mut Alignment, side: Side, reference: SoleReference) {
        let [knee, ankle, foot] =
            [Joint::LeftKnee, Joint::LeftAnkle, Joint::LeftFoot].map(|of| side.of(of));
        let (Some(middle), Some(end)) = (self.at(knee), self.at(ankle)) else {
            return;
        };
        let toes = self.at(foot);
        let shin = alignment.of(knee);
        let has_toes = toes.is_some() || self.end_is_ahead([middle, end], ankle);
        let drawn = self.drawn_sole(alignment, side, reference, has_toes);
        let along = self.zero_bone(ankle, foot).unwrap_or_default();
        let left = self
            .evidence
            .mean_in(end, |world| world[middle].0 * (shin * DVec3::X));
        let is_turned = left.length() > AGREED && degrees(left, drawn * DVec3::X) > FOOT_TURN;
        // Ankles that turn the toes back, as broken captures have them, tell nothing of the drawing.
        let toes_ahead = toes.map_or(1.0, |toes| {
            self.evidence.votes(|world| {
                let up = -bone(world, middle, end);
                let ahead = (world[middle].0 * (shin * DVec3::X)).cross(up);
                bone(world, end, toes).dot(ahead)
            })
        });
        if is_turned && toes_ahead < TOES_AHEAD {
            self.note(format!(
                "{} turns the toes away from where the knee points: kept as drawn",
                ankle.name()
            ));
        }
        // Without toes, soles are across the shin on average.
        let mean = self.evidence.mean_turn(end, middle).0 * shin;
        let to_shin = degrees(along, self.zero_bone(knee, ankle).unwrap_or_default());
        let differs = !self.is_upright
            || (has_toes && !DRAWN_TOES.contains(&to_shin))
            || (!has_toes && degrees(mean * DVec3::Y, drawn * DVec3::Y) > SOLE_TILT)
            || (is_turned && toes_ahead >= TOES_AHEAD);
        let sole = if differs {
            self.note(format!(
                "{} is not drawn as it stands: its sole is aligned by how it moves",
                ankle.name()
            ));
            has_toes
                .then(|| turn_frame([self.target_bone(ankle, foot), DVec3::X], [along, left]))
                .flatten()
                .unwrap_or(mean)
        } else {
            drawn
        };
        let ball = match toes {
            Some(toes) if differs => self.evidence.mean_turn(toes, end).0 * sole,
            _ => sole,
        };
        alignment.set(ankle, sole);
        alignment.set(foot, ball);
        let is_right = usize::from(side == Side::Right);
        alignment.toes_down[is_right] = has_toes
            .then(|| (sole.inverse() * along).normalize_or_zero().y)
            .map(|up| -up.clamp(-1.0, 1.0).asin());
    }

    /// Whether the end of an ankle's bone is where toes are, not along the shin.
    fn end_is_ahead(&self, [knee, ankle]: [usize; 2], joint: Joint) -> bool {
        let (Some(end), Some(start)) = (self.source.end_of(joint), self.source.rest_of(joint))
        else {
            return false;
        };
        let foot = end - start;
        let mean = self.evidence.votes(|world| {
            let shin = bone(world, knee, ankle);
            if shin == DVec3::ZERO {
                return 0.0;
            }
            (world[ankle].0 * foot).angle_between(shin)
        });
        foot.length() > self.shortest() && mean > TOES_FROM_SHIN
    }

    /// Alignment of a foot that lays the body's flat sole onto that of the zero pose and turns its toes
    /// to where the source's point; without toes, to where the trunk faces.
    fn drawn_sole(
        &self,
        alignment: &Alignment,
        side: Side,
        reference: SoleReference,
        has_toes: bool,
    ) -> DQuat {
        let [knee, ankle, foot] =
            [Joint::LeftKnee, Joint::LeftAnkle, Joint::LeftFoot].map(|of| side.of(of));
        let trunk_up = alignment.of(Joint::Pelvis) * DVec3::Y;
        let along_shin = -self
            .zero_bone(knee, ankle)
            .unwrap_or_default()
            .normalize_or(-DVec3::Y);
        let stands = degrees(along_shin, trunk_up) < STANDING_SHIN;
        let up = match reference {
            SoleReference::Floor if stands => trunk_up,
            SoleReference::Floor | SoleReference::Shin => along_shin,
        };
        let trunk_ahead = alignment.of(Joint::Pelvis) * DVec3::Z;
        let ahead = self
            .zero_bone(ankle, foot)
            .filter(|_| has_toes)
            .unwrap_or(trunk_ahead);
        let source_frame = sole_frame(up, ahead);
        let target_frame = sole_frame(DVec3::Y, self.target_bone(ankle, foot));
        DQuat::from_mat3(&(source_frame * target_frame.transpose())).normalize()
    }
}

impl Alignment {
    /// Turns the left and the right foot so that soles whose toes point up by these angles
    /// (radians) become flat.
    pub fn pitch_soles(&mut self, toes_up: [f64; 2]) {
        let feet = [
            [Joint::LeftAnkle, Joint::LeftFoot],
            [Joint::RightAnkle, Joint::RightFoot],
        ];
        for ((joints, angle), toes_down) in feet.into_iter().zip(toes_up).zip(self.toes_down) {
            // Nobody stands with toes up for long.
            let most = if angle > 0.0 { 1.0 } else { MOST_TOES_DOWN };
            let is_flat_then =
                toes_down.is_some_and(|down| (LEAST_TOES_DOWN..most).contains(&(down - angle)));
            let limit = if is_flat_then {
                MAX_PITCH_OF_FLAT
            } else {
                MAX_SOLE_PITCH
            };
            let down = DQuat::from_rotation_x(angle.clamp(-limit, limit));
            for joint in joints {
                self.source_from_target[joint as usize] *= down;
            }
        }
    }
}

/// y along `up`, z along `ahead` as far as that is possible.
fn sole_frame(up: DVec3, ahead: DVec3) -> DMat3 {
    let ahead = ahead
        .reject_from_normalized(up)
        .try_normalize()
        .unwrap_or_else(|| DVec3::Z.reject_from_normalized(up).normalize_or(DVec3::X));
    DMat3::from_cols(up.cross(ahead), up, ahead)
}
