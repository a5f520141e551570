//! Which clips a model may learn from, and which it is measured on.
//!
//! The split is by trial, by capture subject and by body shape, never by frame. Neighbouring
//! frames, parts of one recording and copies of it (mirrored, time-scaled) are nearly the same
//! data, and a model measured on them would look better than it is.

use std::collections::BTreeSet;
use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::TrainError;

/// What a clip's name says: `14_06bm__s2` is trial `14_06` (part b, mirrored) of subject `14` on
/// shape `s2`, `14_06b@88__s2` the same slowed to 88 %; `hop-190-090m__s0` is the procedural motion `hop` at some tempo and height, mirrored.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ClipName {
    /// The trial without part and mirror letters, or the kind of a procedural motion without its
    /// numbers.
    pub trial: String,
    /// The capture subject (`14`), or none for a procedural motion.
    pub subject: Option<String>,
    /// The shape's tag: the last part of the name.
    pub shape: String,
}

impl ClipName {
    /// Takes a name apart; none where it is not `source__shape`.
    pub fn parse(name: &str) -> Option<Self> {
        let (source, shape) = name.rsplit_once("__")?;
        // The speed of a time-scaled copy, perhaps mirrored: `@88`, `@88m`.
        let source = match source.split_once('@') {
            Some((source, percent)) => {
                let digits = percent.strip_suffix('m').unwrap_or(percent);
                let is_number = !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
                is_number.then_some(source)?
            }
            None => source,
        };
        if source.is_empty() || shape.is_empty() {
            return None;
        }
        let shape = shape.to_owned();
        if let Some((subject, trial)) = captured(source) {
            return Some(Self {
                trial: format!("{subject}_{trial}"),
                subject: Some(subject.to_owned()),
                shape,
            });
        }
        let numbered = |c: char| c.is_ascii_digit() || c == '-';
        let kind = source.strip_suffix('m').filter(|s| s.ends_with(numbered));
        let kind = kind.unwrap_or(source).trim_end_matches(numbered);
        (!kind.is_empty()).then(|| Self {
            trial: kind.to_owned(),
            subject: None,
            shape,
        })
    }
}

/// Subject and trial number of a capture's name: `14_06bm` gives `14` and `06`.
fn captured(source: &str) -> Option<(&str, &str)> {
    let (subject, rest) = source.split_once('_')?;
    let trial = rest.trim_end_matches(|c: char| c.is_ascii_lowercase());
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    (digits(subject) && digits(trial) && rest.len() <= trial.len() + 2).then_some((subject, trial))
}

/// The set that a clip belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Set {
    /// Learned from.
    Training,
    /// Decides when to stop; training subjects and shapes, other trials.
    Validation,
    /// Held-out trial of a training subject, on a training shape.
    UnseenMotion,
    /// Held-out subject, on a training shape.
    UnseenSubject,
    /// Training motion on a held-out shape.
    UnseenShape,
    /// Held-out trial or subject on a held-out shape.
    UnseenMotionAndShape,
}

impl Set {
    /// The sets that a model is reported on, in report order.
    pub const TEST: [Self; 4] = [
        Self::UnseenMotion,
        Self::UnseenSubject,
        Self::UnseenShape,
        Self::UnseenMotionAndShape,
    ];

    /// Name in reports: `unseen motion`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Training => "training",
            Self::Validation => "validation",
            Self::UnseenMotion => "unseen motion",
            Self::UnseenSubject => "unseen subject",
            Self::UnseenShape => "unseen shape",
            Self::UnseenMotionAndShape => "unseen motion and shape",
        }
    }
}

/// What is held out. The committed default is [`Split::default`].
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Split {
    /// What the file is, for its reader.
    #[serde(default)]
    pub about: String,
    /// Capture subjects that are only tested on.
    pub test_subjects: Vec<String>,
    /// Trials that are only tested on.
    pub test_trials: Vec<String>,
    /// Trials that decide when to stop.
    pub validation_trials: Vec<String>,
    /// Shape tags that are only tested on.
    pub test_shapes: Vec<String>,
}

impl Default for Split {
    fn default() -> Self {
        serde_json::from_str(include_str!("../config/split.json"))
            .expect("config/split.json is part of the source and tested")
    }
}

impl Split {
    /// Reads a split file.
    ///
    /// # Errors
    /// [`TrainError::Io`], [`TrainError::Split`].
    pub fn read(path: &Path) -> Result<Self, TrainError> {
        let text = std::fs::read_to_string(path).map_err(TrainError::io(path, "reading"))?;
        serde_json::from_str(&text).map_err(|error| TrainError::Split {
            place: path.display().to_string(),
            reason: format!(
                "it is no split of JSON text ({error}); docs/data-set.md has an example, and --hold-out needs no file"
            ),
        })
    }

    /// Holds out motions, people and shapes as clips are named; `validation` are motions.
    ///
    /// # Errors
    /// [`TrainError::NoSuchName`] for what no clip is named after.
    pub fn of_names<'a>(
        clips: impl IntoIterator<Item = &'a ClipName>,
        held_out: &[String],
        validation: &[String],
    ) -> Result<Self, TrainError> {
        let (mut trials, mut subjects, mut shapes) =
            (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
        for clip in clips {
            trials.insert(clip.trial.as_str());
            subjects.extend(clip.subject.as_deref());
            shapes.insert(clip.shape.as_str());
        }
        let known = |wanted, name: &str, sets: &[&BTreeSet<&str>]| {
            if sets.iter().any(|set| set.contains(name)) {
                return Ok(());
            }
            let there: Vec<&str> = sets.iter().copied().flatten().copied().collect();
            Err(TrainError::NoSuchName {
                wanted,
                name: name.to_owned(),
                there: there.join(", "),
            })
        };
        for name in validation {
            known("motion", name, &[&trials])?;
            if held_out.contains(name) {
                return Err(TrainError::HeldOutValidation { name: name.clone() });
            }
        }
        for name in held_out {
            known("motion or person", name, &[&trials, &subjects, &shapes])?;
        }
        let held_out_among = |set: &BTreeSet<&str>| -> Vec<String> {
            let names = held_out.iter();
            names
                .filter(|name| set.contains(name.as_str()))
                .cloned()
                .collect()
        };
        Ok(Self {
            about: "Given with --hold-out and --validate-on.".to_owned(),
            test_subjects: held_out_among(&subjects),
            test_trials: held_out_among(&trials),
            validation_trials: validation.to_vec(),
            test_shapes: held_out_among(&shapes),
        })
    }

    /// The set of a clip. A validation trial on a held-out shape counts as unseen motion and
    /// shape: it decided when to stop, but on other shapes and so on other offsets.
    pub fn set_of(&self, clip: &ClipName) -> Set {
        let subject = clip.subject.as_ref();
        let unseen_subject = subject.is_some_and(|s| self.test_subjects.contains(s));
        let unseen_trial = self.test_trials.contains(&clip.trial);
        let validation = self.validation_trials.contains(&clip.trial);
        let unseen_shape = self.test_shapes.contains(&clip.shape);
        match (unseen_shape, unseen_subject, unseen_trial, validation) {
            (false, true, _, _) => Set::UnseenSubject,
            (false, false, true, _) => Set::UnseenMotion,
            (false, false, false, true) => Set::Validation,
            (false, false, false, false) => Set::Training,
            (true, false, false, false) => Set::UnseenShape,
            (true, _, _, _) => Set::UnseenMotionAndShape,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn set(name: &str) -> Set {
        let split = Split {
            about: String::new(),
            test_subjects: vec!["07".into()],
            test_trials: vec!["14_20".into(), "hop".into()],
            validation_trials: vec!["14_02".into()],
            test_shapes: vec!["s3".into()],
        };
        split.set_of(&ClipName::parse(name).expect("a name"))
    }

    #[test]
    fn names_come_apart() {
        let parse = |name: &str| {
            let clip = ClipName::parse(name)?;
            Some((clip.trial, clip.subject.unwrap_or_default(), clip.shape))
        };
        let expected = |trial: &str, subject: &str, shape: &str| {
            Some((trial.to_owned(), subject.to_owned(), shape.to_owned()))
        };
        assert_eq!(parse("14_06b__s2"), expected("14_06", "14", "s2"));
        assert_eq!(parse("14_06bm__s2"), expected("14_06", "14", "s2"));
        assert_eq!(parse("14_06b@88m__s2"), expected("14_06", "14", "s2"));
        assert_eq!(parse("14_06b@x__s2"), None);
        assert_eq!(parse("127_04m__s9"), expected("127_04", "127", "s9"));
        assert_eq!(
            parse("one-leg-hop-190-090m__s0"),
            expected("one-leg-hop", "", "s0")
        );
        assert_eq!(parse("jump-080-300__s0"), expected("jump", "", "s0"));
        assert_eq!(parse("14_06b"), None);
        assert_eq!(parse("14_06__"), None);
        assert_eq!(parse("__s0"), None);
    }

    #[test]
    fn all_parts_and_copies_of_a_trial_share_a_set() {
        for name in ["14_20a__s0", "14_20cm__s1", "14_20__s0"] {
            assert_eq!(set(name), Set::UnseenMotion, "{name}");
        }
        assert_eq!(set("14_02d__s0"), Set::Validation);
        assert_eq!(set("07_03__s0"), Set::UnseenSubject);
        assert_eq!(set("16_04__s0"), Set::Training);
        assert_eq!(set("16_04__s3"), Set::UnseenShape);
        assert_eq!(set("hop-190-090m__s0"), Set::UnseenMotion);
        for name in ["07_03__s3", "14_20a__s3", "14_02a__s3", "hop-1-2__s3"] {
            assert_eq!(set(name), Set::UnseenMotionAndShape, "{name}");
        }
    }

    #[test]
    fn names_are_held_out_that_clips_have() {
        let clips = [
            "hips__50002",
            "hips__50004",
            "one_leg_jump__50004",
            "07_03__s0",
        ];
        let clips = clips.map(|name| ClipName::parse(name).expect("a name"));
        let of_names = |held_out: &[&str], validation: &str| {
            let held_out: Vec<String> = held_out.iter().map(ToString::to_string).collect();
            Split::of_names(&clips, &held_out, &[validation.to_owned()])
        };
        let split = of_names(&["50004", "one_leg_jump", "07"], "hips").expect("a split");
        let sets = clips.each_ref().map(|clip| split.set_of(clip));
        let expected = [
            Set::Validation,
            Set::UnseenMotionAndShape,
            Set::UnseenMotionAndShape,
            Set::UnseenSubject,
        ];
        assert_eq!(sets, expected);
        for (held_out, validation, words) in [
            (
                "50007",
                "hips",
                ["motion or person `50007`", "50002, 50004"],
            ),
            (
                "50004",
                "50002",
                ["no motion `50002`", "hips, one_leg_jump"],
            ),
            ("hips", "hips", ["`hips` is held out", "--validate-on"]),
        ] {
            let error = of_names(&[held_out], validation)
                .expect_err("a name that is not there")
                .to_string();
            assert!(words.iter().all(|word| error.contains(word)), "{error}");
        }
    }

    #[test]
    fn the_committed_split_is_read() {
        let split = Split::default();
        assert!(!split.test_subjects.is_empty() && !split.test_shapes.is_empty());
        for trial in &split.validation_trials {
            assert!(
                !split.test_trials.contains(trial),
                "{trial} is on both sides"
            );
        }
    }
}
