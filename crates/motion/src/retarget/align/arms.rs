//! Collars, arms and hands.

use dynaskin_body::Joint;
use glam::{DQuat, DVec3};

use super::frames::{degrees, turn_degrees, turn_frame, twist_degrees};
use super::twist::{HingeLimits, Twist};
use super::{Alignment, Builder, Side};

/// A collar whose zero pose is within these degrees of its mean in the motion, or of a usual drawing,
/// is drawn as it rests.
const COLLAR_TURN: f64 = 8.0;
/// A collar that turns less than this against the chest (degrees) always rests.
const STILL_COLLAR: f64 = 3.0;
const ELBOW: HingeLimits = HingeLimits {
    name: "elbow",
    drawn: 8.0,
    drawn_unsure: 45.0,
    believed: 120.0,
};
/// A forearm whose elbow is drawn within these degrees of how it bends is not rolled: forearms twist
/// themselves. Then where the elbow tells nothing.
const FOREARM_TWIST: f64 = 25.0;
const UNSURE_FOREARM_TWIST: f64 = 60.0;
/// Fingers are within these degrees of the forearm on average.
const FINGERS: f64 = 45.0;
/// Hands bend and turn against the forearm by up to this for long.
const HAND_BEND: f64 = 35.0;
const HAND_TURN: f64 = 75.0;

impl Builder<'_> {
    pub(super) fn arm(&mut self, alignment: &mut Alignment, side: Side) {
        self.collar(alignment, side);
        self.upper_arm(alignment, side);
        self.hand(alignment, side);
    }

    /// A collar rests as it stands to the chest on average, or as collars are drawn: sideways, or as
    /// the body's slant.
    fn collar(&mut self, alignment: &mut Alignment, side: Side) {
        let [collar, shoulder] = [Joint::LeftCollar, Joint::LeftShoulder].map(|of| side.of(of));
        let (chest, chest_turn) = alignment.chest(self.source);
        let (Some(own), Some(arm)) = (self.at(collar), self.at(shoulder)) else {
            return;
        };
        let zero = alignment.of(collar);
        let along = self.evidence.mean_bone(own, arm);
        let (turn, spread) = self.evidence.mean_turn(own, chest);
        let mean = turn * chest_turn;
        let up = mean * DVec3::Y;
        let drawn = [DVec3::X * side.sign(), self.target_bone(collar, shoulder)]
            .into_iter()
            .filter_map(|bone| turn_frame([bone, DVec3::Y], [along, up]));
        let mut usual = vec![mean];
        if spread.to_degrees() > STILL_COLLAR {
            usual.extend(drawn);
        }
        if usual
            .iter()
            .any(|usual| turn_degrees(*usual, zero) < COLLAR_TURN)
        {
            return;
        }
        let nearest = usual.iter().skip(1).copied().min_by(|a, b| {
            let [a, b] = [a, b].map(|usual| turn_degrees(*usual, mean));
            a.total_cmp(&b)
        });
        alignment.set(collar, nearest.unwrap_or(mean));
        if self.is_upright {
            self.note(format!(
                "{} is not drawn as it rests: aligned by how it moves",
                collar.name()
            ));
        }
    }

    /// Upper arm and forearm: their bones, and about them the axis that the elbow bends about.
    fn upper_arm(&mut self, alignment: &mut Alignment, side: Side) {
        let [shoulder, elbow, wrist] =
            [Joint::LeftShoulder, Joint::LeftElbow, Joint::LeftWrist].map(|of| side.of(of));
        let (Some(own), Some(middle)) = (self.at(shoulder), self.at(elbow)) else {
            return;
        };
        let axis = self.elbow_axis(side);
        let bone = self.target_bone(shoulder, elbow);
        let (chest, chest_turn) = alignment.chest(self.source);

        let untwisted = self
            .evidence
            .untwisted([own, middle], (chest, chest_turn), bone, axis);
        let hinge = self
            .at(wrist)
            .and_then(|end| self.evidence.hinge([own, middle, end]));
        let along = self.zero_bone(shoulder, elbow).unwrap_or_default();
        let mut upper = self.along_bone(alignment.of(shoulder), shoulder, elbow);
        let twist = Twist::new(
            along,
            upper * axis,
            hinge.as_ref().map(|hinge| hinge.in_upper),
            untwisted,
            &ELBOW,
        );
        if twist.is_rolled
            && let Some(turn) = turn_frame([bone, axis], [along, twist.axis])
        {
            upper = turn;
        }
        self.notes.extend(twist.note(shoulder, &ELBOW));
        alignment.set(shoulder, upper);

        let hinge = hinge.filter(|_| twist.is_by_hinge);
        let mut lower = self.along_bone(upper, elbow, wrist);
        let (axis_in_lower, limit) = match &hinge {
            Some(hinge) => (hinge.in_lower, FOREARM_TWIST),
            None => (
                self.evidence
                    .mean_in(middle, |world| world[own].0 * (upper * axis)),
                UNSURE_FOREARM_TWIST,
            ),
        };
        if let Some(along) = self.zero_bone(elbow, wrist)
            && twist_degrees(along, axis_in_lower, lower * axis) > limit
            && let Some(turn) = turn_frame(
                [self.target_bone(elbow, wrist), axis],
                [along, axis_in_lower],
            )
        {
            lower = turn;
        }
        alignment.set(elbow, lower);
    }

    /// The body's axis of an elbow at rest, upper arm times forearm. Elbows of a T-pose bend ahead:
    /// about down on the left, about up on the right.
    fn elbow_axis(&self, side: Side) -> DVec3 {
        let [shoulder, elbow] = [Joint::LeftShoulder, Joint::LeftElbow].map(|of| side.of(of));
        let out = DVec3::X * side.sign();
        let bone = self.target_bone(shoulder, elbow).normalize_or(out);
        let roll = DQuat::from_axis_angle(bone, -side.sign() * self.elbow_roll());
        roll * DQuat::from_rotation_arc(out, bone) * (-DVec3::Y * side.sign())
    }

    /// By how much the axis of elbows is drawn rolled about the upper arm, in radians. CMU's skeletons
    /// turn it by 30 degrees; they alone have joints between pelvis and legs. All others draw the
    /// elbows of a T-pose to bend straight ahead.
    fn elbow_roll(&self) -> f64 {
        let motion = self.source.motion;
        let has = |wanted: &str| {
            let mut names = (0..motion.joint_count()).map(|joint| motion.name(joint));
            names.any(|name| name.to_ascii_lowercase().ends_with(wanted))
        };
        if has("lhipjoint") && has("rhipjoint") && has("lowerback") {
            30.0_f64.to_radians()
        } else {
            0.0
        }
    }

    /// Hands are drawn along the forearm, and are so on average.
    fn hand(&self, alignment: &mut Alignment, side: Side) {
        let [elbow, wrist, hand] =
            [Joint::LeftElbow, Joint::LeftWrist, Joint::LeftHand].map(|of| side.of(of));
        let forearm = alignment.of(elbow);
        let mut turn = forearm;
        if let (Some(middle), Some(own)) = (self.at(elbow), self.at(wrist)) {
            let axis = self.elbow_axis(side);
            let bone = self.target_bone(elbow, wrist);
            let (mean, _) = self.evidence.mean_turn(own, middle);
            let mean = mean * forearm;
            // Ends of hands are often drawn anywhere; fingers are ahead on average.
            let fingers = self
                .zero_bone(wrist, hand)
                .filter(|along| degrees(*along, mean * bone) < FINGERS);
            let axis_in_hand = self
                .evidence
                .mean_in(own, |world| world[middle].0 * (forearm * axis));
            let by_fingers = fingers
                .and_then(|along| turn_frame([bone, axis], [along, axis_in_hand]))
                .filter(|turn| degrees(*turn * bone, forearm * bone) > HAND_BEND);
            if let Some(by_fingers) = by_fingers {
                turn = by_fingers;
            } else if turn_degrees(mean, forearm) > HAND_TURN {
                turn = mean;
            }
        }
        alignment.set(wrist, turn);
        alignment.set(hand, turn);
    }
}
