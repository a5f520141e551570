//! Constant rotations between the rest poses of source and body.

use dynaskin_body::{JOINT_COUNT, Joint};
use glam::{DMat3, DQuat, DVec3};

use super::Source;
use super::evidence::{Evidence, bone};
use crate::MotionError;

/// Largest correction of the pitch of the soles, in radians.
const MAX_SOLE_PITCH: f64 = 0.2;

/// What the soles of the source's rest pose are flat against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SoleReference {
    /// The floor.
    Floor,
    /// The plane across the shin: feet that turn with spread legs, as in CMU's skeletons.
    Shin,
}

/// Angles in degrees by which a zero pose may differ from what the motion tells before the motion is
/// believed instead. Well-formed files stay within them, and keep the alignment of their zero pose:
/// drawn skeletons and bodies measured in motion never agree to the last degree.
const TRUNK_BEND: f64 = 28.0;
/// The same for a bone that the motion bends, since people bend forward for long.
const MOVING_BEND: f64 = 60.0;
const TRUNK_TWIST: f64 = 35.0;
const HEAD_TWIST: f64 = 70.0;
const COLLAR_SWING: f64 = 35.0;
const HAND_SWING: f64 = 35.0;
/// Thighs and upper arms against their hinges, and bones after a hinge, which twist themselves.
const UPPER_TWIST: f64 = 12.0;
const HINGE_TWIST: f64 = 25.0;
const FOOT_TURN: f64 = 75.0;

/// Least length of a mean of unit vectors that counts: captured ankles turn wildly at times.
const AGREED: f64 = 0.8;

/// A collar that turns less than this against the chest (radians) is drawn as it rests.
const STILL_COLLAR: f64 = 0.05;

/// Rest alignments: `world rotation of the body's joint = world rotation of the source's joint *
/// source_from_target`.
#[derive(Clone)]
pub struct Alignment {
    pub source_from_target: [DQuat; JOINT_COUNT],
    /// The same for the joints of the source that the spine is mixed from.
    pub of_source: Vec<DQuat>,
    /// Largest correction of the pitch of the left and the right sole, in radians.
    max_sole_pitch: [f64; 2],
}

/// Turns `ahead`-like vectors into a rotation: what `from` has as first and second axis goes to `to`'s.
fn turn_frame(from: [DVec3; 2], to: [DVec3; 2]) -> Option<DQuat> {
    let frame = |[first, second]: [DVec3; 2]| {
        let first = first.try_normalize()?;
        let second = second.reject_from_normalized(first).try_normalize()?;
        Some(DMat3::from_cols(first, second, first.cross(second)))
    };
    let turn = frame(to)? * frame(from)?.transpose();
    Some(DQuat::from_mat3(&turn).normalize())
}

fn degrees(a: DVec3, b: DVec3) -> f64 {
    if a.length() < 1e-9 || b.length() < 1e-9 {
        return 0.0;
    }
    a.angle_between(b).to_degrees()
}

/// Angle about `axis` from `a` to `b`, without sign, in degrees.
fn twist_degrees(axis: DVec3, a: DVec3, b: DVec3) -> f64 {
    let axis = axis.normalize_or(DVec3::Y);
    degrees(
        a.reject_from_normalized(axis),
        b.reject_from_normalized(axis),
    )
}

/// By how much the axis of elbows is drawn rolled about the upper arm, in radians: CMU's skeletons
/// (known by the joints between pelvis and legs, which only they have) turn it by 30 degrees, all
/// others draw elbows of a T-pose to bend straight ahead.
fn elbow_roll(source: &Source<'_>) -> f64 {
    let has = |wanted: &str| {
        let mut names = (0..source.motion.joint_count()).map(|joint| source.motion.name(joint));
        names.any(|name| name.to_ascii_lowercase().ends_with(wanted))
    };
    if has("lhipjoint") && has("rhipjoint") && has("lowerback") {
        30.0_f64.to_radians()
    } else {
        0.0
    }
}

/// How the legs, the arms and the feet of a skeleton are called here: left side, then mirrored.
fn on_side(joint: Joint, is_right: bool) -> Joint {
    if is_right { joint.mirrored() } else { joint }
}

impl Alignment {
    pub fn new(
        source: &Source<'_>,
        evidence: &Evidence,
        target_m: &[DVec3; JOINT_COUNT],
        reference: SoleReference,
        notes: &mut Vec<String>,
    ) -> Result<Self, MotionError> {
        let zero = trunk_alignment(source, target_m);
        let measured = measured_trunk(source, evidence);
        let trunk_of_zero = match (&zero, &measured) {
            (Ok(zero), Some(measured)) => {
                (!trunk_differs(*zero, measured, target_m)).then_some(*zero)
            }
            (Ok(zero), None) => Some(*zero),
            (Err(_), _) => None,
        };
        let joint_count = source.motion.joint_count();
        let mut alignment = match (trunk_of_zero, measured) {
            (Some(zero), _) => Self {
                source_from_target: [zero; JOINT_COUNT],
                of_source: vec![zero; joint_count],
                max_sole_pitch: [MAX_SOLE_PITCH; 2],
            },
            (None, Some(measured)) => {
                notes.push(
                    "the zero pose does not stand upright: the trunk is aligned by how it moves"
                        .to_owned(),
                );
                let pelvis = measured
                    .first()
                    .map_or(DQuat::IDENTITY, |pelvis| pelvis.turn);
                let mut alignment = Self {
                    source_from_target: [pelvis; JOINT_COUNT],
                    of_source: vec![pelvis; joint_count],
                    max_sole_pitch: [MAX_SOLE_PITCH; 2],
                };
                for measured in &measured {
                    alignment.of_source[measured.joint] = measured.turn;
                }
                for joint in Joint::ALL {
                    if let Some(source) = source.mapping.source(joint) {
                        alignment.source_from_target[joint as usize] = alignment.of_source[source];
                    }
                }
                alignment
            }
            (None, None) => {
                zero?;
                return Err(MotionError::EmptyClip);
            }
        };
        let is_upright = trunk_of_zero.is_some();
        alignment.head(source, evidence, target_m, is_upright, notes);
        for is_right in [false, true] {
            alignment.arm(source, evidence, target_m, is_right, is_upright, notes);
            alignment.leg(
                source, evidence, target_m, is_right, is_upright, reference, notes,
            );
        }
        Ok(alignment)
    }

    /// The chest's source joint and its alignment.
    fn chest(&self, source: &Source<'_>) -> (usize, DQuat) {
        let chest = source.mapping.spine.last().copied().unwrap_or_default();
        (chest, self.of_source[chest])
    }

    /// Neck and head: up from the chest, not turned against it on average.
    fn head(
        &mut self,
        source: &Source<'_>,
        evidence: &Evidence,
        target_m: &[DVec3; JOINT_COUNT],
        is_upright: bool,
        notes: &mut Vec<String>,
    ) {
        let (chest, chest_turn) = self.chest(source);
        let mut differs = !is_upright;
        for (joint, next) in [(Joint::Neck, Some(Joint::Head)), (Joint::Head, None)] {
            let Some(own) = source.mapping.source(joint) else {
                continue;
            };
            let next = next.and_then(|next| source.mapping.source(next));
            let up = match next {
                Some(next) => evidence.mean_in(own, |world| bone(world, own, next)),
                None => source.end_of(joint).map_or(DVec3::ZERO, |end| {
                    end - source.rest_of(joint).unwrap_or_default()
                }),
            };
            let left = evidence.mean_in(own, |world| world[chest].0 * (chest_turn * DVec3::X));
            let up_of_body = if joint == Joint::Neck {
                target_m[Joint::Head as usize] - target_m[Joint::Neck as usize]
            } else {
                DVec3::Y
            };
            let zero = self.source_from_target[joint as usize];
            differs |= degrees(up, zero * DVec3::Y).min(degrees(up, zero * up_of_body))
                > TRUNK_BEND + 12.0
                || twist_degrees(zero * DVec3::Y, left, zero * DVec3::X) > HEAD_TWIST;
            if !differs {
                continue;
            }
            let aligned = turn_frame([DVec3::Y, DVec3::X], [up, left]).unwrap_or_else(|| {
                let (turn, _) = evidence.mean_turn(own, chest);
                turn * chest_turn
            });
            self.source_from_target[joint as usize] = aligned;
            if is_upright {
                notes.push(format!(
                    "{} is not drawn upright: aligned by how it moves",
                    joint.name()
                ));
            }
        }
    }

    fn arm(
        &mut self,
        source: &Source<'_>,
        evidence: &Evidence,
        target_m: &[DVec3; JOINT_COUNT],
        is_right: bool,
        is_upright: bool,
        notes: &mut Vec<String>,
    ) {
        let [collar, shoulder, elbow, wrist, hand] = [
            Joint::LeftCollar,
            Joint::LeftShoulder,
            Joint::LeftElbow,
            Joint::LeftWrist,
            Joint::LeftHand,
        ]
        .map(|joint| on_side(joint, is_right));
        let (chest, chest_turn) = self.chest(source);
        let out = if is_right { -DVec3::X } else { DVec3::X };
        let at = |joint: Joint| source.mapping.source(joint);

        if let (Some(own), Some(arm)) = (at(collar), at(shoulder)) {
            let zero = self.source_from_target[collar as usize];
            let along = evidence.mean_in(own, |world| bone(world, own, arm));
            let up = evidence.mean_in(own, |world| world[chest].0 * (chest_turn * DVec3::Y));
            let body = target_m[shoulder as usize] - target_m[collar as usize];
            let swing = degrees(along, zero * out).min(degrees(along, zero * body));
            let twist = twist_degrees(along, up, zero * DVec3::Y);
            if !is_upright || swing > COLLAR_SWING || twist > TRUNK_TWIST {
                let (turn, spread) = evidence.mean_turn(own, chest);
                let aligned = if spread < STILL_COLLAR {
                    // It never moves: as it is, it rests.
                    Some(turn * chest_turn)
                } else {
                    turn_frame([out, DVec3::Y], [along, up])
                };
                self.source_from_target[collar as usize] = aligned.unwrap_or(turn * chest_turn);
                if is_upright {
                    notes.push(format!(
                        "{} is not drawn sideways: aligned by how it moves",
                        collar.name()
                    ));
                }
            }
        }
        // Limbs inherit the twist of the trunk's zero pose, not of a collar's.
        let inherited = self.source_from_target[shoulder as usize];
        self.follow_bone_from(inherited, source, target_m, shoulder, elbow);
        let upper = self.source_from_target[shoulder as usize];
        self.follow_bone_from(upper, source, target_m, elbow, wrist);
        let (Some(own), Some(middle)) = (at(shoulder), at(elbow)) else {
            return;
        };
        let end = at(wrist);
        let body = target_m[elbow as usize] - target_m[shoulder as usize];
        let body_lower = target_m[wrist as usize] - target_m[elbow as usize];
        // Elbows of a T-pose bend ahead: about down on the left, about up on the right.
        let axis = DQuat::from_rotation_arc(out, body.normalize_or(out))
            * if is_right { DVec3::Y } else { -DVec3::Y };
        let axis = DQuat::from_axis_angle(
            body.normalize_or(out),
            elbow_roll(source) * if is_right { 1.0 } else { -1.0 },
        ) * axis;
        let hinge = end.and_then(|end| evidence.hinge([own, middle, end]));
        let side = at(collar).map_or((chest, chest_turn), |own| {
            (own, self.source_from_target[collar as usize])
        });
        let mean = evidence.mean_turn(own, side.0).0 * side.1;
        let mut differs = false;
        if let (Some(start), Some(joint)) = (source.rest_of(shoulder), source.rest_of(elbow)) {
            let along = joint - start;
            let (says, sure) = match &hinge {
                Some(hinge) => (hinge.in_upper, true),
                None => (mean * axis, false),
            };
            let old = upper * axis;
            let limit = match (sure, is_upright) {
                (true, true) => UPPER_TWIST,
                (true, false) => 0.0,
                (false, true) => 75.0,
                (false, false) => 0.0,
            };
            differs = twist_degrees(along, says, old) > limit;
            if differs && let Some(turn) = turn_frame([body, axis], [along, says]) {
                self.source_from_target[shoulder as usize] = turn;
                notes.push(format!(
                    "the twist of {} comes from {}",
                    shoulder.name(),
                    if sure {
                        "how the elbow bends"
                    } else {
                        "its mean, for the elbow tells nothing"
                    }
                ));
            }
        }
        // Which way the forearm's own frame is rolled.
        let upper = self.source_from_target[shoulder as usize];
        let end_m = source.rest_of(wrist).or_else(|| source.end_of(elbow));
        if let (Some(start), Some(end)) = (source.rest_of(elbow), end_m) {
            self.follow_bone_from(upper, source, target_m, elbow, wrist);
            let old = self.source_from_target[elbow as usize] * axis;
            let says = hinge.as_ref().map_or_else(
                || evidence.mean_in(middle, |world| world[own].0 * (upper * axis)),
                |hinge| hinge.in_lower,
            );
            let limit = if hinge.is_some() { HINGE_TWIST } else { 60.0 };
            if twist_degrees(end - start, says, old) > limit {
                differs = true;
                if let Some(turn) = turn_frame([body_lower, axis], [end - start, says]) {
                    self.source_from_target[elbow as usize] = turn;
                }
            }
        }
        let forearm = self.source_from_target[elbow as usize];
        self.source_from_target[wrist as usize] = forearm;
        if let Some(own) = end {
            let along = source.rest_of(hand).or_else(|| source.end_of(wrist));
            let along = along.map_or(DVec3::ZERO, |end| {
                end - source.rest_of(wrist).unwrap_or_default()
            });
            let lower = source.rest_of(wrist).unwrap_or_default()
                - source.rest_of(elbow).unwrap_or_default();
            let says = evidence.mean_in(own, |world| world[middle].0 * (forearm * axis));
            if degrees(along, lower) > HAND_SWING
                || twist_degrees(lower, says, forearm * axis) > 75.0
                || differs
            {
                let mean = evidence.mean_turn(own, middle).0 * forearm;
                let turned = turn_frame([body_lower, axis], [along, says]);
                self.source_from_target[wrist as usize] = turned.unwrap_or(mean);
            }
        }
        self.source_from_target[hand as usize] = self.source_from_target[wrist as usize];
    }

    #[allow(clippy::too_many_arguments)]
    fn leg(
        &mut self,
        source: &Source<'_>,
        evidence: &Evidence,
        target_m: &[DVec3; JOINT_COUNT],
        is_right: bool,
        is_upright: bool,
        reference: SoleReference,
        notes: &mut Vec<String>,
    ) {
        let [hip, knee, ankle, foot] = [
            Joint::LeftHip,
            Joint::LeftKnee,
            Joint::LeftAnkle,
            Joint::LeftFoot,
        ]
        .map(|joint| on_side(joint, is_right));
        let trunk = self.source_from_target[Joint::Pelvis as usize];
        self.follow_bone_from(trunk, source, target_m, hip, knee);
        let upper = self.source_from_target[hip as usize];
        self.follow_bone_from(upper, source, target_m, knee, ankle);
        let at = |joint: Joint| source.mapping.source(joint);
        let (Some(own), Some(middle), Some(end), Some(pelvis)) =
            (at(hip), at(knee), at(ankle), at(Joint::Pelvis))
        else {
            return;
        };
        let [start_m, knee_m, ankle_m] =
            [hip, knee, ankle].map(|joint| source.rest_of(joint).unwrap_or_default());
        let [thigh, shin] = [[hip, knee], [knee, ankle]]
            .map(|[from, to]| target_m[to as usize] - target_m[from as usize]);
        let hinge = evidence.hinge([own, middle, end]);
        let toes = at(foot);
        // Left of a thigh: its knee's axis, else across the toes, else the pelvis's.
        let across_toes = |of: usize| {
            toes.map(|toes| {
                evidence.mean_in(of, |world| {
                    let down = bone(world, middle, end);
                    bone(world, end, toes).cross(down).normalize_or_zero()
                })
            })
            .filter(|left| left.length() > 0.5)
        };
        let of_pelvis =
            |of: usize| evidence.mean_in(of, |world| world[pelvis].0 * (trunk * DVec3::X));
        let (left_of_thigh, limit) = match &hinge {
            Some(hinge) => (hinge.in_upper, UPPER_TWIST),
            None => (across_toes(own).unwrap_or_else(|| of_pelvis(own)), 45.0),
        };
        let mut differs = !is_upright;
        if !is_upright || twist_degrees(knee_m - start_m, left_of_thigh, upper * DVec3::X) > limit {
            differs = true;
            if let Some(turn) = turn_frame([thigh, DVec3::X], [knee_m - start_m, left_of_thigh]) {
                self.source_from_target[hip as usize] = turn;
                notes.push(format!(
                    "the twist of {} comes from {}",
                    hip.name(),
                    if hinge.is_some() {
                        "how the knee bends"
                    } else {
                        "the toes or the pelvis, for the knee tells nothing"
                    }
                ));
            }
            let upper = self.source_from_target[hip as usize];
            self.follow_bone_from(upper, source, target_m, knee, ankle);
        }
        let lower = self.source_from_target[knee as usize];
        let upper = self.source_from_target[hip as usize];
        let left_of_shin = hinge.as_ref().map_or_else(
            || evidence.mean_in(middle, |world| world[own].0 * (upper * DVec3::X)),
            |hinge| hinge.in_lower,
        );
        if twist_degrees(ankle_m - knee_m, left_of_shin, lower * DVec3::X) > HINGE_TWIST {
            differs = true;
            if let Some(turn) = turn_frame([shin, DVec3::X], [ankle_m - knee_m, left_of_shin]) {
                self.source_from_target[knee as usize] = turn;
            }
        }

        let lower = self.source_from_target[knee as usize];
        let drawn = sole_alignment(source, target_m, [knee, ankle, foot], reference, trunk);
        let toes_m = source.rest_of(foot).or_else(|| source.end_of(ankle));
        let along = toes_m.map_or(DVec3::ZERO, |toes| toes - ankle_m);
        let has_toes = source.has_toes(ankle, foot);
        let left = evidence.mean_in(end, |world| world[middle].0 * (lower * DVec3::X));
        // Drawn toes are 50 to 115 degrees from the shin, and where the knee bends to.
        let to_shin = degrees(along, ankle_m - knee_m);
        // Ankles that turn the toes back, as broken captures have them, tell nothing of the drawing.
        let toes_ahead = toes.map_or(1.0, |toes| {
            evidence.votes(|world| {
                let up = -bone(world, middle, end);
                let ahead = (world[middle].0 * (lower * DVec3::X)).cross(up);
                bone(world, end, toes).dot(ahead)
            })
        });
        let turned = left.length() > AGREED && degrees(left, drawn * DVec3::X) > FOOT_TURN;
        if turned && toes_ahead < 0.3 {
            notes.push(format!(
                "{} turns the toes away from where the knee points: kept as drawn",
                ankle.name()
            ));
        }
        differs |= (has_toes && !(35.0..125.0).contains(&to_shin)) || (turned && toes_ahead >= 0.3);
        let mut sole = drawn;
        if differs {
            let body = target_m[foot as usize] - target_m[ankle as usize];
            let turned = has_toes
                .then(|| turn_frame([body, DVec3::X], [along, left]))
                .flatten();
            sole = turned.unwrap_or_else(|| evidence.mean_turn(end, middle).0 * lower);
            self.max_sole_pitch[usize::from(is_right)] = 0.7;
            notes.push(format!(
                "{} is not drawn as it stands: its sole is aligned by how it moves",
                ankle.name()
            ));
        }
        self.source_from_target[ankle as usize] = sole;
        self.source_from_target[foot as usize] = sole;
        if let (true, Some(toes)) = (differs, toes) {
            self.source_from_target[foot as usize] = evidence.mean_turn(toes, end).0 * sole;
        }
    }

    /// Turns the left and the right foot so that soles whose toes point up by these angles
    /// (radians) become flat. Larger angles than rest poses explain are how somebody stands.
    pub fn pitch_soles(&mut self, toes_up: [f64; 2]) {
        let feet = [
            [Joint::LeftAnkle, Joint::LeftFoot],
            [Joint::RightAnkle, Joint::RightFoot],
        ];
        let limits = self.max_sole_pitch;
        for ((joints, angle), limit) in feet.into_iter().zip(toes_up).zip(limits) {
            let down = DQuat::from_rotation_x(angle.clamp(-limit, limit));
            for joint in joints {
                self.source_from_target[joint as usize] *= down;
            }
        }
    }

    /// Starts from an alignment that carries the twist along the limb, and adds the smallest rotation
    /// that brings the bone from `joint` to `child` onto the source's.
    fn follow_bone_from(
        &mut self,
        inherited: DQuat,
        source: &Source<'_>,
        target_m: &[DVec3; JOINT_COUNT],
        joint: Joint,
        child: Joint,
    ) {
        let target_bone = inherited * (target_m[child as usize] - target_m[joint as usize]);
        let source_end = source.rest_of(child).or_else(|| source.end_of(joint));
        let source_bone = match (source.rest_of(joint), source_end) {
            (Some(start), Some(end)) => end - start,
            _ => DVec3::ZERO,
        };
        self.source_from_target[joint as usize] =
            match (target_bone.try_normalize(), source_bone.try_normalize()) {
                (Some(from), Some(to)) => DQuat::from_rotation_arc(from, to) * inherited,
                _ => inherited,
            };
    }
}

/// What the motion tells of a joint of the trunk.
struct TrunkJoint {
    /// The source's joint.
    joint: usize,
    /// Its alignment.
    turn: DQuat,
    /// Whether the bone up from it is fixed to it.
    is_drawn: bool,
}

/// Alignments of the pelvis and of the joints of the spine by the motion alone: up to the next joint,
/// left from hip to hip below and from shoulder to shoulder above.
fn measured_trunk(source: &Source<'_>, evidence: &Evidence) -> Option<Vec<TrunkJoint>> {
    let at = |joint: Joint| source.mapping.source(joint);
    let [left_hip, right_hip, left_arm, right_arm] = [
        at(Joint::LeftHip)?,
        at(Joint::RightHip)?,
        at(Joint::LeftShoulder)?,
        at(Joint::RightShoulder)?,
    ];
    let pelvis = at(Joint::Pelvis)?;
    let mut chain = vec![pelvis];
    chain.extend(
        source
            .mapping
            .spine
            .iter()
            .filter(|joint| **joint != pelvis),
    );
    let top = |world: &[(DQuat, DVec3)]| match at(Joint::Neck) {
        Some(neck) => world[neck].1,
        None => (world[left_arm].1 + world[right_arm].1) / 2.0,
    };
    let shortest = 0.02 * source.leg_length();
    let last = (chain.len() - 1).max(1) as f64;
    chain
        .iter()
        .enumerate()
        .map(|(place, &joint)| {
            let share = if chain.len() == 1 {
                0.0
            } else {
                place as f64 / last
            };
            let up = evidence.mean_in(joint, |world| {
                let from = world[joint].1;
                let above = chain[place + 1..].iter().map(|next| world[*next].1);
                above
                    .map(|next| next - from)
                    .find(|bone| bone.length() > shortest)
                    .unwrap_or_else(|| top(world) - from)
                    .normalize_or_zero()
            });
            let left = evidence.mean_in(joint, |world| {
                bone(world, right_hip, left_hip) * (1.0 - share)
                    + bone(world, right_arm, left_arm) * share
            });
            // Unit vectors that add up to less are not drawn but bent by joints between.
            let is_drawn = up.length() > 0.9995;
            let turn = if place == 0 {
                turn_frame([DVec3::X, DVec3::Y], [left, up])
            } else {
                turn_frame([DVec3::Y, DVec3::X], [up, left])
            };
            Some(TrunkJoint {
                joint,
                turn: turn?,
                is_drawn,
            })
        })
        .collect()
}

/// Whether the trunk of the zero pose is bent or twisted against what the motion tells.
fn trunk_differs(zero: DQuat, measured: &[TrunkJoint], target_m: &[DVec3; JOINT_COUNT]) -> bool {
    let low = target_m[Joint::Spine1 as usize] - target_m[Joint::Pelvis as usize];
    measured.iter().enumerate().any(|(place, measured)| {
        let up = measured.turn * DVec3::Y;
        let mut bend = degrees(up, zero * DVec3::Y);
        if place == 0 {
            // The body's own pelvis leans back by 32 degrees to its spine.
            bend = bend.min(degrees(up, zero * low));
        }
        let limit = if measured.is_drawn {
            TRUNK_BEND
        } else {
            MOVING_BEND
        };
        let left = measured.turn * DVec3::X;
        bend > limit || twist_degrees(zero * DVec3::Y, left, zero * DVec3::X) > TRUNK_TWIST
    })
}

/// The trunk: both rest poses stand upright, so only the facing can differ. Up is not taken from
/// bone directions, because the body's spine curves where the source's is straight.
fn trunk_alignment(
    source: &Source<'_>,
    target_m: &[DVec3; JOINT_COUNT],
) -> Result<DQuat, MotionError> {
    let source_at = |joint: Joint| source.rest_of(joint).unwrap_or_default();
    let source_frame = upright_frame("source", &source_at)?;
    let target_frame = upright_frame("target", &|joint| target_m[joint as usize])?;
    Ok(DQuat::from_mat3(&(source_frame * target_frame.transpose())).normalize())
}

/// Frame of a standing body: x to its left, y up, z ahead. Directions close to an axis of the world
/// are meant to be that axis: bodies are measured, skeletons are drawn along axes.
fn upright_frame(
    skeleton: &'static str,
    at: &dyn Fn(Joint) -> DVec3,
) -> Result<DMat3, MotionError> {
    let degenerate = |problem: &str| MotionError::Degenerate {
        skeleton,
        problem: format!("{problem}; the rest pose must be a standing person"),
    };
    let trunk = at(Joint::LeftShoulder) + at(Joint::RightShoulder)
        - at(Joint::LeftHip)
        - at(Joint::RightHip);
    let across = at(Joint::LeftHip) - at(Joint::RightHip);
    let up = trunk
        .try_normalize()
        .ok_or_else(|| degenerate("hips and shoulders coincide"))?;
    let up = near_axis(up);
    let left = across
        .reject_from_normalized(up)
        .try_normalize()
        .ok_or_else(|| degenerate("the hips coincide or lie above each other"))?;
    let left = near_axis(left)
        .reject_from_normalized(up)
        .normalize_or(left);
    Ok(DMat3::from_cols(left, up, left.cross(up)))
}

/// The world axis within 25 degrees of `direction`, else `direction`.
fn near_axis(direction: DVec3) -> DVec3 {
    let near = 25.0_f64.to_radians().cos();
    DVec3::AXES
        .into_iter()
        .flat_map(|axis| [axis, -axis])
        .find(|axis| axis.dot(direction) > near)
        .unwrap_or(direction)
}

/// Alignment of a foot that lays the body's flat sole onto the source's and turns its toes to where
/// the source's point.
fn sole_alignment(
    source: &Source<'_>,
    target_m: &[DVec3; JOINT_COUNT],
    [knee, ankle, foot]: [Joint; 3],
    reference: SoleReference,
    trunk: DQuat,
) -> DQuat {
    let source_at = |joint: Joint| source.rest_of(joint);
    let toes = source_at(foot).or_else(|| source.end_of(ankle));
    let (Some(source_knee), Some(source_ankle)) = (source_at(knee), source_at(ankle)) else {
        return DQuat::IDENTITY;
    };
    let up = match reference {
        SoleReference::Floor => DVec3::Y,
        SoleReference::Shin => (source_knee - source_ankle).normalize_or(DVec3::Y),
    };
    // Without toes, feet point where the trunk faces.
    let ahead = toes
        .filter(|_| source.has_toes(ankle, foot))
        .map_or(trunk * DVec3::Z, |toes| toes - source_ankle);
    let source_frame = sole_frame(up, ahead);
    let target_frame = sole_frame(DVec3::Y, target_m[foot as usize] - target_m[ankle as usize]);
    DQuat::from_mat3(&(source_frame * target_frame.transpose())).normalize()
}

/// y along `up`, z along `ahead` as far as that is possible.
fn sole_frame(up: DVec3, ahead: DVec3) -> DMat3 {
    let ahead = ahead
        .reject_from_normalized(up)
        .try_normalize()
        .unwrap_or_else(|| DVec3::Z.reject_from_normalized(up).normalize_or(DVec3::X));
    DMat3::from_cols(up.cross(ahead), up, ahead)
}
