//! The sections about how many numbers, and how many bytes, hold an offset field: autoencoders and
//! decoders against principal components.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::{Context as _, bail};
use dynaskin_evaluate::study::{self, FLOOR_STRIDE, Floor, Floors};
use dynaskin_report::{Curve, Plot, Report, Table};
use dynaskin_train::{Set, Tissue};

use super::subject::{Methods, Subject};
use super::tables::Csv;
use crate::commands::train::{SubspaceRow, clip_bar};

/// Curves of a clip by numbers of latents, as `dynaskin train casas-otaduy --compare-subspaces` left them in the
/// file `csv`.
pub fn read_subspaces(csv: &Path) -> anyhow::Result<BTreeMap<usize, Vec<SubspaceRow>>> {
    let text = fs::read_to_string(csv).with_context(|| format!("cannot read {}", csv.display()))?;
    let mut lines = text.lines();
    if lines.next() != Some(SubspaceRow::HEAD) {
        bail!(
            "{} does not begin with {}: have it written by `dynaskin train casas-otaduy --compare-subspaces`",
            csv.display(),
            SubspaceRow::HEAD
        );
    }
    let mut sizes: BTreeMap<usize, Vec<SubspaceRow>> = BTreeMap::new();
    for (index, line) in lines.enumerate() {
        let row: SubspaceRow = line
            .parse()
            .with_context(|| format!("{}, line {}", csv.display(), index + 2))?;
        sizes.entry(row.latents).or_default().push(row);
    }
    Ok(sizes)
}

/// Curves of a clip that neither was fitted to, from [`read_subspaces`].
pub fn subspaces_section(
    report: &mut Report,
    sizes: &BTreeMap<usize, Vec<SubspaceRow>>,
) -> anyhow::Result<()> {
    let row = sizes.values().flatten().next();
    let clip = row.map_or("", |row| row.clip.as_str());
    report.section("Autoencoders and principal components");
    report.paragraph(&format!(
        "As in figure 5 of Casas & Otaduy (2018): mean error over all tissue vertices of the best that \
         their autoencoder and as many principal components can do on {clip}, which neither was \
         fitted to. Millimetres."
    ));
    let mut table = Table::new(["numbers a frame", "autoencoder", "principal components"]);
    let mut curves = Vec::new();
    for (latents, rows) in sizes {
        let mean = |value: fn(&SubspaceRow) -> f64| {
            rows.iter().map(value).sum::<f64>() / rows.len().max(1) as f64
        };
        table.row(vec![
            latents.to_string(),
            format!("{:.3}", mean(|row| row.autoencoder_mm)),
            format!("{:.3}", mean(|row| row.pca_mm)),
        ]);
        let curve = |name: &str, value: fn(&SubspaceRow) -> f64| Curve {
            name: format!("{name}, {latents}"),
            points: rows
                .iter()
                .map(|row| (row.frame as f64 / 60.0, value(row)))
                .collect(),
        };
        curves.push(curve("autoencoder", |row| row.autoencoder_mm));
        curves.push(curve("principal components", |row| row.pca_mm));
    }
    report.table(&table);
    report.plot(&Plot {
        title: format!("Reconstruction error: {clip}"),
        x_label: "time (s)".into(),
        y_label: "mean error (mm)".into(),
        curves,
    })?;
    Ok(())
}

/// What the decoder of the bundle under evaluation can give at best, beside principal components in
/// as many bytes.
pub fn bytes_section(
    report: &mut Report,
    path: &Path,
    subject: &Subject<'_>,
    methods: &mut Methods,
) -> anyhow::Result<()> {
    report.section("Decoder and principal components in as many bytes");
    let own = methods.contestants.len() - 1;
    let (Some(kind), Some(decoder)) = (
        methods.contestants[own].feature_kind(),
        &methods.decoders[own],
    ) else {
        return Ok(());
    };
    let tissue = Tissue::known_to(kind);
    if subject
        .data_set
        .of_set(Set::Training, tissue)
        .next()
        .is_none()
    {
        report.paragraph(
            "The data folder has no clips to learn from, so there is nothing to fit principal \
             components to: give a whole data set as --data.",
        );
        return Ok(());
    }
    let onnx = fs::read(decoder).with_context(|| format!("cannot read {}", decoder.display()))?;
    let bar = clip_bar("fitting principal components");
    let floors = study::floors(
        &mut methods.contestants[own],
        &onnx,
        subject.data_set,
        subject.body,
        |done, all| {
            bar.set_length(all as u64);
            bar.set_position(done as u64);
        },
    )?;
    bar.finish_and_clear();
    let label = &methods.contestants[own].label;
    let Some(floors) = floors else {
        report.paragraph(&format!(
            "The decoder of {label} is not linear: its best latents for every frame would have to be \
             searched for."
        ));
        return Ok(());
    };
    report.paragraph(&format!(
        "The least mean error over the soft vertices in millimetres (error over static) that any \
         predictor could reach: every {FLOOR_STRIDE}th frame with its best latents. The decoder of \
         {label}, beside principal components of the whole body, about zero, fitted to frames drawn \
         from the training clips and their mirror images: in as many bytes as the decoder's file \
         (rounded up), and in twice and four times as many. Components are counted in half precision and \
         without the bytes of a graph, in their favour.",
    ));
    floors_table(report, path, label, &floors)
}

fn floors_table(
    report: &mut Report,
    path: &Path,
    label: &str,
    floors: &Floors,
) -> anyhow::Result<()> {
    let mut table = Table::new(["", "numbers a frame", "kB"]);
    let sets = floors.sets.iter();
    let heads = sets.map(|set| format!("{}: {} frames", set.set.name(), set.frames));
    table.head.extend(heads);
    let mut csv = Csv::new(&[
        "set",
        "decoder",
        "latents",
        "bytes",
        "error_mm",
        "over_static",
    ]);
    let mut row = |name: &str, floor: &Floor| {
        let mut cells = vec![
            name.to_owned(),
            floor.latents.to_string(),
            format!("{:.0}", floor.bytes as f64 / 1000.0),
        ];
        for (set, error_mm) in floors.sets.iter().zip(&floor.errors_mm) {
            let ratio = error_mm / set.static_mm;
            cells.push(format!("{error_mm:.3} ({ratio:.3})"));
            let size = [floor.latents as f64, floor.bytes as f64];
            csv.row(
                &[set.set.name(), name],
                &[size[0], size[1], *error_mm, ratio],
            );
        }
        table.row(cells);
    };
    row(label, &floors.decoder);
    for components in &floors.components {
        row("principal components", components);
    }
    report.table(&table);
    if let Some(equal) = floors.components.first() {
        let pairs = floors.decoder.errors_mm.iter().zip(&equal.errors_mm);
        let below = pairs
            .filter(|(decoder, components)| decoder < components)
            .count();
        report.paragraph(&format!(
            "The decoder leaves less than {} principal components in {below} of {} sets.",
            equal.latents,
            floors.sets.len()
        ));
    }
    csv.write(path, "bytes")
}
