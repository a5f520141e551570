//! Sections that simulate anew: other bodies, other materials.

use std::path::Path;

use dynaskin_body::Region;
use dynaskin_evaluate::study::{self, HIGHEST_HZ, Resonance, Shift, Snapshot};
use dynaskin_report::{Report, Table};
use dynaskin_sim::{Amplitude, Ringing};

use super::page::{Methods, Subject};
use super::pictures::{heat, lengths_mm, percentile, round_up};
use super::tables::Csv;

/// Frames of the hops that bodies are compared in.
const HOP_TICKS: usize = 240;
/// How far a predicted shift of a resonance may lie from the simulated one.
const RESONANCE_AIM: f64 = 0.15;

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
         networks, with half, the usual and twice the stiffness of that region. First what the change \
         makes of its resonance: frequency over that of the usual tissue. Rows whose predicted shift \
         is off by more than {:.0} % stand out. Where the simulation swings faster than {HIGHEST_HZ:.0} Hz, \
         60 frames a second cannot tell.",
        100.0 * RESONANCE_AIM
    ));
    let settings = study::simulator_settings(subject.data_set, subject.body);
    let tests = study::resonance_tests();
    let resonances = study::resonances(&mut methods.contestants, subject.body, &settings, &tests)?;
    shift_table(report, path, methods, &knowing, &study::shifts(&resonances))?;
    report.paragraph(
        "The frequencies themselves in hertz, the damping ratios, and in brackets the share of the \
         ringing's energy that one damped sine does not explain: where it is large, a region has no \
         single resonance.",
    );
    ringing_table(report, path, methods, &knowing, &resonances)
}

/// What other stiffness makes of resonances.
fn shift_table(
    report: &mut Report,
    path: &Path,
    methods: &Methods,
    knowing: &[usize],
    shifts: &[Shift],
) -> anyhow::Result<()> {
    let mut table = Table::new([
        "method",
        "region",
        "stiffness",
        "simulated shift",
        "predicted shift",
        "difference",
        "within 15 %",
    ]);
    let mut csv = Csv::new(&[
        "method",
        "region",
        "stiffness",
        "simulated_shift",
        "predicted_shift",
        "difference",
    ]);
    let labels: Vec<&str> = methods.labels().collect();
    for method in knowing {
        for shift in shifts {
            let (Some(predicted), Some(difference)) =
                (shift.predicted[*method], shift.difference(*method))
            else {
                continue;
            };
            let region = shift.test.region.name();
            let (fine, verdict) = match (shift.resolved, difference.abs() <= RESONANCE_AIM) {
                (false, _) => (true, "cannot be told"),
                (true, true) => (true, "yes"),
                (true, false) => (false, "no"),
            };
            let cells = vec![
                labels[*method].to_owned(),
                region.to_owned(),
                format!("{:.1}", shift.test.stiffness),
                format!("{:.3}", shift.simulated),
                format!("{predicted:.3}"),
                format!("{:+.0} %", 100.0 * difference),
                verdict.to_owned(),
            ];
            match fine {
                true => table.row(cells),
                false => table.marked_row(cells),
            }
            let stiffness = f64::from(shift.test.stiffness);
            csv.row(
                &[&methods.names[*method], region],
                &[stiffness, shift.simulated, predicted, difference],
            );
        }
    }
    report.table(&table);
    csv.write(path, "material-shifts")
}

/// Frequencies and damping.
fn ringing_table(
    report: &mut Report,
    path: &Path,
    methods: &Methods,
    knowing: &[usize],
    resonances: &[Resonance],
) -> anyhow::Result<()> {
    let mut table = Table::new([
        "method",
        "region",
        "stiffness",
        "simulated (Hz)",
        "predicted (Hz)",
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
        "simulated_unexplained",
        "predicted_unexplained",
    ]);
    let labels: Vec<&str> = methods.labels().collect();
    for method in knowing {
        for resonance in resonances {
            let Some(predicted) = resonance.predicted[*method] else {
                continue;
            };
            let simulated = resonance.simulated;
            let difference = predicted.frequency_hz / simulated.frequency_hz - 1.0;
            let region = resonance.test.region.name();
            let damping = |r: &Ringing| format!("{:.2} ({:.2})", r.damping_ratio, r.unexplained);
            table.row(vec![
                labels[*method].to_owned(),
                region.to_owned(),
                format!("{:.1}", resonance.test.stiffness),
                format!("{:.2}", simulated.frequency_hz),
                format!("{:.2}", predicted.frequency_hz),
                format!("{:+.0} %", 100.0 * difference),
                damping(&simulated),
                damping(&predicted),
            ]);
            csv.row(
                &[&methods.names[*method], region],
                &[
                    f64::from(resonance.test.stiffness),
                    simulated.frequency_hz,
                    predicted.frequency_hz,
                    simulated.damping_ratio,
                    predicted.damping_ratio,
                    simulated.unexplained,
                    predicted.unexplained,
                ],
            );
        }
    }
    report.table(&table);
    csv.write(path, "materials")
}
