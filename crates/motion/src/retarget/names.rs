//! Which source joint is which: names of common skeletons, read as a side and a part, and the tree,
//! which decides what a word means.
//!
//! A name tells little for sure: `shoulder` is the collar of Mixamo and the shoulder of SMPL, `hip`
//! is a pelvis or the top of a thigh, `leg` a shin or a whole leg. So every joint gets a weight for
//! each part that its name may mean. Of all chains from the trunk outwards, the one with the
//! largest sum is taken: a joint on the chain wins over one beside it.

use dynaskin_body::{JOINT_COUNT, Joint};
use glam::DVec3;

use super::reading::{Reading, readings};
use super::source::SourceMotion;
use super::vocabulary::{Part, Side};

/// The joints of a left limb from the trunk outwards.
const LEG: [Joint; 4] = [
    Joint::LeftHip,
    Joint::LeftKnee,
    Joint::LeftAnkle,
    Joint::LeftFoot,
];
const ARM: [Joint; 5] = [
    Joint::LeftCollar,
    Joint::LeftShoulder,
    Joint::LeftElbow,
    Joint::LeftWrist,
    Joint::LeftHand,
];

/// What a chain loses where two of its joints stand at the same place.
const NO_LENGTH: f64 = 0.5;
/// Weight of a joint that the caller named: more than any chain of names.
const NAMED_BY_CALLER: f64 = 100.0;
/// Joints of a limb that a chain looks back over; more than any rig puts between two joints.
const MAX_LOOK_BACK: usize = 64;

/// The source joint of each of the skeleton's joints; the spine is left open, but for joints that the
/// caller named.
pub fn named_joints(motion: &dyn SourceMotion) -> [Option<usize>; JOINT_COUNT] {
    let readings = readings(motion);
    let tree = Tree::new(motion);
    let mut found = Joint::ALL.map(|joint| motion.named_by_caller(joint));
    for side in [Side::Left, Side::Right] {
        let of_side = |joint: Joint| match side {
            Side::Right => joint.mirrored(),
            _ => joint,
        };
        for limb in [&LEG[..], &ARM[..]] {
            let limb: Vec<Joint> = limb.iter().copied().map(of_side).collect();
            let is_leg = limb.len() == LEG.len();
            let chain = limb_chain(&tree, &readings, side, is_leg, &limb, &found);
            for (joint, source) in limb.iter().zip(chain) {
                found[*joint as usize] = source;
            }
        }
    }
    let both = |joint: Joint| Some((found[joint as usize]?, found[joint.mirrored() as usize]?));
    let legs = both(Joint::LeftHip);
    let arms = both(Joint::LeftCollar).or(both(Joint::LeftShoulder));
    if found[Joint::Pelvis as usize].is_none() {
        let fork = legs.and_then(|(left, right)| tree.meeting(left, right));
        found[Joint::Pelvis as usize] = pelvis(&tree, &readings, fork, &found);
    }
    let fork = arms.and_then(|(left, right)| tree.meeting(left, right));
    neck_and_head(&tree, &readings, fork, &mut found);
    found
}

/// Parents and places of the joints.
struct Tree {
    parents: Vec<Option<usize>>,
    rest: Vec<DVec3>,
    /// Distance below which two joints stand at the same place.
    no_length: f64,
}

impl Tree {
    fn new(motion: &dyn SourceMotion) -> Self {
        let rest = motion.rest_positions();
        let extent = rest
            .iter()
            .map(|place| place.distance(rest[0]))
            .fold(0.0, f64::max);
        Self {
            parents: (0..motion.joint_count())
                .map(|joint| motion.parent(joint))
                .collect(),
            rest,
            no_length: 1e-3 * extent,
        }
    }

    /// A joint and those above it, up to its root.
    fn upwards(&self, joint: usize) -> impl Iterator<Item = usize> + '_ {
        std::iter::successors(Some(joint), |joint| self.parents[*joint])
    }

    /// The lowest joint above both.
    fn meeting(&self, a: usize, b: usize) -> Option<usize> {
        let above: Vec<usize> = self.upwards(a).skip(1).collect();
        self.upwards(b)
            .skip(1)
            .find(|joint| above.binary_search_by(|x| joint.cmp(x)).is_ok())
    }

    fn is_above(&self, above: usize, joint: usize) -> bool {
        self.upwards(joint).skip(1).any(|joint| joint == above)
    }
}

/// The chain of a limb with the largest sum of weights: for each of its parts a joint, or none.
fn limb_chain(
    tree: &Tree,
    readings: &[Reading],
    side: Side,
    is_leg: bool,
    limb: &[Joint],
    found: &[Option<usize>; JOINT_COUNT],
) -> Vec<Option<usize>> {
    let count = tree.parents.len();
    let weight = |source: usize, place: usize| -> f64 {
        match found[limb[place] as usize] {
            Some(named) if named == source => return NAMED_BY_CALLER,
            Some(_) => return 0.0,
            None if found.contains(&Some(source)) => return 0.0,
            None => {}
        }
        let part = if is_leg {
            Part::Leg(place)
        } else {
            Part::Arm(place)
        };
        let reading = &readings[source];
        if reading.side != side {
            return 0.0;
        }
        reading
            .parts
            .iter()
            .find(|(known, _)| *known == part)
            .map_or(0.0, |(_, weight)| *weight)
    };
    // Best sum of a chain that ends at a joint as a part, and what is before it.
    type End = (f64, Option<(usize, usize)>);
    let mut ends: Vec<Option<Vec<Option<End>>>> = vec![None; count];
    // The nearest joint above that may be a part.
    let mut above: Vec<Option<usize>> = vec![None; count];
    let mut best: Option<(f64, usize, usize)> = None;
    for source in 0..count {
        above[source] = tree.parents[source].and_then(|parent| {
            if ends[parent].is_some() {
                Some(parent)
            } else {
                above[parent]
            }
        });
        let weights: Vec<f64> = (0..limb.len()).map(|place| weight(source, place)).collect();
        if weights.iter().all(|weight| *weight <= 0.0) {
            continue;
        }
        let mut own: Vec<Option<End>> = vec![None; limb.len()];
        for (place, weight) in weights.into_iter().enumerate().filter(|(_, w)| *w > 0.0) {
            let mut end: End = (weight, None);
            let before = std::iter::successors(above[source], |joint| above[*joint]);
            for joint in before.take(MAX_LOOK_BACK) {
                let apart = tree.rest[joint].distance(tree.rest[source]) > tree.no_length;
                let loss = if apart { 0.0 } else { NO_LENGTH };
                let ends_before = ends[joint].as_deref().unwrap_or_default();
                for (part, end_before) in ends_before.iter().enumerate().take(place) {
                    let Some((sum, _)) = end_before else { continue };
                    // Among equals the joint nearer to the trunk: a limb of two bones begins there.
                    let sum = sum + weight - loss;
                    if sum > end.0 - 1e-9 {
                        end = (sum, Some((joint, part)));
                    }
                }
            }
            if best.is_none_or(|(most, ..)| end.0 > most + 1e-9) {
                best = Some((end.0, source, place));
            }
            own[place] = Some(end);
        }
        ends[source] = Some(own);
    }
    let mut chain = vec![None; limb.len()];
    let mut at = best.map(|(_, source, place)| (source, place));
    while let Some((source, place)) = at {
        chain[place] = Some(source);
        at = ends[source]
            .as_ref()
            .and_then(|own| own[place])
            .and_then(|(_, before)| before);
    }
    // What the caller named holds, wherever it stands in the tree.
    for (place, joint) in limb.iter().enumerate() {
        if let Some(named) = found[*joint as usize] {
            chain[place] = Some(named);
        }
    }
    chain
}

/// How surely the name of a joint of the middle means a part.
fn middle_weight(reading: &Reading, part: Part) -> f64 {
    let weight = reading.parts.iter().find(|(known, _)| *known == part);
    match (reading.side, weight) {
        (Side::Middle, Some((_, weight))) => *weight,
        _ => 0.0,
    }
}

/// The joint from which both legs hang, or one above it whose name says pelvis where its own does
/// not: Biped's legs hang from the spine.
fn pelvis(
    tree: &Tree,
    readings: &[Reading],
    fork: Option<usize>,
    found: &[Option<usize>; JOINT_COUNT],
) -> Option<usize> {
    let weight = |joint: usize| {
        if found.contains(&Some(joint)) {
            return 0.0;
        }
        middle_weight(&readings[joint], Part::Pelvis)
    };
    let Some(fork) = fork else {
        // Legs that are trees of their own, as control rigs have.
        let by_name = (0..readings.len()).filter(|joint| weight(*joint) > 0.0);
        return by_name.fold(None, |best: Option<usize>, joint| match best {
            Some(best) if weight(best) >= weight(joint) => Some(best),
            _ => Some(joint),
        });
    };
    tree.upwards(fork)
        .find(|joint| weight(*joint) > 0.5)
        .or(Some(fork))
}

/// Neck and head: by name above the joint that carries both arms, else the joints that lead on from
/// there.
fn neck_and_head(
    tree: &Tree,
    readings: &[Reading],
    fork: Option<usize>,
    found: &mut [Option<usize>; JOINT_COUNT],
) {
    let is_free = |joint: &usize| !found.contains(&Some(*joint));
    let on_trunk = |joint: &usize| fork.is_none_or(|fork| tree.is_above(fork, *joint));
    let best = |part: Part, among: &dyn Fn(&usize) -> bool| {
        let mut best: Option<(f64, usize)> = None;
        for joint in (0..readings.len()).filter(|joint| is_free(joint) && among(joint)) {
            let weight = middle_weight(&readings[joint], part);
            if weight > 0.0 && best.is_none_or(|(most, _)| weight > most) {
                best = Some((weight, joint));
            }
        }
        best.map(|(_, joint)| joint)
    };
    let named = |part| best(part, &on_trunk).or_else(|| best(part, &|_| true));
    let mut head = found[Joint::Head as usize].or_else(|| named(Part::Head));
    let mut neck = found[Joint::Neck as usize].or_else(|| {
        let below_head = |joint: &usize| head.is_some_and(|head| tree.is_above(*joint, head));
        best(Part::Neck, &below_head).or_else(|| named(Part::Neck))
    });
    if let (None, None, Some(fork)) = (neck, head, fork) {
        // Rigify's spine goes on to the head by number.
        let chain = longest_middle_chain(tree, readings, fork);
        if let [first, .., last] = chain[..] {
            (neck, head) = (Some(first), Some(last));
        }
    }
    if let (None, Some(fork), Some(head)) = (neck, fork, head)
        && tree.is_above(fork, head)
    {
        let between = tree
            .upwards(head)
            .skip(1)
            .take_while(|joint| *joint != fork);
        neck = between.filter(is_free).last();
    }
    found[Joint::Neck as usize] = neck;
    found[Joint::Head as usize] = head;
}

/// The longest way from a joint outwards over joints of the middle.
fn longest_middle_chain(tree: &Tree, readings: &[Reading], from: usize) -> Vec<usize> {
    let mut lengths: Vec<Option<f64>> = vec![None; tree.parents.len()];
    lengths[from] = Some(0.0);
    let mut last = from;
    for joint in from + 1..tree.parents.len() {
        let Some(parent) = tree.parents[joint] else {
            continue;
        };
        if let (Side::Middle, Some(length)) = (readings[joint].side, lengths[parent]) {
            let length = length + tree.rest[parent].distance(tree.rest[joint]);
            lengths[joint] = Some(length);
            if lengths[last].is_none_or(|most| length > most) {
                last = joint;
            }
        }
    }
    let mut chain: Vec<usize> = tree
        .upwards(last)
        .take_while(|joint| *joint != from)
        .collect();
    chain.reverse();
    chain
}
