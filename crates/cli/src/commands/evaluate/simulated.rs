//! Sections with pictures, and those that simulate anew: other bodies, other materials.

use std::path::Path;

use dynaskin_body::Region;
use dynaskin_report::{Report, Table};
use dynaskin_sim::Amplitude;
use dynaskin_train::study::{self, Comparison, Snapshot};

use super::page::{Methods, Subject};
use super::pictures::{heat, lengths_mm};
use super::tables::Csv;

/// Frames of the hops that bodies are compared in.
const HOP_TICKS: usize = 240;
/// How far a predicted resonance may lie from the simulated one.
const RESONANCE_AIM: f64 = 0.15;

/// A frame of a held-out clip as colour maps: truth, predictions, errors.
pub fn picture_section(
    report: &mut Report,
    subject: &Subject<'_>,
    methods: &mut Methods,
    comparison: &Comparison,
) -> anyhow::Result<()> {
    let Some(clip) = comparison.wildest() else {
        return Ok(());
    };
    let (frame, size_mm) = clip.wildest;
    let snapshot = study::snapshot(
        &mut methods.contestants,
        subject.data_set,
        subject.body,
        &subject.data_set.clips[clip.index],
        frame,
    )?;
    report.section("A frame as a picture");
    let truth_mm = lengths_mm(&snapshot.truth_m, None);
    let most_mm = round_up(percentile(&truth_mm, 0.99));
    report.paragraph(&format!(
        "Frame {frame} of {} ({}), the held-out frame with the largest offsets, {size_mm:.1} mm on \
         average over the soft vertices. First how far the skin is from plain skinning, simulated and \
         predicted; then how far each prediction is from the simulation. All on the same scale; grey \
         skin has no soft tissue.",
        snapshot.name,
        clip.set.name()
    ));
    report.heat_scale("0 mm", &format!("{most_mm:.0} mm and more"));
    let vertices = &subject.data_set.vertices;
    let mut offsets = vec![(
        "simulated".to_owned(),
        heat(
            subject.body,
            vertices,
            &snapshot,
            &snapshot.truth_m,
            &truth_mm,
            most_mm,
        ),
    )];
    let mut errors = Vec::new();
    for (label, predicted) in methods.labels().zip(&snapshot.predicted_m) {
        let sizes_mm = lengths_mm(predicted, None);
        let errors_mm = lengths_mm(predicted, Some(&snapshot.truth_m));
        let mean_mm = errors_mm.iter().sum::<f64>() / errors_mm.len().max(1) as f64;
        let picture = |values: &[f64]| {
            heat(
                subject.body,
                vertices,
                &snapshot,
                predicted,
                values,
                most_mm,
            )
        };
        offsets.push((label.to_owned(), picture(&sizes_mm)));
        let caption = format!("{label}: error, mean {mean_mm:.1} mm");
        errors.push((caption, picture(&errors_mm)));
    }
    report.pictures(&offsets)?;
    report.paragraph("Errors:");
    report.pictures(&errors)?;
    Ok(())
}

/// The value below which a share of the values lies.
fn percentile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().saturating_sub(1) as f64;
    sorted.get((share * last) as usize).copied().unwrap_or(0.0)
}

/// To the next multiple of 5 above 0.
fn round_up(mm: f64) -> f64 {
    5.0 * (mm / 5.0).ceil().max(1.0)
}

/// The same motion on different bodies.
pub fn bodies_section(
    report: &mut Report,
    path: &Path,
    subject: &Subject<'_>,
    methods: &mut Methods,
) -> anyhow::Result<()> {
    report.section("Different bodies, same motion");
    report.paragraph(
        "Hops on one leg on the three held-out body shapes, simulated for this report. Movement of \
         each region against the bones, peak to peak, sum of the three axes, in millimetres: mean over \
         the hops; the chest at its foremost vertex of each side, other regions at the 90th percentile \
         of their vertices. Shape matters: what does not know it moves every body alike.",
    );
    let settings = study::simulator_settings(subject.data_set, subject.body);
    let bodies =
        study::amplitudes_of_bodies(&mut methods.contestants, subject.body, &settings, HOP_TICKS)?;
    let mut csv = Csv::new(&["body", "method", "region", "vertical_mm", "total_mm"]);
    for body in &bodies {
        let mut table = Table::default();
        table.head.push(format!("{} body", body.name));
        table
            .head
            .extend(Region::ALL.map(|region| region.name().to_owned()));
        let mut row = |label: &str, name: &str, amplitudes: &[Amplitude]| {
            let total_mm = |a: &Amplitude| 1000.0 * a.total_m();
            let cells = amplitudes.iter().map(|a| format!("{:.0}", total_mm(a)));
            table.row(std::iter::once(label.to_owned()).chain(cells).collect());
            for amplitude in amplitudes {
                let vertical_mm = 1000.0 * amplitude.peak_to_peak_m[1];
                csv.row(
                    &[body.name, name, amplitude.region.name()],
                    &[vertical_mm, total_mm(amplitude)],
                );
            }
        };
        row("simulated", "simulated", &body.simulated);
        let named = methods.labels().zip(&methods.names).zip(&body.predicted);
        for ((label, name), predicted) in named.skip(1) {
            row(label, name, predicted);
        }
        report.table(&table);
    }
    let snapshots = || bodies.iter().map(|body| &body.snapshot);
    let truths: Vec<f64> = snapshots()
        .flat_map(|snapshot| lengths_mm(&snapshot.truth_m, None))
        .collect();
    let most_mm = round_up(percentile(&truths, 0.99));
    report.paragraph(
        "Below, each body at the moment of its largest offsets, coloured by their length: simulated, \
         and predicted by the last method of the tables.",
    );
    report.heat_scale("0 mm", &format!("{most_mm:.0} mm and more"));
    let draw = |snapshot: &Snapshot, offsets_m: &[f32]| {
        let values = lengths_mm(offsets_m, None);
        heat(
            subject.body,
            &subject.data_set.vertices,
            snapshot,
            offsets_m,
            &values,
            most_mm,
        )
    };
    let mut pictures = Vec::new();
    let last = methods.labels().last().unwrap_or_default();
    for body in &bodies {
        let snapshot = &body.snapshot;
        pictures.push((
            format!("{}: simulated", body.name),
            draw(snapshot, &snapshot.truth_m),
        ));
        if let Some(predicted_m) = snapshot.predicted_m.last() {
            pictures.push((
                format!("{}: {last}", body.name),
                draw(snapshot, predicted_m),
            ));
        }
    }
    report.pictures(&pictures)?;
    csv.write(path, "bodies")
}

/// Whether networks obey their material inputs.
pub fn materials_section(
    report: &mut Report,
    path: &Path,
    subject: &Subject<'_>,
    methods: &mut Methods,
) -> anyhow::Result<()> {
    report.section("Materials");
    let knows = |c: &study::Contestant| c.feature_kind().is_some_and(|kind| kind.has_materials());
    let knowing: Vec<usize> = (0..methods.contestants.len())
        .filter(|method| knows(&methods.contestants[*method]))
        .collect();
    if knowing.is_empty() {
        report.paragraph("None of these methods has inputs for what tissue is made of.");
        return Ok(());
    }
    report.paragraph(&format!(
        "The mean body is jerked upwards at rest, 0.2 m/s within one tick, and a damped sine is fitted \
         to the vertical ringing of a region, by the same estimator in the simulator and in the \
         networks. The stiffness of that region is multiplied. Resonance in hertz; rows beyond {:.0} % \
         stand out.",
        100.0 * RESONANCE_AIM
    ));
    let settings = study::simulator_settings(subject.data_set, subject.body);
    let tests = study::resonance_tests();
    let resonances = study::resonances(&mut methods.contestants, subject.body, &settings, &tests)?;
    let mut table = Table::new([
        "method",
        "region",
        "stiffness",
        "simulated",
        "predicted",
        "difference",
        "damping, simulated",
        "damping, predicted",
    ]);
    let mut csv = Csv::new(&[
        "method",
        "region",
        "stiffness",
        "simulated_hz",
        "predicted_hz",
        "simulated_damping",
        "predicted_damping",
    ]);
    let labels: Vec<&str> = methods.labels().collect();
    for method in knowing {
        for resonance in &resonances {
            let Some(predicted) = resonance.predicted[method] else {
                continue;
            };
            let simulated = resonance.simulated;
            let difference = predicted.frequency_hz / simulated.frequency_hz - 1.0;
            let region = resonance.test.region.name();
            let cells = vec![
                labels[method].to_owned(),
                region.to_owned(),
                format!("{:.1}", resonance.test.stiffness),
                format!("{:.2}", simulated.frequency_hz),
                format!("{:.2}", predicted.frequency_hz),
                format!("{:+.0} %", 100.0 * difference),
                format!("{:.2}", simulated.damping_ratio),
                format!("{:.2}", predicted.damping_ratio),
            ];
            match difference.abs() <= RESONANCE_AIM {
                true => table.row(cells),
                false => table.marked_row(cells),
            }
            csv.row(
                &[&methods.names[method], region],
                &[
                    f64::from(resonance.test.stiffness),
                    simulated.frequency_hz,
                    predicted.frequency_hz,
                    simulated.damping_ratio,
                    predicted.damping_ratio,
                ],
            );
        }
    }
    report.table(&table);
    csv.write(path, "materials")
}
