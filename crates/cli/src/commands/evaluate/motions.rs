//! The section about motions that were held out.

use std::collections::BTreeMap;
use std::path::Path;

use dynaskin_evaluate::study::{ClipErrors, Comparison};
use dynaskin_report::Report;
use dynaskin_train::Set;

use super::groups::{Group, groups_table};
use super::page::{Methods, Subject};

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
    report.paragraph(
        "Each held-out motion by itself, on body shapes that were learned from. Motions with a name are \
         made by formula; all clips of that kind are held out, whatever their tempo and on whatever \
         shape. Numbers are captures of the CMU collection; all parts, mirror images and speeds of such a \
         recording are held out. People who move in similar ways in other recordings are learned from: \
         one of the project's training captures, 14_06, holds jumping jacks and jogging in place. Mean \
         error over the soft vertices in millimetres (error over static).",
    );
    let groups = trials.into_iter().map(|((_, trial), clips)| Group {
        head: vec![trial.to_owned()],
        clips,
    });
    let groups: Vec<Group<'_>> = groups.collect();
    groups_table(report, methods, &["motion"], &groups).write(path, "motions")
}
