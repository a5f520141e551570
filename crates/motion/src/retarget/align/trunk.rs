//! Pelvis, spine, neck and head.

use dynaskin_body::{JOINT_COUNT, Joint};
use glam::{DMat3, DQuat, DVec3};

use super::frames::{degrees, turn_degrees, turn_frame};
use super::{Alignment, Builder};
use crate::MotionError;
use crate::retarget::evidence::{World, bone};

/// A joint of the trunk whose zero pose is within these degrees of its mean in the motion is drawn
/// as it stands. People who dance or crawl stand bent for long: where the zero pose is drawn straight,
/// it may differ by more.
const TRUNK_TURN: f64 = 15.0;
const STRAIGHT_TRUNK_TURN: f64 = 32.0;
/// The same for neck and head: people look down for long.
const HEAD_TURN: f64 = 20.0;
const STRAIGHT_HEAD_TURN: f64 = 60.0;
/// The same where the file does not tell where the head ends.
const ENDLESS_HEAD_TURN: f64 = 45.0;
/// Most degrees between the axis of a trunk that is drawn straight and the line from hips to
/// shoulders, the bones of its spine (spines curve), and, seen from the side, its legs.
const STRAIGHT_LINE: f64 = 13.0;
const STRAIGHT_SPINE: f64 = 18.0;
const STRAIGHT_LEGS: f64 = 12.0;
/// The same for the bones of neck and head.
const STRAIGHT_NECK: f64 = 25.0;
/// A trunk that leans more than this from its bones on average never stands straight.
const DRAWN_LEAN: f64 = 28.0;

/// A joint of the trunk and its alignment by the motion alone.
struct Measured {
    joint: usize,
    turn: DQuat,
}

impl Builder<'_> {
    /// The alignment of the trunk, which all other joints start from.
    pub(super) fn trunk(&mut self) -> Result<Alignment, MotionError> {
        let zero = self.zero_trunk();
        let measured = self.measured_trunk();
        let joint_count = self.source.motion.joint_count();
        let everywhere = |turn| Alignment {
            source_from_target: [turn; JOINT_COUNT],
            of_source: vec![turn; joint_count],
            toes_down: [None; 2],
        };
        let Some(measured) = measured else {
            return zero.map(everywhere);
        };
        if let Ok(zero) = zero {
            let limit = if self.is_drawn_straight(zero) {
                STRAIGHT_TRUNK_TURN
            } else {
                TRUNK_TURN
            };
            if measured
                .iter()
                .all(|measured| turn_degrees(measured.turn, zero) < limit)
            {
                return Ok(everywhere(zero));
            }
        }
        self.is_upright = false;
        self.note(
            "the zero pose does not stand upright as the body does: the trunk is aligned by how it \
             moves"
                .to_owned(),
        );
        let pelvis = measured.first().map_or(DQuat::IDENTITY, |own| own.turn);
        let mut alignment = everywhere(pelvis);
        for measured in &measured {
            alignment.of_source[measured.joint] = measured.turn;
        }
        let (_, chest) = alignment.chest(self.source);
        for joint in Joint::ALL {
            let turn = match self.at(joint) {
                Some(source) if measured.iter().any(|own| own.joint == source) => {
                    alignment.of_source[source]
                }
                _ if is_above(joint) => chest,
                _ => pelvis,
            };
            alignment.set(joint, turn);
        }
        Ok(alignment)
    }

    /// Neck and head: up from the chest, and not turned against it on average.
    pub(super) fn head(&mut self, alignment: &mut Alignment) {
        let (chest, chest_turn) = alignment.chest(self.source);
        for joint in [Joint::Neck, Joint::Head] {
            let Some(own) = self.at(joint).filter(|own| *own != chest) else {
                continue;
            };
            let (turn, _) = self.evidence.mean_turn(own, chest);
            let measured = turn * chest_turn;
            let up = alignment.of(joint) * DVec3::Y;
            let drawn = match joint {
                Joint::Neck => self.zero_bone(Joint::Neck, Joint::Head),
                _ => self
                    .source
                    .end_of(joint)
                    .zip(self.source.rest_of(joint))
                    .map(|(end, start)| end - start),
            };
            let drawn = drawn.filter(|bone| bone.length() > self.shortest());
            let limit = match drawn {
                Some(bone) if self.is_upright && degrees(bone, up) < STRAIGHT_NECK => {
                    STRAIGHT_HEAD_TURN
                }
                None if self.is_upright => ENDLESS_HEAD_TURN,
                _ => HEAD_TURN,
            };
            if turn_degrees(measured, alignment.of(joint)) < limit {
                continue;
            }
            if self.is_upright {
                self.note(format!(
                    "{} is not drawn upright: aligned by how it moves",
                    joint.name()
                ));
            }
            alignment.set(joint, measured);
        }
    }

    /// Whether the zero pose stands with a straight trunk on straight legs.
    fn is_drawn_straight(&self, zero: DQuat) -> bool {
        let at = |joint: Joint| self.source.rest_of(joint).unwrap_or_default();
        let middle = |left: Joint| (at(left) + at(left.mirrored())) / 2.0;
        let [hips, shoulders, ankles] =
            [Joint::LeftHip, Joint::LeftShoulder, Joint::LeftAnkle].map(middle);
        let [left, up, ahead] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| zero * axis);
        let across = |left: Joint| at(left) - at(left.mirrored());
        let spine = self
            .source
            .mapping
            .spine
            .iter()
            .map(|joint| self.source.rest[*joint]);
        let chain: Vec<DVec3> = std::iter::once(at(Joint::Pelvis))
            .chain(spine)
            .chain(self.source.rest_of(Joint::Neck))
            .collect();
        // Straight up, or as the body's own spine curves.
        let own = [
            Joint::Pelvis,
            Joint::Spine1,
            Joint::Spine2,
            Joint::Spine3,
            Joint::Neck,
        ];
        let own = own
            .windows(2)
            .map(|ends| zero * self.target_bone(ends[0], ends[1]));
        let curves: Vec<DVec3> = std::iter::once(up).chain(own).collect();
        let legs = hips - ankles;
        legs.angle_between(legs - legs.dot(ahead) * ahead)
            .to_degrees()
            < STRAIGHT_LEGS
            && legs.dot(up) > 0.0
            && degrees(shoulders - hips, up) < STRAIGHT_LINE
            && degrees(across(Joint::LeftHip), left) < STRAIGHT_LINE
            && degrees(across(Joint::LeftShoulder), left) < STRAIGHT_LINE
            && chain
                .windows(2)
                .map(|ends| ends[1] - ends[0])
                .filter(|bone| bone.length() > self.shortest())
                .all(|bone| {
                    curves
                        .iter()
                        .any(|curve| degrees(bone, *curve) < STRAIGHT_SPINE)
                })
    }

    /// Shorter bones have no direction, in the file's unit.
    pub(super) fn shortest(&self) -> f64 {
        0.02 * self.source.leg_length()
    }

    /// Alignments of the pelvis and of the joints of the spine by the motion alone: in the frames in
    /// which the trunk is straightest they stand one above the other.
    fn measured_trunk(&self) -> Option<Vec<Measured>> {
        let [left_hip, right_hip, left_arm, right_arm] = [
            self.at(Joint::LeftHip)?,
            self.at(Joint::RightHip)?,
            self.at(Joint::LeftShoulder)?,
            self.at(Joint::RightShoulder)?,
        ];
        let pelvis = self.at(Joint::Pelvis)?;
        let spine = self.source.mapping.spine.iter().copied();
        let chain: Vec<usize> = std::iter::once(pelvis)
            .chain(spine.filter(|joint| *joint != pelvis))
            .collect();
        let neck = self.at(Joint::Neck);
        let hips = |world: &World| (world[left_hip].1 + world[right_hip].1) / 2.0;
        let top = |world: &World| match neck {
            Some(neck) => world[neck].1,
            None => (world[left_arm].1 + world[right_arm].1) / 2.0,
        };
        let straight = self
            .evidence
            .longest(|world| top(world).distance(hips(world)));
        let last = chain.len().saturating_sub(1).max(1) as f64;
        let shortest = self.shortest();
        chain
            .iter()
            .enumerate()
            .map(|(place, &joint)| {
                let share = if chain.len() > 1 {
                    place as f64 / last
                } else {
                    0.5
                };
                let across = |world: &World| {
                    bone(world, right_hip, left_hip) * (1.0 - share)
                        + bone(world, right_arm, left_arm) * share
                };
                let left = straight.mean_in(joint, across);
                let up = straight.mean_in(joint, |world| {
                    let shoulders = (world[left_arm].1 + world[right_arm].1) / 2.0;
                    (shoulders - hips(world)).normalize_or_zero()
                });
                let drawn = straight.mean_in(joint, |world| {
                    let from = world[joint].1;
                    let above = chain[place + 1..].iter().map(|next| world[*next].1 - from);
                    above
                        .chain(std::iter::once(top(world) - from))
                        .find(|bone| bone.length() > shortest)
                        .unwrap_or_default()
                        .normalize_or_zero()
                });
                let low = self.target_bone(Joint::Pelvis, Joint::Spine1);
                let up = if degrees(up, drawn) < DRAWN_LEAN || place == 0 && low.length() > 0.0 {
                    up
                } else {
                    drawn
                };
                let turn = if place == 0 {
                    // Hips are fixed to the pelvis.
                    turn_frame([DVec3::X, DVec3::Y], [left, up])
                } else {
                    turn_frame([DVec3::Y, DVec3::X], [up, left])
                };
                Some(Measured { joint, turn: turn? })
            })
            .collect()
    }

    /// The trunk of the zero pose: only the facing can differ. Up is not taken from bone directions,
    /// because the body's spine curves where the source's is straight.
    fn zero_trunk(&self) -> Result<DQuat, MotionError> {
        let source_at = |joint: Joint| self.source.rest_of(joint).unwrap_or_default();
        let source_frame = upright_frame("source", &source_at)?;
        let target_frame = upright_frame("target", &|joint| self.target_m[joint as usize])?;
        Ok(DQuat::from_mat3(&(source_frame * target_frame.transpose())).normalize())
    }
}

/// Whether a joint hangs on the chest.
fn is_above(joint: Joint) -> bool {
    std::iter::successors(Some(joint), |joint| joint.parent()).any(|joint| joint == Joint::Spine3)
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
