//! The section about body shapes that were held out.

use std::collections::BTreeMap;
use std::path::Path;

use dynaskin_evaluate::study::{ClipErrors, Comparison};
use dynaskin_report::Report;
use dynaskin_train::{DataSet, Set, Tissue};

use super::groups::{Group, groups_table};
use super::page::{Methods, Subject};

/// Errors of each held-out shape by itself: between the shapes learned from, or beyond them.
pub fn shapes_section(
    report: &mut Report,
    path: &Path,
    subject: &Subject<'_>,
    methods: &Methods,
    comparison: &Comparison,
) -> anyhow::Result<()> {
    let mut shapes: BTreeMap<&str, Vec<&ClipErrors>> = BTreeMap::new();
    for clip in &comparison.clips {
        if matches!(clip.set, Set::UnseenShape | Set::UnseenMotionAndShape) {
            let shape = subject.data_set.clips[clip.index].name.shape.as_str();
            shapes.entry(shape).or_default().push(clip);
        }
    }
    if shapes.is_empty() {
        return Ok(());
    }
    report.section("Bodies left out");
    report.paragraph(
        "Each held-out body shape by itself, over all its clips. Between: every coefficient lies in the \
         range of the training shapes. Beyond: some do not, which asks a method to extrapolate. Mean error \
         over the soft vertices in millimetres (error over static).",
    );
    let range = training_range(subject.data_set)?;
    let mut groups = Vec::new();
    for (shape, clips) in shapes {
        let beta = subject
            .data_set
            .read(&subject.data_set.clips[clips[0].index])?;
        let mut within = beta.shape.iter().zip(&range);
        let within = within.all(|(b, (least, most))| least <= b && b <= most);
        let place = if within { "between" } else { "beyond" };
        groups.push(Group {
            head: vec![shape.to_owned(), place.to_owned()],
            clips,
        });
    }
    groups_table(report, methods, &["shape", "where"], &groups).write(path, "shapes")
}

/// The least and the greatest of each shape coefficient in the training set.
fn training_range(data_set: &DataSet) -> anyhow::Result<Vec<(f32, f32)>> {
    let mut seen = BTreeMap::new();
    for clip in data_set.of_set(Set::Training, Tissue::Any) {
        seen.entry(clip.name.shape.as_str()).or_insert(clip);
    }
    let mut range: Vec<(f32, f32)> = Vec::new();
    for clip in seen.values() {
        let shape = data_set.read(clip)?.shape;
        range.resize(shape.len(), (f32::MAX, f32::MIN));
        for ((least, most), beta) in range.iter_mut().zip(shape) {
            (*least, *most) = (least.min(beta), most.max(beta));
        }
    }
    Ok(range)
}
