//! Sections about time: curves, spectra, delays, drift, rest.

use std::path::Path;

use dynaskin_evaluate::study::{self, BANDS_HZ, ClipErrors, Comparison, Spectrum, signal_names};
use dynaskin_report::{Curve, Plot, Report, Table};

use super::motions::alike;
use super::subject::{Methods, Subject};
use super::tables::Csv;
use crate::commands::leave_one_out::{JUMPING_JACKS, ONE_LEG_HOPS, RUNS_IN_PLACE};
use crate::commands::train::clip_bar;

/// Kinds of motion that are shown by themselves, as trials.
const SHOWN: [(&str, &[&str]); 3] = [
    ("hops on one leg", &ONE_LEG_HOPS),
    ("jumping jacks", &JUMPING_JACKS),
    ("running in place", &RUNS_IN_PLACE),
];
/// Signals whose spectra are plotted.
const PLOTTED: [&str; 3] = ["left chest", "belly", "left thighs"];
/// Highest frequency plotted, in hertz.
const PLOTTED_HZ: f64 = 16.0;
/// Seconds of the rest curves.
const REST_SECONDS: f64 = 3.0;

/// Motions held out, by themselves, with curves of one clip each.
pub fn curve_section(
    report: &mut Report,
    path: &Path,
    subject: &Subject<'_>,
    methods: &mut Methods,
    comparison: &Comparison,
) -> anyhow::Result<()> {
    report.section("Three motions left out, frame by frame");
    report.paragraph(&format!(
        "The motions of figures 7 and 8 of Casas & Otaduy (2018), who leave them out one by one (section 4.2): hops on \
         one leg, jumping jacks, running in place. Here they are left out together, at all tempos and on all shapes.{} \
         Mean error over the soft vertices in millimetres (error over static), over all clips of the kind; below, one \
         clip of each kind frame by frame.",
        alike(subject)
    ));
    let mut table = Table::new(["motion", "clips"]);
    table.head.extend(methods.labels().map(str::to_owned));
    let mut shown = Vec::new();
    for (kind, trials) in SHOWN {
        let of_trials = trials.iter();
        let clips: Vec<&ClipErrors> = of_trials
            .flat_map(|trial| comparison.clips_of(subject.data_set, trial))
            .collect();
        let frames: usize = clips.iter().map(|clip| clip.frames).sum();
        let mean = |method: usize| {
            let sum: f64 = clips
                .iter()
                .map(|c| c.frames as f64 * c.soft_mm[method])
                .sum();
            sum / frames.max(1) as f64
        };
        let Some(wildest) = clips
            .iter()
            .max_by(|a, b| a.wildest.1.total_cmp(&b.wildest.1))
        else {
            continue;
        };
        let cells = (0..methods.names.len()).map(|method| match method {
            0 => format!("{:.2}", mean(0)),
            _ => format!("{:.2} ({:.2})", mean(method), mean(method) / mean(0)),
        });
        let head = [kind.to_owned(), clips.len().to_string()];
        table.row(head.into_iter().chain(cells).collect());
        shown.push((kind, wildest.index));
    }
    if shown.is_empty() {
        report.paragraph("The data set holds out none of them.");
        return Ok(());
    }
    report.table(&table);
    let mut csv = Csv::new(&["clip", "method", "seconds", "soft_mm"]);
    for (kind, index) in shown {
        let entry = &subject.data_set.clips[index];
        let curves = study::curves(
            &mut methods.contestants,
            subject.data_set,
            subject.body,
            entry,
            || (),
        )?;
        let soft_mm = curves.soft_mm();
        for (name, curve) in methods.names.iter().zip(&soft_mm) {
            for (frame, mm) in curve.iter().enumerate() {
                csv.row(&[&curves.name, name], &[frame as f64 / 60.0, *mm]);
            }
        }
        report.plot(&Plot {
            title: format!("Error in {kind}: {}", curves.name),
            x_label: "time (s)".into(),
            y_label: "mean error over soft vertices (mm)".into(),
            curves: lines(methods, soft_mm),
        })?;
    }
    csv.write(path, "curves")
}

/// One line a method over 60 Hz ticks.
fn lines(methods: &Methods, values: Vec<Vec<f64>>) -> Vec<Curve> {
    let line = |(label, values): (&str, Vec<f64>)| Curve {
        name: label.to_owned(),
        points: values
            .into_iter()
            .enumerate()
            .map(|(tick, value)| (tick as f64 / 60.0, value))
            .collect(),
    };
    methods.labels().zip(values).map(line).collect()
}

/// Error spectra and delays.
pub fn spectrum_section(
    report: &mut Report,
    path: &Path,
    methods: &Methods,
    comparison: &Comparison,
) -> anyhow::Result<()> {
    let signals = signal_names();
    report.section("Errors by frequency");
    report.paragraph(
        "The mean offset of each region (left and right apart) over the three sets with unseen \
         motions. Root mean square of its error in a frequency band, in millimetres, averaged over \
         the regions (error over static); the row of static is the movement itself. The plots show \
         power densities on a logarithmic scale: 20 dB are a factor of ten in millimetres.",
    );
    let mut table = Table::new(["method"]);
    let bands = BANDS_HZ.map(|(low, high)| match (low > 0.0, high < 30.0) {
        (false, _) => format!("below {high:.0} Hz"),
        (true, true) => format!("{low:.0}-{high:.0} Hz"),
        (true, false) => format!("above {low:.0} Hz"),
    });
    table.head.extend(bands.iter().cloned());
    let mut csv = Csv::new(&["method", "signal", "hz", "error_mm2_per_hz"]);
    let mut bands_csv = Csv::new(&["method", "band", "error_mm", "over_static"]);
    let mean_mm = |method: usize, band| {
        let spectra = &comparison.error_spectra[method];
        let sum: f64 = spectra.iter().map(|spectrum| spectrum.band_mm(band)).sum();
        sum / spectra.len() as f64
    };
    for (method, (label, name)) in methods.labels().zip(&methods.names).enumerate() {
        let mut cells = vec![label.to_owned()];
        for (band, hertz) in bands.iter().zip(BANDS_HZ) {
            let error_mm = mean_mm(method, hertz);
            let ratio = error_mm / mean_mm(0, hertz);
            bands_csv.row(&[name, band], &[error_mm, ratio]);
            cells.push(match method {
                0 => format!("{error_mm:.3}"),
                _ => format!("{error_mm:.3} ({ratio:.2})"),
            });
        }
        table.row(cells);
        for (signal, spectrum) in signals.iter().zip(&comparison.error_spectra[method]) {
            for (hz, power) in spectrum.lines() {
                csv.row(&[name, signal], &[hz, power]);
            }
        }
    }
    csv.write(path, "spectra")?;
    bands_csv.write(path, "bands")?;
    if comparison.error_spectra[0].iter().all(Spectrum::is_empty) {
        report.paragraph("The clips are too short for a spectrum.");
        return lag_tables(report, path, methods, comparison, &signals);
    }
    report.table(&table);
    for (signal, name) in signals.iter().enumerate() {
        if !PLOTTED.contains(&name.as_str()) {
            continue;
        }
        let curves = methods.labels().enumerate().map(|(method, label)| Curve {
            name: match method {
                0 => "movement".to_owned(),
                _ => label.to_owned(),
            },
            points: comparison.error_spectra[method][signal]
                .lines()
                .filter(|(hz, power)| *hz > 0.0 && *hz <= PLOTTED_HZ && *power > 0.0)
                .map(|(hz, power)| (hz, 10.0 * power.log10()))
                .collect(),
        });
        report.plot(&Plot {
            title: format!("Spectrum of {name}: movement, and error of each method"),
            x_label: "frequency (Hz)".into(),
            y_label: "power (dB, 0 dB = 1 mm²/Hz)".into(),
            curves: curves.filter(|curve| !curve.points.is_empty()).collect(),
        })?;
    }
    lag_tables(report, path, methods, comparison, &signals)
}

fn lag_tables(
    report: &mut Report,
    path: &Path,
    methods: &Methods,
    comparison: &Comparison,
    signals: &[String],
) -> anyhow::Result<()> {
    report.section("Delay");
    report.paragraph(
        "How late predictions come, in milliseconds: the shift of the largest correlation with the \
         truth (in brackets the correlation without a shift). Below 0 they come early. A dash: no \
         largest correlation within 0.2 s.",
    );
    let mut table = Table::new(["method"]);
    table.head.extend(signals.iter().cloned());
    let mut csv = Csv::new(&["method", "signal", "late_ms", "correlation"]);
    let named = methods.labels().zip(&methods.names).enumerate().skip(1);
    for (method, (label, name)) in named {
        let mut cells = vec![label.to_owned()];
        for (signal, lag) in signals.iter().zip(&comparison.lags[method]) {
            let late = lag.milliseconds();
            csv.row(
                &[name, signal],
                &[late.unwrap_or(f64::NAN), lag.correlation()],
            );
            let shown = late.map_or("-".to_owned(), |ms| {
                // Rounded first, so that there is no minus nought.
                format!("{}", ms.round() as i64)
            });
            cells.push(format!("{shown} ({:.2})", lag.correlation()));
        }
        table.row(cells);
    }
    report.table(&table);
    csv.write(path, "delays")
}

/// Minutes of motion without a break.
pub fn drift_section(
    report: &mut Report,
    path: &Path,
    subject: &Subject<'_>,
    methods: &mut Methods,
    comparison: &Comparison,
) -> anyhow::Result<()> {
    report.section(&format!("{} minutes without a break", subject.minutes));
    // A motion on the spot, where there is one: its end is near its start.
    let mut jacks = JUMPING_JACKS.iter();
    let on_the_spot = jacks.find_map(|trial| comparison.clips_of(subject.data_set, trial).next());
    let longest = || comparison.clips.iter().max_by_key(|clip| clip.frames);
    let Some(clip) = on_the_spot
        .or_else(longest)
        .filter(|clip| clip.frames > 120)
    else {
        report.paragraph("No held-out clip is longer than two seconds.");
        return Ok(());
    };
    report.paragraph(&format!(
        "The held-out clip {}, again and again with a smooth way from its end to its start: mean \
         length of the predicted offsets and mean error over the soft vertices in millimetres, in the \
         first and in the last minute. Each of them holds the same whole passes of the clip; the first \
         second of each pass does not count.",
        clip.name
    ));
    let bar = clip_bar("minutes of motion");
    let drifts = study::drift(
        &mut methods.contestants,
        subject.data_set,
        subject.body,
        &subject.data_set.clips[clip.index],
        subject.minutes,
        |done, all| {
            bar.set_length(all as u64);
            bar.set_position(done as u64);
        },
    )?;
    bar.finish_and_clear();
    let mut table = Table::new([
        "method",
        "offset, first minute",
        "offset, last minute",
        "error, first minute",
        "error, last minute",
    ]);
    let mut csv = Csv::new(&[
        "method",
        "first_offset_mm",
        "last_offset_mm",
        "first_error_mm",
        "last_error_mm",
    ]);
    for ((label, name), drift) in methods.labels().zip(&methods.names).zip(&drifts) {
        let numbers = [
            drift.offset_mm[0],
            drift.offset_mm[1],
            drift.error_mm[0],
            drift.error_mm[1],
        ];
        csv.row(&[name], &numbers);
        let cells = numbers.map(|x| format!("{x:.3}"));
        table.row(std::iter::once(label.to_owned()).chain(cells).collect());
    }
    report.table(&table);
    csv.write(path, "drift")
}

/// What happens once the body stands still.
pub fn rest_section(
    report: &mut Report,
    path: &Path,
    subject: &Subject<'_>,
    methods: &mut Methods,
    comparison: &Comparison,
) -> anyhow::Result<()> {
    report.section("Coming to rest");
    let Some(clip) = comparison.wildest() else {
        return Ok(());
    };
    report.paragraph(&format!(
        "After {}, the held-out clip with the largest offsets, the body moves into the rest pose \
         within 0.75 s and stands there. Mean length of the soft vertices' offsets, which should go to \
         0. Settled: from when on it stays below 0.1 mm.",
        clip.name
    ));
    let settlings = study::settling(
        &mut methods.contestants,
        subject.data_set,
        subject.body,
        &subject.data_set.clips[clip.index],
    )?;
    let mut table = Table::new([
        "method",
        "settled after (s)",
        "offset in the tenth second (mm)",
    ]);
    let mut csv = Csv::new(&["method", "seconds", "offset_mm"]);
    let named = methods.labels().zip(&methods.names).zip(&settlings);
    for ((label, name), settling) in named.skip(1) {
        let seconds = settling.seconds.map(|s| format!("{s:.2}"));
        table.row(vec![
            label.to_owned(),
            seconds.unwrap_or_else(|| "not within 10".into()),
            format!("{:.4}", settling.end_mm()),
        ]);
        for (tick, mm) in settling.offset_mm.iter().enumerate() {
            csv.row(&[name], &[tick as f64 / 60.0, *mm]);
        }
    }
    report.table(&table);
    let ticks = (60.0 * REST_SECONDS) as usize;
    let values = settlings
        .into_iter()
        .map(|s| s.offset_mm.into_iter().take(ticks).collect());
    let mut curves = lines(methods, values.collect());
    curves.remove(0); // Static: 0 throughout.
    report.plot(&Plot {
        title: "Mean offset after the rest pose is reached".into(),
        x_label: "time (s)".into(),
        y_label: "mean offset (mm)".into(),
        curves,
    })?;
    csv.write(path, "rest")
}
