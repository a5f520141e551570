//! Words that names of joints are made of.

/// A side of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    Left,
    Right,
    Middle,
}

/// A part of a limb or of the trunk that a word can mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Hip, knee, ankle and ball, from the trunk outwards.
    Leg(usize),
    /// Collar, shoulder, elbow, wrist and hand, from the trunk outwards.
    Arm(usize),
    Pelvis,
    Neck,
    Head,
}

use Part::{Arm, Head, Leg, Neck, Pelvis};

/// What words mean, and how surely: between two meanings the tree decides.
const MEANINGS: &[(&str, &[(Part, f64)])] = &[
    ("upleg", &[(Leg(0), 1.0)]),
    ("upperleg", &[(Leg(0), 1.0)]),
    ("legup", &[(Leg(0), 1.0)]),
    ("legupper", &[(Leg(0), 1.0)]),
    ("uleg", &[(Leg(0), 1.0)]),
    ("thigh", &[(Leg(0), 1.0)]),
    ("femur", &[(Leg(0), 1.0)]),
    ("hip", &[(Leg(0), 0.8), (Pelvis, 1.0)]),
    ("hipjoint", &[(Leg(0), 0.4)]),
    ("buttock", &[(Leg(0), 0.5)]),
    ("oberschenkel", &[(Leg(0), 1.0)]),
    ("muslo", &[(Leg(0), 1.0)]),
    ("cuisse", &[(Leg(0), 1.0)]),
    ("coscia", &[(Leg(0), 1.0)]),
    ("leg", &[(Leg(1), 0.7), (Leg(0), 0.5)]),
    ("knee", &[(Leg(1), 1.0)]),
    ("shin", &[(Leg(1), 1.0)]),
    ("calf", &[(Leg(1), 1.0)]),
    ("crus", &[(Leg(1), 1.0)]),
    ("tibia", &[(Leg(1), 1.0)]),
    ("shank", &[(Leg(1), 1.0)]),
    ("unterschenkel", &[(Leg(1), 1.0)]),
    ("pantorrilla", &[(Leg(1), 1.0)]),
    ("mollet", &[(Leg(1), 1.0)]),
    ("polpaccio", &[(Leg(1), 1.0)]),
    ("knie", &[(Leg(1), 1.0)]),
    ("rodilla", &[(Leg(1), 1.0)]),
    ("genou", &[(Leg(1), 1.0)]),
    ("ginocchio", &[(Leg(1), 1.0)]),
    ("lowerleg", &[(Leg(1), 1.0)]),
    ("lowleg", &[(Leg(1), 1.0)]),
    ("loleg", &[(Leg(1), 1.0)]),
    ("leglow", &[(Leg(1), 1.0)]),
    ("leglower", &[(Leg(1), 1.0)]),
    ("ankle", &[(Leg(2), 1.0)]),
    ("foot", &[(Leg(2), 0.9), (Leg(3), 0.4)]),
    ("talus", &[(Leg(2), 0.9)]),
    ("fuß", &[(Leg(2), 0.9)]),
    ("fuss", &[(Leg(2), 0.9)]),
    ("pie", &[(Leg(2), 0.9)]),
    ("pied", &[(Leg(2), 0.9)]),
    ("piede", &[(Leg(2), 0.9)]),
    ("knöchel", &[(Leg(2), 1.0)]),
    ("tobillo", &[(Leg(2), 1.0)]),
    ("cheville", &[(Leg(2), 1.0)]),
    ("caviglia", &[(Leg(2), 1.0)]),
    ("toe", &[(Leg(3), 1.0)]),
    ("toes", &[(Leg(3), 1.0)]),
    ("toebase", &[(Leg(3), 1.0)]),
    ("ball", &[(Leg(3), 1.0)]),
    ("metatarsals", &[(Leg(3), 0.8)]),
    ("metatarsal", &[(Leg(3), 0.8)]),
    ("footindex", &[(Leg(3), 1.0)]),
    ("zeh", &[(Leg(3), 1.0)]),
    ("zehen", &[(Leg(3), 1.0)]),
    ("dedos", &[(Leg(3), 0.6)]),
    ("orteils", &[(Leg(3), 1.0)]),
    ("collar", &[(Arm(0), 1.0)]),
    ("collarbone", &[(Arm(0), 1.0)]),
    ("clavicle", &[(Arm(0), 1.0)]),
    ("clavicula", &[(Arm(0), 1.0)]),
    ("clav", &[(Arm(0), 1.0)]),
    ("scapula", &[(Arm(0), 0.9)]),
    ("schlüsselbein", &[(Arm(0), 1.0)]),
    ("clavicule", &[(Arm(0), 1.0)]),
    ("schulter", &[(Arm(0), 0.5), (Arm(1), 0.7)]),
    ("hombro", &[(Arm(0), 0.5), (Arm(1), 0.7)]),
    ("épaule", &[(Arm(0), 0.5), (Arm(1), 0.7)]),
    ("epaule", &[(Arm(0), 0.5), (Arm(1), 0.7)]),
    ("spalla", &[(Arm(0), 0.5), (Arm(1), 0.7)]),
    ("oberarm", &[(Arm(1), 1.0)]),
    ("brazo", &[(Arm(1), 1.0)]),
    ("bras", &[(Arm(1), 1.0)]),
    ("braccio", &[(Arm(1), 1.0)]),
    ("unterarm", &[(Arm(2), 1.0)]),
    ("antebrazo", &[(Arm(2), 1.0)]),
    ("avantbras", &[(Arm(2), 1.0)]),
    ("avambraccio", &[(Arm(2), 1.0)]),
    ("ellbogen", &[(Arm(2), 1.0)]),
    ("codo", &[(Arm(2), 1.0)]),
    ("coude", &[(Arm(2), 1.0)]),
    ("gomito", &[(Arm(2), 1.0)]),
    ("handgelenk", &[(Arm(3), 1.0)]),
    ("muñeca", &[(Arm(3), 1.0)]),
    ("poignet", &[(Arm(3), 1.0)]),
    ("polso", &[(Arm(3), 1.0)]),
    ("mano", &[(Arm(3), 0.8), (Arm(4), 0.5)]),
    ("main", &[(Arm(3), 0.8), (Arm(4), 0.5)]),
    ("shoulder", &[(Arm(0), 0.5), (Arm(1), 0.7)]),
    ("arm", &[(Arm(1), 1.0), (Arm(2), 0.3)]),
    ("upperarm", &[(Arm(1), 1.0)]),
    ("uparm", &[(Arm(1), 1.0)]),
    ("uarm", &[(Arm(1), 1.0)]),
    ("armup", &[(Arm(1), 1.0)]),
    ("armupper", &[(Arm(1), 1.0)]),
    ("shldr", &[(Arm(1), 0.9)]),
    ("humerus", &[(Arm(1), 1.0)]),
    ("elbow", &[(Arm(2), 1.0)]),
    ("forearm", &[(Arm(2), 1.0)]),
    ("farm", &[(Arm(2), 1.0)]),
    ("lowerarm", &[(Arm(2), 1.0)]),
    ("lowarm", &[(Arm(2), 1.0)]),
    ("loarm", &[(Arm(2), 1.0)]),
    ("armlow", &[(Arm(2), 1.0)]),
    ("armlower", &[(Arm(2), 1.0)]),
    ("radius", &[(Arm(2), 0.8)]),
    ("ulna", &[(Arm(2), 0.8)]),
    ("wrist", &[(Arm(3), 1.0)]),
    ("hand", &[(Arm(3), 0.8), (Arm(4), 0.5)]),
    ("palm", &[(Arm(3), 0.85), (Arm(4), 0.8)]),
    ("fingerbase", &[(Arm(4), 0.7)]),
    ("pelvis", &[(Pelvis, 1.0)]),
    ("hips", &[(Pelvis, 1.0)]),
    ("hipcenter", &[(Pelvis, 1.0)]),
    ("centerhip", &[(Pelvis, 1.0)]),
    ("midhip", &[(Pelvis, 1.0)]),
    ("spinebase", &[(Pelvis, 1.0)]),
    ("root", &[(Pelvis, 0.3)]),
    ("becken", &[(Pelvis, 1.0)]),
    ("hüfte", &[(Leg(0), 0.8), (Pelvis, 1.0)]),
    ("hüften", &[(Pelvis, 1.0)]),
    ("cadera", &[(Leg(0), 0.8), (Pelvis, 1.0)]),
    ("hanche", &[(Leg(0), 0.8), (Pelvis, 1.0)]),
    ("bassin", &[(Pelvis, 1.0)]),
    ("bacino", &[(Pelvis, 1.0)]),
    ("lowertorso", &[(Pelvis, 0.8)]),
    ("lowerbody", &[(Pelvis, 1.0)]),
    ("neck", &[(Neck, 1.0)]),
    ("necklower", &[(Neck, 1.0)]),
    ("cervical", &[(Neck, 0.9)]),
    ("lowerneck", &[(Neck, 1.0)]),
    ("hals", &[(Neck, 1.0)]),
    ("nacken", &[(Neck, 1.0)]),
    ("cuello", &[(Neck, 1.0)]),
    ("cou", &[(Neck, 1.0)]),
    ("collo", &[(Neck, 1.0)]),
    ("kopf", &[(Head, 1.0)]),
    ("cabeza", &[(Head, 1.0)]),
    ("tête", &[(Head, 1.0)]),
    ("tete", &[(Head, 1.0)]),
    ("testa", &[(Head, 1.0)]),
    ("head", &[(Head, 1.0)]),
    ("skull", &[(Head, 0.9)]),
    // MikuMikuDance.
    ("足", &[(Leg(0), 1.0)]),
    ("ひざ", &[(Leg(1), 1.0)]),
    ("膝", &[(Leg(1), 1.0)]),
    ("ヒザ", &[(Leg(1), 1.0)]),
    ("足首", &[(Leg(2), 1.0)]),
    ("つま先", &[(Leg(3), 1.0)]),
    ("爪先", &[(Leg(3), 1.0)]),
    ("足先", &[(Leg(3), 0.9)]),
    ("肩", &[(Arm(0), 1.0)]),
    ("腕", &[(Arm(1), 1.0)]),
    ("ひじ", &[(Arm(2), 1.0)]),
    ("肘", &[(Arm(2), 1.0)]),
    ("ヒジ", &[(Arm(2), 1.0)]),
    ("手首", &[(Arm(3), 1.0)]),
    ("下半身", &[(Pelvis, 1.0)]),
    ("首", &[(Neck, 1.0)]),
    ("頭", &[(Head, 1.0)]),
    // Chinese.
    ("大腿", &[(Leg(0), 1.0)]),
    ("小腿", &[(Leg(1), 1.0)]),
    ("脚踝", &[(Leg(2), 1.0)]),
    ("脚", &[(Leg(2), 0.9)]),
    ("脚趾", &[(Leg(3), 1.0)]),
    ("锁骨", &[(Arm(0), 1.0)]),
    ("上臂", &[(Arm(1), 1.0)]),
    ("大臂", &[(Arm(1), 1.0)]),
    ("前臂", &[(Arm(2), 1.0)]),
    ("小臂", &[(Arm(2), 1.0)]),
    ("手腕", &[(Arm(3), 1.0)]),
    ("手", &[(Arm(3), 0.8), (Arm(4), 0.5)]),
    ("骨盆", &[(Pelvis, 1.0)]),
    ("脖子", &[(Neck, 1.0)]),
    ("颈", &[(Neck, 1.0)]),
    ("头", &[(Head, 1.0)]),
];

/// Words that say nothing of which part a joint is.
const SILENT: &[&str] = &[
    "joint",
    "jnt",
    "jt",
    "bone",
    "skin",
    "skn",
    "bind",
    "def",
    "bend",
    "c",
    "m",
    "x",
    "center",
    "centre",
    "stretch",
    "actor",
    "human",
    "anim",
    "j",
    "b",
    "bip",
    "mixamorig",
    "rig",
    "skeleton",
    "character",
    "avatar",
    "rl",
    "cc",
];

/// Words whose joints are no part of a chain: helpers of skins and rigs, fingers, what is worn.
const ASIDE: &[&str] = &[
    "twist",
    "roll",
    "ik",
    "fk",
    "ctrl",
    "ctl",
    "control",
    "controller",
    "pole",
    "target",
    "tweak",
    "mch",
    "end",
    "nub",
    "tip",
    "site",
    "finger",
    "fingers",
    "thumb",
    "index",
    "middle",
    "ring",
    "pinky",
    "little",
    "eye",
    "eyes",
    "jaw",
    "teeth",
    "tongue",
    "nose",
    "ear",
    "hair",
    "cloth",
    "skirt",
    "sleeve",
    "muscle",
    "corrective",
    "bust",
    "breast",
    "pectoral",
    "weapon",
    "prop",
    "socket",
    "helper",
    "share",
    "collider",
    "effector",
    "heel",
    "top",
    "nail",
    "handtip",
    "pinkie",
    "metacarpal",
    "carpal",
    "ｉｋ",
    "捩",
    "親",
    "先",
];

/// What a word means.
pub fn meanings(word: &str) -> &'static [(Part, f64)] {
    MEANINGS
        .iter()
        .find(|(known, _)| *known == word)
        .map_or(&[], |(_, parts)| parts)
}

/// Whether a word says nothing of which part a joint is.
pub fn is_silent(word: &str) -> bool {
    SILENT.contains(&word)
}

/// Whether a word tells that its joint is no part of a chain.
pub fn is_aside(word: &str) -> bool {
    ASIDE.contains(&word)
}

/// The side that a word names.
pub fn side_of(word: &str) -> Side {
    match word {
        "left" | "l" | "lft" | "lf" | "lt" | "左" | "links" | "izq" | "izquierda" | "izquierdo"
        | "gauche" | "sinistra" | "sinistro" => Side::Left,
        "right" | "r" | "rgt" | "rt" | "右" | "rechts" | "der" | "derecha" | "derecho"
        | "droite" | "droit" | "destra" | "destro" => Side::Right,
        _ => Side::Middle,
    }
}

/// Words that only stand beside others.
const BESIDE: &[&str] = &[
    "upper", "lower", "up", "low", "fore", "base", "big", "spine", "chest",
];

/// Whether a word is known, so that it needs no taking apart.
pub fn is_known(word: &str) -> bool {
    !meanings(word).is_empty()
        || is_silent(word)
        || is_aside(word)
        || BESIDE.contains(&word)
        || side_of(word) != Side::Middle
}

/// Takes `lthigh`, `thighleft` or `rightupperarm` apart: the fewest known words that cover all of
/// `word`, of which a single letter stands first or last. The word itself where there are none.
pub fn split_glued(word: &str) -> Vec<String> {
    const MAX_LETTERS: usize = 40;
    let chars: Vec<char> = word.chars().collect();
    if is_known(word) || chars.len() > MAX_LETTERS {
        return vec![word.to_owned()];
    }
    // Fewest words up to each letter, and where the last of them begins.
    let mut best: Vec<Option<(usize, usize)>> = vec![None; chars.len() + 1];
    best[0] = Some((0, 0));
    for end in 1..=chars.len() {
        for start in 0..end {
            let Some((count, _)) = best[start] else {
                continue;
            };
            let part: String = chars[start..end].iter().collect();
            let is_single = end - start == 1 && part.is_ascii();
            let is_word = if is_single {
                side_of(&part) != Side::Middle && (start == 0 || end == chars.len())
            } else {
                // `lf` and the like are too short to be cut out of a word.
                is_known(&part)
                    && (side_of(&part) == Side::Middle || part.len() > 3 || !part.is_ascii())
            };
            if is_word && best[end].is_none_or(|(least, _)| count + 1 < least) {
                best[end] = Some((count + 1, start));
            }
        }
    }
    let mut words = Vec::new();
    let mut end = chars.len();
    while end > 0 {
        let Some((_, start)) = best[end] else {
            return vec![word.to_owned()];
        };
        words.push(chars[start..end].iter().collect());
        end = start;
    }
    words.reverse();
    words
}
