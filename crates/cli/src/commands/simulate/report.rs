//! `dynaskin simulate --report`: the simulator beside measured bodies, as a page.

use std::path::Path;

use anyhow::Context as _;
use dynaskin_body::{BodyModel, Region, Sex};
use dynaskin_report::{Curve, Plot, Report, Table};
use dynaskin_sim::{
    Activity, Calibration, MEASURED, Materials, Measured, Motion, Quantity, Shell, SimSettings,
    Survey, TRAINING_SHAPES, free_vibration,
};
use rayon::prelude::*;

use crate::commands::train::clip_bar;

/// Captures that the amplitudes are also taken from, where the folder has them.
const CAPTURES: [(Activity, &str); 6] = [
    (Activity::Walking, "02_01"),
    (Activity::Walking, "07_03"),
    (Activity::Walking, "16_21"),
    (Activity::Running, "09_01"),
    (Activity::Running, "14_06b"),
    (Activity::Running, "16_35"),
];
/// What the training shapes are.
const SHAPE_NAMES: [&str; TRAINING_SHAPES.len()] = [
    "mean",
    "heavy",
    "lean",
    "tall, muscular",
    "short",
    "large chest",
    "small chest",
];
/// What the presets aim at where nothing is measured: hertz, and millimetres in running.
const AIMS: [[&str; 2]; 6] = [
    [
        "women: 5 small, 4 D cup, 3 large",
        "women: 40 small, 76 D cup, 100 large",
    ],
    ["8 lean, 3 soft", "5 lean, 30-60 soft"],
    ["4-7", "10-40"],
    ["13 women, 20 men", "5-15 women, 2-5 men"],
    ["20-40", "1-4"],
    ["12-25", "3-10"],
];
/// Part of a measured value within which ours should lie.
const TOLERANCE: f64 = 0.25;

/// Writes the report to `path`.
pub fn write(
    path: &Path,
    body: &BodyModel,
    settings: &SimSettings,
    motions: &[Motion],
    data: Option<&Path>,
) -> anyhow::Result<()> {
    let captures: Vec<(Activity, Motion)> = CAPTURES
        .into_iter()
        .filter_map(|(activity, name)| {
            let motion = motions.iter().find(|motion| motion.name() == name)?;
            Some((activity, motion.clone()))
        })
        .collect();
    let bar = clip_bar("measuring bodies");
    bar.set_length(TRAINING_SHAPES.len() as u64);
    let shapes = TRAINING_SHAPES
        .par_iter()
        .map(|shape| {
            let measured = Calibration::of_shape(body, settings, *shape, &captures);
            bar.inc(1);
            measured
        })
        .collect::<Result<Vec<_>, _>>()?;
    bar.finish_and_clear();

    let mut report = Report::new(format!("The {} body's simulator, calibrated", body.name));
    report.paragraph(&format!(
        "Soft tissue as {} layers of finite elements on bone, {} steps of 1/{} s a second. \
         Everything below is simulated anew by this command; measured values and their sources \
         stand beside it.",
        settings.layers,
        60 * settings.substeps,
        60 * settings.substeps,
    ));
    measured_section(&mut report, body, &shapes);
    ringing_section(&mut report, &shapes)?;
    amplitude_section(&mut report, &shapes);
    materials_section(&mut report, body, settings)?;
    tissue_section(&mut report, settings, &shapes);
    if let Some(folder) = data {
        data_section(&mut report, body, folder)?;
    }
    report.write(path)?;
    Ok(())
}

fn measured_section(report: &mut Report, body: &BodyModel, shapes: &[Calibration]) {
    report.section("Beside measured bodies");
    let mean = &shapes[0];
    let mut table = Table::new([
        "region",
        "quantity",
        "measured",
        "ours (mean shape)",
        "difference",
        "taken from",
        "source",
    ]);
    let mut missed = Vec::new();
    for measured in &MEASURED {
        if body.name == Sex::Male.name() && measured.region == Region::Chest {
            continue;
        }
        let Some((value, from)) = mean.value_of(measured) else {
            continue;
        };
        let difference = value / measured.value - 1.0;
        let cells = vec![
            measured.region.name().to_owned(),
            quantity_name(measured.quantity).to_owned(),
            shown(measured, measured.value),
            shown(measured, value),
            format!("{:+.0} %", 100.0 * difference),
            from,
            measured.source.to_owned(),
        ];
        if difference.abs() <= TOLERANCE {
            table.row(cells);
        } else {
            table.marked_row(cells);
            missed.push(measured);
        }
    }
    report.table(&table);
    report.paragraph(&format!(
        "The goal is {:.0} % of every measured value; rows beyond it stand out.",
        100.0 * TOLERANCE
    ));
    if body.name == Sex::Male.name() {
        report.paragraph(
            "The chest's measured values are of women's breasts; a man's chest is simulated as \
             muscle with its cover, for which the guide gives no measurement.",
        );
    }
    for measured in missed {
        let heavy = shapes[1].value_of(measured);
        let beside = heavy.map_or(String::new(), |(value, _)| {
            format!(" The heavy shape reaches {}.", shown(measured, value))
        });
        let reason = match measured.quantity {
            Quantity::HoppingVerticalM => {
                "what was measured is the gut, 9 kg behind the abdominal wall. We simulate the \
                 tissue on that wall and hold the wall to the skeleton, so a body of usual weight \
                 moves less."
            }
            _ => "the presets do not reach it on this shape.",
        };
        report.paragraph(&format!(
            "Why {} of the {} is missed: {reason}{beside}",
            quantity_name(measured.quantity),
            measured.region.name()
        ));
    }
}

fn quantity_name(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::FrequencyHz => "resonance",
        Quantity::DampingRatio => "damping ratio",
        Quantity::RunningVerticalM => "running, vertical",
        Quantity::RunningTotalM => "running, sum of three axes",
        Quantity::WalkingTotalM => "walking, sum of three axes",
        Quantity::HoppingVerticalM => "hopping, vertical",
    }
}

fn shown(measured: &Measured, value: f64) -> String {
    match measured.quantity {
        Quantity::FrequencyHz => format!("{value:.2} Hz"),
        Quantity::DampingRatio => format!("{value:.3}"),
        _ => format!("{:.0} mm", 1e3 * value),
    }
}

fn ringing_section(report: &mut Report, shapes: &[Calibration]) -> anyhow::Result<()> {
    report.section("Resonance and damping");
    report.paragraph(
        "Each region is pushed along the body at 0.1 m/s in the rest pose and left to ring; a \
         damped sine is fitted to its mean. Hertz, damping ratio in brackets.",
    );
    let mut table = Table::new([
        "shape", "chest", "belly", "buttocks", "thighs", "calves", "arms",
    ]);
    for (name, shape) in SHAPE_NAMES.iter().zip(shapes) {
        let mut cells = vec![(*name).to_owned()];
        cells.extend(shape.vibrations.iter().map(|vibration| {
            format!(
                "{:.1} ({:.2})",
                vibration.frequency_hz, vibration.damping_ratio
            )
        }));
        table.row(cells);
    }
    let mut aims = vec!["aim of the presets".to_owned()];
    aims.extend(AIMS.map(|[hertz, _]| hertz.to_owned()));
    table.row(aims);
    report.table(&table);
    for region in Region::ALL {
        let curves = [0, 1, 2]
            .map(|shape| {
                let vibration = &shapes[shape].vibrations[region as usize];
                let points = vibration.trace_m.iter().enumerate();
                Curve {
                    name: SHAPE_NAMES[shape].to_owned(),
                    points: points
                        .map(|(tick, metres)| (tick as f64 / 60.0, f64::from(*metres) * 1e3))
                        .take(60)
                        .collect(),
                }
            })
            .to_vec();
        report.plot(&Plot {
            title: format!("{} after a push of 0.1 m/s", region.name()),
            x_label: "time (s)".to_owned(),
            y_label: "mean vertical displacement (mm)".to_owned(),
            curves,
        })?;
    }
    Ok(())
}

fn amplitude_section(report: &mut Report, shapes: &[Calibration]) {
    report.section("Amplitudes");
    report.paragraph(
        "Peak to peak against the bones in millimetres: vertical, and the sum of three axes in \
         brackets, mean over the cycles of the motion. The chest is measured at its foremost \
         vertex, other regions at the 90th percentile of their vertices.",
    );
    let names: Vec<(Activity, String)> = shapes[0]
        .moved
        .iter()
        .map(|moved| (moved.activity, moved.motion.clone()))
        .collect();
    for (index, (activity, motion)) in names.iter().enumerate() {
        let captured = shapes[0].moved[index].captured;
        let kind = if captured {
            "capture"
        } else {
            "made by formula"
        };
        report.paragraph(&format!("{}: {motion} ({kind})", activity.name()));
        let mut table = Table::new([
            "shape", "chest", "belly", "buttocks", "thighs", "calves", "arms",
        ]);
        for (name, shape) in SHAPE_NAMES.iter().zip(shapes) {
            let mut cells = vec![(*name).to_owned()];
            cells.extend(shape.moved[index].regions.iter().map(|amplitude| {
                format!(
                    "{:.0} ({:.0})",
                    amplitude.peak_to_peak_m[1] * 1e3,
                    amplitude.total_m() * 1e3
                )
            }));
            table.row(cells);
        }
        if *activity == Activity::Running {
            let mut aims = vec!["aim of the presets, vertical".to_owned()];
            aims.extend(AIMS.map(|[_, millimetres]| millimetres.to_owned()));
            table.row(aims);
        }
        report.table(&table);
    }
}

fn materials_section(
    report: &mut Report,
    body: &BodyModel,
    settings: &SimSettings,
) -> anyhow::Result<()> {
    report.section("Material multipliers");
    report.paragraph(
        "Resonance of the mean shape's regions with every region's stiffness or damping \
         multiplied. A linear layer's frequency goes with the root of its stiffness.",
    );
    let cases = [
        ("usual", 1.0, 1.0),
        ("stiffness × 0.5", 0.5, 1.0),
        ("stiffness × 2", 2.0, 1.0),
        ("damping × 1.6", 1.0, 1.6),
    ];
    let rows: Vec<anyhow::Result<Vec<String>>> = cases
        .par_iter()
        .map(|(name, stiffness, damping)| {
            let varied = settings.with_materials(&Materials {
                stiffness: [*stiffness; 6],
                damping: [*damping; 6],
            });
            let shell = Shell::for_body(body, &TRAINING_SHAPES[0], &varied)?;
            let mut cells = vec![(*name).to_owned()];
            for region in Region::ALL {
                let vibration = free_vibration(body, &shell, &varied, region)?;
                cells.push(format!(
                    "{:.2} ({:.2})",
                    vibration.frequency_hz, vibration.damping_ratio
                ));
            }
            Ok(cells)
        })
        .collect();
    let mut table = Table::new([
        "materials",
        "chest",
        "belly",
        "buttocks",
        "thighs",
        "calves",
        "arms",
    ]);
    for row in rows {
        table.row(row?);
    }
    report.table(&table);
    Ok(())
}

fn tissue_section(report: &mut Report, settings: &SimSettings, shapes: &[Calibration]) {
    report.section("Tissue and limits");
    let mut table = Table::new([
        "shape",
        "vertices",
        "tetrahedra",
        "left out",
        "mass (kg)",
        "added for stability (kg)",
        "depth (mm)",
    ]);
    for (name, shape) in SHAPE_NAMES.iter().zip(shapes) {
        let shell = &shape.shell;
        table.row(vec![
            (*name).to_owned(),
            shell.vertices.to_string(),
            shell.tets.to_string(),
            shell.dropped_tets.to_string(),
            format!("{:.1}", shell.mass_kg),
            format!("{:.2}", shape.added_mass_kg),
            format!(
                "{:.0}-{:.0}",
                shell.depth_m[0] * 1e3,
                shell.depth_m[2] * 1e3
            ),
        ]);
    }
    report.table(&table);
    report.paragraph(&format!(
        "Accelerations of the skin saturate at {:.0} m/s²: captures hold flips that no body could \
         follow. Half of that passes with 1.5 % less.",
        settings.drive_limit_m_per_s2
    ));
}

fn data_section(report: &mut Report, body: &BodyModel, folder: &Path) -> anyhow::Result<()> {
    report.section("Data set");
    let bar = clip_bar("reading clips");
    let survey = Survey::of_folder(body, folder, |done, all| {
        bar.set_length(all as u64);
        bar.set_position(done as u64);
    })
    .context("no data set (--out)")?;
    bar.finish_and_clear();
    report.paragraph(&format!(
        "{} clips ({} of them with varied materials), {} frames at 60 Hz.",
        survey.clips, survey.varied_clips, survey.frames
    ));
    let mut table = Table::new(["region", "largest offset (mm)", "clip", "frame", "vertex"]);
    for (region, largest) in Region::ALL.iter().zip(&survey.largest) {
        table.row(vec![
            region.name().to_owned(),
            format!("{:.0}", largest.metres * 1e3),
            largest.clip.clone(),
            largest.frame.to_string(),
            largest.vertex.to_string(),
        ]);
    }
    report.table(&table);
    Ok(())
}
