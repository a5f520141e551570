//! Which source joint is which: names of common skeletons, read as a side and a part.

use dynaskin_body::{JOINT_COUNT, Joint};

use super::source::SourceMotion;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Left,
    Right,
    Middle,
}

/// Name prefixes of rigs, lower case without punctuation.
const PREFIXES: [&str; 12] = [
    "mixamorig",
    "valvebiped",
    "bip001",
    "bip01",
    "bip",
    "jbipc",
    "jbip",
    "favg",
    "mavg",
    "def",
    "org",
    "b",
];

/// Splits a name such as `mixamorig:LeftUpLeg`, `thigh.L`, `L_Hip`, `rShin` or `Bip01 L Calf` into
/// side and part; the part is lower case without punctuation.
fn side_and_part(name: &str) -> Vec<(Side, String)> {
    let name = name.rsplit([':', '|']).next().unwrap_or(name);
    let words = words(name);
    let mut readings = Vec::new();
    for skip in 0..words.len() {
        let prefix = words[..skip].concat();
        let digits_off = prefix.trim_end_matches(|c: char| c.is_ascii_digit());
        if skip > 0 && !PREFIXES.contains(&prefix.as_str()) && !PREFIXES.contains(&digits_off) {
            continue;
        }
        let words = &words[skip..];
        let side = words.iter().position(|word| side_of(word) != Side::Middle);
        let rest: String = words
            .iter()
            .enumerate()
            .filter(|(idx, _)| Some(*idx) != side)
            .map(|(_, word)| word.as_str())
            .collect();
        let side = side.map_or(Side::Middle, |idx| side_of(&words[idx]));
        readings.push((side, rest));
    }
    readings
}

fn side_of(word: &str) -> Side {
    match word {
        "left" | "l" => Side::Left,
        "right" | "r" => Side::Right,
        _ => Side::Middle,
    }
}

/// Lower-case words of a name, split at punctuation, at a capital after a small letter, and after
/// a leading `left` or `right`.
fn words(name: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let mut current = String::new();
    let mut was_lower = false;
    for c in name.chars() {
        if !c.is_alphanumeric() || (c.is_uppercase() && was_lower) {
            words.extend(split_side(&std::mem::take(&mut current)));
        }
        if c.is_alphanumeric() {
            current.extend(c.to_lowercase());
        }
        was_lower = c.is_lowercase() || c.is_ascii_digit();
    }
    words.extend(split_side(&current));
    words
}

fn split_side(word: &str) -> Vec<String> {
    for side in ["left", "right"] {
        if let Some(rest) = word.strip_prefix(side) {
            let parts = [side, rest];
            return parts
                .into_iter()
                .filter(|part| !part.is_empty())
                .map(str::to_owned)
                .collect();
        }
    }
    // `LHipJoint`: the capital H follows a capital.
    if let Some(rest) = word.strip_prefix(['l', 'r'])
        && rest.starts_with("hipjoint")
    {
        return vec![word[..1].to_owned(), rest.to_owned()];
    }
    if word.is_empty() {
        Vec::new()
    } else {
        vec![word.to_owned()]
    }
}

/// Parts of one side from the trunk outwards, best name first. A name that stands in two lists
/// (`shoulder` is the collar of Mixamo and the shoulder of SMPL) is resolved by the order below:
/// a joint taken by an earlier list is not taken again.
const LIMBS: [(Joint, &[&str]); 10] = [
    (
        Joint::LeftKnee,
        &[
            "knee", "shin", "calf", "lowerleg", "lowleg", "loleg", "leglower", "crus", "leg",
        ],
    ),
    (
        Joint::LeftHip,
        &[
            "upleg",
            "upperleg",
            "thigh",
            "thighbend",
            "legupper",
            "femur",
            "hip",
            "buttock",
        ],
    ),
    (Joint::LeftAnkle, &["ankle", "foot"]),
    (
        Joint::LeftFoot,
        &[
            "toebase",
            "toes",
            "toe",
            "toe0",
            "ball",
            "foot",
            "metatarsals",
        ],
    ),
    (
        Joint::LeftElbow,
        &[
            "elbow",
            "forearm",
            "forearmbend",
            "lowerarm",
            "lowarm",
            "loarm",
            "armlower",
        ],
    ),
    (
        Joint::LeftShoulder,
        &[
            "arm",
            "upperarm",
            "uparm",
            "shldr",
            "shldrbend",
            "armupper",
            "humerus",
            "shoulder",
        ],
    ),
    (
        Joint::LeftCollar,
        &["collar", "clavicle", "collarbone", "shoulder"],
    ),
    (Joint::LeftWrist, &["wrist", "hand"]),
    (Joint::LeftHand, &["hand", "palm"]),
    (Joint::LeftHand, &["fingerbase"]),
];

const PELVIS: [&str; 4] = ["pelvis", "hips", "hip", "root"];
const NECK: [&str; 5] = ["neck", "neck1", "necklower", "neck01", "cervical"];
const HEAD: [&str; 2] = ["head", "skull"];

/// The source joint of each of the skeleton's joints, by name alone; the spine is left open.
pub fn named_joints(motion: &dyn SourceMotion) -> [Option<usize>; JOINT_COUNT] {
    let readings: Vec<_> = (0..motion.joint_count())
        .map(|joint| side_and_part(motion.name(joint)))
        .collect();
    let find = |side: Side, parts: &[&str], found: &[Option<usize>; JOINT_COUNT]| {
        parts.iter().find_map(|part| {
            let is_it = |idx: &usize| {
                !found.contains(&Some(*idx))
                    && readings[*idx].iter().any(|(s, p)| *s == side && p == part)
            };
            (0..readings.len()).find(is_it)
        })
    };
    let mut found = [None; JOINT_COUNT];
    found[Joint::Pelvis as usize] = find(Side::Middle, &PELVIS, &found);
    found[Joint::Neck as usize] = find(Side::Middle, &NECK, &found);
    found[Joint::Head as usize] = find(Side::Middle, &HEAD, &found);
    for (joint, parts) in LIMBS {
        for (joint, side) in [(joint, Side::Left), (joint.mirrored(), Side::Right)] {
            if found[joint as usize].is_none() {
                found[joint as usize] = find(side, parts, &found);
            }
        }
    }
    found
}
