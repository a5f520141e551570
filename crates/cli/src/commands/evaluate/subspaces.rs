//! The section about how many numbers hold an offset field: autoencoders against principal
//! components.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::{Context as _, bail};
use dynaskin_report::{Curve, Plot, Report, Table};

use crate::commands::train::SubspaceRow;

/// Curves of a clip that neither was fitted to, as `dynaskin train --compare-subspaces` left them in
/// the file `csv`.
pub fn subspaces_section(report: &mut Report, csv: &Path) -> anyhow::Result<()> {
    let text = fs::read_to_string(csv).with_context(|| format!("cannot read {}", csv.display()))?;
    let mut lines = text.lines();
    if lines.next() != Some(SubspaceRow::HEAD) {
        bail!(
            "{} does not begin with {}: have it written by `dynaskin train --compare-subspaces`",
            csv.display(),
            SubspaceRow::HEAD
        );
    }
    let mut sizes: BTreeMap<usize, Vec<SubspaceRow>> = BTreeMap::new();
    let mut clip = String::new();
    for (index, line) in lines.enumerate() {
        let row: SubspaceRow = line
            .parse()
            .with_context(|| format!("{}, line {}", csv.display(), index + 2))?;
        clip.clone_from(&row.clip);
        sizes.entry(row.latents).or_default().push(row);
    }
    report.section("Autoencoders and principal components");
    report.paragraph(&format!(
        "As in figure 5 of Casas & Otaduy (2018): mean error over all tissue vertices of the best that \
         their autoencoder and as many principal components can do on {clip}, which neither was \
         fitted to. Millimetres."
    ));
    let mut table = Table::new(["numbers a frame", "autoencoder", "principal components"]);
    let mut curves = Vec::new();
    for (latents, rows) in &sizes {
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
