//! Finds a person in a skeleton with meaningless names, by hierarchy and positions: the lowest leaves are the
//! feet, the joint above both the hips, the sideways extremes the hands.

use std::collections::BTreeMap;

use dynaskin_motion::SourceMotion as _;
use dynaskin_skeleton::Joint;
use glam::DVec3;

use crate::avatar::Avatar;
use crate::bones::Skeleton;

/// Bones of a limb, over the height of the person: shorter ones are no upper arm and no thigh.
const LEAST_BONE: f64 = 0.07;
/// A leg, over the height.
const LEAST_LEG: f64 = 0.3;

/// The nodes of joints, by their number; none where the skeleton has not the shape of a person.
pub fn joints(avatar: &Avatar, skeleton: &Skeleton<'_>) -> Option<BTreeMap<usize, usize>> {
    let tree = Tree::new(avatar, skeleton)?;
    let (feet, hips) = tree.feet()?;
    let across = (tree.at(feet[0]) - tree.at(feet[1]))
        .reject_from(DVec3::Y)
        .try_normalize()?;
    let (hands, chest) = tree.hands(across, hips, feet)?;
    let mut found = BTreeMap::new();
    found.insert(Joint::Pelvis as usize, hips);
    let legs = [
        tree.leg(&tree.chain(hips, feet[0]))?,
        tree.leg(&tree.chain(hips, feet[1]))?,
    ];
    let arms = [
        tree.arm(&tree.chain(chest, hands[0]))?,
        tree.arm(&tree.chain(chest, hands[1]))?,
    ];
    // Toes, or the skin of the feet, tell ahead; ahead tells left.
    let ahead: DVec3 = legs.iter().map(|leg| tree.ahead(avatar, leg)).sum();
    let is_left_first = DVec3::Y.cross(ahead).dot(across) > 0.0;
    for (side, (leg, arm)) in legs.iter().zip(&arms).enumerate() {
        let own = |joint: Joint| match (side == 0) == is_left_first {
            true => joint as usize,
            false => joint.mirrored() as usize,
        };
        let leg_joints = [
            Joint::LeftHip,
            Joint::LeftKnee,
            Joint::LeftAnkle,
            Joint::LeftFoot,
        ];
        for (joint, node) in leg_joints.into_iter().zip(leg) {
            found.insert(own(joint), *node);
        }
        let arm_joints = [Joint::LeftShoulder, Joint::LeftElbow, Joint::LeftWrist];
        for (joint, node) in arm_joints.into_iter().zip(&arm.bones) {
            found.insert(own(joint), *node);
        }
        if let Some(collar) = arm.collar {
            found.insert(own(Joint::LeftCollar), collar);
        }
    }
    let (neck, head) = tree.neck_and_head(chest, hands)?;
    found.insert(Joint::Head as usize, head);
    if let Some(neck) = neck {
        found.insert(Joint::Neck as usize, neck);
    }
    Some(found)
}

struct Arm {
    collar: Option<usize>,
    /// Shoulder, elbow, wrist.
    bones: [usize; 3],
}

/// Joints of skins and what stands between them.
struct Tree {
    parents: Vec<Option<usize>>,
    places: Vec<DVec3>,
    is_joint: Vec<bool>,
    leaves: Vec<usize>,
    height: f64,
}

impl Tree {
    fn new(avatar: &Avatar, skeleton: &Skeleton<'_>) -> Option<Self> {
        let count = avatar.nodes.len();
        let mut is_joint = vec![false; count];
        // Who has a VRM's humanoid is named by it alone.
        for node in avatar.meshes.iter().flat_map(|mesh| &mesh.joints) {
            is_joint[*node] = true;
        }
        let parents: Vec<Option<usize>> = avatar.nodes.iter().map(|node| node.parent).collect();
        let mut has_child = vec![false; count];
        for node in (0..count).filter(|node| is_joint[*node]) {
            if let Some(parent) = parents[node] {
                has_child[parent] = true;
            }
        }
        let mut places = vec![DVec3::ZERO; count];
        for (place, at) in skeleton.rest_positions().into_iter().enumerate() {
            places[skeleton.node(place)] = at;
        }
        let leaves: Vec<usize> = (0..count)
            .filter(|n| is_joint[*n] && !has_child[*n])
            .collect();
        let heights = leaves.iter().map(|leaf| places[*leaf].y);
        let (low, high) = heights.fold((f64::MAX, f64::MIN), |(low, high), y| {
            (low.min(y), high.max(y))
        });
        let tree = Self {
            parents,
            places,
            is_joint,
            leaves,
            height: high - low,
        };
        (tree.height > 0.0 && tree.height.is_finite()).then_some(tree)
    }

    fn at(&self, node: usize) -> DVec3 {
        self.places[node]
    }

    fn upwards(&self, node: usize) -> impl Iterator<Item = usize> + '_ {
        std::iter::successors(Some(node), |node| self.parents[*node])
    }

    fn meeting(&self, a: usize, b: usize) -> Option<usize> {
        let above: Vec<usize> = self.upwards(a).collect();
        self.upwards(b).find(|node| above.contains(node))
    }

    /// Joints from below `from` to `to`.
    fn chain(&self, from: usize, to: usize) -> Vec<usize> {
        let mut chain: Vec<usize> = self.upwards(to).take_while(|node| *node != from).collect();
        chain.reverse();
        chain.retain(|node| self.is_joint[*node]);
        chain
    }

    /// The lowest leaves of two limbs, and the joint above both.
    fn feet(&self) -> Option<([usize; 2], usize)> {
        let mut lowest = self.leaves.clone();
        lowest.sort_by(|a, b| self.at(*a).y.total_cmp(&self.at(*b).y));
        let first = *lowest.first()?;
        lowest.iter().skip(1).find_map(|other| {
            let hips = self.meeting(first, *other)?;
            let leg = self.at(hips).y - self.at(first).y.max(self.at(*other).y);
            (leg > LEAST_LEG * self.height).then_some(([first, *other], hips))
        })
    }

    /// The leaves farthest to both sides that do not hang on a leg, and the joint above both; in the
    /// order of the feet.
    fn hands(&self, across: DVec3, hips: usize, feet: [usize; 2]) -> Option<([usize; 2], usize)> {
        let legs: Vec<usize> = feet
            .iter()
            .filter_map(|foot| self.chain(hips, *foot).first().copied())
            .collect();
        let on_leg = |leaf: usize| self.upwards(leaf).any(|node| legs.contains(&node));
        let side = |leaf: &usize| (self.at(*leaf) - self.at(hips)).dot(across);
        let upper = || self.leaves.iter().copied().filter(|leaf| !on_leg(*leaf));
        let first = upper().max_by(|a, b| side(a).total_cmp(&side(b)))?;
        let second = upper().min_by(|a, b| side(a).total_cmp(&side(b)))?;
        let chest = self.meeting(first, second)?;
        let is_apart = side(&first) > 0.0 && side(&second) < 0.0;
        let is_above = self.at(chest).y > self.at(hips).y && self.upwards(chest).any(|n| n == hips);
        (is_apart && (is_above || chest == hips)).then_some(([first, second], chest))
    }

    /// Hip, knee, ankle and, where there is one, the joint of the toes.
    fn leg(&self, chain: &[usize]) -> Option<Vec<usize>> {
        let [hip, knee, ankle] = self.bones(chain, LEAST_LEG)?;
        let toes = chain.iter().skip_while(|node| **node != ankle).nth(1);
        Some(
            [hip, knee, ankle]
                .into_iter()
                .chain(toes.copied())
                .collect(),
        )
    }

    fn arm(&self, chain: &[usize]) -> Option<Arm> {
        // Fingers: the hand is where the chain forks last.
        let forks = |node: usize| {
            let below = |leaf: &&usize| self.upwards(**leaf).any(|above| above == node);
            self.leaves.iter().filter(below).count() > 1
        };
        let end = chain
            .iter()
            .rposition(|node| forks(*node))
            .filter(|at| *at >= 2);
        let bones = self.bones(
            &chain[..end.map_or(chain.len(), |at| at + 1)],
            2.0 * LEAST_BONE,
        )?;
        let before = chain.iter().position(|node| *node == bones[0])?;
        let collar = before.checked_sub(1).map(|at| chain[at]);
        Some(Arm { collar, bones })
    }

    /// The three joints of a chain between which two bones of like length lie, as long as can be.
    fn bones(&self, chain: &[usize], least: f64) -> Option<[usize; 3]> {
        let mut best: Option<(f64, [usize; 3])> = None;
        for (a, start) in chain.iter().enumerate() {
            for (b, middle) in chain.iter().enumerate().skip(a + 1) {
                for end in &chain[b + 1..] {
                    let upper = self.at(*start).distance(self.at(*middle));
                    let lower = self.at(*middle).distance(self.at(*end));
                    if upper.min(lower) < LEAST_BONE * self.height
                        || upper + lower < least * self.height
                    {
                        continue;
                    }
                    let unlike = (upper / lower).ln().abs();
                    let worth = (upper + lower) / self.height - 0.5 * unlike;
                    if best.is_none_or(|(most, _)| worth > most + 1e-9) {
                        best = Some((worth, [*start, *middle, *end]));
                    }
                }
            }
        }
        best.map(|(_, bones)| bones)
    }

    /// Where a leg's foot points: to its toes, or to the middle of its skin.
    fn ahead(&self, avatar: &Avatar, leg: &[usize]) -> DVec3 {
        let Some(ankle) = leg.get(2) else {
            return DVec3::ZERO;
        };
        if let Some(toes) = leg.get(3) {
            return (self.at(*toes) - self.at(*ankle))
                .reject_from(DVec3::Y)
                .normalize_or_zero();
        }
        let mut sum = DVec3::ZERO;
        for mesh in &avatar.meshes {
            let Some(slot) = mesh.joints.iter().position(|node| node == ankle) else {
                continue;
            };
            let world = avatar.nodes[*ankle].world_from_node * mesh.inverse_binds[slot];
            for (position, influences) in mesh.positions.iter().zip(&mesh.influences) {
                let mut own = influences.joints.iter().zip(influences.weights);
                if own.any(|(joint, weight)| usize::from(*joint) == slot && weight > 0.5) {
                    sum += world.transform_point3(position.as_dvec3()) - self.at(*ankle);
                }
            }
        }
        sum.reject_from(DVec3::Y).normalize_or_zero()
    }

    /// The joints that lead up from the chest beside the arms: the first of them, if there are two,
    /// and the head.
    fn neck_and_head(&self, chest: usize, hands: [usize; 2]) -> Option<(Option<usize>, usize)> {
        let arms: Vec<usize> = hands
            .iter()
            .filter_map(|hand| self.chain(chest, *hand).first().copied())
            .collect();
        let is_upper = |leaf: &usize| {
            let mut above = self.upwards(*leaf);
            above.any(|node| node == chest) && !self.upwards(*leaf).any(|node| arms.contains(&node))
        };
        let leaves = self.leaves.iter().copied().filter(is_upper);
        let top = leaves.max_by(|a, b| self.at(*a).y.total_cmp(&self.at(*b).y))?;
        match self.chain(chest, top)[..] {
            [] => None,
            [head] => Some((None, head)),
            [neck, head, ..] => Some((Some(neck), head)),
        }
    }
}
