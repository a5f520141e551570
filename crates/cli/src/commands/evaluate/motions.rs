//! The section about motions that were held out.

use std::collections::BTreeMap;
use std::path::Path;

use dynaskin_evaluate::study::{ClipErrors, Comparison};
use dynaskin_report::Report;
use dynaskin_train::Set;

use super::groups::{Group, groups_table};
use super::subject::{Methods, Subject};

/// Errors of each held-out motion by itself, those made by formula first.
pub fn motions_section(
    report: &mut Report,
    path: &Path,
    subject: &Subject<'_>,
    methods: &Methods,
    comparison: &Comparison,
) -> anyhow::Result<()> {
    let mut trials: BTreeMap<(bool, &str), Vec<&ClipErrors>> = BTreeMap::new();
    for clip in &comparison.clips {
        if clip.set == Set::UnseenMotion {
            let name = &subject.data_set.clips[clip.index].name;
            let captured = name.subject.is_some();
            let trial = name.trial.as_str();
            trials.entry((captured, trial)).or_default().push(clip);
        }
    }
    if trials.is_empty() {
        return Ok(());
    }
    report.section("Each motion left out");
    report.paragraph(&format!(
        "Each held-out motion by itself, on body shapes that were learned from: all clips of it, whatever their tempo \
         and shape; of a recording all parts, mirror images and speeds.{} Mean error over the soft vertices in \
         millimetres (error over static).",
        alike(subject)
    ));
    let groups = trials.into_iter().map(|((_, trial), clips)| Group {
        head: vec![trial.to_owned()],
        clips,
    });
    let groups: Vec<Group<'_>> = groups.collect();
    groups_table(report, methods, &["motion"], &groups).write(path, "motions")
}

/// A sentence about what the project's own captures hold of held-out motions; empty for other captures.
pub fn alike(subject: &Subject<'_>) -> &'static str {
    let mut clips = subject.data_set.clips.iter();
    match clips.any(|clip| clip.name.trial.starts_with("14_06")) {
        true => {
            " People who move in similar ways in other recordings are learned from: one of the project's, CMU's 14_06, \
             holds jumping jacks and jogging in place."
        }
        false => "",
    }
}
