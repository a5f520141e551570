//! The model card: what a model was trained on, how, and how well it does, for people.

use std::fmt::Write as _;

use dynaskin_runtime::Bundle;

use crate::bundle::LICENCE;
use crate::facts::TrainingFacts;
use crate::report::{Errors, Report};

/// What the mocap database asks for.
const MOCAP_ACKNOWLEDGEMENT: &str = "The data used in this project was obtained from \
    mocap.cs.cmu.edu. The database was created with funding from NSF EIA-0196217.";

/// The model card of a bundle as Markdown.
pub fn model_card(bundle: &Bundle, facts: &TrainingFacts, report: &Report) -> String {
    let name = &bundle.name;
    let method = facts.method.label();
    let mut card = format!("# Model card: {method} `{name}`\n\n");
    // Writing to a string cannot fail.
    let _ = write!(
        card,
        "Predicts the offsets of the soft tissue of the {name} body from the motion of its \
         skeleton, sixty times a second: `predictor.onnx` (one step a call) and `decoder.onnx`. Made by \
         `dynaskin train {}`. \
         The numbers below come from playing the exported files through the runtime's features and \
         networks, frame by frame from a state of zeros, without the avatar's delay of one tick; \
         `dynaskin evaluate` prints them again.\n\n",
        facts.method.name()
    );
    write_training(&mut card, facts);
    write_results(&mut card, report);
    write_limits(&mut card, facts, report);
    let licence = &bundle.licence;
    let more = match licence == LICENCE {
        true => format!(
            "The body is built from CC0 data of the MakeHuman community. {MOCAP_ACKNOWLEDGEMENT}"
        ),
        false => "Ask the owners before you pass any of it on.".to_owned(),
    };
    let _ = writeln!(card, "## Licence\n\n{licence}. {more}");
    card
}

fn write_training(card: &mut String, facts: &TrainingFacts) {
    let split = &facts.split;
    let named = |names: &[String]| match names.is_empty() {
        true => "none".to_owned(),
        false => names.join(", "),
    };
    let _ = write!(
        card,
        "## Trained on\n\n{data}\n\n\
         - {clips} clips, {frames} frames ({minutes:.0} minutes) to learn from; \
         {validation_frames} more decide which epoch is kept.\n\
         - Held out whole: capture subjects {subjects}; trials {trials}; body shapes {shapes}. \
         All parts, mirror images and tempos of a trial are on the same side.\n\
         - Offsets over {vertices} vertices. {networks} {parameters} weights; epoch {best} was \
         best; seed {seed}.\n\n",
        data = facts.data,
        clips = facts.clips,
        frames = facts.frames,
        minutes = facts.frames as f64 / 3600.0,
        validation_frames = facts.validation_frames,
        subjects = named(&split.test_subjects),
        trials = named(&split.test_trials),
        shapes = named(&split.test_shapes),
        vertices = facts.vertices,
        networks = facts.networks,
        parameters = facts.parameters,
        best = facts.best_epoch,
        seed = facts.seed,
    );
}

fn write_results(card: &mut String, report: &Report) {
    let _ = write!(
        card,
        "## Held-out results\n\nErrors {}.\n\n\
         | set | region | clips | frames | static (mm) | error (mm) | floor (mm) | error / static |\n\
         |---|---|--:|--:|--:|--:|--:|--:|\n",
        report.metric
    );
    for set in &report.sets {
        let name = set.set.name();
        let sizes = format!("{} | {}", set.clips, set.frames);
        write_row(card, &format!("**{name}**"), "all soft", &sizes, &set.soft);
        for (region, errors) in &set.regions {
            write_row(card, "", region, " | ", errors);
        }
    }
    if let Some(ratio) = report.unseen_motion_ratio() {
        let _ = write!(
            card,
            "\nOver all sets with motions not trained on: error / static **{ratio:.3}**.\n"
        );
    }
    let _ = write!(
        card,
        "\nAfter ten seconds of standing still in the rest pose, the largest offset is \
         {:.4} mm.\n\n",
        report.rest_after_ten_seconds_mm
    );
}

fn floor(errors: &Errors) -> String {
    let shown = errors.floor_mm.map(|floor_mm| format!("{floor_mm:.2}"));
    shown.unwrap_or_else(|| "-".into())
}

fn write_row(card: &mut String, set: &str, region: &str, sizes: &str, errors: &Errors) {
    let _ = writeln!(
        card,
        "| {set} | {region} | {sizes} | {:.2} | {:.2} | {} | {:.2} |",
        errors.static_mm,
        errors.error_mm,
        floor(errors),
        errors.ratio
    );
}

fn write_limits(card: &mut String, facts: &TrainingFacts, report: &Report) {
    let worst = report
        .sets
        .iter()
        .flat_map(|set| set.regions.iter().map(move |region| (set.set, region)))
        .max_by(|a, b| a.1.1.ratio.total_cmp(&b.1.1.ratio));
    let truth = match facts.is_simulated() {
        true => {
            "a simulation, not captures of people; its amplitudes are checked against measured ranges, \
             not its every shape"
        }
        false => "fitted captures: their noise and the errors of the fit are in it",
    };
    let _ = write!(
        card,
        "## Limits\n\n\
         - The ground truth is {truth}.\n\
         - It knows motion only: no contact with the ground, clothes or the body itself, no \
         muscle tension.\n\
         - Shapes outside the range of the training shapes are extrapolated; see the sets with \
         unseen shapes.\n"
    );
    if let Some((set, (region, errors))) = worst {
        let _ = writeln!(
            card,
            "- Least accurate: {region} in the set \"{}\", error / static {:.2} of {:.2} mm.",
            set.name(),
            errors.ratio,
            errors.static_mm
        );
    }
    let _ = write!(card, "- Trained in {:.0} minutes.\n\n", facts.minutes);
}
