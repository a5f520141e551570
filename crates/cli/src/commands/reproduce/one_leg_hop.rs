//! Figure 8 of DSNet: the error frame by frame in a hop on one leg.

use anyhow::Context as _;
use dynaskin_report::{Report, Table};

use super::{Stage, differences, spread};
use crate::commands::leave_one_out::ONE_LEG_HOPS;

/// The paper's least and largest value. It gives no unit.
const PAPER: [f64; 2] = [0.004, 0.023];

/// The page.
pub fn page(stage: &mut Stage, name: Option<&str>) -> anyhow::Result<Report> {
    let clip = stage.held_out(&ONE_LEG_HOPS, name).cloned();
    let clip = clip.with_context(|| match name {
        Some(name) => format!("{name} is not among the clips that the model was not to learn from"),
        None => format!(
            "{} has no clips of {} that the model was not to learn from; name another clip with --clip",
            stage.data_set.dir.display(),
            ONE_LEG_HOPS.join(" or ")
        ),
    })?;
    stage.begin(1);
    let curves = stage.curves(&clip)?;
    let mut report = Report::new("Figure 8 of DSNet (2021): error frame by frame");
    report.paragraph(&format!(
        "The mean distance of all vertices from the truth in {} ({}), a clip that the model did not learn from; \
         vertices without soft tissue count as errors of 0.",
        curves.name,
        clip.set.name()
    ));
    report.plot(&stage.plot(curves.name.clone(), &curves, 0))?;
    report.section("Beside the paper");
    report.paragraph(
        "The paper tells the range of its curve, without a unit and without plain skinning beside it, and that \
         the error is even along the sequence. So the ratios can be compared, the sizes cannot.",
    );
    let mut table = Table::new([
        "",
        "least",
        "largest",
        "largest over least",
        "mean ± deviation",
        "second half over first half",
        "over plain skinning",
    ]);
    table.row(vec![
        "DSNet in the paper".to_owned(),
        format!("{} (no unit)", PAPER[0]),
        format!("{} (no unit)", PAPER[1]),
        format!("{:.1}", PAPER[1] / PAPER[0]),
        "not told".to_owned(),
        "about 1".to_owned(),
        "not told".to_owned(),
    ]);
    let [static_mm, _] = spread(&curves.of_group_mm(0, 0));
    for (method, contestant) in stage.contestants.iter().enumerate() {
        let mm = curves.of_group_mm(method, 0);
        // Before the first movement there is nothing to be wrong about.
        let moving = || mm.iter().copied().filter(|x| *x > 0.0);
        let (least, largest) = (
            moving().fold(f64::INFINITY, f64::min),
            moving().fold(0.0, f64::max),
        );
        let [mean, deviation] = spread(&mm);
        let (first, second) = mm.split_at(mm.len() / 2);
        table.row(vec![
            match method {
                0 => "plain skinning here".to_owned(),
                _ => format!("{} here", contestant.label),
            },
            format!("{least:.3} mm"),
            format!("{largest:.3} mm"),
            format!("{:.1}", largest / least),
            format!("{mean:.3} ± {deviation:.3} mm"),
            format!("{:.2}", spread(second)[0] / spread(first)[0]),
            format!("{:.2}", mean / static_mm),
        ]);
    }
    report.table(&table);
    differences(
        &mut report,
        &[
            [
                "sequence",
                "one leg jump of 50004, a 4D capture at 60 Hz",
                "the clip named above, at 60 Hz",
            ],
            [
                "learned from",
                "the person's other motions, and one leg jumps of the four other women",
                "what the split did not hold out; what was unseen of the clip stands beside its name",
            ],
            [
                "error",
                "not defined; the losses are in latent space and offsets in centimetres",
                "mean distance of vertices in millimetres",
            ],
        ],
    );
    Ok(report)
}
