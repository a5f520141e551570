//! The section about walking away and turning, which soft tissue does not feel.

use std::path::Path;

use dynaskin_evaluate::{Placement, PlacementErrors, evaluate_placements};
use dynaskin_report::{Curve, Plot, Report, Table};
use dynaskin_train::{Set, Tissue};

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
    let (mut shifted, mut turned) = (Vec::new(), Vec::new());
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
        let curve = |points| Curve {
            name: contestant.label.clone(),
            points,
        };
        shifted.push(curve(by_shift(&errors)));
        turned.push(curve(by_turn(&errors)));
    }
    report.table(&table);
    let plots = [
        ("Error after walking away", "moved by (m)", shifted),
        ("Error after turning", "turned by (degrees)", turned),
    ];
    for (title, x_label, curves) in plots {
        report.plot(&Plot {
            title: title.into(),
            x_label: x_label.into(),
            y_label: "error / static".into(),
            curves,
        })?;
    }
    csv.write(path, "places")
}

/// Error over static by distance, of what is not turned.
fn by_shift(errors: &[PlacementErrors]) -> Vec<(f64, f64)> {
    let straight = errors.iter().filter(|e| e.placement.turn_rad == 0.0);
    straight.map(|e| (e.placement.shift_m, e.ratio)).collect()
}

/// Error over static by angle in degrees, of what is not moved.
fn by_turn(errors: &[PlacementErrors]) -> Vec<(f64, f64)> {
    let on_the_spot = errors.iter().filter(|e| e.placement.shift_m == 0.0);
    on_the_spot
        .map(|e| (e.placement.turn_rad.to_degrees(), e.ratio))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shifts_and_turns_are_told_apart() {
        let mut number = 0.0;
        let errors = Placement::ALL.map(|placement| {
            number += 1.0;
            PlacementErrors {
                placement,
                error_mm: 0.0,
                static_mm: 0.0,
                ratio: number,
            }
        });
        assert_eq!(by_shift(&errors), [(0.0, 1.0), (3.0, 2.0), (10.0, 3.0)]);
        assert_eq!(by_turn(&errors), [(0.0, 1.0), (90.0, 4.0), (180.0, 5.0)]);
    }
}
