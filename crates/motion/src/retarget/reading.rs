//! What the name of a joint may mean: a side and parts of the body, however the words are written.

use super::source::SourceMotion;
use super::vocabulary::{Part, Side, is_aside, is_silent, meanings, side_of, split_glued};

/// What a word loses for each other word beside it of which nothing is known.
const UNKNOWN_WORD: f64 = 0.15;
/// Letters of a name that means something, at most.
const MOST_LETTERS: usize = 200;
/// Words that mean something together, at most: `left upper leg joint one`.
const MOST_WORDS: usize = 4;

/// What a name may mean.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading {
    pub side: Side,
    pub parts: Vec<(Part, f64)>,
}

/// The readings of all joints, without what all names share.
pub fn readings(motion: &dyn SourceMotion) -> Vec<Reading> {
    let names: Vec<&str> = (0..motion.joint_count())
        .map(|joint| motion.name(joint))
        .collect();
    without_shared(&without_namespace(&names))
        .iter()
        .map(|name| reading(name))
        .collect()
}

/// What stands after the last `:` or `|`; where that is the same in most names, what stands before.
fn without_namespace<'a>(names: &[&'a str]) -> Vec<&'a str> {
    let cut = |name: &'a str| name.rsplit_once([':', '|']);
    let lasts: Vec<&str> = names
        .iter()
        .filter_map(|name| cut(name))
        .map(|(_, last)| last)
        .collect();
    let same = |last: &&str| 2 * lasts.iter().filter(|other| *other == last).count() > lasts.len();
    let is_suffix = lasts.len() > 4 && lasts.first().is_some_and(same);
    names
        .iter()
        .map(|name| match cut(name) {
            Some((first, _)) if is_suffix => first,
            Some((_, last)) => last,
            None => name,
        })
        .collect()
}

/// The names without what nine in ten of them begin or end with.
fn without_shared(names: &[&str]) -> Vec<String> {
    /// Fewer names than this share something by chance.
    const FEWEST_NAMES: usize = 8;
    let lower: Vec<String> = names.iter().map(|name| name.to_lowercase()).collect();
    let mut sorted: Vec<Vec<char>> = lower
        .iter()
        .filter(|name| !name.is_empty())
        .map(|name| name.chars().collect())
        .collect();
    if sorted.len() < FEWEST_NAMES {
        return names.iter().map(|name| (*name).to_owned()).collect();
    }
    let prefix = shared_start(&mut sorted);
    for name in &mut sorted {
        name.reverse();
    }
    let suffix = shared_start(&mut sorted);
    names
        .iter()
        .map(|name| {
            // Lower case can have another number of letters; such names stay as they are.
            let chars: Vec<char> = name.chars().collect();
            let lower = |c: &char| c.to_lowercase().next().unwrap_or(*c);
            let begins = chars.len() > prefix.len()
                && prefix.iter().zip(&chars).all(|(a, b)| *a == lower(b));
            let rest = if begins {
                &chars[prefix.len()..]
            } else {
                &chars[..]
            };
            let ends = rest.len() > suffix.len()
                && suffix
                    .iter()
                    .zip(rest.iter().rev())
                    .all(|(a, b)| *a == lower(b));
            let rest = if ends {
                &rest[..rest.len() - suffix.len()]
            } else {
                rest
            };
            rest.iter().collect()
        })
        .collect()
}

/// What the names begin with, but for one in ten: names are sorted, and what the first and the last
/// of a range share, all between them share. A single letter counts as chance.
fn shared_start(names: &mut [Vec<char>]) -> Vec<char> {
    names.sort_unstable();
    let most = (9 * names.len()).div_ceil(10);
    let mut longest: &[char] = &[];
    for first in 0..=names.len() - most {
        let (a, b) = (&names[first], &names[first + most - 1]);
        let same = a.iter().zip(b).take_while(|(a, b)| a == b).count();
        if same > longest.len() {
            longest = &a[..same];
        }
    }
    if longest.len() < 2 {
        return Vec::new();
    }
    longest.to_vec()
}

fn reading(name: &str) -> Reading {
    if name.len() > MOST_LETTERS {
        return Reading {
            side: Side::Middle,
            parts: Vec::new(),
        };
    }
    let mut words = words(name);
    let side = words
        .iter()
        .map(|word| side_of(word))
        .find(|side| *side != Side::Middle)
        .unwrap_or(Side::Middle);
    words.retain(|word| side == Side::Middle || side_of(word) != side);
    Reading {
        side,
        parts: parts(&words),
    }
}

/// What the words of a name mean together: the longest that mean something, and of single words all
/// of them (`LegAnkle`). A word that stands for something beside the limb, outside of them, takes all
/// meaning away.
fn parts(words: &[String]) -> Vec<(Part, f64)> {
    let words: Vec<&str> = words
        .iter()
        .map(String::as_str)
        .filter(|word| !is_silent(word))
        .collect();
    let mut found: Vec<(Part, f64)> = Vec::new();
    for length in (1..=words.len().min(MOST_WORDS)).rev() {
        for first in 0..=words.len() - length {
            let (before, rest) = words.split_at(first);
            let (own, after) = rest.split_at(length);
            let is_beside = before.iter().chain(after).any(|word| is_aside(word));
            let meanings = meanings(&own.concat());
            if is_beside || meanings.is_empty() {
                continue;
            }
            let loss = UNKNOWN_WORD * (words.len() - length).min(3) as f64;
            for (part, weight) in meanings {
                let weight = (weight - loss).max(0.1);
                match found.iter_mut().find(|(known, _)| known == part) {
                    Some((_, most)) => *most = most.max(weight),
                    None => found.push((*part, weight)),
                }
            }
        }
        if !found.is_empty() {
            break;
        }
    }
    found
}

/// Lower-case words of a name without its numbers: split at punctuation and digits, at a capital
/// after a small letter (`leftUpLeg`), before the last capital of several (`LThigh`), and where
/// known words are glued together.
fn words(name: &str) -> Vec<String> {
    let chars: Vec<char> = name.chars().collect();
    let mut words: Vec<String> = Vec::new();
    let mut current = String::new();
    for (at, &c) in chars.iter().enumerate() {
        let is_letter = c.is_alphanumeric() && !c.is_numeric();
        let before = at.checked_sub(1).map(|before| chars[before]);
        let after = chars.get(at + 1);
        let begins_word = c.is_uppercase()
            && (before.is_some_and(char::is_lowercase)
                || (before.is_some_and(char::is_uppercase)
                    && after.is_some_and(|after| after.is_lowercase())));
        if !is_letter || begins_word {
            let word = std::mem::take(&mut current);
            // `LUArm`, `RFArm`: a side and the beginning of the next word.
            if begins_word && word.len() == 2 && before.is_some_and(char::is_uppercase) {
                words.extend(word.chars().map(String::from));
            } else {
                words.extend(Some(word).filter(|word| !word.is_empty()));
            }
        }
        if is_letter {
            current.extend(c.to_lowercase());
        }
    }
    words.extend(Some(current).filter(|word| !word.is_empty()));
    words.iter().flat_map(|word| split_glued(word)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(name: &str, side: Side, part: Part) {
        let reading = reading(name);
        assert_eq!(reading.side, side, "{name}: {:?}", words(name));
        let best = reading
            .parts
            .iter()
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|(part, _)| *part);
        assert_eq!(best, Some(part), "{name}: {:?}", words(name));
    }

    #[test]
    fn sides_and_parts_are_found_however_they_are_glued() {
        use Side::{Left, Middle, Right};
        for name in [
            "LThigh",
            "lthigh",
            "thighLeft",
            "thighl",
            "thigh.L",
            "L_Thigh",
            "leftThigh",
            "Thigh_L",
            "upperleg01.L",
            "lThighBend",
            "LeftUpLeg_055",
            "left_upLeg_joint",
            "LEFT_THIGH",
            "左足",
            "thigh_l",
            "LeftUpperLeg",
            "JNT_L_Thigh_SKN",
            "lUpLeg",
        ] {
            check(name, Left, Part::Leg(0));
        }
        for name in [
            "RUArm",
            "rshldr",
            "Bip01 R UpperArm",
            "upperarm_r",
            "右腕",
            "RightArm",
        ] {
            check(name, Right, Part::Arm(1));
        }
        for name in [
            "LFArm",
            "lelbow",
            "L_Lowerarm",
            "lForearmBend",
            "leftLowerArm",
        ] {
            check(name, Left, Part::Arm(2));
        }
        check("R_ToeBase", Right, Part::Leg(3));
        check("Bip01 L Toe0", Left, Part::Leg(3));
        check("HipCenter", Middle, Part::Pelvis);
        check("SpineBase", Middle, Part::Pelvis);
        check("neck_1_joint", Middle, Part::Neck);
    }

    #[test]
    fn helpers_and_other_words_are_no_parts() {
        for name in [
            "LeftHandIndex1",
            "upperarm_twist_01_l",
            "ik_foot_l",
            "lThighTwist",
            "LeftEye",
            "rib",
            "lip",
            "L5",
            "T12",
            "Abdomen",
            "HeadTop_End",
            "thigh_ik.L",
            "Spine1",
            "Chest",
        ] {
            assert!(
                reading(name).parts.is_empty(),
                "{name}: {:?}",
                reading(name)
            );
        }
    }
}
