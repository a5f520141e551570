//! The section about body shapes that were held out.

use std::collections::BTreeMap;
use std::path::Path;

use dynaskin_report::{Report, Table};
use dynaskin_train::study::{ClipErrors, Comparison};
use dynaskin_train::{DataSet, Set, Tissue};

use super::page::{Methods, Subject};
use super::tables::Csv;

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
    let mut table = Table::new(["shape", "where", "clips"]);
    table.head.extend(methods.labels().map(str::to_owned));
    let mut csv = Csv::new(&[
        "shape",
        "where",
        "method",
        "frames",
        "soft_mm",
        "over_static",
    ]);
    for (shape, clips) in shapes {
        let beta = subject
            .data_set
            .read(&subject.data_set.clips[clips[0].index])?;
        let within = beta.shape.iter().zip(&range);
        let within = within
            .clone()
            .all(|(b, (least, most))| least <= b && b <= most);
        let place = if within { "between" } else { "beyond" };
        let frames: usize = clips.iter().map(|clip| clip.frames).sum();
        let mean = |method: usize| {
            let sums = clips.iter().map(|c| c.frames as f64 * c.soft_mm[method]);
            sums.sum::<f64>() / frames.max(1) as f64
        };
        let cells = (0..methods.names.len()).map(|method| match method {
            0 => format!("{:.2}", mean(0)),
            _ => format!("{:.2} ({:.2})", mean(method), mean(method) / mean(0)),
        });
        let head = [shape.to_owned(), place.to_owned(), clips.len().to_string()];
        table.row(head.into_iter().chain(cells).collect());
        for (method, name) in methods.names.iter().enumerate() {
            csv.row(
                &[shape, place, name],
                &[frames as f64, mean(method), mean(method) / mean(0)],
            );
        }
    }
    report.table(&table);
    csv.write(path, "shapes")
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
