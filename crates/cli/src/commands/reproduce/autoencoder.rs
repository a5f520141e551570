//! Figure 5 of Casas & Otaduy: what autoencoder and principal components leave of a sequence.

use std::collections::BTreeMap;
use std::path::Path;

use dynaskin_report::{Report, Table};

use super::differences;
use crate::commands::evaluate::subspaces::{read_subspaces, subspaces_section};
use crate::commands::train::SubspaceRow;

/// Latents that the paper compares.
const LATENTS: [usize; 2] = [50, 100];

/// The page, from the file `csv`.
pub fn page(csv: &Path) -> anyhow::Result<Report> {
    let mut report =
        Report::new("Figure 5 of Casas & Otaduy (2018): autoencoder and principal components");
    let sizes = read_subspaces(csv)?;
    subspaces_section(&mut report, &sizes)?;
    report.section("Beside the paper");
    report.paragraph(
        "The paper gives curves without numbers, and two statements about them. The ratio is the mean error of \
         the first over that of the second.",
    );
    let mut table = Table::new(["", "in the paper", "ratio here", "holds here"]);
    for latents in LATENTS {
        let what = format!("autoencoder below principal components, {latents} numbers each");
        let ratio = ratio(&sizes, latents, latents);
        let holds = ratio.map(|ratio| ratio < 1.0);
        table.row(row(what, "below 1", ratio, holds));
    }
    let ratio = ratio(&sizes, LATENTS[0], LATENTS[1]);
    let what = "autoencoder of 50 numbers about as good as 100 principal components".to_owned();
    let holds = ratio.map(|ratio| ratio < 1.1);
    table.row(row(what, "about 1", ratio, holds));
    report.table(&table);
    differences(
        &mut report,
        &[
            [
                "sequence",
                "50002_running_on_spot, a 4D capture",
                "the clip named above",
            ],
            [
                "fitted to",
                "some 1,800 frames of one person in five motions",
                "frames of all training clips of many shapes, which leave more for principal components",
            ],
            [
                "autoencoder",
                "6000, 3000, 100 wide, three layers each way",
                "the same layers, as narrow as the run was told; 50 and 100 numbers",
            ],
        ],
    );
    Ok(report)
}

/// Mean error of an autoencoder over that of principal components.
fn ratio(
    sizes: &BTreeMap<usize, Vec<SubspaceRow>>,
    autoencoder: usize,
    components: usize,
) -> Option<f64> {
    let mean = |latents: usize, value: fn(&SubspaceRow) -> f64| {
        let rows = sizes.get(&latents)?;
        Some(rows.iter().map(value).sum::<f64>() / rows.len() as f64)
    };
    Some(mean(autoencoder, |row| row.autoencoder_mm)? / mean(components, |row| row.pca_mm)?)
}

fn row(what: String, paper: &str, ratio: Option<f64>, holds: Option<bool>) -> Vec<String> {
    let told = ratio.map_or_else(
        || "not in the file".to_owned(),
        |ratio| format!("{ratio:.2}"),
    );
    let holds = holds.map_or("", |holds| if holds { "yes" } else { "no" });
    vec![what, paper.to_owned(), told, holds.to_owned()]
}
