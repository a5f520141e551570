//! The report: what was measured, section by section.

use std::path::Path;

use dynaskin_evaluate::study::{self, Comparison, Contestant, SetComparison, group_names};
use dynaskin_report::{Report, Table};
use dynaskin_train::{Set, motion_features};

use super::bundles::Found;
use super::cost::{self, Cost};
use super::subject::{Methods, SOFT, Subject, thousands};
use super::tables::Csv;
use super::{card, dynamics, motions, pictures, places, shapes, simulated, subspaces};
use crate::commands::train::clip_bar;

/// Most frames that a method is timed on.
const TIMED_FRAMES: usize = 600;
/// Aims of our own model on simulated clips: error over static in the soft regions.
const AIMS: [(Set, f64); 4] = [
    (Set::UnseenMotion, 0.13),
    (Set::UnseenSubject, 0.16),
    (Set::UnseenShape, 0.18),
    (Set::UnseenMotionAndShape, 0.20),
];

/// Measures the methods `found` and writes the report to `path`, CSV files beside it.
pub fn write(path: &Path, subject: &Subject<'_>, mut found: Vec<Found>) -> anyhow::Result<()> {
    let wasm_ms = cost::wasm_times(subject.wasm_times)?;
    let costs = costs(subject, &mut found, &wasm_ms)?;
    let mut methods = Methods {
        contestants: vec![Contestant::still()],
        names: vec!["static".into()],
        decoders: vec![None],
    };
    for found in found {
        methods.names.push(found.name);
        let decoder = found.folder.join(&found.bundle.decoder.file);
        methods.decoders.push(Some(decoder));
        methods.contestants.push(Contestant {
            label: found.label,
            player: Some(found.player),
        });
    }
    let bar = clip_bar("playing held-out clips");
    let comparison = study::compare(
        &mut methods.contestants,
        subject.data_set,
        subject.body,
        |done, all| {
            bar.set_length(all as u64);
            bar.set_position(done as u64);
        },
    )?;
    bar.finish_and_clear();

    let mut report = Report::new(format!(
        "Soft tissue of the {} body: methods compared",
        subject.body.name
    ));
    report.paragraph(
        "Every method is played here on clips that it did not learn from, frame by frame, by the \
         runtime that ships. Errors are distances between predicted vertices and those of the clips, simulated \
         or captured, in millimetres. \"Static\" is plain skinning without soft tissue: its error is the length \
         of the clips' offsets. Tissue is the usual one unless a section says otherwise. The numbers \
         of every table and plot stand in the CSV files beside this page.",
    );
    let mut clips = subject.data_set.clips.iter();
    report.paragraph(match clips.all(|clip| clip.usual_tissue) {
        true => {
            "All methods learned from one data set without what is held out here. The section on cost counts the \
             clips and frames of each."
        }
        false => {
            "All methods learned from one data set without what is held out here, but not from the same \
             clips of it. Those that are told what tissue is made of (dynaskin) learned from clips with \
             varied tissue too, and so also from more bodies and frames; the others could not tell such \
             tissue from the usual one, and learned from the clips of the usual tissue only. The section \
             on cost counts the clips and frames of each."
        }
    });
    summary_section(&mut report, subject, &methods, &comparison);
    cost_section(&mut report, path, &methods, &costs)?;
    split_sections(&mut report, path, &methods, &comparison)?;
    motions::motions_section(&mut report, path, subject, &methods, &comparison)?;
    shapes::shapes_section(&mut report, path, subject, &methods, &comparison)?;
    pictures::picture_section(&mut report, subject, &mut methods, &comparison)?;
    dynamics::curve_section(&mut report, path, subject, &mut methods, &comparison)?;
    dynamics::spectrum_section(&mut report, path, &methods, &comparison)?;
    dynamics::drift_section(&mut report, path, subject, &mut methods, &comparison)?;
    dynamics::rest_section(&mut report, path, subject, &mut methods, &comparison)?;
    places::places_section(&mut report, path, subject, &mut methods)?;
    if let Some(csv) = subject.subspaces {
        subspaces::subspaces_section(&mut report, &subspaces::read_subspaces(csv)?)?;
    }
    subspaces::bytes_section(&mut report, path, subject, &mut methods)?;
    if subject.simulate {
        simulated::bodies_section(&mut report, path, subject, &mut methods)?;
        simulated::materials_section(&mut report, path, subject, &mut methods)?;
    }
    report.write(path)?;
    if let Some(folder) = subject.card {
        card::write(folder, &methods, &comparison, &costs)?;
    }
    Ok(())
}

fn costs(
    subject: &Subject<'_>,
    found: &mut [Found],
    wasm_ms: &std::collections::HashMap<String, f64>,
) -> anyhow::Result<Vec<Cost>> {
    let Some(entry) = subject.data_set.clips.iter().max_by_key(|clip| clip.frames) else {
        return Ok(Vec::new());
    };
    let mut clip = subject.data_set.read(entry)?;
    clip.poses.truncate(TIMED_FRAMES);
    let mut costs = Vec::new();
    for found in found {
        let features = motion_features(found.player.feature_kind(), subject.body, &clip)?;
        costs.push(cost::of(found, &features, wasm_ms)?);
    }
    Ok(costs)
}

fn summary_section(
    report: &mut Report,
    subject: &Subject<'_>,
    methods: &Methods,
    comparison: &Comparison,
) {
    report.section("Summary");
    report.paragraph(
        "Mean error over the soft vertices in millimetres, with its standard deviation over frames; \
         in brackets the error over that of static.",
    );
    let mut table = Table::new(["method"]);
    let sizes = comparison.sets.iter().map(|set| {
        format!(
            "{}: {} clips, {} frames",
            set.set.name(),
            set.clips,
            set.frames
        )
    });
    table.head.extend(sizes);
    for (method, label) in methods.labels().enumerate() {
        let cells = comparison.sets.iter().map(|set| cell(set, method, SOFT));
        table.row(std::iter::once(label.to_owned()).chain(cells).collect());
    }
    report.table(&table);
    report.paragraph(
        "Unseen motion: other trials, on body shapes that were learned from. Unseen subject: captures \
         of people that were held out whole. Unseen motion and shape: both held out.",
    );
    let own = methods.contestants.len() - 1;
    let verdicts: Vec<String> = comparison
        .sets
        .iter()
        .filter_map(|set| {
            let ratio = set.ratio(own, SOFT);
            let name = set.set.name();
            if !subject.data_set.is_simulated() {
                return Some(format!("{name} {ratio:.3}"));
            }
            let (_, aim) = AIMS.iter().find(|(of, _)| *of == set.set)?;
            let verdict = if ratio <= *aim { "reached" } else { "missed" };
            Some(format!("{name} {ratio:.3} (aim {aim:.2}, {verdict})"))
        })
        .collect();
    report.paragraph(&format!(
        "Error over static of {}, the last row: {}.",
        methods.contestants[own].label,
        verdicts.join("; ")
    ));
}

/// `1.23 ± 0.45`, and `(0.21)` below; how many frames a method failed at where it did.
fn cell(set: &SetComparison, method: usize, group: usize) -> String {
    let spread = set.errors[method][group];
    if spread.failed > 0 {
        return format!("∞\n(no numbers in {} frames)", spread.failed);
    }
    let mean = format!("{:.2} ± {:.2}", spread.mean_mm, spread.deviation_mm);
    match method {
        0 => mean,
        _ => format!("{mean}\n({:.2})", set.ratio(method, group)),
    }
}

fn cost_section(
    report: &mut Report,
    path: &Path,
    methods: &Methods,
    costs: &[Cost],
) -> anyhow::Result<()> {
    report.section("Cost");
    report.paragraph(
        "Clips and frames that a method learned from, without mirror images; weights of predictor and \
         decoder; kilobytes (1000 bytes) of both files, and of both compressed with brotli, which is \
         what a browser loads; milliseconds for one avatar and frame, medians on the machine that \
         wrote this report, which may have had other things to do. Computing the features takes less \
         than 0.01 ms more.",
    );
    let mut table = Table::new([
        "method",
        "clips learned from",
        "frames learned from",
        "parameters",
        "files (kB)",
        "over the wire (kB)",
        "native: predictor (ms)",
        "native: decoder (ms)",
        "wasm: both (ms)",
    ]);
    let mut csv = Csv::new(&[
        "method",
        "clips",
        "frames",
        "parameters",
        "bytes",
        "wire_bytes",
        "native_predictor_ms",
        "native_decoder_ms",
        "wasm_ms",
    ]);
    for ((label, name), cost) in methods.labels().zip(&methods.names).skip(1).zip(costs) {
        let counted = |count: Option<u64>| count.map_or("unknown".to_owned(), thousands);
        let wasm = cost
            .wasm_ms
            .map_or("not measured".to_owned(), |ms| format!("{ms:.3}"));
        table.row(vec![
            label.to_owned(),
            counted(cost.clips),
            counted(cost.frames),
            counted(cost.parameters),
            format!("{:.0}", cost.bytes as f64 / 1000.0),
            format!("{:.0}", cost.wire_bytes as f64 / 1000.0),
            format!("{:.3}", cost.native_ms[0]),
            format!("{:.3}", cost.native_ms[1]),
            wasm,
        ]);
        let number = |count: Option<u64>| count.map_or(f64::NAN, |count| count as f64);
        csv.row(
            &[name],
            &[
                number(cost.clips),
                number(cost.frames),
                number(cost.parameters),
                cost.bytes as f64,
                cost.wire_bytes as f64,
                cost.native_ms[0],
                cost.native_ms[1],
                cost.wasm_ms.unwrap_or(f64::NAN),
            ],
        );
    }
    report.table(&table);
    csv.write(path, "cost")
}

fn split_sections(
    report: &mut Report,
    path: &Path,
    methods: &Methods,
    comparison: &Comparison,
) -> anyhow::Result<()> {
    let groups = group_names();
    let mut csv = Csv::new(&[
        "set",
        "method",
        "group",
        "mean_mm",
        "sd_mm",
        "quartile1_mm",
        "median_mm",
        "quartile3_mm",
        "over_static",
        "failed_frames",
    ]);
    for set in &comparison.sets {
        report.section(&format!("Errors by region: {}", set.set.name()));
        report.paragraph(&format!(
            "{} clips, {} frames. Mean error in millimetres ± standard deviation over frames (error \
             over static). The whole body has all its vertices, those without soft tissue with an \
             error of 0. A frame in which a method gives no numbers counts as infinitely wrong.",
            set.clips, set.frames
        ));
        let mut table = Table::new(["method"]);
        table.head.extend(groups.iter().map(ToString::to_string));
        for (method, (label, name)) in methods.labels().zip(&methods.names).enumerate() {
            let cells = (0..groups.len()).map(|group| cell(set, method, group));
            table.row(std::iter::once(label.to_owned()).chain(cells).collect());
            for (group, group_name) in groups.iter().enumerate() {
                let spread = set.errors[method][group];
                let [first, median, third] = spread.quartiles_mm;
                let ratio = set.ratio(method, group);
                csv.row(
                    &[set.set.name(), name, group_name],
                    &[
                        spread.mean_mm,
                        spread.deviation_mm,
                        first,
                        median,
                        third,
                        ratio,
                        spread.failed as f64,
                    ],
                );
            }
        }
        report.table(&table);
    }
    csv.write(path, "errors")?;
    let mut csv = Csv::new(&["clip", "set", "method", "frames", "soft_mm", "over_static"]);
    for clip in &comparison.clips {
        for (name, soft_mm) in methods.names.iter().zip(&clip.soft_mm) {
            let ratio = soft_mm / clip.soft_mm[0];
            csv.row(
                &[&clip.name, clip.set.name(), name],
                &[clip.frames as f64, *soft_mm, ratio],
            );
        }
    }
    csv.write(path, "clips")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_method_that_failed_says_in_how_many_frames() {
        let spread = |mean_mm: f64, failed: usize| study::Spread {
            mean_mm,
            failed,
            ..study::Spread::default()
        };
        let set = SetComparison {
            set: Set::UnseenMotion,
            clips: 1,
            frames: 9,
            errors: [(2.0, 0), (0.5, 0), (f64::INFINITY, 3)]
                .map(|(mean_mm, failed)| vec![spread(mean_mm, failed)])
                .to_vec(),
        };
        assert_eq!(cell(&set, 0, 0), "2.00 ± 0.00");
        assert_eq!(cell(&set, 1, 0), "0.50 ± 0.00\n(0.25)");
        assert_eq!(cell(&set, 2, 0), "∞\n(no numbers in 3 frames)");
    }

    #[test]
    fn thousands_are_set_apart() {
        assert_eq!(thousands(18), "18");
        assert_eq!(thousands(284_678_770), "284,678,770");
    }
}
