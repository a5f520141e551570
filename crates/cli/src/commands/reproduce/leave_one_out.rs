//! Figure 7 of Casas & Otaduy: motions that were left out, beside plain skinning.

use anyhow::bail;
use dynaskin_evaluate::study::group_names;
use dynaskin_report::{Report, Table};

use super::{Stage, differences, spread};
use crate::commands::leave_one_out::{JUMPING_JACKS, ONE_LEG_HOPS, RUNS_IN_PLACE};

/// A motion of the paper: mean and deviation of its method and of SMPL, in centimetres.
struct Motion {
    name: &'static str,
    trials: &'static [&'static str],
    paper_cm: [[f64; 2]; 2],
    /// Over which vertices.
    paper_vertices: &'static str,
}

const MOTIONS: [Motion; 3] = [
    Motion {
        name: "one leg jump",
        trials: &ONE_LEG_HOPS,
        paper_cm: [[0.40, 0.06], [0.51, 0.12]],
        paper_vertices: "all vertices",
    },
    Motion {
        name: "running on the spot",
        trials: &RUNS_IN_PLACE,
        paper_cm: [[0.77, 0.24], [1.13, 0.52]],
        paper_vertices: "vertices not told",
    },
    Motion {
        name: "jumping jacks",
        trials: &JUMPING_JACKS,
        paper_cm: [[0.71, 0.26], [1.22, 0.68]],
        paper_vertices: "vertices not told",
    },
];
/// Groups of vertices that are shown: a, b and c of the figure.
const GROUPS: [&str; 3] = ["whole body", "chest", "belly"];

/// The page.
pub fn page(stage: &mut Stage) -> anyhow::Result<Report> {
    let mut report = Report::new("Figure 7 of Casas & Otaduy (2018): motions that were left out");
    report.paragraph(
        "The mean distance of vertices from the truth in clips that the model did not learn from, beside plain \
         skinning, which in the paper is SMPL. What was unseen of each clip, its motion, its person (shape) or both, \
         stands beside its name. The figure shows all vertices, and breasts and belly by \
         themselves, of one leg jumps; the text adds two motions.",
    );
    let mut table = Table::new([
        "motion",
        "vertices",
        "method",
        "error (cm)",
        "plain skinning (cm)",
        "ratio",
    ]);
    let mut plots = Vec::new();
    let clips = MOTIONS
        .iter()
        .filter_map(|motion| stage.held_out(motion.trials, None));
    let clips = clips.count();
    stage.begin(clips);
    for motion in &MOTIONS {
        let [method, smpl] = motion.paper_cm;
        table.row(cells(
            motion.name,
            motion.paper_vertices,
            "in the paper",
            [method, smpl],
        ));
        let Some(clip) = stage.held_out(motion.trials, None).cloned() else {
            continue;
        };
        let curves = stage.curves(&clip)?;
        let name = format!("{} ({})", curves.name, clip.set.name());
        for group in GROUPS {
            let Some(index) = group_names().iter().position(|name| *name == group) else {
                continue;
            };
            let still_mm = curves.of_group_mm(0, index);
            if still_mm.iter().any(|mm| !mm.is_finite()) {
                continue;
            }
            for (method, contestant) in stage.contestants.iter().enumerate().skip(1) {
                let errors_mm = curves.of_group_mm(method, index);
                let cm = [&errors_mm, &still_mm].map(|mm| spread(mm).map(|x| x / 10.0));
                table.row(cells(
                    &name,
                    group,
                    &format!("{} here", contestant.label),
                    cm,
                ));
            }
            plots.push(stage.plot(format!("{name}: {group}"), &curves, index));
        }
    }
    if plots.is_empty() {
        let trials: Vec<&str> = MOTIONS
            .iter()
            .flat_map(|motion| motion.trials)
            .copied()
            .collect();
        bail!(
            "{} has none of the motions {} among the clips that the model was not to learn from",
            stage.data_set.dir.display(),
            trials.join(", ")
        );
    }
    report.section("Beside the paper");
    report.table(&table);
    report.section("Frame by frame");
    for plot in &plots {
        report.plot(plot)?;
    }
    differences(
        &mut report,
        &[
            ["truth", "4D captures of 50004", "the clips named above"],
            [
                "plain skinning",
                "SMPL fitted to the captures; its errors of shape and pose count",
                "the same shape and poses as the truth where that is simulated",
            ],
            [
                "model",
                "one for each person and motion left out",
                "one for all people, without what the split holds out",
            ],
            [
                "inputs before",
                "the model's own latents at run time, true ones in training",
                "own latents at run time and, for some ticks, in training (--rollout)",
            ],
        ],
    );
    Ok(report)
}

fn cells(motion: &str, vertices: &str, method: &str, cm: [[f64; 2]; 2]) -> Vec<String> {
    let [errors, still] = cm;
    let told = |[mean, deviation]: [f64; 2]| format!("{mean:.3} ± {deviation:.3}");
    vec![
        motion.to_owned(),
        vertices.to_owned(),
        method.to_owned(),
        told(errors),
        told(still),
        format!("{:.2}", errors[0] / still[0]),
    ]
}
