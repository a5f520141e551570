//! The section about walking away and turning, which soft tissue does not feel.

use std::path::Path;

use dynaskin_report::{Curve, Plot, Report, Table};
use dynaskin_train::{Placement, PlacementErrors, Set, Tissue, evaluate_placements};

use super::page::{Methods, Subject};
use super::tables::Csv;
use crate::commands::train::clip_bar;

/// Held-out motions played at other places on the floor, and facing other ways.
pub fn places_section(
    report: &mut Report,
    path: &Path,
    subject: &Subject<'_>,
    methods: &mut Methods,
) -> anyhow::Result<()> {
    report.section("Walking away and turning");
    report.paragraph(
        "The unseen motions, moved sideways and turned about the vertical. Soft tissue feels neither. \
         DSNet and Casas & Otaduy's networks are told the root's translation and rotation as \
         they are, and meet values there that they did not learn from. Error over static, of all frames \
         together (in the summary: of each clip by itself).",
    );
    let mut table = Table::new(["method"]);
    let placements = Placement::ALL;
    table.head.extend(placements.iter().map(|p| p.label()));
    let mut csv = Csv::new(&[
        "method",
        "shift_m",
        "turn_degrees",
        "error_mm",
        "over_static",
    ]);
    let mut curves = Vec::new();
    let names = methods.names.clone();
    for (contestant, name) in methods.contestants.iter_mut().zip(&names) {
        let Some(player) = &mut contestant.player else {
            continue;
        };
        let clips: Vec<_> = subject
            .data_set
            .of_set(Set::UnseenMotion, Tissue::Usual)
            .collect();
        let bar = clip_bar("playing them elsewhere");
        let errors = evaluate_placements(
            player,
            subject.data_set,
            subject.body,
            clips.into_iter(),
            &placements,
            |done, all| {
                bar.set_length(all as u64);
                bar.set_position(done as u64);
            },
        )?;
        bar.finish_and_clear();
        let cells = errors.iter().map(|e| format!("{:.3}", e.ratio));
        let label = std::iter::once(contestant.label.clone());
        table.row(label.chain(cells).collect());
        for errors in &errors {
            let Placement { shift_m, turn_rad } = errors.placement;
            let turn_degrees = turn_rad.to_degrees();
            csv.row(
                &[name],
                &[shift_m, turn_degrees, errors.error_mm, errors.ratio],
            );
        }
        curves.push(Curve {
            name: contestant.label.clone(),
            points: by_shift(&errors),
        });
    }
    report.table(&table);
    report.plot(&Plot {
        title: "Error after walking away".into(),
        x_label: "moved by (m)".into(),
        y_label: "error / static".into(),
        curves,
    })?;
    csv.write(path, "places")
}

/// Error over static by distance, of what is not turned.
fn by_shift(errors: &[PlacementErrors]) -> Vec<(f64, f64)> {
    let straight = errors.iter().filter(|e| e.placement.turn_rad == 0.0);
    straight.map(|e| (e.placement.shift_m, e.ratio)).collect()
}
